// The functions of an FMU's library that are called.
#pragma once

#include "bf/fmi/fmi2.h"
#include "bf/fmi/fmi3.h"
#include "bf/fmi/instance.hpp"

namespace bf::fmi {

#define BF_FMI2_FUNCTIONS(f)                                                                                 \
    f(fmi2Instantiate) f(fmi2FreeInstance) f(fmi2SetupExperiment) f(fmi2EnterInitializationMode)             \
        f(fmi2ExitInitializationMode) f(fmi2Terminate) f(fmi2Reset) f(fmi2GetReal) f(fmi2GetInteger)         \
            f(fmi2GetBoolean) f(fmi2SetReal) f(fmi2SetInteger) f(fmi2SetBoolean) f(fmi2GetFMUstate)          \
                f(fmi2SetFMUstate) f(fmi2FreeFMUstate) f(fmi2SerializedFMUstateSize)                         \
                    f(fmi2SerializeFMUstate) f(fmi2DeSerializeFMUstate)
#define BF_FMI3_FUNCTIONS(f)                                                                                 \
    f(fmi3FreeInstance) f(fmi3EnterInitializationMode) f(fmi3ExitInitializationMode) f(fmi3Terminate)        \
        f(fmi3Reset) f(fmi3GetFMUState) f(fmi3SetFMUState) f(fmi3FreeFMUState) f(fmi3SerializedFMUStateSize) \
            f(fmi3SerializeFMUState) f(fmi3DeserializeFMUState) f(fmi3GetFloat64) f(fmi3SetFloat64)          \
                f(fmi3GetFloat32) f(fmi3SetFloat32) f(fmi3GetInt8) f(fmi3SetInt8) f(fmi3GetUInt8)            \
                    f(fmi3SetUInt8) f(fmi3GetInt16) f(fmi3SetInt16) f(fmi3GetUInt16) f(fmi3SetUInt16)        \
                        f(fmi3GetInt32) f(fmi3SetInt32) f(fmi3GetUInt32) f(fmi3SetUInt32) f(fmi3GetInt64)    \
                            f(fmi3SetInt64) f(fmi3GetUInt64) f(fmi3SetUInt64) f(fmi3GetBoolean)              \
                                f(fmi3SetBoolean)
// Not every FMU has derivatives, structural parameters and clocks, and those without them may lack their
// functions.
#define BF_FMI2_DERIVATIVES(f) f(fmi2GetDirectionalDerivative)
#define BF_FMI3_DERIVATIVES(f) f(fmi3GetDirectionalDerivative)
#define BF_FMI3_CONFIGURATION(f) f(fmi3EnterConfigurationMode) f(fmi3ExitConfigurationMode)
#define BF_FMI3_CLOCKS(f) f(fmi3SetClock) f(fmi3GetIntervalDecimal) f(fmi3GetShiftDecimal)
#define BF_FMI2_CO_SIMULATION(f) f(fmi2DoStep)
#define BF_FMI3_CO_SIMULATION(f) f(fmi3InstantiateCoSimulation) f(fmi3DoStep)
#define BF_FMI2_MODEL_EXCHANGE(f)                                                                            \
    f(fmi2EnterEventMode) f(fmi2NewDiscreteStates) f(fmi2EnterContinuousTimeMode)                            \
        f(fmi2CompletedIntegratorStep) f(fmi2SetTime) f(fmi2SetContinuousStates) f(fmi2GetDerivatives)       \
            f(fmi2GetEventIndicators) f(fmi2GetContinuousStates)
#define BF_FMI3_EVENTS(f) f(fmi3EnterEventMode) f(fmi3UpdateDiscreteStates)
#define BF_FMI3_STEPS(f) f(fmi3EnterStepMode) // between events
#define BF_FMI3_MODEL_EXCHANGE(f)                                                                            \
    BF_FMI3_EVENTS(f)                                                                                        \
    f(fmi3InstantiateModelExchange) f(fmi3EnterContinuousTimeMode) f(fmi3CompletedIntegratorStep)            \
        f(fmi3SetTime) f(fmi3SetContinuousStates) f(fmi3GetContinuousStateDerivatives)                       \
            f(fmi3GetEventIndicators) f(fmi3GetContinuousStates) f(fmi3GetNumberOfContinuousStates)          \
                f(fmi3GetNumberOfEventIndicators)

struct Library::Functions {
#define BF_FMI_FUNCTION(name) decltype(&::name) name = nullptr;
    BF_FMI2_FUNCTIONS(BF_FMI_FUNCTION)
    BF_FMI3_FUNCTIONS(BF_FMI_FUNCTION)
    BF_FMI2_DERIVATIVES(BF_FMI_FUNCTION)
    BF_FMI3_DERIVATIVES(BF_FMI_FUNCTION)
    BF_FMI3_CONFIGURATION(BF_FMI_FUNCTION)
    BF_FMI3_CLOCKS(BF_FMI_FUNCTION)
    BF_FMI3_STEPS(BF_FMI_FUNCTION)
    BF_FMI2_CO_SIMULATION(BF_FMI_FUNCTION)
    BF_FMI3_CO_SIMULATION(BF_FMI_FUNCTION)
    BF_FMI2_MODEL_EXCHANGE(BF_FMI_FUNCTION)
    BF_FMI3_MODEL_EXCHANGE(BF_FMI_FUNCTION)
#undef BF_FMI_FUNCTION
};

} // namespace bf::fmi

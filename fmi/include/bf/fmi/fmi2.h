/* The functions and types by which an FMU of FMI 2.0 is called: what the standard of the Modelica Association
 * (https://fmi-standard.org) says of them, in C11 and C++. Exported FMUs carry a copy of this file. */
#pragma once

#include <stddef.h>

#ifndef BF_FMI_EXPORT
#ifdef _WIN32
#define BF_FMI_EXPORT __declspec(dllexport)
#else
#define BF_FMI_EXPORT __attribute__((visibility("default")))
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char* fmi2String;
typedef char fmi2Byte;

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String name, fmi2Status, fmi2String category,
                   fmi2String format, ...);
    void* (*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void*);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged,
        valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

BF_FMI_EXPORT const char* fmi2GetTypesPlatform(void);
BF_FMI_EXPORT const char* fmi2GetVersion(void);
BF_FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean on, size_t count,
                                             const fmi2String categories[]);
BF_FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type, fmi2String guid, fmi2String resources,
                                            const fmi2CallbackFunctions*, fmi2Boolean visible,
                                            fmi2Boolean logging);
BF_FMI_EXPORT void fmi2FreeInstance(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                             fmi2Real start, fmi2Boolean has_stop, fmi2Real stop);
BF_FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2Reset(fmi2Component);

#define BF_FMI2_VALUES(T)                                                                                    \
    BF_FMI_EXPORT fmi2Status fmi2Get##T(fmi2Component, const fmi2ValueReference[], size_t,                   \
                                        fmi2##T values[]);                                                   \
    BF_FMI_EXPORT fmi2Status fmi2Set##T(fmi2Component, const fmi2ValueReference[], size_t,                   \
                                        const fmi2##T values[]);
BF_FMI2_VALUES(Real)
BF_FMI2_VALUES(Integer)
BF_FMI2_VALUES(Boolean)
BF_FMI2_VALUES(String)
#undef BF_FMI2_VALUES

BF_FMI_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate*);
BF_FMI_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
BF_FMI_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate*);
BF_FMI_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t*);
BF_FMI_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, fmi2Byte bytes[], size_t);
BF_FMI_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const fmi2Byte bytes[], size_t,
                                                 fmi2FMUstate*);
BF_FMI_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference unknowns[],
                                                      size_t, const fmi2ValueReference knowns[], size_t,
                                                      const fmi2Real seed[], fmi2Real sensitivity[]);

/* Model exchange. */
BF_FMI_EXPORT fmi2Status fmi2EnterEventMode(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component, fmi2EventInfo*);
BF_FMI_EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component, fmi2Boolean forgets_past,
                                                     fmi2Boolean* enter_event_mode, fmi2Boolean* terminate);
BF_FMI_EXPORT fmi2Status fmi2SetTime(fmi2Component, fmi2Real);
BF_FMI_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component, const fmi2Real[], size_t);
BF_FMI_EXPORT fmi2Status fmi2GetDerivatives(fmi2Component, fmi2Real[], size_t);
BF_FMI_EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component, fmi2Real[], size_t);
BF_FMI_EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component, fmi2Real[], size_t);
BF_FMI_EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component, fmi2Real[], size_t);

/* Co-simulation. */
BF_FMI_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component, const fmi2ValueReference[], size_t,
                                                     const fmi2Integer orders[], const fmi2Real values[]);
BF_FMI_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component, const fmi2ValueReference[], size_t,
                                                      const fmi2Integer orders[], fmi2Real values[]);
BF_FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component, fmi2Real time, fmi2Real step, fmi2Boolean forgets_past);
BF_FMI_EXPORT fmi2Status fmi2CancelStep(fmi2Component);
BF_FMI_EXPORT fmi2Status fmi2GetStatus(fmi2Component, const fmi2StatusKind, fmi2Status*);
BF_FMI_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component, const fmi2StatusKind, fmi2Real*);
BF_FMI_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component, const fmi2StatusKind, fmi2Integer*);
BF_FMI_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component, const fmi2StatusKind, fmi2Boolean*);
BF_FMI_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component, const fmi2StatusKind, fmi2String*);

#ifdef __cplusplus
}
#endif

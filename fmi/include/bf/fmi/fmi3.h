/* The functions and types by which an FMU of FMI 3.0 is called: what the standard of the Modelica Association
 * (https://fmi-standard.org/docs/3.0/) says of them, in C11 and C++. Exported FMUs carry a copy of this file.
 */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32
#define BF_FMI_EXPORT __declspec(dllexport)
#else
#define BF_FMI_EXPORT __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char* fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte* fmi3Binary;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category,
                                       fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 time,
                                               fmi3Boolean set_requested, fmi3Boolean get_allowed,
                                               fmi3Boolean step_finished, fmi3Boolean can_return_early,
                                               fmi3Boolean* return_requested, fmi3Float64* return_time);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

BF_FMI_EXPORT const char* fmi3GetVersion(void);
BF_FMI_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean on, size_t count,
                                             const fmi3String categories[]);
BF_FMI_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token,
                                                        fmi3String resources, fmi3Boolean visible,
                                                        fmi3Boolean logging, fmi3InstanceEnvironment,
                                                        fmi3LogMessageCallback);
BF_FMI_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean uses_event_mode, fmi3Boolean allows_early_return, const fmi3ValueReference intermediate[],
    size_t count, fmi3InstanceEnvironment, fmi3LogMessageCallback, fmi3IntermediateUpdateCallback);
BF_FMI_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token,
                                                             fmi3String resources, fmi3Boolean visible,
                                                             fmi3Boolean logging, fmi3InstanceEnvironment,
                                                             fmi3LogMessageCallback, fmi3ClockUpdateCallback,
                                                             fmi3LockPreemptionCallback,
                                                             fmi3UnlockPreemptionCallback);
BF_FMI_EXPORT void fmi3FreeInstance(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance, fmi3Boolean has_tolerance,
                                                     fmi3Float64 tolerance, fmi3Float64 start,
                                                     fmi3Boolean has_stop, fmi3Float64 stop);
BF_FMI_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3Terminate(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3Reset(fmi3Instance);

/* Values of variables, those of arrays one behind the other, row by row. */
#define BF_FMI3_VALUES(T)                                                                                    \
    BF_FMI_EXPORT fmi3Status fmi3Get##T(fmi3Instance, const fmi3ValueReference[], size_t, fmi3##T values[],  \
                                        size_t);                                                             \
    BF_FMI_EXPORT fmi3Status fmi3Set##T(fmi3Instance, const fmi3ValueReference[], size_t,                    \
                                        const fmi3##T values[], size_t);
BF_FMI3_VALUES(Float32)
BF_FMI3_VALUES(Float64)
BF_FMI3_VALUES(Int8)
BF_FMI3_VALUES(UInt8)
BF_FMI3_VALUES(Int16)
BF_FMI3_VALUES(UInt16)
BF_FMI3_VALUES(Int32)
BF_FMI3_VALUES(UInt32)
BF_FMI3_VALUES(Int64)
BF_FMI3_VALUES(UInt64)
BF_FMI3_VALUES(Boolean)
BF_FMI3_VALUES(String)
#undef BF_FMI3_VALUES
BF_FMI_EXPORT fmi3Status fmi3GetBinary(fmi3Instance, const fmi3ValueReference[], size_t, size_t sizes[],
                                       fmi3Binary values[], size_t);
BF_FMI_EXPORT fmi3Status fmi3SetBinary(fmi3Instance, const fmi3ValueReference[], size_t, const size_t sizes[],
                                       const fmi3Binary values[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetClock(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Clock values[]);
BF_FMI_EXPORT fmi3Status fmi3SetClock(fmi3Instance, const fmi3ValueReference[], size_t,
                                      const fmi3Clock values[]);

BF_FMI_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance, fmi3ValueReference, size_t* count);
BF_FMI_EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance, fmi3ValueReference, size_t elements[],
                                                     fmi3ValueReference independents[],
                                                     size_t their_elements[], fmi3DependencyKind kinds[],
                                                     size_t);

BF_FMI_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance, fmi3FMUState*);
BF_FMI_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance, fmi3FMUState);
BF_FMI_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState*);
BF_FMI_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance, fmi3FMUState, size_t*);
BF_FMI_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance, fmi3FMUState, fmi3Byte bytes[], size_t);
BF_FMI_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance, const fmi3Byte bytes[], size_t, fmi3FMUState*);

BF_FMI_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance, const fmi3ValueReference unknowns[],
                                                      size_t, const fmi3ValueReference knowns[], size_t,
                                                      const fmi3Float64 seed[], size_t,
                                                      fmi3Float64 sensitivity[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t,
                                                  const fmi3ValueReference knowns[], size_t,
                                                  const fmi3Float64 seed[], size_t, fmi3Float64 sensitivity[],
                                                  size_t);

BF_FMI_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance);

/* Clocks. */
BF_FMI_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t,
                                                fmi3Float64[], fmi3IntervalQualifier[]);
BF_FMI_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t,
                                                 fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                                 fmi3IntervalQualifier[]);
BF_FMI_EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[]);
BF_FMI_EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t,
                                              fmi3UInt64 counters[], fmi3UInt64 resolutions[]);
BF_FMI_EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t,
                                                const fmi3Float64[]);
BF_FMI_EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t,
                                                 const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
BF_FMI_EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t,
                                             const fmi3Float64[]);
BF_FMI_EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t,
                                              const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
BF_FMI_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, fmi3Boolean* again, fmi3Boolean* terminate,
                                                  fmi3Boolean* nominals_changed, fmi3Boolean* states_changed,
                                                  fmi3Boolean* has_next_event, fmi3Float64* next_event);

/* Model exchange. */
BF_FMI_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance, fmi3Boolean forgets_past,
                                                     fmi3Boolean* enter_event_mode, fmi3Boolean* terminate);
BF_FMI_EXPORT fmi3Status fmi3SetTime(fmi3Instance, fmi3Float64);
BF_FMI_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance, const fmi3Float64[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance, fmi3Float64[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance, fmi3Float64[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance, fmi3Float64[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance, fmi3Float64[], size_t);
BF_FMI_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance, size_t*);
BF_FMI_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance, size_t*);

/* Co-simulation and scheduled execution. */
BF_FMI_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance);
BF_FMI_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance, const fmi3ValueReference[], size_t,
                                                  const fmi3Int32 orders[], fmi3Float64 values[], size_t);
BF_FMI_EXPORT fmi3Status fmi3DoStep(fmi3Instance, fmi3Float64 time, fmi3Float64 step,
                                    fmi3Boolean forgets_past, fmi3Boolean* event_needed,
                                    fmi3Boolean* terminate, fmi3Boolean* returned_early,
                                    fmi3Float64* reached);
BF_FMI_EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance, fmi3ValueReference clock, fmi3Float64 time);

#ifdef __cplusplus
}
#endif

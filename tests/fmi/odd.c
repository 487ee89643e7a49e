/* An FMU of FMI 3.0 for co-simulation, written by hand: y counts its steps, v is a 2 x 3 matrix of the same, in rows. What is
 * defined makes it misbehave. */
#include "bf/fmi/fmi3.h"

#include <fenv.h>
#include <stdlib.h>

#ifndef FAILS_AT
#define FAILS_AT -1
#endif

typedef struct {
    int steps, is_configuring, is_configured, is_read;
    size_t n; /* rows of v */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Odd;

#ifdef EXITS_FIRST
__attribute__((constructor)) static void begin(void) { exit(0); }
#endif

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference* between, size_t count, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
#ifdef CRASHES_FIRST
    *(volatile int*)NULL = 1;
#endif
#ifdef NO_INSTANCE
    log(environment, fmi3Error, "logStatusError", "there is none");
    return NULL;
#endif
    Odd* odd = calloc(1, sizeof *odd);
    odd->n = 2;
    odd->environment = environment;
    odd->log = log;
    return odd;
}
void fmi3FreeInstance(fmi3Instance instance) {
#ifdef HANGS_LAST
    for (volatile int waits = 1; waits;) {
    }
#endif
    free(instance);
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean a, fmi3Float64 b, fmi3Float64 c, fmi3Boolean d,
                                       fmi3Float64 e) {
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance i) {
    Odd* odd = i;
#ifdef FORGETS_TO_BEGIN_ANEW
    ++odd->steps;
#else
    odd->steps = 1;
#endif
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance i) {
    ((Odd*)i)->n = 2;
    return fmi3OK;
}

#ifndef WITHOUT_CONFIGURATION
fmi3Status fmi3EnterConfigurationMode(fmi3Instance i) {
    ((Odd*)i)->is_configuring = 1;
    return fmi3OK;
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance i) {
    Odd* odd = i;
    odd->is_configuring = 0;
    odd->is_configured = 1;
    return fmi3OK;
}
#endif
fmi3Status fmi3SetUInt64(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3UInt64* values, size_t size) {
    Odd* odd = i;
    if (!odd->is_configuring || n != 1 || r[0] != 1 || size != 1 || values[0] > 5) return fmi3Error;
    odd->n = values[0];
    return fmi3OK;
}

#ifndef WITHOUT_STEP
fmi3Status fmi3DoStep(fmi3Instance i, fmi3Float64 time, fmi3Float64 step, fmi3Boolean forgets, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* reached) {
    Odd* odd = i;
    odd->is_read = 0;
#ifdef CRASHES
    *(volatile int*)NULL = 1;
#endif
#ifdef EXITS
    exit(0);
#endif
#ifdef EXITS_QUICKLY
    quick_exit(0);
#endif
#ifdef ENDS
    _Exit(0);
#endif
#ifdef ROUNDS_DOWN
    fesetround(FE_DOWNWARD);
#endif
#ifdef ABORTS_AT
    if (odd->steps == ABORTS_AT) free((void*)((char*)odd + 8)); /* nothing that malloc gave */
#endif
#ifdef HANGS
    for (volatile int waits = 1; waits;) {
    }
#endif
    if (odd->steps++ == FAILS_AT) {
        odd->log(odd->environment, fmi3Error, "logStatusError", "thrown on purpose");
        return fmi3Error;
    }
#ifdef TERMINATES
    *terminate = true;
#endif
#ifdef RETURNS_EARLY
    *early = true;
#endif
    *reached = time + step;
    return fmi3OK;
}
#endif

fmi3Status fmi3GetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float64* values, size_t size) {
    Odd* odd = i;
    odd->is_read = 1;
    for (size_t k = 0; k < size; ++k) values[k] = odd->steps;
    return fmi3OK;
}
fmi3Status fmi3GetFloat32(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float32* values, size_t size) {
    for (size_t k = 0; k < size; ++k) values[k] = (float)k;
    return ((Odd*)i)->is_configured && size != ((Odd*)i)->n * 3 ? fmi3Error : fmi3OK;
}
fmi3Status fmi3GetInt64(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Int64* values, size_t size) {
    for (size_t k = 0; k < size; ++k) values[k] = 2;
    return fmi3OK;
}
fmi3Status fmi3GetUInt64(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3UInt64* values, size_t size) {
    for (size_t k = 0; k < size; ++k) values[k] = 2;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3Float64* values, size_t size) {
#ifdef COMPUTES_ONCE
    if (((Odd*)i)->is_read) return fmi3Error; /* of this step */
#endif
    return fmi3OK;
}

#define NONE(name, ...)                                                                                                \
    fmi3Status name(fmi3Instance i, const fmi3ValueReference* r, size_t n, __VA_ARGS__ values, size_t size) {          \
        return fmi3Error;                                                                                              \
    }
NONE(fmi3SetFloat32, const fmi3Float32*)
NONE(fmi3GetInt8, fmi3Int8*)
NONE(fmi3SetInt8, const fmi3Int8*)
NONE(fmi3GetUInt8, fmi3UInt8*)
NONE(fmi3SetUInt8, const fmi3UInt8*)
NONE(fmi3GetInt16, fmi3Int16*)
NONE(fmi3SetInt16, const fmi3Int16*)
NONE(fmi3GetUInt16, fmi3UInt16*)
NONE(fmi3SetUInt16, const fmi3UInt16*)
NONE(fmi3GetInt32, fmi3Int32*)
NONE(fmi3SetInt32, const fmi3Int32*)
NONE(fmi3GetUInt32, fmi3UInt32*)
NONE(fmi3SetUInt32, const fmi3UInt32*)
NONE(fmi3SetInt64, const fmi3Int64*)
NONE(fmi3GetBoolean, fmi3Boolean*)
NONE(fmi3SetBoolean, const fmi3Boolean*)
#ifdef STATE_SIZE /* which it says, of a state that is never to be written */
fmi3Status fmi3GetFMUState(fmi3Instance i, fmi3FMUState* s) {
    *s = i;
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance i, fmi3FMUState* s) { return fmi3OK; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance i, fmi3FMUState s, size_t* n) {
    *n = (size_t)STATE_SIZE;
    return fmi3OK;
}
#else
fmi3Status fmi3GetFMUState(fmi3Instance i, fmi3FMUState* s) { return fmi3Error; }
fmi3Status fmi3FreeFMUState(fmi3Instance i, fmi3FMUState* s) { return fmi3Error; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance i, fmi3FMUState s, size_t* n) { return fmi3Error; }
#endif
fmi3Status fmi3SetFMUState(fmi3Instance i, fmi3FMUState s) { return fmi3Error; }
fmi3Status fmi3SerializeFMUState(fmi3Instance i, fmi3FMUState s, fmi3Byte* b, size_t n) { return fmi3Error; }
fmi3Status fmi3DeserializeFMUState(fmi3Instance i, const fmi3Byte* b, size_t n, fmi3FMUState* s) { return fmi3Error; }

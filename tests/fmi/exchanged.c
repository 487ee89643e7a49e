/* An FMU of FMI 3.0 for model exchange, written by hand: x' = u - x from 1, y = x, and x := 5 at 0.353 s, which is no step of
 * anybody. It counts its events: that one, one that it asks for after a step from 1 s on, one for each change of its
 * discrete input, and those where x passes 2, also in its jump. What is defined makes it misbehave. */
#include "bf/fmi/fmi3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef STATES
#define STATES 1
#endif
#ifndef RATE
#define RATE odd->k*(odd->u - odd->x)
#endif

enum { initial, events, continuous };
typedef struct {
    double time, x, u, k;
    int mode, count, before, on, asked, jumped, wrong;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Odd;

/* Functions that are called in a wrong mode fail, as those of a strict tool do. */
#define IN(a, b)                                                                                                       \
    Odd* odd = i;                                                                                                      \
    if (odd->mode != a && odd->mode != b) {                                                                            \
        odd->log(odd->environment, fmi3Error, "logStatusError", "called in a wrong mode");                             \
        return fmi3Error;                                                                                              \
    }

const char* fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    Odd* odd = calloc(1, sizeof *odd);
    odd->x = odd->k = 1;
    odd->environment = environment;
    odd->log = log;
    return odd;
}
void fmi3FreeInstance(fmi3Instance i) { free(i); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean a, fmi3Float64 b, fmi3Float64 c, fmi3Boolean d,
                                       fmi3Float64 e) {
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance i) {
    ((Odd*)i)->mode = events;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance i) { return fmi3OK; }

fmi3Status fmi3EnterEventMode(fmi3Instance i) {
    IN(continuous, continuous)
    odd->mode = events;
    ++odd->count;
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance i, fmi3Boolean* again, fmi3Boolean* terminate, fmi3Boolean* nominals,
                                    fmi3Boolean* jumped, fmi3Boolean* has_next, fmi3Float64* next) {
    IN(events, events)
    *again = *terminate = *nominals = *jumped = false;
#ifdef ENDLESS
    *again = true;
#endif
#ifdef TERMINATES
    *terminate = odd->time > 0.3;
#endif
    if (odd->time >= 0.353 && !odd->jumped) {
        odd->jumped = 1;
        odd->x = 5;
        *jumped = true;
    }
#ifdef JUMPS_FIRST
    odd->x = 7;
    *jumped = true;
#endif
    *has_next = !odd->jumped;
    *next = 0.353;
#ifdef NEXT
    *next = NEXT;
#endif
    return fmi3OK;
}
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) {
    IN(events, events)
    odd->mode = continuous;
    return fmi3OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance i, fmi3Boolean forgets, fmi3Boolean* event, fmi3Boolean* terminate) {
    IN(continuous, continuous)
    *terminate = false;
    *event = odd->time >= 0.9999 && !odd->asked;
    odd->asked |= *event;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance i, fmi3Float64 time) {
    IN(continuous, continuous)
    odd->time = time;
    return fmi3OK;
}
fmi3Status fmi3SetContinuousStates(fmi3Instance i, const fmi3Float64* x, size_t n) {
    IN(continuous, continuous)
    odd->x = *x;
    return n == 1 ? fmi3OK : fmi3Error;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance i, fmi3Float64* x, size_t n) {
    *x = ((Odd*)i)->x;
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance i, fmi3Float64* rates, size_t n) {
    Odd* odd = i;
    *rates = RATE;
#ifdef WRITES_MORE
    rates[1] = 0;
#endif
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance i, fmi3Float64* z, size_t n) {
    *z = ((Odd*)i)->x - 2;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance i, size_t* n) {
    *n = STATES;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance i, size_t* n) {
    *n = 1;
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float64* values, size_t size) {
    for (size_t k = 0; k < n; ++k) values[k] = r[k] == 5 ? ((Odd*)i)->count : ((Odd*)i)->x;
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3Float64* values, size_t size) {
    Odd* odd = i;
    for (size_t k = 0; k < n; ++k) {
        if (r[k] == 8 && odd->mode != initial) return fmi3Error; /* it is fixed */
        if (r[k] == 9 && odd->mode == continuous) return fmi3Error;
        *(r[k] == 9 ? &odd->k : r[k] == 1 ? &odd->u : &(double){0}) = values[k];
    }
    return fmi3OK;
}
fmi3Status fmi3GetBoolean(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Boolean* values, size_t size) {
    *values = ((Odd*)i)->on;
    return fmi3OK;
}
fmi3Status fmi3SetBoolean(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3Boolean* values, size_t size) {
    IN(events, initial)
    odd->on = *values;
    return fmi3OK;
}

#ifdef DERIVATIVES /* of f = k*(u - x) and y = x, times what is defined, so that it is seen who computed them */
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance i, const fmi3ValueReference* unknowns, size_t n,
                                        const fmi3ValueReference* knowns, size_t m, const fmi3Float64* seed, size_t s,
                                        fmi3Float64* change, size_t c) {
    IN(events, continuous)
    double u = 0, x = 0;
    for (size_t k = 0; k < m; ++k)
        if (knowns[k] == 1)
            u = seed[k];
        else if (knowns[k] == 3)
            x = seed[k];
        else
            return fmi3Error;
    for (size_t k = 0; k < n; ++k)
        if (unknowns[k] == 4)
            change[k] = DERIVATIVES * odd->k * (u - x);
        else if (unknowns[k] == 6)
            change[k] = DERIVATIVES * x;
        else
            return fmi3Error;
    return fmi3OK;
}
#endif

#define NONE(name, ...)                                                                                                \
    fmi3Status name(fmi3Instance i, const fmi3ValueReference* r, size_t n, __VA_ARGS__ values, size_t size) {          \
        return fmi3Error;                                                                                              \
    }
NONE(fmi3GetFloat32, fmi3Float32*)
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
NONE(fmi3GetInt64, fmi3Int64*)
NONE(fmi3SetInt64, const fmi3Int64*)
NONE(fmi3GetUInt64, fmi3UInt64*)
NONE(fmi3SetUInt64, const fmi3UInt64*)
#ifdef DERIVATIVES /* such an FMU has states, too */
static void copy(void* to, const void* from) {
    const Odd before = *(Odd*)to;
    memcpy(to, from, sizeof(Odd));
    ((Odd*)to)->environment = before.environment;
    ((Odd*)to)->log = before.log;
}
fmi3Status fmi3GetFMUState(fmi3Instance i, fmi3FMUState* s) {
    if (!*s) *s = calloc(1, sizeof(Odd));
    copy(*s, i);
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance i, fmi3FMUState s) {
    copy(i, s);
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance i, fmi3FMUState* s) {
    free(*s);
    *s = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance i, fmi3FMUState s, size_t* n) {
    *n = sizeof(Odd);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance i, fmi3FMUState s, fmi3Byte* b, size_t n) {
    memcpy(b, s, n);
    return fmi3OK;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance i, const fmi3Byte* b, size_t n, fmi3FMUState* s) {
    if (!*s) *s = calloc(1, sizeof(Odd));
    memcpy(*s, b, n);
    return fmi3OK;
}
#else
fmi3Status fmi3GetFMUState(fmi3Instance i, fmi3FMUState* s) { return fmi3Error; }
fmi3Status fmi3SetFMUState(fmi3Instance i, fmi3FMUState s) { return fmi3Error; }
fmi3Status fmi3FreeFMUState(fmi3Instance i, fmi3FMUState* s) { return fmi3Error; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance i, fmi3FMUState s, size_t* n) { return fmi3Error; }
fmi3Status fmi3SerializeFMUState(fmi3Instance i, fmi3FMUState s, fmi3Byte* b, size_t n) { return fmi3Error; }
fmi3Status fmi3DeserializeFMUState(fmi3Instance i, const fmi3Byte* b, size_t n, fmi3FMUState* s) { return fmi3Error; }
#endif

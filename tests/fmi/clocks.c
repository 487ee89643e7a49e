/* An FMU of FMI 3.0 with two clocks, written by hand: in the ticks of `third`, whose interval it says itself, `total` adds up
 * `push`; `count` counts those of `tenth`. Whoever ticks at a wrong time, or reads without a tick, gets an error. */
#include "bf/fmi/fmi3.h"

#include <math.h>
#include <stdlib.h>

#ifndef INTERVAL
#define INTERVAL 0.03
#endif

typedef struct {
    double time, push, total, count;
    int third, tenth;   /* active */
    int thirds, tenths; /* ticks so far */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Ticked;

static fmi3Status wrong(Ticked* its, const char* why) {
    if (its->log) its->log(its->environment, fmi3Error, "logStatusError", why);
    return fmi3Error;
}

const char* fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference* between, size_t count, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    if (!events) return NULL;
    Ticked* its = calloc(1, sizeof *its);
    its->environment = environment;
    its->log = log;
    return its;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    return fmi3InstantiateCoSimulation(name, token, resources, visible, logging, true, false, NULL, 0, environment, log, NULL);
}
void fmi3FreeInstance(fmi3Instance i) { free(i); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance i, fmi3Boolean a, fmi3Float64 b, fmi3Float64 start, fmi3Boolean d,
                                       fmi3Float64 e) {
    ((Ticked*)i)->time = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3EnterEventMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3EnterStepMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance i) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance i) {
    Ticked* its = i;
    its->total = its->count = 0;
    its->thirds = its->tenths = its->third = its->tenth = 0;
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float64* intervals,
                                  fmi3IntervalQualifier* qualifiers) {
    if (n != 1 || r[0] != 3) return wrong(i, "the interval of another clock is in the description");
    intervals[0] = INTERVAL;
    qualifiers[0] = fmi3IntervalChanged;
    return fmi3OK;
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float64* shifts) {
    shifts[0] = 0.02;
    return fmi3OK;
}
fmi3Status fmi3SetClock(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3Clock* active) {
    Ticked* its = i;
    for (size_t k = 0; k < n; ++k) {
        const double due = r[k] == 3 ? 0.02 + its->thirds * INTERVAL : its->tenths * 0.1;
        if (fabs(its->time - due) > 1e-9 || !active[k]) return wrong(its, "a clock is ticked at a wrong time");
        if (r[k] == 3) its->third = 1;
        if (r[k] == 4) its->tenth = 1;
    }
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance i, fmi3Boolean* again, fmi3Boolean* ends, fmi3Boolean* nominals,
                                    fmi3Boolean* jumped, fmi3Boolean* has_next, fmi3Float64* next) {
    Ticked* its = i;
    *again = *ends = *nominals = *jumped = *has_next = false;
    if (its->third) its->total += its->push, ++its->thirds;
    if (its->tenth) its->count += 1, ++its->tenths;
    its->third = its->tenth = 0;
    return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance i, fmi3Float64 time, fmi3Float64 step, fmi3Boolean forgets, fmi3Boolean* event,
                      fmi3Boolean* ends, fmi3Boolean* early, fmi3Float64* reached) {
    *event = *ends = *early = false;
    ((Ticked*)i)->time = *reached = time + step;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance i, fmi3Float64 time) {
    ((Ticked*)i)->time = time;
    return fmi3OK;
}
/* What would be after the update, while the clock is active. */
fmi3Status fmi3GetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, fmi3Float64* values, size_t size) {
    Ticked* its = i;
    for (size_t k = 0; k < n; ++k) {
        if (r[k] == 2 ? !its->third : r[k] == 5 ? !its->tenth : r[k] != 0)
            return wrong(its, "a value is read whose clock is not active");
        values[k] = r[k] == 2 ? its->total + its->push : r[k] == 5 ? its->count + 1 : its->time;
    }
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance i, const fmi3ValueReference* r, size_t n, const fmi3Float64* values, size_t size) {
    Ticked* its = i;
    if (n != 1 || r[0] != 1 || !its->third) return wrong(its, "an input is written whose clock is not active");
    its->push = values[0];
    return fmi3OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance i, fmi3Boolean a, fmi3Boolean* event, fmi3Boolean* ends) {
    *event = *ends = false;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance i, size_t* n) { return *n = 0, fmi3OK; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance i, size_t* n) { return *n = 0, fmi3OK; }

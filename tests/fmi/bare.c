/* Two instances of an FMU of FMI 3.0 for co-simulation, step by step in turns: what a program does that knows nothing
 * but the standard. Usage: bare FOLDER IDENTIFIER TOKEN STEP STEPS VARIABLE...
 *
 * A VARIABLE is in:REFERENCE:SIZE or out:REFERENCE:SIZE, of double. Prints, for each step and instance, the numbers of
 * all of them as they were after the inputs were written. Half way it saves the first instance, goes on to the end,
 * goes back and does it again, of which both must give the same. */
#include "bf/fmi/fmi3.h"

#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { most = 4000 };
static void* library;
static double rows[2][most];

static void* function(const char* name) {
    void* found = dlsym(library, name);
    if (!found) fprintf(stderr, "there is no %s\n", name), exit(1);
    return found;
}
#define CALL(name) ((__typeof__(&name))function(#name))
static void check(fmi3Status status, const char* what) {
    if (status != fmi3OK) fprintf(stderr, "failed: %s\n", what), exit(1);
}
#define CHECK(call) check(call, #call)

static void say(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text) {
    (void)environment, (void)category;
    fprintf(stderr, "%d: %s\n", (int)status, text);
}

/* Writes inputs, reads everything, does a step. */
static void step(fmi3Instance instance, int which, int k, double length, int count, char** variables, double* row) {
    int at = 0;
    bool flags[3];
    double reached;
    for (int i = 0; i < count; ++i) {
        unsigned reference, size;
        const bool is_input = sscanf(variables[i], "in:%u:%u", &reference, &size) == 2;
        if (!is_input && sscanf(variables[i], "out:%u:%u", &reference, &size) != 2) exit(2);
        for (unsigned e = 0; is_input && e < size; ++e)
            row[at + e] = 0.1 * sin(0.7 * e + 3 * which + 0.05 * k * (i + 1));
        if (is_input)
            CHECK(CALL(fmi3SetFloat64)(instance, &reference, 1, row + at, size));
        else
            CHECK(CALL(fmi3GetFloat64)(instance, &reference, 1, row + at, size));
        at += (int)size;
    }
    CHECK(CALL(fmi3DoStep)(instance, k * length, length, true, &flags[0], &flags[1], &flags[2], &reached));
    row[at] = NAN;
}

int main(int argc, char** argv) {
    if (argc < 7) return 2;
    char file[1000], resources[1000];
    snprintf(file, sizeof file, "%s/binaries/x86_64-linux/%s.so", argv[1], argv[2]);
    snprintf(resources, sizeof resources, "%s/resources/", argv[1]);
    library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    const double length = atof(argv[4]);
    const int steps = atoi(argv[5]), half = steps / 2;
    fmi3Instance instances[2];
    for (int i = 0; i < 2; ++i) {
        instances[i] = CALL(fmi3InstantiateCoSimulation)("bare", argv[3], resources, false, true, false, false, NULL,
                                                         0, NULL, say, NULL);
        if (!instances[i]) return 1;
        CHECK(CALL(fmi3EnterInitializationMode)(instances[i], false, 0, 0, false, 0));
        CHECK(CALL(fmi3ExitInitializationMode)(instances[i]));
    }
    fmi3FMUState state = NULL;
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1) CHECK(CALL(fmi3SetFMUState)(instances[0], state));
        for (int k = pass * half; k < steps; ++k)
            for (int i = 0; i < 2 - pass; ++i) {
                if (pass == 0 && i == 0 && k == half) CHECK(CALL(fmi3GetFMUState)(instances[0], &state));
                step(instances[i], i, k, length, argc - 6, argv + 6, rows[i]);
                printf("%d %d %d", pass, i, k);
                for (int e = 0; !isnan(rows[i][e]); ++e) printf(" %a", rows[i][e]);
                printf("\n");
            }
    }
    CHECK(CALL(fmi3FreeFMUState)(instances[0], &state));
    for (int i = 0; i < 2; ++i) CALL(fmi3FreeInstance)(instances[i]);
    return 0;
}

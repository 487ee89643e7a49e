/* Runs the main function of a generated model in C on the inputs of NAME.rows, if there is such a file; its rows go to
   NAME.csv, and why it failed to NAME.txt. */
#include <stdio.h>

static inline void run(const char *name, int steps, int (*main_function)(int argc, char **argv))
{
    char file[300], count[20], program[] = "model";
    char *arguments[3];
    (void)snprintf(file, sizeof file, "%s.rows", name);
    if (freopen(file, "r", stdin) == NULL) {
        return;
    }
    (void)snprintf(file, sizeof file, "%s.csv", name);
    if (freopen(file, "w", stdout) == NULL) {
        return;
    }
    (void)snprintf(file, sizeof file, "%s.txt", name);
    if (freopen(file, "w", stderr) == NULL) {
        return;
    }
    (void)snprintf(count, sizeof count, "%d", steps);
    arguments[0] = program;
    arguments[1] = count;
    arguments[2] = NULL;
    (void)main_function(2, arguments);
    (void)fflush(stdout);
    (void)fflush(stderr);
}

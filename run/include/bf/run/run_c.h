/* A running model as functions of C: what a shared library gives that exports bf_run_v1.
 *
 * C11 and C++, and no other header of BlockFactory: generated projects carry a copy of this file. Texts and
 * tables belong to the library. One thread at a time uses a model; models do not know of one another. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bf_run_model bf_run_model; /* one running model, of whatever the library makes */

typedef struct {
    double value;
    const char* name;
} bf_run_name;

typedef struct {
    const char *path, *unit, *doc;
    int type; /* double, single, int8, uint8, int16, uint16, int32, uint32, boolean of one byte: 0 ... 8 */
    int rows, cols;
    bool is_matrix;
    int rate;                 /* number of its rate; 0: constant */
    const bf_run_name* names; /* of its values, for people */
    int name_count;
    const char* elements; /* names of the elements of a vector, a line each; an empty line: none */
    void* data;           /* column by column, as long as the model lives; write inputs alone */
} bf_run_quantity;

typedef enum {
    bf_run_signals,
    bf_run_inputs,
    bf_run_parameters,
    bf_run_variables,
    bf_run_checks,
    bf_run_outputs
} bf_run_table;

typedef struct {
    double period; /* s */
    bool is_continuous;
    bool is_triggered; /* hit whenever a trigger fires */
} bf_run_rate;

typedef struct {
    const char* title;
    const char* signals; /* paths, one a line */
} bf_run_panel;

typedef struct {
    const char* name;
    const double* values;
    int count;
} bf_run_value;

typedef struct {
    const char* name; /* of the model */
    double period;    /* of a step [s] */
    double stop_time; /* s; may be infinite */
    uint64_t fingerprint;
    const bf_run_rate* rates;
    int rate_count;
    const bf_run_panel* plots;
    int plot_count;
    size_t snapshot_size; /* bytes; 0: the model cannot be saved */

    bf_run_model* (*create)(void); /* null without memory */
    void (*destroy)(bf_run_model* model);
    /* Row `number` of a table; false behind the last one. */
    bool (*quantity)(bf_run_model* model, bf_run_table table, int number, bf_run_quantity* row);
    /* Called at a zero crossing, before blocks answer it. */
    void (*on_event)(bf_run_model* model, void (*call)(void* with), void* with);
    bool (*initialize)(bf_run_model* model);
    /* The two halves of a step: signals, then the next states. False when they fail. */
    bool (*output)(bf_run_model* model);
    bool (*update)(bf_run_model* model);
    void (*terminate)(bf_run_model* model);
    int64_t (*steps)(const bf_run_model* model);
    bool (*is_hit)(const bf_run_model* model, int rate);    /* in this step */
    const char* (*failed_block)(const bf_run_model* model); /* null: none */
    const char* (*failure)(const bf_run_model* model);
    /* Parameters and variables by name, all or none; null, or what is wrong. */
    const char* (*set_parameters)(bf_run_model* model, const bf_run_value* changes, int count);
    void (*save)(const bf_run_model* model, void* bytes);
    void (*restore)(bf_run_model* model, const void* bytes);
} bf_run_library;

/* The one function that is looked for. */
typedef const bf_run_library* (*bf_run_v1_function)(void);

#ifdef __cplusplus
}
#endif

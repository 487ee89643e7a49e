/* any_size_embedded FILE: embeds a model whose sizes the parameter file decides. Element i moves at speed 10 i. */
#include "any_size_c.h"

#include <stdio.h>

int main(int argc, char** argv) {
    any_size_model* model = any_size_create();
    const char* wrong = any_size_elaborate(model, argc > 1 ? argv[1] : NULL);
    if (wrong) {
        fprintf(stderr, "%s\n", wrong);
        return 1;
    }
    if (!any_size_initialize(model)) return 2;
    any_size_inputs* inputs = any_size_get_inputs(model);
    const int n = inputs->speed.rows * inputs->speed.cols;
    for (int i = 0; i < n; ++i) inputs->speed.data[i] = 10 * i;
    for (int k = 0; k <= 50; ++k)
        if (!any_size_step(model)) return 3;
    const any_size_outputs* outputs = any_size_get_outputs(model);
    for (int i = 0; i < n; ++i) printf("%.17g\n", outputs->position.data[i]);
    any_size_terminate(model);
    any_size_destroy(model);
    return 0;
}

/* Embeds the generated model through its C interface. */
#include "lowpass_c.h"

#include <stdio.h>

int main(void) {
    lowpass_model* model = lowpass_create();
    const double K = 0.2;
    if (!model || !lowpass_initialize(model) || lowpass_set_parameter(model, "K.K", &K, 1)) return 1;
    lowpass_get_inputs(model)->u = 1;
    for (int k = 0; k <= 10; ++k)
        if (!lowpass_step(model)) return 1;
    printf("%.17g\n", lowpass_get_outputs(model)->y);
    lowpass_destroy(model);
    return 0;
}

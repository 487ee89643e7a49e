// Embeds the generated class.
#include "lowpass.hpp"

#include <cstdio>

int main() {
    Lowpass model;
    if (!model.initialize()) return 1;
    const double K = 0.2;
    if (model.set_parameter("K.K", &K, 1)) return 1;
    model.inputs.u = 1;
    for (int k = 0; k <= 10; ++k)
        if (!model.step()) return 1;
    std::printf("%.17g\n", model.outputs.y);
}

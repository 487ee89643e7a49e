// Runs the generated law and the one written by hand on the file `inputs`: writes what the first gives to
// `outputs`, checks that the second gives the same but for rounding, and prints the time of a step of each
// [ns]. Behind them the time of the generated products and solutions alone, in the folder `arithmetic`.
#include "hand_law.hpp"
#include "icub_arithmetic.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

namespace {

constexpr int rounds = 10, repetitions = 100;

template <class F> double nanoseconds(std::size_t steps, F&& all) {
    double best = INFINITY;
    for (int i = 0; i < repetitions; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        for (int round = 0; round < rounds; ++round) all();
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
        best = std::min(best, taken.count() / (rounds * static_cast<double>(steps)));
    }
    return best;
}

template <class Inputs> std::vector<Inputs> read(const char* file) {
    std::ifstream stream(file, std::ios::binary | std::ios::ate);
    std::vector<Inputs> inputs(static_cast<std::size_t>(stream.tellg()) / sizeof(Inputs));
    stream.seekg(0).read(reinterpret_cast<char*>(inputs.data()),
                         static_cast<std::streamsize>(inputs.size() * sizeof(Inputs)));
    return inputs;
}

/// Of a step whose inputs stay where they are.
double time_of_arithmetic() {
    const auto inputs = read<IcubArithmetic::Inputs>("arithmetic/inputs");
    const auto law = std::make_unique<IcubArithmetic>();
    if (!law->initialize()) return NAN;
    std::ofstream outputs("arithmetic/outputs", std::ios::binary);
    for (const auto& in : inputs) {
        law->inputs = in;
        if (!law->step()) return NAN;
        outputs.write(reinterpret_cast<const char*>(&law->outputs), sizeof law->outputs);
    }
    return nanoseconds(inputs.size(), [&] {
        for (std::size_t k = 0; k < inputs.size(); ++k) law->step();
    });
}

} // namespace

int main() {
    const auto inputs = read<IcubLaw::Inputs>("inputs");
    const auto law = std::make_unique<IcubLaw>();
    HandLaw hand(law->parameters);
    const auto out = std::make_unique<IcubLaw::Outputs>();
    constexpr std::size_t count = sizeof(IcubLaw::Outputs) / sizeof(double);
    std::ofstream outputs("outputs", std::ios::binary);
    if (!law->initialize()) return 1;
    for (const auto& in : inputs) {
        law->inputs = in;
        if (!law->step()) {
            std::fprintf(stderr, "%s: %s\n", law->failed_block(), law->failure());
            return 1;
        }
        outputs.write(reinterpret_cast<const char*>(&law->outputs), sizeof law->outputs);
        hand.step(in, *out);
        const auto* expected = reinterpret_cast<const double*>(&law->outputs);
        const auto* found = reinterpret_cast<const double*>(out.get());
        for (std::size_t i = 0; i < count; ++i)
            if (!(std::abs(found[i] - expected[i]) <= 1e-8 * (1 + std::abs(expected[i])))) {
                std::fprintf(stderr, "output %zu by hand: %.17g instead of %.17g\n", i, found[i],
                             expected[i]);
                return 1;
            }
    }
    const double generated = nanoseconds(inputs.size(), [&] {
        for (const auto& in : inputs) {
            law->inputs = in;
            law->step();
        }
    });
    const double by_hand = nanoseconds(inputs.size(), [&] {
        for (const auto& in : inputs) hand.step(in, *out);
    });
    std::printf("%.3f %.3f %.3f\n", generated, by_hand, time_of_arithmetic());
    return 0;
}

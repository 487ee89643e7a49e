// The cart-pole of examples/cart_pole: a continuous plant under a sampled controller, beside a hand-written
// loop.
#include "run.hpp"
#include "session.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace {

constexpr double simulated = 4.0; // s
constexpr int steps = 4000, per_period = 10;

using State = std::array<double, 4>; ///< position, angle from upright, velocity, angular velocity

constexpr double M = 1, m = 0.1, l = 0.5, g = 9.81, h = 0.001;

State slope(const State& x, double F) {
    const double s = std::sin(x[1]), c = std::cos(x[1]);
    const double a = (F + s * (m * l * (x[3] * x[3]) - m * g * c)) / (M + m * (s * s));
    return {x[2], x[3], a, g / l * s - a * c / l};
}

State moved(const State& x, const State& k, double by) {
    State y;
    for (std::size_t i = 0; i < 4; ++i) y[i] = x[i] + by * k[i];
    return y;
}

State rk4(const State& x, double F) {
    const State k1 = slope(x, F), k2 = slope(moved(x, k1, h / 2), F), k3 = slope(moved(x, k2, h / 2), F),
                k4 = slope(moved(x, k3, h), F);
    State y;
    for (std::size_t i = 0; i < 4; ++i) y[i] = x[i] + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    return y;
}

double control(const State& x) {
    const double s = std::sin(x[1]), c = std::cos(x[1]), theta = std::atan2(s, c);
    if (std::abs(theta) <= 0.5)
        return 9.21319712 * x[0] + 56.31151 * theta + 9.69488177 * x[2] + 12.66011936 * x[3];
    const double missing = m * l * l / 2 * x[3] * x[3] + m * g * l * c - m * g * l;
    return std::clamp(20 * (missing * x[3] * c) - 3 * x[0] - 4 * x[2], -10.0, 10.0);
}

State by_hand(int count) {
    State x{0, M_PI - 0.01, 0, 0};
    double F = 0;
    for (int k = 0; k < count; ++k) {
        if (k % per_period == 0) F = control(x);
        x = rk4(x, F);
    }
    return x;
}

void hand_loop(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(by_hand(steps));
}

void diagram(benchmark::State& state) {
    bf::tools::ModelOptions options;
    options.file = BF_SOURCE_DIRECTORY "/examples/cart_pole/model.yaml";
    const auto loaded = bf::tools::load_model(options);
    bf::Simulation simulation(loaded.diagram);
    for (auto _ : state) {
        const auto result = bf::tools::run(simulation, simulated);
        if (!result.failure.empty()) throw std::runtime_error(result.failure);
    }
    const auto velocity = loaded.diagram.find_signal("plant.velocity");
    const auto* reached = static_cast<const double*>(simulation.context().data(velocity.node, velocity.slot));
    if (std::abs(reached[1] - by_hand(steps - 1)[3]) > 1e-4)
        throw std::runtime_error("the diagram and the loop do not compute the same motion");
}

} // namespace

BENCHMARK(diagram)->Name("engine.cartpole/diagram")->Unit(benchmark::kMillisecond);
BENCHMARK(hand_loop)->Name("engine.cartpole/hand_loop")->Unit(benchmark::kMillisecond);

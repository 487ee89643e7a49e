// Zero-crossing functions of standard blocks, against closed forms.
#include "adaptive.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>

using namespace bf;
using namespace bf::test;

namespace {

/// x' = u, and when it was asked for.
class Asked final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u", {.feedthrough = false}};
    ContinuousState<double> x{this, "x"};
    Output<double> y{this, "y"};
    Status output(Now at, Out to) const noexcept override {
        to[y] = at[x];
        return ok;
    }
    Status derivative(Now at, Rate to) const noexcept override {
        times.push_back(at.time());
        to[x] = at[u];
        return ok;
    }
    static inline Values times;
};

/// f(1), f(2), ... as far as 4 s.
Values times_of(const std::function<double(int)>& f) {
    Values times;
    for (int k = 1; f(k) < 4; ++k) times.push_back(f(k));
    return times;
}

} // namespace

TEST(Events, OfStandardBlocksAreLocatedWhereTheseJumpOrBend) {
    const std::string file = testing::TempDir() + "steps.csv";
    std::ofstream(file) << "0,0\n0.6,1\n2.1,3\n";
    const Values halves = times_of([](int k) { return k / 1.4; });
    const std::string input = "u: y, "; // 1 + 0.3 t^2
    const struct {
        std::string block, connection;
        Values times;
    } cases[] = {
        {"SignalGenerator, waveform: square, frequency: 0.7", "", halves},
        {"SignalGenerator, waveform: triangle, frequency: 0.7", "", halves},
        {"SignalGenerator, waveform: sawtooth, frequency: 0.7", "", times_of([](int k) { return k / 0.7; })},
        {"Pulse, cycle: 1.1, width: 25, delay: 0.3", "", {0.3, 0.575, 1.4, 1.675, 2.5, 2.775, 3.6, 3.875}},
        {"RepeatingSequence, times: [0, 0.7, 1.9], values: [0, 1, -1]", "", {0.7, 1.9, 2.6, 3.8}},
        {"Ramp, start: 1.3", "", {1.3}},
        {"SignalFromFile, file: " + file, "", {0.6, 2.1}},
        {"Quantize, interval: 0.5", input, times_of([](int k) { return std::sqrt((0.5 * k - 0.25) / 0.3); })},
        {"LookUpRow, table: \"(1:30)'\"", input, times_of([](int k) { return std::sqrt(k / 0.3); })},
    };
    Library asked("");
    asked.group("test").add<Asked>("Asked", "");
    for (const std::string solver : adaptive_solvers)
        for (const auto& [block, connection, times] : cases) {
            // With such tolerances a solver sees no jump but where a guard tells it.
            Session run("model: m\nstep: 4\nmax_step: 4\nrelative_tolerance: 10\nabsolute_tolerance: 10\n"
                        "solver: " +
                            solver +
                            "\nblocks:\n  t: {block: Clock}\n"
                            "  u: {block: Polynomial, coefficients: [0.3, 0, 1]}\n  y: {block: " +
                            block + "}\n  x: {block: Asked}\nconnections: {t: u, " + connection + "y: x}\n",
                        &asked);
            Asked::times.clear();
            run.trace("x", 1);
            for (const double time : times)
                EXPECT_TRUE(std::any_of(Asked::times.begin(), Asked::times.end(),
                                        [&](double t) { return std::abs(t - time) < 1e-11; }))
                    << solver << ": " << block << " at " << time;
        }
}

// Tuned gains beside pole placement and closed forms of the loop.
#include "bf/analysis/linearize.hpp"
#include "bf/analysis/tune_loop.hpp"

#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>
#include <numbers>

namespace bf::analysis::test {

using Tuned = bf::test::Session;

namespace {

constexpr double half_turn = std::numbers::pi;

/// A plant in a loop with a PID.
std::string loop_of(const std::string& plant, const std::string& pid = "P: 1, I: 0.1") {
    return "model: loop\nstep: 0.001\nsolver: rk4\nblocks:\n  r: {block: Step, time: 1e6}\n"
           "  e: {block: Sum, signs: +-}\n  pid: {block: PID, " +
           pid + "}\n  plant: {block: TransferFunction, " + plant +
           "}\nconnections: {r: e.u1, e: pid, pid: plant, plant: e.u2}\n";
}

TunedLoop tuned(const std::string& text, const TuneOptions& options) {
    Tuned session(text);
    return tune_loop(*session.simulation, options);
}

std::string refused_tuning(const std::string& text, const TuneOptions& options) {
    try {
        tuned(text, options);
    } catch (const RunError& error) {
        return error.what();
    }
    return "nothing";
}

/// exp(j (φ - π)): what L is where it crosses 1 with that phase margin.
Complex crossing(double degrees) { return std::polar(1.0, (degrees - 180) / 180 * half_turn); }

const std::string two_lags = "numerator: 1, denominator: \"[1 2 1]\"";

} // namespace

TEST(TuneLoop, FindsTheGainsOfPolePlacement) {
    // PI of k/(τ s + 1) for the poles of s² + 2 ζ ω s + ω²: P = (2 ζ ω τ - 1)/k, I = ω² τ/k.
    const double k = 4, tau = 0.5, zeta = 0.7, w0 = 6;
    const double P = (2 * zeta * w0 * tau - 1) / k, I = w0 * w0 * tau / k;
    // |L| = 1 where k² (P² ω² + I²) = ω² (τ² ω² + 1).
    const double b = (1 - k * k * P * P) / (tau * tau), c = -k * k * I * I / (tau * tau);
    const double w = std::sqrt(-b / 2 + std::sqrt(b * b / 4 - c));
    const Complex s(0, w), L = (P + I / s) * k / (tau * s + 1.0);
    const auto found = tuned(
        loop_of("numerator: 4, denominator: \"[0.5 1]\""),
        {.loop = "pid", .by = {"pid"}, .crossover = w, .phase_margin = 180 + std::arg(L) * 180 / half_turn});
    ASSERT_EQ(found.gains.size(), 2u);
    EXPECT_EQ(found.gains[0].name, "pid.P");
    EXPECT_NEAR(found.gains[0].after, P, 1e-9);
    EXPECT_NEAR(found.gains[1].after, I, 1e-8);
    EXPECT_EQ(found.gains[1].before, 0.1);
    EXPECT_NEAR(found.after.margins.gain_crossover, w, 1e-8);
    // The poles that were placed.
    const auto roots = poles(closed(found.after.loop));
    ASSERT_EQ(roots.size(), 2u);
    EXPECT_NEAR(roots[0].real(), -zeta * w0, 1e-7);
    EXPECT_NEAR(std::abs(roots[0]), w0, 1e-7);
}

TEST(TuneLoop, GivesThreeGainsADoubleZero) {
    const auto found = tuned(loop_of("numerator: 3, denominator: \"[1 0.4 1]\"", "P: 1, I: 1, D: 1, N: 200"),
                             {.loop = "pid", .by = {"pid"}, .crossover = 8, .phase_margin = 55});
    const double P = found.gains[0].after, I = found.gains[1].after, D = found.gains[2].after;
    EXPECT_NEAR(P * P, 4 * I * D, 1e-9 * P * P);
    const Complex s(0, 8);
    const Complex L = (P + I / s + D * s / (s / 200.0 + 1.0)) * 3.0 / (s * s + 0.4 * s + 1.0);
    EXPECT_LT(std::abs(L - crossing(55)), 1e-9);
    EXPECT_TRUE(found.after.margins.is_stable);
}

TEST(TuneLoop, TunesSampledLoopsByVariables) {
    const std::string text = R"m(
model: sampled
step: 0.01
variables:
  Gain: {Kp: 0.3, Ki: 0.2}
blocks:
  e: {block: Gain, K: -1}
  p: {block: Gain, K: Gain.Kp}
  i: {block: DiscreteIntegrator, gain: Gain.Ki, period: 0.1}
  v: {block: Sum, signs: ++}
  plant: {block: DiscreteTransferFunction, numerator: 0.5, denominator: "[1 -0.8]", period: 0.1}
connections: {e: [p, i], p: v.u1, i: v.u2, v: plant, plant: e}
)m";
    const auto found =
        tuned(text, {.loop = "v", .by = {"Gain.Kp", "Gain.Ki"}, .crossover = 2, .phase_margin = 60});
    const Complex z = std::polar(1.0, 0.2), C = crossing(60) * (z - 0.8) / 0.5, integral = 0.1 / (z - 1.0);
    const double Ki = C.imag() / integral.imag(), Kp = C.real() - Ki * integral.real();
    EXPECT_NEAR(found.gains[0].after, Kp, 1e-9);
    EXPECT_NEAR(found.gains[1].after, Ki, 1e-9);
    EXPECT_EQ(found.after.loop.period, 0.1);
}

TEST(TuneLoop, TunesGainsInWhichTheLoopIsNotLinear) {
    // g/(s + b): at 120 degrees b = ω/√3 and g = |jω + b|.
    const std::string text = R"m(
model: inner
step: 0.001
solver: rk4
blocks:
  g: {block: Gain, K: -2}
  sum: {block: Sum, signs: +-}
  x: {block: Integrator}
  b: {block: Gain, K: 1}
connections: {g: sum.u1, sum: x, x: [b, g], b: sum.u2}
)m";
    const auto found = tuned(text, {.loop = "g", .by = {"g.K", "b.K"}, .crossover = 5, .phase_margin = 120});
    EXPECT_NEAR(found.gains[1].after, 5 / std::sqrt(3.0), 1e-8);
    EXPECT_NEAR(found.gains[0].after, -10 / std::sqrt(3.0), 1e-8); // it keeps its sign
}

TEST(TuneLoop, MeetsABandwidthAndAnOvershoot) {
    const auto fast =
        tuned(loop_of(two_lags), {.loop = "pid", .by = {"pid"}, .bandwidth = 1.2, .phase_margin = 60});
    EXPECT_NEAR(fast.after.margins.bandwidth, 1.2, 1e-8);
    EXPECT_NEAR(fast.after.margins.phase, 60, 1e-6);
    const TuneOptions options{.loop = "pid", .by = {"pid"}, .crossover = 0.8, .overshoot = 8};
    const auto calm = tuned(loop_of(two_lags), options);
    EXPECT_LE(calm.after.step.overshoot, 8);
    EXPECT_GT(calm.after.step.overshoot, 7.9); // no more margin than it takes
    EXPECT_NEAR(calm.after.margins.gain_crossover, 0.8, 1e-8);
    auto both = options;
    both.phase_margin = 75;
    EXPECT_NEAR(tuned(loop_of(two_lags), both).after.margins.phase, 75, 1e-6);
}

TEST(TuneLoop, OneGainMeetsOneRequirement) {
    // k/(s (s + 1)) has 45 degrees at 1 rad/s, with k = √2.
    const std::string lag = loop_of("numerator: 1, denominator: \"[1 1 0]\"", "P: 0.1, I: 0");
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}, .phase_margin = 45}).gains[0].after,
                std::sqrt(2.0), 1e-6);
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}, .crossover = 1}).gains[0].after, std::sqrt(2.0),
                1e-9);
    // s² + s + k oversteps by exp(-π ζ/√(1 - ζ²)), k = 1/(4 ζ²).
    const double zeta = 0.5, over = 100 * std::exp(-half_turn * zeta / std::sqrt(1 - zeta * zeta));
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}, .overshoot = over}).gains[0].after, 1, 1e-3);
    // Where nothing is said it has 60 degrees, which are left at 1/√3 rad/s.
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}}).gains[0].after, 2.0 / 3, 1e-6);
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}, .gain_margin = 20}).gains[0].after, 2.0 / 3,
                1e-6);
}

TEST(TuneLoop, TunesAnInnerLoopWithTheOuterOneOpenByElementsOfAVariable) {
    // Inside k/(0.1 s + 1), sampled at 2 ms, outside a loop at 50 ms.
    const std::string cascade = R"m(
model: cascade
step: 0.002
solver: rk4
variables: {K: "[4 20]"}
blocks:
  r: {block: Step, time: 1e6}
  outer: {block: Sum, signs: +-}
  slow: {block: Gain, K: 2, period: 0.05}
  inner: {block: Sum, signs: +-}
  fast: {block: Gain, K: K(2)}
  lag: {block: TransferFunction, numerator: 1, denominator: "[0.1 1]"}
  position: {block: Integrator}
connections: {r: outer.u1, outer: slow, slow: inner.u1, inner: fast, fast: lag, lag: [inner.u2, position], position: outer.u2}
)m";
    const TuneOptions options{.loop = "fast", .by = {"K[2]"}, .crossover = 100, .open = {"slow"}};
    const auto found = tuned(cascade, options);
    EXPECT_NEAR(found.gains[0].after, std::abs(Complex(1, 10)), 1e-6);
    EXPECT_EQ(found.gains[0].before, 20);
    EXPECT_TRUE(found.after.loop.held.empty());
    auto third = options;
    third.by = {"K[3]"};
    EXPECT_EQ(refused_tuning(cascade, third), "'K' has no element [3]; it has 2");
}

TEST(TuneLoop, StaysWithinTheLimitsOfAVariable) {
    std::string text = loop_of("numerator: 1, denominator: \"[1 1 0]\"", "P: k, I: 0");
    text.replace(text.find("blocks:"), 7, "variables: {k: {value: 0.1, minimum: 0, maximum: 5}}\nblocks:");
    EXPECT_NEAR(tuned(text, {.loop = "pid", .by = {"k"}, .phase_margin = 45}).gains[0].after, std::sqrt(2.0),
                1e-6);
}

TEST(TuneLoop, OneGainHasNeitherAnEndlessSpeedNorAnEndlessSwing) {
    // k (s + 1)²/s³ comes to 90 degrees the faster it is.
    const auto growing =
        refused_tuning(loop_of("numerator: \"[1 2 1]\", denominator: \"[1 0 0 0]\"", "P: 2, I: 0"),
                       {.loop = "pid", .by = {"pid.P"}, .phase_margin = 60});
    EXPECT_NE(growing.find("none is the fastest; ask for a crossover"), std::string::npos) << growing;
    // (P + 1/s)/(s (s + 1)) with P = 1: poles at -1 and ±j.
    const auto swinging = refused_tuning(loop_of("numerator: 1, denominator: \"[1 1 0]\"", "P: 3, I: 1"),
                                         {.loop = "pid", .by = {"pid.P"}, .crossover = 1});
    EXPECT_NE(swinging.find("would swing on for ever at 1 rad/s"), std::string::npos) << swinging;
}

TEST(TuneLoop, SaysWhatCannotBeReachedAndWhatCan) {
    const auto expect = [](const std::string& refusal, const std::string& part) {
        EXPECT_NE(refusal.find(part), std::string::npos) << part << "\n" << refusal;
    };
    // At 3 rad/s the plant lags 143 degrees: with a PI less than 37 are left.
    const TuneOptions options{.loop = "pid", .by = {"pid"}, .crossover = 3, .phase_margin = 60};
    const auto refusal = refused_tuning(loop_of(two_lags), options);
    expect(refusal, "a phase margin of 60 degrees at 3 rad/s cannot be reached with pid.P, pid.I: 'pid.I' "
                    "would have to be -");
    double low = 0, high = 0, slow = 0, fast = 0;
    const auto at = refusal.find("phase margins from");
    ASSERT_NE(at, std::string::npos) << refusal;
    ASSERT_EQ(std::sscanf(refusal.c_str() + at,
                          "phase margins from %lf to %lf degrees; with this phase margin there are "
                          "crossovers from %lf to %lf",
                          &low, &high, &slow, &fast),
              4)
        << refusal;
    EXPECT_NEAR(high, 180 - 2 * std::atan(3.0) * 180 / half_turn, 0.1);
    EXPECT_NEAR(fast, std::tan(half_turn / 3), 0.02); // where the plant alone has 60 degrees
    auto less = options;
    less.phase_margin = high;
    EXPECT_EQ(refused_tuning(loop_of(two_lags), less), "nothing");
    less = options;
    less.crossover = fast;
    EXPECT_EQ(refused_tuning(loop_of(two_lags), less), "nothing");
    auto stiff = options;
    stiff.crossover = 1;
    stiff.phase_margin = 30;
    stiff.gain_margin = 20;
    expect(refused_tuning(loop_of("numerator: 1, denominator: \"[1 3 3 1]\""), stiff),
           "the gain margin comes to ");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pdi"}, .crossover = 1}),
           "no parameter, variable or block with P, I and D 'pdi'");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid.P[2]"}, .crossover = 1}),
           "has no element [2]; it has 1");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid"}}),
           "say how fast the loop is to be");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid"}, .crossover = 1, .bandwidth = 1}),
           "say the same");
    expect(
        refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid.P", "pid.I", "pid.N"}, .crossover = 1}),
        "decide two gains, or P, I and D");
    expect(refused_tuning(loop_of(two_lags), {.loop = "r", .by = {"pid"}, .crossover = 1}),
           "'pid.P' does not change what comes back to 'r'");
    std::string limited = loop_of(two_lags, "P: 1, I: 0.1, upper: 1.5");
    limited.replace(limited.find("time: 1e6"), 9, "time: 0");
    expect(refused_tuning(limited, {.loop = "pid", .by = {"pid"}, .crossover = 1, .phase_margin = 60}),
           "nothing comes back to 'pid': a limit is met at this operating point");
    // With two integrators a loop oversteps whatever it does.
    expect(refused_tuning(loop_of("numerator: 1, denominator: \"[1 1 0]\""),
                          {.loop = "pid", .by = {"pid"}, .crossover = 0.3, .overshoot = 0.1}),
           "an overshoot of at most 0.1 % cannot be reached at 0.3 rad/s: the least one is ");
}

TEST(TuneLoop, ChangesTheGainsOfTheRunAlone) {
    Tuned session(loop_of(two_lags)), other(loop_of(two_lags));
    session.trace("plant", 20);
    other.trace("plant", 20);
    auto& run = *session.simulation;
    EXPECT_THROW(tune_loop(run, {.loop = "pid", .by = {"pid"}, .crossover = 3, .phase_margin = 60}),
                 RunError);
    EXPECT_EQ(session.trace("plant", 20), other.trace("plant", 20));
    const auto found = tune_loop(run, {.loop = "pid", .by = {"pid"}, .crossover = 1, .phase_margin = 60});
    EXPECT_EQ(find(run.parameters(), "pid.P")[0], found.gains[0].after);
    EXPECT_DOUBLE_EQ(run.time(), 0.04);
}

TEST(TuneLoop, ASimulatedStepIsThatOfTheClosedLoop) {
    Tuned session(loop_of(two_lags, "P: 3, I: 2, upper: 0.5"));
    auto& run = *session.simulation;
    const auto linear =
        step_response(closed(negative([&] {
                          Simulation fresh(session.diagram);
                          fresh.start();
                          return linearize(fresh, {.from = {"pid"}, .to = {"pid"}, .open = {"pid"}});
                      }())),
                      0, 0, 5);
    const auto simulated = simulated_step(run, "pid", 5, 0.01);
    ASSERT_EQ(simulated.time.size(), 5000u);
    for (std::size_t i = 0; i < linear.time.size(); i += 50) {
        const auto k = static_cast<std::size_t>(std::lround(linear.time[i] / 0.001));
        if (k >= simulated.value.size() || std::abs(simulated.time[k] - linear.time[i]) > 1e-9) continue;
        EXPECT_NEAR(simulated.value[k], linear.value[i], 1e-6) << linear.time[i];
    }
    // Where the limit is met the loop does less.
    const auto limited = simulated_step(run, "pid", 5, -3);
    EXPECT_GT(std::abs(limited.value[1000] - simulated.value[1000]), 0.05);
}

} // namespace bf::analysis::test

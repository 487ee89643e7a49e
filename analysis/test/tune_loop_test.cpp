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
    // Its simulated step is that of this loop alone: k/(1 + k) (1 - exp(-10 (1 + k) t)).
    Tuned session(cascade);
    session.trace("fast", 500);
    tune_loop(*session.simulation, options);
    const double k = found.gains[0].after;
    const auto alone = simulated_step(*session.simulation, "fast", 0.1, 0.01, {"slow"});
    const auto closed_around = simulated_step(*session.simulation, "fast", 0.1, 0.01);
    double most = 0;
    for (std::size_t i = 0; i < alone.time.size(); ++i) {
        const double y = k / (1 + k) * (1 - std::exp(-10 * (1 + k) * alone.time[i]));
        EXPECT_NEAR(alone.value[i], y, 1e-4) << alone.time[i];
        most = std::max(most, std::abs(closed_around.value[i] - y));
    }
    EXPECT_GT(most, 1e-3);
    EXPECT_DOUBLE_EQ(session.simulation->time(), 1);
    auto third = options;
    third.by = {"K[3]"};
    EXPECT_EQ(refused_tuning(cascade, third), "'K' has no element [3]; it has 2, from K[1] to K[2]");
}

TEST(TuneLoop, StaysWithinTheLimitsOfAVariable) {
    std::string text = loop_of("numerator: 1, denominator: \"[1 1 0]\"", "P: k, I: 0");
    text.replace(text.find("blocks:"), 7, "variables: {k: {value: 0.1, minimum: 0, maximum: 5}}\nblocks:");
    EXPECT_NEAR(tuned(text, {.loop = "pid", .by = {"k"}, .phase_margin = 45}).gains[0].after, std::sqrt(2.0),
                1e-6);
}

TEST(TuneLoop, OneGainJustMeetsItsMargin) {
    // k (s + 1)²/s³ comes to 90 degrees the faster it is. Its phase is 2 atan ω - 270 degrees: -120 at tan
    // 75, where k = ω³/(ω² + 1).
    const double w = std::tan(75 * half_turn / 180);
    const auto found = tuned(loop_of("numerator: \"[1 2 1]\", denominator: \"[1 0 0 0]\"", "P: 2, I: 0"),
                             {.loop = "pid", .by = {"pid.P"}, .phase_margin = 60});
    EXPECT_NEAR(found.gains[0].after, w * w * w / (w * w + 1), 1e-6);
    EXPECT_NEAR(found.after.margins.gain_crossover, w, 1e-6);
}

TEST(TuneLoop, OneGainHasNeitherAnEndlessSpeedNorAnEndlessSwing) {
    // k/(s + 1) has more than 90 degrees at any speed, and |L| = 1 from k = 1 on.
    std::string lag = loop_of("numerator: 1, denominator: \"[1 1]\"", "P: k, I: 0");
    lag.replace(lag.find("blocks:"), 7, "variables: {k: 2}\nblocks:");
    const TuneOptions asked{.loop = "pid", .by = {"k"}, .phase_margin = 60};
    EXPECT_EQ(refused_tuning(lag, asked)
                  .find("every value of 'k' from 1 up gives a phase margin of 60 degrees, at "),
              0u);
    EXPECT_NE(refused_tuning(lag, asked).find("none is the fastest; ask for a crossover"), std::string::npos);
    // Within limits there is one.
    lag.replace(lag.find("k: 2"), 4, "k: {value: 2, maximum: 7}");
    EXPECT_EQ(tuned(lag, asked).gains[0].after, 7);
    // (P + 1/s)/(s (s + 1)) with P = 1: poles at -1 and ±j.
    const auto swinging = refused_tuning(loop_of("numerator: 1, denominator: \"[1 1 0]\"", "P: 3, I: 1"),
                                         {.loop = "pid", .by = {"pid.P"}, .crossover = 1});
    EXPECT_NE(swinging.find("would swing on for ever at 1 rad/s"), std::string::npos) << swinging;
}

TEST(TuneLoop, OneGainMayLeaveTheLoopsGainBelowOneEverywhere) {
    // k/(s² + s + 1) closed has s² + s + 1 + k: with ζ = 1/(2 √(1 + k)) it oversteps by exp(-π ζ/√(1 - ζ²)).
    const auto overshoot = [](double k) { return 100 * std::exp(-half_turn / std::sqrt(3 + 4 * k)); };
    const std::string swing = loop_of("numerator: 1, denominator: \"[1 1 1]\"", "P: 5, I: 0");
    EXPECT_NEAR(tuned(swing, {.loop = "pid", .by = {"pid.P"}, .overshoot = overshoot(0.2)}).gains[0].after,
                0.2, 1e-4);
    // k/(s + 1) closed has its pole, and so its bandwidth, at 1 + k.
    const std::string lag = loop_of("numerator: 1, denominator: \"[1 1]\"", "P: 5, I: 0");
    EXPECT_NEAR(tuned(lag, {.loop = "pid", .by = {"pid.P"}, .bandwidth = 1.5}).gains[0].after, 0.5, 1e-6);
    // k/(s + 1)³ is stable up to k = 8.
    const std::string lags = loop_of("numerator: 1, denominator: \"[1 3 3 1]\"", "P: 5, I: 0");
    EXPECT_NEAR(
        tuned(lags, {.loop = "pid", .by = {"pid.P"}, .phase_margin = 60, .gain_margin = 20}).gains[0].after,
        0.8, 1e-4);
}

TEST(TuneLoop, OfGainsThatLeaveTheLoopBelowOneTheOneOfTheGreatestBandwidthIsTaken) {
    // k/(s + 1) has every phase margin up to k = 1; closed it is k/(s + 1 + k).
    std::string lag = loop_of("numerator: 1, denominator: \"[1 1]\"", "P: k, I: 0");
    lag.replace(lag.find("blocks:"), 7, "variables: {k: {value: 0.2, maximum: 0.5}}\nblocks:");
    const auto found = tuned(lag, {.loop = "pid", .by = {"k"}, .phase_margin = 60});
    EXPECT_EQ(found.gains[0].after, 0.5);
    EXPECT_NEAR(found.after.margins.bandwidth, 1.5, 1e-9); // of 0.5/(s + 1.5)
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
    double high = 0, slow = 0, fast = 0;
    const auto at = refusal.find("phase margins up to");
    ASSERT_NE(at, std::string::npos) << refusal;
    ASSERT_EQ(std::sscanf(refusal.c_str() + at,
                          "phase margins up to %lf degrees; with this phase margin there are "
                          "crossovers from %lf to %lf",
                          &high, &slow, &fast),
              3)
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
           "no parameter, variable or block with P and I 'pdi'");
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
           "nothing comes back to 'r': no path leads from it to itself");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid.N"}, .crossover = 1}),
           "'pid.N' does not change what comes back to 'pid'"); // D is 0
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"pid.P", "pid.P"}, .crossover = 1}),
           "'pid.P' is named twice");
    expect(refused_tuning(loop_of(two_lags), {.loop = "pid", .by = {"plant"}, .crossover = 1}),
           "block 'plant' has no parameters P and I");
    std::string limited = loop_of(two_lags, "P: 1, I: 0.1, upper: 1.5");
    limited.replace(limited.find("time: 1e6"), 9, "time: 0");
    expect(refused_tuning(limited, {.loop = "pid", .by = {"pid"}, .crossover = 1, .phase_margin = 60}),
           "with pid.P = 1.732, pid.I = 1 nothing comes back to 'pid': 'pid' passes no small change on; it "
           "stands at a limit");
    // With two integrators a loop oversteps whatever it does.
    expect(refused_tuning(loop_of("numerator: 1, denominator: \"[1 1 0]\""),
                          {.loop = "pid", .by = {"pid"}, .crossover = 0.3, .overshoot = 0.1}),
           "an overshoot of at most 0.1 % cannot be reached at 0.3 rad/s: the least one is ");
}

namespace {

/// (P + I/s + D s/(s/N + 1)) / (s (s + 1) (0.05 s + 1)) with the gains as variables.
std::string servo(const std::string& gains) {
    std::string text = loop_of("numerator: 1, denominator: \"[0.05 1.05 1 0]\"", "P: P, I: I, D: D, N: N");
    text.replace(text.find("blocks:"), 7, "variables: {" + gains + "}\nblocks:");
    return text;
}
double phase_margin_of_servo(double P, double I, double D, double N) {
    const auto L = [&](double w) {
        const Complex s(0, w);
        return (P + I / s + D * s / (s / N + 1.0)) / (s * (s + 1.0) * (0.05 * s + 1.0));
    };
    double low = 0.1, high = 100; // |L| falls
    for (int i = 0; i < 100; ++i) {
        const double middle = std::sqrt(low * high);
        (std::abs(L(middle)) > 1 ? low : high) = middle;
    }
    return 180 + std::arg(L(low)) * 180 / half_turn;
}

/// K/(s (s + 1/tau + Kt)), whose inner loop has the gain Kt.
std::string tacho(const std::string& variables) {
    return "model: tacho\nstep: 0.001\nsolver: rk4\nvariables: {" + variables +
           "}\nblocks:\n  g: {block: Gain, K: -K}\n  s: {block: Sum, signs: +--}\n  v: {block: Integrator}\n"
           "  kt: {block: Gain, K: Kt}\n  one: {block: Gain, K: 1/tau}\n  x: {block: Integrator}\n"
           "connections: {g: s.u1, s: v, v: [x, kt, one], kt: s.u2, one: s.u3, x: g}\n";
}

} // namespace

TEST(TuneLoop, FindsAGainThatHardlyMovesTheCrossover) {
    // All crossovers that I leads to lie from 1.25 to 1.38 rad/s, and each has two values of it.
    const std::string text = servo("P: 2, I: 0.5, D: 0.3, N: 100");
    for (const double margin : {25.0, 34.0, 40.0}) {
        const auto found = tuned(text, {.loop = "pid", .by = {"I"}, .phase_margin = margin});
        EXPECT_NEAR(phase_margin_of_servo(2, found.gains[0].after, 0.3, 100), margin, 1e-6);
        EXPECT_NEAR(found.after.margins.phase, margin, 1e-6);
    }
    // The crossover that the present I has is one that it is found for again, though another I has it, too.
    const auto present = tuned(text, {.loop = "pid", .by = {"I"}, .phase_margin = 34}).before;
    const auto again = tuned(text, {.loop = "pid", .by = {"I"}, .crossover = present.margins.gain_crossover});
    EXPECT_NEAR(again.after.margins.gain_crossover, present.margins.gain_crossover, 1e-9);
    EXPECT_GE(again.after.margins.phase, present.margins.phase - 1e-6);
}

TEST(TuneLoop, TakesAGroupOfVariablesPAndI) {
    std::string text = loop_of(two_lags, "P: c.P, I: c.I");
    text.replace(text.find("blocks:"), 7, "variables: {c: {P: 1, I: 0.1}}\nblocks:");
    const auto found = tuned(text, {.loop = "pid", .by = {"c"}, .crossover = 1, .phase_margin = 60});
    ASSERT_EQ(found.gains.size(), 2u);
    EXPECT_EQ(found.gains[1].name, "c.I");
    EXPECT_NEAR(found.gains[0].after, std::sqrt(3.0), 1e-9); // P - I j = exp(-j 120°) (1 + j)²
    EXPECT_NEAR(found.gains[1].after, 1, 1e-9);
}

TEST(TuneLoop, FindsABandwidthThatDoesNotGrowWithTheCrossover) {
    // 5/(s² + 2 s + 5) with P and I: at 60 degrees I comes to 0 at (1 + √16)/√3 = 2.887 rad/s, and there the
    // closed loop falls by 3 dB long before.
    const std::string text = loop_of("numerator: 5, denominator: \"[1 2 5]\"", "P: 1, I: 1");
    TuneOptions options{.loop = "pid", .by = {"pid"}, .bandwidth = 6};
    const auto refusal = refused_tuning(text, options);
    EXPECT_EQ(refusal.find("a bandwidth of 6 rad/s with a phase margin of 60 degrees cannot be reached"), 0u)
        << refusal;
    double most = 0, crossover = 0;
    const auto at = refusal.find("the nearest that was found");
    ASSERT_NE(at, std::string::npos) << refusal;
    ASSERT_EQ(std::sscanf(refusal.c_str() + at,
                          "the nearest that was found is one of %lf rad/s, with a crossover at %lf", &most,
                          &crossover),
              2)
        << refusal;
    EXPECT_LT(crossover, 5 / std::sqrt(3.0));
    for (const double share : {0.8, 0.9, 0.999}) {
        options.bandwidth = share * most;
        const auto found = tuned(text, options);
        EXPECT_NEAR(found.after.margins.bandwidth, options.bandwidth, 1e-6);
        EXPECT_NEAR(found.after.margins.phase, 60, 1e-6);
    }
}

TEST(TuneLoop, FindsATimeConstantByItsPhaseMargin) {
    const std::string text = servo("P: 2, I: 0.5, D: 0.8, N: 10");
    const auto found = tuned(text, {.loop = "pid", .by = {"N"}, .phase_margin = 45});
    EXPECT_NEAR(found.after.margins.phase, phase_margin_of_servo(2, 0.5, 0.8, found.gains[0].after), 1e-6);
    EXPECT_GE(found.after.margins.phase, 45 - 1e-9);
    // What N = infinity and N = 0 have stands in the refusal.
    const auto refusal = refused_tuning(text, {.loop = "pid", .by = {"N"}, .phase_margin = 85});
    double most = 0;
    const auto at = refusal.find("the most is");
    ASSERT_NE(at, std::string::npos) << refusal;
    ASSERT_EQ(std::sscanf(refusal.c_str() + at, "the most is %lf degrees", &most), 1);
    double best = 0;
    for (double N = 1e-4; N < 1e7; N *= 1.01) best = std::max(best, phase_margin_of_servo(2, 0.5, 0.8, N));
    EXPECT_NEAR(most, best, 0.01);
}

TEST(TuneLoop, FindsOneGainOfAnInnerLoopFromFar) {
    const std::string text = tacho("K: 8, Kt: 0.5, tau: 0.2");
    for (const double w : {1.0, 1.4}) {
        // |jω (jω + 5 + Kt)| = 8.
        const auto found = tuned(text, {.loop = "g", .by = {"Kt"}, .crossover = w});
        EXPECT_NEAR(found.gains[0].after, std::sqrt(64 / w / w - w * w) - 5, 1e-8) << w;
    }
    const std::string algebraic = R"m(
model: algebraic
step: 0.001
solver: rk4
algebraic_loops: solve
variables: {K: 2, f: 0.5}
blocks:
  e: {block: Gain, K: -1}
  s: {block: Sum, signs: +-}
  g: {block: Gain, K: K}
  h: {block: Gain, K: f}
  plant: {block: TransferFunction, numerator: 1, denominator: "[1 1 0]"}
connections: {e: s.u1, s: g, g: [plant, h], h: s.u2, plant: e}
)m";
    // K/(1 + K f) = √2, from both sides.
    for (const char* f : {"0.5", "0.05", "5"}) {
        std::string from = algebraic;
        from.replace(from.find("f: 0.5"), 6, std::string("f: ") + f);
        const auto found = tuned(from, {.loop = "plant", .by = {"f"}, .crossover = 1});
        EXPECT_NEAR(found.gains[0].after, (2 / std::sqrt(2.0) - 1) / 2, 1e-8) << f;
    }
}

TEST(TuneLoop, ApproachesTwoGainsInWhichTheLoopIsNotAffine) {
    // 1/tau + Kt = ω tan 70°, K = ω |jω + 1/tau + Kt|.
    const double w = 3, a = w * std::tan(70 * half_turn / 180), tau = 1 / (a - 0.5), K = w * std::hypot(w, a);
    for (const char* from : {"0.01", "0.05", "0.2", "0.3", "5"}) {
        const auto found = tuned(tacho(std::string("K: 8, Kt: 0.5, tau: ") + from),
                                 {.loop = "g", .by = {"tau", "K"}, .crossover = w, .phase_margin = 70});
        EXPECT_NEAR(found.gains[0].after, tau, 1e-8) << from;
        EXPECT_NEAR(found.gains[1].after, K, 1e-6) << from;
    }
    // Both only move the pole: the phase at the crossover is that of the pole, and |L| is K alone.
    const auto refusal =
        refused_tuning(tacho("K: 8, Kt: 0.5, tau: 0.2"),
                       {.loop = "g", .by = {"tau", "Kt"}, .crossover = w, .phase_margin = 70});
    EXPECT_NE(refusal.find("no gains that were found have it; the nearest are tau = "), std::string::npos)
        << refusal;
}

TEST(TuneLoop, KeepsTwoGainsWithinTheirLimitsAndSaysWhichStandsInTheWay) {
    const auto limited = [](const char* tau) {
        return tacho("K: 8, Kt: 0.5, tau: {value: 0.2, minimum: 0.15, maximum: " + std::string(tau) + "}");
    };
    const TuneOptions far{.loop = "g", .by = {"tau", "K"}, .crossover = 3, .phase_margin = 70};
    const auto refusal = refused_tuning(limited("0.25"), far);
    EXPECT_NE(refusal.find("'tau' is at its limit, 0.15; at 3 rad/s there are phase margins from "),
              std::string::npos)
        << refusal;
    // At 0.15 and at 0.25.
    const auto margin = [](double tau) { return std::atan((1 / tau + 0.5) / 3) * 180 / half_turn; };
    double low = 0, high = 0;
    std::sscanf(refusal.c_str() + refusal.find("phase margins from "), "phase margins from %lf to %lf", &low,
                &high);
    EXPECT_NEAR(low, margin(0.25), 0.02) << refusal;
    EXPECT_NEAR(high, margin(0.15), 0.02) << refusal;
    // Narrow limits, and a gain at one of them.
    TuneOptions near = far;
    near.phase_margin = margin(0.2004);
    EXPECT_NEAR(tuned(limited("0.2005"), near).gains[0].after, 0.2004, 1e-8);
    near.phase_margin = margin(0.18);
    EXPECT_NEAR(tuned(limited("0.2"), near).gains[0].after, 0.18, 1e-8);
    // A quarter more and a quarter less lie beyond both.
    near.phase_margin = margin(0.195);
    const auto narrow = tacho("K: 8, Kt: 0.5, tau: {value: 0.2, minimum: 0.19, maximum: 0.21}");
    EXPECT_NEAR(tuned(narrow, near).gains[0].after, 0.195, 1e-8);
}

TEST(TuneLoop, FindsTheLeastOvershootAtTheEndOfWhatCanBeHad) {
    // A lag and a resonance far away, behind a zero to the right: P and I have at 1 rad/s at most 42 degrees.
    const std::string text = R"m(
model: resonant
step: 0.001
solver: rk4
variables: {P: 0.5, I: 0.1}
blocks:
  e: {block: Gain, K: -1}
  c: {block: PID, P: P, I: I}
  lag: {block: TransferFunction, numerator: 1, denominator: "[1 0.1]"}
  flex: {block: TransferFunction, numerator: 400, denominator: "[1 0.08 400]"}
  delay: {block: TransferFunction, numerator: "[-0.5 1]", denominator: "[0.5 1]"}
connections: {e: c, c: lag, lag: flex, flex: delay, delay: e}
)m";
    TuneOptions options{.loop = "c", .by = {"P", "I"}, .crossover = 1, .overshoot = 25};
    const auto found = tuned(text, options);
    EXPECT_LE(found.after.step.overshoot, 25);
    EXPECT_GT(found.after.step.overshoot, 24.9);
    options.overshoot = 10;
    const auto refusal = refused_tuning(text, options);
    double least = 0, at = 0;
    ASSERT_EQ(std::sscanf(refusal.c_str() + refusal.find("the least one is"),
                          "the least one is %lf %%, with a phase margin of %lf degrees", &least, &at),
              2)
        << refusal;
    options.overshoot = least * 1.001;
    EXPECT_NEAR(tuned(text, options).after.margins.phase, at, 0.1);
}

TEST(TuneLoop, AGainMarginIsAlsoOneOfLessGain) {
    // P/(s - 1) falls with P < 1: 2.5 has 8 dB of it.
    const std::string text = loop_of("numerator: 1, denominator: \"[1 -1]\"", "P: 3, I: 0");
    const double w = std::sqrt(2.5 * 2.5 - 1);
    TuneOptions options{.loop = "pid", .by = {"pid.P"}, .crossover = w, .gain_margin = 7.9};
    EXPECT_NEAR(tuned(text, options).gains[0].after, 2.5, 1e-9);
    options.gain_margin = 8;
    EXPECT_EQ(refused_tuning(text, options)
                  .find("the closed loop would be unstable with 7.959 dB less gain, not with 8 dB"),
              0u);
}

TEST(TuneLoop, OfOneGainSaysWhatCanBeHad) {
    const std::string lag = loop_of("numerator: 1, denominator: \"[1 3 3 1]\"", "P: 1, I: 0");
    // P/(s + 1)³ crosses 1 where P > 1, and is stable up to P = 8, at √3 rad/s.
    const auto refusal = refused_tuning(lag, {.loop = "pid", .by = {"pid.P"}, .crossover = 2});
    double slow = 0, fast = 0;
    const auto at = refusal.find("there are crossovers from");
    ASSERT_NE(at, std::string::npos) << refusal;
    ASSERT_EQ(std::sscanf(refusal.c_str() + at, "there are crossovers from %lf to %lf rad/s", &slow, &fast),
              2)
        << refusal;
    EXPECT_LT(slow, 1e-3);
    EXPECT_NEAR(fast, std::sqrt(3.0), 1e-3);
    const auto both =
        refused_tuning(lag, {.loop = "pid", .by = {"pid.P"}, .crossover = 1.5, .phase_margin = 60});
    const double left = 180 - 3 * std::atan(1.5) * 180 / half_turn;
    char text[64];
    std::snprintf(text, sizeof text, "leaves a phase margin of %.4g degrees, not 60", left);
    EXPECT_NE(both.find(text), std::string::npos) << both;
}

TEST(TuneLoop, RefusesNumbersThatMeanNothing) {
    const auto refused = [](const TuneOptions& options, const std::string& part) {
        const auto text = refused_tuning(loop_of(two_lags), options);
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    const std::vector<std::string> by{"pid"};
    for (const double margin : {-3.0, double(NAN), double(INFINITY)})
        refused({.loop = "pid", .by = by, .crossover = 1, .gain_margin = margin},
                "a gain margin is at least 0 dB, not ");
    for (const double speed : {-1.0, double(NAN), double(INFINITY)}) {
        refused({.loop = "pid", .by = by, .crossover = speed},
                "a crossover or bandwidth is a number above 0");
        refused({.loop = "pid", .by = by, .bandwidth = speed},
                "a crossover or bandwidth is a number above 0");
    }
}

TEST(TuneLoop, HoldsNoSignalsThatAreNotReal) {
    std::string text = loop_of(two_lags);
    text.replace(text.find("connections"), 0,
                 "  c: {block: Sine, frequency: \"[1 2]\"}\n  are: {block: CompareToZero}\n");
    text.replace(text.find("connections: {"), 14, "connections: {c: are, ");
    Tuned session(text);
    try {
        simulated_step(*session.simulation, "pid", 1, 0.01, {"are"});
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(),
                     "'are' is of type boolean, to which nothing is added; choose a signal of real numbers");
    }
}

TEST(TuneLoop, SaysWhichBlockLetsNothingPass) {
    std::string stepped = loop_of(two_lags);
    stepped.replace(stepped.find("connections"), 0, "  q: {block: Quantize, interval: 0.05}\n");
    stepped.replace(stepped.find("pid: plant"), 10, "pid: q, q: plant");
    EXPECT_NE(refused_tuning(stepped, {.loop = "pid", .by = {"pid"}, .crossover = 1})
                  .find("nothing comes back to 'pid': 'q' passes no small change on"),
              std::string::npos);
}

TEST(TuneLoop, EndsWhenItIsAsked) {
    int sets = 0;
    const auto refusal = refused_tuning(
        loop_of(two_lags),
        {.loop = "pid", .by = {"pid.P"}, .phase_margin = 50, .go_on = [&] { return ++sets < 20; }});
    EXPECT_EQ(refusal, "the search was interrupted");
    EXPECT_EQ(sets, 20);
    Tuned session(loop_of(two_lags));
    try {
        simulated_step(*session.simulation, "pid", 5, 0.01, {}, [] { return false; });
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(), "the simulated step was interrupted");
    }
}

TEST(TuneLoop, FindsGainsFarGreaterThanTheModelsWithoutASearch) {
    int sets = 0;
    const auto count = [&] { return ++sets > 0; };
    const auto found =
        tuned(loop_of(two_lags, "P: 1e-4, I: 1e-5"),
              {.loop = "pid", .by = {"pid"}, .crossover = 1, .phase_margin = 60, .go_on = count});
    const auto near = tuned(loop_of(two_lags),
                            {.loop = "pid", .by = {"pid"}, .crossover = 1, .phase_margin = 60, .go_on = {}});
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_NEAR(found.gains[i].after, near.gains[i].after, 1e-10 * std::abs(near.gains[i].after));
    EXPECT_LT(sets, 10);
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
    // Sentences for what cannot be simulated.
    const auto refusal = [&](double duration, const std::vector<std::string>& open) -> std::string {
        try {
            simulated_step(run, "pid", duration, 0.01, open);
        } catch (const RunError& error) {
            return error.what();
        }
        return {};
    };
    for (const double duration : {1e300, 1e9})
        EXPECT_NE(refusal(duration, {}).find("simulate it for a shorter time"), std::string::npos)
            << duration;
    EXPECT_NE(refusal(NAN, {}).find("longer than 0 s"), std::string::npos);
    // Where the limit is met the loop does less.
    const auto limited = simulated_step(run, "pid", 5, -3);
    EXPECT_GT(std::abs(limited.value[1000] - simulated.value[1000]), 0.05);
}

} // namespace bf::analysis::test

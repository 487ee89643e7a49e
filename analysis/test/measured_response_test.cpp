// Measured frequency responses beside closed forms, describing functions and the linearised model.
#include "bf/analysis/measured_response.hpp"

#include "bf/analysis/linearize.hpp"

#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>
#include <numbers>

namespace bf::analysis::test {

using Measured = bf::test::Session;

namespace {

constexpr double pi = std::numbers::pi;

/// 2/(s² + 0.6 s + 1) in a loop with a gain of 3.
const std::string measured_loop = R"m(
model: loop
step: 0.01
solver: rk4
inputs: [r]
blocks:
  error: {block: Sum, signs: +-}
  gain: {block: Gain, K: 3}
  plant: {block: TransferFunction, numerator: 2, denominator: "[1 0.6 1]"}
  position: {block: Integrator}
connections:
  r: error.u1
  error: gain
  gain: plant
  plant: [error.u2, position]
)m";

Complex plant_at(double w) {
    const Complex s(0, w);
    return 2.0 / (s * s + 0.6 * s + 1.0);
}

MeasuredResponse measured(const std::string& text, const MeasureOptions& options) {
    Measured session(text);
    session.simulation->start();
    return measure_response(*session.simulation, options);
}

/// What stands against it.
std::string refused_measurement(const std::string& text, const MeasureOptions& options) {
    try {
        measured(text, options);
    } catch (const RunError& error) {
        return error.what();
    }
    return "nothing";
}

} // namespace

TEST(MeasuredResponse, OfALinearLoopIsItsClosedForm) {
    const std::vector<double> omega{0.2, 1, 3, 7, 20};
    const auto closed =
        measured(measured_loop, {.from = "r", .to = "plant", .omega = omega, .tolerance = 1e-8});
    const auto loop = measured(measured_loop, {.loop = "gain", .omega = omega, .tolerance = 1e-8});
    ASSERT_EQ(closed.response.omega.size(), omega.size());
    for (std::size_t i = 0; i < omega.size(); ++i) {
        const double w = closed.response.omega[i];
        EXPECT_NEAR(w, omega[i], 2e-3 * omega[i]);
        const Complex L = 3.0 * plant_at(w);
        // What is left is the error of the solver, which is of the fourth order.
        EXPECT_LT(std::abs(closed.response.value[i] - L / (1.0 + L)), 2e-5 * std::abs(L / (1.0 + L))) << w;
        EXPECT_LT(std::abs(loop.response.value[i] - 3.0 * plant_at(loop.response.omega[i])),
                  2e-5 * std::abs(L));
        EXPECT_LT(closed.distortion[i], 1e-5);
        EXPECT_GT(closed.coherence[i], 1 - 1e-9);
        EXPECT_LE(closed.unsettled[i], 1e-8);
        EXPECT_NEAR(closed.response.magnitude[i], 20 * std::log10(std::abs(closed.response.value[i])), 1e-12);
    }
    EXPECT_LT(loop.response.phase.back(), -170); // unwrapped
}

TEST(MeasuredResponse, TakesOutADriftThatIsEven) {
    Measured session(measured_loop);
    *reinterpret_cast<double*>(session.simulation->inputs()[0].data) = 100;
    const auto found = measure_response(
        *session.simulation, {.from = "r", .to = "position", .omega = {1.0, 4.0}, .tolerance = 1e-7});
    for (std::size_t i = 0; i < 2; ++i) {
        const double w = found.response.omega[i];
        const Complex L = 3.0 * plant_at(w), expected = L / (1.0 + L) / Complex(0, w);
        EXPECT_LT(std::abs(found.response.value[i] - expected), 1e-4 * std::abs(expected));
        EXPECT_LT(found.distortion[i], 1e-3);
    }
}

TEST(MeasuredResponse, OfSampledBlocksIsThatOfTheirHits) {
    // 0.3/(z - 0.8) at 10 Hz, then 0.5/(z - 0.4) at 50 Hz, and the other way round.
    const std::string text = R"m(
model: rates
step: 0.01
inputs: [u]
blocks:
  slow: {block: DiscreteTransferFunction, numerator: 0.3, denominator: "[1 -0.8]", period: 0.1}
  then_fast: {block: DiscreteTransferFunction, numerator: 0.5, denominator: "[1 -0.4]", period: 0.02}
  fast: {block: DiscreteTransferFunction, numerator: 0.5, denominator: "[1 -0.4]", period: 0.02}
  then_slow: {block: DiscreteTransferFunction, numerator: 0.3, denominator: "[1 -0.8]", period: 0.1}
connections:
  u: [slow, fast]
  slow: then_fast
  fast: then_slow
)m";
    for (const double asked : {0.7, 5.0, 21.0}) {
        const auto both = [&](const std::string& to) {
            const auto found = measured(text, {.from = "u", .to = to, .omega = {asked}, .tolerance = 1e-11});
            return std::pair(found.response.omega[0], found.response.value[0]);
        };
        const auto [w, first] = both("then_slow");
        const auto slow = [w = w] { return 0.3 / (std::polar(1.0, w * 0.1) - 0.8); }();
        const auto fast = [w = w] { return 0.5 / (std::polar(1.0, w * 0.02) - 0.4); }();
        EXPECT_LT(std::abs(first - slow * fast), 1e-9) << w;
        // A value that is held for five hits counts in each of them.
        Complex held = 0;
        for (int i = 0; i < 5; ++i) held += std::polar(0.2, -w * 0.02 * i);
        EXPECT_LT(std::abs(both("then_fast").second - slow * held * fast), 1e-9) << w;
    }
}

TEST(MeasuredResponse, IsWhatLinearisingFindsBetweenAnySignals) {
    // Blocks that go on from their own outputs do so from what they computed, not from what is added there.
    Measured session(R"m(
model: loop
step: 0.1
inputs: [r]
blocks:
  error: {block: Sum, signs: +-}
  pi: {block: DiscretePID, P: 0.4, I: 0.5, D: 0.02, N: 5, period: 0.1}
  limit: {block: RateLimit, rising: 100, falling: -100, period: 0.1}
  plant: {block: DiscreteTransferFunction, numerator: 0.5, denominator: "[1 -0.6]", period: 0.1}
connections:
  r: error.u1
  error: pi
  pi: limit
  limit: plant
  plant: error.u2
)m");
    auto& run = *session.simulation;
    for (const std::string from : {"r", "error", "pi", "limit", "plant"})
        for (const std::string to : {"error", "pi", "limit", "plant", "plant.x"}) {
            const auto found =
                measure_response(run, {.from = from, .to = to, .omega = {3.0}, .tolerance = 1e-10});
            Simulation other(session.diagram);
            other.start();
            const auto system = linearize(other, {.from = {from}, .to = {to}});
            const auto expected = frequency_response(system, 0, 0, found.response.omega[0]);
            EXPECT_LT(std::abs(found.response.value[0] - expected), 1e-8) << from << " " << to;
        }
}

TEST(MeasuredResponse, OfALargeSignalIsTheDescribingFunction) {
    const std::string text = R"m(
model: nonlinear
step: 0.001
inputs: [u]
blocks:
  limit: {block: Saturate, lower: -1, upper: 1}
  switch: {block: Relay, on_point: 0, off_point: 0, on_value: 2, off_value: -2}
connections:
  u: [limit, switch]
)m";
    const auto to = [&](const std::string& block, double amplitude) {
        return measured(text, {.from = "u", .to = block, .omega = {2.0}, .amplitude = amplitude});
    };
    EXPECT_NEAR(to("limit", 0.9).response.value[0].real(), 1, 1e-12);
    for (const double a : {1.5, 4.0}) {
        const auto found = to("limit", a);
        const double expected = 2 / pi * (std::asin(1 / a) + 1 / a * std::sqrt(1 - 1 / (a * a)));
        EXPECT_NEAR(found.response.value[0].real(), expected, 1e-5);
        EXPECT_NEAR(found.response.value[0].imag(), 0, 1e-5);
    }
    const auto relay = to("switch", 5);
    EXPECT_NEAR(std::abs(relay.response.value[0]), 4 * 2 / (pi * 5), 1e-3);
    // Of a square wave.
    EXPECT_NEAR(relay.distortion[0], std::sqrt(pi * pi / 8 - 1), 1e-2);
    EXPECT_NEAR(relay.coherence[0], 8 / (pi * pi), 1e-2);
}

TEST(MeasuredResponse, MeasuresTheLoopOfAPlantThatIsUnstableByItself) {
    const auto found = measured(R"m(
model: unstable
step: 0.01
solver: rk4
blocks:
  plant: {block: TransferFunction, numerator: 1, denominator: "[1 -1]"}
  gain: {block: Gain, K: -3}
connections: {plant: gain, gain: plant}
)m",
                                {.loop = "gain", .omega = {0.5, 2, 8}, .tolerance = 1e-8});
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LT(std::abs(found.response.value[i] - 3.0 / Complex(-1, found.response.omega[i])), 1e-5);
}

TEST(MeasuredResponse, OfAChirpIsThatOfSines) {
    const std::vector<double> omega{0.5, 1, 1.3, 2, 4, 8};
    MeasureOptions options{.from = "r", .to = "plant", .omega = omega, .tolerance = 1e-6};
    options.excitation = MeasureOptions::Excitation::chirp;
    const auto found = measured(measured_loop, options);
    ASSERT_EQ(found.response.omega.size(), omega.size());
    for (std::size_t i = 0; i < omega.size(); ++i) {
        const Complex L = 3.0 * plant_at(found.response.omega[i]), expected = L / (1.0 + L);
        EXPECT_LT(std::abs(found.response.value[i] - expected), 2e-3 * std::abs(expected)) << omega[i];
        EXPECT_GT(found.coherence[i], 0.99);
        EXPECT_TRUE(std::isnan(found.distortion[i]));
    }
    // What a limit cuts off a chirp does not explain.
    options.from = "u";
    options.to = "limit";
    options.amplitude = 4;
    const auto limited = measured(R"m(
model: limit
step: 0.01
inputs: [u]
blocks:
  limit: {block: Saturate, lower: -1, upper: 1}
  lag: {block: DiscreteTransferFunction, numerator: 0.1, denominator: "[1 -0.9]", period: 0.01}
  error: {block: Sum, signs: +-}
connections: {u: error.u1, error: limit, limit: lag, lag: error.u2}
)m",
                                  options);
    EXPECT_LT(*std::min_element(limited.coherence.begin(), limited.coherence.end()), 0.96);
}

TEST(MeasuredResponse, LeavesTheRunWhereItWas) {
    Measured touched(measured_loop), left(measured_loop);
    for (auto* session : {&touched, &left}) {
        *reinterpret_cast<double*>(session->simulation->inputs()[0].data) = 1;
        session->trace("plant", 30);
    }
    measure_response(*touched.simulation, {.from = "r", .to = "plant", .omega = {1.0, 5.0}});
    EXPECT_EQ(touched.trace("plant", 50), left.trace("plant", 50));
    EXPECT_THROW(measure_response(*touched.simulation, {.from = "r", .to = "plant", .omega = {1e4}}),
                 RunError);
    EXPECT_EQ(touched.trace("plant", 50), left.trace("plant", 50));
}

TEST(MeasuredResponse, OfALoopThatIsUnstableWhenClosedIsRefused) {
    std::string text = measured_loop;
    text.replace(text.find("[1 0.6 1]"), 9, "[1 0.6 -9]"); // 1 + L has a zero at 1.44 rad/s
    const auto refusal = refused_measurement(text, {.loop = "gain", .omega = {1.0, 3.0}});
    EXPECT_EQ(refusal.find("what comes back grows without end: the closed loop is unstable"), 0u) << refusal;
}

TEST(MeasuredResponse, SaysWhereItHadNotSettled) {
    // It rings for some 1000 s.
    const std::string slow = "model: slow\nstep: 0.1\nsolver: rk4\ninputs: [u]\nblocks:\n"
                             "  lag: {block: TransferFunction, numerator: 1, denominator: \"[1 0.002 2]\"}\n"
                             "connections: {u: lag}\n";
    const auto found = measured(slow, {.from = "u", .to = "lag", .omega = {1.0}, .most_periods = 8});
    EXPECT_GT(found.unsettled[0], 1e-4);
}

TEST(MeasuredResponse, RefusesByName) {
    const auto expect = [](const std::string& refusal, const std::string& part) {
        EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
    };
    expect(refused_measurement(measured_loop, {.from = "r", .to = "plnat", .omega = {1}}),
           "no signal or state 'plnat'; did you mean 'plant'");
    expect(refused_measurement(measured_loop, {.from = "plant.x[1]", .to = "plant", .omega = {1}}),
           "'plant.x[1]' is a state, to which nothing is added");
    expect(refused_measurement(measured_loop, {.from = "r", .to = "plant.x", .omega = {1}}),
           "'plant.x' has 2 elements; name one of them, as 'plant.x[1]'");
    expect(refused_measurement(measured_loop, {.from = "r", .to = "plant", .omega = {400}}),
           "below half of the sampling frequency, here 314.159265 rad/s, not at 400");
    expect(refused_measurement(measured_loop, {.from = "r", .to = "plant"}), "name frequencies");
    expect(refused_measurement(measured_loop, {.from = "r", .to = "plant", .omega = {1}, .amplitude = NAN}),
           "amplitude");
    expect(refused_measurement(measured_loop, {.loop = "r", .omega = {1}}), "no loop goes through 'r'");
    const std::string constant = "model: c\nstep: 0.1\nblocks:\n  one: {block: Constant, value: 1}\n"
                                 "  two: {block: Gain, K: 2}\n  i: {block: DiscreteIntegrator}\n"
                                 "connections: {one: two, two: i}\n";
    expect(refused_measurement(constant, {.from = "one", .to = "i", .omega = {1}}), "'two', which reads it");
    EXPECT_NEAR(std::abs(measured(constant, {.from = "two", .to = "i", .omega = {1}}).response.value[0]), 1,
                1e-2);
}

} // namespace bf::analysis::test

// Continuous blocks in running diagrams, against closed forms and scipy 1.17.1.
#include "../../engine/test/support.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <string>

using namespace bf;
using namespace bf::test;

namespace {

/// Time and a signal, as observers see them.
class Log final : public Simulation::Observer {
  public:
    Log(Session& session, const std::string& path, int element = 0)
        : end_(session.diagram.find_signal(path)), element_(element) {
        if (end_.node < 0) throw std::runtime_error("no signal " + path);
        session.simulation->add_observer(*this);
    }
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const Simulation&>(run);
        const Slot& slot = simulation.diagram().slot(end_);
        times.push_back(simulation.time());
        values.push_back(read_value(simulation.context().data(end_.node, end_.slot), slot.type, element_));
    }
    /// The last value seen at that time.
    double at(double t) const {
        double value = std::nan("");
        for (std::size_t k = 0; k < times.size(); ++k)
            if (std::abs(times[k] - t) < 1e-9) value = values[k];
        return value;
    }
    /// When the value jumped by more than `height`.
    Values jumps(double height) const {
        Values found;
        for (std::size_t k = 1; k < values.size(); ++k)
            if (std::abs(values[k] - values[k - 1]) > height) found.push_back(times[k]);
        return found;
    }
    Values times, values;

  private:
    Node::End end_;
    int element_;
};

std::string diagram(double step, const std::string& solver, const std::string& blocks,
                    const std::string& connections) {
    return "model: m\nstep: " + std::to_string(step) + "\nstop: 10\nsolver: " + solver + "\nblocks:\n" +
           blocks + "connections: {" + connections + "}\n";
}

/// The trajectory of a signal up to a time.
struct Trajectory {
    Session session;
    Log log;
    Trajectory(const std::string& text, const std::string& path, double until)
        : session(text), log(session, path) {
        while (session.simulation->time() <= until + 1e-9)
            if (!session.simulation->step()) throw std::runtime_error(session.simulation->failure());
    }
    double operator()(double t) const { return log.at(t); }
};

} // namespace

TEST(ZeroPole, HasTheStepResponseOfScipy) {
    // signal.step(signal.ZerosPolesGain([-3], [-1, -1+2j, -1-2j], 2), T=np.linspace(0, 2, 5))
    const Trajectory y(diagram(0.01, "rk4",
                               "  u: {block: Constant}\n"
                               "  h: {block: ZeroPole, zeros: -3, poles: \"[-1 0; -1 2; -1 -2]\", gain: 2}\n",
                               "u: h"),
                       "h", 2);
    const Values expected{0.0, 0.22170058655613084, 0.6620318344198455, 1.0021563987148827,
                          1.1438101737104678};
    for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(y(0.5 * double(k)), expected[k], 1e-8) << k;
}

TEST(TransferFunction, HasTheStepResponseOfScipyOnEveryElement) {
    // signal.step(signal.TransferFunction([2, 0, 1], [1, 3, 2]), T=np.linspace(0, 2, 5))
    Session session(diagram(0.01, "rk4",
                            "  u: {block: Constant, value: [1, -2]}\n"
                            "  h: {block: TransferFunction, numerator: [2, 0, 1], denominator: [1, 3, 2]}\n",
                            "u: h"));
    const Log first(session, "h", 0), second(session, "h", 1);
    session.trace("h", 201);
    const Values expected{2.0, 0.33586550613359, 0.005370451050429992, 0.054651327210098355,
                          0.17641452528946555};
    for (std::size_t k = 0; k < expected.size(); ++k) {
        EXPECT_NEAR(first.at(0.5 * double(k)), expected[k], 1e-8) << k;
        EXPECT_NEAR(second.at(0.5 * double(k)), -2 * expected[k], 1e-8) << k;
    }
}

TEST(StateSpace, BreaksLoopsWithoutFeedthrough) {
    // d²y/dt² = -y around two integrators in state space
    const Trajectory y(diagram(0.01, "rk4",
                               "  p: {block: StateSpace, A: [[0, 1], [0, 0]], B: \"[0; 1]\", C: [1, 0], "
                               "initial: [1, 0]}\n  k: {block: Gain, K: -1}\n",
                               "p: k, k: p"),
                       "p", 1);
    EXPECT_NEAR(y(1), std::cos(1), 1e-9);
}

TEST(StateSpace, OfFirstOrderHasNumbersForMatrices) {
    const Trajectory y(
        diagram(0.01, "rk4",
                "  u: {block: Constant, value: 3}\n  p: {block: StateSpace, A: -2, B: 4, C: 0.5}\n"
                "  e: {block: Terminator}\n",
                "u: p, p: e"),
        "p", 1);
    EXPECT_NEAR(y(1), 3 * (1 - std::exp(-2)), 1e-8); // y + y'/2 = u
}

TEST(FilteredDerivative, LagsTheSlope) {
    const Trajectory y(diagram(0.001, "rk4",
                               "  t: {block: Clock}\n  d: {block: FilteredDerivative, time_constant: 0.1}\n",
                               "t: d"),
                       "d", 0.3);
    for (const double t : {0.0, 0.05, 0.3}) EXPECT_NEAR(y(t), 1 - std::exp(-t / 0.1), 1e-9);
}

TEST(Derivative, IsTheQuotientOverTheLastStep) {
    const Trajectory y(diagram(0.1, "rk4",
                               "  t: {block: Clock}\n  s: {block: Square}\n  d: {block: Derivative}\n"
                               "  x: {block: Integrator}\n",
                               "t: [s, x], s: d"),
                       "d", 1);
    EXPECT_EQ(y(0), 0);
    for (int k = 1; k <= 10; ++k) EXPECT_NEAR(y(0.1 * k), 2 * 0.1 * k - 0.1, 1e-12); // (t² - (t-h)²)/h
}

TEST(TransportDelay, IsTheSignalEarlier) {
    const std::string blocks =
        "  t: {block: Clock}\n  s: {block: Sine, frequency: 3}\n"
        "  d: {block: TransportDelay, delay: 0.123, initial: -7}\n  x: {block: Integrator}\n";
    const Trajectory y(diagram(0.01, "rk4", blocks, "s: d, d: x"), "d", 1);
    EXPECT_EQ(y(0.1), -7);
    for (const double t : {0.13, 0.5, 1.0}) EXPECT_NEAR(y(t), std::sin(3 * (t - 0.123)), 9 * 1e-4 / 8 * 1.1);
}

TEST(TransportDelay, BreaksLoopsAndAnswersADelayDifferentialEquation) {
    // dx/dt = -x(t - 1), x = 1 before 0: x = 1 - t up to 1, then 1 - t + (t - 1)²/2 up to 2
    const Trajectory x(diagram(0.01, "rk4",
                               "  x: {block: Integrator, initial: 1}\n  k: {block: Gain, K: -1}\n"
                               "  d: {block: TransportDelay, delay: 1, initial: 1}\n",
                               "x: d, d: k, k: x"),
                       "x", 2);
    for (const double t : {0.5, 1.0}) EXPECT_NEAR(x(t), 1 - t, 1e-9);
    EXPECT_NEAR(x(2), -0.5, 1e-4);
}

TEST(TransportDelay, StopsWhenItsBufferIsTooShort) {
    Session session(diagram(0.01, "rk4",
                            "  t: {block: Clock}\n  d: {block: TransportDelay, delay: 0.5, buffer: 20}\n"
                            "  x: {block: Integrator}\n",
                            "t: d, d: x"));
    try {
        session.trace("d", 100);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(),
                     "d: the delay is longer than the buffer holds: give 'buffer' more samples");
    }
}

TEST(TransportDelay, GoesOnFromASnapshot) {
    const std::string text =
        diagram(0.01, "rk4",
                "  s: {block: Sine}\n  d: {block: TransportDelay, delay: 0.2, buffer: 30}\n"
                "  x: {block: Integrator}\n",
                "s: d, d: x");
    Session session(text);
    session.trace("x", 100);
    const auto snapshot = session.simulation->snapshot();
    const Values on = session.trace("x", 50);
    session.simulation->restore(snapshot);
    EXPECT_EQ(session.trace("x", 50), on);
}

std::string pid(const std::string& settings, const std::string& block = "PID") {
    return diagram(0.001, "rk4",
                   "  e: {block: Constant}\n  c: {block: " + block + ", P: 0, I: 1, upper: 1" + settings +
                       "}\n",
                   "e: c");
}

TEST(PID, IntegratesNoFurtherThanItsAntiWindupLets) {
    // back-calculation: dx/dt = 1 + (1 - x)/T_t beyond the limit
    Session back(pid(", tracking_time: 0.5")), clamps(pid(", anti_windup: clamping")),
        none(pid(", anti_windup: none"));
    const auto integral = [](Session& session) {
        session.trace("c", 3000);
        const int node = session.diagram.find_node("c");
        const auto& d = session.diagram.nodes[static_cast<std::size_t>(node)].block->declaration();
        return read_value(session.simulation->context().data(node, d.find("x_i")), Type::float64, 0);
    };
    EXPECT_NEAR(integral(back), 1 + 0.5 * (1 - std::exp(-2 / 0.5)), 1e-4);
    EXPECT_NEAR(integral(clamps), 1, 2e-3);
    EXPECT_NEAR(integral(none), 3, 1e-9);
}

TEST(PID2, EqualsPIDOfTheDifferenceWithUnitWeights) {
    const std::string settings = ", P: 2, I: 3, D: 0.5, N: 20";
    const Trajectory one(diagram(0.01, "rk4",
                                 "  r: {block: Sine}\n  m: {block: Constant, value: 0.3}\n"
                                 "  e: {block: Sum, signs: +-}\n  c: {block: PID" +
                                     settings + "}\n",
                                 "r: e.u1, m: e.u2, e: c"),
                         "c", 2);
    const Trajectory two(diagram(0.01, "rk4",
                                 "  r: {block: Sine}\n  m: {block: Constant, value: 0.3}\n  c: {block: PID2" +
                                     settings + "}\n",
                                 "r: c.r, m: c.m"),
                         "c", 2);
    for (const double t : {0.0, 0.5, 2.0}) EXPECT_NEAR(two(t), one(t), 1e-12);
}

TEST(PID, BeginsAnewAtAReset) {
    const Trajectory y(diagram(0.01, "rk4",
                               "  e: {block: Constant}\n  s: {block: Step, time: 1}\n"
                               "  c: {block: PID, P: 0, I: 1, initial: 5, reset: rising}\n",
                               "e: c.e, s: c.reset"),
                       "c", 2);
    EXPECT_NEAR(y(0.99), 5.99, 1e-9);
    EXPECT_NEAR(y(1), 5, 1e-9);
    EXPECT_NEAR(y(1.5), 5.5, 1e-9);
}

TEST(PID, FiltersItsDerivativeAnewAfterAReset) {
    const Trajectory y(diagram(0.01, "rk4",
                               "  e: {block: Constant}\n  s: {block: Step, time: 1}\n"
                               "  c: {block: PID, P: 0, D: 2, N: 3, reset: rising}\n",
                               "e: c.e, s: c.reset"),
                       "c", 2);
    // D N / (s + N) s of a unit step that begins with the filter at rest.
    for (const double t : {0.0, 0.5, 0.99}) EXPECT_NEAR(y(t), 6 * std::exp(-3 * t), 1e-7) << t;
    for (const double t : {1.0, 1.5}) EXPECT_NEAR(y(t), 6 * std::exp(-3 * (t - 1)), 1e-7) << t;
}

TEST(LimitedIntegrator, LeavesALimitAsSoonAsItsInputTurns) {
    // ∫ cos t held at 0.5: from t = π/2 on it falls with sin t - 1
    const Trajectory y(diagram(0.01, "dormand_prince45",
                               "  u: {block: Sine, phase: pi/2}\n"
                               "  x: {block: LimitedIntegrator, upper: 0.5, saturation_port: true}\n",
                               "u: x"),
                       "x.y", 3);
    EXPECT_NEAR(y(0.5), std::sin(0.5), 1e-7);
    EXPECT_NEAR(y(1.2), 0.5, 1e-7);
    EXPECT_NEAR(y(3), 0.5 + std::sin(3.0) - 1, 1e-5);
}

TEST(LimitedIntegrator, TellsWhereItIsAtALimit) {
    const Trajectory s(diagram(0.01, "dormand_prince45",
                               "  u: {block: Constant}\n"
                               "  x: {block: LimitedIntegrator, upper: 0.5, saturation_port: true}\n",
                               "u: x"),
                       "x.saturation", 1);
    EXPECT_EQ(s(0.49), 0);
    EXPECT_EQ(s(0.51), 1);
}

TEST(LimitedIntegrator, ResetsAtTheInstantOfTheEdge) {
    for (const char* solver : {"rk4", "dormand_prince45"}) {
        // A sawtooth: reset at x = 1 through the state port, which makes no loop.
        const Trajectory y(diagram(0.01, solver,
                                   "  u: {block: Constant, value: 4}\n"
                                   "  x: {block: LimitedIntegrator, reset: rising, state_port: true}\n"
                                   "  c: {block: CompareToConstant, operator: '>=', constant: 1}\n",
                                   "u: x.u, x.state: c, c: x.reset"),
                           "x.y", 1);
        const Values resets = y.log.jumps(0.5);
        ASSERT_GE(resets.size(), 3u) << solver;
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(resets[k], 0.25 * double(k + 1), 0.03) << solver;
    }
}

TEST(LimitedIntegrator, BeginsAtAnExternalValue) {
    const Trajectory y(
        diagram(0.1, "rk4",
                "  u: {block: Constant}\n  s: {block: Step, time: 1}\n"
                "  i: {block: Constant, value: 3}\n"
                "  x: {block: LimitedIntegrator, reset: rising, initial_source: external, upper: 3.5}\n",
                "u: x.u, i: x.x0, s: x.reset"),
        "x.y", 2);
    EXPECT_NEAR(y(0), 3, 1e-12);
    EXPECT_NEAR(y(0.3), 3.3, 1e-12);
    EXPECT_NEAR(y(0.9), 3.5, 1e-12);
    EXPECT_NEAR(y(1), 3, 1e-12);
    EXPECT_NEAR(y(1.4), 3.4, 1e-12);
}

TEST(SecondOrderIntegrator, StopsAtItsLimit) {
    // free fall from 1 m to the floor
    Session session(diagram(0.01, "dormand_prince45",
                            "  g: {block: Constant, value: -9.81}\n"
                            "  b: {block: SecondOrderIntegrator, initial_x: 1, lower_x: 0}\n",
                            "g: b"));
    const Log x(session, "b.x"), v(session, "b.v");
    session.trace("b.x", 101);
    EXPECT_NEAR(x.at(0.3), 1 - 9.81 * 0.09 / 2, 1e-7);
    EXPECT_NEAR(v.at(0.3), -9.81 * 0.3, 1e-7);
    EXPECT_NEAR(x.at(1), 0, 1e-7);
    EXPECT_NEAR(v.at(1), 0, 1e-12);
}

TEST(Guards, EndAdaptiveStepsAtKinks) {
    // ∫ |sin πt| is 2/π per half period; a step across a kink would not meet it.
    const Trajectory x(
        diagram(0.5, "dormand_prince45\nrelative_tolerance: 1e-10",
                "  s: {block: Sine, frequency: pi}\n  a: {block: Abs}\n  x: {block: Integrator}\n",
                "s: a, a: x"),
        "x", 4);
    for (const double t : {1.0, 2.0, 3.0, 4.0}) EXPECT_NEAR(x(t), 2 * t / M_PI, 1e-6) << t;
}

TEST(Relay, SwitchesAtTheInstantInContinuousTime) {
    // dx/dt = ±1 by a relay between -0.3 and 0.3: a triangle of period 1.2
    const Trajectory x(
        diagram(0.25, "dormand_prince45",
                "  x: {block: Integrator}\n"
                "  r: {block: Relay, on_point: 0.3, off_point: -0.3, on_value: -1, off_value: 1}\n",
                "x: r, r: x"),
        "x", 5);
    for (int k = 0; k < 20; ++k) {
        const double t = 0.25 * k, phase = std::fmod(t + 0.3, 1.2);
        EXPECT_NEAR(x(t), phase < 0.6 ? phase - 0.3 : 0.9 - phase, 1e-3) << t;
    }
}

TEST(HitCrossing, IsTrueAtTheInstantOfTheCrossing) {
    const Trajectory y(diagram(0.25, "dormand_prince45",
                               "  x: {block: Integrator}\n  u: {block: Constant}\n"
                               "  h: {block: HitCrossing, level: 0.6}\n",
                               "u: x, x: h"),
                       "h", 1);
    const Values jumps = y.log.jumps(0.5);
    ASSERT_FALSE(jumps.empty());
    EXPECT_NEAR(jumps[0], 0.6, 1e-6);
}

TEST(FirstOrderHold, GoesOnAsTheLastTwoSamplesLead) {
    // Samples of t^2 at 0, 1, 2, ...: from t_k = k on y = k^2 + (2k - 1)(t - k).
    for (const std::string solver : {"rk4", "dormand_prince45"}) {
        Session run("model: m\nstep: 0.25\nsolver: " + solver +
                    "\nblocks:\n  t: {block: Clock}\n  u: {block: Square}\n"
                    "  y: {block: FirstOrderHold, interval: 1}\n  x: {block: Integrator}\n"
                    "connections: {t: u, u: y, y: x}");
        Log y(run, "y"), x(run, "x");
        run.trace("y", 17);
        for (int i = 0; i < 17; ++i) {
            const double t = 0.25 * i, k = std::floor(t);
            EXPECT_NEAR(y.at(t), k * k + (k < 1 ? 0 : 2 * k - 1) * (t - k), 1e-12) << solver << " " << t;
        }
        // The integral over [1, 2] is 1 + 1/2, over [2, 3] 4 + 3/2, over [3, 4] 9 + 5/2.
        EXPECT_NEAR(x.at(4), 0 + 1.5 + 5.5 + 11.5, 1e-9) << solver;
    }
}

TEST(Derivative, InsideAStepIsTheQuotientSinceItsBegin) {
    // u = t^2 in steps of 1: y(t) = (t^2 - k^2) / (t - k) = t + k inside, and 2k - 1 at k itself.
    Session run("model: m\nstep: 1\nsolver: heun\nblocks:\n  t: {block: Clock}\n  u: {block: Square}\n"
                "  y: {block: Derivative}\n  x: {block: Integrator}\nconnections: {t: u, u: y, y: x}\n");
    Log y(run, "y"), x(run, "x");
    run.trace("y", 4);
    EXPECT_EQ(y.values, (Values{0, 1, 3, 5}));
    EXPECT_EQ(x.values, (Values{0, 0.5, 2.5, 6.5})); // heun takes the mean of both ends
}

// Continuous states beside discrete ones, against closed forms.
#include "support.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

using namespace bf;
using namespace bf::test;

namespace {

std::string oscillator(const std::string& solver) {
    return "model: oscillator\nstep: 0.01\nsolver: " + solver +
           "\nvariables: {w: 2*pi}\nblocks:\n  v: {block: Integrator}\n  x: {block: Integrator, initial: 1}\n"
           "  k: {block: Gain, K: -w^2}\n  d: {block: UnitDelay, period: 0.1}\n"
           "connections: {x: [k, d], k: v, v: x}\n";
}

/// A signal at each step, as observers see it.
class Trace final : public Simulation::Observer {
  public:
    Trace(Session& session, const std::string& path) : end_(session.diagram.find_signal(path)) {
        session.simulation->add_observer(*this);
    }
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const Simulation&>(run);
        if (simulation.time() == time_) values.pop_back(); // what an event changed
        time_ = simulation.time();
        values.push_back(*static_cast<const double*>(simulation.context().data(end_.node, end_.slot)));
    }
    Values values;

  private:
    Node::End end_;
    double time_ = -1;
};

Values observed(Session& run, const std::string& path, int steps) {
    Trace trace(run, path);
    run.trace(path, steps);
    return trace.values;
}

double largest_error(const std::string& solver) {
    Session run(oscillator(solver));
    const Values x = observed(run, "x", 200);
    double largest = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
        largest = std::max(largest,
                           std::abs(x[k] - std::cos(2 * std::numbers::pi * 0.01 * static_cast<double>(k))));
    return largest;
}

} // namespace

TEST(Continuous, SolversConvergeInTheOrderOfTheirNames) {
    double before = 1;
    for (const auto* solver : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"}) {
        const double error = largest_error(solver);
        EXPECT_LT(error, before) << solver;
        before = error;
    }
    EXPECT_LT(before, 1e-8);
}

TEST(Continuous, OutputsInsideAStepAreThoseOfTheMinorTime) {
    // dx/dt = t, whose integral t^2/2 every method of order 2 meets exactly.
    Session run("model: m\nstep: 0.5\nsolver: heun\nblocks:\n  t: {block: Clock}\n  x: {block: Integrator}\n"
                "connections: {t: x}\n");
    EXPECT_EQ(observed(run, "x", 4), (Values{0, 0.125, 0.5, 1.125}));
}

TEST(Continuous, OutputsAfterAStepAreWhatObserversSawLast) {
    for (const std::string solver : {"euler", "rk4", "dormand_prince45", "cvode_bdf"}) {
        Session run("model: ball\nstep: 0.1\nsolver: " + solver +
                    "\nblocks:\n  g: {block: Constant, value: -10}\n"
                    "  v: {block: LimitedIntegrator, reset: falling, initial_source: external}\n"
                    "  up: {block: Step, period: 0.1, time: 0.1, after: 3}\n"
                    "  h: {block: Integrator, initial: 1}\n  k: {block: Gain, K: 2}\n"
                    "connections: {g: v.u, up: v.x0, v: h, h: [v.reset, k]}\n");
        Trace v(run, "v"), k(run, "k");
        bool has_bounced = false;
        for (int step = 0; step < 8; ++step) {
            ASSERT_TRUE(run.simulation->step()) << run.simulation->failure();
            EXPECT_EQ(run("v"), v.values.back()) << solver << step;
            EXPECT_EQ(run("k"), k.values.back()) << solver << step;
            has_bounced = has_bounced || run("v") > 0;
        }
        EXPECT_TRUE(has_bounced) << solver;
        run.simulation->leave_outputs_of_solver();
        ASSERT_TRUE(run.simulation->step()) << run.simulation->failure();
        EXPECT_EQ(run("v") == v.values.back(), solver == "euler") << solver; // evaluates nothing inside
    }
}

TEST(Continuous, DiscreteBlocksHoldTheirOutputInsideAStep) {
    // x' = the staircase 0, 0, 0, 0, 1, 1, 2, 2 that the delayed sampler makes of time in steps of 0.5.
    Session run("model: m\nstep: 0.5\nsolver: euler\nblocks:\n  t: {block: Clock}\n  d: {block: UnitDelay, "
                "period: 1}\n"
                "  x: {block: Integrator}\nconnections: {t: d, d: x}\n");
    EXPECT_EQ(observed(run, "x", 8), (Values{0, 0, 0, 0, 0, 0.5, 1, 2}));
}

TEST(Continuous, TransferFunctionsFollowTheirStepResponse) {
    // 4/(s^2 + 0.8 s + 4): y = 1 - exp(-d t) (cos w t + d/w sin w t), d = 0.4, w = sqrt(4 - d^2).
    Session run("model: m\nstep: 0.01\nblocks:\n  u: {block: Constant, value: 1}\n"
                "  H: {block: TransferFunction, numerator: [4], denominator: [1, 0.8, 4]}\n"
                "  S: {block: StateSpace, A: [[0, 1], [-4, -0.8]], B: \"[0; 4]\", C: [1, 0]}\n"
                "connections: {u: [H, S]}\n");
    Trace S(run, "S");
    const Values H = observed(run, "H", 300);
    for (std::size_t k = 0; k < H.size(); ++k) {
        const double t = 0.01 * static_cast<double>(k), d = 0.4, w = std::sqrt(4 - d * d);
        const double exact = 1 - std::exp(-d * t) * (std::cos(w * t) + d / w * std::sin(w * t));
        ASSERT_NEAR(H[k], exact, 1e-8) << t;
        ASSERT_NEAR(S.values[k], exact, 1e-8) << t;
    }
}

TEST(Continuous, ProperTransferFunctionsPassTheInputDirectly) {
    Session run(
        "model: m\nstep: 0.1\nblocks:\n  u: {block: Constant, value: 2}\n"
        "  H: {block: TransferFunction, numerator: [3, 0], denominator: [1, 0]}\nconnections: {u: H}\n");
    EXPECT_EQ(observed(run, "H", 3), (Values{6, 6, 6}));
}

TEST(Continuous, LimitedIntegratorsLeaveTheLimitAtOnce) {
    Session run(
        "model: m\nstep: 0.1\nsolver: euler\nblocks:\n  u: {block: Step, time: 1, before: 1, after: -1}\n"
        "  x: {block: LimitedIntegrator, upper: 0.45}\nconnections: {u: x}\n");
    const Values x = observed(run, "x", 13);
    EXPECT_DOUBLE_EQ(x[9], 0.45);
    EXPECT_LT(x[12], 0.45);
}

TEST(Continuous, TrackingKeepsAPidFromWindingUp) {
    // Plant 1/(s + 1), control signal within 1: the reference 2 is out of reach; at t = 5 it falls to 0.5.
    const auto plant = [](const std::string& tracking_time) {
        Session run("model: m\nstep: 0.01\nblocks:\n  r: {block: Step, time: 5, before: 2, after: 0.5}\n"
                    "  e: {block: Sum, signs: +-}\n"
                    "  c: {block: PID, P: 2, I: 2, lower: -1, upper: 1, tracking_time: " +
                    tracking_time +
                    "}\n  plant: {block: TransferFunction, numerator: [1], denominator: [1, 1]}\n"
                    "connections: {r: e.u1, plant: e.u2, e: c, c: plant}\n");
        return observed(run, "plant", 1100);
    };
    const Values tracked = plant("0.2"), wound_up = plant("1e9");
    EXPECT_NEAR(tracked[499], 1, 0.01);
    EXPECT_NEAR(tracked[1099], 0.5, 0.01);
    // The integral of the error, some 10, keeps the other one at its limit for seconds.
    EXPECT_LT(tracked[700], 0.7);
    EXPECT_GT(wound_up[700], 0.95);
}

TEST(Continuous, StatesOfADisabledSubsystemStayWhereTheyAre) {
    Session run(R"m(
model: m
step: 0.25
blocks:
  on: {block: Pulse, delay: 0.5, period: 0.25}
  s:
    execution: enabled
    outputs: [y]
    blocks:
      one: {block: Constant, value: 1}
      x: {block: Integrator}
    connections: {one: x, x: y}
connections: {on: s.enable}
)m");
    const Values y = observed(run, "s.y", 9), expected{0, 0, 0, 0.25, 0.5, 0.5, 0.5, 0.75, 1};
    for (std::size_t k = 0; k < y.size(); ++k) EXPECT_NEAR(y[k], expected[k], 1e-12) << k;
}

TEST(Continuous, AStateThatBecomesNanEndsTheRunByName) {
    Session run(
        "model: m\nstep: 1\nblocks:\n  a: {block: Clock}\n  g: {block: Fcn, expression: (u - u)/(u - u)}\n"
        "  x: {block: Integrator}\nconnections: {a: g, g: x}\n");
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(
        run.simulation->failure(),
        "x: a continuous state became NaN or infinite: look for a division by zero, a value out of range "
        "or a model that diverges, or give a smaller step");
}

TEST(Continuous, AStateThatGrowsBeyondAllNumbersEndsTheRunByName) {
    const auto failure = [](const std::string& solver, const std::string& slope) {
        Session run("model: m\nstep: 1\nsolver: " + solver +
                    "\nblocks:\n  t: {block: Clock}\n  fine: {block: Integrator}\n"
                    "  x: {block: Integrator, initial: 1}\n  g: {block: " +
                    slope + "}\nconnections: {x: g, g: x, t: fine}\n");
        for (int k = 0; k < 200 && run.simulation->step(); ++k) {
        }
        return run.simulation->failure();
    };
    const std::string told = "x: a continuous state became NaN or infinite";
    for (const std::string solver : {"euler", "heun", "bogacki_shampine", "rk4", "dormand_prince"})
        EXPECT_EQ(failure(solver, "Gain, K: 1e3").substr(0, told.size()), told) << solver;
    // x' = x² has no solution beyond t = 1; solvers that choose their steps give up before it.
    for (const std::string solver : {"dormand_prince45", "cvode_adams", "cvode_bdf"})
        EXPECT_EQ(failure(solver, "Square").substr(0, 3), "x: ") << solver;
}

TEST(Continuous, SnapshotsGoOnBitForBit) {
    Session run(oscillator("rk4"));
    run.trace("x", 37);
    const auto snapshot = run.simulation->snapshot();
    const Values first = run.trace("x", 50);
    run.simulation->restore(snapshot);
    EXPECT_EQ(run.trace("x", 50), first);
}

TEST(Continuous, UnknownSolversAreRefusedWithTheKnownOnes) {
    try {
        Session run(oscillator("ode45"));
        FAIL();
    } catch (const model::Errors& errors) {
        EXPECT_STREQ(errors.what(),
                     "m.yaml:3:9: there is no solver 'ode45'; solvers: euler, heun, "
                     "bogacki_shampine, rk4, dormand_prince, dormand_prince45, cvode_bdf, cvode_adams");
    }
}

TEST(Continuous, AnExternalInitialValueCountsInTheFirstStepAlone) {
    // x0 = t; what integrates the limited integral sees no motion inside the first step either.
    for (const auto* solver : {"rk4", "dormand_prince45"}) {
        Session run(std::string("model: m\nstep: 1\nsolver: ") + solver +
                    "\nblocks:\n  t: {block: Clock}\n  zero: {block: Constant, value: 0}\n"
                    "  y: {block: LimitedIntegrator, initial_source: external}\n  x: {block: Integrator}\n"
                    "connections: {t: y.x0, zero: y.u, y: x}\n");
        EXPECT_EQ(observed(run, "x", 3), (Values{0, 0, 0})) << solver;
    }
}

TEST(Rates, ASourceWithAPeriodJumpsAtASample) {
    // The integral of a step at 0.25 s, inside a base step or at the next sample.
    const auto integral = [](const std::string& period) {
        Session run("model: m\nstep: 0.1\nsolver: dormand_prince45\nblocks:\n  u: {block: Step, time: 0.25" +
                    period + "}\n  x: {block: Integrator}\nconnections: {u: x}\n");
        return observed(run, "x", 11).back(); // at 1 s
    };
    EXPECT_NEAR(integral(""), 0.75, 1e-6);
    EXPECT_NEAR(integral(", period: 0.1"), 0.7, 1e-9);
}

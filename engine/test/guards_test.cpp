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

/// When 1 + 0.3 t² passes a level.
double passing(double level) { return std::sqrt((level - 1) / 0.3); }

/// The integral of its part above a level, to 4 s.
double integral_above(double level) {
    const auto to = [&](double t) { return 0.1 * t * t * t - (level - 1) * t; };
    return to(4) - to(level > 1 ? passing(level) : 0);
}

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
        {"Round, function: floor", input, times_of([](int k) { return passing(k + 1); })},
        {"Round", input, times_of([](int k) { return passing(k + 0.5); })},
        {"Fcn, expression: 'mod(u, 0.7)'", input, times_of([](int k) { return passing(0.7 * (k + 1)); })},
        {"Fcn, expression: 'min(u, 3) + (u > 4)*abs(u - 5)'", input, {passing(3), passing(4), passing(5)}},
        {"Fcn, expression: 'atan2(u - 3, -1)'", input, {passing(3)}},
        {"Lookup1D, breakpoints: [1.5, 2, 4.5], table: [0, 1, 2]",
         input,
         {passing(1.5), passing(2), passing(4.5)}},
        {"Lookup1D, breakpoints: [1.5, 2, 4.5], table: [0, 1, 2], interpolation: nearest",
         input,
         {passing(1.75), passing(3.25)}},
        {"DirectLookup, table: [1, 4, 2, 3]", "u: y.i1, ", {passing(2), passing(3), passing(4)}},
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

TEST(Events, OfStandardBlocksKeepTheirIntegrals) {
    const double T = 4, of_input = T + 0.1 * T * T * T;
    const auto of_jumps = [&](double first, double interval) {
        double sum = 0;
        for (double level = first; passing(level) < T; level += interval) sum += T - passing(level);
        return sum;
    };
    const struct {
        std::string block;
        double integral;
    } cases[] = {
        {"Round, function: floor", T + of_jumps(2, 1)},
        {"Round", T + of_jumps(1.5, 1)},
        {"Fcn, expression: 'mod(u, 0.7)'", of_input - 0.7 * (T + of_jumps(1.4, 0.7))},
        {"Fcn, expression: 'abs(u - 3)'", -(of_input - 3 * T) + 2 * integral_above(3)},
        {"Fcn, expression: 'max(u, 2) + (u >= 4)'", 2 * T + integral_above(2) + T - passing(4)},
        {"Lookup1D, breakpoints: [0, 2, 3, 5], table: [0, 1, -1, 1]",
         of_input / 2 - 2.5 * integral_above(2) + 3 * integral_above(3) - integral_above(5)},
        {"Lookup1D, breakpoints: [0, 2, 3, 5], table: [0, 1, -1, 1], interpolation: flat",
         T - passing(2) - 2 * (T - passing(3)) + 2 * (T - passing(5))},
    };
    for (const std::string solver : adaptive_solvers)
        for (const auto& [block, integral] : cases) {
            Session run("model: m\nstep: 4\nsolver: " + solver +
                        "\nrelative_tolerance: 1e-8\nabsolute_tolerance: 1e-10"
                        "\nblocks:\n  t: {block: Clock}\n"
                        "  u: {block: Polynomial, coefficients: [0.3, 0, 1]}\n  y: {block: " +
                        block + "}\n  x: {block: Integrator}\nconnections: {t: u, u: y, y: x}\n");
            EXPECT_NEAR(run.trace("x", 2).back(), integral, 1e-6)
                << solver << ": " << block << ": " << run.simulation->failure();
        }
}

TEST(Events, OfAPulseFarFasterThanTheStepEndTheRunWithItsRemedy) {
    Session run("model: m\nstep: 1\nsolver: dormand_prince45\nblocks:\n  p: {block: Pulse, cycle: 1e-5}\n"
                "  x: {block: Integrator}\nconnections: {p: x}\n");
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(run.simulation->failure(),
              "p: it jumps or crosses zero more often than 10000 times in one base step: give the model a "
              "shorter 'step', or let the signal change less often");
}

namespace {

/// After as many steps of 0.01 s as stand before a time.
double after(Session& run, const std::string& path, double time) {
    const auto steps = run.simulation->steps_before(time) - run.simulation->steps() + 1;
    return run.trace(path, static_cast<int>(steps)).back();
}

std::string limited_by(const std::string& solver, const std::string& block, const std::string& more) {
    return "model: m\nstep: 0.01\nstop: 20\nrelative_tolerance: 1e-8\nsolver: " + solver + "\nblocks:\n" +
           more + "  x: {block: " + block + "}\n  z: {block: Integrator}\n";
}

const double pi = std::acos(-1);

} // namespace

TEST(Limits, OfAnIntegratorAreLeftWhereTheInputTurns) {
    // x' = 2 cos t from 0.3: up to 1.2, where it stays until pi/2, down to -0.5 until 3 pi/2, and so on.
    const auto exact = [](double t) {
        return t < pi / 2     ? std::min(1.2, 0.3 + 2 * std::sin(t))
               : t < 1.5 * pi ? std::max(-0.5, 1.2 + 2 * (std::sin(t) - 1))
                              : std::min(1.2, -0.5 + 2 * (std::sin(t) + 1));
    };
    for (const std::string solver : adaptive_solvers)
        for (const auto* sign : {"", "-"}) { // both limits, from both sides
            const std::string m = sign,
                              limits = m.empty() ? "lower: -0.5, upper: 1.2" : "lower: -1.2, upper: 0.5";
            Session run(limited_by(solver, "LimitedIntegrator, " + limits + ", initial: " + m + "0.3",
                                   "  u: {block: Sine, amplitude: " + m + "2, phase: pi/2}\n") +
                        "connections: {u: [x.u, z]}\n");
            for (const double t : {0.4, 1.0, 1.7, 2.5, 4.0, 4.8, 5.5, 7.0})
                EXPECT_NEAR(after(run, "x.y", t), (m.empty() ? 1 : -1) * exact(t), 1e-6) << solver << t;
        }
}

TEST(Limits, AreHitOnceInEachHalfWave) {
    // x' = sin wt between -0.3 and 0.45 turns at every k pi / w, where it leaves the limit that it hit
    // before.
    const double w = 1.7, end = 40;
    Values hits{std::acos(1 - 0.45 * w) / w};
    for (double turn = pi / w; turn + std::acos(1 - 0.75 * w) / w < end; turn += pi / w)
        hits.push_back(turn + std::acos(1 - 0.75 * w) / w);
    for (const std::string solver : adaptive_solvers)
        for (const double tolerance : {1e-4, 1e-6, 1e-9})
            for (const char* step : {"0.1", "5"}) {
                const std::string which = solver + " " + std::to_string(-std::log10(tolerance)) + " " + step;
                Session run("model: m\nstep: " + std::string(step) + "\nstop: 40\nsolver: " + solver +
                            "\nrelative_tolerance: " + std::to_string(tolerance * 1e9) +
                            "e-9\nblocks:\n  u: {block: Sine, frequency: 1.7}\n"
                            "  x: {block: LimitedIntegrator, lower: -0.3, upper: 0.45}\n"
                            "connections: {u: x}\n");
                Log log(run, "u");
                run.simulation->run_until(end);
                ASSERT_EQ(run.simulation->failure(), "") << which;
                Values events; // observers see each more than once
                for (std::size_t k = 1; k < log.times.size(); ++k)
                    if (log.times[k] == log.times[k - 1] && (events.empty() || events.back() != log.times[k]))
                        events.push_back(log.times[k]);
                // One that rounding makes of a state within an ulp of its limit is none too many.
                EXPECT_LE(events.size(), hits.size() + 1) << which;
                for (const double hit : hits)
                    EXPECT_TRUE(std::any_of(events.begin(), events.end(),
                                            [&](double event) {
                                                return std::abs(event - hit) <
                                                       std::max(200 * tolerance, 1e-6);
                                            }))
                        << which << ' ' << hit;
            }
}

TEST(Limits, OfTheIntegralAreLeftWhereTheErrorTurns) {
    // With I alone clamping is a limited integrator.
    for (const std::string solver : adaptive_solvers) {
        Session run(
            limited_by(solver,
                       "PID, P: 0, I: 1, lower: -0.5, upper: 1.2, initial: 0.3, anti_windup: clamping",
                       "  u: {block: Sine, amplitude: 2, phase: pi/2}\n") +
            "connections: {u: [x, z]}\n");
        for (const double t : {0.4, 1.0, 1.7, 2.5, 4.0, 4.8, 5.5})
            EXPECT_NEAR(after(run, "x", t),
                        t < pi / 2     ? std::min(1.2, 0.3 + 2 * std::sin(t))
                        : t < 1.5 * pi ? std::max(-0.5, 1.2 + 2 * (std::sin(t) - 1))
                                       : std::min(1.2, -0.5 + 2 * (std::sin(t) + 1)),
                        1e-6)
                << solver << t;
    }
}

TEST(Limits, LetAStateSlideAlongThem) {
    // v = cos s + w with s = t + pi/4 - 0.2: below 1 the integral grows faster than cos s falls until t =
    // 0.2, above 1 it stands still. The solution in the sense of Filippov stays at 1 until then.
    for (const std::string solver : adaptive_solvers) {
        Session run(
            "model: m\nstep: 0.1\nstop: 2\nrelative_tolerance: 1e-5\nabsolute_tolerance: 1e-6\nsolver: " +
            solver +
            "\nblocks:\n  u: {block: Sine, phase: 3*pi/4 - 0.2}\n"
            "  x: {block: PID, P: 1, I: 1, lower: -5, upper: 1, initial: 1 - cos(pi/4 - 0.2), "
            "anti_windup: clamping}\n  z: {block: Integrator}\nconnections: {u: [x, z]}\n");
        const auto y = run.trace("x", 16);
        for (int k = 0; k < 16; ++k) {
            const double s = 0.1 * k + pi / 4 - 0.2;
            EXPECT_NEAR(y[static_cast<std::size_t>(k)],
                        k <= 2 ? 1 : std::cos(s) + std::sin(s) + 1 - 2 * std::sin(pi / 4), 5e-3)
                << solver << ' ' << k;
        }
    }
}

TEST(Limits, ThatAStateSlidesAlongAreNamedWhereTheToleranceAsksForTooManySteps) {
    Session run(
        "model: m\nstep: 0.1\nrelative_tolerance: 1e-9\nabsolute_tolerance: 1e-11\nsolver: cvode_bdf\n"
        "blocks:\n  u: {block: Sine, phase: 3*pi/4 - 0.2}\n"
        "  x: {block: PID, P: 1, I: 1, upper: 1, initial: 1 - cos(pi/4 - 0.2), anti_windup: clamping}\n"
        "connections: {u: x}\n");
    while (run.simulation->step()) ASSERT_LT(run.simulation->time(), 1);
    EXPECT_EQ(
        run.simulation->failure(),
        "x: its state slides along a jump of its derivative, which takes steps as short as the tolerances "
        "ask: use larger ones, or dormand_prince45 where this is another solver");
}

TEST(Limits, OfPositionAreLeftWhereTheAccelerationTurns) {
    // v' = 2 sin(t + 0.7), x' = v: each flight ends at a limit at rest, and the next one begins there when
    // the acceleration leads inwards.
    struct Flight {
        double begin, from, end;
        double at(double t) const {
            return from +
                   2 * (std::cos(begin + 0.7) * (t - begin) - std::sin(t + 0.7) + std::sin(begin + 0.7));
        }
    };
    std::vector<Flight> flights{{0, 0, 0}};
    for (double t = 0; t < 20; t += 1e-5) {
        Flight& flight = flights.back();
        if (flight.end == 0) {
            if (std::abs(flight.at(t)) > 1) flight.end = t;
        } else if (const double limit = std::copysign(1.0, flight.at(flight.end));
                   limit * std::sin(t + 0.7) < 0) {
            flights.push_back({t, limit, 0});
        }
    }
    EXPECT_GT(flights.size(), 4u);
    const auto exact = [&](double t) {
        const auto flight =
            std::find_if(flights.rbegin(), flights.rend(), [&](auto f) { return f.begin <= t; });
        return flight->end == 0 || t < flight->end ? flight->at(t)
                                                   : std::copysign(1.0, flight->at(flight->end));
    };
    for (const std::string solver : adaptive_solvers) {
        Session run(limited_by(solver, "SecondOrderIntegrator, lower_x: -1, upper_x: 1",
                               "  u: {block: Sine, amplitude: 2, phase: 0.7}\n") +
                    "connections: {u: [x, z]}\n");
        for (const double t : {0.6, 2.0, 3.1, 5.0, 6.5, 9.0, 13.0, 17.5})
            EXPECT_NEAR(after(run, "x.x", t), exact(t), 1e-4) << solver << t;
    }
}

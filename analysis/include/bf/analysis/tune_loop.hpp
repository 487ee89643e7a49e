// Gains of a loop for a crossover, a phase margin and an overshoot.
#pragma once

#include "bf/analysis/response.hpp"
#include "bf/engine/simulation.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace bf::analysis {

struct TuneOptions {
    std::string loop = {}; ///< a signal, or an element of it: L as of negative feedback, 1 + L = 0
    /// Gains: parameters "block.parameter", or elements of them, and variables of the model; or a block or a
    /// group of variables with P and I, which stands for these, and for its D where that is not 0. One or two
    /// of them, or P, I and D of one block or group.
    std::vector<std::string> by = {};
    double crossover = 0;                    ///< where |L| = 1 [rad/s]; or
    double bandwidth = 0;                    ///< of L/(1 + L) [rad/s]
    std::optional<double> phase_margin = {}; ///< degrees; more where the overshoot asks for it
    std::optional<double> overshoot = {};    ///< of the step of L/(1 + L), at most [%]
    double gain_margin = 0;                  ///< dB, at least, of more gain and of less
    /// Further signals that are cut, as LinearizeOptions has them: those of slower loops around this one.
    std::vector<std::string> open = {};
    /// Asked before each set of gains whether to go on; RunError where not.
    std::function<bool()> go_on = {};
};

struct TunedLoop {
    struct Gain {
        std::string name; ///< "controller.pid.P", "Gain.Kp", "pid.P[2]"
        double before = 0, after = 0;
    };
    std::vector<Gain> gains;
    /// L, and the step of L/(1 + L).
    struct State {
        LinearSystem loop;
        Margins margins;
        StepResponse step;
    } before, after;
};

/// Finds gains with which the linearised loop crosses 1 where it is asked to, with the phase margin that is
/// asked for (60 degrees where nothing is said): C(jω) G(jω) = exp(j (φ - π)) in the gains. Where P, I and D
/// are free they have a double zero, P² = 4 I D. An overshoot is met by the least phase margin that does.
/// Source: Åström and Hägglund, PID Controllers: Theory, Design, and Tuning (1995). The loop is linearised
/// exactly at the run's present state, anew for each set of gains: where L is not affine in them, they are
/// approached by damped steps from several starts.
///
/// One gain is looked for in all that it may be, six decades to both sides of the model's own. It meets a
/// crossover or a bandwidth, of several values by that with the greatest phase margin; or the phase margin,
/// overshoot and gain margin that are asked for are just met, of several values by that of the fastest loop.
///
/// Gains keep the sign that they have, and those that are 0 get that of the others; they stay within their
/// limits. The run then has the gains, and is where it was. Throws RunError, and leaves them as they were:
/// what cannot be reached, and what can; unknown names; what `linearize` and `margins` refuse.
TunedLoop tune_loop(Simulation& run, const TuneOptions& options);

/// y(t) of a run in which a step is added at a loop, from its present state: what comes back there, less what
/// it is without the step, by its height. Of a linear loop that is the step response of L/(1 + L).
struct SimulatedStep {
    std::vector<double> time, value; ///< s from now
    double height = 0;               ///< of the step, in the unit of the signal
};
/// `height` 0: 1 % of what the signal is, at least 0.01. Signals that are `open` stay at what they are now,
/// as those of slower loops around this one. `go_on` is asked now and then. The run is afterwards where it
/// was. Throws RunError.
SimulatedStep simulated_step(Simulation& run, const std::string& loop, double duration, double height = 0,
                             const std::vector<std::string>& open = {},
                             const std::function<bool()>& go_on = {});

} // namespace bf::analysis

// Frequency responses by simulation: of what has no derivative, and of large signals.
#pragma once

#include "bf/analysis/response.hpp"
#include "bf/engine/simulation.hpp"

#include <functional>
#include <string>
#include <vector>

namespace bf::analysis {

/// Signals and their elements are called as in `linearize`; each name is of one element.
struct MeasureOptions {
    std::string from = {}; ///< to what is added: a signal, or an input of the root
    std::string to = {};   ///< what is looked at: a signal or a state
    /// Instead of both: the loop through this signal, which stays closed. Its gain is L = -y/x, y being what
    /// the signal is and x what all that read it see, so that 1 + L = 0 as of negative feedback.
    std::string loop = {};
    std::vector<double> omega = {}; ///< rad/s
    double amplitude = 0;           ///< of what is added; 0: 1 % of what the signal is, at least 0.01
    /// A sine for each frequency, or one chirp for all of them, which sweeps logarithmically from below the
    /// least to above the largest frequency, over and over.
    enum class Excitation { sine, chirp } excitation = Excitation::sine;
    double tolerance = 1e-4; ///< of the response, relative
    int most_periods = 1000; ///< of the excitation, after which it is not waited any more
    int chirp_periods = 20;  ///< of the least frequency, that a chirp takes
    /// Asked now and then whether to go on; RunError where not.
    std::function<bool()> go_on = {};
};

struct MeasuredResponse {
    std::string input, output, input_unit, output_unit;
    double amplitude = 0, time = 0; ///< time of the operating point [s]
    /// At frequencies of which whole periods are whole numbers of samples: those next to what was asked for.
    Response response;
    /// The share of what y does that x explains: of a sine the power of y at its frequency in all of its
    /// power, of a chirp |Σ Y X*|² / (Σ |Y|² Σ |X|²) over five neighbouring harmonics of its period.
    std::vector<double> coherence;
    /// Of a sine: root mean square of all else that y does (harmonics, limit cycles, noise) by that of its
    /// fundamental; NaN of a chirp.
    std::vector<double> distortion;
    /// Relative change from the last stretch of periods but one to the last, as it would sum up; above the
    /// tolerance it had not settled.
    std::vector<double> unsettled;
};

/// Runs on from the present state, once for each frequency, with A sin(ω t) added, until transients have died
/// out, and projects whole periods on exp(jω t): the first harmonic, of nonlinear blocks the describing
/// function at that amplitude (Gelb and Vander Velde, Multiple-Input Describing Functions, 1968, §2.2). A
/// drift that is even in time is taken out. Signals count at the hits of their rates, as the numbers that
/// they are; those of the continuous rate at base steps, though what is added moves inside of them, too. The
/// run is afterwards where it was.
///
/// Throws RunError: unknown names; a frequency above half of the sampling frequency; nobody reads the signal;
/// a run that fails or cannot be saved.
MeasuredResponse measure_response(Simulation& run, const MeasureOptions& options);

} // namespace bf::analysis

// What a linear system does: poles and zeros, responses in frequency and time, margins of loops.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/base/step_measures.hpp"

#include <complex>
#include <limits>
#include <utility>
#include <vector>

namespace bf::analysis {

using Complex = std::complex<double>;

/// Eigenvalues of A, by their real part.
std::vector<Complex> poles(const LinearSystem& system);
/// Where the transfer function from that input to that output is 0. Source: Emami-Naeini and Van Dooren,
/// Automatica 18 (1982).
std::vector<Complex> zeros(const LinearSystem& system, int output, int input);
/// Do all poles lie in the open left half plane, or of a sampled system in the open unit disc? Modes on the
/// boundary that are not controllable or not observable do not count, here and in all that follows; hidden
/// ones that grow do.
bool is_stable(const LinearSystem& system);

/// Evenly on a logarithmic axis, at least one.
std::vector<double> logarithmic(double low, double high, int count);

/// G(jω) = C (jω I - A)⁻¹ B + D, or G(exp(jω T)) of a sampled system; ω [rad/s].
Complex frequency_response(const LinearSystem& system, int output, int input, double omega);
/// Frequencies that show what poles and zeros do [rad/s], evenly on a logarithmic axis; up to π/T of a
/// sampled system. Of a loop they reach a decade beyond all its crossovers.
std::vector<double> frequencies(const LinearSystem& system, int output, int input, int count = 400,
                                bool of_loop = false);
/// `system` at several frequencies. The phase is unwrapped: it has no jump where the transfer function has
/// none.
struct Response {
    std::vector<double> omega; ///< rad/s
    std::vector<Complex> value;
    std::vector<double> magnitude; ///< dB
    std::vector<double> phase;     ///< degrees
};
Response response(const LinearSystem& system, int output, int input, const std::vector<double>& omega);

/// The loop gain L of a loop that is closed by negative feedback, 1 + L = 0.
struct Margins {
    static constexpr double none = std::numeric_limits<double>::infinity();
    double gain = none;         ///< > 1, by which L may be multiplied until the loop is unstable
    double gain_reduction = 0;  ///< the greatest factor < 1 that makes it unstable; 0: none does
    double phase = none;        ///< that L may lose, or must gain where it is negative [degrees]; the least
    double delay = none;        ///< that L may get [s]
    double modulus = none;      ///< least distance of L from -1
    double phase_crossover = 0; ///< where L is negative real, of `gain` [rad/s]; may be 0 or infinite
    double reduction_crossover = 0; ///< the same of `gain_reduction` [rad/s]
    double gain_crossover = 0;      ///< where |L| = 1, of `phase` [rad/s]
    double bandwidth = none;        ///< of L/(1 + L): where it first is 3 dB below its value at 0 [rad/s]
    bool is_stable = false;         ///< is the closed loop? Where its cut holds a signal, the uncut model
};
/// Crossovers are found between points that lie so densely that L moves by a small part of its distance from
/// -1, and then to twelve digits. Throws RunError: L is 0; D = -1.
Margins margins(const LinearSystem& loop, int output = 0, int input = 0);
/// -L: the open-loop transfer function of a loop that was cut has its own sign, which is negative where it
/// feeds back.
LinearSystem negative(LinearSystem system);
/// L/(1 + L).
LinearSystem closed(const LinearSystem& loop, int output = 0, int input = 0);

/// Poles of the closed loop with k L for each k, which follow one another from k to k; without gains from 0
/// to 1000 in steps that are shorter where branches meet.
struct RootLocus {
    std::vector<double> gains;
    std::vector<std::vector<Complex>> roots; ///< by gain
};
RootLocus root_locus(const LinearSystem& loop, int output = 0, int input = 0, std::vector<double> gains = {});

/// y(t) to a step of 1 at t = 0 from rest. Continuous systems are sampled exactly.
struct StepResponse : StepMeasures {
    std::vector<double> time, value; ///< s
    double final = 0;                ///< value that it comes to; NaN of an unstable system
};
/// `duration` 0: until the slowest pole has faded and the response has settled, or eight times the time
/// constant of growth.
StepResponse step_response(const LinearSystem& system, int output, int input, double duration = 0);

} // namespace bf::analysis

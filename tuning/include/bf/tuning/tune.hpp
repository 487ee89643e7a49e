// Gains of position loops: tau = P e + I ∫e - D ds/dt, e = r - s, for a reference r at rest.
#pragma once

#include "bf/tuning/bench.hpp"

#include <string>
#include <vector>

namespace bf::tuning {

/// Slower loops take longer to be watched than a search has time for.
inline constexpr double least_frequency = 0.1; ///< rad/s
/// What a joint is asked for: the response of y'' + 2 damping frequency y' + frequency² y = frequency² r.
struct Goal {
    double frequency = 20; ///< rad/s, `least_frequency` or more
    double damping = 1;    ///< ratio
};
/// y(t) / r of that after a step of r at t = 0. Source: K. J. Åström, R. M. Murray, Feedback Systems, section
/// 7.3 (2nd edition, 2021).
double ideal_response(const Goal& goal, double t);
/// The damping ratio whose response goes beyond its end by this share of the step, above 0 and below 1:
/// overshoot = exp(-pi damping / sqrt(1 - damping²)).
double damping_of(double overshoot);

struct JointGains {
    double P = 0; ///< Nm/rad
    double I = 0; ///< Nm/(rad s)
    double D = 0; ///< Nm s/rad
};

/// What a joint is to its motor near a pose s_0 while all others are held:
/// tau = inertia s'' + damping s' + friction sign(s') + stiffness (s - s_0) + load.
struct Plant {
    double inertia = 0;   ///< kg m2
    double damping = 0;   ///< Nm s/rad
    double friction = 0;  ///< Nm
    double stiffness = 0; ///< Nm/rad, of gravity mostly
    double load = 0;      ///< Nm
};

/// The gains by which an inertia J with damping b and stiffness k has the poles of the goal and, with
/// `integral` above 0, one at -alpha = -integral frequency:
///
///     D = J (2 damping frequency + alpha) - b
///     P = J (frequency² + 2 damping frequency alpha) - k
///     I = J frequency² alpha
///
/// by comparing the coefficients of J s³ + (b + D) s² + (k + P) s + I. None is below 0.
JointGains design(const Plant& plant, const Goal& goal, double integral = 0);

/// How a joint moves after its reference has made a step at t = 0.
struct Response {
    double step = 0;              ///< rad
    double offset = 0;            ///< r - s before the step, rad
    std::vector<double> time;     ///< s
    std::vector<double> position; ///< rad, from where it stood
    std::vector<double> torque;   ///< Nm
};

/// Of a response; what is never reached is NaN.
struct Measures {
    double rise_time = 0;     ///< s, from 10 % to 90 % of where it comes to
    double overshoot = 0;     ///< beyond that, as a share of it
    double settling_time = 0; ///< s, until it stays within 2 % of that
    double error = 0;         ///< rad, r - s at the end
    double torque = 0;        ///< Nm, the largest |tau|
};
Measures measure(const Response& response);

/// The torques that hold the start pose at rest.
Eigen::VectorXd holding_torques(Bench& bench);

/// Moves the joint to and fro, by `step` (rad) at most and by safe gains, and fits the plant to how it moves,
/// by least squares. Throws std::runtime_error when it does not move, or lies on a stop that carries it.
Plant identify(Bench& bench, const Eigen::VectorXd& holding, int joint, double step);

/// What the joint does in a step of its reference, with all others held by these gains.
Response respond(Bench& bench, const physics::Gains& gains, const Eigen::VectorXd& holding, int joint,
                 double step, double duration);

struct Options {
    std::vector<Goal> goals{Goal{}}; ///< one for all joints, or one each
    double step = 0.05;              ///< rad, of the references; the other way where a limit is in the way
    double torque_share = 0.8;       ///< of the effort limits that a step may take
    /// See `design`, where a joint needs one; 0: none has I. What I holds is the load, before and after a
    /// step, so that the error's integral over it is 0: a joint with I goes beyond its reference, by about
    /// twice this share at a damping of 1, and comes back by the slow pole.
    double integral = 0.05; ///< 0, or 0.01 to 1
    double error = 1e-3;    ///< rad: a joint that load or friction hold farther away without I needs one
    int most_trials = 40;   ///< simulated steps per joint of the search

    /// Throws std::invalid_argument that lists every value out of range, for n joints.
    void validate(std::size_t n) const;
};

struct TunedJoint {
    std::string name;
    Plant plant;
    Goal goal; ///< as far as torque and the period of the loops let it be met
    /// Why the goal is less than what was asked for, and in what the step falls short of it: it ends away
    /// from its reference by more than 5 %, does not come to rest, or P and D stand for another frequency or
    /// damping by more than half. Empty: nothing of that.
    std::string remark;
    JointGains before, after;
    Response response_before, response_after;
    Measures measures_before, measures_after;
};

/// Finds gains for all joints: identified one by one, designed in closed form, and then refined one by one,
/// P and D by the search of Nelder and Mead, for the least mean square between the simulated response and
/// that of the goal, with I in its ratio to P and torques within their share of the limits. The frequency of
/// a goal is lowered where a step would take more torque, or where the loops would be too slow for it (above
/// 0.2 per loop period). The same bench gives the same gains. Throws std::runtime_error when a joint cannot
/// be held, does not move, lies on a stop or is held by more than the goal asks for; std::invalid_argument.
std::vector<TunedJoint> tune(Bench& bench, const Options& options = {});

} // namespace bf::tuning

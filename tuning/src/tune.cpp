#include "bf/tuning/tune.hpp"

#include "bf/base/step_measures.hpp"
#include "nelder_mead.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace bf::tuning {

namespace {

using Eigen::Index;
using physics::Gains;

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double most_per_period = 0.2; ///< rad of a goal's oscillation in a period of the loops
constexpr double farthest = 1.4;        ///< of the search, from where it begins, in logarithms

JointGains of(const Gains& gains, Index i) { return {gains.P[i], gains.I[i], gains.D[i]}; }
void set(Gains& gains, Index i, const JointGains& own) {
    gains.P[i] = own.P;
    gains.I[i] = own.I;
    gains.D[i] = own.D;
}

/// s that a response is watched for: loops with I come to rest by their slow pole.
double duration_of(const Goal& goal, double integral) {
    return (integral > 0 ? std::max(12.0, 4 / integral) : 12.0) / goal.frequency;
}

std::string text_of(double value) {
    std::ostringstream text;
    text.precision(3);
    text << value;
    return text.str();
}

} // namespace

double ideal_response(const Goal& goal, double t) {
    const double w = goal.frequency, z = goal.damping;
    if (std::abs(z - 1) < 1e-9) return 1 - std::exp(-w * t) * (1 + w * t);
    if (z < 1) {
        const double root = std::sqrt(1 - z * z);
        return 1 - std::exp(-z * w * t) * (std::cos(root * w * t) + z / root * std::sin(root * w * t));
    }
    const double root = std::sqrt(z * z - 1), fast = w * (z + root), slow = w * (z - root);
    return 1 - (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow);
}

double damping_of(double overshoot) {
    const double l = std::log(overshoot);
    return -l / std::hypot(std::numbers::pi, l);
}

JointGains design(const Plant& plant, const Goal& goal, double integral) {
    const double J = plant.inertia, w = goal.frequency, two_zw = 2 * goal.damping * w, alpha = integral * w;
    return {std::max(J * (w * w + two_zw * alpha) - plant.stiffness, 0.0), J * w * w * alpha,
            std::max(J * (two_zw + alpha) - plant.damping, 0.0)};
}

Measures measure(const Response& response) {
    Measures found{none, 0, none, response.step + response.offset, 0};
    if (response.position.empty()) return found;
    const double end = response.position.back();
    found.error -= end;
    for (const double torque : response.torque) found.torque = std::max(found.torque, std::abs(torque));
    if (end == 0) return found;
    const auto measured = measure_step(response.time, response.position, end, false);
    found.rise_time = measured.rise_time;
    found.overshoot = measured.overshoot / 100;
    // The end is within any band of itself: what leaves the band in the last twentieth has not come to rest.
    if (measured.settling_time < 0.95 * response.time.back()) found.settling_time = measured.settling_time;
    return found;
}

Eigen::VectorXd holding_torques(Bench& bench) {
    Eigen::VectorXd holding = Eigen::VectorXd::Zero(static_cast<Index>(bench.joints().size()));
    // The loops come to rest at s_0 + (holding torque - what was taken for it) / P.
    for (int round = 0; round < 5; ++round) {
        bench.begin(bench.safe(), holding);
        for (double t = 0; t < 1; t += bench.period()) bench.step();
        holding = bench.tau();
    }
    return holding;
}

Response respond(Bench& bench, const Gains& gains, const Eigen::VectorXd& holding, int joint, double step,
                 double duration) {
    bench.begin(gains, holding);
    Response response;
    const double s_0 = bench.s()[joint];
    Eigen::VectorXd references = bench.references();
    response.step = step;
    response.offset = references[joint] - s_0;
    references[joint] += step;
    bench.command(references);
    const auto count = static_cast<std::size_t>(std::ceil(duration / bench.period()));
    for (auto* vector : {&response.time, &response.position, &response.torque}) vector->reserve(count);
    for (std::size_t k = 1; k <= count; ++k) {
        bench.step();
        response.time.push_back(static_cast<double>(k) * bench.period());
        response.position.push_back(bench.s()[joint] - s_0);
        response.torque.push_back(bench.tau()[joint]);
    }
    return response;
}

Plant identify(Bench& bench, const Eigen::VectorXd& holding, int joint, double step) {
    bench.begin(bench.safe(), holding);
    const double s_0 = bench.s()[joint];
    const Eigen::VectorXd rest = bench.references();
    // As the loops are known, torques depend on s, s' and the reference alone. References that go to and fro
    // by unequal ways are no function of the direction of motion, so that friction is told from them.
    constexpr std::array ways{1.0, 0.25, 0.75, 0.0};
    const auto phase = static_cast<Index>(std::ceil(0.2 / bench.period()));
    const auto count = static_cast<Index>(ways.size()) * phase;
    // What the others' loops let move takes part by its accelerations.
    const Index n = rest.size(), own = 5;
    Eigen::MatrixXd A(count, own + n);
    Eigen::VectorXd torques(count);
    std::array<double, ways.size()> held{}; // Nm, at the end of each
    for (Index k = 0; k < count; ++k) {
        if (k % phase == 0) {
            Eigen::VectorXd moved = rest;
            moved[joint] += ways[static_cast<std::size_t>(k / phase)] * step;
            bench.command(moved);
        }
        const double s = bench.s()[joint], s_dot = bench.s_dot()[joint];
        const double direction = std::abs(s_dot) > 1e-3 * std::abs(step) ? std::copysign(1.0, s_dot) : 0.0;
        bench.step();
        A.row(k) << bench.s_ddot()[joint], s_dot, direction, s - s_0, 1.0, bench.s_ddot().transpose();
        A(k, own + joint) = 0;
        torques[k] = held[static_cast<std::size_t>(k / phase)] = bench.tau()[joint];
    }
    // What a stop carries the motor has to carry as soon as the joint leaves it: no plant has such a jump.
    const double jump = std::abs(held[1] - held[3]) - std::abs(held[0] - held[1]) / 3;
    const bool is_at_limit =
        s_0 < bench.lower_limits()[joint] + 1e-3 || s_0 > bench.upper_limits()[joint] - 1e-3;
    if (is_at_limit && jump > 0.05 * bench.safe().P[joint] * std::abs(step))
        throw std::runtime_error("joint '" + bench.joints()[static_cast<std::size_t>(joint)] +
                                 "' lies on its stop at " + text_of(s_0) +
                                 " rad, which carries it; choose a pose away from its limits");
    // Columns have units of their own, so that the rank is decided on columns of one length.
    Eigen::VectorXd scale = A.colwise().norm();
    if (A.col(3).cwiseAbs().maxCoeff() < 0.1 * std::abs(step))
        throw std::runtime_error("joint '" + bench.joints()[static_cast<std::size_t>(joint)] +
                                 "' does not move; look at its limits, its effort limit and its friction");
    for (double& length : scale)
        if (length == 0) length = 1;
    const Eigen::VectorXd x =
        (A * scale.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(torques).cwiseQuotient(scale);
    return {x[0], x[1], std::max(x[2], 0.0), x[3], holding[joint]};
}

void Options::validate(std::size_t n) const {
    std::ostringstream wrong;
    const auto require = [&](bool holds, const std::string& text) {
        if (!holds) wrong << "\n- " << text;
    };
    require(goals.size() == 1 || goals.size() == n, "there are " + std::to_string(goals.size()) +
                                                        " goals for " + std::to_string(n) +
                                                        " joints; give one for all or one each");
    for (const Goal& goal : goals) {
        require(goal.frequency >= least_frequency && std::isfinite(goal.frequency),
                "a frequency is " + text_of(goal.frequency) + "; it must be " + text_of(least_frequency) +
                    " rad/s or more");
        require(goal.damping >= 0.2 && goal.damping <= 5,
                "a damping ratio is " + text_of(goal.damping) + "; it must be 0.2 to 5");
    }
    require(std::isfinite(step) && step != 0, "step is " + text_of(step) + "; it must not be zero (rad)");
    require(torque_share > 0 && torque_share <= 1,
            "torque_share is " + text_of(torque_share) + "; it must be above 0 and at most 1");
    require(integral == 0 || (integral >= 0.01 && integral <= 1),
            "integral is " + text_of(integral) + "; it must be 0, or 0.01 to 1");
    require(error > 0, "error is " + text_of(error) + "; it must be positive (rad)");
    require(most_trials >= 3, "most_trials is " + std::to_string(most_trials) + "; it must be 3 or more");
    if (!wrong.str().empty()) throw std::invalid_argument("tuning:" + wrong.str());
}

namespace {

class Tuner {
  public:
    Tuner(Bench& bench, const Options& options)
        : bench_(bench), options_(options), holding_(holding_torques(bench)), gains_(bench.given()) {
        bench_.begin(gains_, holding_);
        start_ = bench_.s();
    }

    std::vector<TunedJoint> run() {
        const auto n = static_cast<Index>(bench_.joints().size());
        std::vector<TunedJoint> joints;
        for (Index i = 0; i < n; ++i) joints.push_back(designed(i));
        for (Index i = 0; i < n; ++i) set(gains_, i, joints[static_cast<std::size_t>(i)].after);
        for (Index i = 0; i < n; ++i) {
            TunedJoint& joint = joints[static_cast<std::size_t>(i)];
            joint.after = refined(i, joint);
            set(gains_, i, joint.after);
        }
        for (Index i = 0; i < n; ++i) {
            TunedJoint& joint = joints[static_cast<std::size_t>(i)];
            const double step = step_of(i),
                         duration = duration_of(joint.goal, joint.after.I > 0 ? options_.integral : 0);
            const auto of_gains = [&](const Gains& gains, Response& response, Measures& measures) {
                response = respond(bench_, gains, holding_, static_cast<int>(i), step, duration);
                measures = measure(response);
            };
            of_gains(bench_.given(), joint.response_before, joint.measures_before);
            of_gains(gains_, joint.response_after, joint.measures_after);
            remark_shortfall(joint);
        }
        return joints;
    }

  private:
    /// Nm that a joint may take.
    double torque_limit(Index i) const { return options_.torque_share * bench_.effort_limits()[i]; }

    /// That of the options, away from a limit that it would reach.
    double step_of(Index i) {
        const double s_0 = start_[i], lower = bench_.lower_limits()[i], upper = bench_.upper_limits()[i];
        for (const double step : {options_.step, -options_.step})
            if (s_0 + step >= lower && s_0 + step <= upper) return step;
        throw std::runtime_error("joint '" + bench_.joints()[static_cast<std::size_t>(i)] + "' at " +
                                 text_of(s_0) + " rad has no room for a step of " + text_of(options_.step) +
                                 " rad between its limits; choose a smaller one, or another pose");
    }

    TunedJoint designed(Index i) {
        TunedJoint joint;
        joint.name = bench_.joints()[static_cast<std::size_t>(i)];
        joint.before = of(bench_.given(), i);
        joint.plant = identify(bench_, holding_, static_cast<int>(i), step_of(i));
        if (!(joint.plant.inertia > 0))
            throw std::runtime_error("joint '" + joint.name +
                                     "' moves as if it had no inertia; look at its limits and its friction");
        const double left = torque_limit(i) - std::abs(joint.plant.load);
        if (!(left > 0))
            throw std::runtime_error(
                "joint '" + joint.name + "' takes " + text_of(std::abs(joint.plant.load)) +
                " Nm to be held, of " + text_of(torque_limit(i)) +
                " Nm that it may take; choose another pose or a greater share of torque");
        joint.goal = options_.goals[options_.goals.size() == 1 ? 0 : static_cast<std::size_t>(i)];
        if (const double most = most_per_period / bench_.loop_period(); joint.goal.frequency > most) {
            joint.goal.frequency = most;
            joint.remark = "lowered to " + text_of(most) + " rad/s: its loop runs every " +
                           text_of(bench_.loop_period()) + " s";
        }
        const auto first_torque = [&] {
            joint.after = design(joint.plant, joint.goal);
            const double away = std::abs(joint.plant.load) + joint.plant.friction +
                                std::abs(joint.plant.stiffness * options_.step);
            if (away > options_.error * joint.after.P)
                joint.after = design(joint.plant, joint.goal, options_.integral);
            return joint.after.P * std::abs(options_.step);
        };
        if (first_torque() > left) {
            while (first_torque() > left)
                if ((joint.goal.frequency *= 0.98) < least_frequency)
                    throw std::runtime_error("joint '" + joint.name + "' has " + text_of(left) +
                                             " Nm left when it is held, which is too little for a step of " +
                                             text_of(options_.step) +
                                             " rad; choose a smaller one, or another pose");
            joint.remark = "lowered to " + text_of(joint.goal.frequency) + " rad/s: a step of " +
                           text_of(options_.step) + " rad may take " + text_of(torque_limit(i)) + " Nm";
        }
        if (!(joint.after.P > 0))
            throw std::runtime_error("joint '" + joint.name + "' is held at " + text_of(start_[i]) +
                                     " rad by more than its goal asks for, as by gravity; choose a greater "
                                     "frequency, or another pose");
        return joint;
    }

    /// A joint may be far from its goal where it is not the plant that was identified.
    void remark_shortfall(TunedJoint& joint) const {
        const auto add = [&](const std::string& text) {
            joint.remark += (joint.remark.empty() ? "" : "; ") + text;
        };
        if (const double error = joint.measures_after.error;
            std::abs(error) > 0.05 * std::abs(joint.response_after.step))
            add("ends " + text_of(std::abs(error)) + " rad away from its reference");
        if (std::isnan(joint.measures_after.settling_time)) add("does not come to rest");
        const JointGains asked = design(joint.plant, joint.goal, joint.after.I > 0 ? options_.integral : 0);
        const double k = joint.plant.stiffness, b = joint.plant.damping,
                     quicker = std::sqrt(std::max((joint.after.P + k) / (asked.P + k), 0.0)),
                     calmer = (joint.after.D + b) / (asked.D + b) / quicker;
        const auto is_near = [](double ratio) { return ratio > 1 / 1.5 && ratio < 1.5; };
        if (!is_near(quicker) || !is_near(calmer))
            add("P and D are those of " + text_of(quicker * joint.goal.frequency) +
                " rad/s at a damping of " + text_of(calmer * joint.goal.damping));
    }

    JointGains refined(Index i, const TunedJoint& joint) {
        const auto gains_at = [&](const Eigen::Vector2d& x) {
            const double p = std::exp(x[0]);
            return JointGains{joint.after.P * p, joint.after.I * p, joint.after.D * std::exp(x[1])};
        };
        // The slow pole is the integral's own: what is compared is how the joint moves.
        const double duration = duration_of(joint.goal, 0);
        const auto cost = [&](const Eigen::Vector2d& x) {
            if (x.cwiseAbs().maxCoeff() > farthest) return std::numeric_limits<double>::infinity();
            Gains tried = gains_;
            set(tried, i, gains_at(x));
            return mismatch(i, joint.goal, tried, duration);
        };
        return gains_at(nelder_mead(cost, Eigen::Vector2d::Zero(), 0.1, options_.most_trials));
    }

    double mismatch(Index i, const Goal& goal, const Gains& gains, double duration) {
        Response response;
        try {
            response = respond(bench_, gains, holding_, static_cast<int>(i), step_of(i), duration);
        } catch (const std::runtime_error&) { // it diverged
            return std::numeric_limits<double>::infinity();
        }
        double sum = 0;
        const double limit = torque_limit(i);
        for (std::size_t k = 0; k < response.time.size(); ++k) {
            const double away = response.position[k] / response.step - ideal_response(goal, response.time[k]);
            const double excess = std::max(std::abs(response.torque[k]) / limit - 1, 0.0);
            sum += away * away + 10 * excess * excess;
        }
        return sum / static_cast<double>(response.time.size());
    }

    Bench& bench_;
    const Options& options_;
    const Eigen::VectorXd holding_;
    Eigen::VectorXd start_; ///< positions
    Gains gains_;
};

} // namespace

std::vector<TunedJoint> tune(Bench& bench, const Options& options) {
    options.validate(bench.joints().size());
    return Tuner(bench, options).run();
}

} // namespace bf::tuning

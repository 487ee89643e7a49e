#pragma once

#include "bf/trajectory/quintic.hpp"

#include <Eigen/Core>

#include <memory>
#include <string>
#include <vector>

namespace bf::trajectory {

using VectorIn = Eigen::Ref<const Eigen::VectorXd>;
using VectorOut = Eigen::Ref<Eigen::VectorXd>;

/// Motions of n joints from any state to rest at a target:
///
/// - `minimum_jerk`: Quintic, of one duration for all joints, the shortest within the limits and not shorter
/// than
///   `shortest`. From rest that is the largest of 15/8 d/v_max, (10/√3 d/a_max)^½, (60 d/j_max)^⅓ for the way
///   d. A joint that is under way may have to exceed its limits; then the duration is one by which it does so
///   least.
/// - `time_optimal`: in the shortest time within the limits, by phases of constant jerk. Source: L.
/// Berscheid, T.
///   Kröger, Jerk-limited real-time trajectory generation with arbitrary target states, 2021 (Ruckig).
///
/// A state beyond its limits is braked back to them. All memory is allocated by the constructor. Not for
/// concurrent use.
class JointTrajectory {
  public:
    enum class Timing { minimum_jerk, time_optimal };
    /// How joints with shorter ways move, time_optimal only.
    enum class Synchronisation {
        time, ///< all arrive at the same time
        /// On the straight line to the target, as fast as the tightest limits along it allow, from rest and
        /// from a motion along that line, velocity and acceleration alike; from any other motion as time.
        phase,
        none ///< each as soon as it can
    };
    enum class Status {
        planned,
        not_finite, ///< start, target or a limit is no number
        bad_limits, ///< a limit is not above 0, or no time follows from limits and `shortest`
        not_found   ///< the search failed, as where limits are many orders of magnitude apart
    };

    /// Throws std::invalid_argument unless there is a joint.
    JointTrajectory(int joints, Timing timing, Synchronisation synchronisation = Synchronisation::time);
    ~JointTrajectory();
    JointTrajectory(JointTrajectory&&) noexcept;
    JointTrajectory& operator=(JointTrajectory&&) noexcept;

    struct Question {
        Eigen::VectorXd position, velocity, acceleration;         ///< of the start (n)
        Eigen::VectorXd target;                                   ///< (n)
        Eigen::VectorXd max_velocity, max_acceleration, max_jerk; ///< (n), above 0; may be infinite, but for
                                                                  ///< the velocity of time_optimal
        double shortest = 0.0;                                    ///< s
        bool operator==(const Question&) const = default;
    };
    /// To be written before `plan`; as large as the constructor made it.
    Question question;

    /// Finds the motion. The same question again costs nothing.
    Status plan() noexcept;

    /// s, of what was planned.
    double duration() const noexcept;
    /// After the time t from the start; behind the end it rests at the target. (n each)
    void at(double t, VectorOut position, VectorOut velocity, VectorOut acceleration) const noexcept;

  private:
    struct Content;
    Status plan_minimum_jerk() noexcept;
    Status plan_time_optimal() noexcept;
    bool find_line() noexcept;

    std::unique_ptr<Content> content_;
};

} // namespace bf::trajectory

// How fast references may change that go out over topics.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>

namespace bf::middleware {

class ReferenceLimits {
  public:
    double speed = 0.5;                                       ///< rad/s, of ways
    double acceleration = std::numeric_limits<double>::max(); ///< rad/s^2, of velocities

    /// Velocities begin at zero, at that time, s.
    void begin(Eigen::Index joints, double time) {
        velocities_.setZero(joints);
        last_ = time;
    }
    /// The velocities that come next on the way to these ones: v + clamp(v_ref - v, -a dt, a dt), where a
    /// pause counts as `longest` s.
    const Eigen::VectorXd& next(const Eigen::Ref<const Eigen::VectorXd>& references, double time,
                                double longest) {
        const double most = acceleration * std::min(time - last_, longest);
        last_ = time;
        velocities_ += (references - velocities_).cwiseMax(-most).cwiseMin(most);
        return velocities_;
    }
    /// How long a straight way takes, all joints at once and none faster than the limit, s.
    double duration(const Eigen::Ref<const Eigen::VectorXd>& from,
                    const Eigen::Ref<const Eigen::VectorXd>& to) const {
        constexpr double shortest = 0.05; // s
        return std::max(shortest, (to - from).cwiseAbs().maxCoeff() / speed);
    }

  private:
    Eigen::VectorXd velocities_;
    double last_ = 0; ///< s
};

} // namespace bf::middleware

// What a message JointTrajectory asks for.
#pragma once

#include "messages.hpp"

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bf::ros2 {

/// Positions over time. Between two points that tell velocities they are cubic polynomials, otherwise lines,
/// as the joint_trajectory_controller of ros2_control has them. Joints that are not named stay.
class Path {
  public:
    /// Throws std::runtime_error that says what is wrong with the message.
    Path(const messages::Trajectory& message, const std::vector<std::string>& joints);

    /// Where it begins, at that time.
    void begin(double time, const Eigen::VectorXd& positions);
    /// Positions at that time, of the last point behind it. False: that is over.
    bool at(double time, Eigen::VectorXd& positions) const noexcept;

  private:
    struct Point {
        double time;                           ///< s since the begin
        Eigen::VectorXd positions, velocities; ///< of the named joints; without velocities of size 0
    };
    std::vector<Eigen::Index> joints_; ///< numbers of those that are named
    std::vector<Point> points_;        ///< the first is where it begins
    Eigen::VectorXd start_;
    double begin_ = 0;
};

} // namespace bf::ros2

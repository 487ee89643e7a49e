// What a message JointTrajectory asks for.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace bf::middleware {

/// Such a message, whoever brings it.
struct JointTrajectory {
    struct Point {
        double time;                               ///< s since the begin
        std::vector<double> positions, velocities; ///< of the named joints; without velocities of size 0
    };
    std::vector<std::string> joints;
    std::vector<Point> points;
};

/// Positions over time. Between two points that tell velocities they are cubic polynomials, otherwise lines,
/// as the joint_trajectory_controllers of ros_control and ros2_control have them. Joints that are not named
/// stay.
class JointPath {
  public:
    /// Throws std::runtime_error that says what is wrong with the message.
    JointPath(const JointTrajectory& message, const std::vector<std::string>& joints);

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

} // namespace bf::middleware

// Trajectories, whose oracles are polynomials in closed form, and orientations.
#include "bf/middleware/joint_path.hpp"
#include "bf/middleware/topic_robot.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <stdexcept>
#include <tuple>

namespace bf::middleware::test {
namespace {

/// Each point: time, position and velocity of all that are named.
JointTrajectory trajectory(const std::vector<std::string>& names,
                           const std::vector<std::tuple<double, double, double>>& points,
                           bool has_velocities) {
    JointTrajectory message{names, {}};
    for (const auto& [time, position, velocity] : points)
        message.points.push_back({time, std::vector<double>(names.size(), position),
                                  std::vector<double>(has_velocities ? names.size() : 0, velocity)});
    return message;
}

} // namespace

TEST(JointPath, IsTheCubicOfItsEndsAndLinesWithoutVelocities) {
    const std::vector<std::string> joints{"a", "b"};
    Eigen::VectorXd positions(2);
    JointPath cubic(trajectory({"b"}, {{2, 1, 0}, {3, 0.5, -1}}, true), joints);
    cubic.begin(10, Eigen::Vector2d(7, 0));
    for (double t = 0; t < 2; t += 0.25) {
        EXPECT_TRUE(cubic.at(10 + t, positions));
        EXPECT_NEAR(positions[1], 3 * t * t / 4 - 2 * t * t * t / 8, 1e-12) << "3 s^2 - 2 s^3";
        EXPECT_EQ(positions[0], 7) << "it is not named";
    }
    EXPECT_TRUE(cubic.at(12.5, positions));
    EXPECT_NEAR(positions[1], 0.75 + 0.125, 1e-12) << "(1 + 0.5) / 2 + (0 - -1) / 8";
    EXPECT_FALSE(cubic.at(13, positions));
    EXPECT_EQ(positions[1], 0.5);
    JointPath lines(trajectory({"a", "b"}, {{1, 2, 0}}, false), joints);
    lines.begin(0, Eigen::Vector2d(0, 1));
    EXPECT_TRUE(lines.at(0.25, positions));
    EXPECT_NEAR(positions[0], 0.5, 1e-12);
    EXPECT_NEAR(positions[1], 1.25, 1e-12);
}

TEST(JointPath, BeginsWhereItIsToBeAtOnce) {
    Eigen::VectorXd positions(1);
    JointPath jump(trajectory({"a"}, {{0, 5, 0}, {1, 6, 0}}, false), {"a"});
    jump.begin(10, Eigen::VectorXd::Constant(1, 3));
    for (const double t : {0.0, 0.5}) {
        EXPECT_TRUE(jump.at(10 + t, positions));
        EXPECT_EQ(positions[0], 5 + t);
    }
    JointPath place(trajectory({"a"}, {{0, 5, 0}}, false), {"a"});
    place.begin(10, Eigen::VectorXd::Constant(1, 3));
    EXPECT_FALSE(place.at(10, positions));
    EXPECT_EQ(positions[0], 5);
}

TEST(JointPath, RefusesWhatIsNone) {
    const auto why = [](const JointTrajectory& message) -> std::string {
        try {
            const JointPath path(message, {"a", "b"});
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(why(trajectory({"c"}, {{1, 0, 0}}, false)),
              "a trajectory that names 'c', but the joints are a, b");
    EXPECT_EQ(why(trajectory({"a", "b", "a"}, {{1, 0, 0}}, false)), "a trajectory that names 'a' twice");
    EXPECT_EQ(why(trajectory({"a"}, {}, false)), "a trajectory without joints or points");
    EXPECT_EQ(why(trajectory({"a"}, {{1, 0, 0}, {1, 0, 0}}, false)), "a trajectory whose times do not grow");
    EXPECT_EQ(why(trajectory({"a"}, {{1, std::nan(""), 0}}, false)),
              "a trajectory whose point 1 has positions that are not finite");
}

TEST(TopicRobot, HasTheOrientationOfItsAngles) {
    const Eigen::Vector3d rpy(0.3, -0.8, 2.5);
    EXPECT_LT((roll_pitch_yaw(quaternion_of(rpy)) - rpy).norm(), 1e-12);
    // A quarter turn about z: x becomes y.
    const Eigen::Vector4d q = quaternion_of({0, 0, M_PI / 2});
    EXPECT_LT((q - Eigen::Vector4d(0, 0, std::sqrt(0.5), std::sqrt(0.5))).norm(), 1e-12);
}

} // namespace bf::middleware::test

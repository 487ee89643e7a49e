// What the peers of ROS 1 and ROS 2 tell, as a block `s` hears it.
#pragma once

#include "running.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>

namespace bf::middleware::test {

/// The values of an Imu, whose stamp is 7.5 s.
constexpr const char* imu_values =
    "m.header.frame_id='base'; m.orientation.x=0.1; m.orientation.w=0.9; m.angular_velocity.y=-2.0; "
    "m.linear_acceleration.z=9.5; m.orientation_covariance=[float(i) for i in range(9)]; ";
inline void expect_the_imu(const toolbox::test::Running& run) {
    EXPECT_EQ(run.scalar("s.header_stamp"), 7.5);
    EXPECT_EQ(run.get("s.orientation"), Matrix(Eigen::Vector4d(0.1, 0, 0, 0.9)));
    EXPECT_EQ(run.get("s.angular_velocity"), Matrix(Eigen::Vector3d(0, -2, 0)));
    EXPECT_EQ(run.get("s.linear_acceleration"), Matrix(Eigen::Vector3d(0, 0, 9.5)));
    EXPECT_EQ(run.get("s.orientation_covariance"), Matrix(Eigen::VectorXd::LinSpaced(9, 0, 8)));
    EXPECT_GT(run.scalar("s.received"), 0);
    EXPECT_LT(run.scalar("s.age"), 5);
}
inline void expect_the_imu_to_stay(toolbox::test::Running& run) {
    const double age = run.scalar("s.age");
    usleep(200'000);
    ASSERT_TRUE(run.step());
    ASSERT_TRUE(run.step());
    EXPECT_GT(run.scalar("s.age"), age) << "nobody sends any more";
    EXPECT_EQ(run.get("s.linear_acceleration")(2), 9.5) << "the last one stays";
}

/// A base that moves along x by u and turns by 0.3 u about z, where u is the time within ten seconds, and a
/// camera at rest in it.
constexpr const char* moving_frames =
    "u = t % 10; tf('map', 'base', t, u, 2.0, 0.0, 0.3 * u); still('base', 'camera', 0.0, 1.0, 0.5, 0.0); ";
/// Of the camera in the map; returns u.
inline double expect_the_moving_pose(const toolbox::test::Running& run) {
    const Eigen::Matrix4d H = run.get("s.target_H_source");
    const double angle = std::atan2(H(1, 0), H(0, 0)), u = angle / 0.3;
    Eigen::Matrix4d expected = Eigen::Matrix4d::Identity();
    expected.topLeftCorner<2, 2>() = Eigen::Rotation2D<double>(angle).matrix();
    expected.topRightCorner<2, 1>() =
        Eigen::Vector2d(u, 2) + Eigen::Rotation2D<double>(angle) * Eigen::Vector2d(1, 0.5);
    EXPECT_LT((H - expected).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_GT(run.scalar("s.age"), 0);
    EXPECT_LT(run.scalar("s.age"), 5);
    return u;
}

} // namespace bf::middleware::test

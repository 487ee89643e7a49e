#include "bf/physics/figure.hpp"
#include "robots.hpp"

#include <gtest/gtest.h>
#include <numbers>

using namespace bf::physics;
using namespace bf::physics::test;

namespace {

Eigen::Matrix4d matrix(const std::array<double, 7>& pose) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() = Eigen::Quaterniond(pose[3], pose[4], pose[5], pose[6]).toRotationMatrix();
    H.topRightCorner<3, 1>() = Eigen::Vector3d(pose[0], pose[1], pose[2]);
    return H;
}

int body_of(const Figure& figure, const std::string& link) {
    const auto& bodies = figure.bodies();
    return static_cast<int>(std::find(bodies.begin(), bodies.end(), link) - bodies.begin());
}

} // namespace

TEST(Figure, StandsWhereTheSimulationIs) {
    Simulation sim = simulate(icub_options());
    Figure figure(sim.world());
    EXPECT_EQ(figure.bodies(), sim.world().bodies());
    const int foot = body_of(figure, "l_ankle_2");
    ASSERT_LT(foot, static_cast<int>(figure.bodies().size()));
    // What lies between a foot and its sole is fixed, in whatever pose the robot is.
    const auto foot_H_sole = [&]() -> Eigen::Matrix4d {
        figure.place(sim.w_H_b(), {sim.s().data(), 23});
        return matrix(figure.pose(foot)).inverse() * sim.foot_pose(0);
    };
    const Eigen::Matrix4d standing = foot_H_sole();
    const std::vector<double> tau(23, 0.0);
    for (int k = 0; k < 300; ++k) ASSERT_TRUE(sim.step(tau));
    EXPECT_GT((sim.s() - Eigen::Map<const Eigen::VectorXd>(icub_posture().data(), 23)).norm(), 0.05);
    EXPECT_LT((foot_H_sole() - standing).norm(), 1e-9);
}

TEST(Figure, HasTheMeshesOfTheLinksAsClosedSurfacesWithUnitNormals) {
    const World world(icub_options());
    const Figure figure(world);
    ASSERT_GT(figure.mesh_count(), 10);
    double volume = 0;
    for (const auto& shape : figure.shapes()) {
        ASSERT_EQ(shape.kind, Shape::Kind::mesh);
        const Mesh mesh = figure.mesh(shape.mesh);
        ASSERT_EQ(mesh.vertices.size(), mesh.normals.size());
        const auto vertex = [&](std::uint32_t i) -> Eigen::Vector3d {
            return Eigen::Map<const Eigen::Vector3f>(&mesh.vertices.at(3 * i)).cast<double>();
        };
        for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
            volume += vertex(mesh.triangles[i])
                          .dot(vertex(mesh.triangles[i + 1]).cross(vertex(mesh.triangles[i + 2]))) /
                      6;
        for (std::size_t i = 0; i + 2 < mesh.normals.size(); i += 300)
            EXPECT_NEAR(Eigen::Map<const Eigen::Vector3f>(&mesh.normals[i]).norm(), 1, 1e-3);
    }
    EXPECT_GT(volume, 0.005); // m3: of 33 kg, seen from outside
    EXPECT_LT(volume, 0.1);
}

TEST(Figure, HasTheShapesThatAUrdfDraws) {
    WorldOptions options;
    options.urdf = write_urdf("drawn", R"(
      <link name="core"><inertial><mass value="2"/>
        <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><origin xyz="0 0 0.5"/><geometry><box size="0.2 0.4 0.6"/></geometry>
          <material name="red"><color rgba="1 0 0 1"/></material></visual>
        <visual><geometry><sphere radius="0.3"/></geometry></visual>
        <collision><geometry><sphere radius="1"/></geometry></collision></link>)");
    const World world(options);
    const Figure figure(world);
    ASSERT_EQ(figure.shapes().size(), 2U);
    const Shape& box = figure.shapes()[0];
    EXPECT_EQ(box.kind, Shape::Kind::box);
    EXPECT_EQ(box.size, (std::array<double, 3>{0.1, 0.2, 0.3}));
    EXPECT_EQ(box.pose[2], 0.5);
    EXPECT_EQ(box.colour, (std::array<float, 4>{1, 0, 0, 1}));
    EXPECT_EQ(figure.shapes()[1].kind, Shape::Kind::sphere);
    EXPECT_EQ(figure.shapes()[1].size[0], 0.3);
}

TEST(ContactForce, ActsAtTheCentreOfPressureOfATiltedSole) {
    // 100 N along the sole's normal at (0.03, -0.02) of the sole, whatever its pose.
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    H.topRightCorner<3, 1>() = Eigen::Vector3d(0.1, 0.2, 0.3);
    const Eigen::Vector3d lever = H.topLeftCorner<3, 3>() * Eigen::Vector3d(0.03, -0.02, 0),
                          force = 100 * H.block<3, 1>(0, 2);
    Vector6d wrench;
    wrench << force, lever.cross(force);
    const auto contact = contact_force(H, wrench);
    ASSERT_TRUE(contact);
    EXPECT_LT((contact->origin - H.topRightCorner<3, 1>() - lever).norm(), 1e-12);
    EXPECT_EQ(contact->force, force);
    EXPECT_FALSE(contact_force(H, 0.005 * wrench)) << "less than a newton";
}

TEST(ContactForce, ActsOnItsAxisAtAFootWhoseZAxisIsNotThatOfASole) {
    // A ball's frame along a shin that leans by 100 degrees, or lies: the floor pushes upwards below it.
    for (const double tilt : {1.75, std::numbers::pi / 2, std::numbers::pi}) {
        Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
        H.topLeftCorner<3, 3>() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
        H.topRightCorner<3, 1>() = Eigen::Vector3d(0.1, 0.2, 0.02);
        const Eigen::Vector3d lever(0.01, 0.005, -0.02), force(0, 0, 33);
        Vector6d wrench;
        wrench << force, lever.cross(force);
        const auto contact = contact_force(H, wrench);
        ASSERT_TRUE(contact) << tilt;
        EXPECT_LT((contact->origin - Eigen::Vector3d(0.11, 0.205, 0.02)).norm(), 1e-12) << tilt;
        EXPECT_EQ(contact->force, force);
    }
    EXPECT_FALSE(contact_force(Eigen::Matrix4d::Identity(), Vector6d::Constant(0.1)));
}

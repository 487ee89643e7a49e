#include "bf/physics/renderer.hpp"
#include "robots.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <numbers>
#include <set>
#include <thread>

using namespace bf::physics;
using namespace bf::physics::test;

namespace {

/// Share of pixels that differ by more than 20 in some channel.
double difference(const Image& a, const Image& b) {
    size_t count = 0;
    for (size_t i = 0; i < a.pixels.size(); i += 3) {
        int largest = 0;
        for (size_t c = 0; c < 3; ++c)
            largest = std::max(largest, std::abs(a.pixels[i + c] - b.pixels[i + c]));
        count += largest > 20;
    }
    return 3.0 * static_cast<double>(count) / static_cast<double>(a.pixels.size());
}

std::string read_file(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

std::string message_of(auto&& action) {
    try {
        action();
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

const std::string output = BF_BINARY_DIRECTORY "/";

} // namespace

TEST(Renderer, DrawsTheRobotInItsPose) {
    Simulation sim = simulate(icub_options());
    HoldPosture hold(sim.world());
    for (int k = 0; k < 1000; ++k) ASSERT_TRUE(sim.step(hold(sim)));
    Renderer renderer(sim.world());
    Image standing, again, waving, empty, arrows;
    renderer.render(sim, arrows);
    EXPECT_EQ(arrows.width, 960);
    EXPECT_EQ(arrows.pixels.size(), 3u * 960 * 720);

    const Eigen::Matrix4d w_H_b = sim.w_H_b();
    std::vector<double> s = icub_posture();
    renderer.render(w_H_b, s, {}, standing);
    renderer.render(w_H_b, s, {}, again);
    EXPECT_EQ(standing.pixels, again.pixels);
    const std::set<std::uint8_t> shades(standing.pixels.begin(), standing.pixels.end());
    EXPECT_GT(shades.size(), 100u) << "blank";

    s[4] = 2.0; // left arm up
    renderer.render(w_H_b, s, {}, waving);
    EXPECT_GT(difference(standing, waving), 0.005);
    Eigen::Matrix4d sunk = w_H_b;
    sunk(2, 3) -= 5.0;
    renderer.render(sunk, s, {}, empty);
    EXPECT_GT(difference(standing, empty), 0.05) << "the robot covers part of the picture";
    EXPECT_GT(difference(arrows, standing), 0.001) << "contact forces are drawn";
    write_png(output + "icub.png", arrows);
    EXPECT_TRUE(read_file(output + "icub.png").starts_with("\x89PNG"));
}

TEST(Renderer, FollowsTheBaseOverTheFloor) {
    Simulation sim = simulate(icub_options());
    Renderer renderer(sim.world(), {.width = 200, .height = 150});
    Image here, there;
    Eigen::Matrix4d w_H_b = sim.w_H_b();
    renderer.render(w_H_b, icub_posture(), {}, here);
    w_H_b(0, 3) += 10.0; // a whole number of squares
    renderer.render(w_H_b, icub_posture(), {}, there);
    EXPECT_LT(difference(here, there), 0.02);
}

TEST(Renderer, DrawsAFixedBase) {
    WorldOptions options;
    options.urdf = write_urdf("drawn_pendulum", R"(
      <link name="world_frame"/>
      <link name="bob"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><origin xyz="0 0 0.3"/><geometry><box size="0.1 0.1 0.6"/></geometry></visual></link>
      <joint name="swing" type="continuous"><axis xyz="1 0 0"/><parent link="world_frame"/><child link="bob"/></joint>)");
    options.floating_base = false;
    options.base_link = "world_frame";
    Simulation sim = simulate(options);
    Renderer renderer(sim.world(), {.width = 200, .height = 150});
    Image up, aside;
    renderer.render(sim.w_H_b(), std::vector<double>{0.0}, {}, up);
    renderer.render(sim.w_H_b(), std::vector<double>{1.0}, {}, aside);
    EXPECT_GT(difference(up, aside), 0.005);
}

TEST(Renderer, DrawsArrowsToScaleAndThroughTheRobot) {
    Simulation sim = simulate(icub_options());
    const double distance = 2.3;
    const RenderOptions options{
        .width = 300, .height = 300, .elevation = 0.0, .distance = distance, .look_at_height = 0.5};
    Renderer renderer(sim.world(), options);
    const Eigen::Matrix4d w_H_b = sim.w_H_b();
    const Eigen::Vector3d inside_the_robot(w_H_b(0, 3), w_H_b(1, 3), 0.2);
    const Arrow arrow{inside_the_robot, {0.0, 0.0, 0.6}, Arrow::Kind::contact};
    Image image;
    renderer.render(w_H_b, icub_posture(), {&arrow, 1}, image);
    int green_rows = 0;
    for (int y = 0; y < image.height; ++y) {
        bool green = false;
        for (int x = 0; x < image.width; ++x) {
            const std::uint8_t* rgb = &image.pixels[3 * static_cast<size_t>(y * image.width + x)];
            green = green || (rgb[1] > rgb[0] + 30 && rgb[1] > rgb[2] + 30);
        }
        green_rows += green;
    }
    // 300 rows span 2 distance tan(fovy / 2), fovy = 32 deg
    const double metres_per_row = 2.0 * distance * std::tan(16.0 * std::numbers::pi / 180.0) / 300;
    EXPECT_NEAR(green_rows * metres_per_row, 0.6, 0.03);
}

TEST(Renderer, WorksBesideOthersAndInAnyThread) {
    Simulation sim = simulate(icub_options());
    auto first = std::make_unique<Renderer>(sim.world(), RenderOptions{.width = 200, .height = 150});
    Renderer second(sim.world(), {.width = 100, .height = 100});
    Image before, after, small;
    second.render(sim, before);
    first->render(sim, small);
    first.reset();
    std::thread([&] { second.render(sim, after); }).join();
    EXPECT_EQ(difference(before, after), 0.0);
    EXPECT_EQ(small.width, 200);
}

TEST(Renderer, NamesAMeshItCannotFind) {
    WorldOptions options;
    options.urdf = write_urdf("meshes", R"(
      <link name="body"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><geometry><mesh filename="package://nobody/meshes/body.stl"/></geometry></visual></link>)");
    options.package_paths = {"/some/where"};
    const World world(options); // the physics needs no meshes
    const std::string text = message_of([&] { Renderer renderer(world); });
    for (const char* part :
         {"mesh 'package://nobody/meshes/body.stl' of link 'body'", "add the folder that holds",
          "to ROS_PACKAGE_PATH", "- /some/where/nobody/meshes/body.stl"})
        EXPECT_NE(text.find(part), std::string::npos) << text;
}

/// A square plate of 1 m as COLLADA, in centimetres and with y upwards, which ROS ignores.
const char* const plate = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="a" count="12">-50 0 -50 50 0 -50 50 0 50 -50 0 50</float_array>
      <technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3 2 1 0 3 2 0</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>)";

/// Two meshes of one name in two folders, found through the environment; the root is called world.
TEST(Renderer, ReadsColladaOfPackages) {
    const std::filesystem::path folder = output + "packages/share/plates";
    std::filesystem::create_directories(folder / "a");
    std::filesystem::create_directories(folder / "b");
    std::ofstream(folder / "a/plate.dae") << plate;
    std::ofstream(folder / "b/plate.dae")
        << std::string(plate).replace(std::string(plate).find("0.01"), 4, "0.02");
    const auto area = [&](const std::string& address) {
        WorldOptions options;
        options.floating_base = false;
        options.floor.enabled = false;
        options.urdf = write_urdf("collada", R"(<link name="world"/>
          <link name="body"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><geometry><mesh filename="package://plates/b/plate.dae"/></geometry></collision>
            <visual><geometry><mesh filename=")" +
                                                 address + R"("/></geometry></visual></link>
          <joint name="glue" type="fixed"><parent link="world"/><child link="body"/></joint>)");
        const World world(options);
        Renderer renderer(
            world,
            {.width = 200, .height = 200, .azimuth = 90, .elevation = 0, .distance = 6, .look_at_height = 0});
        Image with, without;
        renderer.render(Eigen::Matrix4d::Identity(), {}, {}, with);
        Eigen::Matrix4d away = Eigen::Matrix4d::Identity();
        away(2, 3) = 100;
        renderer.render(away, {}, {}, without);
        return difference(with, without);
    };
    ASSERT_EQ(setenv("AMENT_PREFIX_PATH", (output + "packages").c_str(), 1), 0);
    const double small = area("package://plates/a/plate.dae"), large = area("model://plates/b/plate.dae");
    unsetenv("AMENT_PREFIX_PATH");
    const double height = 2 * 6 * std::tan(16.0 * std::numbers::pi / 180.0); // m in the picture
    EXPECT_NEAR(small, 1 / (height * height), 0.01);
    EXPECT_NEAR(large, 4 / (height * height), 0.02);
}

TEST(Renderer, StandsStillOnRequest) {
    Simulation sim = simulate(icub_options());
    Renderer renderer(sim.world(), {.width = 200, .height = 150, .follows = false});
    Image here, there;
    Eigen::Matrix4d w_H_b = sim.w_H_b();
    renderer.render(w_H_b, icub_posture(), {}, here);
    w_H_b(1, 3) += 10.0;
    renderer.render(w_H_b, icub_posture(), {}, there);
    EXPECT_GT(difference(here, there), 0.03);
}

/// A box of 0.4 m, 0.2 m and 0.1 m that stands on the floor, and a ball of 0.1 m beside it.
Scene box_and_ball() {
    SceneOptions options;
    options.robots.push_back({.name = "robot"});
    auto& robot = options.robots[0].options;
    robot.urdf = write_urdf("standing_box", R"(
      <link name="box"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><geometry><box size="0.4 0.2 0.1"/></geometry></visual>
        <collision><geometry><box size="0.4 0.2 0.1"/></geometry></collision></link>)");
    robot.initial_w_H_b = Eigen::Matrix4d::Identity();
    (*robot.initial_w_H_b)(2, 3) = 0.0499;
    options.objects.push_back({.kind = SceneObject::Kind::sphere, .name = "ball"});
    options.objects[0].w_H_o(1, 3) = 2;
    options.objects[0].w_H_o(2, 3) = 0.3;
    options.objects[0].mass = 1;
    return Scene(options);
}

TEST(Renderer, DrawsAScene) {
    const Scene scene = box_and_ball();
    SceneSimulation start(std::make_shared<const Scene>(box_and_ball()));
    Eigen::VectorXd q = start.q();
    Renderer still(scene, {.width = 200, .height = 150}),
        with_ball(scene, {.width = 200, .height = 150, .followed = "ball"});
    const auto drawn = [&](Renderer& renderer, const Marks& marks = {}) {
        renderer.place({q.data(), static_cast<size_t>(q.size())});
        Image image;
        renderer.draw(marks, image);
        return image;
    };
    const Image first = drawn(still), followed = drawn(with_ball);
    EXPECT_LT(difference(drawn(still), first), 0.001);
    q[7] += 5; // a whole number of squares
    EXPECT_GT(difference(drawn(still), first), 0.001);
    EXPECT_GT(difference(drawn(with_ball), followed), 0.001) << "without the box";
    const Eigen::Vector3d at = with_ball.position(scene.frame("ball"));
    EXPECT_EQ(at, Eigen::Vector3d(5, 2, 0.3));
    EXPECT_EQ(message_of([&] { Renderer renderer(scene, {.followed = "bull"}); }),
              "the world has no body 'bull'; did you mean 'ball'? there are: robot/box, ball, robot/world");
    EXPECT_GT(difference(drawn(still, {.centres = {{0, 0, 0.05}}}), drawn(still)), 0.0002);
    EXPECT_GT(difference(drawn(still, {.lines = {{.points = {{0, 0, 0.3}, {0, 1, 0.3}}}}}), drawn(still)),
              0.001);
    EXPECT_GT(difference(drawn(still, {.caption = "before"}), drawn(still)), 0.001);
}

TEST(Renderer, TellsTheSupportPolygonAndTheCentreOfMassOfARobot) {
    const Scene scene = box_and_ball();
    const SceneSimulation start(std::make_shared<const Scene>(box_and_ball()));
    Renderer renderer(scene, {.width = 100, .height = 100});
    ASSERT_EQ(renderer.robot_count(), 1);
    Eigen::VectorXd q = start.q();
    renderer.place({q.data(), static_cast<size_t>(q.size())});
    const auto polygon = renderer.support(0);
    ASSERT_EQ(polygon.size(), 4u);
    double area = 0;
    for (size_t i = 0; i < 4; ++i) {
        const auto &a = polygon[i], &b = polygon[(i + 1) % 4];
        area += (a.x() * b.y() - a.y() * b.x()) / 2;
        EXPECT_NEAR(std::abs(a.x()), 0.2, 1e-9);
        EXPECT_NEAR(std::abs(a.y()), 0.1, 1e-9);
    }
    EXPECT_NEAR(area, 0.4 * 0.2, 1e-9) << "counterclockwise";
    EXPECT_LT((renderer.com(0) - Eigen::Vector3d(0, 0, 0.0499)).norm(), 1e-9);
    q[2] += 0.1;
    renderer.place({q.data(), static_cast<size_t>(q.size())});
    EXPECT_TRUE(renderer.support(0).empty()) << "it is in the air";
}

TEST(Renderer, FindsTheSupportOfAWorldsRobotUnderItsFeet) {
    Simulation sim = simulate(icub_options());
    HoldPosture hold(sim.world());
    for (int k = 0; k < 500; ++k) ASSERT_TRUE(sim.step(hold(sim)));
    Renderer renderer(sim.world(), {.width = 100, .height = 100});
    renderer.place(sim.w_H_b(), {sim.s().data(), static_cast<size_t>(sim.s().size())});
    const auto polygon = renderer.support(0);
    ASSERT_GE(polygon.size(), 4u);
    const Eigen::Vector3d com = renderer.com(0);
    EXPECT_LT((com - Eigen::Vector3d(sim.com())).norm(), 1e-6);
    for (size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::Vector3d side = polygon[(i + 1) % polygon.size()] - polygon[i], to = com - polygon[i];
        EXPECT_GT(side.x() * to.y() - side.y() * to.x(), 0) << "it stands";
        EXPECT_NEAR(polygon[i].z(), 0, 0.002);
    }
}

TEST(Renderer, RefusesWrongSizes) {
    EXPECT_EQ(message_of([] { RenderOptions{.width = 0, .distance = -1.0}.validate(); }),
              "render options:\n- width is 0; it must be 1 to 8192 pixels\n- distance is -1; it must be "
              "positive (m)");
    Simulation sim = simulate(icub_options());
    Renderer renderer(sim.world(), {.width = 20, .height = 15});
    Image image;
    EXPECT_EQ(message_of([&] { renderer.render(sim.w_H_b(), std::vector<double>(2), {}, image); }),
              "render got 2 joint positions; the robot has 23");
}

TEST(VideoWriter, WritesAnMp4ThroughFfmpeg) {
    Simulation sim = simulate(icub_options());
    Renderer renderer(sim.world(), {.width = 161, .height = 121});
    VideoWriter video(output + "icub.mp4", 161, 121, 25.0);
    HoldPosture hold(sim.world());
    Image image;
    for (int frame = 0; frame < 5; ++frame) {
        for (int k = 0; k < 40; ++k) ASSERT_TRUE(sim.step(hold(sim)));
        renderer.render(sim, image);
        video.add(image);
    }
    video.close();
    EXPECT_EQ(read_file(output + "icub.mp4").substr(4, 4), "ftyp");
    EXPECT_NE(message_of([&] { video.add(image); }).find("is closed"), std::string::npos);
}

TEST(VideoWriter, SaysWhatFfmpegRefuses) {
    VideoWriter video("/nowhere/film.mp4", 16, 16, 25.0);
    const Image image{16, 16, std::vector<std::uint8_t>(3 * 16 * 16)};
    const std::string text = message_of([&] {
        for (int i = 0; i < 10000; ++i) video.add(image);
        video.close();
    });
    EXPECT_NE(text.find("ffmpeg could not write '/nowhere/film.mp4'"), std::string::npos) << text;
    EXPECT_NE(text.find("No such file"), std::string::npos) << text;
    EXPECT_NE(message_of([&] {
                  video.add(Image{8, 8, {}});
              }).find("holds frames of 16 x 16 pixels"),
              std::string::npos);
}

TEST(VideoWriter, SaysThatFfmpegIsMissing) {
    const std::string path = std::getenv("PATH");
    setenv("PATH", "/nowhere", 1);
    const std::string text = message_of([] { VideoWriter video(output + "film.mp4", 16, 16, 25.0); });
    setenv("PATH", path.c_str(), 1);
    EXPECT_NE(text.find("the program ffmpeg did not start"), std::string::npos) << text;
    EXPECT_NE(text.find("install ffmpeg"), std::string::npos) << text;
}

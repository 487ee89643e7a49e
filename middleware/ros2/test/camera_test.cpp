// Pictures and transforms of a served world, as programs of rclpy see them.
#include "heap.hpp"
#include "models.hpp"
#include "peer.hpp"

#include <cmath>
#include <sstream>

namespace bf::ros2::test {
namespace {

std::vector<double> numbers_of_line(const std::string& line) {
    std::istringstream words(line);
    std::vector<double> all;
    for (std::string word; words >> word;) all.push_back(std::strtod(word.c_str(), nullptr));
    return all;
}

/// A red box whose face is the plane x = 2, 0.4 m wide and 0.2 m high, and 0.1 m above the middle of what is
/// seen; a green wall at x = 4, up to z = 1.5; nothing above it.
const char* const box_and_wall = R"(<world step="0.001"><floor/>
  <box name="box" size="0.2 0.4 0.2" position="2.1 0 0.6" colour="0.9 0.05 0.05"/>
  <box name="wall" size="0.1 8 1.5" position="4.05 0 0.75" colour="0.05 0.8 0.05"/></world>)";

std::string camera_model(const Folder& folder, const std::string& settings = ", stamp: model") {
    return "model: m\nplugins: [Ros2, WholeBodyToolbox, WholeBodyCameras]\nstep: 0.01\nblocks:\n"
           "  node: {block: Ros2/Node, namespace: /lab}\n"
           "  world: {block: WholeBodyToolbox/World, file: \"'" +
           folder.write("world.xml", box_and_wall) +
           "'\"}\n"
           "  camera: {block: WholeBodyCameras/WorldCamera, width: 160, height: 120, with_depth: true, "
           "range: 6, "
           "pose: \"[0 0 1 0; -1 0 0 0; 0 -1 0 0.5; 0 0 0 1]\", period: 0.05}\n"
           "  show: {block: Ros2/PublishCamera, topic: eye, frame_id: eye_optical, width: 160, height: 120, "
           "with_depth: true, range: 6" +
           settings + "}\nconnections: {camera.colour: show.colour, camera.depth: show.depth}\n";
}

} // namespace

using Ros2Camera = Alone;
using Ros2Transforms = Alone;

TEST_F(Ros2Camera, ShowsImagesDepthsAndPointsOfTheWorld) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    const Folder folder;
    Running run(camera_model(folder));
    Peer peer({"camera", "/lab/eye"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string heard = line_while(peer, [&] { return run.step(); });
    const double time = std::stod(heard);
    EXPECT_NEAR(std::remainder(time, 0.05), 0, 1e-9) << "time of the model, in which the camera has a period";
    EXPECT_EQ(peer.line(), "rgb8 120 160 480 0 eye_optical 57600");
    EXPECT_EQ(peer.line(), "32FC1 120 160 640 0 eye_optical 76800");
    EXPECT_EQ(peer.line(), "x:0:7:1 y:4:7:1 z:8:7:1 rgb:12:7:1 120 160 16");
    EXPECT_EQ(peer.line(), "2560 False eye_optical 307200");
    EXPECT_EQ(peer.line(), "plumb_bob [0.0, 0.0, 0.0, 0.0, 0.0] 120 160 eye_optical");
    const std::string points = peer.line();
    EXPECT_LT(numbers_of_line(points)[0], 1e-5) << points;
    expect_contains(points, " True True ");
    EXPECT_GT(numbers_of_line(points)[3], 0) << "above the wall is nothing";
    const double f = 60 / std::tan(0.4);
    const std::string lens = peer.line();
    const auto k = numbers_of_line(lens);
    EXPECT_NEAR(k[0], f, 1e-9);
    EXPECT_EQ(k[1], 79.5);
    EXPECT_NEAR(k[2], f, 1e-9);
    EXPECT_EQ(k[3], 59.5);
    expect_contains(lens, "True");
    const auto seen = numbers_of_line(peer.line().substr(std::string("float32 ").size()));
    ASSERT_EQ(seen.size(), 8U);
    EXPECT_NEAR(seen[0], 2, 4e-3) << "the box";
    EXPECT_GT(seen[1], 2 * seen[2]) << "it is red";
    EXPECT_TRUE(std::isinf(seen[4])) << "nothing is above the wall";
    // The box, from 0 to 0.2 m above the axis and 0.2 m to both sides, in the plane at 2 m.
    const auto corners = numbers_of_line(peer.line());
    const std::vector<double> expected{59.5 - 0.1 * f, 79.5 - 0.1 * f, 59.5, 79.5 + 0.1 * f};
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(corners[i], expected[i], 1) << i;
}

TEST_F(Ros2Camera, CostsTheStepNoHeap) {
    Running run(model("  c: {block: Ros2/PublishCamera, width: 8, height: 4, with_depth: true}\n",
                      "u: c.depth, v: c.colour", "u: {shape: [4, 8]}, v: {shape: [4, 24], type: uint8}"));
    for (int k = 0; k < 50; ++k) {
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (bf::test::heap_is_counted() && k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
}

TEST_F(Ros2Camera, RefusesWhatIsNone) {
    const auto wrong = [](const std::string& settings) {
        return refusal(model("  c: {block: Ros2/PublishCamera" + settings + "}\n"));
    };
    expect_contains(wrong(", with_colour: false"),
                    "the camera shows nothing; let with_colour or with_depth be true");
    expect_contains(wrong(", topic: ''"), "argument 'topic': '' is no name of ROS 2: ");
    expect_contains(refusal(model("  c: {block: Ros2/PublishCamera, width: 8, height: 4}\n", "u: c.colour",
                                  "u: {shape: [4, 8], type: uint8}")),
                    "c: input 'colour'");
}

TEST_F(Ros2Transforms, AreThoseOfTheirMatrices) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rclpy";
    setenv("AMENT_PREFIX_PATH", BF_ROS2_MESSAGES, 1);
    const auto tf = [](const std::string& settings) {
        return model(
            "  t: {block: Ros2/PublishTransforms, frame_id: map, children: \"{'base', 'left.hand'}\", "
            "stamp: model" +
                settings + "}\n",
            "u: t.base, v: t.left_hand", "u: {shape: [4, 4]}, v: {shape: [4, 4]}");
    };
    Matrix quarter(4, 4); // about z, then 1, 2, 3 m away
    quarter << 0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1;
    for (const bool is_static : {false, true}) {
        Running run(tf(is_static ? ", static: true" : ""));
        run.set("u", quarter).set("v", Matrix::Identity(4, 4));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        Peer peer({is_static ? "latched" : "echo", "tf2_msgs/msg/TFMessage", is_static ? "/tf_static" : "/tf",
                   "1"});
        ASSERT_EQ(peer.line(), "ready");
        const std::string heard = line_while(peer, [&] { return run.step(); });
        expect_contains(heard,
                        "frame_id='map'), child_frame_id='base', "
                        "transform=geometry_msgs.msg.Transform(translation=geometry_msgs.msg.Vector3(x=1.0, "
                        "y=2.0, z=3.0), rotation=geometry_msgs.msg.Quaternion(x=0.0, y=0.0, z=0.70710678");
        expect_contains(heard, "child_frame_id='left.hand'");
        if (is_static) {
            expect_contains(heard, "Time(sec=0, nanosec=0)"); // it is sent once, and stays
        }
    }
    unsetenv("AMENT_PREFIX_PATH");
}

TEST_F(Ros2Transforms, RefuseWhatAreNone) {
    setenv("AMENT_PREFIX_PATH", BF_ROS2_MESSAGES, 1);
    const auto wrong = [](const std::string& settings) {
        return refusal(model("  t: {block: Ros2/PublishTransforms" + settings + "}\n"));
    };
    expect_contains(wrong(", children: \"{'a b', 'a_b'}\""), "argument 'children' has the port 'a_b' twice");
    expect_contains(wrong(", children: \"{'world'}\""), "the frame 'world' cannot be in 'world'");
    expect_contains(wrong(", children: \"{}\""),
                    "argument 'children' names no frame; name some, such as base");
    unsetenv("AMENT_PREFIX_PATH");
}

} // namespace bf::ros2::test

// Messages of any type, to and from programs of ROS 1 that are not ours.
#include "bf/middleware/topics.hpp"
#include "cycles.hpp"
#include "heap.hpp"
#include "master.hpp"
#include "running.hpp"
#include "told.hpp"
#include "types.hpp"

#include <cmath>
#include <functional>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string model(const std::string& blocks, const std::string& connections = "",
                  const std::string& inputs = "", const std::string& node = "Node") {
    return "model: m\nplugins: [Ros1]\nstep: 0.01\n" + (inputs.empty() ? "" : "inputs: {" + inputs + "}\n") +
           "blocks:\n  node: {block: Ros1/" + node + "}\n" + blocks +
           (connections.empty() ? "" : "connections: {" + connections + "}\n");
}
std::string publish(const std::string& settings) { return "  p: {block: Ros1/Publish" + settings + "}\n"; }
std::string subscribe(const std::string& settings) {
    return "  s: {block: Ros1/Subscribe" + settings + "}\n";
}

} // namespace

using Ros1Topics = WithMaster;

TEST(Ros1Types, HaveTheMd5ThatOtherProgramsCompare) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rospy";
    const std::vector<std::string> types{"std_msgs/String",         "std_msgs/Float64MultiArray",
                                         "std_msgs/Header",         "sensor_msgs/Imu",
                                         "sensor_msgs/JointState",  "sensor_msgs/BatteryState",
                                         "sensor_msgs/CameraInfo",  "sensor_msgs/MultiDOFJointState",
                                         "sensor_msgs/PointCloud2", "sensor_msgs/TimeReference",
                                         "geometry_msgs/Twist",     "trajectory_msgs/JointTrajectory"};
    std::vector<std::string> words{"md5"};
    words.insert(words.end(), types.begin(), types.end());
    Peer peer(words);
    for (const auto& type : types) EXPECT_EQ(MessageType::find(type)->md5(), peer.line()) << type;
    const std::vector<std::string> services{"std_srvs/Empty", "std_srvs/Trigger", "std_srvs/SetBool",
                                            "sensor_msgs/SetCameraInfo"};
    words.assign({"md5"});
    words.insert(words.end(), services.begin(), services.end());
    Peer other(words);
    for (const auto& type : services) EXPECT_EQ(ServiceType::find(type).md5, other.line()) << type;
    EXPECT_THROW(ServiceType::find("std_srvs/Triger"), std::runtime_error);
}

TEST(Ros1Types, RefuseBytesThatAreNoMessage) {
    const auto type = MessageType::find("sensor_msgs/JointState");
    const auto message = std::static_pointer_cast<Message>(type->make());
    const double three[] = {1, 2, 3};
    type->field("position")->write(message.get(), three, 3);
    type->field("name")->write(message.get(), {"hip", "knee"});
    std::vector<std::uint8_t> bytes;
    type->encode(*message, bytes);
    Message back;
    back.values.resize(type->fields().size());
    type->decode(bytes, back);
    double read[3] = {};
    type->field("position")->read(&back, read, 3);
    EXPECT_EQ(read[2], 3);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        // A copy of that size, so that an address sanitizer sees what is read behind it.
        const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_THROW(type->decode(cut, back), std::runtime_error) << size;
    }
    bytes.push_back(0);
    EXPECT_THROW(type->decode(bytes, back), std::runtime_error);
    std::vector<std::uint8_t> many(16, 0xff); // more names than there can be
    many[12] = many[13] = many[14] = many[15] = 0;
    EXPECT_THROW(type->decode(many, back), std::runtime_error);
}

TEST_F(Ros1Topics, AreHeardByRospy) {
    Running run(model(publish(", topic: states, type: sensor_msgs/JointState, fields: \"{'position', "
                              "'velocity'}\", texts: \"{'name=hip,knee'}\", frame_id: base, stamp: model"),
                      "u: p.position, v: p.velocity", "u: {shape: 2}, v: {shape: 1}"));
    run.set("u", Eigen::Vector2d(0.5, -0.25)).set("v", 3);
    Peer peer({"echo", "sensor_msgs/JointState", "/states", "1"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string heard = line_while(peer, [&] { return run.step(); });
    expect_contains(heard,
                    "frame_id: \"base\" | name:  |   - hip |   - knee | position: [0.5, -0.25] | velocity: "
                    "[3.0] | effort: []");
    const auto nanoseconds = std::stol(heard.substr(heard.find("nsecs:") + 6));
    EXPECT_EQ(nanoseconds % 10'000'000, 0) << "time of the model: " << heard;
}

TEST_F(Ros1Topics, AreHeardFromRospy) {
    Peer peer({"send", "sensor_msgs/Imu", "/imu", "200",
               std::string(middleware::test::imu_values) + "m.header.stamp=rospy.Time(7, 500000000)"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(model(subscribe(", topic: /imu, type: sensor_msgs/Imu, frame_id: base, start_timeout: 20")));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    middleware::test::expect_the_imu(run);
    peer.end();
    middleware::test::expect_the_imu_to_stay(run);
}

TEST_F(Ros1Topics, HaveTheNearestNumberThatTheirTypeCanHold) {
    for (const auto& [type, given, expected] :
         std::vector<std::tuple<std::string, double, double>>{{"Bool", 2, 1},
                                                              {"Int8", 200, 127},
                                                              {"UInt8", -1, 0},
                                                              {"Int16", -40000, -32768},
                                                              {"Int32", 3e9, 2147483647.0},
                                                              {"UInt32", 3e9, 3e9},
                                                              {"Int64", -1e18, -1e18},
                                                              {"UInt64", 1e19, 1e19},
                                                              {"Float32", 0.1, 0.1F},
                                                              {"Time", -1, 0},
                                                              {"Time", 1.5, 1.5},
                                                              {"Duration", -1.25, -1.25},
                                                              {"Float64", 0.1, 0.1}}) {
        const std::string topic =
            ", topic: " + type + std::to_string(static_cast<int>(given > 0)) + ", type: std_msgs/" + type;
        Running run(model(publish(topic) + subscribe(topic), "u: p", "u: {}"));
        run.set("u", given);
        EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.received") > 0; }))
            << run.simulation.failure();
        EXPECT_EQ(run.scalar("s.data"), expected) << type << " of " << given;
    }
}

TEST_F(Ros1Topics, CostTheStepNoHeapAndNoWaiting) {
    Running run(model(publish(", topic: twist, type: geometry_msgs/Twist") +
                          subscribe(", topic: twist, type: geometry_msgs/Twist"),
                      "u: p.linear", "u: {shape: 3}"));
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step());
    }
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 200; ++k) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

TEST_F(Ros1Topics, RefuseWhatTheMessagesCannotBe) {
    expect_contains(refusal(model(publish(", type: sensor_msgs/Imuu"))),
                    "argument 'type': there is no message sensor_msgs/Imuu in ");
    expect_contains(refusal(model(publish(", type: ../x/Imu"))),
                    "'../x/Imu' is no type of message; write package/Type, such as sensor_msgs/Imu");
    expect_contains(refusal(model(subscribe(", type: geometry_msgs/Twist, fields: \"{'speed'}\""))),
                    "argument 'fields': geometry_msgs/Twist has no numbers 'speed'; it has linear, angular");
    expect_contains(refusal(model(subscribe(", topic: nobody, start_timeout: 0.1"))),
                    "s: no message of 'nobody' came within 0.1 s; start who sends it");
    expect_contains(refusal(model("", "", "", "Node, remap: \"{'a'}\"")),
                    "argument 'remap': 'a' is not given as from:=to");
    expect_contains(refusal(model("", "", "", "Node, name: other")),
                    "a program is one node of ROS 1, and this one is 'blockfactory'; give all nodes and "
                    "robots of the model the same name and remap");
    expect_contains(refusal("model: m\nplugins: [Ros1]\nstep: 0.01\nblocks:\n" + subscribe("")),
                    "ROS 1 node");
}

TEST_F(Ros1Topics, TakeWholeNumbersAloneAsSizes) {
    for (const std::string size : {"1e9", "1e1", "2.7", "3x", " 3", "3 ", "+3", "0x10", "-1", "0", "",
                                   "1000001", "99999999999999999999", "inf"}) {
        const std::string expected = "argument 'sizes': 'position=" + size +
                                     "' is not given as field=size, with a whole number from 1 to 1000000, "
                                     "such as position=7";
        const auto message =
            refusal(model(subscribe(", type: sensor_msgs/JointState, sizes: \"{'position=" + size + "'}\"")));
        expect_contains(message, "s: " + expected);
    }
    expect_contains(refusal(model("  c: {block: Ros1/Call, type: sensor_msgs/SetCameraInfo, sizes: "
                                  "\"{'success=2.7'}\"}\n")),
                    "c: argument 'sizes': 'success=2.7' is not given as field=size");
    EXPECT_EQ(refusal(model(subscribe(", type: sensor_msgs/JointState, sizes: \"{'position=1000000'}\""))),
              "");
}

TEST_F(Ros1Topics, EndTheRunWhereAMessageDoesNotFit) {
    const auto failure_of = [](const std::string& sent, const std::string& expected) {
        Running run(model(
            publish(", topic: fit, type: sensor_msgs/JointState, fields: \"{'position'}\"" + sent) +
                subscribe(", topic: fit, type: sensor_msgs/JointState, sizes: \"{'position=2'}\"" + expected),
            "u: p", "u: {shape: 3}"));
        steps_until(run, [] { return false; });
        return run.simulation.failure();
    };
    expect_contains(failure_of("", ""),
                    "s: a message has 3 elements in 'position', but at most 2 are expected; raise "
                    "argument 'sizes'");
    expect_contains(failure_of(", frame_id: world", ", frame_id: base"),
                    "s: a message of 'fit' is of another frame than 'base', which argument 'frame_id' says");
    Running silent(model(subscribe(", timeout: 0.05")));
    for (int k = 0; k < 1000 && silent.step(); ++k) usleep(1000);
    expect_contains(
        silent.simulation.failure(),
        "s: no message of 'topic' came within the timeout of 0.05 s; look whether its sender runs");
}

TEST_F(Ros1Topics, EndTheRunWhereAnotherProgramSendsAnotherType) {
    Peer peer({"send", "std_msgs/String", "/other", "100", "m.data='no number'"});
    ASSERT_EQ(peer.line(), "ready");
    Running run(model(subscribe(", topic: /other, type: std_msgs/Float64")));
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "s: '/peer_");
    expect_contains(run.simulation.failure(),
                    "sends std_msgs/String (992ce8a1687cec8c8bd883ec73ca41d1), not std_msgs/Float64 "
                    "(fdb28210bfa9d7c91146260178d9a584); correct argument 'type'");
}

TEST_F(Ros1Topics, StayForThoseWhoComeLater) {
    Running first(model(publish(", topic: kept, latch: true"), "u: p", "u: {}"));
    first.set("u", 5);
    ASSERT_TRUE(first.step());
    Running later(model(subscribe(", topic: kept, start_timeout: 20")));
    ASSERT_TRUE(later.step()) << later.simulation.failure();
    EXPECT_EQ(later.scalar("s.data"), 5);
}

TEST_F(Ros1Topics, HaveTheTimeOfWhoeverSendsTheClock) {
    Peer peer({"send", "rosgraph_msgs/Clock", "/clock", "100", "m.clock=rospy.Time(100+k)"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string joints = ", topic: timed, type: sensor_msgs/JointState, fields: ";
    Running run(model(publish(joints + "\"{'position'}\"") + subscribe(joints + "\"{'header.stamp'}\""),
                      "u: p", "u: {shape: 1}", "Node, use_sim_time: true"));
    EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.header_stamp") >= 110; }))
        << run.scalar("s.header_stamp");
    EXPECT_LT(run.scalar("s.header_stamp"), 1e4) << "it is that of the clock";
    EXPECT_EQ(run.scalar("s.header_stamp"), std::floor(run.scalar("s.header_stamp")));
}

TEST_F(Ros1Topics, KeepTheCommasOfASingleText) {
    Running run(model(publish(", topic: text, type: std_msgs/String, texts: \"{'data=hello, world'}\"")));
    Peer peer({"echo", "std_msgs/String", "/text", "1"});
    ASSERT_EQ(peer.line(), "ready");
    const std::string heard = line_while(peer, [&] { return run.step(); });
    EXPECT_EQ(heard, "data: \"hello, world\"");
}

TEST(Ros1Node, TellsWhatOthersSayWithoutItsBraces) {
    middleware::LiveIncoming end({MessageType::find("std_msgs/Float64"), {}, 0, ""});
    end.refuse("'x' sends {element}");
    EXPECT_STREQ(end.refusal(), "'x' sends (element)");
}

TEST_F(Ros1Topics, LeaveNothingBehindHoweverOftenTheyStart) {
    int k = 0;
    middleware::test::expect_no_leak([&] {
        Running run(model(publish(", topic: again") + subscribe(", topic: again"), "u: p", "u: {}"));
        run.set("u", ++k);
        EXPECT_TRUE(steps_until(run, [&] { return run.scalar("s.received") > 0; }))
            << run.simulation.failure();
        EXPECT_EQ(run.scalar("s.data"), k);
        run.simulation.stop();
    });
}

TEST(Ros1Node, SaysThatNoMasterAnswers) {
    const Folder folder;
    const auto file = folder.write("m.yaml", model(publish("")));
    Socket stalls; // it takes calls, and answers none
    const auto address = stalls.address(0);
    ASSERT_EQ(bind(stalls.number, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(listen(stalls.number, 5), 0);
    for (const int port : {free_port(), stalls.port()}) {
        const std::string uri = "http://127.0.0.1:" + std::to_string(port);
        const auto command = "ROS_MASTER_URI=" + uri +
                             " BLOCKFACTORY_PLUGIN_PATH='" BF_PLUGIN_DIRECTORY "' '" BF_PROGRAM "' run '" +
                             file + "' --stop 0.1 2>&1 >/dev/null";
        FILE* program = popen(command.c_str(), "r");
        ASSERT_NE(program, nullptr);
        char text[1000] = "";
        const auto size = fread(text, 1, sizeof text - 1, program);
        EXPECT_NE(pclose(program), 0);
        expect_contains({text, size}, "node: no master of ROS 1 answers at " + uri +
                                          "; start roscore, or say by ROS_MASTER_URI where it is");
    }
}

TEST_F(Ros1Topics, AreOfThisComputerAlone) {
    Running run(model(publish(", topic: x")));
    ASSERT_TRUE(run.step());
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        const int file = std::stoi(entry.path().filename());
        int is_listening = 0;
        sockaddr_in address{};
        char device[16] = "";
        socklen_t size = sizeof is_listening, address_size = sizeof address, device_size = sizeof device;
        if (getsockopt(file, SOL_SOCKET, SO_ACCEPTCONN, &is_listening, &size) != 0 || is_listening == 0)
            continue;
        getsockname(file, reinterpret_cast<sockaddr*>(&address), &address_size);
        getsockopt(file, SOL_SOCKET, SO_BINDTODEVICE, device, &device_size);
        EXPECT_TRUE(ntohl(address.sin_addr.s_addr) == INADDR_LOOPBACK || std::string(device) == "lo");
        ++count;
    }
    EXPECT_EQ(count, 2) << "for calls and for messages";
}

} // namespace bf::ros1::test

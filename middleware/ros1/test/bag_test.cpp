// Bags that rosbag has written, played into diagrams.
#include "bf/recording/reader.hpp"
#include "heap.hpp"
#include "master.hpp"
#include "running.hpp"

#include <cstring>
#include <map>

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

std::string playing(const std::string& file, const std::string& blocks, const std::string& more = "") {
    return "model: m\nplugins: [Ros1]\nstep: 0.01\nblocks:\n  bag: {block: Ros1/Bag, file: " + file + more +
           "}\n" + blocks;
}
std::string joints(const std::string& more = "") {
    return "  s: {block: Ros1/Subscribe, topic: /joint_states, type: sensor_msgs/JointState, sizes: "
           "\"{'position=2', 'velocity=2'}\"" +
           more + "}\n";
}
const std::string imu = "  imu: {block: Ros1/Subscribe, topic: imu, type: sensor_msgs/Imu, fields: "
                        "\"{'linear_acceleration'}\"}\n";

/// Two seconds of joints, every 10 ms in no order, and of an IMU, every 100 ms and 5 ms later.
constexpr const char* drive =
    "for k in sorted(range(200), key=lambda k: k * 7 % 200):\n"
    "    write('/joint_states', 'sensor_msgs/JointState', k / 100, f'm.header.frame_id=\"base\"; "
    "m.name=[\"hip\", \"knee\"]; m.position=[{k}/7, {k}.0]; m.velocity=[1.5]*({k}%3)')\n"
    "    if k % 10 == 0: write('/imu', 'sensor_msgs/Imu', k / 100 + 0.005, "
    "f'm.linear_acceleration.z={k}.5')\n";

constexpr const char* ten_times_a_second =
    "for k in range(200): write('/a/x', 'geometry_msgs/Point', k / 10, f'm.y={k}')";

class Ros1Bags : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!Peer::is_there()) GTEST_SKIP() << "there is no rosbag";
    }
    std::string bag(const std::string& name, const std::string& compression, const std::string& text) const {
        const std::string file = folder_.path / name;
        Peer peer({"bag", file, compression, text});
        EXPECT_EQ(peer.line(), "written");
        return file;
    }
    std::string bytes(const std::string& file) const {
        std::ifstream stream(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }
    Folder folder_;
};

} // namespace

TEST_F(Ros1Bags, PlayTheNewestMessageAtEachTimeHoweverTheyAreCompressed) {
    for (const std::string compression : {"none", "bz2", "lz4"}) {
        Running run(playing(bag(compression + ".bag", compression, drive), joints(", frame_id: base") + imu));
        for (int k = 0; k < 250; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            const int last = std::min(k, 199);
            EXPECT_EQ(run.get("s.position"), Matrix(Eigen::Vector2d(last / 7.0, last))) << k;
            EXPECT_EQ(run.scalar("s.velocity_length"), last % 3);
            EXPECT_EQ(run.get("s.velocity"),
                      Matrix(Eigen::Vector2d(last % 3 > 0 ? 1.5 : 0, last % 3 > 1 ? 1.5 : 0)));
            EXPECT_EQ(run.scalar("s.received"), last + 1);
            EXPECT_NEAR(run.scalar("s.age"), (k - last) / 100.0, 1e-9);
            const int tenth = k == 0 ? -1 : std::min((k - 1) / 10, 19);
            EXPECT_EQ(run.get("imu.linear_acceleration")(2), tenth < 0 ? 0 : 10 * tenth + 0.5) << k;
        }
    }
}

TEST_F(Ros1Bags, HoldWhatRosbagItselfReads) {
    const auto file = bag("drive.bag", "bz2", drive);
    Peer peer({"index", file});
    std::map<long, double> positions; // by ns
    while (positions.size() < 200) {
        const std::string line = peer.line();
        ASSERT_FALSE(line.empty());
        if (const auto at = line.find("position: ["); at != std::string::npos)
            positions[std::stol(line.substr(line.find(' ')))] = std::stod(line.substr(at + 11));
    }
    Running run(playing(file, joints()));
    for (const auto& [time, position] : positions) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.get("s.position")(0), position) << time;
    }
}

TEST_F(Ros1Bags, AreTheSameInEachRunAndFromAnyBeginning) {
    const auto file = bag("drive.bag", "lz4", drive);
    Running first(playing(file, joints())), second(playing(file, joints())),
        later(playing(file, joints(), ", begin: 0.5"));
    for (int k = 0; k < 50; ++k) {
        ASSERT_TRUE(first.step());
    }
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(first.step());
        ASSERT_TRUE(later.step());
        EXPECT_EQ(first.get("s.position"), later.get("s.position")) << k;
        EXPECT_EQ(first.scalar("s.received"), later.scalar("s.received"));
    }
    const auto snapshot = first.simulation.snapshot();
    ASSERT_TRUE(first.step());
    const Matrix expected = first.get("s.position");
    second.simulation.restore(snapshot);
    ASSERT_TRUE(second.step());
    EXPECT_EQ(second.get("s.position"), expected);
}

TEST_F(Ros1Bags, HaveTopicsWithAndWithoutASlash) {
    const auto file = bag("bare.bag", "none", "write('x', 'geometry_msgs/Point', 0, 'm.y=3.0')");
    for (const std::string topic : {"x", "/x"}) {
        Running run(
            playing(file, "  p: {block: Ros1/Subscribe, topic: " + topic + ", type: geometry_msgs/Point}\n"));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("p.y"), 3);
    }
}

TEST_F(Ros1Bags, CostTheStepNoHeap) {
    Running run(playing(bag("drive.bag", "none", drive), joints() + imu));
    ASSERT_TRUE(run.step());
    const long before = bf::test::heap_calls();
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(run.step());
    }
    EXPECT_EQ(bf::test::heap_calls(), before);
}

TEST_F(Ros1Bags, AreRecordingsToo) {
    const auto recording = recording::load(bag("points.bag", "lz4", ten_times_a_second));
    EXPECT_TRUE(recording.complete) << recording.defect;
    const auto& y = recording.channel("a.x.y");
    ASSERT_EQ(y.samples(), 200U);
    EXPECT_EQ(y.value(199), 199);
    EXPECT_DOUBLE_EQ(y.time(199), 19.9);
}

TEST_F(Ros1Bags, AreRefusedWhereTheyDoNotFit) {
    const auto file = bag("drive.bag", "none", drive);
    expect_contains(refusal(playing("\"\"", joints())), "bag: argument 'file' is empty; name a bag");
    expect_contains(refusal(playing("/no/such.bag", joints())), "bag: cannot open the bag '/no/such.bag': ");
    expect_contains(refusal(playing(folder_.write("text.bag", "no bag at all"), joints())),
                    "text.bag' is no bag: it does not start with '#ROSBAG V2.0'");
    expect_contains(refusal(playing(folder_.write("old.bag", "#ROSBAG V1.2\n"), joints())),
                    "old.bag' is a bag of another version than 2.0, which rosbag migrates: run 'rosbag fix'");
    expect_contains(refusal(playing(file, "  s: {block: Ros1/Subscribe, topic: odom}\n")),
                    "s: the bag '" + file +
                        "': it has no topic '/odom'; it has /imu (sensor_msgs/Imu), /joint_states "
                        "(sensor_msgs/JointState)");
    expect_contains(refusal(playing(file, "  s: {block: Ros1/Subscribe, topic: imu}\n")),
                    "'/imu' is of sensor_msgs/Imu (6a62c6daae103f4ff57a132d6f95cec2), not std_msgs/Float64 "
                    "(fdb28210bfa9d7c91146260178d9a584); correct argument 'type'");
    expect_contains(refusal(playing(file, joints(", frame_id: world"))),
                    "the message of '/joint_states' at 0 s is of another frame than 'world', which argument "
                    "'frame_id' says");
    expect_contains(
        refusal(playing(file, "  s: {block: Ros1/Subscribe, topic: joint_states, type: "
                              "sensor_msgs/JointState, sizes: \"{'position=1'}\"}\n")),
        "at 0 s has 2 elements in 'position', but at most 1 are expected; raise argument 'sizes'");
    expect_contains(refusal(playing(bag("empty.bag", "none", "pass"), joints())), "has no messages");
}

TEST_F(Ros1Bags, AreRefusedWhereverTheyWereCut) {
    const std::string all = bytes(bag("drive.bag", "bz2", drive));
    for (std::size_t size = 13; size < all.size(); size += 211) {
        const auto file = folder_.write("cut.bag", all.substr(0, size));
        const std::string text = refusal(playing(file, joints()));
        // Between two records nothing tells that there was more, but that topics or messages are missing.
        EXPECT_TRUE(text.find("the bag was cut") != text.npos || text.find("it has no topic") != text.npos ||
                    text.find("has no messages") != text.npos || text.find("has no header") != text.npos ||
                    text.empty())
            << size << ": " << text;
    }
    const std::string points = bytes(bag("points.bag", "none", ten_times_a_second));
    const auto cut = folder_.write("cut.bag", points.substr(0, points.size() / 2));
    const auto recording = recording::load(cut);
    EXPECT_FALSE(recording.complete);
    expect_contains(recording.defect, ": the bag was cut; 'rosbag reindex' mends it");
    const auto samples = recording.channel("a.x.y").samples();
    EXPECT_GT(samples, 10U) << "what was there is read";
    Peer rosbag({"reindex", cut});
    EXPECT_EQ(rosbag.line(), "reindexed");
    const auto mended = recording::load(cut);
    EXPECT_TRUE(mended.complete) << mended.defect;
    EXPECT_GT(mended.channel("a.x.y").samples(), 10U) << "of whole chunks";
    EXPECT_LE(mended.channel("a.x.y").samples(), samples);
}

TEST_F(Ros1Bags, AreRefusedOrPlayedWhereBytesAreWrong) {
    std::string all = bytes(bag("drive.bag", "none", drive));
    for (std::size_t at = 13; at < all.size(); at += 97) {
        const char right = std::exchange(all[at], static_cast<char>(all[at] ^ 0xff));
        const auto file = folder_.write("wrong.bag", all);
        try {
            Running run(playing(file, joints()));
            for (int k = 0; k < 5; ++k) {
                EXPECT_TRUE(run.step()) << run.simulation.failure();
            }
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::strlen(error.what()), 0U);
        }
        all[at] = right;
    }
}

} // namespace bf::ros1::test

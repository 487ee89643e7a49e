// Recordings of other programs.
#include "../src/format.hpp"
#include "bf/recording/reader.hpp"

#include <cmath>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace bf::recording {
namespace {

constexpr const char* odometry =
    "std_msgs/Header header\n"
    "# where it is\n"
    "geometry_msgs/Point[2] points   # two of them\n"
    "int8 MODE_A=1\n"
    "int8 mode 3\n"
    "string<=5 label\n"
    "float32[] ranges\n"
    "bool ok\n"
    "================================================================================\n"
    "MSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\n"
    "string frame_id\n"
    "================================================================================\n"
    "MSG: geometry_msgs/Point\n"
    "float64 x\nfloat64 y\n";

struct Message {
    std::int64_t time;
    std::string bytes;
};

/// A file with one channel, all in one chunk or in none, as other writers make it.
std::string file_of(const std::string& encoding, const std::string& schema_name,
                    const std::string& schema_encoding, const std::string& schema,
                    const std::vector<Message>& messages, bool is_chunked = true) {
    Builder records;
    records.begin_record(Opcode::Schema);
    records.put(std::uint16_t{1});
    records.put_text(schema_name);
    records.put_text(schema_encoding);
    records.put_text(schema);
    records.end_record();
    records.begin_record(Opcode::Channel);
    records.put(std::uint16_t{3});
    records.put(std::uint16_t{1});
    records.put_text("/robot/odom");
    records.put_text(encoding);
    records.put_map({});
    records.end_record();
    for (const auto& [time, bytes] : messages) {
        records.begin_record(Opcode::Message);
        records.put(std::uint16_t{3});
        records.put(std::uint32_t{0});
        records.put(time);
        records.put(time);
        records.put_bytes(bytes_of(bytes));
        records.end_record();
    }
    Builder file;
    file.put_bytes(bytes_of(magic));
    file.begin_record(Opcode::Header);
    file.put_text("");
    file.put_text("another program");
    file.end_record();
    if (is_chunked) {
        file.begin_record(Opcode::Chunk);
        file.put(std::uint64_t{0});
        file.put(std::uint64_t{0});
        file.put(static_cast<std::uint64_t>(records.size()));
        file.put(std::uint32_t{0});
        file.put_text("");
        file.put(static_cast<std::uint64_t>(records.size()));
    }
    file.put_bytes(records.bytes());
    if (is_chunked) file.end_record();
    file.begin_record(Opcode::DataEnd);
    file.put(std::uint32_t{0});
    file.end_record();
    file.begin_record(Opcode::Statistics);
    file.put(static_cast<std::uint64_t>(messages.size()));
    file.end_record();
    file.begin_record(Opcode::Footer);
    for (int i = 0; i < 2; ++i) file.put(std::uint64_t{0});
    file.put(std::uint32_t{0});
    file.end_record();
    file.put_bytes(bytes_of(magic));
    return {reinterpret_cast<const char*>(file.bytes().data()), file.size()};
}

Recording parsed(const std::string& file, const LoadOptions& options = {}) {
    std::istringstream stream(file);
    return load(stream, "other.mcap", options);
}

/// Values one after the other, aligned from behind the header on.
class Cdr {
  public:
    explicit Cdr(bool is_big = false)
        : is_big_(is_big), bytes_(is_big ? std::string("\0\0\0\0", 4) : std::string("\0\1\0\0", 4)) {}
    template <class T> Cdr& put(T value) {
        while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
        std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
        if (is_big_) raw = {raw.rbegin(), raw.rend()};
        bytes_ += raw;
        return *this;
    }
    Cdr& text(const std::string& text) {
        put(static_cast<std::uint32_t>(text.size() + 1));
        bytes_ += text + '\0';
        return *this;
    }
    const std::string& bytes() const { return bytes_; }

  private:
    bool is_big_;
    std::string bytes_;
};

std::string odometry_message(bool is_big = false) {
    Cdr cdr(is_big);
    cdr.put(std::int32_t{5}).put(std::uint32_t{7}).text("map"); // the header
    for (const double x : {1.5, 2.5, -3.5, 4.5}) cdr.put(x);
    cdr.put(std::int8_t{-2}).text("ab").put(std::uint32_t{3});
    for (const float x : {0.5f, 0.25f, 8.f}) cdr.put(x);
    return cdr.put(std::uint8_t{1}).bytes();
}

Recording odometries(const std::vector<Message>& messages) {
    return parsed(file_of("cdr", "nav_msgs/msg/Odometry", "ros2msg", odometry, messages));
}

TEST(Foreign, ReadsEachNumberOfAMessageOfRos) {
    for (const bool is_big : {false, true}) {
        const Recording recording = odometries({{1'700'000'000'000'000'000, odometry_message(is_big)},
                                                {1'700'000'000'500'000'000, odometry_message(is_big)}});
        EXPECT_EQ(recording.defect, "");
        EXPECT_TRUE(recording.complete);
        const auto value = [&](const char* name, std::size_t i = 0) {
            return recording.channel(name).value(1, i);
        };
        EXPECT_EQ(value("robot.odom.header.stamp.sec"), 5);
        EXPECT_EQ(value("robot.odom.header.stamp.nanosec"), 7);
        EXPECT_EQ(value("robot.odom.points[1].y"), 2.5);
        EXPECT_EQ(value("robot.odom.points[2].x"), -3.5);
        EXPECT_EQ(value("robot.odom.mode"), -2);
        EXPECT_EQ(value("robot.odom.ranges", 1), 0.25);
        EXPECT_EQ(value("robot.odom.ok"), 1);
        EXPECT_EQ(recording.channels.size(), 9u) << "texts and constants are none";
        EXPECT_EQ(recording.channel("robot.odom.ok").time(0), 0) << "time begins with the first message";
        EXPECT_EQ(recording.channel("robot.odom.ok").time(1), 0.5);
    }
}

TEST(Foreign, ReadsJson) {
    const Recording recording = parsed(file_of(
        "json", "any", "jsonschema", "{}",
        {{10,
          R"({"a": 1.5, "b": {"c": true, "d": "text", "row": [1, 2, 3]}, "list": [{"x": 4}, {"x": 5}], "none": null})"},
         {20, R"({"a": 2.5, "b": {"c": false, "row": [1, 2]}})"},
         {30, "[1"}}));
    EXPECT_EQ(recording.channel("robot.odom.a").values(), (std::vector<double>{1.5, 2.5}));
    EXPECT_EQ(recording.channel("robot.odom.b.c").values(), (std::vector<double>{1, 0}));
    EXPECT_EQ(recording.channel("robot.odom.list[2].x").value(0), 5);
    EXPECT_EQ(recording.channel("robot.odom.b.row").samples(), 1u);
    EXPECT_EQ(recording.channels.size(), 5u);
    EXPECT_EQ(recording.defect,
              "'other.mcap': 'robot.odom.b.row' changes its size; what has another one than at "
              "first is left out; a message of 'robot.odom' is left out: it is no JSON object");
}

TEST(Foreign, SaysWhereAMessageHasMoreSignalsThanAreRead) {
    std::string json = "{";
    for (int i = 0; i < 1001; ++i) json += (i > 0 ? ", \"s" : "\"s") + std::to_string(i) + "\": 1";
    const Recording recording = parsed(file_of("json", "a/B", "jsonschema", "{}", {{1, json + "}"}}));
    EXPECT_EQ(recording.channels.size(), 1000u);
    EXPECT_EQ(recording.defect,
              "'other.mcap': 'robot.odom' has more than 1000 signals; the others are left out");
}

TEST(Foreign, ReadsMessagesThatStandInNoChunk) {
    const std::vector<Message> messages{{10, R"({"v": 1.5})"}, {20, R"({"v": 2.5})"}};
    const Recording recording = parsed(file_of("json", "a/B", "jsonschema", "{}", messages, false));
    EXPECT_EQ(recording.defect, "");
    const auto& channel = recording.channel("robot.odom.v");
    ASSERT_EQ(channel.samples(), 2u);
    EXPECT_EQ(channel.value(0), 1.5);
    EXPECT_EQ(channel.value(1), 2.5);
    EXPECT_NEAR(channel.time(1) - channel.time(0), 1e-8, 1e-15);
}

TEST(Foreign, LeavesOutWhatItDoesNotUnderstandAndSaysSo) {
    const auto defect = [](const std::string& encoding, const std::string& kind, const std::string& schema) {
        const Recording recording = parsed(file_of(encoding, "a/B", kind, schema, {{1, odometry_message()}}));
        EXPECT_TRUE(recording.channels.empty());
        EXPECT_FALSE(recording.complete);
        return recording.defect;
    };
    EXPECT_EQ(
        defect("flatbuffer", "flatbuffer", ""),
        "'other.mcap': the channel '/robot/odom' is left out: messages in 'flatbuffer' with a schema in "
        "'flatbuffer' are not read; 'json', 'cdr' with 'ros2msg', 'ros1' with 'ros1msg', and 'protobuf' are");
    EXPECT_EQ(defect("protobuf", "protobuf", ""),
              "'other.mcap': the channel '/robot/odom' is left out: the schema does not say what 'a/B' is");
    EXPECT_EQ(
        defect("protobuf", "protobuf", "\x0a\xff"),
        "'other.mcap': the channel '/robot/odom' is left out: the schema is no FileDescriptorSet: end of "
        "buffer exception");
    EXPECT_EQ(
        defect("cdr", "ros2msg", "Unknown x"),
        "'other.mcap': the channel '/robot/odom' is left out: the schema does not say what 'Unknown' is");
    EXPECT_EQ(
        defect("cdr", "ros2msg", "B x"),
        "'other.mcap': the channel '/robot/odom' is left out: the types of the schema are nested too deeply");
    std::string fields = "A1 a1\n",
                types = "\n====\nMSG: a/A1\nfloat64 x"; // each is looked at before what has it
    for (int k = 2; k < 40; ++k) {
        const std::string name = "A" + std::to_string(k);
        fields += name + " a" + std::to_string(k) + "\n";
        types += "\n====\nMSG: a/" + name + "\nA" + std::to_string(k - 1) + " x";
    }
    EXPECT_EQ(
        defect("cdr", "ros2msg", fields + types),
        "'other.mcap': the channel '/robot/odom' is left out: the types of the schema are nested too deeply");
    EXPECT_EQ(defect("cdr", "ros2msg", "float64[1000000] x"),
              "'other.mcap': a message of 'robot.odom' is left out: it ends before its last field");
    std::string nested = "C[1000] x";
    for (char type = 'C'; type < 'H'; ++type)
        nested += std::string("\n====\nMSG: a/") + type + "\n" + static_cast<char>(type + 1) + "[1000] x";
    EXPECT_EQ(defect("cdr", "ros2msg", nested + "\n====\nMSG: a/H\n"),
              "'other.mcap': a message of 'robot.odom' is left out: it has more messages in it than can be "
              "looked at");
}

/// Whatever is read of these files, in turns, after some of their bytes were changed or cut off.
void expect_whole_samples(const std::vector<std::string>& files, unsigned seed, std::size_t rounds) {
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < rounds; ++i) {
        std::string file = files[i % files.size()];
        for (unsigned k = 1 + random() % 4; k > 0; --k)
            file[8 + random() % (file.size() - 8)] = static_cast<char>(random());
        if (random() % 5 == 0) file.resize(8 + random() % (file.size() - 8));
        const Recording recording = parsed(file);
        for (const auto& channel : recording.channels)
            EXPECT_EQ(channel.data.size(), channel.samples() * channel.info.bytes());
    }
}

TEST(Foreign, KeepsNoMoreSamplesThanItMay) {
    std::string numbers = "[1"; // two bytes of the file become eight
    for (int i = 1; i < 1000; ++i) numbers += ",1";
    std::vector<Message> messages;
    for (int i = 0; i < 20; ++i) messages.push_back({i, "{\"a\": " + numbers + "]}"});
    const std::string file = file_of("json", "any", "", "", messages);
    ASSERT_LT(file.size(), 50'000U);
    EXPECT_EQ(parsed(file).channels.at(0).samples(), 20U);
    const Recording less = parsed(file, {.most_bytes = 10 * 8008});
    EXPECT_EQ(less.channels.at(0).samples(), 10U);
    EXPECT_NE(less.defect.find("it has more than 80080 bytes of samples; what follows is left out"),
              std::string::npos)
        << less.defect;
}

TEST(Foreign, SurvivesHostileBytes) {
    const std::string good = file_of("cdr", "nav_msgs/msg/Odometry", "ros2msg", odometry,
                                     {{5, odometry_message()}, {6, odometry_message()}});
    const std::string json = file_of("json", "any", "", "", {{1, R"({"a": [1, {"b": 2}], "c": true})"}});
    expect_whole_samples({json, good}, 3, 4000);
}

/// As a Python program writes it with other libraries.
std::string written_file(const std::string& compression) {
    const std::string folder = BF_BINARY_DIRECTORY "/foreign_test",
                      file = folder + "/" + compression + ".mcap";
    const std::string command = "mkdir -p '" + folder +
                                "' && '" BF_PYTHON "' '" BF_SOURCE_DIRECTORY
                                "/recording/test/write_foreign.py' '" +
                                file + "' " + compression;
    EXPECT_EQ(std::system(command.c_str()), 0);
    return file;
}

TEST(Foreign, ReadsWhatThePythonWritersOfMcapWrite) {
    for (const std::string compression : {"NONE", "LZ4", "ZSTD"}) {
        SCOPED_TRACE(compression);
        const Recording recording = load(written_file(compression));
        EXPECT_EQ(recording.defect, "");
        EXPECT_FALSE(recording.unchecked) << "they leave out checksums that the format does not ask for";
        EXPECT_EQ(recording.channel("joint_states.position").info.elements(), 3u);
        for (std::size_t k = 0; k < 50; ++k) {
            const double t = static_cast<double>(k) / 10, n = static_cast<double>(k);
            const auto value = [&](const std::string& name, std::size_t i = 0) {
                return recording.channel(name).value(k, i);
            };
            EXPECT_NEAR(recording.channel("joint_states.position").time(k), t, 1e-9);
            EXPECT_EQ(value("joint_states.position", 1), std::sin(t));
            EXPECT_EQ(value("imu.orientation.w"), 1 - t);
            EXPECT_EQ(value("imu.angular_velocity_covariance", 8), 0.5);
            EXPECT_EQ(value("battery.cell.volts"), 12 - t);
            EXPECT_EQ(value("old.header.seq"), n);
            EXPECT_EQ(value("old.code"), -3);
            EXPECT_EQ(value("old.lasting.sec"), -1);
            EXPECT_EQ(value("old.effort", 1), -n);
            EXPECT_EQ(value("old.counts", 2), n);
            EXPECT_EQ(value("old.parts[2].id"), -std::ldexp(1, 40) - n);
            for (const std::string arm : {"proto2", "proto3"}) {
                const std::vector<std::pair<const char*, double>> ones{{"double", n / 8},
                                                                       {"float", -0.5},
                                                                       {"int64", -std::ldexp(1, 50)},
                                                                       {"uint64", std::ldexp(1, 50)},
                                                                       {"int32", -n},
                                                                       {"fixed64", 3},
                                                                       {"fixed32", 4},
                                                                       {"bool", k % 2},
                                                                       {"uint32", std::ldexp(1, 31)},
                                                                       {"sfixed32", -5},
                                                                       {"sfixed64", -6},
                                                                       {"sint32", -7},
                                                                       {"sint64", -8}};
                for (const auto& [kind, expected] : ones) {
                    EXPECT_EQ(value(arm + ".one_" + kind), expected) << kind;
                    const std::string_view name = kind;
                    const double last = name == "bool" ? 1 : name == "double" || name == "float" ? 1e6 : 300;
                    EXPECT_EQ(value(arm + ".row_" + kind, 2), last) << kind;
                }
                EXPECT_EQ(value(arm + ".row_sint64", 0), -1);
                EXPECT_EQ(value(arm + ".mode"), 5);
                EXPECT_EQ(value(arm + ".joint.inner.inner.angle"), n);
                EXPECT_EQ(value(arm + ".joints[2].angle"), 2 * n) << "also where it is 0 and left out";
            }
        }
    }
}

TEST(Foreign, SurvivesHostileBytesOfCompressedFilesAndProtocolBuffers) {
    for (const std::string compression : {"NONE", "LZ4", "ZSTD"}) {
        std::ifstream stream(written_file(compression), std::ios::binary);
        const std::string good(std::istreambuf_iterator<char>(stream), {});
        expect_whole_samples({good}, 5, 300);
    }
}

} // namespace
} // namespace bf::recording

// Bags of ROS 1, made here byte by byte; those that rosbag writes are read in middleware/ros1.
#include "../src/format.hpp"
#include "bf/recording/bag.hpp"
#include "bf/recording/reader.hpp"
#include "support.hpp"

#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace bf::recording {
namespace {

template <class T> std::string bytes(T value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
}
std::string part(const std::string& text) { return bytes(static_cast<std::uint32_t>(text.size())) + text; }
std::string fields(const std::vector<std::pair<std::string, std::string>>& all) {
    std::string text;
    for (const auto& [name, value] : all) text += part(name + "=" + value);
    return text;
}
std::string record(char op, std::vector<std::pair<std::string, std::string>> header,
                   const std::string& data) {
    header.emplace_back("op", std::string(1, op));
    return part(fields(header)) + part(data);
}
std::string connection(std::uint32_t number, const std::string& topic) {
    return record(7, {{"conn", bytes(number)}, {"topic", topic}},
                  fields({{"topic", "/sent"},
                          {"type", "geometry_msgs/Point"},
                          {"md5sum", "4a842b65f413084dc2b10fb484ea7f17"},
                          {"message_definition", "float64 x\nfloat64 y\nfloat64 z"}}));
}
std::string point(std::uint32_t number, std::uint32_t nanoseconds, double y) {
    return record(
        2, {{"conn", bytes(number)}, {"time", bytes(std::uint32_t{1'500'000'000}) + bytes(nanoseconds)}},
        bytes(1.0) + bytes(y) + bytes(0.0));
}
std::string bag(const std::string& records, std::uint64_t index = 99,
                const std::vector<std::pair<std::string, std::string>>& more = {}) {
    auto header = more;
    header.insert(header.end(),
                  {{"index_pos", bytes(index)}, {"conn_count", bytes(1)}, {"chunk_count", bytes(1)}});
    return std::string(bag_magic) + record(3, header, std::string(100, ' ')) + records;
}
std::string chunk(const std::string& records, const std::string& method = "none") {
    return record(5, {{"compression", method}, {"size", bytes(static_cast<std::uint32_t>(records.size()))}},
                  records);
}
Recording read(const std::string& file) {
    std::istringstream stream(file);
    return load(stream, "some.bag");
}

} // namespace

TEST(Bags, HaveASignalForEachNumberFromTheirBeginOn) {
    const auto recording = read(bag(chunk(connection(3, "/p") + point(3, 250'000'000, 5) +
                                          connection(4, "/p") + point(4, 750'000'000, 6)) +
                                    connection(3, "/p")));
    EXPECT_TRUE(recording.complete) << recording.defect;
    ASSERT_EQ(recording.channels.size(), 3U) << "two programs write to one topic";
    const auto& y = recording.channel("p.y");
    ASSERT_EQ(y.samples(), 2U);
    EXPECT_EQ(y.time(1), 0.5);
    EXPECT_EQ(y.value(1), 6);
}

TEST(Bags, SayWhatIsWrongAndKeepWhatIsRight) {
    const std::string good = chunk(connection(0, "/p") + point(0, 1, 5));
    const auto expect = [&](const std::string& file, const std::string& defect, std::size_t samples = 1) {
        const auto recording = read(file);
        EXPECT_FALSE(recording.complete);
        EXPECT_CONTAINS(recording.defect, defect);
        if (samples > 0) {
            EXPECT_EQ(recording.channel("p.x").samples(), samples);
        }
    };
    expect(bag(good, 0), "the bag was not closed: run 'rosbag reindex'");
    expect(bag(good + good.substr(0, 50)), "the file ends within the record that begins at byte ");
    expect(bag(good + chunk("", "snappy")), "a chunk is compressed with 'snappy', not with 'zstd'");
    expect(bag(good + chunk(point(0, 2, 6).substr(0, 30))), "a record ends before its last field, at byte ");
    expect(bag(good + chunk(point(9, 2, 6))),
           "a message is of the connection 9, which the bag does not tell");
    const std::string damaged = record(7, {{"conn", bytes(1)}, {"topic", "/q"}}, part("type"));
    expect(bag(good + chunk(damaged)), "a record has a field without a name or a value");
    expect(bag(good + chunk(point(1, 2, 6)) + damaged), "a message is of the connection 1");
    expect(bag(good + damaged + chunk(point(1, 2, 6))), "a record has a field without a name or a value");
    expect(bag(good + record(5, {{"compression", "none"}, {"size", bytes(7)}}, "")),
           "a chunk has 0 bytes, but says it has 7");
    expect(bag(good + record(5, {{"compression", "bz2"}, {"size", bytes(7)}}, "no such")), "'bz2'");
    expect(bag(good + record(5, {{"compression", "lz4"}, {"size", bytes(-1)}}, "no such")),
           "a chunk says it has 4294967295 bytes, of which 268435456 are read at most");
    expect(bag(good + part("op=") + part("")), "a record ends before its last field");
    expect(std::string(bag_magic) + good, "the bag has no header");
    EXPECT_CONTAINS(
        error_of([&] {
            read(bag(good, 9, {{"encryptor", "rosbag/AesCbcEncryptor"}}));
        }),
        "'some.bag' is encrypted (rosbag/AesCbcEncryptor), which is not read: run 'rosbag decrypt'");
    EXPECT_CONTAINS(error_of([] { read("#ROSBAG V1.2\n"); }), "is a bag of another version than 2.0");
    EXPECT_CONTAINS(error_of([] { read("#ROS"); }), "'some.bag' is no recording");
}

TEST(Bags, WithAnyBytesWrongAreReadOrRefused) {
    const std::string right =
        bag(chunk(connection(0, "/p") + point(0, 1, 5) + point(0, 2, 6)) + connection(0, "/p"));
    std::mt19937 random(1);
    int damaged = 0;
    for (int k = 0; k < 20'000; ++k) {
        std::string file = right;
        for (unsigned n = random() % 3 + 1; n > 0; --n)
            file[13 + random() % (file.size() - 13)] = static_cast<char>(random());
        try {
            damaged += !read(file).complete;
        } catch (const std::runtime_error&) {
            ++damaged;
        }
    }
    EXPECT_GT(damaged, 5'000);
}

} // namespace bf::recording

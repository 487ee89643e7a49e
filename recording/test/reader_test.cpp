#include "../src/format.hpp"
#include "support.hpp"

#include <random>
#include <set>
#include <sstream>

namespace bf::recording {
namespace {

/// The bytes of a small file with two chunks, an attachment and metadata.
std::string small_file() {
    const Folder folder;
    Writer writer(folder / "small.mcap", {{"model", "m"}}, {.chunk_bytes = 200});
    const ChannelId x = writer.add_channel("x", {.unit = "m"});
    const ChannelId flags = writer.add_channel("flags", {.type = ElementType::Boolean, .rows = 3});
    writer.add_attachment("a", "text/plain", std::string_view("text"));
    writer.begin();
    for (int k = 0; k < 6; ++k) {
        const double value = 1.5 * k;
        const std::uint8_t bits[3] = {1, 0, 1};
        writer.append(x, k, &value);
        writer.append(flags, k, bits);
    }
    writer.close();
    return read_file(folder / "small.mcap");
}

Recording parse(const std::string& bytes) {
    std::istringstream stream(bytes);
    return load(stream, "bytes");
}

void expect_prefix(const Recording& recording) {
    if (recording.channels.empty()) return;
    const Channel& x = recording.channels[0];
    ASSERT_EQ(x.data.size(), x.samples() * x.info.bytes());
    for (std::size_t k = 0; k < x.samples(); ++k) ASSERT_EQ(x.value(k), 1.5 * double(k));
}

TEST(Reader, ReturnsTheWholeRecordsOfAFileCutAnywhere) {
    const std::string file = small_file();
    ASSERT_TRUE(parse(file).complete) << parse(file).defect;
    std::size_t samples = 0;
    for (std::size_t size = 0; size < file.size(); ++size) {
        const std::string cut = file.substr(0, size);
        if (size < 8) {
            EXPECT_CONTAINS(error_of([&] { parse(cut); }), "'bytes' is no recording");
            continue;
        }
        const Recording recording = parse(cut);
        EXPECT_FALSE(recording.complete) << size;
        EXPECT_FALSE(recording.defect.empty());
        expect_prefix(recording);
        if (recording.channels.empty()) continue;
        EXPECT_GE(recording.channels[0].samples(), samples); // never fewer in a longer file
        samples = recording.channels[0].samples();
    }
    EXPECT_EQ(samples, 6u);
}

TEST(Reader, NoticesEveryFlippedByte) {
    const std::string file = small_file();
    for (std::size_t at = 0; at < file.size(); ++at)
        for (const int flip : {0x01, 0x80, 0xFF}) {
            std::string damaged = file;
            damaged[at] = static_cast<char>(damaged[at] ^ flip);
            try {
                EXPECT_FALSE(parse(damaged).complete) << "byte " << at << " flipped by " << flip;
            } catch (const std::runtime_error& error) {
                EXPECT_LT(at, 8u); // only without the signature is it no recording at all
                EXPECT_CONTAINS(error.what(), "is no recording");
            }
        }
}

TEST(Reader, LeavesOutAChunkThatFailsItsChecksum) {
    std::string file = small_file();
    const double value = 1.5 * 2; // of the third sample
    const std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    const auto at = file.find(bytes);
    ASSERT_NE(at, std::string::npos);
    file[at] = static_cast<char>(file[at] ^ 1);
    const Recording recording = parse(file);
    EXPECT_EQ(recording.defect, "'bytes': the checksum of a chunk is wrong; its messages are left out");
    const Channel& x = recording.channels.at(0);
    EXPECT_GT(x.samples(), 0u); // of the other chunks
    EXPECT_LT(x.samples(), 6u);
    for (std::size_t k = 0; k < x.samples(); ++k) EXPECT_EQ(x.value(k), 1.5 * double(x.time_ns[k]));
}

TEST(Reader, NamesAllThatIsWrong) {
    std::string file = small_file();
    const double value = 1.5 * 2;
    const std::string media = "text/plain", bytes(reinterpret_cast<const char*>(&value), sizeof value);
    const auto text = file.find("text", file.find(media) + media.size()), sample = file.find(bytes);
    ASSERT_NE(text, std::string::npos);
    ASSERT_NE(sample, std::string::npos);
    file[text] ^= 1;
    file[sample] ^= 1;
    const std::string chunk = "the checksum of a chunk is wrong; its messages are left out",
                      attachment = "the checksum of the attachment 'a' is wrong; it is left out";
    EXPECT_EQ(parse(file).defect,
              "'bytes': " + (text < sample ? attachment + "; " + chunk : chunk + "; " + attachment));
    EXPECT_EQ(parse(file.substr(0, file.size() - 1)).defect,
              parse(file).defect + "; the file does not end with the MCAP signature");
}

/// https://mcap.dev/spec: a CRC of 0 is none.
std::string without_checksums(std::string file) {
    std::set<int> cleared;
    for (std::size_t at = magic.size(); at + magic.size() < file.size();) {
        const auto opcode = static_cast<Opcode>(file[at]);
        std::uint64_t length;
        std::memcpy(&length, &file[at + 1], sizeof length);
        const std::size_t content = at + record_header_bytes;
        at = content + length;
        const std::size_t crc = opcode == Opcode::Chunk        ? content + 24
                                : opcode == Opcode::Attachment ? at - 4
                                : opcode == Opcode::DataEnd    ? content
                                : opcode == Opcode::Footer     ? content + 16
                                                               : 0;
        if (crc == 0) continue;
        std::memset(&file[crc], 0, 4);
        cleared.insert(static_cast<int>(opcode));
    }
    EXPECT_EQ(cleared.size(), 4u);
    return file;
}

TEST(Reader, AcceptsFilesWithoutChecksumsAndTellsSo) {
    const Recording recording = parse(without_checksums(small_file()));
    EXPECT_TRUE(recording.complete) << recording.defect;
    EXPECT_EQ(recording.attachments.size(), 1u);
    expect_prefix(recording);
    EXPECT_TRUE(recording.unchecked);
    EXPECT_FALSE(parse(small_file()).unchecked);
}

TEST(Reader, LeavesOutChannelsThatSayNotWhatTheyHold) {
    const std::string file = without_checksums(small_file());
    for (const std::string key : {"name", "type", "rows", "cols"}) {
        std::string other = file; // with its length before it, as the format writes texts
        const std::string wanted = std::string("\4\0\0\0", 4) + key;
        int found = 0;
        for (std::size_t at = other.find(wanted); at != std::string::npos;
             at = other.find(wanted, at + 1), ++found)
            other[at + 4] = '?';
        ASSERT_GT(found, 0) << key;
        const Recording recording = parse(other);
        EXPECT_TRUE(recording.channels.empty()) << key;
        EXPECT_CONTAINS(recording.defect, "was not written by BlockFactory and is left out");
    }
    for (const char first : {'b', 'x'}) {
        std::string other = file;
        const std::string wanted("\3\0\0\0cdr", 7);
        for (std::size_t at = 0; (at = other.find(wanted, at)) != std::string::npos;) other[at + 4] = first;
        EXPECT_TRUE(parse(other).channels.empty()) << "another encoding";
    }
}

TEST(Reader, SurvivesHostileBytes) {
    const std::string file = small_file();
    std::mt19937 random(1);
    const std::uint64_t hostile[] = {
        0, 1, 0x7FFFFFFFu, 0xFFFFFFFFu, ~std::uint64_t{0}, std::uint64_t{1} << 63};
    for (int round = 0; round < 20'000; ++round) {
        std::string damaged = file;
        for (unsigned edits = 1 + random() % 4; edits > 0; --edits) {
            const std::size_t at = 8 + random() % (damaged.size() - 16);
            switch (random() % 4) {
            case 0: damaged[at] = static_cast<char>(random()); break;
            case 1: std::memcpy(&damaged[at], &hostile[random() % 6], 1u << (random() % 4)); break;
            case 2: damaged.erase(at, random() % 40); break;
            case 3: damaged.insert(at, damaged.substr(random() % damaged.size(), random() % 40)); break;
            }
            if (damaged.size() < 64) damaged = file;
        }
        const Recording recording = parse(damaged);
        for (const Channel& channel : recording.channels)
            ASSERT_EQ(channel.data.size(), channel.samples() * channel.info.bytes());
    }
}

TEST(Reader, GivesUpWhenItIsTold) {
    std::atomic<bool> given_up = true;
    std::istringstream stream(small_file());
    EXPECT_EQ(error_of([&] { load(stream, "bytes", {.given_up = &given_up}); }),
              "nobody waits for 'bytes' any more");
    given_up = false;
    stream.clear();
    EXPECT_TRUE(load(stream, "bytes", {.given_up = &given_up}).complete);
}

TEST(Reader, KeepsNoMoreThanItMayUnderOtherNames) {
    const Folder folder;
    Writer writer(folder / "named.mcap");
    const ChannelId x = writer.add_channel("x", {.rows = 1000, .other_names = {"y", "z"}});
    writer.begin();
    const std::vector<double> values(1000, 1.5);
    writer.append(x, 0, values.data());
    writer.close();
    ASSERT_EQ(load(folder / "named.mcap").channels.size(), 3U);
    const auto size = std::filesystem::file_size(folder / "named.mcap");
    ASSERT_LT(size, 16000U);
    const Recording less = load(folder / "named.mcap", {.most_bytes = 1});
    EXPECT_EQ(less.channels.size(), 1U);
    EXPECT_CONTAINS(less.defect, "it has more than " + std::to_string(size) + " bytes of samples");
}

TEST(Reader, RefusesWhatIsNoRecording) {
    EXPECT_CONTAINS(error_of([] { parse("time,x\n0,1\n"); }), "does not start with the MCAP signature");
    EXPECT_CONTAINS(error_of([] { load("/nowhere/run.mcap"); }),
                    "cannot open the recording '/nowhere/run.mcap': No such file or directory");
    EXPECT_CONTAINS(error_of([] { load("/"); }), "'/'");
}

TEST(Reader, NamesTheRecordedSignalsWhenOneIsMissing) {
    EXPECT_EQ(error_of([] { parse(small_file()).channel("y"); }),
              "the recording has no signal 'y'; it has: x, flags");
}

TEST(Reader, FindsTheOnlySignalOfABlock) {
    Recording r;
    for (const char* name : {"gain.y", "s.g.y", "two.a", "two.b", "two.deeper.y"})
        r.channels.emplace_back().name = name;
    EXPECT_EQ(r.channel("gain").name, "gain.y");
    EXPECT_EQ(r.channel("s.g").name, "s.g.y");
    EXPECT_EQ(error_of([&] { r.channel("two"); }),
              "the recording has several signals of 'two': two.a, two.b; name one");
    EXPECT_CONTAINS(error_of([&] { r.channel("s"); }), "the recording has no signal 's'; it has: gain.y, ");
}

TEST(Reader, CountsElementsFromOne) {
    Channel channel{.name = "c.M",
                    .topic = {},
                    .info = {.rows = 2, .cols = 3, .is_matrix = true},
                    .time_ns = {},
                    .data = {}};
    EXPECT_EQ(channel.element_name(3), "c.M[2][2]"); // column-major
    channel.info = {.rows = 4};
    EXPECT_EQ(channel.element_name(3), "c.M[4]");
    channel.info = {.rows = 4, .is_matrix = true};
    EXPECT_EQ(channel.element_name(3), "c.M[4]") << "one column needs one number";
    channel.info = {};
    EXPECT_EQ(channel.element_name(0), "c.M");
}

TEST(Reader, FindsElementsByTheirNameAndByTheirNumber) {
    const auto named = [](const char* name, ChannelInfo info) {
        return Channel{.name = name, .topic = {}, .info = std::move(info), .time_ns = {}, .data = {}};
    };
    Recording r;
    r.channels = {named("robot.s", {.rows = 3, .element_names = {"l_knee", "", "r_knee"}}),
                  named("M", {.rows = 2, .cols = 3, .is_matrix = true}), named("u", {}), named("odd[1]", {})};
    const auto element = [&](const char* name) { return r.find(name).element.value_or(99); };
    EXPECT_EQ(r.channels[0].element_name(0), "robot.s[l_knee]");
    EXPECT_EQ(r.channels[0].element_name(1), "robot.s[2]");
    EXPECT_EQ(element("robot.s[l_knee]"), 0u);
    EXPECT_EQ(element("robot.s[1]"), 0u);
    EXPECT_EQ(element("robot.s[2]"), 1u);
    EXPECT_EQ(element("robot[r_knee]"), 2u) << "a block with one output stands for it";
    EXPECT_EQ(element("M[2][3]"), 5u);
    EXPECT_FALSE(r.find("robot.s").element);
    EXPECT_FALSE(r.find("odd[1]").element) << "the name of a whole signal";
    EXPECT_EQ(error_of([&] { r.find("robot.s[0]"); }), "the signal 'robot.s' has no element [0]; they are "
                                                       "counted from 1: [l_knee], [2], [r_knee]");
    EXPECT_CONTAINS(error_of([&] { r.find("robot.s[]"); }), "has no element []");
    EXPECT_CONTAINS(error_of([&] { r.find("M[3]"); }),
                    "'M' has no element [3]; they are counted from 1: [1][1], ");
    EXPECT_EQ(error_of([&] { r.find("u[1]"); }), "the signal 'u' has a single element, not [1]");
    EXPECT_CONTAINS(error_of([&] { r.find("v[1]"); }), "the recording has no signal 'v'");
}

} // namespace
} // namespace bf::recording

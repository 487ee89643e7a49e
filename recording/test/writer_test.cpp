#include "bf/recording/export.hpp"
#include "support.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <fcntl.h>
#include <malloc.h>
#include <new>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {
thread_local std::size_t allocations_here = 0;
std::atomic<std::int64_t> live_bytes{0};
} // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
    void* memory = std::malloc(size);
    if (!memory) throw std::bad_alloc();
    ++allocations_here;
    live_bytes += static_cast<std::int64_t>(::malloc_usable_size(memory));
    return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
    live_bytes -= static_cast<std::int64_t>(::malloc_usable_size(memory));
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

namespace bf::recording {
namespace {

constexpr std::int64_t ms = 1'000'000;

TEST(Writer, IsReadBackExactlyForEveryTypeAndShape) {
    const Folder folder;
    const auto path = folder / "all.mcap";
    const ChannelInfo shapes[] = {{.rows = 1}, {.rows = 7}, {.rows = 3, .cols = 4, .is_matrix = true}};
    std::vector<ChannelInfo> infos;
    {
        Writer writer(path, {{"model", "all types"}, {"version", "1"}});
        std::vector<ChannelId> ids;
        for (int t = 0; t <= static_cast<int>(ElementType::Boolean); ++t)
            for (ChannelInfo info : shapes) {
                info.type = static_cast<ElementType>(t);
                info.unit = "N m";
                info.doc = "torque, \"measured\"";
                info.period = 0.1;
                ids.push_back(writer.add_channel("plant.s" + std::to_string(infos.size()), info));
                infos.push_back(info);
            }
        writer.add_attachment("model.yaml", "application/yaml", std::string_view("blocks: []\n"));
        writer.begin();
        for (int k = 0; k < 50; ++k)
            for (std::size_t c = 0; c < ids.size(); ++c)
                writer.append(ids[c], k * ms, noise(infos[c].bytes(), k * 100 + c, infos[c].type).data());
        writer.add_metadata("result", {{"steps", "50"}});
        writer.close();
    }
    const Recording recording = load(path);
    EXPECT_TRUE(recording.complete) << recording.defect;
    EXPECT_EQ(recording.metadata.at("recording").at("model"), "all types");
    EXPECT_EQ(recording.metadata.at("result").at("steps"), "50");
    ASSERT_EQ(recording.attachments.size(), 1u);
    EXPECT_EQ(recording.attachments[0].media_type, "application/yaml");
    EXPECT_EQ(recording.attachments[0].text(), "blocks: []\n");
    ASSERT_EQ(recording.channels.size(), infos.size());
    for (std::size_t c = 0; c < infos.size(); ++c) {
        const Channel& channel = recording.channels[c];
        EXPECT_EQ(channel.name, "plant.s" + std::to_string(c));
        EXPECT_EQ(channel.topic, "/plant/s" + std::to_string(c));
        EXPECT_TRUE(channel.info == infos[c]);
        ASSERT_EQ(channel.samples(), 50u);
        for (std::size_t k = 0; k < 50; ++k) {
            EXPECT_EQ(channel.time_ns[k], static_cast<std::int64_t>(k) * ms);
            const auto expected = noise(infos[c].bytes(), k * 100 + c, infos[c].type);
            EXPECT_TRUE(std::ranges::equal(channel.sample(k), expected));
        }
    }
}

TEST(Writer, IsReadByForeignReadersAndExportsAgree) {
    const Folder folder;
    Writer writer(folder / "run.mcap", {{"model", "walking"}}, {.chunk_bytes = 4096});
    std::vector<ChannelId> ids;
    std::vector<ChannelInfo> infos;
    for (int t = 0; t <= static_cast<int>(ElementType::Boolean); ++t)
        for (const auto& [rows, cols] : {std::array{1u, 1u}, std::array{5u, 1u}, std::array{2u, 3u}}) {
            infos.push_back({static_cast<ElementType>(t), rows, cols, cols > 1, "rad/s", "any", 0.001});
            if (infos.size() == 2) infos.back().element_names = {"hip", "", "l knee", "r_knee", ""};
            ids.push_back(writer.add_channel("plant.joint" + std::to_string(infos.size()), infos.back()));
        }
    writer.add_attachment("model.yaml", "application/yaml", std::string_view("blocks: [gain]\n"));
    writer.begin();
    // The script compares with these bytes, which did not pass through the writer.
    std::vector<std::ofstream> expected;
    for (std::size_t c = 0; c < ids.size(); ++c)
        expected.emplace_back(folder.path() / ("joint" + std::to_string(c + 1) + ".bin"), std::ios::binary);
    for (int k = 0; k < 300; ++k)
        for (std::size_t c = 0; c < ids.size(); ++c) {
            const auto sample = noise(infos[c].bytes(), k * 1000 + c, infos[c].type);
            writer.append(ids[c], k * ms, sample.data());
            expected[c].write(reinterpret_cast<const char*>(sample.data()), static_cast<long>(sample.size()));
        }
    writer.close();
    expected.clear();

    const Recording recording = load(folder / "run.mcap");
    EXPECT_EQ(recording.channel("plant.joint2").info, infos[1]);
    write_mat(recording, folder / "run.mat");
    EXPECT_EQ(write_csv(recording, folder / "run.csv").size(), 1u);
    const std::string command = std::string(BF_PYTHON) +
                                " " BF_SOURCE_DIRECTORY "/recording/test/check_recording.py " +
                                folder.path().string();
    EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(Writer, KeepsSamplesOfUnlikeSizesOverManyRoundsOfTheBuffer) {
    const Folder folder;
    Writer writer(folder / "run.mcap", {}, {.chunk_bytes = 1 << 12, .buffer_bytes = 1 << 14});
    const ChannelInfo infos[] = {
        {.type = ElementType::Int8}, {.rows = 31}, {.type = ElementType::Single, .rows = 301}};
    ChannelId ids[3];
    for (std::size_t c = 0; c < 3; ++c) ids[c] = writer.add_channel("s" + std::to_string(c), infos[c]);
    writer.begin();
    const auto order = noise(20'000, 7, ElementType::Uint8); // about 10 MB, 600 rounds
    for (std::size_t k = 0; k < order.size(); ++k) {
        const std::size_t c = std::to_integer<std::size_t>(order[k]) % 3;
        writer.append(ids[c], static_cast<std::int64_t>(k), noise(infos[c].bytes(), k, infos[c].type).data());
    }
    writer.close();
    const Recording recording = load(folder / "run.mcap");
    EXPECT_TRUE(recording.complete) << recording.defect;
    std::size_t next[3] = {0, 0, 0};
    for (std::size_t k = 0; k < order.size(); ++k) {
        const std::size_t c = std::to_integer<std::size_t>(order[k]) % 3;
        const Channel& channel = recording.channels[c];
        ASSERT_LT(next[c], channel.samples());
        ASSERT_EQ(channel.time_ns[next[c]], static_cast<std::int64_t>(k));
        ASSERT_TRUE(std::ranges::equal(channel.sample(next[c]++), noise(infos[c].bytes(), k, infos[c].type)));
    }
}

TEST(Writer, StoresASignalWithSeveralNamesOnceAndGivesItUnderEach) {
    const Folder folder;
    const auto path = folder / "names.mcap";
    {
        Writer writer(path);
        const ChannelId y = writer.add_channel("base.J.y", {.rows = 1000, .other_names = {"base.J_c", "J"}});
        const ChannelId x = writer.add_channel("x", {});
        EXPECT_CONTAINS(error_of([&] { writer.add_channel("base.J_c", {}); }), "has the topic '/base/J_c'");
        writer.begin();
        for (int k = 0; k < 10; ++k) {
            writer.append(y, k * ms, noise(8000, k, ElementType::Double).data());
            writer.append(x, k * ms, noise(8, k, ElementType::Double).data());
        }
        writer.close();
    }
    EXPECT_LT(std::filesystem::file_size(path), 2 * 10 * 8000u);
    const Recording recording = load(path);
    EXPECT_TRUE(recording.complete) << recording.defect;
    std::string order;
    for (const Channel& channel : recording.channels) order += channel.topic + " ";
    EXPECT_EQ(order, "/base/J/y /base/J_c /J /x ");
    const Channel& first = recording.channel("base.J.y");
    ASSERT_EQ(first.samples(), 10u);
    for (const char* name : {"base.J_c", "J"}) {
        EXPECT_EQ(recording.channel(name).time_ns, first.time_ns);
        EXPECT_EQ(recording.channel(name).data, first.data);
        EXPECT_EQ(recording.channel(name).info, first.info);
    }
}

TEST(Writer, AppendsWithoutHeap) {
    const Folder folder;
    Writer writer(folder / "run.mcap", {}, {.chunk_bytes = 1 << 16, .buffer_bytes = 1 << 18});
    const ChannelId channel = writer.add_channel("tau", {.rows = 23});
    writer.begin();
    const std::array<double, 23> tau{};
    const std::size_t before = allocations_here;
    for (int k = 0; k < 20'000; ++k) writer.append(channel, k * ms, tau.data());
    EXPECT_EQ(allocations_here, before);
    writer.close();
    EXPECT_EQ(load(folder / "run.mcap").channels[0].samples(), 20'000u);
}

TEST(Writer, HoldsMemoryThatDoesNotGrowWithTime) {
    const Folder folder;
    Writer writer(folder / "run.mcap", {}, {.chunk_bytes = 1 << 14, .buffer_bytes = 1 << 17});
    const ChannelId channel = writer.add_channel("tau", {.rows = 23});
    writer.begin();
    const std::array<double, 23> tau{};
    std::int64_t k = 0;
    while (k < 20'000) writer.append(channel, ++k * ms, tau.data());
    const std::int64_t early = live_bytes;
    while (k < 300'000) writer.append(channel, ++k * ms, tau.data()); // 68 MB, 4,000 chunks
    EXPECT_LE(live_bytes - early, 4096);
    writer.close();
}

TEST(Writer, PutsASampleOnDiskWithinTheFlushPeriod) {
    const Folder folder;
    Writer writer(folder / "run.mcap", {}, {.flush_period = std::chrono::milliseconds(50)});
    const ChannelId channel = writer.add_channel("x", {});
    writer.begin();
    const double x = 4.5;
    writer.append(channel, 7, &x);
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    const Recording recording = load(folder / "run.mcap"); // while it is being written
    EXPECT_FALSE(recording.complete);
    EXPECT_CONTAINS(recording.defect, "the recording was cut");
    ASSERT_EQ(recording.channels.at(0).samples(), 1u);
    EXPECT_EQ(recording.channels[0].value(0), 4.5);
}

TEST(Writer, LeavesAReadableFileWhenKilled) {
    const Folder folder;
    const auto path = folder / "killed.mcap";
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        Writer writer(path, {}, {.chunk_bytes = 1 << 14, .flush_period = std::chrono::milliseconds(20)});
        const ChannelId channel = writer.add_channel("x", {.rows = 2});
        writer.begin();
        for (std::int64_t k = 0;; ++k) {
            const double x[2] = {double(k), -double(k)};
            writer.append(channel, k * ms, x);
            if (k % 100 == 0) ::usleep(1000);
        }
    }
    ::usleep(700'000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);

    const Recording recording = load(path);
    EXPECT_FALSE(recording.complete);
    ASSERT_EQ(recording.channels.size(), 1u);
    const Channel& channel = recording.channels[0];
    EXPECT_GT(channel.samples(), 1000u);
    for (std::size_t k = 0; k < channel.samples(); ++k) {
        ASSERT_EQ(channel.time_ns[k], static_cast<std::int64_t>(k) * ms);
        ASSERT_EQ(channel.value(k, 0), double(k));
        ASSERT_EQ(channel.value(k, 1), -double(k));
    }
}

TEST(Writer, NamesFileAndReasonWhenTheDiskIsFull) {
    Writer writer("/dev/full");
    const ChannelId channel = writer.add_channel("x", {.rows = 1000});
    writer.begin();
    const std::vector<double> x(1000);
    for (int k = 0; k < 5000; ++k)
        writer.append(channel, k * ms, x.data()); // more than the buffer: does not hang
    EXPECT_TRUE(writer.failed());
    EXPECT_CONTAINS(writer.status(), "cannot write the recording '/dev/full': No space left on device; free "
                                     "space, or write to another disk; it holds no samples");
    EXPECT_CONTAINS(error_of([&] { writer.close(); }), "free space, or write to another disk");
}

TEST(Writer, KeepsWhatFittedWhenTheDiskFillsUp) {
    const Folder folder;
    const auto path = folder / "limited.mcap";
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) { // a limit on the size of files stands for a small disk
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{100'000, 100'000};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        Writer writer(path, {}, {.chunk_bytes = 1 << 14});
        const ChannelId channel = writer.add_channel("x", {});
        writer.begin();
        for (std::int64_t k = 0; k < 100'000; ++k) {
            const double x = double(k);
            writer.append(channel, k * ms, &x);
        }
        const std::string error = error_of([&] { writer.close(); });
        ::_exit(error.find("File too large; raise the limit on the size of files, or write less; it holds "
                           "the samples until t = ") != std::string::npos
                    ? 0
                    : 1);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    const Recording recording = load(path);
    EXPECT_CONTAINS(recording.defect, "ends without a footer"); // the torn chunk was cut off
    ASSERT_GT(recording.channels.at(0).samples(), 500u);
    for (std::size_t k = 0; k < recording.channels[0].samples(); ++k)
        ASSERT_EQ(recording.channels[0].value(k), double(k));
}

/// A disk that accepts nothing until told to: a pipe whose reader waits.
class StuckDisk {
  public:
    explicit StuckDisk(std::filesystem::path path) : path_(std::move(path)) {
        ::mkfifo(path_.c_str(), 0600);
        pipe_ = ::open(path_.c_str(), O_RDONLY | O_NONBLOCK);
        ::fcntl(pipe_, F_SETFL, 0);
    }
    ~StuckDisk() { ::close(pipe_); }
    StuckDisk(const StuckDisk&) = delete;
    StuckDisk& operator=(const StuckDisk&) = delete;
    void recover() {
        reader_ = std::thread([this] {
            std::vector<char> some(1 << 16);
            for (ssize_t count = 0; (count = ::read(pipe_, some.data(), some.size())) > 0;)
                received_ += count;
        });
    }
    std::int64_t finish() {
        reader_.join();
        return received_;
    }

  private:
    std::filesystem::path path_;
    int pipe_ = -1;
    std::thread reader_;
    std::int64_t received_ = 0;
};

TEST(Writer, DropsAndCountsWhenTheDiskIsTooSlowForRealTime) {
    const Folder folder;
    StuckDisk disk(folder / "pipe");
    Writer writer(folder / "pipe", {},
                  {.drop_when_full = true, .chunk_bytes = 1 << 14, .buffer_bytes = 1 << 18});
    const ChannelId channel = writer.add_channel("x", {.rows = 100});
    writer.begin();
    const std::array<double, 100> x{};
    constexpr std::uint64_t count = 10'000;
    for (std::uint64_t k = 0; k < count; ++k)
        writer.append(channel, 0, x.data()); // ends although nobody reads
    const std::uint64_t dropped = writer.dropped();
    EXPECT_GT(dropped, count - 1000);
    EXPECT_LT(dropped, count - 100);
    disk.recover();
    EXPECT_NO_THROW(writer.close());
    EXPECT_GE(disk.finish(), std::int64_t(sizeof x * (count - dropped)));
}

TEST(Writer, WaitsForASlowDiskInSimulation) {
    const Folder folder;
    StuckDisk disk(folder / "pipe");
    Writer writer(folder / "pipe", {}, {.chunk_bytes = 1 << 14, .buffer_bytes = 1 << 18});
    const ChannelId channel = writer.add_channel("x", {.rows = 100});
    writer.begin();
    const std::array<double, 100> x{};
    std::atomic<int> appended{0};
    std::thread simulation([&] {
        for (; appended < 10'000; ++appended) writer.append(channel, 0, x.data());
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_LT(appended, 1000); // waits
    disk.recover();
    simulation.join();
    EXPECT_EQ(writer.dropped(), 0u);
    EXPECT_NO_THROW(writer.close());
    EXPECT_GE(disk.finish(), std::int64_t(sizeof x * 10'000));
}

TEST(Writer, RejectsSignalsItCannotRecord) {
    const Folder folder;
    Writer writer(folder / "run.mcap");
    writer.add_channel("a.b", {});
    const auto add = [&](const char* name, const ChannelInfo& info) {
        return error_of([&] { writer.add_channel(name, info); });
    };
    EXPECT_CONTAINS(add("a.b", {}), "cannot record the signal 'a.b': another signal has the topic '/a/b'");
    EXPECT_CONTAINS(add("a/b", {}), "another signal has the topic '/a/b'; rename one of them");
    EXPECT_CONTAINS(add("", {}), "it has no name");
    EXPECT_CONTAINS(add("e", {.rows = 0}), "it has no elements; leave it out");
    EXPECT_CONTAINS(add("m", {.rows = 2, .cols = 2}), "it is 1-D but has 2 columns; set is_matrix");
    EXPECT_CONTAINS(add("big", {.rows = 1u << 31}), "at most 256 MB");
    writer.begin();
    EXPECT_CONTAINS(add("late", {}), "recording has begun");
    EXPECT_CONTAINS(error_of([&] { writer.begin(); }), "has begun already");
}

TEST(Writer, NamesThePathThatCannotBeCreated) {
    EXPECT_EQ(error_of([] { Writer("/nowhere/run.mcap"); }),
              "cannot create the recording '/nowhere/run.mcap': No such file or directory; "
              "give a file in a folder that may be written");
}

TEST(Writer, MakesACompleteFileWithoutSignals) {
    const Folder folder;
    Writer(folder / "empty.mcap").close();
    const Recording recording = load(folder / "empty.mcap");
    EXPECT_TRUE(recording.complete) << recording.defect;
    EXPECT_TRUE(recording.channels.empty());
}

} // namespace
} // namespace bf::recording

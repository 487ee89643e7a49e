// Streams between runs, clocks, and simulators that other runs step.
#include "BlockFactory/Core/Log.h"
#include "bf/core/interrupt.hpp"
#include "running.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <fcntl.h>
#include <random>
#include <thread>
#include <unistd.h>

namespace bf::toolbox::test::streams {
namespace {

using blockfactory::core::Log;

/// A domain of this test alone.
std::string network(const std::string& name) {
    return "  network: {block: WholeBodyToolbox/LocalStreams, domain: test-" + std::to_string(getpid()) +
           "-" + name + "}\n";
}
std::string folder(const std::string& name) {
    return "/dev/shm/blockfactory-" + std::to_string(geteuid()) + "-test-" + std::to_string(getpid()) + "-" +
           name;
}

std::string reading(const std::string& name, const std::string& settings) {
    return "model: m\nstep: 0.01\nblocks:\n" + network(name) +
           "  x: {block: WholeBodyToolbox/StreamRead, stream: /robot/state" + settings + "}\n";
}
std::string writing(const std::string& name, int size, const std::string& settings = {}) {
    return "model: m\nstep: 0.01\ninputs: {u: {shape: " + std::to_string(size) + "}}\nblocks:\n" +
           network(name) + "  x: {block: WholeBodyToolbox/StreamWrite, stream: /robot/state" + settings +
           "}\nconnections: {u: x}\n";
}

double now() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

} // namespace

TEST(Streams, BringTheNewestMessageOnly) {
    Running writer(writing("newest", 2));
    Running reader(reading("newest", ", size: 2"));
    ASSERT_TRUE(reader.step());
    EXPECT_EQ(reader.get("x.y"), Matrix(Eigen::Vector2d(0, 0))) << "zero before the first message";
    EXPECT_EQ(reader.get("x.timestamp"), Matrix(Eigen::Vector2d(0, 0)));
    const double before = now();
    for (int k = 1; k <= 3; ++k) {
        writer.set("u", Eigen::Vector2d(k, -k));
        ASSERT_TRUE(writer.step());
    }
    ASSERT_TRUE(reader.step());
    EXPECT_EQ(reader.get("x.y"), Matrix(Eigen::Vector2d(3, -3)));
    EXPECT_EQ(reader.get("x.timestamp")(0), 3);
    EXPECT_GE(reader.get("x.timestamp")(1), before - 1e-3);
    EXPECT_LE(reader.get("x.timestamp")(1), now() + 1e-3);
    ASSERT_TRUE(reader.step());
    EXPECT_EQ(reader.get("x.y"), Matrix(Eigen::Vector2d(3, -3))) << "held without a new one";
}

TEST(Streams, HaveOneWriterAndManyReaders) {
    Running writer(writing("many", 1));
    Running first(reading("many", "")), second(reading("many", ""));
    expect_contains(refusal(writing("many", 1)),
                    "x: stream '/robot/state': somebody else writes it; give this one another name");
    writer.set("u", 5.0);
    ASSERT_TRUE(writer.step());
    for (Running* reader : {&first, &second}) {
        ASSERT_TRUE(reader->step());
        EXPECT_EQ(reader->scalar("x.y"), 5);
    }
    writer.simulation.stop();
    Running next(writing("many", 1)); // a name is free when its run has ended
    next.set("u", 6.0);
    ASSERT_TRUE(next.step());
    ASSERT_TRUE(first.step());
    EXPECT_EQ(first.scalar("x.y"), 6);
}

TEST(Streams, SayWhetherSomebodySends) {
    expect_contains(
        refusal(reading("missing", "")),
        "x: nobody sends '/robot/state'; start the other program first, or set error_on_missing to "
        "false");
    Log::getSingleton().clear();
    Running warned(reading("missing", ", error_on_missing: false"));
    expect_contains(Log::getSingleton().getWarnings(), "nobody sends '/robot/state' yet");
    expect_contains(refusal(writing("deaf", 1, ", autoconnect: true")), "x: nobody receives '/robot/state'");

    Running waiting(reading("missing", ", autoconnect: false, read_timestamp: false"));
    ASSERT_TRUE(waiting.step());
    EXPECT_EQ(waiting.scalar("x.is_connected"), 0);
    Running writer(writing("missing", 1, ", autoconnect: true"));
    ASSERT_TRUE(waiting.step());
    EXPECT_EQ(waiting.scalar("x.is_connected"), 0) << "a message makes the connection";
    writer.set("u", 1.0);
    ASSERT_TRUE(writer.step());
    ASSERT_TRUE(waiting.step());
    EXPECT_EQ(waiting.scalar("x.is_connected"), 1);
    writer.simulation.stop();
    ASSERT_TRUE(waiting.step());
    EXPECT_EQ(waiting.scalar("x.is_connected"), 1) << "it stays 1";
    ASSERT_TRUE(warned.step());
    EXPECT_EQ(warned.scalar("x.y"), 1) << "a late sender is heard all the same";
}

TEST(Streams, RefuseMessagesOfAnotherSize) {
    Running writer(writing("size", 3));
    Running reader(reading("size", ", size: 2"));
    ASSERT_TRUE(reader.step());
    ASSERT_TRUE(writer.step());
    EXPECT_FALSE(reader.step());
    EXPECT_EQ(reader.simulation.failure(), "x: a message has 3 elements, but argument 'size' is 2");
}

TEST(Streams, WaitForDataUntilTheTimeout) {
    Running writer(writing("wait", 1));
    Running reader(reading("wait", ", wait_for_data: true, timeout: 0.05"));
    EXPECT_FALSE(reader.step());
    EXPECT_EQ(reader.simulation.failure(), "x: stream '/robot/state' (shared memory, domain 'test-" +
                                               std::to_string(getpid()) +
                                               "-wait'): no message came within the timeout of 0.05 s; look "
                                               "whether its sender runs, or raise timeout");

    Running patient(reading("wait", ", wait_for_data: true, timeout: 20"));
    std::thread sender([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        writer.set("u", 7.0);
        EXPECT_TRUE(writer.step());
    });
    EXPECT_TRUE(patient.step()) << patient.simulation.failure();
    sender.join();
    EXPECT_EQ(patient.scalar("x.y"), 7);
}

TEST(Streams, SayWhichMessageIsNotFiniteAndWhereItComesFrom) {
    for (const auto& [wrong, name] : {std::pair(std::nan(""), "nan"), std::pair(-HUGE_VAL, "-inf")}) {
        Running writer(writing("finite", 2));
        Running reader(reading("finite", ", size: 2"));
        writer.set("u", Eigen::Vector2d(1, 2));
        ASSERT_TRUE(writer.step());
        ASSERT_TRUE(reader.step());
        writer.set("u", Eigen::Vector2d(1, wrong));
        ASSERT_TRUE(writer.step());
        EXPECT_FALSE(reader.step());
        EXPECT_EQ(reader.simulation.failure(), "x: stream '/robot/state' (shared memory, domain 'test-" +
                                                   std::to_string(getpid()) + "-finite'): message 2 brings " +
                                                   name +
                                                   " as element 2 of 2; look at what its sender computes");
    }
}

namespace {

/// The file of a stream, for somebody who writes over it.
class Overwritten {
  public:
    explicit Overwritten(const std::string& name)
        : descriptor_(open((folder(name) + "/%2frobot%2fstate").c_str(), O_RDWR | O_CLOEXEC)) {}
    ~Overwritten() { close(descriptor_); }
    off_t size() const { return lseek(descriptor_, 0, SEEK_END); }
    void write(off_t at, std::uint64_t word) const {
        EXPECT_EQ(pwrite(descriptor_, &word, sizeof word, at), static_cast<ssize_t>(sizeof word));
    }
    void cut(off_t size) const { EXPECT_EQ(ftruncate(descriptor_, size), 0); }

  private:
    int descriptor_;
};

/// After each damage a reader has what it had or what was sent, and then the next message.
class Damaged {
  public:
    explicit Damaged(const std::string& name)
        : writer_(writing(name, 3)), reader_(reading(name, ", size: 3")),
          waiting_(reading(name, ", size: 3, wait_for_data: true, timeout: 20")), file(name) {
        send_and_take();
    }
    void expect_the_newest_message_alone() {
        ASSERT_TRUE(reader_.step()) << reader_.simulation.failure();
        EXPECT_EQ(reader_.get("x.y"), message());
        send_and_take();
    }

  private:
    Matrix message() const { return Eigen::Vector3d(sent_, -sent_, 0.5); }
    void send_and_take() {
        ++sent_;
        writer_.set("u", message());
        ASSERT_TRUE(writer_.step()) << writer_.simulation.failure();
        for (Running* reader : {&reader_, &waiting_}) {
            ASSERT_TRUE(reader->step()) << reader->simulation.failure();
            ASSERT_EQ(reader->get("x.y"), message());
        }
    }
    Running writer_, reader_, waiting_;
    double sent_ = 0;

  public:
    const Overwritten file;
};

} // namespace

TEST(Streams, BelieveNoWordThatAnotherProgramWroteOver) {
    Damaged stream("words");
    std::mt19937_64 random(1);
    const off_t size = stream.file.size();
    ASSERT_GE(size, 100);
    for (off_t at = 0; at + 8 <= size; at += 8)
        for (const std::uint64_t word : {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0},
                                         std::uint64_t{1} << 63, random(), random(), random()}) {
            stream.file.write(at, word);
            stream.expect_the_newest_message_alone();
            ASSERT_FALSE(testing::Test::HasFailure()) << "word at " << at << " was " << word;
        }
    for (int k = 0; k < 100; ++k) { // all of it at once
        for (off_t at = 0; at + 8 <= size; at += 8) stream.file.write(at, random());
        stream.expect_the_newest_message_alone();
    }
}

TEST(Streams, LiveOnWhereTheirFileIsMadeShorter) {
    Damaged stream("short");
    const off_t size = stream.file.size();
    for (off_t left = 0; left <= size; ++left) {
        stream.file.cut(left);
        stream.expect_the_newest_message_alone();
        ASSERT_FALSE(testing::Test::HasFailure()) << left << " bytes";
    }
}

TEST(Streams, WaitForAMessageThatCanBeRead) {
    Running writer(writing("unread", 3));
    Running reader(reading("unread", ", size: 3, wait_for_data: true, timeout: 0.05"));
    writer.set("u", Eigen::Vector3d(1, 2, 3));
    ASSERT_TRUE(writer.step());
    const Overwritten file("unread");
    for (off_t at = 24; at + 8 <= file.size(); at += 8) file.write(at, 7); // behind the head
    EXPECT_FALSE(reader.step());
    expect_contains(reader.simulation.failure(), "no message came within the timeout of 0.05 s");
}

TEST(Streams, AreSeenInTheirDomainAlone) {
    Running writer(writing("here", 1));
    expect_contains(refusal(reading("there", "")), "nobody sends");
    expect_contains(
        refusal("model: m\nstep: 0.01\nblocks:\n  x: {block: WholeBodyToolbox/LocalStreams, domain: "
                "a/b}\n"),
        "argument 'domain' is 'a/b'");
    expect_contains(
        refusal("model: m\nstep: 0.01\nblocks:\n  x: {block: WholeBodyToolbox/LocalStreams, domain: "
                "robots}\n"),
        "argument 'domain' is 'robots', where robots in shared memory are");
    expect_contains(refusal("model: m\nstep: 0.01\nblocks:\n  x: {block: WholeBodyToolbox/StreamRead}\n"),
                    "stream network");
}

TEST(Streams, HaveNamesThatAFileMayHave) {
    const std::string name(300, 'a');
    expect_contains(refusal("model: m\nstep: 0.01\nblocks:\n" + network("long") +
                            "  x: {block: WholeBodyToolbox/StreamWrite, stream: /" + name +
                            "}\n  c: {block: Constant}\nconnections: {c: x}\n"),
                    name.substr(0, 39) + "...': its name is longer than that of a file may be, 255 letters");
}

TEST(Streams, LeaveNoFileBehind) {
    const std::string file = folder("files") + "/%2frobot%2fstate";
    {
        Running writer(writing("files", 1));
        EXPECT_EQ(access(file.c_str(), F_OK), 0);
        Running reader(reading("files", ""));
        writer.simulation.stop();
        EXPECT_EQ(access(file.c_str(), F_OK), 0) << "the reader still has it";
    }
    EXPECT_NE(access(file.c_str(), F_OK), 0);
}

TEST(Streams, GoOnWhereTheirFileWasRemovedAndLeaveThatOfOthersAlone) {
    const std::string file = folder("removed") + "/%2frobot%2fstate";
    {
        Running writer(writing("removed", 1));
        Running reader(reading("removed", ""));
        unlink(file.c_str());
        writer.set("u", 7.0);
        ASSERT_TRUE(writer.step() && reader.step());
        EXPECT_EQ(reader.scalar("x.y"), 7);
        Running next(writing("removed", 1));
        writer.simulation.stop();
        reader.simulation.stop();
        EXPECT_EQ(access(file.c_str(), F_OK), 0) << "which is the next one's";
    }
    EXPECT_NE(access(file.c_str(), F_OK), 0);
}

TEST(Streams, AreNeverTorn) {
    Running writer(writing("torn", 1000));
    Running reader(reading("torn", ", size: 1000"));
    std::atomic<bool> goes_on{true};
    std::thread sender([&] {
        for (int k = 1; goes_on; ++k) {
            writer.set("u", Vector::Constant(1000, k));
            if (!writer.step()) break;
        }
    });
    double last = 0;
    int news = 0;
    for (int k = 0; k < 2000 || (news < 3 && k < 2'000'000); ++k) {
        ASSERT_TRUE(reader.step());
        const Matrix y = reader.get("x.y");
        ASSERT_EQ(y.minCoeff(), y.maxCoeff());
        ASSERT_GE(y(0), last);
        ASSERT_EQ(reader.get("x.timestamp")(0), y(0)) << "the number is that of the message";
        news += y(0) > last;
        last = y(0);
    }
    goes_on = false;
    sender.join();
    EXPECT_GE(news, 3);
}

TEST(Streams, CannotBeSaved) {
    Running writer(writing("snapshot", 1));
    Running reader(reading("snapshot", ""));
    ASSERT_TRUE(reader.step());
    try {
        reader.simulation.snapshot();
        ADD_FAILURE() << "saved";
    } catch (const std::exception& error) {
        expect_contains(error.what(), "network: its state lives outside and cannot be saved");
    }
}

TEST(NetworkClock, IsThatOfTheSystem) {
    Running run("model: m\nstep: 0.01\nblocks:\n" + network("clock") +
                "  x: {block: WholeBodyToolbox/NetworkClock}\n");
    const double before = now();
    ASSERT_TRUE(run.step());
    EXPECT_GE(run.scalar("x"), before - 1e-3);
    EXPECT_LE(run.scalar("x"), now() + 1e-3);
}

namespace {

std::string synchronized(const std::string& settings) {
    return "model: m\nstep: 0.005\nblocks:\n" + network("pace") +
           "  x: {block: WholeBodyToolbox/RealTimeSynchronizer, report: true" + settings + "}\n";
}
double elapsed(Running& run, int steps) {
    const double before = now();
    for (int k = 0; k < steps; ++k) EXPECT_TRUE(run.step()) << run.simulation.failure();
    return now() - before;
}

} // namespace

TEST(RealTimeSynchronizer, KeepsAnAbsoluteScheduleAndCountsOverruns) {
    for (const std::string clock : {"system", "network"}) {
        Running run(synchronized(", clock: " + clock));
        ASSERT_TRUE(run.step());
        const double begin = now();
        // Twenty intervals are at least that long, whatever else the machine does.
        EXPECT_GE(elapsed(run, 20), 0.0999) << clock;
        std::this_thread::sleep_until(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
        const double count = run.scalar("x.overruns");
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("x.overruns"), count + 1);
        EXPECT_GE(run.scalar("x.lateness"), 0.09);
        // Late steps follow at once: the schedule is that of the first step.
        for (int k = 0; k < 30; ++k) ASSERT_TRUE(run.step());
        EXPECT_GE(run.scalar("x.overruns"), count + 10);
        EXPECT_GE(now() - begin, 51 * 0.005 - 1e-3);
    }
}

TEST(RealTimeSynchronizer, LeavesOutWhatIsLateOnDemand) {
    Running run(synchronized(", skip: true, interval: 0.02"));
    ASSERT_TRUE(run.step());
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("x.overruns"), 1);
    EXPECT_GE(elapsed(run, 3), 0.04) << "three steps at three times of the schedule, not at once";
}

TEST(RealTimeSynchronizer, TellsOverrunsAtTheEnd) {
    Running run(synchronized(""));
    ASSERT_TRUE(run.step());
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    ASSERT_TRUE(run.step());
    Log::getSingleton().clear();
    run.simulation.stop();
    expect_contains(Log::getSingleton().getWarnings(),
                    "RealTimeSynchronizer: 1 of 2 steps came after their time, the worst 0.0");
}

TEST(RealTimeSynchronizer, RefusesIntervalsThatNoScheduleHolds) {
    const std::string limits = "argument 'interval' must be from 0 to 1000000000, but is ";
    for (const auto& [interval, wrong] :
         {std::pair<std::string, std::string>("1e300", limits + "1e+300"),
          {"inf", limits + "inf"},
          {"1e-300",
           "argument 'interval' is 1e-300 s; give at least 1e-9, or 0 for the block's sample time"}}) {
        expect_contains(refusal(synchronized(", interval: " + interval)), wrong);
        expect_contains(refusal("model: m\nstep: 0.01\nblocks:\n" + network("no") +
                                "  x: {block: WholeBodyToolbox/SimulatorSynchronizer, interval: " + interval +
                                "}\n"),
                        wrong);
    }
}

namespace {

/// A simulator of step 0.001 that counts its steps, and sends the count before it waits.
std::string simulator(const std::string& name) {
    return "model: m\nstep: 0.001\nblocks:\n" + network(name) +
           "  count: {block: CounterFree, bits: 16}\n"
           "  number: {block: Convert, type: double}\n"
           "  send: {block: WholeBodyToolbox/StreamWrite, stream: /count}\n"
           "  clock: {block: WholeBodyToolbox/SimulatorClock, timeout: 20}\n"
           "connections:\n  count: number\n  number: send\n";
}
std::string client(const std::string& name, const std::string& interval) {
    return "model: m\nstep: 0.01\nblocks:\n" + network(name) +
           "  sync: {block: WholeBodyToolbox/SimulatorSynchronizer, interval: " + interval +
           ", timeout: 20}\n  count: {block: WholeBodyToolbox/StreamRead, stream: /count, error_on_missing: "
           "false}\n";
}

} // namespace

TEST(SimulatorSynchronizer, StepsAnotherModelByItsInterval) {
    Log::getSingleton().clear();
    std::atomic<bool> goes_on{true};
    std::atomic<int> steps{0};
    Running served(simulator("sim"));
    std::thread other([&] {
        for (; goes_on && served.step(); ++steps) std::this_thread::yield();
    });
    {
        // 43 steps: 0.043 / 0.001 is below 43 in floating point.
        Running run(client("sim", "0.043"));
        EXPECT_EQ(Log::getSingleton().getWarnings(), "");
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        double last = run.scalar("count.y");
        for (int k = 0; k < 5; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            EXPECT_EQ(run.scalar("count.y") - last, 43);
            last = run.scalar("count.y");
        }
        run.simulation.stop(); // it goes on freely
        const int before = steps;
        const double end = now() + 20;
        while (steps < before + 100 && now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_GE(steps, before + 100);
    }
    {
        Running run(client("sim", "0.0104"));
        expect_contains(
            Log::getSingleton().getWarnings(),
            "SimulatorSynchronizer: an interval of 0.0104 s is 10.4 steps of the simulator; it runs 10");
    }
    expect_contains(refusal("model: m\nstep: 0.01\nblocks:\n" + network("sim") +
                            "  clock: {block: WholeBodyToolbox/SimulatorClock}\n"),
                    "clock: another simulator is called '/clock/rpc'; end it");
    expect_contains(refusal(client("sim", "0.0004")),
                    "sync: an interval of 0.0004 s is no number of steps of 0.001 s of the simulator");
    goes_on = false;
    other.join();
    served.simulation.stop();
    auto alone = client("sim", "0.01");
    alone.replace(alone.find("timeout: 20"), 11, "timeout: 0.1");
    expect_contains(refusal(alone), "sync: no simulator answers at '/clock/rpc' within 0.1 s");
}

/// Anybody may write the stream by which a simulator is asked.
TEST(SimulatorClock, LeavesOutRequestsThatAreNone) {
    Running served(simulator("odd"));
    Running other("model: m\nstep: 0.01\ninputs: {u: {shape: 3}}\nblocks:\n" + network("odd") +
                  "  x: {block: WholeBodyToolbox/StreamWrite, stream: \"'/clock/rpc?request'\"}\n"
                  "connections: {u: x}\n");
    ASSERT_TRUE(served.step());
    for (const auto& [command, steps] : {std::pair(4.0, 1.0),
                                         {-1.0, 0.0},
                                         {1e300, 0.0},
                                         {std::nan(""), 0.0},
                                         {3.0, 1e300},
                                         {3.0, -1.0},
                                         {3.0, std::nan("")}}) {
        other.set("u", Eigen::Vector3d(1, command, steps));
        ASSERT_TRUE(other.step());
        for (int k = 0; k < 3; ++k) {
            ASSERT_TRUE(served.step()) << command << " " << steps << ": " << served.simulation.failure();
        }
    }
}

namespace {

/// The end is asked for a little later, while one lives.
class AskedToEnd {
  public:
    AskedToEnd()
        : thread_([this] {
              std::this_thread::sleep_for(std::chrono::milliseconds(50));
              flag_ = 1;
          }) {
        look_for_interrupt(&flag_);
    }
    ~AskedToEnd() {
        thread_.join();
        look_for_interrupt(nullptr);
    }

  private:
    volatile std::sig_atomic_t flag_ = 0;
    std::thread thread_;
};

} // namespace

TEST(Interrupt, EndsEveryBlockThatWaits) {
    const std::string head =
        "model: m\nstep: 0.01\nblocks:\n" + network("end") + "  x: {block: WholeBodyToolbox/";
    for (const std::string block :
         {"StreamRead, autoconnect: false, wait_for_data: true, timeout: 1e9",
          "RealTimeSynchronizer, interval: 1e9", "RealTimeSynchronizer, interval: 1e9, clock: network",
          "SimulatorSynchronizer, timeout: 1e9"}) {
        const AskedToEnd asked;
        Running run(head + block + "}\n");
        while (run.step()) continue;
        EXPECT_EQ(run.simulation.failure(), std::string("x: ") + interrupted) << block;
    }
    // A simulator that is paused, by a client that neither steps it nor lets it go.
    Running served(head + "SimulatorClock, timeout: 1e9}\n");
    ASSERT_TRUE(served.step());
    std::thread other([&] {
        while (served.step()) continue;
    });
    Running run("model: m\nstep: 0.01\nblocks:\n" + network("end") +
                "  x: {block: WholeBodyToolbox/SimulatorSynchronizer, timeout: 20}\n");
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const AskedToEnd asked;
    other.join();
    EXPECT_EQ(served.simulation.failure(), std::string("x: ") + interrupted);
    served.simulation.stop(); // whose client would wait for it otherwise
}

} // namespace bf::toolbox::test::streams

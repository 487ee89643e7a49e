#include "bf/realtime/watchdog.hpp"

#include <csignal>
#include <filesystem>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>

namespace bf::realtime {
namespace {

constexpr Nanoseconds ms = 1'000'000;

const Control running;

void sleep(Nanoseconds time) { sleep_until(now() + time); }

TEST(Watchdog, BarksOnceWhenAStepWaitsForEver) {
    std::atomic<int> calls{0};
    {
        Watchdog watchdog(50 * ms, 500 * ms, 0, running, [&] { ++calls; });
        sleep(100 * ms);
        EXPECT_EQ(calls, 0) << "not before the first kick";
        watchdog.kick();
        while (calls == 0) sleep(2 * ms);
        sleep(200 * ms);
    }
    EXPECT_EQ(calls, 1);
}

TEST(Watchdog, BarksWhenAStepComputesForEver) {
    std::atomic<int> calls{0};
    Watchdog watchdog(50 * ms, 500 * ms, 0, running, [&] { ++calls; });
    watchdog.kick();
    while (calls == 0) {
    }
    EXPECT_EQ(calls, 1);
}

TEST(Watchdog, IsQuietWhileItHears) {
    std::atomic<int> calls{0};
    Watchdog watchdog(10'000 * ms, 500 * ms, 0, running, [&] { ++calls; });
    for (int i = 0; i < 10; ++i) {
        watchdog.kick();
        sleep(2 * ms);
    }
    EXPECT_EQ(calls, 0);
}

/// Runs `act` in a process of its own that is stopped for a second after the first tenth; its exit code.
template <class Act> int stopped_for_a_second(Act&& act) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(act());
    sleep(100 * ms);
    ::kill(child, SIGSTOP);
    sleep(1000 * ms);
    ::kill(child, SIGCONT);
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(Watchdog, APauseOfTheProcessIsNoHang) {
    EXPECT_EQ(stopped_for_a_second([] {
                  Watchdog watchdog(500 * ms, 500 * ms, 0, running, [] { ::_exit(3); });
                  for (int k = 0; k < 300; ++k) {
                      watchdog.kick();
                      sleep(1 * ms);
                  }
                  return 0;
              }),
              0);
    EXPECT_EQ(stopped_for_a_second([] {
                  Watchdog watchdog(500 * ms, 500 * ms, 0, running, [] { ::_exit(3); });
                  watchdog.kick();
                  sleep(30'000 * ms);
                  return 0;
              }),
              3)
        << "a step that hangs is found after a pause, too";
}

TEST(Watchdog, IsQuietWhileBlocksStartOrStop) {
    std::atomic<int> calls{0};
    Watchdog watchdog(50 * ms, 500 * ms, 0, running, [&] { ++calls; });
    watchdog.kick();
    watchdog.rest();
    sleep(200 * ms);
    EXPECT_EQ(calls, 0);
    watchdog.kick();
    while (calls == 0) sleep(2 * ms);
}

TEST(Watchdog, EndsAnEmergencyStopThatDoesNotComeToItsEndAlsoWhereNoStepHangs) {
    Control control;
    std::atomic<int> calls{0};
    {
        Watchdog watchdog(0, 100 * ms, 0, control, [&] { ++calls; });
        watchdog.kick();
        control.stop();
        sleep(200 * ms);
        EXPECT_EQ(calls, 0) << "a stop in order may take its time";
        control.emergency_stop();
        while (calls == 0) sleep(2 * ms);
        sleep(200 * ms);
    }
    EXPECT_EQ(calls, 1);
}

TEST(Watchdog, TheLimitOfSlowModelsIsTenOfTheirPeriods) {
    EXPECT_EQ(stall_limit(1, 10 * ms), 1000 * ms);
    EXPECT_EQ(stall_limit(1, 500 * ms), 5000 * ms);
    EXPECT_EQ(stall_limit(0, 500 * ms), 0);
    for (const double period : {1e9, 1e10, 1e300}) { // s
        EXPECT_EQ(stall_limit(1, nanoseconds(period)), longest_wait) << period;
        EXPECT_EQ(stall_limit(period, 1000 * ms), longest_wait) << period;
    }
    EXPECT_EQ(stall_text(7, 0.07, 1000 * ms, "arm.motor"),
              "step 7 at t = 0.07 s has not ended for 1 s; block 'arm.motor' is at work, so the program ends "
              "without stopping the blocks; look for a block that waits or never ends, or raise --watchdog");
}

TEST(Watchdog, SaysWhatAnEmergencyStopCouldNotEnd) {
    EXPECT_EQ(emergency_limit(10 * ms), 500 * ms);
    EXPECT_EQ(emergency_limit(500 * ms), 5000 * ms);
    EXPECT_EQ(
        emergency_text(7, 0.07, 500 * ms, "arm.motor"),
        "emergency stop: in 0.5 s neither step 7 at t = 0.07 s has ended nor all blocks have stopped; block "
        "'arm.motor' was begun last, so the program ends without them");
}

TEST(Control, GoesOneWay) {
    Control waiting(true);
    EXPECT_STREQ(text(waiting.state()), "waiting");
    EXPECT_FALSE(waiting.goes_on());
    EXPECT_TRUE(waiting.start());
    EXPECT_TRUE(waiting.goes_on());
    EXPECT_FALSE(waiting.start()) << "it runs already";
    EXPECT_TRUE(waiting.stop());
    EXPECT_FALSE(waiting.stop());
    EXPECT_FALSE(waiting.start()) << "what ends does not begin again";
    EXPECT_TRUE(waiting.emergency_stop()) << "after a stop, too";
    EXPECT_FALSE(waiting.emergency_stop());
    EXPECT_FALSE(waiting.stop()) << "an emergency is not taken back";
    EXPECT_STREQ(text(waiting.state()), "emergency stop");
    Control never(true);
    EXPECT_TRUE(never.stop());
    EXPECT_FALSE(never.start());
}

/// A service manager: the socket of sd_notify, and what it hears.
struct Manager {
    explicit Manager(const std::string& name) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, name.data(), name.size());
        if (name[0] == '@') address.sun_path[0] = '\0';
        const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
        EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), size), 0);
        ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
        ::setenv("WATCHDOG_USEC", "200000", 1);
    }
    ~Manager() {
        ::unsetenv("NOTIFY_SOCKET");
        ::unsetenv("WATCHDOG_USEC");
        ::close(socket);
    }
    /// The next message, or nothing for half a second.
    std::string hear() const {
        pollfd polled{socket, POLLIN, 0};
        if (::poll(&polled, 1, 500) != 1) return "";
        char text[100];
        return {text, static_cast<std::size_t>(::recv(socket, text, sizeof text, 0))};
    }
    int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

void expect_service_protocol(const std::string& name) {
    const Manager manager(name);
    {
        Watchdog watchdog(0, 500 * ms, 0, running, nullptr);
        watchdog.kick();
        EXPECT_EQ(manager.hear(), "") << "the first step has not ended";
        std::atomic<bool> is_over{false};
        watchdog.kick();
        EXPECT_EQ(manager.hear(), "READY=1");
        for (int k = 0; k < 5; ++k) {
            EXPECT_EQ(manager.hear(), "WATCHDOG=1") << k;
            watchdog.kick();
        }
        while (manager.hear() == "WATCHDOG=1") {
        }
        EXPECT_EQ(manager.hear(), "") << "the loop hangs, and so nothing is said";
        watchdog.end();
    }
    EXPECT_EQ(manager.hear(), "STOPPING=1");
}

TEST(Watchdog, TellsTheServiceManagerOfStepsThatEnd) {
    const auto file = std::filesystem::path(testing::TempDir()) / ("notify_" + std::to_string(::getpid()));
    expect_service_protocol(file);
    std::filesystem::remove(file);
    expect_service_protocol("@bf_notify_" + std::to_string(::getpid()));
}

TEST(Watchdog, OfAnotherProcessIsNotOurs) {
    const Manager manager("@bf_other_" + std::to_string(::getpid()));
    ::setenv("WATCHDOG_PID", "1", 1);
    EXPECT_EQ(ServiceManager().limit(), 0);
    ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
    EXPECT_EQ(ServiceManager().limit(), 200 * ms);
    ::unsetenv("WATCHDOG_PID");
    ::setenv("NOTIFY_SOCKET", std::string(200, '/').c_str(), 1);
    EXPECT_FALSE(ServiceManager().is_there());
}

} // namespace
} // namespace bf::realtime

// From one step to another over a topic of ROS 2, beside rcl's bare calls.
#include "bf/middleware/clock.hpp"
#include "blocks.hpp"
#include "messages.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <benchmark/benchmark.h>
#include <cstring>
#include <net/if.h>
#include <sched.h>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {

using bf::middleware::now;
namespace ros2 = bf::ros2;

constexpr int n = 23, count = 1000;

/// What a process of its own measures, as libraries of ROS 2 and their threads stay for as long as their
/// process: s.
struct Measured {
    std::array<double, count> times;
    bool is_good;
};

/// Messages come every 2 ms; what was heard of the last one is waited for before the next.
template <class Send, class Hear> void time(std::array<double, count>& times, Send&& send, Hear&& hear) {
    for (int k = 0; k < count + 100; ++k) {
        usleep(2000);
        const double begin = now();
        send();
        if (!hear()) throw std::runtime_error("a message is lost");
        if (k >= 100) times[static_cast<std::size_t>(k - 100)] = now() - begin;
    }
}

void measure_streams(Measured& measured) {
    ros2::Node here({.name = "here"}), there({.name = "there"});
    here.open();
    there.open();
    const auto reader = ros2::streams_over(there)->open_reader("/numbers", n);
    const auto writer = ros2::streams_over(here)->open_writer("/numbers", n);
    if (!writer->has_reader() || !reader->has_writer())
        throw std::runtime_error("they do not find each other");
    usleep(500'000);
    const Eigen::VectorXd values = Eigen::VectorXd::Zero(n);
    Eigen::VectorXd heard(n);
    bf::toolbox::Stamp stamp;
    time(
        measured.times, [&] { writer->write(values); },
        [&] { return reader->wait(1) && reader->take(heard, stamp) == bf::toolbox::Taken::message; });
}

void measure_bare(Measured& measured) {
    const auto here = std::make_shared<ros2::Context>(ros2::NodeOptions{.name = "here"}),
               there = std::make_shared<ros2::Context>(ros2::NodeOptions{.name = "there"});
    std::atomic<int> heard{0};
    ros2::Subscription subscription(there, ros2::messages::numbers(), "/bare", {},
                                    [&](const void*) { ++heard; });
    ros2::Publisher publisher(here, ros2::messages::numbers(), "/bare", {});
    std::atomic<bool> goes_on{true};
    std::thread listens([&] {
        rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
        if (rcl_wait_set_init(&set, 1, 0, 0, 0, 0, 0, &there->context, rcl_get_default_allocator()) !=
            RCL_RET_OK)
            return;
        while (goes_on) {
            if (rcl_wait_set_clear(&set) != RCL_RET_OK) break;
            subscription.add_to(set);
            if (rcl_wait(&set, 100'000'000) == RCL_RET_OK) subscription.take();
        }
        if (rcl_wait_set_fini(&set) != RCL_RET_OK) return;
    });
    while (publisher.readers() == 0) usleep(1000);
    usleep(500'000);
    const auto message = ros2::messages::make<ros2::messages::Numbers>(ros2::messages::numbers());
    ros2::messages::resize(message->data, n);
    int sent = 0;
    time(
        measured.times, [&] { publisher.publish(message.get()), ++sent; },
        [&] {
            for (const double end = now() + 1; heard < sent;)
                if (now() > end) return false;
            return true;
        });
    goes_on = false;
    listens.join();
}

void measure(Measured& measured, void (*what)(Measured&)) {
    alarm(60);
    if (unshare(CLONE_NEWNET) != 0) return;
    const int any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::strcpy(loopback.ifr_name, "lo");
    loopback.ifr_flags = IFF_UP;
    if (ioctl(any, SIOCSIFFLAGS, &loopback) != 0) return;
    what(measured);
    measured.is_good = true;
}

/// The 99th percentiles.
void ros2_latency(benchmark::State& state, void (*what)(Measured&)) {
    for (auto _ : state) {
        auto* measured = static_cast<Measured*>(
            mmap(nullptr, sizeof(Measured), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
        const pid_t child = fork();
        if (child == 0) {
            try {
                measure(*measured, what);
            } catch (const std::exception&) { // and it is not good
            }
            _exit(0);
        }
        waitpid(child, nullptr, 0);
        auto times = measured->times;
        const bool is_good = measured->is_good;
        munmap(measured, sizeof(Measured));
        if (!is_good) {
            state.SkipWithError("nodes of ROS 2 do not hear each other");
            return;
        }
        std::nth_element(times.begin(), times.begin() + count * 99 / 100, times.end());
        state.SetIterationTime(times[count * 99 / 100]);
    }
}
BENCHMARK_CAPTURE(ros2_latency, streams, measure_streams)
    ->Name("middleware.ros2_latency/streams")
    ->UseManualTime()
    ->Iterations(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(ros2_latency, bare, measure_bare)
    ->Name("middleware.ros2_latency/bare")
    ->UseManualTime()
    ->Iterations(1)
    ->Unit(benchmark::kMicrosecond);

} // namespace

// From one step to another over a topic of ROS 2, beside rcl's bare calls.
#include "bf/middleware/bell.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "own_process.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <benchmark/benchmark.h>
#include <ctime>
#include <stdexcept>
#include <thread>
#include <unistd.h>

namespace {

namespace ros2 = bf::ros2;

constexpr int n = 23, count = 1000;

/// s.
struct Measured {
    std::array<double, count> times;
    bool is_good;
};

/// s since 1970, as messages are stamped when they come.
double system_time() {
    timespec time{};
    clock_gettime(CLOCK_REALTIME, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Messages are sent every 2 ms; `heard` says when the one came that was sent last.
template <class Send, class Heard> void time(Measured& measured, Send&& send, Heard&& heard) {
    for (int k = -100; k < count; ++k) {
        usleep(2000);
        const double begin = system_time();
        send();
        const double came = heard();
        if (k >= 0) measured.times[static_cast<std::size_t>(k)] = came - begin;
    }
    measured.is_good = true;
}

/// From the step that writes to where a step reads.
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
    Eigen::VectorXd taken(n);
    bf::toolbox::Stamp stamp;
    time(
        measured, [&] { writer->write(values); },
        [&] {
            if (!reader->wait(1) || reader->take(taken, stamp) != bf::toolbox::Taken::message)
                throw std::runtime_error("a message is lost");
            return stamp.time;
        });
}

/// From rcl_publish to what rcl_take gives behind rcl_wait.
void measure_bare(Measured& measured) {
    const auto here = std::make_shared<ros2::Context>(ros2::NodeOptions{.name = "here"}),
               there = std::make_shared<ros2::Context>(ros2::NodeOptions{.name = "there"});
    std::atomic<double> came{0};
    bf::middleware::Bell bell{};
    const auto taken = [&](const void*) {
        came = system_time();
        bell.ring();
    };
    ros2::Subscription subscription(there, ros2::messages::numbers(), "/bare", {}, taken, nullptr);
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
    time(
        measured,
        [&] {
            came = 0;
            publisher.publish(message.get());
        },
        [&] {
            bell.wait(
                1, [&] { return came > 0; }, 0);
            return came.load();
        });
    goes_on = false;
    listens.join();
}

/// The 99th percentiles.
void ros2_latency(benchmark::State& state, void (*what)(Measured&)) {
    for (auto _ : state) {
        const auto measured = bf::benchmarks::measured_alone(what);
        if (!measured) {
            state.SkipWithError("nodes of ROS 2 do not hear each other");
            return;
        }
        auto times = measured->times;
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

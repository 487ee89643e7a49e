// From one step to another over a topic of ROS 2, beside rcl's bare calls.
#include "blocks.hpp"
#include "messages.hpp"
#include "own_process.hpp"

#include <algorithm>
#include <array>
#include <benchmark/benchmark.h>
#include <csignal>
#include <ctime>
#include <optional>
#include <stdexcept>
#include <sys/prctl.h>
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

/// Another program calls `send(time)` every 2 ms with what `speak` gives it; `hear` gives for one message
/// after the other how long it took. Fast DDS would not send anything between nodes of one program.
template <class Speak, class Hear> void between_programs(Measured& measured, Speak&& speak, Hear&& hear) {
    const pid_t peer = fork();
    if (peer == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        auto send = speak();
        for (;;) {
            usleep(2000);
            send(system_time());
        }
    }
    auto next = hear();
    for (int k = -200; k < count; ++k) {
        const double taken = next();
        if (k >= 0) measured.times[static_cast<std::size_t>(k)] = taken;
    }
    measured.is_good = true;
    kill(peer, SIGKILL);
}

/// From the step that writes to where a step reads.
void measure_streams(Measured& measured) {
    ros2::Node node({.name = "streams"});
    std::shared_ptr<bf::toolbox::StreamConnection> streams;
    between_programs(
        measured,
        [&] {
            node.open();
            streams = ros2::streams_over(node);
            return [writer = streams->open_writer("/numbers", n),
                    values = Eigen::VectorXd(Eigen::VectorXd::Zero(n))](double time) mutable {
                values[0] = time;
                writer->write(values);
            };
        },
        [&] {
            node.open();
            streams = ros2::streams_over(node);
            return [reader = streams->open_reader("/numbers", n), values = Eigen::VectorXd(n)]() mutable {
                bf::toolbox::Stamp stamp;
                if (!reader->wait(10) || reader->take(values, stamp) != bf::toolbox::Taken::message)
                    throw std::runtime_error("there is no message");
                return stamp.time - values[0];
            };
        });
}

/// From rcl_publish to what rcl_take gives behind rcl_wait.
void measure_bare(Measured& measured) {
    const auto context = [] { return std::make_shared<ros2::Context>(ros2::NodeOptions{.name = "bare"}); };
    double taken = -1;
    const auto take = [&](const void* message, std::uint64_t) {
        taken = system_time() - static_cast<const ros2::messages::Numbers*>(message)->data.data[0];
    };
    std::optional<ros2::Subscription> subscription;
    rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
    between_programs(
        measured,
        [&] {
            const auto message = ros2::messages::make<ros2::messages::Numbers>(ros2::messages::numbers());
            ros2::messages::resize(message->data, n);
            return [publisher = std::make_shared<ros2::Publisher>(context(), ros2::messages::numbers(),
                                                                  "/bare", ros2::Quality{}),
                    message](double time) {
                message->data.data[0] = time;
                publisher->publish(message.get());
            };
        },
        [&] {
            const auto its = context();
            subscription.emplace(its, ros2::messages::numbers(), "/bare", ros2::Quality{}, take);
            ros2::check(rcl_wait_set_init(&set, 1, 0, 0, 0, 0, 0, &its->context, rcl_get_default_allocator()),
                        "nothing can be waited for");
            return [&] {
                for (taken = -1; taken < 0; subscription->take()) {
                    ros2::check(rcl_wait_set_clear(&set), "nothing can be waited for");
                    subscription->add_to(set);
                    ros2::check(rcl_wait(&set, 10'000'000'000), "there is no message");
                }
                return taken;
            };
        });
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

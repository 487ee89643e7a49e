// What stands between a step and other threads and programs.
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/shared_memory/robot.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <benchmark/benchmark.h>
#include <csignal>
#include <cstring>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {

using namespace bf::middleware;

constexpr int n = 23;
using Signal = std::array<double, n>;

/// What the loop sees of one signal of 23 that a thread writes at 1 kHz.
void read_exchange(benchmark::State& state) {
    ExchangeBuffer exchange(n);
    Signal signal{};
    exchange.write(signal.data(), 0);
    std::atomic<bool> goes_on{true};
    std::thread writer([&] {
        Signal given{};
        while (goes_on) {
            exchange.write(given.data(), 0);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    Stamp stamp;
    for (auto _ : state) {
        benchmark::DoNotOptimize(exchange.read(signal.data(), stamp));
        benchmark::DoNotOptimize(signal);
    }
    goes_on = false;
    writer.join();
}
BENCHMARK(read_exchange)->Name("middleware.exchange/read");

void copy_signal(benchmark::State& state) {
    Signal from{}, to{};
    for (auto _ : state) {
        benchmark::DoNotOptimize(from);
        std::memcpy(to.data(), from.data(), sizeof to);
        benchmark::DoNotOptimize(to);
    }
}
BENCHMARK(copy_signal)->Name("middleware.exchange/memcpy");

/// A program of our own that does something until it is killed.
class Child {
  public:
    template <class F> explicit Child(F&& f) : process_(fork()) {
        if (process_ != 0) return;
        f();
        _exit(0);
    }
    ~Child() {
        kill(process_, SIGKILL);
        waitpid(process_, nullptr, 0);
    }

  private:
    pid_t process_;
};

/// The median of 101, in each iteration.
template <class F> void time_medians(benchmark::State& state, F&& f) {
    std::array<double, 101> times;
    for (auto _ : state) {
        for (double& time : times) {
            const double begin = now();
            f();
            time = now() - begin;
        }
        std::nth_element(times.begin(), times.begin() + 50, times.end());
        state.SetIterationTime(times[50]);
    }
}

/// From a command of 23 joints to the state of the robot that it leads to, through another program.
void shared_memory(benchmark::State& state) {
    const std::string name = "benchmark-" + std::to_string(getpid());
    RobotDescription description;
    description.period = 0.001;
    for (int i = 0; i < n; ++i) description.joints.push_back("joint" + std::to_string(i));
    for (auto* limits : {&description.position_min, &description.position_max, &description.velocity_min,
                         &description.velocity_max})
        limits->setZero(n);
    const RobotLayout at(description);
    std::vector<double> command(static_cast<std::size_t>(at.command_size())),
        robot(static_cast<std::size_t>(at.state_size()));
    const Child server([&] {
        auto end = bf::shared_memory::make_end(name);
        end->start(description);
        for (Stamp stamp;;) {
            end->wait(1);
            if (end->take_command(command.data(), stamp)) end->show_state(robot.data(), now());
        }
    });
    auto link = bf::shared_memory::make_link(name);
    link->start(10);
    time_medians(state, [&] {
        Stamp stamp;
        link->send_command(command.data());
        while (!link->take_state(robot.data(), stamp)) link->wait(1);
    });
}
BENCHMARK(shared_memory)
    ->Name("middleware.shared_memory/round_trip")
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

/// The same vectors through two pipes.
void pipes(benchmark::State& state) {
    std::array<double, 31> command{};
    std::array<double, 215> robot{};
    int there[2], back[2];
    if (pipe(there) != 0 || pipe(back) != 0) return state.SkipWithError("no pipe");
    const auto whole = [](ssize_t count, std::size_t wanted) {
        return count == static_cast<ssize_t>(wanted);
    };
    {
        const Child server([&] {
            while (whole(read(there[0], command.data(), sizeof command), sizeof command) &&
                   whole(write(back[1], robot.data(), sizeof robot), sizeof robot))
                continue;
        });
        time_medians(state, [&] {
            if (!whole(write(there[1], command.data(), sizeof command), sizeof command) ||
                !whole(read(back[0], robot.data(), sizeof robot), sizeof robot))
                state.SkipWithError("the pipe broke");
        });
    }
    for (const int end : {there[0], there[1], back[0], back[1]}) close(end);
}
BENCHMARK(pipes)->Name("middleware.shared_memory/pipes")->UseManualTime()->Unit(benchmark::kMicrosecond);

} // namespace

// What it costs to watch a run in the editor, and how long an instant of a run is waited for.
#include "bf/service/service.hpp"

#include <benchmark/benchmark.h>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <thread>

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

/// The service of one page, which knows no network, and what it was told last.
class Page {
  public:
    explicit Page(const fs::path& file)
        : service_({file, "",
                    [this](std::function<void()> task) {
                        const std::lock_guard lock(mutex_);
                        tasks_.push_back(std::move(task));
                        wake_.notify_one();
                    },
                    [this](const std::string& text) {
                        const Json told = Json::parse(text);
                        (told["method"] == "run" ? run_ : document_) = told["params"];
                    },
                    [this](const std::string& frame) { bytes_ += frame.size(); }}) {
        until([&] { return document_.value("is_checked", false); });
    }
    Json ask(const std::string& method, const Json& params) {
        const Json answer = Json::parse(service_.answer(
            0, Json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump()));
        if (!answer.contains("result")) throw std::runtime_error(answer.dump());
        return answer["result"];
    }
    void until(const std::function<bool()>& is_so) {
        while (!is_so()) {
            std::unique_lock lock(mutex_);
            wake_.wait_for(lock, std::chrono::milliseconds(20), [&] { return !tasks_.empty(); });
            const auto tasks = std::exchange(tasks_, {});
            lock.unlock();
            for (const auto& task : tasks) task();
        }
    }
    void go_on(std::chrono::milliseconds time) {
        const auto end = Clock::now() + time;
        until([&] { return Clock::now() >= end; });
    }
    /// To an instant, as the slider asks for it, until the page knows it.
    void go_to(double time) {
        run_ = nullptr;
        ask("run", {{"action", "to"}, {"time", time}});
        until([&] {
            return !run_.is_null() && run_["state"] != "running" &&
                   std::abs(run_["time"].get<double>() - time) < 2e-3;
        });
    }
    std::size_t bytes() const { return bytes_; }

  private:
    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<std::function<void()>> tasks_;
    Json run_, document_ = Json::object();
    std::size_t bytes_ = 0;
    bf::service::Service service_; // last: its threads end first
};

/// A folder that goes with the object.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("bf_watching_benchmark_" + std::to_string(::getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
};

double process_seconds() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time of all threads for a second of a run at 1 kHz, with so many of its 100 signals watched.
void live(benchmark::State& state, int watched) {
    const Folder folder;
    const fs::path file = folder.path / "live.yaml";
    std::string text = "model: live\nstep: 0.001\nstop: 100000\nblocks:\n";
    Json paths = Json::array();
    for (int i = 0; i < 100; ++i) {
        const std::string name = "s" + std::to_string(i);
        text += "  " + name + ": {block: Sine, frequency: " + std::to_string(i + 1) + "}\n";
        if (i < watched) paths.push_back(name + ".y");
    }
    std::ofstream(file) << text;
    Page page(file);
    page.ask("run", {{"action", "step"}});
    page.ask("watch", {{"paths", paths}});
    page.ask("run", {{"action", "start"}, {"factor", 1}});
    for (auto _ : state) {
        const double before = process_seconds();
        const auto begin = Clock::now();
        page.go_on(std::chrono::milliseconds(1000));
        state.SetIterationTime((process_seconds() - before) /
                               std::chrono::duration<double>(Clock::now() - begin).count());
    }
    state.counters["bytes"] = static_cast<double>(page.bytes());
}

/// The longest that a page waits for one of twenty instants of a balancing iCub's first minute.
void scrub(benchmark::State& state) {
    const Folder folder;
    fs::copy(fs::path(BF_SOURCE_DIRECTORY) / "examples" / "icub_balancing", folder.path,
             fs::copy_options::recursive);
    Page page(folder.path / "balancing.yaml");
    page.ask("edit", {{"operation", {{"do", "set"}, {"path", ""}, {"name", "stop"}, {"value", "60"}}}});
    page.go_on(std::chrono::milliseconds(3000)); // until it is checked
    page.ask("run", {{"action", "step"}});
    page.ask("watch", {{"paths", {"world.com", "world.s", "controller.tau"}}});
    page.go_to(60);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> instant(0, 60);
    for (auto _ : state) {
        double longest = 0;
        for (int i = 0; i < 20; ++i) {
            const double time = std::round(instant(random) * 1000) / 1000;
            const auto begin = Clock::now();
            page.go_to(time);
            longest = std::max(longest, std::chrono::duration<double>(Clock::now() - begin).count());
        }
        state.SetIterationTime(longest);
    }
}

} // namespace

BENCHMARK_CAPTURE(live, watched, 100)
    ->Name("editor.live_100_signals/watched")
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(2);
BENCHMARK_CAPTURE(live, alone, 0)
    ->Name("editor.live_100_signals/alone")
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(2);
BENCHMARK(scrub)->Name("editor.scrub")->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(1);

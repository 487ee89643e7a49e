// What the editor's service takes for an edit of a large model, beside the check alone, and for a drawing.
#include "bf/formats/yaml.hpp"
#include "bf/library/load.hpp"
#include "bf/service/service.hpp"
#include "bf/view/draw.hpp"
#include "large_model.hpp"

#include <benchmark/benchmark.h>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <stdexcept>

namespace {

using bf::benchmarks::LargeModel;

/// From the operation to the answer of the check, as a page waits for it.
void edit(benchmark::State& state) {
    const LargeModel large(1000);
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<std::function<void()>> tasks;
    bool is_checked = false;
    bf::service::Service service(
        {large.file, "",
         [&](std::function<void()> task) {
             const std::lock_guard lock(mutex);
             tasks.push_back(std::move(task));
             wake.notify_one();
         },
         [&](const std::string& text) { is_checked = text.find("\"is_checked\":true") != std::string::npos; },
         [](const std::string&) {}});
    const auto wait = [&] {
        while (!is_checked) {
            std::unique_lock lock(mutex);
            wake.wait(lock, [&] { return !tasks.empty(); });
            const auto task = std::move(tasks.front());
            tasks.pop_front();
            lock.unlock();
            task();
        }
    };
    wait();
    int value = 0;
    for (auto _ : state) {
        is_checked = false;
        const std::string answer = service.answer(
            0,
            R"({"id": 1, "method": "edit", "params": {"operation": {"do": "set", "path": "top.g3", "name": "K", "value": ")" +
                std::to_string(++value % 7) + R"("}}})");
        if (answer.find("\"result\"") == std::string::npos) throw std::runtime_error(answer);
        wait();
    }
}

void check(benchmark::State& state) {
    const LargeModel large(1000);
    for (auto _ : state) benchmark::DoNotOptimize(bf::examine(large.file).diagram.nodes.size());
}

/// A subsystem with fifty blocks.
void draw(benchmark::State& state) {
    const LargeModel large(1000);
    const bf::model::Model model = bf::formats::read_yaml(large.file);
    const bf::ExaminedModel examined = bf::examine(large.file);
    for (auto _ : state)
        benchmark::DoNotOptimize(
            bf::editor::draw(model, "top.s0.s1.s0.s1", examined.diagram, {}).elements.size());
}

} // namespace

BENCHMARK(edit)->Name("editor.edit_1000/service")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(check)->Name("editor.edit_1000/check")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(draw)->Name("editor.draw_50")->Unit(benchmark::kMillisecond);

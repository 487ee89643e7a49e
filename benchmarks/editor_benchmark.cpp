// What the editor's service takes for an edit of a large model, beside the check alone, and for a drawing.
#include "bf/formats/yaml.hpp"
#include "bf/library/load.hpp"
#include "bf/service/service.hpp"
#include "bf/view/draw.hpp"

#include <benchmark/benchmark.h>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>

namespace {

namespace fs = std::filesystem;

/// A subsystem of gains in a row, with two subsystems alike in it: five levels, some 1,000 blocks.
std::string system(int level, const std::string& indent) {
    const int count = level == 4 ? 50 : 10;
    std::string text = indent + "inputs: [u]\n" + indent + "outputs: [y]\n" + indent + "blocks:\n";
    std::string wires = indent + "connections:\n" + indent + "  u: g0\n", last = "g0";
    const auto add = [&](const std::string& name) {
        wires += indent + "  " + last + ": " + name + "\n";
        last = name;
    };
    for (int i = 0; i < count; ++i) {
        const std::string name = "g" + std::to_string(i);
        text += indent + "  " + name + ": {block: Gain, K: 0.5}\n";
        if (i > 0) add(name);
    }
    for (int i = 0; i < 2 && level < 4; ++i) {
        const std::string name = "s" + std::to_string(i);
        text += indent + "  " + name + ":\n" + system(level + 1, indent + "    ");
        add(name);
    }
    return text + wires + indent + "  " + last + ": y\n";
}

fs::path large_model() {
    const fs::path file =
        fs::temp_directory_path() / ("bf_editor_benchmark_" + std::to_string(::getpid()) + ".yaml");
    std::ofstream(file) << "model: large\nstep: 0.01\nblocks:\n  c: {block: Constant}\n  top:\n" +
                               system(0, "    ") + "connections: {c: top}\n";
    return file;
}

/// From the operation to the answer of the check, as a page waits for it.
void edit(benchmark::State& state) {
    const fs::path file = large_model();
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<std::function<void()>> tasks;
    bool is_checked = false;
    bf::service::Service service(
        {file, "",
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
    fs::remove(file);
}

void check(benchmark::State& state) {
    const fs::path file = large_model();
    for (auto _ : state) benchmark::DoNotOptimize(bf::examine(file).diagram.nodes.size());
    fs::remove(file);
}

/// A subsystem with fifty blocks.
void draw(benchmark::State& state) {
    const fs::path file = large_model();
    const bf::model::Model model = bf::formats::read_yaml(file);
    const bf::ExaminedModel examined = bf::examine(file);
    for (auto _ : state)
        benchmark::DoNotOptimize(
            bf::editor::draw(model, "top.s0.s1.s0.s1", examined.diagram, {}).elements.size());
    fs::remove(file);
}

} // namespace

BENCHMARK(edit)->Name("editor.edit_1000/service")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(check)->Name("editor.edit_1000/check")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(draw)->Name("editor.draw_50")->Unit(benchmark::kMillisecond);

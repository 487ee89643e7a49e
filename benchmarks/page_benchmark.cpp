// How long a person waits for the editor's page in a browser: the same models as in editor_benchmark.cpp,
// measured by editor/page/test/browser/benchmark.ts in Chromium without a graphics card.
#include "large_model.hpp"

#include <array>
#include <benchmark/benchmark.h>
#include <cstdio>
#include <memory>
#include <sstream>

namespace {

using bf::benchmarks::LargeModel;

/// What the script prints; nothing where there is no Node or no Chromium.
std::vector<double> measured(const std::string& what, const LargeModel& model) {
    const std::string command = "'" BF_NODE "' '" BF_PAGE_TESTS "/benchmark.ts' " + what +
                                " '" BF_COMMAND "' '" + model.file.string() + "'";
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
    std::array<char, 256> line{};
    std::vector<double> numbers;
    if (!pipe || !std::fgets(line.data(), line.size(), pipe.get())) return numbers;
    std::istringstream words(line.data());
    for (double number; words >> number;) numbers.push_back(number);
    return numbers;
}

void page(benchmark::State& state, const char* what, std::size_t which, const LargeModel& model) {
    for (auto _ : state) {
        const std::vector<double> numbers = measured(what, model);
        if (which >= numbers.size()) {
            state.SkipWithError("there is no Node or no Chromium");
            break;
        }
        state.SetIterationTime(numbers[which]);
    }
}

void open(benchmark::State& state, int blocks) { page(state, "open", 0, LargeModel(blocks)); }
void edit(benchmark::State& state) { page(state, "edit", 0, LargeModel(1000)); }
void pan(benchmark::State& state, int blocks, std::size_t which) {
    page(state, "pan", which, LargeModel::flat(blocks));
}

void times(benchmark::internal::Benchmark* benchmark) {
    benchmark->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(1);
}

} // namespace

BENCHMARK_CAPTURE(open, 100, 100)->Name("editor.open_100")->Apply(times);
BENCHMARK_CAPTURE(open, 1000, 1000)->Name("editor.open_1000")->Apply(times);
BENCHMARK_CAPTURE(open, 10000, 10000)->Name("editor.open_10000")->Apply(times);
BENCHMARK(edit)->Name("editor.edit_1000")->Apply(times);
BENCHMARK_CAPTURE(pan, frame, 1000, 0)->Name("editor.pan_1000")->Apply(times);
BENCHMARK_CAPTURE(pan, longest, 1000, 1)->Name("editor.pan_1000/longest")->Apply(times);
BENCHMARK_CAPTURE(pan, small, 1, 0)->Name("editor.pan_1")->Apply(times);

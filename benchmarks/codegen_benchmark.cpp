// Generated code of a chain of 1,010 blocks (gains, sums, unit delays): time per step, and to compile it.
#include "bf/blocks/standard.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/model/builder.hpp"

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
constexpr int all_pairs = 500, all_delays = 10, blocks = 2 * all_pairs + all_delays;

bf::codegen::Files chain(int width, int pairs, int delays) {
    const std::string n = std::to_string(width);
    bf::model::Builder m("chain");
    using bf::model::End;
    m.step(0.001).stop(10);
    m.add("one", "Constant", {{"value", "ones(" + n + ",1)"}});
    for (int i = 0; i < delays; ++i)
        m.add("delay" + std::to_string(i), "UnitDelay", {{"initial", "zeros(" + n + ",1)"}});
    std::string last = "delay" + std::to_string(delays - 1);
    for (int i = 0; i < pairs; ++i) {
        const std::string gain = "gain" + std::to_string(i), sum = "sum" + std::to_string(i);
        m.add(gain, "Gain", {{"K", 0.999}});
        m.add(sum, "Sum");
        m.connect(End{last}, End{gain});
        m.connect(End{gain}, End{sum, "u1"});
        m.connect(End{"one"}, End{sum, "u2"});
        last = sum;
    }
    for (int i = 0; i < delays; ++i) {
        const std::string delay = "delay" + std::to_string(i);
        m.connect(End{last}, End{delay});
        last = delay;
    }
    m.record({last});
    bf::Registry registry;
    registry.add(bf::standard_library());
    return bf::codegen::generate(bf::elaborate(m.build(), registry));
}

/// A generated project, compiled with the options of its CMakeLists.txt.
struct Project {
    fs::path folder;
    explicit Project(int width, int pairs = all_pairs, int delays = all_delays) {
        static int made = 0;
        folder = fs::temp_directory_path() /
                 ("bf_codegen_benchmark_" + std::to_string(getpid()) + "_" + std::to_string(++made));
        bf::codegen::write(chain(width, pairs, delays), folder);
    }
    ~Project() { fs::remove_all(folder); }
    void execute(const std::string& command) const {
        if (std::system(("cd " + folder.string() + " && " + command).c_str()) != 0)
            throw std::runtime_error(command);
    }
    void compile(const std::string& optimisation) const {
        execute("c++ -std=c++17 " + optimisation + " -ffp-contract=off -I. -Iinclude *.cpp -o chain");
    }
};

void step(benchmark::State& state, int width) {
    // Compiled once for all repetitions.
    static std::map<int, std::unique_ptr<Project>> projects;
    auto& known = projects[width];
    if (!known) {
        known = std::make_unique<Project>(width);
        known->compile("-O3 -fno-tree-slp-vectorize");
    }
    const Project& project = *known;
    for (auto _ : state) {
        project.execute("./chain --time > time.txt");
        double nanoseconds = 0;
        std::ifstream(project.folder / "time.txt") >> nanoseconds;
        state.SetIterationTime(nanoseconds / blocks * 1e-9);
    }
}

/// What is left of the time when the model is next to nothing: the compiler and the headers.
void compile(benchmark::State& state, int pairs, int delays) {
    const Project project(1, pairs, delays);
    for (auto _ : state) project.compile("-O2");
}
void compile_all(benchmark::State& state) { compile(state, all_pairs, all_delays); }
void compile_three(benchmark::State& state) { compile(state, 1, 1); }

/// The same numbers written by hand, every signal stored.
void hand_loop(benchmark::State& state) {
    double gain[all_pairs], sum[all_pairs] = {}, delay[all_delays] = {};
    for (auto _ : state) {
        double last = delay[all_delays - 1];
        for (int i = 0; i < all_pairs; ++i) {
            gain[i] = 0.999 * last;
            sum[i] = last = gain[i] + 1;
        }
        for (int i = all_delays - 1; i > 0; --i) delay[i] = delay[i - 1];
        delay[0] = last;
        benchmark::DoNotOptimize(gain);
        benchmark::DoNotOptimize(sum);
        benchmark::DoNotOptimize(delay);
    }
    state.SetItemsProcessed(state.iterations() * blocks);
}

void scalar_block(benchmark::State& state) { step(state, 1); }
void vector23_block(benchmark::State& state) { step(state, 23); }

} // namespace

BENCHMARK(scalar_block)
    ->Name("codegen.scalar_block")
    ->UseManualTime()
    ->Iterations(5)
    ->Unit(benchmark::kNanosecond);
BENCHMARK(vector23_block)
    ->Name("codegen.vector23_block")
    ->UseManualTime()
    ->Iterations(5)
    ->Unit(benchmark::kNanosecond);
BENCHMARK(hand_loop)->Name("codegen.scalar_block/hand_loop");
BENCHMARK(compile_all)
    ->Name("codegen.compile_1000_blocks")
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(2)
    ->Unit(benchmark::kSecond);
BENCHMARK(compile_three)
    ->Name("codegen.compile_1000_blocks/three_blocks")
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(2)
    ->Unit(benchmark::kSecond);

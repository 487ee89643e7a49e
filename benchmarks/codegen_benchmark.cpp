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
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
constexpr int pairs = 500, delays = 10, blocks = 2 * pairs + delays;

bf::codegen::Files chain(int width) {
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
    fs::path folder = fs::temp_directory_path() / ("bf_codegen_benchmark_" + std::to_string(getpid()));
    explicit Project(int width) { bf::codegen::write(chain(width), folder); }
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
    const Project project(width);
    project.compile("-O3 -fno-tree-slp-vectorize");
    for (auto _ : state) {
        project.execute("./chain --time > time.txt");
        double nanoseconds = 0;
        std::ifstream(project.folder / "time.txt") >> nanoseconds;
        state.SetIterationTime(nanoseconds / blocks * 1e-9);
    }
}

void compile(benchmark::State& state) {
    const Project project(1);
    for (auto _ : state) project.compile("-O2");
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
BENCHMARK(compile)
    ->Name("codegen.compile_1000_blocks")
    ->UseRealTime()
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

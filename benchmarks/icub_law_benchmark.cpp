// The equations of the balancing controller alone: its standard blocks, fed with what the blocks of plugins
// gave in a run. Generated code beside the engine, beside the same law written by hand with Eigen, and beside
// its products of matrices and solutions of equations alone, whose kernels the engine and generated code
// share.
#include "part_of_diagram.hpp"

#include "bf/codegen/generate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

namespace fs = std::filesystem;
constexpr int steps = 64; // repeated: few enough to stay in the cache

bool is_law(const bf::DiagramNode& node) {
    return node.path.starts_with("controller.") && node.type.find('/') == std::string::npos;
}

bool is_arithmetic(const bf::DiagramNode& node) {
    static const std::set<std::string_view> kernels{"bf::kernels::ScalarOrMatrixProduct{}",
                                                    "bf::kernels::CholeskySolve{}"};
    const auto& rules = node.block->declaration().rules(bf::Phase::output);
    return is_law(node) && !rules.empty() && kernels.contains(rules.front().kernel);
}

/// A part of the controller.
struct Part {
    std::string name;
    bool (*has)(const bf::DiagramNode&);
    std::vector<std::string> outputs;
};
const Part whole_law{"icub_law",
                     is_law,
                     {"limited.y", "distribution.H.y", "distribution.g.y", "distribution.C.y",
                      "distribution.d.y", "distribution.largest.y", "base.velocity.y", "base.pose.a_H_c",
                      "references.com_r.y", "references.com_dot_r.y", "references.com_ddot_r.y",
                      "references.postures.y", "references.machine.state", "references.releases.y",
                      "references.target.y"}};
const Part arithmetic{"icub_arithmetic", is_arithmetic, {"torque_of_wrenches.y"}};

/// Leaves the blocks of the part.
void reduce(bf::Diagram& d, const Part& part) {
    leave(d, "controller.", part.has);
    d.name = part.name;
    for (const auto& path : part.outputs) {
        const auto end = d.find_signal("controller." + path);
        if (end.node < 0) throw std::runtime_error("the controller has no signal " + path);
        d.outputs.push_back({path, end});
    }
}

bf::LoadedModel balancing() {
    return bf::load(BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml",
                    {{"T_control", "0.001"}, {"scenario", "1"}});
}

/// A part with what it reads and computes in a run of the whole model.
struct Model {
    bf::LoadedModel loaded = balancing();
    std::vector<double> inputs, outputs; ///< of all steps

    explicit Model(const Part& part) {
        reduce(loaded.diagram, part);
        const auto whole = balancing();
        bf::Simulation simulation(whole.diagram);
        Watch in(loaded.diagram.inputs), out(loaded.diagram.outputs);
        simulation.add_observer(in);
        simulation.add_observer(out);
        simulation.start();
        for (int k = 0; k < steps; ++k)
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
        inputs = std::move(in.values);
        outputs = std::move(out.values);
    }
    /// The generated project, and the inputs beside it.
    bf::codegen::Files write(const fs::path& folder) const {
        auto files = bf::codegen::generate(loaded.diagram);
        bf::codegen::write(files, folder);
        std::ofstream(folder / "inputs", std::ios::binary)
            .write(reinterpret_cast<const char*>(inputs.data()),
                   static_cast<std::streamsize>(inputs.size() * sizeof(double)));
        return files;
    }
};

struct Law {
    Model whole{whole_law}, arithmetic{::arithmetic};
    fs::path folder = fs::temp_directory_path() / ("bf_icub_law_" + std::to_string(getpid()));

    Law() {
        const auto files = whole.write(folder);
        arithmetic.write(folder / "arithmetic");
        // The flags of the generated project for its code; plain -O3 for what is written by hand.
        const std::string& project = files.at("CMakeLists.txt");
        const std::string before = "CMAKE_CXX_FLAGS_RELEASE \"";
        const auto at = project.find(before) + before.size();
        const std::string flags = project.substr(at, project.find('"', at) - at);
        const std::string source = BF_SOURCE_DIRECTORY "/benchmarks/icub_law/";
        const std::string include = " -I. -Iarithmetic -Iinclude ";
        execute("c++ -std=c++17 " + flags + " -ffp-contract=off" + include +
                "-c icub_law.cpp icub_law_tables.cpp arithmetic/icub_arithmetic.cpp "
                "arithmetic/icub_arithmetic_tables.cpp && c++ -std=c++17 -O3 -DNDEBUG" +
                include + "-isystem " BF_EIGEN " " + source + "driver.cpp " + source +
                "hand_law.cpp *.o -o driver");
    }
    ~Law() { fs::remove_all(folder); }
    void execute(const std::string& command) const {
        if (std::system(("cd " + folder.string() + " && " + command).c_str()) != 0)
            throw std::runtime_error(command);
    }

    static const Law& made() {
        static const Law law;
        return law;
    }
};

void engine(benchmark::State& state) {
    const Model& law = Law::made().whole;
    const auto& diagram = law.loaded.diagram;
    bf::Simulation simulation(diagram);
    simulation.start();
    const Inputs inputs(simulation, law.inputs);
    const auto run = [&](auto&& after_step) {
        for (int k = 0; k < steps; ++k) {
            inputs.set(static_cast<std::size_t>(k));
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
            after_step();
        }
    };
    std::vector<double> outputs;
    run([&] { append(simulation, diagram.outputs, outputs); });
    if (outputs != law.outputs)
        throw std::runtime_error("the reduced model does not compute what the whole one does");
    // The fastest of as many rounds as the driver of the others makes.
    for (auto _ : state) {
        double best = std::numeric_limits<double>::infinity();
        for (int i = 0; i < 100; ++i) {
            const auto begin = std::chrono::steady_clock::now();
            for (int round = 0; round < 10; ++round) run([] {});
            const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
            best = std::min(best, taken.count() / (10 * steps));
        }
        state.SetIterationTime(best);
    }
}

/// One of the times that the driver prints.
void driver(benchmark::State& state, int which) {
    const Law& law = Law::made();
    for (auto _ : state) {
        law.execute("./driver > times");
        std::ifstream stream(law.folder / "times");
        double nanoseconds[3] = {};
        for (double& time : nanoseconds) stream >> time;
        state.SetIterationTime(nanoseconds[which] * 1e-9);
    }
    const auto compare = [&](const char* file, const std::vector<double>& expected) {
        std::vector<double> outputs(expected.size());
        std::ifstream(law.folder / file, std::ios::binary)
            .read(reinterpret_cast<char*>(outputs.data()),
                  static_cast<std::streamsize>(outputs.size() * sizeof(double)));
        if (outputs != expected)
            throw std::runtime_error("generated code does not compute what the model does");
    };
    compare("outputs", law.whole.outputs);
    compare("arithmetic/outputs", law.arithmetic.outputs);
}
void generated(benchmark::State& state) { driver(state, 0); }
void hand(benchmark::State& state) { driver(state, 1); }
void arithmetic_alone(benchmark::State& state) { driver(state, 2); }

} // namespace

BENCHMARK(engine)->Name("codegen.icub_law/engine")->UseManualTime()->Iterations(3);
BENCHMARK(generated)->Name("codegen.icub_law/generated")->UseManualTime()->Iterations(3);
BENCHMARK(hand)->Name("codegen.icub_law/hand")->UseManualTime()->Iterations(3);
BENCHMARK(arithmetic_alone)->Name("codegen.icub_law/arithmetic")->UseManualTime()->Iterations(3);

// The equations of the balancing controller alone: its standard blocks, fed with what the blocks of plugins
// gave in a run. Generated code beside the engine, and beside the same law written by hand with Eigen.
#include "session.hpp"

#include "bf/codegen/generate.hpp"
#include "bf/engine/simulation.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

namespace fs = std::filesystem;
constexpr int steps = 64; // repeated: few enough to stay in the cache

/// Stands for a block that does not run here. Those of its outputs that are read are inputs of the diagram.
class Recorded final : public bf::Block {
  public:
    Recorded(const bf::Resolution& from, const std::set<int>& read) {
        bf::detail::declared_by(*this).slots = from.declaration().slots;
        resolution().slots = from.slots;
        for (int i = 0; i < static_cast<int>(from.slots.size()); ++i) {
            auto& slot = resolution().slots[static_cast<std::size_t>(i)];
            slot.role = bf::Role::output;
            if (!read.contains(i)) slot.size = {0, 1, false};
        }
    }
};

bool is_law(const bf::DiagramNode& node) {
    return node.path.starts_with("controller.") && node.type.find('/') == std::string::npos;
}

/// Leaves the standard blocks of the controller.
void reduce(bf::Diagram& d) {
    std::vector<std::set<int>> read(d.nodes.size());
    std::vector<bool> stays;
    for (const auto& node : d.nodes) stays.push_back(is_law(node));
    for (std::size_t n = 0; n < d.nodes.size(); ++n)
        for (const auto& from : d.nodes[n].sources)
            if (stays[n] && from.node >= 0 && !stays[static_cast<std::size_t>(from.node)])
                read[static_cast<std::size_t>(from.node)].insert(from.slot);
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
        if (stays[n]) continue;
        auto& node = d.nodes[n];
        node.block = std::make_unique<Recorded>(node.block->resolution(), read[n]);
        node.type = "Inport";
        node.methods = {};
        node.sources.assign(node.sources.size(), {});
        node.providers.clear();
        for (const int slot : read[n]) {
            const bf::Node::End end{static_cast<int>(n), slot};
            d.inputs.push_back({d.end_path(end).substr(std::string("controller.").size()), end});
        }
    }
    for (auto* segments : {&d.plan.outputs, &d.plan.updates})
        for (auto& segment : *segments)
            std::erase_if(segment.activities, [&](const bf::Activity& activity) {
                return !stays[static_cast<std::size_t>(activity.node)];
            });
    d.name = "icub_law";
    d.definitions.clear(); // they name parameters of blocks that do not run here
    d.plots.clear();
    d.record.clear();
    for (const std::string path :
         {"limited.y", "distribution.H.y", "distribution.g.y", "distribution.C.y", "distribution.d.y",
          "distribution.largest.y", "base.velocity.y", "base.pose.a_H_c", "references.com_r.y",
          "references.com_dot_r.y", "references.com_ddot_r.y", "references.postures.y",
          "references.machine.state", "references.releases.y", "references.target.y"}) {
        const auto end = d.find_signal("controller." + path);
        if (end.node < 0) throw std::runtime_error("the controller has no signal " + path);
        d.outputs.push_back({path, end});
    }
}

bf::LoadedModel balancing() {
    bf::tools::ModelOptions options;
    options.file = BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml";
    options.sets = {"T_control=0.001", "scenario=1"};
    return bf::tools::load_model(options);
}

/// The elements of signals, as they come in the structures of generated code.
void append(const bf::Simulation& simulation, const std::vector<bf::SignalName>& signals,
            std::vector<double>& to) {
    for (const auto& signal : signals) {
        const auto* data =
            static_cast<const double*>(simulation.context().data(signal.end.node, signal.end.slot));
        to.insert(to.end(), data, data + simulation.diagram().slot(signal.end).size.count());
    }
}

struct Watch final : bf::Run::Observer {
    const std::vector<bf::SignalName>& signals;
    std::vector<double> values;
    explicit Watch(const std::vector<bf::SignalName>& s) : signals(s) {}
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const bf::Simulation&>(run);
        append(simulation, signals, values);
    }
};

struct Law {
    bf::LoadedModel loaded = balancing();
    std::vector<double> inputs;  ///< of all steps
    std::vector<double> outputs; ///< what the whole model computes from them
    fs::path folder = fs::temp_directory_path() / ("bf_icub_law_" + std::to_string(getpid()));

    Law() {
        reduce(loaded.diagram);
        {
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
        const auto files = bf::codegen::generate(loaded.diagram);
        bf::codegen::write(files, folder);
        std::ofstream(folder / "inputs", std::ios::binary)
            .write(reinterpret_cast<const char*>(inputs.data()),
                   static_cast<std::streamsize>(inputs.size() * sizeof(double)));
        // The flags of the generated project for its code; plain -O3 for what is written by hand.
        const std::string& project = files.at("CMakeLists.txt");
        const std::string before = "CMAKE_CXX_FLAGS_RELEASE \"";
        const auto at = project.find(before) + before.size();
        const std::string flags = project.substr(at, project.find('"', at) - at);
        const std::string source = BF_SOURCE_DIRECTORY "/benchmarks/icub_law/";
        execute("c++ -std=c++17 " + flags +
                " -ffp-contract=off -I. -Iinclude -c icub_law.cpp icub_law_tables.cpp && c++ -std=c++17 -O3 "
                "-DNDEBUG -I. "
                "-Iinclude -isystem " BF_EIGEN " " +
                source + "driver.cpp " + source + "hand_law.cpp icub_law.o icub_law_tables.o -o driver");
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
    const Law& law = Law::made();
    const auto& diagram = law.loaded.diagram;
    bf::Simulation simulation(diagram);
    simulation.start();
    struct Target {
        void* to;
        std::size_t bytes;
    };
    std::vector<Target> targets;
    for (const auto& input : diagram.inputs)
        targets.push_back({simulation.context().data(input.end.node, input.end.slot),
                           static_cast<std::size_t>(diagram.slot(input.end).size.count()) * sizeof(double)});
    const auto run = [&](auto&& after_step) {
        const auto* from = reinterpret_cast<const std::byte*>(law.inputs.data());
        for (int k = 0; k < steps; ++k) {
            for (const auto& [to, bytes] : targets) {
                std::memcpy(to, from, bytes);
                from += bytes;
            }
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
            after_step();
        }
    };
    std::vector<double> outputs;
    run([&] { append(simulation, diagram.outputs, outputs); });
    if (outputs != law.outputs)
        throw std::runtime_error("the reduced model does not compute what the whole one does");
    for (auto _ : state) run([] {});
    state.SetItemsProcessed(state.iterations() * steps);
}

/// One of the two times that the driver prints.
void driver(benchmark::State& state, int which) {
    const Law& law = Law::made();
    for (auto _ : state) {
        law.execute("./driver > times");
        std::ifstream stream(law.folder / "times");
        double nanoseconds[2] = {};
        stream >> nanoseconds[0] >> nanoseconds[1];
        state.SetIterationTime(nanoseconds[which] * 1e-9);
    }
    std::vector<double> outputs(law.outputs.size());
    std::ifstream(law.folder / "outputs", std::ios::binary)
        .read(reinterpret_cast<char*>(outputs.data()),
              static_cast<std::streamsize>(outputs.size() * sizeof(double)));
    if (outputs != law.outputs)
        throw std::runtime_error("generated code does not compute what the model does");
}
void generated(benchmark::State& state) { driver(state, 0); }
void hand(benchmark::State& state) { driver(state, 1); }

} // namespace

BENCHMARK(engine)->Name("codegen.icub_law/engine");
BENCHMARK(generated)->Name("codegen.icub_law/generated")->UseManualTime()->Iterations(3);
BENCHMARK(hand)->Name("codegen.icub_law/hand")->UseManualTime()->Iterations(3);

// A controller as an FMU: a step of it beside the same generated code, and a block with it beside that step.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/fmi/fmi3.h"
#include "bf/fmi/instance.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/library/load.hpp"
#include "bf/run/run_c.h"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

constexpr const char* controller =
    "model: controller\nstep: 0.001\ninputs: [reference, speed]\noutputs: [voltage]\nblocks:\n"
    "  error: {block: Sum, signs: +-}\n  gain: {block: Gain, K: 0.3}\n"
    "  integral: {block: DiscreteIntegrator}\n  sum: {block: Sum}\n"
    "connections:\n  reference: error.u1\n  speed: error.u2\n  error: [gain, integral]\n"
    "  gain: sum.u1\n  integral: sum.u2\n  sum: voltage\n";
constexpr const char* wrapper =
    "model: wrapper\nplugins: [FMI]\nstep: 0.001\ninputs: [reference, speed]\nblocks:\n"
    "  f: {block: FMI/FMU, fmu: controller.fmu, period: 0.001}\n"
    "connections:\n  reference: f.reference\n  speed: f.speed\n";

/// A state of some size.
constexpr const char* held = "model: held\nstep: 0.001\ninputs: [u]\noutputs: [y]\nblocks:\n"
                             "  delay: {block: Delay, steps: 4000}\nconnections:\n  u: delay\n  delay: y\n";

/// The controller exported, and generated, each compiled once.
struct Made {
    bf::fmi::TemporaryFolder folder{"benchmark"};
    void* fmu = nullptr;
    const bf_run_library* generated = nullptr;

    Made() {
        const auto& path = folder.path();
        std::ofstream(path / "controller.yaml") << controller;
        execute(BF_COMMAND " export-fmu controller.yaml -o controller.fmu >log 2>&1");
        execute(BF_COMMAND " generate controller.yaml -o code >log 2>&1");
        execute(
            "cd code && c++ -std=c++17 -O3 -fno-tree-slp-vectorize -DNDEBUG -ffp-contract=off "
            "-fno-semantic-interposition -fPIC -shared -I. -Iinclude controller*.cpp -o libcontroller.so");
        bf::fmi::extract(path / "controller.fmu", path / "fmu");
        fmu = open(path / "fmu/binaries/x86_64-linux/controller.so");
        generated = find<bf_run_v1_function>(open(path / "code/libcontroller.so"), "bf_run_v1")();
        ::setenv("BLOCKFACTORY_PLUGIN_PATH", (path.string() + ":" BF_PLUGIN_DIRECTORY).c_str(), 1);
    }
    void execute(const std::string& command) const {
        if (std::system(("cd " + folder.path().string() + " && " + command).c_str()) != 0)
            throw std::runtime_error(command);
    }
    static void* open(const fs::path& file) {
        void* const handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!handle) throw std::runtime_error(::dlerror());
        return handle;
    }
    template <class F> static F find(void* handle, const char* name) {
        return reinterpret_cast<F>(::dlsym(handle, name));
    }
    static Made& get() {
        static Made made;
        return made;
    }
};

void generated(benchmark::State& state) {
    const auto& its = *Made::get().generated;
    bf_run_model* const model = its.create();
    bf_run_quantity reference{}, speed{}, voltage{};
    its.quantity(model, bf_run_inputs, 0, &reference);
    its.quantity(model, bf_run_inputs, 1, &speed);
    its.quantity(model, bf_run_outputs, 0, &voltage);
    its.initialize(model);
    double sum = 0;
    for (auto _ : state) {
        *static_cast<double*>(reference.data) = sum;
        *static_cast<double*>(speed.data) = 0.5;
        its.output(model);
        sum = *static_cast<double*>(voltage.data) * 1e-3;
        its.update(model);
    }
    benchmark::DoNotOptimize(sum);
    its.destroy(model);
}

void step(benchmark::State& state) {
    void* const library = Made::get().fmu;
    const auto description = bf::fmi::description_of(Made::get().folder.path() / "controller.fmu");
    const auto instance = Made::find<decltype(&fmi3InstantiateCoSimulation)>(
        library, "fmi3InstantiateCoSimulation")("one", description.token.c_str(), nullptr, false, false,
                                                false, false, nullptr, 0, nullptr, nullptr, nullptr);
    const auto set = Made::find<decltype(&fmi3SetFloat64)>(library, "fmi3SetFloat64");
    const auto get = Made::find<decltype(&fmi3GetFloat64)>(library, "fmi3GetFloat64");
    const auto do_step = Made::find<decltype(&fmi3DoStep)>(library, "fmi3DoStep");
    Made::find<decltype(&fmi3EnterInitializationMode)>(library, "fmi3EnterInitializationMode")(
        instance, false, 0, 0, false, 0);
    Made::find<decltype(&fmi3ExitInitializationMode)>(library, "fmi3ExitInitializationMode")(instance);
    const fmi3ValueReference inputs[] = {1, 2}, output[] = {3};
    double values[] = {0, 0.5}, voltage = 0, reached = 0;
    bool flags[3];
    std::int64_t k = 0;
    for (auto _ : state) {
        values[0] = voltage * 1e-3;
        set(instance, inputs, 2, values, 2);
        get(instance, output, 1, &voltage, 1);
        if (do_step(instance, static_cast<double>(k++) * 0.001, 0.001, true, &flags[0], &flags[1], &flags[2],
                    &reached) != fmi3OK)
            state.SkipWithError("the step failed");
    }
    benchmark::DoNotOptimize(voltage);
    Made::find<decltype(&fmi3FreeInstance)>(library, "fmi3FreeInstance")(instance);
}

void block(benchmark::State& state) {
    Made::get();
    bf::Registry registry;
    registry.add(bf::standard_library());
    const bf::Diagram diagram = bf::elaborate(bf::formats::read_yaml_text(wrapper, "wrapper.yaml"), registry);
    bf::Simulation simulation(diagram);
    simulation.start();
    for (auto _ : state)
        if (!simulation.step()) state.SkipWithError("the step failed");
    simulation.stop();
}

/// An instance of the delay, and the bytes that its state has.
class Held {
  public:
    Held() {
        const auto& made = Made::get();
        std::ofstream(made.folder.path() / "held.yaml") << held;
        made.execute(BF_COMMAND " export-fmu held.yaml -o held.fmu >log 2>&1");
        bf::fmi::extract(made.folder.path() / "held.fmu", made.folder.path() / "held");
        library_ = Made::open(made.folder.path() / "held/binaries/x86_64-linux/held.so");
        const auto description = bf::fmi::description_of(made.folder.path() / "held.fmu");
        instance = find<decltype(&fmi3InstantiateCoSimulation)>("fmi3InstantiateCoSimulation")(
            "one", description.token.c_str(), nullptr, false, false, false, false, nullptr, 0, nullptr,
            nullptr, nullptr);
        find<decltype(&fmi3EnterInitializationMode)>("fmi3EnterInitializationMode")(instance, false, 0, 0,
                                                                                    false, 0);
        find<decltype(&fmi3ExitInitializationMode)>("fmi3ExitInitializationMode")(instance);
        find<decltype(&fmi3GetFMUState)>("fmi3GetFMUState")(instance, &state);
        find<decltype(&fmi3SerializedFMUStateSize)>("fmi3SerializedFMUStateSize")(instance, state, &size);
    }
    template <class F> F find(const char* name) const { return Made::find<F>(library_, name); }
    static Held& get() {
        static Held its;
        return its;
    }
    fmi3Instance instance = nullptr;
    fmi3FMUState state = nullptr;
    std::size_t size = 0;

  private:
    void* library_ = nullptr;
};

void save(benchmark::State& state) {
    Held& its = Held::get();
    const auto get = its.find<decltype(&fmi3GetFMUState)>("fmi3GetFMUState");
    for (auto _ : state)
        if (get(its.instance, &its.state) != fmi3OK) state.SkipWithError("it was not saved");
}

void restore(benchmark::State& state) {
    Held& its = Held::get();
    const auto set = its.find<decltype(&fmi3SetFMUState)>("fmi3SetFMUState");
    for (auto _ : state)
        if (set(its.instance, its.state) != fmi3OK) state.SkipWithError("it was not restored");
}

void copy(benchmark::State& state) {
    const std::vector<char> from(Held::get().size, 1);
    std::vector<char> to(from.size());
    for (auto _ : state) {
        std::memcpy(to.data(), from.data(), from.size());
        benchmark::DoNotOptimize(to.data());
        benchmark::ClobberMemory();
    }
    state.counters["bytes"] = static_cast<double>(from.size());
}

/// The balancing iCub in lockstep with its world: the controller in the model, or as an FMU with the
/// Whole-Body Toolbox and the robot in it.
void balance(benchmark::State& state, const char* model) {
    const auto& made = Made::get();
    made.execute("test -e balancing.yaml || { python3 " BF_SOURCE_DIRECTORY
                 "/tests/fmi/law.py . " BF_SOURCE_DIRECTORY "/examples 0.01 && " BF_COMMAND
                 " export-fmu law.yaml -o law.fmu >log 2>&1; }");
    const auto loaded =
        bf::load(fs::path(model).is_absolute() ? fs::path(model) : made.folder.path() / model);
    bf::Simulation simulation(loaded.diagram);
    for (auto _ : state) {
        state.PauseTiming(); // an archive is unpacked
        simulation.start();
        state.ResumeTiming();
        for (int k = 0; k < 4000; ++k) // 4 s
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
        state.PauseTiming();
        simulation.stop();
        state.ResumeTiming();
    }
}
void balance_by_model(benchmark::State& state) {
    balance(state, BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml");
}
void balance_by_fmu(benchmark::State& state) { balance(state, "balancing.yaml"); }

/// The command, with the compiler; `count` blocks one behind the other, a third of each kind.
void export_blocks(benchmark::State& state, int count) {
    std::string blocks, wires = "  u: b0\n  b" + std::to_string(count - 1) + ": y\n";
    for (int i = 0; i < count; ++i) {
        const std::string name = "b" + std::to_string(i);
        constexpr const char* kinds[] = {"Integrator", "Gain, K: 0.99", "DiscreteIntegrator"};
        blocks += "  " + name + ": {block: " + kinds[i % 3] + "}\n";
        if (i > 0) wires += "  b" + std::to_string(i - 1) + ": " + name + "\n";
    }
    const auto& made = Made::get();
    std::ofstream(made.folder.path() / "many.yaml")
        << "model: many\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
        << blocks << "connections:\n"
        << wires;
    for (auto _ : state) made.execute(BF_COMMAND " export-fmu many.yaml -o many.fmu >log 2>&1");
}
void export_many(benchmark::State& state) { export_blocks(state, 1000); }
void export_few(benchmark::State& state) { export_blocks(state, 3); }

} // namespace

BENCHMARK(generated)->Name("fmu.step/generated");
BENCHMARK(step)->Name("fmu.step");
BENCHMARK(block)->Name("fmu.block");
BENCHMARK(save)->Name("fmu.save");
BENCHMARK(restore)->Name("fmu.restore");
BENCHMARK(copy)->Name("fmu.save/memcpy");
BENCHMARK(balance_by_model)->Name("fmu.icub/model")->Unit(benchmark::kMillisecond);
BENCHMARK(balance_by_fmu)->Name("fmu.icub")->Unit(benchmark::kMillisecond);
BENCHMARK(export_many)
    ->Name("fmu.export_1000_blocks")
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(2)
    ->Unit(benchmark::kSecond);
BENCHMARK(export_few)
    ->Name("fmu.export_1000_blocks/three_blocks")
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(2)
    ->Unit(benchmark::kSecond);

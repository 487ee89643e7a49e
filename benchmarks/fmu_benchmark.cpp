// A controller as an FMU: a step of it beside the same generated code, and a block with it beside that step.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/fmi/fmi3.h"
#include "bf/fmi/instance.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/run/run_c.h"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <dlfcn.h>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

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
        execute("cd code && c++ -std=c++17 -O3 -fno-tree-slp-vectorize -DNDEBUG -ffp-contract=off "
                "-fno-semantic-interposition "
                "-fPIC -shared -I. -Iinclude controller*.cpp -o libcontroller.so");
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

} // namespace

BENCHMARK(generated)->Name("fmu.step/generated");
BENCHMARK(step)->Name("fmu.step");
BENCHMARK(block)->Name("fmu.block");

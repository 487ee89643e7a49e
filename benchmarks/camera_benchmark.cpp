// A camera's picture of two arms at a table, beside MuJoCo's drawing of the same scene.
#include "../physics/render/src/canvas.hpp"
#include "../physics/render/src/scene.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/core/registry.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/physics/scene.hpp"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace {

const std::string world = BF_SOURCE_DIRECTORY "/examples/two_robots/world.xml";
constexpr int width = 320, height = 240;
/// Mesa then draws in the thread whose time is measured, not in others that share its processor.
const int failed_to_set = setenv("LP_NUM_THREADS", "0", 0);

/// From (2, 0, 0.8) towards -x.
void camera_block(benchmark::State& state) {
    bf::Registry blocks;
    blocks.add(bf::standard_library());
    blocks.add_search_path(BF_PLUGIN_DIRECTORY);
    const auto diagram =
        bf::elaborate(bf::formats::read_yaml_text(
                          "model: m\nplugins: [WholeBodyToolbox, WholeBodyCameras]\nstep: 0.001\nblocks:\n"
                          "  world: {block: WholeBodyToolbox/World, file: \"'" +
                          world +
                          "'\"}\n  camera: {block: WholeBodyCameras/WorldCamera, pose: \"[0 0 -1 2; 1 0 0 0; "
                          "0 -1 0 0.8; 0 0 0 1]\"}\n"),
                      blocks);
    bf::Simulation simulation(diagram);
    simulation.start();
    for (auto _ : state)
        if (!simulation.step()) return state.SkipWithError("the run failed");
}

void bare_mujoco(benchmark::State& state) {
    using namespace bf::physics;
    const Scene scene(SceneOptions::read(world));
    SceneSimulation simulation(std::make_shared<const Scene>(SceneOptions::read(world)));
    Puppet puppet(scene, [](mjSpec* spec) {
        RenderOptions looks;
        looks.width = width;
        looks.height = height;
        looks.samples = 0;
        decorate(spec, looks);
        spec->visual.quality.shadowsize = 1024;
    });
    const auto q = simulation.q();
    puppet.place({q.data(), static_cast<std::size_t>(q.size())});
    Stage stage(puppet.model(), 1000);
    mjvOption option;
    mjv_defaultOption(&option);
    mjvCamera camera;
    mjv_defaultCamera(&camera);
    camera.azimuth = 180;
    camera.elevation = 0;
    camera.distance = 2;
    camera.lookat[2] = 0.8;
    mj_camlight(puppet.model(), puppet.data());
    mjv_updateScene(puppet.model(), puppet.data(), &option, nullptr, &camera, mjCAT_ALL, &stage.scene);
    std::vector<unsigned char> pixels(3 * width * height);
    const Drawing active(stage.canvas);
    mjr_setBuffer(mjFB_OFFSCREEN, &stage.context);
    const mjrRect whole{0, 0, width, height};
    for (auto _ : state) {
        mjr_render(whole, &stage.scene, &stage.context);
        mjr_readPixels(pixels.data(), nullptr, whole, &stage.context);
    }
    benchmark::DoNotOptimize(pixels.data());
}

BENCHMARK(camera_block)->Name("physics.camera_320x240/block")->Unit(benchmark::kMillisecond);
BENCHMARK(bare_mujoco)->Name("physics.camera_320x240/bare_mujoco")->Unit(benchmark::kMillisecond);

} // namespace

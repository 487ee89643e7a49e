// Builds a model, edits it, runs it and draws what it did: build_edit_plot FOLDER.
#include <bf/engine/simulation.hpp>
#include <bf/formats/yaml.hpp>
#include <bf/library/load.hpp>
#include <bf/model/builder.hpp>
#include <bf/model/operation.hpp>
#include <bf/recording/plot.hpp>
#include <bf/recording/reader.hpp>

#include <fstream>
#include <iostream>

namespace {

/// x'' = -k x - d x'
bf::model::Model oscillator() {
    bf::model::Builder m("oscillator");
    m.variable("k", 40, {.minimum = 0, .unit = "N/m"});
    m.variable("d", 1.5);
    const auto force = m.add("force", "Sum", {{"signs", "--"}});
    const auto velocity = m.add("velocity", "Integrator");
    const auto position = m.add("position", "Integrator", {{"initial", 1}});
    const auto spring = m.add("spring", "Gain", {{"K", "k"}});
    const auto damper = m.add("damper", "Gain", {{"K", "d"}});
    m.connect(force, velocity);
    m.connect(velocity, {position, damper});
    m.connect(position, spring);
    m.connect(spring, force["u1"]);
    m.connect(damper, force["u2"]);
    bf::model::Model model = m.build();
    model.step = {"0.01"};
    model.stop = {"4"};
    model.solver = {"rk4"};
    return model;
}

bf::recording::Panel run(const bf::model::Model& model, const std::string& title,
                         const std::filesystem::path& folder) {
    const bf::LoadedModel loaded = bf::load(model, folder / "oscillator.yaml");
    bf::Simulation run(loaded.diagram);
    const std::filesystem::path file = folder / (title + ".mcap");
    bf::Recorder recorder(run, {bf::find(run.signals(), "position")}, file, loaded.source);
    run.add_observer(recorder);
    run.start();
    if (!run.run_until(loaded.diagram.stop)) throw bf::RunError(run.failure());
    recorder.close();
    bf::recording::Panel panel = bf::recording::panel_of(bf::recording::load(file).channel("position"));
    panel.title = title;
    return panel;
}

} // namespace

int main(int, char** arguments) try {
    namespace op = bf::model::operations;
    const std::filesystem::path folder = arguments[1];
    bf::model::Model model = oscillator();
    bf::recording::Figure figure{"An oscillator", {run(model, "damped", folder)}};

    bf::model::History history;
    history.edit(model, op::Rename{"damper", "friction"});
    history.edit(model, op::Set{"friction", "K", "8*d"});
    figure.panels.push_back(run(model, "overdamped", folder));
    bf::recording::save(figure, folder / "oscillator.svg");
    std::ofstream(folder / "oscillator.yaml") << bf::formats::write_yaml(model);
} catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
}

// Loads, records, saves and changes a run: run_a_model MODEL.yaml RECORDING.mcap, for docs/start/motor.yaml.
#include <bf/engine/simulation.hpp>
#include <bf/library/load.hpp>

#include <iostream>

int main(int, char** arguments) try {
    const bf::LoadedModel motor = bf::load(arguments[1], {{"Gain.Kp", "0.15"}});
    bf::Simulation run(motor.diagram);
    bf::Recorder recorder(run, run.recorded(), arguments[2], motor.source);
    run.add_observer(recorder);
    run.start();
    run.run_until(0.5);
    const std::vector<std::byte> here = run.snapshot();
    run.run_until(1.2);
    recorder.close();
    for (const bf::CheckResult& check : run.checks()) std::cout << check.name << " " << check.value << "\n";

    // What if the gain had been another one from here on? Runs of one diagram do not know of one another.
    bf::Simulation other(motor.diagram);
    other.start();
    other.restore(here);
    other.set_parameter("controller.proportional.K", {0.5});
    if (!other.run_until(1.2)) throw bf::RunError(other.failure());
    for (const bf::Run* which : {static_cast<bf::Run*>(&run), static_cast<bf::Run*>(&other)}) {
        const auto signals = which->signals();
        const bf::Quantity& speed = bf::find(signals, "motor.omega");
        std::cout << speed.path << " " << speed[0] << " at " << which->time() << " s\n";
    }
} catch (const std::exception& error) {
    std::cerr << error.what() << "\n"; // located, with the remedy
    return 1;
}

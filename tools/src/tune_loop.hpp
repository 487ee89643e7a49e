// Tuning of any loop of a model, by requirements.
#pragma once

#include "linearize.hpp"

#include <optional>
#include <string>
#include <vector>

namespace bf::tools {

/// What `bf tune` is asked for; with `loop` a loop of the model is tuned. What robots' joints are asked for,
/// too, counts for them as well: model, overshoot, step, files.
struct LoopTuning : LinearOptions {
    std::vector<std::string> by;
    double crossover = 0, bandwidth = 0, gain_margin = 0;
    std::optional<double> phase_margin, overshoot, step;
    std::string output, picture;
    bool edits_model = false;

    void add_to(CLI::App& app, const char* what_model);
    /// Throws RunError, CommandError, model::Errors.
    void execute() const;
};

inline constexpr const char* loop_example =
    "  bf tune docs/start/motor.yaml --loop controller.voltage --by Gain.Kp --by Gain.Ki --crossover 30 "
    "--phase-margin 65 --picture tuned.png -o gains.yaml";

} // namespace bf::tools

// bf run --realtime: a run stepped by the clock.
#pragma once

#include "bf/library/editing.hpp"
#include "bf/run/recorder.hpp"
#include "run.hpp"

#include <CLI/CLI.hpp>
#include <limits>
#include <optional>

namespace bf::tools {

struct RealtimeOptions {
    bool is_asked = false, is_strict = false, is_controlled = false, is_editable = false, waits = false;
    double factor = 1, watchdog = 1;
    double duration = std::numeric_limits<double>::infinity(); ///< s
    int cpu = -1, priority = 50;
    std::string overrun = "skip";
    std::optional<std::string> serve; ///< where
    std::string token;                ///< file

    void add_to(CLI::App& app);
};

/// As `run`, in real time. All signals are served to viewers, who may edit the model where there is
/// `editing`, which lives longer than `recorder` is written. `before_step` may be empty. `go_on`, given what
/// happened so far as a text, is asked about fifty times a second. `on_stall` is told, from another thread,
/// of a run that ends because a step hangs.
RunResult run_realtime(Run& run, const RealtimeOptions& options, SimulationEditing* editing,
                       Recorder* recorder, std::function<void()> before_step,
                       const std::function<bool(const std::string& progress)>& go_on,
                       const std::function<void(const RunResult&)>& on_stall);

} // namespace bf::tools

// A run that people look at: play, pause, step, back to any instant and on again.
#pragma once

#include "bf/library/load.hpp"
#include "bf/service/protocol.hpp"
#include "bf/service/scenery.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::service {

/// Simulates a model in a thread of its own. Checkpoints that it takes on the way lead back to any instant;
/// from there the same run is computed anew, bit for bit, unless a parameter is changed there.
class Playback {
  public:
    /// Both are called in the thread of the run.
    struct Listener {
        std::function<void(RunState)> state; ///< whenever it changes, and a few times a second while it runs
        std::function<void(std::string)> samples; ///< a binary frame of the protocol
    };

    /// The model must have no mistakes. It starts paused before the first step. Throws RunError when it does
    /// not start.
    Playback(std::shared_ptr<const LoadedModel> model, Listener listener);
    ~Playback(); ///< stops the run

    void command(const RunCommand& command);
    /// Checks the change before it is left to the run. Throws RunError, std::runtime_error.
    void tune(const Tune& tune);
    /// The indices of signals of which samples are wanted.
    void watch(std::vector<int> signals);
    /// From now on frames tell where things are in these, too; none: no longer.
    void show(std::shared_ptr<Sceneries> sceneries);

    RunState state() const;
    const std::vector<SignalInfo>& signals() const;

  private:
    class Loop;
    std::unique_ptr<Loop> loop_;
};

} // namespace bf::service

// A run that people look at: play, pause, step, back to any instant and on again.
#pragma once

#include "bf/library/load.hpp"
#include "bf/service/moves.hpp"
#include "bf/service/protocol.hpp"
#include "bf/service/scenery.hpp"

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace bf::service {

/// Simulates a model in a thread of its own. Checkpoints that it takes on the way lead back to any instant;
/// from there the same run is computed anew, bit for bit. A parameter that is changed there, or an edited
/// model that goes on from there, makes a branch; earlier branches stay, up to 16 of them and 256 MiB of
/// checkpoints, which thin out, in all.
class Playback {
  public:
    /// Both are called in the thread of the run.
    struct Listener {
        /// Whenever it changes, and a few times a second while it runs. `revision`: of the document whose
        /// model runs.
        std::function<void(RunState, std::int64_t revision)> state;
        std::function<void(std::string)> samples; ///< a binary frame of the protocol
    };

    /// The model must have no mistakes. It starts paused before the first step. Throws RunError when it does
    /// not start.
    Playback(std::shared_ptr<const LoadedModel> model, std::int64_t revision, Listener listener);
    ~Playback(); ///< stops the run

    /// Throws RunError for an event or a branch that does not exist.
    void command(const RunCommand& command);
    /// Throws RunError, std::runtime_error and changes nothing.
    void tune(const Tune& tune);
    /// The edited model, which must have no mistakes, goes on from here between two steps, at once where no
    /// state is lost; else RunState tells what would be, and it waits for Action::adopt; a run that
    /// begins anew is one of it. `cause` names the edit; `moves` tell which blocks are the same ones.
    void edit(std::shared_ptr<const LoadedModel> model, std::int64_t revision, std::string cause,
              Moves moves = {});
    /// The indices of signals of which samples are wanted, all from the beginning, on the current branch and
    /// these others; of those in `again` they come once more. Where there are more than anybody can see,
    /// those with the extremes come.
    void watch(std::vector<int> signals, std::vector<int> branches = {}, std::set<int> again = {});
    /// What is watched, as it was when a time began, and its samples from there on until another time; all of
    /// them, as far as they can be seen.
    void refine(double from, double to);
    /// From now on frames tell where things are in these, too; none: no longer.
    void show(std::shared_ptr<Sceneries> sceneries);

    /// Where the time of the run went since this was asked for first, by block; not wanted: nothing is timed.
    Times times(bool is_wanted);

    RunState state() const;
    std::int64_t revision() const;
    std::shared_ptr<const LoadedModel> model() const;
    std::vector<SignalInfo> signals() const; ///< of all branches

  private:
    class Loop;
    std::unique_ptr<Loop> loop_;
};

} // namespace bf::service

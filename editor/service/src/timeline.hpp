#pragma once

#include "bf/engine/handover.hpp"
#include "bf/library/load.hpp"
#include "bf/service/moves.hpp"
#include "bf/service/protocol.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace bf::service {

/// A model with a run of it, which branches of that model share.
struct Played {
    Played(std::shared_ptr<const LoadedModel> m, std::int64_t r)
        : model(std::move(m)), revision(r), run(model->diagram), signals(run.signals()) {}

    const std::shared_ptr<const LoadedModel> model;
    std::int64_t revision; ///< the newest one of the document of which it is the model
    Simulation run;
    const std::vector<Quantity> signals;
    std::vector<int> places = {}; ///< in `signals`, by the index that pages know; -1: not there
};

/// What a document has become.
struct Edited {
    std::shared_ptr<const LoadedModel> model;
    std::int64_t revision = 0;
    std::string cause = {}; ///< names the edit
    Moves moves = {};
};

/// What was simulated of a model that is changed and edited meanwhile: branches, each of which leaves an
/// earlier one where something was changed, and checkpoints that lead back to any instant of them. From
/// there everything is computed again, bit for bit. One thread.
class Timeline {
  public:
    /// Something that a person set in a run, before that step.
    struct Change {
        std::int64_t step;
        std::vector<ParameterValue> asked, values; ///< by name; the parameters that followed
    };
    struct Checkpoint {
        double time;
        std::size_t changes; ///< of the branch, which are in it
        std::vector<std::byte> data;
    };
    struct Branch {
        BranchInfo info;
        std::shared_ptr<Played> played;
        std::vector<Change> changes = {};
        std::vector<Checkpoint> checkpoints =
            {};                 ///< in the order of time; the first is that of its beginning
        double interval = 0.05; ///< between two of them [s]

        const Checkpoint& checkpoint_until(double time) const; ///< the last one, or the first
    };
    /// A place in the timeline.
    struct Cursor {
        int branch = 0;
        std::size_t changes = 0;          ///< of the branch, which were made
        std::vector<std::byte> data = {}; ///< of its run; empty: the run is there
    };

    /// Called with each run before it starts.
    using Begin = std::function<void(Played& played)>;

    Timeline(Begin begin, std::size_t most_bytes, std::size_t most_branches)
        : begin_(std::move(begin)), most_bytes_(most_bytes), most_branches_(most_branches) {}
    ~Timeline();
    Timeline(const Timeline&) = delete;
    Timeline& operator=(const Timeline&) = delete;

    /// Another branch from time 0. Throws RunError when the model does not start.
    void begin(std::shared_ptr<const LoadedModel> model, std::int64_t revision);

    // ---- where it is ----

    Simulation& run() { return at().played->run; }
    double time() const { return at().played->run.time(); }
    /// The branch that is at work: the current one, or the one that it comes from.
    const Branch& at() const { return *branch(cursor_.branch); }
    const Branch& current() const { return *branch(current_); }
    const std::vector<std::unique_ptr<Branch>>& branches() const { return branches_; }
    const Branch* branch(int index) const;
    /// Latest time that was simulated of the current branch [s].
    double reached() const { return current().info.reached; }

    // ---- on and back ----

    /// One step on the current branch. False: it failed.
    bool advance();
    /// To a time of the current branch that was reached, to half a step; `anew`: not on from here, where a
    /// step failed. False: a step failed on the way.
    bool go_to(double time, bool anew = false);
    /// Observers see the outputs of the step to come; afterwards nothing has happened.
    void peek();
    void choose(int branch); ///< and stay at this time, as far as it was reached. Throws RunError.

    // ---- what was set

    /// Since the model at work began, up to this time.
    std::vector<const Change*> changes_so_far() const;
    /// What variables and parameters are here otherwise than that model gives them, which is another state of
    /// the same document.
    std::vector<ParameterValue> unlike(const Diagram& given) const;

    // ---- what makes branches ----

    /// Sets variables and parameters here. Where something was simulated from here on, another branch begins.
    /// Throws RunError, TuningError and changes nothing.
    void change(const std::vector<ParameterValue>& asked);
    /// What would be lost if this model went on from here; `refusal`: why it cannot.
    RunEdit compare(const Edited& edited) const;
    /// Another branch, on which this model goes on from here, with what was changed in this run and is not
    /// given by the model now. Throws RunError.
    void edit(const Edited& edited);

    // ---- beside it: to compute something again ----

    Cursor leave() const; ///< this place
    void enter(const Cursor& cursor);
    /// The last checkpoint of a branch until that time, or its first.
    Cursor before(int branch, double time) const;
    bool step(Cursor& cursor); ///< which was entered. False: it failed

  private:
    Branch& here() { return const_cast<Branch&>(at()); }
    double run_period() const { return at().played->run.period(); }
    const Branch& owner(double time) const;
    void settle();
    void restore(const Branch& branch, const Checkpoint& checkpoint);
    bool apply_changes(Cursor& cursor);
    std::shared_ptr<Played> started(std::shared_ptr<const LoadedModel> model, std::int64_t revision);
    Branch& add(int parent, double from, std::string cause, std::shared_ptr<Played> played);
    bool is_left_by(int branch) const; ///< some other one
    /// Is the branch at work one of an edit, of which nothing was simulated yet?
    bool is_fresh_edit() const;
    bool forget_oldest();
    void make_room();
    void checkpoint();
    std::vector<ParameterValue> asked_so_far() const;

    const Begin begin_;
    const std::size_t most_bytes_, most_branches_;
    std::vector<std::unique_ptr<Branch>> branches_;
    int next_index_ = 0, current_ = 0;
    Cursor cursor_; ///< without data
};

} // namespace bf::service

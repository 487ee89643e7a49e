// Steps a run against the clock.
#pragma once

#include "bf/realtime/control.hpp"
#include "bf/realtime/pacer.hpp"
#include "bf/run/run.hpp"

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf::realtime {

/// Brings changes of parameters from one other thread to the loop, one at a time. Neither waits.
class ParameterMailbox {
  public:
    /// Gives the loop a change; false while the last one is still on its way.
    bool post(ParameterChange change);
    struct Result {
        Status status;
        std::int64_t step;   ///< before which it acts; -1: before the run starts
        std::string refusal; ///< why it does not
    };
    /// What became of the last one, once.
    std::optional<Result> take_result();
    /// The loop, before that step.
    void apply(Run& run, std::int64_t step) noexcept;

  private:
    enum class State { empty, posted, applied };
    std::atomic<State> state_{State::empty};
    ParameterChange change_;
    Result result_{};
};

/// Another run that is to go on where the one of a loop is, made and started beside it.
class Successor {
  public:
    virtual ~Successor() = default;
    virtual Run& run() = 0;
    /// In the loop's thread, between two steps of the run before, which is not stepped any more. Allocates
    /// nothing.
    virtual void take_over() noexcept = 0;
};

/// Brings successors from one other thread to the loop, one at a time. Neither waits.
class Succession {
  public:
    virtual ~Succession() = default;
    /// `observers` see the steps of the successor, as those of the loop see those of the run before. Both
    /// live as long as it runs.
    virtual void post(Successor& successor, const std::vector<Run::Observer*>& observers) = 0;
    /// The step before which the last one took over, once; then nothing refers to the run before any more.
    virtual std::optional<std::int64_t> taken() = 0;
    /// Forgets one that was not taken when the loop had ended.
    virtual void withdraw() = 0;
};

/// What others have of a loop, from any thread; the loop waits for none of them.
struct LoopAccess {
    ParameterMailbox& parameters;
    Control& control;
    const Statistics& statistics;     ///< but for `first_misses`
    Succession* succession = nullptr; ///< none: another run cannot go on in its place
};

struct RunnerOptions {
    double factor = 1; ///< seconds of the model per second
    Overrun overrun = Overrun::skip;
    ThreadOptions thread;
    bool is_strict = false;                                    ///< what the machine refuses is an error
    double duration = std::numeric_limits<double>::infinity(); ///< s on the clock
    bool waits = false;       ///< until Control::start, with nothing started; parameters may change
    Nanoseconds watchdog = 0; ///< without an end of a step; 0: none (see stall_limit)
    /// In a thread of its own: the step hangs, in a block of that path (empty: before the first one), or an
    /// emergency stop does not come to its end.
    std::function<void(std::int64_t step, const std::string& block)> on_stall = nullptr;
    std::function<void()> before_step = nullptr; ///< in the loop's thread, e.g. to write root inputs
};

/// A thread of its own in which a run starts, is stepped at its releases, and stops, when its time has come
/// or its Control says so. The caller's thread only watches, so that whatever it does (print, draw, wait for
/// a disk) cannot disturb the period.
class Runner {
  public:
    /// The run must outlive the runner, as successors must, and is not to be stepped by others, nor
    /// afterwards.
    Runner(Run& run, RunnerOptions options);
    ~Runner();
    Runner(const Runner&) = delete;
    Runner& operator=(const Runner&) = delete;

    /// Sees each step, except those that are degraded.
    void add_observer(Run::Observer& observer);
    LoopAccess access();
    /// The one that is stepped: after the end, or in the loop's thread.
    Run& stepped();

    struct Progress {
        std::int64_t steps, missed;
    };
    /// Runs up to `stop` s of the model. `monitor` is called in this thread about fifty times a second; false
    /// ends the run after the step under way. Throws RunError when the model is not for real time, it
    /// does not start, or when `is_strict` and the machine refuses something.
    void run(double stop, const std::function<bool(const Progress&)>& monitor);

    const Statistics& statistics() const { return pacer_.statistics(); }
    /// What the machine refused, with remedies; known once a step was made.
    const std::vector<std::string>& refused() const { return refused_; }
    /// Why the run ended early, e.g. at a missed deadline; empty when it did not.
    std::string failure() const;
    /// From the first release to the end of the last step, s.
    double wall() const { return wall_; }

  private:
    class Gate;
    class Running;
    struct Stepped;
    class Relay;
    void loop(std::int64_t steps);

    const RunnerOptions options_;
    Pacer pacer_;
    ParameterMailbox parameters_;
    Control control_;
    std::unique_ptr<Relay> relay_;
    std::vector<std::string> refused_;
    double wall_ = 0;
    std::atomic<bool> is_over_{false};
    std::atomic<std::int64_t> steps_{0}, missed_{0};
};

} // namespace bf::realtime

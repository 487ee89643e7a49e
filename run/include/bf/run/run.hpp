// A running model, whoever computes it: what recorders, viewers, replays, profilers and reports work on.
#pragma once

#include "bf/core/context.hpp"
#include "bf/recording/channel.hpp"
#include "bf/run/parameter_change.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bf {

/// A run that cannot go on; the text names the block and the remedy.
struct RunError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The final value of a check block of the model, e.g. {"stood", true} or {"com_rms_error_m", 4e-4}.
struct CheckResult {
    std::string name;
    double value = 0;
    bool is_boolean = false;
};

/// A signal or a parameter of a run. Two names of the same signal have the same data.
struct Quantity {
    std::string path; ///< "controller.tau"
    Type type;
    recording::ChannelInfo info;
    int rate;                          ///< number of the rate at which it is computed
    std::byte* data;                   ///< its elements, column by column, for as long as the run lives
    std::vector<std::byte> given = {}; ///< to a parameter by its model

    double operator[](int element) const { return read_value(data, type, element); }
    std::vector<double> values() const;
};

/// The first of that path, or the only one of the block of that path; throws RunError with the nearest name
/// when there is none.
const Quantity& find(const std::vector<Quantity>& quantities, const std::string& path);

/// What a model gives an argument of a block.
struct GivenArgument {
    std::string block, name, value; ///< the latter as text
    bool operator==(const GivenArgument&) const = default;
};

/// A sample time. Rate 0 is the constant rate, which is hit in no step.
struct RunRate {
    double period = 0; ///< s; 0: continuous
    bool is_continuous = false;
};

/// What a model draws: a title and paths of signals.
struct RunPanel {
    std::string title;
    std::vector<std::string> signals;
};

/// Steps a model. Implemented by bf::Simulation, which interprets a diagram, and by bf::LoadedRun, which is
/// generated code in a shared library. All tables are made when they are asked for; their `data` stay.
///
/// One thread starts, steps, restores and stops a run. `prepare` may be called in one other thread
/// meanwhile, and that thread may read the `data` of parameters while no change of its own is under way.
/// Observers are called in the thread that steps. Several runs do not know of one another.
///
/// Errors before the first step, and of what is asked by name, are RunError; a step returns its Status.
class Run {
  public:
    Run() = default;
    virtual ~Run() = default;
    Run(const Run&) = delete;
    Run& operator=(const Run&) = delete;

    virtual std::string name() const = 0; ///< of the model
    virtual double period() const = 0;    ///< of a base step [s]
    virtual double stop_time() const = 0; ///< of the model [s]; infinite when it names none
    virtual std::vector<RunRate> rates() const = 0;
    virtual std::vector<RunPanel> plots() const = 0;

    virtual std::vector<Quantity> signals() const = 0;  ///< that may be recorded, under all their names
    virtual std::vector<Quantity> recorded() const = 0; ///< that the model asks for, or all if it names none
    virtual std::vector<Quantity> inputs() const = 0;   ///< of the root: write them between two steps
    /// What reaches the model from outside: inputs of the root and what devices give.
    virtual std::vector<Quantity> outside() const = 0;
    virtual std::vector<Quantity> parameters() const = 0;
    /// Of all blocks; none where the fingerprint is of them, too, as that of generated code.
    virtual std::vector<GivenArgument> arguments() const { return {}; }

    /// Throws RunError when a device cannot be opened or an initial state fails; what was opened is closed.
    virtual void start() = 0;
    /// One base step. When it fails the status says why; failure() adds the block. Nothing is allocated.
    virtual Status step() noexcept = 0;
    virtual void stop() noexcept = 0;

    virtual double time() const = 0; ///< of the step, or of the event while observers see one [s]
    virtual std::int64_t steps() const = 0;
    virtual std::string failure() const = 0; ///< "block: message" of a failed step, or empty
    virtual std::vector<CheckResult> checks() const = 0;
    /// Was the rate hit in this step? Of an event observers see the continuous rate, and what it triggers,
    /// alone.
    virtual bool is_hit(int rate) const = 0;
    /// Do observers see an event, not the whole step?
    virtual bool shows_event() const = 0;
    /// Why the time of a step has no bound, with the remedy; empty when nothing stands against a clock.
    virtual std::string not_for_real_time() const = 0;

    /// Checks new values. Throws RunError for an unknown name, a wrong number of elements, or a value that
    /// the parameter does not take.
    virtual ParameterChange prepare(const std::vector<ParameterValue>& values) = 0;
    /// Applies them between two steps, all or none, and computes again what depends on them alone. When that
    /// fails, all has its old value. Allocates nothing.
    virtual Status apply(ParameterChange& change) noexcept = 0;
    /// Both at once, for one parameter. Throws RunError.
    void set_parameter(const std::string& path, const std::vector<double>& values);

    /// Variables of the model, by the names that `follow` takes, with their present values.
    virtual std::vector<ParameterValue> variables() const = 0;
    /// The parameters that new values of variables and parameters lead to, for `prepare`. Throws
    /// std::runtime_error for a variable that is fixed, with the reason.
    virtual std::vector<ParameterValue> follow(const std::vector<ParameterValue>& asked) const = 0;
    /// From now on these hold: to be said when they were applied.
    virtual void accept(const std::vector<ParameterValue>& asked) = 0;

    /// Called after the outputs of each step, before states change; must not allocate if the run must not.
    class Observer {
      public:
        virtual ~Observer() = default;
        virtual void observe(const Run& run) noexcept = 0;
    };
    void add_observer(Observer& observer) { observers_.push_back(&observer); }
    void remove_observer(Observer& observer) { std::erase(observers_, &observer); }

    /// Everything a run needs to go on bit for bit; throws RunError naming a block that refuses.
    virtual std::vector<std::byte> snapshot() const = 0;
    /// Goes on from there, in this or another started run of the same model, also after a failure.
    virtual void restore(const std::vector<std::byte>& snapshot) = 0;
    /// A number that tells apart models whose snapshots do not fit; values of parameters do not count.
    virtual std::uint64_t fingerprint() const = 0;

    /// Every task of a step with the block it belongs to, in the order of a step; none where they are not
    /// apart. A profiler may put another task around it.
    using TaskVisitor = std::function<void(Task& task, Phase phase, const std::string& block, int rate)>;
    virtual void visit_tasks(const TaskVisitor& visit) = 0;

    /// How many steps stand before that time [s].
    std::int64_t steps_before(double time) const;
    /// Steps on to that time [s]; false when a step fails.
    bool run_until(double time);

  protected:
    void show() noexcept {
        for (Observer* observer : observers_) observer->observe(*this);
    }

  private:
    std::vector<Observer*> observers_;
};

/// How a recording calls an element type.
recording::ElementType element_type(Type type);

} // namespace bf

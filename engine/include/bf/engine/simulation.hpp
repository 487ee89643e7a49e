// Simulation of a diagram with fixed base steps.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/engine/parameter_change.hpp"
#include "bf/engine/solver.hpp"
#include "bf/program/program.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
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

/// Runs a diagram. One base step k, at time t = k step, x⁻ the states before it and x⁺ after it:
///
///     start:  outputs := 0 (those of a rate with an offset keep it until their first hit)
///             states := initial values, blocks reset;  blocks start (devices open);
///             constant outputs computed once;  outputs of conditional subsystems := initial outputs
///     step:   1. which rates are hit: (k - offset) divisible by ticks
///             2. outputs, in sorted order, of all blocks whose rate is hit and whose conditions are true:
///                y := output(t, x⁻, u).  A condition is tested before the blocks under it; on being enabled
///                it resets the states under it where the model says so, on being disabled it resets outputs
///                and disables the conditions inside it; a trigger makes it true in this step only.  What is
///                not computed keeps its value.  A loop runs as a whole at its place in the order, its
///                outputs and then its updates in each iteration; an algebraic loop until its equations hold
///             3. observers see t, outputs and x⁻ (this is what a recording holds)
///             4. updates of the same blocks: x⁺ := update(t, x⁻, u, y);  x⁻ := x⁺ for all of them at once, a
///                NaN being a failure
///             5. continuous states go from t to t + step by the diagram's solver, which evaluates
///                derivatives and the outputs they depend on inside the step while all other outputs keep
///                their value;  afterwards outputs are again what observers saw last, see step();
///                k := k + 1
///     event:  a zero-crossing function of a block of the continuous rate changed its sign: at the located
///     instant
///             (adaptive solvers), or in the first step after it (fixed steps, and jumps at a sample hit:
///             after 2.)
///                observers see t, outputs and x⁻;  x⁺ := event(t, x⁻) of all blocks that crossed, in
///                document order, none seeing another's x⁺ through signals;  outputs of the continuous rate
///                are computed again; this repeats while that makes other functions cross;  inside a step
///                observers see t, outputs and x⁺, and what a trigger made run is updated at once
///     stop:   blocks stop, last started first (actuators are put back)
///
/// A step that fails ends the run: nothing after the failed block runs, observers keep what they saw.
/// Inside `step` nothing is allocated and nothing locked.
class Simulation {
  public:
    /// Allocates everything a run needs. The diagram must outlive the simulation.
    explicit Simulation(const Diagram& diagram);
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// Throws RunError when a device cannot be opened or an initial state fails; what was opened is closed.
    void start();
    /// One base step. On failure the status says why; failure() adds the block. Afterwards outputs are what
    /// observers saw last, but in algebraic loops and conditional subsystems of the continuous rate what the
    /// solver evaluated last.
    Status step() noexcept;
    /// From now on all outputs of the continuous rate are what the solver evaluated last: each step saves a
    /// copy of them, where outputs are looked at by observers alone.
    void leave_outputs_of_solver() { seen_.clear(); }
    void stop() noexcept;

    /// Steps until an event: `event` is asked in every step when its outputs are there (3. above), and the
    /// step in which it says yes is completed. False when `limit` s come first or a step fails. Must not
    /// throw.
    bool run_until(const std::function<bool(const Simulation&)>& event,
                   double limit = std::numeric_limits<double>::infinity());
    /// Steps on to that time [s]; false when a step fails.
    bool run_until(double time);
    /// How many steps stand before that time [s].
    std::int64_t steps_before(double time) const;

    /// Of the step, or of the event while observers see one [s].
    double time() const { return is_at_event_ ? event_time_ : static_cast<double>(steps_) * diagram_.step; }
    std::int64_t steps() const { return steps_; }
    /// "controller.qp: message" of the step that failed; empty when none did.
    std::string failure() const;
    /// Final values of the states that blocks report, by the name of their block.
    std::vector<CheckResult> checks() const;

    /// Every parameter, "block.parameter", in document order.
    std::vector<SignalName> parameters() const;
    /// Checks new values. Throws RunError for an unknown name, a wrong number of elements, NaN, or a number
    /// that the parameter's type cannot hold. Any thread may prepare while another one steps.
    ParameterChange prepare(const std::vector<ParameterValue>& values);
    /// Applies them between two steps, all or none, and computes again what depends on them alone. When that
    /// fails, all has its old value. Allocates nothing.
    Status apply(ParameterChange& change) noexcept;
    /// Both at once, for one parameter. Throws RunError.
    void set_parameter(const std::string& path, const std::vector<double>& values);

    /// Called after the outputs of each step (3. above); must not allocate if the run must not.
    class Observer {
      public:
        virtual ~Observer() = default;
        virtual void observe(const Simulation& simulation) noexcept = 0;
    };
    void add_observer(Observer& observer) { observers_.push_back(&observer); }
    /// Was the rate hit in this step? Of an event observers see the continuous rate, and what it triggers,
    /// alone.
    bool is_hit(int rate) const;
    /// Do observers see an event, not the whole step?
    bool shows_event() const { return shows_event_; }

    /// Everything a run needs to go on bit for bit.
    std::vector<std::byte> snapshot() const; ///< throws RunError naming a block that refuses
    /// Goes on from there, in this or another started simulation of the same diagram, also after a failure.
    void restore(const std::vector<std::byte>& snapshot);

    /// Every bound task with its phase, node and rate, in the order of a step. A profiler may put another
    /// task around it.
    using TaskVisitor = std::function<void(Task& task, Phase phase, int node, int rate)>;
    void visit_tasks(const TaskVisitor& visit);

    const Diagram& diagram() const { return diagram_; }
    Context& context() { return context_; }
    const Context& context() const { return context_; }

  private:
    class Machine;
    /// The zero-crossing functions in one slot of a node, or its output that controls a subsystem.
    struct GuardBinding {
        int node;
        int active; ///< flag of the program, or -1
        void* data; ///< of the guard, or the signal
        Type type;
        std::size_t first, count; ///< place among all guards
        bool is_control, is_answered;
        bool may_slide; ///< it tells of a jump in the derivative of the block's own states
        bool is_sliding = false;
        /// A guard of whole numbers counts what it tells of, and crosses wherever it changes.
        bool counts() const { return !is_control && type != Type::float64; }
        struct Recent {
            double last = -1;       ///< when it crossed [s]
            std::int64_t close = 0; ///< how often in a row it crossed at once again
        } recent = {};
    };
    /// A signal that continuous blocks read, or a discrete state of theirs, which the solver does not change.
    struct Held {
        const std::byte* now;
        std::vector<std::byte> last;
        bool is_signal; ///< it jumps; states are memories, and blocks that make them jump have guards
    };
    enum class Change : std::uint8_t { none, memory, jump };
    /// Outputs of the continuous rate, and what observers saw of them last: the solver writes over them.
    struct Seen {
        std::byte* now;
        std::vector<std::byte> last;
    };
    ContinuousSystem continuous_system();
    void bind_guards();
    void find_held(const std::vector<char>& is_needed);
    void find_seen();
    Change held_change() noexcept;
    void set_continuous_time(double t) noexcept;
    bool evaluate_inside(double t) noexcept;
    bool evaluate_guards() noexcept;
    int lost_state(double t, bool looks_ahead) noexcept;
    bool integrate(Status lost) noexcept;
    bool advance_to(double end, Status lost) noexcept;
    bool is_watched(const GuardBinding& guard) const noexcept;
    bool crossed(int node) const noexcept;
    bool crossed(const GuardBinding& guard) const noexcept;
    bool has_crossed(bool is_answered) const noexcept;
    void show_directions(int node) noexcept;
    bool accumulates(double t, int events) noexcept;
    void count_edges() noexcept;
    bool find_crossings() noexcept;
    bool take_crossings() noexcept;
    void observe() noexcept;
    void show_what_was_seen() noexcept;
    void observe_event() noexcept;
    bool fail(Status status, int node) noexcept;
    int owner(Role role, const double* element) noexcept; ///< the node that has it among its (next) states
    void clear_outputs();
    /// All that is kept from step to step, but the context and the solver.
    std::vector<std::span<std::byte>> state();

    const Diagram& diagram_;
    Context context_;
    const program::Program program_;
    std::unique_ptr<Machine> machine_;
    std::vector<GuardBinding> guard_bindings_;
    std::vector<double> guard_values_, guard_before_; ///< of all guards; NaN where they do not run
    std::vector<double> edges_; ///< of guards that count, when they were compared before
    std::vector<std::int8_t> crossed_;
    std::vector<Held> held_;
    std::vector<Seen> seen_;         ///< none without continuous states
    std::unique_ptr<Solver> solver_; ///< null without continuous states
    bool must_restart_ = true;       ///< the continuous state has changed by a jump
    bool is_at_event_ = false;
    bool shows_event_ = false;
    double event_time_ = 0;
    std::vector<Observer*> observers_;
    std::int64_t steps_ = 0;
    Status status_;
    int failed_node_ = -1;
    int started_ = 0; ///< nodes whose start succeeded, in order
};

} // namespace bf

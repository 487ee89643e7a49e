// Simulation of a diagram with fixed base steps.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/elaborate/tuning.hpp"
#include "bf/engine/solver.hpp"
#include "bf/program/program.hpp"
#include "bf/run/run.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace bf {

/// A number that tells diagrams apart: blocks, sizes, types, rates, wiring, order and the constants of rules
/// count, values of parameters do not.
std::uint64_t fingerprint(const Diagram& diagram);

/// What a recording keeps of a signal or parameter, all but its other names.
recording::ChannelInfo channel_info(const Diagram& diagram, const Node::End& end);

/// The path that the block or subsystem of a path had in another diagram; none: it was not there. What is in
/// a block, such as a state of a chart, has a path under that of the block.
using Origin = std::function<std::optional<std::string>(const std::string& path)>;

/// As Run::not_for_real_time() of a run of it.
std::string not_for_real_time(const Diagram& diagram);

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
class Simulation final : public Run {
  public:
    /// Allocates everything a run needs. The diagram must outlive the simulation.
    explicit Simulation(const Diagram& diagram);
    /// One that is to take the place of another one, of the same step, which goes on stepping in its thread
    /// meanwhile: it is made and started beside it. Blocks that are the same in both (their paths, see
    /// Origin, types and arguments) are neither started anew nor open anything again: when the place is taken
    /// they go on with the live objects of the other one, whose diagram must live as long. No parameter of
    /// the other one may change before. Throws RunError with all blocks that keep something open and are not
    /// the same.
    Simulation(const Diagram& diagram, Simulation& before, const Origin& origin = {});
    ~Simulation() override;

    std::string name() const override { return diagram_.name; }
    double period() const override { return diagram_.step; }
    double stop_time() const override { return diagram_.stop; }
    std::vector<RunRate> rates() const override;
    std::vector<RunPanel> plots() const override;

    std::vector<Quantity> signals() const override { return quantities(diagram_.signals()); }
    std::vector<Quantity> recorded() const override { return quantities(diagram_.recorded()); }
    std::vector<Quantity> inputs() const override { return quantities(diagram_.inputs); }
    std::vector<Quantity> outside() const override;
    /// "block.parameter", in document order.
    std::vector<Quantity> parameters() const override;
    std::vector<GivenArgument> arguments() const override;
    /// Signals of the diagram as the run computes them.
    std::vector<Quantity> quantities(const std::vector<SignalName>& names) const;

    void start() override;
    /// Afterwards outputs are what observers saw last, but in algebraic loops and conditional subsystems of
    /// the continuous rate what the solver evaluated last.
    Status step() noexcept override;
    /// From now on all outputs of the continuous rate are what the solver evaluated last: each step saves a
    /// copy of them, where outputs are looked at by observers alone.
    void leave_outputs_of_solver() { seen_.clear(); }
    void stop() noexcept override;

    using Run::run_until;
    /// Steps until an event: `event` is asked in every step when its outputs are there (3. above), and the
    /// step in which it says yes is completed. False when `limit` s come first or a step fails. Must not
    /// throw.
    bool run_until(const std::function<bool(const Simulation&)>& event,
                   double limit = std::numeric_limits<double>::infinity());

    double time() const override {
        return is_at_event_ ? event_time_ : static_cast<double>(steps_) * diagram_.step;
    }
    std::int64_t steps() const override { return steps_; }
    std::string failure() const override;
    std::vector<CheckResult> checks() const override;

    /// Values may not be NaN, nor numbers that the parameter's type cannot hold.
    ParameterChange prepare(const std::vector<ParameterValue>& values) override;
    Status apply(ParameterChange& change) noexcept override;
    std::vector<ParameterValue> variables() const override;
    std::vector<ParameterValue> follow(const std::vector<ParameterValue>& asked) const override;
    void accept(const std::vector<ParameterValue>& asked) override;

    bool is_hit(int rate) const override;
    bool shows_event() const override { return shows_event_; }
    std::string not_for_real_time() const override;

    std::vector<std::byte> snapshot() const override;
    void restore(const std::vector<std::byte>& snapshot) override;
    std::uint64_t fingerprint() const override { return bf::fingerprint(diagram_); }
    /// Goes on, started and before its first step, at the time of a run of another diagram, between two of
    /// its steps. Time, states and outputs of the other run that are here, too (see `handover`), keep their
    /// values, subsystems stay enabled, and rates go on with their hits. The period that a block sees in its
    /// first hit is the time since its last one in the other run. Parameters are those of this diagram.
    /// Without `origin` paths are the same. Throws RunError where that time lies within a step of this one.
    void go_on_from(const Simulation& other, const Origin& origin = {});
    /// The same, started, for the simulation whose place this one takes, in the thread that steps that one,
    /// which is not stepped any more. Allocates nothing.
    void take_over() noexcept;
    /// Does the block go on with what it opened when the place is taken?
    bool keeps(int node) const;
    bool takes_a_place() const { return succession_ != nullptr; }

    void visit_tasks(const TaskVisitor& visit) override;

    const Diagram& diagram() const { return diagram_; }
    Context& context() { return context_; }
    const Context& context() const { return context_; }

  private:
    class Machine;
    struct Succession;
    Simulation(const Diagram& diagram, std::unique_ptr<Succession> succession, const Origin& origin);
    void take_over(Succession& succession) noexcept;
    /// Is no parameter below the one that it must be at least? If one is, the change says so.
    bool is_in_order(ParameterChange& change) const noexcept;
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
    bool find_slopes(double t) noexcept;
    int sliding_node(double t) noexcept;
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
    bool start_blocks() noexcept; ///< false: `start_failure_` says why
    /// All that is kept from step to step, but the context and the solver.
    std::vector<std::span<std::byte>> state();
    Quantity quantity(const SignalName& name) const;
    Tuning& tuning() const;

    const Diagram& diagram_;
    std::unique_ptr<Succession> succession_; ///< where this one takes the place of another one
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
    std::int64_t steps_ = 0;
    Status status_;
    int failed_node_ = -1;
    mutable std::unique_ptr<Tuning> tuning_; ///< made when it is asked for
    int started_ = 0;                        ///< nodes whose start succeeded, in order
    std::vector<char> is_elsewhere_;         ///< by node: another simulation starts and stops it
    std::string start_failure_;
};

} // namespace bf

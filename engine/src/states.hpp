// What a running simulation keeps of conditional subsystems and loops.
#pragma once

#include "algebraic.hpp"
#include "bf/engine/simulation.hpp"

#include <vector>

namespace bf {

/// A signal that controls a subsystem, and its values at the last look.
class ControlSignal {
  public:
    ControlSignal(const Diagram& diagram, Context& context, const Node::End& end, model::Edge edge);
    bool is_given() const { return data_ != nullptr; }
    bool is_on() const;  ///< any element above 0
    bool was_on() const; ///< at the last look
    bool has_edge();     ///< any element, since the last look
    void forget();
    std::vector<double>& before() { return before_; }
    const std::vector<double>& before() const { return before_; }

  private:
    const void* data_ = nullptr;
    Type type_ = Type::boolean;
    model::Edge edge_;
    std::vector<double> before_;
};

struct Simulation::ConditionState {
    Simulation* simulation;
    int index;
    ControlSignal enable, trigger, reset;
    bool is_enabled = false;
    bool is_true = false; ///< enabled, and triggered in this step

    /// Looks at the control signals; called at its place in the order.
    Status test();
    void fire(int rate);
    void disable();
};

/// A loop and the means to run it.
struct Simulation::LoopState {
    Simulation* simulation;
    const Loop* loop;
    bool runs_once; ///< per step, not inside one
    std::vector<BoundSegment> outputs, updates;
    std::vector<CommitSegment> commits;
    /// Rates of the triggered subsystems inside: each iteration looks anew, observers see what ran in any.
    std::vector<std::size_t> triggered;
    std::vector<std::uint8_t> has_run;
    std::unique_ptr<AlgebraicSolver> solver; ///< of an algebraic loop

    Status run();
    Status run_iterations();
    bool iterate();
};

} // namespace bf

// The external reset that integrators, delays and controllers share.
#pragma once

#include "bf/kernels/discrete.hpp"
#include "bf/kernels/events.hpp"
#include "bf/kernels/guards.hpp"

#include "shapes.hpp"

namespace bf::blocks {

namespace detail {
/// Argument and port that both forms of the reset declare.
struct ResetPort {
    ResetPort(Block* owner, const char* doc, std::vector<std::string> choices)
        : kind(owner, "reset", {.initial = "none", .doc = doc, .choices = std::move(choices)}),
          is_present(*kind != "none"),
          signal(owner, "reset", {.shape = scalar, .unit = any_unit, .doc = "reset", .present = is_present}) {
    }

    Argument<std::string> kind;
    bool is_present;
    Input<Other> signal;
};
} // namespace detail

/// The reset of continuous states: a guard that crosses zero with the input, answered by rules of the event.
class ContinuousReset {
  public:
    explicit ContinuousReset(Block* owner)
        : port_(owner,
                "edge of the reset input, through 0, that puts the states back to their initial values",
                {"none", "rising", "falling", "either"}) {}
    bool is_present() const { return port_.is_present; }
    void declare_guard(Block* owner, const Guard& guard) const {
        GuardRule(owner, kernels::PositiveSign{}, guard, port_.signal);
    }
    /// In an event in which the states begin anew: state := value.
    template <class State, class Value>
    void declare_event(Block* owner, const Guard& guard, const State& state, const Value& value) const {
        EventRule(owner, kernels::BegunState{}, after(state), edge(), guard, value, after(state));
    }

  private:
    Constants edge() const {
        return Constants({*port_.kind == "either" ? 0.0 : *port_.kind == "falling" ? -1.0 : 1.0});
    }
    detail::ResetPort port_;
};

/// The reset of discrete states, with the memory that edges need. In each phase first `declare_edge` writes
/// whether the states begin anew in this step; by level they also do so in the step after it.
class ResetInput {
  public:
    explicit ResetInput(Block* owner)
        : port_(owner,
                "when the reset input puts the states back to their initial values: on an edge through 0, or "
                "(level) while not 0 and in the step after that",
                {"none", "rising", "falling", "either", "level"}),
          previous_(owner, "previous", {.doc = "reset input of the step before", .present = is_present()}),
          value_(owner, "reset_value", {.present = is_present()}) {}

    bool is_present() const { return port_.is_present; }

    /// edge := the states begin anew; Rule is OutputRule or UpdateRule.
    template <class Rule> void declare_edge(Block* owner, const Workspace<bool>& edge) const {
        Rule(owner, kernels::Copy{}, value_, port_.signal);
        if (*port_.kind == "rising")
            Rule(owner, kernels::RisingEdge{}, edge, previous_, value_);
        else if (*port_.kind == "falling")
            Rule(owner, kernels::FallingEdge{}, edge, previous_, value_);
        else if (*port_.kind == "either")
            Rule(owner, kernels::EitherEdge{}, edge, previous_, value_);
        else
            Rule(owner, kernels::LevelReset{}, edge, previous_, value_);
    }
    void declare_memory(Block* owner) const {
        UpdateRule(owner, kernels::Copy{}, next(previous_), port_.signal);
    }

  private:
    detail::ResetPort port_;
    DiscreteState<double> previous_;
    Workspace<double> value_;
};

} // namespace bf::blocks

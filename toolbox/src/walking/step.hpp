// What the blocks of a walk tell each other: footholds and the step.
#pragma once

#include "bf/core/block.hpp"
#include "bf/walking/dcm.hpp"
#include "checks.hpp"

namespace bf::toolbox {

using walking::Foothold;
using walking::Side;
using walking::Step;

inline constexpr const char* footholds_doc =
    "columns [x y z yaw] of soles: the foot that moves, where it comes from; the foot that stands; where the "
    "first one goes; the steps after it [m, rad]";
inline constexpr const char* step_doc =
    "of the step: time in it, duration on both feet, on one foot, and both in the next one [s], the standing "
    "foot (1 left, 2 right), how many steps are planned, this one included (0: it stands), whether the "
    "weight begins midway (1 or 0)";

inline Dim::Names step_names() {
    return std::vector<std::string>{
        "time",   "double_support", "single_support", "next_double_support", "next_single_support",
        "stance", "ahead",          "from_rest"};
}

/// Blocks that follow a FootstepPlanner.
class StepBlock : public Block {
  public:
    using Block::Block;
    Dim k{this, "k"};
    Dim numbers{this, "step", [] { return step_names(); }};
    Input<Matrix> footholds{this, "footholds", {.shape = {4, k}, .unit = mixed_units, .doc = footholds_doc}};
    Input<Vector> step{this, "step", {.shape = {numbers}, .unit = mixed_units, .doc = step_doc}};

  protected:
    /// Reads both inputs.
    Status read(Now at, Step& now) const {
        if (const Status good = all_finite(at, footholds, step); !good) return good;
        if (!Step::read(at[step], now))
            return Status::failure(
                "{element} is no step: a time, a duration or a count is below zero, a count no whole number, "
                "stance neither 1 nor 2, or from_rest neither 0 nor 1; wire a FootstepPlanner",
                step, -1);
        if (now.ahead + 2 > static_cast<int>(at[footholds].cols()) || at[footholds].cols() < 3)
            return Status::failure("the step plans {} steps, but there are {} footholds; wire those of the "
                                   "same FootstepPlanner",
                                   now.ahead, static_cast<std::int32_t>(at[footholds].cols()));
        return ok;
    }
};

} // namespace bf::toolbox

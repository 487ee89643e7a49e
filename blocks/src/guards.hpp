// Zero-crossing functions of blocks that have a kink or a jump.
#pragma once

#include "bf/kernels/continuous.hpp"

#include "shapes.hpp"

namespace bf::blocks {

/// Crosses zero where a signal passes a level, element by element: u - level. Its block must call `infer` in
/// its own.
class Crossing {
  public:
    template <class U, class Level>
    Crossing(Block* owner, const char* name, const U& u, const Level& level)
        : key(owner, name, {.doc = "zero where the signal passes its level"}) {
        operands_.push_back(u.index());
        if constexpr (requires { level.index(); }) operands_.push_back(level.index());
        GuardRule(owner, kernels::Margin{}, key, u, level);
    }
    void infer(const Block& block, Inference& inference) const {
        broadcast(block, inference, operands_, key.index());
    }
    const GuardOf<Array<double>> key;

  private:
    std::vector<int> operands_;
};

} // namespace bf::blocks

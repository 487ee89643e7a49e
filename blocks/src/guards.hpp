// Zero-crossing functions of blocks that have a kink or a jump.
#pragma once

#include "bf/kernels/guards.hpp"

#include "shapes.hpp"

namespace bf::blocks {

/// Zero-crossing functions = kernel(operands), element by element. Their block must call `infer` in its own.
template <class T> class ElementGuards {
  public:
    template <class Kernel, class... Operands>
    ElementGuards(Block* owner, const std::string& name, const char* doc, Kernel kernel,
                  const Operands&... operands)
        : key(owner, name, {.doc = doc}) {
        const auto add = [&](const auto& operand) {
            if constexpr (requires { operand.begin(); })
                for (const auto& each : operand) operands_.push_back(each.index());
            else if constexpr (requires { operand.index(); })
                operands_.push_back(operand.index());
        };
        (add(operands), ...);
        GuardRule(owner, kernel, key, operands...);
    }
    void infer(const Block& block, Inference& inference) const {
        broadcast(block, inference, operands_, key.index());
    }
    const GuardOf<Array<T>> key;

  private:
    std::vector<int> operands_;
};

/// Change where a signal jumps or has a corner.
using Edges = ElementGuards<std::int32_t>;

/// Crosses zero where a signal passes a level: u - level.
class Crossing : public ElementGuards<double> {
  public:
    template <class U, class Level>
    Crossing(Block* owner, const char* name, const U& u, const Level& level)
        : ElementGuards(owner, name, "zero where the signal passes its level", kernels::Margin{}, u, level) {}
};

} // namespace bf::blocks

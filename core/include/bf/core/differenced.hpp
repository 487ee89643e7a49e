// Blocks whose state outside of the diagram may be differenced.
#pragma once

#include "bf/core/access.hpp"

namespace bf {

/// A block that owns a state outside of the diagram (Provides, OutsideState) says by this base that it may be
/// differenced: all numbers of what it saves may be moved by little, and those that count or name something
/// are the same in two states that differ by little. Gradients of runs then go through the block, and through
/// all that use what it provides, by central differences of their calls from saved states.
class Differenced {
  public:
    /// Said before its calls are differenced, and after: what it computes by iterations it computes to
    /// rounding meanwhile. Nothing in a simulation calls it: it is no part of a step and may allocate.
    virtual void difference(Now at, bool begins) const = 0;

  protected:
    virtual ~Differenced() = default;
};

/// A block whose state outside of the diagram is where a solver begins says so by this base: what it computes
/// depends on that state by rounding alone, so that gradients of runs may leave it out.
class WarmStarted {
  public:
    virtual bool is_exact() const { return true; } ///< false: it ends at a tolerance instead

  protected:
    virtual ~WarmStarted() = default;
};

} // namespace bf

// What a block does with results that its element type cannot hold.
#pragma once

#include "bf/core/block.hpp"
#include "bf/kernels/convert.hpp"

namespace bf::blocks {

/// The argument `on_overflow`.
class OnOverflow {
  public:
    explicit OnOverflow(Block* owner)
        : argument_(owner, "on_overflow",
                    {.initial = "wrap",
                     .doc =
                         "integers out of range: wrap around, saturate at the limits, or error, which stops "
                         "the run and does so for results that are not finite too",
                     .choices = {"wrap", "saturate", "error"}}) {}
    kernels::Overflow choice() const {
        return *argument_ == "wrap"       ? kernels::Overflow::wrap
               : *argument_ == "saturate" ? kernels::Overflow::saturate
                                          : kernels::Overflow::error;
    }
    bool wraps() const { return choice() == kernels::Overflow::wrap; }
    /// Operand of kernels that take `stops`.
    Constants stops() const { return Constants({choice() == kernels::Overflow::error ? 1.0 : 0.0}); }

  private:
    Argument<std::string> argument_;
};

} // namespace bf::blocks

// What is asked of a running model: 'controller.x > 0.3'.
#pragma once

#include "bf/run/run.hpp"

#include <functional>
#include <string>

namespace bf {

/// A comparison of one element of a signal with a number.
class Comparison {
  public:
    /// An element of a signal or of an input of the root as recordings call it, SIGNAL, SIGNAL[i],
    /// SIGNAL[name] or SIGNAL[row][column], from 1; one of > >= < <= == ~=; a number. The run must live
    /// longer. Throws RunError with the nearest names.
    Comparison(const Run& run, const std::string& text);

    /// Does it hold now?
    bool operator()() const noexcept { return holds_(signal_[element_]); }

  private:
    Quantity signal_;
    int element_ = 0; ///< column by column, from 0
    std::function<bool(double)> holds_;
};

/// The signal or the input of the root of that path, or of its block where this has no other; under the name
/// that it is asked for. Throws RunError with the nearest names.
Quantity find_signal(const Run& run, const std::string& path);

} // namespace bf

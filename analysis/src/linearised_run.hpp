// Gradients of runs whose blocks are more than rules.
#pragma once

#include "bf/analysis/gradient.hpp"
#include "element.hpp"

#include <cstdint>
#include <vector>

namespace bf::analysis {

struct Horizon {
    std::int64_t steps;
    double step; ///< s
    bool counts_end;
    std::function<bool()> go_on;

    /// Throws RunError: nobody wants the rest.
    void begin_step(std::int64_t k) const {
        if (go_on && k % 100 == 0 && !go_on()) throw RunError("the gradient was interrupted");
    }
};

/// Makes a run with the parameters and inputs of another one, and linearises each of its steps along all
/// `by`: what it costs, its slopes, and what was differenced.
void go_along(const Simulation& like, const std::vector<Element>& by, const Element& cost,
              const Horizon& horizon, Gradient& result);

} // namespace bf::analysis

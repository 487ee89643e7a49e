// How what a run costs changes with parameters and initial states.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"

#include <string>
#include <vector>

namespace bf::analysis {

struct GradientOptions {
    /// By what: parameters and states of blocks, "controller.lqr.K", "plant.position.x[2]" (a state counts as
    /// it is at the start), and inputs of the root, which stay what they are. A vector stands for all of its
    /// elements.
    std::vector<std::string> by = {};
    std::string cost = {}; ///< a signal of one element
    enum class Over {
        all, ///< J = Σ cost(t) h over all base steps before the end, h their length
        end  ///< J = cost at the end
    } over = Over::all;
    double duration = 1; ///< s
};

struct Gradient {
    double cost = 0;                ///< J
    std::vector<std::string> names; ///< "controller.lqr.K[1][2]", one per element
    Vector at, slopes;              ///< their values, and dJ by each
    /// A comparison met its limit on the way: the gradient is that of one side.
    bool has_corner = false;
};

/// Runs the diagram from its start on numbers with derivatives, four parameters at a time: forward
/// differentiation of the very steps that a run makes, so that the gradient is that of the sampled and
/// integrated numbers, exact to rounding; where a step goes from one side of a switch to the other it counts
/// as it fell. Memory does not grow with the duration. Parameters and inputs are those of `run`, which stays
/// as it is.
///
/// Throws RunError that names the block or signal and the remedy: solvers with error control, blocks that are
/// no rules or whose kernels need numbers of the machine, algebraic loops, iterations, triggers and events;
/// unknown names; a run that fails.
Gradient gradient(const Simulation& run, const GradientOptions& options);

/// With the parameters of the model.
Gradient gradient(const Diagram& diagram, const GradientOptions& options);

} // namespace bf::analysis

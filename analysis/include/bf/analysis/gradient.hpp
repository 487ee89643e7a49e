// How what a run costs changes with parameters and initial states.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"

#include <functional>
#include <optional>
#include <string>
#include <string_view>
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
    enum class Way {
        cheaper, ///< of both
        forward, ///< along four parameters at a time
        adjoint  ///< back from the cost to all parameters at once
    } way = Way::cheaper;
    bool by_rules_alone = false; ///< refuse what is not exact, or no rule
    /// Asked now and then; false ends it with a RunError.
    std::function<bool()> go_on = nullptr;
};

/// "cheaper", "forward" or "adjoint"; empty: none of them.
std::optional<GradientOptions::Way> way_named(std::string_view name);

struct Gradient {
    double cost = 0;                ///< J
    std::vector<std::string> names; ///< "controller.lqr.K[1][2]", one per element
    Vector at, slopes;              ///< their values, and dJ by each
    /// A comparison met its limit on the way: the gradient is that of one side.
    bool has_corner = false;
    bool is_adjoint = false; ///< which way it was found
    /// Paths of blocks that went in by central differences; none: the gradient is exact.
    std::vector<std::string> differenced;
};

/// Runs the diagram from its start on numbers with derivatives: differentiates the very steps that a run
/// makes, so that the gradient is that of the sampled and integrated numbers, exact to rounding; where a step
/// goes from one side of a switch to the other it counts as it fell.
///
/// Forward it goes along four parameters at a time, and memory does not grow with the duration. The adjoint
/// goes back through the steps, from the cost to all parameters at once: λ_k = (∂x_k+1/∂x_k)ᵀ λ_k+1 + h
/// (∂cost/∂x_k)ᵀ. For N steps it keeps √N states of the run, from each of which it makes √N steps once more,
/// so that time grows as N and memory as √N (Griewank and Walther, Evaluating Derivatives, 2nd ed., §3.2 and
/// §12). Which is cheaper follows from the numbers that go through the blocks' rules. Parameters and inputs
/// are those of `run`, which stays as it is.
///
/// Where a block is no rule, a run is made, and its steps are linearised one by one along all parameters at
/// once (forward): rules and blocks that declare their derivative exactly, such as rigid bodies and quadratic
/// programs by their active set; other methods, and physics worlds that are Differenced with what is read and
/// commanded through them, by central differences of single calls. Such a model has no continuous states, and
/// no other block with a state outside of the diagram between `by` and the cost, unless it is WarmStarted.
///
/// Throws RunError that names the block or signal and the remedy: solvers with error control, kernels that
/// need numbers of the machine, algebraic loops, iterations, triggers and events; unknown names; a run that
/// fails.
Gradient gradient(const Simulation& run, const GradientOptions& options);

/// With the parameters of the model.
Gradient gradient(const Diagram& diagram, const GradientOptions& options);

} // namespace bf::analysis

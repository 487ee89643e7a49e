// Linearising a running diagram between named signals.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/engine/simulation.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::analysis {

/// Signals are called as everywhere, "controller.tau"; "controller.tau[l_knee]" and "controller.tau[3]" are
/// one element.
struct LinearizeOptions {
    /// Where the input is added: an input of the root, or any signal, to whose value it is added for all that
    /// read it over a wire; the block that computes it goes on from its own value. None: all inputs of the
    /// root.
    std::vector<std::string> from = {};
    /// What is looked at: signals, and states by "block.state". None: all outputs of the root.
    std::vector<std::string> to = {};
    /// Signals that are cut: what reads them gets the input that is added there, or nothing that changes;
    /// what is looked at is what stands before the cut. A loop that is cut at a signal which is input and
    /// output has its open-loop transfer function, with its own sign.
    std::vector<std::string> open = {};
    bool all_states = false; ///< also those that are on no path from an input to an output
    /// All states side by side, x' or x⁺ at this instant, whatever their rates; no inputs and outputs but
    /// those that are named.
    bool at_once = false;
    bool by_differences = false; ///< of every block: to compare with the exact derivatives

    bool operator==(const LinearizeOptions&) const = default;
};

/// Linearises at the present states of a started run and the outputs that follow from them, which takes one
/// step of it: what changes the run further begins with `restore`, or elsewhere.
///
/// Where all on the paths from input to output is continuous, the system is in continuous time; where all of
/// it is sampled at one rate, it has that period. Several rates make the map over their common period with
/// the input held (a lifted system): the linearised blocks run at their rates, and between the base steps
/// continuous states follow exp(A t).
///
/// Derivatives are exact for blocks made of rules whose kernels run on numbers with a derivative (Dual); all
/// others are differenced and named. Algebraic loops are solved by the implicit function theorem. What a
/// disabled or triggered subsystem computes is held, and so is state outside of the diagram.
///
/// Throws RunError, which names the signal, block or rates and the remedy: unknown names, signals that are no
/// real numbers, derivatives that are not finite, loops that are singular or iterate, states that are counted
/// from step to step.
LinearSystem linearize(Simulation& run, const LinearizeOptions& options);

/// The same at many points of a run: names are looked up once, and memory is kept. The run outlives it.
class Linearizer {
  public:
    /// Throws RunError for unknown names and signals that are no real numbers.
    Linearizer(Simulation& run, LinearizeOptions options);
    ~Linearizer();
    Linearizer(Linearizer&&) noexcept;
    Linearizer& operator=(Linearizer&&) noexcept;

    const LinearizeOptions& options() const;
    /// As `linearize`, at the present states.
    LinearSystem operator()();

  private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// Starts a run of the diagram, lets it run to that time [s], and linearises there.
LinearSystem linearize(const Diagram& diagram, const LinearizeOptions& options, double time = 0);

} // namespace bf::analysis

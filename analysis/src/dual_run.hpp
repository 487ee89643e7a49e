// A run on numbers with derivatives: the step program of a diagram over a memory of its own, forwards and
// backwards.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/program/program.hpp"
#include "dual_kernels.hpp"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace bf::analysis {

/// A block's derivative is not known step by step.
struct NoRule : RunError {
    using RunError::RunError;
};

/// Begins with parameters and inputs of another run. Throws RunError where the program has what cannot be
/// differentiated step by step, NoRule where that is a block which a linearised run may have.
class DualRun {
  public:
    explicit DualRun(const Simulation& like);
    DualRun(const DualRun&) = delete;
    DualRun& operator=(const DualRun&) = delete;

    /// Of a signal, a parameter or a state.
    Dual* elements(const Node::End& end) { return cells_.data() + place(end).now; }
    /// Constants and initial states, by the parameters as they are.
    void start();
    void outputs(); ///< of a step
    void update();  ///< to the next one
    double time() const { return static_cast<double>(steps_) * d_.step; }

    // ---- backwards

    /// Everything that a run needs to go on between two steps.
    struct Checkpoint {
        std::vector<double> cells, clocks;
        std::vector<std::int64_t> until_hit;
        std::vector<char> flags;
        std::int64_t steps;
    };
    Checkpoint checkpoint() const;
    void restore(const Checkpoint& checkpoint);

    /// A parameter or an input of the root, which is fixed otherwise.
    void follow(const Node::End& end) { is_fixed_[static_cast<std::size_t>(place(end).now)] = 0; }
    /// dJ by each element of a signal, a parameter or a state, as it is where the run stands.
    double* adjoints(const Node::End& end) { return adjoints_.data() + place(end).now; }
    void remember(bool does); ///< what is done from now on
    std::size_t remembered() const { return done_.size(); }
    /// Undoes what was remembered since then, the last first: values are what they were, and each adjoint
    /// goes to what the quantity was computed from.
    void go_back(std::size_t to);
    /// Numbers that pass through kernels in what was remembered since then: done once, and gone back.
    struct Work {
        double forwards = 0, backwards = 0;
    };
    Work work(std::size_t since) const;

  private:
    struct Place {
        int now = -1, next = -1, rate = -1, count = 0; ///< in the memory
    };
    struct Bound {
        bool (*run)(const kernels::View<Dual>* views, const kernels::ListView<Dual>& list);
        const kernels::View<Dual>* views;
        kernels::ListView<Dual> list;
        int node;
        Structure structure;
        bool is_product;                                ///< of the second and third view, matrices
        std::array<int, 2> factors;                     ///< their first cells; -1: a constant
        std::vector<std::pair<int, int>> reads, writes; ///< first cell and count
    };
    struct Instruction {
        enum class Op { task, commit, hit, assign, clear, test, rest, set, finite, integrate } op;
        int a = 0, end = 0; ///< `test`: where to go on if not
        std::vector<program::Literal> when = {};
    };
    using Code = std::vector<Instruction>;
    /// Something that was done. What it wrote over lies on a stack.
    struct Done {
        enum class Op { task, move, spread, fill, clock, stage, slope, step } op;
        int a = 0, b = 0, count = 0; ///< `move`, `spread`: from b to a; task, clock or stage a
    };

    const Place& place(const Node::End& end) const;
    void compile(const program::Statements& statements, program::Pass pass, Code& code);
    void compile(const program::Statement& statement, program::Pass pass, Code& code);
    const std::vector<program::Literal>& tests(const std::vector<program::Literal>& literals) const;
    int bind(int node, Phase phase, int index);
    Dual* memory(int node, const Call::Reference& operand);
    bool holds(const std::vector<program::Literal>& when) const;
    void run(const Code& code);
    void set(const program::Set& set);
    void integrate();
    void note(Done::Op op, int a = 0, int b = 0, int count = 0);
    void note_values(int first, int count); ///< which are written over
    void take_back(int first, int count);
    void go_back(const Bound& task);
    void go_back_through_product(const Bound& task);
    template <class F> void for_each_chunk(const Bound& task, F&& f) const;
    [[noreturn]] void refuse(const std::string& where, const std::string& what) const;
    [[noreturn]] void refuse_jumps() const; ///< names what has triggers, events or iterations

    const Diagram& d_;
    const program::Program program_;
    std::vector<std::vector<Place>> places_;
    std::vector<Dual> cells_;
    int first_state_ = 0, first_rate_ = 0, states_ = 0; ///< continuous ones lie together
    std::vector<Dual> clocks_;                          ///< by rate: time, period, trigger
    std::vector<std::int64_t> until_hit_;               ///< by rate
    std::vector<char> flags_;
    std::vector<Bound> bound_;
    std::vector<std::unique_ptr<kernels::View<Dual>[]>> views_;
    std::vector<std::unique_ptr<Dual[]>> constants_;
    Code start_, step_, update_, derivatives_, inside_;
    std::vector<Dual> before_, slopes_; ///< of the solver
    std::int64_t steps_ = 0;

    bool is_remembered_ = false;
    std::vector<char> is_fixed_;   ///< by first cell of a quantity: nothing changes it
    std::vector<double> adjoints_; ///< by cell
    std::vector<Done> done_;
    std::vector<double> overwritten_;
    std::vector<double> of_start_, of_slopes_, of_results_; ///< adjoints, of the solver and of a task
};

} // namespace bf::analysis

// A run on numbers with derivatives: the step program of a diagram over a memory of its own.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/program/program.hpp"
#include "dual_kernels.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf::analysis {

/// Begins with parameters and inputs of another run. Throws RunError where the program has what cannot be
/// differentiated step by step.
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

  private:
    struct Place {
        int now = -1, next = -1, rate = -1, count = 0; ///< in the memory
    };
    struct Bound {
        bool (*run)(const kernels::View<Dual>* views, const kernels::ListView<Dual>& list);
        const kernels::View<Dual>* views;
        kernels::ListView<Dual> list;
        int node;
    };
    struct Instruction {
        enum class Op { task, commit, hit, assign, clear, test, rest, set, finite, integrate } op;
        int a = 0, end = 0; ///< `test`: where to go on if not
        std::vector<program::Literal> when = {};
    };
    using Code = std::vector<Instruction>;

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
    [[noreturn]] void refuse(const std::string& where, const std::string& what) const;

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
};

} // namespace bf::analysis

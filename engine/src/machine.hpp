// A step program bound to the memory of a run: one flat array of instructions.
#pragma once

#include "algebraic.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/program/step.hpp"

#include <memory>
#include <span>
#include <vector>

namespace bf {

class Simulation::Machine {
  public:
    explicit Machine(Simulation& simulation);

    /// Runs from an entry to its end. False: a statement failed, and the simulation knows why.
    bool run(int entry) noexcept;
    /// What the program remembers is as before the first step.
    void forget();
    /// What it remembers from step to step.
    std::vector<std::span<std::byte>> state();
    /// Adds what this machine is to remember of that of another diagram, as far as both have the same
    /// conditions.
    void find_copies(const Machine& other, const Origin& origin, Succession& succession);
    /// Goes on at the simulation's step. `counterparts`: by node, the other diagram's.
    void go_on_from(const Machine& other, const std::vector<int>& counterparts) noexcept;
    std::uint8_t& flag(int number) { return flags_[static_cast<std::size_t>(number)]; }
    void visit_tasks(const TaskVisitor& visit);

    int constants, start, step, update, inside, derivatives, guards, arrive, event; ///< entries
    int slopes; ///< what is inside, and the derivatives of that, without a pause between them

  private:
    enum class Op : std::uint8_t {
        end,
        tasks, ///< a to b
        moves,
        commits,
        hits,
        jump, ///< to b
        flag, ///< to b unless it is as expected
        signal,
        memory,
        crossing,
        set, ///< flag a := as expected
        edge,
        fire,
        reset,
        rest,
        write,
        start,
        constants,
        finite,
        repeat,
        next, ///< iteration, or to b
        solve,
        answer,
        look,
        locate,
        observe,
        restart,
        integrate,
        evaluate, ///< the outputs in pass a
        call,
        fail
    };
    struct Instruction {
        Op op;
        bool expected = true;
        int a = 0, b = 0;
    };
    /// Copies x⁺ to x⁻: states that lie one after another.
    struct Commit {
        std::byte* to;
        const std::byte* from;
        std::size_t bytes;
        bool is_double; ///< and so looked at for NaN
        Status failure;
    };
    struct Answer {
        int node;
        std::vector<Task> tasks;
    };
    struct Signal {
        const void* data;
        Type type;
        int count;
        double operator[](int i) const { return read_value(data, type, i); }
        bool is_above_zero() const noexcept;
    };
    struct Memory {
        Signal signal;
        program::Edge edge;
        std::vector<double> last; ///< NaN: not looked at
        bool has_edge() noexcept;
    };
    struct Counter {
        int rate, flag;
        std::int64_t ticks;
    };
    struct Iterations {
        double given, most, done;
        Signal count; ///< without data: `given`
    };
    struct Failing {
        int node;
        Status status;
        Signal signal; ///< that must be finite
    };
    struct Bound {
        Phase phase;
        int node;
    };
    /// Of a block that goes on from another diagram: the first step that hits it, and the time since its last
    /// hit there, where that is not its period.
    struct FirstHit {
        std::int64_t step = -1;
        double period = 0; ///< s
    };

    int compile(const program::Statements& statements, program::Pass pass = program::first);
    void emit(const program::Statements& statements, program::Pass pass);
    void emit(const program::Statement& statement, program::Pass pass);
    int emit(Op op, int a = 0, int b = 0, bool expected = true);
    bool goes_on(Op op) const;
    void emit_range(Op op, std::size_t a, std::size_t b);
    std::vector<int> emit_tests(const std::vector<program::Literal>& when); ///< their jumps
    void land(const std::vector<int>& jumps);                               ///< here
    void emit_task(const program::Statement& statement);
    void emit_commits(const program::Statement& statement);
    void emit_repeat(const program::Statement& statement, program::Pass pass);
    void emit_solve(const program::Statement& statement, program::Pass pass);
    Signal signal(const Node::End& end);
    bool commit(const Commit& commit) noexcept;
    bool test(const Instruction& instruction) const noexcept;
    bool fail(int failing) noexcept;
    void rest(int node) noexcept;
    bool is_absent(int node) const noexcept;
    double last_hit(int node) const noexcept;
    void find_first_hits(const Machine& other, const std::vector<int>& counterparts) noexcept;
    bool run_with_first_hits(std::size_t begin, std::size_t end) noexcept;

    Simulation& simulation_;
    Context& context_;
    const program::Program& program_;
    std::vector<Instruction> code_;
    std::vector<Task> tasks_;
    std::vector<Bound> bound_; ///< what each task is
    std::vector<Move> moves_;
    struct Moving {
        int place;      ///< of the instruction
        int begin, end; ///< tasks that do the same
    };
    std::vector<Moving> moving_;
    std::vector<Commit> commits_;
    std::vector<Answer> answers_;
    std::vector<Signal> signals_;
    std::vector<Memory> memories_;
    std::vector<Counter> counters_;
    std::vector<std::int64_t> until_hit_; ///< steps, by counter
    std::vector<Iterations> iterations_;
    std::vector<Failing> failures_;
    std::vector<std::unique_ptr<AlgebraicSolver>> solvers_;
    std::vector<int> procedures_; ///< entries
    int again_ = 0;               ///< entry
    int landed_ = 0;              ///< the last instruction that something jumps to
    std::size_t first_visited_ = 0;
    std::vector<std::uint8_t> flags_;
    std::vector<FirstHit> first_hits_; ///< by node; empty without another diagram before
    std::int64_t last_first_hit_ = -1; ///< step of the latest of them
};

} // namespace bf

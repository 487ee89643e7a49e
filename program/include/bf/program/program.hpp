// What a step means: a small structured program over the memory of a diagram. Whoever runs a diagram
// interprets or prints it, and decides nothing of its own about rates, conditions, loops and events.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace bf::program {

inline constexpr Status state_became_nan =
    Status::failure("a state became NaN: look at the block's inputs in this step for a division by zero or a "
                    "value out of range");
inline constexpr Status continuous_state_not_finite =
    Status::failure("a continuous state became NaN or infinite: look for a division by zero, a value out of "
                    "range or a model that diverges, or give a smaller step");

/// The evaluations of the outputs, in each of which a part of the statements takes part.
enum Pass : std::uint8_t {
    first = 1,   ///< of a step
    again = 2,   ///< at the same instant, or at one inside the step, after states have jumped
    inside = 4,  ///< by the solver inside a step: what derivatives and guards depend on
    between = 8, ///< two steps, by a caller whose solver it is: all that goes on, conditions as they are
    every = 15
};

/// What must hold for a statement to run.
struct Literal {
    enum class Kind : std::uint8_t {
        flag,
        signal,  ///< some element is above 0
        memory,  ///< some element was above 0 when it was looked at last
        crossing ///< a guard that the node answers crossed 0, as found by the last `look`
    };
    Kind kind = Kind::flag;
    int number = 0; ///< of the flag, memory or node
    Node::End signal = {};
    bool is_negated = false;
};

/// One statement. Those that may fail end the step.
struct Statement {
    enum class Kind : std::uint8_t {
        run,    ///< activity `index` of `node` in `phase`
        commit, ///< x⁻ := x⁺ for the discrete states of `node`; fails where one became NaN
        set,    ///< `Program::sets[number]`
        reset,  ///< `node` changes the initial values of its states, which are set
        start,  ///< all blocks start in their order: devices open
        rest,   ///< the derivatives of `node` are 0
        finite, ///< fails where an element of `signal` is not finite
        assign, ///< `flag` := all of `when` hold
        clear,  ///< `flag` := false
        edge,   ///< `flag` := the signal of memory `number` has its edge since the last look, this one
        hit,    ///< `flag` := rate `number` is hit; then its clock goes on to this time. Of a task: it is
                ///< asked once in each of its calls
        fire,   ///< triggered rate `number` runs now: its clock's period is the time since it did before
        when,   ///< `body`, if all of `when` hold
        repeat, ///< `body`, at most `number` times or as often as `signal` says, and while `when` holds
                ///< after it; where that does not end it, `otherwise`
        solve,  ///< `body`, until the equations of algebraic loop `number` hold
        event,  ///< `node` answers the crossings of its guards
        look, ///< after `Program::guards`, finds those that crossed since the last look: `flag` := some did;
              ///< flag `number` := some of a node that answers did. A guard that does not run has no value
        locate,    ///< the same, from what the solver found when it stopped at a crossing
        observe,   ///< observers see the event
        restart,   ///< to the solver, continuous states or their derivatives have jumped
        integrate, ///< continuous states go on to the end of the step, with `Program::derivatives` after an
                   ///< evaluation of the outputs inside the step, which the first stage of a fixed step does
                   ///< without; fails where one is not finite. An adaptive solver that stops at a crossing
                   ///< lets `Program::event` run, and at the end `Program::arrive`
        evaluate,  ///< the outputs in `pass`
        constants, ///< `Program::constants`
        call,      ///< procedure `number`
        fail       ///< at `node`
    };
    Kind kind;
    std::uint8_t passes = every; ///< of outputs
    Phase phase = Phase::output;
    Pass pass = first;
    int node = -1, index = 0, number = 0, flag = -1;
    Node::End signal = {};
    Status failure = {};
    std::vector<Literal> when = {};
    std::vector<Statement> body = {}, otherwise = {};
};
using Statements = std::vector<Statement>;

/// `quantity` := what is at `source`, or `values` where that is none; one element expands, no element is 0.
/// Of a state the next value, too.
struct Set {
    Node::End quantity, source;
    std::vector<double> values;
};

/// A truth value of the program; false at the start.
struct Flag {
    enum class Kind : std::uint8_t {
        hit,       ///< rate `number` is hit, or was fired since the last updates
        enabled,   ///< condition `number` was, when it was tested last
        triggered, ///< condition `number`, which has a trigger, is true
        ran,       ///< rate `number` was fired in some iteration of a loop
        inside,    ///< an event inside a step is being answered
        crossed,   ///< some guard
        answered,  ///< some guard of a node that answers
        local      ///< used in one procedure alone
    };
    Kind kind;
    int number;
    std::string name;
    int task = -1; ///< of a hit: in the calls of this task, rather than in all steps
};

/// The values of a control signal at the last look; at the start it was not looked at yet.
struct Memory {
    Node::End signal;
    model::Edge edge;
    int condition;
    bool is_reset; ///< else the trigger
};

/// The guards in one slot of a node, or a continuous signal that controls a subsystem.
struct Watched {
    Node::End end;
    int condition;
    bool is_control;
    bool is_answered; ///< by an event; else it only marks where a solver must stop
};

struct Procedure {
    std::string name; ///< "test part"
    Statements body;
    int condition = -1; ///< that it tests or ends
    int task = -1;      ///< that calls it, by its rate; -1: whoever does the whole step
};

/// What is done at the hits of one period, for a scheduler with a priority for each. It may be interrupted
/// anywhere by tasks before it in the list, and ends before it is due again.
struct Task {
    int rate;        ///< that is hit when the task is due
    Statements hits; ///< of slower rates from or to which it carries signals
    Statements outputs, update;
    std::vector<int> nodes; ///< whose outputs it writes
};

struct Program {
    const Diagram* diagram;
    std::vector<Flag> flags;
    std::vector<Memory> memories;
    std::vector<Set> sets;        ///< initial values of states, and of outputs of conditional subsystems
    std::vector<Watched> watched; ///< controls come last
    /// Where a solver of the caller must stop, besides: jumps, corners, and then controls.
    std::vector<Watched> marked;
    std::vector<Procedure> procedures;
    std::vector<int> hit;    ///< flag by rate
    std::vector<int> active; ///< flag by condition: its blocks run; -1 for what is always true

    Statements constants;    ///< once, and after each change of parameters
    Statements start;        ///< before the first step, when outputs and derivatives are 0
    Statements outputs;      ///< in their order, with the passes of each
    Statements step;         ///< before observers see the step
    Statements update;       ///< after it
    Statements derivatives;  ///< for the solver
    Statements guards;       ///< zero-crossing functions
    Statements marks;        ///< those of what is marked
    Statements arrive;       ///< where an adaptive solver reaches the end of a step
    Statements event;        ///< where it stops at a crossing, or the caller's does
    std::vector<Task> tasks; ///< made by `split`: shorter periods first
};

/// Who integrates the continuous states?
enum class Integrator {
    own,   ///< the diagram's solver, in steps
    caller ///< some other one in place of it, where the caller does not do steps
};

/// The program of a diagram, which must outlive it.
Program lower(const Diagram& diagram, Integrator integrator = Integrator::own);

/// Deals the statements of outputs and updates out to tasks: each block to that of its period. Between
/// periods signals pass through blocks that change the rate alone. Their outputs belong to the faster side,
/// at the hits of the slower one, when nobody there is at work: a held sample stays what it is while the slow
/// task reads it, and a delayed one is what the slow task left when it ended. So whatever the tasks' moments,
/// they compute what a step does. Returns what stands against it, each with its place, reason and remedy;
/// there are no tasks then.
std::vector<std::string> split(Program& program);

/// "0.3 s", and with an offset "0.3 s + 0.1 s": as people write it, 3 times 0.1 as 0.3.
std::string period_text(const Diagram& diagram, int rate);

/// The program in words, one statement a line.
std::string text_of(const Program& program);

} // namespace bf::program

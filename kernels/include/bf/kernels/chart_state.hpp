#pragma once

#include "bf/kernels/expression.hpp"

/// State charts: hierarchical states with actions, parallel regions, history, events and timers, as a table
/// of numbers and one step over it. States, transitions and their order are those of W3C, "State Chart XML
/// (SCXML): State Machine Notation for Control Abstraction", 2015, appendix D; charts are Harel's
/// ("Statecharts: a visual formalism for complex systems", Sci. Comput. Program. 8, 1987).
namespace bf::kernels {

namespace chart {

/// The first numbers of a table. `..._at` are places in the table.
enum Head {
    state_count,    ///< states 1 to that, in the document's order; histories follow; 0 is the chart
    compounds,      ///< states with one active child, the chart being the first
    variables,      ///< numbers that actions assign
    parameters,     ///< elements of the parameter that formulas read
    events,         ///< numbered from 1, those of inputs first
    event_inputs,   ///< how many events are inputs
    event_port,     ///< the first of them in the list of inputs
    timers,         ///< delayed events
    has_history,    ///< is the last active child remembered?
    completes,      ///< 1: a step ends where nothing more can happen; 0: it is one microstep
    is_flat,        ///< the parameter is the number of the first state
    regions,        ///< of which the active state is an output
    states_at,      ///< rows of State
    transitions_at, ///< rows of Transition
    regions_at,     ///< a state each: the chart, or a child of a parallel state
    flags_at,       ///< list of the states that formulas ask about
    initial_at,     ///< initial values of the variables
    timers_at,      ///< the event of each timer
    head_size
};

enum class Kind { atomic, compound, parallel, final, shallow_history, deep_history };

/// A row of a state. Places are 0 where there is nothing; lists begin with their length.
enum State {
    parent,
    kind,
    compound, ///< its number among the compound states
    first_child,
    next_sibling,
    last_descendant,
    entry, ///< actions
    during,
    leave,
    first_transition, ///< number of its first row, of `transitions` ones
    transition_count,
    targets,      ///< list: the initial states, or what a history without memory stands for
    begin_action, ///< the actions on the way to these
    done_event,   ///< raised when a child that is final is entered; 0: nobody listens
    state_columns
};

enum Transition {
    source,
    domain,   ///< the state whose descendants are left; -1: none is
    goals,    ///< list
    triggers, ///< list of events; 0: it needs none
    guard,    ///< formula; 0: true
    action,   ///< actions
    transition_columns
};

/// An action is three numbers: this, a, b.
enum class Action { assign, raise, send, cancel, jump_unless, jump };

inline constexpr int most_states = 1000, most_compounds = 48, most_variables = 64, most_cells = 160,
                     most_events = 64, most_timers = 16, most_chosen = 32, most_queued = 32,
                     most_microsteps = 200;

/// What formulas read besides variables and parameters, in this order: time in the state [s], period [s],
/// time [s], then which of the states they ask about is active.
inline constexpr int given_cells = 3;

/// What a chart is during a step, and what its formulas and actions do. T: table, L: list of inputs, N:
/// numbers.
template <class T, class L, class N> class Present {
  public:
    Present(const T& table, const L& inputs, N time, N period) noexcept
        : table_(table), u_(inputs), time_(time), late_(N(1e-6) * period), period_(period) {}

    template <class X, class M> [[gnu::noinline]] void write(const X& x, const M& memory) const noexcept {
        const int n = head(compounds), own = head(events) - head(event_inputs);
        int at = n;
        for (int c = 0; c < n; ++c) x[c] = x_[c], memory[c] = entry_[c];
        for (int c = 0; head(has_history) != 0 && c < n; ++c) memory[at++] = last_[c];
        for (int v = 0; v < head(variables); ++v) memory[at++] = cells_[v];
        for (int k = 0; k < head(timers); ++k) memory[at++] = due_[k];
        for (int e = 0; e < own; ++e) memory[at++] = raised_[e];
    }

    /// Of each region the innermost active state that is not in a region of its own, 0: none; how long it has
    /// been active, and whether it was entered in this step.
    template <class Y, class S, class E>
    [[gnu::noinline]] void write_regions(const Y& state, const S& time_in_state,
                                         const E& entered) const noexcept {
        for (int r = 0; r < head(regions); ++r) {
            int s = at_(regions_at, r);
            state[r] = s;
            if (!is_active(s)) {
                state[r] = 0, time_in_state[r] = 0, entered[r] = false;
                continue;
            }
            while (kind_of(s) == Kind::compound) {
                state[r] = x_[of(s, compound)];
                // Which of them it is decides nothing where none of them has children.
                const int child = head(is_flat) == 0 ? active_child(s) : of(s, first_child);
                if (child == 0) break;
                s = child;
            }
            entered[r] = is_fresh(s);
            time_in_state[r] = time_in(s);
        }
    }
    template <class V> void write_variables(const V& values) const noexcept {
        for (int v = 0; v < head(variables); ++v) values[v] = cells_[v];
    }
    bool is_active(int s) const noexcept {
        while (s != 0) {
            const int around = of(s, parent);
            if (kind_of(around) == Kind::compound) return x_[of(around, compound)] == N(s);
            if (is_out(s)) return false;
            s = around;
        }
        return true;
    }

  protected:
    static constexpr int any_event = -1, no_event = 0;

    int at(int place) const noexcept { return static_cast<int>(table_[place]); }
    int head(Head which) const noexcept { return at(which); }
    int at_(Head list, int i) const noexcept { return at(head(list) + i); }
    int of(int s, State column) const noexcept { return at(head(states_at) + s * state_columns + column); }
    int of(int t, Transition column) const noexcept {
        return at(head(transitions_at) + t * transition_columns + column);
    }
    Kind kind_of(int s) const noexcept { return static_cast<Kind>(of(s, kind)); }
    int active_child(int s) const noexcept { return child_of(s, x_[of(s, compound)]); }
    int child_of(int s, const N& number) const noexcept {
        for (int child = of(s, first_child); child != 0; child = of(child, next_sibling))
            if (number == N(child)) return child;
        return 0;
    }
    /// Is this region of a parallel state left already, or not yet entered, while actions of `passing_` run?
    /// States are entered in the document's order and left in the opposite one.
    bool is_out(int s) const noexcept {
        return passing_ > 0 && s > passing_ && (domain_ < 0 ? is_wanted_[s] : is_below(s, domain_));
    }
    bool is_below(int s, int around) const noexcept { return s > around && s <= of(around, last_descendant); }
    /// The number of the innermost compound state around it.
    int compound_around(int s) const noexcept {
        do s = of(s, parent);
        while (kind_of(s) != Kind::compound);
        return of(s, compound);
    }
    N time_in(int s) const noexcept {
        const int c = compound_around(s);
        return fresh_[c] ? N(0) : time_ - entry_[c];
    }
    /// Was it entered in this step?
    bool is_fresh(int s) const noexcept { return fresh_[compound_around(s)]; }
    bool is_finished() const noexcept {
        for (int s = of(0, first_child); s != 0; s = of(s, next_sibling))
            if (kind_of(s) == Kind::final && x_[0] == N(s)) return true;
        return false;
    }

    // ---- formulas and actions

    [[gnu::noinline]] N value(int code) const noexcept { // one copy: it has all operations inside
        return Expression::value(View<const Element<T>>(table_.data + code + 1, at(code)),
                                 View<const N>(cells_, most_cells), u_, 0, [](Operation, auto, auto) {});
    }
    void set_cells(const N& time_in_state) noexcept {
        const int first = head(variables) + head(parameters), flags = head(flags_at);
        cells_[first] = time_in_state;
        for (int i = 0; i < at(flags); ++i) cells_[first + given_cells + i] = is_active(at(flags + 1 + i));
    }
    void perform(int actions, const N& time_in_state) noexcept {
        if (actions == 0) return;
        set_cells(time_in_state);
        const int count = at(actions);
        for (int i = 0; i < count;) {
            const int what = actions + 1 + 3 * i, a = at(what + 1), b = at(what + 2);
            ++i;
            switch (static_cast<Action>(at(what))) {
            case Action::assign: cells_[a] = value(b); break;
            case Action::raise: raise(a); break;
            case Action::send: {
                const N delay = value(b);
                due_[a] = delay > N(0) ? time_ + delay : time_; // below 0 would be no timer
                break;
            }
            case Action::cancel: due_[a] = -1; break;
            case Action::jump_unless:
                if (!(value(b) != N(0))) i = a;
                break;
            case Action::jump: i = a; break;
            }
        }
    }
    void raise(int event) noexcept {
        if (event == 0) return;
        if (head(completes) == 0)
            raised_[event - head(event_inputs) - 1] = 1;
        else if (queued_ - taken_ < most_queued)
            queue_[queued_++ % most_queued] = event;
        else
            is_right_ = false;
    }
    /// A timer whose time has come, the earliest one; -1: none. It is switched off. Times are sums of
    /// periods, rounded: a millionth of a period does not make a step late.
    int next_due() noexcept {
        int found = -1;
        for (int k = 0; k < head(timers); ++k)
            if (due_[k] >= N(0) && due_[k] <= time_ + late_ && (found < 0 || due_[k] < due_[found]))
                found = k;
        if (found >= 0) due_[found] = -1;
        return found;
    }

    const T& table_;
    const L& u_;
    N time_, late_, period_;
    N x_[most_compounds], entry_[most_compounds], last_[most_compounds];
    N cells_[most_cells], due_[most_timers], pending_[most_events], raised_[most_events],
        time_of_[most_chosen];
    bool fresh_[most_compounds], is_wanted_[most_states + 1], is_default_[most_states + 1];
    int content_[most_states + 1], chosen_[most_chosen], queue_[most_queued];
    int chosen_count_ = 0, queued_ = 0, taken_ = 0, microsteps_ = 0, event_ = no_event;
    int passing_ = 0,
        domain_ = -1; // the state that is entered or left; below which states are left, -1: none
    bool is_right_ = true;
};

} // namespace chart
} // namespace bf::kernels

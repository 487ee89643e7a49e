// The table of a state chart, in C11 and C++17: rows of numbers, of which the first ones say where the others are.
// Generated C has this text, with a prefix of its own before `chart_`.

// The first numbers. `..._at` are places in the table.
enum {
    chart_state_count,    // states 1 to that, in the document's order; histories follow; 0 is the chart
    chart_compounds,      // states with one active child, the chart being the first
    chart_variables,      // numbers that actions assign
    chart_parameters,     // elements of the parameter that formulas read
    chart_events,         // numbered from 1, those of inputs first
    chart_event_inputs,   // how many events are inputs
    chart_event_port,     // the first of them in the list of inputs
    chart_timers,         // delayed events
    chart_has_history,    // is the last active child remembered?
    chart_completes,      // 1: a step ends where nothing more can happen; 0: it is one microstep
    chart_is_flat,        // the parameter is the number of the first state
    chart_regions,        // of which the active state is an output
    chart_states_at,      // rows of states
    chart_transitions_at, // rows of transitions
    chart_regions_at,     // a state each: the chart, or a child of a parallel state
    chart_flags_at,       // list of the states that formulas ask about
    chart_timers_at,      // the event of each timer
    chart_initial_at,     // initial values of the variables
    chart_formulas_at,    // their instructions, after how many numbers these are; places count from 1
    chart_head_size
};

// Kinds of states.
enum {
    chart_atomic,
    chart_compound,
    chart_parallel,
    chart_final,
    chart_shallow_history,
    chart_deep_history
};

// A row of a state. Places are 0 where there is nothing; lists begin with their length.
enum {
    chart_parent,
    chart_kind,
    chart_group, // its number among the compound states
    chart_first_child,
    chart_next_sibling,
    chart_last_descendant,
    chart_entry, // actions
    chart_during,
    chart_exit,
    chart_first_transition, // number of its first row, of `transition_count` ones
    chart_transition_count,
    chart_targets,      // list: the initial states, or what a history without memory stands for
    chart_begin_action, // the actions on the way to these
    chart_done_event,   // raised when a child that is final is entered; 0: nobody listens
    chart_state_columns
};

// A row of a transition.
enum {
    chart_source,
    chart_domain,   // the state whose descendants are left; -1: none is
    chart_goals,    // list
    chart_triggers, // list of events; 0: it needs none
    chart_guard,    // formula; 0: true
    chart_action,   // actions
    chart_transition_columns
};

// An action is three numbers: this, a, b.
enum {
    chart_assign, // to cell a the formula b
    chart_raise,  // event a
    chart_send,   // timer a, after formula b
    chart_cancel, // timer a
    chart_jump_unless,
    chart_jump // to action a, unless formula b
};

// What formulas read besides variables and parameters, in this order: time in the state [s], period [s], time
// [s], then which of the states they ask about is active.
enum { chart_given_cells = 3 };

// A step waits for at most so many events, and takes less than so many microsteps.
enum { chart_most_queued = 32, chart_most_microsteps = 200 };

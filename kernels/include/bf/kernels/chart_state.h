// A state chart during a step, in C11 and C++17: a class of C++ includes this text (kernels/chart.hpp), and
// generated C has it, with a prefix of its own before `chart_`. What includes it says what a chart_number is and where
// the chart's numbers come from, by
//   chart_at(from, place)            a number of the table,
//   chart_initial_value(from, i)     of variable i,
//   chart_is_input(from, event)      whether the input of an event is true,
//   chart_value(from, cells, code)   a formula.
// Recursion would follow the nesting of states; as these are numbered in the document's order, loops do.

typedef struct {
    const chart_numbers *from;
    chart_number time;
    chart_number late; // times are sums of periods, rounded: this does not make a step late
    chart_number period;
    // Of each compound state: its active child, 0: none, the one before it was left, the time of entry, and
    // whether that was in this step.
    chart_number x[chart_most_compounds];
    chart_number last[chart_most_compounds];
    chart_number entered[chart_most_compounds];
    bool fresh[chart_most_compounds];
    chart_number cells[chart_most_cells]; // what formulas read
    chart_number due[chart_most_timers];  // time, -1: none
    chart_number pending[chart_most_events]; // events of this step
    chart_number raised[chart_most_events];  // of the next one
    int32_t queue[chart_most_queued];
    int32_t queued;
    int32_t taken;
    int32_t chosen[chart_most_chosen]; // transitions, and the time in the state of each
    chart_number time_of[chart_most_chosen];
    int32_t chosen_count;
    // What will be entered: states, whether each begins by itself, and the action of a history inside.
    bool wanted[chart_most_states + 1];
    bool begins[chart_most_states + 1];
    int32_t content[chart_most_states + 1];
    int32_t order[chart_most_states + 1]; // states that are left, or goals
    int32_t microsteps;
    int32_t event;   // the one that is answered
    int32_t passing; // the state that is entered or left
    int32_t domain;  // below which states are left, -1: none
    bool is_right;   // false: the chart does not come to rest, or too much was raised in one step
} chart_step;

enum { chart_any_event = -1, chart_no_event = 0 };

// ---- states

static int32_t chart_head(const chart_step *chart, int32_t which)
{
    return chart_at(chart->from, which);
}

// Number i of what begins at a place that the head names.
static int32_t chart_item(const chart_step *chart, int32_t where, int32_t i)
{
    return chart_at(chart->from, chart_head(chart, where) + i);
}

static int32_t chart_state(const chart_step *chart, int32_t s, int32_t column)
{
    return chart_item(chart, chart_states_at, (s * chart_state_columns) + column);
}

static int32_t chart_transition(const chart_step *chart, int32_t t, int32_t column)
{
    return chart_item(chart, chart_transitions_at, (t * chart_transition_columns) + column);
}

static bool chart_is(const chart_step *chart, int32_t s, int32_t kind)
{
    return chart_state(chart, s, chart_kind) == kind;
}

static bool chart_is_history(const chart_step *chart, int32_t s)
{
    return chart_is(chart, s, chart_shallow_history) || chart_is(chart, s, chart_deep_history);
}

static bool chart_is_below(const chart_step *chart, int32_t s, int32_t around)
{
    return (s > around) && (s <= chart_state(chart, around, chart_last_descendant));
}

static int32_t chart_child(const chart_step *chart, int32_t s, chart_number number)
{
    int32_t child = chart_state(chart, s, chart_first_child);
    while ((child != 0) && (number != (chart_number)child)) {
        child = chart_state(chart, child, chart_next_sibling);
    }
    return child;
}

static int32_t chart_active_child(const chart_step *chart, int32_t s)
{
    return chart_child(chart, s, chart->x[chart_state(chart, s, chart_group)]);
}

static int32_t chart_last_child(const chart_step *chart, int32_t s)
{
    return chart_child(chart, s, chart->last[chart_state(chart, s, chart_group)]);
}

// Below `top` the active state that follows an active one in the document; 0: none.
static int32_t chart_next_active(const chart_step *chart, int32_t from, int32_t top)
{
    int32_t s = from;
    int32_t next = 0;
    if (chart_is(chart, s, chart_compound)) {
        next = chart_active_child(chart, s);
    } else if (chart_is(chart, s, chart_parallel)) {
        next = chart_state(chart, s, chart_first_child);
    } else {
        // It has no states inside.
    }
    while ((next == 0) && (s != top)) {
        const int32_t around = chart_state(chart, s, chart_parent);
        if (chart_is(chart, around, chart_parallel)) {
            next = chart_state(chart, s, chart_next_sibling);
        }
        s = around;
    }
    return next;
}

// Is this region of a parallel state left already, or not yet entered, while actions run? States are entered
// in the document's order and left in the opposite one.
static bool chart_is_out(const chart_step *chart, int32_t s)
{
    bool is_out = false;
    if ((chart->passing > 0) && (s > chart->passing)) { // only then is it known what is wanted
        is_out = (chart->domain < 0) ? chart->wanted[s] : chart_is_below(chart, s, chart->domain);
    }
    return is_out;
}

static bool chart_is_active(const chart_step *chart, int32_t state)
{
    int32_t s = state;
    while (s != 0) {
        const int32_t around = chart_state(chart, s, chart_parent);
        if (chart_is(chart, around, chart_compound)) {
            return chart->x[chart_state(chart, around, chart_group)] == (chart_number)s;
        }
        if (chart_is_out(chart, s)) {
            return false;
        }
        s = around;
    }
    return true;
}

// The number of the innermost compound state around it.
static int32_t chart_group_around(const chart_step *chart, int32_t s)
{
    int32_t around = chart_state(chart, s, chart_parent);
    while (!chart_is(chart, around, chart_compound)) {
        around = chart_state(chart, around, chart_parent);
    }
    return chart_state(chart, around, chart_group);
}

// Was it entered in this step?
static bool chart_is_fresh(const chart_step *chart, int32_t s)
{
    return chart->fresh[chart_group_around(chart, s)];
}

static chart_number chart_time_in(const chart_step *chart, int32_t s)
{
    const int32_t group = chart_group_around(chart, s);
    return chart->fresh[group] ? (chart_number)0 : (chart->time - chart->entered[group]);
}

static bool chart_is_finished(const chart_step *chart)
{
    int32_t s = chart_state(chart, 0, chart_first_child);
    while ((s != 0) && !(chart_is(chart, s, chart_final) && (chart->x[0] == (chart_number)s))) {
        s = chart_state(chart, s, chart_next_sibling);
    }
    return s != 0;
}

// ---- actions

static void chart_set_cells(chart_step *chart, chart_number time_in_state)
{
    const int32_t first = chart_head(chart, chart_variables) + chart_head(chart, chart_parameters);
    const int32_t count = chart_item(chart, chart_flags_at, 0);
    chart->cells[first] = time_in_state;
    for (int32_t i = 0; i < count; ++i) {
        const bool is_active = chart_is_active(chart, chart_item(chart, chart_flags_at, 1 + i));
        chart->cells[first + chart_given_cells + i] = is_active ? (chart_number)1 : (chart_number)0;
    }
}

static void chart_happen(chart_step *chart, int32_t event)
{
    if (event == 0) {
        // Nobody listens.
    } else if (chart_head(chart, chart_completes) == 0) {
        chart->raised[event - chart_head(chart, chart_event_inputs) - 1] = (chart_number)1;
    } else if ((chart->queued - chart->taken) < chart_most_queued) {
        chart->queue[chart->queued % chart_most_queued] = event;
        chart->queued = chart->queued + 1;
    } else {
        chart->is_right = false;
    }
}

// When an event that is sent now is due. Of those due at one instant, but for rounding, the one sent first comes
// first: this one is due later than they are, by a part of what a step takes for its time.
static chart_number chart_due(const chart_step *chart, int32_t timer, chart_number at)
{
    chart_number due = at;
    for (int32_t k = 0; k < chart_head(chart, chart_timers); ++k) {
        const chart_number other = chart->due[k];
        if ((k != timer) && (other >= due) && (other <= (at + (chart->late / (chart_number)2)))) {
            due = other + (chart->late / (chart_number)64);
        }
    }
    return due;
}

static void chart_perform(chart_step *chart, int32_t actions, chart_number time_in_state)
{
    int32_t i = 0;
    int32_t count = 0;
    if (actions != 0) {
        chart_set_cells(chart, time_in_state);
        count = chart_at(chart->from, actions);
    }
    while (i < count) {
        const int32_t what = actions + 1 + (3 * i);
        const int32_t a = chart_at(chart->from, what + 1);
        const int32_t b = chart_at(chart->from, what + 2);
        i = i + 1;
        switch (chart_at(chart->from, what)) {
        case chart_assign:
            chart->cells[a] = chart_value(chart->from, chart->cells, b);
            break;
        case chart_raise:
            chart_happen(chart, a);
            break;
        case chart_send: {
            const chart_number delay = chart_value(chart->from, chart->cells, b);
            // A time below 0 would be no timer.
            chart->due[a] =
                chart_due(chart, a, (delay > (chart_number)0) ? (chart->time + delay) : chart->time);
            break;
        }
        case chart_cancel:
            chart->due[a] = (chart_number)-1;
            break;
        case chart_jump_unless:
            if (!(chart_value(chart->from, chart->cells, b) != (chart_number)0)) {
                i = a;
            }
            break;
        default: // chart_jump
            i = a;
            break;
        }
    }
}

// A timer whose time has come, the earliest one; -1: none. It is switched off.
static int32_t chart_take_due(chart_step *chart)
{
    const int32_t count = chart_head(chart, chart_timers);
    int32_t found = -1;
    for (int32_t k = 0; k < count; ++k) {
        const bool is_due =
            (chart->due[k] >= (chart_number)0) && (chart->due[k] <= (chart->time + chart->late));
        if (is_due && ((found < 0) || (chart->due[k] < chart->due[found]))) {
            found = k;
        }
    }
    if (found >= 0) {
        chart->due[found] = (chart_number)-1;
    }
    return found;
}

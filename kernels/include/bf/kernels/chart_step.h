// A step of a state chart; see chart_state.h.

static void chart_begin(chart_step *chart, chart_number first_state)
{
    for (int32_t c = 0; c < chart_head(chart, chart_compounds); ++c) {
        chart->x[c] = (chart_number)0;
        chart->last[c] = (chart_number)0;
    }
    for (int32_t v = 0; v < chart_head(chart, chart_variables); ++v) {
        chart->cells[v] = chart_initial_value(chart->from, v);
    }
    for (int32_t k = 0; k < chart_head(chart, chart_timers); ++k) {
        chart->due[k] = (chart_number)-1;
    }
    if (chart_head(chart, chart_is_flat) != 0) {
        chart->x[0] = first_state;
        chart->entered[0] = chart->time;
        chart->fresh[0] = true;
    } else {
        chart_forget_wishes(chart);
        chart_perform(chart, chart_state(chart, 0, chart_begin_action), (chart_number)0);
        chart_want(chart, chart_state(chart, 0, chart_targets), 0);
        chart_enter_wanted(chart);
    }
}

// Microsteps without an event and with the events that they raise, until there are none.
static void chart_settle(chart_step *chart)
{
    bool goes_on = true;
    while (goes_on && chart->is_right && (!chart_is_finished(chart))) {
        chart->event = chart_no_event;
        chart_select(chart);
        if ((chart->chosen_count == 0) && (chart->taken == chart->queued)) {
            goes_on = false;
        } else if (chart->chosen_count == 0) {
            chart->event = chart->queue[chart->taken % chart_most_queued];
            chart->taken = chart->taken + 1;
            chart_select(chart);
        } else {
            // It needs no event.
        }
        chart_microstep(chart);
    }
}

static void chart_answer(chart_step *chart, int32_t event)
{
    if (chart->is_right && (!chart_is_finished(chart))) {
        chart->event = event;
        chart_select(chart);
        chart_microstep(chart);
        chart_settle(chart);
    }
}

// What needs no event, then the same with each event from outside.
static void chart_complete(chart_step *chart)
{
    // What is due has happened, even if an answer to an input sends it anew.
    int32_t due[chart_most_timers];
    int32_t count = 0;
    int32_t k = chart_take_due(chart);
    while (k >= 0) {
        due[count] = chart_item(chart, chart_timers_at, k);
        count = count + 1;
        k = chart_take_due(chart);
    }
    chart_settle(chart);
    for (int32_t e = 1; e <= chart_head(chart, chart_event_inputs); ++e) {
        if (chart_is_input(chart->from, e)) {
            chart_answer(chart, e);
        }
    }
    for (int32_t i = 0; i < count; ++i) {
        chart_answer(chart, due[i]);
    }
    k = chart_take_due(chart);
    while ((k >= 0) && chart->is_right) {
        chart_answer(chart, chart_item(chart, chart_timers_at, k));
        k = chart_take_due(chart);
    }
}

static void chart_prepare(chart_step *chart, const chart_numbers *from, chart_number time, chart_number period)
{
    chart->from = from;
    chart->time = time;
    chart->late = (chart_number)1e-6 * period;
    chart->period = period;
    chart->queued = 0;
    chart->taken = 0;
    chart->microsteps = 0;
    chart->chosen_count = 0;
    chart->event = chart_no_event;
    chart->passing = 0;
    chart->domain = -1;
    chart->is_right = true;
}

// From the states before the step. `memory` has the times at which the active children were entered, the children
// that were active last, if there is a history, the variables, the times at which events are due, and which
// events were raised. False: the chart does not come to rest.
static bool chart_run(chart_step *chart, const chart_number *x, const chart_number *memory, bool was_started,
                      const chart_number *p)
{
    const int32_t n = chart_head(chart, chart_compounds);
    const int32_t given = chart_head(chart, chart_variables) + chart_head(chart, chart_parameters);
    const int32_t inputs = chart_head(chart, chart_event_inputs);
    const int32_t own = chart_head(chart, chart_events) - inputs;
    int32_t at = n;
    for (int32_t c = 0; c < n; ++c) {
        chart->x[c] = x[c];
        chart->entered[c] = memory[c];
        chart->fresh[c] = false;
    }
    for (int32_t c = 0; (chart_head(chart, chart_has_history) != 0) && (c < n); ++c) {
        chart->last[c] = memory[at + c];
    }
    at = at + ((chart_head(chart, chart_has_history) != 0) ? n : 0);
    for (int32_t v = 0; v < chart_head(chart, chart_variables); ++v) {
        chart->cells[v] = memory[at + v];
    }
    at = at + chart_head(chart, chart_variables);
    for (int32_t k = 0; k < chart_head(chart, chart_timers); ++k) {
        chart->due[k] = memory[at + k];
    }
    at = at + chart_head(chart, chart_timers);
    for (int32_t e = 0; e < own; ++e) {
        chart->pending[e] = memory[at + e];
        chart->raised[e] = (chart_number)0;
    }
    for (int32_t i = 0; i < chart_head(chart, chart_parameters); ++i) {
        chart->cells[chart_head(chart, chart_variables) + i] = p[i];
    }
    chart->cells[given + 1] = chart->period;
    chart->cells[given + 2] = chart->time;
    if (!was_started) {
        chart_begin(chart, p[0]);
    }
    if (chart_head(chart, chart_completes) != 0) {
        chart_complete(chart);
    } else if (!chart_is_finished(chart)) {
        int32_t k = chart_take_due(chart);
        while (k >= 0) {
            chart->pending[chart_item(chart, chart_timers_at, k) - inputs - 1] = (chart_number)1;
            k = chart_take_due(chart);
        }
        chart->event = chart_any_event;
        chart_select(chart);
        chart_microstep(chart);
    } else {
        // Nothing leaves a final state.
    }
    // Actions of states that stay active, which a chart without states in states has none of.
    if (chart_head(chart, chart_is_flat) == 0) {
        int32_t s = chart_next_active(chart, 0, 0);
        while (s != 0) {
            const int32_t during = chart_state(chart, s, chart_during);
            if ((during != 0) && (!chart_is_fresh(chart, s))) {
                chart_perform(chart, during, chart_time_in(chart, s));
            }
            s = chart_next_active(chart, s, 0);
        }
    }
    if (chart_head(chart, chart_completes) != 0) {
        chart_settle(chart); // what these raise
    }
    return chart->is_right;
}

// ---- what outputs show

// The innermost active state of a region that is not in a region of its own, 0: none. `shown` is that state, or
// one beside it: they were entered at the same time.
static chart_number chart_active_in(const chart_step *chart, int32_t region, int32_t *shown)
{
    int32_t s = chart_item(chart, chart_regions_at, region);
    int32_t child = s;
    chart_number number = (chart_number)s;
    if (!chart_is_active(chart, s)) {
        *shown = 0;
        return (chart_number)0;
    }
    do {
        s = child;
        child = 0;
        if (chart_is(chart, s, chart_compound)) {
            number = chart->x[chart_state(chart, s, chart_group)];
            // Which of them it is decides nothing where none of them has children.
            child = (chart_head(chart, chart_is_flat) == 0) ? chart_active_child(chart, s)
                                                            : chart_state(chart, s, chart_first_child);
        }
    } while (child != 0);
    *shown = s;
    return number;
}

// ---- what is kept

static void chart_keep(const chart_step *chart, chart_number *x, chart_number *memory)
{
    const int32_t n = chart_head(chart, chart_compounds);
    const int32_t own = chart_head(chart, chart_events) - chart_head(chart, chart_event_inputs);
    int32_t at = n;
    for (int32_t c = 0; c < n; ++c) {
        x[c] = chart->x[c];
        memory[c] = chart->entered[c];
    }
    for (int32_t c = 0; (chart_head(chart, chart_has_history) != 0) && (c < n); ++c) {
        memory[at + c] = chart->last[c];
    }
    at = at + ((chart_head(chart, chart_has_history) != 0) ? n : 0);
    for (int32_t v = 0; v < chart_head(chart, chart_variables); ++v) {
        memory[at + v] = chart->cells[v];
    }
    at = at + chart_head(chart, chart_variables);
    for (int32_t k = 0; k < chart_head(chart, chart_timers); ++k) {
        memory[at + k] = chart->due[k];
    }
    at = at + chart_head(chart, chart_timers);
    for (int32_t e = 0; e < own; ++e) {
        memory[at + e] = chart->raised[e];
    }
}

// Which transitions of a state chart are taken, and what they leave and enter; see chart_state.h.

static bool chart_is_present(const chart_step *chart, int32_t event)
{
    const int32_t inputs = chart_head(chart, chart_event_inputs);
    if (chart->event != chart_any_event) {
        return event == chart->event;
    }
    return (event > inputs) ? (chart->pending[event - inputs - 1] != (chart_number)0)
                            : chart_is_input(chart->from, event);
}

static bool chart_is_triggered(const chart_step *chart, int32_t t)
{
    const int32_t list = chart_transition(chart, t, chart_triggers);
    if (list == 0) {
        return chart->event <= chart_no_event;
    }
    bool is_one = false;
    for (int32_t i = 1; (chart->event != chart_no_event) && (!is_one) && (i <= chart_at(chart->from, list));
         ++i) {
        is_one = chart_is_present(chart, chart_at(chart->from, list + i));
    }
    return is_one;
}

// Of two that leave the same state the one of the inner state counts, or else the first.
static void chart_choose(chart_step *chart, int32_t t, chart_number its_time)
{
    bool is_inner[chart_most_chosen];
    bool is_preempted = false;
    int32_t kept = 0;
    for (int32_t i = 0; i < chart->chosen_count; ++i) {
        const int32_t a = chart_transition(chart, t, chart_domain);
        const int32_t b = chart_transition(chart, chart->chosen[i], chart_domain);
        const bool conflicts = (a >= 0) && (b >= 0) &&
                               ((a == b) || chart_is_below(chart, a, b) || chart_is_below(chart, b, a));
        is_inner[i] =
            conflicts && chart_is_below(chart, chart_transition(chart, t, chart_source),
                                        chart_transition(chart, chart->chosen[i], chart_source));
        is_preempted = is_preempted || (chart->chosen[i] == t) || (conflicts && (!is_inner[i]));
    }
    if (is_preempted) {
        return;
    }
    for (int32_t i = 0; i < chart->chosen_count; ++i) {
        if (!is_inner[i]) {
            chart->chosen[kept] = chart->chosen[i];
            chart->time_of[kept] = chart->time_of[i];
            kept = kept + 1;
        }
    }
    chart->chosen[kept] = t;
    chart->time_of[kept] = its_time;
    chart->chosen_count = kept + 1;
}

// The first transition of a state that is enabled; -1: none.
static int32_t chart_enabled(chart_step *chart, int32_t s, chart_number its_time)
{
    const int32_t count = chart_state(chart, s, chart_transition_count);
    chart_set_cells(chart, its_time);
    for (int32_t i = 0; i < count; ++i) {
        const int32_t t = chart_state(chart, s, chart_first_transition) + i;
        const int32_t guard = chart_transition(chart, t, chart_guard);
        if (chart_is_triggered(chart, t) &&
            ((guard == 0) || (chart_value(chart->from, chart->cells, guard) != (chart_number)0))) {
            return t;
        }
    }
    return -1;
}

// Of each active state without children the first transition that is enabled, or else of those around it.
static void chart_select(chart_step *chart)
{
    int32_t innermost = chart_next_active(chart, 0, 0);
    chart->chosen_count = 0;
    while (innermost != 0) {
        const bool has_children =
            chart_is(chart, innermost, chart_compound) || chart_is(chart, innermost, chart_parallel);
        int32_t s = has_children ? 0 : innermost;
        while (s != 0) {
            int32_t t = -1;
            chart_number its_time = (chart_number)0;
            if (chart_state(chart, s, chart_transition_count) != 0) {
                its_time = chart_time_in(chart, s);
                t = chart_enabled(chart, s, its_time);
            }
            if (t >= 0) {
                chart_choose(chart, t, its_time);
            }
            s = (t >= 0) ? 0 : chart_state(chart, s, chart_parent);
        }
        innermost = chart_next_active(chart, innermost, 0);
    }
}

// ---- one microstep

// A state and all that is active inside, the last one in the document first.
static void chart_leave(chart_step *chart, int32_t top)
{
    int32_t count = 0;
    int32_t s = top;
    while ((count == 0) || (s != 0)) {
        chart->order[count] = s;
        count = count + 1;
        s = chart_next_active(chart, s, top);
    }
    while (count > 0) {
        count = count - 1;
        s = chart->order[count];
        const int32_t around = chart_state(chart, s, chart_parent);
        const int32_t action = chart_state(chart, s, chart_exit);
        chart->passing = s;
        if (action != 0) {
            chart_perform(chart, action, chart_time_in(chart, s));
        }
        if (chart_is(chart, around, chart_compound)) {
            const int32_t group = chart_state(chart, around, chart_group);
            if ((chart_head(chart, chart_has_history) != 0) && (around >= top)) {
                chart->last[group] = chart->x[group];
            }
            chart->x[group] = (chart_number)0;
        }
    }
}

// Was it left before, by a compound state that has noted it: the state itself, or the first ones inside of a
// parallel state, whose regions may be parallel, too?
static bool chart_remembers(const chart_step *chart, int32_t s)
{
    const int32_t end = chart_state(chart, s, chart_last_descendant);
    int32_t d = s;
    bool is_known = false;
    while ((d <= end) && (!is_known)) {
        if (chart_is(chart, d, chart_compound)) {
            is_known = chart_last_child(chart, d) != 0;
            d = chart_state(chart, d, chart_last_descendant);
        }
        d = d + 1;
    }
    return is_known;
}

// What was active in a state last: its child, or of a deep history all below.
static void chart_want_last(chart_step *chart, int32_t s, bool is_deep)
{
    const int32_t end = chart_state(chart, s, chart_last_descendant);
    int32_t d = s + 1;
    while (d <= end) {
        const int32_t around = chart_state(chart, d, chart_parent);
        if (chart_is(chart, around, chart_compound) && (chart_last_child(chart, around) != d)) {
            d = chart_state(chart, d, chart_last_descendant);
        } else {
            chart->wanted[d] = true;
            if (!is_deep) {
                d = chart_state(chart, d, chart_last_descendant);
            }
        }
        d = d + 1;
    }
}

// The states of a list, what histories among them stand for, and those around them, up to `around`.
static void chart_want(chart_step *chart, int32_t list, int32_t around)
{
    int32_t count = (list == 0) ? 0 : chart_at(chart->from, list);
    for (int32_t i = 0; i < count; ++i) {
        chart->order[i] = chart_at(chart->from, list + 1 + i);
    }
    int32_t next = 0;
    while (next < count) {
        const int32_t s = chart->order[next];
        const int32_t above = chart_state(chart, s, chart_parent);
        next = next + 1;
        if (!chart_is_history(chart, s)) {
            chart->wanted[s] = true;
        } else if (chart_remembers(chart, above)) {
            chart_want_last(chart, above, chart_is(chart, s, chart_deep_history));
        } else {
            const int32_t others = chart_state(chart, s, chart_targets);
            const int32_t other_count = chart_at(chart->from, others);
            chart->content[above] = chart_state(chart, s, chart_begin_action);
            for (int32_t i = 0; i < other_count; ++i) {
                chart->order[count] = chart_at(chart->from, others + 1 + i);
                count = count + 1;
            }
        }
    }
    for (int32_t i = 0; i < count; ++i) {
        int32_t s = chart_state(chart, chart->order[i], chart_parent);
        while ((s != around) && (s != 0)) {
            chart->wanted[s] = true;
            s = chart_state(chart, s, chart_parent);
        }
    }
}

// Regions of what is wanted, and the initial states of what has no wanted child.
static void chart_complete_wishes(chart_step *chart)
{
    for (int32_t s = 1; s <= chart_head(chart, chart_state_count); ++s) {
        const bool is_parallel = chart->wanted[s] && chart_is(chart, s, chart_parallel);
        const bool is_compound = chart->wanted[s] && chart_is(chart, s, chart_compound);
        bool has_wanted = false;
        int32_t child = (is_parallel || is_compound) ? chart_state(chart, s, chart_first_child) : 0;
        while (child != 0) {
            chart->wanted[child] = chart->wanted[child] || is_parallel;
            has_wanted = has_wanted || chart->wanted[child];
            child = chart_state(chart, child, chart_next_sibling);
        }
        if (is_compound && (!has_wanted)) {
            chart->begins[s] = true;
            chart_want(chart, chart_state(chart, s, chart_targets), s);
        }
    }
}

// Is each region in a final state?
static bool chart_are_final(const chart_step *chart, int32_t s)
{
    const int32_t end = chart_state(chart, s, chart_last_descendant);
    bool are_all = true;
    int32_t region = s + 1;
    while (are_all && (region <= end)) {
        if (!chart_is(chart, region, chart_parallel)) { // of which each region has to be
            const int32_t child =
                chart_is(chart, region, chart_compound) ? chart_active_child(chart, region) : 0;
            are_all = (child != 0) && chart_is(chart, child, chart_final);
            region = chart_state(chart, region, chart_last_descendant);
        }
        region = region + 1;
    }
    return are_all;
}

static void chart_forget_wishes(chart_step *chart)
{
    for (int32_t s = 0; s <= chart_head(chart, chart_state_count); ++s) {
        chart->wanted[s] = false;
        chart->begins[s] = false;
        chart->content[s] = 0;
    }
}

static void chart_enter_wanted(chart_step *chart)
{
    chart_complete_wishes(chart);
    for (int32_t s = 1; s <= chart_head(chart, chart_state_count); ++s) {
        const int32_t around = chart_state(chart, s, chart_parent);
        if (chart->wanted[s]) {
            if (chart_is(chart, around, chart_compound)) {
                const int32_t group = chart_state(chart, around, chart_group);
                chart->x[group] = (chart_number)s;
                chart->entered[group] = chart->time;
                chart->fresh[group] = true;
            }
            chart->passing = s;
            chart_perform(chart, chart_state(chart, s, chart_entry), (chart_number)0);
            if (chart->begins[s]) {
                chart_perform(chart, chart_state(chart, s, chart_begin_action), (chart_number)0);
            }
            chart_perform(chart, chart->content[s], (chart_number)0);
            if (chart_is(chart, s, chart_final) && (around != 0)) {
                const int32_t above = chart_state(chart, around, chart_parent);
                chart_happen(chart, chart_state(chart, around, chart_done_event));
                if (chart_is(chart, above, chart_parallel) && chart_are_final(chart, above)) {
                    chart_happen(chart, chart_state(chart, above, chart_done_event));
                }
            }
        }
    }
    chart->passing = 0;
}

static void chart_microstep(chart_step *chart)
{
    int32_t before = INT32_MAX;
    if (chart->chosen_count == 0) {
        return;
    }
    chart->microsteps = chart->microsteps + 1;
    chart->is_right = chart->is_right && (chart->microsteps < chart_most_microsteps);
    // Domains do not overlap; the last one in the document is left first.
    while (before >= 0) {
        int32_t next = -1;
        for (int32_t i = 0; i < chart->chosen_count; ++i) {
            const int32_t d = chart_transition(chart, chart->chosen[i], chart_domain);
            next = ((d < before) && (d > next)) ? d : next;
        }
        if (next >= 0) {
            const int32_t child = chart_active_child(chart, next);
            chart->domain = next;
            if (child != 0) {
                chart_leave(chart, child);
            }
        }
        before = next;
    }
    chart->domain = -1;
    chart->passing = 0;
    for (int32_t i = 0; i < chart->chosen_count; ++i) {
        chart_perform(chart, chart_transition(chart, chart->chosen[i], chart_action), chart->time_of[i]);
    }
    chart_forget_wishes(chart);
    for (int32_t i = 0; i < chart->chosen_count; ++i) {
        const int32_t domain = chart_transition(chart, chart->chosen[i], chart_domain);
        if (domain >= 0) {
            chart_want(chart, chart_transition(chart, chart->chosen[i], chart_goals), domain);
        }
    }
    chart_enter_wanted(chart);
}

#pragma once

#include "bf/kernels/chart_state.hpp"

namespace bf::kernels {

namespace chart {

/// One step of a chart.
template <class T, class L, class N> class Step : public Present<T, L, N> {
    using Base = Present<T, L, N>;

  public:
    using Base::Base;

    /// From the states before the step. `memory` has the times at which the active children were entered, the
    /// children that were active last, if there is a history, the variables, the times at which events are
    /// due, -1: none, and which events were raised. False: the chart does not come to rest, or too much was
    /// raised in one step.
    template <class X, class M, class B, class P>
    [[gnu::noinline]] bool run(const X& x, const M& memory, const B& started, const P& p) noexcept {
        const int n = head(compounds), V = head(variables), own = head(events) - head(event_inputs);
        int at = n;
        for (int c = 0; c < n; ++c) x_[c] = x[c], entry_[c] = memory[c], fresh_[c] = false;
        for (int c = 0; head(has_history) != 0 && c < n; ++c) last_[c] = memory[at++];
        for (int v = 0; v < V; ++v) cells_[v] = memory[at++];
        for (int k = 0; k < head(timers); ++k) due_[k] = memory[at++];
        for (int e = 0; e < own; ++e) pending_[e] = memory[at++], raised_[e] = 0;
        for (int i = 0; i < head(parameters); ++i) cells_[V + i] = p[i];
        cells_[V + head(parameters) + 1] = period_;
        cells_[V + head(parameters) + 2] = time_;
        if (!started[0]) begin(p);
        if (head(completes) != 0)
            complete();
        else if (!is_finished()) {
            for (int k = next_due(); k >= 0; k = next_due())
                pending_[at_(timers_at, k) - head(event_inputs) - 1] = 1;
            event_ = any_event;
            select();
            microstep();
        }
        stay(0);
        if (head(completes) != 0) settle(); // what these raise
        return is_right_;
    }

  private:
    using Base::at, Base::at_, Base::of, Base::head, Base::kind_of, Base::active_child, Base::child_of,
        Base::time_in, Base::is_fresh, Base::is_below, Base::is_finished, Base::value, Base::set_cells,
        Base::perform, Base::raise, Base::next_due, Base::table_, Base::u_, Base::time_, Base::period_,
        Base::x_, Base::entry_, Base::last_, Base::cells_, Base::due_, Base::pending_, Base::raised_,
        Base::time_of_, Base::fresh_, Base::is_wanted_, Base::is_default_, Base::content_, Base::chosen_,
        Base::queue_, Base::chosen_count_, Base::queued_, Base::taken_, Base::microsteps_, Base::event_,
        Base::passing_, Base::domain_, Base::is_right_, Base::any_event, Base::no_event;
    // ---- which transitions

    bool is_present(int event) const noexcept {
        if (event_ != any_event) return event == event_;
        const int inputs = head(event_inputs);
        if (event > inputs) return pending_[event - inputs - 1] != N(0);
        return is_input(event);
    }
    bool is_input(int event) const noexcept { return u_[head(event_port) + event - 1][0] != Element<L>(0); }
    bool is_triggered(int t) const noexcept {
        const int list = of(t, triggers);
        if (list == 0) return event_ <= no_event;
        for (int i = 1; event_ != no_event && i <= at(list); ++i)
            if (is_present(at(list + i))) return true;
        return false;
    }
    void select() noexcept {
        chosen_count_ = 0;
        select(0);
    }
    /// Of each active state without children the first transition that is enabled, innermost states first.
    void select(int s) noexcept {
        const Kind its = kind_of(s);
        if (its == Kind::compound) {
            if (const int child = active_child(s); child != 0) select(child);
        } else if (its == Kind::parallel) {
            for (int child = of(s, first_child); child != 0; child = of(child, next_sibling)) select(child);
        } else {
            for (; s != 0; s = of(s, parent)) {
                if (of(s, transition_count) == 0) continue;
                const N its_time = time_in(s);
                set_cells(its_time);
                for (int i = 0; i < of(s, transition_count); ++i) {
                    const int t = of(s, first_transition) + i, condition = of(t, guard);
                    if (is_triggered(t) && (condition == 0 || value(condition) != N(0)))
                        return choose(t, its_time);
                }
            }
        }
    }
    /// Of two that leave the same state the one of the inner state counts, or else the first.
    void choose(int t, const N& its_time) noexcept {
        int kept = 0;
        bool is_preempted = false, is_inner[most_chosen];
        for (int i = 0; i < chosen_count_; ++i) {
            if (chosen_[i] == t) return;
            const int a = of(t, domain), b = of(chosen_[i], domain);
            const bool conflicts = a >= 0 && b >= 0 && (a == b || is_below(a, b) || is_below(b, a));
            is_inner[i] = conflicts && is_below(of(t, source), of(chosen_[i], source));
            is_preempted = is_preempted || (conflicts && !is_inner[i]);
        }
        if (is_preempted) return;
        for (int i = 0; i < chosen_count_; ++i)
            if (!is_inner[i]) {
                chosen_[kept] = chosen_[i];
                time_of_[kept++] = time_of_[i];
            }
        chosen_[kept] = t;
        time_of_[kept] = its_time;
        chosen_count_ = kept + 1;
    }

    // ---- one microstep

    void microstep() noexcept {
        if (chosen_count_ == 0) return;
        is_right_ = is_right_ && ++microsteps_ < most_microsteps;
        // Domains do not overlap; the last one in the document is left first.
        for (int before = most_states + 1;;) {
            int next = -1;
            for (int i = 0; i < chosen_count_; ++i)
                if (const int d = of(chosen_[i], domain); d < before && d > next) next = d;
            if (next < 0) break;
            domain_ = next;
            if (const int child = active_child(next); child != 0) leave_state(child);
            before = next;
        }
        domain_ = -1, passing_ = 0;
        for (int i = 0; i < chosen_count_; ++i) perform(of(chosen_[i], action), time_of_[i]);
        forget_wishes();
        for (int i = 0; i < chosen_count_; ++i)
            if (of(chosen_[i], domain) >= 0) want_all(of(chosen_[i], goals), of(chosen_[i], domain));
        enter_wanted();
    }
    void leave_state(int s) noexcept {
        const Kind its = kind_of(s);
        const int c = of(s, compound);
        const N left = x_[c];
        if (its == Kind::compound) {
            const int child = active_child(s);
            if (child != 0) leave_state(child);
        } else if (its == Kind::parallel) {
            for (int done = most_states + 1;;) { // the last child first
                int next = 0;
                for (int child = of(s, first_child); child != 0; child = of(child, next_sibling))
                    if (child < done) next = child;
                if (next == 0) break;
                leave_state(next);
                done = next;
            }
        }
        passing_ = s;
        perform(of(s, leave), of(s, leave) == 0 ? N(0) : time_in(s));
        if (its == Kind::compound) {
            if (head(has_history) != 0) last_[c] = left;
            x_[c] = 0;
        }
        if (kind_of(of(s, parent)) == Kind::compound) x_[of(of(s, parent), compound)] = 0;
    }

    void forget_wishes() noexcept {
        for (int s = 0; s <= head(state_count); ++s) is_wanted_[s] = is_default_[s] = false, content_[s] = 0;
    }
    bool wants_below(int s) const noexcept {
        for (int d = s + 1; d <= of(s, last_descendant); ++d)
            if (is_wanted_[d]) return true;
        return false;
    }
    /// The states of a list and all that is entered with them, up to `around`.
    void want_all(int list, int around) noexcept {
        for (int i = 1; list != 0 && i <= at(list); ++i) want(at(list + i));
        for (int i = 1; list != 0 && i <= at(list); ++i) want_around(at(list + i), around);
    }
    void want(int s) noexcept {
        switch (kind_of(s)) {
        case Kind::shallow_history:
        case Kind::deep_history: return want_history(s);
        case Kind::compound: is_wanted_[s] = is_default_[s] = true; return want_all(of(s, targets), s);
        case Kind::parallel: is_wanted_[s] = true; return want_regions(s);
        default: is_wanted_[s] = true;
        }
    }
    void want_regions(int s) noexcept {
        for (int child = of(s, first_child); child != 0; child = of(child, next_sibling))
            if (!is_wanted_[child] && !wants_below(child)) want(child);
    }
    void want_around(int s, int around) noexcept {
        for (s = of(s, parent); s != around && s != 0; s = of(s, parent)) {
            is_wanted_[s] = true;
            if (kind_of(s) == Kind::parallel) want_regions(s);
        }
    }
    void want_history(int h) noexcept {
        const int s = of(h, parent);
        if (remembers(s)) return want_last(s, kind_of(h) == Kind::deep_history);
        content_[s] = of(h, begin_action);
        want_all(of(h, targets), s);
    }
    bool remembers(int s) const noexcept {
        if (kind_of(s) == Kind::compound) return last_child(s) != 0;
        for (int child = of(s, first_child); child != 0; child = of(child, next_sibling))
            if (kind_of(child) == Kind::compound && last_child(child) != 0) return true;
        return false;
    }
    int last_child(int s) const noexcept { return child_of(s, last_[of(s, compound)]); }
    /// The children of s that were active last; of a deep history theirs, too.
    void want_last(int s, bool is_deep) noexcept {
        if (kind_of(s) == Kind::compound) return want_again(last_child(s), is_deep);
        for (int child = of(s, first_child); child != 0; child = of(child, next_sibling))
            want_again(child, is_deep);
    }
    void want_again(int s, bool is_deep) noexcept {
        if (!is_deep || of(s, first_child) == 0) return want(s);
        is_wanted_[s] = true;
        want_last(s, is_deep);
    }

    void enter_wanted() noexcept {
        for (int s = 1; s <= head(state_count); ++s) {
            if (!is_wanted_[s]) continue;
            const int around = of(s, parent);
            if (kind_of(around) == Kind::compound) {
                const int c = of(around, compound);
                x_[c] = s, entry_[c] = time_, fresh_[c] = true;
            }
            passing_ = s;
            perform(of(s, entry), 0);
            if (is_default_[s]) perform(of(s, begin_action), 0);
            perform(content_[s], 0);
            if (kind_of(s) != Kind::final || around == 0) continue;
            raise(of(around, done_event));
            const int above = of(around, parent);
            if (kind_of(above) == Kind::parallel && are_final(above)) raise(of(above, done_event));
        }
        passing_ = 0;
    }
    /// Is each region in a final state?
    bool are_final(int s) const noexcept {
        for (int child = of(s, first_child); child != 0; child = of(child, next_sibling)) {
            const int its = kind_of(child) == Kind::compound ? active_child(child) : 0;
            if (its == 0 ? !(kind_of(child) == Kind::parallel && are_final(child))
                         : kind_of(its) != Kind::final)
                return false;
        }
        return true;
    }

    // ---- one step

    template <class P> void begin(const P& p) noexcept {
        for (int c = 0; c < head(compounds); ++c) x_[c] = last_[c] = 0;
        for (int v = 0; v < head(variables); ++v) cells_[v] = table_[head(initial_at) + v];
        for (int k = 0; k < head(timers); ++k) due_[k] = -1;
        if (head(is_flat) != 0) {
            x_[0] = p[0], entry_[0] = time_, fresh_[0] = true;
            return;
        }
        forget_wishes();
        perform(of(0, begin_action), 0);
        want_all(of(0, targets), 0);
        enter_wanted();
    }
    /// Microsteps without an event and with the events that they raise, until there are none; then the same
    /// with each event from outside.
    void complete() noexcept {
        // What is due has happened, even if an answer to an input sends it anew.
        int due[most_timers], due_count = 0;
        for (int k = next_due(); k >= 0; k = next_due()) due[due_count++] = at_(timers_at, k);
        settle();
        for (int e = 1; e <= head(event_inputs); ++e)
            if (is_input(e)) answer(e);
        for (int i = 0; i < due_count; ++i) answer(due[i]);
        for (int k = next_due(); k >= 0 && is_right_; k = next_due()) answer(at_(timers_at, k));
    }
    void answer(int event) noexcept {
        if (!is_right_ || is_finished()) return;
        event_ = event;
        select();
        microstep();
        settle();
    }
    void settle() noexcept {
        while (is_right_ && !is_finished()) {
            event_ = no_event;
            select();
            if (chosen_count_ == 0) {
                if (taken_ == queued_) return;
                event_ = queue_[taken_++ % most_queued];
                select();
            }
            microstep();
        }
    }
    /// The actions of states that stay active, from the outside in.
    void stay(int s) noexcept {
        if (of(s, during) != 0 && !is_fresh(s)) perform(of(s, during), time_in(s));
        if (kind_of(s) == Kind::parallel) {
            for (int child = of(s, first_child); child != 0; child = of(child, next_sibling)) stay(child);
        } else if (kind_of(s) == Kind::compound && head(is_flat) == 0) {
            if (const int child = active_child(s); child != 0) stay(child);
        }
    }
};

template <class T, class L, class N>
Step<T, L, Element<N>> step_of(const T& table, const L& u, const N& time, const N& period) noexcept {
    return {table, u, time[0], period[0]};
}

inline constexpr char failure[] =
    "the chart does not come to rest: more than 200 microsteps in a step, or more "
    "than 32 events that wait";

} // namespace chart

/// State machine without variables: number of the innermost active state of each region, the time since its
/// entry [s], and whether it was entered in this step. See chart::Step for the operands.
struct StateMachine {
    static constexpr const char* name = "bf::kernels::StateMachine{}";
    static constexpr const auto& failure = chart::failure;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S, class E, class M, class P, class X, class R, class B, class T, class D,
              class L>
    bool operator()(const Y& state, const S& time_in_state, const E& entered, const M& table, const P& p,
                    const X& x, const R& memory, const B& started, const T& time, const D& period,
                    const L& u) const noexcept {
        auto step = chart::step_of(table, u, time, period);
        const bool is_right = step.run(x, memory, started, p);
        step.write_regions(state, time_in_state, entered);
        return is_right;
    }
};

/// The same with the values of its variables.
struct Chart {
    static constexpr const char* name = "bf::kernels::Chart{}";
    static constexpr const auto& failure = chart::failure;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S, class E, class V, class M, class P, class X, class R, class B, class T,
              class D, class L>
    bool operator()(const Y& state, const S& time_in_state, const E& entered, const V& variables,
                    const M& table, const P& p, const X& x, const R& memory, const B& started, const T& time,
                    const D& period, const L& u) const noexcept {
        auto step = chart::step_of(table, u, time, period);
        const bool is_right = step.run(x, memory, started, p);
        step.write_regions(state, time_in_state, entered);
        step.write_variables(variables);
        return is_right;
    }
};

/// Next states of a chart. It takes the step that the outputs showed once more, as rules of a block share
/// only what its signals and states hold; to hand on what a step did would take a second copy of its memory.
struct ChartUpdate {
    static constexpr const char* name = "bf::kernels::ChartUpdate{}";
    static constexpr const auto& failure = chart::failure;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class N, class S, class M, class P, class X, class R, class B, class T, class D,
              class L>
    bool operator()(const Y& next_x, const N& next_memory, const S& next_started, const M& table, const P& p,
                    const X& x, const R& memory, const B& started, const T& time, const D& period,
                    const L& u) const noexcept {
        auto step = chart::step_of(table, u, time, period);
        const bool is_right = step.run(x, memory, started, p);
        step.write(next_x, next_memory);
        next_started[0] = true;
        return is_right;
    }
};

/// Which states of a chart are active, from the active state of each region: these and all around them.
struct ActiveStates {
    static constexpr const char* name = "bf::kernels::ActiveStates{}";
    template <class Y, class M, class S>
    void operator()(const Y& active, const M& table, const S& state) const noexcept {
        const auto of = [&](int s, chart::State column) {
            return static_cast<int>(
                table[static_cast<int>(table[chart::states_at]) + s * chart::state_columns + column]);
        };
        for (int s = 1; s <= active.size(); ++s) {
            bool is_one = false;
            for (int r = 0; r < state.size(); ++r)
                is_one = is_one || (state[r] >= s && state[r] <= of(s, chart::last_descendant));
            active[s - 1] = is_one;
        }
    }
};

} // namespace bf::kernels

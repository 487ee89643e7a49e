#pragma once

#include "bf/kernels/expression.hpp"

#include <cstdint>

/// State charts: hierarchical states with actions, parallel regions, history, events and timers, as a table
/// of numbers and one step over it. States, transitions and their order are those of W3C, "State Chart XML
/// (SCXML): State Machine Notation for Control Abstraction", 2015, appendix D; charts are Harel's
/// ("Statecharts: a visual formalism for complex systems", Sci. Comput. Program. 8, 1987).
namespace bf::kernels {

namespace chart {

#include "bf/kernels/chart_table.h"

inline constexpr int chart_most_states = 1000, chart_most_compounds = 48, chart_most_variables = 64,
                     chart_most_cells = 160, chart_most_events = 64, chart_most_timers = 16,
                     chart_most_chosen = 32;

/// The list of inputs of a chart as its numbers N, whatever their type is: a step is compiled once for all.
template <class N> class Inputs {
  public:
    template <class L>
    explicit Inputs(const L& list) noexcept
        : list_(&list), element_([](const void* l, int i, int k) noexcept {
              return static_cast<N>((*static_cast<const L*>(l))[i][k]);
          }),
          size_([](const void* l, int i) noexcept { return (*static_cast<const L*>(l))[i].size(); }) {}

    struct Input {
        const Inputs& all;
        int i;
        N operator[](int k) const noexcept { return all.element_(all.list_, i, k); }
        int size() const noexcept { return all.size_(all.list_, i); }
    };
    Input operator[](int i) const noexcept { return {*this, i}; }

  private:
    const void* list_;
    N (*element_)(const void* list, int i, int k) noexcept;
    int (*size_)(const void* list, int i) noexcept;
};

/// One step of a chart. T: table, N: numbers.
template <class T, class N> class Step {
  public:
    template <class L>
    Step(const T& table, const L& inputs, const N& time, const N& period) noexcept
        : from_{table, Inputs<N>(inputs)} {
        chart_prepare(&chart_, &from_, time, period);
    }

    /// See chart_run in chart_step.h. False: the step fails.
    [[gnu::noinline]] bool run(const N* x, const N* memory, bool was_started, const N* p) noexcept {
        return chart_run(&chart_, x, memory, was_started, p);
    }
    [[gnu::noinline]] void keep(N* x, N* memory) const noexcept { chart_keep(&chart_, x, memory); }

    /// Of each region the innermost active state that is not in a region of its own, 0: none; how long it has
    /// been active, and whether it was entered in this step.
    template <class Y, class S, class E>
    [[gnu::noinline]] void write_regions(const Y& state, const S& time_in_state,
                                         const E& entered) const noexcept {
        for (int r = 0; r < chart_head(&chart_, chart_regions); ++r) {
            std::int32_t shown = 0;
            state[r] = chart_active_in(&chart_, r, &shown);
            entered[r] = shown != 0 && chart_is_fresh(&chart_, shown);
            time_in_state[r] = shown != 0 ? chart_time_in(&chart_, shown) : N(0);
        }
    }
    template <class V> void write_variables(const V& values) const noexcept {
        for (int v = 0; v < chart_head(&chart_, chart_variables); ++v) values[v] = chart_.cells[v];
    }

  private:
    using chart_number = N;
    struct chart_numbers {
        const T& table;
        const Inputs<N> inputs;
    };
    static int chart_at(const chart_numbers* from, int place) noexcept {
        return static_cast<int>(from->table[place]);
    }
    static N chart_initial_value(const chart_numbers* from, int v) noexcept {
        return N(from->table[chart_at(from, chart_initial_at) + v]);
    }
    static bool chart_is_input(const chart_numbers* from, int event) noexcept {
        return from->inputs[chart_at(from, chart_event_port) + event - 1][0] != N(0);
    }
    [[gnu::noinline]] static N chart_value(const chart_numbers* from, const N* cells, int code) noexcept {
        const int at = chart_at(from, chart_formulas_at) + code; // one copy: it has all operations inside
        return Expression::value(View<const Element<T>>(from->table.data + at, chart_at(from, at - 1)),
                                 View<const N>(cells, chart_most_cells), from->inputs, 0,
                                 [](Operation, auto, auto) {});
    }
#include "bf/kernels/chart_state.h"

#include "bf/kernels/chart_microstep.h"

#include "bf/kernels/chart_step.h"

    chart_numbers from_;
    chart_step chart_;
};

template <class T, class L, class N>
Step<T, Element<N>> step_of(const T& table, const L& u, const N& time, const N& period) noexcept {
    return {table, u, time[0], period[0]};
}

inline constexpr char failure[] =
    "the chart does not come to rest: more than 200 microsteps in a step, or more than 32 events that wait";

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
        const bool is_right = step.run(x.data, memory.data, bool(started[0]), p.data);
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
        const bool is_right = step.run(x.data, memory.data, bool(started[0]), p.data);
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
        const bool is_right = step.run(x.data, memory.data, bool(started[0]), p.data);
        step.keep(next_x.data, next_memory.data);
        next_started[0] = true;
        return is_right;
    }
};

/// Which states of a chart are active, from the active state of each region: these and all around them.
struct ActiveStates {
    static constexpr const char* name = "bf::kernels::ActiveStates{}";
    template <class Y, class M, class S>
    void operator()(const Y& active, const M& table, const S& state) const noexcept {
        const auto of = [&](int s, int column) {
            return static_cast<int>(table[static_cast<int>(table[chart::chart_states_at]) +
                                          s * chart::chart_state_columns + column]);
        };
        for (int s = 1; s <= active.size(); ++s) {
            bool is_one = false;
            for (int r = 0; r < state.size(); ++r)
                is_one = is_one || (state[r] >= s && state[r] <= of(s, chart::chart_last_descendant));
            active[s - 1] = is_one;
        }
    }
};

} // namespace bf::kernels

// A chart that is stepped as its block is.
#pragma once

#include "bf/charts/table.hpp"
#include "bf/kernels/chart.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace bf::charts::test {

using Numbers = std::vector<double>;

inline kernels::View<double> view(Numbers& x) { return {x.data(), static_cast<int>(x.size())}; }
inline kernels::View<const double> view(const Numbers& x) { return {x.data(), static_cast<int>(x.size())}; }

/// What is said of a document in JSON that no chart can be made of, a line each.
inline std::string refusal(const std::string& text) {
    try {
        lower(read(text, ""));
    } catch (const Refused& refused) {
        std::string all;
        for (const auto& problem : refused.problems()) all += (all.empty() ? "" : "\n") + problem;
        return all;
    }
    return "nothing";
}

class Machine {
  public:
    explicit Machine(Table its) : table(std::move(its)) {
        inputs.assign(std::max<std::size_t>(table.ports.size(), 1), {0});
        x.assign(static_cast<std::size_t>(table.compounds), 0);
        memory.assign(static_cast<std::size_t>(table.memory), 0);
        state.assign(table.regions.size(), 0);
        time_in_state = entered = state;
        values.assign(static_cast<std::size_t>(table.numbers[kernels::chart::chart_variables]), 0);
    }

    /// False: the chart does not come to rest.
    bool step(double at) {
        std::vector<kernels::View<const double>> views;
        for (const auto& u : inputs) views.push_back(view(u));
        const kernels::ListView<const double> u(views.data(), static_cast<int>(views.size()));
        const Numbers time{at}, period{0.1}, old_x = x, old_memory = memory, was_started = started;
        const auto run = [&](auto kernel, const auto&... written) {
            return kernel(written..., view(std::as_const(table.numbers)), view(p), view(old_x),
                          view(old_memory), view(was_started), view(time), view(period), u);
        };
        const bool is_right =
            run(kernels::Chart{}, view(state), view(time_in_state), view(entered), view(values));
        return run(kernels::ChartUpdate{}, view(x), view(memory), view(started)) && is_right;
    }
    /// The active state of each region.
    std::string names() const {
        std::string all;
        for (const double number : state)
            all += (all.empty() ? "" : " ") +
                   (number > 0 ? table.states[static_cast<std::size_t>(number) - 1] : "-");
        return all;
    }

    Table table;
    Numbers p{1}, state, time_in_state, entered, values;
    std::vector<Numbers> inputs;

  private:
    Numbers x, memory, started{0};
};

} // namespace bf::charts::test

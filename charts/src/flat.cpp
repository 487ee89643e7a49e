// State machines without hierarchy are charts.
#include "bf/base/numbers.hpp"
#include "bf/charts/table.hpp"
#include "bf/kernels/chart.hpp"

#include <algorithm>

namespace bf::charts {

std::string port_name(const std::string& event) {
    std::string name = event;
    std::ranges::replace(name, '.', '_');
    return name;
}

Table lower_flat(const std::vector<std::string>& states, const std::vector<double>& rows) {
    // Conditions are elements of one input, so that the rows are transitions with formulas over it.
    Chart chart;
    const std::size_t count = rows.size() / 4;
    chart.inputs = {"conditions"};
    for (std::size_t s = 0; s < states.size(); ++s)
        chart.root.states.push_back({.name = "s" + std::to_string(s + 1)});
    for (std::size_t i = 0; i < count; ++i) {
        Transition t{.to = {"s" + number_text(rows[i + count])}};
        if (rows[i + 2 * count] > 0) t.condition = "conditions(" + number_text(rows[i + 2 * count]) + ")";
        if (rows[i + 3 * count] > 0) t.after = number_text(rows[i + 3 * count]);
        chart.root.states[static_cast<std::size_t>(rows[i]) - 1].transitions.push_back(std::move(t));
    }
    Table table = lower(chart);
    table.numbers[kernels::chart::chart_is_flat] = 1;
    table.states = states;
    return table;
}

} // namespace bf::charts

#include "chart.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/charts/chart.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace bf::editor {

namespace {

const Value* argument(const DiagramNode& node, std::string_view name) {
    const auto found = std::ranges::find(node.arguments, name, &std::pair<std::string, Value>::first);
    return found == node.arguments.end() ? nullptr : &found->second;
}

/// What is wired to a block's input; null: nothing. An end without a port is the only input, the first one.
const model::Endpoint* source_of(const model::System& system, const std::string& block,
                                 const std::string& input, bool is_first = true) {
    for (const auto& connection : system.connections)
        for (const auto& to : connection.to)
            if (to.block == block && (to.port == input || (is_first && to.port.empty())))
                return &connection.from;
    return nullptr;
}

/// How many elements an input has, as far as that is known.
int count_of(const DiagramNode* node, const Diagram& diagram, const std::string& input) {
    if (!node) return 1;
    const int slot = node->block->declaration().find(input, Role::input);
    if (slot < 0) return 1;
    const Node::End source = node->sources[static_cast<std::size_t>(slot)];
    if (source.node < 0 || !diagram.slot(source).size_known) return 1;
    return diagram.slot(source).size.count();
}

StateKind kind_of(const charts::State& state) {
    using Kind = charts::State::Kind;
    switch (state.kind) {
    case Kind::parallel: return StateKind::with_regions;
    case Kind::final: return StateKind::final;
    case Kind::shallow_history: return StateKind::shallow_history;
    case Kind::deep_history: return StateKind::deep_history;
    case Kind::junction: return StateKind::junction;
    default: return state.states.empty() ? StateKind::plain : StateKind::with_states;
    }
}

} // namespace

model::Chart chart_of(const model::Block& block, const DiagramNode* node) {
    if (auto chart = model::chart_of(block)) return *chart;
    model::Chart chart;
    const Value* const states = node ? argument(*node, "states") : nullptr;
    if (!states) return chart;
    chart.states = states->texts;
    const auto place = [&](double number) {
        return static_cast<std::size_t>(std::clamp(number, 1.0, static_cast<double>(chart.states.size()))) -
               1;
    };
    const Value* const rows = argument(*node, "transitions");
    for (int i = 0; rows && rows->cols == 4 && i < rows->rows; ++i) {
        const auto entry = [&](int column) {
            return rows->data[static_cast<std::size_t>(i + column * rows->rows)];
        };
        chart.transitions.push_back(
            {place(entry(0)), place(entry(1)), number_text(entry(2)), number_text(entry(3))});
    }
    return chart;
}

std::optional<Level> level_of(const model::Block& block, const std::string& folder,
                              const std::string& inside) {
    const model::Setting* const setting = block.find_setting(model::chart_setting);
    if (!model::has_chart(block) || !setting) return {};
    try {
        const charts::Chart document = charts::read(setting->value.text, folder);
        const charts::State* around = &document.root;
        for (std::string rest = inside; !rest.empty();) {
            const std::string name = rest.substr(0, rest.find('.'));
            rest.erase(0, name.size() + 1);
            const auto found = std::ranges::find(around->states, name, &charts::State::name);
            if (found == around->states.end()) return {};
            around = &*found;
        }
        if (around->states.empty()) return {};
        Level level;
        const std::vector<std::string> paths = charts::state_paths(document);
        for (const auto& state : around->states) {
            level.chart.states.push_back(state.name);
            level.kinds.push_back(kind_of(state));
            const auto found =
                std::ranges::find(paths, inside.empty() ? state.name : inside + "." + state.name);
            level.numbers.emplace_back();
            if (found != paths.end()) level.numbers.back() = static_cast<int>(found - paths.begin()) + 1;
        }
        // Histories and junctions are never active.
        const auto first = std::ranges::find_if(level.numbers, [](const auto& n) { return n.has_value(); });
        if (first != level.numbers.end())
            level.chart.initial = static_cast<std::size_t>(first - level.numbers.begin());
        // The state of this level that a path leads into.
        const auto place_of = [&](const std::string& path) -> std::optional<std::size_t> {
            const auto rest = inside.empty() ? std::optional("." + path) : rest_under(path, inside);
            if (!rest || rest->empty()) return {};
            const std::string name = rest->substr(1, rest->find('.', 1) - 1);
            const auto found = std::ranges::find(level.chart.states, name);
            if (found == level.chart.states.end()) return {};
            return static_cast<std::size_t>(found - level.chart.states.begin());
        };
        if (!around->initial.empty())
            level.chart.initial =
                place_of(inside.empty() ? around->initial[0] : inside + "." + around->initial[0]).value_or(0);
        std::map<std::string, int> counts; // of the transitions of each state
        for (const auto& arc : charts::arcs(document)) {
            const int number = ++counts[arc.from];
            const auto from = place_of(arc.from);
            int goals = 0;
            const bool is_of_this_level =
                from && arc.from == (inside.empty() ? "" : inside + ".") + level.chart.states[*from];
            for (const std::string& goal : arc.to.empty() ? std::vector{arc.from} : arc.to)
                if (const auto to = place_of(goal); from && to && (*from != *to || is_of_this_level)) {
                    level.chart.transitions.push_back({*from, *to, charts::label_of(*arc.transition), "0"});
                    std::string name = inside.empty() ? arc.from : arc.from.substr(inside.size() + 1);
                    name += "." + std::to_string(number);
                    level.names.push_back(++goals > 1 ? name + "." + std::to_string(goals) : name);
                }
        }
        return level;
    } catch (const charts::Refused&) {
        return {};
    }
}

std::vector<std::string> condition_names(const model::Block& block, const model::System& system,
                                         const Diagram& diagram, const FindNode& find_node) {
    constexpr int most = 1000;
    std::vector<std::string> names;
    const auto add = [&](const model::Endpoint& source, const std::string& reader, const std::string& input) {
        const int count =
            std::min(count_of(find_node(reader), diagram, input), most - static_cast<int>(names.size()));
        for (int i = 1; i <= count; ++i)
            names.push_back(source.text() + (count > 1 ? "(" + std::to_string(i) + ")" : ""));
    };
    const std::string input = "conditions";
    const model::Endpoint* const source = source_of(system, block.name, input);
    if (!source) return names;
    const model::Block* const mux = source->block.empty() ? nullptr : system.find_block(source->block);
    if (!mux || mux->type != "Mux") {
        add(*source, block.name, input);
        return names;
    }
    for (int i = 1;; ++i) {
        const std::string port = "u" + std::to_string(i);
        const model::Endpoint* const part = source_of(system, mux->name, port, i == 1);
        if (!part) return names;
        add(*part, mux->name, port);
    }
}

std::string label_of(const model::Transition& transition, const std::vector<std::string>& conditions) {
    std::string label;
    if (transition.condition != "0") {
        const auto number = number_of(transition.condition);
        const bool is_known = number && *number >= 1 && *number <= static_cast<double>(conditions.size()) &&
                              std::trunc(*number) == *number;
        label = "[" +
                (is_known ? conditions[static_cast<std::size_t>(*number) - 1]
                          : "condition " + transition.condition) +
                "]";
    }
    if (transition.minimum_time != "0")
        label += (label.empty() ? "after " : " after ") + transition.minimum_time + " s";
    return label;
}

std::vector<Shape> arrow_along(const std::vector<Point>& points) {
    const Point end = points.back(), last = points[points.size() - 2];
    const double dx = (last.x > end.x) - (last.x < end.x),
                 dy = (last.y > end.y) - (last.y < end.y); // back along it
    return {{Shape::Kind::line, Style::wire, points},
            {Shape::Kind::polygon,
             Style::branch,
             {end,
              {end.x + 8 * dx + 4 * dy, end.y + 8 * dy + 4 * dx},
              {end.x + 8 * dx - 4 * dy, end.y + 8 * dy - 4 * dx}}}};
}

} // namespace bf::editor

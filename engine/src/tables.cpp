// What a run says of itself: its quantities, rates and plots, by their names.
#include "bf/base/numbers.hpp"
#include "bf/engine/simulation.hpp"

#include <algorithm>

namespace bf {

static_assert(constant_rate == 0, "as bf::Quantity says");

recording::ChannelInfo channel_info(const Diagram& diagram, const Node::End& end) {
    const Slot& slot = diagram.slot(end);
    const int rate = std::max(diagram.nodes[static_cast<std::size_t>(end.node)].rate, constant_rate);
    recording::ChannelInfo info;
    info.type = element_type(slot.type);
    info.rows = static_cast<std::uint32_t>(slot.size.rows);
    info.cols = static_cast<std::uint32_t>(slot.size.cols);
    info.is_matrix = slot.size.is_matrix;
    if (slot.unit.kind == Unit::Kind::exact && slot.unit.text != "1") info.unit = slot.unit.text;
    info.doc = slot.doc;
    info.period = diagram.period(rate);
    for (const auto& named : diagram.enumerated)
        if (named.end.node == end.node && named.end.slot == end.slot) info.names = named.names;
    info.element_names = diagram.element_names(end);
    info.is_held = !diagram.rates[static_cast<std::size_t>(rate)].is_continuous;
    return info;
}

Quantity Simulation::quantity(const SignalName& name) const {
    return {name.path, diagram_.slot(name.end).type, channel_info(diagram_, name.end),
            std::max(diagram_.nodes[static_cast<std::size_t>(name.end.node)].rate, constant_rate),
            static_cast<std::byte*>(const_cast<Context&>(context_).data(name.end.node, name.end.slot))};
}

std::vector<Quantity> Simulation::quantities(const std::vector<SignalName>& names) const {
    std::vector<Quantity> all;
    all.reserve(names.size());
    for (const auto& name : names) all.push_back(quantity(name));
    return all;
}

std::vector<Quantity> Simulation::parameters() const {
    std::vector<Quantity> all;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            const Slot& slot = slots[i];
            if (slot.role != Role::parameter) continue;
            const Node::End end{static_cast<int>(n), static_cast<int>(i)};
            Quantity& added = all.emplace_back(quantity({diagram_.end_path(end), end}));
            added.given.resize(added.info.bytes());
            write_values(added.given.data(), slot.type, slot.size.count(), slot.initial);
        }
    }
    return all;
}

namespace {

/// All of a value, which two values do not share.
std::string text_of(const Value& value) {
    if (value.kind == Value::Kind::text) return "'" + value.text + "'";
    std::string text = "[";
    if (value.kind == Value::Kind::texts) {
        for (const auto& one : value.texts) text += (text.size() > 1 ? " '" : "'") + one + "'";
        return text + "]";
    }
    if (value.data.size() == 1) return number_text(value.data[0]);
    for (int i = 0; i < value.rows; ++i) {
        if (i > 0) text += "; ";
        for (int j = 0; j < value.cols; ++j)
            text +=
                (j > 0 ? " " : "") + number_text(value.data[static_cast<std::size_t>(j * value.rows + i)]);
    }
    return text + "]";
}

} // namespace

std::vector<GivenArgument> Simulation::arguments() const {
    std::vector<GivenArgument> all;
    for (const auto& node : diagram_.nodes)
        for (const auto& [name, value] : node.arguments) all.push_back({node.path, name, text_of(value)});
    return all;
}

std::vector<Quantity> Simulation::outside() const {
    std::vector<SignalName> names = diagram_.inputs;
    for (const int node : context_.devices()) {
        const auto& slots = diagram_.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (const Node::End end{node, static_cast<int>(i)}; slots[i].role == Role::output)
                names.push_back({diagram_.end_path(end), end});
    }
    return quantities(names);
}

std::vector<RunRate> Simulation::rates() const {
    std::vector<RunRate> all;
    for (std::size_t r = 0; r < diagram_.rates.size(); ++r) {
        const bool is_continuous = diagram_.rates[r].is_continuous;
        all.push_back({is_continuous ? 0 : diagram_.period(static_cast<int>(r)), is_continuous});
    }
    return all;
}

std::vector<RunPanel> Simulation::plots() const {
    std::vector<RunPanel> all;
    for (const auto& panel : diagram_.plots) {
        RunPanel& added = all.emplace_back(RunPanel{panel.title, {}});
        for (const auto& signal : panel.signals) added.signals.push_back(signal.path);
    }
    return all;
}

std::string Simulation::not_for_real_time() const { return bf::not_for_real_time(diagram_); }

std::string not_for_real_time(const Diagram& diagram) {
    std::string reasons;
    for (const auto& loop : diagram.plan.loops)
        if (loop.kind == Loop::Kind::algebraic)
            reasons +=
                "\n  " + loop.path +
                ": it stands in an algebraic loop, which is iterated until its equations hold, as often as "
                "that takes; put a UnitDelay into the loop";
    if (is_adaptive(diagram.solver.method) && !diagram.plan.derivatives.empty()) {
        std::string name;
        for (const auto& [text, method] : solver_methods)
            if (method == diagram.solver.method) name = text;
        reasons +=
            "\n  the solver '" + name +
            "' chooses its own steps, as many as it takes; choose one with fixed steps, e.g. solver: rk4";
    }
    return reasons.empty() ? reasons : "the time of a step is not bounded:" + reasons;
}

} // namespace bf

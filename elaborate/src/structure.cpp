#include "bf/elaborate/structure.hpp"

#include "bf/core/hash.hpp"
#include "bf/core/rule.hpp"

namespace bf {

namespace {

template <class... T> void add(std::string& text, const T&... numbers) {
    ((text += std::to_string(static_cast<std::int64_t>(numbers)) + " "), ...);
}
void add(std::string& text, const Node::End& end) { add(text, end.node, end.slot); }

void add(std::string& text, const std::vector<Call>& rules) {
    for (const Call& call : rules) {
        text += std::string(call.kernel) + " ";
        add(text, call.list_from, call.list_size, call.operands.size());
        for (const auto& operand : call.operands) add(text, operand.source, operand.slot, operand.is_written);
    }
    text += ";";
}

void add(std::string& text, const std::vector<Segment>& segments) {
    for (const auto& segment : segments) {
        add(text, segment.rate, segment.condition);
        for (const auto& a : segment.activities) add(text, a.node, a.index, a.condition, a.loop);
        text += ";";
    }
}

std::string text_of(const DiagramNode& node) {
    std::string text = node.type + " ";
    const auto& m = node.methods;
    add(text, node.rate, node.condition, node.loop, m.reset, m.output, m.update, m.derivative, m.guards,
        m.event);
    const auto& d = node.block->declaration();
    const auto& slots = node.block->resolution().slots;
    for (std::size_t s = 0; s < slots.size(); ++s) {
        const Slot& slot = slots[s];
        text += slot.name + " ";
        add(text, slot.role, slot.type, slot.initial_from);
        if (slot.role == Role::input) add(text, node.sources[s]);
    }
    for (const Phase phase : phases) add(text, d.rules(phase));
    return text;
}

std::string text_of(const Condition& c) {
    std::string text;
    add(text, c.parent, c.trigger_edge, c.reset_edge, c.rate, c.triggered_rate, c.loop, c.resets_states);
    for (const auto& end : {c.enable, c.trigger, c.reset}) add(text, end);
    for (const int node : c.nodes) add(text, node);
    for (const auto& outlet : c.outlets) {
        add(text, outlet.end);
        add(text, outlet.initial_from);
        add(text, outlet.resets);
    }
    return text;
}

std::string text_of(const Loop& l) {
    std::string text;
    add(text, l.kind, l.parent, l.condition, l.rate, l.resets_states, l.iterations);
    for (const auto& end : {l.count, l.initial, l.again}) add(text, end);
    for (const int counter : l.counters) add(text, counter);
    for (const auto& end : l.unknowns) add(text, end);
    add(text, l.outputs);
    add(text, l.updates);
    return text;
}

} // namespace

std::vector<StructurePart> structure_of(const Diagram& diagram) {
    std::vector<StructurePart> parts;
    const auto part = [&](const std::string& name, const std::string& text) {
        const std::string all = name + "\n" + text;
        parts.push_back({name, fnv1a(std::as_bytes(std::span(all)))});
    };
    for (const auto& node : diagram.nodes) part(node.path, text_of(node));
    for (const auto& condition : diagram.conditions) part(condition.path, text_of(condition));
    std::string rates = matlab::number_text(diagram.step) + " ", ends, order;
    for (const auto& rate : diagram.rates)
        add(rates, rate.ticks, rate.offset, rate.is_constant, rate.is_continuous, rate.trigger);
    add(rates, diagram.solver.method);
    part("sample times", rates);
    for (const auto* signals : {&diagram.inputs, &diagram.outputs})
        for (const auto& signal : *signals) {
            ends += signal.path + " ";
            add(ends, signal.end);
        }
    part("inputs and outputs", ends);
    for (const auto* segments :
         {&diagram.plan.outputs, &diagram.plan.updates, &diagram.plan.derivatives, &diagram.plan.guards})
        add(order, *segments);
    part("order of execution", order);
    for (const auto& loop : diagram.plan.loops) part(loop.path, text_of(loop));
    return parts;
}

} // namespace bf

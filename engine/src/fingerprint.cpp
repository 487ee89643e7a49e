// What tells diagrams apart whose snapshots do not fit.
#include "bf/core/hash.hpp"
#include "bf/engine/simulation.hpp"

#include <span>
#include <string_view>
#include <type_traits>

namespace bf {

namespace {

/// Hashes values one after the other; texts with their length, so that no two sequences look alike.
class Hash {
  public:
    template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T> Hash& operator<<(T value) {
        value_ = fnv1a(std::as_bytes(std::span(&value, 1)), value_);
        return *this;
    }
    Hash& operator<<(std::string_view text) {
        *this << text.size();
        value_ = fnv1a(std::as_bytes(std::span<const char>(text)), value_);
        return *this;
    }
    Hash& operator<<(const Node::End& end) { return *this << end.node << end.slot; }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = fnv1a({});
};

void add(Hash& hash, const std::vector<Call>& rules) {
    hash << rules.size();
    for (const auto& rule : rules) {
        hash << rule.kernel << rule.list_size;
        for (const auto& operand : rule.operands) {
            hash << operand.source << operand.slot;
            if (operand.constants)
                for (const double x : *operand.constants) hash << x;
        }
    }
}

void add(Hash& hash, const std::vector<Segment>& segments) {
    hash << segments.size();
    for (const auto& segment : segments) {
        hash << segment.rate << segment.condition;
        for (const auto& activity : segment.activities)
            hash << activity.node << activity.index << activity.condition << activity.loop;
    }
}

} // namespace

std::uint64_t fingerprint(const Diagram& diagram) {
    Hash hash;
    hash << diagram.step << diagram.solver.method << diagram.nodes.size();
    for (const auto& node : diagram.nodes) {
        const Declaration& d = node.block->declaration();
        hash << node.path << node.type << node.condition << node.rate << d.slots.size();
        for (const auto& slot : node.block->resolution().slots)
            hash << slot.role << slot.name << slot.type << slot.size.rows << slot.size.cols;
        for (const auto& source : node.sources) hash << source;
        for (const auto& provider : node.providers) hash << provider;
        for (const Phase phase : phases) add(hash, d.rules(phase));
    }
    for (const auto& rate : diagram.rates)
        hash << rate.ticks << rate.offset << rate.is_constant << rate.is_continuous << rate.trigger;
    for (const auto& condition : diagram.conditions)
        hash << condition.path << condition.parent << condition.enable << condition.trigger << condition.reset
             << condition.trigger_edge << condition.reset_edge << condition.loop << condition.resets_states;
    for (const auto& loop : diagram.plan.loops) {
        hash << loop.kind << loop.path << loop.parent << loop.condition << loop.rate << loop.iterations
             << loop.count << loop.initial << loop.again;
        for (const auto& end : loop.unknowns) hash << end;
        add(hash, loop.outputs);
        add(hash, loop.updates);
    }
    const Plan& plan = diagram.plan;
    for (const auto* phase : {&plan.outputs, &plan.updates, &plan.derivatives, &plan.guards})
        add(hash, *phase);
    return hash.value();
}

} // namespace bf

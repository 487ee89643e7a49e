// One diagram goes on where another one is.
#include "bf/engine/handover.hpp"

#include "bf/base/numbers.hpp"
#include "machine.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace bf {

namespace {

/// Bytes of a snapshot that are neither signals nor parameters, states or clocks: what blocks keep outside.
std::size_t outside_bytes(const Simulation& run) {
    const Context& context = run.context();
    return context.snapshot_size() - context.signal_bytes() - context.parameter_bytes() -
           context.state_bytes() - run.diagram().rates.size() * sizeof(Clock);
}

std::vector<const DiagramNode*> nodes_with_objects(const Diagram& diagram) {
    std::vector<const DiagramNode*> found;
    for (const auto& node : diagram.nodes)
        if (!node.block->declaration().objects.empty()) found.push_back(&node);
    return found;
}

/// It is saved as a whole, in the order of the document: either all of it has the same place in both, or
/// none.
bool have_same_outside(const Simulation& a, const Simulation& b) {
    const auto is_same = [](const DiagramNode* one, const DiagramNode* other) {
        return one->path == other->path && one->type == other->type;
    };
    return outside_bytes(a) == outside_bytes(b) &&
           std::ranges::equal(nodes_with_objects(a.diagram()), nodes_with_objects(b.diagram()), is_same);
}

/// The node of the same path and type; -1: there is none.
int counterpart(const Diagram& diagram, const DiagramNode& node) {
    const int found = diagram.find_node(node.path);
    return found >= 0 && diagram.nodes[static_cast<std::size_t>(found)].type == node.type ? found : -1;
}

const std::vector<Slot>& slots_of(const Diagram& diagram, int node) {
    return diagram.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
}

/// The slot of the same name and role; -1: there is none.
int counterpart(const std::vector<Slot>& slots, const Slot& slot) {
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].name == slot.name && slots[i].role == slot.role) return static_cast<int>(i);
    return -1;
}

bool fits(const Slot& a, const Slot& b) {
    return a.type == b.type && a.size.rows == b.size.rows && a.size.cols == b.size.cols;
}

std::string form_of(const Slot& slot) {
    return std::to_string(slot.size.rows) + "x" + std::to_string(slot.size.cols) + " " + name(slot.type);
}

} // namespace

Handover handover(const Simulation& before, const Simulation& after) {
    const Diagram &from = before.diagram(), &to = after.diagram();
    Handover found;
    for (const auto& node : from.nodes) {
        const int other = counterpart(to, node);
        for (const auto& slot : node.block->resolution().slots) {
            if (!is_state(slot.role)) continue;
            const std::string state = "'" + node.path + "." + slot.name + "'";
            const int index = other < 0 ? -1 : counterpart(slots_of(to, other), slot);
            if (index < 0)
                found.lost.push_back(state + " is no longer there");
            else if (const Slot& its = to.slot({other, index}); !fits(slot, its))
                found.lost.push_back(state + " is " + form_of(its) + " and was " + form_of(slot));
        }
    }
    for (const auto& node : to.nodes) {
        const int other = counterpart(from, node);
        for (const auto& slot : node.block->resolution().slots)
            if (is_state(slot.role) && (other < 0 || counterpart(slots_of(from, other), slot) < 0))
                found.begun.push_back(node.path + "." + slot.name);
    }
    if (outside_bytes(before) > 0 && !have_same_outside(before, after))
        found.lost.push_back("what blocks keep outside of the diagram, such as the state of a physics world");
    return found;
}

void Simulation::Machine::go_on_from(const Machine& other) {
    const auto& mine = simulation_.diagram_;
    const auto& its = other.simulation_.diagram_;
    const auto path = [](const Diagram& diagram, int condition) -> const std::string& {
        return diagram.conditions[static_cast<std::size_t>(condition)].path;
    };
    const auto is_of_condition = [](const program::Flag& flag) {
        return flag.kind == program::Flag::Kind::enabled || flag.kind == program::Flag::Kind::triggered;
    };
    for (std::size_t i = 0; i < flags_.size(); ++i)
        for (std::size_t k = 0; k < other.flags_.size(); ++k) {
            const program::Flag &a = program_.flags[i], &b = other.program_.flags[k];
            if (is_of_condition(a) && a.kind == b.kind && path(mine, a.number) == path(its, b.number))
                flags_[i] = other.flags_[k];
        }
    for (std::size_t i = 0; i < memories_.size(); ++i)
        for (std::size_t k = 0; k < other.memories_.size(); ++k) {
            const program::Memory &a = program_.memories[i], &b = other.program_.memories[k];
            if (a.is_reset == b.is_reset && path(mine, a.condition) == path(its, b.condition) &&
                memories_[i].last.size() == other.memories_[k].last.size())
                memories_[i].last = other.memories_[k].last;
        }
    const std::int64_t steps = simulation_.steps_;
    for (std::size_t i = 0; i < counters_.size(); ++i) {
        const SampleRate& rate = mine.rates[static_cast<std::size_t>(counters_[i].rate)];
        const std::int64_t since = steps - rate.offset; // the rate is hit at multiples of its ticks
        const std::int64_t hits = since <= 0 ? 0 : (since - 1) / rate.ticks + 1;
        until_hit_[i] = rate.offset + hits * rate.ticks - steps;
        Clock& clock = context_.clock(counters_[i].rate);
        clock.step = hits - 1;
        if (hits > 0) clock.time = static_cast<double>(rate.offset + (hits - 1) * rate.ticks) * mine.step;
    }
    for (const auto& condition : mine.conditions)
        for (const auto& before : its.conditions)
            if (condition.path == before.path && condition.triggered_rate >= 0 && before.triggered_rate >= 0)
                context_.clock(condition.triggered_rate) = other.context_.clock(before.triggered_rate);
}

void Simulation::go_on_from(const Simulation& other) {
    const double time = other.time();
    const auto steps = std::llround(time / diagram_.step);
    if (std::abs(static_cast<double>(steps) * diagram_.step - time) > 1e-9 * std::max(1.0, time))
        throw RunError("t = " + number_text(time) + " s lies within a step of " + number_text(diagram_.step) +
                       " s; go on from a multiple of it, or start anew");
    steps_ = steps;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const int its = counterpart(other.diagram_, diagram_.nodes[n]);
        if (its < 0 || diagram_.nodes[n].rate == constant_rate) continue;
        const auto& slots = slots_of(diagram_, static_cast<int>(n));
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (!is_state(slots[i].role) && slots[i].role != Role::output) continue;
            const int k = counterpart(slots_of(other.diagram_, its), slots[i]);
            if (k < 0 || !fits(slots[i], other.diagram_.slot({its, k}))) continue;
            const auto size = static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type));
            const int node = static_cast<int>(n), slot = static_cast<int>(i);
            std::memcpy(context_.data(node, slot), other.context_.data(its, k), size);
            if (slots[i].role == Role::discrete_state)
                std::memcpy(context_.next_data(node, slot), other.context_.data(its, k), size);
        }
    }
    if (const auto size = static_cast<std::ptrdiff_t>(outside_bytes(*this));
        size > 0 && have_same_outside(other, *this)) {
        std::vector<std::byte> own(context_.snapshot_size()), its(other.context_.snapshot_size());
        context_.save(own.data());
        other.context_.save(its.data());
        std::copy(its.end() - size, its.end(), own.end() - size);
        context_.restore(own.data());
    }
    machine_->go_on_from(*other.machine_);
    if (!machine_->run(machine_->constants)) throw RunError(failure());
    for (auto& held : held_) std::memcpy(held.last.data(), held.now, held.last.size());
    for (auto& seen : seen_) std::memcpy(seen.last.data(), seen.now, seen.last.size());
    std::fill(guard_before_.begin(), guard_before_.end(), std::numeric_limits<double>::quiet_NaN());
    if (solver_) solver_->set_history(time, {});
    must_restart_ = true;
}

} // namespace bf

// Subsystems that do not always run: enabled, triggered, reset.
#include "states.hpp"

#include <algorithm>
#include <limits>

namespace bf {

namespace {

bool is_edge(model::Edge edge, double before, double now) {
    const bool rises = before <= 0 && now > 0, falls = before > 0 && now <= 0;
    switch (edge) {
    case model::Edge::rising: return rises;
    case model::Edge::falling: return falls;
    case model::Edge::either: return rises || falls;
    case model::Edge::level: break;
    }
    return now > 0;
}

} // namespace

ControlSignal::ControlSignal(const Diagram& diagram, Context& context, const Node::End& end, model::Edge edge)
    : edge_(edge) {
    if (end.node < 0) return;
    const Slot& slot = diagram.slot(end);
    data_ = context.data(end.node, end.slot);
    type_ = slot.type;
    before_.assign(static_cast<std::size_t>(slot.size.count()), std::numeric_limits<double>::quiet_NaN());
}

bool ControlSignal::is_on() const {
    for (std::size_t i = 0; i < before_.size(); ++i)
        if (read_value(data_, type_, static_cast<int>(i)) > 0) return true;
    return false;
}

/// The first look only remembers: nothing changed yet. A level counts at once.
bool ControlSignal::has_edge() {
    bool is_found = false;
    for (std::size_t i = 0; i < before_.size(); ++i) {
        const double now = read_value(data_, type_, static_cast<int>(i));
        is_found = is_found || is_edge(edge_, before_[i], now);
        before_[i] = now;
    }
    return is_found;
}

bool ControlSignal::was_on() const {
    return std::any_of(before_.begin(), before_.end(), [](double value) { return value > 0; });
}

void ControlSignal::forget() {
    std::fill(before_.begin(), before_.end(), std::numeric_limits<double>::quiet_NaN());
}

Status Simulation::ConditionState::test() {
    if (simulation->is_minor_) return ok;
    const auto& condition = simulation->diagram_.conditions[static_cast<std::size_t>(index)];
    const bool enabled = !enable.is_given() || enable.is_on();
    // A function call counts once per step; an edge that was seen at this instant still counts.
    const bool is_call = condition.trigger_edge == model::Edge::level;
    const bool ran = condition.triggered_rate >= 0 && simulation->is_hit(condition.triggered_rate);
    const bool fires =
        !trigger.is_given() || ran || (!(is_call && simulation->is_at_event_) && trigger.has_edge());
    // A level that ends between the base steps held the states until then.
    const bool ends =
        simulation->is_at_event_ && condition.reset_edge == model::Edge::level && reset.was_on();
    const bool resets = reset.is_given() && (reset.has_edge() || ends);
    if (!enabled && is_enabled) disable();
    const bool is_new = enabled && !is_enabled;
    is_enabled = enabled;
    is_true = enabled && fires;
    if (is_enabled && ((is_new && condition.resets_states) || resets)) {
        simulation->must_restart_ = true;
        if (const Status status = simulation->reset_nodes(condition.nodes); !status) return status;
    }
    if (is_true && !ran && condition.triggered_rate >= 0) fire(condition.triggered_rate);
    return ok;
}

/// A triggered subsystem sees as its period the time since it ran before.
void Simulation::ConditionState::fire(int rate) {
    Clock& clock = simulation->context_.clock(rate);
    const double t = simulation->time();
    clock.period = clock.step < 0 ? 0 : t - clock.time;
    clock.time = t;
    clock.trigger = 1;
    ++clock.step;
    simulation->hit_[static_cast<std::size_t>(rate)] = 1;
}

void Simulation::ConditionState::disable() {
    is_enabled = is_true = false;
    auto& conditions = simulation->diagram_.conditions;
    for (const auto& outlet : conditions[static_cast<std::size_t>(index)].outlets)
        if (outlet.resets) simulation->diagram_.write_initial(outlet, simulation->context_);
    for (const int node : conditions[static_cast<std::size_t>(index)].nodes) simulation->clear_rates(node);
    for (std::size_t c = 1; c < conditions.size(); ++c)
        if (conditions[c].parent == index && simulation->conditions_[c]->is_enabled)
            simulation->conditions_[c]->disable();
}

void Simulation::bind_conditions() {
    for (std::size_t c = 0; c < diagram_.conditions.size(); ++c) {
        const auto& condition = diagram_.conditions[c];
        const auto signal = [&](const Node::End& end, model::Edge edge) {
            return ControlSignal(diagram_, context_, end, edge);
        };
        conditions_.push_back(std::make_unique<ConditionState>(
            ConditionState{this, static_cast<int>(c), signal(condition.enable, model::Edge::level),
                           signal(condition.trigger, condition.trigger_edge),
                           signal(condition.reset, condition.reset_edge)}));
    }
    conditions_[0]->is_true = conditions_[0]->is_enabled = true;
}

Task Simulation::condition_task(int condition) {
    return {[](const void* p, int) {
                return const_cast<ConditionState*>(static_cast<const ConditionState*>(p))->test();
            },
            conditions_[static_cast<std::size_t>(condition)].get(), 0};
}

bool Simulation::is_active(int condition) const {
    return conditions_[static_cast<std::size_t>(condition)]->is_true;
}

void Simulation::reset_conditions() {
    for (std::size_t c = 1; c < conditions_.size(); ++c) {
        auto& condition = *conditions_[c];
        condition.is_true = condition.is_enabled = false;
        condition.trigger.forget();
        condition.reset.forget();
    }
}

void Simulation::clear_trigger(std::size_t rate) noexcept {
    hit_[rate] = 0;
    conditions_[static_cast<std::size_t>(diagram_.rates[rate].trigger)]->is_true = false;
}

std::vector<double> Simulation::save_conditions() const {
    std::vector<double> saved;
    for (const auto& condition : conditions_) {
        saved.push_back(condition->is_true);
        saved.push_back(condition->is_enabled);
        for (const auto* signal : {&condition->trigger, &condition->reset})
            saved.insert(saved.end(), signal->before().begin(), signal->before().end());
    }
    return saved;
}

void Simulation::restore_conditions(const std::vector<double>& saved) {
    const double* from = saved.data();
    for (auto& condition : conditions_) {
        condition->is_true = *from++ != 0;
        condition->is_enabled = *from++ != 0;
        for (auto* signal : {&condition->trigger, &condition->reset})
            for (double& value : signal->before()) value = *from++;
    }
}

} // namespace bf

// Continuous time inside a base step: integration and events.
#include "machine.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace bf {

namespace {
/// Sets a flag while it lives.
struct Raised {
    bool& flag;
    explicit Raised(bool& f) : flag(f) { flag = true; }
    ~Raised() { flag = false; }
};
constexpr int most_events = 1000; ///< in one base step
} // namespace

void Simulation::bind_guards() {
    for (const auto& [end, condition, is_control, is_answered] : program_.watched) {
        const Slot& slot = diagram_.slot(end);
        const auto count = static_cast<std::size_t>(slot.size.count());
        const auto& slots = diagram_.nodes[static_cast<std::size_t>(end.node)].block->resolution().slots;
        const bool has_states = std::any_of(slots.begin(), slots.end(),
                                            [](const Slot& s) { return s.role == Role::continuous_state; });
        guard_bindings_.push_back({end.node, program_.active[static_cast<std::size_t>(condition)],
                                   context_.data(end.node, end.slot), slot.type, guard_values_.size(), count,
                                   is_control, is_answered,
                                   !is_control && slot.type != Type::float64 && has_states});
        guard_values_.resize(guard_values_.size() + count);
    }
    guard_before_.resize(guard_values_.size());
    edges_.resize(guard_values_.size());
    crossed_.resize(guard_values_.size());
}

/// What may change under the solver's feet: signals of other rates and discrete states of continuous blocks.
void Simulation::find_held(const std::vector<char>& is_needed) {
    const auto is_continuous = [&](const DiagramNode& node) {
        return diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous &&
               !node.block->declaration().traits.is_root_input;
    };
    const auto hold = [&](int node, int slot, bool is_signal) {
        const Slot& s = diagram_.slot({node, slot});
        const auto* now = static_cast<const std::byte*>(context_.data(node, slot));
        for (const auto& known : held_)
            if (known.now == now) return;
        held_.push_back({now,
                         std::vector<std::byte>(static_cast<std::size_t>(s.size.count() * bytes(s.type))),
                         is_signal});
    };
    const auto hold_source = [&](const Node::End& from) {
        if (from.node < 0) return;
        const auto& source = diagram_.nodes[static_cast<std::size_t>(from.node)];
        if (source.rate != constant_rate && !is_continuous(source)) hold(from.node, from.slot, true);
    };
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& node = diagram_.nodes[n];
        if (!is_needed[n] || !is_continuous(node)) continue;
        for (const auto& from : node.sources) hold_source(from);
        const auto& slots = node.block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::discrete_state) hold(static_cast<int>(n), static_cast<int>(i), false);
    }
    for (const auto& condition : diagram_.conditions)
        for (const auto& signal : {condition.enable, condition.trigger, condition.reset}) hold_source(signal);
}

/// Stretches of memory from one output of the continuous rate to another: what else lies in them does not
/// change while the solver runs. Left out is where the next step begins with what was evaluated last: a
/// conditional subsystem holds it, and a solution of an algebraic loop is near it.
void Simulation::find_seen() {
    std::vector<char> is_left_out(diagram_.nodes.size());
    for (std::size_t n = 0; n < is_left_out.size(); ++n) is_left_out[n] = diagram_.nodes[n].condition > 0;
    for (const auto& loop : diagram_.plan.loops)
        for (const int node : loop.nodes) is_left_out[static_cast<std::size_t>(node)] = 1;
    bool goes_on = false;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& node = diagram_.nodes[n];
        goes_on = goes_on && !is_left_out[n];
        if (is_left_out[n] || !diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous) continue;
        const auto& slots = node.block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::output) continue;
            auto* now = static_cast<std::byte*>(context_.data(static_cast<int>(n), static_cast<int>(i)));
            if (!goes_on) seen_.push_back({now, {}});
            seen_.back().last.resize(static_cast<std::size_t>(now - seen_.back().now) +
                                     static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type)));
            goes_on = true;
        }
    }
}

/// Since it was asked before.
Simulation::Change Simulation::held_change() noexcept {
    auto change = Change::none;
    for (auto& held : held_) {
        if (std::memcmp(held.last.data(), held.now, held.last.size()) == 0) continue;
        std::memcpy(held.last.data(), held.now, held.last.size());
        change = std::max(change, held.is_signal ? Change::jump : Change::memory);
    }
    return change;
}

ContinuousSystem Simulation::continuous_system() {
    return {.x = context_.continuous_state(),
            .rate = context_.continuous_rate(),
            .guards = guard_values_,
            .derivatives =
                [this](double t) {
                    // The first stage of a fixed step stands where the outputs of the step were computed.
                    const bool is_current = !is_adaptive(diagram_.solver.method) &&
                                            t == static_cast<double>(steps_) * diagram_.step;
                    return is_current ? machine_->run(machine_->derivatives) : find_slopes(t);
                },
            .evaluate_guards =
                [this](double t, bool is_current) {
                    return (is_current || evaluate_inside(t)) && evaluate_guards();
                },
            .has_samples = !held_.empty()};
}

void Simulation::set_continuous_time(double t) noexcept {
    for (std::size_t r = 1; r < diagram_.rates.size(); ++r)
        if (diagram_.rates[r].is_continuous) context_.clock(static_cast<int>(r)).time = t;
}

/// Outputs of the continuous rate at an instant inside the step, as far as the solver needs them.
bool Simulation::evaluate_inside(double t) noexcept {
    set_continuous_time(t);
    return machine_->run(machine_->inside);
}

/// The same, and the derivatives there.
bool Simulation::find_slopes(double t) noexcept {
    set_continuous_time(t);
    return machine_->run(machine_->slopes);
}

bool Simulation::evaluate_guards() noexcept {
    if (!machine_->run(machine_->guards)) return false;
    for (const auto& guard : guard_bindings_)
        for (std::size_t i = 0; i < guard.count; ++i) {
            double& value = guard_values_[guard.first + i];
            value = is_watched(guard) ? read_value(guard.data, guard.type, static_cast<int>(i))
                                      : std::numeric_limits<double>::quiet_NaN();
            // Subsystems run above 0, so 0 lies on the other side: as near as a number that comes to it may
            // (its product with another guard must not underflow in a solver that compares signs by it), and
            // as far as 1 for what jumps, so that a crossing is found by halves.
            if (guard.counts() && !std::isnan(value)) value = value == edges_[guard.first + i] ? 1 : -1;
            if (guard.is_control && value == 0) value = guard.type == Type::float64 ? -1e-100 : -1;
        }
    return true;
}

/// Do the subsystems around it run?
bool Simulation::is_watched(const GuardBinding& guard) const noexcept {
    return (guard.active < 0 || machine_->flag(guard.active) != 0) && !guard.is_sliding;
}

bool Simulation::crossed(const GuardBinding& guard) const noexcept {
    const auto from = crossed_.begin() + static_cast<std::ptrdiff_t>(guard.first);
    return std::any_of(from, from + static_cast<std::ptrdiff_t>(guard.count),
                       [](std::int8_t direction) { return direction != 0; });
}

bool Simulation::crossed(int node) const noexcept {
    return std::any_of(guard_bindings_.begin(), guard_bindings_.end(), [&](const auto& guard) {
        return guard.node == node && guard.is_answered && crossed(guard);
    });
}

bool Simulation::has_crossed(bool is_answered) const noexcept {
    return std::any_of(guard_bindings_.begin(), guard_bindings_.end(), [&](const auto& guard) {
        return (guard.is_answered || !is_answered) && crossed(guard);
    });
}

/// The guards of a node read how they crossed.
void Simulation::show_directions(int node) noexcept {
    for (const auto& guard : guard_bindings_)
        if (guard.node == node && guard.is_answered)
            std::copy_n(crossed_.begin() + static_cast<std::ptrdiff_t>(guard.first), guard.count,
                        static_cast<double*>(guard.data));
}

/// Do crossings follow each other so closely that time would hardly go on? Then the run ends. States that
/// both sides of a jump of their derivative lead back to it slide along it: the solver goes on with steps
/// that its error control finds short enough, and does not look for the jump until the end of the base step.
bool Simulation::accumulates(double t, int events) noexcept {
    for (auto& guard : guard_bindings_) {
        if (!crossed(guard)) continue;
        auto& recent = guard.recent;
        recent.close = t - recent.last < 1e-4 * diagram_.step ? recent.close + 1 : 0;
        recent.last = t;
        guard.is_sliding = guard.may_slide && recent.close >= 3;
        const bool is_close = recent.close == 3 && !guard.may_slide;
        if (events == most_events || (is_close && guard.counts()))
            return !fail(
                Status::failure("it jumps or crosses zero more often than {} times in one base step: give "
                                "the model a shorter 'step', or let the signal change less often",
                                events == most_events ? most_events : 10000),
                guard.node);
        if (is_close)
            return !fail(Status::failure("its zero crossings accumulate (Zeno behaviour or chattering): let "
                                         "the block rest below a small speed, or give it hysteresis"),
                         guard.node);
    }
    return false;
}

/// What counts crosses where it differs from now.
void Simulation::count_edges() noexcept {
    for (const auto& guard : guard_bindings_)
        for (std::size_t i = 0; guard.counts() && i < guard.count; ++i) {
            edges_[guard.first + i] = read_value(guard.data, guard.type, static_cast<int>(i));
            if (is_watched(guard)) guard_values_[guard.first + i] = guard_before_[guard.first + i] = 1;
        }
}

/// Which guards crossed since they were compared before.
bool Simulation::find_crossings() noexcept {
    if (!evaluate_guards()) return false;
    for (std::size_t i = 0; i < crossed_.size(); ++i)
        crossed_[i] = static_cast<std::int8_t>(program::crossing(guard_before_[i], guard_values_[i]));
    guard_before_ = guard_values_;
    count_edges();
    return true;
}

/// The solver found them.
bool Simulation::take_crossings() noexcept {
    if (!evaluate_guards()) return false;
    std::copy(solver_->crossings().begin(), solver_->crossings().end(), crossed_.begin());
    guard_before_ = guard_values_;
    count_edges();
    return true;
}

void Simulation::observe_event() noexcept {
    const Raised event(shows_event_);
    observe();
}

/// The first continuous state that is not finite, or would not be a moment after t, before which a solver
/// gives up; or -1.
int Simulation::lost_state(double t, bool looks_ahead) noexcept {
    const auto x = context_.continuous_state(), rate = context_.continuous_rate();
    const auto found = [&] {
        const auto at = std::find_if(x.begin(), x.end(), [](double value) { return !std::isfinite(value); });
        return at == x.end() ? -1 : static_cast<int>(at - x.begin());
    };
    const double moment = 1e-6 * diagram_.step;
    for (int looks = looks_ahead ? 2 : 0; found() < 0 && looks > 0; --looks, t += moment) {
        if (!find_slopes(t)) break;
        for (std::size_t i = 0; i < x.size(); ++i) x[i] += moment * rate[i];
    }
    return found();
}

/// Whose state slides along a jump of its derivative at t, where a solver gave up; or -1. It was found to, or
/// jumps a moment after: the steps of a solver may all end on one side.
int Simulation::sliding_node(double t) noexcept {
    for (const auto& guard : guard_bindings_)
        if (guard.is_sliding) return guard.node;
    const double moment = 1e-4 * diagram_.step;
    if (!find_slopes(t) || !evaluate_guards()) return -1;
    guard_before_ = guard_values_;
    const auto x = context_.continuous_state(), rate = context_.continuous_rate();
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += moment * rate[i];
    if (!evaluate_inside(t + moment) || !evaluate_guards()) return -1;
    for (const auto& guard : guard_bindings_)
        for (std::size_t i = guard.first; guard.may_slide && i < guard.first + guard.count; ++i)
            if (guard_values_[i] != guard_before_[i]) return guard.node;
    return -1;
}

bool Simulation::integrate(Status lost) noexcept {
    const bool is_good = advance_to(static_cast<double>(steps_ + 1) * diagram_.step, lost);
    show_what_was_seen();
    return is_good;
}

bool Simulation::advance_to(double end, Status lost) noexcept {
    double t = time();
    const Change change = held_change();
    if (must_restart_ || change == Change::jump)
        solver_->restart(t);
    else if (change == Change::memory)
        solver_->resume(t);
    must_restart_ = false;
    const auto x = context_.continuous_state();
    for (int events = 0;;) {
        const auto outcome = solver_->advance(t, end);
        if (outcome == Solver::Outcome::failed && !status_) return false;
        if (const int state = lost_state(t, outcome == Solver::Outcome::failed); state >= 0)
            return fail(lost, owner(Role::continuous_state, x.data() + state));
        if (outcome == Solver::Outcome::failed) {
            if (const int node = sliding_node(t); node >= 0)
                return fail(Status::failure("its state slides along a jump of its derivative, which takes "
                                            "steps as short as the tolerances ask: use larger ones, or "
                                            "dormand_prince45 where this is another solver"),
                            node);
            const int worst = solver_->worst_state();
            return fail(solver_->failure(), worst < 0 ? -1 : owner(Role::continuous_state, x.data() + worst));
        }
        if (outcome == Solver::Outcome::reached) {
            for (auto& guard : guard_bindings_) guard.is_sliding = false;
            set_continuous_time(end);
            return machine_->run(machine_->arrive);
        }
        std::copy(solver_->crossings().begin(), solver_->crossings().end(), crossed_.begin());
        if (accumulates(t, ++events)) return false;
        set_continuous_time(t);
        const Raised event(is_at_event_);
        event_time_ = t;
        if (!machine_->run(machine_->event)) return false;
        held_change();
        solver_->restart(t);
        must_restart_ = false;
    }
}

} // namespace bf

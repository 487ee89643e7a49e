// Continuous time inside a base step: integration and events.
#include "bf/engine/simulation.hpp"

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
constexpr int most_events = 1000; ///< in one base step, or at one instant
} // namespace

void Simulation::bind_guards() {
    // Between fixed steps nothing is located: only who answers a crossing needs to know of it.
    const bool locates = is_adaptive(diagram_.solver.method);
    for (const auto& segment : guards_) {
        int last = -1;
        for (const int node : segment.nodes) {
            if (node == last) continue;
            last = node;
            const auto& block = diagram_.nodes[static_cast<std::size_t>(node)];
            const auto& slots = block.block->declaration().slots;
            const bool has_states = std::any_of(slots.begin(), slots.end(), [](const Slot& slot) {
                return slot.role == Role::continuous_state;
            });
            for (std::size_t i = 0; i < slots.size(); ++i) {
                if (slots[i].role != Role::guard) continue;
                // What counts only marks where a solver must stop.
                const bool counts = slots[i].type != Type::float64;
                const bool has_event = block.methods.event && !counts;
                if (!locates && !has_event) continue;
                const auto count = static_cast<std::size_t>(slots[i].size.count());
                guard_bindings_.push_back({node, segment.condition, context_.data(node, static_cast<int>(i)),
                                           slots[i].type, guard_values_.size(), count, false, has_event,
                                           counts && has_states});
                guard_values_.resize(guard_values_.size() + count);
            }
        }
    }
    // Continuous signals that control subsystems are watched as they are.
    for (const auto& condition : diagram_.conditions)
        for (const auto& signal : {condition.enable, condition.trigger, condition.reset}) {
            if (!locates || signal.node < 0) continue;
            const int rate = diagram_.nodes[static_cast<std::size_t>(signal.node)].rate;
            if (!diagram_.rates[static_cast<std::size_t>(rate)].is_continuous) continue;
            const Slot& slot = diagram_.slot(signal);
            const auto count = static_cast<std::size_t>(slot.size.count());
            guard_bindings_.push_back({signal.node, condition.parent, context_.data(signal.node, signal.slot),
                                       slot.type, guard_values_.size(), count, true, false, false});
            guard_values_.resize(guard_values_.size() + count);
        }
    guard_before_.resize(guard_values_.size());
    edges_.resize(guard_values_.size());
    crossed_.resize(guard_values_.size());
}

/// The solver asks for no other outputs inside a step.
void Simulation::bind_minor_outputs(const std::vector<char>& is_needed) {
    for (const auto& segment : outputs_) {
        if (!diagram_.rates[static_cast<std::size_t>(segment.rate)].is_continuous) continue;
        BoundSegment minor{segment.rate, segment.condition, {}, {}};
        for (std::size_t i = 0; i < segment.tasks.size(); ++i) {
            const int node = segment.nodes[i];
            if (node >= 0 && !is_needed[static_cast<std::size_t>(node)]) continue;
            minor.tasks.push_back(segment.tasks[i]);
            minor.nodes.push_back(node);
        }
        if (!minor.tasks.empty()) minor_outputs_.push_back(std::move(minor));
    }
}

/// What may change under the solver's feet: signals of other rates and discrete states of continuous blocks.
void Simulation::find_held(const std::vector<char>& is_needed) {
    const auto is_continuous = [&](const DiagramNode& node) {
        return diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous && node.type != "Inport";
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
        const auto& slots = node.block->declaration().slots;
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
        const auto& slots = node.block->declaration().slots;
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
                    const Raised minor(is_minor_);
                    // The first stage of a fixed step stands where the outputs of the step were computed.
                    const bool is_current = !is_adaptive(diagram_.solver.method) &&
                                            t == static_cast<double>(steps_) * diagram_.step;
                    return (is_current || evaluate_minor_outputs(t)) && evaluate_derivatives();
                },
            .evaluate_guards =
                [this](double t, bool is_current) {
                    const Raised minor(is_minor_);
                    return (is_current || evaluate_outputs(t)) && evaluate_guards();
                },
            .has_samples = !held_.empty()};
}

/// Is the rate hit at an instant inside the step? Triggers fire there.
bool Simulation::runs_inside(int rate) const noexcept {
    const auto& r = diagram_.rates[static_cast<std::size_t>(rate)];
    return r.is_continuous || (r.trigger > 0 && is_hit(rate));
}

bool Simulation::has_fired() const noexcept {
    for (std::size_t r = 1; r < hit_.size(); ++r)
        if (diagram_.rates[r].trigger > 0 && hit_[r]) return true;
    return false;
}

void Simulation::set_continuous_time(double t) noexcept {
    for (std::size_t r = 1; r < hit_.size(); ++r)
        if (diagram_.rates[r].is_continuous) context_.clock(static_cast<int>(r)).time = t;
}

bool Simulation::evaluate_minor_outputs(double t) noexcept {
    const Raised again(is_again_);
    set_continuous_time(t);
    for (const auto& segment : minor_outputs_)
        if (is_active(segment.condition) && !run(segment)) return false;
    return true;
}

/// Outputs of the continuous rate, and of what it triggers, at an instant inside the step.
bool Simulation::evaluate_outputs(double t) noexcept {
    const Raised again(is_again_);
    set_continuous_time(t);
    for (const auto& segment : outputs_)
        if (runs_inside(segment.rate) && is_active(segment.condition) && !run(segment)) return false;
    return true;
}

/// A solver may have evaluated last somewhere else. What a conditional subsystem holds when it is disabled at
/// t is its output of that instant.
bool Simulation::finish_outputs(double t) noexcept {
    if (!must_finish_outputs_) return true;
    const Raised minor(is_minor_);
    return evaluate_outputs(t);
}

bool Simulation::evaluate_derivatives() noexcept {
    for (const auto& segment : derivatives_)
        if (is_active(segment.condition) && !run(segment)) return false;
    return true;
}

bool Simulation::evaluate_guards() noexcept {
    for (const auto& segment : guards_)
        if (is_active(segment.condition) && !run(segment)) return false;
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

bool Simulation::crossed(const GuardBinding& guard) const noexcept {
    const auto from = crossed_.begin() + static_cast<std::ptrdiff_t>(guard.first);
    return std::any_of(from, from + static_cast<std::ptrdiff_t>(guard.count),
                       [](std::int8_t direction) { return direction != 0; });
}

bool Simulation::is_watched(const GuardBinding& guard) const noexcept {
    return is_active(guard.condition) && !guard.is_sliding;
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
                Status::failure("it jumps or crosses zero more often than {} times in one base step: "
                                "give the model a shorter 'step', or let the signal change less often",
                                events == most_events ? most_events : 10000),
                guard.node);
        if (is_close)
            return !fail(
                Status::failure(
                    "its zero crossings accumulate (Zeno behaviour or chattering): let the block rest "
                    "below a small speed, or give it hysteresis"),
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

/// Which guards crossed since they were compared before; true if any did.
bool Simulation::compare_guards() noexcept {
    bool is_crossed = false;
    for (std::size_t i = 0; i < crossed_.size(); ++i) {
        crossed_[i] = crossing(guard_before_[i], guard_values_[i]);
        is_crossed = is_crossed || crossed_[i] != 0;
    }
    guard_before_ = guard_values_;
    return is_crossed;
}

/// Crossings between the last look and this step: those of a fixed-step solver, and jumps.
bool Simulation::find_crossings() noexcept {
    if (!evaluate_guards()) return false;
    const bool is_crossed = compare_guards();
    count_edges();
    return !is_crossed || answer_crossings(time(), false);
}

/// x⁺ of the blocks whose guards crossed, until nothing more crosses at this instant.
bool Simulation::answer_crossings(double t, bool is_inside_step) noexcept {
    must_restart_ = true;
    if (std::none_of(guard_bindings_.begin(), guard_bindings_.end(),
                     [&](const auto& guard) { return guard.has_event && crossed(guard); })) {
        if (is_inside_step && has_fired()) observe_event();
        return true;
    }
    for (int round = 0;; ++round) {
        int first = -1;
        observe_event();
        for (std::size_t g = 0; g < guard_bindings_.size();) {
            const auto& guard = guard_bindings_[g];
            if (guard.is_control) break; // these come last
            bool is_crossed = false;
            for (; g < guard_bindings_.size() && guard_bindings_[g].node == guard.node &&
                   !guard_bindings_[g].is_control;
                 ++g)
                for (std::size_t i = 0; guard_bindings_[g].has_event && i < guard_bindings_[g].count; ++i) {
                    const auto direction = crossed_[guard_bindings_[g].first + i];
                    static_cast<double*>(guard_bindings_[g].data)[i] = direction;
                    is_crossed = is_crossed || direction != 0;
                }
            if (!is_crossed) continue;
            if (first < 0) first = guard.node;
            if (const Status status = context_.event(guard.node); !status) return fail(status, guard.node);
        }
        if (!evaluate_outputs(t) || !evaluate_guards()) return false;
        if (!compare_guards()) break;
        if (round == most_events)
            return fail(
                Status::failure("its zero crossings answer one another without end: {} times at one instant; "
                                "give one of the blocks a dead band or hysteresis",
                                round),
                first);
    }
    if (is_inside_step) observe_event();
    return true;
}

/// Observers see an event as a hit of the continuous rate, and of what it triggers, alone.
void Simulation::observe_event() noexcept {
    const Raised event(shows_event_);
    for (std::size_t r = 1; r < hit_.size(); ++r) hit_at_event_[r] = runs_inside(static_cast<int>(r));
    hit_.swap(hit_at_event_);
    observe();
    hit_.swap(hit_at_event_);
}

/// The first continuous state that is NaN, or would be a moment after t, before which a solver gives up; or
/// -1.
int Simulation::nan_state(double t, bool looks_ahead) noexcept {
    const auto x = context_.continuous_state(), rate = context_.continuous_rate();
    const auto found = [&] {
        const auto at = std::find_if(x.begin(), x.end(), [](double value) { return std::isnan(value); });
        return at == x.end() ? -1 : static_cast<int>(at - x.begin());
    };
    const double moment = 1e-6 * diagram_.step;
    for (int looks = looks_ahead ? 2 : 0; found() < 0 && looks > 0; --looks, t += moment) {
        const Raised minor(is_minor_);
        if (!evaluate_minor_outputs(t) || !evaluate_derivatives()) break;
        for (std::size_t i = 0; i < x.size(); ++i) x[i] += moment * rate[i];
    }
    return found();
}

bool Simulation::integrate(double t) noexcept {
    const Change change = held_change();
    if (must_restart_ || change == Change::jump)
        solver_->restart(t);
    else if (change == Change::memory)
        solver_->resume(t);
    must_restart_ = false;
    const double end = static_cast<double>(steps_ + 1) * diagram_.step;
    const auto x = context_.continuous_state();
    for (int events = 0;;) {
        const auto outcome = solver_->advance(t, end);
        if (outcome == Solver::Outcome::failed && !status_) return false;
        if (const int state = nan_state(t, outcome == Solver::Outcome::failed); state >= 0)
            return fail(Status::failure(
                            "a continuous state became NaN: look for a division by zero or a value out of "
                            "range, or give a smaller step"),
                        owner(Role::continuous_state, x.data() + state));
        if (outcome == Solver::Outcome::failed) {
            const int worst = solver_->worst_state();
            return fail(solver_->failure(), worst < 0 ? -1 : owner(Role::continuous_state, x.data() + worst));
        }
        if (outcome == Solver::Outcome::reached) {
            for (auto& guard : guard_bindings_) guard.is_sliding = false;
            return finish_outputs(end);
        }
        std::copy(solver_->crossings().begin(), solver_->crossings().end(), crossed_.begin());
        if (accumulates(t, ++events)) return false;
        if (!finish_outputs(t)) return false;
        const Raised event(is_at_event_);
        event_time_ = t;
        if (!evaluate_outputs(t) || !evaluate_guards()) return false;
        guard_before_ = guard_values_;
        count_edges();
        if (!answer_crossings(t, true) || !update_blocks(true)) return false;
        held_change();
        solver_->restart(t);
        must_restart_ = false;
    }
}

bool Simulation::fail(Status status, int node) noexcept {
    status_ = status;
    failed_node_ = node;
    return false;
}

} // namespace bf

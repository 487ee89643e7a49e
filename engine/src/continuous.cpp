// Continuous time inside a base step: integration and events.
#include "bf/engine/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace bf {

namespace {
/// While it lives, evaluations are those of the solver.
struct Minor {
    bool& flag;
    explicit Minor(bool& f) : flag(f) { flag = true; }
    ~Minor() { flag = false; }
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
            if (!locates && !block.methods.event) continue;
            const auto& slots = block.block->declaration().slots;
            for (std::size_t i = 0; i < slots.size(); ++i) {
                if (slots[i].role != Role::guard) continue;
                const auto count = static_cast<std::size_t>(slots[i].size.count());
                guard_bindings_.push_back({node, segment.condition,
                                           static_cast<double*>(context_.data(node, static_cast<int>(i))),
                                           guard_values_.size(), count, block.methods.event});
                guard_values_.resize(guard_values_.size() + count);
            }
        }
    }
    // Continuous signals that enable or reset subsystems are watched as they are.
    for (const auto& condition : diagram_.conditions)
        for (const auto& signal : {condition.enable, condition.reset}) {
            if (!locates || signal.node < 0 || diagram_.slot(signal).type != Type::float64) continue;
            const int rate = diagram_.nodes[static_cast<std::size_t>(signal.node)].rate;
            if (!diagram_.rates[static_cast<std::size_t>(rate)].is_continuous) continue;
            const auto count = static_cast<std::size_t>(diagram_.slot(signal).size.count());
            guard_bindings_.push_back({-1, condition.parent,
                                       static_cast<double*>(context_.data(signal.node, signal.slot)),
                                       guard_values_.size(), count, false});
            guard_values_.resize(guard_values_.size() + count);
        }
    guard_before_.resize(guard_values_.size());
    crossed_.resize(guard_values_.size());
}

/// What may change under the solver's feet: signals of other rates and discrete states of continuous blocks.
void Simulation::find_held() {
    const auto is_continuous = [&](const DiagramNode& node) {
        return diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous && node.type != "Inport";
    };
    const auto hold = [&](int node, int slot) {
        const Slot& s = diagram_.slot({node, slot});
        const auto* now = static_cast<const std::byte*>(context_.data(node, slot));
        for (const auto& known : held_)
            if (known.now == now) return;
        held_.push_back(
            {now, std::vector<std::byte>(static_cast<std::size_t>(s.size.count() * bytes(s.type)))});
    };
    const auto hold_source = [&](const Node::End& from) {
        if (from.node < 0) return;
        const auto& source = diagram_.nodes[static_cast<std::size_t>(from.node)];
        if (source.rate != constant_rate && !is_continuous(source)) hold(from.node, from.slot);
    };
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& node = diagram_.nodes[n];
        if (!is_continuous(node)) continue;
        for (const auto& from : node.sources) hold_source(from);
        const auto& slots = node.block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::discrete_state) hold(static_cast<int>(n), static_cast<int>(i));
    }
    for (const auto& condition : diagram_.conditions)
        for (const auto& signal : {condition.enable, condition.trigger, condition.reset}) hold_source(signal);
}

bool Simulation::held_changed() noexcept {
    bool is_changed = false;
    for (auto& held : held_) {
        if (std::memcmp(held.last.data(), held.now, held.last.size()) == 0) continue;
        std::memcpy(held.last.data(), held.now, held.last.size());
        is_changed = true;
    }
    return is_changed;
}

ContinuousSystem Simulation::continuous_system() {
    return {.x = context_.continuous_state(),
            .rate = context_.continuous_rate(),
            .guards = guard_values_,
            .derivatives =
                [this](double t) {
                    const Minor minor(is_minor_);
                    // The first stage of a fixed step stands where the outputs of the step were computed.
                    const bool is_current = !is_adaptive(diagram_.solver.method) &&
                                            t == static_cast<double>(steps_) * diagram_.step;
                    return (is_current || evaluate_outputs(t)) && evaluate_derivatives();
                },
            .evaluate_guards =
                [this](double t, bool is_current) {
                    return (is_current || evaluate_outputs(t)) && evaluate_guards();
                },
            .has_samples = !held_.empty()};
}

/// Outputs of the continuous rate at an instant inside the step.
bool Simulation::evaluate_outputs(double t) noexcept {
    for (std::size_t r = 1; r < hit_.size(); ++r)
        if (diagram_.rates[r].is_continuous) context_.clock(static_cast<int>(r)).time = t;
    for (const auto& segment : outputs_)
        if (diagram_.rates[static_cast<std::size_t>(segment.rate)].is_continuous &&
            is_active(segment.condition) && !run(segment))
            return false;
    return true;
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
        for (std::size_t i = 0; i < guard.count; ++i)
            guard_values_[guard.first + i] =
                is_active(guard.condition) ? guard.values[i] : std::numeric_limits<double>::quiet_NaN();
    return true;
}

bool Simulation::crossed(const GuardBinding& guard) const noexcept {
    const auto from = crossed_.begin() + static_cast<std::ptrdiff_t>(guard.first);
    return std::any_of(from, from + static_cast<std::ptrdiff_t>(guard.count),
                       [](std::int8_t direction) { return direction != 0; });
}

/// The block whose crossings follow each other so closely that time would hardly go on, or -1.
int Simulation::accumulating(double t, int events) noexcept {
    for (auto& guard : guard_bindings_) {
        if (!crossed(guard)) continue;
        guard.close = t - guard.last < 1e-6 * diagram_.step ? guard.close + 1 : 0;
        guard.last = t;
        if (guard.close == 3 || events == most_events) return guard.node;
    }
    return -1;
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
    return !compare_guards() || answer_crossings(time(), false);
}

/// x⁺ of the blocks whose guards crossed, until nothing more crosses at this instant.
bool Simulation::answer_crossings(double t, bool is_inside_step) noexcept {
    must_restart_ = true;
    if (std::none_of(guard_bindings_.begin(), guard_bindings_.end(),
                     [&](const auto& guard) { return guard.has_event && crossed(guard); }))
        return true;
    for (int round = 0;; ++round) {
        int first = -1;
        observe_event(t);
        for (std::size_t g = 0; g < guard_bindings_.size();) {
            const auto& guard = guard_bindings_[g];
            if (guard.node < 0) break; // the control signals come last
            bool is_crossed = false;
            for (; g < guard_bindings_.size() && guard_bindings_[g].node == guard.node; ++g)
                for (std::size_t i = 0; i < guard_bindings_[g].count; ++i) {
                    guard_bindings_[g].values[i] = crossed_[guard_bindings_[g].first + i];
                    is_crossed = is_crossed || guard_bindings_[g].values[i] != 0;
                }
            if (!is_crossed || !guard.has_event) continue;
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
    if (is_inside_step) observe_event(t);
    held_changed();
    return true;
}

/// Observers see an event as a hit of the continuous rate alone.
void Simulation::observe_event(double t) noexcept {
    is_at_event_ = true;
    event_time_ = t;
    for (std::size_t r = 1; r < hit_.size(); ++r) hit_at_event_[r] = diagram_.rates[r].is_continuous;
    hit_.swap(hit_at_event_);
    for (Observer* observer : observers_) observer->observe(*this);
    hit_.swap(hit_at_event_);
    is_at_event_ = false;
}

bool Simulation::integrate(double t) noexcept {
    if (held_changed() || must_restart_) solver_->restart(t);
    must_restart_ = false;
    const double end = static_cast<double>(steps_ + 1) * diagram_.step;
    const auto x = context_.continuous_state();
    for (int events = 0;;) {
        const auto outcome = solver_->advance(t, end);
        if (outcome == Solver::Outcome::failed)
            return status_ ? fail(solver_->failure(), solver_->worst_state() < 0
                                                          ? -1
                                                          : node_of_continuous_state(static_cast<std::size_t>(
                                                                solver_->worst_state())))
                           : false;
        const auto nan = std::find_if(x.begin(), x.end(), [](double value) { return std::isnan(value); });
        if (nan != x.end())
            return fail(Status::failure(
                            "a continuous state became NaN: look for a division by zero or a value out of "
                            "range, or give a smaller step"),
                        node_of_continuous_state(static_cast<std::size_t>(nan - x.begin())));
        if (outcome == Solver::Outcome::reached) return true;
        std::copy(solver_->crossings().begin(), solver_->crossings().end(), crossed_.begin());
        if (const int node = accumulating(t, ++events); node >= 0)
            return fail(
                Status::failure(
                    "its zero crossings accumulate (Zeno behaviour or chattering): let the block rest "
                    "below a small speed, or give it hysteresis"),
                node);
        if (!evaluate_outputs(t) || !evaluate_guards()) return false;
        guard_before_ = guard_values_;
        if (!answer_crossings(t, true)) return false;
        solver_->restart(t);
        must_restart_ = false;
    }
}

bool Simulation::fail(Status status, int node) noexcept {
    status_ = status;
    failed_node_ = node;
    return false;
}

int Simulation::node_of_continuous_state(std::size_t element) const noexcept {
    const double* address = const_cast<Simulation*>(this)->context_.continuous_state().data() + element;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::continuous_state) continue;
            const auto* begin =
                static_cast<const double*>(context_.data(static_cast<int>(n), static_cast<int>(i)));
            if (begin <= address && address < begin + slots[i].size.count()) return static_cast<int>(n);
        }
    }
    return -1;
}

} // namespace bf

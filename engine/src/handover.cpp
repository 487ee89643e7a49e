// One diagram goes on where another one is.
#include "bf/engine/handover.hpp"

#include "bf/base/numbers.hpp"
#include "machine.hpp"
#include "succession.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>

namespace bf {

std::optional<std::string> path_before(const Origin& origin, const std::string& path) {
    return origin ? origin(path) : path;
}

std::vector<int> counterparts(const Diagram& from, const Diagram& to, const Origin& origin) {
    std::unordered_map<std::string_view, int> by_path;
    for (std::size_t n = 0; n < from.nodes.size(); ++n)
        by_path.emplace(from.nodes[n].path, static_cast<int>(n));
    std::vector<int> all;
    for (const auto& node : to.nodes) {
        const std::optional<std::string> path = path_before(origin, node.path);
        const auto found = path ? by_path.find(*path) : by_path.end();
        const bool is_it =
            found != by_path.end() && from.nodes[static_cast<std::size_t>(found->second)].type == node.type;
        all.push_back(is_it ? found->second : -1);
    }
    return all;
}

std::vector<int> numbers_now(const Diagram& from, const Node::End& was, const Diagram& to,
                             const Node::End& is, const SamePath& is_same) {
    const std::string before = from.nodes[static_cast<std::size_t>(was.node)].path + ".",
                      now = to.nodes[static_cast<std::size_t>(is.node)].path + ".";
    const auto& names = to.slot(is).value_names;
    std::vector<int> numbers;
    for (const auto& name : from.slot(was).value_names) {
        const auto found = std::ranges::find_if(
            names, [&](const auto& other) { return is_same(before + name, now + other); });
        numbers.push_back(found == names.end() ? 0 : static_cast<int>(found - names.begin()) + 1);
    }
    return numbers;
}

std::optional<double> number_now(const std::vector<int>& numbers, double number) noexcept {
    if (!(number >= 1 && number <= static_cast<double>(numbers.size()))) return number;
    const int now = numbers[static_cast<std::size_t>(number) - 1];
    return now > 0 ? std::optional<double>(now) : std::nullopt;
}

namespace {

/// Bytes of a snapshot that are neither signals nor parameters, states or clocks: what blocks keep outside.
std::size_t outside_bytes(const Simulation& run) {
    const Context& context = run.context();
    return context.snapshot_size() - context.signal_bytes() - context.parameter_bytes() -
           context.state_bytes() - run.diagram().rates.size() * sizeof(Clock);
}

std::vector<int> nodes_with_objects(const Diagram& diagram) {
    std::vector<int> found;
    for (std::size_t n = 0; n < diagram.nodes.size(); ++n)
        if (!diagram.nodes[n].block->declaration().objects.empty()) found.push_back(static_cast<int>(n));
    return found;
}

/// It is saved as a whole, in the order of the document: either all of it has the same place in both, or
/// none. `its`: counterparts of b's nodes.
bool have_same_outside(const Simulation& a, const Simulation& b, const std::vector<int>& its) {
    const auto is_same = [&](int one, int other) { return its[static_cast<std::size_t>(other)] == one; };
    return outside_bytes(a) == outside_bytes(b) &&
           std::ranges::equal(nodes_with_objects(a.diagram()), nodes_with_objects(b.diagram()), is_same);
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

SamePath same_path(const Origin& origin) {
    return [&origin](const std::string& before, const std::string& now) {
        return path_before(origin, now) == before;
    };
}

/// Why a state whose numbers stand for names has no place; empty: it has one. What it will be in a run that
/// goes on until its place is taken is not known yet.
std::string missing_name(const Simulation& before, const Node::End& was, const Simulation& after,
                         const Node::End& is, const Origin& origin) {
    const Slot& slot = before.diagram().slot(was);
    const std::vector<int> numbers =
        numbers_now(before.diagram(), was, after.diagram(), is, same_path(origin));
    const bool goes_on = after.takes_a_place();
    std::string names;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const auto is_active = [&] {
            const void* const data = before.context().data(was.node, was.slot);
            for (int k = 0; k < slot.size.count(); ++k)
                if (read_value(data, slot.type, k) == static_cast<double>(i + 1)) return true;
            return false;
        };
        if (numbers[i] == 0 && (goes_on || is_active()))
            names += (names.empty() ? "'" : " or '") + slot.value_names[i] + "'";
    }
    if (names.empty()) return "";
    const std::string& path = before.diagram().nodes[static_cast<std::size_t>(was.node)].path;
    return "'" + path + "." + slot.name + (goes_on ? "' may be " : "' is ") + names +
           ", which is no longer there: '" + path + "' then begins anew";
}

std::string form_of(const Slot& slot) {
    return std::to_string(slot.size.rows) + "x" + std::to_string(slot.size.cols) + " " + name(slot.type);
}

} // namespace

Handover handover(const Simulation& before, const Simulation& after, const Origin& origin) {
    const Diagram &from = before.diagram(), &to = after.diagram();
    const std::vector<int> its = counterparts(from, to, origin);
    std::vector<int> others(from.nodes.size(), -1); // by node of `from`, the one that it becomes
    for (std::size_t n = 0; n < its.size(); ++n)
        if (its[n] >= 0) others[static_cast<std::size_t>(its[n])] = static_cast<int>(n);
    Handover found;
    for (std::size_t n = 0; n < from.nodes.size(); ++n) {
        const auto& node = from.nodes[n];
        const int other = others[n];
        const auto& slots = node.block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            const Slot& slot = slots[i];
            if (!is_state(slot.role)) continue;
            const std::string state = "'" + node.path + "." + slot.name + "'";
            const int index = other < 0 ? -1 : counterpart(slots_of(to, other), slot);
            if (index < 0)
                found.lost.push_back(state + " is no longer there");
            else if (const Slot& next = to.slot({other, index}); !fits(slot, next))
                found.lost.push_back(state + " is " + form_of(next) + " and was " + form_of(slot));
            else if (std::string missing = missing_name(before, {static_cast<int>(n), static_cast<int>(i)},
                                                        after, {other, index}, origin);
                     !missing.empty())
                found.lost.push_back(std::move(missing));
        }
    }
    for (std::size_t n = 0; n < to.nodes.size(); ++n)
        for (const auto& slot : slots_of(to, static_cast<int>(n)))
            if (is_state(slot.role) && (its[n] < 0 || counterpart(slots_of(from, its[n]), slot) < 0))
                found.begun.push_back(to.nodes[n].path + "." + slot.name);
    if (after.takes_a_place()) {
        for (const int node : before.context().outside())
            if (const int other = others[static_cast<std::size_t>(node)]; other < 0 || !after.keeps(other))
                found.lost.push_back("what '" + from.nodes[static_cast<std::size_t>(node)].path +
                                     "' keeps outside of the diagram");
    } else if (outside_bytes(before) > 0 && !have_same_outside(before, after, its))
        found.lost.push_back("what blocks keep outside of the diagram, such as the state of a physics world");
    return found;
}

// ---- what is found before

Simulation::Succession::Succession(Simulation* before, const Diagram& to, const Origin& origin)
    : Succession(*before, to, origin) {
    replaced = before;
    const Diagram& was = from.diagram_;
    std::vector<char> goes_on(was.nodes.size()); // by node of the other one
    is_kept.resize(to.nodes.size());
    for (std::size_t n = 0; n < to.nodes.size(); ++n) {
        const auto& node = to.nodes[n];
        const bool opens = std::ranges::any_of(node.block->declaration().objects,
                                               [](const auto& object) { return object.requirement < 0; });
        is_kept[n] = (opens || node.methods.start) && is_unchanged(to, static_cast<int>(n));
        if (is_kept[n]) goes_on[static_cast<std::size_t>(its[n])] = 1;
    }
    std::string refused;
    const std::vector<int> owners = from.context_.outside(), devices = from.context_.devices();
    const auto is_open = [&](int node) {
        return was.nodes[static_cast<std::size_t>(node)].methods.start ||
               (std::ranges::count(owners, node) > 0 && std::ranges::count(devices, node) > 0);
    };
    for (std::size_t n = 0; n < was.nodes.size(); ++n)
        if (is_open(static_cast<int>(n)) && !goes_on[n])
            refused += "\n  " + was.nodes[n].path +
                       ": it keeps something open, such as a device, and would be removed or changed";
    is_absent = is_kept;
    for (std::size_t n = 0; n < to.nodes.size(); ++n) {
        const auto& node = to.nodes[n];
        for (const auto& provider : node.providers) {
            if (provider.node < 0 || !is_kept[static_cast<std::size_t>(provider.node)]) continue;
            is_absent[n] = 1;
            if ((node.methods.reset || node.methods.start) && !is_unchanged(to, static_cast<int>(n)))
                refused += "\n  " + node.path + ": it begins with what '" +
                           to.nodes[static_cast<std::size_t>(provider.node)].path +
                           "' has open, which the run before uses until then";
        }
    }
    if (!refused.empty())
        throw RunError("these blocks cannot come or go while the program runs; start it anew:" + refused);
}

/// It has the arguments, ports and states that it had, and uses what it used.
bool Simulation::Succession::is_unchanged(const Diagram& to, int n) const {
    const int before = its[static_cast<std::size_t>(n)];
    if (before < 0) return false;
    const auto &is = to.nodes[static_cast<std::size_t>(n)],
               &was = from.diagram_.nodes[static_cast<std::size_t>(before)];
    const auto is_same = [](const Slot& a, const Slot& b) {
        return a.name == b.name && a.role == b.role && fits(a, b);
    };
    const auto was_used = [&](const Node::End& now, const Node::End& then) {
        return now.slot == then.slot &&
               (now.node < 0 ? -1 : its[static_cast<std::size_t>(now.node)]) == then.node;
    };
    return is.arguments == was.arguments &&
           std::ranges::equal(is.block->resolution().slots, was.block->resolution().slots, is_same) &&
           std::ranges::equal(is.providers, was.providers, was_used);
}

std::vector<Node> Simulation::Succession::context_nodes(const Diagram& to) const {
    std::vector<Node> nodes = to.context_nodes();
    for (std::size_t n = 0; n < is_kept.size(); ++n) nodes[n].awaits_objects = is_kept[n] != 0;
    return nodes;
}

void Simulation::Succession::find_copies(Simulation& to, const Origin& origin) {
    for (std::size_t n = 0; n < its.size(); ++n) {
        if (its[n] < 0 || to.diagram_.nodes[n].rate == constant_rate) continue;
        const auto& slots = slots_of(to.diagram_, static_cast<int>(n));
        Named own;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (!is_state(slots[i].role) && slots[i].role != Role::output) continue;
            const int k = counterpart(slots_of(from.diagram_, its[n]), slots[i]);
            if (k < 0 || !fits(slots[i], from.diagram_.slot({its[n], k}))) continue;
            const int node = static_cast<int>(n), slot = static_cast<int>(i);
            const void* const source = from.context_.data(its[n], k);
            std::vector<void*> targets{to.context_.data(node, slot)};
            if (slots[i].role == Role::discrete_state) targets.push_back(to.context_.next_data(node, slot));
            const auto count = slots[i].size.count();
            for (void* const target : targets)
                own.copies.push_back(
                    {target, source, static_cast<std::size_t>(count * bytes(slots[i].type))});
            if (!slots[i].value_names.empty())
                own.numbers.push_back(
                    {std::move(targets), source, slots[i].type, count,
                     numbers_now(from.diagram_, {its[n], k}, to.diagram_, {node, slot}, same_path(origin))});
        }
        if (own.numbers.empty())
            copies.insert(copies.end(), own.copies.begin(), own.copies.end());
        else
            named.push_back(std::move(own));
    }
    to.machine_->find_copies(*from.machine_, origin, *this);
    if (!replaced) return;
    std::vector<std::pair<int, int>> kept;
    for (std::size_t n = 0; n < is_kept.size(); ++n)
        if (is_kept[n]) kept.emplace_back(static_cast<int>(n), its[n]);
    objects = to.context_.exchange(replaced->context_, kept);
}

void Simulation::Succession::Named::take_over() const noexcept {
    const auto now = [](const Number& number, int i) {
        return number_now(number.numbers, read_value(number.from, number.type, i));
    };
    for (const Number& number : numbers)
        for (int i = 0; i < number.count; ++i)
            if (!now(number, i)) return;
    for (const auto& [to, from, bytes] : copies) std::memcpy(to, from, bytes);
    for (const Number& number : numbers)
        for (void* const to : number.to)
            for (int i = 0; i < number.count; ++i)
                with_type(number.type, [&](auto type) {
                    using T = typename decltype(type)::type;
                    static_cast<T*>(to)[i] = static_cast<T>(*now(number, i));
                });
}

void Simulation::Machine::find_copies(const Machine& other, const Origin& origin, Succession& succession) {
    const auto &mine = simulation_.diagram_, &its = other.simulation_.diagram_;
    const auto is_same = [&](int condition, int before) {
        return path_before(origin, mine.conditions[static_cast<std::size_t>(condition)].path) ==
               its.conditions[static_cast<std::size_t>(before)].path;
    };
    const auto is_of_condition = [](const program::Flag& flag) {
        return flag.kind == program::Flag::Kind::enabled || flag.kind == program::Flag::Kind::triggered;
    };
    const auto add = [&](auto& to, const auto& from) {
        succession.copies.push_back({&to, &from, sizeof to});
    };
    for (std::size_t i = 0; i < flags_.size(); ++i)
        for (std::size_t k = 0; k < other.flags_.size(); ++k) {
            const program::Flag &a = program_.flags[i], &b = other.program_.flags[k];
            if (is_of_condition(a) && a.kind == b.kind && is_same(a.number, b.number))
                add(flags_[i], other.flags_[k]);
        }
    for (std::size_t i = 0; i < memories_.size(); ++i)
        for (std::size_t k = 0; k < other.memories_.size(); ++k) {
            const program::Memory &a = program_.memories[i], &b = other.program_.memories[k];
            std::vector<double>&to = memories_[i].last, &from = const_cast<Machine&>(other).memories_[k].last;
            if (a.is_reset == b.is_reset && is_same(a.condition, b.condition) && to.size() == from.size())
                succession.copies.push_back({to.data(), from.data(), to.size() * sizeof(double)});
        }
    for (std::size_t i = 0; i < mine.conditions.size(); ++i)
        for (std::size_t k = 0; k < its.conditions.size(); ++k)
            if (const int rate = mine.conditions[i].triggered_rate, before = its.conditions[k].triggered_rate;
                rate >= 0 && before >= 0 && is_same(static_cast<int>(i), static_cast<int>(k)))
                add(context_.clock(rate), other.context_.clock(before));
    first_hits_.resize(mine.nodes.size());
}

// ---- going on

bool Simulation::Machine::is_absent(int node) const noexcept {
    const auto& succession = simulation_.succession_;
    return succession && succession->replaced && succession->is_absent[static_cast<std::size_t>(node)];
}

/// The time of the last step that hit a node's rate; NaN: there was none, or it has no period.
double Simulation::Machine::last_hit(int node) const noexcept {
    const Diagram& diagram = simulation_.diagram_;
    if (!first_hits_.empty())
        if (const FirstHit& first = first_hits_[static_cast<std::size_t>(node)];
            first.step >= simulation_.steps_) // its last one was in the diagram before this one
            return static_cast<double>(first.step) * diagram.step - first.period;
    const int rate = diagram.nodes[static_cast<std::size_t>(node)].rate;
    const SampleRate& sampled = diagram.rates[static_cast<std::size_t>(rate)];
    const Clock& clock = context_.clock(rate);
    const bool has_period = !sampled.is_constant && !sampled.is_continuous && sampled.trigger == 0;
    return has_period && clock.step >= 0 ? clock.time : std::numeric_limits<double>::quiet_NaN();
}

void Simulation::Machine::find_first_hits(const Machine& other,
                                          const std::vector<int>& counterparts) noexcept {
    const Diagram& diagram = simulation_.diagram_;
    const auto next_hit = [&](int rate) -> std::int64_t { // -1: there is none
        for (std::size_t i = 0; i < counters_.size(); ++i)
            if (counters_[i].rate == rate && !diagram.rates[static_cast<std::size_t>(rate)].is_continuous)
                return simulation_.steps_ + until_hit_[i];
        return -1;
    };
    last_first_hit_ = -1;
    for (std::size_t n = 0; n < diagram.nodes.size(); ++n) {
        first_hits_[n] = {};
        const int rate = diagram.nodes[n].rate;
        const std::int64_t step = next_hit(rate);
        if (counterparts[n] < 0 || step < 0) continue;
        const double usual = diagram.period(rate);
        const double period = static_cast<double>(step) * diagram.step - other.last_hit(counterparts[n]);
        if (!(std::abs(period - usual) > 1e-9 * usual)) continue; // also where it is NaN
        first_hits_[n] = {step, period};
        last_first_hit_ = std::max(last_first_hit_, step);
    }
}

bool Simulation::Machine::run_with_first_hits(std::size_t begin, std::size_t end) noexcept {
    for (std::size_t i = begin; i < end; ++i) {
        const auto node = static_cast<std::size_t>(bound_[i].node);
        Clock& clock = context_.clock(simulation_.diagram_.nodes[node].rate);
        const double usual = clock.period;
        if (first_hits_[node].step == simulation_.steps_) clock.period = first_hits_[node].period;
        const Status status = tasks_[i]();
        clock.period = usual;
        if (!status) return simulation_.fail(status, bound_[i].node);
    }
    return true;
}

void Simulation::Machine::go_on_from(const Machine& other, const std::vector<int>& counterparts) noexcept {
    const auto& mine = simulation_.diagram_;
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
    find_first_hits(other, counterparts);
}

Simulation::Simulation(const Diagram& diagram, Simulation& before, const Origin& origin)
    : Simulation(diagram, std::make_unique<Succession>(&before, diagram, origin), origin) {}

bool Simulation::keeps(int node) const {
    return succession_ && succession_->is_kept[static_cast<std::size_t>(node)];
}

void Simulation::take_over(Succession& succession) noexcept {
    const Simulation& other = succession.from;
    steps_ = std::llround(other.time() / diagram_.step);
    machine_->go_on_from(*other.machine_, succession.its);
    for (const auto& [to, from, bytes] : succession.copies) std::memcpy(to, from, bytes);
    for (const auto& named : succession.named) named.take_over();
    for (auto& held : held_) std::memcpy(held.last.data(), held.now, held.last.size());
    for (auto& seen : seen_) std::memcpy(seen.last.data(), seen.now, seen.last.size());
    std::fill(guard_before_.begin(), guard_before_.end(), std::numeric_limits<double>::quiet_NaN());
    if (solver_) solver_->set_history(time(), {});
    must_restart_ = true;
}

void Simulation::take_over() noexcept {
    Succession& succession = *succession_;
    take_over(succession);
    succession.objects.make();
    for (std::size_t n = 0; n < is_elsewhere_.size(); ++n)
        if (std::exchange(is_elsewhere_[n], char{0}))
            succession.replaced->is_elsewhere_[static_cast<std::size_t>(succession.its[n])] = 1;
    succession.replaced = nullptr;
}

void Simulation::go_on_from(const Simulation& other, const Origin& origin) {
    const double time = other.time();
    const auto steps = std::llround(time / diagram_.step);
    if (std::abs(static_cast<double>(steps) * diagram_.step - time) > 1e-9 * std::max(1.0, time))
        throw RunError("t = " + number_text(time) + " s lies within a step of " + number_text(diagram_.step) +
                       " s; go on from a multiple of it, or start anew");
    Succession succession(other, diagram_, origin);
    succession.find_copies(*this, origin);
    take_over(succession);
    const auto size = static_cast<std::ptrdiff_t>(outside_bytes(*this));
    if (size == 0 || !have_same_outside(other, *this, succession.its)) return;
    std::vector<std::byte> own(context_.snapshot_size()), its(other.context_.snapshot_size());
    context_.save(own.data());
    other.context_.save(its.data());
    std::copy(its.end() - size, its.end(), own.end() - size);
    context_.restore(own.data());
}

} // namespace bf

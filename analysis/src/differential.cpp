#include "differential.hpp"

#include "named.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

namespace bf::analysis {

namespace {

const std::vector<Slot>& slots_of(const Diagram& d, int node) {
    return d.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
}

} // namespace

Differential::Differential(Simulation& run, int seeds, bool by_differences)
    : d_(run.diagram()), context_(run.context()), by_differences_(by_differences), seeds_(seeds) {
    int count = 0;
    for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n) {
        auto& places = places_.emplace_back();
        const auto& sources = d_.nodes[static_cast<std::size_t>(n)].sources;
        for (std::size_t s = 0; s < slots_of(d_, n).size(); ++s) {
            const Slot& slot = slots_of(d_, n)[s];
            Place place{.count = slot.size.count(), .is_real = is_real(slot.type)};
            const bool is_wired = slot.role == Role::input && s < sources.size() && sources[s].node >= 0;
            if (slot.role != Role::parameter && slot.role != Role::guard && !is_wired)
                place.first = place.own = count++;
            if (slot.role == Role::discrete_state) place.next = count++;
            if (slot.role == Role::continuous_state) place.rate = count++;
            places.push_back(place);
        }
    }
    for (int n = 0; n < static_cast<int>(places_.size()); ++n) {
        auto& origins = origins_.emplace_back();
        for (int s = 0; s < static_cast<int>(places_[static_cast<std::size_t>(n)].size()); ++s)
            origins.push_back(origin(d_, {n, s}));
    }
    for (const auto& loop : d_.plan.loops) {
        first_unknown_.push_back(columns());
        for (const auto& end : loop.unknowns) unknowns_ += d_.slot(end).size.count();
    }
    constexpr double most_numbers = 2.5e8;
    if (static_cast<double>(columns()) * columns() > most_numbers)
        throw RunError(
            "a linear system of " + std::to_string(columns()) +
            " states, inputs and unknowns of algebraic loops does not fit into memory; linearise a "
            "subsystem of the model");
    slopes_.resize(static_cast<std::size_t>(count));
    for (const int node : context_.devices()) devices_.insert(node);
}

void Differential::begin() {
    for (auto& its : slopes_) its.clear();
    outside_.clear();
    memory_.clear();
    tidied_ = 0;
    flows_.clear();
    differenced_.clear();
    kinks_.clear();
}

const Differential::Place& Differential::place(const Node::End& end) const {
    const auto& from = origins_[static_cast<std::size_t>(end.node)][static_cast<std::size_t>(end.slot)];
    return places_[static_cast<std::size_t>(from.node)][static_cast<std::size_t>(from.slot)];
}

Matrix Differential::rows(const Node::End& end) const { return seeded(place(end).first, place(end).count); }
Matrix Differential::computed(const Node::End& signal) const {
    return seeded(place(signal).own, place(signal).count);
}
Matrix Differential::next(const Node::End& state) const {
    return seeded(place(state).next, place(state).count);
}
Matrix Differential::rate(const Node::End& state) const {
    return seeded(place(state).rate, place(state).count);
}
void Differential::set(const Node::End& end, const Matrix& rows) {
    slopes(place(end).first).assign(rows, memory_);
}

void Differential::follow(const Node::End& parameter) {
    auto& its = places_[static_cast<std::size_t>(parameter.node)][static_cast<std::size_t>(parameter.slot)];
    if (its.first >= 0) return;
    its.first = its.own = static_cast<int>(slopes_.size());
    slopes_.emplace_back();
    followed_.insert(parameter.node);
    plans_ = {};
}

void Differential::at(const Node::End& signal, std::function<void(Matrix&)> change) {
    auto& its = places_[static_cast<std::size_t>(signal.node)][static_cast<std::size_t>(signal.slot)];
    if (its.own == its.first) {
        its.own = static_cast<int>(slopes_.size());
        slopes_.emplace_back();
        plans_ = {};
    }
    changes_[{signal.node, signal.slot}] = std::move(change);
}

void Differential::change(int node, int slot) {
    const auto& its = places_[static_cast<std::size_t>(node)][static_cast<std::size_t>(slot)];
    Matrix rows = slopes(its.own).spread(its.count, columns());
    changes_.at({node, slot})(rows);
    slopes(its.first).assign(rows, memory_);
}

int Differential::read_by(int node, int slot) const {
    const auto& from = origins_[static_cast<std::size_t>(node)][static_cast<std::size_t>(slot)];
    const auto& its = places_[static_cast<std::size_t>(from.node)][static_cast<std::size_t>(from.slot)];
    return from.node == node && from.slot == slot ? its.own : its.first;
}

bool Differential::is_active(int condition) const {
    if (condition <= 0) return true;
    const auto& c = d_.conditions[static_cast<std::size_t>(condition)];
    if (c.trigger.node >= 0) return false; // it runs at instants, if at all
    if (c.enable.node >= 0) {
        const Slot& slot = d_.slot(c.enable);
        bool is_on = false;
        for (int i = 0; i < slot.size.count(); ++i)
            is_on |= read_value(context_.data(c.enable.node, c.enable.slot), slot.type, i) > 0;
        if (!is_on) return false;
    }
    return is_active(c.parent);
}

void Differential::fail(int node, const std::string& why) const {
    throw RunError(d_.nodes[static_cast<std::size_t>(node)].path + ": " + why);
}

// ---- passes

/// What a pass writes takes new memory, so that others may still share the old: passes without end would take
/// it without end.
void Differential::tidy() {
    constexpr std::size_t little = 1 << 16;
    if (memory_.size() < 2 * tidied_ + little) return;
    spare_.clear();
    for (auto& its : slopes_) its.move_to(spare_);
    outside_.move_to(spare_);
    std::swap(memory_, spare_);
    tidied_ = memory_.size();
}

void Differential::outputs(const Runs& runs) {
    tidy();
    for (const auto& [end, change] : changes_) {
        const auto& node = d_.nodes[static_cast<std::size_t>(end.first)];
        const bool is_computed = node.rate != constant_rate && is_active(node.condition) && runs(end.first) &&
                                 !node.block->declaration().traits.is_root_input &&
                                 !devices_.contains(end.first);
        if (!is_computed) this->change(end.first, end.second);
    }
    for (const auto& segment : d_.plan.outputs) run(segment, Phase::output, runs);
}

void Differential::updates(const Runs& runs) {
    for (const auto& places : places_)
        for (const auto& place : places)
            if (place.next >= 0) slopes(place.next) = slopes(place.first);
    for (const auto& segment : d_.plan.updates) run(segment, Phase::update, runs);
}

void Differential::derivatives(const Runs& runs) {
    for (const auto& segment : d_.plan.derivatives) run(segment, Phase::derivative, runs);
}

void Differential::constants() {
    for (const auto& segment : d_.plan.outputs)
        if (segment.rate == constant_rate)
            for (const auto& activity : segment.activities)
                run(activity, Phase::output, [](int) { return true; });
}

void Differential::commit() {
    for (const auto& places : places_)
        for (const auto& place : places)
            if (place.next >= 0) slopes(place.first) = slopes(place.next);
}

void Differential::run(const Segment& segment, Phase phase, const Runs& runs) {
    if (segment.rate == constant_rate || !is_active(segment.condition)) return;
    for (const auto& activity : segment.activities) run(activity, phase, runs);
}

void Differential::run(const Activity& activity, Phase phase, const Runs& runs) {
    if (activity.loop >= 0) {
        const auto& loop = d_.plan.loops[static_cast<std::size_t>(activity.loop)];
        if (loop.kind == Loop::Kind::algebraic)
            solve(loop, runs);
        else
            iterate(loop, runs);
        return;
    }
    const int node = activity.node;
    if (node < 0 || devices_.contains(node) || !runs(node)) return;
    Plan& plan = this->plan(node, phase, activity.index);
    this->activity(plan);
    if (phase != Phase::output) return;
    for (auto& [end, change] : changes_) {
        if (end.first != node) continue;
        const auto& its = places_[static_cast<std::size_t>(node)][static_cast<std::size_t>(end.second)];
        for (const auto& part : plan.writes)
            if (part.slopes == its.own) this->change(node, end.second);
    }
}

/// z = f(z, s) of an algebraic loop gives dz = (I - ∂f/∂z)⁻¹ ∂f/∂s ds, the implicit function theorem; what
/// else is computed in the loop follows from both.
void Differential::solve(const Loop& loop, const Runs& runs) {
    if (std::none_of(loop.nodes.begin(), loop.nodes.end(), runs)) return; // it is held
    const auto number = static_cast<std::size_t>(&loop - d_.plan.loops.data());
    const int column = first_unknown_[number];
    int unknowns = 0;
    for (const auto& end : loop.unknowns) {
        const auto& its = place(end);
        Matrix own = Matrix::Zero(its.count, columns());
        for (int i = 0; i < its.count; ++i) own(i, column + unknowns++) = 1;
        slopes(its.first).assign(own, memory_);
    }
    for (const auto& segment : loop.outputs) run(segment, Phase::output, runs);
    Matrix f(unknowns, columns());
    int i = 0;
    for (const auto& end : loop.unknowns) {
        f.middleRows(i, place(end).count) = slopes(place(end).first).spread(place(end).count, columns());
        i += place(end).count;
    }
    const Matrix own = Matrix::Identity(unknowns, unknowns) - f.middleCols(column, unknowns);
    f.middleCols(column, unknowns).setZero();
    const Eigen::FullPivLU<Matrix> lu(own);
    if (!lu.isInvertible())
        throw RunError(loop.path +
                       ": the equations of its algebraic loop are singular here, so that they say nothing "
                       "of small changes; choose another operating point, or break the loop with a delay");
    const Matrix found = lu.solve(f);
    for (const int node : loop.nodes)
        for (const auto& its : places_[static_cast<std::size_t>(node)])
            for (const int which : std::set{its.first, its.own}) {
                if (which < 0) continue;
                Matrix rows = slopes(which).spread(its.count, columns());
                const Matrix by_unknowns = rows.middleCols(column, unknowns);
                rows.middleCols(column, unknowns).setZero();
                rows += by_unknowns * found;
                slopes(which).assign(rows, memory_);
            }
}

void Differential::iterate(const Loop& loop, const Runs& runs) {
    for (const int node : loop.nodes)
        for (std::size_t s = 0; runs(node) && s < slots_of(d_, node).size(); ++s) {
            const auto& its = place({node, static_cast<int>(s)});
            if (its.first >= 0 && !slopes(its.first).is_zero())
                throw RunError(loop.path +
                               ": an iterating subsystem is not linearised, and what it reads depends on "
                               "the inputs or states; open the path before it (--open), or write the "
                               "iterations out");
        }
}

// ---- one activity

Differential::Plan& Differential::plan(int node, Phase phase, int index) {
    auto& by_node = plans_.at(static_cast<std::size_t>(phase));
    by_node.resize(d_.nodes.size());
    auto& by_index = by_node[static_cast<std::size_t>(node)];
    if (static_cast<int>(by_index.size()) <= index) by_index.resize(static_cast<std::size_t>(index) + 1);
    auto& made = by_index[static_cast<std::size_t>(index)];
    if (made) return *made;
    made = std::make_unique<Plan>();
    auto& plan = *made;
    plan.node = node;
    plan.index = index;
    plan.phase = phase;
    const auto& its = d_.nodes[static_cast<std::size_t>(node)];
    const auto& rules = its.block->declaration().rules(phase);
    if (index < static_cast<int>(rules.size())) plan.rule = &rules[static_cast<std::size_t>(index)];
    plan.has_more = rules.size() > 1;
    for (int s = 0; s < static_cast<int>(its.sources.size()); ++s)
        if (const auto& source = its.sources[static_cast<std::size_t>(s)];
            source.node >= 0 && place({node, s}).first >= 0)
            plan.wires.push_back({source, place({node, s}).first});
    if (plan.rule && !by_differences_) {
        const auto [known, is_new] = kernels_.try_emplace(plan.rule->kernel);
        if (is_new) known->second = dual_kernel(plan.rule->kernel);
        plan.kernel = known->second;
    }
    if (plan.kernel.kernel) {
        plan_rule(plan);
    } else {
        if (!plan.rule) plan.declares = dynamic_cast<const Differentiable*>(its.block.get());
        plan.reads = reads(plan);
        plan.writes = writes(plan);
    }
    return plan;
}

std::vector<Differential::Part> Differential::reads(const Plan& plan) const {
    std::vector<Part> parts;
    const Frame& frame = context_.frame(plan.node);
    const auto add = [&](int slot) {
        const auto& its = place({plan.node, slot});
        const int read = read_by(plan.node, slot);
        if (read < 0 || !its.is_real) return;
        for (const auto& part : parts)
            if (part.slopes == read) return;
        parts.push_back({read, slot, frame.now[slot], d_.slot({plan.node, slot}).type, its.count});
    };
    if (plan.rule) {
        for (const auto& operand : plan.rule->operands)
            if (operand.source == Call::Source::slot &&
                (!is_written(d_, plan.node, plan.phase, operand) ||
                 d_.slot({plan.node, operand.slot}).role == Role::workspace))
                add(operand.slot);
        return parts;
    }
    for (std::size_t s = 0; s < slots_of(d_, plan.node).size(); ++s) {
        const Slot& slot = slots_of(d_, plan.node)[s];
        const bool is_read = plan.phase == Phase::output
                                 ? slot.role == Role::input && slot.feedthrough
                                 : slot.role == Role::input || slot.role == Role::output;
        if (is_read || is_state(slot.role) || slot.role == Role::parameter) add(static_cast<int>(s));
    }
    return parts;
}

std::vector<Differential::Part> Differential::writes(const Plan& plan) const {
    std::vector<Part> parts;
    const Frame& frame = context_.frame(plan.node);
    const auto add = [&](int slot, Call::Source to) {
        const auto& its = places_[static_cast<std::size_t>(plan.node)][static_cast<std::size_t>(slot)];
        const Type type = d_.slot({plan.node, slot}).type;
        if (to == Call::Source::next)
            parts.push_back({its.next, slot, frame.next[slot], type, its.count});
        else if (to == Call::Source::rate)
            parts.push_back({its.rate, slot, frame.rate[slot], type, its.count});
        else if (its.own >= 0)
            parts.push_back({its.own, slot, frame.now[slot], type, its.count});
    };
    if (plan.rule) {
        for (const auto& operand : plan.rule->operands)
            if (is_written(d_, plan.node, plan.phase, operand)) add(operand.slot, operand.source);
        return parts;
    }
    for (std::size_t s = 0; s < slots_of(d_, plan.node).size(); ++s) {
        const Role role = slots_of(d_, plan.node)[s].role;
        const int slot = static_cast<int>(s);
        if (plan.phase == Phase::output && role == Role::output) add(slot, Call::Source::slot);
        if (plan.phase == Phase::update && role == Role::discrete_state) add(slot, Call::Source::next);
        if (plan.phase == Phase::derivative && role == Role::continuous_state) add(slot, Call::Source::rate);
    }
    return parts;
}

void Differential::activity(Plan& plan) {
    read_.clear();
    for (const auto& part : plan.reads)
        if (!slopes(part.slopes).is_zero()) read_.push_back(part);
    const bool moves = !read_.empty();
    if (moves)
        for (const auto& wire : plan.wires)
            if (!slopes(wire.slopes).is_zero())
                flows_.emplace_back(wire.source.node, wire.source.slot, plan.node);
    // Integers change by jumps; where booleans do, zero-crossing functions tell.
    if (moves && std::ranges::any_of(plan.writes, [&](const Part& part) {
            return !is_real(part.type) && part.type != Type::boolean &&
                   d_.slot({plan.node, part.slot}).role == Role::output;
        }))
        kinks_.insert(plan.node);
    if (moves_outside_.contains(plan.node))
        with_outside(plan);
    else if (!moves)
        for (const auto& part : plan.writes) slopes(part.slopes).clear();
    else if (plan.kernel.kernel)
        rule(plan);
    else if (plan.rule || by_differences_ || followed_.contains(plan.node) || !declared(plan))
        by_differences(plan);
    // One rule may change what another one wrote: each is differentiated at the values that it found.
    if (plan.rule && plan.has_more && !task(plan)()) fail(plan.node, "it fails at this operating point");
}

const Task& Differential::task(const Plan& plan) {
    const auto key = std::tuple(plan.node, plan.phase, plan.index);
    auto found = tasks_.find(key);
    if (found == tasks_.end())
        found = tasks_.emplace(key, context_.task(plan.node, plan.phase, plan.index)).first;
    return found->second;
}

void Differential::rows(const std::vector<Part>& from, std::vector<SlopeRow>& all) const {
    all.clear();
    for (const auto& part : from) {
        const Slopes& its = slopes(part.slopes);
        for (int e = 0; e < part.count; ++e) all.push_back(its.row(e));
    }
}

void Differential::check_finite(const Plan& plan, bool is_finite) const {
    if (!is_finite)
        fail(plan.node, "its derivative is not finite at this operating point (as that of a root at 0); "
                        "choose another one");
}

Differential::Directions Differential::directions() {
    rows(read_, elements_);
    Directions along{.seeds = seeds_of(elements_)};
    along.are_elements = elements_.size() < along.seeds.size();
    along.count = static_cast<Eigen::Index>(along.are_elements ? elements_.size() : along.seeds.size());
    return along;
}

Matrix Differential::changes_of(std::size_t first, std::size_t count, const Directions& along) const {
    Matrix changes = Matrix::Zero(static_cast<Eigen::Index>(count), along.count);
    for (std::size_t e = 0; e < count; ++e) {
        const auto row = static_cast<Eigen::Index>(e);
        if (along.are_elements) {
            changes(row, static_cast<Eigen::Index>(first + e)) = 1;
            continue;
        }
        const auto& its = elements_[first + e];
        auto seed = std::lower_bound(along.seeds.begin(), along.seeds.end(), its.first);
        for (; seed != along.seeds.end() && *seed < its.end; ++seed)
            changes(row, seed - along.seeds.begin()) = its.values[*seed - its.first];
    }
    return changes;
}

void Differential::put(const Plan& plan, const Part& part, const Eigen::Ref<const Matrix>& changes,
                       const Directions& along) {
    check_finite(plan, changes.allFinite());
    Slopes& its = slopes(part.slopes);
    if (!is_real(part.type)) return its.clear();
    if (!along.are_elements) return its.assign(changes, along.seeds, memory_);
    sum(static_cast<std::size_t>(part.count),
        {{changes.data(),
          1,
          changes.outerStride(),
          elements_.data(),
          {0, 1, static_cast<int>(along.count)},
          {0, 1, part.count}}},
        nullptr, memory_, its);
    check_finite(plan, its.is_finite());
}

void Differential::write(const Plan& plan, const Differentiate& differentiate) {
    Eigen::Index results = 0;
    for (const auto& part : plan.writes) results += part.count;
    if (results == 0) return;
    const auto along = directions();
    Matrix changes = Matrix::Zero(results, along.count);
    differentiate(changes_of(0, elements_.size(), along), changes);
    Eigen::Index row = 0;
    for (const auto& part : plan.writes) {
        put(plan, part, changes.middleRows(row, part.count), along);
        row += part.count;
    }
}

/// By what the block says of its methods.
bool Differential::declared(const Plan& plan) {
    if (!plan.declares) return false;
    if (plan.writes.empty()) return true;
    const auto along = directions();
    const auto& block = *plan.declares;
    const auto slots = static_cast<int>(slots_of(d_, plan.node).size());
    Changes changes(slots, static_cast<int>(along.count));
    std::size_t first = 0;
    for (const auto& part : read_) {
        const auto count = static_cast<std::size_t>(part.count);
        for (int s = 0; s < slots; ++s)
            if (const Role role = d_.slot({plan.node, s}).role;
                (role == Role::input || is_state(role)) && read_by(plan.node, s) == part.slopes)
                changes.at(s) = changes_of(first, count, along);
        first += count;
    }
    const auto result = [&](const Part& part) -> Matrix& {
        return plan.phase == Phase::output   ? changes.at(part.slot)
               : plan.phase == Phase::update ? changes.next_at(part.slot)
                                             : changes.rate_at(part.slot);
    };
    for (const auto& part : plan.writes) result(part).setZero(part.count, along.count);
    const Now now(context_.frame(plan.node));
    if (!(plan.phase == Phase::output   ? block.directional_derivative(now, changes)
          : plan.phase == Phase::update ? block.directional_derivative_of_update(now, changes)
                                        : block.directional_derivative_of_rates(now, changes)))
        return false;
    if (changes.has_corner()) kinks_.insert(plan.node);
    for (const auto& part : plan.writes) put(plan, part, result(part), along);
    return true;
}

/// At a corner, central differences are the mean of two slopes: there the flatter one counts, which is also
/// that of the side without a jump. What is smooth bends with the square of the step, a corner with the step.
template <class Evaluate>
void Differential::bend(int node, const Vector& direction, double step, double precision, const Vector& here,
                        const Vector& above, const Vector& below, Evaluate&& evaluate, Vector& slopes) {
    const Vector far = above - 2 * here + below;
    const double change =
        std::max((above - here).cwiseAbs().maxCoeff(), (here - below).cwiseAbs().maxCoeff());
    const auto is_bent = [&](Eigen::Index i) {
        return std::abs(far[i]) > std::max(1e-3 * change, 100 * precision * (1 + std::abs(here[i])));
    };
    bool is_any = false;
    for (Eigen::Index i = 0; i < far.size(); ++i) is_any |= is_bent(i);
    if (!is_any) return;
    Vector right(far.size()), left(far.size());
    if (!evaluate(direction, step / 8, right) || !evaluate(direction, -step / 8, left)) return;
    const Vector near = right - 2 * here + left;
    for (Eigen::Index i = 0; i < far.size(); ++i) {
        if (!is_bent(i) || std::abs(near[i]) < std::abs(far[i]) / 16) continue;
        kinks_.insert(node);
        const double up = right[i] - here[i], down = here[i] - left[i];
        slopes[i] = (std::abs(up) < std::abs(down) ? up : down) / (step / 8);
    }
}

void Differential::by_differences(const Plan& plan) {
    const int node = plan.node;
    const auto &from = read_, &to = plan.writes;
    if (to.empty()) return;
    for (std::size_t a = 0; a < from.size(); ++a)
        for (std::size_t b = 0; b < a; ++b)
            if (from[a].data == from[b].data)
                fail(node,
                     "it reads its output both by itself and over a wire, and where an input is added or "
                     "the signal is cut (--open), these differ; put a Gain of 1 into the wire, and choose "
                     "its output");
    differenced_.insert(node);
    const Task& task = this->task(plan);
    std::vector<std::vector<double>> values;
    std::vector<std::vector<std::byte>> results;
    for (const auto& part : from) {
        values.emplace_back();
        for (int e = 0; e < part.count; ++e) values.back().push_back(read_value(part.data, part.type, e));
    }
    for (const auto& part : to) {
        const auto* begin = static_cast<const std::byte*>(part.data);
        results.emplace_back(begin, begin + part.count * bytes(part.type));
    }
    const auto restore = [&] { // what a rule reads and writes
        for (std::size_t p = 0; p < to.size(); ++p)
            std::memcpy(to[p].data, results[p].data(), results[p].size());
    };
    const auto move = [&](const Vector& direction, double step) {
        int i = 0;
        for (std::size_t p = 0; p < from.size(); ++p)
            for (int e = 0; e < from[p].count; ++e, ++i)
                write_real(from[p].data, from[p].type, e,
                           values[p][static_cast<std::size_t>(e)] + step * direction[i]);
    };
    Status failed; // the last one that did
    const auto evaluate = [&](const Vector& direction, double step, Vector& at) {
        restore();
        move(direction, step);
        const Status status = task();
        if (!status) failed = status;
        int i = 0;
        for (const auto& part : to) // some of which may be read, too
            for (int e = 0; e < part.count; ++e)
                at[i++] = is_real(part.type) ? read_value(part.data, part.type, e) : 0;
        move(direction, 0);
        return static_cast<bool>(status) && at.allFinite();
    };
    const auto beside = [&] {
        const auto& block = d_.nodes[static_cast<std::size_t>(node)].block->resolution();
        return "it fails beside this operating point" + (failed ? "" : " (" + failed.text(&block) + ")") +
               ", so that its derivative cannot be found; choose another one";
    };
    Vector here;
    bool has_here = false;
    const auto along = [&](const Vector& direction, Vector& slopes) {
        if (here.size() == 0) {
            here.resize(slopes.size());
            has_here = evaluate(direction, 0, here);
        }
        // The step that balances rounding and curvature, ∛ε of the element that changes most.
        double largest = 0, precision = std::numeric_limits<double>::epsilon();
        for (const auto& part : to)
            if (part.type == Type::float32) precision = std::numeric_limits<float>::epsilon();
        int i = 0;
        for (std::size_t p = 0; p < from.size(); ++p)
            for (int e = 0; e < from[p].count; ++e, ++i) {
                if (direction[i] == 0) continue;
                largest =
                    std::max(largest, std::abs(direction[i]) /
                                          std::max(1.0, std::abs(values[p][static_cast<std::size_t>(e)])));
                if (from[p].type == Type::float32) precision = std::numeric_limits<float>::epsilon();
            }
        const double step = std::cbrt(precision) / largest;
        Vector above(slopes.size()), below(slopes.size());
        const bool has_above = evaluate(direction, step, above),
                   has_below = evaluate(direction, -step, below);
        if (has_above && has_below) {
            slopes = (above - below) / (2 * step);
            if (has_here) bend(node, direction, step, precision, here, above, below, evaluate, slopes);
        } else if ((has_above || has_below) && has_here) {
            slopes = (has_above ? Vector(above - here) : Vector(here - below)) / step;
        } else {
            fail(node, beside());
        }
    };
    write(plan, [&](const Matrix& directions, Matrix& slopes) {
        Vector slope(slopes.rows());
        for (Eigen::Index c = 0; c < directions.cols(); ++c) {
            along(directions.col(c), slope);
            slopes.col(c) = slope;
        }
    });
    restore();
}

} // namespace bf::analysis

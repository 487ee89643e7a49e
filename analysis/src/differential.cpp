#include "differential.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

namespace bf::analysis {

namespace {

bool is_real(Type type) { return type == Type::float64 || type == Type::float32; }

const std::vector<Slot>& slots_of(const Diagram& d, int node) {
    return d.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
}

void write_real(void* data, Type type, int i, double value) {
    if (type == Type::float64)
        static_cast<double*>(data)[i] = value;
    else
        static_cast<float*>(data)[i] = static_cast<float>(value);
}

} // namespace

Differential::Differential(Simulation& run, int seeds, bool by_differences)
    : d_(run.diagram()), context_(run.context()), by_differences_(by_differences), seeds_(seeds) {
    int count = 0;
    const auto reserve = [&](int elements) {
        const int first = count;
        count += elements;
        return first;
    };
    for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n) {
        auto& places = places_.emplace_back();
        const auto& sources = d_.nodes[static_cast<std::size_t>(n)].sources;
        for (std::size_t s = 0; s < slots_of(d_, n).size(); ++s) {
            const Slot& slot = slots_of(d_, n)[s];
            Place place{.count = slot.size.count(), .is_real = is_real(slot.type)};
            const bool is_wired = slot.role == Role::input && s < sources.size() && sources[s].node >= 0;
            if (slot.role != Role::parameter && slot.role != Role::guard && !is_wired)
                place.first = place.own = reserve(place.count);
            if (slot.role == Role::discrete_state) place.next = reserve(place.count);
            if (slot.role == Role::continuous_state) place.rate = reserve(place.count);
            places.push_back(place);
        }
    }
    int unknowns = 0;
    for (const auto& loop : d_.plan.loops) {
        first_unknown_.push_back(seeds + unknowns);
        for (const auto& end : loop.unknowns) unknowns += d_.slot(end).size.count();
    }
    constexpr double most_numbers = 5e8;
    if (static_cast<double>(count) * (seeds + unknowns) > most_numbers)
        throw RunError("the derivatives of " + std::to_string(count) + " elements by " +
                       std::to_string(seeds) +
                       " states and inputs do not fit into memory; linearise a subsystem of the model");
    rows_ = Rows::Zero(count, seeds + unknowns);
    for (const int node : context_.devices()) devices_.insert(node);
}

Node::End Differential::origin(const Node::End& end) const {
    const auto& sources = d_.nodes[static_cast<std::size_t>(end.node)].sources;
    const auto s = static_cast<std::size_t>(end.slot);
    const bool is_wired = d_.slot(end).role == Role::input && s < sources.size() && sources[s].node >= 0;
    return is_wired ? sources[s] : end;
}

const Differential::Place& Differential::place(const Node::End& end) const {
    const auto from = origin(end);
    return places_[static_cast<std::size_t>(from.node)][static_cast<std::size_t>(from.slot)];
}

Eigen::Block<Differential::Rows> Differential::rows(const Node::End& end) {
    return rows_.block(place(end).first, 0, place(end).count, seeds_);
}
Eigen::Block<Differential::Rows> Differential::computed(const Node::End& signal) {
    return rows_.block(place(signal).own, 0, place(signal).count, seeds_);
}
Eigen::Block<Differential::Rows> Differential::next(const Node::End& state) {
    return rows_.block(place(state).next, 0, place(state).count, seeds_);
}
Eigen::Block<Differential::Rows> Differential::rate(const Node::End& state) {
    return rows_.block(place(state).rate, 0, place(state).count, seeds_);
}

void Differential::at(const Node::End& signal, std::function<void(Eigen::Block<Rows>)> change) {
    auto& its = places_[static_cast<std::size_t>(signal.node)][static_cast<std::size_t>(signal.slot)];
    if (its.own == its.first) {
        its.own = static_cast<int>(rows_.rows());
        rows_.conservativeResizeLike(Rows::Zero(its.own + its.count, rows_.cols()));
    }
    changes_[{signal.node, signal.slot}] = std::move(change);
}

void Differential::change(int node, int slot) {
    const auto& its = places_[static_cast<std::size_t>(node)][static_cast<std::size_t>(slot)];
    auto rows = rows_.block(its.first, 0, its.count, rows_.cols());
    rows = rows_.middleRows(its.own, its.count).eval();
    changes_.at({node, slot})(rows);
}

int Differential::row_read(int node, int slot) const {
    const auto from = origin({node, slot});
    const auto& its = place(from);
    return from.node == node && from.slot == slot ? its.own : its.first;
}

bool Differential::is_zero(int row, int count) const {
    return (rows_.middleRows(row, count).array() == 0).all();
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

void Differential::outputs(const Runs& runs) {
    for (const auto& [end, change] : changes_) {
        const auto& node = d_.nodes[static_cast<std::size_t>(end.first)];
        const bool is_computed = node.rate != constant_rate && is_active(node.condition) &&
                                 !node.block->declaration().traits.is_root_input &&
                                 !devices_.contains(end.first);
        if (!is_computed) this->change(end.first, end.second);
    }
    for (const auto& segment : d_.plan.outputs) run(segment, Phase::output, runs);
}

void Differential::updates(const Runs& runs) {
    for (const auto& places : places_)
        for (const auto& place : places)
            if (place.next >= 0)
                rows_.middleRows(place.next, place.count) = rows_.middleRows(place.first, place.count).eval();
    for (const auto& segment : d_.plan.updates) run(segment, Phase::update, runs);
}

void Differential::derivatives(const Runs& runs) {
    for (const auto& segment : d_.plan.derivatives) run(segment, Phase::derivative, runs);
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
            iterate(loop);
        return;
    }
    const int node = activity.node;
    if (node < 0 || devices_.contains(node) || !runs(node)) return;
    this->activity(node, phase, activity.index);
    if (phase != Phase::output || changes_.empty()) return;
    const auto written = writes(node, phase, activity.index);
    for (auto& [end, change] : changes_) {
        if (end.first != node) continue;
        const auto& its = places_[static_cast<std::size_t>(node)][static_cast<std::size_t>(end.second)];
        for (const auto& part : written)
            if (part.row == its.own) this->change(node, end.second);
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
        rows_.middleRows(its.first, its.count).setZero();
        for (int i = 0; i < its.count; ++i) rows_(its.first + i, column + unknowns++) = 1;
    }
    for (const auto& segment : loop.outputs) run(segment, Phase::output, runs);
    Matrix f(unknowns, rows_.cols());
    int i = 0;
    for (const auto& end : loop.unknowns) {
        f.middleRows(i, place(end).count) = rows_.middleRows(place(end).first, place(end).count);
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
            for (const int row : std::set{its.first, its.own}) {
                if (row < 0) continue;
                auto rows = rows_.middleRows(row, its.count);
                const Matrix by_unknowns = rows.middleCols(column, unknowns);
                rows.middleCols(column, unknowns).setZero();
                rows += by_unknowns * found;
            }
}

void Differential::iterate(const Loop& loop) {
    for (const int node : loop.nodes)
        for (std::size_t s = 0; s < slots_of(d_, node).size(); ++s) {
            const auto& its = place({node, static_cast<int>(s)});
            if (its.first >= 0 && !is_zero(its.first, its.count))
                throw RunError(loop.path +
                               ": an iterating subsystem is not linearised, and what it reads depends on "
                               "the inputs or states; open the path before it (--open), or write the "
                               "iterations out");
        }
}

// ---- one activity

const Call* Differential::call(int node, Phase phase, int index) const {
    const auto& rules = d_.nodes[static_cast<std::size_t>(node)].block->declaration().rules(phase);
    return index < static_cast<int>(rules.size()) ? &rules[static_cast<std::size_t>(index)] : nullptr;
}

/// The first operands of a rule may be targets; outputs are so in the rules of outputs alone.
bool Differential::is_written(int node, Phase phase, const Call::Reference& operand) const {
    const bool is_target = phase == Phase::output || operand.source != Call::Source::slot ||
                           d_.slot({node, operand.slot}).role == Role::workspace;
    return operand.is_written && is_target;
}

std::vector<Differential::Part> Differential::reads(int node, Phase phase, int index) const {
    std::vector<Part> parts;
    const Frame& frame = context_.frame(node);
    const auto add = [&](int slot) {
        const auto& its = place({node, slot});
        const int row = row_read(node, slot);
        if (row < 0 || !its.is_real || is_zero(row, its.count)) return;
        for (const auto& part : parts)
            if (part.row == row) return;
        parts.push_back({row, frame.now[slot], d_.slot({node, slot}).type, its.count});
    };
    if (const Call* rule = call(node, phase, index)) {
        for (const auto& operand : rule->operands)
            if (operand.source == Call::Source::slot &&
                (!is_written(node, phase, operand) || d_.slot({node, operand.slot}).role == Role::workspace))
                add(operand.slot);
        return parts;
    }
    for (std::size_t s = 0; s < slots_of(d_, node).size(); ++s) {
        const Slot& slot = slots_of(d_, node)[s];
        const bool is_read = phase == Phase::output ? slot.role == Role::input && slot.feedthrough
                                                    : slot.role == Role::input || slot.role == Role::output;
        if (is_read || is_state(slot.role)) add(static_cast<int>(s));
    }
    return parts;
}

std::vector<Differential::Part> Differential::writes(int node, Phase phase, int index) const {
    std::vector<Part> parts;
    const Frame& frame = context_.frame(node);
    const auto add = [&](int slot, Call::Source to) {
        const auto& its = places_[static_cast<std::size_t>(node)][static_cast<std::size_t>(slot)];
        const Type type = d_.slot({node, slot}).type;
        if (to == Call::Source::next)
            parts.push_back({its.next, frame.next[slot], type, its.count});
        else if (to == Call::Source::rate)
            parts.push_back({its.rate, frame.rate[slot], type, its.count});
        else if (its.own >= 0)
            parts.push_back({its.own, frame.now[slot], type, its.count});
    };
    if (const Call* rule = call(node, phase, index)) {
        for (const auto& operand : rule->operands)
            if (is_written(node, phase, operand)) add(operand.slot, operand.source);
        return parts;
    }
    for (std::size_t s = 0; s < slots_of(d_, node).size(); ++s) {
        const Role role = slots_of(d_, node)[s].role;
        const int slot = static_cast<int>(s);
        if (phase == Phase::output && role == Role::output) add(slot, Call::Source::slot);
        if (phase == Phase::update && role == Role::discrete_state) add(slot, Call::Source::next);
        if (phase == Phase::derivative && role == Role::continuous_state) add(slot, Call::Source::rate);
    }
    return parts;
}

void Differential::activity(int node, Phase phase, int index) {
    const Call* rule = call(node, phase, index);
    const auto& sources = d_.nodes[static_cast<std::size_t>(node)].sources;
    if (!reads(node, phase, index).empty())
        for (std::size_t s = 0; s < sources.size(); ++s)
            if (sources[s].node >= 0)
                if (const auto& its = place({node, static_cast<int>(s)});
                    its.first >= 0 && !is_zero(its.first, its.count))
                    flows_.emplace(sources[s].node, sources[s].slot, node);
    const auto* kernel = rule && !by_differences_ ? dual_kernel(rule->kernel) : nullptr;
    if (kernel)
        this->rule(node, phase, *rule, *kernel);
    else
        by_differences(node, phase, index);
    // One rule may change what another one wrote: each is differentiated at the values that it found.
    const bool has_more =
        d_.nodes[static_cast<std::size_t>(node)].block->declaration().rules(phase).size() > 1;
    if (rule && has_more && !task(node, phase, index)()) fail(node, "it fails at this operating point");
}

const Task& Differential::task(int node, Phase phase, int index) {
    const auto key = std::tuple(node, phase, index);
    auto found = tasks_.find(key);
    if (found == tasks_.end()) found = tasks_.emplace(key, context_.task(node, phase, index)).first;
    return found->second;
}

/// Rows of what is written from rows of what is read. `differentiate` gives the derivative along a direction
/// in all elements that are read: along each of them, or along each seed, whichever is less.
void Differential::write(int node, const std::vector<Part>& from, const std::vector<Part>& to,
                         const std::function<void(const Vector&, Vector&)>& differentiate) {
    int inputs = 0, results = 0;
    for (const auto& part : from) inputs += part.count;
    for (const auto& part : to) results += part.count;
    Matrix read(inputs, rows_.cols());
    int i = 0;
    for (const auto& part : from) {
        read.middleRows(i, part.count) = rows_.middleRows(part.row, part.count);
        i += part.count;
    }
    std::vector<int> columns;
    for (int c = 0; c < read.cols(); ++c)
        if ((read.col(c).array() != 0).any()) columns.push_back(c);
    const bool by_elements = inputs <= static_cast<int>(columns.size());
    const int count = by_elements ? inputs : static_cast<int>(columns.size());
    Matrix slopes(results, count);
    Vector direction(inputs), slope(results);
    for (int k = 0; k < count; ++k) {
        if (by_elements)
            direction = Vector::Unit(inputs, k);
        else
            direction = read.col(columns[static_cast<std::size_t>(k)]);
        differentiate(direction, slope);
        slopes.col(k) = slope;
    }
    if (!slopes.allFinite())
        fail(node, "its derivative is not finite at this operating point (as that of a root at 0); choose "
                   "another one");
    Rows written = Rows::Zero(results, rows_.cols());
    if (by_elements)
        written.noalias() = slopes * read;
    else
        for (int k = 0; k < count; ++k) written.col(columns[static_cast<std::size_t>(k)]) = slopes.col(k);
    i = 0;
    for (const auto& part : to) {
        if (is_real(part.type))
            rows_.middleRows(part.row, part.count) = written.middleRows(i, part.count);
        else
            rows_.middleRows(part.row, part.count).setZero();
        i += part.count;
    }
}

void Differential::rule(int node, Phase phase, const Call& call, const NamedKernel<Dual>& kernel) {
    const Frame& frame = context_.frame(node);
    const auto& slots = slots_of(d_, node);
    struct Operand {
        std::vector<Dual> numbers;
        int from = -1; ///< where it begins among what is read
    };
    std::vector<Part> read, written;
    std::vector<Operand> operands(call.operands.size());
    std::vector<kernels::View<Dual>> views, list;
    std::vector<std::size_t> results;
    int inputs = 0;
    for (std::size_t k = 0; k < call.operands.size(); ++k) {
        const auto& reference = call.operands[k];
        auto& operand = operands[k];
        const auto slot = static_cast<std::size_t>(std::max(reference.slot, 0));
        Size size;
        const void* data = nullptr;
        Type type = Type::float64;
        switch (reference.source) {
        case Call::Source::slot: data = frame.now[slot]; break;
        case Call::Source::next: data = frame.next[slot]; break;
        case Call::Source::rate: data = frame.rate[slot]; break;
        case Call::Source::time: data = &frame.clock->time; break;
        case Call::Source::period: data = &frame.clock->period; break;
        case Call::Source::trigger: data = &frame.clock->trigger; break;
        case Call::Source::constants:
            data = reference.constants->data();
            size.rows = static_cast<int>(reference.constants->size());
            break;
        }
        if (reference.slot >= 0) {
            size = slots[slot].size;
            type = slots[slot].type;
        }
        const bool is_written = this->is_written(node, phase, reference);
        // A workspace that a rule reads and writes is one memory.
        auto* same = &operand;
        for (std::size_t before = 0; is_written && before < k; ++before)
            if (call.operands[before].slot == reference.slot &&
                call.operands[before].source == reference.source && call.operands[before].is_written)
                same = &operands[before];
        if (same == &operand)
            for (int e = 0; e < size.count(); ++e) operand.numbers.emplace_back(read_value(data, type, e));
        const bool is_listed = call.list_from >= 0 && static_cast<int>(k) >= call.list_from &&
                               static_cast<int>(k) < call.list_from + call.list_size;
        (is_listed ? list : views).emplace_back(same->numbers.data(), size.rows, size.cols);
        if (same != &operand) continue;
        const Node::End end{node, reference.slot};
        if (is_written) {
            const auto& its = places_[static_cast<std::size_t>(node)][slot];
            const int row = reference.source == Call::Source::next   ? its.next
                            : reference.source == Call::Source::rate ? its.rate
                                                                     : its.own;
            if (row >= 0) {
                written.push_back({row, nullptr, type, its.count});
                results.push_back(k);
            }
        }
        if (reference.source != Call::Source::slot) continue;
        const auto& its = place(end);
        const int row = row_read(node, reference.slot);
        if (row < 0 || !its.is_real || is_zero(row, its.count)) continue;
        // What a rule writes it reads only where rules share a workspace.
        if (is_written && slots[slot].role != Role::workspace) continue;
        operand.from = inputs;
        inputs += its.count;
        read.push_back({row, nullptr, type, its.count});
    }
    if (read.empty()) {
        for (const auto& part : written) rows_.middleRows(part.row, part.count).setZero();
        return;
    }
    const auto values = operands;
    write(node, read, written, [&](const Vector& direction, Vector& slopes) {
        for (std::size_t k = 0; k < operands.size(); ++k)
            for (std::size_t e = 0; e < operands[k].numbers.size(); ++e) {
                auto& number = operands[k].numbers[e] = values[k].numbers[e];
                if (operands[k].from >= 0) number.slope = direction[operands[k].from + static_cast<int>(e)];
            }
        Dual::is_at_corner = false;
        if (!kernel.run(views.data(), {list.data(), static_cast<int>(list.size())}))
            fail(node,
                 "it fails at this operating point, so that it has no derivative there; choose another one");
        if (Dual::is_at_corner) kinks_.insert(node);
        int i = 0;
        for (const std::size_t k : results)
            for (const auto& number : operands[k].numbers)
                slopes[i++] = number.slope != 0 && std::isnan(number.value) ? number.value : number.slope;
    });
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

void Differential::by_differences(int node, Phase phase, int index) {
    const auto from = reads(node, phase, index), to = writes(node, phase, index);
    if (from.empty()) {
        for (const auto& part : to) rows_.middleRows(part.row, part.count).setZero();
        return;
    }
    for (std::size_t a = 0; a < from.size(); ++a)
        for (std::size_t b = 0; b < a; ++b)
            if (from[a].data == from[b].data)
                fail(node,
                     "it reads its output both by itself and over a wire, and where an input is added or "
                     "the signal is cut (--open), these differ; put a Gain of 1 into the wire, and choose "
                     "its output");
    differenced_.insert(node);
    const Task& task = this->task(node, phase, index);
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
    const auto evaluate = [&](const Vector& direction, double step, Vector& at) {
        restore();
        move(direction, step);
        const Status status = task();
        int i = 0;
        for (const auto& part : to) // some of which may be read, too
            for (int e = 0; e < part.count; ++e)
                at[i++] = is_real(part.type) ? read_value(part.data, part.type, e) : 0;
        move(direction, 0);
        return static_cast<bool>(status) && at.allFinite();
    };
    Vector here;
    bool has_here = false;
    write(node, from, to, [&](const Vector& direction, Vector& slopes) {
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
            fail(node, "it fails beside this operating point, so that its derivative cannot be found; choose "
                       "another "
                       "one");
        }
    });
    restore();
}

} // namespace bf::analysis

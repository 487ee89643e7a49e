#include "dual_run.hpp"

#include "bf/base/names.hpp"
#include "bf/engine/fixed_step.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/standard.hpp"
#include "bf/program/step.hpp"
#include "named.hpp"

#include <algorithm>
#include <cmath>

namespace bf::analysis {

using program::Literal;
using program::Statement;
using Kind = Statement::Kind;

DualRun::DualRun(const Simulation& like) : d_(like.diagram()), program_(program::lower(d_)) {
    if (is_adaptive(d_.solver.method))
        throw RunError("the solver chooses its steps by their error, which has no derivative; give the model "
                       "one of fixed steps, as solver: rk4");
    int count = 0;
    const auto reserve = [&](int elements) { return std::exchange(count, count + elements); };
    for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n) {
        auto& places = places_.emplace_back();
        for (const Slot& slot : d_.nodes[static_cast<std::size_t>(n)].block->resolution().slots) {
            Place its{.count = slot.size.count()};
            if (slot.role != Role::continuous_state) its.now = reserve(its.count);
            if (slot.role == Role::discrete_state) its.next = reserve(its.count);
            places.push_back(its);
        }
    }
    const auto for_each_continuous = [&](auto&& f) {
        for (std::size_t n = 0; n < places_.size(); ++n)
            for (std::size_t s = 0; s < places_[n].size(); ++s)
                if (d_.slot({static_cast<int>(n), static_cast<int>(s)}).role == Role::continuous_state)
                    f(places_[n][s]);
    };
    first_state_ = count;
    for_each_continuous([&](Place& its) { its.now = its.next = reserve(its.count); });
    states_ = count - first_state_;
    first_rate_ = count;
    for_each_continuous([&](Place& its) { its.rate = reserve(its.count); });
    cells_.assign(static_cast<std::size_t>(count), Dual(0));
    is_fixed_.assign(cells_.size(), 0);
    before_.resize(static_cast<std::size_t>(states_));
    for (int n = 0; n < static_cast<int>(places_.size()); ++n)
        for (int s = 0; s < static_cast<int>(places_[static_cast<std::size_t>(n)].size()); ++s) {
            const Slot& slot = d_.slot({n, s});
            if (slot.role != Role::parameter && slot.role != Role::input &&
                !d_.nodes[static_cast<std::size_t>(n)].block->declaration().traits.is_root_input)
                continue;
            for (int e = 0; e < slot.size.count(); ++e)
                elements({n, s})[e] = read_value(like.context().data(n, s), slot.type, e);
            if (slot.size.count() > 0 && origin(d_, {n, s}).node == n)
                is_fixed_[static_cast<std::size_t>(place({n, s}).now)] = 1;
        }
    clocks_.assign(3 * d_.rates.size(), Dual(0));
    flags_.assign(program_.flags.size(), 0);
    compile(program_.start, program::first, start_);
    compile(program_.step, program::first, step_);
    compile(program_.update, program::first, update_);
    compile(program_.derivatives, program::first, derivatives_);
    compile(program_.outputs, program::inside, inside_);
}

const DualRun::Place& DualRun::place(const Node::End& end) const {
    const auto from = origin(d_, end);
    return places_[static_cast<std::size_t>(from.node)][static_cast<std::size_t>(from.slot)];
}

void DualRun::refuse(const std::string& where, const std::string& what) const {
    throw RunError((where.empty() ? "" : where + ": ") + what);
}

// ---- binding

void DualRun::compile(const program::Statements& statements, program::Pass pass, Code& code) {
    for (const auto& statement : statements)
        if (statement.passes & pass) compile(statement, pass, code);
}

void DualRun::compile(const Statement& s, program::Pass pass, Code& code) {
    using Op = Instruction::Op;
    const auto path = s.node >= 0 ? d_.nodes[static_cast<std::size_t>(s.node)].path : std::string();
    switch (s.kind) {
    case Kind::run: code.push_back({Op::task, bind(s.node, s.phase, s.index)}); return;
    case Kind::commit: code.push_back({Op::commit, s.node}); return;
    case Kind::set: code.push_back({Op::set, s.number}); return;
    case Kind::rest: code.push_back({Op::rest, s.node}); return;
    case Kind::start: return;
    case Kind::finite: code.push_back({Op::finite, place(s.signal).now, place(s.signal).count}); return;
    case Kind::assign: code.push_back({Op::assign, s.flag, 0, tests(s.when)}); return;
    case Kind::clear: code.push_back({Op::clear, s.flag}); return;
    case Kind::hit: code.push_back({Op::hit, s.number, s.flag}); return;
    case Kind::when: {
        const auto at = code.size();
        code.push_back({Op::test, 0, 0, tests(s.when)});
        compile(s.body, pass, code);
        code[at].end = static_cast<int>(code.size());
        return;
    }
    case Kind::integrate: code.push_back({Op::integrate}); return;
    case Kind::evaluate: return compile(program_.outputs, s.pass, code);
    case Kind::constants: return compile(program_.constants, program::first, code);
    case Kind::call: return compile(program_.procedures[static_cast<std::size_t>(s.number)].body, pass, code);
    case Kind::reset:
        throw NoRule(path + ": it resets its states by a method, of which no derivative is known; leave it "
                            "out, or give initial values");
    case Kind::solve:
        refuse(d_.plan.loops[static_cast<std::size_t>(s.number)].path,
               "the equations of an algebraic loop are not differentiated over a run; break it with a delay");
    default: refuse_jumps();
    }
}

void DualRun::refuse_jumps() const {
    std::vector<std::string> all;
    const auto add = [&](const std::string& path, const char* what) {
        const auto text = "'" + path + "' " + what;
        if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
    };
    for (const auto& watched : program_.watched) // with fixed steps guards alone
        add(d_.nodes[static_cast<std::size_t>(watched.end.node)].path, "has events");
    for (const auto& memory : program_.memories)
        add(d_.conditions[static_cast<std::size_t>(memory.condition)].path,
            memory.is_reset ? "is reset" : "is triggered");
    for (const auto& loop : d_.plan.loops)
        if (loop.kind != Loop::Kind::algebraic) add(loop.path, "iterates");
    refuse({}, name_list(all) + ", which is not differentiated over a run; differentiate a model without "
                                "that, or by differences of runs");
}

const std::vector<Literal>& DualRun::tests(const std::vector<Literal>& literals) const {
    for (const auto& l : literals)
        if (l.kind != Literal::Kind::flag && l.kind != Literal::Kind::signal) refuse_jumps();
    return literals;
}

Dual* DualRun::memory(int node, const Call::Reference& operand) {
    const auto rate = 3 * static_cast<std::size_t>(d_.nodes[static_cast<std::size_t>(node)].rate);
    const auto at = [&](int place) { return cells_.data() + place; };
    switch (operand.source) {
    case Call::Source::slot: return at(place({node, operand.slot}).now);
    case Call::Source::next: return at(place({node, operand.slot}).next);
    case Call::Source::rate: return at(place({node, operand.slot}).rate);
    case Call::Source::time: return &clocks_[rate];
    case Call::Source::period: return &clocks_[rate + 1];
    case Call::Source::trigger: return &clocks_[rate + 2];
    case Call::Source::constants: break;
    }
    const auto& values = *operand.constants;
    constants_.push_back(std::make_unique<Dual[]>(values.size()));
    std::copy(values.begin(), values.end(), constants_.back().get());
    return constants_.back().get();
}

int DualRun::bind(int node, Phase phase, int index) {
    const auto& its = d_.nodes[static_cast<std::size_t>(node)];
    const auto& rules = its.block->declaration().rules(phase);
    const Call* call =
        index < static_cast<int>(rules.size()) ? &rules[static_cast<std::size_t>(index)] : nullptr;
    const auto [kernel, structure] = call ? dual_kernel(call->kernel) : DualKernel{};
    if (!kernel)
        throw NoRule(its.path + ": its derivative is not known step by step, as that of rules is; such "
                                "gradients of runs go through standard blocks alone");
    auto& memory = views_.emplace_back(std::make_unique<kernels::View<Dual>[]>(call->operands.size()));
    const auto listed = static_cast<std::size_t>(std::max(call->list_size, 0));
    std::size_t plain = 0, list = call->operands.size() - (call->list_from >= 0 ? listed : 0);
    const auto first_of_list = list;
    std::vector<std::pair<int, int>> reads, writes;
    std::array<int, 2> factors{-1, -1}; // of what is no list
    for (std::size_t k = 0; k < call->operands.size(); ++k) {
        const auto& operand = call->operands[k];
        Size size;
        if (operand.slot >= 0)
            size = d_.slot({node, operand.slot}).size;
        else if (operand.constants)
            size.rows = static_cast<int>(operand.constants->size());
        const bool is_listed = call->list_from >= 0 && static_cast<int>(k) >= call->list_from &&
                               static_cast<int>(k) < call->list_from + call->list_size;
        Dual* const numbers = this->memory(node, operand);
        memory[is_listed ? list++ : plain++] = {numbers, size.rows, size.cols};
        if (operand.slot < 0 || size.count() == 0) continue; // constants and clocks
        const std::pair<int, int> cells(static_cast<int>(numbers - cells_.data()), size.count());
        if (k == 1 || k == 2) factors[k - 1] = cells.first;
        const auto add = [&](auto& to) {
            if (std::find(to.begin(), to.end(), cells) == to.end()) to.push_back(cells);
        };
        const bool is_target = is_written(d_, node, phase, operand);
        if (is_target) add(writes);
        if (!is_target || d_.slot({node, operand.slot}).role == Role::workspace) add(reads);
    }
    const auto is_matrix = [&](std::size_t k) { return memory[k].size() != 1; };
    const bool is_product =
        kernel->name == kernels::MatrixProduct::name ||
        (kernel->name == kernels::ScalarOrMatrixProduct::name && is_matrix(1) && is_matrix(2));
    bound_.push_back({kernel->run,
                      memory.get(),
                      {memory.get() + first_of_list, static_cast<int>(list - first_of_list)},
                      node,
                      structure,
                      is_product,
                      factors,
                      std::move(reads),
                      std::move(writes)});
    return static_cast<int>(bound_.size()) - 1;
}

// ---- running

bool DualRun::holds(const std::vector<Literal>& when) const {
    return std::all_of(when.begin(), when.end(), [this](const Literal& test) {
        bool is = false;
        if (test.kind == Literal::Kind::flag) {
            is = flags_[static_cast<std::size_t>(test.number)] != 0;
        } else {
            const auto& its = place(test.signal);
            for (int e = 0; e < its.count; ++e) is |= cells_[static_cast<std::size_t>(its.now + e)].value > 0;
        }
        return is != test.is_negated;
    });
}

void DualRun::start() {
    steps_ = 0;
    std::fill(flags_.begin(), flags_.end(), 0);
    until_hit_.clear();
    for (std::size_t r = 0; r < d_.rates.size(); ++r) {
        until_hit_.push_back(d_.rates[r].offset);
        clocks_[3 * r] = 0;
        clocks_[3 * r + 1] = d_.rates[r].is_continuous ? 0 : d_.period(static_cast<int>(r));
    }
    run(start_);
}

void DualRun::outputs() { run(step_); }

void DualRun::update() {
    run(update_);
    ++steps_;
}

void DualRun::run(const Code& code) {
    using Op = Instruction::Op;
    for (std::size_t i = 0; i < code.size(); ++i) {
        const Instruction& one = code[i];
        const auto a = static_cast<std::size_t>(one.a);
        switch (one.op) {
        case Op::task: {
            const Bound& task = bound_[a];
            if (is_remembered_) {
                for (const auto& [first, count] : task.writes) note_values(first, count);
                note(Done::Op::task, one.a);
            }
            if (!task.run(task.views, task.list)) [[unlikely]]
                refuse(d_.nodes[static_cast<std::size_t>(task.node)].path,
                       "it fails at " + std::to_string(time()) + " s; bf run says why");
            break;
        }
        case Op::commit:
            for (const auto& its : places_[a])
                if (its.next >= 0 && its.rate < 0) {
                    if (is_remembered_) {
                        note_values(its.now, its.count);
                        note(Done::Op::move, its.now, its.next, its.count);
                    }
                    std::copy_n(cells_.begin() + its.next, its.count, cells_.begin() + its.now);
                }
            break;
        case Op::hit: {
            const bool is_hit = until_hit_[a]-- == 0;
            flags_[static_cast<std::size_t>(one.end)] = is_hit;
            if (!is_hit) break;
            until_hit_[a] = d_.rates[a].ticks - 1;
            if (is_remembered_) note(Done::Op::clock, static_cast<int>(3 * a));
            clocks_[3 * a] = time();
            break;
        }
        case Op::assign: flags_[a] = holds(one.when); break;
        case Op::clear: flags_[a] = 0; break;
        case Op::test:
            if (!holds(one.when)) i = static_cast<std::size_t>(one.end) - 1;
            break;
        case Op::rest:
            for (const auto& its : places_[a])
                if (its.rate >= 0) {
                    if (is_remembered_) {
                        note_values(its.rate, its.count);
                        note(Done::Op::fill, its.rate, 0, its.count);
                    }
                    std::fill_n(cells_.begin() + its.rate, its.count, Dual(0));
                }
            break;
        case Op::set: set(program_.sets[a]); break;
        case Op::finite:
            for (int e = 0; e < one.end; ++e)
                if (!std::isfinite(cells_[a + static_cast<std::size_t>(e)].value))
                    refuse({}, "a signal became NaN or infinite at " + std::to_string(time()) +
                                   " s; bf run says which");
            break;
        case Op::integrate: integrate(); break;
        }
    }
}

/// Of a state x⁻ and x⁺ agree.
void DualRun::set(const program::Set& set) {
    const auto& to = place(set.quantity);
    for (const int first : {to.now, to.next == to.now ? -1 : to.next})
        if (is_remembered_ && first >= 0) {
            note_values(first, to.count);
            const bool has_source = set.source.node >= 0 && place(set.source).count > 0;
            note(!has_source                           ? Done::Op::fill
                 : place(set.source).count == to.count ? Done::Op::move
                                                       : Done::Op::spread,
                 first, has_source ? place(set.source).now : 0, to.count);
        }
    for (int e = 0; e < to.count; ++e) {
        Dual value = 0;
        if (set.source.node >= 0) {
            const auto& from = place(set.source);
            if (from.count > 0)
                value = cells_[static_cast<std::size_t>(from.now + (from.count == 1 ? 0 : e))];
        } else if (!set.values.empty()) {
            value = set.values[set.values.size() == 1 ? 0 : static_cast<std::size_t>(e)];
        }
        cells_[static_cast<std::size_t>(to.now + e)] = value;
        if (to.next >= 0) cells_[static_cast<std::size_t>(to.next + e)] = value;
    }
}

/// A step is linear in states and rates: their derivatives go the way of the values beside them.
void DualRun::integrate() {
    constexpr int parts = 1 + Dual::directions;
    static_assert(sizeof(Dual) == parts * sizeof(double));
    const auto numbers = [](Dual* dual) { return reinterpret_cast<double*>(dual); };
    const auto derivative = [&](int stage, double t) {
        if (is_remembered_) note(Done::Op::stage, stage);
        if (stage > 0) { // the first one stands where the outputs were computed
            for (std::size_t r = 1; r < d_.rates.size(); ++r)
                if (d_.rates[r].is_continuous) {
                    if (is_remembered_) note(Done::Op::clock, static_cast<int>(3 * r));
                    clocks_[3 * r] = t;
                }
            run(inside_);
        }
        run(derivatives_);
        if (is_remembered_) {
            note_values(first_state_, states_);
            note(Done::Op::slope, stage);
        }
        return true;
    };
    with_tableau(d_.solver.method, [&]<const kernels::ButcherTableau & method> {
        slopes_.resize(static_cast<std::size_t>(method.stages * states_));
        return kernels::runge_kutta_step<method>(
            time(), d_.step, parts * states_, numbers(cells_.data() + first_state_),
            numbers(cells_.data() + first_rate_), numbers(before_.data()), numbers(slopes_.data()),
            derivative);
    });
    if (is_remembered_) note(Done::Op::step);
    for (int e = 0; e < states_; ++e)
        if (!std::isfinite(cells_[static_cast<std::size_t>(first_state_ + e)].value))
            refuse({}, program::continuous_state_not_finite.text());
}

} // namespace bf::analysis

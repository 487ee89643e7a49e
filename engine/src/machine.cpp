#include "machine.hpp"
#include "succession.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace bf {

using program::Literal;
using program::Statement;
using Kind = Statement::Kind;

Simulation::Machine::Machine(Simulation& simulation)
    : simulation_(simulation), context_(simulation.context_), program_(simulation.program_),
      flags_(program_.flags.size()) {
    for (const auto& m : program_.memories)
        memories_.push_back({signal(m.signal), static_cast<program::Edge>(m.edge), {}});
    for (auto& memory : memories_) memory.last.resize(static_cast<std::size_t>(memory.signal.count));
    constants = compile(program_.constants);
    first_visited_ = tasks_.size();
    start = compile(program_.start);
    step = compile(program_.step);
    inside = compile(program_.outputs, program::inside);
    update = compile(program_.update);
    derivatives = compile(program_.derivatives);
    slopes = static_cast<int>(code_.size());
    emit(program_.outputs, program::inside);
    emit(program_.derivatives, program::first);
    emit(Op::end);
    guards = compile(program_.guards);
    again_ = compile(program_.outputs, program::again);
    arrive = compile(program_.arrive);
    event = compile(program_.event);
    for (const auto& procedure : program_.procedures) procedures_.push_back(compile(procedure.body));
    forget();
}

void Simulation::Machine::forget() {
    std::fill(flags_.begin(), flags_.end(), std::uint8_t{0});
    for (auto& memory : memories_)
        std::fill(memory.last.begin(), memory.last.end(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < counters_.size(); ++i)
        until_hit_[i] = simulation_.diagram_.rates[static_cast<std::size_t>(counters_[i].rate)].offset;
    first_hits_.assign(first_hits_.size(), {});
    last_first_hit_ = -1;
}

std::vector<std::span<std::byte>> Simulation::Machine::state() {
    std::vector<std::span<std::byte>> parts{std::as_writable_bytes(std::span(flags_)),
                                            std::as_writable_bytes(std::span(until_hit_))};
    for (auto& memory : memories_) parts.push_back(std::as_writable_bytes(std::span(memory.last)));
    return parts;
}

/// Whoever looks at tasks sees all of them from now on.
void Simulation::Machine::visit_tasks(const TaskVisitor& visit) {
    for (const auto& [place, begin, end] : std::exchange(moving_, {}))
        code_[static_cast<std::size_t>(place)] = {Op::tasks, true, begin, end};
    for (std::size_t i = first_visited_; i < tasks_.size(); ++i) {
        const auto& node = simulation_.diagram_.nodes[static_cast<std::size_t>(bound_[i].node)];
        visit(tasks_[i], bound_[i].phase, node.path, node.rate);
    }
}

// ---- binding

int Simulation::Machine::compile(const program::Statements& statements, program::Pass pass) {
    const int entry = static_cast<int>(code_.size());
    emit(statements, pass);
    emit(Op::end);
    return entry;
}

void Simulation::Machine::emit(const program::Statements& statements, program::Pass pass) {
    for (const auto& statement : statements)
        if (statement.passes & pass) emit(statement, pass);
}

int Simulation::Machine::emit(Op op, int a, int b, bool expected) {
    code_.push_back({op, expected, a, b});
    return static_cast<int>(code_.size()) - 1;
}

/// Was that emitted last, and is what follows reached from there alone?
bool Simulation::Machine::goes_on(Op op) const {
    return landed_ < static_cast<int>(code_.size()) && code_.back().op == op;
}

/// Goes on with what was emitted last, where that ends at a.
void Simulation::Machine::emit_range(Op op, std::size_t a, std::size_t b) {
    if (goes_on(op) && code_.back().b == static_cast<int>(a))
        code_.back().b = static_cast<int>(b);
    else
        emit(op, static_cast<int>(a), static_cast<int>(b));
}

std::vector<int> Simulation::Machine::emit_tests(const std::vector<Literal>& when) {
    std::vector<int> jumps;
    for (const auto& l : when) {
        int a = l.number;
        if (l.kind == Literal::Kind::signal) {
            a = static_cast<int>(signals_.size());
            signals_.push_back(signal(l.signal));
        }
        const auto op = l.kind == Literal::Kind::flag     ? Op::flag
                        : l.kind == Literal::Kind::signal ? Op::signal
                        : l.kind == Literal::Kind::memory ? Op::memory
                                                          : Op::crossing;
        jumps.push_back(emit(op, a, 0, !l.is_negated));
    }
    return jumps;
}

void Simulation::Machine::land(const std::vector<int>& jumps) {
    landed_ = static_cast<int>(code_.size());
    for (const int jump : jumps) code_[static_cast<std::size_t>(jump)].b = landed_;
}

Simulation::Machine::Signal Simulation::Machine::signal(const Node::End& end) {
    const Slot& slot = simulation_.diagram_.slot(end);
    return {context_.data(end.node, end.slot), slot.type, slot.size.count()};
}

void Simulation::Machine::emit(const Statement& s, program::Pass pass) {
    switch (s.kind) {
    case Kind::run: return emit_task(s);
    case Kind::commit: return emit_commits(s);
    case Kind::reset: emit(Op::reset, s.node); return;
    case Kind::rest: emit(Op::rest, s.node); return;
    case Kind::set: emit(Op::write, s.number); return;
    case Kind::start: emit(Op::start); return;
    case Kind::constants: emit(Op::constants); return;
    case Kind::finite:
    case Kind::fail:
        failures_.push_back({s.node, s.failure, {}});
        if (s.kind == Kind::finite) failures_.back().signal = signal(s.signal);
        emit(s.kind == Kind::finite ? Op::finite : Op::fail, static_cast<int>(failures_.size()) - 1);
        return;
    case Kind::assign: {
        const auto jumps = emit_tests(s.when);
        emit(Op::set, s.flag, 0, true);
        if (jumps.empty()) return;
        const int end = emit(Op::jump);
        land(jumps);
        emit(Op::set, s.flag, 0, false);
        return land({end});
    }
    case Kind::clear: emit(Op::set, s.flag, 0, false); return;
    case Kind::edge: emit(Op::edge, s.flag, s.number); return;
    case Kind::hit:
        counters_.push_back({s.number, program_.hit[static_cast<std::size_t>(s.number)],
                             simulation_.diagram_.rates[static_cast<std::size_t>(s.number)].ticks});
        until_hit_.push_back(0);
        return emit_range(Op::hits, counters_.size() - 1, counters_.size());
    case Kind::fire: emit(Op::fire, s.number); return;
    case Kind::when: {
        const auto jumps = emit_tests(s.when);
        emit(s.body, pass);
        return land(jumps);
    }
    case Kind::repeat: return emit_repeat(s, pass);
    case Kind::solve: return emit_solve(s, pass);
    case Kind::event:
        emit(Op::answer, static_cast<int>(answers_.size()));
        answers_.push_back({s.node, {}});
        for (int i = 0; i < context_.activities(s.node, Phase::event); ++i)
            answers_.back().tasks.push_back(context_.task(s.node, Phase::event, i));
        return;
    case Kind::look: emit(Op::look, s.flag, s.number); return;
    case Kind::locate: emit(Op::locate, s.flag, s.number); return;
    case Kind::observe: emit(Op::observe); return;
    case Kind::restart: emit(Op::restart); return;
    case Kind::integrate:
        failures_.push_back({-1, s.failure, {}});
        emit(Op::integrate, static_cast<int>(failures_.size()) - 1);
        return;
    case Kind::evaluate:
        if (s.pass == program::first) return emit(program_.outputs, s.pass);
        emit(Op::evaluate, s.pass);
        return;
    case Kind::call: emit(Op::call, s.number); return;
    }
}

/// Blocks that only move numbers, as those that join and split signals, are most of some diagrams, and a call
/// costs more than what it moves.
void Simulation::Machine::emit_task(const Statement& s) {
    const auto task = static_cast<int>(tasks_.size());
    tasks_.push_back(context_.task(s.node, s.phase, s.index));
    bound_.push_back({s.phase, s.node});
    const auto moves = context_.moves(tasks_.back(), s.node, s.phase, s.index);
    if (moves.empty()) return emit_range(Op::tasks, tasks_.size() - 1, tasks_.size());
    for (const auto& move : moves) {
        if (goes_on(Op::moves) && join(moves_.back(), move)) continue;
        moves_.push_back(move);
        emit_range(Op::moves, moves_.size() - 1, moves_.size());
    }
    const auto place = static_cast<int>(code_.size()) - 1;
    if (moving_.empty() || moving_.back().place != place) moving_.push_back({place, task, task});
    moving_.back().end = task + 1;
}

void Simulation::Machine::emit_commits(const Statement& s) {
    const auto& slots =
        simulation_.diagram_.nodes[static_cast<std::size_t>(s.node)].block->resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i].role != Role::discrete_state) continue;
        const int slot = static_cast<int>(i);
        const Commit next{static_cast<std::byte*>(context_.data(s.node, slot)),
                          static_cast<const std::byte*>(context_.next_data(s.node, slot)),
                          static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type)),
                          slots[i].type == Type::float64, s.failure};
        if (goes_on(Op::commits)) {
            auto& before = commits_.back();
            if (before.is_double == next.is_double && before.to + before.bytes == next.to &&
                before.from + before.bytes == next.from) {
                before.bytes += next.bytes;
                continue;
            }
        }
        commits_.push_back(next);
        emit_range(Op::commits, commits_.size() - 1, commits_.size());
    }
}

void Simulation::Machine::emit_repeat(const Statement& s, program::Pass pass) {
    const int loop = static_cast<int>(iterations_.size());
    iterations_.push_back({static_cast<double>(s.number), 0, 0, {}});
    if (s.signal.node >= 0) iterations_.back().count = signal(s.signal);
    emit(Op::repeat, loop);
    const int begin = emit(Op::next, loop);
    landed_ = begin;
    emit(s.body, pass);
    auto ends = emit_tests(s.when);
    emit(Op::jump, 0, begin);
    land({begin});
    emit(s.otherwise, pass);
    land(ends);
}

/// The body stands aside: the solver runs it as often as it needs.
void Simulation::Machine::emit_solve(const Statement& s, program::Pass pass) {
    const int around = emit(Op::jump), body = compile(s.body, pass);
    std::vector<std::span<double>> unknowns;
    const auto& diagram = simulation_.diagram_;
    for (const auto& end : diagram.plan.loops[static_cast<std::size_t>(s.number)].unknowns)
        unknowns.emplace_back(static_cast<double*>(context_.data(end.node, end.slot)),
                              static_cast<std::size_t>(diagram.slot(end).size.count()));
    land({around});
    emit(Op::solve, static_cast<int>(solvers_.size()), s.node);
    try {
        solvers_.push_back(
            std::make_unique<AlgebraicSolver>(std::move(unknowns), [this, body] { return run(body); }));
    } catch (const std::runtime_error& error) {
        throw RunError(diagram.nodes[static_cast<std::size_t>(s.node)].path + ": " + error.what());
    }
}

// ---- running

bool Simulation::Machine::Signal::is_above_zero() const noexcept {
    for (int i = 0; i < count; ++i)
        if ((*this)[i] > 0) return true;
    return false;
}

bool Simulation::Machine::Memory::has_edge() noexcept {
    bool is_found = false;
    for (std::size_t i = 0; i < last.size(); ++i) {
        const double now = signal[static_cast<int>(i)];
        is_found = is_found || program::is_edge(edge, last[i], now);
        last[i] = now;
    }
    return is_found;
}

bool Simulation::Machine::test(const Instruction& i) const noexcept {
    const auto number = static_cast<std::size_t>(i.a);
    const auto is_positive = [](double value) { return value > 0; };
    if (i.op == Op::signal) return signals_[number].is_above_zero();
    if (i.op == Op::crossing) return simulation_.crossed(i.a);
    const auto& last = memories_[number].last;
    return std::any_of(last.begin(), last.end(), is_positive);
}

bool Simulation::Machine::fail(int failing) noexcept {
    const auto& f = failures_[static_cast<std::size_t>(failing)];
    return simulation_.fail(f.status, f.node);
}

/// Continuous states that do not run keep their value.
void Simulation::Machine::rest(int node) noexcept {
    const auto& slots = simulation_.diagram_.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].role == Role::continuous_state)
            std::memset(context_.frame(node).rate[i], 0,
                        static_cast<std::size_t>(slots[i].size.count()) * sizeof(double));
}

bool Simulation::Machine::commit(const Commit& commit) noexcept {
    if (commit.is_double) {
        const auto* from = reinterpret_cast<const double*>(commit.from);
        const std::size_t count = commit.bytes / sizeof(double);
        bool is_nan = false;
        for (std::size_t i = 0; i < count; ++i) is_nan |= from[i] != from[i];
        if (is_nan) [[unlikely]] {
            while (*from == *from) ++from;
            return simulation_.fail(commit.failure, simulation_.owner(Role::discrete_state, from));
        }
    }
    std::memcpy(commit.to, commit.from, commit.bytes);
    return true;
}

namespace {
void move(const Move& move) noexcept {
    constexpr int few = 8; // are copied sooner than memcpy begins
    if (move.count > few) {
        std::memcpy(move.to, move.from, static_cast<std::size_t>(move.count) * sizeof(double));
        return;
    }
    double* const to = move.to;
    for (int i = 0; i < move.count; ++i) to[i] = move.from[i];
}
} // namespace

bool Simulation::Machine::run(int entry) noexcept {
    Simulation& s = simulation_;
    const Instruction* const code = code_.data();
    for (const Instruction* i = code + entry;; ++i) {
        const auto a = static_cast<std::size_t>(i->a), b = static_cast<std::size_t>(i->b);
        switch (i->op) {
        case Op::end: return true;
        case Op::tasks: {
            if (s.steps_ <= last_first_hit_) [[unlikely]] {
                if (!run_with_first_hits(a, b)) return false;
                break;
            }
            const Task* const end = tasks_.data() + b;
            for (const Task* task = tasks_.data() + a; task != end; ++task)
                if (const Status status = (*task)(); !status) [[unlikely]]
                    return s.fail(status, bound_[static_cast<std::size_t>(task - tasks_.data())].node);
            break;
        }
        case Op::moves:
            for (std::size_t m = a; m < b; ++m) move(moves_[m]);
            break;
        case Op::commits:
            for (std::size_t c = a; c < b; ++c)
                if (!commit(commits_[c])) [[unlikely]]
                    return false;
            break;
        case Op::hits:
            for (std::size_t c = a; c < b; ++c) {
                const Counter& counter = counters_[c];
                const bool is_hit = until_hit_[c]-- == 0;
                flags_[static_cast<std::size_t>(counter.flag)] = is_hit;
                if (!is_hit) continue;
                until_hit_[c] = counter.ticks - 1;
                program::hit(context_.clock(counter.rate), s.time());
            }
            break;
        case Op::jump: i = code + b - 1; break;
        case Op::flag:
            if ((flags_[a] != 0) != i->expected) i = code + b - 1;
            break;
        case Op::signal:
        case Op::memory:
        case Op::crossing:
            if (test(*i) != i->expected) i = code + b - 1;
            break;
        case Op::set: flags_[a] = i->expected; break;
        case Op::edge: flags_[a] = memories_[b].has_edge(); break;
        case Op::fire: program::fire(context_.clock(i->a), s.time()); break;
        case Op::reset:
            if (is_absent(i->a)) break;
            if (const Status status = context_.reset(i->a); !status) return s.fail(status, i->a);
            break;
        case Op::rest: rest(i->a); break;
        case Op::write: {
            const auto& [quantity, source, values] = program_.sets[a];
            context_.set(quantity, source, values);
            break;
        }
        case Op::start:
            if (!s.start_blocks()) return false;
            break;
        case Op::constants:
            if (!run(constants)) return false;
            break;
        case Op::finite:
            for (int e = 0; e < failures_[a].signal.count; ++e)
                if (!std::isfinite(failures_[a].signal[e])) return fail(i->a);
            break;
        case Op::repeat: {
            auto& loop = iterations_[a];
            loop.done = 0;
            loop.most = loop.count.data ? loop.count[0] : loop.given;
            break;
        }
        case Op::next:
            if (!(++iterations_[a].done <= iterations_[a].most)) i = code + b - 1;
            break;
        case Op::solve:
            if (solvers_[a]->solve()) break;
            return s.status_ ? s.fail(solvers_[a]->failure(), i->b) : false;
        case Op::answer: {
            const auto& [node, tasks] = answers_[a];
            s.show_directions(node);
            if (const Status status = context_.event(node, tasks); !status) return s.fail(status, node);
            break;
        }
        case Op::look:
        case Op::locate:
            if (!(i->op == Op::look ? s.find_crossings() : s.take_crossings())) return false;
            flags_[a] = s.has_crossed(false);
            flags_[b] = s.has_crossed(true);
            break;
        case Op::observe: s.observe_event(); break;
        case Op::restart: s.must_restart_ = true; break;
        case Op::integrate:
            if (!s.integrate(failures_[a].status)) return false;
            break;
        case Op::evaluate:
            if (!run(i->a == program::inside ? inside : again_)) return false;
            break;
        case Op::call:
            if (!run(procedures_[a])) return false;
            break;
        case Op::fail: return fail(i->a);
        }
    }
}

} // namespace bf

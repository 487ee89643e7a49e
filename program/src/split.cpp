// Program → tasks, one for each period.
#include "bf/program/program.hpp"

#include "lists.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace bf::program {

namespace {

using Kind = Statement::Kind;

/// A task is called by the first rate of its period and offset; that of constants is none.
class Splitting {
  public:
    explicit Splitting(Program& program) : p_(program), d_(*program.diagram) {}

    std::vector<std::string> run() {
        place_blocks();
        for (const auto& read : reads_) check(read);
        for (int c = 1; c < count(d_.conditions); ++c) {
            const auto& condition = at(d_.conditions, c);
            check_one_task(condition.path, condition.nodes, task(condition.rate));
        }
        for (const auto& loop : d_.plan.loops) check_one_task(loop.path, loop.nodes, task(loop.rate));
        for (const auto& watched : p_.watched)
            refuse(path(watched.end.node),
                   "answers zero crossings, after which blocks of all periods may compute again",
                   "generate one function for all periods");
        if (problems_.empty()) deal();
        return std::move(problems_);
    }

  private:
    /// Who reads a signal: a block, or what decides about a subsystem.
    struct Read {
        Node::End from;
        int task;
        std::string path;
        int node = -1, slot = -1;
    };

    const SampleRate& rate(int r) const { return at(d_.rates, r); }
    const std::string& path(int node) const { return at(d_.nodes, node).path; }
    const Declaration& declaration(int node) const { return at(d_.nodes, node).block->declaration(); }
    bool changes_rate(int node) const { return declaration(node).traits.changes_rate; }

    int task(int r) const {
        while (rate(r).trigger > 0) r = at(d_.conditions, rate(r).trigger).rate;
        if (r == constant_rate) return constant_rate;
        for (int first = 1;; ++first)
            if (rate(first).trigger == 0 && rate(first).ticks == rate(r).ticks &&
                rate(first).offset == rate(r).offset)
                return first;
    }
    /// Is every hit of the slow one a hit of the fast one?
    bool includes(int fast, int slow) const {
        const auto distance = rate(slow).offset - rate(fast).offset;
        return rate(slow).ticks % rate(fast).ticks == 0 && distance >= 0 && distance % rate(fast).ticks == 0;
    }
    bool precedes(int a, int b) const {
        return std::pair(rate(a).ticks, rate(a).offset) < std::pair(rate(b).ticks, rate(b).offset);
    }
    /// The other one where that is hit whenever this one is.
    int faster(int task, int other) const {
        return other != constant_rate && includes(other, task) ? other : task;
    }

    static bool reads(const std::vector<Call>& rules, int slot) {
        return std::any_of(rules.begin(), rules.end(), [&](const Call& rule) { return rule.reads(slot); });
    }

    // ---- where blocks run

    void find_reads() {
        for (int n = 0; n < count(d_.nodes); ++n)
            for (int s = 0; s < count(at(d_.nodes, n).sources); ++s)
                if (const auto& from = at(at(d_.nodes, n).sources, s); from.node >= 0)
                    reads_.push_back({from, task(at(d_.nodes, n).rate), path(n), n, s});
        const auto add = [&](const Node::End& from, int r, const std::string& path) {
            if (from.node >= 0) reads_.push_back({from, task(r), path});
        };
        for (const auto& c : d_.conditions)
            for (const auto& from : {c.enable, c.trigger, c.reset}) add(from, c.rate, c.path);
        for (const auto& l : d_.plan.loops)
            for (const auto& from : {l.count, l.initial, l.again}) add(from, l.rate, l.path);
    }

    void place_blocks() {
        find_reads();
        for (const auto& node : d_.nodes) update_.push_back(task(node.rate));
        // An input of the model is there when it is read first.
        std::map<int, int> inputs;
        for (const auto& read : reads_)
            if (declaration(read.from.node).traits.is_root_input) {
                const auto [input, is_new] = inputs.try_emplace(read.from.node, read.task);
                if (!is_new) input->second = faster(input->second, read.task);
            }
        for (const auto& [node, task] : inputs) at(update_, node) = task;
        hits_ = update_;
        for (const auto& read : reads_)
            if (read.node >= 0 && changes_rate(read.node))
                at(update_, read.node) = faster(at(update_, read.node), at(hits_, read.from.node));
        output_ = update_;
        for (const auto& read : reads_)
            if (const int from = read.from.node; changes_rate(from) && !has_feedthrough(from))
                at(output_, from) =
                    faster(at(output_, from), read.node >= 0 ? at(update_, read.node) : read.task);
    }
    bool has_feedthrough(int node) const {
        const auto& slots = declaration(node).slots;
        for (int s = 0; s < count(slots); ++s)
            if (at(slots, s).role == Role::input && reads(declaration(node).output_rules, s)) return true;
        return false;
    }

    // ---- what cannot be split

    std::string period(int task) const { return period_text(d_, task); }
    void refuse(const std::string& path, const std::string& why, const std::string& remedy) {
        const std::string problem = path + ": " + why + "; " + remedy;
        if (std::find(problems_.begin(), problems_.end(), problem) == problems_.end())
            problems_.push_back(problem);
    }

    /// What a task reads is its own, or was written before it began and is not before it ends.
    bool is_consistent(int from, int reader) const {
        const int writer = at(output_, from);
        return writer == constant_rate || writer == reader ||
               (precedes(writer, reader) && includes(reader, at(hits_, from)));
    }

    void check(const Read& read) {
        std::vector<int> readers;
        if (read.node < 0) {
            readers.push_back(read.task);
        } else {
            if (reads(declaration(read.node).update_rules, read.slot))
                readers.push_back(at(update_, read.node));
            if (readers.empty() || reads(declaration(read.node).output_rules, read.slot))
                readers.push_back(at(output_, read.node));
        }
        for (const int reader : readers) {
            if (is_consistent(read.from.node, reader)) continue;
            const int from = at(hits_, read.from.node);
            const std::string where =
                "at " + period(read.task) + " it reads " + d_.end_path(read.from) + " at " + period(from);
            if (!includes(from, read.task) && !includes(read.task, from))
                refuse(read.path, where + ", and neither is hit whenever the other is",
                       "pass the signal through a block of a period that both are multiples of");
            else
                refuse(read.path, where,
                       "put a RateTransition with period " +
                           (precedes(from, read.task) ? period(read.task)
                                                      : period(from) + " and `mode: delay`") +
                           " in between, or say `rate_transitions: inserted`");
        }
    }

    void check_one_task(const std::string& subsystem, const std::vector<int>& nodes, int its) {
        for (const int n : nodes)
            for (const int task : {at(output_, n), at(update_, n)})
                if (task != constant_rate && task != its) {
                    refuse(path(n),
                           "runs at " + period(task) + " in '" + subsystem + "', which is decided about at " +
                               period(its),
                           "give all of that subsystem one period, and change rates outside of it");
                    break;
                }
    }

    // ---- tasks

    int task_of_flag(const Flag& flag) const {
        const bool has_condition = flag.kind == Flag::Kind::enabled || flag.kind == Flag::Kind::triggered;
        return task(has_condition ? at(d_.conditions, flag.number).rate : flag.number);
    }

    int owner(const Statement& s) const {
        switch (s.kind) {
        case Kind::run: return at(s.phase == Phase::update ? update_ : output_, s.node);
        case Kind::commit: return at(update_, s.node);
        case Kind::set: return at(output_, at(p_.sets, s.number).quantity.node);
        case Kind::call: return task(at(d_.conditions, at(p_.procedures, s.number).condition).rate);
        case Kind::assign:
        case Kind::clear: return task_of_flag(at(p_.flags, s.flag));
        case Kind::when:
        case Kind::repeat: return owner(s.body.front());
        case Kind::integrate:
            for (int r = 1;; ++r)
                if (rate(r).is_continuous) return task(r);
        default: return at(output_, s.node);
        }
    }

    /// The hits of a slower rate in the calls of a task.
    int hit_in(int task, int rate) {
        const auto [place, is_new] = hit_in_.try_emplace({task, rate}, count(p_.flags));
        if (is_new)
            p_.flags.push_back(
                {Flag::Kind::hit, rate,
                 at(p_.flags, at(p_.hit, rate)).name + " in " + at(p_.flags, at(p_.hit, task)).name, task});
        return place->second;
    }

    /// Of a task's own rate it needs no hit.
    std::vector<Literal> inside(const std::vector<Literal>& when, int task) {
        std::vector<Literal> all;
        for (Literal literal : when) {
            const Flag* flag = literal.kind == Literal::Kind::flag ? &at(p_.flags, literal.number) : nullptr;
            if (flag && flag->kind == Flag::Kind::hit && rate(flag->number).trigger == 0) {
                if (this->task(flag->number) == task) continue;
                literal.number = hit_in(task, flag->number);
            }
            all.push_back(literal);
        }
        return all;
    }

    Statements part(const Statements& all, int task) {
        Statements some;
        for (const auto& s : all) {
            const bool is_conditional = s.kind == Kind::when;
            if (!is_conditional && owner(s) != task) continue;
            Statement one = s;
            one.body = part(s.body, task);
            one.otherwise = part(s.otherwise, task);
            if (is_conditional && one.body.empty()) continue;
            one.when = inside(s.when, task);
            if (is_conditional && one.when.empty())
                some.insert(some.end(), one.body.begin(), one.body.end());
            else
                some.push_back(std::move(one));
        }
        return some;
    }

    void deal() {
        for (int r = 1; r < count(d_.rates); ++r) {
            if (task(r) != r) continue;
            Task one{r, {}, part(p_.outputs, r), part(p_.update, r), {}};
            for (const auto& [key, flag] : hit_in_)
                if (key.first == r)
                    one.hits.push_back({.kind = Kind::hit, .number = key.second, .flag = flag});
            for (int n = 0; n < count(d_.nodes); ++n)
                if (at(output_, n) == r) one.nodes.push_back(n);
            if (!one.outputs.empty() || !one.update.empty()) p_.tasks.push_back(std::move(one));
        }
        for (auto& procedure : p_.procedures)
            procedure.task = task(at(d_.conditions, procedure.condition).rate);
        std::sort(p_.tasks.begin(), p_.tasks.end(),
                  [&](const Task& a, const Task& b) { return precedes(a.rate, b.rate); });
    }

    Program& p_;
    const Diagram& d_;
    std::vector<Read> reads_;
    std::vector<int> hits_, output_, update_; ///< by node: its own task; those that run its rules
    std::map<std::pair<int, int>, int> hit_in_;
    std::vector<std::string> problems_;
};

} // namespace

std::vector<std::string> split(Program& program) { return Splitting(program).run(); }

} // namespace bf::program

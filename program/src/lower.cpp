// Diagram → Program: every rule of a step is said here, once.
#include "bf/program/program.hpp"

#include "lists.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

namespace bf::program {

namespace {

using Kind = Statement::Kind;

constexpr int most_answers = 1001; ///< to crossings at one instant

Literal flag(int number) { return {.number = number}; }
Literal above_zero(const Node::End& signal) { return {.kind = Literal::Kind::signal, .signal = signal}; }
Literal crossing_of(int node) { return {.kind = Literal::Kind::crossing, .number = node}; }
Literal operator!(Literal literal) {
    literal.is_negated = !literal.is_negated;
    return literal;
}

Statement of(Kind kind) { return {.kind = kind}; }
Statement of_node(Kind kind, int node, Status failure = {}) {
    return {.kind = kind, .node = node, .failure = failure};
}
Statement numbered(Kind kind, int number) { return {.kind = kind, .number = number}; }
Statement assign(int to, std::vector<Literal> when = {}) {
    return {.kind = Kind::assign, .flag = to, .when = std::move(when)};
}
Statement clear(int flag) { return {.kind = Kind::clear, .flag = flag}; }
Statement if_all(std::vector<Literal> when, Statements body) {
    std::uint8_t passes = 0;
    for (const auto& statement : body) passes |= statement.passes;
    return {.kind = Kind::when, .passes = passes, .when = std::move(when), .body = std::move(body)};
}
void append(Statements& to, Statements more) {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

class Lowering {
  public:
    Lowering(const Diagram& diagram, Integrator integrator)
        : d_(diagram), is_needed_(diagram.needed_inside_a_step()),
          is_callers_(integrator == Integrator::caller) {
        p_.diagram = &diagram;
        for (int n = 0; n < count(d_.nodes); ++n)
            for (const Slot& s : slots(n))
                is_continuous_ |= s.role == Role::continuous_state && s.size.count() > 0;
        is_adaptive_ = is_continuous_ && is_adaptive(d_.solver.method);
    }

    Program run() {
        make_flags();
        find_watched();
        make_procedures();
        for (const auto& segment : d_.plan.outputs)
            if (segment.rate == constant_rate) append(p_.constants, activities(segment, first));
        lower_start();
        lower_outputs();
        p_.derivatives = phase(d_.plan.derivatives, Phase::derivative);
        p_.guards = phase(d_.plan.guards, Phase::guards, p_.watched);
        p_.marks = phase(d_.plan.guards, Phase::guards, p_.marked);
        for (int r = 1; r < count(d_.rates); ++r)
            if (rate(r).trigger == 0)
                p_.step.push_back({.kind = Kind::hit, .number = r, .flag = at(p_.hit, r)});
        p_.step.push_back({.kind = Kind::evaluate, .pass = first});
        if (!p_.watched.empty()) {
            p_.step.push_back(look(Kind::look));
            p_.step.push_back(if_all({flag(crossed_)}, {numbered(Kind::call, answer_)}));
        }
        if (d_.refuses_non_finite) append(p_.update, finite());
        append(p_.update, updates(d_.plan.updates, [](const Segment&) { return true; }));
        append(p_.update, clear_triggers());
        if (is_continuous_) p_.update.push_back(of_node(Kind::integrate, -1, continuous_state_not_finite));
        if (is_adaptive_ || is_callers_) lower_event();
        return std::move(p_);
    }

  private:
    const Condition& condition(int c) const { return at(d_.conditions, c); }
    const SampleRate& rate(int r) const { return at(d_.rates, r); }
    const std::vector<Slot>& slots(int n) const { return at(d_.nodes, n).block->resolution().slots; }
    bool has(int n, Role role) const {
        return std::any_of(slots(n).begin(), slots(n).end(), [&](const Slot& s) { return s.role == role; });
    }
    bool has_trigger(int c) const { return condition(c).trigger.node >= 0; }

    // ---- names

    int new_flag(Flag::Kind kind, int number, std::string name) {
        p_.flags.push_back({kind, number, std::move(name)});
        return count(p_.flags) - 1;
    }
    int local(const char* name) { return new_flag(Flag::Kind::local, -1, name); }
    int procedure(std::string name, int condition = -1) {
        p_.procedures.push_back({std::move(name), {}, condition});
        return count(p_.procedures) - 1;
    }
    int memory(int c, const Node::End& signal, model::Edge edge, bool is_reset) {
        p_.memories.push_back({signal, edge, c, is_reset});
        return count(p_.memories) - 1;
    }

    void make_flags() {
        p_.hit.push_back(-1);
        for (int r = 1; r < count(d_.rates); ++r) {
            std::string name = rate(r).trigger > 0     ? condition(rate(r).trigger).path + ".fired"
                               : rate(r).is_continuous ? "hit(continuous)"
                                                       : "hit(" + period_text(d_, r) + ")";
            p_.hit.push_back(new_flag(Flag::Kind::hit, r, std::move(name)));
        }
        enabled_ = p_.active = {-1};
        for (int c = 1; c < count(d_.conditions); ++c) {
            const std::string& path = condition(c).path;
            enabled_.push_back(new_flag(Flag::Kind::enabled, c, path + ".enabled"));
            p_.active.push_back(has_trigger(c) ? new_flag(Flag::Kind::triggered, c, path + ".triggered")
                                               : enabled_.back());
        }
    }

    /// Between fixed steps nothing is located: only who answers a crossing needs to know of it. Adaptive
    /// solvers watch continuous signals that control subsystems, too.
    void find_watched() {
        for (const auto& segment : d_.plan.guards) {
            int last = -1;
            for (const auto& activity : segment.activities) {
                if (std::exchange(last, activity.node) == activity.node) continue;
                const auto& node = at(d_.nodes, last);
                const bool has_events =
                    node.block->answers(node.methods) || node.block->declaration().traits.goes_on;
                bool has_answer = false;
                for (int s = 0; s < count(slots(last)); ++s) {
                    const Slot& slot = at(slots(last), s);
                    if (slot.role != Role::guard || slot.size.count() == 0) continue;
                    // What counts only marks where a solver must stop.
                    const bool is_answered = has_events && slot.type == Type::float64;
                    has_answer |= is_answered;
                    if (is_adaptive_ || is_answered)
                        p_.watched.push_back({{last, s}, segment.condition, false, is_answered});
                    else if (is_callers_)
                        p_.marked.push_back({{last, s}, segment.condition, false, false});
                }
                if (has_answer) answering_.push_back(last);
            }
        }
        for (const auto& c : d_.conditions)
            for (const auto& signal : {c.enable, c.trigger, c.reset})
                if ((is_adaptive_ || is_callers_) && signal.node >= 0 &&
                    rate(at(d_.nodes, signal.node).rate).is_continuous)
                    (is_adaptive_ ? p_.watched : p_.marked).push_back({signal, c.parent, true, false});
        if (is_continuous_) passes_ |= inside;
        if (is_callers_) passes_ |= again | between;
        if (is_callers_ || (is_adaptive_ && !p_.watched.empty()))
            inside_ = new_flag(Flag::Kind::inside, -1, "inside a step");
        if (p_.watched.empty()) return;
        passes_ |= again;
        crossed_ = new_flag(Flag::Kind::crossed, -1, "crossed");
        answered_ = new_flag(Flag::Kind::answered, -1, "answered");
    }

    void make_procedures() {
        disable_ = test_ = {-1};
        for (int c = 1; c < count(d_.conditions); ++c) {
            const int parent = condition(c).parent;
            const bool can_end = condition(c).enable.node >= 0 || (parent > 0 && at(disable_, parent) >= 0);
            disable_.push_back(can_end ? procedure("disable " + condition(c).path, c) : -1);
        }
        for (int c = 1; c < count(d_.conditions); ++c) {
            test_.push_back(procedure("test " + condition(c).path, c));
            Statements tests = test(c);
            at(p_.procedures, at(test_, c)).body = std::move(tests);
            if (at(disable_, c) >= 0) at(p_.procedures, at(disable_, c)).body = disable(c);
        }
        if (p_.watched.empty()) return;
        answer_ = procedure("answer crossings");
        Statements answers = answer();
        at(p_.procedures, answer_).body = std::move(answers);
    }

    // ---- conditions

    /// When the blocks of a rate and condition run. A trigger that fires makes its rate hit and its condition
    /// true, and both end together.
    std::vector<Literal> due(const Segment& segment) const {
        std::vector<Literal> all;
        const auto& r = rate(segment.rate);
        if (r.trigger > 0)
            all.push_back(flag(at(p_.active, r.trigger)));
        else if (r.ticks > 1 || r.offset > 0)
            all.push_back(flag(at(p_.hit, segment.rate)));
        if (segment.condition > 0 && segment.condition != r.trigger)
            all.push_back(flag(at(p_.active, segment.condition)));
        return all;
    }
    void add(Statements& to, const Segment& segment, Statements body) const {
        const auto when = due(segment);
        if (when.empty())
            append(to, std::move(body));
        else if (!body.empty())
            to.push_back(if_all(when, std::move(body)));
    }

    Statements test(int number) {
        const Condition& c = condition(number);
        Statements states = resets(c.nodes);
        const bool has_enable = c.enable.node >= 0, has_states = !states.empty(),
                   has_reset = c.reset.node >= 0 && has_states;
        const int enabled = at(enabled_, number), active = at(p_.active, number);
        Statements all;
        int is_on = -1, fires = -1;
        std::vector<Literal> begins;
        if (has_enable) {
            is_on = local("is_on");
            all.push_back(assign(is_on, {above_zero(c.enable)}));
        }
        if (has_trigger(number)) {
            fires = local("fires");
            // An edge that was seen at this instant still counts; a function call counts once per step.
            all.push_back(assign(fires, {flag(at(p_.hit, c.triggered_rate))}));
            std::vector<Literal> looks{!flag(fires)};
            if (c.trigger_edge == model::Edge::level && inside_ >= 0) looks.push_back(!flag(inside_));
            all.push_back(if_all(looks, {{.kind = Kind::edge,
                                          .number = memory(number, c.trigger, c.trigger_edge, false),
                                          .flag = fires}}));
        }
        if (has_reset) {
            const int resets = local("resets"), last = memory(number, c.reset, c.reset_edge, true);
            begins.push_back(flag(resets));
            // A level that ends between the base steps held the states until then.
            const bool may_end = c.reset_edge == model::Edge::level && inside_ >= 0;
            const int ends = may_end ? local("ends") : -1;
            if (may_end)
                all.push_back(assign(ends, {flag(inside_), {.kind = Literal::Kind::memory, .number = last}}));
            all.push_back({.kind = Kind::edge, .number = last, .flag = resets});
            if (may_end) all.push_back(if_all({flag(ends)}, {assign(resets)}));
        }
        if (has_enable)
            all.push_back(
                if_all({!flag(is_on), flag(enabled)}, {numbered(Kind::call, at(disable_, number))}));
        if (c.resets_states && has_states) {
            const int starts = local("starts");
            all.push_back(assign(starts, has_enable ? std::vector{flag(is_on), !flag(enabled)}
                                                    : std::vector{!flag(enabled)}));
            if (has_reset) all.push_back(if_all(begins, {assign(starts)}));
            begins = {flag(starts)};
        }
        all.push_back(assign(enabled, has_enable ? std::vector{flag(is_on)} : std::vector<Literal>{}));
        if (fires >= 0) all.push_back(assign(active, {flag(enabled), flag(fires)}));
        if (!begins.empty()) {
            if (is_adaptive_) states.insert(states.begin(), of(Kind::restart));
            if (has_enable) begins.insert(begins.begin(), flag(enabled));
            all.push_back(if_all(begins, std::move(states)));
        }
        if (fires >= 0) {
            const int hit = at(p_.hit, c.triggered_rate);
            all.push_back(
                if_all({flag(active), !flag(hit)}, {numbered(Kind::fire, c.triggered_rate), assign(hit)}));
        }
        return all;
    }

    Statements disable(int number) {
        const Condition& c = condition(number);
        Statements all{clear(at(enabled_, number))};
        if (has_trigger(number)) all.push_back(clear(at(p_.active, number)));
        for (const auto& outlet : c.outlets)
            if (outlet.resets) all.push_back(initial(outlet));
        for (const int node : c.nodes)
            if (has(node, Role::continuous_state)) all.push_back(of_node(Kind::rest, node));
        for (int inner = 1; inner < count(d_.conditions); ++inner)
            if (condition(inner).parent == number)
                all.push_back(
                    if_all({flag(at(enabled_, inner))}, {numbered(Kind::call, at(disable_, inner))}));
        return all;
    }

    Statement set(const Node::End& quantity, const Node::End& source, const std::vector<double>& values) {
        p_.sets.push_back({quantity, source, source.node < 0 ? values : std::vector<double>()});
        return numbered(Kind::set, count(p_.sets) - 1);
    }
    Statement initial(const Condition::Outlet& outlet) {
        return set(outlet.end, outlet.initial_from, outlet.initial);
    }

    Statements resets(const std::vector<int>& nodes) {
        Statements all;
        for (const int n : nodes) {
            for_each_initial(*at(d_.nodes, n).block, n,
                             [&](const auto&... state) { all.push_back(set(state...)); });
            if (at(d_.nodes, n).methods.reset) all.push_back(of_node(Kind::reset, n));
        }
        return all;
    }

    /// Constants may depend on what a device says of itself, and initial values on constants.
    void lower_start() {
        std::vector<int> nodes(d_.nodes.size());
        std::iota(nodes.begin(), nodes.end(), 0);
        p_.start = resets(nodes);
        append(p_.start, {of(Kind::start), of(Kind::constants)});
        for (const auto& condition : d_.conditions)
            for (const auto& outlet : condition.outlets) p_.start.push_back(initial(outlet));
    }

    // ---- outputs and updates

    Statements activities(const Segment& segment, int passes) {
        Statements all;
        for (const auto& a : segment.activities) {
            Statements some;
            int its = passes;
            if (a.node >= 0) {
                some.push_back({.kind = Kind::run, .node = a.node, .index = a.index});
            } else if (a.loop >= 0) {
                if (runs_once(a.loop)) its &= first;
                some = loop(a.loop, its);
            } else { // where states do not jump, conditions stay what they are
                its &= ~(inside | between);
                some.push_back(numbered(Kind::call, at(test_, a.condition)));
            }
            for (auto& statement : some) statement.passes = static_cast<std::uint8_t>(its & passes_);
            append(all, std::move(some));
        }
        return all;
    }

    /// Of guards those that are written for one of a list.
    Statements phase(const std::vector<Segment>& segments, Phase phase,
                     const std::vector<Watched>& wanted = {}) const {
        Statements all;
        for (const auto& segment : segments) {
            Statements some;
            for (const auto& a : segment.activities)
                if (phase != Phase::guards || writes(a, wanted))
                    some.push_back({.kind = Kind::run, .phase = phase, .node = a.node, .index = a.index});
            add(all, segment, std::move(some));
        }
        return all;
    }

    bool writes(const Activity& a, const std::vector<Watched>& wanted) const {
        const auto& rules = at(d_.nodes, a.node).block->declaration().guard_rules;
        return std::any_of(wanted.begin(), wanted.end(), [&](const Watched& w) {
            return !w.is_control && w.end.node == a.node &&
                   (a.index >= count(rules) || at(rules, a.index).writes(w.end.slot));
        });
    }

    /// What is continuous is computed again after an event, and what it triggers; inside a step of the solver
    /// what that needs. The rest waits, so that these stand together.
    void lower_outputs() {
        Statements late;
        for (const auto& segment : d_.plan.outputs) {
            if (segment.rate == constant_rate) continue;
            const auto& r = rate(segment.rate);
            Statements now = activities(segment, r.is_continuous ? every
                                                 : r.trigger > 0 ? first | again
                                                                 : first);
            if (r.is_continuous && is_continuous_) {
                const auto waiting = std::stable_partition(now.begin(), now.end(), [&](const Statement& s) {
                    return s.kind != Kind::run || at(is_needed_, s.node);
                });
                Statements others(std::make_move_iterator(waiting), std::make_move_iterator(now.end()));
                now.erase(waiting, now.end());
                for (auto& statement : others) statement.passes &= static_cast<std::uint8_t>(~inside);
                add(late, segment, std::move(others));
            } else {
                append(p_.outputs, std::exchange(late, {}));
            }
            add(p_.outputs, segment, std::move(now));
        }
        append(p_.outputs, std::move(late));
    }

    template <class Wanted> Statements updates(const std::vector<Segment>& segments, Wanted wanted) const {
        Statements all;
        for (const auto& segment : segments) {
            if (!wanted(segment)) continue;
            Statements some;
            for (const auto& a : segment.activities)
                some.push_back({.kind = Kind::run, .phase = Phase::update, .node = a.node, .index = a.index});
            add(all, segment, std::move(some));
        }
        for (const auto& segment : segments) {
            if (!wanted(segment)) continue;
            Statements some;
            int last = -1;
            for (const auto& a : segment.activities)
                if (std::exchange(last, a.node) != a.node && has(a.node, Role::discrete_state))
                    some.push_back(of_node(Kind::commit, a.node, state_became_nan));
            add(all, segment, std::move(some));
        }
        return all;
    }

    /// Afterwards no trigger holds any more.
    Statements clear_triggers() const {
        Statements all;
        for (int c = 1; c < count(d_.conditions); ++c)
            if (has_trigger(c)) append(all, clear_trigger(c));
        return all;
    }
    Statements clear_trigger(int c) const {
        return {clear(at(p_.hit, condition(c).triggered_rate)), clear(at(p_.active, c))};
    }

    Statements finite() const {
        Statements all;
        std::vector<char> is_seen(d_.nodes.size());
        const std::function<void(const std::vector<Segment>&)> look_at =
            [&](const std::vector<Segment>& segments) {
                for (const auto& segment : segments) {
                    if (segment.rate == constant_rate) continue;
                    Statements some;
                    for (const auto& a : segment.activities) {
                        if (a.loop >= 0) look_at(at(d_.plan.loops, a.loop).outputs);
                        if (a.node >= 0 && !std::exchange(at(is_seen, a.node), 1))
                            append(some, finite(a.node));
                    }
                    add(all, segment, std::move(some));
                }
            };
        look_at(d_.plan.outputs);
        return all;
    }
    Statements finite(int node) const {
        Statements all;
        for (int s = 0; s < count(slots(node)); ++s) {
            const Slot& slot = at(slots(node), s);
            if (slot.role != Role::output || slot.size.count() == 0 ||
                (slot.type != Type::float64 && slot.type != Type::float32))
                continue;
            all.push_back(
                of_node(Kind::finite, node,
                        Status::failure("its output {element} is not finite: look at the block's inputs in "
                                        "this step for a division by zero or a value out of range",
                                        s, -1)));
            all.back().signal = {node, s};
        }
        return all;
    }

    // ---- loops

    /// Does a loop of the continuous rate run once per step, not inside one? It does where it has states that
    /// go on from step to step.
    bool runs_once(int l) const {
        const Loop& loop = at(d_.plan.loops, l);
        return !loop.resets_states && rate(loop.rate).is_continuous &&
               std::any_of(loop.nodes.begin(), loop.nodes.end(), [&](int n) {
                   return has(n, Role::discrete_state) &&
                          std::find(loop.counters.begin(), loop.counters.end(), n) == loop.counters.end();
               });
    }

    /// Each iteration looks anew at the triggers inside; observers see what ran in any.
    Statements loop(int number, int passes) {
        const Loop& l = at(d_.plan.loops, number);
        Statements body, all, after;
        for (int c = 1; c < count(d_.conditions); ++c) {
            if (!has_trigger(c) || !is_around(number, c)) continue;
            const int hit = at(p_.hit, condition(c).triggered_rate);
            const int ran =
                new_flag(Flag::Kind::ran, condition(c).triggered_rate, condition(c).path + ".ran");
            append(body, clear_trigger(c));
            all.push_back(clear(ran));
            after.push_back(assign(hit, {flag(ran)}));
        }
        for (const auto& segment : l.outputs) add(body, segment, activities(segment, passes));
        append(body, updates(l.updates, [](const Segment&) { return true; }));
        for (std::size_t i = 0; i < after.size(); ++i)
            body.push_back(if_all({flag(after[i].flag)}, {assign(all[i].flag)}));
        if (l.kind == Loop::Kind::algebraic) {
            all.push_back(
                {.kind = Kind::solve, .node = l.nodes.front(), .number = number, .body = std::move(body)});
            return all;
        }
        append(all, resets(l.resets_states ? l.nodes : l.counters));
        Statement repeat{
            .kind = Kind::repeat, .number = l.iterations, .signal = l.count, .body = std::move(body)};
        if (l.kind == Loop::Kind::while_loop) {
            repeat.when = {above_zero(l.again)};
            repeat.otherwise = {of_node(Kind::fail, l.decider,
                                        Status::failure("the while loop around it did not end within {} "
                                                        "iterations: look at the condition of its While, or "
                                                        "let it allow more",
                                                        l.iterations))};
        }
        if (l.initial.node >= 0) repeat = if_all({above_zero(l.initial)}, {std::move(repeat)});
        all.push_back(std::move(repeat));
        append(all, std::move(after));
        return all;
    }
    bool is_around(int loop, int c) const {
        int l = condition(c).loop;
        while (l >= 0 && l != loop) l = at(d_.plan.loops, l).parent;
        return l == loop && loop >= 0;
    }

    // ---- crossings

    Statement look(Kind kind) const { return {.kind = kind, .number = answered_, .flag = crossed_}; }

    /// x⁺ of the blocks whose guards crossed, none seeing another's through signals, until nothing more
    /// crosses at this instant.
    Statements answer() {
        Statements round{of(Kind::observe)}, endless, all;
        for (const int n : answering_) {
            round.push_back(if_all({crossing_of(n)}, {of_node(Kind::event, n)}));
            endless.push_back(if_all(
                {crossing_of(n)},
                {of_node(Kind::fail, n,
                         Status::failure("its zero crossings answer one another without end: {} times at one "
                                         "instant; give one of the blocks a dead band or hysteresis",
                                         most_answers - 1))}));
        }
        round.push_back({.kind = Kind::evaluate, .pass = again});
        round.push_back(look(Kind::look));
        Statements rounds{{.kind = Kind::repeat,
                           .number = most_answers,
                           .when = {flag(crossed_)},
                           .body = std::move(round),
                           .otherwise = std::move(endless)}};
        if (answering_.empty()) rounds.clear();
        if (!is_adaptive_) return rounds;
        const int fired = local("fired");
        all = {of(Kind::restart), clear(fired)};
        for (int r = 1; r < count(d_.rates); ++r)
            if (rate(r).trigger > 0) all.push_back(if_all({flag(at(p_.hit, r))}, {assign(fired)}));
        all.push_back(if_all({!flag(answered_), flag(inside_), flag(fired)}, {of(Kind::observe)}));
        if (rounds.empty()) return all;
        rounds.push_back(if_all({flag(inside_)}, {of(Kind::observe)}));
        all.push_back(if_all({flag(answered_)}, std::move(rounds)));
        return all;
    }

    /// A solver may have evaluated last somewhere else. What a conditional subsystem holds when it is
    /// disabled is its output of that instant.
    void lower_event() {
        if (std::any_of(d_.plan.outputs.begin(), d_.plan.outputs.end(), [&](const Segment& segment) {
                return segment.condition > 0 && rate(segment.rate).is_continuous;
            }))
            p_.arrive.push_back({.kind = Kind::evaluate, .pass = is_callers_ ? between : inside});
        if (inside_ < 0) return;
        p_.event = p_.arrive;
        append(p_.event, {assign(inside_), {.kind = Kind::evaluate, .pass = again}});
        if (is_callers_ && !p_.watched.empty())
            append(p_.event, {look(Kind::look), if_all({flag(crossed_)}, {numbered(Kind::call, answer_)})});
        else if (!is_callers_)
            append(p_.event, {look(Kind::locate), numbered(Kind::call, answer_)});
        append(p_.event,
               updates(d_.plan.updates, [&](const Segment& s) { return rate(s.rate).trigger > 0; }));
        append(p_.event, clear_triggers());
        p_.event.push_back(clear(inside_));
    }

    const Diagram& d_;
    const std::vector<char> is_needed_; ///< by node: inside a step
    const bool is_callers_;             ///< solver
    bool is_continuous_ = false, is_adaptive_ = false;
    int passes_ = first; ///< those that there are
    Program p_;
    std::vector<int> enabled_, test_, disable_; ///< by condition
    std::vector<int> answering_;                ///< nodes whose crossings have answers
    int crossed_ = -1, answered_ = -1, inside_ = -1, answer_ = -1;
};

} // namespace

Program lower(const Diagram& diagram, Integrator integrator) { return Lowering(diagram, integrator).run(); }

} // namespace bf::program

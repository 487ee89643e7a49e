// Sample times: given, inherited from sources, or constant.
#include "internal_blocks.hpp"

#include "bf/base/run_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace bf::elaboration {

namespace {

/// y = u at the hits of its rate, or u of the hit before.
class Transition final : public Block {
  public:
    explicit Transition(bool delays) : delays_(delays) {
        declare({.changes_rate = true});
        if (delays) {
            OutputRule(this, kernels::Copy{}, y, x);
            UpdateRule(this, kernels::Copy{}, next(x), u);
        } else {
            OutputRule(this, kernels::Copy{}, y, u);
        }
    }
    const bool delays_;
    AnyShape s{this};
    Input<> u{this, "u", {.shape = s, .unit = any_unit}};
    Output<> y{this, "y", {.shape = s, .unit = any_unit}};
    DiscreteState<> x{this, "x", {.shape = s, .present = delays_}};
};

class Rates {
  public:
    explicit Rates(Elaboration& elaboration) : e_(elaboration), nodes_(e_.diagram.nodes) {}

    void run() {
        for (std::size_t n = 0; n < nodes_.size(); ++n) check_period(n);
        find_step();
        if (!(e_.diagram.step > 0)) return;
        base_ = rate_of({1, 0, false, false});
        if (std::any_of(nodes_.begin(), nodes_.end(), is_continuous))
            continuous_ = rate_of({1, 0, false, true});
        for (std::size_t c = 1; c < conditions_.size(); ++c)
            if (conditions_[c].trigger.node >= 0) {
                conditions_[c].triggered_rate = static_cast<int>(e_.diagram.rates.size());
                e_.diagram.rates.push_back({0, 0, false, false, static_cast<int>(c)});
            }
        for (std::size_t n = 0; n < nodes_.size(); ++n)
            if (const int rate = triggered_rate(nodes_[n].condition); rate >= 0) {
                nodes_[n].rate = never_changes(nodes_[n]) && has_no_inputs(nodes_[n]) ? constant_rate : rate;
                refuse_continuous(nodes_[n], "a triggered subsystem");
            } else if (is_continuous(nodes_[n])) {
                if (nodes_[n].loop >= 0) refuse_continuous(nodes_[n], "a loop");
                nodes_[n].rate = continuous_;
            } else if (e_.sample_times[n].period.value_or(0) > 0) {
                nodes_[n].rate = never_changes(nodes_[n]) && has_no_inputs(nodes_[n])
                                     ? constant_rate
                                     : given(e_.sample_times[n]);
            } else if (has_no_inputs(nodes_[n])) {
                nodes_[n].rate = never_changes(nodes_[n]) ? constant_rate : fastest(nodes_[n]);
            }
        inherit();
        // Inner conditions come after those around them, and decide with what rate those are looked at.
        for (std::size_t c = conditions_.size(); c-- > 1;) {
            auto& condition = conditions_[c];
            if (condition.trigger.node < 0) {
                condition.rate = fastest_of(condition.nodes, static_cast<int>(c));
                continue;
            }
            const int around = triggered_rate(condition.parent);
            condition.rate = around >= 0 ? around : seen_outside(condition.triggered_rate);
        }
        // What a trigger computes and disabling resets changes whenever its subsystem is looked at.
        for (const auto& condition : conditions_)
            if (condition.trigger.node >= 0 && condition.enable.node >= 0)
                for (const auto& outlet : condition.outlets)
                    if (outlet.resets)
                        nodes_[static_cast<std::size_t>(outlet.end.node)].rate = condition.rate;
        for (auto& loop : e_.diagram.plan.loops) loop.rate = fastest_of(loop.nodes, loop.condition);
        // Inner conditions come after those around them: an output may inherit from theirs.
        for (auto condition = e_.diagram.conditions.rbegin(); condition != e_.diagram.conditions.rend();
             ++condition)
            for (auto& outlet : condition->outlets)
                if (outlet.initial.empty()) inherit_initial(outlet);
        // The rate of what reads a wire that is missing is not the one that it will have.
        if (e_.report.is_empty() && e_.model.rate_transitions != model::RateTransitions::allowed)
            check_transitions();
    }

  private:
    /// A period is a time, and nothing that a trigger runs has one.
    void check_period(std::size_t n) {
        const SampleTime& time = e_.sample_times[n];
        if (!time.period || misfits_.contains(&*time.given_by->period)) return;
        const auto refuse = [&](const std::string& why, const char* remedy) {
            misfits_.insert(&*time.given_by->period);
            e_.report.add(time.given_by->period->where, time.path, why, remedy);
        };
        if (*time.period <= 0)
            refuse(
                "period " + matlab::number_text(*time.period) + " s is not above 0",
                "give a multiple of the base step, or leave it out to run as fast as what the block reads");
        for (int c = nodes_[n].condition; c > 0; c = conditions_[static_cast<std::size_t>(c)].parent) {
            const auto& condition = conditions_[static_cast<std::size_t>(c)];
            if (condition.trigger.node >= 0 && (time.path + ".").starts_with(condition.path + "."))
                return refuse("a triggered subsystem has no period: its trigger says when it runs",
                              "leave the period out; a FunctionCallGenerator with a period is a trigger");
        }
    }

    /// The rate of the innermost triggered subsystem around, or -1.
    int triggered_rate(int condition) const {
        for (; condition > 0; condition = conditions_[static_cast<std::size_t>(condition)].parent)
            if (const int rate = conditions_[static_cast<std::size_t>(condition)].triggered_rate; rate >= 0)
                return rate;
        return -1;
    }

    /// The fastest of the signals that control a condition; -1 while one is unknown.
    int looked_at(const Condition& condition) {
        int rate = constant_rate;
        for (const auto& signal : {condition.enable, condition.trigger, condition.reset}) {
            if (signal.node < 0) continue;
            const int its = seen_outside(nodes_[static_cast<std::size_t>(signal.node)].rate);
            if (its < 0) return -1;
            rate = common(rate, its);
        }
        return rate;
    }

    /// The rate at which others see signals of a rate: triggered ones change when their trigger is looked at,
    /// which for a constant trigger is as often as whatever is around it may run.
    int seen_outside(int rate) {
        if (rate < 0) return rate;
        const int trigger = e_.diagram.rates[static_cast<std::size_t>(rate)].trigger;
        if (trigger == 0) return rate;
        const auto& condition = conditions_[static_cast<std::size_t>(trigger)];
        if (const int seen = looked_at(condition); seen != constant_rate) return seen;
        const int around = triggered_rate(condition.parent);
        return around >= 0 ? seen_outside(around) : base_;
    }

    void refuse_continuous(const DiagramNode& node, const std::string& place) {
        if (is_continuous(node))
            e_.report.add(node.where, node.path, "has a continuous state, but stands in " + place,
                          "use its discrete counterpart");
    }

    static bool has_no_inputs(const DiagramNode& node) {
        return std::none_of(node.sources.begin(), node.sources.end(),
                            [](const auto& s) { return s.node >= 0; });
    }

    /// Only rules without time and states: outputs change with the inputs alone.
    static bool never_changes(const DiagramNode& node) {
        const auto& d = node.block->declaration();
        const auto& m = node.methods;
        if (d.traits.is_root_input) return false; // written by whoever runs the diagram
        if (m.output || m.update || m.derivative || node.block->answers(m) || !d.update_rules.empty() ||
            !d.derivative_rules.empty() || !d.objects.empty())
            return false;
        for (const auto& slot : d.slots)
            if (is_state(slot.role)) return false;
        for (const Call& call : d.output_rules)
            for (const auto& operand : call.operands)
                if (operand.source == Call::Source::time || operand.source == Call::Source::period)
                    return false;
        return true;
    }

    static bool is_continuous(const DiagramNode& node) {
        const auto& slots = node.block->resolution().slots;
        return std::any_of(slots.begin(), slots.end(),
                           [](const Slot& s) { return s.role == Role::continuous_state; });
    }

    /// The fastest rate a block can have: blocks with discrete states run inside a step only if events change
    /// them there.
    int fastest(const DiagramNode& node) const {
        const auto& d = node.block->declaration();
        const bool is_discrete = (node.methods.update || !d.update_rules.empty()) &&
                                 !node.block->answers(node.methods) && !d.traits.goes_on;
        return continuous_ > 0 && !is_discrete ? continuous_ : base_;
    }

    /// The base step: given, or the greatest common divisor of all periods and offsets.
    void find_step() {
        if (e_.diagram.step > 0) return;
        double step = 0, shortest = std::numeric_limits<double>::infinity();
        const auto divide = [](double a, double b) { // Euclid's algorithm, a >= b
            const double rounding = 4 * std::numeric_limits<double>::epsilon() * a;
            while (b > 0) {
                const double rest = std::abs(a - std::round(a / b) * b);
                a = b;
                b = rest <= std::max(1e-6 * b, rounding) ? 0 : rest;
            }
            return a;
        };
        for (std::size_t n = 0; n < nodes_.size(); ++n)
            for (const auto& time : {e_.sample_times[n].period, e_.sample_times[n].offset})
                if (time && *time > 0) {
                    step = step == 0 ? *time : divide(std::max(step, *time), std::min(step, *time));
                    shortest = std::min(shortest, *time);
                    if (shortest > 1e6 * step)
                        return e_.report.add(nodes_[n].where, nodes_[n].path,
                                             "runs every " + matlab::number_text(*time) +
                                                 " s, and a base step that divides this and the other "
                                                 "periods is more than a million times shorter than they",
                                             "give periods that nest, or the model a 'step'");
                }
        if (step > 0) step = shortest / std::round(shortest / step); // free of the rounding above
        if (step == 0 && e_.report.is_empty()) // a block that could not be made may name one
            e_.report.add(e_.model.where, "", "neither the model nor any block names a sample time",
                          "give the model a 'step', e.g. step: 0.001");
        e_.diagram.step = step;
    }

    int rate_of(const SampleRate& rate) {
        auto& rates = e_.diagram.rates;
        const auto known = std::find(rates.begin(), rates.end(), rate);
        if (known != rates.end()) return static_cast<int>(known - rates.begin());
        rates.push_back(rate);
        return static_cast<int>(rates.size()) - 1;
    }

    int given(const SampleTime& sample_time) {
        const double step = e_.diagram.step;
        const auto ticks = [&](const std::optional<model::Expression>& key, double time, const char* what) {
            const double count = std::round(time / step);
            const bool fits = std::abs(count * step - time) <= 1e-9 * std::max(time, step) && count >= 0 &&
                              count <= most_steps;
            // Once: the blocks of a subsystem have its sample time.
            if (!fits && misfits_.insert(&*key).second)
                e_.report.add(
                    key->where, sample_time.path,
                    std::string(what) + " " + matlab::number_text(time) +
                        (count > most_steps ? " s is more than 2^53 times" : " s is no multiple of") +
                        " the base period " + matlab::number_text(step) + " s",
                    "change it, or give the model a 'step' that divides it");
            return fits ? static_cast<std::int64_t>(count) : 0;
        };
        const std::int64_t p = ticks(sample_time.given_by->period, *sample_time.period, "period");
        const std::int64_t o = ticks(sample_time.given_by->offset, sample_time.offset.value_or(0), "offset");
        if (p < 1) return base_;
        return rate_of({p, o % p, false});
    }

    /// Without a sample time of its own a block is there whenever a signal that it reads may change.
    void inherit() {
        std::vector<std::vector<int>> consumers(nodes_.size());
        for (std::size_t n = 0; n < nodes_.size(); ++n)
            for (const auto& from : nodes_[n].sources)
                if (from.node >= 0)
                    consumers[static_cast<std::size_t>(from.node)].push_back(static_cast<int>(n));
        // Who reads a triggered output learns its rate from the trigger.
        for (const auto& condition : conditions_)
            for (const auto& signal : {condition.enable, condition.trigger, condition.reset})
                if (condition.trigger.node >= 0 && signal.node >= 0)
                    for (const auto& outlet : condition.outlets)
                        for (const int to : consumers[static_cast<std::size_t>(outlet.end.node)])
                            consumers[static_cast<std::size_t>(signal.node)].push_back(to);
        std::vector<char> inherits;
        for (const auto& node : nodes_) inherits.push_back(node.rate < 0);
        std::vector<int> queue;
        const auto settle = [&](int n, int rate) {
            nodes_[static_cast<std::size_t>(n)].rate = rate;
            for (const int to : consumers[static_cast<std::size_t>(n)]) queue.push_back(to);
        };
        // What is read only makes a rate faster, so the order of the blocks decides nothing.
        const auto work = [&](bool all_known) {
            for (std::size_t next = 0; next < queue.size(); ++next) {
                const int n = queue[next];
                auto& node = nodes_[static_cast<std::size_t>(n)];
                if (!inherits[static_cast<std::size_t>(n)]) continue;
                if (const int rate = inherited(node, all_known); rate >= 0 && rate != node.rate)
                    settle(n, rate);
            }
            queue.clear();
        };
        const auto work_on_all = [&](bool all_known) {
            for (std::size_t n = 0; n < nodes_.size(); ++n) queue.push_back(static_cast<int>(n));
            work(all_known);
        };
        work_on_all(true);
        work_on_all(false); // loops through delays: what is known decides
        for (std::size_t n = 0; n < nodes_.size(); ++n)
            if (nodes_[n].rate < 0) settle(static_cast<int>(n), fastest(nodes_[n]));
        work(false);
    }

    /// Of what is known; -1 while that does not tell.
    int inherited(const DiagramNode& node, bool all_known) {
        int rate = constant_rate;
        bool is_partial = false, reads = false;
        for (const auto& from : node.sources) {
            if (from.node < 0) continue;
            reads = true;
            const int source = seen_outside(nodes_[static_cast<std::size_t>(from.node)].rate);
            if (source < 0)
                is_partial = true;
            else
                rate = common(rate, source);
        }
        if (!reads || (is_partial && (all_known || rate == constant_rate))) return -1;
        if (rate == constant_rate && (!never_changes(node) || node.condition > 0)) return fastest(node);
        return rate == continuous_ ? fastest(node) : rate;
    }

    /// The slowest rate that is hit wherever one of the two is: the faster one if their hits nest, else that
    /// of the greatest common divisor of their periods and the distance of their offsets.
    int common(int a, int b) {
        if (a == b || b == constant_rate) return a;
        if (a == constant_rate) return b;
        if (a == continuous_ || b == continuous_) return continuous_;
        const auto &x = e_.diagram.rates[static_cast<std::size_t>(a)],
                   &y = e_.diagram.rates[static_cast<std::size_t>(b)];
        const auto ticks = std::gcd(std::gcd(x.ticks, y.ticks), x.offset - y.offset);
        return rate_of({ticks, x.offset % ticks, false});
    }

    /// Is it a rate with a period? The continuous one has that of the base step.
    bool is_periodic(int rate) const {
        return rate != constant_rate && e_.diagram.rates[static_cast<std::size_t>(rate)].trigger == 0;
    }
    /// The base step itself and the continuous rate need no transition.
    bool is_as_fast(int a, int b) const {
        return a == b ||
               (e_.diagram.period(a) == e_.diagram.period(b) && (a == continuous_ || b == continuous_));
    }

    /// Wires between two periodic rates: errors, or a block in between that all readers of that rate share.
    void check_transitions() {
        const bool inserts = e_.model.rate_transitions == model::RateTransitions::inserted;
        const auto period_text = [&](int rate) { // 3 times 0.1 as 0.3
            char text[32];
            std::snprintf(text, sizeof text, "%.12g", e_.diagram.period(rate));
            return std::string(text);
        };
        std::map<std::array<int, 3>, int> made; // source, slot, rate of the reader
        const std::size_t count = nodes_.size();
        for (std::size_t n = 0; n < count; ++n) {
            const bool is_transition = nodes_[n].block->declaration().traits.changes_rate;
            for (std::size_t i = 0; i < nodes_[n].sources.size() && !is_transition; ++i) {
                const auto from = nodes_[n].sources[i];
                if (from.node < 0) continue;
                const auto& source = nodes_[static_cast<std::size_t>(from.node)];
                const int a = source.rate, b = nodes_[n].rate;
                if (!is_periodic(a) || !is_periodic(b) || is_as_fast(a, b)) continue;
                if (delays(source) && e_.diagram.period(a) > e_.diagram.period(b)) continue;
                if (inserts) {
                    const auto [place, is_new] = made.try_emplace({from.node, from.slot, b}, 0);
                    if (is_new) place->second = add_transition(from, b);
                    nodes_[n].sources[i] = {place->second, 1};
                    continue;
                }
                const Slot& slot = nodes_[n].block->resolution().slots[i];
                e_.report.add(nodes_[n].where, nodes_[n].path,
                              "input '" + slot.name + "' at " + period_text(b) + " s reads " +
                                  e_.diagram.end_path(from) + " at " + period_text(a) + " s",
                              "put a RateTransition in between, or say `rate_transitions: inserted`",
                              transition_fixes(nodes_[n].path, slot.name, period_text(b)));
            }
        }
    }

    std::vector<model::Fix> transition_fixes(const std::string& path, const std::string& input,
                                             const std::string& period) const {
        std::vector<model::Fix> fixes = inserted_before(
            e_.model, path, {input}, "Insert a RateTransition",
            {.name = "transition", .type = "RateTransition", .period = model::Expression{period}});
        fixes.push_back(fix("Insert all rate transitions of the model",
                            model::operations::Set{"", "rate_transitions", "inserted"}));
        return fixes;
    }

    /// Does it change the rate, and nobody wait for what it reads?
    static bool delays(const DiagramNode& node) {
        const auto& d = node.block->declaration();
        return d.traits.changes_rate &&
               std::none_of(d.output_rules.begin(), d.output_rules.end(), [&](const Call& rule) {
                   return std::any_of(rule.operands.begin(), rule.operands.end(), [&](const auto& operand) {
                       return operand.slot >= 0 &&
                              d.slots[static_cast<std::size_t>(operand.slot)].role == Role::input;
                   });
               });
    }

    /// To a slower rate the sample of its hit is held; to a faster one the last sample but one, so that the
    /// slow block has its whole period to compute.
    int add_transition(const Node::End& from, int rate) {
        const int source_rate = nodes_[static_cast<std::size_t>(from.node)].rate;
        const bool to_faster = e_.diagram.period(source_rate) > e_.diagram.period(rate);
        const auto& source = nodes_[static_cast<std::size_t>(from.node)];
        DiagramNode node;
        node.block = std::make_unique<Transition>(to_faster);
        const Slot& slot = e_.diagram.slot(from);
        offer(node.block->resolution(), 0, slot.size);
        offer(node.block->resolution(), 0, slot.type);
        propagate(*node.block);
        node.path = e_.diagram.end_path(from) + (to_faster ? " delayed" : " held");
        node.type = "RateTransition";
        node.sources.resize(node.block->resolution().slots.size());
        node.sources[0] = from;
        node.rate = to_faster ? source_rate : rate;
        node.where = source.where;
        nodes_.push_back(std::move(node));
        return static_cast<int>(nodes_.size()) - 1;
    }

    /// Without an initial value of its own an output takes that of the constant, InitialCondition or
    /// conditional subsystem that drives it.
    void inherit_initial(Condition::Outlet& outlet) const {
        const auto from = nodes_[static_cast<std::size_t>(outlet.end.node)].sources[0];
        if (from.node < 0) return; // in a wrong model
        const auto& node = nodes_[static_cast<std::size_t>(from.node)];
        if (node.rate == constant_rate) outlet.initial_from = from;
        if (const int value = node.block->declaration().traits.first_value; value >= 0)
            outlet.initial_from = {from.node, value};
        for (const auto& condition : e_.diagram.conditions)
            for (const auto& inner : condition.outlets)
                if (inner.end.node == from.node) {
                    outlet.initial = inner.initial;
                    outlet.initial_from = inner.initial_from;
                }
    }

    /// Of the blocks inside a condition, or inside a loop under one.
    int fastest_of(const std::vector<int>& nodes, int condition) {
        int rate = constant_rate;
        for (const int n : nodes)
            rate = common(rate, seen_from(condition, nodes_[static_cast<std::size_t>(n)].rate));
        return rate == constant_rate ? base_ : rate;
    }

    /// A rate as one sees it under a condition: of a triggered subsystem further inside, when its trigger is
    /// looked at.
    int seen_from(int condition, int rate) const {
        while (const int trigger = e_.diagram.rates[static_cast<std::size_t>(rate)].trigger) {
            for (int around = condition; around > 0;
                 around = conditions_[static_cast<std::size_t>(around)].parent)
                if (around == trigger) return rate;
            rate = conditions_[static_cast<std::size_t>(trigger)].rate;
        }
        return rate;
    }

    Elaboration& e_;
    std::vector<DiagramNode>& nodes_;
    std::vector<Condition>& conditions_ = e_.diagram.conditions;
    int base_ = 0, continuous_ = -1;
    std::set<const model::Expression*> misfits_; ///< that gave times which fit no step
};

} // namespace

void assign_rates(Elaboration& e) { Rates(e).run(); }

} // namespace bf::elaboration

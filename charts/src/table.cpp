#include "bf/charts/table.hpp"

#include "actions.hpp"
#include "tree.hpp"

#include "bf/base/numbers.hpp"
#include "bf/kernels/chart.hpp"
#include "bf/matlab/formula.hpp"

#include <algorithm>
#include <functional>
#include <map>

namespace bf::charts {

namespace {

namespace k = kernels::chart;
using kernels::Operation;

constexpr std::size_t most_ways = 1000; ///< through junctions, of one transition

/// A way from a state through junctions.
struct Way {
    std::vector<const Transition*> parts;
    std::vector<int> to;
};

class Lowering : public Tree {
  public:
    explicit Lowering(const Chart& chart) : Tree(chart) {}

    Table run() {
        find_events();
        Table table = write();
        stop_if_wrong();
        return table;
    }

  private:
    // ---- events

    void find_events() {
        for (const auto& name : chart_.events) {
            if (!is_identifier(name, true))
                refuse("the event '" + name +
                       "' is no name; begin with a letter and go on with letters, digits, '_' and '.'");
            else if (!events_.try_emplace(name, static_cast<int>(events_.size()) + 1).second)
                refuse("there is a second event '" + name + "'; remove one of them");
        }
        inputs_ = static_cast<int>(events_.size());
        for (int s = 0; s < static_cast<int>(nodes_.size()); ++s) {
            const State& state = *node(s).state;
            const auto note = [&](const std::string& action, const std::string& where) {
                try {
                    for (const auto& statement : statements_of(action))
                        if (statement.kind == Statement::Kind::raise ||
                            statement.kind == Statement::Kind::send)
                            add_event(statement.name, where);
                } catch (const std::invalid_argument& wrong) {
                    refuse(where + ": " + wrong.what());
                }
            };
            note(state.entry, called(s) + ", entry");
            note(state.during, called(s) + ", during");
            note(state.exit, called(s) + ", exit");
            note(state.begin, called(s) + ", begin");
            for (std::size_t i = 0; i < state.transitions.size(); ++i)
                note(state.transitions[i].action, transition_name(s, i));
        }
        // Who finishes tells so, where somebody listens.
        std::vector<std::string> awaited;
        for (const auto& each : nodes_)
            for (const auto& t : each.state->transitions)
                awaited.insert(awaited.end(), t.events.begin(), t.events.end());
        for (int s = 1; s <= real_; ++s) {
            if (!is_compound(s) && kind(s) != Kind::parallel) continue;
            const std::string event = "done.state." + node(s).state->name;
            if (events_.contains(event) ||
                std::ranges::any_of(awaited, [&](const auto& wanted) { return matches(wanted, event); }))
                add_event(event, called(s));
        }
        if (events_.size() > k::chart_most_events)
            refuse("the chart has " + std::to_string(events_.size()) + " events; " +
                   std::to_string(k::chart_most_events) + " are the most");
        stop_if_wrong();
    }
    void add_event(const std::string& name, const std::string& where) {
        const auto [event, is_new] = events_.try_emplace(name, static_cast<int>(events_.size()) + 1);
        if (!is_new && event->second <= inputs_)
            refuse(where + ": '" + name +
                   "' is an input, which the chart cannot raise; give its own event another name");
    }
    int event_list(const std::vector<std::string>& wanted, const std::string& where) {
        if (wanted.empty()) return 0;
        std::vector<double> all;
        for (const auto& name : wanted) {
            const std::size_t before = all.size();
            for (const auto& [event, number] : events_)
                if (matches(name, event) && std::ranges::find(all, double(number)) == all.end())
                    all.push_back(number);
            if (all.size() > before || name == "*") continue;
            std::vector<std::string> known;
            for (const auto& [event, number] : events_) known.push_back(event);
            const std::string near = near_name(name, known);
            if (std::ranges::none_of(known, [&](const auto& event) { return matches(name, event); }))
                refuse(where + ": nothing is the event '" + name + "'; " +
                       (near.empty()
                            ? "name it among the 'events', which are inputs, or raise it in an action"
                            : "did you mean '" + near + "'?"));
        }
        return list(all);
    }

    // ---- formulas

    int list(const std::vector<double>& items) {
        const int at = size();
        numbers_.push_back(static_cast<double>(items.size()));
        numbers_.insert(numbers_.end(), items.begin(), items.end());
        return at;
    }
    int list(const std::vector<int>& items) { return list(std::vector<double>(items.begin(), items.end())); }
    int size() const { return static_cast<int>(numbers_.size()); }
    /// Its place from 1 among the formulas, which stand at the end of the table.
    int formula(const std::vector<double>& code) {
        const int at = static_cast<int>(formulas_.size()) + 1;
        formulas_.push_back(static_cast<double>(code.size()));
        append(formulas_, code);
        return at;
    }
    int first_given() const { return static_cast<int>(chart_.variables.size() + chart_.parameters.size()); }

    /// What a name in a formula is: an input, or a cell of the step.
    std::optional<matlab::Slot> slot_of(const std::string& name, int from) {
        const int state = named_state(name, from);
        if (const auto given = given_slot(name)) {
            if (state > 0)
                throw matlab::Error("'" + name + "' is " +
                                    (is_clock(name) ? "what formulas know anyway" : "a number of the chart") +
                                    " and " + called(state) + ", too; give one of them another name");
            return given;
        }
        if (state > 0) {
            const auto known = std::ranges::find(flags_, state);
            const int flag = static_cast<int>(known - flags_.begin());
            if (known == flags_.end()) flags_.push_back(state);
            if (first_given() + k::chart_given_cells + flag >= k::chart_most_cells)
                throw matlab::Error("formulas ask about too many states");
            return matlab::Slot{first_given() + k::chart_given_cells + flag, {}};
        }
        const std::string head = name + "."; // of a state whose fields are states
        for (const auto& [path, s] : by_path_)
            if (path.starts_with(head)) return matlab::Slot{-1, {}};
        return std::nullopt;
    }
    /// The same of what is no state.
    std::optional<matlab::Slot> given_slot(const std::string& name) const {
        const auto place = [&](const auto& all, const auto& of) -> int {
            for (std::size_t i = 0; i < all.size(); ++i)
                if (of(all[i]) == name) return static_cast<int>(i);
            return -1;
        };
        const auto itself = [](const std::string& text) { return text; };
        if (const int i = place(chart_.inputs, itself); i >= 0) return matlab::Slot{cells_end + i, {}};
        const int variable = place(chart_.variables, [](const auto& v) { return v.first; });
        if (variable >= 0) return matlab::Slot{variable, {}};
        const int V = static_cast<int>(chart_.variables.size());
        if (const int i = place(chart_.parameters, itself); i >= 0) return matlab::Slot{V + i, {}};
        if (name == "time_in_state") return matlab::Slot{first_given(), {}};
        if (name == "period") return matlab::Slot{first_given() + 1, {}};
        if (name == "time") return matlab::Slot{first_given() + 2, {}};
        return std::nullopt;
    }
    /// The formula's program; empty where it is wrong.
    std::vector<double> program(const std::string& text, int state, const std::string& where) {
        const matlab::Workspace constants;
        std::string names;
        for (const auto& name : chart_.inputs) names += ", " + name;
        for (const auto& name : chart_.parameters) names += ", " + name;
        for (const auto& variable : chart_.variables) names += ", " + variable.first;
        const matlab::Scope scope{[&](const std::string& name) { return slot_of(name, state); }, constants,
                                  true,
                                  "; formulas know time_in_state, time, period, the names of states" + names};
        try {
            const auto parsed = matlab::parse_expression(text);
            return matlab::scalar_program(matlab::resolve(*parsed, scope),
                                          [&](const matlab::Formula& slot) { return read(slot); });
        } catch (const matlab::Error& error) {
            refuse(where + ": '" + text + "', character " + std::to_string(error.location().column) + ": " +
                   error.message());
            return {};
        }
    }
    matlab::Instruction read(const matlab::Formula& slot) {
        const int index = slot.places.empty() ? 0 : static_cast<int>(slot.places[0]);
        if (slot.slot < cells_end) {
            if (!slot.places.empty())
                throw matlab::Error("only inputs have elements, this is a number", slot.span);
            return {double(Operation::parameter), double(slot.slot), 0};
        }
        Reads& reads = reads_[static_cast<std::size_t>(slot.slot - cells_end)];
        if (slot.places.empty())
            reads.whole = true;
        else
            reads.element = std::max(reads.element, index + 1);
        return {double(Operation::fixed), double(slot.slot - cells_end), double(index)};
    }
    /// A time that the formula alone gives has to be `above` 0, or at least 0.
    void check_time(const std::vector<double>& code, bool is_above, const std::string& where) {
        for (std::size_t i = 0; i < code.size(); i += 3)
            if (code[i] == double(Operation::parameter) || code[i] == double(Operation::fixed)) return;
        if (code.empty()) return; // it is refused already
        const kernels::View<const double> instructions(code.data(), static_cast<int>(code.size())),
            none(nullptr, 0);
        const double time = kernels::Expression::value(
            instructions, none, kernels::ListView<const double>(nullptr, 0), 0, [](Operation, auto, auto) {});
        if (is_above ? !(time > 0) : !(time >= 0))
            refuse(where + " is " + number_text(time) + ", but must " +
                   (is_above ? "be more than 0" : "not be negative"));
    }
    static void push(std::vector<double>& code, Operation operation, double operand = 0) {
        code.insert(code.end(), {double(operation), operand, 0});
    }
    static void append(std::vector<double>& code, const std::vector<double>& other) {
        code.insert(code.end(), other.begin(), other.end());
    }
    /// time_in_state + a millionth of a period: times are sums of periods, rounded.
    void push_time(std::vector<double>& code) const {
        push(code, Operation::parameter, first_given());
        push(code, Operation::number, 1e-6);
        push(code, Operation::parameter, first_given() + 1);
        push(code, Operation::times);
        push(code, Operation::plus);
    }
    /// Joins conditions, all of which have to hold.
    static void both(std::vector<double>& guard, const std::vector<double>& other) {
        const bool is_first = guard.empty();
        append(guard, other);
        if (!is_first) push(guard, Operation::logical_and);
    }
    int guard_of(const Way& way, int s, const std::string& where) {
        std::vector<double> guard;
        for (const Transition* part : way.parts) {
            if (!part->after.empty()) {
                std::vector<double> late;
                push_time(late);
                append(late, program(part->after, s, where + ", after"));
                push(late, Operation::greater_equal);
                both(guard, late);
            }
            if (!part->every.empty()) { // the number of periods is another one than a step before, and not 0
                const auto T = program(part->every, s, where + ", every");
                check_time(T, true, where + ": the period `every`");
                std::vector<double> hits;
                push_time(hits);
                append(hits, T);
                push(hits, Operation::over);
                push(hits, Operation::floor);
                std::vector<double> now = hits, anew = hits;
                push(anew, Operation::number, 0);
                push(anew, Operation::greater);
                push_time(now);
                push(now, Operation::parameter, first_given() + 1);
                push(now, Operation::minus);
                append(now, T);
                push(now, Operation::over);
                push(now, Operation::floor);
                push(now, Operation::greater);
                both(guard, anew);
                both(guard, now);
            }
            if (!part->condition.empty()) both(guard, program(part->condition, s, where + ", if"));
        }
        return guard.empty() ? 0 : formula(guard);
    }

    // ---- actions

    int actions_of(const std::vector<std::string>& texts, int s, const std::string& where) {
        std::vector<std::array<double, 3>> code;
        const auto add = [&](int what, double a, double b = 0) { code.push_back({double(what), a, b}); };
        const auto its = [&](const std::string& text) { return double(formula(program(text, s, where))); };
        for (const auto& text : texts) {
            struct Open {
                std::size_t unless; ///< the jump over the present branch
                std::vector<std::size_t> ends;
            };
            std::vector<Open> open;
            const auto close_branch = [&] {
                if (open.back().unless != std::string::npos)
                    code[open.back().unless][1] = double(code.size());
            };
            for (const auto& statement : statements_of(text)) {
                using What = Statement::Kind;
                switch (statement.kind) {
                case What::assign:
                    add(k::chart_assign, variable(statement.name, where), its(statement.formula));
                    break;
                case What::raise: add(k::chart_raise, events_.at(statement.name)); break;
                case What::send: {
                    const auto delay = program(statement.formula, s, where);
                    check_time(delay, false, where + ": the delay of '" + statement.name + "'");
                    add(k::chart_send, timer(statement.name), formula(delay));
                    break;
                }
                case What::cancel:
                    if (!events_.contains(statement.name))
                        refuse(where + ": nothing sends the event '" + statement.name +
                               "' that is cancelled");
                    else
                        add(k::chart_cancel, timer(statement.name));
                    break;
                case What::if_:
                    open.push_back({code.size(), {}});
                    add(k::chart_jump_unless, 0, its(statement.formula));
                    break;
                case What::elseif:
                case What::else_:
                    open.back().ends.push_back(code.size());
                    add(k::chart_jump, 0);
                    close_branch();
                    open.back().unless = std::string::npos;
                    if (statement.kind == What::elseif) {
                        open.back().unless = code.size();
                        add(k::chart_jump_unless, 0, its(statement.formula));
                    }
                    break;
                case What::end:
                    close_branch();
                    for (const std::size_t jump : open.back().ends) code[jump][1] = double(code.size());
                    open.pop_back();
                    break;
                }
            }
        }
        if (code.empty()) return 0;
        std::vector<double> flat{double(code.size())};
        for (const auto& one : code) flat.insert(flat.end(), one.begin(), one.end());
        const int at = size();
        append(numbers_, flat);
        return at;
    }
    int variable(const std::string& name, const std::string& where) {
        for (std::size_t v = 0; v < chart_.variables.size(); ++v)
            if (chart_.variables[v].first == name) return static_cast<int>(v);
        std::vector<std::string> known;
        for (const auto& each : chart_.variables) known.push_back(each.first);
        const std::string near = near_name(name, known);
        refuse(where + ": there is no variable '" + name + "' to assign to; " +
               (near.empty() ? "name it among the 'variables'" : "did you mean '" + near + "'?"));
        return 0;
    }
    int timer(const std::string& event) {
        const auto [found, is_new] = timers_.try_emplace(event, static_cast<int>(timers_.size()));
        if (is_new && timers_.size() > k::chart_most_timers)
            refuse("the chart sends more than " + std::to_string(k::chart_most_timers) +
                   " events with a delay");
        return found->second;
    }

    // ---- transitions

    /// Ways from a transition on, through junctions.
    std::vector<Way> ways(int s, std::size_t i) {
        std::vector<Way> all;
        std::vector<int> through;
        bool are_too_many = false;
        const std::string where = transition_name(s, i);
        const std::function<void(Way, int, const Transition&)> follow = [&](Way way, int from,
                                                                            const Transition& t) {
            way.parts.push_back(&t);
            way.to = find_all(t.to, from, where);
            const bool joins =
                std::ranges::any_of(way.to, [&](int to) { return kind(to) == Kind::junction; });
            if (!joins) {
                if (all.size() < most_ways) return all.push_back(std::move(way));
                are_too_many = true;
                return refuse(where + ": more than 1000 ways lead through its junctions");
            }
            const int junction = way.to[0];
            if (way.to.size() > 1) return refuse(where + ": leads to a junction and to other states");
            if (std::ranges::find(through, junction) != through.end())
                return refuse(where + ": leads in a circle through " + called(junction));
            through.push_back(junction);
            for (const Transition& next : node(junction).state->transitions) {
                if (!next.events.empty())
                    refuse(called(junction) + ": a transition that leaves a junction awaits no event; the "
                                              "one to the junction does");
                if (next.to.empty())
                    refuse(called(junction) + ": a transition that leaves a junction needs a `to`");
                if (are_too_many) return;
                follow(way, junction, next);
            }
            through.pop_back();
        };
        follow({}, s, node(s).state->transitions[i]);
        return all;
    }
    /// The innermost state with one active child around the source and all goals: it is not left.
    int domain_of(int s, const Way& way) const {
        if (way.to.empty()) return -1;
        const auto holds = [&](int around) {
            return std::ranges::all_of(way.to, [&](int to) { return is_below(to, around); });
        };
        if (way.parts[0]->is_internal && is_compound(s) && holds(s)) return s;
        for (int around = node(s).parent; around > 0; around = node(around).parent)
            if (is_compound(around) && holds(around)) return around;
        return 0;
    }
    /// Goals in different regions can be active at once, others cannot.
    void check_goals(const std::vector<int>& goals, const std::string& where) {
        for (std::size_t i = 0; i < goals.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) {
                int a = goals[i];
                while (a > 0 && !is_below(goals[j], a)) a = node(a).parent;
                if (goals[i] == goals[j] || is_below(goals[i], goals[j]) || is_below(goals[j], goals[i]) ||
                    kind(std::max(a, 0)) != Kind::parallel)
                    refuse(where + ": " + called(goals[j]) + " and " + called(goals[i]) +
                           " are never active at once; goals lie in different regions");
            }
    }

    struct Row {
        int source, domain, goals, triggers, guard, action;
    };
    void add_transitions(int s, std::vector<Row>& rows) {
        for (std::size_t i = 0; i < node(s).state->transitions.size(); ++i) {
            const std::string where = transition_name(s, i);
            const Transition& t = node(s).state->transitions[i];
            if (t.to.empty() && t.events.empty() && t.condition.empty() && t.after.empty() && t.every.empty())
                refuse(where + ": has neither a goal nor a condition; what is done in each step is the "
                               "state's `during`");
            if (t.to.empty() && chart_.is_completed && t.events.empty())
                refuse(where + ": stays in its state without an event, so that the step never ends; await an "
                               "event, or let `during` do it");
            for (const Way& way : ways(s, i)) {
                check_goals(way.to, where);
                std::vector<std::string> actions;
                for (const Transition* part : way.parts) actions.push_back(part->action);
                node(s).transitions.push_back(static_cast<int>(rows.size()));
                const int goals = way.to.empty() ? 0 : list(way.to), triggers = event_list(t.events, where),
                          guard = guard_of(way, s, where), action = actions_of(actions, s, where + ", do");
                // Only `*` matches none where there are no events: such a transition is never taken.
                rows.push_back({s, domain_of(s, way), goals, triggers, guard, action});
            }
        }
    }

    // ---- the table

    Table write() {
        reads_.resize(chart_.inputs.size() + static_cast<std::size_t>(inputs_));
        for (std::size_t e = chart_.inputs.size(); e < reads_.size(); ++e) reads_[e].whole = true;
        const int count = static_cast<int>(nodes_.size());
        const int states_at = k::chart_head_size, regions_at = states_at + count * k::chart_state_columns;
        std::vector<int> regions{0};
        for (int s = 1; s <= real_; ++s)
            if (kind(node(s).parent) == Kind::parallel) regions.push_back(s);
        numbers_.resize(static_cast<std::size_t>(regions_at));
        numbers_.insert(numbers_.end(), regions.begin(), regions.end());
        std::vector<Row> rows;
        for (int s = 1; s <= real_; ++s) add_transitions(s, rows);
        bool has_history = false;
        for (int s = 0; s < count; ++s) {
            if (kind(s) == Kind::junction) continue;
            has_history = has_history || is_history(kind(s));
            write_state(s, states_at + s * k::chart_state_columns);
        }
        const int transitions_at = size();
        for (const Row& row : rows)
            numbers_.insert(numbers_.end(), {double(row.source), double(row.domain), double(row.goals),
                                             double(row.triggers), double(row.guard), double(row.action)});
        const int flags_at = list(flags_), timers_at = size();
        numbers_.resize(numbers_.size() + timers_.size());
        for (const auto& [event, number] : timers_)
            numbers_[static_cast<std::size_t>(timers_at + number)] = events_.at(event);
        const int initial_at = size();
        for (const auto& variable : chart_.variables) numbers_.push_back(variable.second);
        const int formulas_at = size();
        append(numbers_, formulas_);
        const int E = static_cast<int>(events_.size()), V = static_cast<int>(chart_.variables.size());
        const int head[k::chart_head_size] = {real_,
                                              compounds_,
                                              V,
                                              static_cast<int>(chart_.parameters.size()),
                                              E,
                                              inputs_,
                                              static_cast<int>(chart_.inputs.size()),
                                              static_cast<int>(timers_.size()),
                                              has_history,
                                              chart_.is_completed,
                                              0,
                                              static_cast<int>(regions.size()),
                                              states_at,
                                              transitions_at,
                                              regions_at,
                                              flags_at,
                                              timers_at,
                                              initial_at,
                                              formulas_at};
        std::ranges::copy(head, numbers_.begin());
        Table table;
        table.numbers = std::move(numbers_);
        table.compounds = compounds_;
        table.memory =
            compounds_ * (has_history ? 2 : 1) + V + static_cast<int>(timers_.size()) + E - inputs_;
        for (int s = 1; s <= real_; ++s) table.states.push_back(short_name(s));
        for (const int s : regions) table.regions.push_back(s == 0 ? "main" : short_name(s));
        table.ports = chart_.inputs;
        for (const auto& event : chart_.events) table.ports.push_back(port_name(event));
        table.reads = reads_;
        for (const auto& name : chart_.outputs) {
            const auto found =
                std::ranges::find(chart_.variables, name, &std::pair<std::string, double>::first);
            const bool is_state = found == chart_.variables.end();
            table.outputs.push_back(
                {port_name(name), is_state,
                 is_state ? named_state(name, 0) - 1 : static_cast<int>(found - chart_.variables.begin())});
        }
        return table;
    }
    /// As much of the end of its path as no other state has.
    std::string short_name(int s) const {
        const std::string& path = node(s).path;
        for (auto dot = path.rfind('.'); dot != path.npos && dot > 0; dot = path.rfind('.', dot - 1)) {
            const std::string end = path.substr(dot);
            if (std::ranges::count_if(
                    nodes_, [&](const Node& other) { return ("." + other.path).ends_with(end); }) == 1)
                return end.substr(1);
        }
        return path;
    }
    void write_state(int s, int at) {
        const State& state = *node(s).state;
        const std::string where = called(s);
        const auto action = [&](const std::string& text, const char* which) {
            return actions_of({text}, s, where + ", " + which);
        };
        double row[k::chart_state_columns] = {};
        const auto& siblings = node(s).parent < 0 ? node(s).children : node(node(s).parent).children;
        const auto self = std::ranges::find(siblings, s);
        row[k::chart_parent] = std::max(node(s).parent, 0);
        row[k::chart_kind] = double(kind(s) == Kind::parallel          ? k::chart_parallel
                                    : kind(s) == Kind::final           ? k::chart_final
                                    : kind(s) == Kind::shallow_history ? k::chart_shallow_history
                                    : kind(s) == Kind::deep_history    ? k::chart_deep_history
                                    : is_compound(s)                   ? k::chart_compound
                                                                       : k::chart_atomic);
        row[k::chart_group] = node(s).compound;
        row[k::chart_first_child] = node(s).children.empty() ? 0 : node(s).children[0];
        row[k::chart_next_sibling] =
            s > 0 && self != siblings.end() && self + 1 != siblings.end() ? *(self + 1) : 0;
        row[k::chart_last_descendant] = node(s).last;
        row[k::chart_entry] = action(state.entry, "entry");
        row[k::chart_during] = action(state.during, "during");
        row[k::chart_exit] = action(state.exit, "exit");
        row[k::chart_first_transition] = node(s).transitions.empty() ? 0 : node(s).transitions[0];
        row[k::chart_transition_count] = static_cast<double>(node(s).transitions.size());
        if (is_compound(s) || is_history(kind(s))) {
            const std::string leads = where + (is_history(kind(s)) ? ", to" : ", initial");
            std::vector<int> goals = find_all(state.initial, is_compound(s) ? s : node(s).parent, leads);
            if (goals.empty() && is_compound(s)) goals = {node(s).children[0]};
            const int around = is_compound(s) ? s : node(s).parent;
            for (const int goal : goals)
                if (is_history(kind(s)) && is_history(kind(goal)))
                    refuse(where + " is a history and leads to " + called(goal) +
                           ", which is one, too; name a state");
                else if (!is_below(goal, around) || kind(goal) == Kind::junction)
                    refuse(leads + ": " + called(goal) + " is no state inside of " + called(around));
            check_goals(goals, leads);
            row[k::chart_targets] = list(goals);
            row[k::chart_begin_action] = action(state.begin, "begin");
        } else if (!state.initial.empty() || !state.begin.empty()) {
            refuse(where + " has an initial state or a `begin`, but no states of which one begins");
        }
        const auto done = events_.find("done.state." + state.name);
        row[k::chart_done_event] = done == events_.end() ? 0 : done->second;
        std::copy(row, row + k::chart_state_columns, numbers_.begin() + at);
    }

    static constexpr int cells_end = k::chart_most_cells; ///< slots from here on are inputs

    int inputs_ = 0; ///< events that are
    std::map<std::string, int> events_, timers_;
    std::vector<int> flags_;
    std::vector<Reads> reads_;
    std::vector<double> numbers_, formulas_;
};

} // namespace

Table lower(const Chart& chart) { return Lowering(chart).run(); }

} // namespace bf::charts

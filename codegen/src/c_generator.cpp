#include "c_generator.hpp"

#include "bf/kernels/runge_kutta.hpp"
#include "c_rule.hpp"
#include "equation.hpp"
#include "trace.hpp"

#include <algorithm>
#include <cmath>

namespace bf::codegen {

namespace {

using program::Statement;
using Kind = Statement::Kind;

/// x = start + h Σ_j weights_j k_j of one stage, as the kernel says it of one element; `operands` are start,
/// k_0, k_1, ...
template <const kernels::ButcherTableau& method, int stage>
std::string advance_text(int wanted, double h, Type real, const std::vector<Argument>& operands) {
    if constexpr (stage <= method.stages) {
        if (stage != wanted) return advance_text<method, stage + 1>(wanted, h, real, operands);
        begin_terms(real);
        Trace trace{.most_terms = 1000, .path = {}};
        std::vector<Symbol> symbols;
        for (int a = 0; a < static_cast<int>(operands.size()); ++a)
            symbols.emplace_back(
                term({.kind = TermKind::element, .type = real, .argument = a, .index = 0, .trace = &trace}));
        Symbol x;
        kernels::detail::advance<method, stage, Symbol>(&x, symbols.data(), Symbol(h), symbols.data() + 1, 1);
        return EquationPrinter(operands, -1)(x.term(), real).text;
    } else {
        return {};
    }
}

} // namespace

CGenerator::CGenerator(const Diagram& diagram, const Options& options) : Generator(diagram, options) {
    flatten_ = "";
    control_ = "model->control.";
    time_ = step_time_ = "model->time_of_step";
}

void CGenerator::check() const {
    Generator::check();
    std::string problems;
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
        if (is_hosted(static_cast<int>(n)))
            problems += "\n  " + diagram_.nodes[n].path + " (" + diagram_.nodes[n].type +
                        "): it is more than rules, and a C program cannot make it";
    if (!problems.empty())
        throw GenerationError("no C code can be generated for '" + diagram_.name + "':" + problems +
                              "\nreplace these blocks, or generate C++: --language c++");
}

std::string CGenerator::in_structure(const std::string& name) const {
    return "model->" + (name.ends_with('_') ? name.substr(0, name.size() - 1) : name);
}

std::string CGenerator::failing(int n, const std::string& why) const {
    return "return " + file_ + "_fail(model, " + literal(node(n).path) + ", " + why + ");\n";
}

std::string CGenerator::unless(const std::string& good, const std::string& otherwise) const {
    return "if (!(" + good + ")) {\n" + indented(otherwise, 4) + "}\n";
}

std::string CGenerator::time_at(const std::string& steps) const {
    return "(" + c_name(real()) + ")" + steps + " * " + c_literal(diagram_.step, real());
}

std::string CGenerator::call_of(const std::string& function) const {
    return file_ + "_" + function + "(model)";
}
std::string CGenerator::declaration_of(const std::string& function) const { return head_of(function) + ";"; }
std::string CGenerator::head_of(const std::string& function) const {
    return "static bool " + file_ + "_" + function + "(" + file_ + "_model *model)";
}

std::string CGenerator::each(const Slot& slot,
                             const std::function<std::string(const std::string&)>& statement) const {
    if (is_one_number(slot)) return statement("");
    return "for (int i = 0; i < " + number(slot.size.count()) + "; ++i) {\n" + indented(statement("[i]"), 4) +
           "}\n";
}

Argument CGenerator::argument(int n, const Call::Reference& from) {
    Argument result = Generator::argument(n, from);
    if (result.text.ends_with(".data")) result.text.resize(result.text.size() - 5);
    if (from.source == Call::Source::period && !result.values.empty()) {
        result.text.clear();
        result.type = real();
    }
    return result;
}

std::string CGenerator::rule(int n, Phase phase, int index) {
    const Call& call = block(n).declaration().rules(phase)[static_cast<std::size_t>(index)];
    std::vector<Argument> arguments;
    for (const auto& from : call.operands) arguments.push_back(argument(n, from));
    auto made = charts_.rule(call.kernel, arguments, call.list_from, call.list_size, file_ + "_");
    if (!made) made = c_rule(call.kernel, arguments, call.list_from, call.list_size, file_ + "_");
    if (!made) {
        const std::string what = "\n  " + node(n).path + " (" + node(n).type + ")";
        if (std::find(refused_.begin(), refused_.end(), what) == refused_.end()) refused_.push_back(what);
        return "// " + comment(node(n).path) + "\n";
    }
    functions_.insert(made->functions.begin(), made->functions.end());
    std::string text = "// " + comment(node(n).path) + " (" + comment(node(n).type) + ")\n";
    for (const std::string& written : made->lines) {
        if (const auto at = written.find(c_fail); at != written.npos) {
            text += indented(failing(n, message(std::string(made->failure))), static_cast<int>(at));
            continue;
        }
        const auto indent = written.find_first_not_of(' ');
        text += indented(equation(written.substr(indent)), static_cast<int>(indent));
    }
    return text;
}

std::string CGenerator::write_values(const std::string& target, const Slot& slot,
                                     const std::vector<double>& values) const {
    const auto differ = [](double a, double b) { return a != b || std::signbit(a) != std::signbit(b); };
    const auto text = [&](double value) { return c_literal(value, type_of(slot)); };
    if (values.empty() || std::adjacent_find(values.begin(), values.end(), differ) == values.end())
        return each(slot, [&](const std::string& i) {
            return target + i + " = " + text(values.empty() ? 0.0 : values.front()) + ";\n";
        });
    std::string all;
    for (std::size_t i = 0; i < values.size(); ++i)
        all += target + "[" + number(static_cast<int>(i)) + "] = " + text(values[i]) + ";\n";
    return all;
}

std::string CGenerator::assignment(const std::string& to, const Slot& to_slot, const std::string& from,
                                   const Slot& from_slot) const {
    const std::string cast =
        type_of(to_slot) == type_of(from_slot) ? "" : "(" + c_name(type_of(to_slot)) + ")";
    return each(to_slot, [&](const std::string& i) {
        return to + i + " = " + cast + from +
               (is_one_number(from_slot)      ? ""
                : from_slot.size.count() == 1 ? "[0]"
                                              : i) +
               ";\n";
    });
}

std::string CGenerator::has_crossed(const Field& guard) const {
    std::string text;
    for (int i = 0; i < guard.slot->size.count(); ++i)
        text += (i ? " || " : "") + ("(" + in_structure("guards_") + "." + guard.member) +
                (is_one_number(*guard.slot) ? "" : "[" + number(i) + "]") + " != " + c_literal(0, real()) +
                ")";
    return text;
}

std::string CGenerator::is_positive(const Node::End& end) const {
    const Slot& slot = diagram_.slot(end);
    const std::string place = place_of(end).text();
    std::string text;
    for (int i = 0; i < slot.size.count(); ++i)
        text += (i ? " || " : "") + ("(" + place + "[" + number(i) + "]") +
                (slot.type == Type::boolean ? ")" : " > 0)");
    return slot.size.count() == 0 ? "false" : "(" + text + ")";
}

std::string CGenerator::is_finite(const Node::End& end) const {
    const Slot& slot = diagram_.slot(end);
    const std::string place = place_of(end).text();
    std::string text;
    for (int i = 0; i < slot.size.count(); ++i)
        text +=
            (i ? " && " : "") + ("isfinite(" + place) + (is_one_number(slot) ? ")" : "[" + number(i) + "])");
    return text.empty() ? "true" : text;
}

std::string CGenerator::edge(const Statement& s) const {
    const auto& memory = program_.memories[static_cast<std::size_t>(s.number)];
    const Slot& slot = diagram_.slot(memory.signal);
    const std::string signal = place_of(memory.signal).text(), before = this->memory(s.number),
                      found = flag(s.flag);
    const std::string i = is_one_number(slot) ? "" : "[i]";
    const std::string rises = "((before <= 0.0) && (now > 0.0))", falls = "((before > 0.0) && (now <= 0.0))";
    const std::string is_edge = memory.edge == model::Edge::rising    ? rises
                                : memory.edge == model::Edge::falling ? falls
                                : memory.edge == model::Edge::either  ? rises + " || " + falls
                                                                      : "(now > 0.0)";
    const bool asks_before = memory.edge != model::Edge::level;
    return found + " = false;\nfor (int i = 0; i < " + number(slot.size.count()) +
           "; ++i) {\n    const double now = " +
           (slot.type == Type::boolean ? signal + i + " ? 1.0 : 0.0" : "(double)" + signal + i) + ";\n" +
           (asks_before ? "    const double before = " + before + "[i];\n" : "") + "    " + found + " = " +
           found + " || " + is_edge + ";\n    " + before + "[i] = now;\n}\n";
}

std::string CGenerator::text_of(const Statement& s, program::Pass pass) {
    switch (s.kind) {
    case Kind::finite:
        return unless(is_finite(s.signal),
                      failing(s.node, message(s.failure.text(&block(s.node).resolution()))));
    case Kind::edge: return edge(s);
    case Kind::hit: {
        if (!used_flags_.contains(s.flag)) return {};
        const auto& hit = program_.flags[static_cast<std::size_t>(s.flag)];
        const std::string until = control_ + "until_hit_" + hit_name(hit);
        return flag(s.flag) + " = (" + until + " == 0);\nif (" + flag(s.flag) + ") {\n    " + until + " = " +
               std::to_string(calls_between(hit)) + ";\n}\n" + until + "--;\n";
    }
    case Kind::fire: {
        if (!timed_rates_.contains(s.number)) return {};
        const std::string clock = control_ + "clock_" + number(s.number);
        return clock + ".period = " + clock + ".has_run ? (" + time_ + " - " + clock +
               ".time) : " + literal(0, real()) + ";\n" + clock + ".time = " + time_ + ";\n" + clock +
               ".has_run = true;\n";
    }
    case Kind::repeat: return repetition(s, pass);
    case Kind::observe:
        return "if (model->before_event != NULL) {\n    model->before_event(model->observer);\n}\n";
    default: return Generator::text_of(s, pass);
    }
}

std::string CGenerator::commits(const Statement& s) const {
    std::string checks, copies;
    const auto& slots = block(s.node).resolution().slots;
    for (std::size_t k = 0; k < slots.size(); ++k) {
        const Slot& slot = slots[k];
        if (slot.role != Role::discrete_state || slot.size.count() == 0) continue;
        const std::string state = place_of({s.node, static_cast<int>(k)}).text();
        const std::string next = next_[static_cast<std::size_t>(s.node)][k].text();
        if (slot.type == Type::float64)
            copies += each(slot, [&](const std::string& i) {
                return "if (isnan(" + next + i + ") != 0) {\n    return " + file_ + "_fail(model, " +
                       literal(node(s.node).path) + ", " + file_ + "_state_became_nan);\n}\n";
            });
        copies += assignment(state, slot, next, slot);
    }
    return copies.empty() ? copies
                          : "// The next states become those of now, unless one is not a number.\n" + copies;
}

std::string CGenerator::repetition(const Statement& s, program::Pass pass) {
    const std::string depth = ++c_loop_depth_ > 1 ? "_" + number(c_loop_depth_) : "";
    const std::string i = "iteration" + depth, goes_on = "goes_on" + depth;
    const bool has_count = s.signal.node >= 0, can_end = !s.when.empty();
    const std::string body = Generator::text_of(s.body, pass, 4);
    std::string text;
    if (has_count) {
        const Slot& slot = diagram_.slot(s.signal);
        const std::string most = "most" + depth;
        text = "const double " + most + " = (double)" + place_of(s.signal).text() +
               (is_one_number(slot) ? "" : "[0]") + ";\nint64_t " + i + " = 1;\nwhile ((double)" + i +
               " <= " + most + ") {\n" + body + "    " + i + "++;\n}\n";
    } else {
        if (can_end) text = "bool " + goes_on + " = true;\n";
        text += "for (int " + i + " = 1; " + (can_end ? goes_on + " && (" : "") + i +
                " <= " + number(s.number) + (can_end ? ")" : "") + "; ++" + i + ") {\n" + body +
                (can_end ? "    " + goes_on + " = " + condition(s.when) + ";\n" : "") + "}\n";
    }
    if (!s.otherwise.empty())
        text += "if (" + goes_on + ") {\n" + Generator::text_of(s.otherwise, pass, 4) + "}\n";
    --c_loop_depth_;
    return can_end || has_count ? "{\n" + indented(text, 4) + "}\n" : text;
}

std::string CGenerator::runge_kutta(const Calls& calls) const {
    const std::string type = c_name(real());
    const int stages = stages_of_solver();
    std::string body = stages > 1 ? "    const " + type + " t = " + time_ + ";\n" : "";
    body += "    model->start = model->continuous;\n";
    const auto give_up = [&](const std::string& good) {
        return indented(unless(good, "model->continuous = model->start;\nreturn false;\n"), 4);
    };
    body += give_up(called(calls.derivatives)) + "    model->slopes[0] = model->rates;\n";
    const double h =
        real() == Type::float32 ? static_cast<double>(static_cast<float>(diagram_.step)) : diagram_.step;
    const auto with_tableau = [&](auto&& f) {
        switch (diagram_.solver.method) {
        case SolverMethod::euler: return f.template operator()<kernels::euler>();
        case SolverMethod::heun: return f.template operator()<kernels::heun>();
        case SolverMethod::bogacki_shampine: return f.template operator()<kernels::bogacki_shampine>();
        case SolverMethod::rk4: return f.template operator()<kernels::rk4>();
        default: return f.template operator()<kernels::dormand_prince>();
        }
    };
    for (int stage = 1; stage <= stages; ++stage) {
        for (const auto& field : continuous_)
            body += indented(
                each(*field.slot,
                     [&](const std::string& i) {
                         std::vector<Argument> operands{
                             {.type = real(), .text = "model->start." + field.member + i}};
                         for (int j = 0; j < stage; ++j)
                             operands.push_back(
                                 {.type = real(),
                                  .text = "model->slopes[" + number(j) + "]." + field.member + i});
                         return equation("model->continuous." + field.member + i + " = " +
                                         with_tableau([&]<const kernels::ButcherTableau & method>() {
                                             return advance_text<method, 1>(stage, h, real(), operands);
                                         }) +
                                         ";");
                     }),
                4);
        if (stage == stages) break;
        const double c =
            with_tableau([&]<const kernels::ButcherTableau & method>() { return method.c[stage]; });
        body += "    " + time_ + " = t + (" + literal(c, real()) + " * " + literal(diagram_.step, real()) +
                ");\n" + give_up(called(calls.inside)) + give_up(called(calls.derivatives)) +
                "    model->slopes[" + number(stage) + "] = model->rates;\n";
    }
    for (const auto& field : continuous_)
        body +=
            indented(unless(is_finite(field.end),
                            failing(field.end.node, message(program::continuous_state_not_finite.text()))),
                     4);
    return "// One step of " + solver_name() + ".\n" + head_of("integrate") + "\n{\n" + body +
           "    return true;\n}\n\n";
}

std::string CGenerator::evaluation(const std::string& name, const std::string& its,
                                   const std::string& doc) const {
    return "// " + doc + "\n" + head_of(name) + "\n{\n" + (its == "true" ? "    (void)model;\n" : "") +
           "    return " + its + ";\n}\n\n";
}

std::string CGenerator::crossings(const Calls& calls) {
    const CFunction crossing{"crossing", real()};
    functions_.insert(crossing);
    const std::string type = c_name(real()), found = flag(crossed_flag());
    std::string lost, looks;
    for (const auto& field : guards_) {
        const std::string guard = in_structure("guards_") + "." + field.member,
                          before = in_structure("guards_before_") + "." + field.member;
        lost += each(*field.slot, [&](const std::string& i) { return guard + i + " = NAN;\n"; });
        looks += each(*field.slot, [&](const std::string& i) {
            const std::string change =
                c_name(crossing, file_ + "_") + "(" + before + i + ", " + guard + i + ")";
            return equation("change = " + change + ";") + before + i + " = " + guard + i + ";\n" + guard + i +
                   " = change;\n" + found + " = " + found + " || (change != " + c_literal(0, real()) + ");\n";
        });
    }
    return evaluation("compute_again", called(calls.again), "After an event.") +
           "// Guards are 1 where they rose through 0, -1 where they fell, else 0.\n" +
           head_of("find_crossings") + "\n{\n    " + type + " change;\n" + indented(lost, 4) +
           indented(unless(called(calls.guards), "return false;\n"), 4) + "    " + found + " = false;\n" +
           indented(looks, 4) + "    return true;\n}\n\n";
}

} // namespace bf::codegen

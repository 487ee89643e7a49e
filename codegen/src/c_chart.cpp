#include "c_chart.hpp"

#include "generator.hpp"
#include "texts.hpp"

#include <algorithm>
#include <map>

namespace bf::codegen {

namespace {

namespace k = kernels;

int head(const std::vector<double>& table, int which) {
    return static_cast<int>(table[static_cast<std::size_t>(which)]);
}
int cells_of(const std::vector<double>& table) {
    return head(table, k::chart::chart_variables) + head(table, k::chart::chart_parameters) +
           k::chart::chart_given_cells +
           static_cast<int>(table[static_cast<std::size_t>(head(table, k::chart::chart_flags_at))]);
}

std::string array_of(const std::string& type, const std::string& name, const std::vector<double>& values,
                     Type its) {
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + c_literal(value, its);
    return equation("static const " + type + " " + name + "[" + number(static_cast<int>(values.size())) +
                    "] = {" + list + "};");
}

/// A part of a text of kernels/, from a heading on up to the next one; without a heading all before the
/// first.
std::string part_of(const std::string& header, const std::string& heading) {
    const std::string mark = "// ---- ", text(text_of_header("bf/kernels/" + header));
    const auto begin = heading.empty() ? text.find("\n\n") + 2 : text.find(mark + heading);
    const auto end = text.find(mark, begin + 1);
    return text.substr(begin, end == text.npos ? end : end - begin);
}
/// The whole text, but for what it says of itself.
std::string text_of(const std::string& header) {
    const std::string text(text_of_header("bf/kernels/" + header));
    return text.substr(text.find("\n\n") + 2) + "\n";
}

} // namespace

std::optional<CRule> CCharts::rule(std::string_view kernel, const std::vector<Argument>& arguments,
                                   int list_from, int list_size, const std::string& prefix) {
    if (kernel == k::ActiveStates::name) return active_states(arguments);
    const bool is_update = kernel == k::ChartUpdate::name, has_variables = kernel == k::Chart::name;
    if (!is_update && !has_variables && kernel != k::StateMachine::name) return {};
    const auto at = static_cast<std::size_t>(has_variables ? 4 : 3); // what is written stands before
    const Argument &table = arguments[at], &p = arguments[at + 1], &x = arguments[at + 2],
                   &memory = arguments[at + 3], &started = arguments[at + 4], &time = arguments[at + 5],
                   &period = arguments[at + 6];
    if (table.values[k::chart::chart_is_flat] != 0) // as equations, if these are few
        if (auto equations = c_rule(kernel, arguments, list_from, list_size, prefix)) return equations;
    const Chart* const its = chart(table, time, list_size, prefix);
    if (!its) return {};
    real_ = time.type;
    CRule rule{{}, its->functions, k::Chart::failure};
    const std::string real = c_name(real_), chart = prefix + "chart_";
    const auto add = [&](const std::string& line) { rule.lines.push_back("    " + line); };
    const auto address = [](const Argument& a) { return a.is_array ? a.text : "&" + a.text; };
    const auto element = [](const Argument& a, const std::string& i) {
        return a.is_array ? a.text + "[" + i + "]" : a.text;
    };
    // Inputs of other types are copied.
    std::string inputs;
    for (int i = 0; i < list_size; ++i) {
        const Argument& input = arguments[static_cast<std::size_t>(list_from + i)];
        std::string place = address(input);
        if (input.type != real_ || !input.values.empty()) {
            const int count = input.size.count();
            place = "input_" + number(i + 1);
            add(real + " " + place + "[" + number(count) + "];");
            const CFunction of_truth{"number_of", real_};
            const std::string value = element(input, "i");
            if (input.type == Type::boolean) rule.functions.insert(of_truth);
            add("for (int i = 0; i < " + number(count) + "; ++i) {");
            add("    " + place + "[i] = " +
                (input.type == Type::boolean ? c_name(of_truth, prefix) + "(" + value + ")"
                                             : "(" + real + ")" + value) +
                ";");
            add("}");
        }
        inputs += (i ? ", " : "") + place;
    }
    if (list_size > 0) add("const " + real + " *const inputs[" + number(list_size) + "] = {" + inputs + "};");
    add("const " + chart + "numbers numbers = {" + its->name + "_table, " + its->name + "_initial, " +
        (list_size > 0 ? "inputs" : "NULL") + ", " + its->name + "_value};");
    add(chart + "step chart;");
    add(chart + "prepare(&chart, &numbers, " + time.text + ", " +
        (period.values.empty() ? element(period, "0") : c_literal(period.values[0], real_)) + ");");
    add("if (!" + chart + "run(&chart, " + address(x) + ", " + address(memory) + ", " +
        element(started, "0") + ", " + address(p) + ")) {");
    add("    " + std::string(c_fail));
    add("}");
    if (is_update) {
        keeps_ = true;
        add(chart + "keep(&chart, " + address(arguments[0]) + ", " + address(arguments[1]) + ");");
        add(element(arguments[2], "0") + " = true;");
    } else {
        shows_ = true;
        const bool is_one = !arguments[0].is_array;
        const std::string zero = c_literal(0, real_), in = is_one ? "    " : "        ";
        if (!is_one) add("for (int32_t r = 0; r < " + number(arguments[0].size.count()) + "; ++r) {");
        const std::string r = is_one ? "0" : "r", indent = is_one ? "" : "    ";
        add(indent + "int32_t shown = 0;");
        add(indent + element(arguments[0], "r") + " = " + chart + "active_in(&chart, " + r + ", &shown);");
        add(indent + element(arguments[1], "r") + " = (shown != 0) ? " + chart +
            "time_in(&chart, shown) : " + zero + ";");
        add(indent + element(arguments[2], "r") + " = (shown != 0) && " + chart + "is_fresh(&chart, shown);");
        if (!is_one) add("}");
        if (has_variables) {
            const Argument& variables = arguments[3];
            add("for (int32_t v = 0; v < " + number(variables.size.count()) + "; ++v) {");
            add("    " + element(variables, "v") + " = chart.cells[v];");
            add("}");
        }
    }
    rule.lines.insert(rule.lines.begin(), "{");
    rule.lines.push_back("}");
    return rule;
}

std::optional<CRule> CCharts::active_states(const std::vector<Argument>& arguments) const {
    const Argument &active = arguments[0], &table = arguments[1], &state = arguments[2];
    const int count = active.size.count(), at = head(table.values, k::chart::chart_states_at);
    std::vector<double> last;
    for (int s = 1; s <= count; ++s)
        last.push_back(table.values[static_cast<std::size_t>(at + s * k::chart::chart_state_columns +
                                                             k::chart::chart_last_descendant)]);
    const std::string one = active.is_array ? active.text + "[s - 1]" : active.text,
                      now = state.is_array ? state.text + "[r]" : state.text, real = c_name(state.type);
    std::string ends = array_of("int32_t", "last", last, Type::int32);
    ends.pop_back();
    return CRule{{"{", "    " + ends, "    for (int32_t s = 1; s <= " + number(count) + "; ++s) {",
                  "        " + one + " = false;",
                  "        for (int32_t r = 0; r < " + number(state.size.count()) + "; ++r) {",
                  "            " + one + " = " + one + " || ((" + now + " >= (" + real + ")s) && (" + now +
                      " <= (" + real + ")last[s - 1]));",
                  "        }", "    }", "}"},
                 {},
                 {}};
}

const CCharts::Chart* CCharts::chart(const Argument& table, const Argument& time, int inputs,
                                     const std::string& prefix) {
    const std::vector<double>& numbers = table.values;
    for (const Chart& known : charts_)
        if (known.table == numbers) return &known;
    Chart made{.table = numbers, .text = {}, .functions = {}, .name = {}};
    made.name = prefix + "chart_" + number(static_cast<int>(charts_.size()) + 1);
    const auto initial = numbers.begin() + head(numbers, k::chart::chart_initial_at),
               formulas = numbers.begin() + head(numbers, k::chart::chart_formulas_at);
    made.text = array_of("int32_t", made.name + "_table", {numbers.begin(), initial}, Type::int32) + "\n";
    std::vector<double> first(initial, formulas);
    if (first.empty()) first.push_back(0);
    const std::string real = c_name(time.type);
    made.text += array_of(real, made.name + "_initial", first, time.type) + "\n";
    std::string cases;
    const auto add = [&](const std::string& line) {
        const auto indent = line.find_first_not_of(' ');
        cases += indented(equation(line.substr(indent)), 8 + static_cast<int>(indent));
    };
    for (auto at = formulas; at != numbers.end(); at += 1 + static_cast<int>(*at)) {
        const std::vector<double> code(at + 1, at + 1 + static_cast<int>(*at));
        std::vector<Argument> operands{
            {.type = time.type, .text = "y", .is_written = true},
            {.size = {static_cast<int>(code.size()), 1}, .is_array = true, .values = code},
            {.type = time.type, .size = {cells_of(numbers), 1}, .text = "cells", .is_array = true}};
        std::vector<int> counts(static_cast<std::size_t>(inputs), 1);
        for (std::size_t i = 0; i < code.size(); i += 3)
            if (static_cast<k::Operation>(static_cast<int>(code[i])) == k::Operation::fixed) {
                int& count = counts[static_cast<std::size_t>(code[i + 1])];
                count = std::max(count, static_cast<int>(code[i + 2]) + 1);
            }
        for (int i = 0; i < inputs; ++i)
            operands.push_back({.type = time.type,
                                .size = {counts[static_cast<std::size_t>(i)], 1},
                                .text = "inputs[" + number(i) + "]",
                                .is_array = true});
        const auto value = c_rule(k::Expression::name, operands, 3, inputs, prefix);
        if (!value) return nullptr;
        made.functions.insert(value->functions.begin(), value->functions.end());
        cases += "    case " + number(static_cast<int>(at - formulas) + 1) + ":\n";
        for (const auto& line : value->lines) add(line);
        cases += "        break;\n";
    }
    const std::string uses_inputs = cases.find("inputs[") == cases.npos ? "    (void)inputs;\n" : "",
                      uses_cells = cases.find("cells[") == cases.npos ? "    (void)cells;\n" : "";
    made.text += "static " + real + " " + made.name + "_value(const " + real + " *cells, const " + real +
                 " *const *inputs, int32_t code)\n{\n    " + real + " y = " + c_literal(0, time.type) +
                 ";\n" + uses_inputs + uses_cells + "    switch (code) {\n" + cases +
                 "    default:\n        break;\n    }\n    return y;\n}\n\n";
    charts_.push_back(std::move(made));
    return &charts_.back();
}

std::string CCharts::definitions(const std::string& prefix) const {
    if (charts_.empty()) return {};
    std::map<std::string, int> most;
    const auto note = [&](const char* name, int n) { most[name] = std::max({most[name], n, 1}); };
    std::string own;
    for (const Chart& one : charts_) {
        const auto its = [&](int which) { return head(one.table, which); };
        note("states", its(k::chart::chart_state_count));
        note("compounds", its(k::chart::chart_compounds));
        note("cells", cells_of(one.table));
        note("timers", its(k::chart::chart_timers));
        note("events", its(k::chart::chart_events) - its(k::chart::chart_event_inputs));
        note("chosen", its(k::chart::chart_regions)); // each innermost state is in a region of its own
        own += one.text;
    }
    const std::string real = c_name(real_);
    std::string text = "// ---- state charts\n\n// The largest ones.\n";
    for (const auto& [name, n] : most) text += "enum { chart_most_" + name + " = " + number(n) + " };\n";
    text += "\n" + text_of("chart_table.h") + "typedef " + real +
            " chart_number;\n// What is a chart's own.\ntypedef struct {\n    const int32_t *table;\n"
            "    const chart_number *initial;\n    const chart_number *const *inputs;\n    chart_number "
            "(*value)(const chart_number *cells, const chart_number *const *inputs, int32_t code);\n} "
            "chart_numbers;\n\nstatic int32_t chart_at(const chart_numbers *from, int32_t place)\n{\n    "
            "return from->table[place];\n}\n\nstatic chart_number chart_initial_value(const chart_numbers "
            "*from, int32_t i)\n{\n    return from->initial[i];\n}\n\nstatic bool chart_is_input(const "
            "chart_numbers *from, int32_t event)\n{\n    return from->inputs[chart_at(from, "
            "chart_event_port) + event - 1][0] != (chart_number)0;\n}\n\nstatic chart_number "
            "chart_value(const chart_numbers *from, const chart_number *cells, int32_t code)\n{\n    return "
            "from->value(cells, from->inputs, code);\n}\n\n" +
            text_of("chart_state.h") + text_of("chart_microstep.h") + part_of("chart_step.h", "");
    if (shows_) text += part_of("chart_step.h", "what outputs show");
    if (keeps_) text += part_of("chart_step.h", "what is kept") + "\n";
    std::string named;
    for (std::size_t at = 0; at < text.size();) { // names of the texts begin with the model's
        const auto found = text.find("chart_", at);
        named += text.substr(at, found == text.npos ? found : found - at);
        if (found == text.npos) break;
        named += prefix + "chart_";
        at = found + 6;
    }
    return named + own;
}

} // namespace bf::codegen

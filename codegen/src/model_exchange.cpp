// What a solver of the caller needs of a model: derivatives, guards and events apart from steps.
#include "generator.hpp"

#include <algorithm>
#include <utility>

namespace bf::codegen {

bool Generator::is_sampled(const Calls& calls) const {
    // A function call counts at the steps alone.
    const auto is_called = [&](const Condition& c) {
        return c.trigger.node >= 0 && c.trigger_edge == model::Edge::level;
    };
    return calls.outputs != calls.again || !calls.commit.empty() ||
           std::any_of(diagram_.conditions.begin(), diagram_.conditions.end(), is_called);
}

int Generator::mark_count() const {
    int count = 0;
    for (const auto& marked : program_.marked) count += diagram_.slot(marked.end).size.count();
    return count;
}

bool Generator::keeps_signals(const Calls& calls) const {
    const auto remembers = [&](const DiagramNode& node) {
        const auto& slots = node.block->resolution().slots;
        return diagram_.rates[static_cast<std::size_t>(node.rate)].is_continuous &&
               std::any_of(slots.begin(), slots.end(),
                           [](const Slot& slot) { return slot.role == Role::discrete_state; });
    };
    return !marks_.empty() && !calls.commit.empty() &&
           std::any_of(diagram_.nodes.begin(), diagram_.nodes.end(), remembers);
}

std::string Generator::event_statements(const Calls& calls) {
    std::string text;
    program::Statements others;
    const auto print_others = [&] { text += update_body(std::exchange(others, {})); };
    for (const auto& statement : program_.event) {
        if (statement.kind != program::Statement::Kind::evaluate) {
            others.push_back(statement);
            continue;
        }
        print_others();
        text += indented(
            unless(called(statement.pass == program::again ? calls.again : calls.between), "return false;\n"),
            4);
    }
    print_others();
    return text;
}

std::string Generator::exchange_declarations(const Calls& calls) const {
    if (!is_fmu_) return {};
    const auto truth = [](bool is) { return is ? "true" : "false"; };
    return "\n    /// For a solver of the caller, which integrates `continuous` where update() would. A step "
           "is output() and "
           "end_step();\n    /// then, at any time until the next one, rates and crossings, and answer() "
           "where "
           "one of these "
           "changed its sign.\n    static constexpr int continuous_count = " +
           number(continuous_size()) + ", guard_count = " + number(guard_count() + mark_count()) +
           ";\n    static constexpr bool is_sampled = " + truth(is_sampled(calls)) +
           "; ///< does anything happen in steps alone?\n"
           "    static bf::generated::Quantities continuous_table() noexcept;\n"
           "    Real* continuous_states() noexcept;\n    Real* rates() noexcept;\n"
           "    bool compute_rates(Real at) noexcept;\n"
           "    bool compute_crossings(Real at, Real* values) noexcept;\n"
           "    /// All signals and outputs that go on between two steps; in an event subsystems begin and "
           "end, too.\n"
           "    bool compute_signals(Real at, bool is_event) noexcept;\n"
           "    bool answer(Real at) noexcept;\n    bool end_step() noexcept;\n"
           "    /// Over steps in which no rate is hit.\n    void pass(std::int64_t steps) noexcept;\n";
}

std::string Generator::exchange_members(const Calls& calls) const {
    if (marks_.empty()) return {};
    return std::string("    Marks marks_{}, marked_{}; // now, and after the last event\n") +
           (keeps_signals(calls) ? "    Signals kept_signals_{};\n" : "") +
           "    bool compute_marks() noexcept;\n";
}

std::string Generator::exchange_functions(const Calls& calls) const {
    if (!is_fmu_) return {};
    const std::string head = "bool " + class_ + "::";
    std::string copies, rows, passed;
    for (const auto& quantity : control_quantities())
        if (quantity.name.starts_with("until_hit_"))
            passed += "    " + control_ + quantity.name + " -= steps;\n";
    for (const auto& field : outputs_) copies += "    " + copy_of(field);
    const std::string at = "    if (failure_) return false;\n    " + step_time_ + " = at;\n" + go_to();
    const std::string mark = marks_.empty() ? ""
                                            : "    if (!compute_marks()) return false;\n"
                                              "    marked_ = marks_;\n";
    // The signals of the step stay those of its begin.
    const bool keeps = keeps_signals(calls);
    std::string text =
        "// For a solver of the caller.\n" + head + "end_step() noexcept {\n" + unless_failed() +
        calls.commit + "    ++steps_;\n" +
        (keeps ? "    kept_signals_ = signals;\n    if (!(" + called(calls.between) + ")) return false;\n"
               : "") +
        mark + (keeps ? "    signals = kept_signals_;\n" : "") + "    return true;\n}\n\nvoid " + class_ +
        "::pass(std::int64_t steps) noexcept {\n    steps_ += steps;\n" + passed + "}\n\n";
    const bool has_states = has_continuous_states();
    text += "" + class_ + "::Real* " + class_ + "::continuous_states() noexcept { return " +
            (has_states ? "bf::generated::elements<Real>(continuous)" : "nullptr") + "; }\n" + class_ +
            "::Real* " + class_ + "::rates() noexcept { return " +
            (has_states ? "bf::generated::elements<Real>(rates_)" : "nullptr") + "; }\n\n";
    text += head + "compute_rates(Real at) noexcept { return !failure_ && " +
            (has_states ? "evaluate(at) && " + called(calls.derivatives) : std::string("at == at")) +
            "; }\n\n";
    text += crossings_of_caller(calls, at);
    text += head + "compute_signals(Real at, bool is_event) noexcept {\n" + at +
            (calls.again == calls.between
                 ? "    static_cast<void>(is_event);\n    if (!(" + called(calls.again) + ")) return false;\n"
                 : "    if (!(is_event ? " + called(calls.again) + " : " + called(calls.between) +
                       ")) return false;\n") +
            copies + "    return true;\n}\n\n";
    text +=
        head + "answer(Real at) noexcept {\n" + at + calls.event + mark + copies + "    return true;\n}\n\n";
    for (const auto& field : continuous_) rows += "        " + table_row(field.path, field.end).substr(4);
    text += "bf::generated::Quantities " + class_ + "::continuous_table() noexcept {\n";
    if (rows.empty()) return text + "    return {nullptr, 0};\n}\n\n";
    return text +
           "    using bf::generated::Type;\n    using bf::generated::Where;\n"
           "    static constexpr bf::generated::Quantity rows[] = {\n" +
           rows + "    };\n    return {rows, static_cast<int>(sizeof rows / sizeof rows[0])};\n}\n\n";
}

/// What blocks answer, what only jumps or bends, and signals that control subsystems.
std::string Generator::crossings_of_caller(const Calls& calls, const std::string& at) const {
    const std::string head = "bool " + class_ + "::", guards = number(guard_count());
    std::string text;
    if (!marks_.empty()) {
        text += head + "compute_marks() noexcept {\n    marks_ = marked_;\n";
        for (const auto& field : marks_)
            if (field.slot->type == Type::float64)
                text += "    bf::generated::forget(bf::generated::elements<double>(marks_." + field.member +
                        "), " + number(field.slot->size.count()) + ");\n";
        text += "    return " + called(calls.marks) + ";\n}\n\n";
    }
    if (guard_count() + mark_count() == 0)
        return text + head + "compute_crossings(Real, Real*) noexcept { return true; }\n\n";
    text += head + "compute_crossings(Real at, Real* values) noexcept {\n" + at + "    if (!(" +
            called(calls.between) + ")) return false;\n";
    if (!guards_.empty())
        text += "    bf::generated::forget(bf::generated::elements<Real>(guards_), " + guards +
                ");\n    if (!(" + called(calls.guards) + ")) return false;\n    for (int i = 0; i < " +
                guards + "; ++i) *values++ = bf::generated::elements<Real>(guards_)[i];\n";
    if (!marks_.empty()) text += "    if (!compute_marks()) return false;\n";
    for (const auto& field : marks_)
        text += "    values = bf::generated::look_at_mark(marks_." + field.member + ", marked_." +
                field.member + ", values);\n";
    for (const auto& marked : program_.marked) {
        if (!marked.is_control) continue;
        const int active = program_.active[static_cast<std::size_t>(marked.condition)];
        text += "    values = bf::generated::look_at_control(" + place_of(marked.end).text() + ", " +
                (active < 0 ? "true" : flag(active)) + ", values);\n";
    }
    return text + "    return true;\n}\n\n";
}

} // namespace bf::codegen

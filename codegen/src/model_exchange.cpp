// What a solver of the caller needs of a model: derivatives, guards and events apart from steps.
#include "generator.hpp"

namespace bf::codegen {

bool Generator::is_sampled(const Calls& calls) const {
    return calls.outputs != calls.again || !calls.commit.empty();
}

void Generator::go_on_between_steps(program::Statements& outputs) const {
    for (auto& s : outputs) {
        go_on_between_steps(s.body);
        const bool is_continuous = s.kind == program::Statement::Kind::run &&
                                   diagram_.rates[static_cast<std::size_t>(node(s.node).rate)].is_continuous;
        const bool has_some = std::any_of(s.body.begin(), s.body.end(), [](const program::Statement& one) {
            return (one.passes & program::again) != 0;
        });
        if (is_continuous || has_some || (s.passes & program::inside) != 0) s.passes |= program::again;
    }
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
           number(continuous_size()) + ", guard_count = " + number(guard_count()) +
           ";\n    static constexpr bool is_sampled = " + truth(is_sampled(calls)) +
           "; ///< does anything happen in steps alone?\n"
           "    static bf::generated::Quantities continuous_table() noexcept;\n"
           "    Real* continuous_states() noexcept;\n    Real* rates() noexcept;\n"
           "    bool compute_rates(Real at) noexcept;\n"
           "    bool compute_crossings(Real at, Real* values) noexcept;\n"
           "    /// All signals and outputs that go on between two steps.\n"
           "    bool compute_signals(Real at) noexcept;\n"
           "    bool answer(Real at) noexcept;\n    bool end_step() noexcept;\n"
           "    /// Over steps in which no rate is hit.\n    void pass(std::int64_t steps) noexcept;\n";
}

std::string Generator::exchange_functions(const Calls& calls) {
    if (!is_fmu_) return {};
    const std::string head = "bool " + class_ + "::", guards = number(guard_count());
    std::string copies, rows, answers, passed;
    for (const auto& quantity : control_quantities())
        if (quantity.name.starts_with("until_hit_"))
            passed += "    " + control_ + quantity.name + " -= steps;\n";
    bool is_behind = false; // what a step evaluates
    for (const auto& statement : program_.step) {
        if (is_behind) answers += indented(text_of(statement), 4);
        is_behind = is_behind || statement.kind == program::Statement::Kind::evaluate;
    }
    for (const auto& field : outputs_) copies += "    " + copy_of(field);
    const std::string at = "    if (failure_) return false;\n    " + step_time_ + " = at;\n" + go_to();
    const std::string again = "    if (!(" + called(calls.again) + ")) return false;\n";
    std::string text = "// For a solver of the caller.\n" + head + "end_step() noexcept {\n" +
                       unless_failed() + calls.commit + "    ++steps_;\n    return true;\n}\n\nvoid " +
                       class_ + "::pass(std::int64_t steps) noexcept {\n    steps_ += steps;\n" + passed +
                       "}\n\n";
    const bool has_states = has_continuous_states();
    text += "" + class_ + "::Real* " + class_ + "::continuous_states() noexcept { return " +
            (has_states ? "bf::generated::elements<Real>(continuous)" : "nullptr") + "; }\n" + class_ +
            "::Real* " + class_ + "::rates() noexcept { return " +
            (has_states ? "bf::generated::elements<Real>(rates_)" : "nullptr") + "; }\n\n";
    text += head + "compute_rates(Real at) noexcept { return !failure_ && " +
            (has_states ? "evaluate(at) && " + called(calls.derivatives) : std::string("at == at")) +
            "; }\n\n";
    if (guards_.empty())
        text += head + "compute_crossings(Real, Real*) noexcept { return true; }\n\n";
    else
        text += head + "compute_crossings(Real at, Real* values) noexcept {\n" + at +
                "    bf::generated::forget(bf::generated::elements<Real>(guards_), " + guards +
                ");\n    if (!(" + called(calls.inside.empty() ? calls.again : calls.inside) + ") || !(" +
                called(calls.guards) + ")) return false;\n    for (int i = 0; i < " + guards +
                "; ++i) values[i] = bf::generated::elements<Real>(guards_)[i];\n    return true;\n}\n\n";
    text += head + "compute_signals(Real at) noexcept {\n" + at + again + copies + "    return true;\n}\n\n";
    text += head + "answer(Real at) noexcept {\n" + at + again + answers + copies + "    return true;\n}\n\n";
    for (const auto& field : continuous_) rows += "        " + table_row(field.path, field.end).substr(4);
    text += "bf::generated::Quantities " + class_ + "::continuous_table() noexcept {\n";
    if (rows.empty()) return text + "    return {nullptr, 0};\n}\n\n";
    return text +
           "    using bf::generated::Type;\n    using bf::generated::Where;\n"
           "    static constexpr bf::generated::Quantity rows[] = {\n" +
           rows + "    };\n    return {rows, static_cast<int>(sizeof rows / sizeof rows[0])};\n}\n\n";
}

} // namespace bf::codegen

// Names of the model's quantities, and what changes with its variables.
#include "generator.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace bf::codegen {

std::string unit_text(const Slot& slot) {
    return slot.unit.kind == Unit::Kind::exact && slot.unit.text != "1" ? std::string(slot.unit.text) : "";
}

std::string about(const std::string& what, const std::string& unit, const std::string& doc) {
    return comment(what + (unit.empty() ? "" : " [" + unit + "]") + (doc.empty() ? "" : ": " + doc));
}

/// The last members of a row; by default everything is allowed, and no element has a name.
static std::string last_members(const Limits& limits, const std::string& elements = {}, int at_least = -1) {
    std::string last;
    if (at_least >= 0) last = ", " + number(at_least);
    if (!elements.empty() || at_least >= 0) last = ", " + literal(elements) + last;
    if (!limits.are_given()) return last.empty() ? "" : ", {}" + last;
    const auto bound = [](double x) {
        if (std::isinf(x)) return std::string(x < 0 ? "-" : "") + "bf::kernels::Limits::infinity";
        return literal(x, Type::float64);
    };
    return ", {" + bound(limits.minimum) + ", " + bound(limits.above) + ", " + bound(limits.maximum) + "}" +
           last;
}

std::string Generator::table_row(const std::string& name, const Node::End& end) const {
    return table_row(name, end, place_of(end), unit_text(diagram_.slot(end)), diagram_.slot(end).doc);
}

std::string Generator::table_row(const std::string& name, const Node::End& end, const Place& place,
                                 const std::string& unit, const std::string& doc) const {
    const Slot& slot = diagram_.slot(end);
    std::string structure = place.structure == "continuous" ? "continuousStates" : place.structure;
    structure[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(structure[0])));
    const auto least = std::find_if(parameters_.begin(), parameters_.end(), [&](const Field& field) {
        return field.end.node == end.node && field.end.slot == slot.at_least;
    });
    const int at_least =
        least == parameters_.end() ? -1 : static_cast<int>(std::distance(parameters_.begin(), least));
    return "    {" + literal(name) + ", " + literal(unit) + ", " + literal(doc) +
           ", Type::" + enumerator(type_of(slot)) + ", Where::" + place.structure + ", " +
           number(slot.size.rows) + ", " + number(slot.size.cols) + ", offsetof(" + class_ +
           "::" + structure + ", " + place.member + "), " + number(formula_of(name)) +
           last_members(slot.limits, diagram_.element_lines(end), at_least) + "},\n";
}

int Generator::formula_of(const std::string& name) const {
    const auto found = formula_numbers_.find(name);
    return found == formula_numbers_.end() ? -1 : found->second;
}

std::string Generator::variables_structure() const {
    if (!has_variables()) return "";
    std::string text =
        "    /// Of the model; parameters follow from them. Change them by set_parameter.\n    struct "
        "Variables {\n";
    for (const auto& field : formulas_.variables) {
        const auto& d = definition(field.definition);
        std::string list;
        for (matlab::Index i = 0; i < d.value.numel(); ++i)
            list += (i ? ", " : "") + literal(d.value[i], Type::float64);
        text += d.value.is_scalar()
                    ? "        double " + field.member + " = " + list + ";"
                    : "        bf::generated::Matrix<double, " + std::to_string(d.value.rows()) + ", " +
                          std::to_string(d.value.cols()) + "> " + field.member + " = {{" + list + "}};";
        text += " ///< " + about(d.path + (d.text.empty() ? "" : " = " + d.text), d.unit, d.doc) + "\n";
    }
    return text + "    };\n\n";
}

std::vector<Guarded> Generator::follow() const {
    std::map<int, std::string> members;
    for (const auto& field : formulas_.variables) members[field.definition] = "variables." + field.member;
    Guarded all{};
    for (const auto& formula : formulas_.formulas) {
        const auto& d = definition(formula.definition);
        const std::string target =
            d.kind == Definition::Kind::variable ? members.at(formula.definition) : place_of(d.end).text();
        all.statements.push_back(
            {"// " + comment(d.path) + " = " + comment(d.text) +
             "\nif (bf::generated::Formula f; !given_.is[" + number(formula_of(d.path)) + "] && !f.write(" +
             target + ", " + formula.code + "))\n    return fail(\"\", " +
             literal("'" + d.path + "', which follows, is not defined for these values") + ");\n"});
    }
    return {all};
}

std::string Generator::fixed_rows() const {
    std::string rows;
    const auto row = [&](const std::string& name, const std::string& reason) {
        rows += "    {" + literal(name) + ", " + literal(reason) + "},\n";
    };
    row("step", "it is the period of the generated code");
    row("stop", "give it as --stop");
    for (const auto& [name, reason] : formulas_.fixed) row(name, reason);
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n)
        if (!is_hosted(static_cast<int>(n)))
            for (const auto& [name, value] : diagram_.nodes[n].arguments)
                row(diagram_.nodes[n].path + "." + name,
                    "it is an argument, which the code was generated for");
    return rows;
}

std::vector<SignalName> Generator::recorded_rows() const {
    std::vector<SignalName> rows;
    std::unordered_set<std::string> seen;
    for (const auto& signal : diagram_.recorded())
        if (!place_of(signal.end).member.empty() && seen.insert(signal.path).second) rows.push_back(signal);
    return rows;
}

std::string Generator::tables() const {
    const auto& d = diagram_;
    std::string parameters, inputs, outputs, recorded, checks, variables;
    for (const auto& field : formulas_.variables) {
        const auto& v = definition(field.definition);
        variables += "    {" + literal(v.path) + ", " + literal(v.unit) + ", " + literal(v.about()) +
                     ", Type::float64, Where::variables, " + std::to_string(v.value.rows()) + ", " +
                     std::to_string(v.value.cols()) + ", offsetof(" + class_ + "::Variables, " +
                     field.member + "), " + number(formula_of(v.path)) + last_members(v.limits) + "},\n";
    }
    for (const auto& field : parameters_) parameters += table_row(field.path, field.end);
    for (const auto& input : d.inputs)
        if (!place_of(input.end).member.empty()) inputs += table_row(input.path, input.end);
    for (const auto& output : outputs_)
        outputs += table_row(output.path, output.end, {"outputs", output.member}, output.unit, output.doc);
    for (const auto& signal : recorded_rows()) recorded += table_row(signal.path, signal.end);
    for (const auto& check : d.checks())
        if (d.slot(check.end).size.count() > 0) checks += table_row(check.path, check.end);
    const auto table = [&](const char* name, const std::string& rows) {
        const std::string head = "Quantities " + class_ + "::" + name + "_table() noexcept {\n";
        if (rows.empty()) return head + "    return {nullptr, 0};\n}\n\n";
        return head + "    static constexpr Quantity rows[] = {\n" + indented(rows, 4) +
               "    };\n    return {rows, static_cast<int>(sizeof rows / sizeof rows[0])};\n}\n\n";
    };
    const std::string problem = options_.embedded ? "" : ", outside_";
    return "// Names of the model's quantities.\n#include \"" + file_ +
           ".hpp\"\n\nusing bf::generated::FixedName;\nusing bf::generated::FixedNames;\nusing "
           "bf::generated::NewValue;\nusing "
           "bf::generated::Quantities;\n"
           "using bf::generated::Quantity;\nusing bf::generated::Type;\nusing bf::generated::Where;\n\n" +
           table("parameter", parameters) + table("variable", variables) + "FixedNames " + class_ +
           "::fixed_table() noexcept {\n    static constexpr FixedName rows[] = {\n" +
           indented(fixed_rows(), 4) +
           "    };\n    return {rows, static_cast<int>(sizeof rows / sizeof rows[0])};\n}\n\nconst "
           "Quantity* " +
           class_ +
           "::find_parameter(const char* name) noexcept {\n    const Quantity* found = "
           "parameter_table().find(name);\n    return found ? found : variable_table().find(name);\n}\n\n" +
           table("input", inputs) + table("output", outputs) + table("recorded", recorded) +
           table("check", checks) + "void* " + class_ +
           "::data(const Quantity& quantity) noexcept {\n"
           "    return const_cast<void*>(static_cast<const " +
           class_ +
           "*>(this)->data(quantity));\n}\n\n"
           "const void* " +
           class_ +
           "::data(const Quantity& quantity) const noexcept {\n"
           "    const void* structure = quantity.where == Where::inputs       ? static_cast<const "
           "void*>(&inputs)\n"
           "                            : quantity.where == Where::outputs    ? static_cast<const "
           "void*>(&outputs)\n"
           "                            : quantity.where == Where::parameters ? static_cast<const "
           "void*>(&parameters)\n" +
           (has_variables() ? "                            : quantity.where == Where::variables ? "
                              "static_cast<const void*>(&variables)\n"
                            : "") +
           "                            : quantity.where == Where::signals    ? static_cast<const "
           "void*>(&signals)\n" +
           (has_continuous_states() ? "                            : quantity.where == Where::continuous ? "
                                      "static_cast<const void*>(&continuous)\n"
                                    : "") +
           "                                                                  : static_cast<const "
           "void*>(&states);\n"
           "    return static_cast<const char*>(structure) + quantity.offset;\n}\n\n"
           "const char* " +
           class_ +
           "::set_parameter(const char* name, const double* values, int count) noexcept {\n"
           "    const NewValue change{name, values, count};\n    return set_parameters(&change, 1);\n}\n\n"
           "const char* " +
           class_ +
           "::set_parameters(const NewValue* changes, int count) noexcept {\n"
           "    if (const char* wrong = bf::generated::check_changes(*this, changes, count" +
           problem +
           "))\n        return wrong;\n"
           "    previous_ = parameters;\n" +
           (has_variables() ? "    previous_variables_ = variables;\n" : "") +
           (formulas_.formulas.empty() ? "" : "    previous_given_ = given_;\n") +
           "    for (int i = 0; i < count; ++i) {\n"
           "        const Quantity& quantity = *find_parameter(changes[i].name);\n"
           "        bf::generated::write_all(data(quantity), quantity, changes[i].values, "
           "changes[i].count);\n" +
           (formulas_.formulas.empty()
                ? ""
                : "        if (quantity.formula >= 0) given_.is[quantity.formula] = true;\n") +
           "    }\n"
           "    const char* const before = failure_;\n"
           "    const char* const block = failed_block_;\n"
           "    const auto check = [this]() -> const char* {\n"
           "        if (!follow()) return failure_;\n"
           "        if (const char* wrong = bf::generated::check_following(*this" +
           problem +
           "))\n            return wrong;\n"
           "        return bf::generated::check_order(\n            parameter_table(), [this](const "
           "Quantity& "
           "quantity) { return data(quantity); }" +
           problem +
           ");\n    };\n"
           "    const auto recompute = [this]() -> const char* {\n"
           "        return is_initialized_ && !compute_constants() ? failure_ : nullptr;\n    };\n"
           "    const auto restore = [this] {\n        parameters = previous_;\n" +
           (has_variables() ? "        variables = previous_variables_;\n" : "") +
           (formulas_.formulas.empty() ? "" : "        given_ = previous_given_;\n") +
           "    };\n"
           "    const char* const wrong = bf::kernels::keep_or_restore(check, recompute, restore);\n"
           "    if (!wrong) return nullptr;\n"
           "    failure_ = before;\n"
           "    failed_block_ = block;\n"
           "    return wrong;\n}\n";
}

} // namespace bf::codegen

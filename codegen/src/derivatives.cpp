// The functions of a model on numbers with derivatives.
#include "generator.hpp"
#include "names.hpp"
#include "texts.hpp"

#include <algorithm>
#include <optional>
#include <set>

namespace bf::codegen {

namespace {

/// The functions that an expression calls, "a() && b()"; nothing for one of another form.
std::optional<std::vector<std::string>> called(const std::string& expression) {
    std::vector<std::string> names;
    if (expression == "true" || expression.empty()) return names;
    const std::string separator = "() && ", text = expression + " && ";
    for (std::size_t at = 0; at < text.size();) {
        const auto end = text.find(separator, at);
        if (end == std::string::npos) return std::nullopt;
        names.push_back(text.substr(at, end - at));
        if (names.back().find_first_of(" (!?") != std::string::npos) return std::nullopt;
        at = end + separator.size();
    }
    return names;
}

/// Those of bf/codegen/on_numbers.hpp, which says what they are on numbers.
const std::set<std::string>& known_functions() {
    static const std::set<std::string> all = [] {
        std::set<std::string> found;
        const std::string text(text_of_header("bf/codegen/on_numbers.hpp")), begin = "\nBF_ON_NUMBERS(";
        for (auto at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
            const auto first = at + begin.size();
            found.insert(text.substr(first, text.find(')', first) - first));
        }
        return found;
    }();
    return all;
}

/// Is the body made of equations alone, whose functions have derivatives?
bool has_derivative(const std::string& body) {
    for (const char* other :
         {"kernels::", "call(", "hosted_->", "control_.", "guards_.", "static_cast<", "std::", "elements<",
          "has_crossed(", "has_edge<", "is_finite(", "is_positive("})
        if (body.find(other) != std::string::npos) return false;
    const std::string begin = "math::";
    for (auto at = body.find(begin); at != std::string::npos; at = body.find(begin, at + 1)) {
        const auto first = at + begin.size();
        if (!known_functions().contains(body.substr(first, body.find_first_of("(<", first) - first)))
            return false;
    }
    return true;
}

} // namespace

/// Empty where some of what goes on between two steps is no equation.
std::string Generator::derivatives_source(const std::vector<std::string>& places) const {
    if (!has_model_exchange() || is_split() || real() != Type::float64) return {};
    const auto all = called(calls_.outputs), again = called(calls_.again), inside = called(calls_.inside),
               rates = called(calls_.derivatives);
    if (!all || !again || !inside || !rates) return {};
    std::vector<std::string> names;
    for (const auto& name : *all)
        if (std::count(again->begin(), again->end(), name) +
                std::count(inside->begin(), inside->end(), name) >
            0)
            names.push_back(name);
    for (const auto* list : {&*again, &*inside})
        for (const auto& name : *list)
            if (!std::count(names.begin(), names.end(), name)) return {};
    names.insert(names.end(), rates->begin(), rates->end());
    if (names.empty()) return {};

    std::string functions, declarations, joined;
    for (const auto& name : names) {
        const std::string head = "bool " + class_ + "::" + name + "() noexcept {\n";
        const auto piece = std::find_if(pieces_.begin(), pieces_.end(), [&](const std::string& text) {
            return text.find(head) != std::string::npos;
        });
        if (piece == pieces_.end()) return {};
        const std::string body = piece->substr(piece->find(head) + head.size());
        if (!has_derivative(body)) return {};
        functions += "\nbool OnNumbers::" + name + "() noexcept {\n" + body;
        declarations += "    bool " + name + "() noexcept;\n";
        joined += (joined.empty() ? "" : " && ") + name + "()";
    }
    std::string structures, members, copies, outputs;
    const auto add = [&](const std::string& name, const std::string& member, const std::vector<Field>& fields,
                         bool is_copied) {
        structures += "    struct " + name + " {\n";
        for (const auto& field : fields) {
            const Slot& slot = *field.slot;
            const std::string type = slot.type == Type::float64 ? "Number" : cpp_name(slot.type);
            structures +=
                "        " +
                (slot.size.cols != 1 ? "bf::generated::Matrix<" + type + ", " + number(slot.size.rows) +
                                           ", " + number(slot.size.cols) + "> " + field.member
                 : is_one_number(slot) ? type + " " + field.member
                                       : type + " " + field.member + "[" + number(slot.size.rows) + "]") +
                ";\n";
            if (is_copied)
                copies += "        copy(" + member + "." + field.member + ", from." + member + "." +
                          field.member + ");\n";
        }
        structures += "    };\n";
        members += "    " + name + " " + member + ";\n";
    };
    add("Inputs", "inputs", inputs_, true);
    add("Outputs", "outputs", outputs_, false);
    add("Parameters", "parameters", parameters_, true);
    add("Signals", "signals", signals_, true);
    add("States", "states", states_, true);
    if (has_continuous_states()) {
        add("ContinuousStates", "continuous", continuous_, true);
        members += "    ContinuousStates rates_;\n";
    }
    if (!workspace_.empty()) add("Workspace", "workspace_", workspace_, false);
    for (const auto& field : outputs_) outputs += "        " + copy_of(field);
    std::string rows = "-1"; // the time
    for (const auto& place : places)
        rows += place.empty() ? ", -1" : ",\n    std::ptrdiff_t(offsetof(OnNumbers, " + place + "))";
    return "// " + comment(diagram_.name) +
           ": what goes on between two steps, on numbers with derivatives.\n#include "
           "\"bf/codegen/on_numbers.hpp\"\n#include \"" +
           file_ +
           ".hpp\"\n\n// Compiling it better would take longer than it is ever at work.\n"
           "#ifdef __GNUC__\n#pragma GCC optimize(\"O1\")\n#endif\n\nnamespace {\n\nusing "
           "bf::generated::assign;\nusing "
           "bf::generated::on_numbers::copy;\nusing bf::generated::on_numbers::Number;\nnamespace math = "
           "bf::generated::on_numbers::math;\n\nstruct OnNumbers {\n    using Real = Number;\n    static "
           "constexpr double period = " +
           class_ + "::period;\n    static const std::ptrdiff_t places[];\n" + structures + "\n" + members +
           "    Number time_;\n\n    void begin(const " + class_ +
           "& from, double at) noexcept {\n        time_ = at;\n" + copies +
           "    }\n    bool compute() noexcept {\n        if (!(" + joined + ")) return false;\n" + outputs +
           "        return true;\n    }\n    bool fail(const char*, const char*) noexcept { return false; "
           "}\n" +
           declarations + "};\n\nconst std::ptrdiff_t OnNumbers::places[] = {" + rows + "};\n" + functions +
           "\n} // namespace\n\nnamespace bf::generated {\nextern const FmuDerivatives fmu_derivatives;\n"
           "const FmuDerivatives fmu_derivatives{OnNumbers::places, &on_numbers::compute<" +
           class_ + ", OnNumbers>};\n} // namespace bf::generated\n";
}

} // namespace bf::codegen

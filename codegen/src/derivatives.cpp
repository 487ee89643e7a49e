// The functions of a model on numbers with derivatives.
#include "generator.hpp"
#include "names.hpp"

#include <algorithm>

namespace bf::codegen {

/// Empty where some of what goes on between two steps is no equation.
std::string Generator::derivatives_source(const std::vector<std::string>& places) const {
    if (!is_fmu_ || is_split() || real() != Type::float64) return {};
    PieceNumbers between = calls_.between;
    between.insert(between.end(), calls_.derivatives.begin(), calls_.derivatives.end());
    if (between.empty()) return {};

    std::string functions, declarations;
    for (const int number : between) {
        const Piece& piece = pieces_[static_cast<std::size_t>(number)];
        if (!piece.is_differentiable) return {};
        functions +=
            "\nbool OnNumbers::" + piece.name + "() noexcept {\n" + piece.body + "    return true;\n}\n";
        declarations += "    " + declaration_of(piece.name) + "\n";
    }
    std::string structures, members, copies, outputs;
    const auto add = [&](const std::string& name, const std::string& member, const std::vector<Field>& fields,
                         bool is_copied) {
        structures += "    struct " + name + " {\n";
        for (const auto& field : fields) {
            const Slot& slot = *field.slot;
            structures +=
                "        " +
                declared(slot, slot.type == Type::float64 ? "Number" : cpp_name(slot.type), field.member) +
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
           "    }\n    bool compute() noexcept {\n        if (!(" + called(between) + ")) return false;\n" +
           outputs +
           "        return true;\n    }\n    bool fail(const char*, const char*) noexcept { return false; "
           "}\n" +
           declarations + "};\n\nconst std::ptrdiff_t OnNumbers::places[] = {" + rows + "};\n" + functions +
           "\n} // namespace\n\nnamespace bf::generated {\nextern const FmuDerivatives " + file_ +
           "_derivatives;\nconst FmuDerivatives " + file_ +
           "_derivatives{OnNumbers::places, &on_numbers::compute<" + class_ +
           ", OnNumbers>};\n} // namespace bf::generated\n";
}

} // namespace bf::codegen

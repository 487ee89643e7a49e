// The models of an FMU: one, or one for each combination of values of its structural parameters.
#include "bf/codegen/fmu.hpp"

#include "bf/core/hash.hpp"
#include "generator.hpp"
#include "texts.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <span>

namespace bf::codegen {

namespace {

/// The variables that all models have, in the order of the first one's, and what their sizes are.
class CommonVariables {
  public:
    CommonVariables(const std::vector<FmuModel>& models, const FmuChoice& choice, std::vector<FmuPart>& parts)
        : models_(models), names_(choice.structural), parts_(parts), code_(parts.front().code) {
        for (auto& part : parts_) {
            auto& rows = numbers_.emplace_back();
            for (std::size_t i = 0; i < part.code.variables.size(); ++i)
                rows[part.code.variables[i].name] = i;
        }
    }

    void find() {
        for (std::size_t m = 1; m < parts_.size(); ++m) {
            if (parts_[m].clocks != parts_[0].clocks)
                refuse("its clocks are others where " + where(m) + " than where " + where(0) +
                       "; export it without clocks");
            for (const auto& v : parts_[m].code.variables)
                if (!same(0, v))
                    leave_out(v, "is not in the model where " + where(0) + ", or of another type");
        }
        std::vector<FmuVariable> all;
        for (auto& v : code_.variables)
            if (is_in_all(v) && finds(v, &FmuVariable::rows, v.rows_by, "rows") &&
                finds(v, &FmuVariable::cols, v.cols_by, "columns"))
                all.push_back(v);
        for (auto& v : all)
            if (is_parameter(v.role) && !has_one_start(v)) {
                v.role = FmuVariable::Role::calculated;
                v.start.clear();
            }
        if (!code_.has_model_exchange)
            std::erase_if(all, [](const FmuVariable& v) { return is_of_solver(v.role); });
        for (std::size_t m = 0; m < parts_.size(); ++m) {
            auto& part = parts_[m];
            std::vector<std::string> rows;
            for (const auto& v : all) {
                const std::size_t number = numbers_[m].at(v.name);
                // Derivatives are numbered as the variables of each model.
                if (number != rows.size()) code_.has_derivatives = false;
                rows.push_back(v.role == FmuVariable::Role::calculated ? as_calculated(part.rows[number])
                                                                       : part.rows[number]);
            }
            part.rows = std::move(rows);
            code_.has_derivatives = code_.has_derivatives && part.code.has_derivatives;
        }
        code_.variables = std::move(all);
    }

  private:
    [[noreturn]] void refuse(const std::string& why) const {
        throw GenerationError("no FMU with structural parameters can be made of '" +
                              models_[0].diagram->name + "': " + why);
    }
    std::string where(std::size_t m) const {
        std::string text;
        for (std::size_t p = 0; p < names_.size(); ++p)
            text += (p > 0 ? ", " : "") + names_[p] + " = " + std::to_string(models_[m].structure[p]);
        return text;
    }
    /// That variable of a model; null where it has another type or is missing.
    const FmuVariable* same(std::size_t m, const FmuVariable& like) const {
        const auto at = numbers_[m].find(like.name);
        if (at == numbers_[m].end()) return nullptr;
        const auto& v = parts_[m].code.variables[at->second];
        const bool is_same =
            v.role == like.role && v.type == like.type && v.names == like.names && v.clocks == like.clocks;
        return is_same ? &v : nullptr;
    }
    static bool is_of_solver(FmuVariable::Role role) {
        return role == FmuVariable::Role::state || role == FmuVariable::Role::rate ||
               role == FmuVariable::Role::crossings;
    }
    static bool is_parameter(FmuVariable::Role role) {
        return role == FmuVariable::Role::parameter || role == FmuVariable::Role::fixed;
    }
    /// A parameter that follows from structural ones has no start value that could be described.
    bool has_one_start(const FmuVariable& v) const {
        const bool is_sized = v.rows_by >= 0 || v.cols_by >= 0;
        for (std::size_t m = 0; m < parts_.size(); ++m) {
            const auto& start = same(m, v)->start;
            if (is_sized
                    ? std::any_of(start.begin(), start.end(), [&](double x) { return x != v.start.front(); })
                    : start != v.start)
                return false;
        }
        return true;
    }
    static std::string as_calculated(std::string row) {
        for (const std::string setting : {"FmuSetting::always", "FmuSetting::before"})
            if (const auto at = row.find(setting); at != std::string::npos)
                row.replace(at, setting.size(), "FmuSetting::none");
        return row;
    }
    /// What nobody has to know is left out, or model exchange with it; ports must be as FMI wants them.
    void leave_out(const FmuVariable& v, const std::string& why) {
        if (is_of_solver(v.role))
            code_.has_model_exchange = false;
        else if (v.role == FmuVariable::Role::input || v.role == FmuVariable::Role::output)
            refuse("'" + v.name + "' " + why);
    }
    bool is_in_all(const FmuVariable& v) {
        for (std::size_t m = 1; m < parts_.size(); ++m)
            if (!same(m, v)) {
                leave_out(v, "is not in the model where " + where(m) + ", or of another type");
                return false;
            }
        return true;
    }
    /// Which structural parameter is the size? False: none, and it is not constant.
    bool finds(const FmuVariable& v, int FmuVariable::*size, int& by, const char* what) {
        const auto is = [&](auto&& expected) {
            for (std::size_t m = 0; m < parts_.size(); ++m)
                if (same(m, v)->*size != expected(m)) return false;
            return true;
        };
        if (is([&](std::size_t) { return v.*size; })) return true;
        for (std::size_t p = 0; p < names_.size(); ++p)
            if (is([&](std::size_t m) { return static_cast<int>(models_[m].structure[p]); })) {
                by = static_cast<int>(p);
                return true;
            }
        std::string sizes;
        for (std::size_t m = 0; m < parts_.size(); ++m)
            sizes += (m > 0 ? ", " : "") + std::to_string(same(m, v)->*size) + " where " + where(m);
        leave_out(
            v, std::string("has as many ") + what + " as no structural parameter says (" + sizes +
                   "), which FMI 3.0 has no description for (section 2.4.7.2); divide it into parts of such "
                   "sizes");
        return false;
    }

    const std::vector<FmuModel>& models_;
    const std::vector<std::string>& names_;
    std::vector<FmuPart>& parts_;
    FmuCode& code_; ///< of the first one, which becomes that of all
    std::vector<std::map<std::string, std::size_t>> numbers_;
};

/// A constant array, and its name; nothing where it is empty.
std::string table(const char* type, const std::string& name, const std::string& rows) {
    return rows.empty() ? ""
                        : std::string("static constexpr ") + type + " " + name + "[] = {" + rows + "};\n";
}
const char* name_of(const std::string& rows, const char* name) { return rows.empty() ? "nullptr" : name; }

} // namespace

FmuCode generate_fmu(const std::vector<FmuModel>& models, const FmuChoice& choice) {
    std::vector<FmuPart> parts;
    for (const auto& model : models)
        parts.push_back(
            Generator(*model.diagram, model.options, program::Integrator::caller).fmu(choice, model.folders));
    if (models.size() > 1) CommonVariables(models, choice, parts).find();

    FmuCode code = std::move(parts.front().code);
    for (std::size_t m = 1; m < parts.size(); ++m) {
        auto& its = parts[m].code;
        code.files.merge(its.files);
        for (const auto& plugin : its.plugins)
            if (!std::count(code.plugins.begin(), code.plugins.end(), plugin)) code.plugins.push_back(plugin);
        code.is_hosted = code.is_hosted || its.is_hosted;
        code.uses_standard_blocks = code.uses_standard_blocks || its.uses_standard_blocks;
    }
    std::string declarations, tables, all, names, structure;
    for (std::size_t m = 0; m < parts.size(); ++m) {
        const auto& part = parts[m];
        std::string rows = "\n";
        for (const auto& row : part.rows) rows += row;
        if (part.rows.empty()) rows += "    {bf_run_inputs, 0, FmuSetting::none}, // none: not counted\n";
        const std::string its_rows = "rows_" + std::to_string(m);
        declarations += part.declarations;
        tables += table("bf::generated::FmuVariable", its_rows, rows);
        all += "    {" + part.library + ", " + its_rows + ", " + std::to_string(part.rows.size()) + ", " +
               part.functions + ", " +
               (code.has_derivatives ? "&bf::generated::" + part.derivatives : "nullptr") +
               (part.is_repeatable ? ", true, " : ", false, ") + name_of(part.clocks, "clocks") + ", " +
               std::to_string(code.clocks.size()) + "},\n";
        for (const auto value : models[m].structure) structure += std::to_string(value) + "u, ";
    }
    for (const auto& name : choice.structural) names += literal(name) + ", ";
    const std::string clocks = parts.front().clocks;
    tables += table("bf::generated::FmuClock", "clocks", clocks.empty() ? "" : "\n" + clocks) +
              table("const char*", "parameters", names) + table("std::uint64_t", "structure", structure);

    std::uint64_t hash = fnv1a({});
    for (const auto& [name, text] : code.files) hash = fnv1a(std::as_bytes(std::span(text)), hash);
    hash = fnv1a(std::as_bytes(std::span(tables)), hash);
    char digits[20];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
    code.token = std::string("{bf-") + digits + "}";
    code.files[code.identifier + "_fmu.cpp"] =
        "// " + comment(models.front().diagram->name) + " as an FMU of FMI " +
        std::to_string(choice.version) + ".0.\n#include \"bf/codegen/fmu" + std::to_string(choice.version) +
        ".hpp\"\n" + (code.is_hosted ? "#include \"bf/codegen/fmu_hosted.hpp\"\n" : "") + declarations +
        "\nusing bf::generated::FmuSetting;\n" + tables +
        "static constexpr bf::generated::FmuTables tables[] = {\n" + all +
        "};\nconst bf::generated::FmuModels bf::generated::fmu_models{tables, " +
        std::to_string(parts.size()) + ", " + literal(code.token) + ", " + name_of(names, "parameters") +
        ", " + name_of(structure, "structure") + ", " + std::to_string(choice.structural.size()) + ", " +
        (code.has_model_exchange ? "true" : "false") + "};\n";
    Files headers;
    for (const auto& [name, text] : code.files) {
        if (name.ends_with(".cpp")) code.sources.push_back(name);
        add_headers_of(text, headers);
    }
    // They stand beside the sources, where every importer looks for them.
    for (auto& [name, text] : headers)
        code.files[name.substr(std::string("include/").size())] = std::move(text);
    return code;
}

} // namespace bf::codegen

// Structural parameters of an FMU.
#pragma once

#include "bf/codegen/fmu_variables.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

namespace bf::generated {

/// The values of structural parameters, which choose one of the models: FMI 3.0, section 2.4.7.5.1. They are
/// fixed: written in the Configuration Mode before the initialisation.
class FmuStructure {
  public:
    explicit FmuStructure(const FmuModels& models) : models_(models) { set(first()); }

    bool have_some() const noexcept { return models_.parameter_count > 0; }
    const FmuTables& first() const noexcept { return *models_.first; }
    /// Takes the values of that model.
    void set(const FmuTables& model) {
        const std::uint64_t* const values =
            models_.structure + (&model - models_.first) * models_.parameter_count;
        values_.assign(values, values + models_.parameter_count);
    }

    /// The value of a reference, which follow those of variables and clocks; null for another one.
    std::uint64_t* value(std::uint32_t reference) noexcept {
        const auto first = std::uint32_t(models_.first->variable_count + models_.first->clock_count) + 1;
        return reference >= first && reference - first < values_.size() ? &values_[reference - first]
                                                                        : nullptr;
    }

    /// Has one of the models that value? False, with the reason, where none has.
    bool has(const std::uint64_t* parameter, std::uint64_t value, Problem& problem) const {
        const auto p = int(parameter - values_.data());
        std::set<std::uint64_t> known;
        for (int m = 0; m < models_.count; ++m)
            known.insert(models_.structure[m * models_.parameter_count + p]);
        if (known.count(value) > 0) return true;
        std::string all;
        for (const auto one : known) all += (all.empty() ? "" : ", ") + std::to_string(one);
        std::snprintf(problem.text, sizeof problem.text, "'%s' cannot be %s: the FMU was exported for %s",
                      models_.parameters[p], std::to_string(value).c_str(), all.c_str());
        return false;
    }
    /// The model of these values; null, with the reason, where there is none.
    const FmuTables* chosen(Problem& problem) const {
        std::set<std::vector<std::uint64_t>> all;
        for (int m = 0; m < models_.count; ++m) {
            const std::uint64_t* const its = models_.structure + m * models_.parameter_count;
            if (std::equal(values_.begin(), values_.end(), its)) return models_.first + m;
            all.emplace(its, its + models_.parameter_count);
        }
        std::string known;
        for (const auto& its : all) known += (known.empty() ? "" : "; ") + text(its.data());
        std::snprintf(problem.text, sizeof problem.text, "it was exported for no %s, but for: %s",
                      text(values_.data()).c_str(), known.c_str());
        return nullptr;
    }

  private:
    std::string text(const std::uint64_t* values) const {
        std::string all;
        for (int p = 0; p < models_.parameter_count; ++p)
            all +=
                (p > 0 ? ", " : "") + std::string(models_.parameters[p]) + " = " + std::to_string(values[p]);
        return all;
    }

    const FmuModels& models_;
    std::vector<std::uint64_t> values_;
};

} // namespace bf::generated

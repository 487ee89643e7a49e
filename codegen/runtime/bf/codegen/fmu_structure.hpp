// Structural parameters of an FMU.
#pragma once

#include "bf/codegen/fmu_variables.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
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

    /// The model of these values; null, with the reason, where there is none.
    const FmuTables* chosen(Problem& problem) const {
        std::string known;
        for (int m = 0; m < models_.count; ++m) {
            const std::uint64_t* const its = models_.structure + m * models_.parameter_count;
            if (std::equal(values_.begin(), values_.end(), its)) return models_.first + m;
            known += (known.empty() ? "" : "; ") + text(its);
        }
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

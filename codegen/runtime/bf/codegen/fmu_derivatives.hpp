// Directional and adjoint derivatives of an FMU.
#pragma once

#include "bf/codegen/fmu_instance.hpp"

#include <algorithm>
#include <vector>

namespace bf::generated {

using FmuElements = std::vector<FmuElement>;

/// Elements of a call, which has `values` numbers for them; false, with a message, where one has no
/// derivative.
inline bool are_differentiable(FmuInstance& instance, const char* function, const FmuElements& elements,
                               std::size_t values) {
    if (!instance.tables().derivatives) return instance.fail("derivatives of this model are not known");
    for (const auto& e : elements)
        if (instance.tables().derivatives->places[e.variable] < 0) {
            instance.message(FmuInstance::Level::error, "logStatusError",
                             "%s: '%s' has no derivative: states, their derivatives, inputs, outputs and "
                             "local variables of 64 bits have one",
                             function, instance.variables.variable(std::uint32_t(e.variable))->name);
            return false;
        }
    if (elements.size() == values) return true;
    instance.message(FmuInstance::Level::error, "logStatusError", "%s: the variables have not %zu elements",
                     function, values);
    return false;
}

/// Changes of all unknowns with those of some knowns, whose seeds have a number for each direction.
inline bool differentiate(FmuInstance& instance, const FmuElement* knowns, std::size_t known_count,
                          const double* seeds, const FmuElements& unknowns, double* changes) {
    if (instance.is_in_step())
        return instance.fail("derivatives are those between two steps of the model, and one is under way");
    return instance.is_reached() && (instance.tables().derivatives->compute(
                                         instance.model(), instance.instant(), knowns, seeds,
                                         int(known_count), unknowns.data(), changes, int(unknowns.size())) ||
                                     instance.fail("the model fails here"));
}

/// Δunknown = Σ ∂unknown/∂known Δknown: FMI 3.0, section 2.2.11.
inline bool directional(FmuInstance& instance, const FmuElements& knowns, const FmuElements& unknowns,
                        const double* seed, double* change) {
    constexpr auto lanes = std::size_t(FmuDerivatives::directions);
    std::vector<double> seeds(lanes * knowns.size()), changes(lanes * unknowns.size());
    for (std::size_t k = 0; k < knowns.size(); ++k) seeds[lanes * k] = seed[k];
    if (!differentiate(instance, knowns.data(), knowns.size(), seeds.data(), unknowns, changes.data()))
        return false;
    for (std::size_t u = 0; u < unknowns.size(); ++u) change[u] = changes[lanes * u];
    return true;
}

/// Δknownᵀ = Δunknownᵀ ∂unknown/∂known, known by known: FMI 3.0, section 2.2.11.
inline bool adjoint(FmuInstance& instance, const FmuElements& knowns, const FmuElements& unknowns,
                    const double* seed, double* change) {
    constexpr auto lanes = std::size_t(FmuDerivatives::directions);
    std::vector<double> changes(lanes * unknowns.size());
    double seeds[lanes * lanes] = {}; // a direction for each of so many
    for (std::size_t d = 0; d < lanes; ++d) seeds[lanes * d + d] = 1;
    for (std::size_t first = 0; first < knowns.size(); first += lanes) {
        const std::size_t count = std::min(lanes, knowns.size() - first);
        if (!differentiate(instance, knowns.data() + first, count, seeds, unknowns, changes.data()))
            return false;
        for (std::size_t d = 0; d < count; ++d) {
            change[first + d] = 0;
            for (std::size_t u = 0; u < unknowns.size(); ++u)
                change[first + d] += seed[u] * changes[lanes * u + d];
        }
    }
    return true;
}

} // namespace bf::generated

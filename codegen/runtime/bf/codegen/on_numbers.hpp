// What the functions of a model call where they run on numbers with derivatives, and how changes come in and
// go out.
#pragma once

#include "bf/codegen/differentiable.hpp"
#include "bf/codegen/fmu_variables.hpp"
#include "bf/codegen/math.hpp"
#include "bf/codegen/views.hpp"
#include "bf/core/dual_kernels.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace bf::generated {
template <> inline constexpr bool is_one_number<Dual<FmuDerivatives::directions>> = true;
}

namespace bf::generated::on_numbers {

using Number = Dual<FmuDerivatives::directions>;

/// The functions of `math` that have derivatives, where such numbers meet literals.
namespace math {
#define BF_ON_NUMBERS(name)                                                                                  \
    template <class... T> auto name(const T&... x) noexcept {                                                \
        using Common = std::common_type_t<T...>;                                                             \
        return generated::math::name(Common(x)...);                                                          \
    }
BF_DIFFERENTIABLE_FUNCTIONS(BF_ON_NUMBERS)
#undef BF_ON_NUMBERS
} // namespace math

// Values that do not change. A model has thousands of them, which in line would take long to compile.
[[gnu::noinline]] inline void copy(Number& to, double from) noexcept { to = from; }
template <class T> std::enable_if_t<std::is_scalar_v<T>> copy(T& to, const T& from) noexcept { to = from; }
template <class To, class T, int N> void copy(To (&to)[N], const T (&from)[N]) noexcept {
    for (int i = 0; i < N; ++i) copy(to[i], from[i]);
}
template <class To, class T, int R, int C>
void copy(Matrix<To, R, C>& to, const Matrix<T, R, C>& from) noexcept {
    copy(to.data, from.data);
}

/// FmuDerivatives::compute of a model by its functions on numbers.
template <class Model, class OnNumbers>
bool compute(bf_run_model* model, double at, const FmuElement* knowns, const double* seeds, int known_count,
             const FmuElement* unknowns, double* changes, int unknown_count) {
    const auto its = std::make_unique<OnNumbers>();
    its->begin(*reinterpret_cast<const Model*>(model), at);
    const auto number = [&](const FmuElement& e) -> Number& {
        return reinterpret_cast<Number*>(reinterpret_cast<char*>(its.get()) +
                                         OnNumbers::places[e.variable])[e.element];
    };
    constexpr int lanes = FmuDerivatives::directions;
    for (int k = 0; k < known_count; ++k)
        std::copy_n(seeds + lanes * k, lanes, number(knowns[k]).slope.begin());
    if (!its->compute()) return false;
    for (int u = 0; u < unknown_count; ++u)
        std::copy_n(number(unknowns[u]).slope.begin(), lanes, changes + lanes * u);
    return true;
}

} // namespace bf::generated::on_numbers

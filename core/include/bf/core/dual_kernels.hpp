// Kernels on numbers with derivatives. C++17: exported FMUs carry a copy of this file.
#pragma once

#include "bf/base/dual.hpp"
#include "bf/kernels/expression.hpp"
#include "bf/kernels/functions.hpp"

#include <cmath>

namespace bf::kernels {

template <> inline constexpr bool is_real<Dual<4>> = true;
template <> inline const Dual<4> pi<Dual<4>>{pi<double>};
template <> inline Dual<4> opaque<Dual<4>>(Dual<4> x) noexcept { return x; }
/// Without its short cuts for some exponents, which may depend on something, too.
template <> inline Dual<4> power<Dual<4>>(Dual<4> x, Dual<4> e) noexcept { return pow(x, e); }

// These name the functions of the standard library.
#define BF_FUNCTION(kernel, result)                                                                          \
    template <> inline Dual<4> kernel::apply<Dual<4>>(Dual<4> x) noexcept { return result; }
BF_FUNCTION(Sqrt, sqrt(x))
BF_FUNCTION(SignedSqrt, x.value < 0 ? -sqrt(-x) : sqrt(x))
BF_FUNCTION(ReciprocalSqrt, 1 / sqrt(x))
BF_FUNCTION(Exp, exp(x))
BF_FUNCTION(Log, log(x))
BF_FUNCTION(Log10, log10(x))
BF_FUNCTION(Pow10, pow(Dual<4>(10), x))
BF_FUNCTION(Sin, sin(x))
BF_FUNCTION(Cos, cos(x))
BF_FUNCTION(Tan, tan(x))
BF_FUNCTION(Asin, asin(x))
BF_FUNCTION(Acos, acos(x))
BF_FUNCTION(Atan, atan(x))
BF_FUNCTION(Sinh, sinh(x))
BF_FUNCTION(Cosh, cosh(x))
BF_FUNCTION(Tanh, tanh(x))
BF_FUNCTION(Asinh, asinh(x))
BF_FUNCTION(Acosh, acosh(x))
BF_FUNCTION(Atanh, atanh(x))
BF_FUNCTION(Floor, floor(x))
BF_FUNCTION(Ceil, ceil(x))
BF_FUNCTION(Round, round(x))
BF_FUNCTION(Fix, trunc(x))
BF_FUNCTION(Sign, sign(x))
#undef BF_FUNCTION
template <> inline Dual<4> Atan2::apply<Dual<4>>(Dual<4> y, Dual<4> x) noexcept { return atan2(y, x); }
template <> inline Dual<4> Hypot::apply<Dual<4>>(Dual<4> a, Dual<4> b) noexcept { return hypot(a, b); }

/// Of formulas: comparisons and roundings have no derivative.
template <> inline Dual<4> value_of<Dual<4>>(Operation operation, Dual<4> x) noexcept {
    switch (operation) {
    case Operation::negative: return -x;
    case Operation::abs: return fabs(x);
    case Operation::sign: return sign(x);
    case Operation::floor: return floor(x);
    case Operation::ceil: return ceil(x);
    case Operation::round: return round(x);
    case Operation::fix: return trunc(x);
    case Operation::sqrt: return sqrt(x);
    case Operation::exp: return exp(x);
    case Operation::log: return log(x);
    case Operation::log10: return log10(x);
    case Operation::sin: return sin(x);
    case Operation::cos: return cos(x);
    case Operation::tan: return tan(x);
    case Operation::asin: return asin(x);
    case Operation::acos: return acos(x);
    case Operation::atan: return atan(x);
    case Operation::sinh: return sinh(x);
    case Operation::cosh: return cosh(x);
    case Operation::tanh: return tanh(x);
    case Operation::asinh: return asinh(x);
    case Operation::acosh: return acosh(x);
    case Operation::atanh: return atanh(x);
    case Operation::expm1: return expm1(x);
    case Operation::log1p: return log1p(x);
    case Operation::log2: return log2(x);
    case Operation::deg2rad: return pi<double> / 180 * x;
    case Operation::rad2deg: return 180 / pi<double> * x;
    default: return value_of(operation, x.value);
    }
}

} // namespace bf::kernels

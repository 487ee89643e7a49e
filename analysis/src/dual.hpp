// Numbers with a derivative: forward differentiation through the kernels themselves.
#pragma once

#include "bf/core/named_kernels.hpp"

#include <cmath>
#include <limits>

namespace bf::analysis {

/// x + x' ε with ε² = 0, so that f(x + x' ε) = f(x) + f'(x) x' ε. Comparisons look at x alone: at a corner
/// the derivative is that of the side on which the kernel computes. Source: Griewank and Walther, Evaluating
/// Derivatives, 2nd ed., §3.1.
class Dual {
  public:
    double value, slope;

    /// Has a comparison, or a rounding, been right where its answer changes? Then there is a jump or corner.
    static inline thread_local bool is_at_corner = false;

    Dual(double number = 0, double derivative = 0) : value(number), slope(derivative) {}
    explicit operator bool() const { return value != 0; }
    explicit operator int() const { return static_cast<int>(value); }

    friend Dual operator-(const Dual& x) { return {-x.value, -x.slope}; }
    friend Dual operator+(const Dual& x, const Dual& y) { return {x.value + y.value, x.slope + y.slope}; }
    friend Dual operator-(const Dual& x, const Dual& y) { return {x.value - y.value, x.slope - y.slope}; }
    friend Dual operator*(const Dual& x, const Dual& y) {
        return {x.value * y.value, x.slope * y.value + x.value * y.slope};
    }
    friend Dual operator/(const Dual& x, const Dual& y) {
        const double q = x.value / y.value;
        return {q, (x.slope - q * y.slope) / y.value};
    }
    friend Dual& operator+=(Dual& x, const Dual& y) { return x = x + y; }
    friend Dual& operator-=(Dual& x, const Dual& y) { return x = x - y; }
    friend Dual& operator*=(Dual& x, const Dual& y) { return x = x * y; }
    friend Dual& operator/=(Dual& x, const Dual& y) { return x = x / y; }
    friend bool operator<(const Dual& x, const Dual& y) { return x.meets(y), x.value < y.value; }
    friend bool operator>(const Dual& x, const Dual& y) { return x.meets(y), x.value > y.value; }
    friend bool operator<=(const Dual& x, const Dual& y) { return x.meets(y), x.value <= y.value; }
    friend bool operator>=(const Dual& x, const Dual& y) { return x.meets(y), x.value >= y.value; }
    friend bool operator==(const Dual& x, const Dual& y) { return x.value == y.value; }
    friend bool operator!=(const Dual& x, const Dual& y) { return x.value != y.value; }

    // What kernels call of <cmath>.
    friend Dual floor(const Dual& x) { return x.meets(std::floor(x.value)), std::floor(x.value); }
    friend Dual ceil(const Dual& x) { return x.meets(std::ceil(x.value)), std::ceil(x.value); }
    friend Dual round(const Dual& x) {
        return x.meets(std::trunc(x.value) + std::copysign(0.5, x.value)), std::round(x.value);
    }
    friend Dual trunc(const Dual& x) {
        if (x.value != 0) x.meets(std::trunc(x.value));
        return std::trunc(x.value);
    }
    friend Dual fabs(const Dual& x) { return x < 0 ? -x : x; }
    friend Dual sign(const Dual& x) { return x > 0 ? 1 : x < 0 ? -1 : x.value; }
    friend Dual sqrt(const Dual& x) { return x.through(std::sqrt(x.value), 0.5 / std::sqrt(x.value)); }
    friend Dual exp(const Dual& x) { return x.through(std::exp(x.value), std::exp(x.value)); }
    friend Dual expm1(const Dual& x) { return x.through(std::expm1(x.value), std::exp(x.value)); }
    friend Dual log(const Dual& x) { return x.through(std::log(x.value), 1 / x.value); }
    friend Dual log1p(const Dual& x) { return x.through(std::log1p(x.value), 1 / (1 + x.value)); }
    friend Dual log2(const Dual& x) { return x.through(std::log2(x.value), 1 / (x.value * std::log(2.0))); }
    friend Dual log10(const Dual& x) {
        return x.through(std::log10(x.value), 1 / (x.value * std::log(10.0)));
    }
    friend Dual sin(const Dual& x) { return x.through(std::sin(x.value), std::cos(x.value)); }
    friend Dual cos(const Dual& x) { return x.through(std::cos(x.value), -std::sin(x.value)); }
    friend Dual tan(const Dual& x) {
        const double t = std::tan(x.value);
        return x.through(t, 1 + t * t);
    }
    friend Dual asin(const Dual& x) {
        return x.through(std::asin(x.value), 1 / std::sqrt(1 - x.value * x.value));
    }
    friend Dual acos(const Dual& x) {
        return x.through(std::acos(x.value), -1 / std::sqrt(1 - x.value * x.value));
    }
    friend Dual atan(const Dual& x) { return x.through(std::atan(x.value), 1 / (1 + x.value * x.value)); }
    friend Dual sinh(const Dual& x) { return x.through(std::sinh(x.value), std::cosh(x.value)); }
    friend Dual cosh(const Dual& x) { return x.through(std::cosh(x.value), std::sinh(x.value)); }
    friend Dual tanh(const Dual& x) {
        const double t = std::tanh(x.value);
        return x.through(t, 1 - t * t);
    }
    friend Dual asinh(const Dual& x) {
        return x.through(std::asinh(x.value), 1 / std::sqrt(1 + x.value * x.value));
    }
    friend Dual acosh(const Dual& x) {
        return x.through(std::acosh(x.value), 1 / std::sqrt(x.value * x.value - 1));
    }
    friend Dual atanh(const Dual& x) { return x.through(std::atanh(x.value), 1 / (1 - x.value * x.value)); }
    friend Dual atan2(const Dual& y, const Dual& x) {
        const double square = x.value * x.value + y.value * y.value;
        return {std::atan2(y.value, x.value), (x.value * y.slope - y.value * x.slope) / square};
    }
    friend Dual hypot(const Dual& a, const Dual& b) {
        const double h = std::hypot(a.value, b.value);
        return {h, (a.value * a.slope + b.value * b.slope) / h};
    }
    friend Dual fmod(const Dual& x, const Dual& y) {
        const double wholes = y.slope == 0 ? 0 : std::trunc(x.value / y.value);
        return {std::fmod(x.value, y.value), x.slope - wholes * y.slope};
    }
    friend Dual pow(const Dual& x, const Dual& e) {
        const double p = std::pow(x.value, e.value);
        double slope = x.slope == 0 || e.value == 0 ? 0 : e.value * std::pow(x.value, e.value - 1) * x.slope;
        if (e.slope != 0) slope += p * std::log(x.value) * e.slope;
        return {p, slope};
    }

  private:
    void meets(const Dual& other) const { is_at_corner |= value == other.value && slope != other.slope; }
    /// f(x), where f has this value and this derivative. What does not depend on anything has no derivative,
    /// even where f has none.
    Dual through(double f, double derivative) const { return {f, slope == 0 ? 0 : derivative * slope}; }
};

} // namespace bf::analysis

template <> struct std::numeric_limits<bf::analysis::Dual> {
    static constexpr bool is_specialized = true;
    static bf::analysis::Dual epsilon() { return std::numeric_limits<double>::epsilon(); }
    static bf::analysis::Dual min() { return std::numeric_limits<double>::min(); }
    static bf::analysis::Dual max() { return std::numeric_limits<double>::max(); }
    static bf::analysis::Dual infinity() { return std::numeric_limits<double>::infinity(); }
    static bf::analysis::Dual quiet_NaN() { return std::numeric_limits<double>::quiet_NaN(); }
};

namespace bf::kernels {

template <> inline constexpr bool is_real<analysis::Dual> = true;
template <> inline const analysis::Dual pi<analysis::Dual>{pi<double>};
template <> inline analysis::Dual opaque<analysis::Dual>(analysis::Dual x) noexcept { return x; }
/// Without its short cuts for some exponents, which may depend on something, too.
template <> inline analysis::Dual power<analysis::Dual>(analysis::Dual x, analysis::Dual e) noexcept {
    return pow(x, e);
}

// These name the functions of the standard library.
#define BF_FUNCTION(kernel, result)                                                                          \
    template <> inline analysis::Dual kernel::apply<analysis::Dual>(analysis::Dual x) noexcept {             \
        return result;                                                                                       \
    }
BF_FUNCTION(Sqrt, sqrt(x))
BF_FUNCTION(SignedSqrt, x.value < 0 ? -sqrt(-x) : sqrt(x))
BF_FUNCTION(ReciprocalSqrt, 1 / sqrt(x))
BF_FUNCTION(Exp, exp(x))
BF_FUNCTION(Log, log(x))
BF_FUNCTION(Log10, log10(x))
BF_FUNCTION(Pow10, pow(analysis::Dual(10), x))
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
template <> inline analysis::Dual Atan2::apply<analysis::Dual>(analysis::Dual y, analysis::Dual x) noexcept {
    return atan2(y, x);
}
template <> inline analysis::Dual Hypot::apply<analysis::Dual>(analysis::Dual a, analysis::Dual b) noexcept {
    return hypot(a, b);
}

/// Of formulas: comparisons and roundings have no derivative.
template <> inline analysis::Dual value_of<analysis::Dual>(Operation operation, analysis::Dual x) noexcept {
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

#pragma once

#include "bf/kernels/elementwise.hpp"

/// Functions of <cmath>, element by element, on double and float. Functions that are exact by definition
/// (square root, rounding) or correctly rounded are the same everywhere; the others depend on the C library.
namespace bf::kernels {

/// y = √u; NaN for u < 0.
struct Sqrt : Unary<Sqrt> {
    static constexpr const char* name = "bf::kernels::Sqrt{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::sqrt(x); }
};

/// y = sign(u) √|u|.
struct SignedSqrt : Unary<SignedSqrt> {
    static constexpr const char* name = "bf::kernels::SignedSqrt{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::copysign(std::sqrt(std::fabs(x)), x); }
};

/// y = 1/√u.
struct ReciprocalSqrt : Unary<ReciprocalSqrt> {
    static constexpr const char* name = "bf::kernels::ReciprocalSqrt{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return T(1) / std::sqrt(x); }
};

/// y = 1/u.
struct Reciprocal : Unary<Reciprocal> {
    static constexpr const char* name = "bf::kernels::Reciprocal{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return T(1) / x; }
};

/// y = e^u.
struct Exp : Unary<Exp> {
    static constexpr const char* name = "bf::kernels::Exp{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::exp(opaque(x)); }
};

/// y = ln u; -∞ at 0, NaN below.
struct Log : Unary<Log> {
    static constexpr const char* name = "bf::kernels::Log{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::log(opaque(x)); }
};

/// y = log₁₀ u.
struct Log10 : Unary<Log10> {
    static constexpr const char* name = "bf::kernels::Log10{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::log10(opaque(x)); }
};

/// y = 10^u.
struct Pow10 : Unary<Pow10> {
    static constexpr const char* name = "bf::kernels::Pow10{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::pow(opaque(T(10)), opaque(x)); }
};

/// y = sin u, u [rad].
struct Sin : Unary<Sin> {
    static constexpr const char* name = "bf::kernels::Sin{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::sin(opaque(x)); }
};

/// y = cos u, u [rad].
struct Cos : Unary<Cos> {
    static constexpr const char* name = "bf::kernels::Cos{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::cos(opaque(x)); }
};

/// sine = sin u, cosine = cos u, u [rad]; the same numbers as from Sin and Cos, but compilers make one call
/// of it where the C library has `sincos`.
struct SineCosine {
    static constexpr const char* name = "bf::kernels::SineCosine{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class S, class C, class U>
    void operator()(const S& sine, const C& cosine, const U& u) const noexcept {
        for (int i = 0; i < u.size(); ++i) {
            const auto x = opaque(u[i]);
            sine[i] = sin(x);
            cosine[i] = cos(x);
        }
    }
};

/// y = tan u, u [rad].
struct Tan : Unary<Tan> {
    static constexpr const char* name = "bf::kernels::Tan{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::tan(opaque(x)); }
};

/// y = arcsin u [rad]; NaN outside [-1, 1].
struct Asin : Unary<Asin> {
    static constexpr const char* name = "bf::kernels::Asin{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::asin(opaque(x)); }
};

/// y = arccos u [rad]; NaN outside [-1, 1].
struct Acos : Unary<Acos> {
    static constexpr const char* name = "bf::kernels::Acos{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::acos(opaque(x)); }
};

/// y = arctan u [rad].
struct Atan : Unary<Atan> {
    static constexpr const char* name = "bf::kernels::Atan{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::atan(opaque(x)); }
};

/// y = sinh u.
struct Sinh : Unary<Sinh> {
    static constexpr const char* name = "bf::kernels::Sinh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::sinh(opaque(x)); }
};

/// y = cosh u.
struct Cosh : Unary<Cosh> {
    static constexpr const char* name = "bf::kernels::Cosh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::cosh(opaque(x)); }
};

/// y = tanh u.
struct Tanh : Unary<Tanh> {
    static constexpr const char* name = "bf::kernels::Tanh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::tanh(opaque(x)); }
};

/// y = arsinh u.
struct Asinh : Unary<Asinh> {
    static constexpr const char* name = "bf::kernels::Asinh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::asinh(opaque(x)); }
};

/// y = arcosh u; NaN below 1.
struct Acosh : Unary<Acosh> {
    static constexpr const char* name = "bf::kernels::Acosh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::acosh(opaque(x)); }
};

/// y = artanh u; ±∞ at ±1, NaN outside.
struct Atanh : Unary<Atanh> {
    static constexpr const char* name = "bf::kernels::Atanh{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::atanh(opaque(x)); }
};

/// y = largest integer not above u.
struct Floor : Unary<Floor> {
    static constexpr const char* name = "bf::kernels::Floor{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::floor(x); }
};

/// y = smallest integer not below u.
struct Ceil : Unary<Ceil> {
    static constexpr const char* name = "bf::kernels::Ceil{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::ceil(x); }
};

/// y = nearest integer, halves away from zero.
struct Round : Unary<Round> {
    static constexpr const char* name = "bf::kernels::Round{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::round(x); }
};

/// y = u without its fraction.
struct Fix : Unary<Fix> {
    static constexpr const char* name = "bf::kernels::Fix{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T x) noexcept { return std::trunc(x); }
};

/// y = a^b.
struct Power : Binary<Power> {
    static constexpr const char* name = "bf::kernels::Power{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T a, T b) noexcept { return power(a, b); }
};

/// y = angle of the point (b, a) [rad], in [-π, π].
struct Atan2 : Binary<Atan2> {
    static constexpr const char* name = "bf::kernels::Atan2{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T a, T b) noexcept { return std::atan2(opaque(a), opaque(b)); }
};

/// y = √(a² + b²).
struct Hypot : Binary<Hypot> {
    static constexpr const char* name = "bf::kernels::Hypot{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class T> static T apply(T a, T b) noexcept { return std::hypot(opaque(a), opaque(b)); }
};

/// y = c_0 uⁿ + … + c_n by Horner's rule.
struct Polynomial {
    static constexpr const char* name = "bf::kernels::Polynomial{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class C, class U>
    constexpr void operator()(const Y& y, const C& coefficients, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const Element<Y> x = u[pick(i, u.size())];
            Element<Y> value = 0;
            for (int k = 0; k < coefficients.size(); ++k) value = value * x + coefficients[k];
            y[i] = value;
        }
    }
};

} // namespace bf::kernels

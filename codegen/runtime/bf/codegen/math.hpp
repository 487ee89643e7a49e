// The functions that equations of generated code call, the same ones that simulations do.
#pragma once

#include "bf/kernels/expression.hpp"

namespace bf::generated::math {

// Of whole numbers these wrap around; none of them loses a NaN or finds another order than the simulation's.
using kernels::absolute;
using kernels::add;
using kernels::clamp;
using kernels::divide;
using kernels::maximum;
using kernels::minimum;
using kernels::modulo;
using kernels::multiply;
using kernels::negate;
using kernels::power;
using kernels::remainder;
using kernels::subtract;

template <class T> T sqrt(T x) noexcept { return kernels::Sqrt::apply(x); }
template <class T> T signed_sqrt(T x) noexcept { return kernels::SignedSqrt::apply(x); }
template <class T> T reciprocal_sqrt(T x) noexcept { return kernels::ReciprocalSqrt::apply(x); }
template <class T> T exp(T x) noexcept { return kernels::Exp::apply(x); }
template <class T> T log(T x) noexcept { return kernels::Log::apply(x); }
template <class T> T log10(T x) noexcept { return kernels::Log10::apply(x); }
template <class T> T pow10(T x) noexcept { return kernels::Pow10::apply(x); }
template <class T> T sin(T x) noexcept { return kernels::Sin::apply(x); }
template <class T> T cos(T x) noexcept { return kernels::Cos::apply(x); }
template <class T> T tan(T x) noexcept { return kernels::Tan::apply(x); }
template <class T> T asin(T x) noexcept { return kernels::Asin::apply(x); }
template <class T> T acos(T x) noexcept { return kernels::Acos::apply(x); }
template <class T> T atan(T x) noexcept { return kernels::Atan::apply(x); }
template <class T> T sinh(T x) noexcept { return kernels::Sinh::apply(x); }
template <class T> T cosh(T x) noexcept { return kernels::Cosh::apply(x); }
template <class T> T tanh(T x) noexcept { return kernels::Tanh::apply(x); }
template <class T> T asinh(T x) noexcept { return kernels::Asinh::apply(x); }
template <class T> T acosh(T x) noexcept { return kernels::Acosh::apply(x); }
template <class T> T atanh(T x) noexcept { return kernels::Atanh::apply(x); }
template <class T> T floor(T x) noexcept { return kernels::Floor::apply(x); }
template <class T> T ceil(T x) noexcept { return kernels::Ceil::apply(x); }
template <class T> T round(T x) noexcept { return kernels::Round::apply(x); }
template <class T> T fix(T x) noexcept { return kernels::Fix::apply(x); }
template <class T> T fmod(T x, T y) noexcept { return std::fmod(x, y); }
template <class T> T atan2(T y, T x) noexcept { return kernels::Atan2::apply(y, x); }
template <class T> T hypot(T a, T b) noexcept { return kernels::Hypot::apply(a, b); }

// Of formulas alone.
/// A call, since GCC 12 makes 0.0 - double(b) the number -0.0 for false: it replaces it by a negation.
template <class R, class T> R as(T x) noexcept { return static_cast<R>(x); }
template <class T> T sign(T x) noexcept { return kernels::value_of(kernels::Operation::sign, x); }
template <class T> T expm1(T x) noexcept { return kernels::value_of(kernels::Operation::expm1, x); }
template <class T> T log1p(T x) noexcept { return kernels::value_of(kernels::Operation::log1p, x); }
template <class T> T log2(T x) noexcept { return kernels::value_of(kernels::Operation::log2, x); }
template <class T> T deg2rad(T x) noexcept { return kernels::value_of(kernels::Operation::deg2rad, x); }
template <class T> T rad2deg(T x) noexcept { return kernels::value_of(kernels::Operation::rad2deg, x); }

} // namespace bf::generated::math

// Arithmetic of the model's expressions: the same operations in the same order as when the model was
// elaborated.
#pragma once

#include "bf/codegen/views.hpp"
#include "bf/kernels/limits.hpp"
#include "bf/kernels/scalar.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace bf::generated {

/// Extents and elements of an operand: a double, or a Matrix of them.
template <class T> struct OperandOf {
    static constexpr int rows = 1, cols = 1;
    static const double* data(const double& x) noexcept { return &x; }
};
template <int R, int C> struct OperandOf<Matrix<double, R, C>> {
    static constexpr int rows = R, cols = C;
    static const double* data(const Matrix<double, R, C>& x) noexcept { return x.data; }
};
template <int R, int C> using Numbers = std::conditional_t<R == 1 && C == 1, double, Matrix<double, R, C>>;

/// The functions of one evaluation, named as in MATLAB. What is not defined for real numbers is remembered.
class Formula {
  public:
    bool is_defined = true;

    template <class A, class B> auto plus(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x + y; });
    }
    template <class A, class B> auto minus(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x - y; });
    }
    template <class A, class B> auto times(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x * y; });
    }
    template <class A, class B> auto rdivide(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x / y; });
    }
    template <class A, class B> auto ldivide(const A& a, const B& b) noexcept { return rdivide(b, a); }
    template <class A, class B> auto power(const A& a, const B& b) noexcept {
        return zip(a, b, [this](double x, double y) {
            require(!(x < 0 && y != std::round(y)));
            return std::pow(x, y);
        });
    }
    template <class A, class B> auto mtimes(const A& a, const B& b) noexcept {
        using X = OperandOf<A>;
        using Y = OperandOf<B>;
        if constexpr (X::rows * X::cols == 1 || Y::rows * Y::cols == 1) {
            return times(a, b);
        } else {
            static_assert(X::cols == Y::rows);
            Numbers<X::rows, Y::cols> result{};
            double* const c = elements_of(result);
            for (int j = 0; j < Y::cols; ++j)
                for (int k = 0; k < X::cols; ++k)
                    for (int i = 0; i < X::rows; ++i)
                        c[i + j * X::rows] += X::data(a)[i + k * X::rows] * Y::data(b)[k + j * Y::rows];
            return result;
        }
    }

    template <class A, class B> auto equal(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x == y); });
    }
    template <class A, class B> auto not_equal(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x != y); });
    }
    template <class A, class B> auto less(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x < y); });
    }
    template <class A, class B> auto less_equal(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x <= y); });
    }
    template <class A, class B> auto greater(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x > y); });
    }
    template <class A, class B> auto greater_equal(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return double(x >= y); });
    }
    template <class A, class B> auto logical_and(const A& a, const B& b) noexcept {
        return zip(a, b, [this](double x, double y) { return double(number(x) != 0 && number(y) != 0); });
    }
    template <class A, class B> auto logical_or(const A& a, const B& b) noexcept {
        return zip(a, b, [this](double x, double y) { return double(number(x) != 0 || number(y) != 0); });
    }
    template <class A> auto logical_not(const A& a) noexcept {
        return map(a, [this](double x) { return double(number(x) == 0); });
    }
    template <class A, class B> double both(const A& a, const B& b) noexcept {
        return double(truth(a) && truth(b));
    }
    template <class A, class B> double either(const A& a, const B& b) noexcept {
        return double(truth(a) || truth(b));
    }

    template <class A, class B> auto atan2(const A& a, const B& b) noexcept {
        return zip(a, b, [](double y, double x) { return std::atan2(y, x); });
    }
    template <class A, class B> auto hypot(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return std::hypot(x, y); });
    }
    /// As in MATLAB, the one that is a number.
    template <class A, class B> auto min(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x != x || y < x ? y : x; });
    }
    template <class A, class B> auto max(const A& a, const B& b) noexcept {
        return zip(a, b, [](double x, double y) { return x != x || y > x ? y : x; });
    }
    template <class A, class B> auto rem(const A& a, const B& b) noexcept {
        return zip(a, b, kernels::remainder<double>);
    }
    template <class A, class B> auto mod(const A& a, const B& b) noexcept {
        return zip(a, b, kernels::modulo<double>);
    }

    template <class A> auto same(const A& a) noexcept { return a; }
    template <class A> auto uminus(const A& a) noexcept {
        return map(a, [](double x) { return -x; });
    }
    template <class A> auto sin(const A& a) noexcept {
        return map(a, [](double x) { return std::sin(x); });
    }
    template <class A> auto cos(const A& a) noexcept {
        return map(a, [](double x) { return std::cos(x); });
    }
    template <class A> auto tan(const A& a) noexcept {
        return map(a, [](double x) { return std::tan(x); });
    }
    template <class A> auto asin(const A& a) noexcept {
        return map(a, [this](double x) { return std::asin(require(!(std::abs(x) > 1), x)); });
    }
    template <class A> auto acos(const A& a) noexcept {
        return map(a, [this](double x) { return std::acos(require(!(std::abs(x) > 1), x)); });
    }
    template <class A> auto atan(const A& a) noexcept {
        return map(a, [](double x) { return std::atan(x); });
    }
    template <class A> auto sinh(const A& a) noexcept {
        return map(a, [](double x) { return std::sinh(x); });
    }
    template <class A> auto cosh(const A& a) noexcept {
        return map(a, [](double x) { return std::cosh(x); });
    }
    template <class A> auto tanh(const A& a) noexcept {
        return map(a, [](double x) { return std::tanh(x); });
    }
    template <class A> auto asinh(const A& a) noexcept {
        return map(a, [](double x) { return std::asinh(x); });
    }
    template <class A> auto acosh(const A& a) noexcept {
        return map(a, [this](double x) { return std::acosh(require(!(x < 1), x)); });
    }
    template <class A> auto atanh(const A& a) noexcept {
        return map(a, [this](double x) { return std::atanh(require(!(std::abs(x) > 1), x)); });
    }
    template <class A> auto exp(const A& a) noexcept {
        return map(a, [](double x) { return std::exp(x); });
    }
    template <class A> auto expm1(const A& a) noexcept {
        return map(a, [](double x) { return std::expm1(x); });
    }
    template <class A> auto log(const A& a) noexcept {
        return map(a, [this](double x) { return std::log(require(!(x < 0), x)); });
    }
    template <class A> auto log2(const A& a) noexcept {
        return map(a, [this](double x) { return std::log2(require(!(x < 0), x)); });
    }
    template <class A> auto log10(const A& a) noexcept {
        return map(a, [this](double x) { return std::log10(require(!(x < 0), x)); });
    }
    template <class A> auto log1p(const A& a) noexcept {
        return map(a, [this](double x) { return std::log1p(require(!(x < -1), x)); });
    }
    template <class A> auto sqrt(const A& a) noexcept {
        return map(a, [this](double x) { return std::sqrt(require(!(x < 0), x)); });
    }
    template <class A> auto abs(const A& a) noexcept {
        return map(a, [](double x) { return std::abs(x); });
    }
    template <class A> auto sign(const A& a) noexcept {
        return map(a, [](double x) { return x != x ? x : double(x > 0) - double(x < 0); });
    }
    template <class A> auto floor(const A& a) noexcept {
        return map(a, [](double x) { return std::floor(x); });
    }
    template <class A> auto ceil(const A& a) noexcept {
        return map(a, [](double x) { return std::ceil(x); });
    }
    template <class A> auto fix(const A& a) noexcept {
        return map(a, [](double x) { return std::trunc(x); });
    }
    template <class A> auto round(const A& a) noexcept {
        return map(a, [](double x) { return std::round(x); });
    }
    template <class A> auto deg2rad(const A& a) noexcept {
        return map(a, [](double x) { return pi / 180 * x; });
    }
    template <class A> auto rad2deg(const A& a) noexcept {
        return map(a, [](double x) { return 180 / pi * x; });
    }

    template <class A> auto transpose(const A& a) noexcept {
        using X = OperandOf<A>;
        Numbers<X::cols, X::rows> result{};
        for (int i = 0; i < X::rows; ++i)
            for (int j = 0; j < X::cols; ++j)
                elements_of(result)[j + i * X::cols] = X::data(a)[i + j * X::rows];
        return result;
    }
    /// Of a vector: the matrix with that diagonal; of a matrix: its diagonal.
    template <class A> auto diag(const A& a) noexcept {
        using X = OperandOf<A>;
        constexpr bool is_vector = X::rows == 1 || X::cols == 1;
        constexpr int n = is_vector ? X::rows * X::cols : X::rows < X::cols ? X::rows : X::cols;
        Numbers<n, is_vector ? n : 1> result{};
        for (int i = 0; i < n; ++i)
            elements_of(result)[is_vector ? i + i * n : i] = X::data(a)[is_vector ? i : i + i * X::rows];
        return result;
    }
    /// The elements at these places, column by column, as R x C.
    template <int R, int C, int... places, class A> auto pick(const A& a) noexcept {
        constexpr int from[] = {places...};
        static_assert(sizeof...(places) == R * C);
        Numbers<R, C> result{};
        for (int i = 0; i < R * C; ++i) elements_of(result)[i] = OperandOf<A>::data(a)[from[i]];
        return result;
    }
    /// The element at a place that is computed, too; counted from 1.
    template <class A> double element(const A& a, double i) noexcept {
        return at(a, i, OperandOf<A>::rows * OperandOf<A>::cols, 0, 0);
    }
    template <class A> double element(const A& a, double i, double j) noexcept {
        return at(a, i, OperandOf<A>::rows, j - 1, OperandOf<A>::cols);
    }
    /// Side by side.
    template <class A> auto row(const A& a) noexcept { return a; }
    template <class A, class B, class... More>
    auto row(const A& a, const B& b, const More&... more) noexcept {
        using X = OperandOf<A>;
        using Y = OperandOf<B>;
        static_assert(X::rows == Y::rows);
        Numbers<X::rows, X::cols + Y::cols> result{};
        copy(X::rows * X::cols, X::data(a), elements_of(result));
        copy(Y::rows * Y::cols, Y::data(b), elements_of(result) + X::rows * X::cols);
        return row(result, more...);
    }
    /// One above the other.
    template <class A> auto stack(const A& a) noexcept { return a; }
    template <class A, class B, class... More>
    auto stack(const A& a, const B& b, const More&... more) noexcept {
        return stack(transpose(row(transpose(a), transpose(b))), more...);
    }

    /// to = value, one element for all; false when that is not defined, or no number of an integer type.
    template <class To, class A> bool write(To& to, const A& value) noexcept {
        using X = OperandOf<A>;
        const auto target = out(to);
        using T = typename decltype(target)::value_type;
        const double* const x = X::data(value);
        constexpr kernels::Range range = kernels::range_of<T>();
        for (int i = 0; i < X::rows * X::cols; ++i)
            is_defined = is_defined && (!range.is_whole || range.holds(x[i]));
        if (!is_defined) return false;
        for (int i = 0; i < target.size(); ++i) target[i] = static_cast<T>(x[X::rows * X::cols == 1 ? 0 : i]);
        return true;
    }

  private:
    static constexpr double pi = 3.14159265358979323846;

    static double* elements_of(double& x) noexcept { return &x; }
    template <int R, int C> static double* elements_of(Matrix<double, R, C>& x) noexcept { return x.data; }
    static void copy(int count, const double* from, double* to) noexcept {
        for (int i = 0; i < count; ++i) to[i] = from[i];
    }
    double require(bool is_real, double x = 0) noexcept {
        is_defined = is_defined && is_real;
        return x;
    }
    /// Row i of `rows`, which counts from 1; column j of `cols`, which counts from 0 (0: there is but one
    /// index).
    template <class A> double at(const A& a, double i, int rows, double j, int cols) noexcept {
        const bool is_inside = i >= 1 && i <= rows && i == std::floor(i) && j >= 0 && j == std::floor(j) &&
                               (cols == 0 ? j == 0 : j < cols);
        require(is_inside);
        return is_inside ? OperandOf<A>::data(a)[static_cast<int>(i) - 1 + static_cast<int>(j) * rows] : 0;
    }
    double number(double x) noexcept { return require(!(x != x), x); }
    template <class A> bool truth(const A& a) noexcept {
        bool all = true;
        for (int i = 0; i < OperandOf<A>::rows * OperandOf<A>::cols; ++i)
            all = all && OperandOf<A>::data(a)[i] != 0;
        return all;
    }

    template <class A, class F> auto map(const A& a, F&& f) noexcept {
        using X = OperandOf<A>;
        Numbers<X::rows, X::cols> result{};
        for (int i = 0; i < X::rows * X::cols; ++i) elements_of(result)[i] = f(X::data(a)[i]);
        return result;
    }
    /// Element by element; a row or column of length 1 expands.
    template <class A, class B, class F> auto zip(const A& a, const B& b, F&& f) noexcept {
        using X = OperandOf<A>;
        using Y = OperandOf<B>;
        constexpr int rows = X::rows == 1 ? Y::rows : X::rows, cols = X::cols == 1 ? Y::cols : X::cols;
        static_assert((Y::rows == 1 || Y::rows == rows) && (Y::cols == 1 || Y::cols == cols));
        Numbers<rows, cols> result{};
        for (int j = 0; j < cols; ++j)
            for (int i = 0; i < rows; ++i)
                elements_of(result)[i + j * rows] =
                    f(X::data(a)[(X::rows == 1 ? 0 : i) + (X::cols == 1 ? 0 : j * X::rows)],
                      Y::data(b)[(Y::rows == 1 ? 0 : i) + (Y::cols == 1 ? 0 : j * Y::rows)]);
        return result;
    }
};

} // namespace bf::generated

// Arithmetic of the model's expressions: the same operations in the same order as when the model was
// elaborated.
#pragma once

#include "bf/codegen/views.hpp"
#include "bf/kernels/expression.hpp"
#include "bf/kernels/limits.hpp"

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

/// The operations of one evaluation. What is not defined for real numbers is remembered.
class Formula {
  public:
    bool is_defined = true;

    /// Element by element.
    template <kernels::Operation op, class A> auto of(const A& a) noexcept {
        return map(a, [this](double x) {
            require(kernels::is_defined(op, x));
            return kernels::value_of(op, x);
        });
    }
    template <kernels::Operation op, class A, class B> auto of(const A& a, const B& b) noexcept {
        return zip(a, b, [this](double x, double y) {
            require(kernels::is_defined(op, x, y));
            return kernels::value_of(op, x, y);
        });
    }
    /// 1 or 0. A call, since GCC 12 makes 0.0 - double(truth) the number -0.0 for false: it replaces it by a
    /// negation.
    double number(bool truth) noexcept { return truth ? 1 : 0; }
    /// Is it true as a condition: no element 0? NaN is no condition.
    template <class A> bool truth(const A& a) noexcept {
        bool all = OperandOf<A>::rows * OperandOf<A>::cols > 0;
        for (int i = 0; i < OperandOf<A>::rows * OperandOf<A>::cols; ++i) {
            const double x = OperandOf<A>::data(a)[i];
            require(x == x);
            all = all && x != 0;
        }
        return all;
    }

    template <class A, class B> auto mtimes(const A& a, const B& b) noexcept {
        using X = OperandOf<A>;
        using Y = OperandOf<B>;
        if constexpr (X::rows * X::cols == 1 || Y::rows * Y::cols == 1) {
            return of<kernels::Operation::times>(a, b);
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
    template <class A> auto transpose(const A& a) noexcept {
        using X = OperandOf<A>;
        Numbers<X::cols, X::rows> result{};
        for (int i = 0; i < X::rows; ++i)
            for (int j = 0; j < X::cols; ++j)
                elements_of(result)[j + i * X::cols] = X::data(a)[i + j * X::rows];
        return result;
    }
    /// The elements at these places, column by column, as R x C; 0 where a place is negative.
    template <int R, int C, int... places, class A> auto pick(const A& a) noexcept {
        constexpr int from[] = {places...};
        static_assert(sizeof...(places) == R * C);
        Numbers<R, C> result{};
        for (int i = 0; i < R * C; ++i)
            if (from[i] >= 0) elements_of(result)[i] = OperandOf<A>::data(a)[from[i]];
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
    static double* elements_of(double& x) noexcept { return &x; }
    template <int R, int C> static double* elements_of(Matrix<double, R, C>& x) noexcept { return x.data; }
    static void copy(int count, const double* from, double* to) noexcept {
        for (int i = 0; i < count; ++i) to[i] = from[i];
    }
    void require(bool is_met) noexcept { is_defined = is_defined && is_met; }
    /// Row i of `rows`, which counts from 1; column j of `cols`, which counts from 0 (0: there is but one
    /// index).
    template <class A> double at(const A& a, double i, int rows, double j, int cols) noexcept {
        const bool is_inside = i >= 1 && i <= rows && i == std::floor(i) && j >= 0 && j == std::floor(j) &&
                               (cols == 0 ? j == 0 : j < cols);
        require(is_inside);
        return is_inside ? OperandOf<A>::data(a)[static_cast<int>(i) - 1 + static_cast<int>(j) * rows] : 0;
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

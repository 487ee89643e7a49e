#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// One number from many; y is a scalar unless said otherwise. Elements are taken in column-major order.
namespace bf::kernels {

/// y = Σ u_i.
struct SumOfElements {
    static constexpr const char* name = "bf::kernels::SumOfElements{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        using T = Element<Y>;
        T sum = 0;
        for (int i = 0; i < u.size(); ++i) sum = add(sum, static_cast<T>(u[i]));
        y[0] = sum;
    }
};

/// y = Π u_i.
struct ProductOfElements {
    static constexpr const char* name = "bf::kernels::ProductOfElements{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        using T = Element<Y>;
        T product = 1;
        for (int i = 0; i < u.size(); ++i) product = multiply(product, static_cast<T>(u[i]));
        y[0] = product;
    }
};

/// y_j = Σ_i u_ij, one sum per column.
struct SumOfColumns {
    static constexpr const char* name = "bf::kernels::SumOfColumns{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int j = 0; j < u.cols; ++j) {
            y[j] = 0;
            for (int i = 0; i < u.rows; ++i) y[j] = add(y[j], static_cast<Element<Y>>(u(i, j)));
        }
    }
};

/// y_i = Σ_j u_ij, one sum per row.
struct SumOfRows {
    static constexpr const char* name = "bf::kernels::SumOfRows{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < u.rows; ++i) y[i] = 0;
        for (int j = 0; j < u.cols; ++j)
            for (int i = 0; i < u.rows; ++i) y[i] = add(y[i], static_cast<Element<Y>>(u(i, j)));
    }
};

/// y = smallest element, ignoring NaN; u is not empty.
struct MinimumOfElements {
    static constexpr const char* name = "bf::kernels::MinimumOfElements{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        y[0] = u[0];
        for (int i = 1; i < u.size(); ++i) y[0] = minimum(y[0], Element<Y>(u[i]));
    }
};

/// y = largest element, ignoring NaN; u is not empty.
struct MaximumOfElements {
    static constexpr const char* name = "bf::kernels::MaximumOfElements{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        y[0] = u[0];
        for (int i = 1; i < u.size(); ++i) y[0] = maximum(y[0], Element<Y>(u[i]));
    }
};

/// y = Σ a_i b_i.
struct Dot {
    static constexpr const char* name = "bf::kernels::Dot{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        using T = Element<Y>;
        const int n = a.size() > b.size() ? a.size() : b.size();
        T sum = 0;
        for (int i = 0; i < n; ++i)
            sum = add(sum,
                      multiply(static_cast<T>(a[pick(i, a.size())]), static_cast<T>(b[pick(i, b.size())])));
        y[0] = sum;
    }
};

/// y = a × b, three elements each.
struct Cross {
    static constexpr const char* name = "bf::kernels::Cross{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        y[0] = a[1] * b[2] - a[2] * b[1];
        y[1] = a[2] * b[0] - a[0] * b[2];
        y[2] = a[0] * b[1] - a[1] * b[0];
    }
};

/// y = Σ |u_i|.
struct Norm1 {
    static constexpr const char* name = "bf::kernels::Norm1{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        Element<Y> sum = 0;
        for (int i = 0; i < u.size(); ++i) sum += absolute(u[i]);
        y[0] = sum;
    }
};

/// y = √(Σ u_i²); the Frobenius norm of a matrix. The squares are not scaled against overflow.
struct Norm2 {
    static constexpr const char* name = "bf::kernels::Norm2{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        Element<Y> sum = 0;
        for (int i = 0; i < u.size(); ++i) sum += u[i] * u[i];
        y[0] = sqrt(sum);
    }
};

/// y = max |u_i|; NaN if an element is.
struct NormInf {
    static constexpr const char* name = "bf::kernels::NormInf{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        Element<Y> largest = 0;
        for (int i = 0; i < u.size(); ++i) {
            const auto x = absolute(u[i]);
            if (x > largest || x != x) largest = x;
        }
        y[0] = largest;
    }
};

/// y_k = Σ_{i ≤ k} u_i over all elements.
struct CumulativeSum {
    static constexpr const char* name = "bf::kernels::CumulativeSum{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        Element<Y> sum = 0;
        for (int i = 0; i < y.size(); ++i) y[i] = sum = add(sum, static_cast<Element<Y>>(u[i]));
    }
};

/// y = u sorted, the smallest first or with descends ≠ 0 the largest; index = place of y_i in u, from 1.
/// Equal elements keep their order, NaN counts as the largest.
struct Sort {
    static constexpr const char* name = "bf::kernels::Sort{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class D, class U>
    constexpr void operator()(const Y& y, const I& index, const D& descends, const U& u) const noexcept {
        const auto before = [](Element<Y> a, Element<Y> b) { return a < b || (b != b && a == a); };
        const bool down = descends[0] != 0;
        for (int k = 0; k < y.size(); ++k) { // insertion sort
            const Element<Y> x = u[k];
            int i = k;
            for (; i > 0 && (down ? before(y[i - 1], x) : before(x, y[i - 1])); --i) {
                y[i] = y[i - 1];
                index[i] = index[i - 1];
            }
            y[i] = x;
            index[i] = static_cast<Element<I>>(k + 1);
        }
    }
};

/// y = place of the first element that is not 0, from 1; 0 if there is none.
struct FindFirst {
    static constexpr const char* name = "bf::kernels::FindFirst{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        int i = 0;
        while (i < u.size() && u[i] == 0) ++i;
        y[0] = static_cast<Element<Y>>(i < u.size() ? i + 1 : 0);
    }
};

} // namespace bf::kernels

#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Products and patterns of matrices. Outputs share no memory with inputs.
namespace bf::kernels {

namespace detail {

/// y += f x, n elements.
template <class T> constexpr void add_scaled(T* __restrict y, const T* __restrict x, T f, int n) noexcept {
    for (int i = 0; i < n; ++i) y[i] = add(y[i], multiply(x[i], f));
}

/// R × C elements of y = a b: y and a have `rows` rows, b has `depth`. The sums stay in registers.
template <int R, int C, class T>
constexpr void product_tile(T* __restrict y, const T* __restrict a, const T* __restrict b, int rows,
                            int depth) noexcept {
    T sum[C][R] = {};
    for (int k = 0; k < depth; ++k, a += rows, ++b)
#pragma GCC unroll 16
        for (int c = 0; c < C; ++c)
#pragma GCC unroll 16
            for (int r = 0; r < R; ++r) sum[c][r] = add(sum[c][r], multiply(a[r], b[c * depth]));
    for (int c = 0; c < C; ++c)
        for (int r = 0; r < R; ++r) y[r + c * rows] = sum[c][r];
}

/// C columns of y = a b from row i on, in tiles of at most Tall rows. A last tile that is more than half full
/// overlaps rows before it: to compute some elements twice costs less than single rows.
template <int Tall, int C, class T>
constexpr void product_columns(T* y, const T* a, const T* b, int rows, int depth, int i = 0) noexcept {
    for (; i + Tall <= rows; i += Tall) product_tile<Tall, C>(y + i, a + i, b, rows, depth);
    if (rows >= Tall && i + Tall / 2 < rows)
        product_tile<Tall, C>(y + rows - Tall, a + rows - Tall, b, rows, depth);
    else if constexpr (Tall > 1)
        product_columns<Tall / 2, C>(y, a, b, rows, depth, i);
}

/// Columns of y (rows × cols) = a (rows × depth) b (depth × cols) from column j on, in tiles of at most
/// Tall × Wide.
template <int Tall, int Wide, class T>
constexpr void product_tiles(T* y, const T* a, const T* b, int rows, int depth, int cols,
                             int j = 0) noexcept {
    for (; j + Wide <= cols; j += Wide)
        product_columns<Tall, Wide>(y + j * rows, a, b + j * depth, rows, depth);
    if constexpr (Wide > 1) product_tiles<Tall, Wide / 2>(y, a, b, rows, depth, cols, j);
}

/// y = a b of one column, four columns of a at a time, each from its top to its bottom.
template <class T>
constexpr void product_vector(T* __restrict y, const T* __restrict a, const T* __restrict b, int rows,
                              int depth) noexcept {
    for (int i = 0; i < rows; ++i) y[i] = T{};
    int k = 0;
    for (; k + 4 <= depth; k += 4, a += 4 * rows)
        for (int i = 0; i < rows; ++i) {
            T sum = y[i];
#pragma GCC unroll 4
            for (int c = 0; c < 4; ++c) sum = add(sum, multiply(a[i + c * rows], b[k + c]));
            y[i] = sum;
        }
    for (; k < depth; ++k, a += rows) add_scaled(y, a, b[k], rows);
}

/// y (rows × cols) = a (rows × depth) b (depth × cols). Does the compiler know the extents? Only then do sums
/// of a tall tile stay in registers.
template <bool is_known, class T>
constexpr void product(T* y, const T* a, const T* b, int rows, int depth, int cols) noexcept {
    if constexpr (is_known)
        product_tiles<8, 4>(y, a, b, rows, depth, cols);
    else if (cols == 1 && rows >= 16)
        product_vector(y, a, b, rows, depth);
    else
        product_tiles<4, 2>(y, a, b, rows, depth, cols);
}

} // namespace detail

/// y = a b, y_ij = Σ_k a_ik b_kj summed in the order of k. Shapes: m × p = (m × n)(n × p).
struct MatrixProduct {
    static constexpr const char* name = "bf::kernels::MatrixProduct{}";
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        detail::product<is_fixed<Y>>(y.data, a.data, b.data, a.rows, a.cols, b.cols);
    }
};

/// y = M x + N u: output, update or derivative of a linear system.
struct StateSpace {
    static constexpr const char* name = "bf::kernels::StateSpace{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class M, class N, class X, class U>
    constexpr void operator()(const Y& y, const M& m, const N& n, const X& x, const U& u) const noexcept {
        using T = Element<Y>;
        detail::product<is_fixed<Y>>(y.data, m.data, x.data, m.rows, m.cols, 1);
        for (int k = 0; k < u.size(); ++k)
            detail::add_scaled<T>(y.data, n.data + k * y.size(), u[k], y.size());
    }
};

/// y = uᵀ.
struct Transpose {
    static constexpr const char* name = "bf::kernels::Transpose{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int j = 0; j < u.cols; ++j)
            for (int i = 0; i < u.rows; ++i) y(j, i) = u(i, j);
    }
};

/// y = matrix with the vector u on its diagonal, 0 elsewhere.
struct Diagonal {
    static constexpr const char* name = "bf::kernels::Diagonal{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = 0;
        for (int i = 0; i < u.size(); ++i) y(i, i) = u[i];
    }
};

/// y = diagonal of the matrix u.
struct DiagonalOf {
    static constexpr const char* name = "bf::kernels::DiagonalOf{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = u(i, i);
    }
};

/// y = identity, also of a rectangle.
struct Identity {
    static constexpr const char* name = "bf::kernels::Identity{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y> constexpr void operator()(const Y& y) const noexcept {
        for (int j = 0; j < y.cols; ++j)
            for (int i = 0; i < y.rows; ++i) y(i, j) = i == j;
    }
};

} // namespace bf::kernels

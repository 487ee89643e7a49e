#pragma once

#include "bf/kernels/lanes.hpp"
#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

#ifdef __has_builtin
#if __has_builtin(__builtin_shufflevector)
#define BF_HAS_SHUFFLES
#endif
#endif

/// Products and patterns of matrices. Outputs share no memory with inputs.
namespace bf::kernels {

namespace detail {

/// y = uᵀ of 4 × 4 elements; their columns stand y_step and u_step elements apart.
template <int most, class T>
constexpr void transpose_tile(T* __restrict y, int y_step, const T* __restrict u, int u_step) noexcept {
#ifdef BF_HAS_SHUFFLES
    using Pack = Lanes<T, 4, most>;
    if constexpr (Pack::count == 4) {
        typename Pack::type a, b, c, d;
        Pack::load(a, u);
        Pack::load(b, u + u_step);
        Pack::load(c, u + 2 * u_step);
        Pack::load(d, u + 3 * u_step);
        // Rows 0 and 2, and rows 1 and 3, of two columns.
        const auto ab_02 = __builtin_shufflevector(a, b, 0, 4, 2, 6);
        const auto ab_13 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
        const auto cd_02 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
        const auto cd_13 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
        Pack::store(y, __builtin_shufflevector(ab_02, cd_02, 0, 1, 4, 5));
        Pack::store(y + y_step, __builtin_shufflevector(ab_13, cd_13, 0, 1, 4, 5));
        Pack::store(y + 2 * y_step, __builtin_shufflevector(ab_02, cd_02, 2, 3, 6, 7));
        Pack::store(y + 3 * y_step, __builtin_shufflevector(ab_13, cd_13, 2, 3, 6, 7));
        return;
    }
#endif
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) y[j + i * y_step] = u[i + j * u_step];
}

/// y = uᵀ for u of rows × cols; their columns stand y_step and u_step elements apart.
template <int most, class T>
constexpr void transpose(T* __restrict y, int y_step, const T* __restrict u, int u_step, int rows,
                         int cols) noexcept {
    const int tall = rows - rows % 4, wide = cols - cols % 4;
    for (int j = 0; j < wide; j += 4)
        for (int i = 0; i < tall; i += 4)
            transpose_tile<most>(y + j + i * y_step, y_step, u + i + j * u_step, u_step);
    for (int i = tall; i < rows; ++i)
        for (int j = 0; j < wide; ++j) y[j + i * y_step] = u[i + j * u_step];
    for (int j = wide; j < cols; ++j)
        for (int i = 0; i < rows; ++i) y[j + i * y_step] = u[i + j * u_step];
}
template <int most = widest, class T>
constexpr void transpose(T* y, const T* u, int rows, int cols) noexcept {
    transpose<most>(y, cols, u, rows, rows, cols);
}

/// y += f x, n elements.
template <class T> constexpr void add_scaled(T* __restrict y, const T* __restrict x, T f, int n) noexcept {
    for (int i = 0; i < n; ++i) y[i] = add(y[i], multiply(x[i], f));
}

/// y = a x, a column of a product, of whole numbers, which no register of Lanes holds.
template <class T> constexpr void product_column(T* y, const T* a, const T* x, int rows, int depth) noexcept {
    for (int i = 0; i < rows; ++i) y[i] = 0;
    for (int k = 0; k < depth; ++k) add_scaled(y, a + k * rows, x[k], rows);
}

/// sum += x f, of numbers or of registers.
template <class V, class T> constexpr void add_product(V& sum, const V& x, T f) noexcept {
    if constexpr (std::is_same_v<V, T>)
        sum = add(sum, multiply(x, f));
    else
        sum += x * f;
}

/// P registers of L rows, the last one from row `last` on, and C columns of y = a b: y and a have `rows`
/// rows, b has `depth`. The sums stay in registers, which takes loops that are unrolled for sure, but for the
/// one along the sums: compilers that unroll it keep sums in memory.
template <int L, int P, int C, int most, class T>
constexpr void product_tile(T* __restrict y, const T* __restrict a, const T* __restrict b, int rows,
                            int depth, int last) noexcept {
    using Pack = Lanes<T, L, most>;
    typename Pack::type sum[C][P] = {};
#pragma GCC unroll 1
    for (int k = 0; k < depth; ++k, a += rows, ++b)
#pragma GCC unroll 4
        for (int p = 0; p < P; ++p) {
            typename Pack::type x;
            Pack::load(x, a + (p < P - 1 ? p * L : last));
#pragma GCC unroll 8
            for (int c = 0; c < C; ++c) add_product(sum[c][p], x, b[c * depth]);
        }
#pragma GCC unroll 8
    for (int c = 0; c < C; ++c)
#pragma GCC unroll 4
        for (int p = 0; p < P; ++p) Pack::store(y + (p < P - 1 ? p * L : last) + c * rows, sum[c][p]);
}

/// C columns of y = a b from row i on, in tiles of at most P registers. The last one overlaps rows before it:
/// to compute some elements twice costs less than single rows.
template <int L, int P, int C, int most, class T>
constexpr void product_columns(T* y, const T* a, const T* b, int rows, int depth, int i = 0) noexcept {
    for (; rows - i > (P - 1) * L; i += P * L)
        product_tile<L, P, C, most>(y + i, a + i, b, rows, depth,
                                    rows - i < P * L ? rows - i - L : (P - 1) * L);
    if constexpr (P > 1) product_columns<L, P - 1, C, most>(y, a, b, rows, depth, i);
}

/// How many registers of rows a tile has at most, and how many sums processors have registers for.
template <int most> inline constexpr int most_packs = most > 32 ? 4 : 3;
template <int most> inline constexpr int most_sums = most > 32 ? 24 : 12;

/// How many elements T one register holds, at most `rows`.
template <class T, int most, int rows, int count = 64 / sizeof(T)> constexpr int pack_size() noexcept {
    if constexpr (count <= 1)
        return 1;
    else
        return count <= rows && Lanes<T, count, most>::count == count ? count
                                                                      : pack_size<T, most, rows, count / 2>();
}

/// y (rows × cols) = a (rows × depth) b (depth × cols) from column j on.
template <int most = widest, int Wide = 4, int most_rows = 64, class T>
constexpr void product(T* y, const T* a, const T* b, int rows, int depth, int cols, int j = 0) noexcept {
    constexpr int L = pack_size<T, most, most_rows>(), P = most_rows < 64 ? 2 : most_packs<most>;
    if constexpr (L > 1)
        if (rows < L) return product<most, Wide, L - 1>(y, a, b, rows, depth, cols, j);
    for (; j + Wide <= cols; j += Wide)
        product_columns<L, P, Wide, most>(y + j * rows, a, b + j * depth, rows, depth);
    if constexpr (Wide > 1) product<most, Wide / 2, most_rows>(y, a, b, rows, depth, cols, j);
}

/// The same of extents that the compiler knows: as few tiles as registers have room for.
template <int most, int rows, int depth, int cols, int j = 0, class T>
constexpr void product_of_known(T* y, const T* a, const T* b) noexcept {
    constexpr int L = pack_size<T, most, rows>(), packs = (rows + L - 1) / L;
    constexpr int P = packs < most_packs<most> ? packs : most_packs<most>;
    constexpr int wide = most_sums<most> / P < 8 ? most_sums<most> / P : 8;
    constexpr int tiles = (cols - j + wide - 1) / wide, C = (cols - j + tiles - 1) / tiles;
    product_columns<L, P, C, most>(y + j * rows, a, b + j * depth, rows, depth);
    if constexpr (j + C < cols) product_of_known<most, rows, depth, cols, j + C>(y, a, b);
}

} // namespace detail

/// y = a b, y_ij = Σ_k a_ik b_kj summed in the order of k. Shapes: m × p = (m × n)(n × p).
struct MatrixProduct {
    static constexpr const char* name = "bf::kernels::MatrixProduct{}";
    static constexpr bool chooses_registers = true;
    template <class T> static constexpr bool accepts = is_number<T>;
    template <class Y, class A, class B>
    constexpr void operator()(const Y& y, const A& a, const B& b) const noexcept {
        if constexpr (is_real<Element<Y>>)
            run_widest(*this, y, read_only(a), read_only(b));
        else
            for (int j = 0; j < b.cols; ++j)
                detail::product_column(y.data + j * a.rows, a.data, b.data + j * a.cols, a.rows, a.cols);
    }
    template <int most, class Y, class A, class B>
    constexpr void run(const Y& y, const A& a, const B& b) const noexcept {
        if constexpr (is_fixed<Y> && is_fixed<A> && is_fixed<B>) {
            if constexpr (Y::size() > 0)
                detail::product_of_known<most, A::rows, A::cols, B::cols>(y.data, a.data, b.data);
        } else {
            detail::product<most>(y.data, a.data, b.data, a.rows, a.cols, b.cols);
        }
    }
};

/// y = M x + N u: output, update or derivative of a linear system.
struct StateSpace {
    static constexpr const char* name = "bf::kernels::StateSpace{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class M, class N, class X, class U>
    constexpr void operator()(const Y& y, const M& m, const N& n, const X& x, const U& u) const noexcept {
        using T = Element<Y>;
        detail::product(y.data, m.data, x.data, m.rows, m.cols, 1);
        for (int k = 0; k < u.size(); ++k)
            detail::add_scaled<T>(y.data, n.data + k * y.size(), u[k], y.size());
    }
};

/// y = uᵀ.
struct Transpose {
    static constexpr const char* name = "bf::kernels::Transpose{}";
    static constexpr bool chooses_registers = true;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U> constexpr void operator()(const Y& y, const U& u) const noexcept {
        if (is_real<Element<Y>> && u.rows >= 4 && u.cols >= 4)
            run_widest(*this, y, u);
        else
            run<0>(y, u);
    }
    template <int most, class Y, class U> constexpr void run(const Y& y, const U& u) const noexcept {
        detail::transpose<most>(y.data, u.data, u.rows, u.cols);
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

#pragma once

#include "bf/kernels/scalar.hpp"
#include "bf/kernels/view.hpp"

/// Stacking, splitting and picking of elements. Indices are one-based, as in models. A reshape is `Copy`.
/// Kernels that take indices return false when one lies outside; that element then is 0, or is not assigned.
/// `is_move`: each element of the result is an element of an operand, and which one only indices decide.
namespace bf::kernels {

/// y = operands one after the other: vectors into a vector, or matrices of equal height side by side.
struct Concatenate {
    static constexpr const char* name = "bf::kernels::Concatenate{}";
    static constexpr bool is_move = true;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        int next = 0;
        for_each(u, [&](const auto& x) {
            if (x.size() == 1) // most often; a loop would look for vectors of numbers first
                y[next] = x[0];
            else
                for (int i = 0; i < x.size(); ++i) y[next + i] = x[i];
            next += x.size();
        });
    }
};

/// y = part k = 0, 1, ... of the elements of u, all parts being as large as y.
struct PartOf {
    static constexpr const char* name = "bf::kernels::PartOf{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class U, class K>
    constexpr void operator()(const Y& y, const U& u, const K& k) const noexcept {
        const int first = static_cast<int>(k[0]) * y.size();
        for (int i = 0; i < y.size(); ++i) y[i] = u[first + i];
    }
};

/// y = matrices of equal width, one above the other.
struct ConcatenateVertically {
    static constexpr const char* name = "bf::kernels::ConcatenateVertically{}";
    static constexpr bool is_move = true;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        int top = 0;
        for_each(u, [&](const auto& x) {
            for (int j = 0; j < x.cols; ++j)
                for (int i = 0; i < x.rows; ++i) y(top + i, j) = x(i, j);
            top += x.rows;
        });
    }
};

/// y = operands on the diagonal, 0 elsewhere.
struct BlockDiagonal {
    static constexpr const char* name = "bf::kernels::BlockDiagonal{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class L> constexpr void operator()(const Y& y, const L& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = 0;
        int top = 0, left = 0;
        for_each(u, [&](const auto& x) {
            for (int j = 0; j < x.cols; ++j)
                for (int i = 0; i < x.rows; ++i) y(top + i, left + j) = x(i, j);
            top += x.rows;
            left += x.cols;
        });
    }
};

/// The outputs of the list y receive the elements of u one after the other.
struct Split {
    static constexpr const char* name = "bf::kernels::Split{}";
    static constexpr bool is_move = true;
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class L, class U> constexpr void operator()(const L& y, const U& u) const noexcept {
        int next = 0;
        for_each(y, [&](const auto& x) {
            for (int i = 0; i < x.size(); ++i) x[i] = u[next + i];
            next += x.size();
        });
    }
};

namespace detail {
/// Zero-based place of a one-based index, or -1 outside 1 … size.
template <class I> constexpr int place(I index, int size) noexcept {
    if constexpr (is_real<I>) // without its fraction; NaN is in no range
        return index >= I(1) && index < static_cast<I>(size) + I(1) ? static_cast<int>(index) - 1 : -1;
    else
        return index >= I(1) && whole(index) <= size ? static_cast<int>(index) - 1 : -1;
}
} // namespace detail

/// y = index + shift, without the fraction: an index as Select takes it.
struct Place {
    static constexpr const char* name = "bf::kernels::Place{}";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class S, class I>
    constexpr void operator()(const Y& y, const S& shift, const I& index) const noexcept {
        for (int i = 0; i < y.size(); ++i)
            y[i] = static_cast<Element<Y>>(detail::whole(index[pick(i, index.size())])) + shift[0];
    }
};

/// y_i = u(index_i).
struct Select {
    static constexpr const char* name = "bf::kernels::Select{}";
    static constexpr bool is_move = true;
    static constexpr char failure[] = "an index is outside the signal";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class U>
    constexpr bool operator()(const Y& y, const I& index, const U& u) const noexcept {
        bool inside = true;
        for (int i = 0; i < y.size(); ++i) {
            const int p = detail::place(index[i], u.size());
            y[i] = p < 0 ? Element<Y>(0) : u[p];
            inside = inside && p >= 0;
        }
        return inside;
    }
};

/// y_ij = u(row_i, col_j).
struct SelectMatrix {
    static constexpr const char* name = "bf::kernels::SelectMatrix{}";
    static constexpr bool is_move = true;
    static constexpr char failure[] = "an index is outside the matrix";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class J, class U>
    constexpr bool operator()(const Y& y, const I& row, const J& col, const U& u) const noexcept {
        bool inside = true;
        for (int j = 0; j < y.cols; ++j)
            for (int i = 0; i < y.rows; ++i) {
                const int p = detail::place(row[i], u.rows), q = detail::place(col[j], u.cols);
                y(i, j) = p < 0 || q < 0 ? Element<Y>(0) : u(p, q);
                inside = inside && p >= 0 && q >= 0;
            }
        return inside;
    }
};

/// y = the part of u of the size of y whose first element is u(row, col).
struct Submatrix {
    static constexpr const char* name = "bf::kernels::Submatrix{}";
    static constexpr char failure[] = "the submatrix reaches outside the matrix";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class J, class U>
    constexpr bool operator()(const Y& y, const I& row, const J& col, const U& u) const noexcept {
        const int top = detail::place(row[0], u.rows - y.rows + 1);
        const int left = detail::place(col[0], u.cols - y.cols + 1);
        const bool inside = top >= 0 && left >= 0;
        for (int j = 0; j < y.cols; ++j)
            for (int i = 0; i < y.rows; ++i) y(i, j) = inside ? u(top + i, left + j) : Element<Y>(0);
        return inside;
    }
};

/// y = base, then y(index_i) = u_i; a scalar u expands, of equal indices the last wins.
struct Assign {
    static constexpr const char* name = "bf::kernels::Assign{}";
    static constexpr char failure[] = "an index is outside the signal";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class B, class U>
    constexpr bool operator()(const Y& y, const I& index, const B& base, const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = base[pick(i, base.size())];
        bool inside = true;
        for (int i = 0; i < index.size(); ++i) {
            const int p = detail::place(index[i], y.size());
            if (p >= 0) y[p] = u[pick(i, u.size())];
            inside = inside && p >= 0;
        }
        return inside;
    }
};

/// y = base, then y(row_i, col_j) = u_ij; a scalar u expands.
struct AssignMatrix {
    static constexpr const char* name = "bf::kernels::AssignMatrix{}";
    static constexpr char failure[] = "an index is outside the matrix";
    template <class T> static constexpr bool accepts = is_any<T>;
    template <class Y, class I, class J, class B, class U>
    constexpr bool operator()(const Y& y, const I& row, const J& col, const B& base,
                              const U& u) const noexcept {
        for (int i = 0; i < y.size(); ++i) y[i] = base[pick(i, base.size())];
        bool inside = true;
        for (int j = 0; j < col.size(); ++j)
            for (int i = 0; i < row.size(); ++i) {
                const int p = detail::place(row[i], y.rows), q = detail::place(col[j], y.cols);
                if (p >= 0 && q >= 0) y(p, q) = u[pick(i + j * row.size(), u.size())];
                inside = inside && p >= 0 && q >= 0;
            }
        return inside;
    }
};

} // namespace bf::kernels

#pragma once

#include <type_traits>

#ifdef __FAST_MATH__
#error "bf/kernels: -ffast-math changes results; simulation and generated code would differ"
#endif

namespace bf::kernels {

/// Array of rows × cols elements, column by column, extents known at run time. A 1-D signal of n elements
/// is n × 1, a scalar 1 × 1. Copying a view copies no data; T may be const.
template <class T> struct View {
    using value_type = std::remove_const_t<T>;

    T* data = nullptr;
    int rows = 0;
    int cols = 1;

    constexpr View() noexcept = default;
    constexpr View(T* elements, int r, int c = 1) noexcept : data(elements), rows(r), cols(c) {}
    /// View<T> reads as View<const T>.
    template <class S, class = std::enable_if_t<std::is_same_v<const S, T>>>
    constexpr View(const View<S>& v) noexcept : data(v.data), rows(v.rows), cols(v.cols) {}

    constexpr int size() const noexcept { return rows * cols; }
    constexpr T& operator[](int i) const noexcept { return data[i]; }
    constexpr T& operator()(int i, int j) const noexcept { return data[i + j * rows]; }
    constexpr View col(int j) const noexcept { return {data + j * rows, rows, 1}; }
};

/// The same with extents known to the compiler; `FixedView<double, 3>{p}` is a vector.
template <class T, int R, int C = 1> struct FixedView {
    using value_type = std::remove_const_t<T>;
    static constexpr int rows = R;
    static constexpr int cols = C;

    T* data = nullptr;

    constexpr FixedView() noexcept = default;
    constexpr explicit FixedView(T* elements) noexcept : data(elements) {}

    static constexpr int size() noexcept { return R * C; }
    constexpr T& operator[](int i) const noexcept { return data[i]; }
    constexpr T& operator()(int i, int j) const noexcept { return data[i + j * R]; }
    constexpr FixedView<T, R> col(int j) const noexcept { return FixedView<T, R>{data + j * R}; }
    constexpr operator View<T>() const noexcept { return {data, R, C}; }
};

/// Are the extents of this view known to the compiler?
template <class V> inline constexpr bool is_fixed = false;
template <class T, int R, int C> inline constexpr bool is_fixed<FixedView<T, R, C>> = true;

/// A view by which nothing is written: what only reads is compiled for it alone.
template <class T> constexpr View<const T> read_only(const View<T>& v) noexcept { return v; }
template <class T, int R, int C>
constexpr FixedView<const T, R, C> read_only(const FixedView<T, R, C>& v) noexcept {
    return FixedView<const T, R, C>{v.data};
}

/// A variable number of operands: points at an array of views which the caller keeps.
template <class T> struct ListView {
    using value_type = std::remove_const_t<T>;

    const View<T>* views = nullptr;
    int count = 0;

    constexpr ListView() noexcept = default;
    constexpr ListView(const View<T>* first, int n) noexcept : views(first), count(n) {}
    template <int N> constexpr ListView(const View<T> (&array)[N]) noexcept : views(array), count(N) {}

    constexpr int size() const noexcept { return count; }
    constexpr const View<T>& operator[](int i) const noexcept { return views[i]; }
};

/// The same of scalars, N of them if it is greater than 0.
template <class T, int N = 0> struct ScalarListView {
    using value_type = std::remove_const_t<T>;

    const View<T>* views = nullptr;
    int count = 0;

    constexpr int size() const noexcept { return N > 0 ? N : count; }
    constexpr FixedView<T, 1> operator[](int i) const noexcept { return FixedView<T, 1>{views[i].data}; }
};

/// f(view) for each operand of a list in its order. A list whose operands have extents that the compiler
/// knows does it by itself.
template <class L, class F> constexpr auto for_each(const L& u, F&& f) noexcept -> decltype(u.for_each(f)) {
    u.for_each(f);
}
template <class T, class F> constexpr void for_each(const ListView<T>& u, F&& f) noexcept {
    for (int k = 0; k < u.size(); ++k) f(u[k]);
}

/// Type of the elements of a view or of a list, without const.
template <class V> using Element = typename V::value_type;

/// The type in which elements of these operands are computed together: double if one of them is. Code of
/// single precision has none, and no processor emulates it.
template <class... V> using Computed = std::common_type_t<Element<V>...>;

/// Index of element i in an operand of `size` elements, where a scalar stands for all elements.
constexpr int pick(int i, int size) noexcept { return size == 1 ? 0 : i; }

} // namespace bf::kernels

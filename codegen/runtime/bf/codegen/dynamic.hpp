// Quantities whose sizes are known when the program starts.
#pragma once

#include "bf/codegen/views.hpp"

#include <limits>
#include <vector>

namespace bf::generated {

/// Elements in memory that the model owns; bound once, before the first step.
template <class T> struct Dynamic {
    T* data = nullptr;
    int rows = 0, cols = 0;
    int size() const noexcept { return rows * cols; }
};

template <class T> kernels::View<const T> in(const Dynamic<T>& x) noexcept {
    return {x.data, x.rows, x.cols};
}
template <class T> kernels::View<T> out(Dynamic<T>& x) noexcept { return {x.data, x.rows, x.cols}; }

/// The operands of a kernel that takes a list.
template <class T, int N> struct DynamicList {
    using value_type = std::remove_const_t<T>;
    kernels::View<T> views[N];
    static constexpr int size() noexcept { return N; }
    const kernels::View<T>& operator[](int k) const noexcept { return views[k]; }
    template <class F> void for_each(F&& f) const noexcept {
        for (const auto& view : views) f(view);
    }
};
template <class T, class... V> auto list(const kernels::View<T>& first, const V&... others) noexcept {
    return DynamicList<T, 1 + int(sizeof...(V))>{{first, others...}};
}

/// As many elements of a control signal, not looked at yet.
inline void forget(std::vector<double>& x, int count) {
    x.assign(static_cast<std::size_t>(count), std::numeric_limits<double>::quiet_NaN());
}

/// state = next, but false when an element is not a number.
template <class T> bool commit(Dynamic<T>& state, const Dynamic<T>& next) noexcept {
    for (int i = 0; i < next.size(); ++i)
        if (next.data[i] != next.data[i]) return false;
    for (int i = 0; i < next.size(); ++i) state.data[i] = next.data[i];
    return true;
}

} // namespace bf::generated

// How generated code hands its data to kernels.
#pragma once

#include "bf/kernels/view.hpp"
#include "bf/program/step.hpp"

#include <cstring>
#include <limits>
#include <new>
#include <type_traits>

namespace bf::generated {

/// R x C elements, column by column. One column is an ordinary array, one element an ordinary variable.
template <class T, int R, int C> struct Matrix { T data[R * C]; };

template <class T> inline constexpr bool is_one_number = std::is_arithmetic_v<T>;
template <class T> using IfNumber = std::enable_if_t<is_one_number<T>>;

/// What a kernel reads.
template <class T, class = IfNumber<T>> constexpr kernels::FixedView<const T, 1> in(const T& x) noexcept {
    return kernels::FixedView<const T, 1>{&x};
}
template <class T, int N> constexpr kernels::FixedView<const T, N> in(const T (&x)[N]) noexcept {
    return kernels::FixedView<const T, N>{x};
}
template <class T, int R, int C>
constexpr kernels::FixedView<const T, R, C> in(const Matrix<T, R, C>& x) noexcept {
    return kernels::FixedView<const T, R, C>{x.data};
}

/// What a kernel writes.
template <class T, class = IfNumber<T>> constexpr kernels::FixedView<T, 1> out(T& x) noexcept {
    return kernels::FixedView<T, 1>{&x};
}
template <class T, int N> constexpr kernels::FixedView<T, N> out(T (&x)[N]) noexcept {
    return kernels::FixedView<T, N>{x};
}
template <class T, int R, int C> constexpr kernels::FixedView<T, R, C> out(Matrix<T, R, C>& x) noexcept {
    return kernels::FixedView<T, R, C>{x.data};
}

/// The same elements as R x C.
template <int R, int C, class T, int M, int N>
constexpr kernels::FixedView<T, R, C> reshaped(const kernels::FixedView<T, M, N>& x) noexcept {
    static_assert(R * C == M * N);
    return kernels::FixedView<T, R, C>{x.data};
}
/// An operand without elements.
template <class T, int R, int C> constexpr kernels::FixedView<T, R, C> empty() noexcept {
    return kernels::FixedView<T, R, C>{};
}

/// The operands of a kernel that takes a list: their extents are constants of the type.
template <class T, class... V> struct List {
    using value_type = std::remove_const_t<T>;
    T* data[sizeof...(V)];
    static constexpr int size() noexcept { return sizeof...(V); }
    constexpr kernels::View<T> operator[](int k) const noexcept {
        constexpr int rows[] = {V::rows...}, cols[] = {V::cols...};
        return {data[k], rows[k], cols[k]};
    }
    template <class F> constexpr void for_each(F&& f) const noexcept {
        int k = 0;
        (f(kernels::FixedView<T, V::rows, V::cols>{data[k++]}), ...);
    }
};
template <class T, int R, int C, class... V>
constexpr List<T, kernels::FixedView<T, R, C>, V...> list(const kernels::FixedView<T, R, C>& first,
                                                          const V&... others) noexcept {
    return {{first.data, others.data...}};
}

/// An operand of whole numbers that the model fixes, e.g. signs or indices.
template <class T, int... N> struct WholeNumbers {
    using value_type = T;
    static constexpr T data[] = {T(N)...};
    static constexpr int rows = sizeof...(N), cols = 1;
    static constexpr int size() noexcept { return rows; }
    constexpr const T& operator[](int i) const noexcept { return data[i]; }
    constexpr const T& operator()(int i, int) const noexcept { return data[i]; }
    constexpr operator kernels::View<const T>() const noexcept { return {data, rows, cols}; }
};
template <class T, int... N> constexpr WholeNumbers<T, N...> numbers() noexcept { return {}; }

/// Does the kernel choose the registers of the processor itself (bf/kernels/lanes.hpp)?
template <class Kernel, class = void> inline constexpr bool chooses_registers = false;
template <class Kernel>
inline constexpr bool chooses_registers<Kernel, std::void_t<decltype(Kernel::chooses_registers)>> = true;
template <class View> inline constexpr bool is_one_element = false;
template <class T> inline constexpr bool is_one_element<kernels::FixedView<T, 1>> = true;
/// What scales by one element chooses nothing.
template <bool chooses, class Kernel, class... Views>
using IfChooses =
    std::enable_if_t<(chooses_registers<Kernel> && !(is_one_element<Views> || ...)) == chooses, int>;

/// Runs a kernel out of line: one copy for all calls with the same kernel, types and extents. On x86-64 there
/// is a second one with vectors of 32 bytes; which one runs is decided when the program is loaded. Both round
/// alike, for contraction is off.
template <class Kernel, class... Views, IfChooses<false, Kernel, Views...> = 0>
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__OPTIMIZE__) && !defined(__clang__)
[[gnu::noinline, gnu::flatten, gnu::target_clones("default", "arch=x86-64-v3")]]
#else
[[gnu::noinline]]
#endif
auto call(Kernel kernel, Views... views) noexcept {
    return kernel(views...);
}
template <class Kernel, class... Views, IfChooses<true, Kernel, Views...> = 0>
[[gnu::noinline]] auto call(Kernel kernel, Views... views) noexcept {
    return kernel(views...);
}

template <class V> using Writable = typename V::value_type;

/// x as it is declared, without a second one on the stack.
template <class T> void renew(T& x) noexcept { ::new (static_cast<void*>(&x)) T(); }

/// to = from; one element expands.
template <class To, class From> void assign(To& to, const From& from) noexcept {
    auto target = out(to);
    const auto source = in(from);
    if constexpr (std::is_same_v<To, From> && kernels::is_fixed<decltype(target)> &&
                  std::is_trivially_copyable_v<To>)
        std::memcpy(target.data, source.data, sizeof to); // loops of long signals take three times as long
    else
        for (int i = 0; i < target.size(); ++i)
            target[i] = static_cast<Writable<decltype(target)>>(source[kernels::pick(i, source.size())]);
}

/// state = next, but false when an element is not a number.
template <class T> bool commit(T& state, const T& next) noexcept {
    const auto x = in(next);
    bool is_number = true;
    for (int i = 0; i < x.size(); ++i) is_number = is_number && !(x[i] != x[i]);
    if (is_number) state = next;
    return is_number;
}
template <class T, int N> bool commit(T (&state)[N], const T (&next)[N]) noexcept {
    bool is_number = true;
    for (int i = 0; i < N; ++i) is_number = is_number && !(next[i] != next[i]);
    if (is_number)
        for (int i = 0; i < N; ++i) state[i] = next[i];
    return is_number;
}

/// A structure whose members are all of type T as one array.
template <class T, class Structure> T* elements(Structure& x) noexcept {
    static_assert(std::is_standard_layout_v<Structure> && alignof(Structure) == alignof(T));
    return reinterpret_cast<T*>(&x);
}

/// Is every element a number, and finite?
template <class T> bool is_finite(const T& signal) noexcept {
    const auto x = in(signal);
    bool value = true;
    for (int i = 0; i < x.size(); ++i) value = value && x[i] - x[i] == 0;
    return value;
}

/// Is some element above 0? What an enabled subsystem asks.
template <class T> bool is_positive(const T& signal) noexcept {
    const auto x = in(signal);
    bool value = false;
    for (int i = 0; i < x.size(); ++i) value = value || x[i] > 0;
    return value;
}

/// x := NaN: not looked at yet, or not running.
template <class T> void forget(T* x, int count) noexcept {
    for (int i = 0; i < count; ++i) x[i] = std::numeric_limits<T>::quiet_NaN();
}

/// Has some element of a control signal such an edge since the last look? The first look only remembers; a
/// level counts at once.
template <program::Edge edge, class T> bool has_edge(const T& signal, double* before) noexcept {
    const auto x = in(signal);
    bool found = false;
    for (int i = 0; i < x.size(); ++i) {
        const double now = static_cast<double>(x[i]);
        found = found || program::is_edge(edge, before[i], now);
        before[i] = now;
    }
    return found;
}

/// before := the values of zero-crossing functions; guards := +1 where one rose through 0 since then, -1
/// where it fell, else 0. True if one did.
template <class T> bool find_crossings(T* guards, T* before, int count) noexcept {
    bool found = false;
    for (int i = 0; i < count; ++i) {
        const T last = before[i], now = guards[i];
        before[i] = now;
        guards[i] = static_cast<T>(program::crossing(last, now));
        found = found || guards[i] != 0;
    }
    return found;
}
/// What a solver of the caller looks at of a mark: itself; of a count 1, and -1 where it is not what it was.
/// Behind the last.
template <class T> double* look_at_mark(const T& now, const T& before, double* to) noexcept {
    const auto x = in(now), last = in(before);
    for (int i = 0; i < x.size(); ++i)
        *to++ = std::is_floating_point<std::decay_t<decltype(x[i])>>::value ? static_cast<double>(x[i])
                : x[i] == last[i]                                           ? 1.0
                                                                            : -1.0;
    return to;
}

/// The same of a control signal. Subsystems run above 0, so 0 lies on the other side; NaN where what is
/// around them does not run.
template <class T> double* look_at_control(const T& signal, bool is_watched, double* to) noexcept {
    const auto x = in(signal);
    constexpr double zero = std::is_floating_point<std::decay_t<decltype(x[0])>>::value ? -1e-100 : -1.0;
    for (int i = 0; i < x.size(); ++i)
        *to++ = !is_watched ? std::numeric_limits<double>::quiet_NaN()
                : x[i] == 0 ? zero
                            : static_cast<double>(x[i]);
    return to;
}

template <class T> bool has_crossed(const T& guard) noexcept {
    const auto x = in(guard);
    bool found = false;
    for (int i = 0; i < x.size(); ++i) found = found || x[i] != 0;
    return found;
}

template <class Kernel, class = void> struct FailureOf {
    static constexpr const char* text = "the result is not defined for these inputs";
};
template <class Kernel> struct FailureOf<Kernel, std::void_t<decltype(Kernel::failure)>> {
    static constexpr const char* text = Kernel::failure;
};
/// What is wrong when the kernel returns false.
template <class Kernel> constexpr const char* failure_of(Kernel) noexcept { return FailureOf<Kernel>::text; }

} // namespace bf::generated

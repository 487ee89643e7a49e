#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

/// Elements side by side in one register of the processor. Arithmetic on it is that of its elements, with the
/// same bits; compilers left to themselves vectorise along sums instead, by loads of single elements.
namespace bf::kernels {

namespace detail {
/// Bytes of the widest register that this code may use.
#if defined(__AVX512F__)
inline constexpr int widest = 64;
#elif defined(__AVX__)
inline constexpr int widest = 32;
#elif defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
inline constexpr int widest = 16;
#else
inline constexpr int widest = 0;
#endif

template <class T, int R> constexpr int bytes_of_a_register(int most) noexcept {
    const int bytes = R * static_cast<int>(sizeof(T));
    if (!std::is_floating_point_v<T> || sizeof(T) > 8) return 0;
    for (int width = 64; width >= 16; width /= 2)
        if (most >= width && bytes % width == 0) return width;
    return 0;
}
} // namespace detail

/// How to hold R elements T: in registers of at most `most` bytes, `count` elements each, R a multiple of it.
template <class T, int R, int most = detail::widest, class = void> struct Lanes {
    using type = T;
    static constexpr int count = 1;
    static constexpr void load(type& x, const T* from) noexcept { x = *from; }
    static constexpr void store(T* to, const T& x) noexcept { *to = x; }
};

#ifdef __GNUC__
template <class T, int R, int most>
struct Lanes<T, R, most, std::enable_if_t<(detail::bytes_of_a_register<T, R>(most) > 0)>> {
    typedef T type __attribute__((vector_size(detail::bytes_of_a_register<T, R>(most))));
    static constexpr int count = detail::bytes_of_a_register<T, R>(most) / static_cast<int>(sizeof(T));
    static void load(type& x, const T* from) noexcept { std::memcpy(&x, from, sizeof x); }
    static void store(T* to, const type& x) noexcept { std::memcpy(to, &x, sizeof x); }
};
#endif

#if defined(__GNUC__) && defined(__x86_64__) && !defined(__AVX__)
namespace detail {
/// Compiled for processors with AVX-512 or AVX2, all that they call included.
template <class Kernel, class... X>
__attribute__((target("avx512f,avx512vl,avx512dq"), flatten)) auto with_avx512(const Kernel& kernel,
                                                                               const X&... x) noexcept {
    return kernel.template run<64>(x...);
}
template <class Kernel, class... X>
__attribute__((target("avx2"), flatten)) auto with_avx2(const Kernel& kernel, const X&... x) noexcept {
    return kernel.template run<32>(x...);
}
} // namespace detail
#endif

/// kernel.run<most>(x...) for the widest registers that the processor has, though the compiler was told of
/// none: products and solutions then take half or a quarter of the time, with the same bits. Processors
/// without VBMI2 that have AVX-512 lower their clock where it is used.
template <class Kernel, class... X> auto run_widest(const Kernel& kernel, const X&... x) noexcept {
#if defined(__GNUC__) && defined(__x86_64__) && !defined(__AVX__)
    if (__builtin_cpu_supports("avx512vbmi2")) return detail::with_avx512(kernel, x...);
    if (__builtin_cpu_supports("avx2")) return detail::with_avx2(kernel, x...);
#endif
    return kernel.template run<detail::widest>(x...);
}

namespace detail {
/// Are C elements 0, `next` apart? Asked of their bits at once, as comparisons of numbers take longer than
/// the products that zeros save.
template <int C, class T> constexpr bool are_zero(const T* x, int next) noexcept {
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, float>) {
        using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
        Bits any = 0;
#pragma GCC unroll 4
        for (int c = 0; c < C; ++c) {
            Bits bits = 0;
            std::memcpy(&bits, x + c * next, sizeof bits);
            any |= bits;
        }
        return any << 1 == 0; // but for the sign
    } else {
        bool all = true;
        for (int c = 0; c < C; ++c) all = all && x[c * next] == T(0);
        return all;
    }
}
} // namespace detail

/// A function, compiled once more for the widest registers that the processor has, with the same bits.
template <auto function> struct Widest;
template <class R, class... X, R (*function)(X...)> struct Widest<function> {
    using Function = R (*)(X...);
#if defined(__GNUC__) && defined(__x86_64__) && !defined(__AVX__)
    __attribute__((target("avx2"), flatten)) static R with_avx2(X... x) { return function(x...); }
    static Function get() noexcept { return __builtin_cpu_supports("avx2") ? with_avx2 : function; }
#else
    static Function get() noexcept { return function; }
#endif
};

} // namespace bf::kernels

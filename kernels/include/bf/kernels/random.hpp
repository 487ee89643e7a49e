#pragma once

#include "bf/kernels/functions.hpp"

/// Random numbers without a hidden state: number k of element i is a function of (seed, k, i), the same on
/// every machine.
namespace bf::kernels {

/// Philox4x32-10: four random words from a counter of four words and a key of two. Source: Salmon, Moraes,
/// Dror, Shaw, Parallel Random Numbers: As Easy as 1, 2, 3, SC'11.
struct Philox {
    std::uint32_t word[4];

    constexpr Philox(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3, std::uint32_t k0,
                     std::uint32_t k1) noexcept
        : word{c0, c1, c2, c3} {
        for (int round = 0; round < 10; ++round) {
            const std::uint64_t a = std::uint64_t(0xD2511F53u) * word[0];
            const std::uint64_t b = std::uint64_t(0xCD9E8D57u) * word[2];
            const std::uint32_t w1 = word[1], w3 = word[3];
            word[0] = static_cast<std::uint32_t>(b >> 32) ^ w1 ^ k0;
            word[1] = static_cast<std::uint32_t>(b);
            word[2] = static_cast<std::uint32_t>(a >> 32) ^ w3 ^ k1;
            word[3] = static_cast<std::uint32_t>(a);
            k0 += 0x9E3779B9u;
            k1 += 0xBB67AE85u;
        }
    }
    /// In [0, 1), a multiple of 2^-53, from the words 0 and 1 or 2 and 3; of 2^-24 from word 0 or 2 in single
    /// precision.
    template <class T> constexpr T uniform(int pair) const noexcept {
        if constexpr (std::is_same_v<T, float>)
            return static_cast<float>(word[2 * pair] >> 8) / 16777216.0f;
        else
            return (static_cast<double>(word[2 * pair] >> 5) * 67108864.0 +
                    static_cast<double>(word[2 * pair + 1] >> 6)) /
                   9007199254740992.0;
    }
};

namespace detail {
/// The words for element i; count = [low high] is the number of draws so far.
template <class S, class N> constexpr Philox draw(const S& seed, const N& count, int i) noexcept {
    return {count[0], count[1], static_cast<std::uint32_t>(i), 0, seed[0], 0};
}
} // namespace detail

/// y uniform in [minimum, maximum).
struct RandomUniform {
    static constexpr const char* name = "bf::kernels::RandomUniform{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class L, class H, class S, class N>
    constexpr void operator()(const Y& y, const L& minimum, const H& maximum, const S& seed,
                              const N& count) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            using T = Computed<L, H>;
            const T low = minimum[pick(i, minimum.size())], high = maximum[pick(i, maximum.size())];
            const T part = detail::draw(seed, count, i).template uniform<T>(0);
            y[i] = static_cast<Element<Y>>(low + (high - low) * part);
        }
    }
};

/// y normal with the given mean and standard deviation = √(power / period), or √power where period is 0:
/// y = mean + σ √(-2 ln(1 - u₁)) cos 2πu₂. Source: Box, Muller, Ann. Math. Stat. 29 (1958) 610-611.
struct RandomNormal {
    static constexpr const char* name = "bf::kernels::RandomNormal{}";
    template <class T> static constexpr bool accepts = is_real<T>;
    template <class Y, class M, class P, class T, class S, class N>
    void operator()(const Y& y, const M& mean, const P& power, const T& period, const S& seed,
                    const N& count) const noexcept {
        for (int i = 0; i < y.size(); ++i) {
            const Philox words = detail::draw(seed, count, i);
            using R = Computed<M, P>;
            const R radius = std::sqrt(R(-2) * Log::apply<R>(R(1) - words.uniform<R>(0)));
            const R angle = R(2) * pi<R> * words.uniform<R>(1);
            const R p = power[pick(i, power.size())];
            const R sigma = std::sqrt(period[0] > 0 ? p / period[0] : p);
            y[i] =
                static_cast<Element<Y>>(mean[pick(i, mean.size())] + sigma * radius * Cos::apply<R>(angle));
        }
    }
};

/// next = count + 1 in 64 bits, [low high].
struct NextDraw {
    static constexpr const char* name = "bf::kernels::NextDraw{}";
    template <class Y, class X> constexpr void operator()(const Y& next, const X& count) const noexcept {
        next[0] = count[0] + 1;
        next[1] = count[1] + (next[0] == 0);
    }
};

} // namespace bf::kernels

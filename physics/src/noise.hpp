#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace bf::physics {

/// 64 well mixed bits of a counter (SplitMix64, Steele, Lea and Flood 2014).
inline std::uint64_t mix(std::uint64_t counter) noexcept {
    std::uint64_t z = counter + 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/// Sample of (0, 1) that is spread evenly over it.
inline double uniform(std::uint64_t bits) noexcept {
    return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53;
}

/// Key of a sample that depends on its arguments alone.
inline std::uint64_t key_of(std::uint64_t seed, std::uint64_t step, std::uint64_t channel) noexcept {
    return mix(mix(mix(seed) ^ step) ^ channel);
}

/// Standard normal sample that depends on its arguments alone (Box-Muller on two mixed counters).
inline double gaussian(std::uint64_t seed, std::uint64_t step, std::uint64_t channel) noexcept {
    const std::uint64_t key = key_of(seed, step, channel);
    return std::sqrt(-2.0 * std::log(uniform(key))) * std::cos(2.0 * std::numbers::pi * uniform(mix(key)));
}

} // namespace bf::physics

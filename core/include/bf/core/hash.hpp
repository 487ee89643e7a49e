// A number that stands for bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace bf {

/// FNV-1a, 64 bits (Fowler, Noll, Vo), going on from `hash`.
constexpr std::uint64_t fnv1a(std::span<const std::byte> bytes, std::uint64_t hash = 0xcbf29ce484222325) {
    for (const std::byte b : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(b)) * 0x100000001b3;
    return hash;
}

/// Eight bytes at once, going on from `hash`: each step is one to one in both. The odd factor is 2^64 over
/// the golden ratio (D. E. Knuth, The Art of Computer Programming 3, 6.4).
constexpr std::uint64_t hash_word(std::uint64_t word, std::uint64_t hash) {
    hash = (hash ^ word) * 0x9e3779b97f4a7c15;
    return hash ^ hash >> 32;
}

/// A whole number of 32 bits that a name decides: the same in every program, seldom the same for two names.
inline std::uint32_t number_of_name(std::string_view name) {
    const std::uint64_t hash = fnv1a(std::as_bytes(std::span(name.data(), name.size())));
    return static_cast<std::uint32_t>(hash ^ hash >> 32);
}

} // namespace bf

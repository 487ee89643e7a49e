// A number that stands for bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace bf {

/// FNV-1a, 64 bits (Fowler, Noll, Vo), going on from `hash`.
constexpr std::uint64_t fnv1a(std::span<const std::byte> bytes, std::uint64_t hash = 0xcbf29ce484222325) {
    for (const std::byte b : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(b)) * 0x100000001b3;
    return hash;
}

} // namespace bf

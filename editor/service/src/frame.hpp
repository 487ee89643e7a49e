#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace bf::service {

constexpr std::size_t first_world = std::size_t{1} << 31; ///< index of the first world; signals come before

template <class T> void append(std::string& frame, const T& value) {
    frame.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Begins a piece of a binary frame; `elements` doubles follow.
inline void append_piece(std::string& frame, std::uint32_t index, int branch, std::size_t elements,
                         double time) {
    append(frame, index);
    append(frame, static_cast<std::uint32_t>(branch));
    append(frame, static_cast<std::uint32_t>(elements));
    append(frame, time);
}

} // namespace bf::service

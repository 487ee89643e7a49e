// Texts that come from outside, as messages of a Status.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace bf {

/// Keeps as much of a text as there is room for, so that Status::failure takes it from there. Braces, which
/// stand for numbers in such a message, become parentheses. For use in a step, too.
template <std::size_t N> void keep_text(char (&kept)[N], std::string_view text) noexcept {
    const auto end =
        std::transform(text.begin(), text.begin() + std::min(text.size(), N - 1), kept, [](char c) {
            return c == '{' ? '(' : c == '}' ? ')' : c;
        });
    *end = '\0';
}

} // namespace bf

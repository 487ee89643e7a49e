#include "bf/base/escape.hpp"

#include <algorithm>
#include <cstdio>

namespace bf::escape {

namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }

/// A character: its bytes, and its code; -1: the byte is not UTF-8.
struct Character {
    std::string_view bytes;
    int code;
    /// Does it change the direction of the text, so that a reader sees another order than a compiler? (N.
    /// Boucher and R. Anderson, "Trojan Source", USENIX Security 2023.)
    bool is_directional() const {
        return (code >= 0x202a && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069) || code == 0x200e ||
               code == 0x200f || code == 0x061c;
    }
    /// A break of lines outside ASCII, or a control character of C1.
    bool is_break() const { return code == 0x2028 || code == 0x2029 || (code >= 0x80 && code < 0xa0); }
};

Character first_of(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const std::size_t size = byte(0) < 0x80       ? 1
                             : byte(0) >> 5 == 6  ? 2
                             : byte(0) >> 4 == 14 ? 3
                             : byte(0) >> 3 == 30 ? 4
                                                  : 0;
    if (size == 0 || size > text.size()) return {text.substr(0, 1), -1};
    int code = size == 1 ? byte(0) : byte(0) & (0x7f >> size);
    for (std::size_t i = 1; i < size; ++i) {
        if (byte(i) >> 6 != 2) return {text.substr(0, 1), -1};
        code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr int least[] = {0, 0, 0x80, 0x800, 0x10000};
    const bool is_surrogate = code >= 0xd800 && code < 0xe000;
    if (code < least[size] || code > 0x10ffff || is_surrogate) return {text.substr(0, 1), -1};
    return {text.substr(0, size), code};
}

template <class F> void for_each_character(std::string_view text, F&& f) {
    while (!text.empty()) {
        const Character character = first_of(text);
        f(character);
        text.remove_prefix(character.bytes.size());
    }
}

template <class... Values> std::string formatted(const char* format, Values... values) {
    char text[32];
    std::snprintf(text, sizeof text, format, values...);
    return text;
}

/// Between quotes, with what `special` gives instead of a byte; an empty text: the byte itself.
template <class F> std::string quoted(std::string_view text, char quote, F&& special) {
    std::string result(1, quote);
    for (const char c : text) {
        const std::string instead = special(c);
        instead.empty() ? result += c : result += instead;
    }
    return result + quote;
}

} // namespace

std::string cpp(std::string_view text) {
    std::string result = "\"";
    for_each_character(text, [&](const Character& character) {
        const char c = character.bytes[0];
        if (c == '"' || c == '\\' || (c == '?' && result.ends_with('?')))
            result += std::string("\\") + c;
        else if (is_control(c) || character.code < 0 || character.is_directional() || character.is_break())
            for (const char byte : character.bytes)
                result += formatted("\\%03o", static_cast<unsigned>(static_cast<unsigned char>(byte)));
        else
            result += character.bytes;
    });
    return result + "\"";
}

std::string comment(std::string_view text) {
    std::string line;
    for_each_character(text, [&](const Character& character) {
        const char c = character.bytes[0];
        // A backslash would join lines, and two question marks begin a trigraph.
        if (c == '?' && line.ends_with('?')) line += ' ';
        if ((c == '/' || c == '\\') && line.ends_with('*')) line += ' ';
        if (c == '*' && line.ends_with('/')) line += ' ';
        if (character.is_directional()) return;
        if (is_control(c) || character.is_break())
            line += ' ';
        else if (character.code < 0)
            line += "\xef\xbf\xbd"; // U+FFFD
        else if (c == '\\')
            line += '/';
        else
            line += character.bytes;
    });
    return line;
}

std::string python(std::string_view text) {
    std::string result = "\"";
    for_each_character(text, [&](const Character& character) {
        const char c = character.bytes[0];
        if (c == '"' || c == '\\')
            result += std::string("\\") + c;
        else if (character.code < 0)
            result += "\\ufffd";
        else if (is_control(c) || character.is_directional() || character.is_break())
            result += formatted("\\u%04x", static_cast<unsigned>(character.code));
        else
            result += character.bytes;
    });
    return result + "\"";
}

std::string shell(std::string_view text) {
    return quoted(text, '\'', [](char c) { return c == '\'' ? "'\\''" : ""; });
}

std::string cmake(std::string_view text) {
    return quoted(text, '"', [](char c) -> std::string {
        if (c == '\r') return "\\r"; // files are read with any ends of lines
        return std::string_view("\\\"$@").find(c) != std::string_view::npos ? std::string("\\") + c : "";
    });
}

std::string gnuplot(std::string_view text) {
    // Of a quote after a quote gnuplot makes the end of the string, so each is a string of its own.
    return quoted(text, '\'', [](char c) { return c == '\'' ? "'.\"'\".'" : is_control(c) ? " " : ""; });
}

std::string xml(std::string_view text) {
    std::string result;
    for_each_character(text, [&](const Character& character) {
        switch (character.bytes[0]) {
        case '&': result += "&amp;"; return;
        case '<': result += "&lt;"; return;
        case '>': result += "&gt;"; return;
        case '"': result += "&quot;"; return;
        case '\'': result += "&#39;"; return;
        default: break;
        }
        // XML has no place for U+FFFE, U+FFFF and most control characters.
        const bool is_none = character.code == 0xfffe || character.code == 0xffff || character.is_break() ||
                             character.is_directional() ||
                             (character.code >= 0 && is_control(character.bytes[0]));
        if (character.code < 0)
            result += "\xef\xbf\xbd"; // the replacement character
        else
            result += is_none ? std::string_view(" ") : character.bytes;
    });
    return result;
}

std::string csv(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
    return quoted(text, '"', [](char c) { return c == '"' ? "\"\"" : ""; });
}

std::string matlab(std::string_view text) {
    return quoted(text, '\'', [](char c) { return c == '\'' ? "''" : is_control(c) ? " " : ""; });
}

std::string markdown(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (std::string_view("|*<\\[").find(c) != std::string_view::npos) result += '\\';
        result += is_control(c) ? ' ' : c;
    }
    return result;
}

std::string markdown_code(std::string_view text) {
    if (text.empty()) return "";
    // The fence is longer than any row of backticks inside (CommonMark 0.31, 6.1).
    std::size_t longest = 0, row = 0;
    std::string inside;
    for (const char c : text) {
        row = c == '`' ? row + 1 : 0;
        longest = std::max(longest, row);
        if (c == '|') inside += '\\';
        inside += is_control(c) ? ' ' : c;
    }
    const std::string fence(longest + 1, '`');
    const bool needs_room = text.front() == '`' || text.back() == '`';
    return fence + (needs_room ? " " + inside + " " : inside) + fence;
}

std::string uri(std::string_view path) {
    constexpr std::string_view digits = "0123456789ABCDEF";
    std::string text;
    for (const char c : path) {
        const auto byte = static_cast<unsigned char>(c);
        const bool is_plain = (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') ||
                              (byte >= '0' && byte <= '9') ||
                              std::string_view("-._~/").find(c) != std::string_view::npos;
        if (is_plain)
            text += c;
        else
            (text += '%') += {digits[byte >> 4u], digits[byte & 15u]};
    }
    return text;
}

std::string file_name(std::string_view text) {
    std::string result;
    for_each_character(text, [&](const Character& character) {
        const bool is_bad = character.code < 0 || is_control(character.bytes[0]) ||
                            character.bytes[0] == '/' || character.is_directional() || character.is_break();
        const std::string_view part = is_bad ? "_" : character.bytes;
        if (result.size() + part.size() <= 120) result += part;
    });
    return result;
}

std::string terminal(std::string_view text) {
    std::string result;
    for_each_character(text, [&](const Character& character) {
        const char c = character.bytes[0];
        const bool is_plain =
            c == '\n' || c == '\t' ||
            (!is_control(c) && character.code >= 0 && !character.is_directional() && !character.is_break());
        if (is_plain)
            result += character.bytes;
        else
            for (const char byte : character.bytes)
                result += formatted("<%02x>", static_cast<unsigned>(static_cast<unsigned char>(byte)));
    });
    return result;
}

std::string shortened(std::string_view text, std::size_t most) {
    if (text.size() <= most) return std::string(text);
    // A byte 10xxxxxx continues a character of UTF-8.
    const auto begins_inside = [&](std::size_t at) { return (text[at] & 0xC0) == 0x80; };
    std::size_t head = most * 3 / 4, tail = text.size() - most / 4;
    while (head > 0 && begins_inside(head)) --head;
    while (tail < text.size() && begins_inside(tail)) ++tail;
    return std::string(text.substr(0, head)) + " ... (" + std::to_string(text.size()) + " bytes) ... " +
           std::string(text.substr(tail));
}

} // namespace bf::escape

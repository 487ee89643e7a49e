#include "scalar.hpp"

#include <algorithm>
#include <array>

namespace bf::formats {

bool is_plain(std::string_view text, bool flow) {
    if (text.empty() || text.front() == ' ' || text.back() == ' ' || text.back() == ':') return false;
    const std::array<std::string_view, 4> nulls = {"~", "null", "Null", "NULL"};
    if (std::ranges::find(nulls, text) != nulls.end() || text.starts_with("---") || text.starts_with("..."))
        return false;
    const char first = text[0], second = text.size() > 1 ? text[1] : ' ';
    const std::string_view never_first = ",[]{}#&*!|>'\"%@`", first_if_joined = "-?:";
    if (never_first.find(first) != never_first.npos) return false;
    if (first_if_joined.find(first) != first_if_joined.npos && (second == ' ' || flow)) {
        if (first != '-' || second == ' ' || second == ',') return false;
    }
    if (text.find(": ") != text.npos || text.find(" #") != text.npos) return false;
    if (flow && text.find_first_of(",[]{}?") != text.npos) return false;
    return std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

bool is_literal(std::string_view text) {
    if (text.empty() || text[0] == '\n' || text[0] == ' ' || text.ends_with("\n\n")) return false;
    for (std::size_t line = 0; line < text.size();) {
        const std::size_t end = std::min(text.find('\n', line), text.size());
        const std::string_view content = text.substr(line, end - line);
        if (!content.empty() && (content.find_first_not_of(" \t") == content.npos || content[0] == '\t'))
            return false;
        line = end + 1;
    }
    return std::ranges::none_of(
        text, [](unsigned char c) { return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7f; });
}

std::string double_quoted(std::string_view text) {
    const std::string_view digits = "0123456789abcdef";
    std::string quoted = "\"";
    for (char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\')
            quoted += '\\', quoted += c;
        else if (c == '\n')
            quoted += "\\n";
        else if (c == '\t')
            quoted += "\\t";
        else if (byte < 0x20 || byte == 0x7f)
            quoted += "\\x", quoted += digits[byte >> 4], quoted += digits[byte & 15];
        else
            quoted += c;
    }
    return quoted + '"';
}

std::string single_quoted(std::string_view text) {
    std::string quoted = "'";
    for (char c : text) quoted.append(c == '\'' ? 2 : 1, c);
    return quoted + "'";
}

std::string key_text(std::string_view text) {
    const bool plain = is_plain(text, true) && text.find(':') == text.npos && text != "<<";
    return plain ? std::string(text) : double_quoted(text);
}

std::size_t width(std::string_view text) {
    return std::ranges::count_if(text, [](unsigned char c) { return c >> 6 != 2; });
}

} // namespace bf::formats

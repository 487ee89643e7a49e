#include "bf/model/listed.hpp"

#include <algorithm>

namespace bf::model {

namespace {

constexpr std::string_view blanks = " \t\r\n", quotes = "'\"";

/// Behind the quote that closes the one at `begin`; npos: none does.
std::size_t quoted_end(std::string_view list, std::size_t begin) {
    const char quote = list[begin];
    for (std::size_t at = begin + 1; at < list.size(); ++at) {
        if (quote == '"' && list[at] == '\\')
            ++at;
        else if (list[at] == quote && at + 1 < list.size() && list[at + 1] == quote)
            ++at;
        else if (list[at] == quote)
            return at + 1;
    }
    return list.npos;
}

std::string unquoted(std::string_view item) {
    if (quotes.find(item[0]) == quotes.npos || quoted_end(item, 0) != item.size()) return std::string(item);
    std::string text;
    for (std::size_t at = 1; at + 1 < item.size(); ++at) {
        if (item[at] == item[0] || (item[0] == '"' && item[at] == '\\')) ++at;
        text += item[at];
    }
    return text;
}

} // namespace

std::vector<ListedText> listed_texts(std::string_view list) {
    const std::size_t first = list.find_first_not_of(blanks);
    if (first == list.npos) return {};
    std::size_t at = first, end = list.find_last_not_of(blanks) + 1;
    if (list[at] == '[' && list[end - 1] == ']' && end > at + 1) ++at, --end;
    list = list.substr(0, end);
    std::vector<ListedText> items;
    while (at < end) {
        at = std::min(list.find_first_not_of(blanks, at), end);
        if (at == end) break;
        std::size_t behind = at;
        if (quotes.find(list[at]) != quotes.npos)
            if (const std::size_t closed = quoted_end(list, at); closed != list.npos) behind = closed;
        behind = std::min(list.find(',', behind), end);
        if (behind > at) {
            const std::size_t last = list.find_last_not_of(blanks, behind - 1) + 1;
            items.push_back({at, last, unquoted(list.substr(at, last - at))});
        }
        at = behind + 1;
    }
    return items;
}

std::string listed(const std::string& text) {
    const bool is_word = text.find_first_of(",\"{}()[]#:&*!|>%@`\\") == text.npos &&
                         !text.starts_with('\'') && !text.starts_with('-') && !text.starts_with('?');
    if (is_word) return text;
    std::string item = "'";
    for (const char c : text) item.append(c == '\'' ? 2 : 1, c);
    return item + "'";
}

} // namespace bf::model

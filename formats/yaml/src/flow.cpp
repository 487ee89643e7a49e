#include "flow.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n'; }

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

/// Walks a flow collection as YAML sees it; quotes count only where a value begins, so A' stays a transpose.
class FlowScanner {
  public:
    FlowScanner(std::string_view text, std::size_t begin) : at(begin), text_(text) {}

    std::size_t at;
    int depth = 0;

    bool done() const { return at >= text_.size(); }

    /// Moves behind the next character, quoted text or comment, whose begin is returned.
    std::size_t next() {
        const std::size_t begin = at;
        const char c = text_[at++];
        if ((c == '\'' || c == '"') && value_begins_)
            skip_quoted(c);
        else if (c == '#' && begin > 0 && is_blank(text_[begin - 1]))
            at = std::min(text_.find('\n', at), text_.size());
        else if (c == '[' || c == '{')
            ++depth;
        else if (c == ']' || c == '}')
            --depth;
        if (!is_blank(c) && c != '#')
            value_begins_ = c == '[' || c == '{' || c == ',' || (c == ':' && (done() || is_blank(text_[at])));
        return begin;
    }

  private:
    void skip_quoted(char quote) {
        for (; at < text_.size(); ++at) {
            if (quote == '"' && text_[at] == '\\')
                ++at;
            else if (text_[at] == quote && quote == '\'' && at + 1 < text_.size() && text_[at + 1] == quote)
                ++at;
            else if (text_[at] == quote)
                break;
        }
        at = std::min(at + 1, text_.size());
    }

    std::string_view text_;
    bool value_begins_ = true;
};

/// One value between commas: quoted as a whole, or plain text that neither YAML nor MATLAB takes for more.
bool is_flow_scalar(std::string_view item) {
    if (item.empty()) return false;
    if (item[0] == '\'' || item[0] == '"') {
        FlowScanner scanner(item, 0);
        scanner.next();
        return scanner.at == item.size() && item.size() > 1 && item.back() == item[0] &&
               item.find('\\') == item.npos;
    }
    const std::string_view starts = "._+(~"; // besides letters, digits and a '-' in front of more
    auto alnum = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    };
    const bool minus = item[0] == '-' && item.size() > 1 && !is_blank(item[1]);
    if (!alnum(item[0]) && !minus && starts.find(item[0]) == starts.npos) return false;
    const bool odd = item.find_first_of("\"{}?") != item.npos || item.find(": ") != item.npos ||
                     item.find(" #") != item.npos || item.back() == ':';
    return !odd && std::ranges::all_of(item, [](char c) { return static_cast<unsigned char>(c) >= 0x20; });
}

} // namespace

std::size_t flow_end(std::string_view text, std::size_t begin) {
    FlowScanner scanner(text, begin);
    do scanner.next();
    while (!scanner.done() && scanner.depth > 0);
    return scanner.depth == 0 ? scanner.at : text.npos;
}

std::vector<std::string> flow_lines(std::string_view slice) {
    std::vector<std::string> lines(1);
    FlowScanner scanner(slice, 0);
    while (!scanner.done()) {
        const std::size_t begin = scanner.next();
        const std::string_view piece = slice.substr(begin, scanner.at - begin);
        if (piece == "\n")
            lines.emplace_back();
        else if (piece[0] != '#' || piece.size() == 1)
            lines.back() += piece;
    }
    for (std::string& line : lines) line = std::string(trimmed(line));
    std::erase(lines, "");
    return lines;
}

std::size_t ambiguous_break(const std::vector<std::string>& lines) {
    const std::string_view opens = "[{,;", closes = "]},";
    for (std::size_t i = 0; i + 1 < lines.size(); ++i)
        if (opens.find(lines[i].back()) == opens.npos && closes.find(lines[i + 1].front()) == closes.npos)
            return i;
    return lines.size();
}

std::string join_flow_lines(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) {
        const bool tight = text.empty() || text.back() == '[' || text.back() == '{' || line[0] == ']' ||
                           line[0] == '}' || line[0] == ',';
        text += (tight ? "" : " ") + line;
    }
    return text;
}

std::vector<std::string_view> flow_items(std::string_view slice, char separator) {
    std::vector<std::string_view> items;
    FlowScanner scanner(slice, 0);
    std::size_t item = 1;
    while (!scanner.done()) {
        const std::size_t begin = scanner.next();
        const bool is_end = slice[begin] == separator && scanner.at == begin + 1 && scanner.depth == 1;
        if (!is_end && !scanner.done()) continue;
        items.push_back(trimmed(slice.substr(item, begin - item)));
        item = scanner.at;
    }
    if (!items.empty() && items.back().empty()) items.pop_back(); // behind a last one, or in []
    return items;
}

std::string matrix_of_rows(std::string_view slice) {
    if (slice.empty() || slice[0] != '[') return {};
    std::string text;
    for (std::string_view row : flow_items(slice)) {
        const bool is_row = !row.empty() && row[0] == '[' && flow_end(row, 0) == row.size();
        if (!is_row || row.find(';') != row.npos) return {};
        text += (text.empty() ? "[" : "; ") + std::string(trimmed(row.substr(1, row.size() - 2)));
    }
    return text.empty() ? text : text + "]";
}

bool is_flow_text(std::string_view text) {
    if (text.size() < 2 || (text[0] != '[' && text[0] != '{') || text.back() != (text[0] == '[' ? ']' : '}'))
        return false;
    if (flow_end(text, 0) != text.size() || !matrix_of_rows(text).empty()) return false;
    if (std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; })) return false;
    const bool is_cell = text[0] == '{';
    for (std::string_view item : flow_items(text)) {
        const bool nested = !item.empty() && (item[0] == '[' || item[0] == '{');
        if (nested ? is_cell || !is_flow_text(item) : !is_flow_scalar(item)) return false;
        if (nested && flow_end(item, 0) != item.size()) return false;
    }
    return true;
}

} // namespace bf::formats

// The text of parameter files: names and values as YAML, the format of `bf run --params`, without
// expressions.
//
//     Gain: {Kp: 2, Kd: 0.1}        # a variable, Gain.Kp
//     controller:
//       pd:
//         K: [[1, 0], [0, 1]]       # a parameter, controller.pd.K; rows
//         limit: "[1 2; 3 4]"
#pragma once

#include "bf/base/value_text.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace bf::generated {

/// One name with its value: `rows` x `cols` texts, column by column.
struct Entry {
    std::string name;
    int line = 0;
    int rows = 1, cols = 1;
    std::vector<std::string> items;
    std::string text; ///< as written
};

/// What a text says, or what is wrong, one mistake per line: "FILE:LINE: ...".
struct ParsedParameters {
    std::vector<Entry> entries;
    std::string errors;
};

namespace detail {

inline std::string trimmed(const std::string& text) {
    const auto first = text.find_first_not_of(" \t\r\n"), last = text.find_last_not_of(" \t\r\n");
    return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
}

/// The places of a text where a character counts: outside quotes. `depth` of brackets before it.
template <class F> void each_plain(const std::string& text, F&& f) {
    char quote = 0;
    int depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quote) {
            const char next = i + 1 < text.size() ? text[i + 1] : '\0';
            if ((c == '\\' && quote == '"') || (c == '\'' && quote == c && next == c))
                ++i; // what follows does not end the quote
            else if (c == quote)
                quote = 0;
            continue;
        }
        const bool begins = i == 0 || std::string(" \t,:[{").find(text[i - 1]) != std::string::npos;
        if ((c == '\'' || c == '"') && begins) {
            quote = c;
            continue;
        }
        if (c == ']' || c == '}') --depth;
        if (!f(i, c, depth)) return;
        if (c == '[' || c == '{') ++depth;
    }
}

inline std::string without_comment(const std::string& line) {
    std::size_t end = line.size();
    each_plain(line, [&](std::size_t i, char c, int) {
        if (c != '#' || (i > 0 && line[i - 1] != ' ' && line[i - 1] != '\t')) return true;
        end = i;
        return false;
    });
    return line.substr(0, end);
}

inline int open_brackets(const std::string& text) {
    int open = 0;
    each_plain(text, [&](std::size_t, char c, int) {
        open += (c == '[' || c == '{') - (c == ']' || c == '}');
        return true;
    });
    return open;
}

/// The parts between commas outside brackets.
inline std::vector<std::string> parts_of(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::size_t begin = 0;
    each_plain(text, [&](std::size_t i, char c, int depth) {
        if (c == separator && depth == 0) {
            parts.push_back(trimmed(text.substr(begin, i - begin)));
            begin = i + 1;
        }
        return true;
    });
    if (const std::string last = trimmed(text.substr(begin)); !last.empty()) parts.push_back(last);
    return parts;
}

/// Where the colon after a key stands, or npos.
inline std::size_t colon_of(const std::string& text) {
    std::size_t at = std::string::npos;
    each_plain(text, [&](std::size_t i, char c, int depth) {
        if (c != ':' || depth != 0 || (i + 1 < text.size() && text[i + 1] != ' ' && text[i + 1] != '\t'))
            return true;
        at = i;
        return false;
    });
    return at;
}

inline bool is_between(const std::string& text, char first, char last) {
    return text.size() >= 2 && text.front() == first && text.back() == last;
}
inline std::string inside(const std::string& text) { return text.substr(1, text.size() - 2); }
/// A quote of a '...' text is doubled; of a "..." text a backslash stands before it, and before a backslash.
inline std::string unquoted(const std::string& text) {
    const bool is_double = is_between(text, '"', '"');
    if (!is_double && !is_between(text, '\'', '\'')) return text;
    std::string plain;
    for (std::size_t i = 1; i + 1 < text.size(); ++i) {
        const char next = i + 2 < text.size() ? text[i + 1] : '\0';
        if (is_double ? text[i] == '\\' && (next == '\\' || next == '"') : text[i] == '\'' && next == '\'')
            ++i;
        plain += text[i];
    }
    return plain;
}

/// A name as a key of YAML, in quotes where it would be read as something else.
inline std::string key_text(const std::string& name) {
    const auto is_plain = [](unsigned char c) {
        return c >= 0x80 || std::isalnum(c) ||
               std::string("_. -+/()").find(static_cast<char>(c)) != std::string::npos;
    };
    const auto first = static_cast<unsigned char>(name[0]);
    if ((first >= 0x80 || std::isalpha(first)) && std::all_of(name.begin(), name.end(), is_plain) &&
        name != "null" && name != "Null" && name != "NULL")
        return name;
    std::string quoted = "'";
    for (const char c : name) quoted += c == '\'' ? "''" : std::string(1, c);
    return quoted + "'";
}

/// A scalar, [a, b], [[a, b], [c, d]] or MATLAB's [a b; c d]. False when rows differ in length.
inline bool read_entry(const std::string& written, Entry& entry) {
    const std::string text = unquoted(written);
    entry.text = text;
    std::vector<std::vector<std::string>> rows;
    if (!is_between(text, '[', ']')) {
        rows = {{text}};
    } else {
        for (const std::string& row : parts_of(inside(text), ';')) {
            std::vector<std::string> items;
            for (const std::string& part : parts_of(row, ',')) {
                if (is_between(part, '[', ']')) { // a row of its own
                    std::vector<std::string> inner;
                    for (const std::string& item : parts_of(inside(part), ','))
                        inner.push_back(unquoted(item));
                    rows.push_back(std::move(inner));
                    continue;
                }
                if (part.empty() || part.front() == '\'' || part.front() == '"') {
                    items.push_back(unquoted(part));
                    continue;
                }
                for (const std::string& item : parts_of(part, ' '))
                    if (!item.empty()) items.push_back(item);
            }
            if (!items.empty()) rows.push_back(std::move(items));
        }
    }
    entry.rows = static_cast<int>(rows.size());
    entry.cols = rows.empty() ? 0 : static_cast<int>(rows[0].size());
    for (const auto& row : rows)
        if (row.size() != rows[0].size()) return false;
    entry.items.clear();
    for (int j = 0; j < entry.cols; ++j)
        for (int i = 0; i < entry.rows; ++i)
            entry.items.push_back(rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]);
    return true;
}

/// The numbers of an entry, or what is wrong.
inline std::string numbers_of(const Entry& entry, std::vector<double>& values) {
    values.resize(entry.items.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        if (const std::string& item = entry.items[i]; item == "true" || item == "false")
            values[i] = item == "true";
        else if (std::string wrong = read_value(item, values[i]); !wrong.empty())
            return wrong + "; a generated program computes no expressions, write the value";
    return values.empty() ? "there is no value" : "";
}

} // namespace detail

/// Reads block and flow mappings, sequences and scalars; anchors and documents are not known here.
inline ParsedParameters parse_parameters(const std::string& text, const std::string& source) {
    ParsedParameters result;
    struct Level {
        int indent;
        std::string prefix;
        int inside = -1; ///< indentation of its names, once there is one
    };
    std::vector<Level> levels{{-1, "", -1}};
    std::map<std::string, int> lines; // of the names so far
    const auto wrong = [&](int line, const std::string& what) {
        result.errors += source + ":" + std::to_string(line) + ": " + what + "\n";
    };
    const auto add = [&](auto&& self, const std::string& name, const std::string& value, int line) -> void {
        if (std::count(name.begin(), name.end(), '.') > 50)
            return wrong(line, "the names are nested too deeply");
        if (detail::is_between(value, '{', '}')) {
            for (const std::string& part : detail::parts_of(detail::inside(value), ',')) {
                const auto colon = detail::colon_of(part);
                if (colon == std::string::npos)
                    wrong(line, "write name: value, not '" + part + "'");
                else
                    self(self,
                         (name.empty() ? "" : name + ".") +
                             detail::unquoted(detail::trimmed(part.substr(0, colon))),
                         detail::trimmed(part.substr(colon + 1)), line);
            }
            return;
        }
        const auto [first, is_new] = lines.emplace(name, line);
        if (!is_new)
            return wrong(line, "a second '" + name + "'; remove or rename one; the first is at " + source +
                                   ":" + std::to_string(first->second));
        if (value.empty()) return wrong(line, "'" + name + "' has no value; write name: value");
        Entry entry;
        entry.name = name;
        entry.line = line;
        if (!detail::read_entry(value, entry))
            return wrong(line, "the rows of '" + name + "' differ in length");
        result.entries.push_back(std::move(entry));
    };
    std::string pending; // a key whose value stands on the lines that follow
    int pending_line = 0, number = 0, first_line = 0;
    std::string sequence;
    // The next line, at that depth, is no item of the key's list.
    const auto finish_pending = [&](int indent) {
        if (!pending.empty() && (!sequence.empty() || levels.back().indent >= indent))
            add(add, pending, sequence.empty() ? "" : "[" + sequence + "]", pending_line);
        sequence.clear();
        pending.clear();
    };
    std::string joined;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        std::string line = detail::without_comment(text.substr(at, end - at));
        at = end + 1;
        ++number;
        if (joined.empty()) {
            if (detail::trimmed(line).empty() || line.compare(0, 3, "---") == 0) continue;
            first_line = number;
            joined = line;
        } else {
            joined += " " + detail::trimmed(line);
        }
        if (detail::open_brackets(joined) > 0 && at < text.size()) continue;
        line = std::exchange(joined, "");
        const int indent = static_cast<int>(line.find_first_not_of(' '));
        const std::string content = detail::trimmed(line);
        if (content == "-" || content.compare(0, 2, "- ") == 0) {
            if (pending.empty()) {
                wrong(first_line, "a list needs a name before it");
                continue;
            }
            sequence += (sequence.empty() ? "" : ", ") + detail::trimmed(content.substr(1));
            continue;
        }
        finish_pending(indent);
        while (levels.back().indent >= indent) levels.pop_back();
        if (detail::is_between(content, '{', '}') && levels.size() == 1) {
            add(add, "", content, first_line);
            continue;
        }
        if (int& inside = levels.back().inside; inside < 0) {
            inside = indent;
        } else if (inside != indent) {
            wrong(first_line, "'" + content + "' is indented by " + std::to_string(indent) +
                                  ", its neighbours by " + std::to_string(inside));
            continue;
        }
        const auto colon = detail::colon_of(content);
        if (colon == std::string::npos || colon == 0) {
            wrong(first_line, "write name: value, not '" + content + "'");
            continue;
        }
        const std::string name =
            levels.back().prefix + detail::unquoted(detail::trimmed(content.substr(0, colon)));
        const std::string value = detail::trimmed(content.substr(colon + 1));
        if (value.empty()) {
            levels.push_back({indent, name + ".", -1});
            pending = name;
            pending_line = first_line;
        } else {
            add(add, name, value, first_line);
        }
    }
    finish_pending(-1);
    return result;
}

} // namespace bf::generated

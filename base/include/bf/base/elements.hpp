// How the elements of a signal are called: in recordings, figures, tables and messages, and by whoever asks
// for one. Generated programs have this header too: C++17.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace bf {

/// What stands behind the name of a signal of `rows` x `cols` for its element i (column by column, from 0):
/// nothing for a single element, "[3]" in a vector, "[2][3]", row and column, in a matrix. People count from
/// 1, as the expressions of a model do. An element of a vector that has a name is called by it, "[l_knee]";
/// `names` are those of all elements, "" of one that has none, or there are none at all.
inline std::string element_text(int rows, int cols, int i, const std::vector<std::string>& names = {}) {
    if (rows * cols == 1) return {};
    const auto bracket = [](int index) { return "[" + std::to_string(index + 1) + "]"; };
    if (cols > 1) return bracket(i % rows) + bracket(i / rows);
    const auto k = static_cast<std::size_t>(i);
    return k < names.size() && !names[k].empty() ? "[" + names[k] + "]" : bracket(i);
}

/// The element (from 0) that "[3]", "[2][3]" or "[l_knee]" stands for, -1: none.
inline int find_element(std::string_view text, int rows, int cols, const std::vector<std::string>& names) {
    for (int i = 0; i < rows * cols; ++i)
        if (text == element_text(rows, cols, i) || text == element_text(rows, cols, i, names)) return i;
    return -1;
}

/// Names as recordings and tables of generated programs keep them: a line each.
inline std::string element_lines(const std::vector<std::string>& names) {
    std::string lines;
    for (const auto& name : names) lines += name + "\n";
    return lines;
}

/// The names in such a text; none at all unless there are `count`.
inline std::vector<std::string> names_of_lines(std::string_view lines, std::size_t count) {
    if (static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n')) != count) return {};
    std::vector<std::string> names;
    for (std::size_t at = 0; at < lines.size(); at += names.back().size() + 1)
        names.emplace_back(lines.substr(at, lines.find('\n', at) - at));
    return names;
}

/// "robot.s[l_knee]" in its parts: the signal's name, and "[l_knee]". Names of elements have no brackets.
struct ElementPath {
    std::string_view signal, element;
};
inline ElementPath split_element(std::string_view text) {
    const auto bracket = text.empty() || text.back() != ']' ? text.npos : text.find('[');
    return {text.substr(0, bracket), bracket == text.npos ? std::string_view() : text.substr(bracket)};
}

} // namespace bf

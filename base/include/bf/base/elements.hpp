// How the elements of a signal are called: in recordings, figures, tables and messages, and by whoever asks
// for one. Generated programs have this header too: C++17.
#pragma once

#include <string>
#include <string_view>

namespace bf {

/// What stands behind the name of a signal of `rows` x `cols` for its element i (column by column, from 0):
/// nothing for a single element, "[3]" in a vector, "[2][3]", row and column, in a matrix. People count from
/// 1, as the expressions of a model do. An element of a vector that has a name is called by it, "[l_knee]".
inline std::string element_text(int rows, int cols, int i, std::string_view name = {}) {
    if (rows * cols == 1) return {};
    const auto bracket = [](int index) { return "[" + std::to_string(index + 1) + "]"; };
    if (cols > 1) return bracket(i % rows) + bracket(i / rows);
    return name.empty() ? bracket(i) : "[" + std::string(name) + "]";
}

/// The element (from 0) that "[3]", "[2][3]" or "[l_knee]" stands for, -1: none; name(i) is that of element
/// i.
template <class Name> int find_element(std::string_view text, int rows, int cols, Name&& name) {
    for (int i = 0; i < rows * cols; ++i)
        if (text == element_text(rows, cols, i) || text == element_text(rows, cols, i, name(i))) return i;
    return -1;
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

#include "text.hpp"

namespace bf::editor {

namespace {

/// Thousandths of the size, from the blank to the tilde.
constexpr short widths[] = {
    278,  278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, // blank to /
    556,  556, 556, 556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, // 0 to ?
    1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778, // @ to O
    667,  778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, // P to _
    333,  556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, // ` to o
    556,  556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584};     // p to ~

bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

double width_of(char c) {
    constexpr short n = 556;
    if (is_continuation(c)) return 0;
    const bool is_known = c >= ' ' && c <= '~';
    return (is_known ? widths[c - ' '] : n) / 1000.0;
}

} // namespace

double text_width(std::string_view text, double size) {
    double width = 0;
    for (const char c : text) width += width_of(c);
    return width * size;
}

std::string fitted(const std::string& text, double size, double most) {
    if (text_width(text, size) <= most) return text;
    constexpr const char* dots = "…";
    double width = text_width(dots, size);
    std::size_t end = 0;
    for (; end < text.size(); ++end) {
        width += width_of(text[end]) * size;
        if (width > most && !is_continuation(text[end])) break;
    }
    return text.substr(0, end) + dots;
}

std::string without_every(const std::string& rate) {
    const std::string every = "every ";
    return rate.starts_with(every) ? rate.substr(every.size()) : rate;
}

} // namespace bf::editor

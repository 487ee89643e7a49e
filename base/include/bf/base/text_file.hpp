// Reading a file as a whole. Generated programs have this header too: C++17 and POSIX.
#pragma once

#include "bf/base/open_file.hpp"

#include <cerrno>
#include <fstream>
#include <string>

namespace bf {

/// Appends the bytes of a regular file, at most `most` of them, to `text`. Returns an empty text, or why the
/// file cannot be read.
inline std::string read_file(const std::string& file, std::string& text,
                             std::size_t most = std::size_t{1} << 30) {
    if (std::string why = why_unreadable(file); !why.empty()) return why;
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return file_error(errno);
    // What the size says may be 0 (in /proc), and the file may grow meanwhile.
    char part[1 << 16];
    while (stream.read(part, sizeof part), stream.gcount() > 0) {
        text.append(part, static_cast<std::size_t>(stream.gcount()));
        if (text.size() > most) return "it is larger than " + std::to_string(most >> 20) + " MB";
    }
    return stream.bad() ? file_error(errno) : "";
}

/// Without the byte order mark that some editors and spreadsheets begin UTF-8 with.
inline std::string without_mark(const std::string& text) {
    return text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? text.substr(3) : text;
}

} // namespace bf

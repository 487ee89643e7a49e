// Reading a file as a whole. Generated programs have this header too: C++17 and POSIX.
#pragma once

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <sys/stat.h>

namespace bf {

/// Appends the bytes of a regular file, at most `most` of them, to `text`. Returns an empty text, or why the
/// file cannot be read. Others, such as pipes and /dev/zero, may have no end.
inline std::string read_file(const std::string& file, std::string& text,
                             std::size_t most = std::size_t{1} << 30) {
    struct stat status {};
    if (::stat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
        return "it is no regular file, which has an end; write the text to one";
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return std::strerror(errno);
    // What the size says may be 0 (in /proc), and the file may grow meanwhile.
    char part[1 << 16];
    while (stream.read(part, sizeof part), stream.gcount() > 0) {
        text.append(part, static_cast<std::size_t>(stream.gcount()));
        if (text.size() > most) return "it is larger than " + std::to_string(most >> 20) + " MB";
    }
    return stream.bad() ? std::strerror(errno) : "";
}

} // namespace bf

// Files that are read as a whole.
#pragma once

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <sys/stat.h>

namespace bf::generated::detail {

/// The text of a regular file, which has an end, up to 1 GB. Returns an empty text, or why it cannot be read.
inline std::string read_file(const std::string& file, std::string& text) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return std::strerror(errno);
    if (!S_ISREG(status.st_mode)) return "it is no regular file, which has an end";
    if (status.st_size > (1 << 30)) return "it is larger than 1024 MB";
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    char part[1 << 16];
    while (stream.read(part, sizeof part), stream.gcount() > 0)
        text.append(part, static_cast<std::size_t>(stream.gcount()));
    return stream.is_open() && !stream.bad() ? "" : std::strerror(errno ? errno : EIO);
}

} // namespace bf::generated::detail

// Files by which programs know of each other: locks of single bytes, which end with the open file that has
// them, however its program ends.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>

namespace bf {

namespace detail {
inline bool control_byte(int descriptor, int command, off_t byte, struct flock& range) noexcept {
    range.l_whence = SEEK_SET;
    range.l_start = byte;
    range.l_len = 1;
    return fcntl(descriptor, command, &range) == 0;
}
} // namespace detail

/// F_RDLCK, F_WRLCK or F_UNLCK of that byte. False: others have it.
inline bool lock_byte(int descriptor, off_t byte, short kind) noexcept {
    struct flock range = {};
    range.l_type = kind;
    return detail::control_byte(descriptor, F_OFD_SETLK, byte, range);
}

/// Could nobody else have that lock?
inline bool is_byte_free(int descriptor, off_t byte) noexcept {
    struct flock range = {};
    range.l_type = F_WRLCK;
    return !detail::control_byte(descriptor, F_OFD_GETLK, byte, range) || range.l_type == F_UNLCK;
}

/// Does the name stand for the file that is open, and not for none, or one of others, after it was removed?
inline bool is_named(int descriptor, const char* name) noexcept {
    struct stat ours = {}, found = {};
    return fstat(descriptor, &ours) == 0 && stat(name, &found) == 0 && ours.st_dev == found.st_dev &&
           ours.st_ino == found.st_ino;
}

} // namespace bf

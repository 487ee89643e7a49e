// A Unix socket that its owner alone may open.
//
// C++17 and POSIX alone, and no other header of BlockFactory: generated projects carry a copy of this file.
#pragma once

#include <cerrno>
#include <cstring>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace bf::realtime {

/// Listens at a path, with mode 0600 from its first moment. A socket that a killed program left behind, at
/// which nobody answers, is replaced. The descriptor, or -1 and errno.
inline int listen_at(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path) {
        errno = path.empty() ? ENOENT : ENAMETOOLONG;
        return -1;
    }
    std::memcpy(address.sun_path, path.data(), path.size());
    const auto* const generic = reinterpret_cast<const sockaddr*>(&address);
    const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const auto bind = [&] {
        const mode_t before = ::umask(0177);
        const bool good = ::bind(listener, generic, sizeof address) == 0;
        const int error = errno;
        ::umask(before);
        errno = error;
        return good;
    };
    struct stat status {};
    bool good = listener >= 0 && bind();
    if (!good && errno == EADDRINUSE && ::lstat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode)) {
        const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
        const bool is_dead = ::connect(probe, generic, sizeof address) != 0 && errno == ECONNREFUSED;
        ::close(probe);
        errno = EADDRINUSE;
        good = is_dead && ::unlink(path.c_str()) == 0 && bind();
    }
    if (good && ::listen(listener, SOMAXCONN) == 0) return listener;
    const int error = errno;
    if (listener >= 0) ::close(listener);
    errno = error;
    return -1;
}

} // namespace bf::realtime

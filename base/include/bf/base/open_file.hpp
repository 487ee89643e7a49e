// Which files are read and written, and why not. Generated programs have this header too: C++17 and POSIX.
#pragma once

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

namespace bf {

/// What an error number of a file means.
inline std::string file_error(int error) {
    switch (error) {
    case ELOOP: return "its symbolic links lead in a ring; remove one of them";
    case ENXIO: return "no program reads this pipe; start one that does, or give a file";
    case EMFILE: return "this program may open too few files; raise that limit, as by ulimit -n 1024";
    default: return std::strerror(error);
    }
}

/// The same for a file that is written, with the remedy.
inline std::string write_error(int error) {
    const auto with = [&](const char* remedy) { return file_error(error) + "; " + remedy; };
    switch (error) {
    case ELOOP:
    case EMFILE:
    case ENXIO: return file_error(error);
    case ENOSPC:
    case EDQUOT: return with("free space, or write to another disk");
    case EFBIG: return with("raise the limit on the size of files, or write less");
    case ENAMETOOLONG: return with("give a shorter name");
    case EISDIR: return with("give the name of a file");
    case EBUSY: return "another program is writing it; give another name";
    case EIO: return with("check the disk, or write to another one");
    case ESPIPE: return "a pipe or a device is written from its beginning to its end; give a file";
    default: return with("give a file in a folder that may be written");
    }
}

/// Empty for a regular file, or why the file is not read: others, such as pipes and /dev/zero, may have no
/// end.
inline std::string why_unreadable(const std::string& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return file_error(errno);
    if (S_ISDIR(status.st_mode)) return "it is a folder; give the name of a file";
    if (!S_ISREG(status.st_mode)) return "it is no regular file, which has an end; write its content to one";
    return "";
}

/// Do two names stand for one regular file that is there?
inline bool is_one_file(const std::string& a, const std::string& b) {
    struct stat first {
    }, second{};
    return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 && S_ISREG(first.st_mode) &&
           first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

/// Which open file the name stands for: /dev/stdout, /dev/stderr, /dev/fd/N or /proc/self/fd/N; otherwise -1.
inline int descriptor_of(const std::string& file) {
    if (file == "/dev/stdout") return STDOUT_FILENO;
    if (file == "/dev/stderr") return STDERR_FILENO;
    for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
        const std::string number = file.substr(0, folder.size()) == folder ? file.substr(folder.size()) : "";
        if (!number.empty() && number.size() < 6 && number.find_first_not_of("0123456789") == number.npos)
            return std::stoi(number);
    }
    return -1;
}

/// Gives /dev/null to the standard streams that whoever started the program has closed: a file would be
/// opened in their place, and messages written into it. Call it first in main.
inline void occupy_standard_streams() {
    int descriptor = 0;
    while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = ::open("/dev/null", O_RDWR);
    if (descriptor >= 0) ::close(descriptor);
}

/// Opens a file to be written as open(2) does, with further flags, e.g. O_CREAT | O_TRUNC; -1 and errno where
/// it cannot. It gives the reader of a pipe two seconds to come, and does not wait for ever: ENXIO. What is
/// open already is written on from where it stands.
inline int open_to_write(const std::string& file, int flags) {
    if (const int open = descriptor_of(file); open >= 0) return ::fcntl(open, F_DUPFD_CLOEXEC, 0);
    constexpr int pauses = 200;
    constexpr timespec pause{0, 10'000'000};
    int descriptor = -1;
    for (int i = 0; i < pauses; ++i) {
        descriptor = ::open(file.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC | flags, 0666);
        struct stat status {};
        if (descriptor >= 0 || errno != ENXIO || ::stat(file.c_str(), &status) != 0 ||
            !S_ISFIFO(status.st_mode))
            break;
        ::nanosleep(&pause, nullptr);
        errno = ENXIO;
    }
    if (descriptor >= 0) ::fcntl(descriptor, F_SETFL, 0); // writing waits for the reader
    return descriptor;
}

/// Opens a file that grows from nothing while a program runs, as its only writer: EBUSY where another program
/// is writing it. Otherwise as `open_to_write`.
inline int open_to_grow(const std::string& file) {
    const int descriptor = open_to_write(file, O_CREAT);
    struct stat status {};
    if (descriptor < 0 || descriptor_of(file) >= 0 || ::fstat(descriptor, &status) != 0 ||
        !S_ISREG(status.st_mode))
        return descriptor;
    // Where files cannot be locked, as on some networks, nobody is refused.
    const bool is_taken = ::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!is_taken && ::ftruncate(descriptor, 0) == 0) return descriptor;
    const int error = is_taken ? EBUSY : errno;
    ::close(descriptor);
    errno = error;
    return -1;
}

} // namespace bf

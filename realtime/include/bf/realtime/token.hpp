// The secret by which a running program knows those who may look at it and change it.
//
// C++17 and POSIX alone, and no other header of BlockFactory: generated projects carry a copy of this file.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <string_view>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

namespace bf::realtime {

/// 128 random bits as 32 hexadecimal digits; empty if the system gives none.
inline std::string random_token() {
    unsigned char bytes[16];
    if (::getrandom(bytes, sizeof bytes, 0) != static_cast<ssize_t>(sizeof bytes)) return "";
    std::string text;
    for (const unsigned char byte : bytes) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", byte);
        text += digits;
    }
    return text;
}

/// Is it the token? How long the answer takes does not tell how much of it is right.
inline bool is_token(std::string_view given, std::string_view token) noexcept {
    unsigned difference = given.size() != token.size() || token.empty();
    for (std::size_t i = 0; i < given.size(); ++i)
        difference |= static_cast<unsigned char>(given[i]) ^
                      static_cast<unsigned char>(token.empty() ? '\0' : token[i % token.size()]);
    return difference == 0;
}

/// Where the service manager that started this program has put the secret of that name, for this program
/// alone (systemd.exec(5), LoadCredential=); empty: there is none.
inline std::string credential(const std::string& name) {
    const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
    if (folder == nullptr || *folder == '\0' || name.empty()) return "";
    const std::string file = std::string(folder) + "/" + name;
    return ::access(file.c_str(), F_OK) == 0 ? file : "";
}

/// Reads the token in a file of one line; makes the file, with a random token and for its owner alone, where
/// there is none. A file that `is_credential` others cannot reach, whatever its mode says. Empty, or what is
/// wrong, with `what` it is and how one that is not fit is replaced.
inline std::string read_token(const std::string& file, std::string& token, const std::string& what = "token",
                              const std::string& remedy = "remove the file, and one is made",
                              bool is_credential = false) {
    const auto wrong = [&](const std::string& text) { return "the " + what + " file " + file + " " + text; };
    const int made = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (made >= 0) {
        token = random_token();
        const std::string line = token + "\n";
        const bool good =
            !token.empty() && ::write(made, line.data(), line.size()) == static_cast<ssize_t>(line.size());
        ::close(made);
        if (good) return "";
        ::unlink(file.c_str());
        return wrong("cannot be written; give a file in a folder that may be written");
    }
    if (errno != EEXIST)
        return wrong(std::string("cannot be made: ") + std::strerror(errno) +
                     "; give a file in a folder that may be written");
    const int read = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    char bytes[257];
    const bool is_there = read >= 0 && ::fstat(read, &status) == 0 && S_ISREG(status.st_mode);
    const ssize_t count = is_there ? ::read(read, bytes, sizeof bytes) : -1;
    if (read >= 0) ::close(read);
    if (count < 0) return wrong("cannot be read; check its name and rights");
    if (!is_credential && (status.st_mode & (S_IRWXG | S_IRWXO)))
        return wrong("is open to others than its owner; say chmod 600 " + file);
    token.assign(bytes, static_cast<std::size_t>(count));
    while (!token.empty() && (token.back() == '\n' || token.back() == '\r')) token.pop_back();
    const bool is_plain =
        token.find_first_not_of("0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-._~") ==
        std::string::npos;
    if (token.size() < 16 || token.size() > 255 || !is_plain)
        return wrong("needs one line of 16 to 255 letters, digits and -._~; " + remedy);
    return "";
}

} // namespace bf::realtime

#include "bf/base/files.hpp"

#include "bf/base/text_file.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace bf {

namespace fs = std::filesystem;

namespace {

const char* remedy(int error) {
    switch (error) {
    case ENOSPC:
    case EDQUOT: return "free space, or write to another disk";
    case ENAMETOOLONG: return "give a shorter name";
    case EISDIR: return "give the name of a file";
    default: return "give a file in a folder that may be written";
    }
}

[[noreturn]] void refuse(const std::string& what, const fs::path& file, int error) {
    throw FileError("cannot " + what + " " + file.string() + ": " + std::strerror(error) + "; " +
                    remedy(error));
}

/// A name beside `target` that nobody can foresee, so that nothing can have been put there.
fs::path hidden_name(const fs::path& target, const std::string& ending) {
    std::uint64_t number = 0;
    while (::getrandom(&number, sizeof number, 0) != sizeof number) {
    }
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(number));
    return target.parent_path() / ("." + std::string(digits) + ".part" + ending);
}

/// What the links lead to, whether it exists or not.
fs::path place_behind(fs::path file) {
    std::error_code error;
    for (int links = 0; links < 40 && fs::is_symlink(fs::symlink_status(file, error)); ++links) {
        const fs::path to = fs::read_symlink(file, error);
        if (error) break;
        file = to.is_absolute() ? to : file.parent_path() / to;
    }
    return file;
}

bool write_all(int descriptor, std::string_view text) {
    while (!text.empty()) {
        const ssize_t count = ::write(descriptor, text.data(), text.size());
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return false;
        text.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
}

} // namespace

OutputFile::OutputFile(fs::path file)
    : file_(std::move(file)), target_(place_behind(file_)), temporary_(file_) {
    struct stat status {};
    const bool exists = ::stat(file_.c_str(), &status) == 0; // what a link of /proc leads to has no name
    if (file_.empty()) fail(ENOENT);
    if (exists && S_ISDIR(status.st_mode)) fail(EISDIR);
    if (exists && !S_ISREG(status.st_mode)) return;
    if (exists && ::access(target_.c_str(), W_OK) != 0) fail(errno);
    do {
        temporary_ = hidden_name(target_, file_.extension().string());
        descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) fail(errno);
    if (exists) ::fchmod(descriptor_, status.st_mode & 07777);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : file_(std::move(other.file_)), target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

OutputFile::~OutputFile() {
    if (descriptor_ < 0) return;
    ::unlink(temporary_.c_str());
    ::close(descriptor_);
}

void OutputFile::write(std::string_view text) {
    const int special = descriptor_ < 0 ? ::open(file_.c_str(), O_WRONLY | O_CLOEXEC) : -1;
    const int to = descriptor_ < 0 ? special : descriptor_;
    const bool is_written = to >= 0 &&
                            (special >= 0 || (::ftruncate(to, 0) == 0 && ::lseek(to, 0, SEEK_SET) == 0)) &&
                            write_all(to, text);
    const int error = errno;
    if (special >= 0) ::close(special);
    if (!is_written) fail(error);
}

void OutputFile::commit() {
    if (descriptor_ < 0) return;
    // The content first: after a power cut the name must not stand for an empty file.
    if (::fsync(descriptor_) != 0 || ::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
    ::close(std::exchange(descriptor_, -1));
    temporary_ = file_;
}

void OutputFile::fail(int error) const { refuse("write", file_, error); }

OutputFolder::OutputFolder(fs::path folder) : folder_(std::move(folder)) {
    target_ = fs::absolute(place_behind(folder_)).lexically_normal();
    if (!target_.has_filename()) target_ = target_.parent_path();
    std::error_code error;
    const auto status = fs::status(target_, error);
    if (fs::exists(status) && !fs::is_directory(status)) fail("it is a file; name a folder");
    if (fs::exists(status) && !fs::is_empty(target_, error))
        fail(error ? error.message() : "the folder is not empty; empty it or name another one");
    fs::create_directories(target_.parent_path(), error);
    if (error) fail(error.message());
    do {
        temporary_ = hidden_name(target_, "");
        errno = 0;
    } while (::mkdir(temporary_.c_str(), 0777) != 0 && errno == EEXIST);
    if (errno != 0) fail(std::strerror(errno));
}

OutputFolder::~OutputFolder() {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored); // follows no link
}

void OutputFolder::write(const fs::path& name, std::string_view text, bool is_program) const {
    const fs::path file = temporary_ / name;
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    if (error) fail(error.message());
    const int to =
        ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, is_program ? 0777 : 0666);
    const bool is_written = to >= 0 && write_all(to, text);
    const int why = errno;
    if (to >= 0) ::close(to);
    if (!is_written) fail(name.string() + ": " + std::strerror(why));
}

void OutputFolder::copy(const fs::path& from, const fs::path& name) const {
    std::error_code error;
    fs::create_directories((temporary_ / name).parent_path(), error);
    if (!error) fs::copy_file(from, temporary_ / name, fs::copy_options::skip_existing, error);
    if (error) fail(from.string() + ": " + error.message());
}

void OutputFolder::commit() {
    // An empty folder in its place is replaced; one that was filled meanwhile is not.
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(std::strerror(errno));
    temporary_.clear();
}

void OutputFolder::fail(const std::string& reason) const {
    throw FileError("cannot write the folder " + folder_.string() + ": " + reason);
}

std::string read_text_file(const fs::path& file, std::size_t most) {
    std::error_code error;
    std::string text;
    const std::string wrong =
        fs::is_directory(file, error) ? "it is a folder" : read_file(file.string(), text, most);
    if (!wrong.empty()) throw FileError("cannot read " + file.string() + ": " + wrong);
    return text;
}

} // namespace bf

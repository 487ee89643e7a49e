#include "bf/base/files.hpp"

#include "bf/base/open_file.hpp"
#include "bf/base/text_file.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace bf {

namespace fs = std::filesystem;

namespace {

/// A name beside `target` that nobody can foresee, so that nothing can have been put there.
fs::path hidden_name(const fs::path& target, const std::string& ending) {
    std::uint64_t number = 0;
    while (::getrandom(&number, sizeof number, 0) != sizeof number) {
    }
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(number));
    return target.parent_path() / ("." + std::string(digits) + ".part" + ending);
}

/// Whether it is such a name, of a file of that ending.
bool is_hidden_name(const std::string& name, const std::string& ending) {
    const std::string_view tail = ".part", digits = "0123456789abcdef";
    return name.size() == 17 + tail.size() + ending.size() && name[0] == '.' &&
           name.find_first_not_of(digits, 1) == 17 && name.compare(17, tail.size(), tail) == 0 &&
           name.ends_with(ending);
}

/// Says to everybody that somebody works on the file, until it is closed or the program ends.
bool lock(int descriptor) { return ::flock(descriptor, LOCK_EX | LOCK_NB) == 0; }

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

/// Appends the first bytes of a file to another one. False: errno says why, EIO where it has not so many.
bool copy_all(int from, int to, ::off_t size) {
    std::array<char, 65536> part{};
    for (::off_t at = 0; at < size;) {
        errno = EIO;
        const ::ssize_t count = ::pread(from, part.data(), part.size(), at);
        if (count <= 0 || !write_all(to, {part.data(), static_cast<std::size_t>(count)})) return false;
        at += count;
    }
    return true;
}

/// Puts the content of a file in the place of another one's; on a full disk that one stays as it was.
bool copy_into(int from, const fs::path& to, ::off_t old_size) {
    const ::off_t size = ::lseek(from, 0, SEEK_END);
    const int file = ::open(to.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) return false;
    int problem = size > 0 ? ::posix_fallocate(file, 0, size) : 0; // the room first
    if (problem != 0) ::ftruncate(file, old_size);
    if (problem == 0 && !copy_all(from, file, size)) problem = errno;
    if (problem == 0 && (::ftruncate(file, size) != 0 || ::fsync(file) != 0)) problem = errno;
    ::close(file);
    errno = problem;
    return problem == 0;
}

/// A file that is read, and may get other names meanwhile.
class Reading {
  public:
    explicit Reading(const fs::path& file)
        : descriptor_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
    ~Reading() {
        if (is_open()) ::close(descriptor_);
    }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

    bool is_open() const { return descriptor_ >= 0; }
    int descriptor() const { return descriptor_; }
    ::nlink_t names() const {
        struct stat status {};
        return ::fstat(descriptor_, &status) == 0 ? status.st_nlink : 0;
    }
    std::string text() const {
        std::string all;
        std::array<char, 65536> part{};
        for (::ssize_t count;
             (count = ::pread(descriptor_, part.data(), part.size(), static_cast<::off_t>(all.size()))) > 0;)
            all.append(part.data(), static_cast<std::size_t>(count));
        return all;
    }

  private:
    const int descriptor_;
};

/// Exchanges two files, or gives the first the name of the second, which nobody has. Returns an error number:
/// EINVAL where the file system can do neither.
int put(const fs::path& from, const fs::path& to, bool exchanges) {
#ifdef RENAME_EXCHANGE
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(),
                    exchanges ? RENAME_EXCHANGE : RENAME_NOREPLACE) == 0)
        return 0;
    return errno == ENOSYS ? EINVAL : errno;
#else
    static_cast<void>(from), static_cast<void>(to), static_cast<void>(exchanges);
    return EINVAL;
#endif
}

} // namespace

void remove_abandoned(const fs::path& file) {
    const fs::path target = place_behind(file),
                   folder = target.has_parent_path() ? target.parent_path() : ".";
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
        if (!is_hidden_name(at->path().filename().string(), file.extension().string())) continue;
        const int left = ::open(at->path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
        if (left < 0) continue;
        struct stat status {};
        const bool is_file = ::fstat(left, &status) == 0 && S_ISREG(status.st_mode);
        if (is_file && lock(left)) ::unlink(at->path().c_str()); // nobody works on it
        ::close(left);
    }
}

OutputFile::OutputFile(fs::path file) : file_(std::move(file)), target_(place_behind(file_)) {
    struct stat status {};
    const bool exists = ::stat(file_.c_str(), &status) == 0; // what a link of /proc leads to has no name
    if (!exists && (errno != ENOENT || file_.empty())) fail(errno);
    if (exists && S_ISDIR(status.st_mode)) fail(EISDIR);
    is_special_ = exists && (!S_ISREG(status.st_mode) || descriptor_of(file_.string()) >= 0);
    if (is_special_) {
        descriptor_ = open_to_write(file_.string(), 0);
        if (descriptor_ < 0) fail(errno);
        return;
    }
    if (exists && ::access(target_.c_str(), W_OK) != 0) fail(errno);
    // Nameless, so that nothing stays behind however the program ends; not every file system has such files.
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : ".";
    if (::access("/proc/self/fd", X_OK) == 0)
        descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) lock(descriptor_);
    if (descriptor_ < 0) make_named();
    if (exists) ::fchmod(descriptor_, status.st_mode & 07777);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : file_(std::move(other.file_)), target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})), descriptor_(std::exchange(other.descriptor_, -1)),
      is_special_(other.is_special_) {}

OutputFile::~OutputFile() {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
    if (descriptor_ >= 0) ::close(descriptor_);
}

/// Gives the file a name beside its place.
void OutputFile::make_named() {
    const std::string nameless = "/proc/self/fd/" + std::to_string(descriptor_);
    int made = -1;
    do {
        temporary_ = hidden_name(target_, file_.extension().string());
        if (descriptor_ >= 0)
            made = ::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW);
        else
            made = descriptor_ =
                ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    } while (made < 0 && errno == EEXIST);
    if (made >= 0) {
        lock(descriptor_);
        return;
    }
    temporary_.clear();
    fail(errno);
}

const fs::path& OutputFile::path() {
    if (is_special_) fail(ESPIPE);
    if (temporary_.empty()) make_named();
    return temporary_;
}

void OutputFile::write(std::string_view text) {
    if (!is_special_ && (::ftruncate(descriptor_, 0) != 0 || ::lseek(descriptor_, 0, SEEK_SET) != 0))
        fail(errno);
    append(text);
}

void OutputFile::append(std::string_view text) {
    if (!write_all(descriptor_, text)) fail(errno);
}

/// Its content first: after a power cut the name must not stand for an empty file.
void OutputFile::make_whole() {
    if (::fsync(descriptor_) != 0) fail(errno);
    if (temporary_.empty()) make_named();
}

void OutputFile::replace() {
    struct stat there {};
    // A file that has several names stays that file: the new content, which is whole on the disk beside it,
    // is copied into it.
    if (::stat(target_.c_str(), &there) == 0 && S_ISREG(there.st_mode) && there.st_nlink > 1) {
        if (!copy_into(descriptor_, target_, there.st_size)) fail(errno);
        ::unlink(temporary_.c_str());
    } else if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
        fail(errno);
    }
    temporary_.clear();
}

void OutputFile::commit() {
    if (!is_special_) {
        make_whole();
        replace();
    }
    ::close(std::exchange(descriptor_, -1));
}

bool OutputFile::commit_over(const std::optional<std::string>& before) {
    if (is_special_) return false; // another program has put it in the place of the file
    make_whole();
    const Reading there(target_);
    if (!there.is_open() && errno != ENOENT) fail(errno);
    if (there.is_open() != before.has_value() || (before && there.text() != *before)) return false;
    lock(there.descriptor()); // beside its place it is nothing that was abandoned
    const std::string ours = Reading(temporary_).text();
    const int error = there.names() > 1 ? EINVAL : put(temporary_, target_, before.has_value());
    if (error == EEXIST || error == ENOENT) return false;
    if (error == EINVAL) replace(); // the file system can do no better
    if (error != 0 && error != EINVAL) fail(error);
    if (error == 0 && !before) temporary_.clear();
    if (temporary_.empty()) return true;
    std::string out = Reading(temporary_).text(), in = ours;
    if (out == *before) return true;
    // It was written after it was read here. It goes back, and so does what is written in the meantime.
    for (bool is_back = false; !is_back;) {
        if (put(temporary_, target_, true) != 0) {
            if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
            temporary_.clear();
            return false;
        }
        std::string next = Reading(temporary_).text();
        is_back = next == in;
        in = std::exchange(out, std::move(next));
    }
    return false;
}

void OutputFile::fail(int error) const {
    throw FileError("cannot write " + file_.string() + ": " + write_error(error));
}

OutputFolder::OutputFolder(fs::path folder) : folder_(std::move(folder)) {
    // What a link leads to cannot be asked with a slash behind it where nothing is there yet.
    const fs::path named = folder_.has_filename() ? folder_ : folder_.parent_path();
    std::error_code error;
    target_ = fs::absolute(place_behind(named), error).lexically_normal();
    if (error) fail("the current folder is not there any more; change to another one");
    if (!target_.has_filename()) target_ = target_.parent_path();
    const auto status = fs::status(target_, error);
    if (error == std::errc::too_many_symbolic_link_levels) fail(file_error(ELOOP));
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
    if (error) fail(write_error(error.value()));
    const int to =
        ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, is_program ? 0777 : 0666);
    const bool is_written = to >= 0 && write_all(to, text);
    const int why = errno;
    if (to >= 0) ::close(to);
    if (!is_written) fail(name.string() + ": " + write_error(why));
}

void OutputFolder::copy(const fs::path& from, const fs::path& name) const {
    const fs::path file = temporary_ / name;
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    if (error) fail(write_error(error.value()));
    const Reading source(from);
    struct stat status {};
    if (!source.is_open() || ::fstat(source.descriptor(), &status) != 0)
        fail(from.string() + ": " + file_error(errno));
    const int to =
        ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, status.st_mode & 0777);
    if (to < 0 && errno == EEXIST) return; // as another file of that name
    const bool is_written = to >= 0 && ::fchmod(to, status.st_mode & 0777) == 0 &&
                            copy_all(source.descriptor(), to, status.st_size);
    const int why = errno;
    if (to >= 0) ::close(to);
    if (!is_written) fail(name.string() + ": " + write_error(why));
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
    std::string text;
    const std::string wrong = read_file(file.string(), text, most);
    if (!wrong.empty()) throw FileError("cannot read " + file.string() + ": " + wrong);
    return text;
}

bool is_inside(const fs::path& file, const fs::path& folder) {
    std::error_code error;
    const fs::path real = fs::weakly_canonical(file, error);
    if (error) return false;
    const fs::path within = fs::weakly_canonical(folder, error);
    if (error) return false;
    const fs::path way = real.lexically_relative(within);
    return !way.empty() && *way.begin() != "..";
}

} // namespace bf

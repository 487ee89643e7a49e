#include "streams/segment.hpp"

#include "bf/core/hash.hpp"
#include "bf/core/shared_file.hpp"

#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fcntl.h>
#include <span>
#include <stdexcept>
#include <sys/stat.h>
#include <unistd.h>

namespace bf::toolbox {

namespace {

// Bytes of the file that stand for what its openers do; locks of open files end with them.
constexpr off_t writer_byte = 0, reader_byte = 1, life_byte = 2;

/// The name as that of a file.
std::string file_name(const std::string& name) {
    constexpr const char* digits = "0123456789abcdef";
    std::string text;
    for (const char letter : name) {
        const auto byte = static_cast<unsigned char>(letter);
        if ((byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') || (byte >= '0' && byte <= '9') ||
            byte == '_' || byte == '-')
            text += letter;
        else
            text += {'%', digits[byte >> 4], digits[byte & 15]};
    }
    return text;
}

std::runtime_error failure(const std::string& name, const std::string& what) {
    return std::runtime_error("stream '" + name + "': " + what);
}

/// Of words that nobody wrote in between.
std::uint64_t check_of(std::span<const std::uint64_t> words) noexcept {
    std::uint64_t sum = words.size() + 1;
    for (const std::uint64_t word : words) sum = hash_word(word, sum);
    return sum;
}

bool read_at(int descriptor, void* to, std::size_t bytes, std::size_t at) noexcept {
    return pread(descriptor, to, bytes, static_cast<off_t>(at)) == static_cast<ssize_t>(bytes);
}
bool write_at(int descriptor, const void* from, std::size_t bytes, std::size_t at) noexcept {
    return pwrite(descriptor, from, bytes, static_cast<off_t>(at)) == static_cast<ssize_t>(bytes);
}

} // namespace

Segment::Segment(const std::filesystem::path& folder, const std::string& name, int size, Role role)
    : file_(folder / file_name(name)), size_(size),
      words_(place_bytes(static_cast<std::uint64_t>(size)) / sizeof(std::uint64_t)) {
    if (name.empty()) throw failure(name, "it needs a name, such as '/robot/state'");
    if (file_.filename().string().size() > 255)
        throw failure(name.substr(0, 40) + "...",
                      "its name is longer than that of a file may be, 255 letters; give a shorter one");
    const std::size_t bytes = sizeof(Head) + places * place_bytes(static_cast<std::uint64_t>(size));
    for (;;) {
        if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
            throw failure(name, "cannot make the folder " + folder.string() + ": " + std::strerror(errno));
        struct stat owner {};
        if (lstat(folder.c_str(), &owner) != 0 && errno == ENOENT)
            continue; // the last stream was closed just now
        if (!S_ISDIR(owner.st_mode) || owner.st_uid != geteuid() || (owner.st_mode & 077) != 0)
            throw failure(name, folder.string() + " is not a folder of this user alone; delete it");
        descriptor_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (descriptor_ < 0 && errno == ENOENT) continue;
        if (descriptor_ < 0)
            throw failure(name, "cannot open " + file_.string() + ": " + std::strerror(errno));
        // The last one to close a file locks it against all others while deleting it.
        if (!lock_byte(descriptor_, life_byte, F_RDLCK) || !is_named(descriptor_, file_.c_str())) {
            ::close(descriptor_);
            continue;
        }
        std::string wrong;
        if (role == Role::writer && !lock_byte(descriptor_, writer_byte, F_WRLCK))
            wrong = "somebody else writes it; give this one another name, or end the other";
        else if (role == Role::reader && !lock_byte(descriptor_, reader_byte, F_RDLCK))
            wrong = std::string("cannot lock its file: ") + std::strerror(errno);
        else if (role == Role::writer)
            if (const int error = posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes)); error != 0)
                wrong = std::string("there is no memory for it: ") + std::strerror(error);
        if (wrong.empty()) break;
        close();
        throw failure(name, wrong);
    }
    written_ = newest(); // of a writer before
}

void Segment::close() noexcept {
    if (descriptor_ < 0) return;
    if (is_named(descriptor_, file_.c_str()) && lock_byte(descriptor_, life_byte, F_WRLCK)) {
        unlink(file_.c_str());
        rmdir(file_.parent_path().c_str()); // which does nothing while there are others
    }
    ::close(descriptor_);
    descriptor_ = -1;
}

bool Segment::has(Role role) const noexcept {
    return !is_byte_free(descriptor_, role == Role::writer ? writer_byte : reader_byte);
}

Segment::Head Segment::head() const noexcept {
    for (int attempt = 0; attempt < 3; ++attempt) {
        Head head;
        if (!read_at(descriptor_, &head, sizeof head, 0)) break;
        if (head.check == check_of(std::array{head.number, head.count}) && head.count <= INT_MAX) return head;
    }
    return {};
}

bool Segment::write(const Eigen::Ref<const Eigen::VectorXd>& given, double time) noexcept {
    const auto count = static_cast<std::uint64_t>(given.size());
    if (given.size() != size_) return false;
    words_[0] = ++written_;
    std::memcpy(&words_[1], &time, sizeof time);
    if (count > 0) std::memcpy(&words_[2], given.data(), count * sizeof(double));
    words_[count + 2] = check_of(std::span(words_).first(count + 2));
    const Head head{written_, count, check_of(std::array{written_, count})};
    return write_at(descriptor_, words_.data(), place_bytes(count),
                    sizeof head + written_ % places * place_bytes(count)) &&
           write_at(descriptor_, &head, sizeof head, 0);
}

std::uint64_t Segment::read(Eigen::Ref<Eigen::VectorXd> taken, double& time) noexcept {
    for (int attempt = 0; attempt < 3; ++attempt) {
        const Head newest = head();
        if (newest.number == 0) return none;
        count_ = static_cast<int>(newest.count);
        if (count_ != size_ || taken.size() != size_) return misfit;
        if (!read_at(descriptor_, words_.data(), place_bytes(newest.count),
                     sizeof newest + newest.number % places * place_bytes(newest.count)))
            return none;
        if (words_[0] != newest.number ||
            words_[newest.count + 2] != check_of(std::span(words_).first(newest.count + 2)))
            continue;
        std::memcpy(&time, &words_[1], sizeof time);
        if (size_ > 0) std::memcpy(taken.data(), &words_[2], newest.count * sizeof(double));
        return newest.number;
    }
    return none;
}

} // namespace bf::toolbox

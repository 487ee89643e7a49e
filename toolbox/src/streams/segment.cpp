#include "streams/segment.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace bf::toolbox {

namespace {

static_assert(std::atomic<double>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free);

// Bytes of the file that stand for what its openers do; locks of open files end with them.
constexpr off_t writer_byte = 0, reader_byte = 1, life_byte = 2;

bool lock(int descriptor, off_t byte, short kind) noexcept {
    struct flock range {};
    range.l_type = kind;
    range.l_whence = SEEK_SET;
    range.l_start = byte;
    range.l_len = 1;
    return fcntl(descriptor, F_OFD_SETLK, &range) == 0;
}

/// Could nobody else have that lock?
bool is_free(int descriptor, off_t byte) noexcept {
    struct flock range {};
    range.l_type = F_WRLCK;
    range.l_whence = SEEK_SET;
    range.l_start = byte;
    range.l_len = 1;
    return fcntl(descriptor, F_OFD_GETLK, &range) != 0 || range.l_type == F_UNLCK;
}

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

} // namespace

Segment::Segment(const std::filesystem::path& folder, const std::string& name, int size, Role role)
    : file_(folder / file_name(name)),
      bytes_(sizeof(Header) + static_cast<std::size_t>(size) * sizeof(double)), size_(size) {
    if (name.empty()) throw failure(name, "it needs a name, such as '/robot/state'");
    if (file_.filename().string().size() > 255) throw failure(name, "its name is too long");
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
        struct stat opened = {}, present = {};
        if (!lock(descriptor_, life_byte, F_RDLCK) || fstat(descriptor_, &opened) != 0 ||
            stat(file_.c_str(), &present) != 0 || opened.st_ino != present.st_ino) {
            ::close(descriptor_);
            continue;
        }
        std::string wrong;
        if (role == Role::writer && !lock(descriptor_, writer_byte, F_WRLCK))
            wrong = "somebody else writes it; give this one another name, or end the other";
        else if (role == Role::reader && !lock(descriptor_, reader_byte, F_RDLCK))
            wrong = std::string("cannot lock its file: ") + std::strerror(errno);
        // Never shorter, as others may have it, too.
        else if (const int error = posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes_)); error != 0)
            wrong = std::string("there is no memory for it: ") + std::strerror(error);
        if (wrong.empty()) break;
        close();
        throw failure(name, wrong);
    }
    void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    if (memory == MAP_FAILED) {
        close();
        throw failure(name, std::string("there is no memory for it: ") + std::strerror(errno));
    }
    header_ = static_cast<Header*>(memory);
}

Segment::~Segment() {
    if (header_) munmap(header_, bytes_);
    close();
}

void Segment::close() noexcept {
    if (descriptor_ < 0) return;
    if (lock(descriptor_, life_byte, F_WRLCK)) {
        unlink(file_.c_str());
        rmdir(file_.parent_path().c_str()); // which does nothing while there are others
    }
    ::close(descriptor_);
    descriptor_ = -1;
}

bool Segment::has(Role role) const noexcept {
    return !is_free(descriptor_, role == Role::writer ? writer_byte : reader_byte);
}

std::uint64_t Segment::newest() const noexcept { return header_->lock.turn() / 2; }

int Segment::count() const noexcept {
    return static_cast<int>(header_->count.load(std::memory_order_relaxed));
}

void Segment::write(const Eigen::Ref<const Eigen::VectorXd>& given, double time) noexcept {
    const std::uint64_t k = newest() + 1;
    header_->lock.begin(k);
    header_->count.store(static_cast<std::uint64_t>(given.size()), std::memory_order_relaxed);
    header_->time.store(time, std::memory_order_relaxed);
    for (int i = 0; i < std::min<int>(size_, static_cast<int>(given.size())); ++i)
        values()[i].store(given[i], std::memory_order_relaxed);
    header_->lock.end(k);
}

std::uint64_t Segment::read(Eigen::Ref<Eigen::VectorXd> taken, double& time) const noexcept {
    for (int attempt = 0; attempt < 3; ++attempt) {
        const auto turn = header_->lock.turn();
        if (turn % 2 != 0) continue;
        const auto number = header_->count.load(std::memory_order_relaxed);
        const double sent = header_->time.load(std::memory_order_relaxed);
        const bool fits = number == static_cast<std::uint64_t>(taken.size()) && taken.size() <= size_;
        for (Eigen::Index i = 0; fits && i < taken.size(); ++i)
            taken[i] = values()[i].load(std::memory_order_relaxed);
        if (!header_->lock.is_still(turn)) continue;
        if (!fits) return misfit;
        time = sent;
        return turn / 2;
    }
    return torn;
}

} // namespace bf::toolbox

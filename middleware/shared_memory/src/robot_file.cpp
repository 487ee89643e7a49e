#include "robot_file.hpp"

#include "bf/shared_memory/robot.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace bf::shared_memory {

using middleware::Exchange;
using middleware::RobotDescription;
using middleware::RobotLayout;

namespace {

std::runtime_error system_error(const std::string& what) {
    return std::runtime_error(what + ": " + std::strerror(errno));
}

/// A folder in memory of this user alone. Throws std::runtime_error.
std::string folder() {
    const std::string name = "/dev/shm/blockfactory-" + std::to_string(geteuid()) + "-robots";
    if (mkdir(name.c_str(), 0700) != 0 && errno != EEXIST)
        throw system_error("cannot make the folder " + name);
    struct stat found {};
    if (lstat(name.c_str(), &found) != 0 || !S_ISDIR(found.st_mode) || found.st_uid != geteuid() ||
        (found.st_mode & 077) != 0)
        throw std::runtime_error(name + " is not a folder of this user alone; delete it");
    return name;
}

/// Holds others back who make a robot, as long as it lives.
class Making {
  public:
    explicit Making(const std::string& folder)
        : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
        if (descriptor_ < 0 || flock(descriptor_, LOCK_EX) != 0) throw system_error("cannot lock " + folder);
    }
    ~Making() { ::close(descriptor_); }

  private:
    int descriptor_;
};

/// The lock of one byte, in whatever program.
struct flock range(int byte) noexcept {
    struct flock lock {};
    lock.l_type = F_WRLCK;
    lock.l_whence = SEEK_SET;
    lock.l_start = byte;
    lock.l_len = 1;
    return lock;
}

} // namespace

std::string wrong_name(const std::string& name) {
    const bool is_plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                 "0123456789_-.") == std::string::npos;
    if (!name.empty() && name.size() <= 100 && is_plain && name[0] != '.') return {};
    return "the robot's name is '" + name + "'; write up to 100 letters, digits, '_', '-' and '.'";
}

bool RobotFile::is_free(int byte) const noexcept {
    auto lock = range(byte);
    return fcntl(descriptor_, F_OFD_GETLK, &lock) != 0 || lock.l_type == F_UNLCK;
}

bool RobotFile::lock(int byte) const noexcept {
    auto lock = range(byte);
    return fcntl(descriptor_, F_OFD_SETLK, &lock) == 0;
}

void RobotFile::map(std::size_t bytes) {
    void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    if (memory == MAP_FAILED) throw system_error("there is no memory for it");
    header_ = static_cast<Header*>(memory);
    bytes_ = bytes;
}

std::size_t RobotFile::place(const RobotDescription& description, std::size_t text_bytes) {
    const RobotLayout layout(description);
    std::size_t end = header_bytes + (text_bytes + 63) / 64 * 64;
    for (auto& [exchange, size] :
         {std::pair(&state_, layout.state_size()), std::pair(&gains_, layout.settings_size()),
          std::pair(&command_, layout.command_size()), std::pair(&settings_, layout.settings_size())}) {
        if (header_) exchange->emplace(reinterpret_cast<std::byte*>(header_) + end, size);
        end += Exchange::bytes(size);
    }
    return end;
}

void RobotFile::create(const std::string& name, const RobotDescription& description) {
    close();
    if (const auto wrong = wrong_name(name); !wrong.empty()) throw std::runtime_error(wrong);
    const std::string in = folder(), file = in + "/" + name, fresh = file + "~";
    const Making making(in);
    // What a server has left that was killed nobody uses any more.
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    const bool is_served = descriptor_ >= 0 && !is_server_gone();
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    if (is_served)
        throw std::runtime_error(
            "another program serves a robot of that name; end it, or choose another name");
    unlink(fresh.c_str());
    descriptor_ = ::open(fresh.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor_ < 0) throw system_error("cannot make " + fresh);
    try {
        text_ = description.text();
        const std::size_t bytes = place(description, text_.size());
        if (const int error = posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes)); error != 0)
            throw std::runtime_error(std::string("there is no memory for it: ") + std::strerror(error));
        if (!lock(server_byte)) throw system_error("cannot lock " + fresh);
        map(bytes);
        place(description, text_.size());
        mend();
        if (rename(fresh.c_str(), file.c_str()) != 0) throw system_error("cannot make " + file);
    } catch (...) {
        unlink(fresh.c_str());
        close();
        throw;
    }
    made_ = file;
}

void RobotFile::mend() noexcept {
    auto* text = reinterpret_cast<std::byte*>(header_) + header_bytes;
    if (header_->magic == magic && header_->layout == sizeof(Header) && header_->text_bytes == text_.size() &&
        header_->is_complete.load(std::memory_order_relaxed) == 1 &&
        std::memcmp(text, text_.data(), text_.size()) == 0)
        return;
    header_->magic = magic;
    header_->layout = sizeof(Header);
    header_->text_bytes = text_.size();
    std::memcpy(text, text_.data(), text_.size());
    header_->is_complete.store(1, std::memory_order_release);
}

bool RobotFile::open(const std::string& name, RobotDescription& description) {
    close();
    descriptor_ = ::open((folder() + "/" + name).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    if (descriptor_ < 0) return false;
    try {
        struct stat found {};
        if (fstat(descriptor_, &found) != 0 || !S_ISREG(found.st_mode))
            throw std::runtime_error("its memory is no file");
        if (is_server_gone()) return close(), false;
        const auto bytes = static_cast<std::size_t>(found.st_size);
        if (bytes < header_bytes)
            throw std::runtime_error("its memory is damaged: it has only " + std::to_string(bytes) +
                                     " bytes");
        map(bytes);
        if (header_->magic != magic || header_->layout != sizeof(Header) ||
            header_->text_bytes > bytes - header_bytes ||
            header_->is_complete.load(std::memory_order_acquire) != 1)
            throw std::runtime_error(
                "its memory is that of another version, or damaged; use the same BlockFactory on both sides, "
                "or start its server anew");
        description = RobotDescription::read(
            std::string(reinterpret_cast<const char*>(header_) + header_bytes, header_->text_bytes));
        if (const std::size_t wanted = place(description, header_->text_bytes); wanted != bytes)
            throw std::runtime_error("its memory has " + std::to_string(bytes) +
                                     " bytes, and a robot of its joints and "
                                     "sensors has " +
                                     std::to_string(wanted) + "; start its server anew");
        if (!lock(controller_byte))
            throw std::runtime_error("another program (process " +
                                     std::to_string(header_->controller.load()) +
                                     ") drives it; end that one first");
        header_->controller.store(static_cast<std::int32_t>(getpid()));
    } catch (...) {
        close();
        throw;
    }
    return true;
}

void RobotFile::close() noexcept {
    for (auto* exchange : {&state_, &gains_, &command_, &settings_}) exchange->reset();
    if (header_) munmap(std::exchange(header_, nullptr), bytes_);
    if (!made_.empty()) unlink(std::exchange(made_, {}).c_str());
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

} // namespace bf::shared_memory

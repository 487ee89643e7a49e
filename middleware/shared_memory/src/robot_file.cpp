#include "robot_file.hpp"

#include "bf/core/hash.hpp"
#include "bf/shared_memory/robot.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdexcept>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace bf::shared_memory {

using middleware::RobotDescription;
using middleware::RobotLayout;
using middleware::Stamp;

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

/// Of the time and all but the last of the words.
double check_of(double time, const std::vector<double>& words) noexcept {
    std::uint64_t sum =
        words.size() ^ std::bit_cast<std::uint64_t>(time); // memory that is cleared is no message
    for (std::size_t i = 0; i + 1 < words.size(); ++i)
        sum = hash_word(std::bit_cast<std::uint64_t>(words[i]), sum);
    return std::bit_cast<double>(sum);
}

constexpr const char* damaged = "its memory is that of another version, or damaged; use the same "
                                "BlockFactory on both sides, or start its server anew";

bool is_same(const double* a, const double* b, std::size_t count) noexcept {
    return std::memcmp(a, b, count * sizeof(double)) == 0; // bit by bit, as some are NaN
}

} // namespace

void CheckedExchange::write(const double* values, double time) noexcept {
    std::copy_n(values, message_.size() - 1, message_.begin());
    message_.back() = check_of(time, message_);
    time_ = time;
    is_written_ = true;
    exchange_.write(message_.data(), time);
}

bool CheckedExchange::read() noexcept {
    if (exchange_.read(read_.data(), come_)) {
        const double check = check_of(come_.time, read_);
        if (is_same(&check, &read_.back(), 1)) return true;
    }
    come_ = {};
    return false;
}

bool CheckedExchange::has_news(const Stamp& last) noexcept {
    const auto newest = exchange_.newest();
    return newest != last.number && ((newest == come_.number && newest != 0) || read());
}

bool CheckedExchange::take(double* values, Stamp& last) noexcept {
    if (!has_news(last)) return false;
    std::copy_n(read_.begin(), read_.size() - 1, values);
    last = come_;
    return true;
}

void CheckedExchange::mend() noexcept {
    if (!is_written_ || (read() && come_.number == exchange_.written() &&
                         is_same(read_.data(), message_.data(), message_.size())))
        return;
    exchange_.write(message_.data(), time_);
}

std::string wrong_name(const std::string& name) {
    const bool is_plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                 "0123456789_-.") == std::string::npos;
    if (!name.empty() && name.size() <= 100 && is_plain && name[0] != '.') return {};
    return "the robot's name is '" + name + "'; write up to 100 letters, digits, '_', '-' and '.'";
}

void RobotFile::attach(int memory) {
    void* const attached = shmat(memory, nullptr, 0);
    if (attached == reinterpret_cast<void*>(-1)) throw system_error("its memory is not in reach");
    header_ = static_cast<Header*>(attached);
}

std::size_t RobotFile::place(const RobotDescription& description, std::size_t text_bytes) {
    const RobotLayout layout(description);
    std::size_t end = header_bytes + (text_bytes + 63) / 64 * 64;
    for (auto& [exchange, size] :
         {std::pair(&state_, layout.state_size()), std::pair(&gains_, layout.settings_size()),
          std::pair(&command_, layout.command_size()), std::pair(&settings_, layout.settings_size())}) {
        if (header_) exchange->emplace(reinterpret_cast<std::byte*>(header_) + end, size);
        end += CheckedExchange::bytes(size);
    }
    return end;
}

int RobotFile::make(const std::string& file) const {
    const std::string fresh = file + "~";
    // What a server has left that was killed nobody uses any more.
    const int found = ::open(file.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    const bool is_served = found >= 0 && !is_byte_free(found, server_byte);
    if (found >= 0) ::close(found);
    if (is_served)
        throw std::runtime_error(
            "another program serves a robot of that name; end it, or choose another name");
    unlink(fresh.c_str());
    const int made = ::open(fresh.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (made < 0) throw system_error("cannot make " + fresh);
    if (lock_byte(made, server_byte, F_WRLCK) &&
        pwrite(made, &finder_, sizeof finder_, 0) == sizeof finder_ &&
        rename(fresh.c_str(), file.c_str()) == 0)
        return made;
    const auto error = system_error("cannot make " + file);
    unlink(fresh.c_str());
    ::close(made);
    throw error;
}

void RobotFile::create(const std::string& name, const RobotDescription& description) {
    close();
    if (const auto wrong = wrong_name(name); !wrong.empty()) throw std::runtime_error(wrong);
    const std::string in = folder(), file = in + "/" + name;
    const Making making(in);
    try {
        text_ = description.text();
        const std::size_t bytes = place(description, text_.size());
        const int memory = shmget(IPC_PRIVATE, bytes, IPC_CREAT | 0600);
        if (memory < 0) throw system_error("there is no memory for it");
        try {
            attach(memory);
        } catch (...) {
            shmctl(memory, IPC_RMID, nullptr);
            throw;
        }
        shmctl(memory, IPC_RMID, nullptr);                  // when nobody is attached any more
        std::memset(static_cast<void*>(header_), 0, bytes); // it is all there from now on
        finder_ = {Finder::own_magic, memory};
        place(description, text_.size());
        mend_memory();
        descriptor_ = make(file);
    } catch (...) {
        close();
        throw;
    }
    made_ = file;
}

/// At the end of a login the system may remove what its user has in memory. A controller that has found the
/// robot by the file of before knows by it that the server lives, and is known by it, and none is let in
/// beside it.
void RobotFile::name_anew() {
    const Making making(folder());
    const int made = make(made_);
    if (removed_ < 0 && !is_byte_free(descriptor_, controller_byte))
        removed_ = descriptor_;
    else
        ::close(descriptor_);
    descriptor_ = made;
    if (removed_ >= 0) lock_byte(descriptor_, controller_byte, F_WRLCK);
}

void RobotFile::mend() noexcept {
    if (!is_named(descriptor_, made_.c_str())) try {
            name_anew();
        } catch (const std::exception&) { // and again the next time
        }
    if (removed_ >= 0 && is_byte_free(removed_, controller_byte)) {
        lock_byte(descriptor_, controller_byte, F_UNLCK);
        ::close(std::exchange(removed_, -1));
    }
    Finder found{};
    if (pread(descriptor_, &found, sizeof found, 0) != sizeof found || found.magic != finder_.magic ||
        found.memory != finder_.memory)
        static_cast<void>(pwrite(descriptor_, &finder_, sizeof finder_, 0) < 0); // and again the next time
    mend_memory();
}

void RobotFile::mend_memory() noexcept {
    state_->mend();
    gains_->mend();
    auto* text = reinterpret_cast<std::byte*>(header_) + header_bytes;
    if (header_->layout == sizeof(Header) && header_->text_bytes == text_.size() &&
        header_->is_complete.load(std::memory_order_relaxed) == 1 &&
        std::memcmp(text, text_.data(), text_.size()) == 0)
        return;
    header_->layout = sizeof(Header);
    header_->text_bytes = static_cast<std::uint32_t>(text_.size());
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
        shmid_ds memory{};
        if (pread(descriptor_, &finder_, sizeof finder_, 0) != sizeof finder_ ||
            finder_.magic != Finder::own_magic)
            throw std::runtime_error(damaged);
        if (shmctl(finder_.memory, IPC_STAT, &memory) != 0)
            throw system_error("its memory is not in reach, be it that its file is damaged, or that it is of "
                               "another container (share its IPC namespace)");
        const std::size_t bytes = memory.shm_segsz;
        if (memory.shm_perm.uid != geteuid() || bytes < header_bytes) throw std::runtime_error(damaged);
        attach(finder_.memory);
        // What others may write over while it is looked at is read once.
        const std::size_t text_bytes = header_->text_bytes;
        if (header_->layout != sizeof(Header) || text_bytes > bytes - header_bytes ||
            header_->is_complete.load(std::memory_order_acquire) != 1)
            throw std::runtime_error(damaged);
        std::string text(text_bytes, '\0');
        std::memcpy(text.data(), reinterpret_cast<const std::byte*>(header_) + header_bytes, text_bytes);
        description = RobotDescription::read(text);
        if (const std::size_t wanted = place(description, text_bytes); wanted != bytes)
            throw std::runtime_error("its memory has " + std::to_string(bytes) +
                                     " bytes, and a robot of its joints and sensors has " +
                                     std::to_string(wanted) + "; start its server anew");
        if (!lock_byte(descriptor_, controller_byte, F_WRLCK))
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
    if (header_) shmdt(std::exchange(header_, nullptr));
    if (!made_.empty() && is_named(descriptor_, made_.c_str()))
        unlink(made_.c_str()); // another server may have one of that name
    made_.clear();
    for (int* descriptor : {&descriptor_, &removed_})
        if (*descriptor >= 0) ::close(std::exchange(*descriptor, -1));
}

} // namespace bf::shared_memory

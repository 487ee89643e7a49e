// The memory of a served robot, and the file by which other programs find it.
#pragma once

#include "bf/core/shared_file.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bf::shared_memory {

/// An exchange with memory that others may write over: behind each message stands a check of it, and
/// what does not fit that is no message.
class CheckedExchange {
  public:
    static std::size_t bytes(int size) { return middleware::Exchange::bytes(size + 1); }
    CheckedExchange(void* memory, int size)
        : exchange_(memory, size + 1), message_(static_cast<std::size_t>(size) + 1), read_(message_) {}

    void write(const double* values, double time) noexcept;
    /// Is there a message to take that is not the `last` one?
    bool has_news(const middleware::Stamp& last) noexcept;
    /// Copies it, and makes it the last one.
    bool take(double* values, middleware::Stamp& last) noexcept;
    /// Of the writer: writes its last message again where it is not as it was.
    void mend() noexcept;

  private:
    bool read() noexcept;

    middleware::Exchange exchange_;
    std::vector<double> message_, read_; ///< the last one, and what was read
    middleware::Stamp come_;             ///< of what was read; number 0: it is no message
    double time_ = 0;
    bool is_written_ = false;
};

/// The memory is one of System V, whose size nobody changes: who makes a mapped file shorter ends every
/// program that looks at it (SIGBUS). The system gives it back when the last program has left it, however
/// that ended. The file says which memory it is, and its locks, which the kernel forgets with a program, tell
/// each side of the other's death.
class RobotFile {
  public:
    RobotFile() = default;
    RobotFile(const RobotFile&) = delete;
    RobotFile& operator=(const RobotFile&) = delete;
    ~RobotFile() { close(); }

    /// Of the server. Throws std::runtime_error: somebody serves a robot of that name, there is no memory.
    void create(const std::string& name, const middleware::RobotDescription& description);
    /// Of a controller. False where no such robot is served at present. Throws std::runtime_error: somebody
    /// drives it already, or the memory is another version's or damaged.
    bool open(const std::string& name, middleware::RobotDescription& description);
    /// The file is deleted where it was made here.
    void close() noexcept;

    /// Of the server: writes anew what somebody has written over of the file, of that by which controllers
    /// know the memory, and of what was shown; makes the file anew where somebody has removed it.
    void mend() noexcept;

    bool is_server_gone() const noexcept { return is_byte_free(descriptor_, server_byte); }
    bool is_controller_gone() const noexcept {
        return is_byte_free(descriptor_, controller_byte) &&
               (removed_ < 0 || is_byte_free(removed_, controller_byte));
    }

    /// From the server and from the controller.
    CheckedExchange& state() { return *state_; }
    CheckedExchange& gains() { return *gains_; }
    CheckedExchange& command() { return *command_; }
    CheckedExchange& settings() { return *settings_; }
    middleware::Bell& state_bell() noexcept { return header_->state_bell; }
    middleware::Bell& command_bell() noexcept { return header_->command_bell; }

  private:
    static constexpr int server_byte = 0, controller_byte = 1;

    /// All of the file.
    struct Finder {
        static constexpr std::uint32_t own_magic = 0x42465232; ///< "BFR2"
        std::uint32_t magic;
        std::int32_t memory; ///< its number in the system
    };
    struct Header {
        std::uint32_t layout;     ///< of this struct
        std::uint32_t text_bytes; ///< of the description behind it
        std::atomic<std::uint32_t> is_complete;
        std::atomic<std::int32_t> controller; ///< its process, or that of the last one
        alignas(64) middleware::Bell state_bell;
        alignas(64) middleware::Bell command_bell;
    };
    static constexpr std::size_t header_bytes = 256;
    static_assert(sizeof(Header) <= header_bytes);

    /// Of the server: the file of that name, with its lock. Throws std::runtime_error.
    int make(const std::string& file) const;
    void name_anew();
    void mend_memory() noexcept;
    void attach(int memory);
    /// The four vectors for that robot; how many bytes there are, up to their end.
    std::size_t place(const middleware::RobotDescription& description, std::size_t text_bytes);

    int descriptor_ = -1;
    int removed_ = -1; ///< the file that was removed while a controller had found the robot by it
    Finder finder_{};
    Header* header_ = nullptr;
    std::string made_, text_; ///< the file and the description, where it was made here
    std::optional<CheckedExchange> state_, gains_, command_, settings_;
};

} // namespace bf::shared_memory

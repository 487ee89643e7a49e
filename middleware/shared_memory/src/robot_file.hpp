// The memory of a served robot: a file that its server makes anew each time, and that other programs map.
#pragma once

#include "bf/middleware/bell.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

namespace bf::shared_memory {

/// The kernel forgets the locks of a program that ends, however it ends: so each side knows of the other's
/// death.
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

    /// Of the server: writes anew what somebody has written over of that by which controllers know the file.
    void mend() noexcept;

    bool is_server_gone() const noexcept { return is_free(server_byte); }
    bool is_controller_gone() const noexcept { return is_free(controller_byte); }

    /// From the server and from the controller.
    middleware::Exchange& state() { return *state_; }
    middleware::Exchange& gains() { return *gains_; }
    middleware::Exchange& command() { return *command_; }
    middleware::Exchange& settings() { return *settings_; }
    middleware::Bell& state_bell() noexcept { return header_->state_bell; }
    middleware::Bell& command_bell() noexcept { return header_->command_bell; }

  private:
    static constexpr std::uint32_t magic = 0x42465231; ///< "BFR1"
    static constexpr int server_byte = 0, controller_byte = 1;

    struct Header {
        std::uint32_t magic, layout; ///< of this struct
        std::uint64_t text_bytes;    ///< of the description behind it
        std::atomic<std::uint32_t> is_complete;
        std::atomic<std::int32_t> controller; ///< its process, or that of the last one
        alignas(64) middleware::Bell state_bell;
        alignas(64) middleware::Bell command_bell;
    };
    static constexpr std::size_t header_bytes = 256;
    static_assert(sizeof(Header) <= header_bytes);

    bool is_free(int byte) const noexcept;
    bool lock(int byte) const noexcept;
    void map(std::size_t bytes);
    /// The four vectors for that robot; how many bytes there are, up to their end.
    std::size_t place(const middleware::RobotDescription& description, std::size_t text_bytes);

    int descriptor_ = -1;
    std::size_t bytes_ = 0;
    Header* header_ = nullptr;
    std::string made_, text_; ///< the file and the description, where it was made here
    std::optional<middleware::Exchange> state_, gains_, command_, settings_;
};

} // namespace bf::shared_memory

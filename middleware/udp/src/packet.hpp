// Datagrams that only those can write who know a key.
#pragma once

#include "bf/middleware/robot_frames.hpp"

#include <array>
#include <atomic>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace bf::udp {

/// The last two are those of streams.
enum class Kind : std::uint8_t {
    hello = 1,
    welcome,
    busy,
    state,
    gains,
    command,
    settings,
    here,
    peer = 10,
    news
};

/// What stands before the content of a datagram. Numbers are in the order of the processors that we run on,
/// lowest byte first.
struct Head {
    static constexpr std::uint32_t magic = 0x31554642; ///< "BFU1", with the version as its last letter
    Kind kind{};
    /// A random number that the receiver has chosen: what was recorded on the way and is sent again later has
    /// that of another time, and is left out.
    std::uint64_t session = 0;
    std::uint64_t sequence = 0; ///< of the datagram in its session, from 1
    std::uint64_t number = 0;   ///< of what it carries; the same one again where that is repeated
};

/// Which datagrams of a session have come, of its last ones (the window of RFC 4303, section 3.4.3).
class Arrivals {
  public:
    /// False: this one came before, or is older than the window or than the first.
    bool come(std::uint64_t sequence);
    /// Another session, of which that is the first one. Counts go on.
    void begin(std::uint64_t first = 1) {
        first_ = first;
        newest_ = first - 1;
        seen_.reset();
    }
    /// From any thread.
    middleware::Counts counts() const noexcept { return {received_, lost_, late_, duplicates_, rejected_}; }
    void reject() { ++rejected_; }

  private:
    static constexpr std::size_t window = 1024;
    std::uint64_t first_ = 1, newest_ = 0;
    std::bitset<window> seen_; ///< bit i: the one with the number newest_ - i
    std::atomic<std::uint64_t> received_{0}, lost_{0}, late_{0}, duplicates_{0}, rejected_{0};
};

/// A secret that both sides know.
class Key {
  public:
    /// The token of a file of one line that its owner alone may read, made where there is none if it
    /// `may_make` it. Where the service manager has given a secret of the file's name, that one counts
    /// (realtime::credential). Throws std::runtime_error that says what is wrong.
    Key(const std::string& file, bool may_make);

    static constexpr std::size_t head_bytes = 32, code_bytes = 16;
    /// What one datagram holds at most, with head and code.
    static constexpr std::size_t most_bytes = 60'000;

    /// Writes head, content and their code (the first half of HMAC-SHA-256, RFC 2104) into `datagram`, whose
    /// memory is kept.
    void seal(const Head& head, std::span<const std::byte> content, std::vector<std::byte>& datagram) const;
    /// The content of one, and its head. Empty and a head of kind 0 where the code is wrong, or it is another
    /// protocol.
    std::span<const std::byte> open(std::span<const std::byte> datagram, Head& head) const;
    /// A number that follows from those bytes, which are fewer than a head's, and that nobody without the key
    /// can compute.
    std::uint64_t number_of(std::span<const std::byte> bytes) const;
    /// Is it of this protocol in another version? It may be anybody's.
    static bool is_of_other_version(std::span<const std::byte> datagram);

  private:
    std::array<std::byte, code_bytes> code(std::span<const std::byte> bytes) const;
    std::string token_;
};

/// A number that nobody can guess.
std::uint64_t random_number();

inline std::span<const std::byte> bytes_of(const std::vector<double>& values) {
    return std::as_bytes(std::span(values));
}
inline std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }
/// Copies doubles; false where there is another number of them.
bool copy(std::span<const std::byte> content, std::vector<double>& values);

} // namespace bf::udp

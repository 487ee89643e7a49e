#pragma once

// The MCAP container, https://mcap.dev/spec: every record is opcode (1 byte), length (8 bytes), content.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace bf::recording {

static_assert(std::endian::native == std::endian::little, "MCAP and our CDR payloads are little-endian");

inline constexpr std::string_view magic("\x89MCAP0\r\n", 8);

enum class Opcode : std::uint8_t {
    Header = 1,
    Footer = 2,
    Schema = 3,
    Channel = 4,
    Message = 5,
    Chunk = 6,
    MessageIndex = 7,
    ChunkIndex = 8,
    Attachment = 9,
    AttachmentIndex = 10,
    Statistics = 11,
    Metadata = 12,
    MetadataIndex = 13,
    SummaryOffset = 14,
    DataEnd = 15,
};

inline constexpr std::size_t record_header_bytes = 9;
inline constexpr std::size_t message_header_bytes = 22; // channel, sequence, log time, publish time
inline constexpr std::size_t chunk_header_bytes = 40;   // of a chunk without compression
inline constexpr std::array<std::uint8_t, 4> cdr_le = {0, 1, 0, 0};

using Bytes = std::span<const std::byte>;

/// CRC-32 of IEEE 802.3 over `bytes`, continuing from `crc`.
std::uint32_t crc32(Bytes bytes, std::uint32_t crc = 0) noexcept;
/// That of a sequence from those of its two parts, the second of `size` bytes, without reading them again.
std::uint32_t joined_crc(std::uint32_t first, std::uint32_t second, std::size_t size) noexcept;

inline Bytes bytes_of(std::string_view text) { return std::as_bytes(std::span<const char>(text)); }

/// Grows a sequence of records; keeps its memory when cleared.
class Builder {
  public:
    template <class T> void put(T value) {
        const auto* from = reinterpret_cast<const std::byte*>(&value);
        bytes_.insert(bytes_.end(), from, from + sizeof value);
    }
    void put_bytes(Bytes bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
    void put_text(std::string_view text) {
        put(static_cast<std::uint32_t>(text.size()));
        put_bytes(bytes_of(text));
    }
    void put_map(const std::map<std::string, std::string>& map) {
        const std::size_t at = begin_array();
        for (const auto& [key, value] : map) {
            put_text(key);
            put_text(value);
        }
        end_array(at);
    }

    /// An array is its length in bytes (4 bytes), then its elements.
    std::size_t begin_array() {
        put(std::uint32_t{0});
        return bytes_.size();
    }
    void end_array(std::size_t at) {
        const auto length = static_cast<std::uint32_t>(bytes_.size() - at);
        std::memcpy(&bytes_[at - sizeof length], &length, sizeof length);
    }
    void begin_record(Opcode opcode) {
        put(opcode);
        put(std::uint64_t{0});
        record_ = bytes_.size();
    }
    /// `more`: bytes of the record that follow without passing through this builder.
    void end_record(std::uint64_t more = 0) {
        const std::uint64_t length = bytes_.size() - record_ + more;
        std::memcpy(&bytes_[record_ - sizeof length], &length, sizeof length);
    }

    void clear() noexcept { bytes_.clear(); }
    std::size_t size() const noexcept { return bytes_.size(); }
    Bytes bytes() const noexcept { return bytes_; }

  private:
    std::vector<std::byte> bytes_;
    std::size_t record_ = 0;
};

/// A record says it is longer than its bytes.
struct Malformed : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Reads values off the front of a sequence of bytes; throws Malformed past its end.
class Cursor {
  public:
    explicit Cursor(Bytes bytes) : bytes_(bytes) {}
    Bytes take(std::uint64_t count) {
        if (count > bytes_.size()) throw Malformed("a record ends before its last field");
        const Bytes taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }
    template <class T> T get() {
        T value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }
    std::string text() {
        const Bytes taken = take(get<std::uint32_t>());
        return {reinterpret_cast<const char*>(taken.data()), taken.size()};
    }
    std::map<std::string, std::string> map() {
        Cursor entries(take(get<std::uint32_t>()));
        std::map<std::string, std::string> map;
        while (!entries.rest().empty()) {
            std::string key = entries.text();
            map[std::move(key)] = entries.text();
        }
        return map;
    }
    Bytes rest() const noexcept { return bytes_; }

  private:
    Bytes bytes_;
};

} // namespace bf::recording

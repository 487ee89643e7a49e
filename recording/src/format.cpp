#include "format.hpp"

#include <libdeflate.h>
#include <zlib.h>

namespace bf::recording {

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) noexcept {
    // Without bytes there may be no address, for which libdeflate gives the initial value.
    return bytes.empty() ? crc : libdeflate_crc32(crc, bytes.data(), bytes.size());
}

std::uint32_t joined_crc(std::uint32_t first, std::uint32_t second, std::size_t size) noexcept {
    return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(size)));
}

} // namespace bf::recording

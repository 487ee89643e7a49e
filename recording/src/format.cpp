#include "format.hpp"

#include <libdeflate.h>

namespace bf::recording {

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) noexcept {
    // Without bytes there may be no address, for which libdeflate gives the initial value.
    return bytes.empty() ? crc : libdeflate_crc32(crc, bytes.data(), bytes.size());
}

} // namespace bf::recording

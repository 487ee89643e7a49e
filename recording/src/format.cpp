#include "format.hpp"

#include <libdeflate.h>

namespace bf::recording {

std::uint32_t crc32(Bytes bytes, std::uint32_t crc) noexcept {
    return libdeflate_crc32(crc, bytes.data(), bytes.size());
}

} // namespace bf::recording

#pragma once

#include "format.hpp"

namespace bf::recording {

/// What was compressed to these bytes, "zstd" or "lz4" (frames). Throws Malformed, which says what is wrong
/// with the chunk: another method, other bytes than of that method, another size than it says, or a size that
/// is not read.
std::vector<std::byte> decompressed(const std::string& method, Bytes bytes, std::uint64_t size);

} // namespace bf::recording

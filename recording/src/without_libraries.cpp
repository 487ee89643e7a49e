// For WebAssembly, without the libraries that recordings of other programs need.
#include "compression.hpp"
#include "foreign.hpp"

namespace bf::recording {

std::vector<std::byte> decompressed(const std::string& method, Bytes, std::uint64_t) {
    throw Malformed("a chunk is compressed with '" + method + "', which is not read here, and is left out");
}

std::unique_ptr<Decoder> make_protobuf_decoder(std::string_view, std::string_view) {
    throw Malformed("messages in 'protobuf' are not read here");
}

} // namespace bf::recording

#include "compression.hpp"

#ifdef BF_BZIP2
#include <bzlib.h>
#endif
#include <lz4frame.h>
#include <memory>
#include <zstd.h>

namespace bf::recording {

namespace {

/// False where the bytes are no frame, or not one of that size.
bool decompress_zstd(Bytes from, std::vector<std::byte>& to) {
    return ZSTD_decompress(to.data(), to.size(), from.data(), from.size()) == to.size();
}

bool decompress_lz4(Bytes from, std::vector<std::byte>& to) {
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) throw std::bad_alloc();
    const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
        made, LZ4F_freeDecompressionContext);
    std::size_t written = 0, expected = 1; // bytes that would come next; 0: the frame is whole
    while (expected > 0 && !from.empty()) {
        std::size_t taken = from.size(), given = to.size() - written;
        expected = LZ4F_decompress(made, to.data() + written, &given, from.data(), &taken, nullptr);
        if (LZ4F_isError(expected) || (taken == 0 && given == 0)) return false;
        written += given;
        from = from.subspan(taken);
    }
    return expected == 0 && from.empty() && written == to.size();
}

#ifdef BF_BZIP2
bool decompress_bz2(Bytes from, std::vector<std::byte>& to) {
    auto size = static_cast<unsigned>(to.size());
    auto* const source = const_cast<char*>(reinterpret_cast<const char*>(from.data())); // it is only read
    return BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(to.data()), &size, source,
                                      static_cast<unsigned>(from.size()), 0, 0) == BZ_OK &&
           size == to.size();
}
#else
constexpr bool (*decompress_bz2)(Bytes, std::vector<std::byte>&) = nullptr;
#endif

/// Null: it is not known here.
auto decompressor(const std::string& method) -> bool (*)(Bytes, std::vector<std::byte>&) {
    if (method == "zstd") return decompress_zstd;
    if (method == "lz4") return decompress_lz4;
    return method == "bz2" ? decompress_bz2 : nullptr;
}

} // namespace

std::vector<std::byte> decompressed(const std::string& method, Bytes bytes, std::uint64_t size) {
    constexpr std::uint64_t most = std::uint64_t{1} << 28; // programs write chunks of some MiB
    const auto decompress = decompressor(method);
    if (decompress == nullptr)
        throw Malformed("a chunk is compressed with '" + method + "', not with 'zstd'" +
                        (decompressor("bz2") ? ", 'bz2'" : "") + " or 'lz4', and is left out");
    if (size > most)
        throw Malformed("a chunk says it has " + std::to_string(size) + " bytes, of which " +
                        std::to_string(most) + " are read at most, and is left out");
    std::vector<std::byte> whole(size);
    if (!decompress(bytes, whole))
        throw Malformed("a chunk that is compressed with '" + method + "' is damaged and is left out");
    return whole;
}

} // namespace bf::recording

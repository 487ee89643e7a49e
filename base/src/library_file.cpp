#include "bf/base/library_file.hpp"

#include "bf/base/open_file.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <link.h>

namespace bf {

std::string why_not_loadable(const std::string& file) {
    if (std::string why = why_unreadable(file); !why.empty()) return why;
    errno = 0;
    std::ifstream stream(file, std::ios::binary | std::ios::ate);
    if (!stream) return file_error(errno);
    const auto size = static_cast<std::uint64_t>(stream.tellg());
    const auto read = [&](std::uint64_t at, auto& header) {
        return at <= size && sizeof header <= size - at && stream.seekg(static_cast<std::streamoff>(at)) &&
               stream.read(reinterpret_cast<char*>(&header), sizeof header);
    };
    ElfW(Ehdr) header{};
    constexpr unsigned char own_class = sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32;
    if (!read(0, header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
        header.e_ident[EI_CLASS] != own_class || header.e_phentsize != sizeof(ElfW(Phdr)))
        return "";
    // Begin and length may be any numbers in a damaged file, so their sum may not fit.
    const auto end = [](std::uint64_t begin, std::uint64_t length) {
        return begin + std::min(length, ~begin);
    };
    std::uint64_t needed = std::max(end(header.e_phoff, std::uint64_t{header.e_phnum} * header.e_phentsize),
                                    end(header.e_shoff, std::uint64_t{header.e_shnum} * header.e_shentsize));
    ElfW(Phdr) segment{};
    for (std::uint64_t i = 0; i < header.e_phnum && read(header.e_phoff + i * sizeof segment, segment); ++i)
        needed = std::max(needed, end(segment.p_offset, segment.p_filesz));
    if (needed <= size) return "";
    return "it is cut or damaged: its headers speak of " + std::to_string(needed) + " bytes, and it has " +
           std::to_string(size) + "; copy or build it again";
}

} // namespace bf

#include "file.hpp"

#include "bf/base/open_file.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace bf::recording {
namespace {

/// A folder for what has no name: that of the recording, unless this is a pipe or a device.
std::string place_of_nameless(const std::string& path) {
    struct stat status {};
    const bool is_special = ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
    return (is_special ? (std::filesystem::temp_directory_path() / "bf").string() : path) + ".XXXXXX";
}

} // namespace

File::File(const std::filesystem::path& path, Kind kind) : path_(path.string()) {
    if (kind == Kind::named) {
        descriptor_ = open_to_grow(path_);
    } else {
        std::string name = place_of_nameless(path_);
        descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
        if (descriptor_ >= 0) ::unlink(name.c_str());
    }
    if (descriptor_ < 0) {
        const int error = errno;
        throw std::runtime_error("cannot create the recording '" + path_ + "': " + write_error(error));
    }
}

File::~File() { close(); }

void File::write(Bytes bytes, Bytes more, std::uint32_t crc_of_more) noexcept {
    for (Bytes left : {bytes, more}) {
        while (!failed() && !left.empty()) {
            const ssize_t count = ::write(descriptor_, left.data(), left.size());
            if (count >= 0)
                left = left.subspan(static_cast<std::size_t>(count));
            else if (errno != EINTR)
                fail(errno);
        }
    }
    if (failed()) {
        // The error is latched already; a torn tail that stays is one that the reader skips.
        [[maybe_unused]] const int ignored = ::ftruncate(descriptor_, static_cast<off_t>(offset_));
        return;
    }
    offset_ += bytes.size() + more.size();
    crc_ = joined_crc(crc32(bytes, crc_), crc_of_more, more.size());
}

void File::read(std::uint64_t offset, void* to, std::size_t count) noexcept {
    std::memset(to, 0, count);
    std::size_t done = 0;
    while (!failed() && done < count) {
        const ssize_t got = ::pread(descriptor_, static_cast<char*>(to) + done, count - done,
                                    static_cast<off_t>(offset + done));
        if (got > 0)
            done += static_cast<std::size_t>(got);
        else if (got == 0)
            fail(EIO);
        else if (errno != EINTR)
            fail(errno);
    }
}

void File::close() noexcept {
    if (descriptor_ >= 0 && ::close(descriptor_) != 0 && errno != EINTR) fail(errno);
    descriptor_ = -1;
}

void File::fail(int error) noexcept {
    int none = 0;
    error_.compare_exchange_strong(none, error);
}

std::string File::status() const {
    const int error = error_.load();
    if (error == 0) return {};
    return "cannot write the recording '" + path_ + "': " + write_error(error);
}

} // namespace bf::recording

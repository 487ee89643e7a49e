#pragma once

#include "format.hpp"

#include <atomic>
#include <filesystem>

namespace bf::recording {

/// The file under a Writer: appends records, keeps the CRC of what was written, and latches the first error.
class File {
  public:
    /// Nameless: a file beside `path` that ends with the program, however that ends.
    enum class Kind { named, nameless };
    explicit File(const std::filesystem::path& path, Kind kind = Kind::named); ///< throws std::runtime_error
    ~File();
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    /// Appends whole records, given in one part, or in two with the CRC of the second. After an error cuts
    /// the file back to the last whole record and ignores all that follows.
    void write(Bytes bytes, Bytes more = {}, std::uint32_t crc_of_more = 0) noexcept;
    void read(std::uint64_t offset, void* to, std::size_t count) noexcept; ///< of what was written
    void close() noexcept;

    std::uint64_t offset() const noexcept { return offset_; }
    std::uint32_t crc() const noexcept { return crc_; }
    void reset_crc() noexcept { crc_ = 0; }
    bool failed() const noexcept { return error() != 0; }
    int error() const noexcept { return error_.load(std::memory_order_relaxed); } ///< errno of it, or 0
    void fail(int error) noexcept; ///< latches an error number if it is the first
    std::string status() const;
    const std::string& path() const noexcept { return path_; }

  private:
    const std::string path_;
    int descriptor_ = -1;
    std::uint64_t offset_ = 0;
    std::uint32_t crc_ = 0;
    std::atomic<int> error_{0}; // an errno value
};

} // namespace bf::recording

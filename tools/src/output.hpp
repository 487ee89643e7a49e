// Files that a verb writes, and JSON.
#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace bf::tools {

/// Must the file be written as it is, because it exists and is no regular file? (/dev/stdout, a pipe, a link)
bool is_special(const std::filesystem::path& file);

/// A file that appears whole or not at all: written beside its place and put there by `commit`. A special one
/// is written as it is.
class OutputFile {
  public:
    /// Throws CommandError when it cannot be written, before any work is done.
    explicit OutputFile(std::filesystem::path file);
    ~OutputFile(); ///< without `commit` nothing stays behind
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Where to write until `commit`, for libraries that open files themselves.
    const std::filesystem::path& path() const { return temporary_; }
    /// Throws CommandError, e.g. on a full disk.
    void write(const std::string& text);
    void commit();

  private:
    [[noreturn]] void fail(const std::string& reason) const;
    std::filesystem::path file_, temporary_;
};

/// The whole file; throws CommandError with the reason.
std::string read_file(const std::filesystem::path& file);

/// Indented, with a line break at the end; bytes that are no UTF-8 are replaced.
std::string to_text(const nlohmann::ordered_json& json);

/// 0.0123, 1234.5: six significant digits.
std::string number(double x);

} // namespace bf::tools

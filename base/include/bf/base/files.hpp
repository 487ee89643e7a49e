// Files and folders that appear whole or not at all.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace bf {

/// "cannot write FILE: reason; remedy".
struct FileError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file written beside its place, without a name or under one that nobody can foresee, and put there by
/// `commit`. What stands in its place keeps its permissions; a link stays one, and what it points to is
/// replaced. What is no regular file (a pipe that a program reads), or is open already (/dev/stdout), is
/// written as it is.
class OutputFile {
  public:
    /// Throws FileError when it cannot be written, before any work is done.
    explicit OutputFile(std::filesystem::path file);
    ~OutputFile(); ///< without `commit` nothing stays behind
    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;

    /// Where to write until `commit`, for libraries that open files themselves; its ending is the file's.
    /// From now on it has a name, which stays behind where the program is killed. Throws FileError for a pipe
    /// or a device, where such libraries would go back and forth.
    const std::filesystem::path& path();
    /// The whole content. Throws FileError, e.g. on a full disk.
    void write(std::string_view text);
    void append(std::string_view text); ///< the same for a part that follows
    void commit();
    /// The same where the file holds `before`; none: where there is no file. False where another program was
    /// faster: what it wrote stays, or comes back where it was written while this file took its place.
    bool commit_over(const std::optional<std::string>& before);
    /// Throws the FileError of an error number, for those who write to `path`.
    [[noreturn]] void fail(int error) const;

  private:
    void make_named();
    void make_whole();
    void replace();
    std::filesystem::path file_, target_;
    std::filesystem::path temporary_; ///< empty: the temporary file has no name
    int descriptor_ = -1;             ///< of the temporary file, or of the file itself if it is special
    bool is_special_ = false;
};

/// Removes what programs that were killed have left beside the file, or others of its ending, while they
/// wrote.
void remove_abandoned(const std::filesystem::path& file);

/// A folder made beside its place, as OutputFile is, for a place that is empty or does not exist.
class OutputFolder {
  public:
    explicit OutputFolder(std::filesystem::path folder); ///< throws FileError
    ~OutputFolder();                                     ///< without `commit` nothing stays behind
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where it is until `commit`.
    const std::filesystem::path& path() const { return temporary_; }
    /// A file in the folder, with the folders above it. Throws FileError.
    void write(const std::filesystem::path& name, std::string_view text, bool is_program = false) const;
    /// Copies a file, unless there is one of that name already. Throws FileError.
    void copy(const std::filesystem::path& from, const std::filesystem::path& name) const;
    void commit();

  private:
    [[noreturn]] void fail(const std::string& reason) const;
    std::filesystem::path folder_, target_, temporary_;
};

/// Is the file in that folder or below, wherever links lead? It need not exist. False where that cannot be
/// found out.
bool is_inside(const std::filesystem::path& file, const std::filesystem::path& folder);

/// The whole text of a regular file of at most `most` bytes. Throws FileError with the reason where it cannot
/// be read.
std::string read_text_file(const std::filesystem::path& file, std::size_t most = std::size_t{1} << 30);

} // namespace bf

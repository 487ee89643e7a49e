// FMUs as archives: ZIP files, written for any importer and read as what a stranger may have made.
#pragma once

#include "bf/fmi/description.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace bf::fmi {

/// Contents by their path in the archive.
using Contents = std::map<std::string, std::string>;

/// The archive, the same bytes for the same contents. Throws FileError.
void write_archive(const Contents& contents, const std::filesystem::path& file);

/// What an archive may hold: 4 GiB in 100,000 files, and no file that grew more than 200 times, as none of an
/// FMU does.
struct ArchiveLimits {
    std::uint64_t bytes = std::uint64_t{4} << 30u;
    std::uint64_t files = 100000;
    double growth = 200;
};

/// What an archive is, in messages.
struct ArchiveKind {
    const char *name, *standard, *section;
};
inline constexpr ArchiveKind fmu_archive{"an FMU", "FMI", "FMI 3.0, section 2.5"},
    system_archive{"a system structure package", "SSP", "SSP 2.0, chapter 3"};

/// A folder of its own in the system's temporary folder, which nobody else may open, removed at its end by
/// the process that made it.
class TemporaryFolder {
  public:
    explicit TemporaryFolder(const std::string& name);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }
    /// Removes those that stand, where the process ends without their destructors.
    static void remove_all() noexcept;

  private:
    std::filesystem::path path_;
    int owner_;
};

/// Writes all files of the archive into the folder. Throws FmuError for one that is no archive, is encrypted
/// or damaged, passes the limits, or holds absolute names, "..", links or two files of one name; files before
/// that may stand there.
void extract(const std::filesystem::path& archive, const std::filesystem::path& folder,
             const ArchiveLimits& limits = {}, const ArchiveKind& kind = fmu_archive);

/// The description alone. Throws FmuError.
Description description_of(const std::filesystem::path& archive, const Structure& structure = {});

/// Where an FMU of that name is. It is a program, and where programs are taken from is for the user to say:
/// it is looked for in the folders of BLOCKFACTORY_PLUGIN_PATH, then in the folder fmus beside the program,
/// where generated ones have theirs, never beside a model. Throws FmuError.
std::filesystem::path find_fmu(const std::string& name);

} // namespace bf::fmi

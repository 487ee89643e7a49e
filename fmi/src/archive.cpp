// ZIP archives by minizip.
#include "bf/fmi/archive.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <unistd.h>
#include <unzip.h>
#include <vector>
#include <zip.h>

namespace bf::fmi {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void refuse(const fs::path& archive, const std::string& why) {
    throw FmuError(archive.string() + ": " + why);
}

/// The archive's own name of a file, checked: where it would stand below a folder.
fs::path safe_path(const fs::path& archive, const ArchiveKind& kind, const std::string& name) {
    const std::string shown = "'" + escape::terminal(escape::shortened(name, 200)) + "'";
    const std::string rule =
        std::string("; ") + kind.name + "'s files are named relative to its root (" + kind.section + ")";
    if (name.empty() || name.front() == '/' || name.find('\\') != std::string::npos ||
        name.find(':') != std::string::npos || name.find('\0') != std::string::npos)
        refuse(archive, "it holds the file " + shown + ", which is no relative name" + rule);
    fs::path path;
    for (const auto& part : fs::path(name)) {
        if (part == "..") refuse(archive, "it holds the file " + shown + ", which leaves its folder" + rule);
        if (part != "." && !part.empty()) path /= part;
    }
    return path;
}

/// Calls f with each file's name and size, until it gives false; f may read it by `read`.
using Read = std::function<void(const std::function<void(const char*, std::size_t)>&)>;
void for_each(const fs::path& archive, const ArchiveLimits& limits, const ArchiveKind& kind,
              const std::function<bool(const fs::path&, bool is_folder, const Read&)>& f) {
    const std::unique_ptr<void, int (*)(unzFile)> zip(unzOpen64(archive.c_str()), unzClose);
    std::error_code error;
    if (!zip && !fs::exists(archive, error)) refuse(archive, "there is no such file");
    if (!zip)
        refuse(archive, std::string("it is no ZIP archive, or cannot be read; ") + kind.name + " is one (" +
                            kind.section + ")");
    std::uint64_t files = 0, bytes = 0;
    std::set<fs::path> names;
    for (int result = unzGoToFirstFile(zip.get()); result != UNZ_END_OF_LIST_OF_FILE;
         result = unzGoToNextFile(zip.get())) {
        if (result != UNZ_OK) refuse(archive, "its list of files is damaged");
        unz_file_info64 info{};
        if (unzGetCurrentFileInfo64(zip.get(), &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK ||
            info.size_filename > 4096)
            refuse(archive, "its list of files is damaged");
        std::string name(info.size_filename, '\0');
        if (unzGetCurrentFileInfo64(zip.get(), &info, name.data(), name.size() + 1, nullptr, 0, nullptr, 0) !=
            UNZ_OK)
            refuse(archive, "its list of files is damaged");
        const bool is_folder = !name.empty() && name.back() == '/';
        const fs::path path = safe_path(archive, kind, name);
        const auto format = static_cast<unsigned>(info.external_fa >> 16u) & 0170000u;
        if (format != 0 && format != 0100000u && format != 0040000u)
            refuse(archive, "'" + name + "' is a link or a special file, which " + kind.name + " has not");
        if ((info.flag & 1u) != 0) refuse(archive, "'" + name + "' is encrypted");
        if (info.compression_method != 0 && info.compression_method != Z_DEFLATED)
            refuse(archive, "'" + name + "' is compressed in another way than " + kind.standard +
                                " allows (deflate, or not at all)");
        if (!is_folder && !names.insert(path).second)
            refuse(archive, "two of its files are called '" + name + "'");
        if (++files > limits.files)
            refuse(archive, "it holds more than " + std::to_string(limits.files) + " files");
        const Read read = [&](const std::function<void(const char*, std::size_t)>& take) {
            if (unzOpenCurrentFile(zip.get()) != UNZ_OK)
                refuse(archive, "'" + name + "' cannot be read: it is damaged");
            char part[65536];
            std::uint64_t length = 0;
            for (int count = 0; (count = unzReadCurrentFile(zip.get(), part, sizeof part)) != 0;) {
                if (count < 0) refuse(archive, "'" + name + "' cannot be read: it is damaged");
                // What the archive says of sizes may be a lie, so what comes is counted.
                length += static_cast<std::uint64_t>(count);
                bytes += static_cast<std::uint64_t>(count);
                if (bytes > limits.bytes ||
                    static_cast<double>(length) >
                        65536 + limits.growth * static_cast<double>(info.compressed_size))
                    refuse(archive, "'" + name + "' grows to more than " + kind.name +
                                        "'s files do; it may be made to fill the disk");
                take(part, static_cast<std::size_t>(count));
            }
            // The checksum is compared by closing it, where as many bytes came as the archive says.
            if (length != info.uncompressed_size || unzCloseCurrentFile(zip.get()) != UNZ_OK)
                refuse(archive, "'" + name + "' cannot be read: it is damaged");
        };
        if (!f(path, is_folder, read)) return;
    }
}

} // namespace

void write_archive(const Contents& contents, const fs::path& file) {
    OutputFile output(file);
    const fs::path& path = output.path();
    const zipFile zip = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
    bool good = zip != nullptr;
    for (const auto& [name, content] : contents) {
        if (!good) break;
        zip_fileinfo info{};
        info.tmz_date = {0, 0, 0, 1, 0, 1980}; // the same archive whenever it is made
        info.external_fa = 0100644u << 16u;
        // Version 2.0 of the format, made on Unix.
        good = zipOpenNewFileInZip4_64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                                       6, 0, -MAX_WBITS, DEF_MEM_LEVEL, Z_DEFAULT_STRATEGY, nullptr, 0,
                                       (3u << 8u) | 20u, 1u << 11u, content.size() > 0xfffffff0u) == ZIP_OK;
        for (std::size_t at = 0; good && at < content.size();) {
            const auto count = std::min<std::size_t>(content.size() - at, 1u << 20u);
            good = zipWriteInFileInZip(zip, content.data() + at, static_cast<unsigned>(count)) == ZIP_OK;
            at += count;
        }
        good = good && zipCloseFileInZip(zip) == ZIP_OK;
    }
    if (zip) good = zipClose(zip, nullptr) == ZIP_OK && good;
    if (!good) output.fail(errno ? errno : EIO);
    output.commit();
}

namespace {
/// Those that stand.
struct TemporaryFolders {
    std::mutex mutex;
    std::set<const TemporaryFolder*> items;
};
/// Looked at while static objects are destroyed, so it never is.
TemporaryFolders& temporary_folders() {
    static auto* const all = new TemporaryFolders;
    return *all;
}
} // namespace

TemporaryFolder::TemporaryFolder(const std::string& name) {
    std::string pattern =
        (fs::temp_directory_path() / ("bf_" + escape::file_name(name) + "_XXXXXX")).string();
    if (!::mkdtemp(pattern.data()))
        throw FmuError("cannot make a temporary folder " + pattern + ": " + std::strerror(errno));
    path_ = pattern;
    owner_ = ::getpid();
    const std::lock_guard lock(temporary_folders().mutex);
    temporary_folders().items.insert(this);
}

TemporaryFolder::~TemporaryFolder() {
    {
        const std::lock_guard lock(temporary_folders().mutex);
        temporary_folders().items.erase(this);
    }
    std::error_code ignored;
    if (::getpid() == owner_) fs::remove_all(path_, ignored);
}

void TemporaryFolder::remove_all() noexcept {
    const std::lock_guard lock(temporary_folders().mutex);
    std::error_code ignored;
    for (const auto* its : temporary_folders().items)
        if (::getpid() == its->owner_) fs::remove_all(its->path_, ignored);
}

void extract(const fs::path& archive, const fs::path& folder, const ArchiveLimits& limits,
             const ArchiveKind& kind) {
    for_each(archive, limits, kind, [&](const fs::path& path, bool is_folder, const Read& read) {
        const fs::path to = folder / path;
        std::error_code error;
        fs::create_directories(is_folder ? to : to.parent_path(), error);
        if (error) refuse(archive, "'" + path.string() + "' cannot be extracted: " + error.message());
        if (is_folder) return true;
        std::ofstream file(to, std::ios::binary | std::ios::trunc);
        read([&](const char* part, std::size_t count) {
            file.write(part, static_cast<std::streamsize>(count));
        });
        file.close();
        if (!file) refuse(archive, "'" + path.string() + "' cannot be extracted: " + std::strerror(errno));
        return true;
    });
}

Description description_of(const fs::path& archive, const Structure& structure) {
    std::string xml;
    bool is_there = false;
    for_each(archive, {}, fmu_archive, [&](const fs::path& path, bool is_folder, const Read& read) {
        if (is_folder || path != "modelDescription.xml") return true;
        read([&](const char* part, std::size_t count) {
            if (xml.size() + count > description_limit)
                refuse(archive, "its modelDescription.xml has more than 64 MiB");
            xml.append(part, count);
        });
        is_there = true;
        return false;
    });
    if (!is_there)
        refuse(archive, "it has no modelDescription.xml, which every FMU has (FMI 3.0, section 2.5)");
    return read_description(xml, archive.string(), structure);
}

fs::path find_fmu(const std::string& name) {
    std::string searched;
    const fs::path relative = fs::path(name).lexically_normal();
    const bool leaves = relative.is_absolute() || (!relative.empty() && *relative.begin() == "..");
    if (const char* path = std::getenv("BLOCKFACTORY_PLUGIN_PATH")) {
        std::istringstream folders(path);
        for (std::string folder; std::getline(folders, folder, ':');) {
            if (folder.empty()) continue;
            searched += (searched.empty() ? "" : ", ") + folder;
            std::error_code error;
            if (!leaves && fs::is_regular_file(folder / relative, error)) return folder / relative;
        }
    }
    std::error_code error;
    const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / "fmus" / relative;
    if (!leaves && fs::is_regular_file(beside, error)) return beside;
    throw FmuError(
        "there is no FMU '" + name + "' in the folders that plugins are taken from (" +
        (searched.empty() ? "none is given" : searched) +
        "); an FMU is a program, so that its folder is given to the command: --plugin-path FOLDER");
}

} // namespace bf::fmi

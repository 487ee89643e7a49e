#include "bf/codegen/generate.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <unistd.h>

namespace bf::codegen {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void refuse(const fs::path& folder, const std::string& reason) {
    throw GenerationError("cannot generate into " + folder.string() + ": " + reason);
}

void write_file(const fs::path& file, const std::string& text) {
    fs::create_directories(file.parent_path());
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error(file.string() + ": " + std::strerror(errno));
}

} // namespace

void write(const Files& files, const fs::path& folder) {
    std::error_code error;
    const auto status = fs::status(folder, error);
    const bool exists = fs::exists(status);
    if (exists && !fs::is_directory(status)) refuse(folder, "it is a file; name a folder");
    if (exists && !fs::is_empty(folder, error))
        refuse(folder, error ? error.message() : "the folder is not empty; empty it or name another one");
    // All files are written beside the folder first, so that a full disk leaves nothing half-written.
    const fs::path target = fs::absolute(folder).lexically_normal();
    const fs::path named = target.has_filename() ? target : target.parent_path();
    fs::path part = named;
    part += ".part" + std::to_string(getpid());
    try {
        fs::create_directories(part);
        for (const auto& [name, text] : files) write_file(part / name, text);
        if (exists) fs::remove(named);
        fs::rename(part, named);
    } catch (const std::exception& failure) {
        fs::remove_all(part, error);
        refuse(folder, failure.what());
    }
}

} // namespace bf::codegen

#include "output.hpp"

#include "session.hpp"

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

namespace bf::tools {

namespace fs = std::filesystem;

bool is_special(const fs::path& file) {
    std::error_code ignored;
    const auto status = fs::symlink_status(file, ignored);
    return fs::exists(status) && !fs::is_regular_file(status);
}

OutputFile::OutputFile(fs::path file) : file_(std::move(file)), temporary_(file_) {
    std::error_code ignored;
    if (fs::is_directory(file_, ignored)) fail(std::strerror(EISDIR));
    if (is_special(file_)) return;
    // The ending stays: libraries tell the format by it.
    temporary_.replace_filename("." + file_.stem().string() + ".part" + file_.extension().string());
    errno = 0;
    if (!std::ofstream(temporary_, std::ios::binary)) fail(std::strerror(errno));
}

OutputFile::~OutputFile() {
    std::error_code ignored;
    if (temporary_ != file_) fs::remove(temporary_, ignored);
}

void OutputFile::write(const std::string& text) {
    errno = 0;
    std::ofstream stream(temporary_, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) fail(std::strerror(errno));
}

void OutputFile::commit() {
    std::error_code error;
    if (temporary_ != file_) fs::rename(temporary_, file_, error);
    if (error) fail(error.message());
    temporary_ = file_;
}

void OutputFile::fail(const std::string& reason) const {
    throw CommandError("cannot write " + file_.string() + ": " + reason +
                       "; give a file in a folder that may be written");
}

std::string read_file(const fs::path& file) {
    std::error_code ignored;
    if (fs::is_directory(file, ignored))
        throw CommandError("cannot read " + file.string() + ": it is a folder");
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw CommandError("cannot read " + file.string() + ": " + std::strerror(errno));
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

std::string to_text(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", x + 0.0); // no -0
    return text;
}

} // namespace bf::tools

#include "bf/view/image.hpp"

#include "bf/base/base64.hpp"
#include "bf/base/files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>

namespace bf::editor {

namespace fs = std::filesystem;

std::string image_type(const fs::path& file) {
    std::string ending = file.extension().string();
    std::ranges::transform(ending, ending.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending == ".png" ? "image/png" : ending == ".svg" ? "image/svg+xml" : "";
}

std::string image_defect(const fs::path& file, const fs::path& folder) {
    std::error_code error;
    const std::string name = "the image '" + file.filename().string() + "' ", type = image_type(file);
    if (type.empty()) return name + "is neither a PNG nor an SVG file";
    if (!is_inside(file, folder)) return name + "lies outside of the folder of the model";
    if (!fs::is_regular_file(file, error)) return name + "is not there";
    if (const auto size = fs::file_size(file, error); error || size > largest_image)
        return name + "is larger than 4 MiB";
    std::array<char, 4096> begin{};
    std::ifstream stream(file, std::ios::binary);
    stream.read(begin.data(), begin.size());
    const std::string_view bytes(begin.data(), static_cast<std::size_t>(stream.gcount()));
    const bool is_right =
        type == "image/png" ? bytes.starts_with("\x89PNG\r\n\x1a\n") : bytes.find("<svg") != bytes.npos;
    return is_right ? "" : name + "holds no " + (type == "image/png" ? "PNG" : "SVG");
}

std::string data_address(const fs::path& file) {
    try {
        return "data:" + image_type(file) + ";base64," + base64(read_text_file(file, largest_image));
    } catch (const std::exception&) { // it is gone since it was looked at
        return {};
    }
}

} // namespace bf::editor

// Images of a drawing. They come with a model, so nothing in them is trusted: they are files of the model's
// folder, of bounded size, PNG or SVG, and are shown where browsers run no scripts and load nothing: as the
// source of an <img>.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace bf::editor {

inline constexpr std::size_t largest_image = 4 << 20; ///< bytes

/// "image/png" or "image/svg+xml" by the name of the file; empty: it is none of them.
std::string image_type(const std::filesystem::path& file);

/// Why the file may not be shown: it lies outside of the folder, also by way of links, is too large, or is
/// not what its name says; empty: it may.
std::string image_defect(const std::filesystem::path& file, const std::filesystem::path& folder);

/// As an address of its own: "data:image/png;base64,..."; empty where the file cannot be read.
std::string data_address(const std::filesystem::path& file);

} // namespace bf::editor

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bf::service {

/// As the protocol names a file: relative to the folder, or whole where it is elsewhere on another root.
std::string relative_to(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Names of the files of an ending in the folder and some levels below, in order, a thousand at most; those
/// of hidden folders and of builds are left out, and links that lead elsewhere.
std::vector<std::string> files_in(const std::filesystem::path& folder, const char* ending);

} // namespace bf::service

#include "bf/base/packages.hpp"

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace bf {

namespace fs = std::filesystem;

std::vector<fs::path> package_folders(std::vector<fs::path> first) {
    for (const char* variable :
         {"ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH", "YARP_DATA_DIRS"}) {
        const char* value = std::getenv(variable);
        std::istringstream list(value ? value : "");
        for (std::string entry; std::getline(list, entry, ':');) {
            if (!entry.empty()) first.emplace_back(entry);
        }
    }
    return first;
}

bool is_package_address(const std::string& address) {
    return address.starts_with("package://") || address.starts_with("model://");
}

std::vector<fs::path> package_candidates(const std::string& address) {
    const std::string path = address.substr(address.find("://") + 3);
    const fs::path file = path.substr(std::min(path.find('/'), path.size() - 1) + 1);
    return {path, fs::path("share") / path, file};
}

std::vector<fs::path> mesh_candidates(const std::string& address, const fs::path& description,
                                      const std::vector<fs::path>& package_paths,
                                      const std::string& meshdir) {
    const fs::path own = description.parent_path();
    if (address.starts_with(file_scheme)) return {address.substr(std::string_view(file_scheme).size())};
    if (!is_package_address(address)) return {own / address, own / meshdir / address};
    std::vector<fs::path> folders = package_folders(package_paths), candidates;
    for (fs::path folder = own; folder != folder.root_path(); folder = folder.parent_path())
        folders.push_back(folder);
    for (const fs::path& folder : folders)
        for (const fs::path& inside : package_candidates(address)) candidates.push_back(folder / inside);
    return candidates;
}

} // namespace bf

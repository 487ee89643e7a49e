#include "bf/dynamics/find_urdf.hpp"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace bf::dynamics {
namespace {

namespace fs = std::filesystem;

/// `directories`, then those of the environment.
std::vector<fs::path> roots(std::vector<fs::path> directories) {
    for (const char* variable :
         {"ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "GAZEBO_MODEL_PATH", "YARP_DATA_DIRS"}) {
        const char* value = std::getenv(variable);
        std::istringstream list(value ? value : "");
        for (std::string entry; std::getline(list, entry, ':');) {
            if (!entry.empty()) directories.emplace_back(entry);
        }
    }
    return directories;
}

/// Files relative to a folder that the name may stand for.
std::vector<fs::path> candidates(const std::string& name) {
    const std::size_t scheme = name.find("://");
    if (scheme != std::string::npos) {
        const std::string path = name.substr(scheme + 3);
        const fs::path file = path.substr(std::min(path.find('/'), path.size() - 1) + 1);
        return {path, fs::path("share") / path, file};
    }
    return {name, fs::path(name) / "model.urdf", name + ".urdf", fs::path(name) / (name + ".urdf")};
}

/// The folder itself and those below it in which packages keep robots.
std::vector<fs::path> with_robot_folders(const fs::path& root) {
    std::vector<fs::path> folders{root, root / "robots", root / "share"};
    for (const fs::path& parent : {root, root / "share"}) {
        std::error_code ignored; // a folder that cannot be listed holds nothing for us
        std::vector<fs::path> found;
        for (const auto& entry : fs::directory_iterator(parent, ignored)) {
            if (fs::is_directory(entry.path() / "robots", ignored)) found.push_back(entry.path() / "robots");
        }
        std::sort(found.begin(), found.end());
        folders.insert(folders.end(), found.begin(), found.end());
    }
    return folders;
}

} // namespace

fs::path find_urdf(const std::string& name, const std::vector<fs::path>& directories) {
    std::error_code ignored;
    if (fs::path(name).is_absolute()) {
        if (fs::is_regular_file(name, ignored)) return name;
        throw std::runtime_error("robot description '" + name + "' does not exist; check the path");
    }
    const std::vector<fs::path> searched = roots(directories);
    for (const fs::path& root : searched) {
        for (const fs::path& folder : with_robot_folders(root)) {
            for (const fs::path& candidate : candidates(name)) {
                if (fs::is_regular_file(folder / candidate, ignored)) return folder / candidate;
            }
        }
    }
    std::string text = "robot description '" + name + "' was not found; searched in:";
    for (const fs::path& root : searched) text += "\n  " + root.string();
    if (searched.empty()) text += " no folder at all";
    throw std::runtime_error(text +
                             "\nGive an absolute path, or add the folder of the robot to ROS_PACKAGE_PATH, "
                             "AMENT_PREFIX_PATH, GAZEBO_MODEL_PATH or YARP_DATA_DIRS");
}

} // namespace bf::dynamics

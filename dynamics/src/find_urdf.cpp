#include "bf/dynamics/find_urdf.hpp"

#include "bf/base/open_file.hpp"
#include "bf/base/packages.hpp"

#include <algorithm>
#include <stdexcept>

namespace bf::dynamics {
namespace {

namespace fs = std::filesystem;

/// Files relative to a folder that the name may stand for.
std::vector<fs::path> candidates(const std::string& name) {
    if (is_package_address(name)) return package_candidates(name);
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
        const std::string wrong = why_unreadable(name);
        if (wrong.empty()) return name;
        throw std::runtime_error("robot description '" + name + "' cannot be read: " + wrong +
                                 "; check the path");
    }
    const std::vector<fs::path> searched = package_folders(directories);
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
    throw std::runtime_error(text + "\nGive an absolute path, or add the folder of the robot to " +
                             package_variables);
}

} // namespace bf::dynamics

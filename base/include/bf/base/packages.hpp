// Where robots and their meshes are installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bf {

/// The environment variables that list folders with packages of robots.
inline constexpr const char* package_variables =
    "ROS_PACKAGE_PATH, AMENT_PREFIX_PATH, GAZEBO_MODEL_PATH or YARP_DATA_DIRS";

/// `first`, then the folders that the environment lists.
std::vector<std::filesystem::path> package_folders(std::vector<std::filesystem::path> first = {});

/// Is this an address like `package://PACKAGE/FILE` or `model://PACKAGE/FILE`?
bool is_package_address(const std::string& address);

/// Files relative to a package folder that such an address may stand for: `PACKAGE/FILE`,
/// `share/PACKAGE/FILE`, and `FILE` where the folder is that of the package itself.
std::vector<std::filesystem::path> package_candidates(const std::string& address);

} // namespace bf

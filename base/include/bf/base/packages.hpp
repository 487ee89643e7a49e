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

/// Begins an absolute address of a file, which means nothing on another computer.
inline constexpr const char* file_scheme = "file://";

/// Files that the address of a mesh in a description of a robot may stand for, the first one that exists:
/// package://PACKAGE/FILE or model://PACKAGE/FILE in `package_paths`, the folders that the environment lists
/// and those above the description; file://FILE; otherwise relative to the description or to its folder
/// `meshdir`.
std::vector<std::filesystem::path> mesh_candidates(const std::string& address,
                                                   const std::filesystem::path& description,
                                                   const std::vector<std::filesystem::path>& package_paths,
                                                   const std::string& meshdir = {});

} // namespace bf

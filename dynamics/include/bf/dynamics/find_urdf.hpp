#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bf::dynamics {

/// The URDF file that `name` stands for:
/// - an absolute path, or a path relative to one of `directories`;
/// - `package://P/FILE` or `model://P/FILE`: `P/FILE`, `share/P/FILE` or `FILE` inside the package's own
/// folder;
/// - a bare robot name such as `iCubGazeboV2_5`: `NAME/model.urdf`, `NAME.urdf` or `NAME/NAME.urdf`, also
/// under
///   `robots/`, `*/robots/` and `share/`.
///
/// `directories` come first, then those of the environment variables ROS_PACKAGE_PATH, AMENT_PREFIX_PATH,
/// GAZEBO_MODEL_PATH and YARP_DATA_DIRS, with the `share` and `robots` folders below each.
/// Throws std::runtime_error that lists where it looked.
std::filesystem::path find_urdf(const std::string& name,
                                const std::vector<std::filesystem::path>& directories = {});

} // namespace bf::dynamics

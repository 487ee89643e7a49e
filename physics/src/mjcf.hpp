#pragma once

#include "bf/physics/scene_options.hpp"
#include "spec.hpp"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
}

namespace bf::physics {

/// Does the file begin with <mujoco>? False for one that cannot be read.
bool is_mjcf(const std::filesystem::path& file);

/// Says where a file is no XML, after `document` could not be parsed.
[[noreturn]] void refuse_xml(const std::filesystem::path& file, const tinyxml2::XMLDocument& document);

/// A robot that an MJCF describes.
struct Mjcf {
    SpecPtr spec;      ///< with motors and marks, as make_robot has them
    mjsBody* body;     ///< what of it is attached
    double mass = 0.0; ///< kg
    std::map<std::string, std::vector<double>>
        start; ///< joint positions of the key frame, of a ball a quaternion
    /// P and D of the position actuators that gave way, by joint.
    std::map<std::string, std::pair<double, double>> gains;
};

/// Reads an MJCF and fills in what the robot's options leave to it. Joints that are not controlled move as
/// the file says; the file's actuators of controlled joints give way to motors, which keep their limits.
/// Throws std::runtime_error.
Mjcf read_mjcf(SceneRobot& robot);

} // namespace bf::physics

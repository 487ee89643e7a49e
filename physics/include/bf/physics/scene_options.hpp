// What a Scene is made of: several robots and objects in one environment.
#pragma once

#include "bf/physics/world_options.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace bf::physics {

/// A robot of a Scene. All its shapes touch whatever comes near; `options.feet` has none.
///
/// `options.urdf` is a URDF, or an MJCF, which is taken as it is: then `floating_base` and `package_paths`
/// say nothing, `surface` must be none, `initial_w_H_b` is where the origin of the file comes to lie, joints
/// that are not controlled move as the file says, and links are its bodies.
struct SceneRobot {
    std::string name;
    /// Joints that are empty: all movable ones of a URDF that mimic no other; those of an MJCF that actuators
    /// drive, or, where it has no actuators, all that no equality makes follow others.
    RobotOptions options{};
    /// Where position_gains are empty, P and D are those of an MJCF's position actuators, if it has them. Of
    /// the joints of these the damping of all loops is implicit, as theirs is in MuJoCo, where the loops have
    /// the period of the time step and the integrator is implicit_fast.
    MotorOptions motors{};
    double loop_period = 0.0; ///< s, of the loops, a multiple of the time step; 0: that
    std::string body{};       ///< the part of the MJCF that is the robot; empty: all there is
    bool is_held =
        false; ///< an MJCF's free joint above the base link is left out, so that it stands where it begins
    std::string key{};   ///< key frame of the MJCF that the joints start with; empty: its reference positions
    std::string where{}; ///< file and line, which messages begin with; may be empty
};

/// Everything that defines a Scene. SI units.
struct SceneOptions : PhysicsOptions {
    std::vector<SceneRobot> robots;
    std::vector<SceneObject> objects;

    /// Reads an XML file of the form that docs/how-to/several_robots.md describes; names of files in it begin
    /// at its folder. `package_paths` are those of all robots. Throws std::runtime_error naming file, line,
    /// element, attribute and remedy.
    static SceneOptions read(const std::filesystem::path& file,
                             const std::vector<std::filesystem::path>& package_paths = {});
};

} // namespace bf::physics

// How the joints of a robot are laid out over control boards, and how sensors are called, as programs of
// YARP's robots expect it.
#pragma once

#include <string>
#include <vector>

namespace bf::yarp {

/// A control board: /robot/name with these joints, in its order.
struct Part {
    std::string name;
    std::vector<std::string> joints;
};

/// Boards of these joints as an iCub has them: torso, head, left_arm, right_arm, left_leg, right_leg, by what
/// the joints are called; those that are called otherwise are on the board `body`. In the order of the
/// joints.
std::vector<Part> parts_of(const std::vector<std::string>& joints);

/// As `name=joint,joint,...` describe them. Throws std::runtime_error: a joint that is not there, twice or on
/// no board, or a text that says nothing of the kind.
std::vector<Part> read_parts(const std::vector<std::string>& texts, const std::vector<std::string>& joints);

/// The name of the port that streams a force/torque sensor, without the robot: l_foot_ft_sensor ->
/// left_foot/analog:o.
std::string stream_of(const std::string& sensor);

} // namespace bf::yarp

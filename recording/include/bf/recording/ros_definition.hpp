// The message definitions of ROS 1 (http://wiki.ros.org/msg) and ROS 2
// (https://design.ros2.org/articles/legacy_interface_definition.html).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bf::recording {

enum class Ros { one, two };

enum class RosPrimitive {
    boolean,
    uint8,
    int8,
    uint16,
    int16,
    uint32,
    int32,
    uint64,
    int64,
    float32,
    float64,
    text
};

/// Bytes of one; of a text the least.
std::size_t bytes_of(RosPrimitive primitive) noexcept;

struct RosField {
    std::string name;
    std::optional<RosPrimitive> primitive = {};
    int type = -1; ///< of a message, its number
    enum class Kind { one, fixed, sequence } kind = Kind::one;
    std::size_t count = 1;    ///< of a fixed array
    std::string written = {}; ///< the type as it is written, "float64[9]"
};

struct RosType {
    std::string name; ///< "geometry_msgs/Twist"; of ROS 1's own two "time" and "duration"
    std::vector<RosField> fields = {};
    std::vector<std::string> constants = {}; ///< each as "int8 MODE=3"
};

constexpr std::size_t most_elements = 1 << 20; ///< of an array

/// The types that a definition tells, the message's own first. Those of others follow in it, each behind a
/// line of '=' and one with its name, "MSG: geometry_msgs/Vector3". Throws std::runtime_error: what it does
/// not tell, or types that hold themselves.
std::vector<RosType> read_ros_definition(std::string_view name, std::string_view text, Ros ros);

} // namespace bf::recording

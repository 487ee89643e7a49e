// Bags of ROS 1, format 2.0 (http://wiki.ros.org/Bags/Format/2.0).
#pragma once

#include "bf/recording/reader.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>

namespace bf::recording {

inline constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";

/// Somebody who wrote to a topic.
struct BagConnection {
    std::string topic;
    std::string type;       ///< "sensor_msgs/Imu"
    std::string md5;        ///< of the type's definition
    std::string definition; ///< of the type and those in it
};

/// What is found in a bag.
struct BagVisit {
    /// A connection, before its first message, once for each number.
    std::function<void(std::uint32_t number, const BagConnection& connection)> connection;
    /// A message, when it was recorded, in ns since 1970, and its bytes, for the length of the call.
    std::function<void(std::uint32_t connection, std::int64_t time_ns, std::span<const std::byte> bytes)>
        message;
    /// What is wrong with a part, which is left out.
    std::function<void(std::string defect)> defect;
};

/// Visits all of a bag in the order of the file, that was closed or was cut; the index is not needed. Chunks
/// may be compressed with lz4, and with bz2 where BlockFactory was built with it. Nothing is believed: a
/// length that cannot be is a defect. Throws std::runtime_error where it is no bag, or one of another
/// version, or it is given up.
void read_bag(std::istream& stream, std::string_view name, const BagVisit& visit,
              const LoadOptions& options = {});

} // namespace bf::recording

// How a signal looks to ROS 2 tools: in recordings, and live.
#pragma once

#include "bf/recording/channel.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace bf::recording {

/// "controller.tau" has the topic "/controller/tau".
std::string topic_of(std::string_view name);

/// And back: "/controller/tau" is of "controller.tau".
std::string signal_of(std::string_view topic);

/// "bf_msgs/msg/Double", "bf_msgs/msg/Double23", "bf_msgs/msg/Double3x4": a type per element type and shape.
std::string message_type(const ChannelInfo& info);

/// Element type and shape of a message type; none if it is not one of these.
std::optional<ChannelInfo> channel_of(std::string_view message_type);

/// The type in the language of ROS 2: `float64 time`, then `value`, matrices column-major.
std::string message_definition(const ChannelInfo& info);

/// Bytes in front of the value's own in CDR: the encapsulation, little-endian, and the time in s.
inline constexpr std::size_t message_prefix_bytes = 4 + 8;
void write_message_prefix(std::byte* to, double time) noexcept;

} // namespace bf::recording

#pragma once

#include "bf/recording/ros_definition.hpp"
#include "format.hpp"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace bf::recording {

constexpr int deepest = 20;            ///< of messages in messages
constexpr std::size_t most_parts = 64; ///< of an array of messages

/// A number of a message by its path, "twist.linear.x", or several: those of an array.
using Visit = std::function<void(const std::string& path, std::span<const double> values)>;

/// Reads the numbers and truth values out of messages that others have written; texts are left out.
class Decoder {
  public:
    virtual ~Decoder() = default;
    /// Throws Malformed where the message is not as its schema says.
    virtual void decode(Bytes message, const Visit& visit) const = 0;
};

/// JSON objects; messages of ROS 2 (CDR, `ros2msg`), of ROS 1 (`ros1msg`) and of Protocol Buffers as the
/// schema says. Throws Malformed, which says what is not understood, for other encodings and for schemas that
/// hold what is not known.
std::unique_ptr<Decoder> make_decoder(std::string_view message_encoding, std::string_view schema_encoding,
                                      std::string_view schema_name, std::string_view schema);

/// That of Protocol Buffers, of which the schema is a FileDescriptorSet.
std::unique_ptr<Decoder> make_protobuf_decoder(std::string_view schema_name, std::string_view schema);

} // namespace bf::recording

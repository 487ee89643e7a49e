#pragma once

#include "format.hpp"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace bf::recording {

/// A number of a message by its path, "twist.linear.x", or several: those of an array.
using Visit = std::function<void(const std::string& path, std::span<const double> values)>;

/// Reads the numbers and truth values out of messages that others have written; texts are left out.
class Decoder {
  public:
    virtual ~Decoder() = default;
    /// Throws Malformed where the message is not as its schema says.
    virtual void decode(Bytes message, const Visit& visit) const = 0;
};

/// JSON objects, and CDR of ROS 2 (`ros2msg`) as the schema says. Throws Malformed, which says what is not
/// understood, for other encodings and for schemas that hold what is not known.
std::unique_ptr<Decoder> make_decoder(std::string_view message_encoding, std::string_view schema_encoding,
                                      std::string_view schema_name, std::string_view schema);

} // namespace bf::recording

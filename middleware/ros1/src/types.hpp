// Any type of message that this machine has, from its .msg files.
#pragma once

#include "bf/middleware/fields.hpp"
#include "bf/recording/ros_definition.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bf::ros1 {

using middleware::Field;
using Bytes = std::span<const std::uint8_t>;

/// A message: of each field the bytes that stand for it between programs, which follow each other there
/// without gaps, little-endian. Those that came are not copied.
struct Message {
    struct Value {
        Bytes bytes;                        ///< without the number of elements or letters in front
        std::size_t count = 1;              ///< of elements
        std::vector<std::uint8_t> own = {}; ///< of those that are written
    };
    std::vector<Value> values;
    std::vector<Bytes> lists = {}; ///< of messages, each with their number in front; of those that came
    Bytes bytes;                   ///< all of one that came
};

/// A type of message, as its definition tells.
class MessageType final : public middleware::MessageType {
  public:
    /// `name` as in sensor_msgs/Imu; sensor_msgs/msg/Imu is the same. Its .msg file is looked for in the
    /// folders of ROS_PACKAGE_PATH and CMAKE_PREFIX_PATH and in /usr/share. Throws std::runtime_error.
    static std::shared_ptr<const MessageType> find(const std::string& name);
    /// By a definition that tells the types in it, too. Throws std::runtime_error.
    MessageType(const std::string& name, std::string definition);

    const std::string& definition() const { return definition_; }
    /// By which programs compare types: of the definition without comments.
    const std::string& md5() const { return md5_; }
    /// Of which that is made.
    std::string normal_form() const { return normal_form(types_[0]); }
    std::shared_ptr<void> make() const override;

    /// What a message has in a field of this type.
    const Message::Value& value(const Message& message, const std::string& path) const;
    /// Takes a message apart, whose bytes are to stay. Throws std::runtime_error: it is not of this type.
    void decode(Bytes bytes, Message& message) const;
    /// Calls `take` with each message of a list in a message of this type, such as the points of a
    /// trajectory; they are of the type `its`. Throws std::runtime_error: they are not.
    void each(const Message& message, const std::string& path, const MessageType& its,
              const std::function<void(const Message&)>& take) const;
    /// Puts it together, behind what `bytes` has. Throws std::bad_alloc.
    void encode(const Message& message, std::vector<std::uint8_t>& bytes) const;

  private:
    /// What stands behind each other in the bytes.
    struct Part {
        const recording::RosField* its;
        int field;         ///< by its number; -1: nobody looks at it
        std::size_t bytes; ///< of an element of a field
    };
    void look_into(const recording::RosType& type, const std::string& prefix);
    std::string normal_form(const recording::RosType& type) const;
    /// Of a message that `bytes` begin with; gives what is behind it.
    Bytes decode_first(Bytes bytes, Message& message) const;

    std::string definition_, md5_;
    std::vector<recording::RosType> types_;
    std::vector<Part> parts_;
    std::vector<std::string> lists_; ///< paths of lists of messages
};

/// A type of service.
struct ServiceType {
    /// `name` as in std_srvs/SetBool; std_srvs/srv/SetBool is the same. Its .srv file is looked for as those
    /// of messages. Throws std::runtime_error.
    static ServiceType find(const std::string& name);

    std::string name = "", md5 = "";
    std::shared_ptr<const MessageType> request = nullptr, response = nullptr;
};

/// Those of a field of any number of texts.
std::vector<std::string> texts_of(const Message::Value& value);

} // namespace bf::ros1

// Any type of message that this machine has, looked into at run time.
#pragma once

#include "node.hpp"

#include <cstdint>
#include <memory>
#include <rosidl_typesupport_introspection_c/message_introspection.h>
#include <string>
#include <vector>

namespace bf::ros2 {

/// What a port or an argument gives to a message, or takes from it.
struct Field {
    enum class Kind {
        numbers,  ///< one, or as many as the type says
        sequence, ///< any number of numbers, or up to `size`
        time,     ///< of builtin_interfaces, as s
        text,
        texts, ///< any number of them
    };
    using Member = rosidl_typesupport_introspection_c__MessageMember;

    std::string path; ///< such as header.stamp
    Kind kind;
    std::uint8_t type;              ///< of numbers
    int size;                       ///< of numbers; of a sequence the largest, 0: none is said
    std::vector<std::size_t> parts; ///< where they are in a message; one: all follow each other
    const Member* member;           ///< of sequences and texts
    bool is_scalar = false;

    /// The path as a name of a port.
    std::string port() const;
    /// How many numbers the message has.
    std::size_t length(const void* message) const;
    /// Those that are there, up to `count`.
    void read(const void* message, double* values, std::size_t count) const;
    /// Numbers that the type cannot hold become the next one that it can. Throws std::bad_alloc.
    void write(void* message, const double* values, std::size_t count) const;
    std::string text(const void* message) const;
    void write(void* message, const std::vector<std::string>& texts) const;
};

/// A type of message, from its libraries.
class MessageType {
  public:
    /// `name` as in sensor_msgs/msg/Imu or sensor_msgs/Imu. Throws std::runtime_error.
    static std::shared_ptr<const MessageType> find(const std::string& name);

    const std::string& name() const { return name_; }
    /// All but lists of messages: numbers and times alone are a vector where they are the numbers of one
    /// point, quaternion or the like.
    const std::vector<Field>& fields() const { return fields_; }
    /// Null: there is none of that path.
    const Field* field(const std::string& path) const;
    const MessageMemory& memory() const { return memory_; }

  private:
    using Members = rosidl_typesupport_introspection_c__MessageMembers;
    void look_into(const Members& members, const std::string& prefix, std::size_t offset);

    std::string name_;
    MessageMemory memory_;
    std::vector<Field> fields_;
};

/// A type of service, from its libraries.
struct ServiceType {
    /// `name` as in std_srvs/srv/SetBool. Throws std::runtime_error.
    static ServiceType find(const std::string& name);

    std::shared_ptr<const MessageType> request = nullptr, response = nullptr;
    const rosidl_service_type_support_t* support = nullptr;
};

/// A type of action, from its libraries: services and topics that its clients and servers have, each with the
/// id of a goal, and what is of the type under goal, feedback and result.
struct ActionType {
    /// `name` as in control_msgs/action/FollowJointTrajectory. Throws std::runtime_error.
    static ActionType find(const std::string& name);

    ServiceType goal{}, result{}, cancel{};
    std::shared_ptr<const MessageType> feedback = nullptr, status = nullptr;
};

} // namespace bf::ros2

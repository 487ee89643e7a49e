// Any type of message that this machine has, looked into at run time.
#pragma once

#include "bf/middleware/fields.hpp"
#include "node.hpp"

#include <memory>
#include <rosidl_typesupport_introspection_c/message_introspection.h>
#include <string>

namespace bf::ros2 {

using middleware::Field, middleware::FieldInputs, middleware::FieldOutputs, middleware::Place;

/// A type of message, from its libraries.
class MessageType final : public middleware::MessageType {
  public:
    /// `name` as in sensor_msgs/msg/Imu or sensor_msgs/Imu. Throws std::runtime_error.
    static std::shared_ptr<const MessageType> find(const std::string& name);

    const MessageMemory& memory() const { return memory_; }
    std::shared_ptr<void> make() const override { return memory_.make(); }

  private:
    using Members = rosidl_typesupport_introspection_c__MessageMembers;
    void look_into(const Members& members, const std::string& prefix, std::size_t offset);

    MessageMemory memory_;
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

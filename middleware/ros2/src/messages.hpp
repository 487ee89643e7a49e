// The messages that robots and clocks of ROS 2 speak, with their C types.
#pragma once

#include "node.hpp"

#include <geometry_msgs/msg/wrench_stamped.h>
#include <new>
#include <rosgraph_msgs/msg/clock.h>
#include <sensor_msgs/msg/imu.h>
#include <sensor_msgs/msg/joint_state.h>
#include <span>
#include <std_msgs/msg/float64_multi_array.h>
#include <std_srvs/srv/set_bool.h>
#include <std_srvs/srv/trigger.h>
#include <string>
#include <trajectory_msgs/msg/joint_trajectory.h>
#include <trajectory_msgs/msg/joint_trajectory_point.h>

namespace bf::ros2::messages {

using Clock = rosgraph_msgs__msg__Clock;
using Imu = sensor_msgs__msg__Imu;
using JointState = sensor_msgs__msg__JointState;
using Numbers = std_msgs__msg__Float64MultiArray;
using Time = builtin_interfaces__msg__Time;
using Trajectory = trajectory_msgs__msg__JointTrajectory;
using Wrench = geometry_msgs__msg__WrenchStamped;

const MessageMemory& camera_info();
const MessageMemory& clock();
const MessageMemory& image();
const MessageMemory& imu();
const MessageMemory& joint_state();
const MessageMemory& numbers();
const MessageMemory& point_cloud();
const MessageMemory& trajectory();
const MessageMemory& wrench();

/// Of a C type, by its own functions. Throws std::bad_alloc.
template <class T> std::shared_ptr<void> memory(T* (*create)(), void (*destroy)(T*)) {
    T* made = create();
    if (made == nullptr) throw std::bad_alloc();
    return {made, [destroy](void* message) { destroy(static_cast<T*>(message)); }};
}

/// Throws std::bad_alloc.
template <class T> std::shared_ptr<T> make(const MessageMemory& type) {
    return std::static_pointer_cast<T>(type.make());
}

/// Sequences keep their memory where the size stays. They throw std::bad_alloc.
void resize(rosidl_runtime_c__double__Sequence& sequence, std::size_t size);
void assign(rosidl_runtime_c__double__Sequence& sequence, std::span<const double> values);
void assign(rosidl_runtime_c__String& text, const std::string& value);
std::string text(const rosidl_runtime_c__String& from);
void assign(rosidl_runtime_c__String__Sequence& texts, const std::vector<std::string>& values);

Time time_of(double seconds);
inline double seconds(const Time& time) { return time.sec + time.nanosec / 1e9; }

/// Services without arguments, and with one that is true or false.
std::shared_ptr<Service> serve(Node& node, const std::string& name,
                               std::function<std::string(bool& is_done)> answer);
std::shared_ptr<Service> serve(Node& node, const std::string& name,
                               std::function<std::string(bool asked, bool& is_done)> answer);

/// A call of such a service. What others answer is told in the waiting thread: whether it is done, or why
/// not.
struct Call {
    using Answered = std::function<void(bool is_done, const std::string& why)>;
    std::shared_ptr<Client> client;
    std::shared_ptr<void> request;

    bool has_server() const noexcept { return client->has_server(); }
    bool send() noexcept { return client->call(request.get()) != 0; }
};
Call trigger(Node& node, const std::string& name, Call::Answered answered);
Call set_bool(Node& node, const std::string& name, bool value, Call::Answered answered);

} // namespace bf::ros2::messages

#include "messages.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <rosidl_runtime_c/primitives_sequence_functions.h>
#include <rosidl_runtime_c/string_functions.h>
#include <sensor_msgs/msg/camera_info.h>
#include <sensor_msgs/msg/image.h>
#include <sensor_msgs/msg/point_cloud2.h>

namespace bf::ros2::messages {

namespace {

template <class T>
MessageMemory type(const rosidl_message_type_support_t* support, T* (*create)(), void (*destroy)(T*)) {
    return {support, [create, destroy] { return memory(create, destroy); }};
}

} // namespace

#define BF_MESSAGE(function, package, name)                                                                  \
    const MessageMemory& function() {                                                                        \
        static const auto its = type(ROSIDL_GET_MSG_TYPE_SUPPORT(package, msg, name),                        \
                                     package##__msg__##name##__create, package##__msg__##name##__destroy);   \
        return its;                                                                                          \
    }
BF_MESSAGE(camera_info, sensor_msgs, CameraInfo)
BF_MESSAGE(clock, rosgraph_msgs, Clock)
BF_MESSAGE(image, sensor_msgs, Image)
BF_MESSAGE(imu, sensor_msgs, Imu)
BF_MESSAGE(joint_state, sensor_msgs, JointState)
BF_MESSAGE(numbers, std_msgs, Float64MultiArray)
BF_MESSAGE(point_cloud, sensor_msgs, PointCloud2)
BF_MESSAGE(trajectory, trajectory_msgs, JointTrajectory)
BF_MESSAGE(wrench, geometry_msgs, WrenchStamped)
#undef BF_MESSAGE

void resize(rosidl_runtime_c__double__Sequence& sequence, std::size_t size) {
    if (sequence.size == size) return;
    rosidl_runtime_c__double__Sequence__fini(&sequence);
    if (!rosidl_runtime_c__double__Sequence__init(&sequence, size)) throw std::bad_alloc();
}
void assign(rosidl_runtime_c__double__Sequence& sequence, std::span<const double> values) {
    resize(sequence, values.size());
    std::ranges::copy(values, sequence.data);
}

std::string text(const rosidl_runtime_c__String& from) { return {from.data, from.size}; }

void assign(rosidl_runtime_c__String& text, const std::string& value) {
    if (!rosidl_runtime_c__String__assignn(&text, value.data(), value.size())) throw std::bad_alloc();
}

void assign(rosidl_runtime_c__String__Sequence& texts, const std::vector<std::string>& values) {
    rosidl_runtime_c__String__Sequence__fini(&texts);
    if (!rosidl_runtime_c__String__Sequence__init(&texts, values.size())) throw std::bad_alloc();
    for (std::size_t i = 0; i < values.size(); ++i) assign(texts.data[i], values[i]);
}

Time time_of(double seconds) {
    const double whole = std::floor(seconds);
    const double rest = std::round((seconds - whole) * 1e9);
    Time time{};
    time.sec = static_cast<std::int32_t>(whole) + (rest >= 1e9 ? 1 : 0);
    time.nanosec = rest >= 1e9 ? 0 : static_cast<std::uint32_t>(rest);
    return time;
}

std::shared_ptr<Service> serve(Node& node, const std::string& name,
                               std::function<std::string(bool&)> answer) {
    return node.serve(
        ROSIDL_GET_SRV_TYPE_SUPPORT(std_srvs, srv, Trigger), name,
        memory(std_srvs__srv__Trigger_Request__create, std_srvs__srv__Trigger_Request__destroy),
        memory(std_srvs__srv__Trigger_Response__create, std_srvs__srv__Trigger_Response__destroy),
        [answer = std::move(answer)](const void*, void* response) {
            auto& its = *static_cast<std_srvs__srv__Trigger_Response*>(response);
            assign(its.message, answer(its.success));
        });
}

std::shared_ptr<Service> serve(Node& node, const std::string& name,
                               std::function<std::string(bool, bool&)> answer) {
    return node.serve(
        ROSIDL_GET_SRV_TYPE_SUPPORT(std_srvs, srv, SetBool), name,
        memory(std_srvs__srv__SetBool_Request__create, std_srvs__srv__SetBool_Request__destroy),
        memory(std_srvs__srv__SetBool_Response__create, std_srvs__srv__SetBool_Response__destroy),
        [answer = std::move(answer)](const void* request, void* response) {
            auto& its = *static_cast<std_srvs__srv__SetBool_Response*>(response);
            assign(its.message,
                   answer(static_cast<const std_srvs__srv__SetBool_Request*>(request)->data, its.success));
        });
}

namespace {
template <class Response> Client::Answered told(Call::Answered answered) {
    return [answered = std::move(answered)](const void* response, std::int64_t) {
        const auto& its = *static_cast<const Response*>(response);
        answered(its.success, text(its.message));
    };
}
} // namespace

Call trigger(Node& node, const std::string& name, Call::Answered answered) {
    return {
        node.client(ROSIDL_GET_SRV_TYPE_SUPPORT(std_srvs, srv, Trigger), name,
                    memory(std_srvs__srv__Trigger_Response__create, std_srvs__srv__Trigger_Response__destroy),
                    told<std_srvs__srv__Trigger_Response>(std::move(answered))),
        memory(std_srvs__srv__Trigger_Request__create, std_srvs__srv__Trigger_Request__destroy)};
}

Call set_bool(Node& node, const std::string& name, bool value, Call::Answered answered) {
    auto request = memory(std_srvs__srv__SetBool_Request__create, std_srvs__srv__SetBool_Request__destroy);
    static_cast<std_srvs__srv__SetBool_Request*>(request.get())->data = value;
    return {
        node.client(ROSIDL_GET_SRV_TYPE_SUPPORT(std_srvs, srv, SetBool), name,
                    memory(std_srvs__srv__SetBool_Response__create, std_srvs__srv__SetBool_Response__destroy),
                    told<std_srvs__srv__SetBool_Response>(std::move(answered))),
        request};
}

} // namespace bf::ros2::messages

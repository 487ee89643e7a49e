#include "frames.hpp"

#include <cstring>
#include <stdexcept>
#include <string>

namespace bf::ros1 {

std::shared_ptr<const MessageType> transforms_type() {
    static const auto type =
        std::make_shared<const MessageType>("tf2_msgs/TFMessage",
                                            R"(geometry_msgs/TransformStamped[] transforms
====
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
====
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
====
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
====
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
====
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
)");
    return type;
}

std::vector<middleware::FrameMessage> frames_of(const Message& message, bool is_static) {
    Bytes left = message.bytes;
    const auto take = [&](void* to, std::size_t count) {
        if (count > left.size()) throw std::runtime_error("a message of tf ends before its last field");
        std::memcpy(to, left.data(), count);
        left = left.subspan(count);
    };
    const auto number = [&] {
        std::uint32_t value = 0;
        take(&value, sizeof value);
        return value;
    };
    const auto text = [&] {
        std::string value(std::min<std::size_t>(number(), left.size()), ' ');
        take(value.data(), value.size());
        return value;
    };
    std::vector<middleware::FrameMessage> all;
    for (std::uint32_t count = number(); count > 0; --count) {
        middleware::FrameMessage its;
        its.is_static = is_static;
        number(); // seq
        const std::int64_t seconds = number();
        its.stamp = seconds * 1'000'000'000 + number();
        its.parent = text();
        its.child = text();
        double p[3], q[4]; // x, y, z, w
        take(p, sizeof p);
        take(q, sizeof q);
        its.pose = {.q = {q[3], q[0], q[1], q[2]}, .p = {p[0], p[1], p[2]}};
        all.push_back(std::move(its));
    }
    return all;
}

} // namespace bf::ros1

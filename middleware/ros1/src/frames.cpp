#include "frames.hpp"

#include <cstdint>
#include <cstring>
#include <string>

namespace bf::ros1 {

namespace {

// Definitions as their packages have them, each with those of the types in it.
const std::string stamped = R"(std_msgs/Header header
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
)";

} // namespace

std::shared_ptr<const MessageType> transforms_type() {
    static const auto type = std::make_shared<const MessageType>(
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n====\nMSG: geometry_msgs/TransformStamped\n" + stamped);
    return type;
}

std::vector<middleware::FrameMessage> frames_of(const Message& message, bool is_static) {
    static const MessageType type("geometry_msgs/TransformStamped", stamped);
    static const Field &parent = *type.field("header.frame_id"), &child = *type.field("child_frame_id"),
                       &translation = *type.field("transform.translation"),
                       &rotation = *type.field("transform.rotation");
    std::vector<middleware::FrameMessage> all;
    transforms_type()->each(message, "transforms", type, [&](const Message& its) {
        std::uint32_t stamp[2]; // s and ns, which one number does not hold
        std::memcpy(stamp, type.value(its, "header.stamp").bytes.data(), sizeof stamp);
        double p[3], q[4]; // x, y, z, w
        translation.read(&its, p, 3);
        rotation.read(&its, q, 4);
        all.push_back({.parent = parent.text(&its),
                       .child = child.text(&its),
                       .stamp = std::int64_t{stamp[0]} * 1'000'000'000 + stamp[1],
                       .pose = {.q = {q[3], q[0], q[1], q[2]}, .p = {p[0], p[1], p[2]}},
                       .is_static = is_static});
    });
    return all;
}

} // namespace bf::ros1

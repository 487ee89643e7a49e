// Transforms between frames, as tf has them.
#include "bf/middleware/transforms.hpp"
#include "bf/middleware/frame_listener.hpp"

#include "blocks.hpp"
#include "messages.hpp"
#include "types.hpp"

#include <geometry_msgs/msg/transform_stamped.h>
#include <new>
#include <stdexcept>

namespace bf::ros2 {

namespace {

constexpr const char* message_type = "tf2_msgs/msg/TFMessage";

/// A message of that type, whose package is looked for at run time.
struct TransformMessage {
    geometry_msgs__msg__TransformStamped__Sequence transforms;
};

class PublishTransforms final : public middleware::PublishTransformsBlock {
  public:
    explicit PublishTransforms(const Arguments& arguments) : PublishTransformsBlock(arguments) {
        try {
            type_ = MessageType::find(message_type);
        } catch (const std::runtime_error& error) {
            problem(error.what());
        }
    }
    Requires<RosNode> node{this, "the node that talks"};

  private:
    void open(Now at, const std::shared_ptr<middleware::OutgoingTransforms>& end) const override {
        Node& its = at[node];
        its.open();
        const auto message = std::static_pointer_cast<TransformMessage>(type_->memory().make());
        if (!geometry_msgs__msg__TransformStamped__Sequence__init(&message->transforms, children->size()))
            throw std::bad_alloc();
        for (std::size_t i = 0; i < children->size(); ++i) {
            messages::assign(message->transforms.data[i].header.frame_id, frame_id);
            messages::assign(message->transforms.data[i].child_frame_id, (*children)[i]);
        }
        const auto publisher = is_static ? its.advertise(type_->memory(), "/tf_static", {1, true, true})
                                         : its.advertise(type_->memory(), "/tf", {100, true});
        end->publish = [message, publisher](double stamp,
                                            std::span<const middleware::SentTransform> transforms) {
            const auto time = messages::time_of(stamp);
            for (std::size_t i = 0; i < transforms.size(); ++i) {
                const auto& [p, q] = transforms[i];
                auto& to = message->transforms.data[i];
                to.header.stamp = time;
                to.transform.translation = {p.x(), p.y(), p.z()};
                to.transform.rotation = {q.x(), q.y(), q.z(), q.w()};
            }
            publisher->publish(message.get());
        };
        end->clock = [context = its.context()] { return context->now(); };
        end->bell = &its.bell();
        its.add(end);
    }
    std::shared_ptr<const MessageType> type_;
};

std::vector<middleware::FrameMessage> frames_of(const TransformMessage& message, bool is_static) {
    std::vector<middleware::FrameMessage> all;
    for (std::size_t i = 0; i < message.transforms.size; ++i) {
        const auto& its = message.transforms.data[i];
        const auto& [p, q] = its.transform;
        all.push_back({.parent = messages::text(its.header.frame_id),
                       .child = messages::text(its.child_frame_id),
                       .stamp = its.header.stamp.sec * std::int64_t{1'000'000'000} + its.header.stamp.nanosec,
                       .pose = {.q = {q.w, q.x, q.y, q.z}, .p = {p.x, p.y, p.z}},
                       .is_static = is_static});
    }
    return all;
}

} // namespace

/// What a node hears of frames, as long as one of its blocks listens.
class Frames {
  public:
    static std::shared_ptr<Frames> of(Node& node, const MessageType& type) {
        auto its = node.frames.lock();
        if (its) return its;
        its = std::make_shared<Frames>(node);
        node.frames = its;
        its->listen(node, type, its);
        return its;
    }
    explicit Frames(const Node& node) : listener([context = node.context()] { return context->now(); }) {}
    middleware::FrameListener listener;

  private:
    void listen(Node& node, const MessageType& type, const std::weak_ptr<Frames>& self) {
        for (const bool is_static : {false, true})
            topics_.push_back(
                node.subscribe(type.memory(), is_static ? "/tf_static" : "/tf", {100, true, is_static},
                               [self, is_static](const void* message, std::uint64_t) {
                                   if (const auto its = self.lock())
                                       its->listener.take(frames_of(
                                           *static_cast<const TransformMessage*>(message), is_static));
                               }));
    }
    std::vector<std::shared_ptr<Subscription>> topics_;
};

namespace {

class SubscribeTransform final : public middleware::SubscribeTransformBlock {
  public:
    explicit SubscribeTransform(const Arguments& arguments) : SubscribeTransformBlock(arguments) {
        try {
            type_ = MessageType::find(message_type);
        } catch (const std::runtime_error& error) {
            problem(error.what());
        }
    }
    Requires<RosNode> node{this, "the node that talks"};

  private:
    std::shared_ptr<middleware::TransformView> open(Now at) const override {
        at[node].open();
        const auto frames = Frames::of(at[node], *type_);
        return frames->listener.watch(target, source, frames);
    }
    std::shared_ptr<const MessageType> type_;
};

} // namespace

void add_transforms(Library& library) {
    library.group("topics").add<SubscribeTransform>("SubscribeTransform",
                                                    middleware::subscribe_transform_doc);
    library.group("topics").add<PublishTransforms>(
        "PublishTransforms",
        "Publishes homogeneous transforms as tf has them (tf2_msgs/msg/TFMessage), on /tf or /tf_static, "
        "such as those that ForwardKinematics gives; a port for each child frame. Where only the base moves "
        "in the world, a robot_state_publisher tells the rest from joint_states. Errors: a frame twice or "
        "in itself; no package tf2_msgs.");
}

} // namespace bf::ros2

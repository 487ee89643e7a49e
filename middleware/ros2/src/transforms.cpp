// Transforms between frames, as tf has them.
#include "bf/middleware/transforms.hpp"

#include "blocks.hpp"
#include "messages.hpp"
#include "types.hpp"

#include <geometry_msgs/msg/transform_stamped.h>
#include <new>
#include <stdexcept>

namespace bf::ros2 {

namespace {

/// tf2_msgs/msg/TFMessage, whose package is looked for at run time.
struct TransformMessage {
    geometry_msgs__msg__TransformStamped__Sequence transforms;
};

class PublishTransforms final : public middleware::PublishTransformsBlock {
  public:
    explicit PublishTransforms(const Arguments& arguments) : PublishTransformsBlock(arguments) {
        try {
            type_ = MessageType::find("tf2_msgs/msg/TFMessage");
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

} // namespace

void add_transforms(Library& library) {
    library.group("topics").add<PublishTransforms>(
        "PublishTransforms",
        "Publishes homogeneous transforms as tf has them (tf2_msgs/msg/TFMessage), on /tf or /tf_static, "
        "such as those that ForwardKinematics gives; a port for each child frame. Where only the base moves "
        "in the world, a robot_state_publisher tells the rest from joint_states. Errors: a frame twice or "
        "in itself; no package tf2_msgs.");
}

} // namespace bf::ros2

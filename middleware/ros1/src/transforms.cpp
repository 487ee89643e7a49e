// Transforms between frames, as tf has them.
#include "bf/middleware/transforms.hpp"

#include "draft.hpp"
#include "node.hpp"

#include <cstring>
#include <mutex>

namespace bf::ros1 {

namespace {

class PublishTransforms final : public middleware::PublishTransformsBlock {
  public:
    explicit PublishTransforms(const Arguments& arguments) : PublishTransformsBlock(arguments) {
        try {
            type_ = MessageType::find("tf2_msgs/TFMessage");
        } catch (const std::runtime_error& error) {
            problem(error.what());
        }
    }
    Requires<RosConnection> node{this, "the node that talks"};

  private:
    void open(Now at, const std::shared_ptr<middleware::OutgoingTransforms>& end) const override {
        at[node].open();
        at[node].publish({is_static ? "/tf_static" : "/tf", type_, is_static ? 1 : 100, is_static}, frame_id,
                         children, end);
    }
    std::shared_ptr<const MessageType> type_;
};

} // namespace

/// What a block tells, as it goes out.
struct ToldTransforms {
    std::uint32_t count = 0;
    std::vector<std::uint8_t> bytes;
};

void Node::publish(const TopicOptions& topic, const std::string& frame,
                   const std::vector<std::string>& children,
                   const std::shared_ptr<middleware::OutgoingTransforms>& end) {
    const auto told = std::make_shared<ToldTransforms>();
    // roscpp keeps the last message of a topic alone, so it has what all blocks tell that stays.
    const auto list = topic.is_kept ? kept_transforms_ : std::make_shared<KeptTransforms>();
    {
        const std::lock_guard lock(list->mutex);
        list->all.push_back(told);
    }
    end->publish =
        [publisher = advertise(topic), each = Draft("geometry_msgs/TransformStamped"), frame, children, told,
         list, raw = Raw()](double stamp, std::span<const middleware::SentTransform> transforms) mutable {
            told->count = static_cast<std::uint32_t>(transforms.size());
            told->bytes.clear();
            for (std::size_t i = 0; i < transforms.size(); ++i) {
                each.set("header.stamp", stamp);
                each.set("header.frame_id", {frame});
                each.set("child_frame_id", {children[i]});
                each.set("transform.translation", std::span(transforms[i].translation.data(), 3));
                each.set("transform.rotation", std::span(transforms[i].rotation.data(), 4));
                each.append_to(told->bytes);
            }
            std::uint32_t count = 0; // a list is its number and its elements
            raw.bytes.assign(sizeof count, 0);
            const std::lock_guard lock(list->mutex);
            for (const auto& its : middleware::alive(list->all)) {
                count += its->count;
                raw.bytes.insert(raw.bytes.end(), its->bytes.begin(), its->bytes.end());
            }
            std::memcpy(raw.bytes.data(), &count, sizeof count);
            publisher->publish(raw);
        };
    end->clock = clock();
    end->bell = &outbox_.bell();
    outbox_.add(end);
}

void add_transforms(Library& library) {
    library.group("topics").add<PublishTransforms>(
        "PublishTransforms",
        "Publishes homogeneous transforms as tf has them (tf2_msgs/TFMessage), on /tf or /tf_static, such as "
        "those that ForwardKinematics gives; a port for each child frame. Where only the base moves in the "
        "world, a robot_state_publisher tells the rest from joint_states. Below a Bag nothing is sent. "
        "Errors: a frame twice or in itself; no package tf2_msgs.");
}

} // namespace bf::ros1

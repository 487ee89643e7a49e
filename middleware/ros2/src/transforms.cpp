// Transforms between frames, as tf has them.
#include "bf/base/names.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/topics.hpp"
#include "blocks.hpp"
#include "messages.hpp"
#include "types.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <geometry_msgs/msg/transform_stamped.h>
#include <new>
#include <stdexcept>

namespace bf::ros2 {

namespace {

using middleware::Opened;

/// tf2_msgs/msg/TFMessage, whose package is looked for at run time.
struct TransformMessage {
    geometry_msgs__msg__TransformStamped__Sequence transforms;
};

/// The step leaves matrices, and the node's thread makes messages of them.
class Transforms final : public Sender {
  public:
    Transforms(const Node& node, std::shared_ptr<const MessageType> type, const std::string& frame,
               const std::vector<std::string>& children, bool is_static, bool is_model_time)
        : newest(1 + 16 * static_cast<int>(children.size())), context_(node.context()),
          type_(std::move(type)),
          message_(std::static_pointer_cast<TransformMessage>(type_->memory().make())), is_static_(is_static),
          is_model_time_(is_model_time), values_(static_cast<std::size_t>(newest.size())),
          before_(values_.size()) {
        end_ = is_static ? node.advertise(type_->memory(), "/tf_static", {1, true, true})
                         : node.advertise(type_->memory(), "/tf", {100, true});
        if (!geometry_msgs__msg__TransformStamped__Sequence__init(&message_->transforms, children.size()))
            throw std::bad_alloc();
        for (std::size_t i = 0; i < children.size(); ++i) {
            messages::assign(message_->transforms.data[i].header.frame_id, frame);
            messages::assign(message_->transforms.data[i].child_frame_id, children[i]);
        }
    }
    bool has_news() const noexcept override { return newest.newest() != sent_; }
    void send() override {
        middleware::Stamp stamp;
        if (!newest.read(values_.data(), stamp)) return;
        const bool is_first = sent_ == 0;
        sent_ = stamp.number;
        if (is_static_ && !is_first && std::equal(values_.begin() + 1, values_.end(), before_.begin() + 1))
            return;
        before_ = values_;
        const auto time = messages::time_of(is_model_time_ ? values_[0] : context_->now());
        for (std::size_t i = 0; i < message_->transforms.size; ++i) {
            const Eigen::Map<const Eigen::Matrix4d> H(values_.data() + 1 + 16 * i);
            const Eigen::Quaterniond q = Eigen::Quaterniond(H.topLeftCorner<3, 3>()).normalized();
            auto& its = message_->transforms.data[i];
            its.header.stamp = time;
            its.transform.translation = {H(0, 3), H(1, 3), H(2, 3)};
            its.transform.rotation = {q.x(), q.y(), q.z(), q.w()};
        }
        end_->publish(message_.get());
    }
    middleware::ExchangeBuffer newest; ///< time of the model, matrices column by column

  private:
    std::shared_ptr<Context> context_;
    std::shared_ptr<const MessageType> type_;
    std::shared_ptr<TransformMessage> message_;
    const bool is_static_, is_model_time_;
    std::vector<double> values_, before_;
    std::shared_ptr<Publisher> end_;
    std::atomic<std::uint64_t> sent_{0};
};

class PublishTransforms final : public Block {
  public:
    explicit PublishTransforms(const Arguments& arguments) : Block(arguments) {
        try {
            type_ = MessageType::find("tf2_msgs/msg/TFMessage");
        } catch (const std::runtime_error& error) {
            problem(error.what());
        }
        bool is_fine = !children->empty();
        if (!is_fine) problem("argument 'children' names no frame; name some, such as base");
        for (const auto& child : *children) {
            const bool is_one = std::ranges::count_if(*children, [&](const auto& other) {
                                    return plain(other) == plain(child);
                                }) == 1;
            if (!is_one) problem("argument 'children' has the port '" + plain(child) + "' twice");
            if (child.empty() || child == *frame_id)
                problem("the frame '" + child + "' cannot be in '" + *frame_id + "'");
            is_fine = is_fine && is_one;
        }
        if (!is_fine) return;
        for (const auto& child : *children)
            inputs_.emplace_back(this, plain(child),
                                 About{.shape = {4, 4}, .doc = "homogeneous: of that frame in frame_id"});
    }
    Argument<std::string> frame_id{
        this, "frame_id", {.initial = "world", .doc = "in which the transforms are"}};
    Argument<std::vector<std::string>> children{
        this, "children", {.initial = {"base"}, .doc = "frames whose transforms are inputs, by their names"}};
    Argument<bool> is_static{
        this,
        "static",
        {.initial = false,
         .doc = "publish on /tf_static, where they stay for those who come later, as soon as they change"}};
    Argument<std::string> stamp{
        this,
        "stamp",
        {.initial = "clock",
         .doc = "of the headers: time of ROS when they are sent, or time of the model",
         .choices = {"clock", "model"}}};
    Requires<RosNode> node{this, "the node that talks"};
    OutsideState<Opened<Transforms>> opened{this, [] { return std::make_shared<Opened<Transforms>>(); }};
    Scratch<std::vector<double>> values{this, [] { return std::vector<double>(); }};

    void start(Now at) const override {
        Node& its = at[node];
        its.open();
        auto end = std::make_shared<Transforms>(its, type_, frame_id, children, is_static, *stamp == "model");
        its.add(end);
        at[values].assign(static_cast<std::size_t>(end->newest.size()), 0.0);
        at[opened].end = std::move(end);
    }
    void stop(Now at) const noexcept override {
        send_last(at[opened].end);
        at[opened].end.reset();
    }
    Status output(Now at, Out) const noexcept override {
        auto& all = at[values];
        all[0] = at.time();
        double* to = all.data() + 1;
        for (const auto& input : inputs_) to = std::copy_n(at[input].data(), 16, to);
        at[opened].end->newest.write(all.data(), middleware::now());
        at[node].bell().ring();
        return ok;
    }

  private:
    std::shared_ptr<const MessageType> type_;
    std::vector<Input<Matrix>> inputs_;
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

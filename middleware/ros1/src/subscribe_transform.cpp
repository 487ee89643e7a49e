// The pose of a frame in another one, as tf tells it.
#include "frames.hpp"
#include "node.hpp"

#include <atomic>
#include <chrono>

namespace bf::ros1 {

/// What a node hears of frames, as long as one of its blocks listens.
class Frames {
  public:
    Frames()
        : listener([told = told_time_] {
              const double its = *told;
              if (its != by_system) return its;
              return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
                  .count();
          }) {}
    void listen(Node& node, const std::weak_ptr<Frames>& self) {
        if (ros::Time::isSimTime()) {
            *told_time_ = 0;
            const auto type = std::make_shared<const MessageType>("rosgraph_msgs/Clock", "time clock\n");
            topics_.push_back(node.hear(
                {"/clock", type, 10},
                [told = told_time_, field = type->field("clock"), type](const Message& message,
                                                                        const std::string&) {
                    double time = 0;
                    field->read(&message, &time, 1);
                    *told = time;
                },
                [](const std::string&, const std::string&) {}));
        }
        for (const bool is_static : {false, true})
            topics_.push_back(node.hear(
                {is_static ? "/tf_static" : "/tf", transforms_type(), 100},
                [self, is_static](const Message& message, const std::string&) {
                    if (const auto its = self.lock()) its->listener.take(frames_of(message, is_static));
                },
                [self](const std::string& what, const std::string& from) {
                    if (const auto its = self.lock()) its->listener.leave_out("'" + from + "' sends " + what);
                }));
    }

  private:
    static constexpr double by_system = -1;
    std::shared_ptr<std::atomic<double>> told_time_ = std::make_shared<std::atomic<double>>(by_system);

  public:
    middleware::FrameListener listener;

  private:
    std::vector<std::shared_ptr<void>> topics_;
};

std::shared_ptr<middleware::TransformView> Node::watch(const std::string& target, const std::string& source) {
    auto frames = frames_.lock();
    if (!frames) {
        frames = std::make_shared<Frames>();
        frames_ = frames;
        frames->listen(*this, frames);
    }
    return frames->listener.watch(target, source, frames);
}

namespace {

class SubscribeTransform final : public middleware::SubscribeTransformBlock {
  public:
    using SubscribeTransformBlock::SubscribeTransformBlock;
    Requires<RosConnection> node{this, "the node that talks"};

  private:
    std::shared_ptr<middleware::TransformView> open(Now at) const override {
        at[node].open();
        return at[node].watch(target, source);
    }
};

} // namespace

void add_frames(Library& library) {
    library.group("topics").add<SubscribeTransform>("SubscribeTransform",
                                                    middleware::subscribe_transform_doc);
}

} // namespace bf::ros1

// Transforms between frames, as tf has them: what the blocks PublishTransforms of the middlewares that have
// tf share.
#pragma once

#include "bf/middleware/topics.hpp"

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace bf::middleware {

/// Of a child frame in its parent.
struct SentTransform {
    Eigen::Vector3d translation;
    Eigen::Vector4d rotation; ///< x y z w
};

/// The step leaves matrices, and the thread of an Outbox sends them.
class OutgoingTransforms final : public Sender {
  public:
    OutgoingTransforms(int count, bool is_static, bool is_model_time);
    bool has_news() const noexcept override { return newest.newest() != sent_; }
    void send() override;

    ExchangeBuffer newest; ///< time of the model, matrices column by column
    /// All that follow are set by who opens it; the first one sends a message.
    std::function<void(double stamp, std::span<const SentTransform>)> publish;
    std::function<double()> clock; ///< time of the network, s
    Bell* bell = nullptr;          ///< of who sends; null: nobody does

  private:
    const bool is_static_, is_model_time_;
    std::vector<double> values_, before_;
    std::vector<SentTransform> all_;
    std::atomic<std::uint64_t> sent_{0};
};

class PublishTransformsBlock : public Block {
  public:
    explicit PublishTransformsBlock(const Arguments& arguments);
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
    OutsideState<Opened<OutgoingTransforms>> opened{
        this, [] { return std::make_shared<Opened<OutgoingTransforms>>(); }};
    Scratch<std::vector<double>> values{this, [] { return std::vector<double>(); }};

    void start(Now at) const override;
    void stop(Now at) const noexcept override;
    Status output(Now at, Out out) const noexcept override;

  protected:
    /// Gives it what it sends with. Throws std::runtime_error.
    virtual void open(Now at, const std::shared_ptr<OutgoingTransforms>& end) const = 0;

  private:
    std::vector<Input<Matrix>> inputs_;
};

} // namespace bf::middleware

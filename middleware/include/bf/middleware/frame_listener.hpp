// The transform between two frames of tf as outputs of a block: what the blocks SubscribeTransform of the
// middlewares that have tf share.
#pragma once

#include "bf/core/block.hpp"
#include "bf/middleware/exchange.hpp"
#include "bf/middleware/fields.hpp"
#include "bf/middleware/frame_buffer.hpp"
#include "bf/middleware/topics.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace bf::middleware {

/// What is known of a transform at a time.
struct KnownTransform {
    Eigen::Matrix4d target_H_source = Eigen::Matrix4d::Identity(); ///< the last one that was found
    FrameBuffer::State state = FrameBuffer::State::no_target;
    bool was_found = false;
    std::optional<double> stamp = {}; ///< s, of the last one; none where all is static
    double jumps = 0, left_out = 0;
    std::string why = ""; ///< it is not found
};

/// Where steps find what is known of a transform.
class TransformView {
  public:
    /// As numbers.
    enum Place { pose = 0, state = 16, was_found, is_static, stamp, jumps, left_out, size };
    virtual ~TransformView() = default;
    /// Copies the newest numbers; they stay as they are where nothing is known yet.
    virtual void take(double time, double* values) noexcept = 0;
    /// Why it was not found.
    virtual void why(double time, std::span<char> text) const noexcept = 0;
    /// By the clock of the stamps, s.
    virtual double now(double time) const noexcept = 0;
    /// How long it is looked at, s.
    virtual double looked(double time) const noexcept = 0;

  protected:
    static void write(const KnownTransform& from, double* values);
};

/// Follows a transform through the messages of tf.
class TransformWatch {
  public:
    TransformWatch(std::string target, std::string source)
        : target_(std::move(target)), source_(std::move(source)) {}
    /// `stamps` is the time by the clock of the stamps, `now` that of a clock that goes on, s.
    const KnownTransform& look(const FrameBuffer& frames, double stamps, double now);
    /// That a message was left out, and why.
    void leave_out(const std::string& why);

  private:
    const std::string target_, source_;
    std::string left_out_;
    KnownTransform known_;
};

/// Transforms whose messages come in another thread, for all blocks of a node.
class FrameListener {
  public:
    /// `clock` gives the time by the clock of the stamps, in any thread, without waiting.
    explicit FrameListener(std::function<double()> clock) : clock_(std::move(clock)) {}
    /// In the thread of who receives: what one message has.
    void take(std::span<const FrameMessage> messages);
    /// The same: that a message is none.
    void leave_out(const std::string& why);
    /// Follows it from now on as long as somebody has what is returned, which keeps `owner`.
    std::shared_ptr<TransformView> watch(const std::string& target, const std::string& source,
                                         std::shared_ptr<const void> owner);

  private:
    class Live;
    void look(Live& end, double now);
    const std::function<double()> clock_;
    double last_ = 0; ///< by that clock
    std::mutex mutex_;
    FrameBuffer frames_;
    std::vector<std::weak_ptr<Live>> watches_;
};

/// What the middlewares' blocks say of themselves.
inline constexpr const char* subscribe_transform_doc =
    "The pose of the frame `source` in the frame `target` as /tf and /tf_static tell it, along the tree of "
    "frames, at the newest time that all moving frames in between have; at that time the pose of each is "
    "interpolated between the stamps around, as tf2 does it: positions linearly, orientations by slerp. Of "
    "each frame 10 s are kept. Another thread listens and follows the tree, and a step takes what was found "
    "last. While none is found, `valid` is false and the last one stays. A frame has the parent of its "
    "newest stamp, and one that changes between parents three times within 10 s has two of them. A stamp "
    "that is more than 1 s older than one before of the same frame, or a clock that goes back, says that "
    "time has jumped back: what moves is forgotten then. Errors: not found within start_timeout; in a step: "
    "it is older than timeout.";

/// The pose of a frame in another one.
class SubscribeTransformBlock : public Block {
  public:
    explicit SubscribeTransformBlock(const Arguments& arguments);

    Argument<std::string> target{
        this, "target", {.initial = "world", .doc = "frame in which coordinates are wanted"}};
    Argument<std::string> source{this, "source", {.initial = "base", .doc = "frame in which they are"}};
    Argument<double> timeout{this, "timeout", waiting_time("age at which the run ends, s; 0: never")};
    Argument<double> start_timeout{
        this, "start_timeout",
        waiting_time("how long the start waits until the transform is found, s; 0: not at all")};
    Output<Matrix> target_H_source{
        this,
        "target_H_source",
        {.shape = {4, 4}, .doc = "homogeneous; the last one while none is found, at first the identity"}};
    Output<bool> valid{this, "valid", {.doc = "whether it is found"}};
    Output<double> age{this,
                       "age",
                       {.unit = unit<"s">,
                        .doc = "of the last one, by the clock of the stamps; 0 where all frames are static; "
                               "before the first, since the start"}};
    Output<double> state{
        this,
        "state",
        {.doc = "0 found, 1 there is no target, 2 no source, 3 they are in two trees, 4 frames are in a "
                "loop, 5 there is no time that all frames in between have, 6 one of them has two parents"}};
    Output<double> jumps{this, "jumps", {.doc = "how often time has jumped back so far"}};
    Output<double> left_out{this,
                            "left_out",
                            {.doc = "messages so far that were none: not finite, no unit quaternion, a frame "
                                    "in itself or without a name"}};
    OutsideState<Opened<TransformView>> opened{this,
                                               [] { return std::make_shared<Opened<TransformView>>(); }};
    Scratch<std::vector<double>> values{this, [] { return std::vector<double>(TransformView::size); }};
    Scratch<StatusText> refused{this, [] { return StatusText(""); }};

    void start(Now at) const override;
    void stop(Now at) const noexcept override { at[opened].end.reset(); }
    Status output(Now at, Out out) const noexcept override;

  protected:
    /// Opens what it looks at. Throws std::runtime_error.
    virtual std::shared_ptr<TransformView> open(Now at) const = 0;
};

} // namespace bf::middleware

// A tree of frames, and the poses that its frames have had in their parents for the last seconds.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace bf::middleware {

/// a_H_b as tf tells it: x_a = R(q) x_b + p.
struct FramePose {
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero();

    FramePose operator*(const FramePose& b_H_c) const { return {q * b_H_c.q, p + q * b_H_c.p}; }
    FramePose inverse() const { return {q.conjugate(), -(q.conjugate() * p)}; }
};

/// What a message says of a frame.
struct FrameMessage {
    std::string parent, child;
    std::int64_t stamp = 0; ///< ns; of a static one it does not count
    FramePose pose = {};    ///< parent_H_child
    bool is_static = false;
};

/// The newest of messages of tf, from which transforms are found along the tree. Names with and without a
/// slash in front are the same.
///
/// - A frame has one parent, that of its newest stamp; what was known of it in another one is forgotten. A
///   frame that changes between parents `most_changes` times in `memory` has two, and transforms through it
///   are refused until it has not changed for as long.
/// - Stamps of a frame come in order but for `disorder`; one that is older says that time has jumped back,
///   and all is forgotten that is not static.
/// - Of messages with the same stamp the first counts.
class FrameBuffer {
  public:
    static constexpr double memory = 10;           ///< s that are kept of each frame
    static constexpr double disorder = 1;          ///< s
    static constexpr std::size_t most_changes = 3; ///< of a parent, in that time
    static constexpr std::size_t most_frames = 10'000, most_samples = 20'000;

    enum class State {
        found,
        no_target,
        no_source,
        apart,          ///< the frames are in two trees
        loop,           ///< a frame is below itself
        no_common_time, ///< a frame has come later than the newest stamp of another one
        two_parents,
    };
    struct Found {
        State state = State::found;
        FramePose pose = {};                    ///< target_H_source
        std::optional<std::int64_t> stamp = {}; ///< ns; none where all frames in between are static
        std::string why = {};                   ///< it is not found
    };

    /// Takes what came at that time, s, by a clock that goes on. What is wrong with it, and it is left out;
    /// empty: nothing.
    std::string add(const FrameMessage& message, double arrived);
    /// Of the newest time that all frames in between have, at which the pose of each is interpolated between
    /// the stamps around: positions on a line, orientations on a great arc.
    Found find(const std::string& target, const std::string& source, double now) const;
    /// Forgets what is not static, as time has jumped back.
    void jump();
    int jumps() const { return jumps_; }

  private:
    struct Sample {
        std::int64_t stamp;
        FramePose pose;
    };
    struct Frame {
        std::string name;
        int parent = -1; ///< -1: none so far
        int other = -1;  ///< another one that was told
        bool is_static = false;
        std::deque<Sample> samples = {}; ///< by their stamps; one where it is static
        std::deque<double> changes = {}; ///< when they came, s; the last of them

        bool has_two_parents(double now) const {
            return changes.size() == most_changes && now - changes.front() < memory;
        }
    };
    using Path = std::vector<int>; ///< from a frame up to its root; it ends where it meets itself

    int number(const std::string& name);
    int known(const std::string& name) const;
    const Frame& frame(int number) const { return frames_[static_cast<std::size_t>(number)]; }
    Path path_from(int number) const;
    std::string text(const Path& path) const;
    std::string unknown(const std::string& name) const;
    bool changes_parent(Frame& child, int parent, const FrameMessage& message, double arrived);

    std::vector<Frame> frames_;
    std::map<std::string, int, std::less<>> numbers_;
    int jumps_ = 0;
};

} // namespace bf::middleware

#include "bf/middleware/frame_buffer.hpp"

#include "bf/base/names.hpp"
#include "bf/core/value.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace bf::middleware {

namespace {

constexpr std::int64_t nanoseconds(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

std::string without_slash(const std::string& name) { return name.starts_with('/') ? name.substr(1) : name; }

/// What is wrong with it by itself.
std::string defect_of(const FrameMessage& message) {
    // Single precision and text of some digits come within that, as tf2 takes them.
    constexpr double tolerance = 0.01;
    const std::string where = "the pose of '" + message.child + "' in '" + message.parent + "' ";
    if (without_slash(message.child).empty() || without_slash(message.parent).empty())
        return where + "is of a frame without a name";
    if (without_slash(message.child) == without_slash(message.parent))
        return where + "is of a frame in itself";
    constexpr double farthest = 1e150; // m, so that a path of poses stays finite
    if (!(message.pose.p.array().abs() < farthest).all() || !message.pose.q.coeffs().allFinite())
        return where + "is not finite, or farther than a pose can be";
    if (std::abs(message.pose.q.squaredNorm() - 1) > tolerance)
        return where + "has a quaternion that is not of unit length";
    return "";
}

/// Does it end where it was?
bool is_loop(const std::vector<int>& path) { return std::ranges::find(path, path.back()) != path.end() - 1; }

} // namespace

int FrameBuffer::known(const std::string& name) const {
    const auto found = numbers_.find(without_slash(name));
    return found == numbers_.end() ? -1 : found->second;
}

int FrameBuffer::number(const std::string& name) {
    const auto [at, is_new] = numbers_.try_emplace(without_slash(name), static_cast<int>(frames_.size()));
    if (is_new) frames_.push_back({.name = at->first});
    return at->second;
}

std::string FrameBuffer::add(const FrameMessage& message, double arrived) {
    if (std::string defect = defect_of(message); !defect.empty()) return defect;
    if (frames_.size() + 2 > most_frames && (known(message.child) < 0 || known(message.parent) < 0))
        return "there are more than " + std::to_string(most_frames) + " frames, without '" + message.child +
               "'";
    const int parent = number(message.parent);
    const auto its_number = static_cast<std::size_t>(number(message.child));
    const Sample sample{message.stamp, {message.pose.q.normalized(), message.pose.p}};
    if (const auto& its = frames_[its_number];
        !message.is_static && !its.is_static && !its.samples.empty() &&
        message.stamp < its.samples.back().stamp - nanoseconds(disorder))
        jump();
    Frame& child = frames_[its_number];
    if (child.parent >= 0 && (child.parent != parent || child.is_static != message.is_static) &&
        !changes_parent(child, parent, message, arrived))
        return "";
    child.parent = parent;
    child.is_static = message.is_static;
    if (message.is_static) {
        child.samples.assign(1, sample);
        return "";
    }
    const auto at = std::ranges::lower_bound(child.samples, message.stamp, {}, &Sample::stamp);
    if (at == child.samples.end() || at->stamp != message.stamp) child.samples.insert(at, sample);
    const std::int64_t oldest = child.samples.back().stamp - nanoseconds(memory);
    while (child.samples.front().stamp < oldest || child.samples.size() > most_samples)
        child.samples.pop_front();
    return "";
}

/// Whether the message counts, which tells another parent, or of a frame that was static that it moves.
bool FrameBuffer::changes_parent(Frame& child, int parent, const FrameMessage& message, double arrived) {
    const bool moves = !message.is_static && !child.is_static;
    if (moves && message.stamp < child.samples.front().stamp) return false; // of the time before the change
    child.changes.push_back(arrived);
    if (child.changes.size() > most_changes) child.changes.pop_front();
    if (moves && message.stamp < child.samples.back().stamp) {
        child.other = parent;
        return false;
    }
    child.other = child.parent;
    child.samples.clear();
    return true;
}

void FrameBuffer::jump() {
    ++jumps_;
    for (auto& each : frames_) {
        if (each.is_static) continue;
        each.parent = each.other = -1;
        each.samples.clear();
        each.changes.clear();
    }
}

FrameBuffer::Path FrameBuffer::path_from(int number) const {
    Path path{number};
    while (frame(path.back()).parent >= 0 && !is_loop(path)) path.push_back(frame(path.back()).parent);
    return path;
}

std::string FrameBuffer::text(const Path& path) const {
    std::string all;
    for (const int each : path) all += (all.empty() ? "'" : " in '") + frame(each).name + "'";
    return all;
}

std::string FrameBuffer::unknown(const std::string& name) const {
    std::vector<std::string> names;
    for (const auto& [each, number] : numbers_) names.push_back(each);
    if (names.empty()) return "no frames are told";
    const auto near = nearest_first(name, names, 1);
    const bool is_near = edit_distance(name, near.front()) <= 2;
    return "there is no frame '" + name + "'; " +
           (is_near ? "did you mean '" + near.front() + "'?" : "there are " + name_list(names));
}

FrameBuffer::Found FrameBuffer::find(const std::string& target, const std::string& source, double now) const {
    const auto fail = [](State state, std::string why) {
        return Found{.state = state, .why = std::move(why)};
    };
    const int from = known(source), to = known(target);
    if (to < 0) return fail(State::no_target, unknown(target));
    if (from < 0) return fail(State::no_source, unknown(source));
    Path up = path_from(from), down = path_from(to);
    for (const auto* path : {&up, &down})
        if (is_loop(*path))
            return fail(State::loop, "frames are in a loop: " +
                                         text({std::ranges::find(*path, path->back()), path->end()}));
    if (up.back() != down.back())
        return fail(State::apart, "'" + target + "' is in the tree of '" + frame(down.back()).name + "', '" +
                                      source + "' in that of '" + frame(up.back()).name + "'");
    // What both have in common is above the frame where they meet.
    while (up.size() > 1 && down.size() > 1 && up[up.size() - 2] == down[down.size() - 2]) {
        up.pop_back();
        down.pop_back();
    }
    up.pop_back();
    down.pop_back();
    Found found;
    int newest = -1; ///< frame whose newest stamp is the oldest
    for (const auto* path : {&up, &down})
        for (const int each : *path) {
            const Frame& its = frame(each);
            if (its.has_two_parents(now))
                return fail(State::two_parents,
                            "'" + its.name + "' is told in '" + frame(its.parent).name + "' and " +
                                (its.other == its.parent ? "there as static, too"
                                                         : "in '" + frame(its.other).name + "'"));
            if (its.is_static || (found.stamp && *found.stamp <= its.samples.back().stamp)) continue;
            found.stamp = its.samples.back().stamp;
            newest = each;
        }
    for (const auto* path : {&up, &down}) {
        FramePose top_H_end;
        for (const int each : *path) {
            const auto& samples = frame(each).samples;
            if (frame(each).is_static) {
                top_H_end = samples.front().pose * top_H_end;
                continue;
            }
            const auto after = std::ranges::lower_bound(samples, *found.stamp, {}, &Sample::stamp);
            if (after == samples.begin() && after->stamp != *found.stamp)
                return fail(State::no_common_time,
                            "the newest of '" + frame(newest).name + "' is " +
                                Value(static_cast<double>(after->stamp - *found.stamp) / 1e9).describe() +
                                " s older than the first of '" + frame(each).name + "'");
            FramePose pose = after->pose;
            if (after->stamp != *found.stamp) {
                const Sample& before = *(after - 1);
                const double part = static_cast<double>(*found.stamp - before.stamp) /
                                    static_cast<double>(after->stamp - before.stamp);
                pose = {before.pose.q.slerp(part, pose.q), before.pose.p + part * (pose.p - before.pose.p)};
            }
            top_H_end = pose * top_H_end;
        }
        found.pose = path == &up ? top_H_end : top_H_end.inverse() * found.pose;
    }
    return found;
}

} // namespace bf::middleware

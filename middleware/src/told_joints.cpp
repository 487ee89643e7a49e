#include "told_joints.hpp"

#include "bf/base/names.hpp"
#include "bf/middleware/clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace bf::middleware {

ToldJoints::ToldJoints(const std::vector<std::string>& joints) : joints_(joints) {
    for (std::size_t i = 0; i < joints.size(); ++i) ours_[joints[i]] = static_cast<Eigen::Index>(i);
    clear();
}

void ToldJoints::clear() {
    const auto n = static_cast<Eigen::Index>(joints_.size());
    for (auto* values : {&position_, &velocity_, &effort_}) values->setZero(n);
    came_.setConstant(n, never);
    for (auto* has : {&has_velocity_, &has_effort_}) has->setConstant(n, false);
    stamp_ = 0;
    names_.clear();
    places_.clear();
    left_out_at_ = never;
    tellers_ = std::vector<Turns>(joints_.size());
}

void ToldJoints::take(const JointStates& states, bool stamps_go_on) {
    if (states.names != names_) {
        names_ = states.names;
        places_.clear();
        twice_ = -1;
        for (const auto& name : names_) {
            const auto found = ours_.find(name);
            const Eigen::Index place = found == ours_.end() ? -1 : found->second;
            if (place >= 0 && std::ranges::find(places_, place) != places_.end()) twice_ = place;
            places_.push_back(place);
        }
    }
    const bool is_ours = std::ranges::any_of(places_, [](auto place) { return place >= 0; });
    if (!is_ours && !names_.empty()) return;
    if (states.position.size() != names_.size())
        return leave_out("it has %zu names and %zu positions", names_.size(), states.position.size());
    if (twice_ >= 0)
        return leave_out("it names '%s' twice", joints_[static_cast<std::size_t>(twice_)].c_str());
    for (std::size_t i = 0; i < names_.size(); ++i) {
        const Eigen::Index at = places_[i];
        if (at < 0) continue;
        if (auto& tellers = tellers_[static_cast<std::size_t>(at)]; states.from != 0) {
            tellers.sent(states.from);
            if (tellers.are_two()) {
                leave_out("two programs tell of '%s' by turns; end one of them", names_[i].c_str());
                continue;
            }
        }
        const auto has = [i](std::span<const double> from) {
            return i < from.size() && std::isfinite(from[i]);
        };
        const auto lacks = [&](const char* what, std::span<const double> from) {
            if (has(from)) return false;
            if (i < from.size())
                leave_out("the %s of '%s' is %g", what, names_[i].c_str(), from[i]);
            else
                leave_out("it tells no %s of '%s' any more", what, names_[i].c_str());
            return true;
        };
        // What a robot does not know it may tell as NaN; what it has told once belongs to each state.
        if (lacks("position", states.position) || (has_velocity_[at] && lacks("velocity", states.velocity)) ||
            (has_effort_[at] && lacks("effort", states.effort)))
            continue;
        position_[at] = states.position[i];
        if ((has_velocity_[at] = has(states.velocity))) velocity_[at] = states.velocity[i];
        if ((has_effort_[at] = has(states.effort))) effort_[at] = states.effort[i];
        came_[at] = now();
        stamp_ = stamps_go_on ? std::max(stamp_, states.stamp) : states.stamp;
    }
}

void ToldJoints::stand_at(double stamp) {
    if (stamp == stamp_) came_ = (came_.array() > 0).select(now(), came_);
}

std::optional<std::vector<Eigen::Index>> ToldJoints::order() const {
    std::vector<Eigen::Index> all(joints_.size());
    std::iota(all.begin(), all.end(), 0);
    return std::ranges::is_permutation(places_, all) ? std::optional(places_) : std::nullopt;
}

std::string ToldJoints::what_is_missing(const std::string& topic, const std::string& within) const {
    if (names_.empty() && left_out_at_ == never)
        return "no message came on the topic '" + topic + "' within " + within +
               "; start the robot, or correct namespace and states";
    std::vector<std::string> missing;
    for (std::size_t i = 0; i < joints_.size(); ++i)
        if (came_[static_cast<Eigen::Index>(i)] == never) missing.push_back(joints_[i]);
    const std::string nothing =
        "the topic '" + topic + "' tells nothing of " + name_list(missing) + " within " + within;
    return left_out_at_ == never ? nothing + "; it has " + name_list(names_)
                                 : nothing + ": what came was left out: " + left_out_;
}

void ToldJoints::say_left_out(toolbox::RobotConnection::ErrorText& text) const noexcept {
    Eigen::Index oldest = 0;
    const double all_came = came_.minCoeff(&oldest);
    text[0] = '\0';
    if (left_out_at_ > all_came)
        std::snprintf(text, sizeof text, "what came was left out: %s", left_out_);
    else if (came_.maxCoeff() > all_came + longest_silence)
        std::snprintf(text, sizeof text, "what came told nothing of '%s'",
                      joints_[static_cast<std::size_t>(oldest)].c_str());
}

template <class... Values> void ToldJoints::leave_out(const char* format, Values... values) noexcept {
    std::snprintf(left_out_, sizeof left_out_, format, values...);
    left_out_at_ = now();
}

} // namespace bf::middleware

// What messages of joint states have told of the joints of a diagram.
#pragma once

#include "bf/middleware/topic_robot.hpp"
#include "bf/middleware/turns.hpp"

#include <Eigen/Core>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace bf::middleware {

inline constexpr double longest_silence = 0.1; ///< s; older states are none
inline constexpr double never = -std::numeric_limits<double>::infinity();

/// In the diagram's order, whatever that of the messages, of which each may tell of some of the joints.
class ToldJoints {
  public:
    explicit ToldJoints(const std::vector<std::string>& joints);

    /// Forgets all of a run before.
    void clear();
    /// Leaves out what is no state. Stamps only go on where several programs tell, which are not equally far.
    void take(const JointStates& states, bool stamps_go_on);
    /// The time stands still there: no new state comes, and the newest one counts on.
    void stand_at(double stamp);

    const Eigen::VectorXd& position() const { return position_; }
    const Eigen::VectorXd& velocity() const { return velocity_; }
    const Eigen::VectorXd& effort() const { return effort_; }
    bool has_velocities() const { return has_velocity_.all(); }
    bool has_efforts() const { return has_effort_.all(); }
    double stamp() const { return stamp_; }           ///< of the newest state, s
    double since() const { return came_.minCoeff(); } ///< when that of all joints came, s
    /// Our number of each joint that the newest message names; nothing: it has others, or not all of ours.
    std::optional<std::vector<Eigen::Index>> order() const;

    bool has_all() const { return since() != never; }
    /// Why it has not, of messages that came on `topic` up to `within`.
    std::string what_is_missing(const std::string& topic, const std::string& within) const;
    /// Why what has come since the state of all joints is none; empty: nothing has.
    void say_left_out(toolbox::RobotConnection::ErrorText& text) const noexcept;

  private:
    template <class... Values> void leave_out(const char* format, Values... values) noexcept;

    const std::vector<std::string> joints_;
    std::map<std::string, Eigen::Index> ours_;
    std::vector<std::string> names_;   ///< of the newest message
    std::vector<Eigen::Index> places_; ///< our number of each of them; -1: none of ours
    Eigen::Index twice_ = -1;          ///< our joint that has two of those names; -1: none has
    char left_out_[120] = "";          ///< why a message was no state, or not of all joints that it names
    double left_out_at_ = never;       ///< when that was, s
    Eigen::VectorXd position_, velocity_, effort_, came_;
    Eigen::Array<bool, Eigen::Dynamic, 1> has_velocity_, has_effort_; ///< of each joint, so far
    std::vector<Turns> tellers_;                                      ///< of each joint
    double stamp_ = 0;
};

} // namespace bf::middleware

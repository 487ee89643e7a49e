// A robot of a running model as other programs drive it, whatever carries it: what `bf serve` runs.
#pragma once

#include "bf/middleware/robot_host.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace bf::middleware {

class ServedRobot {
  public:
    virtual ~ServedRobot() = default;

    /// Shows the robot, which has started and steps every `period` s, to others. Throws std::runtime_error,
    /// e.g. where somebody else serves one of that name.
    virtual void start(double period) = 0;
    /// Between the outputs and the updates of a step at that time of the robot: shows its state; all robots
    /// of a model are shown before any of them waits.
    virtual void show(double) noexcept {}
    /// Then waits where it waits, and gives the robot what was commanded.
    virtual void step(double time) noexcept = 0;
    /// While the model waits in the step of another of its robots: sees whether the controller ends.
    virtual void heed() noexcept {}
    /// From now on others may ask for the robot as it began: does somebody? Then reset() takes its joints
    /// back, and the model goes there before its next step.
    virtual void allow_reset() noexcept {}
    virtual bool wants_reset() const noexcept { return false; }
    virtual void reset() noexcept {}
    /// How users call it, such as "robot 'icub' in shared memory".
    virtual const std::string& name() const noexcept = 0;
    /// What happened since the last call, for people, oldest first; empty: nothing. From any one thread.
    virtual std::string take_news() = 0;
    /// How many controllers have gone, however they did.
    virtual int gone() const noexcept = 0;
};

/// Which robot is served, and how.
struct ServeRequest {
    std::string path; ///< of the block that provides the robot
    bool is_alone;    ///< the model has no other robot
    const toolbox::RobotDevice& device;
    toolbox::RobotConnection& robot; ///< both outlive what is served
    /// Of the options of the command, by their names without dashes; options that were not given are left
    /// out.
    std::map<std::string, std::vector<std::string>> options;
    HostOptions host;

    /// The value of an option, the last one that was given.
    std::string option(const std::string& name, const std::string& otherwise = {}) const {
        const auto found = options.find(name);
        return found == options.end() || found->second.empty() ? otherwise : found->second.back();
    }
};

/// Over a RobotHost: what its end carries, and its events told.
std::unique_ptr<ServedRobot> make_served_robot(std::string name, const ServeRequest& request,
                                               std::unique_ptr<RobotEnd> end);

/// A plugin whose middleware serves robots has this function, which may throw std::runtime_error:
///   extern "C" bf::middleware::ServedRobot* bf_serve_robot_v1(const bf::middleware::ServeRequest&);
/// `bf serve` finds it by a line of its table of ways (tools/src/ways_to_serve.cpp).
inline constexpr const char* serve_symbol = "bf_serve_robot_v1";

} // namespace bf::middleware

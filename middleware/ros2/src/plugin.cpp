// The plugin Ros2.
#include "bf/middleware/served_robot.hpp"
#include "bf/middleware/topic_robot_block.hpp"
#include "blocks.hpp"
#include "end.hpp"
#include "messages.hpp"
#include "names.hpp"
#include "parameters.hpp"
#include "rmw_choice.hpp"
#include "robot.hpp"
#include "types.hpp"

#include <cstdlib>

namespace bf::ros2 {

namespace {

class RobotBlock final : public middleware::TopicRobotBlock {
  public:
    explicit RobotBlock(const Arguments& arguments)
        : TopicRobotBlock(arguments, {"ROS 2", "use_sim_time", CommandTopics{}, name_rules}) {}

  private:
    std::unique_ptr<middleware::RobotTopics> make_topics() const override {
        return make_robot_topics({node, name_space, node_arguments(remap, is_clock)}, step_size > 0);
    }
};

} // namespace

} // namespace bf::ros2

extern "C" bf::middleware::ServedRobot* bf_serve_robot_v1(const bf::middleware::ServeRequest& request) {
    return bf::middleware::make_served_robot(
               request.path, request,
               bf::ros2::make_end({.name = "robot", .name_space = request.option("ros2"), .arguments = {}},
                                  {}, request.host.waits))
        .release();
}

/// What `bf deploy` packs: a node that is alone has opened all that runs open.
extern "C" const char* const* bf_deploy_v1() {
    static const std::string profile = bf::ros2::loopback_profile();
    static const char* const files[] = {profile.empty() ? nullptr : profile.c_str(), nullptr};
    setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", 1);
    namespace messages = bf::ros2::messages;
    bf::ros2::Node node({.name = "packed", .name_space = "/", .arguments = {}});
    node.open();
    int count = 0; // each type has a topic of its own
    for (const auto* type : {&messages::clock(), &messages::imu(), &messages::joint_state(),
                             &messages::numbers(), &messages::trajectory(), &messages::wrench()})
        node.advertise(*type, "packed_" + std::to_string(count++), {});
    const messages::Call calls[] = {messages::trigger(node, "packed_trigger", [](auto...) {}),
                                    messages::set_bool(node, "packed_bool", true, [](auto...) {})};
    node.close();
    // Encoders of types that Lifecycle and parameters have in their code, which ROS 2 opens in runs.
    for (const char* type : {"lifecycle_msgs/msg/State", "rcl_interfaces/msg/Parameter"})
        bf::ros2::MessageType::find(type);
    return files;
}

extern "C" bf::middleware::ServedParameters* bf_serve_parameters_v1(bf::middleware::ParameterSource& source,
                                                                    const std::string& where) {
    return bf::ros2::serve_parameters(source, {.name = "model", .name_space = where, .arguments = {}})
        .release();
}

extern "C" void bf_plugin_v1(bf::Library& library) {
    bf::ros2::give_rmw_choice_back();
    library.group("robot").add<bf::ros2::RobotBlock>(
        "Robot", "A robot behind joint states and the topics of ros2_control's controllers, in place of a "
                 "world: the robot that GetMeasurement, GetSensor and SetReferences in its subsystem and "
                 "below use. Positions, velocities and efforts are those of the joints that the messages "
                 "name, in any order, of one program or several; the age is that of the oldest. Command "
                 "messages have the joints in the order of `joints`, which the controllers are to have, too. "
                 "A thread of its own reads, and sends what was commanded; when the run ends, or has not "
                 "stepped for `silence` s, it sends zero efforts and velocities, and positions stay. Limits "
                 "are not known. With `step_size` the thread steps the robot instead, in lockstep with the "
                 "diagram, by commands and the service robot/step (std_srvs/srv/Trigger). Errors: no states, "
                 "or not of all joints, or another node that sends commands, within start_timeout; in a "
                 "step: the mode is refused where nobody listens to its topic; those of SharedMemory/Robot.");
    bf::ros2::add_network(library);
    bf::ros2::add_topics(library);
    bf::ros2::add_calls(library);
    bf::ros2::add_goals(library);
    bf::ros2::add_cameras(library);
    bf::ros2::add_transforms(library);
    bf::ros2::add_lifecycle(library);
}

#include "bf/middleware/topic_robot_block.hpp"

#include <utility>

namespace bf::middleware {

TopicRobotBlock::TopicRobotBlock(const Arguments& arguments, const TopicRobotKind& kind)
    : RemoteRobot(arguments), kind_(kind) {
    require_names_of(wrenches, "topic");
    require_names_of(imus, "topic");
    std::vector<std::string> problems;
    check_node(kind_.names, "node", node, name_space, remap, problems);
    const NameRule rule = kind_.names.topic;
    check_name(rule, "states", states, problems);
    for (const auto& [argument, topic] :
         {std::pair("effort", *effort), std::pair("velocity", *velocity), std::pair("position", *position),
          std::pair("trajectory", *trajectory)})
        if (!topic.empty()) check_name(rule, argument, topic, problems);
    for (const auto& [argument, sensors] : {std::pair("wrenches", *wrenches), std::pair("imus", *imus)})
        for (const auto& sensor : sensors)
            if (const auto equals = sensor.find('='); equals != std::string::npos)
                check_name(rule, argument, sensor.substr(equals + 1), problems);
    for (auto& text : problems) problem(std::move(text));
}

std::unique_ptr<RobotLink> TopicRobotBlock::make_link() const {
    const std::string name = std::string(kind_.name) + " robot";
    return make_threaded_link(
        name + " in the namespace " + *name_space,
        make_topic_robot(make_topics(), {.kind = name,
                                         .joints = joint_names(),
                                         .states = states,
                                         .commands = {effort, velocity, position, trajectory},
                                         .wrenches = wrenches,
                                         .imus = imus,
                                         .is_clock = is_clock,
                                         .patience = 0.8 * start_timeout, // so that it says why itself
                                         .step_size = step_size}),
        thread);
}

} // namespace bf::middleware

// The blocks of the plugin Ros2, by the files that have them.
#pragma once

#include "bf/core/registry.hpp"
#include "bf/toolbox/streams.hpp"
#include "node.hpp"

namespace bf::ros2 {

/// A node, for the blocks that publish and subscribe: resource of the subsystem around.
struct RosNode {
    static constexpr const char* resource = "ROS 2 node";
    using Live = Node;
    NodeOptions options;
    std::shared_ptr<Live> open() const { return std::make_shared<Node>(options); }
};

/// The arguments of a node as rcl takes them.
std::vector<std::string> node_arguments(const std::vector<std::string>& remap, bool use_sim_time);

/// Streams over a node that is open, which outlives them.
std::shared_ptr<toolbox::StreamConnection> streams_over(Node& node);

void add_topics(Library& library);
void add_calls(Library& library);
void add_cameras(Library& library);
void add_goals(Library& library);
void add_lifecycle(Library& library);
void add_transforms(Library& library);
void add_network(Library& library);

} // namespace bf::ros2

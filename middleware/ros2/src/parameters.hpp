// Parameters of a model as those of a node.
#pragma once

#include "bf/middleware/served_parameters.hpp"
#include "node.hpp"

#include <memory>

namespace bf::ros2 {

/// The services of rcl_interfaces and the topic /parameter_events, at a node of its own, whose thread may
/// wait for a step. The source outlives them.
std::unique_ptr<middleware::ServedParameters> serve_parameters(middleware::ParameterSource& source,
                                                               const NodeOptions& node);

} // namespace bf::ros2

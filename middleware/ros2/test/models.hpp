// Models around a node of ROS 2.
#pragma once

#include "patience.hpp"
#include "running.hpp"

#include <string>

namespace bf::ros2::test {

using middleware::test::expect_refusal_with, middleware::test::refusal_with, middleware::test::steps_until;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

inline std::string model(const std::string& blocks, const std::string& connections = "",
                         const std::string& inputs = "", const std::string& node = "") {
    return "model: m\nplugins: [Ros2, WholeBodyToolbox]\nstep: 0.01\n" +
           (inputs.empty() ? "" : "inputs: {" + inputs + "}\n") + "blocks:\n  node: {block: Ros2/Node" +
           node + "}\n" + blocks + (connections.empty() ? "" : "connections: {" + connections + "}\n");
}

} // namespace bf::ros2::test

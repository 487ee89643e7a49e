// Models around a node of ROS 2.
#pragma once

#include "running.hpp"

#include <functional>
#include <string>
#include <unistd.h>

namespace bf::ros2::test {

using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

inline std::string model(const std::string& blocks, const std::string& connections = "",
                         const std::string& inputs = "", const std::string& node = "") {
    return "model: m\nplugins: [Ros2, WholeBodyToolbox]\nstep: 0.01\n" +
           (inputs.empty() ? "" : "inputs: {" + inputs + "}\n") + "blocks:\n  node: {block: Ros2/Node" +
           node + "}\n" + blocks + (connections.empty() ? "" : "connections: {" + connections + "}\n");
}
/// Steps until it is so; false: it never was.
inline bool steps_until(Running& run, const std::function<bool()>& is_so) {
    for (int k = 0; k < 5000; ++k, usleep(1000)) {
        if (!run.step()) return false;
        if (is_so()) return true;
    }
    return false;
}

} // namespace bf::ros2::test

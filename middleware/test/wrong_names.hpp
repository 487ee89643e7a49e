// Names that are refused where a model is read, of middlewares that have nodes and topics.
#pragma once

#include "running.hpp"

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace bf::middleware::test {

/// Of ROS 1 or ROS 2, as `version` says. `model` has these blocks, and a node with what follows its type;
/// `names` are wrong ones, each with why it is.
inline void expect_wrong_names_are_refused(
    const std::string& version,
    const std::function<std::string(const std::string& blocks, const std::string& node)>& model,
    const std::vector<std::pair<std::string, std::string>>& names) {
    using toolbox::test::expect_contains;
    const auto refusal = [&](const std::string& blocks, const std::string& node = "") {
        return toolbox::test::refusal(model(blocks, node));
    };
    const std::string plugin = "Ros" + version, is_none = " is no name of ROS " + version + ": ",
                      robot = "  r: {block: " + plugin + "/Robot, joints: \"{'a'}\", period: 0.01";
    for (const auto& [name, why] : names) {
        const std::string its = "'" + name + "'", wrong = its + is_none + why;
        expect_contains(refusal("  p: {block: " + plugin + "/Publish, topic: " + its + "}\n"),
                        "p: argument 'topic': " + wrong);
        expect_contains(refusal("  s: {block: " + plugin + "/Subscribe, topic: " + its + "}\n"),
                        "s: argument 'topic': " + wrong);
        expect_contains(refusal("  c: {block: " + plugin + "/Call, service: " + its + "}\n"),
                        "c: argument 'service': " + wrong);
        expect_contains(refusal("", ", namespace: " + its), "node: argument 'namespace': " + wrong);
        for (const std::string argument :
             {"namespace", "states", "effort", "velocity", "position", "trajectory"})
            expect_contains(refusal(robot + ", " + argument + ": " + its + "}\n"),
                            "r: argument '" + argument + "': " + wrong);
        expect_contains(refusal(robot + ", imus: \"{'base=" + name + "'}\"}\n"),
                        "r: argument 'imus': " + wrong);
        expect_contains(refusal(robot + ", wrenches: \"{'foot=" + name + "'}\"}\n"),
                        "r: argument 'wrenches': " + wrong);
    }
    expect_contains(refusal("", ", name: a/b"), "node: argument 'name': 'a/b'" + is_none);
    expect_contains(refusal(robot + ", node: a/b}\n"), "r: argument 'node': 'a/b'" + is_none);
    expect_contains(refusal("", ", remap: \"{':='}\""),
                    "node: argument 'remap': ':=' is not given as from:=to");
    expect_contains(refusal(robot + ", remap: \"{':='}\"}\n"),
                    "r: argument 'remap': ':=' is not given as from:=to");
}

} // namespace bf::middleware::test

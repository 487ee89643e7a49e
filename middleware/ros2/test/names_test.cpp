// Names of topics, services, actions, namespaces and nodes, and the rules that replace them.
#include "models.hpp"
#include "names.hpp"
#include "wrong_names.hpp"

#include <gtest/gtest.h>

namespace bf::ros2::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;

} // namespace

// https://design.ros2.org/articles/topic_and_service_names.html
TEST(Ros2Names, AreThoseOfItsDesign) {
    struct Case {
        std::string name;
        bool is_topic, is_namespace, is_node;
    };
    for (const auto& [name, is_topic, is_namespace, is_node] :
         std::vector<Case>{{"a", true, true, true},
                           {"/a", true, true, false},
                           {"a/b", true, true, false},
                           {"/a/b_1", true, true, false},
                           {"~/a", true, false, false},
                           {"{node}/a", true, false, false},
                           {"a_", true, true, true},
                           {"_a", true, true, true},
                           {"", false, true, false},
                           {"/", false, true, false},
                           {"a//b", false, false, false},
                           {"/a/", false, false, false},
                           {"a b", false, false, false},
                           {"1a", false, false, false},
                           {"a/1b", false, false, false},
                           {"a~", false, false, false},
                           {"a-b", false, false, false},
                           {"{a", false, false, false}}) {
        EXPECT_EQ(name_rules.topic(name).empty(), is_topic) << name;
        EXPECT_EQ(name_rules.name_space(name).empty(), is_namespace) << name;
        EXPECT_EQ(name_rules.node(name).empty(), is_node) << name;
    }
}

TEST(Ros2Names, ReplaceOneNameByAnother) {
    for (const std::string rule :
         {"imu:=base/imu", "/a:=/b", "~/a:=b", "other:a:=b", "__ns:=/a", "rostopic://a:=b"})
        EXPECT_EQ(name_rules.remapping(rule), "") << rule;
    for (const std::string rule : {"", "a", "a=b", ":=", "a:=", ":=b", "a b:=c", "a:=b c", "a:=/b/", "1a:=b"})
        EXPECT_EQ(name_rules.remapping(rule),
                  "'" + rule + "' is not given as from:=to, such as imu:=base/imu");
}

TEST(Ros2Names, AreRefusedWhereTheModelIsReadByBlockAndArgument) {
    const std::vector<std::string> wrong_ones{"a//b", "/a/", "a b", "1a"};
    std::vector<std::pair<std::string, std::string>> names; // rcl says why
    for (const auto& name : wrong_ones) names.emplace_back(name, "");
    middleware::test::expect_wrong_names_are_refused(
        "2", [](const std::string& blocks, const std::string& node) { return model(blocks, "", "", node); },
        names);
    for (const auto& name : wrong_ones) {
        const std::string its = "'" + name + "'", wrong = its + " is no name of ROS 2: ";
        expect_contains(refusal(model("  g: {block: Ros2/SendGoal, action: " + its + "}\n")),
                        "g: argument 'action': " + wrong);
        expect_contains(refusal(model("  c: {block: Ros2/PublishCamera, topic: " + its + "}\n")),
                        "c: argument 'topic': " + wrong);
    }
}

} // namespace bf::ros2::test

// Names of topics, services, namespaces, nodes and frames, and the rules that replace them.
#include "master.hpp"
#include "names.hpp"
#include "wrong_names.hpp"

namespace bf::ros1::test {
namespace {

using toolbox::test::expect_contains;
using toolbox::test::refusal;

const std::vector<std::string> names{"a",      "/a",  "a/b",  "/a/b_1", "A1",  "a/1b", "a_",  "~a",   "~",
                                     "~/a",    "",    "/",    "a//b",   "//a", "/a/",  "a/",  "a b",  " a",
                                     "a ",     "1a",  "/1/a", "_a",     "/_a", "a-b",  "a.b", "a~b",  "a:=b",
                                     "\u00e4", "a\n", "{a}",  "a{b}",   "@a",  "[a",   "`a",  "a\t/b"};

bool is_topic(const std::string& name) { return name_rules.topic(name).empty(); }
bool is_node(const std::string& name) { return name_rules.node(name).empty(); }

std::string model(const std::string& blocks, const std::string& node) {
    return "model: m\nplugins: [Ros1, WholeBodyToolbox]\nstep: 0.01\nblocks:\n  node: {block: Ros1/Node" +
           node + "}\n" + blocks;
}

} // namespace

TEST(Ros1Names, AreThoseThatRosgraphKnowsWithOneSpellingEach) {
    if (!Peer::is_there()) GTEST_SKIP() << "there is no rosgraph";
    std::vector<std::string> words{"legal"};
    words.insert(words.end(), names.begin(), names.end());
    Peer peer(words);
    for (const auto& name : names) {
        const std::string legal = peer.line();
        const bool is_other_spelling = name.ends_with('/') || name.empty(),
                   is_private = name.starts_with('~');
        EXPECT_EQ(is_topic(name), legal.starts_with('1') && !is_private && !is_other_spelling) << name;
        EXPECT_EQ(is_node(name), legal.ends_with('1')) << name;
        const bool is_namespace =
            name.empty() || name == "/" || (legal.starts_with('1') && !is_other_spelling);
        EXPECT_EQ(name_rules.name_space(name).empty(), is_namespace) << name;
    }
}

TEST(Ros1Names, ReplaceOneNameByAnother) {
    for (const std::string rule :
         {"imu:=base/imu", "/a:=/b", "~a:=b", "a:=~b", "_rate:=5", "__log:=/tmp/a b", "a:=b1"})
        EXPECT_EQ(name_rules.remapping(rule), "") << rule;
    for (const std::string rule : {"", "a", "a=b", ":=", "a:=", ":=b"})
        expect_contains(name_rules.remapping(rule),
                        "'" + rule + "' is not given as from:=to, such as imu:=base/imu");
    for (const auto& [rule, name] :
         {std::pair("a b:=c", "a b"), std::pair("a:=b c", "b c"), std::pair("a//b:=c", "a//b"),
          std::pair("a:=/b/", "/b/"), std::pair("1a:=b", "1a"), std::pair("a:=b:=c", "b:=c")})
        expect_contains(name_rules.remapping(rule), "'" + std::string(name) + "' is no name of ROS 1: ");
}

TEST(Ros1Names, AreRefusedWhereTheModelIsReadByBlockAndArgument) {
    middleware::test::expect_wrong_names_are_refused("1", model,
                                                     {{"a//b", "it has a part without letters"},
                                                      {"/a/", "it has a part without letters"},
                                                      {"a b", "it has more than letters, digits and '_'"},
                                                      {"1a", "it does not begin with a letter"}});
    for (const std::string frames : {"frame_id: /map", "children: \"{'base', '/map'}\""})
        expect_contains(refusal(model("  t: {block: Ros1/PublishTransforms, " + frames + "}\n", "")),
                        "t: the frame '/map' begins with '/', as frames of tf2 do not; leave it out");
}

} // namespace bf::ros1::test

#include "command.hpp"

namespace bf::tools {

namespace {

class Reference : public Command {};

TEST_F(Reference, PagesEqualWhatTheCommandPrints) {
    const auto update = shell("'" BF_SOURCE_DIRECTORY "/scripts/update-reference' '" BF_PROGRAM "' .");
    ASSERT_EQ(update.code, 0) << update.err;
    for (const std::string page :
         {"standard.md", "whole_body_toolbox.md", "whole_body_cameras.md", "shared_memory.md", "udp.md",
          "yarp.md", "ros1.md", "ros2.md", "fmi.md", "command.md"}) {
        if (!exists(page)) continue; // of a plugin that is not built here
        std::ostringstream committed;
        committed << std::ifstream(BF_SOURCE_DIRECTORY "/docs/reference/" + page).rdbuf();
        EXPECT_TRUE(committed.str() == read(page))
            << "docs/reference/" << page << " is out of date: run scripts/update-reference and commit it\n"
            << shell("diff '" BF_SOURCE_DIRECTORY "/docs/reference/" + page + "' " + page + " | head -20")
                   .out;
    }
}

TEST_F(Reference, PagesHoldEveryVerbAndEveryBlock) {
    ASSERT_EQ(shell("'" BF_SOURCE_DIRECTORY "/scripts/update-reference' '" BF_PROGRAM "' .").code, 0);
    for (const std::string verb : {"run", "check", "describe", "plot", "film", "export", "deploy", "doctor"})
        EXPECT_CONTAINS(read("command.md"), "\n## bf " + verb + "\n");
    const auto blocks = nlohmann::json::parse(bf("describe --json standard").out);
    EXPECT_GT(blocks.size(), 50u);
    for (const auto& block : blocks) {
        EXPECT_CONTAINS(read("standard.md"), "\n### " + block["name"].get<std::string>() + "\n");
        for (const auto& q : block["quantities"])
            EXPECT_CONTAINS(read("standard.md"), "| `" + q["name"].get<std::string>() + "` |");
    }
}

} // namespace

} // namespace bf::tools

// Model files of several people, merged by git.
#include "bf/base/files.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"

#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bf::formats {
namespace {

using namespace model;
namespace fs = std::filesystem;
namespace op = model::operations;

constexpr const char* base = "model: m\n"
                             "blocks:\n"
                             "  reference: {block: Constant, value: 1}\n"
                             "  controller:\n"
                             "    inputs: [error]\n"
                             "    outputs: [force]\n"
                             "    blocks:\n"
                             "      gain: {block: Gain, K: 2}\n"
                             "    connections:\n"
                             "      error: gain\n"
                             "      gain: force\n"
                             "  plant: {block: TransferFunction, numerator: 1, denominator: [1 1]}\n"
                             "connections:\n"
                             "  reference: controller.error\n"
                             "  controller.force: plant\n"
                             "layout:\n"
                             "  blocks:\n"
                             "    reference: {x: 0, y: 0}\n"
                             "    controller: {x: 100, y: 0}\n"
                             "    plant: {x: 200, y: 0}\n"
                             "    controller.gain: {x: 0, y: 0}\n";

class Merge : public ::testing::Test {
  protected:
    void SetUp() override {
        if (std::system("git --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "git is missing";
        fs::create_directories(folder);
    }
    void TearDown() override { fs::remove_all(folder); }

    static std::string edited(const std::vector<Operation>& operations) {
        Model model = read_yaml_text(base);
        for (const auto& operation : operations) edit(model, operation);
        return write_yaml(model);
    }
    /// What git makes of the work of two people; how many conflicts it leaves.
    int merge(const std::vector<Operation>& ours, const std::vector<Operation>& theirs) {
        std::ofstream(folder / "base.yaml") << base;
        std::ofstream(folder / "m.yaml") << edited(ours);
        std::ofstream(folder / "theirs.yaml") << edited(theirs);
        const int status =
            std::system(("cd '" + folder.string() +
                         "' && git merge-file -L ours -L base -L theirs m.yaml base.yaml theirs.yaml")
                            .c_str());
        return WEXITSTATUS(status);
    }

    const fs::path folder = fs::temp_directory_path() / ("bf_merge_" + std::to_string(::getpid()));
};

TEST_F(Merge, OfEditsOfDifferentBlocksHasNoConflict) {
    ASSERT_EQ(merge({op::Move{"reference", {0, 50}}, op::Set{"reference", "value", "3"},
                     op::Add{"", {.name = "start", .type = "Constant"}, 0, Point{0, 200}}},
                    {op::Move{"plant", {300, 0}}, op::Set{"controller.gain", "K", "5"},
                     op::Add{"controller", {.name = "limit", .type = "Saturate"}, {}, {}}}),
              0);
    const Model merged = read_yaml(folder / "m.yaml");
    EXPECT_EQ(find(merged, "reference")->find_setting("value")->value.text, "3");
    EXPECT_EQ(find(merged, "controller.gain")->find_setting("K")->value.text, "5");
    EXPECT_TRUE(find(merged, "start") && find(merged, "controller.limit"));
    EXPECT_EQ(merged.layout.blocks[0].at, (Point{0, 50}));
    EXPECT_EQ(merged.layout.blocks[2].at, (Point{300, 0}));
}

TEST_F(Merge, OfTheSameBlockLeavesOneLineOfEachAndIsExplained) {
    ASSERT_EQ(merge({op::Move{"plant", {250, 0}}}, {op::Move{"plant", {300, 0}}}), 1);
    const std::string text = read_text_file(folder / "m.yaml");
    EXPECT_NE(
        text.find(
            "<<<<<<< ours\n    plant: {x: 250, y: 0}\n=======\n    plant: {x: 300, y: 0}\n>>>>>>> theirs\n"),
        std::string::npos)
        << text;
    try {
        read_yaml(folder / "m.yaml");
        ADD_FAILURE() << "it was read";
    } catch (const Errors& errors) {
        ASSERT_EQ(errors.diagnostics().size(), 1u);
        const Diagnostic& wrong = errors.diagnostics()[0];
        EXPECT_EQ(wrong.where.line, 20);
        EXPECT_EQ(wrong.message,
                  "a conflict of a merge stands here, between '<<<<<<<', '=======' and '>>>>>>>'");
        EXPECT_EQ(wrong.remedy, "keep the lines of one side, or of both, and remove these three");
    }
}

TEST(Conflicts, AreNotSeenInTexts) {
    EXPECT_NO_THROW(read_yaml_text("model: m\ndoc: |\n  <<<<<<< ours\n  is what git writes\n"));
}

} // namespace
} // namespace bf::formats

#include "bf/service/project.hpp"

#include "bf/base/files.hpp"
#include "bf/model/edit.hpp"
#include "folder.hpp"

#include <atomic>
#include <chrono>
#include <fstream>
#include <future>
#include <gtest/gtest.h>
#include <thread>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
namespace op = bf::model::operations;
using bf::service::Project;

/// A folder of its own for each test.
class ProjectTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = bf::service::test_folder();
        write("loop.yaml", loop);
        write("law.yaml", law);
    }
    void write(const std::string& name, const std::string& text) const {
        bf::service::write_beside(folder_ / name, text);
    }
    std::string read(const std::string& name) const { return bf::read_text_file(folder_ / name); }
    fs::path file(const std::string& name = "loop.yaml") const { return folder_ / name; }

    static constexpr const char* loop = "# A loop.\n"
                                        "model: loop\n"
                                        "step: 0.1   # s\n"
                                        "blocks:\n"
                                        "  reference: {block: Constant, value: 1}\n"
                                        "  law: {file: law.yaml}   # the controller\n"
                                        "connections:\n"
                                        "  reference: law.error\n";
    static constexpr const char* law = "model: law\n"
                                       "inputs: [error]\n"
                                       "outputs: [force]\n"
                                       "blocks:\n"
                                       "  gain: {block: Gain, K: 2}   # N/m\n"
                                       "connections:\n"
                                       "  error: gain\n"
                                       "  gain: force\n";

  private:
    fs::path folder_;
};

TEST_F(ProjectTest, WritesAnEditIntoTheFileAndUndoGivesItsBytesBack) {
    Project project(file());
    project.edit(op::Rename{"reference", "wanted"});
    EXPECT_NE(read("loop.yaml").find("wanted: law.error"), std::string::npos);
    EXPECT_NE(read("loop.yaml").find("# the controller"), std::string::npos);
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_FALSE(project.undo());
    EXPECT_TRUE(project.redo());
    EXPECT_NE(read("loop.yaml").find("wanted: law.error"), std::string::npos);
}

TEST_F(ProjectTest, EditsUnderAReferenceGoToItsFile) {
    Project project(file());
    project.edit(op::Set{"law.gain", "K", "3"});
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_NE(read("law.yaml").find("gain: {block: Gain, K: 3}   # N/m"), std::string::npos);
    EXPECT_EQ(bf::model::find(project.model(), "law.gain")->find_setting("K")->value.text, "3");
    project.edit(op::Move{"law.gain", {40, 20}});
    project.edit(op::Move{"law", {80, 20}}); // the block itself stands in the file around it
    EXPECT_NE(read("law.yaml").find("layout:"), std::string::npos);
    EXPECT_NE(read("loop.yaml").find("law: {x: 80, y: 20}"), std::string::npos) << read("loop.yaml");
    while (project.undo()) {
    }
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_EQ(read("law.yaml"), law);
}

TEST_F(ProjectTest, TellsWhichFileHoldsABlock) {
    const Project project(file());
    EXPECT_EQ(project.place_of("law.gain"), std::pair(file("law.yaml"), std::string("gain")));
    EXPECT_EQ(project.place_of("law"), std::pair(file(), std::string("law")));
}

TEST_F(ProjectTest, ABatchOfSeveralFilesIsRefusedAndChangesNothing) {
    Project project(file());
    op::Batch batch;
    batch.operations = {op::Set{"law.gain", "K", "3"}, op::Set{"reference", "value", "2"}};
    EXPECT_THROW(project.edit(batch), bf::model::Errors);
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_EQ(read("law.yaml"), law);
}

TEST_F(ProjectTest, TakesOverWhatAnotherProgramWritesAsAnEditThatCanBeUndone) {
    Project project(file());
    project.edit(op::Set{"reference", "value", "5"});
    EXPECT_FALSE(project.synchronise());
    std::string text = read("loop.yaml");
    text.replace(text.find("0.1"), 3, "0.2");
    write("loop.yaml", text);
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(project.model().step->text, "0.2");
    project.edit(op::Set{"reference", "value", "6"});
    EXPECT_NE(read("loop.yaml").find("step: 0.2   # s"), std::string::npos);
    EXPECT_NE(read("loop.yaml").find("value: 6"), std::string::npos);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("loop.yaml"), loop);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(project.redo());
    EXPECT_NE(read("loop.yaml").find("step: 0.2   # s"), std::string::npos);
}

TEST_F(ProjectTest, TakesOverAReferencedFile) {
    Project project(file());
    std::string text = law;
    text.replace(text.find("K: 2"), 4, "K: 7");
    write("law.yaml", text);
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(bf::model::find(project.model(), "law.gain")->find_setting("K")->value.text, "7");
}

TEST_F(ProjectTest, AFileThatCannotBeReadIsSaidAndTheLastGoodModelStays) {
    Project project(file());
    write("loop.yaml", "model: [");
    EXPECT_TRUE(project.synchronise());
    EXPECT_NE(project.failure().find("loop.yaml:1"), std::string::npos) << project.failure();
    EXPECT_TRUE(bf::model::find(project.model(), "law"));
    write("loop.yaml", loop);
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(project.failure(), "");
}

TEST_F(ProjectTest, NeverWritesOverWhatAnotherProgramWroteEvenIfItIsNoModel) {
    Project project(file());
    const std::string foreign = std::string(loop) + "extra: [unclosed\n";
    write("loop.yaml", foreign);
    EXPECT_TRUE(project.synchronise());
    EXPECT_THROW(project.edit(op::Set{"reference", "value", "5"}), bf::model::Errors);
    EXPECT_EQ(read("loop.yaml"), foreign);
    write("loop.yaml", loop);
    project.edit(op::Set{"reference", "value", "5"});
    EXPECT_NE(read("loop.yaml").find("value: 5"), std::string::npos);
}

TEST_F(ProjectTest, TakesATextAsAnEditThatWritesItsBytesAndCanBeUndone) {
    Project project(file());
    std::string text = loop;
    text.replace(text.find("value: 1}"), 9, "value: 9}   # as typed");
    EXPECT_TRUE(project.rewrite(file(), loop, text));
    EXPECT_EQ(read("loop.yaml"), text);
    EXPECT_EQ(bf::model::find(project.model(), "reference")->find_setting("value")->value.text, "9");
    project.edit(op::Set{"reference", "value", "7"});
    EXPECT_NE(read("loop.yaml").find("value: 7}   # as typed"), std::string::npos);
    EXPECT_EQ(project.text_in(file()), read("loop.yaml"));
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("loop.yaml"), text);
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_TRUE(project.redo());
    EXPECT_EQ(read("loop.yaml"), text);
}

TEST_F(ProjectTest, TakesTheTextOfAFileThatTheModelRefersTo) {
    Project project(file());
    std::string text = law;
    text.replace(text.find("K: 2"), 4, "K: 7");
    EXPECT_TRUE(project.rewrite(file("law.yaml"), law, text));
    EXPECT_EQ(read("law.yaml"), text);
    EXPECT_EQ(bf::model::find(project.model(), "law.gain")->find_setting("K")->value.text, "7");
    EXPECT_THROW(project.rewrite(file("other.yaml"), "", law), bf::model::Errors);
    EXPECT_FALSE(fs::exists(file("other.yaml")));
}

TEST_F(ProjectTest, ATextThatIsNoModelOrBreaksAnotherFileIsRefusedAndNothingIsWritten) {
    Project project(file());
    for (const std::string& text :
         {std::string("model: ["), std::string(loop) + "  nothing: law.error\n", std::string("\xff")})
        try {
            static_cast<void>(project.rewrite(file(), loop, text));
            ADD_FAILURE() << text;
        } catch (const bf::model::Errors& errors) {
            EXPECT_GT(errors.diagnostics()[0].where.line, 0) << errors.what();
        }
    std::string renamed = law;
    for (std::size_t at; (at = renamed.find("error")) != std::string::npos;) renamed.replace(at, 5, "e");
    EXPECT_THROW(project.rewrite(file("law.yaml"), law, renamed),
                 bf::model::Errors); // loop.yaml uses 'error'
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_EQ(read("law.yaml"), law);
    EXPECT_FALSE(project.can_undo());
    EXPECT_EQ(bf::model::find(project.model(), "law.gain")->find_setting("K")->value.text, "2");
}

TEST_F(ProjectTest, HasNothingToUndoOfAnEditThatChangesNothing) {
    Project project(file());
    project.edit(op::Set{"reference", "value", "5"});
    project.edit(op::Set{"reference", "value", "5"});
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_FALSE(project.can_undo());
}

TEST_F(ProjectTest, ATextIsNotTakenWhereTheFileHoldsAnotherOneThanItsAuthorSaw) {
    Project project(file());
    std::string text = loop, other = loop;
    text.replace(text.find("value: 1"), 8, "value: 9");
    other.replace(other.find("0.1"), 3, "0.2");
    write("loop.yaml", other);
    EXPECT_FALSE(project.rewrite(file(), loop, text));
    EXPECT_EQ(read("loop.yaml"), other);
    project.edit(op::Set{"reference", "value", "5"});
    EXPECT_FALSE(project.rewrite(file(), other, text));
    EXPECT_NE(read("loop.yaml").find("value: 5"), std::string::npos);
}

TEST_F(ProjectTest, ATextMendsAFileThatAnotherProgramBroke) {
    Project project(file());
    const std::string foreign = std::string(loop) + "extra: [unclosed\n";
    write("loop.yaml", foreign);
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(project.text_in(file()), foreign);
    EXPECT_TRUE(project.rewrite(file(), foreign, loop)); // as it was before
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_EQ(project.failure(), "");
    EXPECT_FALSE(project.synchronise());
}

TEST_F(ProjectTest, RefusesAnEditThatBreaksAFileThatRefersToThisOne) {
    Project project(file());
    EXPECT_THROW(project.edit(op::Remove{"law.error"}), bf::model::Errors);
    EXPECT_EQ(read("law.yaml"), law);
    EXPECT_FALSE(project.can_undo());
    project.edit(op::Remove{"law.force"}); // which nothing uses
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("law.yaml"), law);
}

TEST_F(ProjectTest, ARenamedPortIsFollowedByAllFilesThatReferToItsFileAsOneEdit) {
    const std::string rig = "model: rig   # two loops\n"
                            "step: 0.1\n"
                            "blocks:\n"
                            "  left: {file: loop.yaml}\n"
                            "record: [left.law.force, left.law.gain]   # what matters\n";
    const std::string other = "# another one\n"
                              "model: other\n"
                              "step: 0.1\n"
                              "blocks:\n"
                              "  one: {block: Constant, value: 1}\n"
                              "  a: {file: ../law.yaml}\n"
                              "connections: {one: a.error}\n"
                              "plots:\n"
                              "  Force: [a.force]\n";
    write("rig.yaml", rig);
    fs::create_directory(file("more"));
    write("more/other.yaml", other);
    write("more/broken.yaml", "model: [ law.yaml");
    const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
        return text.replace(text.find(from), from.size(), to);
    };
    Project project(file());
    project.edit(op::Rename{"law.error", "e"});
    EXPECT_EQ(read("loop.yaml"), replaced(loop, "law.error", "law.e"));
    EXPECT_EQ(read("law.yaml"), replaced(replaced(law, "[error]", "[e]"), "error: gain", "e: gain"));
    EXPECT_EQ(read("more/other.yaml"), replaced(other, "a.error", "a.e"));
    EXPECT_EQ(read("rig.yaml"), rig);
    project.edit(op::Rename{"law.force", "f"});
    EXPECT_EQ(read("more/other.yaml"), replaced(replaced(other, "a.error", "a.e"), "a.force", "a.f"));
    EXPECT_EQ(read("rig.yaml"), replaced(rig, "law.force", "law.f"));
    project.edit(op::Rename{"law.gain", "K"});
    EXPECT_EQ(read("rig.yaml"), replaced(replaced(rig, "law.force", "law.f"), "law.gain", "law.K"));
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(project.undo());
    EXPECT_FALSE(project.can_undo());
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_EQ(read("law.yaml"), law);
    EXPECT_EQ(read("more/other.yaml"), other);
    EXPECT_EQ(read("rig.yaml"), rig);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(project.redo());
    EXPECT_EQ(read("rig.yaml"), replaced(replaced(rig, "law.force", "law.f"), "law.gain", "law.K"));
}

TEST_F(ProjectTest, AModelThatWasDeletedIsWrittenAgainByTheNextEdit) {
    Project project(file());
    fs::remove(file());
    EXPECT_TRUE(project.synchronise());
    EXPECT_NE(project.failure(), "");
    project.edit(op::Set{"reference", "value", "5"});
    EXPECT_EQ(project.failure(), "");
    EXPECT_NE(read("loop.yaml").find("value: 5"), std::string::npos);
}

TEST_F(ProjectTest, WritesNothingOutsideOfTheFolderOfTheOpenedModel) {
    write("../outside.yaml", law);
    std::string text = loop;
    text.replace(text.find("law.yaml"), 8, "../outside.yaml");
    write("loop.yaml", text);
    Project project(file());
    EXPECT_THROW(project.edit(op::Set{"law.gain", "K", "3"}), bf::model::Errors);
    EXPECT_EQ(read("../outside.yaml"), law);
    project.edit(op::Group{"", {"reference"}, "source"});
    EXPECT_THROW(project.edit(op::Extract{"source", "../source.yaml"}), bf::model::Errors);
    EXPECT_FALSE(std::filesystem::exists(file("../source.yaml")));
    std::filesystem::create_directory_symlink(file().parent_path().parent_path(), file("way_out"));
    EXPECT_THROW(project.edit(op::Extract{"source", "way_out/source.yaml"}), bf::model::Errors);
}

TEST_F(ProjectTest, ExtractingMakesAFileAndNeverWritesOverOne) {
    Project project(file());
    project.edit(op::Group{"", {"reference"}, "source"});
    EXPECT_THROW(project.edit(op::Extract{"source", "law.yaml"}), bf::model::Errors);
    EXPECT_EQ(read("law.yaml"), law);
    const std::string before = read("loop.yaml");
    EXPECT_THROW(project.edit(op::Extract{"source", "missing/source.yaml"}), bf::model::Errors);
    EXPECT_EQ(read("loop.yaml"), before);
    EXPECT_TRUE(project.model().root.find_block("source")->system);
    try {
        project.edit(op::Extract{"source", ""});
        ADD_FAILURE() << "a file without a name was made";
    } catch (const bf::model::Errors& error) {
        EXPECT_EQ(error.diagnostics()[0].message, "there is no file to extract to");
        EXPECT_EQ(error.diagnostics()[0].remedy, "give `file`");
    }
    project.edit(op::Extract{"source", "source.yaml"});
    EXPECT_NE(read("source.yaml").find("reference: {block: Constant, value: 1}"), std::string::npos);
    project.edit(op::Set{"source.reference", "value", "4"});
    EXPECT_NE(read("source.yaml").find("value: 4"), std::string::npos);
}

TEST_F(ProjectTest, UndoingAnExtractTakesItsFileAwayAndRedoingMakesItAgain) {
    write("loop.yaml", "model: loop\nblocks:\n  part:\n    blocks:\n      one: {block: Constant}\n");
    Project project(file());
    project.edit(op::Extract{"part", "part.yaml"});
    const std::string made = read("part.yaml");
    EXPECT_TRUE(project.undo());
    EXPECT_FALSE(fs::exists(file("part.yaml")));
    EXPECT_TRUE(project.redo());
    EXPECT_EQ(read("part.yaml"), made);
    project.edit(op::Set{"part.one", "value", "2"});
    EXPECT_TRUE(project.undo());
    EXPECT_TRUE(project.undo());
    EXPECT_FALSE(fs::exists(file("part.yaml"))) << "it is as it was made";
    write("part.yaml", "model: mine\n");
    EXPECT_THROW(project.redo(), bf::model::Errors);
    EXPECT_EQ(read("part.yaml"), "model: mine\n");
}

TEST_F(ProjectTest, UndoingAnExtractKeepsAFileThatAnotherModelRefersTo) {
    write("loop.yaml", "model: loop\nblocks:\n  part: {blocks: {one: {block: Constant}}}\n");
    Project project(file());
    project.edit(op::Extract{"part", "part.yaml"});
    write("other.yaml", "model: other\nblocks:\n  p: {file: part.yaml}\n");
    const std::string part = read("part.yaml"), after = read("loop.yaml");
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(read("part.yaml"), part);
    EXPECT_TRUE(project.redo());
    EXPECT_EQ(read("loop.yaml"), after);
    EXPECT_EQ(read("part.yaml"), part);
}

TEST_F(ProjectTest, ARenamedVariableIsFollowedByAllWhoGiveItAValue) {
    write("law.yaml", "model: law\nvariables: {k: 2}\nblocks:\n  gain: {block: Gain, K: k}\n");
    write("loop.yaml", "model: loop\nblocks:\n  one: {file: law.yaml, with: {k: 3}}\n"
                       "  two: {file: law.yaml, with: {k: 4}}   # the other\n");
    write("aside.yaml", "model: aside\nblocks:\n  law: {file: law.yaml, with: {k: 5}}\n");
    Project project(file());
    project.edit(op::RenameVariable{"one", "k", "stiffness"});
    EXPECT_EQ(read("law.yaml"),
              "model: law\nvariables: {stiffness: 2}\nblocks:\n  gain: {block: Gain, K: stiffness}\n");
    EXPECT_EQ(read("loop.yaml"), "model: loop\nblocks:\n  one: {file: law.yaml, with: {stiffness: 3}}\n"
                                 "  two: {file: law.yaml, with: {stiffness: 4}}   # the other\n");
    EXPECT_EQ(read("aside.yaml"), "model: aside\nblocks:\n  law: {file: law.yaml, with: {stiffness: 5}}\n");
    EXPECT_TRUE(project.undo());
    EXPECT_NE(read("aside.yaml").find("{k: 5}"), std::string::npos);
}

/// A disk that writes nothing until it is let go.
class SlowDisk {
  public:
    SlowDisk() { hold(); }
    void hold() {
        released_ = std::make_unique<std::promise<void>>();
        worker.post([wait = released_->get_future().share()] { wait.wait(); });
    }
    void let_go() {
        released_->set_value();
        worker.call([] {});
    }
    bf::service::Worker worker;
    std::atomic<int> written = 0;
    std::function<void()> count = [this] { ++written; };

  private:
    std::unique_ptr<std::promise<void>> released_;
};

TEST_F(ProjectTest, AnEditWaitsForNoDiskAndSaysWhenItIsThere) {
    SlowDisk disk;
    Project project(file(), &disk.worker, disk.count);
    project.edit(op::Rename{"reference", "wanted"});
    EXPECT_NE(bf::model::find(project.model(), "wanted"), nullptr);
    EXPECT_FALSE(project.is_saved());
    project.edit(op::Rename{"wanted", "again"}); // follows the one that is on its way
    project.edit(op::Rename{"again", "last"});
    EXPECT_EQ(read("loop.yaml"), loop);
    EXPECT_FALSE(project.synchronise()) << "nobody else has written";
    disk.let_go();
    project.note_written();
    disk.worker.call([] {});
    project.note_written();
    EXPECT_TRUE(project.is_saved());
    EXPECT_EQ(disk.written, 2);
    EXPECT_NE(read("loop.yaml").find("last: law.error"), std::string::npos);
    EXPECT_FALSE(project.synchronise());
    while (project.undo()) {
    }
    disk.worker.call([] {});
    project.note_written();
    disk.worker.call([] {});
    project.note_written();
    EXPECT_EQ(read("loop.yaml"), loop);
}

TEST_F(ProjectTest, WhatAnotherProgramWroteInTheMeantimeIsNotWrittenOver) {
    SlowDisk disk;
    Project project(file(), &disk.worker, disk.count);
    project.edit(op::Rename{"reference", "wanted"});
    std::string other = loop;
    other.replace(other.find("value: 1"), 8, "value: 2");
    write("loop.yaml", other);
    EXPECT_FALSE(project.synchronise()) << "ours is on its way";
    disk.let_go();
    project.note_written();
    EXPECT_EQ(read("loop.yaml"), other);
    EXPECT_TRUE(project.synchronise());
    ASSERT_NE(bf::model::find(project.model(), "wanted"), nullptr) << "ours is made again";
    EXPECT_EQ(bf::model::find(project.model(), "wanted")->find_setting("value")->value.text, "2");
    disk.worker.call([] {});
    project.note_written();
    EXPECT_TRUE(project.is_saved());
    EXPECT_NE(read("loop.yaml").find("wanted: {block: Constant, value: 2}"), std::string::npos);
    EXPECT_TRUE(project.undo());
    EXPECT_TRUE(project.undo()) << "theirs was an edit";
    EXPECT_EQ(bf::model::find(project.model(), "wanted")->find_setting("value")->value.text, "1");
}

TEST_F(ProjectTest, NothingIsLostThatIsOnItsWayWhenTheProgramEnds) {
    SlowDisk disk;
    std::thread later;
    {
        Project project(file(), &disk.worker, disk.count);
        project.edit(op::Rename{"reference", "wanted"});
        project.edit(op::Set{"law.gain", "K", "7"});
        later = std::thread([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            disk.let_go();
        });
    }
    later.join();
    EXPECT_NE(read("loop.yaml").find("wanted: law.error"), std::string::npos);
    EXPECT_NE(read("law.yaml").find("K: 7"), std::string::npos);
}

TEST_F(ProjectTest, SaysAtTheEndWhichFilesAreWithoutTheLastEdits) {
    Project project(file());
    project.edit(op::Rename{"reference", "wanted"});
    EXPECT_EQ(project.unsaved(), "");
    fs::remove_all(file().parent_path());
    project.edit(op::Set{"law.gain", "K", "7"});
    EXPECT_EQ(project.unsaved().find(file("law.yaml").string() + " is without the last edits: cannot "), 0U)
        << project.unsaved();
    fs::create_directory(file().parent_path());
    EXPECT_EQ(project.unsaved(), "");
    EXPECT_NE(read("law.yaml").find("K: 7"), std::string::npos);
}

TEST_F(ProjectTest, ADiskThatRefusesIsAskedAgain) {
    SlowDisk disk;
    Project project(file(), &disk.worker, disk.count);
    fs::permissions(file(), fs::perms::owner_read);
    if (::access(file().c_str(), W_OK) == 0) GTEST_SKIP() << "this user may write everything";
    disk.let_go();
    project.edit(op::Rename{"reference", "wanted"});
    disk.worker.call([] {});
    project.note_written();
    EXPECT_FALSE(project.is_saved());
    EXPECT_NE(project.failure().find("cannot write"), std::string::npos);
    fs::permissions(file(), fs::perms::owner_all);
    static_cast<void>(project.synchronise());
    disk.worker.call([] {});
    project.note_written();
    static_cast<void>(project.synchronise());
    disk.worker.call([] {});
    project.note_written();
    EXPECT_TRUE(project.is_saved());
}

} // namespace

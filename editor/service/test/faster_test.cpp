// What another program writes at the very moment at which an edit is put into the file.
#include "bf/base/files.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "bf/service/project.hpp"
#include "folder.hpp"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <sys/syscall.h>
#include <unistd.h>
#include <vector>

namespace {

/// Runs when a file is put in its place; a number other than 0 is the error that comes of it.
std::function<int()> at_the_moment;

} // namespace

/// Stands in this program for the one of the C library.
extern "C" int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                         unsigned flags) noexcept {
    const auto happens = at_the_moment;
    const int error = happens ? happens() : 0;
    if (error == 0)
        return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
    errno = error;
    return -1;
}

namespace {

namespace fs = std::filesystem;
namespace op = bf::model::operations;
using bf::service::Project;

class FasterTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder = bf::service::test_folder();
        file = folder / "m.yaml";
        write_in_place(first);
    }
    void TearDown() override { at_the_moment = {}; }

    void write_in_place(const std::string& text) const { std::ofstream(file) << text; }
    void write_beside(const std::string& text) const { bf::service::write_beside(file, text); }
    /// Each once, at the moments that follow.
    static void meanwhile(std::vector<std::function<void()>> all) {
        at_the_moment = [all = std::move(all), next = std::make_shared<std::size_t>(0)] {
            if (*next < all.size()) all[(*next)++]();
            return 0;
        };
    }
    std::string text() const { return bf::read_text_file(file); }
    static std::string value(const Project& project, const std::string& block) {
        return bf::model::find(project.model(), block)->find_setting("value")->value.text;
    }
    std::ptrdiff_t files() const {
        return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
    }
    static op::SetVariable variable(const std::string& name) {
        return {"", name, bf::model::Variable{.name = name, .value = bf::model::Expression{.text = "1"}}};
    }

    const std::string first = "model: m\nblocks:\n  a: {block: Constant, value: 1}   # a\n"
                              "  b: {block: Constant, value: 1}\n",
                      theirs = first + "# by hand\n";
    fs::path folder, file;
};

TEST_F(FasterTest, WhatIsWrittenAtTheMomentOfAnEditStaysAndTheEditIsMadeAgainOnIt) {
    for (const bool in_place : {true, false}) {
        write_in_place(first);
        Project project(file);
        meanwhile({[&] { in_place ? write_in_place(theirs) : write_beside(theirs); }});
        project.edit(op::Set{"a", "value", "5"});
        EXPECT_EQ(text(), theirs) << "nothing is written over";
        EXPECT_FALSE(project.is_saved());
        EXPECT_TRUE(project.synchronise());
        std::string both = theirs;
        both.replace(both.find("value: 1"), 8, "value: 5");
        EXPECT_EQ(text(), both);
        EXPECT_TRUE(project.is_saved());
        EXPECT_EQ(project.failure() + project.collision(), "");
        EXPECT_FALSE(project.synchronise());
        EXPECT_EQ(files(), 1);
        EXPECT_TRUE(project.undo());
        EXPECT_EQ(text(), theirs);
        EXPECT_TRUE(project.undo());
        EXPECT_TRUE(project.undo());
        EXPECT_EQ(text(), first);
        EXPECT_FALSE(project.can_undo());
    }
}

TEST_F(FasterTest, ALaterWriteWhileAnEarlierOneComesBackIsTheOneThatStays) {
    Project project(file);
    meanwhile({[&] { write_in_place(theirs); }, [&] { write_beside(theirs + "# and again\n"); }});
    project.edit(op::Set{"a", "value", "5"});
    EXPECT_EQ(text(), theirs + "# and again\n");
    EXPECT_TRUE(project.synchronise());
    EXPECT_NE(text().find("value: 5"), std::string::npos);
    EXPECT_NE(text().find("# and again"), std::string::npos);
    EXPECT_EQ(files(), 1);
}

TEST_F(FasterTest, TwoProjectsOfOneFileLoseNoEditOfEachOther) {
    Project a(file), b(file);
    constexpr int count = 20;
    for (int i = 0; i < count; ++i) {
        meanwhile({[&] { b.edit(variable("b" + std::to_string(i))); }});
        a.edit(variable("a" + std::to_string(i)));
        EXPECT_TRUE(a.synchronise());
    }
    EXPECT_TRUE(b.synchronise());
    EXPECT_TRUE(a.is_saved() && b.is_saved());
    for (int i = 0; i < count; ++i)
        for (const char* who : {"a", "b"})
            EXPECT_NE(text().find(who + std::to_string(i) + ": 1"), std::string::npos) << who << i;
    EXPECT_EQ(a.texts().at(file), text());
    EXPECT_EQ(b.texts().at(file), text());
    EXPECT_EQ(a.collision() + b.collision(), "");
}

TEST_F(FasterTest, AnEditThatDoesNotFitWhatWasWrittenIsToldAndUndoLeadsToIt) {
    Project project(file);
    const std::string without = first.substr(0, first.find("  b:"));
    meanwhile({[&] { write_beside(without); }});
    project.edit(op::Set{"b", "value", "5"});
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(text(), without);
    EXPECT_EQ(project.collision().find("another program wrote " + file.string() +
                                       " at the same time, and an edit does not fit what is there now: "),
              0u)
        << project.collision();
    EXPECT_NE(project.collision().find("there is no block or port 'b'"), std::string::npos);
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(value(project, "b"), "5");
    EXPECT_EQ(project.collision(), "");
    EXPECT_TRUE(project.redo());
    EXPECT_EQ(text(), without);
}

TEST_F(FasterTest, WhatIsUndoneOrTypedAtThatMomentIsTold) {
    Project project(file);
    project.edit(op::Set{"a", "value", "5"});
    meanwhile({[&] { write_beside(theirs); }});
    EXPECT_TRUE(project.undo());
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(text(), theirs);
    EXPECT_NE(project.collision().find("what was undone, typed as a text"), std::string::npos);
    std::string typed = theirs;
    typed.replace(typed.find("value: 1"), 8, "value: 7");
    meanwhile({[&] { write_beside(theirs + "# and again\n"); }});
    EXPECT_TRUE(project.rewrite(file, theirs, typed));
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(text(), theirs + "# and again\n");
    EXPECT_NE(project.collision(), "");
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(text(), typed);
}

TEST_F(FasterTest, AnEditWaitsUntilWhatWasWrittenIsAModel) {
    Project project(file);
    meanwhile({[&] { write_in_place(""); }}); // it writes on
    project.edit(op::Set{"a", "value", "5"});
    EXPECT_TRUE(project.synchronise());
    EXPECT_NE(project.failure(), "");
    EXPECT_EQ(text(), "");
    EXPECT_THROW(project.edit(op::Set{"b", "value", "6"}), bf::model::Errors);
    write_in_place(theirs);
    EXPECT_TRUE(project.synchronise());
    EXPECT_EQ(project.failure(), "");
    EXPECT_EQ(value(project, "a"), "5");
    EXPECT_NE(text().find("# by hand"), std::string::npos);
    EXPECT_NE(text().find("value: 5"), std::string::npos);
}

TEST_F(FasterTest, AFileThatIsDeletedAtThatMomentIsWrittenAgain) {
    Project project(file);
    meanwhile({[&] { fs::remove(file); }});
    project.edit(op::Set{"a", "value", "5"});
    EXPECT_FALSE(fs::exists(file));
    static_cast<void>(project.synchronise());
    EXPECT_NE(text().find("value: 5"), std::string::npos);
    EXPECT_EQ(project.failure(), "");
}

TEST_F(FasterTest, TheLastEditOfAProgramIsMadeAgainBeforeItEnds) {
    {
        Project project(file);
        meanwhile({[&] { write_in_place(theirs); }});
        project.edit(op::Set{"a", "value", "5"});
    }
    EXPECT_NE(text().find("# by hand"), std::string::npos);
    EXPECT_NE(text().find("value: 5"), std::string::npos);
}

TEST_F(FasterTest, ExtractingWritesOverNoFileThatIsMadeAtThatMoment) {
    Project project(file);
    project.edit(op::Group{"", {"a"}, "part"});
    const std::string before = text();
    meanwhile({[&] { std::ofstream(folder / "part.yaml") << "mine"; }});
    try {
        project.edit(op::Extract{"part", "part.yaml"});
        ADD_FAILURE() << "it was written over";
    } catch (const bf::model::Errors& error) {
        EXPECT_EQ(error.diagnostics()[0].message,
                  "another program has written the file 'part.yaml' meanwhile");
    }
    EXPECT_EQ(bf::read_text_file(folder / "part.yaml"), "mine");
    EXPECT_EQ(text(), before);
}

TEST_F(FasterTest, EditsAreWrittenWhereTheFileSystemCannotExchangeFiles) {
    for (const int error : {EINVAL, ENOSYS}) {
        write_in_place(first);
        Project project(file);
        at_the_moment = [error] { return error; };
        project.edit(op::Set{"a", "value", "5"});
        EXPECT_NE(text().find("value: 5"), std::string::npos);
        EXPECT_TRUE(project.is_saved());
        EXPECT_EQ(files(), 1);
        write_beside(theirs);
        project.edit(op::Set{"a", "value", "6"});
        EXPECT_NE(text().find("value: 6"), std::string::npos);
        EXPECT_NE(text().find("# by hand"), std::string::npos);
    }
}

TEST_F(FasterTest, AWriteOfTheSameSizeInTheSameTickOfTheClockIsSeen) {
    Project project(file);
    std::string other = first;
    for (char digit = '2'; digit <= '9'; ++digit) {
        other[other.find("value: ") + 7] = digit;
        write_in_place(other);
        EXPECT_TRUE(project.synchronise()) << digit;
        EXPECT_EQ(value(project, "a"), std::string(1, digit));
    }
}

} // namespace

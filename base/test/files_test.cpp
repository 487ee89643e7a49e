#include "bf/base/files.hpp"
#include "bf/base/library_file.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>

#include <link.h>
#include <unistd.h>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <csignal>
#include <cstring>
#include <thread>

namespace bf {
namespace {

namespace fs = std::filesystem;

class FilesTest : public testing::Test {
  protected:
    FilesTest() { fs::create_directories(at); }
    ~FilesTest() override { fs::remove_all(at); }

    void put(const std::string& name, const std::string& text) const { std::ofstream(at / name) << text; }
    std::string text_of(const std::string& name) const { return read_text_file(at / name); }
    std::size_t count() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(at), fs::directory_iterator()));
    }
    static std::string error_of(const std::function<void()>& f) {
        try {
            f();
        } catch (const FileError& error) {
            return error.what();
        }
        return "";
    }

    const fs::path at = fs::temp_directory_path() / ("bf_files_" + std::to_string(::getpid()));
};

TEST_F(FilesTest, AppearWholeOrNotAtAll) {
    {
        OutputFile file(at / "a.txt");
        file.write("half");
        EXPECT_FALSE(fs::exists(at / "a.txt"));
        EXPECT_EQ(file.path().extension(), ".txt");
    }
    EXPECT_EQ(count(), 0u);
    OutputFile file(at / "a.txt");
    file.write("longer than the second");
    file.write("whole");
    file.commit();
    EXPECT_EQ(text_of("a.txt"), "whole");
    EXPECT_EQ(count(), 1u);
}

TEST_F(FilesTest, AreWrittenUnderNamesThatNobodyForesees) {
    OutputFile a(at / "a.txt"), b(at / "a.txt");
    EXPECT_NE(a.path(), b.path());
    EXPECT_EQ(a.path().string().find("a.txt"), std::string::npos);
}

TEST_F(FilesTest, KeepLinksAndPermissions) {
    fs::create_directory(at / "folder");
    put("folder/target", "old");
    fs::permissions(at / "folder/target", fs::perms(0640));
    fs::create_symlink("folder/target", at / "link");
    OutputFile file(at / "link");
    EXPECT_EQ(file.path().parent_path(), at / "folder");
    file.write("new");
    EXPECT_EQ(text_of("link"), "old");
    file.commit();
    EXPECT_TRUE(fs::is_symlink(at / "link"));
    EXPECT_EQ(text_of("folder/target"), "new");
    EXPECT_EQ(fs::status(at / "folder/target").permissions(), fs::perms(0640));
}

TEST_F(FilesTest, StayTheSameFileWhereTheyHaveSeveralNames) {
    const fs::path first = at / "first", second = at / "second";
    std::ofstream(first) << "a text that is longer than the new one";
    fs::create_hard_link(first, second);
    for (const std::string text : {"short", "and longer again", ""}) {
        OutputFile output(first);
        output.write(text);
        output.commit();
        EXPECT_EQ(read_text_file(second), text);
        EXPECT_EQ(fs::hard_link_count(first), 2u);
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(first.parent_path()), fs::directory_iterator()), 2)
        << "nothing stays beside them";
}

TEST_F(FilesTest, AreInsideOfAFolderByWhereLinksLead) {
    fs::create_directories(at / "folder/..inner");
    fs::create_symlink(at, at / "folder/out");
    fs::create_symlink(at / "folder", at / "in");
    EXPECT_TRUE(is_inside(at / "folder", at / "folder"));
    EXPECT_TRUE(is_inside(at / "folder/..inner/not yet", at / "folder"));
    EXPECT_TRUE(is_inside(at / "in/x", at / "folder"));
    EXPECT_FALSE(is_inside(at / "folder/out/x", at / "folder"));
    EXPECT_FALSE(is_inside(at / "folder/../x", at / "folder"));
    EXPECT_FALSE(is_inside(at / "folder2", at / "folder"));
}

TEST_F(FilesTest, MakeWhatALinkLeadsTo) {
    fs::create_symlink("not yet", at / "link");
    OutputFile file(at / "link");
    file.write("new");
    file.commit();
    EXPECT_TRUE(fs::is_symlink(at / "link"));
    EXPECT_EQ(text_of("not yet"), "new");
}

TEST_F(FilesTest, AreWrittenAsTheyAreWhereTheyAreNoRegularFiles) {
    ASSERT_EQ(::mkfifo((at / "pipe").c_str(), 0600), 0);
    std::string got;
    std::thread reader([&] { std::getline(std::ifstream(at / "pipe"), got); });
    OutputFile file(at / "pipe");
    file.write("through\n");
    file.commit();
    reader.join();
    EXPECT_EQ(got, "through");
    EXPECT_TRUE(fs::is_fifo(at / "pipe"));
}

TEST_F(FilesTest, WaitForNoReaderForEver) {
    ASSERT_EQ(::mkfifo((at / "pipe").c_str(), 0600), 0);
    EXPECT_EQ(error_of([&] { OutputFile(at / "pipe"); }),
              "cannot write " + (at / "pipe").string() +
                  ": no program reads this pipe; start one that does, or give a file");
    EXPECT_EQ(error_of([&] { read_text_file(at / "pipe"); }),
              "cannot read " + (at / "pipe").string() +
                  ": it is no regular file, which has an end; write its content to one");
    EXPECT_EQ(
        error_of([] { OutputFile("/dev/null").path(); }),
        "cannot write /dev/null: a pipe or a device is written from its beginning to its end; give a file");
}

TEST_F(FilesTest, LeaveNothingBehindWhereTheProgramIsKilled) {
    const pid_t child = ::fork();
    if (child == 0) {
        OutputFile file(at / "a.txt");
        file.write("half");
        ::raise(SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(count(), 0u);
}

TEST_F(FilesTest, RemoveWhatKilledProgramsLeftAndNothingElse) {
    put("model.yaml", "model: m\n");
    const pid_t child = ::fork();
    if (child == 0) { // killed between the name and the place
        OutputFile file(at / "model.yaml");
        file.write("x");
        static_cast<void>(file.path());
        ::raise(SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(count(), 2u);
    OutputFile written(at / "other.yaml"), film(at / "film.mp4");
    written.write("y");
    const fs::path under_way = written.path(), of_another_kind = film.path();
    for (const char* name :
         {".0123456789abcdef.part.yml", ".0123456789abcde.part.yaml", ".x123456789abcdef.part.yaml",
          "0123456789abcdef0.part.yaml", ".0123456789abcdef.copy.yaml"})
        put(name, "a person's");
    fs::create_directory(at / ".0123456789abcdef.part.yaml");
    fs::create_symlink("model.yaml", at / ".0123456789abcdee.part.yaml");
    const std::size_t before = count();
    remove_abandoned(at / "model.yaml");
    EXPECT_EQ(count(), before - 1);
    EXPECT_TRUE(fs::exists(under_way)) << "this program writes it";
    EXPECT_TRUE(fs::exists(of_another_kind));
    written.commit();
    EXPECT_EQ(text_of("other.yaml"), "y");
    EXPECT_EQ(text_of("model.yaml"), "model: m\n");
    EXPECT_NO_THROW(remove_abandoned(at / "missing" / "model.yaml"));
}

TEST_F(FilesTest, SayThatLinksLeadInARing) {
    fs::create_symlink("b", at / "a");
    fs::create_symlink("a", at / "b");
    const std::string ring = ": its symbolic links lead in a ring; remove one of them";
    EXPECT_EQ(error_of([&] { OutputFile(at / "a"); }), "cannot write " + (at / "a").string() + ring);
    EXPECT_EQ(error_of([&] { read_text_file(at / "a"); }), "cannot read " + (at / "a").string() + ring);
    EXPECT_EQ(error_of([&] { OutputFolder(at / "a"); }),
              "cannot write the folder " + (at / "a").string() + ring);
    EXPECT_TRUE(fs::is_symlink(at / "a"));
}

TEST_F(FilesTest, FoldersAreMadeWhereALinkLeadsTo) {
    fs::create_symlink("far/away", at / "link");
    for (const char* name : {"link", "link/"}) {
        fs::remove_all(at / "far");
        OutputFolder folder(at / name);
        folder.write("a", "text");
        folder.commit();
        EXPECT_EQ(text_of("far/away/a"), "text");
        EXPECT_TRUE(fs::is_symlink(at / "link"));
    }
}

TEST_F(FilesTest, SayWhyTheyCannotBeWritten) {
    EXPECT_EQ(error_of([&] { OutputFile(at / "no/a.txt"); }),
              "cannot write " + (at / "no/a.txt").string() +
                  ": No such file or directory; give a file in a folder that may be written");
    EXPECT_EQ(error_of([&] { OutputFile{at}; }),
              "cannot write " + at.string() + ": Is a directory; give the name of a file");
    EXPECT_EQ(error_of([&] { OutputFile("/dev/full").write("x"); }),
              "cannot write /dev/full: No space left on device; free space, or write to another disk");
    EXPECT_EQ(error_of([&] { OutputFile(at / std::string(300, 'x')).commit(); }),
              "cannot write " + (at / std::string(300, 'x')).string() +
                  ": File name too long; give a shorter name");
}

/// A limit on the size of files stands for a full disk.
TEST_F(FilesTest, FoldersSayWhyAndWhichOfTheirFilesCannotBeWritten) {
    put("whole", std::string(100'000, 'x'));
    const OutputFolder folder(at / "new");
    const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{10'000, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const std::string copied = error_of([&] { folder.copy(at / "whole", "lib/whole"); }),
                      written = error_of([&] { folder.write("text", std::string(100'000, 'x')); });
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, ignored);
    const std::string start = "cannot write the folder " + (at / "new").string() + ": ",
                      why = ": File too large; raise the limit on the size of files, or write less";
    EXPECT_EQ(copied, start + "lib/whole" + why);
    EXPECT_EQ(written, start + "text" + why);
    EXPECT_EQ(error_of([&] { folder.copy(at / "none", "lib/none"); }),
              start + (at / "none").string() + ": No such file or directory");
}

TEST_F(FilesTest, AreNotReadWhereTheyHaveNoEnd) {
    EXPECT_EQ(error_of([] { read_text_file("/dev/zero"); }),
              "cannot read /dev/zero: it is no regular file, which has an end; write its content to one");
    put("large", std::string(2 << 20, 'x'));
    EXPECT_EQ(error_of([&] { read_text_file(at / "large", 1 << 20); }),
              "cannot read " + (at / "large").string() + ": it is larger than 1 MB");
    EXPECT_EQ(error_of([&] { read_text_file(at / "none"); }),
              "cannot read " + (at / "none").string() + ": No such file or directory");
}

TEST_F(FilesTest, LibrariesAreNotLoadedWhereTheyAreCut) {
    const auto why = [&](const std::string& bytes) {
        put("lib.so", bytes);
        return why_not_loadable((at / "lib.so").string());
    };
    std::ifstream own("/proc/self/exe", std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(own), {}};
    EXPECT_EQ(why(whole), "");
    EXPECT_EQ(why(whole + "more"), "");
    // The table of sections ends such a file.
    for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{200}})
        EXPECT_EQ(why(whole.substr(0, size)), "it is cut or damaged: its headers speak of " +
                                                  std::to_string(whole.size()) + " bytes, and it has " +
                                                  std::to_string(size) + "; copy or build it again");
    EXPECT_EQ(why("no library at all"), "") << "the loader says what it is";
    EXPECT_EQ(why(whole.substr(0, 10)), "");
    EXPECT_NE(why_not_loadable((at / "nothing.so").string()).find("No such file"), std::string::npos);
}

TEST_F(FilesTest, LibrariesWithoutSectionsAreMeasuredByTheirSegments) {
    std::ifstream own("/proc/self/exe", std::ios::binary);
    std::string whole{std::istreambuf_iterator<char>(own), {}};
    ElfW(Ehdr) header;
    std::memcpy(&header, whole.data(), sizeof header);
    header.e_shoff = header.e_shnum = 0; // as strip may leave it
    std::memcpy(whole.data(), &header, sizeof header);
    std::uint64_t end = 0;
    for (int i = 0; i < header.e_phnum; ++i) {
        ElfW(Phdr) segment;
        std::memcpy(&segment, &whole[header.e_phoff + static_cast<std::size_t>(i) * sizeof segment],
                    sizeof segment);
        end = std::max<std::uint64_t>(end, segment.p_offset + segment.p_filesz);
    }
    put("whole.so", whole.substr(0, end));
    put("cut.so", whole.substr(0, end - 1));
    EXPECT_EQ(why_not_loadable((at / "whole.so").string()), "");
    EXPECT_EQ(why_not_loadable((at / "cut.so").string()),
              "it is cut or damaged: its headers speak of " + std::to_string(end) + " bytes, and it has " +
                  std::to_string(end - 1) + "; copy or build it again");
}

TEST_F(FilesTest, FoldersAppearWholeOrNotAtAll) {
    {
        const OutputFolder folder(at / "new");
        folder.write("a/b", "text");
        EXPECT_FALSE(fs::exists(at / "new"));
    }
    EXPECT_EQ(count(), 0u);
    OutputFolder folder(at / "new/");
    folder.write("a/b", "text");
    folder.write("run", "#!/bin/sh\n", true);
    folder.copy(folder.path() / "a/b", "c/d");
    folder.commit();
    EXPECT_EQ(text_of("new/c/d"), "text");
    EXPECT_NE(fs::status(at / "new/run").permissions() & fs::perms::owner_exec, fs::perms::none);
    EXPECT_EQ(count(), 1u);
}

TEST_F(FilesTest, FoldersDeleteNothing) {
    for (const char* name : {".new.part", "new.part", "new.part1"}) {
        fs::create_directory(at / name);
        put(std::string(name) + "/thesis.txt", "years of work");
    }
    fs::create_directory(at / "target");
    fs::create_directory_symlink("target", at / "new");
    OutputFolder folder(at / "new");
    folder.write("a", "text");
    folder.commit();
    EXPECT_TRUE(fs::is_symlink(at / "new"));
    EXPECT_EQ(text_of("target/a"), "text");
    EXPECT_EQ(text_of(".new.part/thesis.txt"), "years of work");
    EXPECT_EQ(count(), 5u);
    EXPECT_EQ(error_of([&] { OutputFolder(at / "target"); }),
              "cannot write the folder " + (at / "target").string() +
                  ": the folder is not empty; empty it or name another one");

    OutputFolder late(at / "late");
    fs::create_directory(at / "late");
    put("late/mine", "x");
    EXPECT_EQ(error_of([&] { late.commit(); }),
              "cannot write the folder " + (at / "late").string() + ": Directory not empty");
    EXPECT_EQ(text_of("late/mine"), "x");
}

} // namespace
} // namespace bf

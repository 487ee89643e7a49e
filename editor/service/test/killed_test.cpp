// A program that is killed, a disk that is full, a folder that may not be written: files stay whole, and what
// could not be written is written as soon as it can be.
#include "bf/base/files.hpp"
#include "bf/model/operation.hpp"
#include "bf/service/project.hpp"
#include "folder.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sched.h>
#include <set>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
namespace op = bf::model::operations;
using bf::service::Project;
using bf::service::test_folder;

constexpr int edits = 60;
const std::string first =
    "model: m # first\nstep: 0.1\nblocks:\n  # kept\n  a: {block: Gain} # a\nconnections: {}\n";

/// The edits of a burst, of which some make the file much longer and some shorter; none leads back.
bf::model::Operation edit_of(int i) {
    const std::string name = "b" + std::to_string(i / 4);
    const op::Set counted{"a", "K", std::to_string(i)};
    if (i % 4 == 0) return op::Batch{{counted, op::Add{"", {.name = name, .type = "Constant"}, {}, {}}}};
    if (i % 4 == 1) {
        const auto length = static_cast<std::size_t>(i % 3 * 9000 + 1);
        return op::Batch{{counted, op::Set{name, "value", std::string(length, '1')}}};
    }
    if (i % 4 == 2) return op::Batch{{counted, op::Move{name, {static_cast<double>(i), 5}}}};
    if (i % 8 == 3) return op::Batch{{counted, op::Remove{name}}};
    return op::Batch{{counted, op::Rename{name, "c" + std::to_string(i)}}};
}

fs::path written(const fs::path& folder, const std::string& text) {
    bf::OutputFile file(folder / "m.yaml");
    file.write(text);
    file.commit();
    return folder / "m.yaml";
}

std::set<std::string> names_in(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
    return names;
}

/// What the file is after each of the edits.
std::vector<std::string> all_texts(const fs::path& folder) {
    fs::create_directories(folder);
    const fs::path file = written(folder, first);
    std::vector<std::string> texts{first};
    Project project(file);
    for (int i = 0; i < edits; ++i) {
        project.edit(edit_of(i));
        texts.push_back(bf::read_text_file(file));
    }
    return texts;
}

/// Makes all edits, and says how many are on the disk whenever it knows.
[[noreturn]] void work(const fs::path& file, int saved, unsigned seed) {
    bf::service::Worker disk;
    Project project(file, &disk, [] {});
    std::mt19937 random(seed);
    for (std::int32_t i = 1;; i += i <= edits) {
        if (i <= edits) project.edit(edit_of(i - 1));
        const bool waits = i > edits || random() % 3 == 0;
        for (int tries = 0; waits && (tries == 0 || !project.is_saved()); ++tries) {
            if (tries > 100000) ::_exit(1); // somebody else works in the folder
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            project.note_written();
        }
        project.note_written();
        const std::int32_t done = std::min(i, edits);
        if (project.is_saved() && ::write(saved, &done, sizeof done) != sizeof done) ::_exit(1);
    }
}

TEST(Killed, LeavesAWholeFileOfOneOfItsStatesWhenever) {
    const char* const asked = std::getenv("BF_KILLS"); // for a longer trial
    const int kills = asked ? std::atoi(asked) : 12;
    const fs::path folder = test_folder();
    const std::vector<std::string> texts = all_texts(folder / "wanted");
    std::mt19937 random(3);
    for (int kill = 0; kill < kills; ++kill) {
        const fs::path place = folder / "model";
        fs::remove_all(place);
        fs::create_directories(place);
        const fs::path file = written(place, first);
        int saved[2];
        ASSERT_EQ(::pipe(saved), 0);
        const auto seed = static_cast<unsigned>(random());
        const ::pid_t child = ::fork();
        if (child == 0) work(file, saved[1], seed);
        ::close(saved[1]);
        // At some moment behind some edit, however fast this computer is.
        const auto edit = static_cast<std::int32_t>(random() % edits);
        std::int32_t known = 0;
        while (known < edit && ::read(saved[0], &known, sizeof known) == sizeof known) {
        }
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
        ::kill(child, SIGKILL);
        while (::read(saved[0], &known, sizeof known) == sizeof known) {
        }
        ::close(saved[0]);
        int status = 0;
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << "it ended by itself";

        const std::string text = bf::read_text_file(file);
        const auto state = std::ranges::find(texts, text);
        ASSERT_NE(state, texts.end()) << "kill " << kill << ": no state of the model:\n" << text;
        EXPECT_GE(state - texts.begin(), known) << "kill " << kill << ": what was said to be saved is lost";
        {
            Project again(file);
            EXPECT_EQ(names_in(place), std::set<std::string>{"m.yaml"}) << "kill " << kill;
            EXPECT_FALSE(again.can_undo());
            again.edit(op::Add{"", {.name = "later", .type = "Gain"}, {}, {}});
            EXPECT_TRUE(again.undo());
            EXPECT_FALSE(again.can_undo());
        }
        EXPECT_EQ(bf::read_text_file(file), text) << "kill " << kill;
    }
}

/// An edit that cannot be written, and then can.
void expect_writing_later(const fs::path& file, const std::string& failure,
                          const std::function<void()>& hinder, const std::function<void()>& allow) {
    Project project(file);
    const std::set<std::string> names = names_in(file.parent_path());
    hinder();
    project.edit(op::Add{"", {.name = "more", .type = "Constant"}, {}, {}});
    project.edit(op::Set{"more", "value", std::string(30000, '1')});
    const std::string found = project.failure();
    const bool is_saved = project.is_saved();
    project.synchronise(); // again
    allow();
    EXPECT_NE(found.find(failure), std::string::npos) << found;
    EXPECT_FALSE(is_saved);
    EXPECT_LT(fs::file_size(file), 2000u);
    EXPECT_NO_THROW(Project(file).model()) << "a whole file of an earlier state";
    EXPECT_EQ(names_in(file.parent_path()), names);
    EXPECT_TRUE(project.synchronise());
    EXPECT_TRUE(project.is_saved());
    EXPECT_EQ(project.failure(), "");
    EXPECT_EQ(bf::read_text_file(file), project.texts().at(file));
    EXPECT_TRUE(project.undo());
    EXPECT_TRUE(project.undo());
    EXPECT_EQ(bf::read_text_file(file), first);
    EXPECT_EQ(names_in(file.parent_path()), names);
}

TEST(Killed, ADiskThatIsFullKeepsTheFileAndTakesItLater) {
    const fs::path folder = test_folder(), filler = folder / "others" / "filler";
    // A small disk that nobody else sees.
    if (::unshare(CLONE_NEWNS) != 0 || ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("none", folder.c_str(), "tmpfs", 0, "size=128k") != 0)
        GTEST_SKIP() << "no file system can be mounted";
    fs::create_directories(filler.parent_path());
    expect_writing_later(
        written(folder, first), "No space left on device",
        [&] {
            std::ofstream fill(filler);
            while (fill << std::string(4096, 'x') && fill.flush()) {
            }
        },
        [&] { fs::remove(filler); });
    ::umount(folder.c_str());
}

TEST(Killed, AFileThatMayNotGrowStaysAndGrowsLater) {
    const fs::path file = written(test_folder(), first);
    const auto limit = [](::rlim_t bytes) {
        struct rlimit known {};
        ::getrlimit(RLIMIT_FSIZE, &known);
        known.rlim_cur = std::min(bytes, known.rlim_max);
        ::setrlimit(RLIMIT_FSIZE, &known);
    };
    const auto before = std::signal(SIGXFSZ, SIG_IGN);
    expect_writing_later(
        file, "File too large", [&] { limit(8000); }, [&] { limit(RLIM_INFINITY); });
    std::signal(SIGXFSZ, before);
}

TEST(Killed, AFolderThatMayNotBeWrittenKeepsTheFileAndTakesItLater) {
    const fs::path folder = test_folder(), file = written(folder, first);
    constexpr ::uid_t nobody = 65534; // whom permissions bind, as they do not bind root
    const bool is_root = ::geteuid() == 0;
    if (is_root &&
        (::chown(folder.c_str(), nobody, nobody) != 0 || ::chown(file.c_str(), nobody, nobody) != 0))
        GTEST_SKIP() << "files cannot be given to another user";
    expect_writing_later(
        file, "Permission denied",
        [&] {
            fs::permissions(folder, fs::perms(0555));
            if (is_root) {
                ASSERT_EQ(::seteuid(nobody), 0);
            }
        },
        [&] {
            if (is_root) {
                ASSERT_EQ(::seteuid(0), 0);
            }
            fs::permissions(folder, fs::perms(0755));
        });
}

} // namespace

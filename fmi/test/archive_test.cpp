#include "bf/base/files.hpp"
#include "bf/fmi/archive.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <set>

namespace bf::fmi::test {
namespace {

namespace fs = std::filesystem;

struct Archives : ::testing::Test {
    /// What extraction says of an archive with these contents, whose bytes are changed before; nothing may
    /// stand beside the folder afterwards.
    std::string refusal(const Contents& contents, const std::function<void(std::string&)>& change = {},
                        const ArchiveLimits& limits = {}) {
        const fs::path file = folder.path() / "x.fmu";
        write_archive(contents, file);
        std::string bytes = read_text_file(file);
        if (change) change(bytes);
        return refusal_of(bytes, limits);
    }
    std::string refusal_of(const std::string& bytes, const ArchiveLimits& limits = {}) {
        const fs::path file = folder.path() / "x.fmu", to = folder.path() / "to";
        std::ofstream(file, std::ios::binary) << bytes;
        fs::remove_all(to);
        fs::create_directory(to);
        std::string text;
        try {
            extract(file, to, limits);
        } catch (const FmuError& error) {
            text = error.what();
        }
        std::set<std::string> names;
        for (const auto& entry : fs::directory_iterator(folder.path())) names.insert(entry.path().filename());
        EXPECT_EQ(names, (std::set<std::string>{"to", "x.fmu"}));
        EXPECT_TRUE(text.empty() || text.starts_with(file.string() + ": ")) << text;
        return text.empty() ? "none" : text.substr(file.string().size() + 2);
    }
    TemporaryFolder folder{"archive_test"};
};

/// Of the first entry of the list at the archive's end.
std::size_t entry(const std::string& bytes) { return bytes.find("PK\1\2"); }

TEST_F(Archives, GiveBackWhatWasWrittenAndAreTheSameBytesEachTime) {
    const Contents contents{{"a/b/c.txt", "text"}, {"empty", ""}, {"zeros", std::string(30000, '\0')}};
    EXPECT_EQ(refusal(contents), "none");
    for (const auto& [name, content] : contents)
        EXPECT_EQ(read_text_file(folder.path() / "to" / name), content);
    write_archive(contents, folder.path() / "again.fmu");
    EXPECT_EQ(read_text_file(folder.path() / "again.fmu"), read_text_file(folder.path() / "x.fmu"));
}

TEST_F(Archives, AreRefusedWhoseFilesAreNotWhatTheListSays) {
    const std::string damaged = "'a' cannot be read: it is damaged";
    // More and fewer bytes than come, another checksum; the list has it at 16, the length at 24.
    for (const auto& change : {std::pair(24, 1), {24, -1}, {16, 1}})
        EXPECT_EQ(refusal({{"a", std::string(1000, 'x')}},
                          [&](std::string& bytes) {
                              char& byte = bytes[entry(bytes) + static_cast<std::size_t>(change.first)];
                              byte = static_cast<char>(byte + change.second);
                          }),
                  damaged);
}

TEST_F(Archives, AreRefusedWhoseFilesWouldStandElsewhere) {
    const std::string rule = "; an FMU's files are named relative to its root (FMI 3.0, section 2.5)";
    EXPECT_EQ(refusal({{"../x", "1"}}), "it holds the file '../x', which leaves its folder" + rule);
    EXPECT_EQ(refusal({{"a/../../x", "1"}}), "it holds the file 'a/../../x', which leaves its folder" + rule);
    EXPECT_EQ(refusal({{"/tmp/x", "1"}}), "it holds the file '/tmp/x', which is no relative name" + rule);
    EXPECT_EQ(refusal({{"..\\x", "1"}}), "it holds the file '..\\x', which is no relative name" + rule);
    EXPECT_EQ(refusal({{"C:x", "1"}}), "it holds the file 'C:x', which is no relative name" + rule);
}

TEST_F(Archives, AreRefusedWithLinksDoublesAndCiphers) {
    EXPECT_EQ(refusal({{"x", "/etc/passwd"}},
                      [](std::string& bytes) { // a link, by the permissions of Unix
                          bytes[entry(bytes) + 40] = '\xff', bytes[entry(bytes) + 41] = '\xa1';
                      }),
              "'x' is a link or a special file, which an FMU has not");
    EXPECT_EQ(refusal({{"aa", "1"}, {"ab", "2"}},
                      [](std::string& bytes) {
                          for (auto at = bytes.find("ab"); at != std::string::npos; at = bytes.find("ab", at))
                              bytes[at + 1] = 'a';
                      }),
              "two of its files are called 'aa'");
    EXPECT_EQ(refusal({{"x", "1"}}, [](std::string& bytes) { bytes[entry(bytes) + 8] |= 1; }),
              "'x' is encrypted");
}

TEST_F(Archives, AreRefusedThatWouldFillTheDisk) {
    EXPECT_EQ(refusal({{"bomb", std::string(60'000'000, '\0')}}),
              "'bomb' grows to more than an FMU's files do; it may be made to fill the disk");
    EXPECT_EQ(refusal({{"a", "12345"}, {"b", "12345"}}, {}, {.bytes = 9}),
              "'b' grows to more than an FMU's files do; it may be made to fill the disk");
    EXPECT_EQ(refusal({{"a", ""}, {"b", ""}, {"c", ""}}, {}, {.files = 2}), "it holds more than 2 files");
}

TEST_F(Archives, AreRefusedWhenDamaged) {
    EXPECT_EQ(refusal({{"x", "1"}}, [](std::string& bytes) { bytes = "no archive"; }),
              "it is no ZIP archive, or cannot be read; an FMU is one (FMI 3.0, section 2.5)");
    EXPECT_EQ(refusal({{"x", "content"}}, [](std::string& bytes) { bytes[entry(bytes) + 16] ^= 1; }),
              "'x' cannot be read: it is damaged");
    // Whatever byte is wrong: a message or the contents, and nothing elsewhere.
    const Contents contents{{"a/b.txt", "some text of some length"}, {"c", "more"}};
    write_archive(contents, folder.path() / "x.fmu");
    const std::string whole = read_text_file(folder.path() / "x.fmu");
    std::size_t refused = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ 0x55);
        refused += refusal_of(bytes) != "none";
    }
    EXPECT_GT(refused, whole.size() / 3);
    EXPECT_LT(refused, whole.size());
}

TEST_F(Archives, FoldersOfTheirOwnAreForTheirOwnerAndGoneAtTheEnd) {
    fs::path path;
    {
        const TemporaryFolder own("a/b");
        path = own.path();
        EXPECT_EQ(fs::status(path).permissions() & fs::perms::all, fs::perms::owner_all);
        std::ofstream(path / "file") << "text";
    }
    EXPECT_FALSE(fs::exists(path));
}

} // namespace
} // namespace bf::fmi::test

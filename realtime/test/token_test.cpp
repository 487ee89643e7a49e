#include "bf/realtime/token.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>

namespace bf::realtime {
namespace {

namespace fs = std::filesystem;

TEST(Token, IsRandom) {
    EXPECT_EQ(random_token().size(), 32u);
    EXPECT_NE(random_token(), random_token());
}

TEST(Token, OnlyTheSameTextIsIt) {
    EXPECT_TRUE(is_token("abcd", "abcd"));
    for (const char* wrong : {"", "abc", "abcde", "abcdabcd", "Abcd", "abcx"})
        EXPECT_FALSE(is_token(wrong, "abcd")) << wrong;
    EXPECT_FALSE(is_token("", "")) << "no token lets nobody in";
    EXPECT_FALSE(is_token("a", ""));
}

TEST(Token, AFileIsMadeForItsOwnerAloneAndReadAgain) {
    const auto file = fs::path(testing::TempDir()) / ("token_" + std::to_string(::getpid()));
    fs::remove(file);
    std::string made, again;
    EXPECT_EQ(read_token(file, made), "");
    EXPECT_EQ(made.size(), 32u);
    EXPECT_EQ(fs::status(file).permissions(), fs::perms(0600));
    EXPECT_EQ(read_token(file, again), "");
    EXPECT_EQ(again, made);
    const auto wrong = [&] {
        std::string token;
        return read_token(file, token);
    };
    fs::permissions(file, fs::perms(0640));
    EXPECT_NE(wrong().find("is open to others than its owner; say chmod 600 "), std::string::npos) << wrong();
    fs::permissions(file, fs::perms(0600));
    for (const std::string text : {"", "short", "with blanks and more", "ends&with=another?value"}) {
        std::ofstream(file) << text << "\n";
        EXPECT_NE(wrong().find("needs one line of 16 to 255 letters"), std::string::npos) << text;
    }
    fs::remove(file);
    EXPECT_EQ(wrong(), "");
    fs::remove(file);
    fs::create_directory(file);
    EXPECT_NE(wrong().find("cannot be read; check its name and rights"), std::string::npos) << wrong();
    fs::remove(file);
    std::string token;
    EXPECT_NE(read_token("/nowhere/token", token).find("cannot be made: No such file"), std::string::npos);
}

} // namespace
} // namespace bf::realtime

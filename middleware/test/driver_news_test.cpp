#include "bf/middleware/driver_news.hpp"

#include <chrono>
#include <gtest/gtest.h>
#include <thread>

namespace bf::middleware {
namespace {

/// Those that are even have none.
std::string name_of(std::uint64_t program) { return program % 2 == 0 ? "" : "/n" + std::to_string(program); }
const std::string rest = "; so are those that follow";

TEST(DriverNews, SayOfWhatIsLeftOutOnceWhoSendsItWhere) {
    DriverNews news;
    EXPECT_EQ(news.take(), "");
    for (int k = 0; k < 3; ++k) news.left_out("/a", 1, "2 numbers");
    news.left_out("/b", 1, "2 numbers");
    news.left_out("/b", 3, "2 numbers");
    news.left_out("/b", 1, "nan");
    EXPECT_EQ(news.rejected(), 6U);
    EXPECT_EQ(news.take(), "") << "the names are not known yet";
    news.find_names(name_of);
    for (const std::string what :
         {"/a': the node '/n1' sends 2 numbers", "/b': the node '/n1' sends 2 numbers",
          "/b': the node '/n3' sends 2 numbers", "/b': the node '/n1' sends nan"})
        EXPECT_EQ(news.take(), "left out what came to the topic '" + what + rest);
    EXPECT_EQ(news.take(), "");
}

TEST(DriverNews, WaitASecondForNames) {
    DriverNews news;
    news.left_out("/a", 1, "nan");
    news.left_out("/a", 2, "nan");
    int asked = 0;
    const auto late = [&](std::uint64_t program) { return ++asked < 4 ? "" : name_of(program); };
    news.find_names(late);
    EXPECT_EQ(news.take(), "");
    news.find_names(late);
    EXPECT_EQ(news.take(), "");
    news.find_names(late);
    EXPECT_EQ(news.take(), "left out what came to the topic '/a': the node '/n1' sends nan" + rest);
    EXPECT_EQ(news.take(), "");
    std::this_thread::sleep_for(std::chrono::milliseconds(1010));
    news.find_names(late);
    EXPECT_EQ(news.take(), "left out what came to the topic '/a': a program sends nan" + rest);
}

TEST(DriverNews, AreTenAtMostOfWhatIsLeftOut) {
    DriverNews news;
    for (int k = 0; k < 100; ++k) news.left_out("/a", 1, std::to_string(k) + " numbers");
    news.find_names(name_of);
    int told = 0;
    while (!news.take().empty()) ++told;
    EXPECT_EQ(told, 10);
    EXPECT_EQ(news.rejected(), 100U);
}

TEST(DriverNews, NameTwoWhoCommandByTurnsOnce) {
    DriverNews news;
    for (int k = 0; k < 4; ++k) {
        news.came(1);
        news.came(3);
    }
    news.find_names(name_of);
    EXPECT_EQ(news.take(), "the node '/n3' and the node '/n1' send commands to it by turns; end one of them");
    EXPECT_EQ(news.take(), "");
}

TEST(DriverNews, SayNothingOfOneWhoCommands) {
    DriverNews news;
    for (int k = 0; k < 4; ++k) news.came(1);
    news.find_names(name_of);
    EXPECT_EQ(news.take(), "");
}

} // namespace
} // namespace bf::middleware

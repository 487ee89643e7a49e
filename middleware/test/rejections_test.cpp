#include "bf/middleware/rejections.hpp"

#include <chrono>
#include <gtest/gtest.h>
#include <thread>

namespace bf::middleware {
namespace {

std::string lab() { return "/lab"; }

TEST(Rejections, AreEachToldOnceWithTheirTopicAndNode) {
    Rejections its;
    EXPECT_EQ(its.take(), "");
    for (int k = 0; k < 3; ++k) its.add("/a", 1, "2 numbers for 3 joints", lab);
    its.add("/b", 1, "2 numbers for 3 joints", lab);
    its.add("/b", 1, "nan", lab);
    EXPECT_EQ(its.count(), 5U);
    EXPECT_EQ(its.take(), "") << "their names are not known yet";
    its.find_names();
    const std::string rest = "2 numbers for 3 joints; so are those that follow";
    EXPECT_EQ(its.take(), "left out what came to the topic '/a': the node '/lab' sends " + rest);
    EXPECT_EQ(its.take(), "left out what came to the topic '/b': the node '/lab' sends " + rest);
    EXPECT_EQ(its.take(),
              "left out what came to the topic '/b': the node '/lab' sends nan; so are those that follow");
    EXPECT_EQ(its.take(), "");
}

TEST(Rejections, AreToldWithoutANameWhereNoneIsFoundWithinASecond) {
    Rejections its;
    int asked = 0;
    const auto late = [&] { return ++asked < 3 ? std::string() : lab(); };
    its.add("/a", 1, "nan", late);
    its.add("/a", 2, "nan", [] { return std::string(); });
    its.find_names();
    its.find_names();
    EXPECT_EQ(its.take(), "");
    its.find_names();
    EXPECT_EQ(its.take(),
              "left out what came to the topic '/a': the node '/lab' sends nan; so are those that follow");
    EXPECT_EQ(its.take(), "");
    std::this_thread::sleep_for(std::chrono::milliseconds(1010));
    its.find_names();
    EXPECT_EQ(its.take(),
              "left out what came to the topic '/a': a program sends nan; so are those that follow");
}

TEST(Rejections, AreToldTenTimesAtMost) {
    Rejections its;
    for (int k = 0; k < 100; ++k) its.add("/a", 1, std::to_string(k) + " numbers", lab);
    its.find_names();
    int told = 0;
    while (!its.take().empty()) ++told;
    EXPECT_EQ(told, 10);
    EXPECT_EQ(its.count(), 100U);
}

} // namespace
} // namespace bf::middleware

#include "bf/middleware/ending.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <memory>
#include <unistd.h>

namespace bf::middleware::test {
namespace {

struct Global {
    ~Global() { _exit(4); }
};

TEST(Ending, WaitsForWhatEndsInTimeAndForWhatThatHeld) {
    bool is_done = false;
    const auto held = std::make_shared<int>(1);
    EXPECT_TRUE(end_within(60, [&is_done, held] { is_done = true; }));
    EXPECT_TRUE(is_done);
    EXPECT_EQ(held.use_count(), 1);
}

TEST(Ending, LeavesWhatNeverEndsToTheProgramsEndWithoutGlobals) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_EXIT(
        {
            static const Global global;
            if (end_within(0.01, [] { pause(); })) std::exit(5);
            std::exit(3);
        },
        ::testing::ExitedWithCode(3), "");
}

} // namespace
} // namespace bf::middleware::test

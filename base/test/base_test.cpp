#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

namespace bf {
namespace {

TEST(Names, CountEditsAndSwapsLettersApartFromCase) {
    EXPECT_EQ(edit_distance("gain", "gain"), 0u);
    EXPECT_EQ(edit_distance("Gain", "gAIN"), 0u);
    EXPECT_EQ(edit_distance("gain", "gian"), 1u);
    EXPECT_EQ(edit_distance("gain", "gains"), 1u);
    EXPECT_EQ(edit_distance("kitten", "sitting"), 3u); // the textbook's example
    EXPECT_EQ(edit_distance("", "abc"), 3u);
}

TEST(Names, AreOrderedByDistanceAndThenAsGiven) {
    EXPECT_EQ(nearest_first("l_sol", {"head", "r_sole", "l_sole", "l_sola"}),
              (std::vector<std::string>{"l_sole", "l_sola", "r_sole"}));
    EXPECT_EQ(nearest_first("x", {}), std::vector<std::string>{});
}

TEST(Names, AreListedUpToAFewAndCounted) {
    EXPECT_EQ(name_list(std::vector<std::string>{}), "");
    EXPECT_EQ(name_list(std::vector<std::string>{"a", "b"}), "a, b");
    EXPECT_EQ(name_list(std::vector<std::string>(100, "a")),
              "a, a, a, a, a, a, a, a, a, a, a, a and 88 more");
}

TEST(Names, AreSuggestedForTheFirstMistakes) {
    Suggestions suggestions;
    int made = 0;
    for (int i = 0; i < 1000; ++i) made += suggestions.take();
    EXPECT_EQ(made, 20);
}

TEST(Numbers, ReadBackAsWritten) {
    for (const double x : {0.0, -0.0, 0.1, 1.0 / 3, 1e23, 5e-324, std::numeric_limits<double>::max(),
                           std::numeric_limits<double>::infinity()}) {
        ASSERT_TRUE(number_of(number_text(x))) << number_text(x);
        EXPECT_EQ(std::bit_cast<std::uint64_t>(*number_of(number_text(x))), std::bit_cast<std::uint64_t>(x));
    }
    EXPECT_EQ(number_text(0.1f), "0.1");
    EXPECT_EQ(number_text(-0.0), "-0");
}

TEST(Numbers, AreWholeTextsInNoLocale) {
    for (const char* text : {"", " 1", "1 ", "+1", "1,5", "0x10", "1e", "--1", "one", "1e999", "1e-999"})
        EXPECT_FALSE(number_of(text)) << text;
    EXPECT_EQ(number_of("-.5e1"), -5.0);
    EXPECT_EQ(number_of("0e-999"), 0.0);
}

} // namespace
} // namespace bf

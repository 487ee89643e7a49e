#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"

#include <gtest/gtest.h>
#include <random>

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

TEST(Names, OfAPathUnderAnotherOneAreWhatFollows) {
    EXPECT_EQ(rest_under("a.b.c", "a.b"), ".c");
    EXPECT_EQ(rest_under("a.b", "a.b"), "");
    EXPECT_EQ(rest_under("a.bc", "a.b"), std::nullopt);
    EXPECT_EQ(rest_under("a", "a.b"), std::nullopt);
}

/// By the definition, without a table: the best of all last edits.
std::size_t plain_distance(std::string_view a, std::string_view b) {
    if (a.empty() || b.empty()) return a.size() + b.size();
    const auto shorter = [](std::string_view text, std::size_t by) {
        return text.substr(0, text.size() - by);
    };
    std::size_t best = std::min({plain_distance(shorter(a, 1), b) + 1, plain_distance(a, shorter(b, 1)) + 1,
                                 plain_distance(shorter(a, 1), shorter(b, 1)) + (a.back() != b.back())});
    if (a.size() > 1 && b.size() > 1 && a.back() == b[b.size() - 2] && b.back() == a[a.size() - 2])
        best = std::min(best, plain_distance(shorter(a, 2), shorter(b, 2)) + 1);
    return best;
}

TEST(Names, HaveTheDistanceOfTheirBestEdits) {
    std::mt19937 random(3);
    for (int k = 0; k < 300; ++k) {
        std::string a(random() % 6, ' '), b(random() % 6, ' ');
        for (auto* text : {&a, &b})
            for (char& c : *text) c = static_cast<char>('a' + random() % 3);
        EXPECT_EQ(edit_distance(a, b), plain_distance(a, b)) << a << ", " << b;
    }
}

TEST(Names, AreOrderedByDistanceAndThenAsGiven) {
    EXPECT_EQ(nearest_first("l_sol", {"head", "r_sole", "l_sole", "l_sola"}),
              (std::vector<std::string>{"l_sole", "l_sola", "r_sole"}));
    EXPECT_EQ(nearest_first("x", {}), std::vector<std::string>{});
}

TEST(Names, AreSimilarWhereFewLettersDiffer) {
    const std::vector<std::string> known = {"blocks", "block", "Gain", "K", "k2"};
    EXPECT_EQ(similar("bolck", known), (std::vector<std::string>{"block"})); // of five letters one differs
    EXPECT_EQ(similar("bolcks", known), (std::vector<std::string>{"blocks", "block"}));
    EXPECT_EQ(similar("gain", known), (std::vector<std::string>{"Gain"}));
    EXPECT_EQ(similar("k", known), (std::vector<std::string>{"K", "k2"}));
    EXPECT_EQ(similar("x", known), std::vector<std::string>{"K"});
    EXPECT_EQ(similar("gain2", {"gains", "pains", "gains"}), std::vector<std::string>{"gains"});
    EXPECT_EQ(similar(std::string(101, 'a'), {std::string(101, 'a')}), std::vector<std::string>{});
    EXPECT_EQ(similar("gain", {"gains", "gaim", "again", "pain"}).size(), 3u);
    EXPECT_EQ(did_you_mean("bolcks", known), "; did you mean 'blocks' or 'block'?");
    EXPECT_EQ(did_you_mean("bolck", known, ""), "did you mean 'block'?");
    EXPECT_EQ(did_you_mean("xy", known), "");
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

// Claims about what may be asked of a running model.
#include "support.hpp"

#include "bf/run/comparison.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

const char* const model =
    "model: m\nstep: 1\nblocks:\n  a: {block: Constant, value: [1, 2, 3]}\n"
    "  M: {block: Constant, value: [[1, 2], [3, 4]]}\n  s: {block: Constant, value: -0.5}\n"
    "  'x<=y': {block: Constant, value: 7}\n";

TEST(Comparison, HoldsAsItIsWritten) {
    Session run(model);
    run.trace("s", 1);
    const auto holds = [&](const std::string& text) { return Comparison(*run.simulation, text)(); };
    const std::vector<std::pair<std::string, std::array<bool, 3>>> all{
        {">", {false, false, true}}, {">=", {false, true, true}},  {"<", {true, false, false}},
        {"<=", {true, true, false}}, {"==", {false, true, false}}, {"~=", {true, false, true}},
        {"!=", {true, false, true}}};
    for (const auto& [comparison, wanted] : all)
        for (int i = 0; i < 3; ++i)
            EXPECT_EQ(holds("a[" + std::to_string(i + 1) + "] " + comparison + " 2"),
                      wanted[static_cast<std::size_t>(i)])
                << i + 1 << comparison << 2;
    EXPECT_TRUE(holds("s==-0.5"));
    EXPECT_TRUE(holds("s.y < Inf"));
    EXPECT_TRUE(holds("M[2][1] == 3")) << "by row and column";
    EXPECT_TRUE(holds("M[1][2] == 2"));
    EXPECT_TRUE(holds("x<=y >= 7")) << "names may hold signs of comparison";
}

TEST(Comparison, SaysWhatIsNoComparison) {
    Session run(model);
    const auto refused = [&](const std::string& text) -> std::string {
        try {
            Comparison(*run.simulation, text);
        } catch (const RunError& error) {
            return error.what();
        }
        return "";
    };
    for (const char* text : {"s", "s = 1", "=", "s >", "s > nan", "s > 1 m", "> 1 >"})
        EXPECT_TRUE(refused(text).starts_with("'" + std::string(text) + "' is no event; write SIGNAL"))
            << text;
    const std::string more = "; bf check lists the signals",
                      three = "'a' has 3, counted from 1; name one, e.g. a[1]",
                      four = "'M' has 2 x 2, counted from 1; name one, e.g. M[1][1]",
                      one = "'s' has only one; call it s";
    const std::vector<std::pair<std::string, std::string>> all{
        {"t > 1", "the run has no 't'" + more},
        {"s => 1", "the run has no 's ='" + more},
        {"a[0] > 1", "'a[0]' is no element: " + three},
        {"a[4] > 1", "'a[4]' is no element: " + three},
        {"a > 1", "'a' is no element: " + three},
        {"M[3] > 1", "'M[3]' is no element: " + four},
        {"M[2][3] > 1", "'M[2][3]' is no element: " + four},
        {"s[2] > 1", "'s[2]' is no element: " + one}};
    for (const auto& [text, wanted] : all) EXPECT_EQ(refused(text), wanted);
}

} // namespace
} // namespace bf::test

// Models of chance in this process, in others, and in several threads.
#include "cases.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <sys/wait.h>

namespace bf::fuzz {
namespace {

/// What bf_fuzz prints, or its exit code if that is not 0.
std::string output_of(const std::string& arguments) {
    FILE* pipe = ::popen(("'" BF_FUZZ "' " + arguments).c_str(), "r");
    std::array<char, 4096> text{};
    const std::size_t size = std::fread(text.data(), 1, text.size(), pipe);
    const int status = ::pclose(pipe);
    return status == 0 ? std::string(text.data(), size) : "exit code " + std::to_string(WEXITSTATUS(status));
}

TEST(ModelsOfChance, AreRefusedWithReasonsOrRunAlikeTwiceAndFromASnapshot) {
    std::array<int, 3> accepted{};
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        const Outcome outcome = try_model(model_of(seed), seed);
        ASSERT_EQ(outcome.violation, "") << "seed " << seed << "\n" << model_of(seed);
        accepted[seed % 3] += outcome.is_accepted;
    }
    EXPECT_GE(accepted[0], 90) << "of 100 that are right";
    EXPECT_LT(accepted[1] + accepted[2], 150) << "broken models are refused";
}

TEST(ModelsOnceRunOtherwise, RunAlikeFromASnapshotBeforeEveryStep) {
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(BF_FOUND)) {
        std::ifstream file(entry.path());
        const std::string text{std::istreambuf_iterator<char>(file), {}};
        for (std::uint64_t seed = 0; seed < 24; seed += 3) {
            const Outcome outcome = try_model(text, seed);
            EXPECT_TRUE(outcome.is_accepted) << entry.path();
            EXPECT_EQ(outcome.violation, "") << entry.path();
        }
        ++files;
    }
    EXPECT_GT(files, 3);
}

TEST(ModelsOfChance, ComeOutTheSameInEveryProcessAndWithAnyNumberOfThreads) {
    const std::string expected = output_of("--first 1000 --count 30");
    EXPECT_NE(expected.find("30 models"), std::string::npos) << expected;
    EXPECT_EQ(output_of("--first 1000 --count 30"), expected);
    EXPECT_EQ(output_of("--first 1000 --count 30 --threads 4"), expected);
}

} // namespace
} // namespace bf::fuzz

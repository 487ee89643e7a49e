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
    int accepted = 0;
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        const Outcome outcome = try_model(model_of(seed), seed);
        ASSERT_EQ(outcome.violation, "") << "seed " << seed << "\n" << model_of(seed);
        accepted += seed % 3 == 0 && outcome.is_accepted;
    }
    EXPECT_GE(accepted, 90) << "of 100 that are right";
}

TEST(ModelsOfChance, AreRefusedForTheOneFaultThatTheyHave) {
    const std::array<std::pair<std::string, std::string>, 5> faults{{
        {"block: Gian", "did you mean 'Gain'"},
        {"block: Gain, KK: 2", "the block has no argument or parameter 'KK'; did you mean 'K'"},
        {"block: Gain, K: undefined_name", "undefined_name"},
        {"block: DiscreteTransferFunction, numerator: 1, denominator: [1, 2], sample_time: 1", "sample_time"},
        {"block: Delay, steps: 0", "argument 'steps' must be from 1 to 1000000, but is 0"},
    }};
    int tried = 0;
    for (std::uint64_t seed = 0; seed < 300; seed += 3) {
        const std::string right = model_of(seed);
        if (!try_model(right, seed).is_accepted) continue;
        for (const auto& [block, reason] : faults) {
            std::string wrong = right;
            const std::string blocks = "\nblocks:\n";
            wrong.insert(wrong.find(blocks) + blocks.size(), "  the_fault: {" + block + "}\n");
            const Outcome outcome = try_model(wrong, seed);
            EXPECT_FALSE(outcome.is_accepted) << wrong;
            EXPECT_NE(outcome.refusal.find("the_fault"), std::string::npos) << outcome.refusal;
            EXPECT_NE(outcome.refusal.find(reason), std::string::npos) << outcome.refusal;
            ++tried;
        }
    }
    EXPECT_GE(tried, 450);
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

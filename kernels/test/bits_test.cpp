#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace {

/// Text that the program test/bits/bits.cpp prints when built as `variant`.
std::string output_of(const std::string& variant) {
    FILE* pipe = popen((std::string(BF_BINARY_DIRECTORY "/kernels/bits_") + variant).c_str(), "r");
    std::string text;
    char buffer[4096];
    while (const auto n = std::fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
    EXPECT_EQ(pclose(pipe), 0) << variant << ": fixed and run-time extents differ, or the program failed";
    return text;
}

TEST(Bits, AreTheSameForEveryCompilerAndLevel) {
    const std::string reference = output_of("reference");
    EXPECT_GT(reference.size(), 10000u);
    std::istringstream variants(BF_BITS_VARIANTS);
    for (std::string variant; variants >> variant;) {
        const std::string text = output_of(variant);
        std::istringstream expected(reference), actual(text);
        std::string a, b;
        while (std::getline(expected, a) && std::getline(actual, b)) ASSERT_EQ(a, b) << variant;
        EXPECT_EQ(text.size(), reference.size()) << variant;
    }
}

TEST(Bits, AreCheckedForEveryKernelUnderItsOwnName) {
    const std::string printed = output_of("reference");
    const std::regex kernel(
        R"re(struct (\w+)[^{}]*\{\s*static constexpr const char\* name\s*=\s*"([^"]*)")re");
    int count = 0;
    for (const auto& file :
         std::filesystem::directory_iterator(BF_SOURCE_DIRECTORY "/kernels/include/bf/kernels")) {
        std::ifstream in(file.path());
        const std::string code((std::istreambuf_iterator<char>(in)), {});
        for (std::sregex_iterator i(code.begin(), code.end(), kernel), end; i != end; ++i, ++count) {
            const std::string name = (*i)[1], text = (*i)[2];
            EXPECT_EQ(text, "bf::kernels::" + name + "{}") << file.path();
            EXPECT_NE(printed.find("bf::kernels::" + name), std::string::npos)
                << name << " is not in bits.cpp";
        }
    }
    EXPECT_GT(count, 130);
}

} // namespace

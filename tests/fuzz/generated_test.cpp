// Generated code of models of chance beside the engine.
#include "compare.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace bf::codegen::test {
namespace {

TEST(ModelsOfChance, RunAlikeAsGeneratedCode) {
    std::vector<Case> cases;
    for (auto* make : families())
        for (auto& one : make()) cases.push_back(std::move(one));
    EXPECT_GE(cases.size(), 15u) << "most are accepted";
    EXPECT_GE(std::count_if(cases.begin(), cases.end(), is_c_case), 1);
    compare_all(cases, {BF_PLAIN_DRIVER, BF_C_DRIVER, BF_HOSTED_DRIVER, ""});
}

} // namespace
} // namespace bf::codegen::test

// Generated code of models of chance beside the engine.
#include "compare.hpp"

#include <gtest/gtest.h>

namespace bf::codegen::test {
namespace {

TEST(ModelsOfChance, RunAlikeAsGeneratedCode) {
    std::vector<Case> cases;
    for (auto* make : families())
        for (auto& one : make()) cases.push_back(std::move(one));
    EXPECT_GE(cases.size(), 15u) << "most are accepted";
    compare_all(cases, {BF_PLAIN_DRIVER, BF_HOSTED_DRIVER, ""});
}

} // namespace
} // namespace bf::codegen::test

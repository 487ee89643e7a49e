#include "contract.hpp"
#include "standard_variants.hpp"

#include "bf/blocks/standard.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::conformance {
namespace {

class EveryStandardBlock : public testing::TestWithParam<std::string> {};

TEST_P(EveryStandardBlock, KeepsTheContract) {
    const Library library = standard_library();
    for (const auto& block_class : library.classes()) {
        if (block_class.name != GetParam()) continue;
        std::vector<Arguments> tried;
        if (block_class.name == "SignalFromFile") {
            const std::string file =
                testing::TempDir() + "contract_signal_" + std::to_string(getpid()) + ".csv";
            std::ofstream(file) << "0,1,2\n0.02,3,4\n";
            tried.push_back({{"file", file}});
        } else {
            tried.emplace_back();
        }
        const auto [first, last] = variants().equal_range(block_class.name);
        for (auto i = first; i != last; ++i) {
            Arguments& arguments = tried.emplace_back();
            arguments.assign(i->second.begin(), i->second.end());
        }
        for (const auto& arguments : tried)
            for (const auto& sentence : check_contract(block_class, arguments).broken)
                ADD_FAILURE() << sentence;
    }
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    const Library library = standard_library();
    for (const auto& block_class : library.classes()) all.push_back(block_class.name);
    return all;
}
INSTANTIATE_TEST_SUITE_P(Blocks, EveryStandardBlock, testing::ValuesIn(names()),
                         [](const auto& instance) { return instance.param; });

TEST(Contract, CountsTheHeap) {
    if (!heap_is_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
    const long before = heap_calls();
    double* volatile made = new double[10]; // otherwise clang leaves it out
    delete[] made;
    EXPECT_EQ(heap_calls() - before, 2);
}

TEST(Contract, KnowsOnlyBlocksThatExist) {
    const auto all = names();
    for (const auto& [name, settings] : variants())
        EXPECT_TRUE(std::count(all.begin(), all.end(), name)) << name;
}

// ---- the test is tested: broken blocks, each for its own reason

struct Broken : Block {
    using Block::Block;
    Input<Vector> u{this, "u", {.shape = {3}}};
    Output<Vector> y{this, "y", {.shape = {3}}};
    DiscreteState<Vector> x{this, "x", {.shape = {3}}};
};
struct LeavesAnOutput : Broken {
    using Broken::Broken;
    Status output(Now at, Out out) const noexcept override {
        out[y].head(2) = at[u].head(2);
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[u];
        return ok;
    }
};
struct UsesTheHeap : Broken {
    using Broken::Broken;
    Status output(Now at, Out out) const noexcept override {
        const Vector copy = at[u] + at[x];
        out[y] = copy;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[u];
        return ok;
    }
};
struct HidesState : Broken {
    using Broken::Broken;
    mutable double hidden = 0;
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u] * ++hidden;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[u];
        return ok;
    }
};
struct WritesItsInput : Broken {
    using Broken::Broken;
    Status output(Now at, Out out) const noexcept override {
        *const_cast<double*>(at[u].data()) += 1;
        out[y].setZero();
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[u];
        return ok;
    }
};
struct LeavesAState : Broken {
    using Broken::Broken;
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u];
        return ok;
    }
    Status update(Now, Next) const noexcept override { return ok; }
};
struct SurvivesAReset : Broken {
    using Broken::Broken;
    mutable Vector3 kept{0, 0, 0};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u] + kept;
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[u];
        kept = at[u];
        return ok;
    }
};
struct HasNoDoc : Block {
    using Block::Block;
    Parameter<double> stiffness{this, "stiffness"};
};

template <class B> std::string first_complaint() {
    Library library("");
    library.group("broken").add<B>("Broken", "Breaks the contract.");
    const auto verdict = check_contract(library.classes().front());
    return verdict.broken.empty() ? "" : verdict.broken.front();
}

TEST(Contract, FindsEachBreachForItsOwnReason) {
    EXPECT_EQ(first_complaint<LeavesAnOutput>(), "Broken ([3]): output leaves output 'y' unwritten");
    if (heap_is_counted()) {
        EXPECT_EQ(first_complaint<UsesTheHeap>(), "Broken ([3]): output uses the heap");
    }
    EXPECT_EQ(first_complaint<HidesState>(), "Broken ([3]): same inputs give another output 'y'");
    EXPECT_EQ(first_complaint<WritesItsInput>(), "Broken ([3]): output writes input 'u'");
    EXPECT_EQ(first_complaint<LeavesAState>(), "Broken ([3]): update leaves the next state 'x' unwritten");
    EXPECT_EQ(first_complaint<SurvivesAReset>(), "Broken ([3]): same inputs give another output 'y'");
    EXPECT_EQ(first_complaint<HasNoDoc>(), "Broken: parameter 'stiffness' has no doc");
}

} // namespace
} // namespace bf::conformance

// Claims about the memory that blocks of one diagram share.
#include "bf/core/context.hpp"
#include "bf/core/interrupt.hpp"
#include "bf/core/resolve.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/routing.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <gtest/gtest.h>

namespace bf {
namespace {

/// A quantity of every role and of several types.
struct Everything : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Output<Vector> y{this, "y", {.shape = {n}}};
    Output<std::int8_t> small{this, "small"};
    Parameter<double> p{this, "p", {.initial = {4}}};
    DiscreteState<std::int32_t> k{this, "k", {.initial = {7}}};
    DiscreteState<Vector> held{this, "held", {.shape = {n}, .initial = {1.5}}};
    ContinuousState<Vector> x{this, "x", {.shape = {n}, .initial = {-2}}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[p] * at[u] + at[x];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[k] = at[k] + 1;
        next[held] = at[u];
        return ok;
    }
};

/// Three of them with 1, 2 and 3 elements, of which each reads itself.
struct Three {
    std::array<Everything, 3> blocks;
    std::unique_ptr<Context> context;

    Three() {
        std::vector<Node> nodes;
        for (int i = 0; i < 3; ++i) {
            Everything& block = blocks[static_cast<std::size_t>(i)];
            offer(block.resolution(), block.u.index(), Size{i + 1, 1, false});
            propagate(block);
            std::vector<Node::End> sources(block.declaration().slots.size());
            nodes.push_back({&block, methods_of<Everything>(), sources, {}, i});
        }
        context = std::make_unique<Context>(nodes, 3);
        for (int i = 0; i < 3; ++i) EXPECT_TRUE(context->initialize(i));
    }
    const Slot& slot(int node, int i) const {
        return blocks[static_cast<std::size_t>(node)].resolution().slots[static_cast<std::size_t>(i)];
    }
    /// All memory: values, next values and derivatives, each with its bytes.
    std::vector<std::pair<std::byte*, std::size_t>> pieces() const {
        std::vector<std::pair<std::byte*, std::size_t>> all;
        for (int n = 0; n < 3; ++n)
            for (int i = 0; i < static_cast<int>(blocks[0].declaration().slots.size()); ++i) {
                const Slot& s = slot(n, i);
                const auto size =
                    static_cast<std::size_t>(s.size.count()) * static_cast<std::size_t>(bytes(s.type));
                const Frame& frame = context->frame(n);
                all.emplace_back(static_cast<std::byte*>(frame.now[i]), size);
                if (s.role == Role::discrete_state || s.role == Role::continuous_state)
                    all.emplace_back(static_cast<std::byte*>(frame.next[i]), size);
                if (s.role == Role::continuous_state)
                    all.emplace_back(static_cast<std::byte*>(frame.rate[i]), size);
            }
        return all;
    }
    double* numbers(int node, int slot) { return static_cast<double*>(context->data(node, slot)); }
};

TEST(Context, GivesEveryQuantityMemoryOfItsOwnOfItsTypeAndAlignment) {
    const Three three;
    const auto pieces = three.pieces();
    ASSERT_EQ(pieces.size(), 3U * (7 + 3 + 1));
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        ASSERT_NE(pieces[i].first, nullptr) << i;
        std::memset(pieces[i].first, static_cast<int>(i + 1), pieces[i].second);
        if (pieces[i].second % 8 == 0) {
            EXPECT_EQ(reinterpret_cast<std::uintptr_t>(pieces[i].first) % 8, 0U) << i;
        }
    }
    for (std::size_t i = 0; i < pieces.size(); ++i)
        EXPECT_TRUE(std::all_of(pieces[i].first, pieces[i].first + pieces[i].second, [&](std::byte b) {
            return b == static_cast<std::byte>(i + 1);
        })) << i;
}

TEST(Context, BeginsWithTheDeclaredValuesInEveryElement) {
    Three three;
    for (int n = 0; n < 3; ++n) {
        const Everything& block = three.blocks[static_cast<std::size_t>(n)];
        EXPECT_EQ(*three.numbers(n, block.p.index()), 4);
        EXPECT_EQ(*static_cast<std::int32_t*>(three.context->data(n, block.k.index())), 7);
        EXPECT_EQ(*static_cast<std::int32_t*>(three.context->next_data(n, block.k.index())), 7);
        for (int i = 0; i <= n; ++i) {
            EXPECT_EQ(three.numbers(n, block.held.index())[i], 1.5);
            EXPECT_EQ(three.numbers(n, block.x.index())[i], -2);
        }
    }
}

TEST(Context, HoldsContinuousStatesAsOneVectorInTheOrderOfNodes) {
    Three three;
    const auto x = three.context->continuous_state(), rate = three.context->continuous_rate();
    ASSERT_EQ(x.size(), rate.size());
    const int state = three.blocks[0].x.index();
    std::ptrdiff_t end = 0;
    for (int n = 0; n < 3; ++n) {
        const auto at = three.numbers(n, state) - x.data();
        EXPECT_GE(at, end) << "between them only what aligns them";
        EXPECT_LE(at, end + 1);
        EXPECT_EQ(static_cast<double*>(three.context->frame(n).rate[state]) - rate.data(), at);
        end = at + n + 1;
    }
    EXPECT_EQ(end, static_cast<std::ptrdiff_t>(x.size()));
}

TEST(Context, RunsAndCommitsOneNodeAlone) {
    Three three;
    const Everything& block = three.blocks[1];
    for (int i = 0; i < 2; ++i) three.numbers(1, block.u.index())[i] = i + 1;
    ASSERT_EQ(three.context->activities(1, Phase::output), 1);
    ASSERT_EQ(three.context->activities(1, Phase::derivative), 0);
    ASSERT_TRUE(three.context->task(1, Phase::output, 0)());
    ASSERT_TRUE(three.context->task(1, Phase::update, 0)());
    EXPECT_EQ(three.numbers(1, block.y.index())[0], 2);
    EXPECT_EQ(three.numbers(1, block.y.index())[1], 6);
    EXPECT_EQ(three.numbers(1, block.held.index())[1], 1.5) << "before the commit";
    three.context->commit(1);
    const auto k = [&](int n) {
        return *static_cast<std::int32_t*>(three.context->data(n, block.k.index()));
    };
    EXPECT_EQ(three.numbers(1, block.held.index())[1], 2);
    EXPECT_EQ(k(0), 7);
    EXPECT_EQ(k(1), 8);
    EXPECT_EQ(k(2), 7);
    EXPECT_EQ(three.numbers(0, block.y.index())[0], 0);
    EXPECT_EQ(three.numbers(2, block.held.index())[2], 1.5);
}

TEST(Context, RestoresWhatItSaved) {
    Three three;
    const auto pieces = three.pieces();
    for (std::size_t i = 0; i < pieces.size(); ++i)
        std::memset(pieces[i].first, static_cast<int>(i + 1), pieces[i].second);
    std::vector<std::byte> saved(three.context->snapshot_size());
    three.context->save(saved.data());
    for (const auto& [at, size] : pieces) std::memset(at, 0, size);
    three.context->restore(saved.data());
    std::vector<std::byte> again(saved.size());
    three.context->save(again.data());
    EXPECT_EQ(again, saved);
    const Everything& block = three.blocks[2];
    for (const int i :
         {block.y.index(), block.small.index(), block.k.index(), block.held.index(), block.x.index()}) {
        const auto* at = static_cast<const std::byte*>(three.context->data(2, i));
        EXPECT_NE(*at, std::byte{0}) << three.slot(2, i).name;
    }
    EXPECT_EQ(three.context->refuses_snapshot(), -1);
    EXPECT_TRUE(three.context->devices().empty());
}

struct Opened : Block {
    using Block::Block;
    void start(Now at) const override { log += "start " + std::to_string(int(at[number])) + " "; }
    void stop(Now at) const noexcept override { log += "stop " + std::to_string(int(at[number])) + " "; }
    Parameter<double> number{this, "number"};
    static inline std::string log;
};

TEST(Context, StartsAndStopsTheNodeThatItIsAskedFor) {
    Opened first, second;
    for (Opened* block : {&first, &second}) propagate(*block);
    Context context({{&first, {}, {{}}, {}, 0}, {&second, {}, {{}}, {}, 0}});
    *static_cast<double*>(context.data(0, 0)) = 1;
    *static_cast<double*>(context.data(1, 0)) = 2;
    Opened::log.clear();
    context.start(0);
    context.start(1);
    context.stop(1);
    context.stop(0);
    EXPECT_EQ(Opened::log, "start 1 start 2 stop 2 stop 1 ");
}

struct Cache {
    static constexpr bool is_cache = true;
};
struct World {
    double time = 3;
    int state_size() const { return 1; }
    void save(double* to) const { *to = time; }
    void restore(const double* from) { time = *from; }
};
struct Socket {};
template <class T> struct Holds : Block {
    OutsideState<T> object{this, [] { return std::make_shared<T>(); }};
};
struct Works : Block {
    Scratch<std::vector<double>> work{this, [] { return std::vector<double>(3); }};
};

TEST(Context, IsSavedUnlessItHoldsStateOutsideThatCannotBe) {
    Works works;
    Holds<Cache> cache;
    Holds<World> world;
    Holds<Socket> socket;
    const auto node = [](Block& block) { return Node{&block, {}, {}, {}, 0}; };
    Context saved({node(works), node(cache), node(world)});
    EXPECT_EQ(saved.refuses_snapshot(), -1);
    EXPECT_EQ(saved.devices(), std::vector<int>());
    EXPECT_EQ(saved.outside(), std::vector<int>{2});
    const Context refused({node(works), node(cache), node(world), node(socket)});
    EXPECT_EQ(refused.refuses_snapshot(), 3);
    EXPECT_EQ(refused.devices(), std::vector<int>{3});
    EXPECT_EQ(refused.outside(), (std::vector<int>{2, 3}));
    auto& time = static_cast<World*>(saved.frame(2).objects[0])->time;
    std::vector<std::byte> bytes(saved.snapshot_size());
    saved.save(bytes.data());
    time = 8;
    saved.restore(bytes.data());
    EXPECT_EQ(time, 3);
}

struct Routes : Block {
    using Block::Block;
    Parameter<double> k{this, "k", {.initial = {2}}};
    Input<Vector> u{this, "u", {.shape = {3}}};
    Output<Vector> copied{this, "copied", {.shape = {3}}};
    Output<Vector> picked{this, "picked", {.shape = {2}}};
    Output<Vector> outside{this, "outside", {.shape = {1}}};
    Output<Vector> chosen{this, "chosen", {.shape = {1}}};
    Output<Vector> doubled{this, "doubled", {.shape = {3}}};
    Output<Array<std::int32_t>> whole{this, "whole", {.shape = {3}}};
    OutputRule copy{this, kernels::Copy{}, copied, u};
    OutputRule pick{this, kernels::Select{}, picked, Constants({3, 1}), u};
    OutputRule pick_outside{this, kernels::Select{}, outside, Constants({4}), u};
    OutputRule choose{this, kernels::Select{}, chosen, k, u};
    OutputRule gain{this, kernels::Gain{}, doubled, k, u};
    OutputRule round{this, kernels::Copy{}, whole, u};
};

TEST(Context, KnowsWhichTasksOnlyMoveNumbersAndWhereFrom) {
    Routes block;
    propagate(block);
    Context context({{&block, methods_of<Routes>(), {}, {}, 0}});
    ASSERT_TRUE(context.initialize(0));
    const auto* const u = static_cast<const double*>(context.data(0, block.u.index()));
    const auto moves = [&](int rule) {
        return context.moves(context.task(0, Phase::output, rule), 0, Phase::output, rule);
    };
    const auto copy = moves(0), pick = moves(1);
    ASSERT_EQ(copy.size(), 1U);
    EXPECT_EQ(copy[0].to, context.data(0, block.copied.index()));
    EXPECT_EQ(copy[0].from, u);
    EXPECT_EQ(copy[0].count, 4) << "to the end of the last register";
    ASSERT_EQ(pick.size(), 2U);
    EXPECT_EQ(pick[0].from, u + 2);
    EXPECT_EQ(pick[1].from, u);
    EXPECT_EQ(pick[1].to, static_cast<double*>(context.data(0, block.picked.index())) + 1);
    EXPECT_TRUE(moves(2).empty()) << "the index lies outside, which is a failure in every step";
    EXPECT_TRUE(moves(3).empty()) << "the index is a parameter, which may change";
    EXPECT_TRUE(moves(4).empty()) << "it computes";
    EXPECT_TRUE(moves(5).empty()) << "it converts";
}

TEST(Move, IsJoinedOnlyWithWhatGoesOnAndReadsNothingThatItWrites) {
    std::array<double, 8> a{};
    Move first{&a[4], &a[0], 2};
    EXPECT_FALSE(join(first, {&a[7], &a[2], 1})) << "it leaves one out";
    EXPECT_FALSE(join(first, {&a[6], &a[3], 1})) << "it leaves one out";
    EXPECT_TRUE(join(first, {&a[6], &a[2], 2}));
    EXPECT_EQ(first.count, 4);
    Move shift{&a[1], &a[0], 1};
    EXPECT_FALSE(join(shift, {&a[2], &a[1], 1})) << "the second moves what the first has written";
}

TEST(Interruptions, AreToldByTheEndOfAFailureWhateverWaited) {
    EXPECT_TRUE(is_interruption(interrupted));
    EXPECT_TRUE(is_interruption(std::string("shm: robot 'arm' in shared memory: ") + interrupted));
    EXPECT_FALSE(is_interruption(std::string(interrupted) + " by nobody"));
    EXPECT_FALSE(is_interruption("interrupted"));
    EXPECT_FALSE(is_interruption(""));
}

} // namespace
} // namespace bf

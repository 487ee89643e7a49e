// Claims about what a context binds, copies and opens for its blocks.
#include "bf/core/context.hpp"
#include "bf/core/resolve.hpp"
#include "bf/kernels/elementwise.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <numeric>

namespace bf {
namespace {

using Values = std::vector<double>;

// ---- values

template <class T> Values written(Type type, int count, const Values& values) {
    std::vector<T> memory(static_cast<std::size_t>(count) + 1, T{1});
    write_values(memory.data(), type, count, values);
    EXPECT_EQ(memory.back(), T{1}) << "behind the last element";
    Values read;
    for (int i = 0; i < count; ++i) read.push_back(read_value(memory.data(), type, i));
    return read;
}

TEST(Values, AreRoundedAndSaturatedForIntegers) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(written<std::int8_t>(Type::int8, 6, {0.5, -0.5, 1.49, 200, -200, nan}),
              (Values{1, -1, 1, 127, -128, 0}));
    EXPECT_EQ(written<std::uint8_t>(Type::uint8, 3, {-1, 255.4, 1e9}), (Values{0, 255, 255}));
    EXPECT_EQ(written<std::uint32_t>(Type::uint32, 2, {4294967295.0, infinity}),
              (Values{4294967295.0, 4294967295.0}));
    EXPECT_EQ(written<std::int32_t>(Type::int32, 2, {-infinity, 2147483646}),
              (Values{-2147483648.0, 2147483646}));
    EXPECT_EQ(written<float>(Type::float32, 1, {0.1}), (Values{static_cast<double>(0.1F)}));
    EXPECT_EQ(written<double>(Type::float64, 2, {0.1, infinity}), (Values{0.1, infinity}));
}

TEST(Values, OfTruthAreTrueWhereTheyAreNotZero) {
    std::array<bool, 4> memory{};
    write_values(memory.data(), Type::boolean, 4, {0, 2, -0.5, 0});
    EXPECT_EQ(memory, (std::array<bool, 4>{false, true, true, false}));
}

TEST(Values, OneFillsAllElementsAndNoneIsZero) {
    EXPECT_EQ(written<double>(Type::float64, 3, {7}), (Values{7, 7, 7}));
    EXPECT_EQ(written<std::int16_t>(Type::int16, 2, {}), (Values{0, 0}));
}

// ---- rules and methods

/// Writes the sum of what it reads; of one type or, of the wiring, any.
struct Total {
    static constexpr std::string_view name = "Total";
    template <class Y, class... Read> void operator()(const Y& y, const Read&... read) const {
        for (int i = 0; i < y.size(); ++i) y[i] = 0;
        const auto add = [&](const auto& one) {
            for (int i = 0; i < one.size(); ++i)
                y[i < y.size() ? i : 0] =
                    static_cast<std::remove_reference_t<decltype(y[0])>>(y[i < y.size() ? i : 0] + one[i]);
        };
        (add(read), ...);
    }
};

struct Ruled : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Output<Vector> y{this, "y", {.shape = {n}}};
    Output<Vector> z{this, "z", {.shape = {2}}};
    Output<double> t{this, "t"}, h{this, "h"}, by{this, "by"};
    DiscreteState<Vector> x{this, "x", {.shape = {n}, .initial = {5}}};
    ContinuousState<Vector> c{this, "c", {.shape = {n}, .initial = {-1}}};
    GuardOf<Vector> g{this, "g", {.shape = {n}}};
    OutputRule sums{this, Total{}, y, u, x, c};
    OutputRule constant{this, Total{}, z, Constants({3, 4})};
    OutputRule time{this, Total{}, t, at_time};
    OutputRule period{this, Total{}, h, at_period};
    OutputRule trigger{this, Total{}, by, at_trigger};
    UpdateRule goes_on{this, Total{}, bf::next(x), x, u};
    DerivativeRule slope{this, Total{}, bf::derivative(c), u};
    GuardRule guard{this, Total{}, g, u, c};
};

struct Written : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    DiscreteState<double> x{this, "x", {.initial = {5}}};
    ContinuousState<double> c{this, "c", {.initial = {-1}}};
    Guard g{this, "g"};

    Status reset(Now at, After after) const noexcept override {
        after[x] = at[x] + at[c];
        return ok;
    }
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u] + at[x] + at[c];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = 2 * at[x];
        return ok;
    }
    Status derivative(Now at, Rate rate) const noexcept override {
        rate[c] = 3 * at[u];
        return ok;
    }
    Status guards(Now at, Guards guards) const noexcept override {
        guards[g] = at[u] - 4;
        return ok;
    }
    Status event(Now at, After after) const noexcept override {
        if (at[u] < 0) return Status::failure("u is negative");
        after[c] = after[c] + 10;
        return ok;
    }
};

struct Both {
    Ruled ruled;
    Written written;
    std::unique_ptr<Context> context;

    Both() {
        offer(ruled.resolution(), ruled.u.index(), Size{2, 1, false});
        propagate(ruled);
        propagate(written);
        const auto sources = [](const Block& block) {
            return std::vector<Node::End>(block.declaration().slots.size());
        };
        context = std::make_unique<Context>(
            std::vector<Node>{{&ruled, methods_of<Ruled>(), sources(ruled), {}, 1},
                              {&written, methods_of<Written>(), sources(written), {}, 0}},
            2);
        EXPECT_TRUE(context->initialize(0));
        (*this)(0, ruled.u)[0] = 7;
        (*this)(0, ruled.u)[1] = 8;
        *(*this)(1, written.u) = 100;
    }
    template <class K> double* operator()(int node, const K& key) {
        return static_cast<double*>(context->data(node, key.index()));
    }
    Values both(int node, const auto& key) { return {(*this)(node, key)[0], (*this)(node, key)[1]}; }
    void run(int node, Phase phase) {
        for (int i = 0; i < context->activities(node, phase); ++i)
            ASSERT_TRUE(context->task(node, phase, i)());
    }
};

TEST(Rules, WorkInTheirPhaseOnTheOperandsThatTheyName) {
    Both both;
    const Ruled& block = both.ruled;
    both.context->clock(0) = {91, 92, 93, 94};
    both.context->clock(1) = {0.75, 0.25, 3, 1};
    EXPECT_EQ(both.context->activities(0, Phase::output), 5);
    for (const Phase phase : {Phase::update, Phase::derivative, Phase::guards})
        EXPECT_EQ(both.context->activities(0, phase), 1);
    both.run(0, Phase::output);
    EXPECT_EQ(both.both(0, block.y), (Values{7 + 5 - 1, 8 + 5 - 1}));
    EXPECT_EQ(both.both(0, block.z), (Values{3, 4}));
    EXPECT_EQ(*both(0, block.t), 0.75);
    EXPECT_EQ(*both(0, block.h), 0.25);
    EXPECT_EQ(*both(0, block.by), 1);
    both.run(0, Phase::derivative);
    EXPECT_EQ(both.context->continuous_rate()[0], 7);
    EXPECT_EQ(both.context->continuous_rate()[1], 8);
    both.run(0, Phase::guards);
    EXPECT_EQ(both.both(0, block.g), (Values{6, 7}));
    both.run(0, Phase::update);
    EXPECT_EQ(both.both(0, block.x), (Values{5, 5})) << "before the commit";
    both.context->commit(0);
    EXPECT_EQ(both.both(0, block.x), (Values{12, 13}));
    EXPECT_EQ(both.both(0, block.c), (Values{-1, -1})) << "continuous states are the solver's";
}

TEST(Methods, AreCalledInTheirPhase) {
    Both both;
    const Written& block = both.written;
    ASSERT_TRUE(both.context->initialize(1));
    EXPECT_EQ(*both(1, block.x), 4) << "after the declared initial values";
    EXPECT_EQ(*static_cast<double*>(both.context->next_data(1, block.x.index())), 4);
    for (const Phase phase : {Phase::output, Phase::update, Phase::derivative, Phase::guards}) {
        EXPECT_EQ(both.context->activities(1, phase), 1);
        both.run(1, phase);
    }
    EXPECT_EQ(*both(1, block.y), 100 + 4 - 1);
    EXPECT_EQ(both.context->continuous_rate().back(), 300);
    EXPECT_EQ(*both(1, block.g), 96);
    both.context->commit(1);
    EXPECT_EQ(*both(1, block.x), 8);
}

TEST(Methods, AnEventBeginsWithTheStatesAndPutsThemInPlace) {
    Both both;
    const Written& block = both.written;
    ASSERT_TRUE(both.context->initialize(1));
    *static_cast<double*>(both.context->next_data(1, block.x.index())) =
        77; // an update that was not committed
    *both(1, block.c) = 2;
    const auto event = [&] {
        return both.context->event(1, std::vector{both.context->task(1, Phase::event, 0)});
    };
    ASSERT_TRUE(event());
    EXPECT_EQ(*both(1, block.c), 12);
    EXPECT_EQ(*both(1, block.x), 4);
    *both(1, block.u) = -1;
    EXPECT_EQ(event().text(), "u is negative");
}

TEST(Tables, MemoryOutsideTakesThePlaceOfASlot) {
    Both both;
    double u[2] = {40, 50}, x[2] = {1, 2}, next_x[2] = {}, rate[2] = {};
    both.context->use_memory(0, both.ruled.u.index(), {.now = u, .connects = true});
    both.context->use_memory(0, both.ruled.x.index(), {.now = x, .next = next_x});
    both.context->use_memory(0, both.ruled.c.index(), {.now = both(0, both.ruled.c), .rate = rate});
    for (const Phase phase : {Phase::output, Phase::update, Phase::derivative}) both.run(0, phase);
    EXPECT_EQ(both.both(0, both.ruled.y), (Values{40, 51}));
    EXPECT_EQ(next_x[1], 52);
    EXPECT_EQ(rate[0], 40);
    const auto& connected = both.context->frame(0).connected;
    EXPECT_TRUE(connected[both.ruled.u.index()]);
    EXPECT_FALSE(connected[both.ruled.x.index()]);
}

/// Arithmetic whose arrays end within a register, between numbers that nobody writes.
struct Arrays : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> a{this, "a", {.shape = {n}}};
    Input<double> before{this, "before"};
    Input<Vector> b{this, "b", {.shape = {n}}};
    Output<Vector> sum{this, "sum", {.shape = {n}}};
    Output<double> between{this, "between"};
    Output<Vector> scaled{this, "scaled", {.shape = {n}}};
    Output<double> behind{this, "behind"};
    Output<Vector> shifted{this, "shifted", {.shape = {n}}};
    Parameter<Vector> k{this, "k", {.shape = {n}, .initial = {3}}};
    DiscreteState<Vector> x{this, "x", {.shape = {n}}};
    ContinuousState<Vector> c{this, "c", {.shape = {n}, .initial = {5}}};
    ContinuousState<double> other{this, "other", {.initial = {7}}};
    OutputRule adds{this, kernels::Add{}, sum, a, b};
    OutputRule scales{this, kernels::Gain{}, scaled, k, a};
    OutputRule shifts{this, kernels::Add{}, shifted, a, c};
    UpdateRule keeps{this, kernels::Copy{}, bf::next(x), b};
    DerivativeRule falls{this, kernels::Negate{}, bf::derivative(c), a};
};

TEST(Rules, OfArraysWriteNothingButTheirElements) {
    for (int n = 1; n < 20; ++n) {
        SCOPED_TRACE(n);
        Arrays block;
        offer(block.resolution(), block.a.index(), Size{n, 1, false});
        propagate(block);
        Context context({{&block,
                          methods_of<Arrays>(),
                          std::vector<Node::End>(block.declaration().slots.size()),
                          {},
                          0}});
        ASSERT_TRUE(context.initialize(0));
        const auto memory = [&](const auto& key) {
            return static_cast<double*>(context.data(0, key.index()));
        };
        std::vector<double> outside(static_cast<std::size_t>(n) + 8, 77);
        for (int i = 0; i < n; ++i) {
            memory(block.a)[i] = i;
            memory(block.b)[i] = outside[static_cast<std::size_t>(i)] = 100;
        }
        *memory(block.before) = *memory(block.between) = *memory(block.behind) = 77;
        for (const bool is_outside : {false, true}) {
            if (is_outside) context.use_memory(0, block.sum.index(), {.now = outside.data()});
            for (const Phase phase : {Phase::output, Phase::update, Phase::derivative})
                for (int i = 0; i < context.activities(0, phase); ++i)
                    ASSERT_TRUE(context.task(0, phase, i)());
            context.commit(0);
            for (int i = 0; i < n; ++i) {
                EXPECT_EQ(memory(block.sum)[i], 100 + i);
                EXPECT_EQ(memory(block.scaled)[i], 3 * i);
                EXPECT_EQ(memory(block.shifted)[i], 5 + i);
                EXPECT_EQ(memory(block.x)[i], 100);
            }
            EXPECT_EQ(*memory(block.before), 77);
            EXPECT_EQ(*memory(block.between), 77);
            EXPECT_EQ(*memory(block.behind), 77);
            EXPECT_EQ(*memory(block.other), 7);
            for (int i = n; i < n + 8; ++i) EXPECT_EQ(outside[static_cast<std::size_t>(i)], 77);
            for (std::size_t i = 0; i < context.continuous_rate().size(); ++i)
                EXPECT_EQ(context.continuous_rate()[i], i < static_cast<std::size_t>(n) ? -double(i) : 0.0);
        }
    }
}

/// y = a + b in two types that the wiring decides.
struct TwoTypes : Block {
    using Block::Block;
    Input<Any> a{this, "a"};
    Input<Other> b{this, "b"};
    Output<Any> y{this, "y"};
    Output<Other> z{this, "z"};
    OutputRule sum{this, Total{}, y, a, b};
    OutputRule other{this, Total{}, z, b};
};

TEST(Rules, AreThoseOfTheTypesThatTheWiringDecided) {
    for (int first = 0; first < type_count; ++first)
        for (int second = 0; second < type_count; ++second) {
            TwoTypes block;
            Resolution& r = block.resolution();
            const auto a = static_cast<Type>(first), b = static_cast<Type>(second);
            offer(r, block.a.index(), a);
            offer(r, block.b.index(), b);
            offer(r, block.a.index(), Size{2, 1, false});
            offer(r, block.b.index(), Size{2, 1, false});
            for (const int i : {block.y.index(), block.z.index()}) offer(r, i, Size{2, 1, false});
            propagate(block);
            Context context({{&block, methods_of<TwoTypes>(), std::vector<Node::End>(4), {}, 0}});
            write_values(context.data(0, block.a.index()), a, 2, {1, 0});
            write_values(context.data(0, block.b.index()), b, 2, {0, 1});
            for (int i = 0; i < 2; ++i) ASSERT_TRUE(context.task(0, Phase::output, i)());
            for (int i = 0; i < 2; ++i) {
                EXPECT_EQ(read_value(context.data(0, block.y.index()), a, i), 1) << name(a) << name(b);
                EXPECT_EQ(read_value(context.data(0, block.z.index()), b, i), i) << name(a) << name(b);
            }
        }
}

struct Adds : Block {
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", {.shape = shape}};
    Input<double> v{this, "v"};
    Output<> y{this, "y", {.shape = shape}};
    OutputRule rule{this, kernels::Add{}, y, u, v};
};

TEST(Rules, OfScalarsAreNoRulesOfArrays) {
    for (const int n : {1, 3}) {
        Adds block;
        offer(block.resolution(), block.u.index(), Size{n, 1, false});
        offer(block.resolution(), block.u.index(), Type::float64);
        propagate(block);
        Context context({{&block, methods_of<Adds>(), std::vector<Node::End>(3), {}, 0}});
        write_values(context.data(0, block.u.index()), Type::float64, n,
                     n == 1 ? Values{4} : Values{4, 5, 6});
        write_values(context.data(0, block.v.index()), Type::float64, 1, {10});
        ASSERT_TRUE(context.task(0, Phase::output, 0)());
        const auto* y = static_cast<const double*>(context.data(0, block.y.index()));
        EXPECT_EQ(Values(y, y + n), n == 1 ? Values{14} : (Values{14, 15, 16}));
    }
}

// ---- initial values of states

struct Begun : Block {
    using Block::Block;
    Dim n{this, "n"};
    Parameter<Vector> each{this, "each", {.shape = {n}, .initial = {1, 2, 3}}};
    Parameter<double> all{this, "all", {.initial = {9}}};
    DiscreteState<Vector> x{this, "x", {.shape = {n}, .initial_from = each.index()}};
    DiscreteState<Vector> w{this, "w", {.shape = {n}, .initial_from = all.index()}};
};

TEST(Reset, TakesInitialValuesFromTheQuantityThatAStateNames) {
    Begun block;
    offer(block.resolution(), block.each.index(), Size{3, 1, false});
    propagate(block);
    Context context({{&block, methods_of<Begun>(), std::vector<Node::End>(4), {}, 0}});
    ASSERT_TRUE(context.initialize(0));
    const auto at = [&](const auto& key) {
        const auto* x = static_cast<const double*>(context.data(0, key.index()));
        return Values(x, x + 3);
    };
    EXPECT_EQ(at(block.x), (Values{1, 2, 3}));
    EXPECT_EQ(at(block.w), (Values{9, 9, 9}));
}

// ---- objects

struct Saved {
    double value = 0;
    int state_size() const { return 1; }
    void save(double* to) const { *to = value; }
    void restore(const double* from) { value = *from; }
};
struct Wire {
    double value = 0;
};
struct Line {
    static constexpr const char* resource = "Line";
    using Live = Wire;
    static inline int opened = 0;
    std::shared_ptr<Wire> open() const { return ++opened, std::make_shared<Wire>(); }
};
struct Keeper : Block {
    using Block::Block;
    Output<double> y{this, "y"};
    Scratch<Values> scratch{this, [] { return Values{1, 2}; }};
    OutsideState<Saved> outside{this, [] { return std::make_shared<Saved>(); }};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[outside].value += 1;
        return ok;
    }
};
struct Source : Block {
    using Block::Block;
    Scratch<Values> before{this, [] { return Values{}; }};
    Provides<Line> line{this, [] { return std::make_shared<const Line>(); }};
};
struct Reader : Block {
    using Block::Block;
    Output<double> y{this, "y"};
    Requires<Line> line{this, "what to write"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[line].value += 1;
        return ok;
    }
};

struct Plant {
    Keeper keeper;
    std::array<Source, 2> sources;
    std::array<Reader, 2> readers;
    std::vector<Node> nodes;

    Plant() {
        for (Block* block :
             std::initializer_list<Block*>{&keeper, &sources[0], &sources[1], &readers[0], &readers[1]}) {
            for (const auto& p : block->declaration().provisions)
                block->resolution().provided.push_back(p.make());
            propagate(*block);
        }
        // The first reader has the second line, the second one the first.
        nodes = {{&keeper, methods_of<Keeper>(), {{}}, {}, 0},
                 {&sources[0], {}, {}, {}, 0},
                 {&sources[1], {}, {}, {}, 0},
                 {&readers[0], methods_of<Reader>(), {{}}, {{2, 0}}, 0},
                 {&readers[1], methods_of<Reader>(), {{}}, {{1, 0}}, 0}};
        Line::opened = 0;
    }
};

double output_of(Context& context, int node) {
    EXPECT_TRUE(context.task(node, Phase::output, 0)());
    return *static_cast<double*>(context.data(node, 0));
}

TEST(Objects, OfAProvisionAreOpenedOnceAndReachThoseWhoRequireIt) {
    Plant plant;
    Context context(plant.nodes);
    EXPECT_EQ(Line::opened, 2);
    EXPECT_EQ(output_of(context, 3), 1);
    EXPECT_EQ(output_of(context, 3), 2);
    EXPECT_EQ(output_of(context, 4), 1) << "another line";
    EXPECT_EQ(context.frame(3).objects[0], context.frame(2).objects[1]);
    EXPECT_EQ(context.frame(4).objects[0], context.frame(1).objects[1]);
}

TEST(Objects, ThatLiveOutsideAndCannotBeSavedMakeDevicesOfAllWhoUseThem) {
    Plant plant;
    EXPECT_EQ(Context(plant.nodes).devices(), (std::vector<int>{1, 2, 3, 4}));
    EXPECT_EQ(Context(plant.nodes).refuses_snapshot(), 1);
    plant.nodes[4].providers = {{2, 0}};
    EXPECT_EQ(Context(plant.nodes).devices(), (std::vector<int>{1, 2, 3, 4}));
    plant.nodes.resize(1);
    EXPECT_EQ(Context(plant.nodes).devices(), std::vector<int>());
    EXPECT_EQ(Context(plant.nodes).refuses_snapshot(), -1);
}

TEST(Objects, ThatCanBeSavedArePartOfASnapshot) {
    Plant plant;
    plant.nodes.resize(1);
    Context context(plant.nodes);
    EXPECT_EQ(output_of(context, 0), 1);
    std::vector<std::byte> saved(context.snapshot_size() + 1, std::byte{0x5a});
    context.save(saved.data());
    EXPECT_EQ(saved.back(), std::byte{0x5a}) << "the size is that of what is saved";
    EXPECT_EQ(output_of(context, 0), 2);
    context.restore(saved.data());
    EXPECT_EQ(*static_cast<double*>(context.data(0, 0)), 1);
    EXPECT_EQ(output_of(context, 0), 2);
}

TEST(Objects, MayBeSharedWithSomebodyOutside) {
    Plant plant;
    const auto wire = std::make_shared<Wire>();
    wire->value = 40;
    const auto open = [&] { return Object{wire, {}, {}, {}, true}; };
    plant.nodes[2].shared = {open};
    plant.nodes[4].providers.clear();
    plant.nodes[4].borrowed = {open};
    Context context(plant.nodes);
    EXPECT_EQ(Line::opened, 1);
    EXPECT_EQ(output_of(context, 3), 41) << "through the provision that is shared";
    EXPECT_EQ(output_of(context, 4), 42) << "borrowed";
}

TEST(Objects, RestoreLeavesTheNextStatesAtTheStates) {
    Both both;
    std::vector<std::byte> saved(both.context->snapshot_size());
    both.context->save(saved.data());
    both.run(0, Phase::update);
    both.context->restore(saved.data());
    both.context->commit(0);
    EXPECT_EQ(both.both(0, both.ruled.x), (Values{5, 5}));
}

} // namespace
} // namespace bf

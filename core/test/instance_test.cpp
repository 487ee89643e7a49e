// Claims about one block that runs by itself.
#include "bf/core/instance.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/events.hpp"

#include <gtest/gtest.h>

namespace bf {
namespace {

/// y[k] = gain u[k] + x[k], x[k+1] = x[k] + offset.
struct Ramp : Block {
    using Block::Block;
    Argument<int> rows{this, "rows", {.initial = 1, .minimum = 1, .doc = "rows"}};
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Input<double> offset{this, "offset", {.initial = {2}, .optional = true}};
    Output<Vector> y{this, "y", {.shape = {n}}};
    Parameter<double> gain{this, "gain", {.initial = {3}, .minimum = 0}};
    Parameter<Vector> x0{this, "x0", {.shape = {n}, .initial = {10}}};
    DiscreteState<Vector> x{this, "x", {.shape = {n}, .initial_from = x0.index()}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[gain] * at[u] + at[x];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[x].array() + at[offset] + (at.is_connected(offset) ? 100 : 0);
        return ok;
    }
};

/// What it starts from has two elements, so that it fits where n is 2.
struct Pair : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Input<Vector> v{this, "v", {.shape = {n}, .initial = {5, 6}, .optional = true}};
    DiscreteState<Vector> x{this, "x", {.shape = {n}, .initial = {3, 4}}};
};

struct Counter {
    int value = 0;
};
struct Account {
    static constexpr const char* resource = "Account";
    using Live = Counter;
    std::shared_ptr<Counter> open() const { return std::make_shared<Counter>(); }
};
struct Bank : Block {
    using Block::Block;
    Provides<Account> account{this, [] { return std::make_shared<const Account>(); }};
};
struct Customer : Block {
    using Block::Block;
    Requires<Account> account{this, "where to count"};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = ++at[account].value;
        return ok;
    }
};

template <class B> BlockClass class_of(const char* name) {
    Library library("test");
    library.group("test").add<B>(name, "A block.");
    return library.classes().front();
}

double* numbers(Instance& instance, const char* name) {
    return static_cast<double*>(instance.data(instance.resolution().find(name)));
}

template <class F> std::string refusal_of(F&& f) {
    try {
        f();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(Instance, StepsABlockWithoutADiagram) {
    const BlockClass type = class_of<Ramp>("Ramp");
    Instance ramp(type, {});
    ramp.wire(ramp.resolution().find("u"), Size{2, 1, false});
    ramp.settle();
    ramp.open();
    ASSERT_TRUE(ramp.reset());
    numbers(ramp, "u")[0] = 1;
    numbers(ramp, "u")[1] = -1;
    ASSERT_TRUE(ramp.run(Phase::output));
    EXPECT_EQ(numbers(ramp, "y")[0], 13);
    EXPECT_EQ(numbers(ramp, "y")[1], 7);
    ASSERT_TRUE(ramp.run(Phase::update));
    EXPECT_EQ(numbers(ramp, "x")[0], 10) << "before the commit";
    ramp.commit();
    EXPECT_EQ(numbers(ramp, "x")[0], 12);
}

/// What it holds open outside.
struct Device : Block {
    using Block::Block;
    static inline int open = 0;
    void start(Now) const override { ++open; }
    void stop(Now) const noexcept override { --open; }
};

TEST(Instance, ClosesWhatItsStartOpened) {
    const BlockClass type = class_of<Device>("Device");
    {
        Instance device(type, {});
        device.open();
        EXPECT_EQ(Device::open, 0);
        device.start();
        EXPECT_EQ(Device::open, 1);
    }
    EXPECT_EQ(Device::open, 0);
    {
        Instance never_started(type, {});
        never_started.open();
    }
    EXPECT_EQ(Device::open, 0);
}

TEST(Instance, ConnectsAnOptionalInputOnlyWhereItIsSaid) {
    const BlockClass type = class_of<Ramp>("Ramp");
    Instance ramp(type, {});
    ramp.settle();
    ramp.open([&](int input) { return input == ramp.resolution().find("offset"); });
    ASSERT_TRUE(ramp.reset());
    ASSERT_TRUE(ramp.run(Phase::update));
    ramp.commit();
    EXPECT_EQ(numbers(ramp, "x")[0], 112);
}

TEST(Instance, LeavesTheDeclarationAsTheBlockMadeIt) {
    const BlockClass type = class_of<Ramp>("Ramp");
    Instance ramp(type, {});
    const int gain = ramp.resolution().find("gain");
    ramp.give(gain, Value(5.0));
    ramp.settle();
    EXPECT_EQ(ramp.slot(gain).initial, std::vector<double>{5});
    EXPECT_EQ(ramp.declaration().slots[static_cast<std::size_t>(gain)].initial, std::vector<double>{3});
}

TEST(Instance, RefusesWrongValuesByName) {
    const BlockClass type = class_of<Ramp>("Ramp");
    EXPECT_EQ(refusal_of([&] {
                  Instance(type, {{"rows", Value(0.0)}});
              }),
              "argument 'rows' must be at least 1, but is 0");
    Instance ramp(type, {});
    const int gain = ramp.resolution().find("gain"), x0 = ramp.resolution().find("x0");
    EXPECT_EQ(refusal_of([&] { ramp.give(gain, Value(-1.0)); }),
              "parameter 'gain' must be at least 0, but is -1");
    EXPECT_EQ(refusal_of([&] { ramp.give(gain, Value("much")); }),
              "parameter 'gain' must be a number, not the text 'much'");
    EXPECT_TRUE(refusal_of([&] { ramp.open(); }).starts_with("the size of input 'u' cannot be found from"));
    ramp.give(x0, Value(Matrix(Matrix::Ones(3, 1))));
    EXPECT_TRUE(refusal_of([&] {
                    ramp.give(x0, Value(Matrix(Matrix::Ones(2, 1))));
                }).starts_with("parameter 'x0' does not fit: "));
}

TEST(Instance, RefusesInitialValuesOfAnotherSize) {
    const BlockClass type = class_of<Pair>("Pair");
    const auto opened = [&](int n, bool connects) {
        Instance pair(type, {});
        pair.wire(pair.resolution().find("u"), Size{n, 1, false});
        return refusal_of([&] { pair.open([&](int) { return connects; }); });
    };
    EXPECT_EQ(opened(2, false), "");
    EXPECT_EQ(opened(3, false), "the initial value of input 'v' has 2 elements, but needs 3");
    EXPECT_EQ(opened(3, true), "the initial value of discrete state 'x' has 2 elements, but needs 3");
}

TEST(Instance, RefusesMoreElementsThanCanBeCounted) {
    Slot matrix;
    matrix.name = "M";
    matrix.role = Role::output;
    matrix.size = {100'000, 100'000, true};
    EXPECT_EQ(wrong_size(matrix, false), "output 'M' is 100000x100000, more elements than can be counted");
    matrix.size.cols = 20'000;
    EXPECT_EQ(wrong_size(matrix, false), "");
}

TEST(Instance, KnowsHowManyBytesAQuantityHas) {
    struct Sized : Block {
        using Block::Block;
        Output<bool> flag{this, "flag"};
        Output<Vector> y{this, "y", {.shape = {3}}};
        Output<std::int16_t> count{this, "count"};
    };
    const BlockClass type = class_of<Sized>("Sized");
    Instance sized(type, {});
    sized.settle();
    EXPECT_EQ(sized.bytes_of(0), 1u);
    EXPECT_EQ(sized.bytes_of(1), 24u);
    EXPECT_EQ(sized.bytes_of(2), 2u);
}

TEST(Instance, AFailureEndsThePhase) {
    struct Fails : Block {
        using Block::Block;
        Output<double> y{this, "y"};
        Status output(Now, Out out) const noexcept override {
            out[y] = 1;
            return Status::failure("no");
        }
    };
    const BlockClass type = class_of<Fails>("Fails");
    Instance fails(type, {});
    fails.settle();
    fails.open();
    EXPECT_EQ(fails.run(Phase::output).text(), "no");
    EXPECT_TRUE(fails.run(Phase::update));
}

TEST(Instance, GivesStatesTheSizeOfTheirInitialValueWhereNothingElseDecides) {
    const BlockClass type = class_of<Ramp>("Ramp");
    Instance ramp(type, {});
    ramp.give(ramp.resolution().find("x0"), Value(Matrix(Matrix::Ones(3, 1))));
    ramp.settle();
    EXPECT_EQ(ramp.slot(ramp.resolution().find("u")).size, (Size{3, 1, false}));
}

TEST(Instance, BorrowsTheLiveObjectOfAnother) {
    const BlockClass bank_class = class_of<Bank>("Bank"), customer_class = class_of<Customer>("Customer");
    Instance bank(bank_class, {});
    bank.open();
    EXPECT_EQ(bank.resolution().find_provided("Account"), bank.resolution().provided[0].get());
    EXPECT_EQ(bank.resolution().find_provided("Bank"), nullptr);
    const auto customer = [&] {
        auto made = std::make_unique<Instance>(customer_class, Arguments{});
        made->require(0, bank.resolution().provided[0], [&] { return bank.object(0); });
        made->open();
        return made;
    };
    const auto one = customer(), other = customer();
    ASSERT_TRUE(one->run(Phase::output));
    ASSERT_TRUE(other->run(Phase::output));
    EXPECT_EQ(*numbers(*other, "y"), 2);
}

struct Answering : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    DiscreteState<double> n{this, "n", {.initial = {5}}};
    ContinuousState<double> x{this, "x", {.initial = {-1}}};
    Guard g{this, "g"};
    EventRule stop{this, kernels::StoppedState{}, after(x), g, g, Constants({0}), u, Constants({0}), x};
    EventRule sum{this, kernels::Add{}, after(n), after(x), n};
};

TEST(Rules, OfAnEventReadWhatThoseBeforeThemWroteAndTakeEffectTogether) {
    const auto type = class_of<Answering>("Answering");
    Instance run(type, {});
    run.settle();
    run.open();
    ASSERT_TRUE(run.reset());
    const auto at = [&](const auto& key) -> double& { return *static_cast<double*>(run.data(key.index())); };
    const auto& block = static_cast<const Answering&>(run.block());
    EXPECT_TRUE(block.answers(type.methods));
    at(block.u) = 7;
    at(block.g) = 1;
    ASSERT_TRUE(run.event());
    EXPECT_EQ(at(block.x), 7);
    EXPECT_EQ(at(block.n), 12);
    at(block.g) = 0;
    ASSERT_TRUE(run.event());
    EXPECT_EQ(at(block.x), 7) << "no guard crossed";
    EXPECT_EQ(at(block.n), 19);
}

} // namespace
} // namespace bf

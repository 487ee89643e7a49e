// Claims about what is decided where values and signals leave it open.
#include "bf/core/resolve.hpp"

#include "bf/core/block.hpp"
#include "bf/kernels/elementwise.hpp"

#include <gtest/gtest.h>

namespace bf {
namespace {

TEST(Size, IsWrittenAsWhatItIs) {
    EXPECT_EQ((Size{1, 1, false}).text(), "scalar");
    EXPECT_EQ((Size{1, 1, true}).text(), "1x1");
    EXPECT_EQ((Size{3, 1, false}).text(), "[3]");
    EXPECT_EQ((Size{3, 1, true}).text(), "3x1");
    EXPECT_EQ((Size{2, 3, true}).text(), "2x3");
}

/// K has a shape of its own, limits share that of u, table is kept as it is written.
struct Given : Block {
    using Block::Block;
    AnyShape wired{this}, own{this};
    Input<> u{this, "u", {.shape = wired}};
    Output<> y{this, "y", {.shape = wired}};
    Parameter<> limit{this, "limit", {.shape = wired, .initial = {1}}};
    Parameter<> K{this, "K", {.shape = own, .initial = {1, 2}}};
    Parameter<Matrix> M{this, "M", {.shape = {2, 2}}};
    Parameter<std::int8_t> count{this, "count"};
    OutputRule rule{this, kernels::Add{}, y, u, limit};
};

Value value(int rows, int cols, Type type = Type::float64) {
    Value made(Matrix(Matrix::Ones(rows, cols)));
    made.type = type;
    return made;
}

TEST(Give, AParameterWithAShapeOfItsOwnHasTheSizeOfItsValue) {
    const auto size = [](int rows, int cols) {
        Given block;
        give(block.resolution(), block.K.index(), value(rows, cols));
        return block.resolution().slots[static_cast<std::size_t>(block.K.index())].size.text();
    };
    EXPECT_EQ(size(1, 1), "scalar");
    EXPECT_EQ(size(3, 1), "[3]");
    EXPECT_EQ(size(1, 3), "[3]") << "rows are 1-D signals, too";
    EXPECT_EQ(size(2, 3), "2x3");
}

TEST(Give, OneElementExpandsWhereAnInputSharesTheShape) {
    Given block;
    Resolution& r = block.resolution();
    give(r, block.limit.index(), Value(5.0));
    EXPECT_FALSE(r.slots[static_cast<std::size_t>(block.limit.index())].size_known);
    offer(r, block.u.index(), Size{4, 1, false});
    propagate(block);
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.limit.index())].size.text(), "[4]");
    Given other;
    give(other.resolution(), other.limit.index(), value(3, 1));
    propagate(other);
    EXPECT_EQ(other.resolution().slots[static_cast<std::size_t>(other.u.index())].size.text(), "[3]");
}

TEST(Give, AMatrixIsRefusedAsAnotherSize) {
    Given block;
    try {
        give(block.resolution(), block.M.index(), value(2, 3));
        FAIL();
    } catch (const ResolutionError& error) {
        EXPECT_STREQ(error.what(), "parameter 'M' has length 2, but is wired to length 3");
    }
}

TEST(Give, ATypedValueDecidesTheTypeOfWhatSharesIt) {
    const auto type_of = [](Type given) {
        Given block;
        give(block.resolution(), block.limit.index(), value(1, 1, given));
        propagate(block);
        return block.resolution().type_of(block.u.index());
    };
    EXPECT_EQ(type_of(Type::int16), Type::int16);
    EXPECT_EQ(type_of(Type::float64), std::nullopt) << "numbers as they are written fit any type";
    Given block;
    give(block.resolution(), block.M.index(), value(2, 2, Type::int8));
    EXPECT_EQ(block.resolution().type_of(block.M.index()), Type::float64) << "declared";
}

TEST(Give, DefaultsHaveTheSizeOfTheirElementsWhereNothingElseDecides) {
    Given block;
    Resolution& r = block.resolution();
    give_defaults(r);
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.K.index())].size.text(), "[2]");
    EXPECT_FALSE(r.slots[static_cast<std::size_t>(block.limit.index())].size_known);
    Given other;
    give(other.resolution(), other.K.index(), value(3, 1));
    give_defaults(other.resolution());
    EXPECT_EQ(other.resolution().slots[static_cast<std::size_t>(other.K.index())].size.text(), "[3]");
}

struct Weighted : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Parameter<Vector> w{this, "w", {.shape = {n}, .initial = {1}}};
};

TEST(Give, AParameterThatHasDecidedALengthIsNamedWhereItIsContradicted) {
    Weighted block;
    Resolution& r = block.resolution();
    give(r, block.w.index(), value(2, 1));
    try {
        offer(r, block.u.index(), Size{3, 1, false});
        propagate(block);
        FAIL() << "taken";
    } catch (const ResolutionError& error) {
        EXPECT_STREQ(error.what(), "input 'u' needs n = 3, but n is already 2, as parameter 'w' has it");
    }
}

TEST(Limits, OfATypeTellTheRemedyWhereSignalsDecidedIt) {
    Given block;
    Resolution& r = block.resolution();
    const Slot& limit = r.slots[static_cast<std::size_t>(block.limit.index())];
    EXPECT_EQ(outside_remedy(limit), "") << "the type is not known yet";
    EXPECT_EQ(outside_limits(limit, {300}), "");
    offer(r, block.u.index(), Type::uint8);
    propagate(block);
    EXPECT_EQ(outside_limits(limit, {300}),
              "parameter 'limit' must be a whole number from 0 to 255, but is 300");
    EXPECT_EQ(outside_remedy(limit),
              "the parameter has the type of its signals, uint8: give a value of that type, or convert the "
              "signals before the block with a Convert block");
    EXPECT_EQ(outside_remedy(r.slots[static_cast<std::size_t>(block.M.index())]), "");
    EXPECT_EQ(outside_remedy(r.slots[static_cast<std::size_t>(block.count.index())]), "")
        << "no signal decides the type of a parameter that has one";
    Given of_double;
    offer(of_double.resolution(), of_double.u.index(), Type::float64);
    propagate(of_double);
    EXPECT_EQ(outside_remedy(of_double.resolution().slots[static_cast<std::size_t>(of_double.limit.index())]),
              "");
}

TEST(Offer, SaysWhetherItTaughtSomething) {
    Given block;
    Resolution& r = block.resolution();
    EXPECT_TRUE(offer(r, block.u.index(), Size{4, 1, false}));
    EXPECT_FALSE(offer(r, block.u.index(), Size{4, 1, false}));
    EXPECT_FALSE(offer(r, block.y.index(), Size{4, 1, true})) << "a column has the same elements";
    EXPECT_TRUE(offer(r, block.u.index(), Type::int8));
    EXPECT_FALSE(offer(r, block.y.index(), Type::int8));
    EXPECT_TRUE(offer(r, block.M.index(), Size{2, 2, true}));
    EXPECT_FALSE(offer(r, block.M.index(), Size{2, 2, true}));
    EXPECT_FALSE(offer(r, block.M.index(), Type::float64));
    EXPECT_TRUE(propagate(block)) << "the size reaches y and the limit";
    EXPECT_FALSE(propagate(block));
}

TEST(Propagate, NamesTheQuantityOfATypeThatARuleIsNotDefinedForWhereverItStands) {
    struct OutputFirst : Block {
        AnyShape shape{this};
        Output<> y{this, "y", {.shape = shape}};
        Input<> u{this, "u", {.shape = shape}};
        OutputRule rule{this, kernels::Add{}, y, u, u};
    };
    OutputFirst block;
    offer(block.resolution(), block.u.index(), Type::boolean);
    try {
        propagate(block);
        FAIL();
    } catch (const ResolutionError& error) {
        EXPECT_STREQ(error.what(),
                     "output 'y' cannot be of type boolean, for which this operation is not defined; "
                     "insert a Convert block");
    }
}

/// A chain of blocks' own rules, the last of which decides first: even of no elements.
struct Chain : Block {
    using Block::Block;
    Dim first{this, "first"}, second{this, "second"}, third{this, "third"};
    Output<Vector> z{this, "z", {.shape = {third}}};
    Output<Vector> y{this, "y", {.shape = {second}}};
    Input<Vector> u{this, "u", {.shape = {first}}};
    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(y.index())) inference.set(z.index(), *size);
        if (const Size* size = inference.size(u.index())) inference.set(y.index(), *size);
    }
};

TEST(Propagate, AsksAgainUntilNothingMoreIsLearned) {
    for (const int length : {0, 1, 3}) {
        Chain block;
        Resolution& r = block.resolution();
        EXPECT_FALSE(propagate(block));
        EXPECT_TRUE(offer(r, block.u.index(), Size{length, 1, false}));
        EXPECT_TRUE(propagate(block)) << length;
        EXPECT_TRUE(unresolved(r).empty()) << length;
        EXPECT_EQ(r.slots[0].size, (Size{length, 1, false}));
    }
}

/// A state that begins at what an input or a parameter says.
struct Remembers : Block {
    using Block::Block;
    AnyShape shape{this}, of_initial{this}, foreign{this};
    Input<> u{this, "u", {.shape = shape}};
    Input<> apart{this, "apart", {.shape = foreign}};
    Input<> other{this, "other", {.shape = of_initial}};
    Parameter<> x0{this, "x0", {.shape = of_initial, .initial = {0}}};
    DiscreteState<> x{this, "x", {.shape = shape, .initial_from = x0.index()}};
};

TEST(Settle, AStateGivesTheSizeOfItsInitialValueToWhatIsAlikeAlone) {
    Remembers block;
    Resolution& r = block.resolution();
    const Slot& state = r.slots[static_cast<std::size_t>(block.x.index())];
    EXPECT_EQ(sized_by_initial(r, state), std::vector<int>()) << "its own size is not known yet";
    give(r, block.x0.index(), value(3, 1));
    propagate(block);
    EXPECT_EQ(sized_by_initial(r, state), std::vector<int>{block.u.index()});
    EXPECT_EQ(sized_by_initial(r, r.slots[0]), std::vector<int>()) << "no state";
    settle_sizes(block);
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.u.index())].size.text(), "[3]");
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.apart.index())].size.text(), "scalar");
    settle_types(block);
    EXPECT_TRUE(unresolved(r).empty());
    EXPECT_EQ(state.type, Type::float64);
}

TEST(Settle, WhatOneDecisionSaysOfOthersGoesBeforeTheirs) {
    struct Longer : Block {
        Dim n{this, "n"};
        Input<Vector> u{this, "u", {.shape = {n}}};
        Input<Vector> longer{this, "longer", {.shape = {n + 1}}};
    };
    Longer block;
    settle_sizes(block);
    EXPECT_EQ(block.resolution().slots[0].size.text(), "scalar");
    EXPECT_EQ(block.resolution().slots[1].size.text(), "[2]");
}

TEST(Settle, WhatNothingDecidesIsAScalarOrAsLargeAsItsDefault) {
    Given block;
    settle_sizes(block);
    Resolution& r = block.resolution();
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.u.index())].size.text(), "scalar");
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.y.index())].size.text(), "scalar");
    EXPECT_EQ(r.slots[static_cast<std::size_t>(block.K.index())].size.text(), "[2]");
    struct Alone : Block {
        AnyShape own{this};
        Parameter<> K{this, "K", {.shape = own, .initial = {1, 2}}};
    };
    Alone alone;
    settle_sizes(alone);
    EXPECT_EQ(alone.resolution().slots[0].size.text(), "[2]") << "the first of all quantities, too";
}

} // namespace
} // namespace bf

#include "bf/core/context.hpp"
#include "bf/core/kept_text.hpp"
#include "bf/core/resolve.hpp"

#include "bf/kernels/elementwise.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <memory>

namespace bf {
namespace {

// ---- units: the compiler is the test

static_assert(unit<"kg.m2/s2"> == unit<"Nm">);
static_assert(unit<"N.m"> == unit<"J">);
static_assert(unit<"1/s"> == unit<"Hz">);
static_assert(unit<"rad/s"> != unit<"Hz">);
static_assert(unit<"V.A"> == unit<"W">);
static_assert(unit<"Ohm.F"> == unit<"s">);
static_assert(unit<"H/Ohm"> == unit<"s">);
static_assert(unit<"m"> != unit<"s">);
static_assert(Unit{} == unit<"1">);
static_assert(!unit<"m">.agrees_with(unit<"rad">));
static_assert(unit<"m">.agrees_with(any_unit) && mixed_units.agrees_with(unit<"m">));

// ---- arguments

struct Arguable : Block {
    using Block::Block;
    Argument<double> number{this, "number", {.initial = 1.5}};
    Argument<int> whole{this, "whole", {.initial = 2}};
    Argument<bool> flag{this, "flag", {.initial = true}};
    Argument<std::string> mode{this, "mode", {.initial = "slow", .choices = {"slow", "fast"}}};
    Argument<Matrix> matrix{this, "matrix", {.initial = Matrix::Identity(2, 2)}};
    Argument<std::vector<double>> vector{this, "vector", {.initial = {1, 2}}};
    Argument<std::vector<int>> wholes{this, "wholes", {.initial = {1, 2}}};
    Argument<std::vector<std::string>> texts{this, "texts", {.initial = {"a"}}};
    Argument<double> positive{this, "positive", {.initial = 1, .above = 0}};
    Argument<int> few{this, "few", {.initial = 2, .minimum = 1, .maximum = 4}};
    Argument<std::vector<double>> shares{this, "shares", {.minimum = 0, .maximum = 1}};
    Argument<Matrix> most{this, "most", {.maximum = 9}};
};

std::string problem(const char* name, const Value& value) {
    const Arguments arguments{{name, value}};
    const Arguable block(arguments);
    return block.declaration().problems.empty() ? "" : block.declaration().problems.front();
}

TEST(Argument, TakesItsDefaultAndDescribesIt) {
    const Arguable block;
    EXPECT_EQ(*block.number, 1.5);
    EXPECT_EQ(*block.mode, "slow");
    EXPECT_TRUE(block.declaration().problems.empty());
    ASSERT_EQ(block.declaration().arguments.size(), 12u);
    EXPECT_EQ(block.declaration().arguments[3].choices, (std::vector<std::string>{"slow", "fast"}));
    EXPECT_EQ(block.declaration().arguments[0].initial.data, (std::vector<double>{1.5}));
}

TEST(Argument, TakesWhatIsGiven) {
    const Arguments arguments{{"number", 3}, {"whole", 4},    {"flag", false}, {"mode", "fast"},
                              {"matrix", 5}, {"vector", 6.5}, {"wholes", 7},   {"texts", "b"}};
    const Arguable block(arguments);
    EXPECT_TRUE(block.declaration().problems.empty());
    EXPECT_EQ(*block.number, 3);
    EXPECT_EQ(*block.whole, 4);
    EXPECT_FALSE(*block.flag);
    EXPECT_EQ(*block.mode, "fast");
    EXPECT_EQ(*block.matrix, Matrix::Constant(1, 1, 5));
    EXPECT_EQ(*block.vector, (std::vector<double>{6.5}));
    EXPECT_EQ(*block.wholes, (std::vector<int>{7}));
    EXPECT_EQ(*block.texts, (std::vector<std::string>{"b"}));
}

TEST(Argument, RefusesEveryWrongKind) {
    const Value text("abc"), matrix(Matrix(Matrix::Zero(2, 3)));
    EXPECT_EQ(problem("number", text), "argument 'number' must be a number, not the text 'abc'");
    EXPECT_EQ(problem("number", matrix), "argument 'number' must be a number, not a 2x3 matrix");
    EXPECT_EQ(problem("whole", 2.5), "argument 'whole' must be a whole number, not 2.5");
    EXPECT_EQ(problem("whole", 1e12), "argument 'whole' must be a whole number of less than 2^31, not 1e+12");
    EXPECT_EQ(problem("flag", 2), "argument 'flag' must be true or false, not 2");
    EXPECT_EQ(problem("mode", true), "argument 'mode' must be a text, not true");
    EXPECT_EQ(problem("matrix", text), "argument 'matrix' must be a matrix, not the text 'abc'");
    EXPECT_EQ(problem("vector", matrix), "argument 'vector' must be a vector, not a 2x3 matrix");
    EXPECT_EQ(problem("wholes", 0.5), "argument 'wholes' must be a vector of whole numbers, not 0.5");
    EXPECT_EQ(problem("texts", 1), "argument 'texts' must be a list of texts, not 1");
    EXPECT_EQ(problem("number", std::vector<std::string>{"a", "b"}),
              "argument 'number' must be a number, not a list of 2 texts");
}

TEST(Argument, NamesItsChoices) {
    EXPECT_EQ(problem("mode", "quick"), "argument 'mode' is 'quick', but must be one of 'slow', 'fast'");
}

TEST(Argument, KeepsItsLimits) {
    EXPECT_EQ(problem("positive", 0), "argument 'positive' must be greater than 0, but is 0");
    EXPECT_EQ(problem("positive", 1e-300), "");
    EXPECT_EQ(problem("positive", NAN), "argument 'positive' must be greater than 0, but is NaN");
    EXPECT_EQ(problem("number", NAN), "") << "without limits it is a number like any other";
    EXPECT_EQ(problem("few", 1), "");
    EXPECT_EQ(problem("few", 4), "");
    EXPECT_EQ(problem("few", 5), "argument 'few' must be from 1 to 4, but is 5");
    EXPECT_EQ(problem("shares", Value(Matrix{{0.5, 1.0, 1.5}})),
              "argument 'shares' must be from 0 to 1, but element 3 is 1.5");
    EXPECT_EQ(problem("most", Value(Matrix{{1.0, 2.0}, {10.0, 3.0}})),
              "argument 'most' must be at most 9, but element 2 is 10");
    const Arguments arguments{{"few", -3}};
    EXPECT_EQ(*Arguable(arguments).few, 2) << "the default, for ports that follow from it";
}

TEST(Argument, NamesAFileBesideTheModelAlsoWhenTheBlockIsMade) {
    struct Reader : Block {
        using Block::Block, Block::path_of;
    };
    auto arguments = std::make_unique<Arguments>();
    arguments->folder = "/models/arm";
    const Reader reader(*arguments);
    arguments.reset();
    EXPECT_EQ(reader.path_of("table.csv"), "/models/arm/table.csv");
    EXPECT_EQ(reader.path_of("../table.csv"), "/models/table.csv");
    EXPECT_EQ(reader.path_of("/table.csv"), "/table.csv");
    EXPECT_EQ(Reader().path_of("table.csv"), "table.csv");
}

// ---- limits

TEST(Limits, SayWhatIsAllowedAndWhatIsNot) {
    EXPECT_EQ(text_of({}), "");
    EXPECT_EQ(text_of({.minimum = 0}), "at least 0");
    EXPECT_EQ(text_of({.above = 0}), "greater than 0");
    EXPECT_EQ(text_of({.maximum = 0.1}), "at most 0.1");
    EXPECT_EQ(text_of({.minimum = -1, .maximum = 1}), "from -1 to 1");
    EXPECT_EQ(text_of({.above = 0, .maximum = 1}), "greater than 0 and at most 1");
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(outside({.above = 0}, {1, infinity}), "");
    EXPECT_EQ(outside({.minimum = 0}, {-infinity}), "must be at least 0, but is -inf");
    EXPECT_EQ(outside({.maximum = 1}, {std::nextafter(1, 2)}),
              "must be at most 1, but is 1.0000000000000002");
    EXPECT_EQ(outside({.minimum = 0, .maximum = 1}, {0, 1, NAN}),
              "must be from 0 to 1, but element 3 is NaN");
    EXPECT_EQ(outside({}, {NAN}), "must be a number, but is NaN");
}

TEST(Limits, BelongToParametersAlone) {
    struct Limited : Block {
        Parameter<double> p{this, "p", {.initial = {1}, .minimum = 0, .maximum = 2}};
        Input<double> u{this, "u", {.minimum = 0}};
    };
    const Limited block;
    const auto& slots = block.resolution().slots;
    EXPECT_EQ(text_of(slots[0].limits), "from 0 to 2");
    EXPECT_FALSE(slots[1].limits.are_given());
    EXPECT_EQ(outside_limits(slots[0], {3}), "parameter 'p' must be from 0 to 2, but is 3");
    EXPECT_EQ(outside_limits(slots[0], {3}, "a.b.p"), "parameter 'a.b.p' must be from 0 to 2, but is 3");
}

TEST(Limits, HoldOneParameterToAnother) {
    struct Interval : Block {
        AnyShape n{this}, m{this};
        Parameter<> lower{this, "lower", {.shape = n, .initial = {0}}};
        Parameter<> upper{this, "upper", {.shape = m, .initial = {1}, .at_least = lower.index()}};
    };
    const auto wrong = [](const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
        Interval block;
        Resolution& r = block.resolution();
        give(r, block.lower.index(), Matrix(lower));
        give(r, block.upper.index(), Matrix(upper));
        propagate(block);
        EXPECT_EQ(below_another(r, block.lower.index()), "");
        return below_another(r, block.upper.index());
    };
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(wrong(Eigen::VectorXd::Constant(1, 1), Eigen::VectorXd::Constant(1, 1)), "");
    EXPECT_EQ(wrong(Eigen::Vector2d(1, -infinity), Eigen::Vector2d(infinity, -infinity)), "");
    EXPECT_EQ(wrong(Eigen::VectorXd::Constant(1, 2), Eigen::VectorXd::Constant(1, 1)),
              "parameter 'upper' must be at least 'lower', but 1 is below 2");
    EXPECT_EQ(wrong(Eigen::Vector2d(0, 2), Eigen::VectorXd::Constant(1, 1)),
              "parameter 'upper' must be at least 'lower', but 1 is below 2 (element 2)");
    EXPECT_EQ(wrong(Eigen::VectorXd::Constant(1, 0.5), Eigen::Vector2d(1, 0.25)),
              "parameter 'upper' must be at least 'lower', but 0.25 is below 0.5 (element 2)");
}

// ---- sizes and types

struct Shaped : Block {
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> a{this, "a", {.shape = {n}}};
    Input<Vector> b{this, "b", {.shape = {n + 6}}};
    Input<Vector3> fixed{this, "fixed"};
    Output<Matrix> M{this, "M", {.shape = {n, n}}};
};

struct Typed : Block {
    using Block::Block;
    AnyShape shape{this};
    Input<> u{this, "u", {.shape = shape}};
    Input<> v{this, "v", {.shape = shape}};
    Output<> y{this, "y", {.shape = shape}};
    OutputRule rule{this, kernels::Add{}, y, u, v};
};

template <class F> std::string error_of(F&& f) {
    try {
        f();
    } catch (const ResolutionError& error) {
        return error.what();
    }
    return "";
}

TEST(Resolution, SpreadsALengthToAllThatNameIt) {
    Shaped block;
    EXPECT_TRUE(offer(block.resolution(), 0, Size{5, 1, false}));
    propagate(block);
    EXPECT_TRUE(unresolved(block.resolution()).empty());
    EXPECT_EQ(block.resolution().slots[1].size, (Size{11, 1, false}));
    EXPECT_EQ(block.resolution().slots[3].size, (Size{5, 5, true}));
}

TEST(Resolution, KnowsSignalsWithoutElements) {
    Shaped block;
    EXPECT_TRUE(offer(block.resolution(), 0, Size{0, 1, false}));
    propagate(block);
    EXPECT_TRUE(unresolved(block.resolution()).empty());
    EXPECT_EQ(block.resolution().slots[1].size, (Size{6, 1, false}));
    EXPECT_EQ(block.resolution().slots[3].size, (Size{0, 0, true}));
    EXPECT_EQ(error_of([&] {
                  offer(block.resolution(), 1, Size{7, 1, false});
              }),
              "input 'b' needs n = 1, but n is already 0");
    Shaped other;
    EXPECT_EQ(error_of([&] {
                  offer(other.resolution(), 1, Size{5, 1, false});
              }),
              "input 'b' has at least 6 elements, but is wired to length 5");
}

/// Its first quantity has the size of its second one, by the block's own rule.
struct Infers : Block {
    using Block::Block;
    AnyShape of_y{this}, of_u{this};
    Output<Vector> y{this, "y", {.shape = of_y}};
    Input<Vector> u{this, "u", {.shape = of_u}};
    void infer(Inference& inference) const override {
        if (const Size* size = inference.size(u.index())) inference.set(y.index(), *size);
    }
};

TEST(Resolution, TakesTheSizesThatABlockInfers) {
    Infers block;
    offer(block.resolution(), 1, Size{3, 1, false});
    propagate(block);
    EXPECT_EQ(block.resolution().slots[0].size, (Size{3, 1, false}));
}

TEST(Resolution, NamesWhatContradictsALength) {
    Shaped block;
    auto& r = block.resolution();
    offer(r, 0, Size{5, 1, false});
    EXPECT_EQ(error_of([&] {
                  offer(r, 1, Size{10, 1, false});
              }),
              "input 'b' needs n = 4, but n is already 5");
    EXPECT_EQ(error_of([&] {
                  offer(r, 2, Size{4, 1, false});
              }),
              "input 'fixed' has length 3, but is wired to length 4");
    EXPECT_EQ(error_of([&] {
                  offer(r, 0, Size{5, 2, true});
              }),
              "input 'a' is a 1-D signal, but is wired to a 5x2 matrix");
}

TEST(Resolution, TakesAColumnWhereA1DSignalIsDeclared) {
    Shaped block;
    offer(block.resolution(), 0, Size{5, 1, true});
    EXPECT_FALSE(block.resolution().slots[0].size.is_matrix);
}

TEST(Resolution, ListsWhatIsUnknown) {
    Shaped block;
    propagate(block);
    EXPECT_EQ(unresolved(block.resolution()), (std::vector<int>{0, 1, 3}));
}

TEST(Resolution, KeepsOneTypeAndSizeAmongLikeQuantities) {
    Typed block;
    auto& r = block.resolution();
    offer(r, 0, Type::int8);
    EXPECT_EQ(
        error_of([&] { offer(r, 1, Type::float64); }),
        "input 'v' must be of type int8 like the other quantities of its kind, but is wired to type double; "
        "insert a Convert block");
    offer(r, 0, Size{3, 1, false});
    EXPECT_EQ(
        error_of([&] {
            offer(r, 1, Size{4, 1, false});
        }),
        "input 'v' must have size [3] like the other quantities of its shape, but is wired to size [4]");
    propagate(block);
    EXPECT_EQ(r.slots[2].type, Type::int8);
}

TEST(Resolution, RefusesATypeThatARuleIsNotDefinedFor) {
    Typed block;
    offer(block.resolution(), 0, Type::boolean);
    EXPECT_EQ(error_of([&] { propagate(block); }), "output 'y' cannot be of type boolean, for which this "
                                                   "operation is not defined; insert a Convert block");
}

TEST(Resolution, RefusesAnotherTypeThanTheDeclaredOne) {
    Shaped block;
    EXPECT_EQ(error_of([&] { offer(block.resolution(), 0, Type::boolean); }),
              "input 'a' is of type double, but is wired to type boolean; insert a Convert block");
}

TEST(Status, TakesTextsFromOutsideAsTheyAre) {
    char kept[12];
    keep_text(kept, "a {} b {element}");
    EXPECT_EQ(Status::failure(kept, 3, 4).text(), "a () b (ele");
    keep_text(kept, "");
    EXPECT_EQ(Status::failure(kept).text(), "");
}

TEST(Status, FillsIntegersIntoItsText) {
    EXPECT_EQ(Status::failure("H({}, {}) is not finite", 3, 4).text(), "H(3, 4) is not finite");
    EXPECT_EQ(ok.text(), "ok");
    EXPECT_TRUE(ok);
}

struct Named : Block {
    using Block::Block;
    Dim n{this, "n", []() -> Dim::Names { return std::vector<std::string>{"hip", "knee"}; }};
    Dim m{this, "m"};
    Input<Vector> u{this, "u", {.shape = {n}}};
    Input<Vector> v{this, "v", {.shape = {m}}};
    Input<Vector> longer{this, "longer", {.shape = {n + 6}}};
    Input<Matrix> M{this, "M", {.shape = {n, m}}};
};

TEST(Dim, HasAsManyElementsAsNames) {
    Named block;
    offer(block.resolution(), block.v.index(), Size{3, 1, false});
    propagate(block);
    const auto& d = block.declaration();
    EXPECT_EQ(block.resolution().slots[0].size.text(), "[2]");
    EXPECT_EQ(d.element_names(block.u.index()), (std::vector<std::string>{"hip", "knee"}));
    EXPECT_TRUE(d.element_names(block.v.index()).empty());
    EXPECT_TRUE(d.element_names(block.longer.index()).empty());
    EXPECT_TRUE(d.element_names(block.M.index()).empty());
}

TEST(Status, NamesTheElementThatItIsAbout) {
    Named block;
    offer(block.resolution(), block.v.index(), Size{3, 1, false});
    propagate(block);
    const auto text = [&](const auto& quantity, int element) {
        return Status::failure("{element} is not finite", quantity, element).text(&block.resolution());
    };
    EXPECT_EQ(text(block.u, 1), "u[knee] is not finite");
    EXPECT_EQ(text(block.v, 2), "v[3] is not finite");
    EXPECT_EQ(text(block.M, 5), "M[2][3] is not finite");
    EXPECT_EQ(Status::failure("{element} is not finite", block.v, 2).text(), "element 3 is not finite");
}

struct HasDefaults : Block {
    using Block::Block;
    Input<double> a{this, "a", {.initial = {2}, .optional = true}};
    Input<double> b{this, "b", {.initial = {3}, .optional = true}};
    Output<double> y{this, "y"};
};

TEST(Context, GivesOpenInputsTheirDefaultsWhateverIsWiredElsewhere) {
    HasDefaults open, wired;
    propagate(open);
    propagate(wired);
    const Context context({{&open, {}, {{}, {}, {}}, {}, 0}, {&wired, {}, {{}, {0, 2}, {}}, {}, 0}});
    const auto value = [&](int node, int slot) {
        return *static_cast<const double*>(context.data(node, slot));
    };
    EXPECT_EQ(value(0, 0), 2);
    EXPECT_EQ(value(0, 1), 3);
    EXPECT_EQ(value(1, 0), 2);
    EXPECT_EQ(context.data(1, 1), context.data(0, 2)) << "a wire is the memory of its source";
}

TEST(Types, KeepTheirNames) {
    for (int i = 0; i < type_count; ++i)
        EXPECT_EQ(type_from_name(name(static_cast<Type>(i))), static_cast<Type>(i));
    EXPECT_FALSE(type_from_name("float"));
}

} // namespace
} // namespace bf

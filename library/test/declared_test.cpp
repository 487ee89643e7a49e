#include "bf/library/declared.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace bf {
namespace {

struct Grid {
    static constexpr const char* resource = "Grid";
    struct Live {};
    std::shared_ptr<Live> open() const { return std::make_shared<Live>(); }
};

/// Has something of everything that is shown.
class Valve final : public Block {
  public:
    using Block::Block;
    Argument<bool> inverted{this, "inverted", {.initial = false, .doc = "closes instead"}};
    Argument<std::string> law{
        this,
        "law",
        {.initial = "linear", .doc = "of the opening", .choices = {"linear", "square", "cubic"}}};
    Argument<std::vector<std::string>> outlets{this, "outlets", {.doc = "further ones"}};
    Argument<std::vector<std::string>> stages{this, "stages", {.initial = {"a", "b"}, .doc = "in turn"}};
    Argument<Matrix> table{
        this, "table", {.initial = Matrix{{1, -0.0}, {0.5, 4}}, .minimum = 0, .doc = "flow over opening"}};
    Argument<double> most{
        this, "most", {.initial = std::numeric_limits<double>::infinity(), .above = 0, .doc = "flow"}};
    Argument<int> seed{this, "seed", {.doc = "of the noise", .from_path = true}};

    Requires<Grid> grid{this, "where it stands"};
    Provides<Grid> cell{this, [] { return std::make_shared<const Grid>(); }};

    Dim n{this, "n"};
    AnyShape any{this};
    Input<double> opening{this, "opening", {.unit = unit<"rad">, .doc = "of the valve"}};
    Input<double> bias{this, "bias", {.initial = {0.25}, .doc = "added", .optional = true}};
    Input<Vector> back{this, "back", {.shape = {n}, .doc = "flow back", .present = *inverted}};
    Input<double> meter{this, "meter", {.doc = "flow so far", .present = std::isfinite(*most)}};
    Output<double> excess{
        this, "excess", {.doc = "above most", .present = *inverted || std::isfinite(*most)}};
    Output<Matrix> flows{this, "flows", {.shape = {n, 3}, .doc = "by stage"}};
    Output<Vector> ends{this, "ends", {.shape = {n + 1}, .doc = "of stages"}};
    Output<Vector> gaps{this, "gaps", {.shape = {n + -1}, .doc = "between stages"}};
    Output<Vector> more{this, "more", {.shape = {2}, .doc = "outlets", .present = !outlets->empty()}};
    Output<double> open{this, "open", {.doc = "as it is", .present = !*inverted || *law == "square"}};
    Output<Array<double>> copy{this, "copy", {.shape = any, .doc = "of any size"}};
    Parameter<double> lower{this, "lower", {.initial = {-1}, .minimum = -2, .doc = "smallest"}};
    Parameter<double> upper{this, "upper", {.initial = {1}, .at_least = lower.index(), .doc = "largest"}};
    Parameter<Vector> gains{this, "gains", {.shape = {3}, .initial = {1, 2, 3}, .doc = "of stages"}};
    Parameter<bool> is_on{this, "is_on", {.initial = {1}, .doc = "at the start"}};
    Parameter<bool> is_dry{this, "is_dry", {.doc = "without flow"}};
    Parameter<double> exponent{
        this, "exponent", {.initial = {2}, .doc = "of the law", .present = *law != "linear"}};
    Parameter<double> start{this, "start", {.initial = {0.5}, .doc = "first position"}};
    DiscreteState<double> position{this, "position", {.doc = "now", .initial_from = start.index()}};
    DiscreteState<bool> was_on{this, "was_on", {.doc = "before"}};
    ContinuousState<double> level{this, "level", {.initial = {3}, .doc = "of the tank"}};
    Status output(Now, Out) const noexcept override { return ok; }
};

class DeclaredBlock : public testing::Test {
  protected:
    DeclaredBlock() {
        library_.group("water").add<Valve>("Valve", "A valve. It closes.");
        valve_ = declared(library_.classes().front());
    }
    const DeclaredQuantity& quantity_called(const std::string& name) const {
        return *std::find_if(valve_.quantities.begin(), valve_.quantities.end(),
                             [&](const auto& q) { return q.name == name; });
    }
    const DeclaredArgument& argument_called(const std::string& name) const {
        return *std::find_if(valve_.arguments.begin(), valve_.arguments.end(),
                             [&](const auto& a) { return a.name == name; });
    }

    Library library_{"Plant"};
    Declared valve_;
};

TEST_F(DeclaredBlock, IsNamedWithItsLibraryGroupAndResources) {
    EXPECT_EQ(valve_.name, "Valve");
    EXPECT_EQ(valve_.qualified_name, "Plant/Valve");
    EXPECT_EQ(valve_.group, "water");
    ASSERT_EQ(valve_.needs.size(), 1u);
    EXPECT_EQ(valve_.needs[0].type, "Grid");
    EXPECT_EQ(valve_.needs[0].doc, "where it stands");
    ASSERT_EQ(valve_.provides.size(), 1u);
    EXPECT_EQ(valve_.provides[0].type, "Grid");
}

TEST_F(DeclaredBlock, SaysTypesAndDefaultsOfArgumentsAsModelsWriteThem) {
    const auto expect = [&](const char* name, const char* type, const char* initial) {
        EXPECT_EQ(argument_called(name).type, type) << name;
        EXPECT_EQ(argument_called(name).initial, initial) << name;
    };
    expect("inverted", "boolean", "false");
    expect("law", "text", "'linear'");
    expect("outlets", "list of texts", "{}");
    expect("stages", "list of texts", "{'a', 'b'}");
    expect("table", "matrix", "[1 0; 0.5 4]");
    expect("seed", "number", "by the path");
    EXPECT_EQ(argument_called("law").choices.size(), 3u);
    EXPECT_EQ(argument_called("table").limits.minimum, 0);
}

TEST_F(DeclaredBlock, SaysSizesBySymbolsOfTheDeclaration) {
    const auto expect = [&](const char* name, const char* size) {
        EXPECT_EQ(quantity_called(name).size, size) << name;
    };
    expect("opening", "scalar");
    expect("flows", "n x 3");
    expect("ends", "n+1");
    expect("gaps", "n-1");
    expect("more", "2");
    expect("copy", "any");
}

TEST_F(DeclaredBlock, SaysFirstValuesOfWhatHasOne) {
    const auto expect = [&](const char* name, const char* initial) {
        EXPECT_EQ(quantity_called(name).initial, initial) << name;
    };
    expect("opening", "");
    expect("bias", "0.25");
    expect("flows", "");
    expect("lower", "-1");
    expect("gains", "[1 2 3]");
    expect("is_on", "true");
    expect("is_dry", "false");
    expect("was_on", "false");
    expect("position", "start");
    expect("level", "3");
}

TEST_F(DeclaredBlock, SaysWhichArgumentBringsAQuantity) {
    const auto expect = [&](const char* name, const char* condition) {
        EXPECT_EQ(quantity_called(name).condition, condition) << name;
    };
    expect("opening", "");
    expect("back", "inverted: true");
    expect("more", "outlets: [NAME, ...]");
    expect("exponent", "law: square or cubic");
    expect("open", "inverted: false or law: square");
    expect("meter", "most: finite");
    expect("excess", "inverted: true or most: finite");
}

TEST_F(DeclaredBlock, SaysLimitsBehindWhatAQuantityMeans) {
    EXPECT_EQ(quantity_called("upper").at_least, "lower");
    EXPECT_EQ(quantity_called("lower").at_least, "");
    EXPECT_EQ(with_limits("largest", {}, "lower"), "largest; at least lower");
    const auto& lower = quantity_called("lower");
    EXPECT_EQ(with_limits(lower.doc, lower.limits), "smallest; at least -2");
    EXPECT_EQ(with_limits("", lower.limits, "other"), "at least -2, at least other");
    EXPECT_EQ(with_limits("largest", {}), "largest");
}

TEST(FirstSentence, EndsBeforeItsFullStop) {
    EXPECT_EQ(first_sentence("A valve. It closes."), "A valve");
    EXPECT_EQ(first_sentence("A valve."), "A valve");
    EXPECT_EQ(first_sentence("A valve of 0.5 m"), "A valve of 0.5 m");
    EXPECT_EQ(first_sentence(""), "");
}

} // namespace
} // namespace bf

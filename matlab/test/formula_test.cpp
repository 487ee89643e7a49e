// Resolved formulas: types, errors and programs of numbers.
#include "bf/kernels/view.hpp"
#include "bf/matlab/formula.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

using namespace bf::matlab;

namespace {

/// a and b are numbers, v is 1x3, M is 2x2, on is logical, S.k is a number; n = 2 is known.
struct Names {
    Workspace constants;
    std::optional<Slot> find(const std::string& name) const {
        const std::pair<const char*, Type> slots[] = {{"a", {}},
                                                      {"b", {}},
                                                      {"v", {Class::Double, {1, 3}}},
                                                      {"M", {Class::Double, {2, 2}}},
                                                      {"on", {Class::Logical, {1, 1}}},
                                                      {"S.k", {}},
                                                      {"i", {Class::Int8, {1, 1}}}};
        for (int i = 0; i < 7; ++i)
            if (name == slots[i].first) return Slot{i, slots[i].second};
        return name == "S" ? std::optional(Slot{-1, {}}) : std::nullopt;
    }
    Scope scope(bool is_elementwise = false) {
        constants.set("n", Value(2));
        return {[this](const std::string& name) { return find(name); }, constants, is_elementwise,
                "; names are a, b, v, M, on, S.k"};
    }
};

std::string type_of(const std::string& text) {
    Names names;
    try {
        const Type type = resolve(*parse_expression(text), names.scope()).type;
        return type.size_text() + " " + std::string(class_name(type.element));
    } catch (const Error& error) {
        return std::to_string(error.location().column) + ": " + error.message();
    }
}

/// The value of a formula of a and b, computed as a block does.
double computed(const std::string& text, double a, double b) {
    Names names;
    const auto code =
        scalar_program(resolve(*parse_expression(text), names.scope(true)), [](const Formula& slot) {
            return Instruction{static_cast<double>(Operation::element), double(slot.slot), 0};
        });
    using bf::kernels::View;
    double y = 0;
    const double p = 0;
    const View<const double> inputs[] = {{&a, 1, 1}, {&b, 1, 1}};
    bf::kernels::Expression{}(View<double>(&y, 1, 1),
                              View<const double>(code.data(), static_cast<int>(code.size()), 1),
                              View<const double>(&p, 1, 1), bf::kernels::ListView<const double>(inputs, 2));
    return y;
}

} // namespace

TEST(Formula, KnowsClassAndSize) {
    EXPECT_EQ(type_of("a + 1"), "1x1 double");
    EXPECT_EQ(type_of("v' * v"), "3x3 double");
    EXPECT_EQ(type_of("v * v'"), "1x1 double");
    EXPECT_EQ(type_of("a > v"), "1x3 logical");
    EXPECT_EQ(type_of("on + on"), "1x1 double");
    EXPECT_EQ(type_of("-on"), "1x1 double");
    EXPECT_EQ(type_of("single(1) * a"), "1x1 single");
    EXPECT_EQ(type_of("i * a"), "1x1 int8");
    EXPECT_EQ(type_of("[M, [a; b]; 1 2 S.k]"), "3x3 double");
    EXPECT_EQ(type_of("M(:, end)"), "2x1 double");
    EXPECT_EQ(type_of("v([3 1])"), "1x2 double");
    EXPECT_EQ(type_of("v(a)"), "1x1 double");
    EXPECT_EQ(type_of("diag(v)"), "3x3 double");
    EXPECT_EQ(type_of("a && v"), "1x1 logical");
    EXPECT_EQ(type_of("plus(v, 1)"), "1x3 double");
}

TEST(Formula, FoldsWhatDependsOnNoSlot) {
    Names names;
    const auto folded = [&](const char* text) { return resolve(*parse_expression(text), names.scope()); };
    EXPECT_EQ(folded("2*n + norm([3 4])").kind, Formula::Kind::constant);
    EXPECT_EQ(folded("2*n + norm([3 4])").value, Value(9));
    EXPECT_EQ(folded("numel(v)").value, Value(3));
    EXPECT_EQ(folded("a + 2*n").operands[1].value, Value(4));
}

TEST(Formula, SaysWhereItIsWrong) {
    EXPECT_EQ(type_of("a + nn"),
              "5: unknown variable or function 'nn'; did you mean 'n'?; names are a, b, v, M, on, S.k");
    EXPECT_EQ(type_of("M + v"), "1: size mismatch: 2x2 + 1x3; sizes must be equal, or 1 where they differ");
    EXPECT_EQ(type_of("1 + [a b; v]"), "5: size mismatch: 1x2 above 1x3");
    EXPECT_EQ(type_of("a + inv(M)"), "5: 'inv' is not computed there");
    EXPECT_EQ(type_of("zeros(a)"), "1: its size would change");
    EXPECT_EQ(type_of("M \\ v'"), "1: a system of equations or a power of a matrix is not computed there");
    EXPECT_EQ(type_of("i + int16(1)"),
              "1: integers of different classes do not mix: int8 and int16; cast one of them");
    EXPECT_EQ(type_of("a + sqrt(-1)"), "5: sqrt(-1) is complex; complex numbers are not supported");
    EXPECT_EQ(type_of("S"), "1: its expression is more than arithmetic");
}

TEST(Formula, ComputesAsTheInterpreterDoes) {
    for (const char* text : {"a + b",
                             "a - b",
                             "a * b",
                             "a / b",
                             "a \\ b",
                             "abs(a)^b",
                             "a < b",
                             "a <= b",
                             "a > b",
                             "a >= b",
                             "a == b",
                             "a ~= b",
                             "a & b",
                             "a | b",
                             "~a",
                             "-a",
                             "min(a, b)",
                             "max(a, b)",
                             "mod(a, b)",
                             "rem(a, b)",
                             "atan2(a, b)",
                             "hypot(a, b)",
                             "abs(a)",
                             "sign(a)",
                             "sqrt(abs(a))",
                             "exp(a)",
                             "log(abs(a))",
                             "log2(abs(a))",
                             "log10(abs(a))",
                             "log1p(abs(a))",
                             "expm1(a)",
                             "sin(a)",
                             "cos(a)",
                             "tan(a)",
                             "asin(a/9)",
                             "acos(a/9)",
                             "atan(a)",
                             "sinh(a)",
                             "cosh(a)",
                             "tanh(a)",
                             "asinh(a)",
                             "acosh(abs(a) + 1)",
                             "atanh(a/9)",
                             "deg2rad(a)",
                             "rad2deg(a)",
                             "floor(a)",
                             "ceil(a)",
                             "round(a)",
                             "fix(a)",
                             "a > 0 && b > 0",
                             "a > 0 || b > 0",
                             "a'",
                             "+a"})
        for (const double a : {-2.5, -0.0, 0.0, 0.3, 3.0})
            for (const double b : {0.1, -0.0, 2.0, -1.0}) {
                Workspace workspace;
                workspace.set("a", Value(a));
                workspace.set("b", Value(b));
                const double expected = evaluate(text, workspace).scalar(), found = computed(text, a, b);
                EXPECT_TRUE(std::memcmp(&found, &expected, sizeof found) == 0 ||
                            (std::isnan(found) && std::isnan(expected)))
                    << text << " of " << a << " and " << b << ": " << found << " " << expected;
            }
}

TEST(Formula, OfNumbersRefusesWhatIsMore) {
    const auto refused = [](const char* text) {
        try {
            computed(text, 1, 2);
        } catch (const Error& error) {
            return std::to_string(error.location().column) + ": " + error.message();
        }
        return std::string();
    };
    EXPECT_EQ(refused("1 + (a + [1 2])"),
              "1: a step computes this formula with numbers of class double, this is a 1x2 double");
    EXPECT_EQ(refused("a + int8(3)"),
              "1: a step computes this formula with numbers of class double, this is a 1x1 int8");
    EXPECT_EQ(refused("a(0)"), "3: elements are counted by whole numbers from 1");
    std::string deep = "b";
    for (int i = 0; i < 40; ++i) deep = "a + (" + deep + ")";
    EXPECT_NE(refused(deep.c_str()).find("it nests too deeply"), std::string::npos);
}

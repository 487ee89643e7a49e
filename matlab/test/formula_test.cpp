// Resolved formulas: types, errors and programs of numbers.
#include "bf/kernels/view.hpp"
#include "bf/matlab/formula.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

using namespace bf::matlab;

namespace {

/// a and b are numbers, v is 1x3, M is 2x2, on is logical, S.k is a number; n = 2 is known.
struct Names {
    Workspace constants;
    std::optional<Slot> find(const std::string& name) const {
        const std::pair<const char*, Type> slots[] = {{"a", {}},
                                                      {"b", {}},
                                                      {"v", {Class::Double, 1, 3}},
                                                      {"M", {Class::Double, 2, 2}},
                                                      {"on", {Class::Logical}},
                                                      {"S.k", {}},
                                                      {"i", {Class::Int8}}};
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
    EXPECT_EQ(type_of("reshape([v a], [], 2)"), "2x2 double");
    EXPECT_EQ(type_of("repmat(v, 2, 2)"), "2x6 double");
    EXPECT_EQ(type_of("size(M, 2)*v"), "1x3 double");
    EXPECT_EQ(type_of("a && v"), "1x1 logical");
    EXPECT_EQ(type_of("plus(v, 1)"), "1x3 double");
}

TEST(Formula, FoldsWhatDependsOnNoSlot) {
    Names names;
    const auto folded = [&](const char* text) { return resolve(*parse_expression(text), names.scope()); };
    EXPECT_EQ(folded("2*n + norm([3 4])").kind, Formula::Kind::constant);
    EXPECT_EQ(folded("2*n + norm([3 4])").value, Value(9));
    EXPECT_EQ(folded("numel(v)").value, Value(3));
    EXPECT_EQ(folded("2*numel(v) + 1").value, Value(7));
    EXPECT_EQ(folded("v(numel(v))").places, std::vector<Index>{2});
    EXPECT_EQ(folded("a + 2*n").operands[1].value, Value(4));
}

TEST(Formula, SaysWhereItIsWrong) {
    EXPECT_EQ(type_of("a + nn"),
              "5: unknown variable or function 'nn'; did you mean 'n'?; names are a, b, v, M, on, S.k");
    EXPECT_EQ(type_of("M + v"), "1: size mismatch: 2x2 + 1x3; sizes must be equal, or 1 where they differ");
    EXPECT_EQ(type_of("1 + [a b; v]"), "5: size mismatch: 1x2 above 1x3 (2 and 3 columns differ)");
    EXPECT_EQ(type_of("a + inv(M)"), "5: 'inv' is not computed there");
    EXPECT_EQ(type_of("zeros(a)"), "1: its size would change");
    EXPECT_EQ(type_of("M \\ v'"), "1: a system of equations or a power of a matrix is not computed there");
    EXPECT_EQ(type_of("i + int16(1)"),
              "1: integers of different classes do not mix: int8 and int16; cast one of them");
    EXPECT_EQ(type_of("a + sqrt(-1)"), "5: sqrt(-1) is complex; complex numbers are not supported");
    EXPECT_EQ(type_of("S"), "1: its expression is more than arithmetic");
}

TEST(Formula, ComputesInAStepWhatItComputesAtOnce) {
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

// Whatever is inferred without the operands' values is what their values then give, and what is wrong is
// wrong in the same words.
TEST(Formula, InfersTheClassAndSizeThatValuesHave) {
    const std::pair<const char*, const char*> quantities[] = {{"a", "0.5"},
                                                              {"r", "[1 2 3]"},
                                                              {"c", "[2; 1; 3]"},
                                                              {"M", "[1 2 3; 4 5 6; 7 8 9]"},
                                                              {"on", "true"},
                                                              {"mask", "[true false true]"},
                                                              {"x", "single(2)"},
                                                              {"k", "int8(3)"},
                                                              {"kr", "int8([1 2 3])"},
                                                              {"n", "uint16(2)"},
                                                              {"text", "'abc'"},
                                                              {"e", "zeros(1,0)"}};
    const char* constants[] = {"2",    "[1 2 3]", "[1; 2; 3]", "int8(2)", "int16([1 2 3])", "single(3)",
                               "true", "'a'",     "[]",        "{1}",     "zeros(0,3)"};
    const char* binary[] = {"+",  "-",  "*",  ".*", "/",  "./", "\\", ".\\", "^",
                            ".^", "==", "~=", "<",  "<=", ">",  ">=", "&",   "|"};
    const char* functions[] = {"min", "max", "atan2", "hypot", "mod", "rem", "plus", "ldivide", "eq"};
    const char* unary[] = {"-", "+", "~"};
    const char* of_one[] = {"abs",       "sqrt",  "round", "floor",  "sign",   "diag", "double",
                            "transpose", "numel", "triu",  "flipud", "fliplr", "flip"};
    Workspace workspace;
    for (const auto& [name, text] : quantities) workspace.set(name, evaluate(text, Workspace()));
    const Workspace none;
    const Scope scope{[&](const std::string& name) -> std::optional<Slot> {
                          for (int i = 0; i < static_cast<int>(std::size(quantities)); ++i)
                              if (name == quantities[i].first) return Slot{i, type_of(workspace.at(name))};
                          return std::nullopt;
                      },
                      none};
    std::mt19937 random(1);
    const auto pick = [&](const auto& list) { return list[random() % std::size(list)]; };
    const std::function<std::string(int)> expression = [&](int depth) -> std::string {
        if (depth == 0) return random() % 4 == 0 ? pick(constants) : pick(quantities).first;
        const auto part = [&] {
            return expression(static_cast<int>(random() % static_cast<unsigned>(depth)));
        };
        switch (random() % 8) {
        case 0: return std::string(pick(functions)) + "(" + part() + ", " + part() + ")";
        case 1: return std::string(pick(unary)) + "(" + part() + ")";
        case 2: return std::string(pick(of_one)) + "(" + part() + ")";
        case 3: return "[" + part() + ", " + part() + "]";
        case 4: return "[" + part() + "; " + part() + "]";
        case 5: return "(" + part() + ")'";
        default: return "(" + part() + ") " + pick(binary) + " (" + part() + ")";
        }
    };
    int inferred = 0, refused = 0;
    for (int i = 0; i < 20000; ++i) {
        const std::string text = expression(1 + static_cast<int>(random() % 3));
        std::string expected, found;
        try {
            expected = type_of(evaluate(text, workspace)).text();
        } catch (const Error& error) {
            expected = error.message();
        }
        try {
            found = resolve(*parse_expression(text), scope).type.text();
            ++inferred;
        } catch (const Unresolved&) {
            continue;
        } catch (const Error& error) {
            found = error.message();
            ++refused;
        }
        const bool depends_on_values =
            expected.find("is complex") != std::string::npos || expected.find("NaN") != std::string::npos;
        if (!depends_on_values) {
            ASSERT_EQ(found, expected) << "of " << text;
        }
    }
    EXPECT_GT(inferred, 5000);
    EXPECT_GT(refused, 1000);
}

TEST(Formula, HasTypesForAllArraysAndRefusesThoseThatNothingComputes) {
    const auto refused = [](const Type& type) {
        const Workspace none;
        const Scope scope{[&](const std::string& name) {
                              return name == "q" ? std::optional(Slot{0, type}) : std::nullopt;
                          },
                          none};
        try {
            return resolve(*parse_expression("1 + q"), scope).type.text();
        } catch (const Error& error) {
            return std::to_string(error.location().column) + ": " + error.message();
        }
    };
    Type complex;
    complex.is_complex = true;
    EXPECT_EQ(refused(complex),
              "5: this is a 1x1 complex double; complex numbers are not supported; compute with "
              "real and imaginary parts of their own");
    EXPECT_EQ(refused({Class::Int64}),
              "5: this is a 1x1 int64; int64 is not supported; use int32 or uint32, or "
              "double, which holds whole numbers up to 2^53");
    EXPECT_EQ(refused({Class::Double, 2, 2, {2}}),
              "5: this is a 2x2x2 double; arrays have two dimensions; use a cell array for more");
    Type structs{Class::Struct, 1, 3};
    structs.fields.emplace_back("a", complex);
    EXPECT_EQ(refused(structs),
              "5: this is a 1x3 struct; arrays of structs are not supported; use a cell array, "
              "c{i}.field");
    const Type of_struct = type_of(evaluate("struct('a', int8([1 2]), 'b', struct('c', 'x'))", Workspace()));
    ASSERT_EQ(of_struct.fields.size(), 2U);
    EXPECT_EQ(of_struct.fields[0].second.text(), "1x2 int8");
    EXPECT_EQ(of_struct.fields[1].second.fields[0].first, "c");
}

TEST(Formula, RefusesToHideThatIntegersRound) {
    EXPECT_EQ(type_of("double(i)"), "1x1 double");
    EXPECT_EQ(type_of("double(i * 2.7)"), "1: it is computed with a int8");
    EXPECT_EQ(type_of("M(a, a, a)"), "1: arrays have two dimensions; more indices are not computed there");
    EXPECT_EQ(type_of("a && {1}"), "1: expected a condition (numbers or logicals), got a 1x1 cell");
    EXPECT_EQ(type_of("a + {1}"), "1: operator '+' does not apply to a cell");
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

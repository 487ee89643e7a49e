#include "cases.hpp"
#include "octave.hpp"
#include "sample.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <sstream>

using namespace bf::matlab;

TEST(Expression, HasTheValueOfTheTable) {
    const Workspace variables = sample_variables();
    for (const Case& c : cases) {
        try {
            EXPECT_EQ(evaluate(c.expression, variables).to_text(), c.value) << "of " << c.expression;
        } catch (const Error& error) {
            ADD_FAILURE() << c.expression << " throws " << error.what();
        }
    }
}

TEST(Expression, HasTheClassSizeAndElementsThatOctaveComputes) {
    Workspace variables;
    for (const auto& [name, text] : octave_variables) variables.set(name, evaluate(text, variables));
    for (const OctaveCase& c : octave_cases) {
        const Value value = evaluate(c.expression, variables);
        std::istringstream expected(c.value);
        std::string type, size, element;
        expected >> type >> size;
        EXPECT_EQ(value.type_name(), type) << "of " << c.expression;
        ASSERT_EQ(value.size_text(), size) << "of " << c.expression;
        for (Index i = 0; i < value.numel() && expected >> element; ++i) {
            const double x = std::strtod(element.c_str(), nullptr);
            EXPECT_TRUE((std::isnan(x) && std::isnan(value[i])) || value[i] == x ||
                        std::abs(value[i] - x) <= 1e-13 * std::abs(x))
                << c.expression << " is " << value.to_text() << ", not " << c.value;
        }
    }
}

TEST(Value, PrintsAnExpressionThatEvaluatesBackToItself) {
    const Workspace variables = sample_variables();
    for (const Case& c : cases) {
        const Value value = evaluate(c.expression, variables);
        if (value.to_text().find('@') != std::string::npos) continue; // handles compare by identity
        EXPECT_EQ(evaluate(value.to_text(), Workspace()), value)
            << c.expression << " prints " << value.to_text();
    }
}

TEST(Value, PrintsRandomDoublesExactly) {
    std::mt19937_64 random(1);
    for (int k = 0; k < 2000; ++k) {
        const double x = std::bit_cast<double>(random());
        const Value back = evaluate(Value(x).to_text(), Workspace());
        EXPECT_TRUE(back == Value(x)) << x;
        if (!std::isfinite(static_cast<float>(x))) continue;
        const Value single = Value(x).as(Class::Single);
        EXPECT_EQ(evaluate(single.to_text(), Workspace()), single);
    }
}

TEST(Value, PrintsControlCharactersAsCodes) {
    const Value text(std::string_view("a\n'b'\t"));
    EXPECT_EQ(text.to_text(), "['a' char(10) '''b''' char(9) '']");
    EXPECT_EQ(evaluate(text.to_text(), Workspace()), text);
}

TEST(Value, CopiesDoNotSeeLaterChanges) {
    Value a = Value::structure({{"x", Value(1)}});
    const Value b = a;
    a.set_field("x", Value(2));
    EXPECT_EQ(b.field("x").scalar(), 1);
    EXPECT_EQ(a.field("x").scalar(), 2);
    Value m(Eigen::MatrixXd::Zero(2, 2));
    const Value n = m;
    m.mutable_data()[0] = 5;
    EXPECT_EQ(n[0], 0);
}

TEST(Value, NamesTheNearestFieldWhenOneIsMissing) {
    const Value s = Value::structure({{"KP", Value(1)}, {"tolerance", Value(2)}});
    EXPECT_EQ(s.field("KP").scalar(), 1);
    try {
        s.field("tolerence");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.message(), "the struct has no field 'tolerence'; did you mean 'tolerance'?");
    }
}

TEST(PlainNumber, AcceptsLiteralsOnly) {
    EXPECT_EQ(plain_number("0.999"), 0.999);
    EXPECT_EQ(plain_number(" -1e-3\n"), -1e-3);
    for (const char* text : {"", "-", "inf", "nan", "1+1", "1 2", "0x10", "x", "--1", "1e", "1e999"})
        EXPECT_FALSE(plain_number(text)) << text;
}

TEST(FreeNames, AreThoseThatNoParameterExplains) {
    const auto names = [](const char* text) { return free_names(*parse_expression(text)); };
    using Names = std::vector<std::string>;
    EXPECT_EQ(names("Config.Gain.KP(i, :) * sin(t) + t"), (Names{"Config.Gain.KP", "i", "sin", "t"}));
    EXPECT_EQ(names("cellfun(@(x) x.y + offset, c) + x.y"), (Names{"cellfun", "offset", "c", "x.y"}));
    EXPECT_EQ(names("@(x) x"), Names{});
    EXPECT_EQ(names("a.b.(c)"), (Names{"a.b", "c"}));
}

TEST(Workspace, LooksUpEnclosingWorkspacesAndKeepsOrder) {
    Workspace model;
    model.set("a", Value(1));
    model.set("b", Value(2));
    Workspace mask(&model);
    mask.set("b", Value(3));
    EXPECT_EQ(evaluate("a + b", mask).scalar(), 4);
    EXPECT_EQ(evaluate("a + b", model).scalar(), 3);
    EXPECT_EQ(model.begin()->first, "a");
    EXPECT_EQ(model.at("b").scalar(), 2);
    EXPECT_TRUE(mask.contains("a"));
}

TEST(Names, VariablesShadowFunctions) {
    Workspace w;
    w.set("max", Value(7));
    w.set("dir", evaluate("[1 2 3]", w));
    EXPECT_EQ(evaluate("max + dir(2)", w).scalar(), 9);
}

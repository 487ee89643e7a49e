// Formulas, against the MATLAB language of model files.
#include "../../engine/test/support.hpp"
#include "bf/matlab/formula.hpp"
#include "standard_block.hpp"

#include <cmath>

namespace bf::test {
namespace {

double value(const std::string& expression, const Values& u, const Values& p = {0}) {
    auto block = make("Fcn", {{"expression", expression}});
    const auto& slots = block.resolution().slots;
    const bool is_single =
        std::any_of(slots.begin(), slots.end(), [](const Slot& s) { return s.name == "u"; });
    for (std::size_t i = 0; i < u.size(); ++i)
        block.wire(is_single ? "u" : "u" + std::to_string(i + 1), scalar_size(), Type::float64);
    block.wire("p", vector_size(static_cast<int>(p.size()))).start().set("p", p);
    for (std::size_t i = 0; i < u.size(); ++i)
        block.set(is_single ? "u" : "u" + std::to_string(i + 1), Values{u[i]});
    EXPECT_TRUE(block.output());
    return block.scalar("y");
}

TEST(Fcn, AgreesWithMatlab) {
    for (const char* text : {"u1 + u2*2 - 3/u1",
                             "-u1^2",
                             "u1^-2",
                             "2^-u2^2",
                             "-2^-1*u1",
                             "(u1 - u2)*(u1 + u2)",
                             "u1 - u2 - 1",
                             "8/u1/2",
                             "u1.*u2./2",
                             "~u1 + 1",
                             "u1 < u2",
                             "u1 >= u2 | u2 == 2",
                             "u1 ~= u2 & u1 < 9",
                             "~(u1 > 1) || u2",
                             "1 - u1 > u2*2 == 0",
                             "sin(u1)^2 + cos(u1)^2",
                             "atan2(u1, -u2)",
                             "hypot(u1, u2)",
                             "max(u1, u2) - min(u1, 2)",
                             "mod(-u1, u2)",
                             "rem(-7.5, u2)",
                             "mod(0.3, 0.1*u1/u1)",
                             "exp(-u1)*log(u2) + log10(u1)",
                             "sqrt(abs(-u1)) + sign(-u2)",
                             "floor(-u1) + ceil(u2) + round(2.5) + fix(-2.5)",
                             "tanh(u1) + sinh(u1)/cosh(u2) - atan(u1)",
                             "2*pi*u1",
                             "1e-3*u1 + .5",
                             "u1 + true",
                             "!(u1 != u2) + norm([3 4])*u1",
                             "min(0*u1, -0*u2) + expm1(u1) + log2(u2) + asinh(u1) + deg2rad(u2)",
                             "asin(u1/10) + acos(u2/10) + tan(u1)",
                             "- - u1 + + u2"})
        for (const auto& [a, b] : {std::pair{1.5, 2.0}, std::pair{2.0, 0.75}, std::pair{3.0, 3.0}}) {
            matlab::Workspace workspace;
            workspace.set("u1", matlab::Value(a));
            workspace.set("u2", matlab::Value(b));
            const double expected = matlab::evaluate(text, workspace).scalar();
            EXPECT_DOUBLE_EQ(value(std::string("0*u2 + (") + text + ") + 0*u1", {a, b}), expected)
                << text << " " << a << " " << b;
        }
}

TEST(Fcn, WorksElementByElementAndOnSingleElements) {
    auto block = make("Fcn", {{"expression", "u1*p(2) + u2(3)"}});
    block.wire("u1", vector_size(2)).wire("u2", vector_size(3)).wire("p", vector_size(2)).start();
    block.set("u1", Values{1, 2}).set("u2", Values{7, 8, 9}).set("p", Values{0, 10});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{19, 29}));
    EXPECT_EQ(value("u(1) > 2", {3}), 1);
    auto single = make("Fcn", {{"expression", "u/3"}}).wire("u", scalar_size(), Type::float32).start();
    single.set("u", Values{1});
    ASSERT_TRUE(single.output());
    EXPECT_EQ(single.scalar("y"), static_cast<double>(static_cast<float>(1.0 / 3)));
}

TEST(Fcn, SaysWhereAFormulaIsWrong) {
    const auto refused = [](const std::string& text) {
        return refusal([&] { make("Fcn", {{"expression", text}}); });
    };
    EXPECT_EQ(refused("u1 + sinn(u2)"),
              "argument 'expression': 'u1 + sinn(u2)', character 6: unknown variable or function 'sinn'; did "
              "you mean 'sign'?; inputs are u or u1, u2, ..., parameters p(1), p(2), ...");
    EXPECT_EQ(refused("u1 + "),
              "argument 'expression': 'u1 + ', character 6: expected a value, found the end of the text");
    EXPECT_EQ(refused("(u1"), "argument 'expression': '(u1', character 1: this '(' is never closed");
    EXPECT_EQ(refused("u1 u2"), "argument 'expression': 'u1 u2', character 4: expected the end of the "
                                "expression, found 'u2'");
    EXPECT_EQ(refused("u1 + inv(u2)"),
              "argument 'expression': 'u1 + inv(u2)', character 6: 'inv' is not computed there");
    EXPECT_EQ(refused("u1 + sqrt(-1)"), "argument 'expression': 'u1 + sqrt(-1)', character 6: sqrt(-1) is "
                                        "complex; complex numbers are not supported");
    EXPECT_EQ(refused("u + u2"),
              "argument 'expression': 'u + u2', character 5: there is one input u, or u1, u2, ...; not both");
    EXPECT_EQ(refused("u(0)"),
              "argument 'expression': 'u(0)', character 3: elements are counted by whole numbers from 1");
    EXPECT_EQ(refused("p(1)"), "argument 'expression' reads no input; a Constant has a value without one");
    EXPECT_NE(refused(std::string(500, '(') + "u"), "");
    EXPECT_NE(refused("u" + std::string(1000, '^')), "");
    std::string deep = "u";
    for (int i = 0; i < 40; ++i) deep = "1 + (" + deep + "*2 - 1 + (u";
    EXPECT_NE(refused(deep), "");
    EXPECT_EQ(refusal([] {
                  make("Fcn", {{"expression", "u(4)"}}).wire("u", vector_size(3)).start();
              }),
              "input 'u' of size [3] has no element 4, which the expression reads");
    EXPECT_EQ(refusal([] {
                  make("Fcn", {{"expression", "u*p(2)"}}).wire("u", scalar_size()).start();
              }),
              "parameter 'p' has 1 elements, but the expression reads p(2)");
    EXPECT_EQ(
        refusal([&] {
            make("Fcn", {{"expression", "u*p"}}).wire("u", scalar_size()).wire("p", vector_size(3)).start();
        }),
        "the expression reads p, which has 3 elements; write p(1), p(2), ... for each of them");
}

TEST(Fcn, ReadsUnquotedFormulasOfModels) {
    Session run(
        "model: m\nstep: 0.5\nblocks:\n  t: {block: Clock}\n"
        "  f: {block: Fcn, expression: \"3*u1^2 - p(1)*u2\", p: 2}\nconnections: {t: [f.u1, f.u2]}\n");
    EXPECT_EQ(run.trace("f", 3), (Values{0, 0.75 - 1, 3 - 2}));
}

} // namespace
} // namespace bf::test

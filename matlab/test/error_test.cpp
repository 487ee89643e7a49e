#include "sample.hpp"

#include <gtest/gtest.h>

using namespace bf::matlab;

namespace {

struct Wrong {
    const char* expression;
    const char* message; ///< `column: message`
};

constexpr Wrong wrongs[] = {
    {"", "1: expected an expression, found nothing"},
    {"1 +", "4: expected a value, found the end of the text"},
    {"1 2", "3: expected the end of the expression, found '2'"},
    {"24**2", "4: expected a value, found '*'; a power is written with '^'"},
    {"24 V", "4: expected the end of the expression, found 'V'; write units in a comment"},
    {"(1", "1: this '(' is never closed"},
    {"str2num('1 + 1')",
     "1: str2num computes no text here: write the expression itself, or str2double, which gives "
     "NaN for what is no number"},
    {"1)", "2: this ')' closes nothing; expected a '(' before it"},
    {"[1 2)", "5: this ')' closes nothing; expected a '(' before it"},
    {"'abc", "1: this text has no closing '"},
    {"a = 3", "3: '=' assigns; compare with '=='"},
    {"(v = 3)", "4: '=' assigns; compare with '=='"},
    {"2 + 1e400", "5: '1e400' is beyond the largest number, 1.8e308; write Inf for infinity"},
    {"2 + 3i", "5: complex numbers are not supported; compute with real and imaginary parts of their own"},
    {"1e3j", "1: complex numbers are not supported; compute with real and imaginary parts of their own"},
    {"3in", "1: a number ends before a letter; write '*' to multiply; hexadecimal numbers are not supported"},
    {"int64(5)",
     "1: int64 is not supported; use int32 or uint32, or double, which holds whole numbers up to 2^53"},
    {"uint64(5)",
     "1: uint64 is not supported; use int32 or uint32, or double, which holds whole numbers up to 2^53"},
    {"zeros(2,'int64')",
     "1: int64 is not supported; use int32 or uint32, or double, which holds whole numbers up to "
     "2^53"},
    {"sin(int8(3))", "1: 'sin' computes with double or single, not with int8; cast with double(x)"},
    {"int8([1 2]) * [1; 2]",
     "1: products, quotients and powers of matrices are not computed with int8; cast with "
     "double(x)"},
    {"xor(NaN, 1)", "1: NaN cannot become logical; test it with isnan"},
    {"zeros([2 2 2])", "1: arrays have two dimensions; use a cell array for more"},
    {"Config(2).t_step",
     "1: arrays of structs are not supported; a struct has only element 1, use a cell array, "
     "c{i}.field"},
    {"1 $ 2", "3: unexpected character"},
    {"v(1,)", "5: expected an argument after ','"},
    {"end", "1: 'end' stands for the last index only inside an index"},
    {"if", "1: expected a value, found 'if'"},
    {"[1;2\n3 4]", "1: size mismatch: 1x1 above 1x2 (1 and 2 columns differ)"},
    {"[[1;2] [1;2;3]]", "1: size mismatch: 2x1 beside 3x1 (2 and 3 rows differ)"},
    {"vv + 1", "1: unknown variable or function 'vv'; did you mean 'v'?"},
    {"2 * Confg.t_step", "5: unknown variable or function 'Confg.t_step'; did you mean 'Config'?"},
    {"zeross(3)", "1: unknown variable or function 'zeross'; did you mean 'zeros'?"},
    {"Config.Gain.Kp", "1: the struct has no field 'Kp'; did you mean 'KP'?"},
    {"ones(2,3) * ones(2,2)", "1: size mismatch: 2x3 * 2x2 (inner lengths 3 and 2 differ); use '.*' for an "
                              "element-wise product"},
    {"A + [1 2 3]", "1: size mismatch: 2x2 + 1x3; sizes must be equal, or 1 where they differ"},
    {"A \\ [1 2 3]", "1: size mismatch: 2x2 \\ 1x3 (2 and 1 rows differ)"},
    {"v ^ 2",
     "1: '^' needs a square matrix and a whole number, got 1x3 ^ 2; use '.^' for element-wise powers"},
    {"v(4)", "1: index 4 exceeds the 3 elements"},
    {"A(3,1)", "1: index 3 exceeds the 2 rows"},
    {"A(1,3)", "1: index 3 exceeds the 2 columns"},
    {"A(1,1,2)", "1: arrays have two dimensions; index 3 must be 1"},
    {"v(0)", "1: index 0 is not a whole number from 1 on"},
    {"v(1.5)", "1: index 1.5 is not a whole number from 1 on"},
    {"v{1}", "1: '{}' indexes cell arrays only, this is a 1x3 double"},
    {"names{:} + 1", "1: '{}' selects 2 elements where one is needed"},
    {"names + 1", "1: operator '+' does not apply to a cell"},
    {"v.x", "1: expected a struct, got [10 20 30]"},
    {"[Config Config]", "1: arrays of structs are not supported; use a cell array {a, b}"},
    {"struct('a', {1, 2})", "1: arrays of structs are not supported; write the cell of field 'a' in another "
                            "pair of braces, {{...}}"},
    {"int8(1) + int16(1)", "1: integers of different classes do not mix: int8 and int16; cast one of them"},
    {"sqrt(-1)", "1: sqrt(-1) is complex; complex numbers are not supported"},
    {"(-8)^(1/3)", "1: -8^0.3333333333333333 is complex; complex numbers are not supported"},
    {"sin(1, 2)", "1: 'sin' takes 1 argument, got 2"},
    {"size()", "1: 'size' takes 1 to 2 arguments, got 0"},
    {"inv(ones(2,3))", "1: 'inv' needs a square matrix, got 2x3"},
    {"cross(1, 2)", "1: size mismatch: cross of 1x1 and 1x1; it needs two vectors of 3 elements"},
    {"zeros(1e9)", "1: an array of 1e+09x1e+09 exceeds the limit of 1e+07 elements"},
    {"zeros(2,2,2)", "1: arrays have two dimensions; use a cell array for more"},
    {"1:1e12", "1: an array of 1x1e+12 exceeds the limit of 1e+07 elements"},
    {"reshape(1:6, [-2 -3])", "1: cannot reshape 1x6 to 0x0: the number of elements differs"},
    {"diag([1 2], NaN)", "1: diag needs a whole number for the diagonal, got NaN"},
    {"linspace(0, 1, inf)", "1: a size must be a whole number, got inf"},
    {"logical(NaN)", "1: NaN cannot become logical; test it with isnan"},
    {"error('gain %d is wrong', 3)", "1: gain 3 is wrong"},
    {"getenv('HOME')", "1: unknown variable or function 'getenv'"},
    {"run('x.m')", "1: unknown variable or function 'run'"},
    {"feval(@(f) f(f), @(f) f(f))",
     "23: calls and expressions nest deeper than 1000 levels; is there an endless recursion?"},
};

std::string message_of(const std::string& text, const Workspace& variables) {
    try {
        return "no error, but " + evaluate(text, variables).to_text();
    } catch (const Error& error) {
        EXPECT_TRUE(error.located()) << text;
        return std::to_string(error.location().column) + ": " + error.message();
    }
}

} // namespace

TEST(Error, SaysWhereWhatAndTheRemedy) {
    const Workspace variables = sample_variables();
    for (const Wrong& w : wrongs)
        EXPECT_EQ(message_of(w.expression, variables), w.message) << "of " << w.expression;
}

TEST(Error, CountsLinesAndColumnsFromTheStartOfTheText) {
    try {
        evaluate("[1 2\n  nothing]", Workspace(), {"model.yaml", 12, 8});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.location(), (Location{"model.yaml", 13, 3}));
        EXPECT_EQ(error.text(), "nothing");
        EXPECT_STREQ(error.what(), "model.yaml:13:3: unknown variable or function 'nothing', in 'nothing'");
    }
}

TEST(Error, EndsEndlessComputations) {
    const auto error_of = [](const char* text) {
        try {
            return "no error, but " + evaluated(text, Workspace(), {1e6, 3e7, 1000}).to_text();
        } catch (const Error& error) {
            return error.message();
        }
    };
    EXPECT_EQ(error_of("numel(repmat('ab', 1, 1e6))"),
              "an array of 1x2e+06 exceeds the limit of 1e+06 elements");
    EXPECT_EQ(error_of("inv(eye(1000))"), "the computation takes too many steps; is there an endless loop?");
    EXPECT_EQ(error_of("cellfun(@(k) sum(zeros(1, 1e5)), num2cell(1:100))"),
              "the computation takes too many steps; is there an endless loop?");
}

TEST(Error, EndsTextsThatNestTooDeeply) {
    const auto repeated = [](const char* text, int times) {
        std::string result;
        for (int i = 0; i < times; ++i) result += text;
        return result;
    };
    const Workspace none;
    EXPECT_NE(
        message_of(repeated("(", 100000) + "1" + repeated(")", 100000), none).find("nest deeper than 100"),
        std::string::npos);
    EXPECT_NE(message_of(repeated("-", 100000) + "1", none).find("nests deeper than"), std::string::npos);
    EXPECT_NE(message_of("1" + repeated("+1", 100000), none).find("more than 500 levels"), std::string::npos);
    EXPECT_NE(message_of("1" + repeated("'", 100000), none).find("more than 500 levels"), std::string::npos);
    EXPECT_EQ(message_of("1" + repeated("+1", 400), none), "no error, but 401");
}

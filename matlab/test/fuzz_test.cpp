#include "cases.hpp"
#include "sample.hpp"

#include <gtest/gtest.h>

#include <random>

using namespace bf::matlab;

namespace {

constexpr std::string_view pieces[] = {
    "(", ")", "[",     "]",      "{",      "}",     "'",    "\"",      ":",    "end",    ",",
    ";", " ", "\n",    "...",    "%",      "@",     "@(x)", ".",       "~",    "-",      "*",
    "^", "=", "==",    "&&",     "0",      "1e9",   "NaN",  "-1",      "inf",  "1e308",  "x",
    "v", "A", "names", "Config", "zeros(", "int8(", "\x80", "repmat(", "'%s'", "struct("};

/// `text` after one to four random edits: pieces put in, bytes changed or removed, parts doubled.
std::string mutated(std::string text, std::mt19937& random) {
    const auto below = [&](std::size_t n) {
        return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
    };
    for (std::size_t edits = 1 + below(4); edits > 0; --edits) {
        const std::size_t at = below(text.size() + 1);
        switch (below(4)) {
        case 0: text.insert(at, pieces[below(std::size(pieces))]); break;
        case 1: text.erase(at, 1 + below(3)); break;
        case 2: text.insert(at, text.substr(below(text.size() + 1), below(12))); break;
        default:
            if (at < text.size()) text[at] = char(below(256));
        }
    }
    return text;
}

} // namespace

TEST(Fuzz, MutatedExpressionsGiveAValueOrAnError) {
    std::mt19937 random(7);
    const Workspace variables = sample_variables();
    int values = 0, errors = 0;
    for (int round = 0; round < 30; ++round) {
        for (const Case& c : cases) {
            const std::string text = mutated(c.expression, random);
            try {
                evaluated(text, variables, {1e5, 1e6, 1000}).to_text();
                ++values;
            } catch (const Error& error) {
                EXPECT_TRUE(error.located()) << text;
                ++errors;
            }
        }
    }
    EXPECT_GT(values, 500);
    EXPECT_GT(errors, 500);
}

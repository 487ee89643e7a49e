// Reading and checking a model takes a time that grows with its size, whatever there is much of, right or
// wrong.
#include "growth.hpp"
#include "support.hpp"

#include <functional>
#include <gtest/gtest.h>

namespace bf::test {
namespace {

using Write = std::function<std::string(int)>; ///< a model of n things

/// "f(0)between f(1)between ..."
template <class F> std::string repeated(int n, F&& f, const std::string& between = ", ") {
    std::string text;
    for (int i = 0; i < n; ++i) text += (i > 0 ? between : "") + f(std::to_string(i));
    return text;
}

std::string document(const std::string& parts) { return "model: m\nstep: 0.1\nstop: 1\n" + parts; }

std::string names(int n, const std::string& prefix, const std::string& suffix = "") {
    return repeated(n, [&](const std::string& i) { return prefix + i + suffix; });
}

std::string constants(int n) {
    return "blocks: {" + repeated(n, [](const std::string& i) { return "c" + i + ": {block: Constant}"; }) +
           "}\n";
}

void expect_growth_with(const std::string& what, const Write& write, int n) {
    const std::string small = write(n), large = write(4 * n);
    expect_growth(
        what, [&] { errors_of(small); }, [&] { errors_of(large); });
}

TEST(Growth, PortsOfModelsAndSubsystems) {
    const auto wires = [](int n) {
        return "connections: {" + repeated(n, [](const std::string& i) { return "u" + i + ": y" + i; }) + "}";
    };
    const auto ports = [&](int n) {
        return "inputs: [" + names(n, "u") + "]\noutputs: [" + names(n, "y") + "]\n";
    };
    expect_growth_with(
        "root", [&](int n) { return document(ports(n) + wires(n) + "\nblocks: {}\n"); }, 3000);
    expect_growth_with(
        "subsystem",
        [&](int n) {
            return document("blocks: {c: {block: Constant}, s: {inputs: [" + names(n, "u") + "], outputs: [" +
                            names(n, "y") + "], blocks: {k: {block: Constant}}, " + wires(n) +
                            "}}\nconnections: {c: [" + names(n, "s.u") + "]}\n");
        },
        2000);
}

TEST(Growth, RecordedSignals) {
    expect_growth_with(
        "known", [](int n) { return document(constants(n) + "record: [" + names(n, "c") + "]\n"); }, 2000);
    expect_growth_with(
        "unknown", [](int n) { return document(constants(n) + "record: [" + names(n, "c", ".w") + "]\n"); },
        2000);
}

TEST(Growth, WrongPortsOfAWideBlock) {
    expect_growth_with(
        "sum",
        [](int n) {
            return document(
                "blocks: {c: {block: Constant}, s: {block: Sum, signs: " + std::string(std::size_t(n), '+') +
                "}}\nconnections: {c: [" + names(n, "s.w") + "]}\n");
        },
        2000);
}

TEST(Growth, SignalsOfBuses) {
    const auto bus = [](const std::string& more) {
        return [=](int n) {
            const std::string list = "signals: \"[" + names(n, "s") + "]\"}";
            return document(
                "blocks: {c: {block: Constant}, b: {block: BusCreator, " + list +
                ", a: {block: BusAssignment, " + list + ", x: {block: BusSelector, " + list + ", " +
                repeated(n, [](const std::string& i) { return "t" + i + ": {block: Terminator}"; }) +
                "}\nconnections: {c: [" + names(n, "b.s") + ", " + names(n, "a.s") + "], b: a.bus, a: x, " +
                repeated(n, [&](const std::string& i) { return "x." + more + i + ": t" + i; }) + "}\n");
        };
    };
    expect_growth_with("known", bus("s"), 1500);
    expect_growth_with("unknown", bus("w"), 1500);
}

TEST(Growth, FieldsThatAStructLacks) {
    expect_growth_with(
        "fields",
        [](int n) {
            return document("variables: {e: {" +
                            repeated(100, [](const std::string& i) { return "v" + i + ": 1"; }) +
                            "}}\nblocks: {" +
                            repeated(n,
                                     [](const std::string& i) {
                                         return "c" + i + ": {block: Constant, value: e.w" + i + "}";
                                     }) +
                            "}\n");
        },
        1500);
}

TEST(Growth, VariablesOfOneExpression) {
    expect_growth_with(
        "expression",
        [](int n) {
            return document("variables: {" +
                            repeated(n, [](const std::string& i) { return "v" + i + ": 1"; }) +
                            "}\nblocks: {c: {block: Constant, value: \"[" + names(n, "v") + "]\"}}\n");
        },
        3000);
}

TEST(Errors, AreListedUpToAHundredAndCounted) {
    const std::string all = errors_of(
        document("blocks: {" +
                 repeated(150, [](const std::string& i) { return "c" + i + ": {block: Gian}"; }) + "}\n"));
    EXPECT_EQ(std::ranges::count(all, '\n'), 100);
    EXPECT_TRUE(all.ends_with("\nand 50 more")) << all.substr(all.size() - 80);
}

} // namespace
} // namespace bf::test

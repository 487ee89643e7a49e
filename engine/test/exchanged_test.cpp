// Names that blocks seem to have exchanged, found without comparing each with each.
#include "bf/engine/handover.hpp"
#include "support.hpp"

#include <functional>
#include <gtest/gtest.h>
#include <new>

namespace {
thread_local std::size_t allocations_here = 0;
} // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
    void* memory = std::malloc(size);
    if (!memory) throw std::bad_alloc();
    ++allocations_here;
    return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

namespace bf::test {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

struct Searched {
    Pairs names;
    std::size_t work; ///< pieces of memory that were asked for
};
Searched searched(const std::string& before, const std::string& after) {
    Registry registry;
    registry.add(standard_library());
    const Diagram one = elaborate(formats::read_yaml_text(before), registry),
                  other = elaborate(formats::read_yaml_text(after), registry);
    const std::size_t asked = allocations_here;
    Pairs names = exchanged(one, other);
    return {std::move(names), allocations_here - asked};
}

using Line = std::function<std::string(int)>;

/// A model with `count` of these blocks and wires, which are lines of text.
std::string many(int count, const Line& block, const Line& wire, const std::string& more = "") {
    std::string text = "model: m\nstep: 0.1\nblocks:\n" + more;
    for (int i = 0; i < count; ++i) text += "  " + block(i) + "\n";
    text += "connections:\n";
    for (int i = 0; i < count; ++i)
        if (const std::string line = wire(i); !line.empty()) text += "  " + line + "\n";
    return text;
}
std::string d(int i) { return "d" + std::to_string(i); }
std::string delay(int i) { return d(i) + ": {block: UnitDelay}"; }

/// Neighbours have exchanged their sources, so every one of the delays is another one than before.
Searched crossed_pairs(int count) {
    const Line block = [](int i) { return "s" + std::to_string(i) + ": {block: Constant}\n  " + delay(i); };
    const auto wire = [](int by) -> Line {
        return [by](int i) { return "s" + std::to_string(i) + ": " + d(i ^ by); };
    };
    return searched(many(count, block, wire(0)), many(count, block, wire(1)));
}

/// All of one half have what the other half had: each may have exchanged its name with any one there.
Searched crossed_halves(int count) {
    const auto wires = [count](bool is_other) -> Line {
        return [count, is_other](int i) {
            if (i > 1) return std::string();
            std::string line = (i == 0) != is_other ? "s: [" : "t: [";
            for (int k = i * count / 2; k < (i + 1) * count / 2; ++k)
                line += (line.back() == '[' ? "" : ", ") + d(k);
            return line + "]";
        };
    };
    const std::string sources = "  s: {block: Constant}\n  t: {block: Constant}\n";
    return searched(many(count, delay, wires(false), sources), many(count, delay, wires(true), sources));
}

/// A ring that is run through the other way around: each is wired to others that have changed, too.
Searched turned_ring(int count) {
    const auto wire = [count](int by) -> Line {
        return [count, by](int i) { return d(i) + ": " + d((i + by + count) % count); };
    };
    return searched(many(count, delay, wire(1)), many(count, delay, wire(-1)));
}

/// One delay feeds all others, and all begin with other values.
Searched star(int count) {
    const auto block = [](const char* initial) -> Line {
        return [initial](int i) {
            return d(i) + ": {block: UnitDelay, initial: " + std::to_string(i) + initial + "}";
        };
    };
    const Line wire = [count](int i) {
        std::string line = i == 0 ? "d0: [" : "";
        for (int k = 1; k < count && i == 0; ++k) line += (k > 1 ? ", " : "") + d(k);
        return i == 0 ? line + "]" : line;
    };
    const auto hub = [&](const char* initial) {
        return many(count, block(initial), wire, "  one: {block: Constant}\n") + "  one: d0\n";
    };
    return searched(hub(".25"), hub(".5"));
}

TEST(Exchanged, AreFoundInAsMuchWorkAsBlocksHaveChanged) {
    EXPECT_EQ(crossed_pairs(4).names, (Pairs{{"d0", "d1"}, {"d2", "d3"}}));
    EXPECT_EQ(crossed_halves(4).names, (Pairs{{"d0", "d2"}, {"d1", "d3"}}));
    EXPECT_EQ(turned_ring(5).names, Pairs());
    EXPECT_EQ(star(5).names, Pairs());
    for (const auto& search : {crossed_pairs, crossed_halves, turned_ring, star}) {
        const Searched few = search(2500), more = search(10000);
        EXPECT_EQ(more.names.size(), 4 * few.names.size());
        EXPECT_LT(more.work, 5 * few.work) << "four times as many blocks";
        EXPECT_LT(more.work, 10000u * 100u) << "for each block";
    }
}

TEST(Exchanged, AreSubsystemsAsWellAsBlocksOfSeveralSubsystems) {
    const auto model = [](const std::string& wires) {
        return "model: m\nstep: 0.1\nblocks:\n  one: {block: Constant}\n  two: {block: Constant}\n"
               "  f: {inputs: [u], blocks: {x: {block: UnitDelay}}, connections: {u: x}}\n"
               "  g: {inputs: [u, v], blocks: {x: {block: UnitDelay}, y: {block: UnitDelay, initial: 3}}, "
               "connections: {u: x, v: y}}\n"
               "  y: {block: UnitDelay, initial: 3}\n  z: {block: UnitDelay, initial: 4}\n"
               "connections: {" +
               wires + "}\n";
    };
    const std::string before = model("one: [f, y, z], two: [g.u, g.v]");
    EXPECT_EQ(searched(before, model("one: [g.u, y, z], two: [f, g.v]")).names, (Pairs{{"f", "g"}}));
    EXPECT_EQ(searched(before, model("one: [f, g.v, z], two: [g.u, y]")).names, (Pairs{{"g.y", "y"}}));
    EXPECT_EQ(searched(before, model("two: [g.v, g.u], one: [z, y, f]")).names, Pairs()) << "another order";
    EXPECT_EQ(searched(before, model("one: [f, y], two: [g.u, g.v, z]")).names, Pairs());
}

} // namespace
} // namespace bf::test

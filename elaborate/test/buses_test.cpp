// Claims about buses: they become no blocks, and their wires lead where their names say.
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// What drives the input of a block.
std::string driver(const Elaborated& m, const std::string& path, const std::string& input = "u") {
    const auto& node = m.node(path);
    return m.diagram.end_path(node.sources[static_cast<std::size_t>(node.block->resolution().find(input))]);
}

const std::string blocks = "model: m\nstep: 1\nblocks:\n  p: {block: Constant, value: [1, 2]}\n"
                           "  v: {block: Clock}\n  t: {block: Constant, value: 7}\n"
                           "  inner: {block: BusCreator, signals: [position, velocity]}\n"
                           "  outer: {block: BusCreator, signals: [state, temperature]}\n"
                           "  new: {block: BusAssignment, signals: [temperature]}\n"
                           "  take: {block: BusSelector, signals: [state, temperature, state.velocity]}\n"
                           "  deep: {block: BusSelector, signals: [position]}\n"
                           "  a: {block: Gain}\n  b: {block: Gain}\n  c: {block: Gain}\n";

TEST(Buses, LeadEachSignalToWhoTakesItByName) {
    const std::string wires =
        "connections: {p: inner.position, v: [inner.velocity, new.temperature], inner: "
        "outer.state, t: outer.temperature, outer: new.bus, new: take, take.state: deep, "
        "deep: a, take.temperature: b, take.velocity: c}\n";
    const auto m = elaborate_text(blocks + wires);
    EXPECT_EQ(driver(m, "a"), "p.y");
    EXPECT_EQ(driver(m, "b"), "v.y") << "assigned";
    EXPECT_EQ(driver(m, "c"), "v.y");
    EXPECT_EQ(m.size("a"), "[2]");
    for (const char* bus : {"inner", "outer", "new", "take", "deep"})
        EXPECT_EQ(m.diagram.find_node(bus), -1) << bus << " is no block";
}

TEST(Buses, SayWhichPortsAndSignalsThereAre) {
    const auto said = [](const std::string& more, const std::string& connections) {
        return errors_of("model: m\nstep: 1\nblocks:\n  t: {block: Clock}\n"
                         "  c: {block: BusCreator, signals: [x, y]}\n" +
                         more + "  g: {block: Gain}\nconnections: {" + connections + "}\n");
    };
    EXPECT_EQ(said("", "t: [c.x, c.z, g]"),
              "m.yaml:7:24: c: there is no input 'z'; did you mean 'x' or 'y'?; inputs: x, y");
    EXPECT_EQ(said("  s: {block: BusSelector, signals: [x]}\n", "t: [c.x, c.y], c: s, s.w: g"),
              "m.yaml:8:36: s: there is no output 'w'; did you mean 'x'?; outputs: x");
    EXPECT_EQ(said("  s: {block: BusSelector, signals: [w]}\n", "t: [c.x, c.y], c: s, s: g"),
              "m.yaml:5:3: c: the bus has no signal 'w'; did you mean 'x' or 'y'?; its signals: x, y");
    EXPECT_EQ(said("  n: {block: BusAssignment, signals: [x]}\n", "t: [c.x, c.y, n.w], c: n.bus, n: g"),
              "m.yaml:8:29: n: there is no input 'w'; did you mean 'x'?; inputs: x, bus\nm.yaml:8:45: 'n' is "
              "a bus of x; take a signal out of it with a BusSelector");
}

} // namespace
} // namespace bf::test

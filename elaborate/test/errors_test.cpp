#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// What is wrong with a model that has these blocks and connections.
std::string wrong(const std::string& blocks, const std::string& connections = {}) {
    return errors_of("model: m\nstep: 0.1\nblocks:\n" + blocks +
                     (connections.empty() ? "" : "connections:\n" + connections));
}

TEST(Errors, UnknownBlockIsNamedWithSimilarOnes) {
    EXPECT_EQ(wrong("  a: {block: Gian}\n"),
              "m.yaml:4:14: a: there is no block 'Gian'; did you mean 'Gain'?");
}

TEST(Errors, UnknownSettingIsNamedWithSimilarOnes) {
    EXPECT_EQ(wrong("  t: {block: Clock}\n  a: {block: UnitDelay, inital: 1}\n", "  t: a\n"),
              "m.yaml:5:25: a: the block has no argument or parameter 'inital'; did you mean 'initial'?");
    EXPECT_EQ(wrong("  t: {block: Clock}\n  a: {block: UnitDelay, mod: fast}\n", "  t: a\n"),
              "m.yaml:5:25: a: the block has no argument or parameter 'mod'")
        << "before the word 'fast' is looked at";
}

TEST(Errors, UnknownVariableIsNamedWithSimilarOnes) {
    EXPECT_EQ(
        errors_of(
            "model: m\nstep: 0.1\nvariables: {gain: 2}\nblocks:\n  c: {block: Constant, value: 2*gai}\n"),
        "m.yaml:5:33: c.value: '2*gai': unknown variable or function 'gai'; did you mean 'gain'?");
}

TEST(Errors, UnknownPortsAreNamedWithThoseThereAre) {
    EXPECT_EQ(wrong("  t: {block: Clock}\n  s: {block: Sum}\n", "  t.z: s.u1\n  t: s.v2\n"),
              "m.yaml:7:3: t: there is no output 'z'; did you mean 'y'?; outputs: y\n"
              "m.yaml:8:6: s: there is no input 'v2'; did you mean 'u2'?; inputs: u1, u2");
}

TEST(Errors, AmbiguousPortIsRefused) {
    EXPECT_EQ(
        wrong("  t: {block: Clock}\n  s: {block: Sum}\n", "  t: s\n"),
        "m.yaml:7:6: s: 's' does not say which input is meant: there are 2; write one of u1, u2 after a dot");
}

TEST(Errors, BlockWithoutOutputsCannotBeASource) {
    EXPECT_EQ(
        wrong("  t: {block: Clock}\n  e: {block: Terminator}\n  g: {block: Gain}\n", "  t: e\n  e: g\n"),
        "m.yaml:9:3: e: 'e' has no output; remove the connection");
}

TEST(Errors, UnconnectedInputIsNamed) {
    EXPECT_EQ(wrong("  t: {block: Clock}\n  s: {block: Sum}\n", "  t: s.u1\n"),
              "m.yaml:5:3: s: input 'u2' is not connected; connect a signal to it");
}

TEST(Errors, UnconnectedPortsOfSubsystemsAreNamedOnce) {
    EXPECT_EQ(
        wrong("  s:\n    inputs: [a]\n    outputs: [y]\n    blocks: {g: {block: Gain}, h: {block: Gain}}\n"
              "    connections: {a: [g, h]}\n  z: {block: Gain}\n",
              "  s: z\n"),
        "m.yaml:4:3: s: the subsystem's input 'a' is not connected; connect a signal to it\n"
        "m.yaml:6:15: s.y: the subsystem's output is not connected; connect a block's output to it");
}

TEST(Errors, UnconnectedSubsystemOutputAndEnableAreNamed) {
    EXPECT_EQ(wrong("  s:\n    execution: enabled\n    outputs: [y]\n    blocks: {}\n"),
              "m.yaml:4:3: s: the subsystem's input 'enable' is not connected; connect a signal to "
              "it; the subsystem runs while any element is above 0\n"
              "m.yaml:6:15: s.y: the subsystem's output is not connected; connect a block's output to it");
}

TEST(Errors, ASecondDriverIsRefused) {
    EXPECT_EQ(wrong("  t: {block: Clock}\n  g: {block: Gain}\n", "  t: [g, g.u]\n"),
              "m.yaml:7:10: g: 'g.u' is driven twice: by 't' and by 't'; remove one of the connections");
}

TEST(Errors, SizesThatDifferAreNamedWithTheirPorts) {
    EXPECT_EQ(wrong("  a: {block: Constant, value: [1, 2]}\n  b: {block: Constant, value: [1, 2, 3]}\n"
                    "  s: {block: Sum}\n  d: {block: Dot}\n  x: {block: Cross}\n",
                    "  a: [s.u1, d.u1, x.u1]\n  b: [s.u2, d.u2, x.u2]\n"),
              "m.yaml:6:3: s: input 'u1' of size [2] and input 'u2' of size [3] cannot be combined element "
              "by element; sizes must be equal or scalar\n"
              "m.yaml:7:3: d: input 'u1' of size [2] and input 'u2' of size [3] must have as many elements\n"
              "m.yaml:8:3: x: input 'u1' has length 3, but is wired to length 2 (a.y -> x.u1)");
}

TEST(Errors, InitialValueOfAnotherSizeIsRefused) {
    EXPECT_EQ(wrong("  a: {block: Constant, value: [1, 2]}\n  d: {block: UnitDelay, initial: [1, 2, 3]}\n",
                    "  a: d\n"),
              "m.yaml:5:3: d: parameter 'initial' of size [3] and input 'u' of size [2] differ; give a "
              "scalar or as many elements");
}

TEST(Errors, InitialOutputOfAnotherSizeIsRefused) {
    EXPECT_EQ(wrong("  t: {block: Clock}\n  s:\n    execution: enabled\n    outputs: {y: {initial: [1, 2]}}\n"
                    "    blocks: {c: {block: Constant, value: [1, 2, 3]}}\n    connections: {c: y}\n",
                    "  t: s.enable\n"),
              "m.yaml:7:15: s.y: 'initial' has 2 elements, but the output has 3; give one element or 3");
}

TEST(Errors, TypesThatDifferAreNamed) {
    EXPECT_EQ(wrong("  a: {block: Constant, value: int8(1)}\n  b: {block: Constant, value: true}\n"
                    "  s: {block: Sum}\n  n: {block: Trigonometry}\n",
                    "  a: [s.u1, n]\n  b: s.u2\n"),
              "m.yaml:6:3: s: input 'u2' must be of type int8 like the other quantities of its kind, but is "
              "wired to type boolean; insert a Convert block (b.y -> s.u2)\n"
              "m.yaml:7:3: n: output 'y' cannot be of type int8, for which this operation is not defined; "
              "insert a Convert block");
}

TEST(Errors, DeclaredPortsAreHeldToTheirWord) {
    EXPECT_EQ(
        wrong("  a: {block: Constant, value: [1, 2]}\n  s:\n    inputs: {u: {shape: 3}}\n"
              "    outputs: {y: {type: single}, z: {shape: 0}}\n    blocks: {g: {block: Gain}}\n"
              "    connections: {u: g, g: [y, z]}\n",
              "  a: s\n"),
        "m.yaml:7:45: s.z: 'shape' is 0; give the length of a 1-D signal, or [rows columns] of a matrix");
    EXPECT_EQ(
        wrong("  a: {block: Constant, value: [1, 2]}\n  s:\n    inputs: {u: {shape: 3}}\n"
              "    outputs: {y: {type: single}}\n    blocks: {g: {block: Gain}}\n"
              "    connections: {u: g, g: y}\n",
              "  a: s\n"),
        "m.yaml:6:14: s.u: the port is declared as size [3], but a.y is of size [2]; change one of them");
}

TEST(Errors, UndeterminedSizeAsksForAConnection) {
    EXPECT_EQ(wrong("  a: {block: Ground}\n"),
              "m.yaml:4:3: a: the size of output 'y' cannot be found from the wiring; connect the block, or "
              "give a parameter with the wanted size");
}

/// A quantity in radians and one in metres.
class Angle final : public Block {
  public:
    using Block::Block;
    Output<double> y{this, "y", {.unit = unit<"rad">}};
    Status output(Now, Out out) const noexcept override {
        out[y] = 0;
        return ok;
    }
};
class Ruler final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "length", {.unit = unit<"m">}};
};

/// A robot that knows its frames, and a block that needs one.
struct Robot {
    static constexpr const char* resource = "robot";
    struct Live {
        static constexpr bool is_cache = true;
    };
    std::string frame;
    std::shared_ptr<Live> open() const { return std::make_shared<Live>(); }
};
class RobotBlock final : public Block {
  public:
    using Block::Block;
    Argument<std::string> frame{this, "frame", {.initial = "hand"}};
    Provides<Robot> robot{this, [this] {
                              if (*frame == "broken") throw std::runtime_error("the robot's file is broken");
                              return std::make_shared<const Robot>(Robot{*frame});
                          }};
};
class FrameBlock final : public Block {
  public:
    using Block::Block;
    Argument<std::string> frame{this, "frame", {.initial = "hand"}};
    Requires<Robot> robot{this};
    Dim n{this, "n", [this] {
              if (*frame != robot->frame) throw std::runtime_error("the robot has no frame '" + *frame + "'");
              return 3;
          }};
    Output<Vector> y{this, "y", {.shape = {n}}};
};

/// Sets a thing outside, which several may name; without `u` only where that is wired.
class Setter final : public Block {
  public:
    using Block::Block;
    Argument<std::string> thing{this, "thing", {.initial = "the lamp"}};
    Argument<bool> needs_u{this, "needs_u", {.initial = false}};
    Input<double> u{this, "u", {.optional = true}};
    void infer(Inference& inference) const override {
        static const int room = 0;
        inference.claim({&room, *thing, needs_u ? u.index() : -1});
    }
};

std::string wrong_with_robots(const std::string& blocks) {
    Library library("");
    library.group("test")
        .add<Angle>("Angle", "")
        .add<Ruler>("Ruler", "")
        .add<RobotBlock>("Robot", "")
        .add<Setter>("Setter", "")
        .add<FrameBlock>("Frame", "");
    return errors_of("model: m\nstep: 0.1\nblocks:\n" + blocks, {}, &library);
}

TEST(Errors, WhatTwoBlocksWouldSetInOneStepIsNamed) {
    const auto undone = [](const std::string& second, const std::string& first) {
        return second + ": sets the lamp, which " + first +
               " sets in the same step, so that the one that runs later would undo the other; keep one of "
               "them, or "
               "put each into a conditional subsystem of its own";
    };
    EXPECT_EQ(wrong_with_robots(
                  "  a: {block: Setter}\n  b: {block: Setter, thing: the door}\n  c: {block: Setter}\n"),
              "m.yaml:6:3: " + undone("c", "a"));
    EXPECT_EQ(wrong_with_robots("  a: {block: Setter}\n  b: {block: Setter, needs_u: true}\n"), "");
    EXPECT_EQ(
        wrong_with_robots("  one: {block: Constant}\n  a: {block: Setter}\n  b: {block: Setter, needs_u: "
                          "true}\nconnections: {one: b}\n"),
        "m.yaml:6:3: " + undone("b", "a"));
    // Each in a subsystem of its own, of which one is on; one that stands around them runs with both.
    const std::string on = "  one: {block: Constant}\n", wires = "connections: {one: [x.enable, y.enable]}\n";
    const auto subsystem = [](const std::string& name, const std::string& more = {}) {
        return "  " + name + ":\n    execution: enabled\n    blocks:\n      a: {block: Setter}\n" + more;
    };
    EXPECT_EQ(wrong_with_robots(on + subsystem("x") + subsystem("y") + wires), "");
    EXPECT_EQ(wrong_with_robots(on + subsystem("x") + subsystem("y") + "  all: {block: Setter}\n" + wires),
              "m.yaml:13:3: " + undone("all", "x.a"));
    EXPECT_EQ(wrong_with_robots(on + subsystem("x", "      b: {block: Setter}\n") + subsystem("y") + wires),
              "m.yaml:9:7: " + undone("x.b", "x.a"));
}

TEST(Errors, UnitsThatDifferAreNamed) {
    EXPECT_EQ(wrong_with_robots("  a: {block: Angle}\n  b: {block: Ruler}\nconnections: {a: b}\n"),
              "m.yaml:5:3: b: input 'length' is in m, but is wired to a.y in rad; convert the signal, e.g. "
              "with a Gain");
}

TEST(Errors, UnitsOfPortsOfSystemsThatDifferAreNamed) {
    const auto subsystem = [](const std::string& unit, const std::string& block) {
        return "  s:\n    inputs: {in: {unit: " + unit + "}}\n    blocks: {c: {block: " + block +
               "}}\n    connections: {in: c}\n";
    };
    const std::string angle = "  a: {block: Angle}\n", wired = "connections: {a: s}\n";
    EXPECT_EQ(wrong_with_robots(angle + subsystem("rad", "Gain") + wired), "");
    EXPECT_EQ(wrong_with_robots(angle + subsystem("'some words'", "Gain") + wired), "");
    EXPECT_EQ(
        wrong_with_robots(angle + subsystem("m", "Gain") + wired),
        "m.yaml:6:14: s.in: the port is in m, but its signal a.y is in rad; convert the signal, e.g. with "
        "a Gain, or correct the unit");
    const std::string constant = "  a: {block: Constant}\n";
    EXPECT_EQ(wrong_with_robots(constant + subsystem("m", "Ruler") + wired), "");
    EXPECT_EQ(
        wrong_with_robots(constant + subsystem("rad", "Ruler") + wired),
        "m.yaml:7:14: s.c: input 'length' is in m, but is wired to s.in in rad; convert the signal, e.g. "
        "with a Gain");
    const std::string inner =
        "        inputs: {u: {unit: s}}\n        blocks: {g: {block: Gain}}\n        connections: {u: g}";
    EXPECT_EQ(
        wrong_with_robots(constant + "  s:\n    inputs: {in: {unit: m}}\n    blocks:\n      t:\n" + inner +
                          "\n    connections: {in: t}\n" + wired),
        "m.yaml:9:18: s.t.u: the port is in s, but the same signal is at s.in in m; convert the signal, "
        "e.g. with a Gain, or correct the unit");
}

TEST(Errors, MissingResourceSaysWhatToAdd) {
    EXPECT_EQ(wrong_with_robots("  f: {block: Frame}\n"),
              "m.yaml:4:3: f: needs a robot, and no enclosing subsystem has one; add a block that provides "
              "it beside this block or in a subsystem around it");
}

TEST(Errors, TwoResourcesAtOneLevelAreRefused) {
    EXPECT_EQ(
        wrong_with_robots("  a: {block: Robot}\n  b: {block: Robot}\n  f: {block: Frame}\n"),
        "m.yaml:6:3: f: finds more than one robot around it: a and b; keep one of them in this subsystem");
}

TEST(Errors, TheNearestResourceServes) {
    EXPECT_EQ(
        wrong_with_robots("  a: {block: Robot, frame: foot}\n  s:\n    blocks:\n      b: {block: Robot}\n"
                          "      f: {block: Frame}\n"),
        "");
}

TEST(Errors, UnknownFrameIsToldByTheResource) {
    EXPECT_EQ(wrong_with_robots("  a: {block: Robot}\n  f: {block: Frame, frame: elbow}\n"),
              "m.yaml:5:3: f: the robot has no frame 'elbow'");
}

TEST(Errors, ResourceThatCannotBeMadeIsReportedOnce) {
    EXPECT_EQ(
        wrong_with_robots("  a: {block: Robot, frame: broken}\n  f: {block: Frame}\n  g: {block: Frame}\n"),
        "m.yaml:4:3: a: the robot's file is broken");
}

TEST(Errors, AllErrorsOfAModelAreReportedAtOnceInDocumentOrder) {
    EXPECT_EQ(errors_of(R"m(
model: m
step: -1
stop: [1, 2]
variables:
  a: 2*
  b: nothing + 1
blocks:
  x: {block: Nothing}
  y: {block: Gain, L: 1}
  z: {block: Sum, signs: "+*"}
  w: {block: Constant, value: missing(3)}
connections:
  x: [y, z.u9]
  y: w
)m"),
              "m.yaml:3:7: 'step' is -1; give a positive number of seconds up to 1e9\n"
              "m.yaml:4:7: 'stop' is [1 2]; give a number of seconds from 0 to Inf\n"
              "m.yaml:6:8: a: '2*': expected a value, found the end of the text\n"
              "m.yaml:7:6: b: 'nothing + 1': unknown variable or function 'nothing'\n"
              "m.yaml:9:14: x: there is no block 'Nothing'; `bf describe` lists all blocks\n"
              "m.yaml:10:20: y: the block has no argument or parameter 'L'; did you mean 'K'?\n"
              "m.yaml:11:3: z: argument 'signs' is the text '+*', but must be made of '+' and '-', one per "
              "input, or be the number of inputs\n"
              "m.yaml:12:31: w.value: 'missing(3)': unknown variable or function 'missing'\n"
              "m.yaml:14:10: z: there is no input 'u9'; did you mean 'u1' or 'u2'?; inputs: u1, u2\n"
              "m.yaml:15:6: w: 'w' has no input; remove the connection");
}

TEST(Errors, ATextWithoutQuotesIsTold) {
    EXPECT_EQ(
        errors_of("model: m\nstep: 0.1\nvariables: {gait: fast walk}\nblocks: {c: {block: Clock}}\n"),
        "m.yaml:3:24: gait: 'fast walk': expected the end of the expression, found 'walk'; if it is a text, "
        "give it quotes of its own: \"'fast walk'\"");
}

TEST(Errors, APeriodIsATimeAndNothingThatATriggerRunsHasOne) {
    for (const std::string period : {"-0.3", "0"})
        EXPECT_EQ(
            errors_of("model: m\nstep: 0.1\nblocks:\n  a: {block: Clock, period: " + period +
                      ", offset: -0.1}\n"),
            "m.yaml:4:29: a: period " + period +
                " s is not above 0; give a multiple of the base step, or leave it out to run as fast as "
                "what the block reads");
    // Around a triggered subsystem a period is right: it holds for what no trigger runs.
    EXPECT_EQ(
        errors_of("model: m\nstep: 0.1\nblocks:\n  t: {block: Pulse, period: 0.2}\n  all:\n"
                  "    period: 0.2\n    inputs: [u]\n    blocks:\n      s:\n        execution: triggered\n"
                  "        blocks: {c: {block: Clock}}\n    connections: {u: s.trigger}\n"
                  "connections: {t: all}\n"),
        "");
    const std::string rule =
        "a triggered subsystem has no period: its trigger says when it runs; leave the period "
        "out; a FunctionCallGenerator with a period is a trigger";
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nblocks:\n  t: {block: Pulse}\n  s:\n    execution: triggered\n"
                        "    period: 0.5\n    blocks:\n      c: {block: Clock, period: 0.3}\n"
                        "      d: {block: Clock}\n      e: {blocks: {f: {block: Clock, period: 0.1}}}\n"
                        "connections: {t: s.trigger}\n"),
              "m.yaml:7:13: s: " + rule + "\nm.yaml:9:33: s.c: " + rule + "\nm.yaml:11:46: s.e.f: " + rule);
}

TEST(Errors, SampleTimesMustFitTheBaseStep) {
    EXPECT_EQ(errors_of("model: m\nstep: 0.01\nblocks:\n  t: {block: Clock, period: 0.015}\n"
                        "  s: {block: Clock, period: 0.02, offset: 0.005}\n"),
              "m.yaml:4:29: t: period 0.015 s is no multiple of the base period 0.01 s; change it, or give "
              "the model a 'step' that divides it\n"
              "m.yaml:5:43: s: offset 0.005 s is no multiple of the base period 0.01 s; change it, or give "
              "the model a 'step' that divides it");
    EXPECT_EQ(
        errors_of("model: m\nstep: 1e-10\nblocks:\n  t: {block: Clock, period: 1e9}\n"),
        "m.yaml:4:29: t: period 1e+09 s is more than 2^53 times the base period 1e-10 s; change it, or give "
        "the model a 'step' that divides it");
    EXPECT_EQ(errors_of("model: m\nstep: 0.01\nblocks:\n  s:\n    period: 0.015\n"
                        "    blocks: {t: {block: Clock}, u: {block: Clock}}\n"
                        "  r:\n    period: 0.015\n    blocks: {t: {blocks: {u: {block: Clock}}}}\n"),
              "m.yaml:5:13: s: period 0.015 s is no multiple of the base period 0.01 s; change it, or give "
              "the model a 'step' that divides it\n"
              "m.yaml:8:13: r: period 0.015 s is no multiple of the base period 0.01 s; change it, or give "
              "the model a 'step' that divides it");
    EXPECT_EQ(errors_of("model: m\nblocks:\n  t: {block: Clock}\n"),
              "m.yaml:1:1: neither the model nor any block names a sample time; give the model a 'step', "
              "e.g. step: 0.001");
    const auto two_periods = [](const std::string& a, const std::string& b) {
        return errors_of("model: m\nblocks:\n  t: {block: Clock, period: " + a +
                         "}\n  u: {block: Clock, period: " + b + "}\n");
    };
    EXPECT_EQ(
        two_periods("pi", "exp(1)"),
        "m.yaml:4:3: u: runs every 2.718281828459045 s, and a base step that divides this and the other "
        "periods is more than a million times shorter than they; give periods that nest, or the model a "
        "'step'");
    EXPECT_EQ(two_periods("3600*24*365", "1e-4"), "");
    EXPECT_EQ(two_periods("1/30", "0.001"), "");
    EXPECT_EQ(errors_of("model: m\nstep: 0\nblocks:\n  t: {block: Clock}\n"),
              "m.yaml:2:7: 'step' is 0; give a positive number of seconds up to 1e9");
}

TEST(Errors, CircleOfPortsWithoutABlockIsRefused) {
    EXPECT_EQ(wrong("  s:\n    inputs: [u]\n    outputs: [y]\n    blocks: {}\n    connections: {u: y}\n  g: "
                    "{block: Gain}\n",
                    "  s: [s.u, g]\n"),
              "m.yaml:8:19: s: ports of subsystems are connected in a circle without any block; connect one "
              "of them to the block that is to drive it");
}

TEST(Errors, UnknownOverrideIsNamedWithSimilarOnes) {
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nvariables: {Gain: {Kp: 2}}\nblocks:\n  g: {block: Constant}\n",
                        {{"Gain.Kd", "1"}, {"g.valu", "2"}, {"stepp", "1"}, {"Gain.Kp", "2*"}}),
              "Gain.Kp: '2*': expected a value, found the end of the text\n"
              "g: the block has no argument or parameter 'valu'; did you mean 'value'?\n"
              "nothing is called 'Gain.Kd'; did you mean 'Gain.Kp'?; give the name of a variable, of a "
              "setting as block.setting, step, stop or one of the solver\n"
              "nothing is called 'stepp'; did you mean 'step'?; give the name of a variable, of a "
              "setting as block.setting, step, stop or one of the solver");
}

TEST(Errors, AWrongVariableIsOneErrorHoweverManyUseIt) {
    const std::string model =
        "model: m\nstep: 0.1\nvariables: {n: 2, twice: 2*n, S: {a: 1, b: 3}, T: S}\nblocks:\n"
        "  c: {block: Constant, value: 1}\n"
        "  d: {block: Delay, steps: n}\n"
        "  e: {block: Delay, steps: twice}\n"
        "  f: {block: Delay, steps: T.a}\n"
        "  g: {block: Delay, steps: S.b}\n"
        "  end: {block: Terminator}\n"
        "connections: {c: d, d: e, e: f, f: g, g: end}\n";
    const std::string beyond =
        ": '1e400': '1e400' is beyond the largest number, 1.8e308; write Inf for infinity; "
        "if it is a text, give it quotes of its own: \"'1e400'\"";
    EXPECT_EQ(errors_of(model, {{"n", "1e400"}}), "n" + beyond);
    EXPECT_EQ(errors_of(model, {{"S.a", "1e400"}}), "S.a" + beyond);
    EXPECT_EQ(errors_of(model, {{"S", "1e400"}}), "S" + beyond);
    EXPECT_EQ(errors_of(model, {{"S.a", "1e400"}, {"S.b", "-1"}}),
              "m.yaml:9:3: g: argument 'steps' must be from 1 to 1000000, but is -1\nS.a" + beyond);
}

TEST(Errors, WrongParametersAreRefused) {
    EXPECT_EQ(
        wrong("  a: {block: Constant, value: []}\n  b: {block: Constant, value: '''text'''}\n"
              "  t: {block: Clock}\n  c: {block: Counter}\n  d: {block: OnDelay, duration: [1, 2]}\n"
              "  e: {block: Gain, multiplication: sideways}\n  h: {block: Delay, steps: 0}\n",
              "  t: [c.u, e, h]\n"),
        "m.yaml:4:31: a: parameter 'value' is empty; give at least one element\n"
        "m.yaml:5:31: b: parameter 'value' must be a number, not the text ''text''\n"
        "m.yaml:8:3: d: input 'u' is not connected; connect a signal to it\n"
        "m.yaml:8:33: d: '[1, 2]' does not fit: parameter 'duration' has length 1, but is wired to length 2\n"
        "m.yaml:9:3: e: argument 'multiplication' is 'sideways', but must be one of 'elementwise', 'K*u', "
        "'u*K'\n"
        "m.yaml:10:3: h: argument 'steps' must be from 1 to 1000000, but is 0");
}

TEST(Errors, LimitsThatCrossAreRefusedWhereTheyAreWritten) {
    EXPECT_EQ(
        errors_of("model: m\nstep: 0.1\nvariables: {low: 2}\nblocks:\n"
                  "  c: {block: Constant, value: [1, 2]}\n"
                  "  s: {block: Saturate, lower: [0, low], upper: 1}\n"
                  "  d: {block: DeadZone, start: 3}\n"
                  "  r: {block: Relay, on_point: -1}\n"
                  "connections: {c: [s, d, r]}\n"),
        "m.yaml:6:48: s: parameter 'upper' must be at least 'lower', but 1 is below 2 (element 2); "
        "exchange the two, or give others\n"
        "m.yaml:7:31: d: parameter 'end' must be at least 'start', but 0.5 is below 3; exchange the two, "
        "or give others\n"
        "m.yaml:8:31: r: parameter 'on_point' must be at least 'off_point', but -1 is below 0; exchange the "
        "two, or give others");
}

TEST(Errors, ValuesOutsideOfTheirLimitsAreRefusedTogether) {
    const std::string text = "model: m\nstep: 0.1\nvariables: {T: 1 - 2}\nblocks:\n"
                             "  lag: {block: FilteredDerivative, time_constant: [0.1, T]}\n"
                             "  part:\n    inputs: [u]\n    blocks:\n"
                             "      q: {block: Quantize, interval: 0}\n    connections: {u: q}\n"
                             "  p: {block: Pulse, width: [1, 101], cycle: nan}\n"
                             "  c: {block: CounterFree, bits: 33}\n"
                             "connections: {p: [lag, part.u]}\n";
    EXPECT_EQ(errors_of(text),
              "m.yaml:5:51: lag: parameter 'time_constant' must be greater than 0, but element 2 is -1\n"
              "m.yaml:9:38: part.q: parameter 'interval' must be greater than 0, but is 0\n"
              "m.yaml:11:28: p: parameter 'width' must be from 0 to 100, but element 2 is 101\n"
              "m.yaml:11:45: p: parameter 'cycle' must be greater than 0, but is NaN\n"
              "m.yaml:12:3: c: argument 'bits' must be from 1 to 32, but is 33");
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nvariables: {T: 1}\nblocks:\n  p: {block: Pulse, cycle: T}\n",
                        {{"T", "-2"}}),
              "m.yaml:5:28: p: parameter 'cycle' must be greater than 0, but is -2");
}

class Least final : public Block {
  public:
    using Block::Block;
    Parameter<> p{this, "p", {.minimum = 2}};
};

TEST(Errors, AParameterWithoutAValueIsZeroAndHeldToItsLimits) {
    Library library("");
    library.group("test").add<Least>("Least", "");
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nblocks:\n  a: {block: Least}\n", {}, &library),
              "m.yaml:4:3: a: parameter 'p' must be at least 2, but is 0; give 'p' a value");
}

TEST(Errors, OfATableOfTransitionsNameTheLineOfTheirRow) {
    const auto at = [](const std::string& transitions) {
        const std::string text = errors_of("model: m\nstep: 0.1\nblocks:\n  c: {block: Constant}\n  m:\n"
                                           "    block: StateMachine\n    states: [a, b]\n    transitions:" +
                                           transitions + "connections: {c: m}\n");
        return text.substr(0, text.find(", but"));
    };
    const std::string to = ": m: argument 'transitions', row 2: to is 3";
    EXPECT_EQ(at("\n      - [1, 2, 0, 0]\n      # back\n      - [2, 3, 0, 0]\n"), "m.yaml:11:9" + to);
    EXPECT_EQ(at(" [[1, 2, 0, 0],\n      [2, 3, 0, 0]]\n"), "m.yaml:9:7" + to);
    EXPECT_EQ(at(" [1 2 0 0;\n      2 3 0 0]\n"), "m.yaml:9:7" + to);
    EXPECT_EQ(at(" |\n      [1 2 0 0;\n       2 3 0 0]\n"), "m.yaml:10:8" + to);
    EXPECT_EQ(at(" \"[1 2 0 0; 2 3 0 0]\"\n"), "m.yaml:8:29" + to);
    EXPECT_EQ(at(" [1 2 0 0;\n      2 1 0 -1]\n"),
              "m.yaml:9:7: m: argument 'transitions', row 2: minimum_time is -1");
    EXPECT_EQ(at(" [1 2 0 0;\n      2 1 2 0]\n"),
              "m.yaml:9:7: m: input 'conditions' of size scalar is too short: 'transitions', row 2, names "
              "condition 2");
    EXPECT_EQ(at(" \"1*[1 2 0 0; 2 3 0 0]\"\n"), "m.yaml:8:18" + to) << "which is evaluated";
}

TEST(Errors, ParametersThatAnIntegerTypeDoesNotHoldAreRefused) {
    const auto model = [](const std::string& blocks) {
        return "model: m\nstep: 0.1\nvariables: {k: 1}\nblocks:\n  a: {block: Constant, value: \"uint8([1 2 "
               "3])\"}\n" +
               blocks + "connections: {a: g}\n";
    };
    const std::string remedy =
        "; the parameter has the type of its signals, uint8: give a value of that type, or "
        "convert the signals before the block with a Convert block";
    EXPECT_EQ(errors_of(model("  g: {block: Gain, K: 0.5}\n")),
              "m.yaml:6:23: g: parameter 'K' must be a whole number from 0 to 255, but is 0.5" + remedy);
    EXPECT_EQ(errors_of(model("  g: {block: Gain, K: [1, 2, 300]}\n")),
              "m.yaml:6:23: g: parameter 'K' must be a whole number from 0 to 255, but element 3 is 300" +
                  remedy);
    EXPECT_EQ(errors_of(model("  g: {block: Bias, bias: 2}\n"), {{"g.bias", "-1"}}),
              "g: parameter 'bias' must be a whole number from 0 to 255, but is -1" + remedy);
    EXPECT_EQ(errors_of(model("  g: {block: Gain, K: k}\n"), {{"k", "2.5"}}),
              "m.yaml:6:23: g: parameter 'K' must be a whole number from 0 to 255, but is 2.5" + remedy);
    EXPECT_EQ(errors_of(model("  g: {block: Gain, K: inf}\n")),
              "m.yaml:6:23: g: parameter 'K' must be a whole number from 0 to 255, but is inf" + remedy);
    EXPECT_EQ(errors_of(model("  g: {block: Gain, K: 255}\n")), "");
    EXPECT_EQ(errors_of(model("  g: {block: UnitDelay, initial: 7.5}\n")),
              "m.yaml:6:34: g: parameter 'initial' must be a whole number from 0 to 255, but is 7.5" +
                  remedy);
}

TEST(Errors, NoParameterIsNan) {
    const std::string text =
        "model: m\nstep: 0.1\nvariables: {k: 1}\nblocks:\n  a: {block: Constant, value: k}\n"
        "  n: {block: RandomNormal, seed: 1.5}\n  b: {block: Constant, value: \"min(k, 2)\"}\n";
    EXPECT_EQ(errors_of(text),
              "m.yaml:6:34: n: parameter 'seed' must be a whole number from 0 to 4294967295, but is 1.5");
    EXPECT_EQ(errors_of(text, {{"k", "NaN"}, {"n.seed", "-1"}}),
              "m.yaml:5:31: a: parameter 'value' must be a number, but is NaN\n"
              "n: parameter 'seed' must be a whole number from 0 to 4294967295, but is -1");
}

TEST(Elaborate, SeedsWithoutAValueFollowFromThePath) {
    const std::string text =
        "model: m\nstep: 0.1\nblocks:\n  a: {block: RandomNormal}\n  b: {block: RandomNormal}\n"
        "  c: {block: WhiteNoise, seed: 7}\n";
    const auto seed = [](const Elaborated& model, const char* path) {
        return model.slot(path, "seed").initial;
    };
    const auto one = elaborate_text(text), again = elaborate_text(text);
    EXPECT_NE(seed(one, "a"), seed(one, "b"));
    EXPECT_EQ(seed(one, "a"), seed(again, "a"));
    EXPECT_EQ(seed(one, "c"), std::vector<double>{7});
    // FNV-1a of "a" is af63dc4c8601ec8c; its halves are joined by exclusive or.
    EXPECT_EQ(seed(one, "a"), std::vector<double>{0xaf63dc4cu ^ 0x8601ec8cu});
}

TEST(Errors, ANamedSignalHasASource) {
    EXPECT_EQ(wrong("  t: {block: Clock}\nsignals: {time: t.z}\n"),
              "m.yaml:5:17: t: there is no output 'z'; did you mean 'y'?; outputs: y");
    EXPECT_EQ(wrong("  t: {block: Clock}\n  e: {block: Terminator}\nconnections: {t: e}\nsignals: {e2: e}\n"),
              "m.yaml:7:15: e: 'e' has no output; remove the connection");
    EXPECT_EQ(
        wrong("  t: {block: Clock}\nsignals: {t: t}\n"),
        "m.yaml:5:11: 't' names a signal and something else; rename one of them, so that paths are clear");
}

TEST(Errors, UnknownSignalToRecordIsNamedWithSimilarOnes) {
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nblocks:\n  clock: {block: Clock}\nrecord: [clock.z, clokc]\n"),
              "m.yaml:5:19: there is no signal 'clokc'; did you mean 'clock'?");
    EXPECT_EQ(errors_of("model: m\nstep: 0.1\nblocks:\n  clock: {block: Clock}\nrecord: [clock.z, x.*]\n"),
              "m.yaml:5:19: there is no signal 'x.*'; known are 'clock'");
}

TEST(Errors, ABlockOfSeveralOutputsIsNoSignal) {
    const auto text = [](const std::string& signal) {
        return "model: m\nstep: 0.1\nblocks:\n  clock: {block: Clock}\n  w: {block: SineCosine}\n"
               "connections: {clock: w}\nrecord: [" +
               signal + "]\n";
    };
    EXPECT_EQ(errors_of(text("w")),
              "m.yaml:7:10: there is no signal 'w'; take one of w.sin, w.cos, or all by 'w.*'");
    const auto all = elaborate_text(text("w.*"));
    ASSERT_EQ(all.diagram.record.size(), 2u);
    EXPECT_EQ(all.diagram.record[1].path, "w.cos");
    EXPECT_EQ(all.diagram.find_signal("w").node, -1);
}

} // namespace
} // namespace bf::test

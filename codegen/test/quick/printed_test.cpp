// What generated code reads like, and what is refused.
#include "../cases.hpp"
#include "../folder.hpp"

#include "bf/formats/yaml.hpp"

#include <filesystem>
#include <gtest/gtest.h>
#include <sstream>

namespace bf::codegen::test {
namespace {

template <class F> std::string refusal(F&& f) {
    try {
        f();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

TEST(GeneratedCode, SplitsInitialValuesOverFunctionsOfBoundedLength) {
    std::string blocks;
    for (int i = 0; i < 9; ++i)
        blocks += "      d" + std::to_string(i) + ": {block: UnitDelay, initial: 7}\n";
    blocks += "    connections: {u: [d0, d1, d2, d3, d4, d5, d6, d7, d8]}\n";
    const Elaborated model(
        formats::read_yaml_text("model: m\nstep: 0.1\ninputs: [on]\nblocks:\n  s:\n    "
                                "inputs: [u]\n    execution: enabled\n    states: reset\n    blocks:\n" +
                                    blocks + "connections: {on: [s.enable, s.u]}\n",
                                "m.yaml"));
    for (const Language language : {Language::cpp, Language::c}) {
        const Files files = generate(model.diagram, {.language = language, .statements_per_function = 4});
        std::istringstream source(files.at(language == Language::c ? "m.c" : "m.cpp"));
        int all = 0, here = 0;
        for (std::string line; std::getline(source, line); here = line == "}" ? 0 : here)
            if (line.find("_initial;") != line.npos) {
                ++all;
                EXPECT_LE(++here, 4) << line;
            }
        EXPECT_EQ(all, 18) << "at the start, and when the subsystem begins anew";
    }
}

TEST(GeneratedCode, DefinesNoMacroForThoseWhoIncludeIt) {
    const Elaborated model(
        formats::read_yaml_text("model: m\nstep: 0.1\nblocks: {p: {block: Pulse}, s: {block: Saturate}}\n"
                                "connections: {p: s}\n",
                                "m.yaml"));
    for (const auto& [file, text] : generate(model.diagram))
        EXPECT_EQ(text.find("#define"), std::string::npos) << file;
}

TEST(GeneratedCode, AsksInsideAStepOnlyForWhatDerivativesDependOn) {
    const Elaborated model(formats::read_yaml_text(
        "model: m\nstep: 0.1\nblocks: {shown: {block: Gain}, x: {block: Integrator}, fed: {block: Gain}}\n"
        "connections: {x: [shown, fed], fed: x}\n",
        "m.yaml"));
    const std::string source = generate(model.diagram).at("m.cpp");
    EXPECT_NE(source.find("return outputs_1();"), std::string::npos) << source; // in evaluate()
    const auto others = source.find("::outputs_2() noexcept {");
    EXPECT_LT(source.find("signals.fed_y ="), others) << source;
    EXPECT_GT(source.find("signals.shown_y ="), others) << source;
}

/// The source of a model of these blocks, whose inputs u, v, on are a number, three numbers and a truth
/// value.
std::string source_of(const std::string& blocks, const std::string& connections,
                      const std::string& type = "") {
    const std::string is = type.empty() ? "" : ", type: " + type;
    const Elaborated model(formats::read_yaml_text(
        "model: m\nstep: 0.1\ninputs: {u: {shape: 1" + is + "}, v: {shape: [3]" + is +
            "}, on: {type: boolean}}\nblocks:\n" + blocks + "connections: {" + connections + "}\n",
        "m.yaml"));
    return generate(model.diagram).at("m.cpp");
}

TEST(GeneratedCode, ReadsLikeTheEquation) {
    const std::string source = source_of(R"m(
  difference: {block: Sum, signs: "+-"}
  ratio: {block: Product, operations: "*/"}
  limited: {block: Saturate, lower: -1, upper: 1}
  zone: {block: DeadZone}
  inside: {block: Logic, operator: XOR}
  either: {block: Switch, criterion: "~="}
  spread: {block: Gain, K: [1, 2, 3]}
  sum: {block: DiscreteIntegrator}
  wave: {block: Sine}
  positive: {block: CompareToZero, operator: ">"}
)m",
                                         "u: [difference.u1, ratio.u1, limited, spread, sum, positive, "
                                         "zone, either.u1], wave: [difference.u2, ratio.u2, either.u3], "
                                         "on: [either.u2, inside.u1], positive: inside.u2");
    for (const char* line :
         {"signals.difference_y = inputs.u - signals.wave_y;", "signals.ratio_y = inputs.u / signals.wave_y;",
          "signals.limited_y = math::clamp(inputs.u, parameters.limited_lower, parameters.limited_upper);",
          "signals.inside_y = inputs.on != signals.positive_y;", "workspace_.either_holds = inputs.on;",
          "signals.either_y = workspace_.either_holds ? inputs.u : signals.wave_y;",
          "for (int i = 0; i < 3; ++i) signals.spread_y[i] = parameters.spread_K.data[i] * inputs.u;",
          "next_.sum_x = signals.sum_y;", "signals.positive_y = inputs.u > 0.0;",
          "inputs.u > parameters.zone_end ? inputs.u - parameters.zone_end : inputs.u <",
          "math::clamp(states.sum_x + parameters.sum_gain * period * states.sum_before,"})
        EXPECT_NE(source.find(line), std::string::npos) << line << "\n" << source;
    for (const char* machinery : {"kernels::", "template", "::new", " in(", "(in(", "out("})
        EXPECT_EQ(source.find(machinery), std::string::npos) << machinery << "\n" << source;
}

TEST(GeneratedCode, WritesFormulasAsTheirArithmetic) {
    const std::string source = source_of(R"m(
  f: {block: Fcn, expression: "p(1)*u1 - sin(u2(2))", p: 0.3}
  truth: {block: Fcn, expression: "u > 0 && ~u"}
  each: {block: Fcn, expression: "log1p(u) - min(u, 2)"}
)m",
                                         "u: [f.u1, truth], v: [f.u2, each]");
    for (const char* line :
         {"signals.f_y = parameters.f_p * inputs.u - math::sin(inputs.v[1]);",
          "signals.truth_y = math::as<double>(inputs.u > 0.0 && inputs.u == 0.0);",
          "signals.each_y[i] = math::log1p(inputs.v[i]) - math::minimum(2.0, inputs.v[i]);"})
        EXPECT_NE(source.find(line), std::string::npos) << line << "\n" << source;
    EXPECT_EQ(source.find("kernels::Expression"), std::string::npos) << source;
    const std::string narrow = source_of("  f: {block: Fcn, expression: 2*u}\n", "u: f", "single");
    EXPECT_NE(narrow.find("signals.f_y = math::as<float>(2.0 * math::as<double>(inputs.u));"),
              std::string::npos)
        << narrow;
}

TEST(GeneratedCode, WrapsWholeNumbersAroundInItsEquations) {
    const std::string source = source_of(R"m(
  sum: {block: Sum, signs: "+-"}
  twice: {block: Gain, K: 2}
  sign: {block: Sign}
)m",
                                         "u: [sum.u1, twice, sign], twice: sum.u2", "int8");
    for (const char* line : {"signals.sum_y = math::subtract(inputs.u, signals.twice_y);",
                             "signals.twice_y = math::multiply(parameters.twice_K, inputs.u);",
                             "signals.sign_y = inputs.u > 0 ? 1 : inputs.u < 0 ? -1 : inputs.u;"})
        EXPECT_NE(source.find(line), std::string::npos) << line << "\n" << source;
}

TEST(GeneratedCode, DeclaresTheNamesThatItCallsAlone) {
    const std::string source = source_of("  gain: {block: Gain}\n", "u: gain");
    EXPECT_NE(source.find("using bf::generated::renew;"), std::string::npos) << source;
    EXPECT_EQ(source.find("using "), source.rfind("using ")) << source;
    EXPECT_EQ(source.find("namespace "), std::string::npos) << source;
}

TEST(GeneratedCode, TellsUnitsAndDocsOfInputsAndOutputs) {
    const Elaborated model(formats::read_yaml_text(R"m(model: m
step: 0.1
inputs: {u: {unit: N, doc: of the hand}}
outputs: {y: {unit: N m}}
blocks: {g: {block: Gain}}
connections: {u: g, g: y}
)m",
                                                   "m.yaml"));
    const Files files = generate(model.diagram);
    EXPECT_NE(files.at("m_c.h").find("double u; /* u [N]: of the hand */"), std::string::npos)
        << files.at("m_c.h");
    EXPECT_NE(files.at("m.py").find("# u [N]: of the hand\n"), std::string::npos) << files.at("m.py");
    EXPECT_NE(files.at("m.hpp").find("double u; ///< u [N]: of the hand\n"), std::string::npos)
        << files.at("m.hpp");
    EXPECT_NE(files.at("m.hpp").find("double y; ///< y [N m]\n"), std::string::npos) << files.at("m.hpp");
}

TEST(Generate, RefusesByNameWhatNeedsMoreThanFixedSteps) {
    const Elaborated one(formats::read_yaml_text(R"m(model: loose
step: 0.1
solver: dormand_prince45
algebraic_loops: solve
blocks:
  x: {block: Integrator}
  half: {block: Gain, K: 0.5}
  sum: {block: Sum, signs: +-}
connections: {sum: [half, x], half: sum.u2, x: sum.u1}
)m",
                                                 "m.yaml"));
    EXPECT_EQ(
        refusal([&] { generate(one.diagram); }),
        "no code can be generated for 'loose':\n  the solver 'dormand_prince45' chooses its own steps; give "
        "the "
        "model one with fixed steps, e.g. solver: rk4\n  half: it stands in an algebraic loop, whose "
        "solution takes "
        "a number of iterations that has no bound; break the loop with a UnitDelay\nreplace these blocks, or "
        "generate the part of the model without them");
}

TEST(Generate, RefusesBlocksWithMethodsOnBareProcessors) {
    const auto with = [](const std::string& block) {
        const Elaborated one(formats::read_yaml_text("model: bare\nstep: 0.1\nblocks:\n  x: {block: "
                                                     "Integrator}\n  some: {block: " +
                                                         block + "}\nconnections: {x: some, some: x}\n",
                                                     "m.yaml"));
        return refusal([&] { generate(one.diagram, {.embedded = true}); });
    };
    EXPECT_EQ(with("Relay"), "") << "it answers zero crossings by rules";
    EXPECT_EQ(
        with("FirstOrderHold"),
        "no code can be generated for 'bare':\n  some (FirstOrderHold): its class makes it at the start "
        "of the program, which needs a heap and exceptions\nreplace these blocks, or generate the part "
        "of the model without them");
}

TEST(Generate, WritesIntoEmptyFoldersOnly) {
    const Folder folder;
    write({{"a/b.txt", "text"}}, folder.path);
    EXPECT_EQ(read_text(folder.path / "a" / "b.txt"), "text");
    EXPECT_EQ(refusal([&] {
                  write({{"c.txt", "text"}}, folder.path);
              }),
              "cannot write the folder " + folder.path.string() +
                  ": the folder is not empty; empty it or name another one");
    EXPECT_FALSE(fs::exists(folder.path / "c.txt"));
    EXPECT_EQ(refusal([&] {
                  write({{"c.txt", "text"}}, folder.path / "a" / "b.txt");
              }),
              "cannot write the folder " + (folder.path / "a" / "b.txt").string() +
                  ": it is a file; name a folder");
    EXPECT_NE(refusal([&] { write({{"c.txt", "text"}}, "/proc/no/folder"); }), "");
}

} // namespace
} // namespace bf::codegen::test

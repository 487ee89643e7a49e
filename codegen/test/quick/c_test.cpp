// Generated C: what it reads like, and what it refuses.
#include "../c_models.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <regex>
#include <sstream>

namespace bf::codegen::test {
namespace {

std::string refused_in_c(const std::string& model, const Options& options = {.language = Language::c}) {
    const Elaborated elaborated(formats::read_yaml_text(model, "m.yaml"));
    try {
        generate(elaborated.diagram, options);
    } catch (const GenerationError& error) {
        return error.what();
    }
    return "";
}

// That they compile in C++, too, and have the engine's values is a part of the comparison of all cases.
TEST(GeneratedC, HasEveryFunctionOfFormulas) { EXPECT_EQ(refused_in_c(functions_model()), ""); }

TEST(GeneratedC, ReadsLikeTheEquation) {
    const std::string source = in_c(motor).at("m.c");
    for (const char* line :
         {"    model->signals.difference_y = model->inputs.u - model->signals.wave_y;\n",
          "        m_clamp_float64(model->inputs.u, model->parameters.limited_lower, "
          "model->parameters.limited_upper);\n",
          "    for (int i = 0; i < 12; ++i) {\n        model->signals.spread_y[i] = "
          "model->parameters.spread_K * "
          "model->inputs.v[i];\n    }\n",
          "    model->signals.twice_y = m_multiply_int8(model->parameters.twice_K, model->inputs.n);\n",
          "static int8_t m_multiply_int8(int8_t a, int8_t b)\n"})
        EXPECT_NE(source.find(line), std::string::npos) << line << "\n" << source;
    for (const char* machinery : {"malloc", "template", "::", "kernels", "#define"})
        EXPECT_EQ(source.find(machinery), std::string::npos) << machinery << "\n" << source;
}

TEST(GeneratedC, ComputesWhatStandsInSeveralPlacesOnce) {
    const std::string source =
        in_c("model: m\nstep: 0.1\ninputs: {q: {shape: [4]}}\nblocks: {R: {block: RotationFromQuaternion}}\n"
             "connections: {q: R}\n")
            .at("m.c");
    const std::string square = "model->inputs.q[1] * model->inputs.q[1]";
    EXPECT_NE(source.find(" = " + square + ";"), std::string::npos) << source;
    EXPECT_EQ(source.find(square), source.rfind(square)) << source;
}

TEST(GeneratedC, SaysWhichLinesABlockBecameAndWhatItIsFor) {
    const Files files = in_c(R"m(model: m
step: 0.1
inputs: [u]
blocks:
  speed:
    doc: R-12, follows | within 1 s
    inputs: [u]
    outputs: [y]
    blocks:
      twice: {block: Gain, K: 2}
      noisy: {block: Pulse, doc: R-13}
    connections: {u: twice, twice: y}
connections: {u: speed}
)m");
    const std::string& page = files.at("blocks.md");
    std::smatch row;
    ASSERT_TRUE(std::regex_search(
        page, row,
        std::regex(R"(\| `speed.twice` \| Gain \| m\.c:(\d+) \| R-12, follows \\\| within 1 s \|\n)")))
        << page;
    const auto line = [&](int n) {
        std::istringstream lines(files.at("m.c"));
        std::string text;
        for (int i = 0; i < n; ++i) std::getline(lines, text);
        return text;
    };
    EXPECT_EQ(line(std::stoi(row[1])),
              "    model->signals.speed_twice_y = model->parameters.speed_twice_K * model->inputs.u;");
    ASSERT_TRUE(std::regex_search(page, row, std::regex(R"(\| Pulse \| m\.c:(\d+)-(\d+) \| R-13 \|\n)")))
        << page;
    EXPECT_EQ(line(std::stoi(row[1])), "    {");
    EXPECT_EQ(line(std::stoi(row[2])), "    }");
}

TEST(GeneratedC, HasTheStepOfChartsOnceAndOfEachItsTableAndItsFormulasAsEquations) {
    const std::string chart =
        "{block: StateMachine, chart: {inputs: [u], variables: {n: 2}, states: {a: {states: {b: {exit: "
        "n = n*u, transitions: [{to: c, if: u > 0.5}]}, c: {}}}}}}";
    std::string other = chart;
    other.replace(other.find("n*u"), 3, "n - u");
    const std::string source =
        in_c("model: m\nstep: 0.1\ninputs: [u]\nblocks:\n  one: " + chart + "\n  same: " + chart +
             "\n  other: " + other + "\nconnections: {u: [one, same, other]}\n")
            .at("m.c");
    const auto count = [&](const std::string& text) {
        int times = 0;
        for (auto at = source.find(text); at != source.npos; at = source.find(text, at + 1)) ++times;
        return times;
    };
    EXPECT_EQ(count("static bool m_chart_run("), 1) << source;
    EXPECT_EQ(count("static const int32_t m_chart_1_table["), 1);
    EXPECT_EQ(count("static const int32_t m_chart_2_table["), 1);
    EXPECT_EQ(count("m_chart_3_table"), 0) << "equal charts have one table";
    EXPECT_EQ(count("        y = cells[0] * inputs[0][0];\n"), 1) << source;
    EXPECT_EQ(count("        y = cells[0] - inputs[0][0];\n"), 1) << source;
    EXPECT_EQ(count("enum { m_chart_most_states = 3 };\n"), 1) << source;
}

TEST(GeneratedC, RefusesByNameWhatIsMoreThanArithmetic) {
    const std::string model =
        "model: m\nstep: 0.1\ninputs: {u: {shape: [20]}}\nblocks:\n  noise: {block: WhiteNoise}\n"
        "  order: {block: Sort}\nconnections: {u: order}\n";
    EXPECT_EQ(
        refused_in_c(model),
        "no C code can be generated for 'm', because these rules are more than arithmetic on numbers and "
        "short vectors:\n  order (Sort)\nreplace these blocks, or generate C++: --language c++");
    EXPECT_EQ(refused_in_c(model, {}), "");
    EXPECT_NE(refused_in_c("model: m\nstep: 0.1\nsolver: dormand_prince45\nblocks: {c: {block: Constant}, x: "
                           "{block: Integrator}}\nconnections: {c: x}\n")
                  .find("solver"),
              std::string::npos);
}

} // namespace
} // namespace bf::codegen::test

// FMUs: their variables, clocks and files, and what an importer in C gets of one.
#include "../cases.hpp"
#include "../folder.hpp"

#include "bf/codegen/fmu.hpp"
#include "bf/formats/yaml.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <regex>
#include <set>

namespace bf::codegen::test {
namespace {

using Role = FmuVariable::Role;

FmuCode fmu_of(const std::string& text, const FmuChoice& choice = {}) {
    const Elaborated model(formats::read_yaml_text(text, "m.yaml"));
    return generate_fmu({{.diagram = &model.diagram}}, choice);
}

std::string fmu_refusal(const std::string& text, const FmuChoice& choice = {}) {
    try {
        fmu_of(text, choice);
    } catch (const GenerationError& error) {
        return error.what();
    }
    return "";
}

const FmuVariable& variable(const FmuCode& code, const std::string& name) {
    return *std::ranges::find(code.variables, name, &FmuVariable::name);
}

/// x' = k u - 2 x, and what has no derivative.
const char* const plant = R"m(model: plant
step: 0.1
solver: euler
variables: {k: {value: 3, maximum: 9, unit: N, doc: strength}}
inputs: {u: {unit: N, doc: of the hand}, w: {shape: [2, 2]}, n: {type: int8}}
outputs: {y: {unit: m}, late: {}}
blocks:
  drive: {block: Gain, K: k}
  x: {block: Integrator, initial: 0.5}
  pull: {block: Gain, K: -2}
  force: {block: Sum}
  past: {block: UnitDelay, initial: 7}
  twice: {block: Gain, K: 2}
  pair: {block: Gain, K: [[2, 3], [4, 5]]}
connections: {u: [drive, past], drive: force.u1, x: [pull, y], pull: force.u2, force: x, past: late, w: pair, n: twice}
)m";

TEST(Fmu, HasPortsVariablesParametersSignalsAndStatesInThisOrder) {
    const FmuCode code = fmu_of(plant);
    std::vector<std::pair<std::string, Role>> found;
    for (const auto& v : code.variables)
        if (v.role != Role::signal) found.emplace_back(v.name, v.role);
    EXPECT_EQ(found, (std::vector<std::pair<std::string, Role>>{{"u", Role::input},
                                                                {"w", Role::input},
                                                                {"n", Role::input},
                                                                {"y", Role::output},
                                                                {"late", Role::output},
                                                                {"k", Role::parameter},
                                                                {"drive.K", Role::calculated},
                                                                {"x.initial", Role::fixed},
                                                                {"pull.K", Role::parameter},
                                                                {"past.initial", Role::fixed},
                                                                {"twice.K", Role::parameter},
                                                                {"pair.K", Role::parameter},
                                                                {"x.x", Role::state},
                                                                {"der(x.x)", Role::rate}}));
    std::map<std::string, int> names;
    for (const auto& v : code.variables) EXPECT_EQ(++names[v.name], 1) << v.name;
    EXPECT_EQ(names.count("drive.y"), 1u) << "a signal";
    const auto& k = variable(code, "k");
    EXPECT_EQ(k.start, std::vector<double>{3});
    EXPECT_EQ(k.limits.maximum, 9);
    EXPECT_EQ(k.unit, "N");
    EXPECT_NE(k.doc.find("strength"), std::string::npos);
    EXPECT_EQ(variable(code, "pair.K").start, (std::vector<double>{2, 4, 3, 5})) << "column by column";
    EXPECT_EQ(variable(code, "w").start, std::vector<double>(4, 0.0));
    EXPECT_EQ(variable(code, "w").rows, 2);
    EXPECT_EQ(variable(code, "w").cols, 2);
    EXPECT_EQ(variable(code, "n").type, Type::int8);
    EXPECT_EQ(variable(code, "u").unit, "N");
    EXPECT_EQ(variable(code, "u").doc, "of the hand");
    EXPECT_EQ(variable(code, "past.initial").start, std::vector<double>{7});
    EXPECT_EQ(variable(code, "y").dependencies, std::vector<std::string>{"x.x"});
    EXPECT_TRUE(code.has_derivatives);
    EXPECT_FALSE(code.is_hosted);
    EXPECT_TRUE(code.clocks.empty());
}

TEST(Fmu, AnOutputDependsOnTheInputsAndStatesThatReachItInTheSameInstant) {
    const FmuCode code = fmu_of(R"m(model: m
step: 0.1
solver: rk4
inputs: [a, b, enable, trigger, count, up, r]
outputs: [y_sum, y_late, y_part, y_edge, y_loop, y_limited, y_free]
blocks:
  sum: {block: Sum}
  past: {block: UnitDelay}
  part:
    execution: enabled
    inputs: [u]
    outputs: [y]
    blocks: {d: {block: UnitDelay}}
    connections: {u: d, d: y}
  edge:
    execution: triggered
    inputs: [u]
    outputs: [y]
    blocks: {d: {block: Gain}}
    connections: {u: d, d: y}
  loop:
    execution: for
    inputs: [u]
    outputs: [y]
    blocks: {m: {block: UnitDelay}}
    connections: {u: m, m: y}
  one: {block: Constant, value: 1}
  limited: {block: LimitedIntegrator, upper: 1, reset: rising}
  free: {block: Integrator}
connections: {a: [sum.u1, past, part.u, edge.u, loop.u, limited.u, free], b: sum.u2, enable: part.enable, trigger: edge.trigger,
              count: loop.iterations, r: limited.reset, sum: y_sum, past: y_late, part: y_part, edge: y_edge, loop: y_loop,
              limited: y_limited, free: y_free}
)m");
    const auto of = [&](const std::string& name) { return variable(code, name).dependencies; };
    using Names = std::vector<std::string>;
    EXPECT_EQ(of("y_sum"), (Names{"a", "b"}));
    EXPECT_EQ(of("y_late"), Names{});
    EXPECT_EQ(of("y_part"), Names{"enable"}) << "whether it runs";
    EXPECT_EQ(of("y_edge"), (Names{"a", "trigger"}));
    EXPECT_EQ(of("y_loop"), Names{"count"}) << "how often it runs";
    EXPECT_EQ(of("y_limited"), (Names{"limited.x", "r"})) << "its state jumps in the same instant";
    EXPECT_EQ(of("y_free"), Names{"free.x"});
}

TEST(Fmu, CarriesAllThatItsSourcesIncludeAndNoProgram) {
    for (const int version : {2, 3}) {
        const FmuCode code = fmu_of(plant, {.version = version});
        const std::regex include("#include \"([^\"]+)\"");
        for (const auto& [name, text] : code.files) {
            EXPECT_EQ(text.find("main("), std::string::npos) << name;
            const fs::path folder = fs::path(name).parent_path();
            for (std::sregex_iterator at(text.begin(), text.end(), include), end; at != end; ++at)
                EXPECT_TRUE(code.files.contains((*at)[1]) || code.files.contains(folder / (*at)[1].str()))
                    << name << " includes " << (*at)[1];
        }
        std::vector<std::string> sources;
        for (const auto& [name, text] : code.files)
            if (name.ends_with(".cpp")) sources.push_back(name);
        EXPECT_EQ(code.sources, sources);
        const std::string own = "bf/codegen/fmu" + std::to_string(version) + ".hpp";
        EXPECT_NE(code.files.at("plant_fmu.cpp").find(own), std::string::npos);
        EXPECT_FALSE(code.files.contains("plant_c.h") || code.files.contains("plant_c.cpp"));
        EXPECT_NE(code.files.at("plant_fmu.cpp").find(code.token), std::string::npos);
    }
    std::string other = plant;
    other.replace(other.find("K: -2"), 5, "K: -4");
    EXPECT_NE(fmu_of(plant).token, fmu_of(other).token) << "the token is of this code";
    EXPECT_EQ(fmu_of(plant).token, fmu_of(plant).token);
}

/// Rates of two and three steps, the second one a step late; `more` reads v.
std::string sampled(const std::string& step, const std::string& more) {
    return "model: m\nstep: " + step +
           "\nsolver: rk4\ninputs: [u, v, w]\noutputs: [a, b]\nblocks:\n  d: {block: UnitDelay, period: 2*" +
           step + "}\n  g: {block: Gain, period: 3*" + step + ", offset: " + step +
           "}\n  x: {block: Integrator}\n  more: " + more +
           "\nconnections: {u: [d, g], d: a, g: b, v: more, w: x}\n";
}

TEST(Fmu, ClocksHaveExactCountsWhereAResolutionGivesThem) {
    const FmuCode code = fmu_of(sampled("0.01", "{block: Gain, period: 0.02}"), {.has_clocks = true});
    ASSERT_EQ(code.clocks.size(), 2u);
    const auto& [first, second] = std::tie(code.clocks[0], code.clocks[1]);
    EXPECT_EQ(first.ticks, 2);
    EXPECT_EQ(first.offset, 0);
    EXPECT_EQ((std::vector<std::uint64_t>{first.resolution, first.interval, first.shift}),
              (std::vector<std::uint64_t>{100, 2, 0}));
    EXPECT_EQ(second.ticks, 3);
    EXPECT_EQ(second.offset, 1);
    EXPECT_EQ((std::vector<std::uint64_t>{second.resolution, second.interval, second.shift}),
              (std::vector<std::uint64_t>{100, 3, 1}));
    EXPECT_EQ(variable(code, "a").clocks, std::vector<int>{0});
    EXPECT_EQ(variable(code, "b").clocks, std::vector<int>{1});
    EXPECT_EQ(variable(code, "u").clocks, (std::vector<int>{0, 1})) << "whoever reads it";
    EXPECT_EQ(variable(code, "v").clocks, std::vector<int>{0});
    for (const auto& clock :
         fmu_of(sampled("1/30", "{block: Gain, period: 1/15}"), {.has_clocks = true}).clocks)
        EXPECT_EQ(clock.resolution, 0u) << "no power of ten gives thirds";
    const FmuCode every = fmu_of(sampled("0.01", "{block: Integrator}"), {.has_clocks = true});
    EXPECT_EQ(variable(every, "v").clocks, std::vector<int>{}) << "read at any time";
    const FmuCode apart =
        fmu_of("model: m\nstep: 0.01\ninputs: [u]\nblocks: {d: {block: UnitDelay, period: 0.02}}\n"
               "connections: {u: d}\n",
               {.has_clocks = true});
    ASSERT_EQ(apart.clocks.size(), 1u) << "none of steps in which no block runs";
    EXPECT_EQ(apart.clocks[0].name, "clock_20ms");
}

TEST(Fmu, NamesThatAreTakenAreRefused) {
    EXPECT_EQ(fmu_refusal("model: m\nstep: 0.1\ninputs: [time]\nblocks: {g: {block: Gain}}\n"
                          "connections: {time: g}\n"),
              "no FMU can be made of 'm': 'time' names two of its ports, parameters or variables, or is the "
              "time; rename one");
    EXPECT_EQ(
        fmu_refusal("model: m\nstep: 0.1\ninputs: [u]\nsolver: rk4\nblocks: {x: {block: Integrator}}\n"
                    "connections: {u: x}\n",
                    {.has_clocks = true}),
        "no FMU with clocks can be made of 'm': it has 0 rates of sampled blocks, but must have 1 to 64; "
        "export it without clocks");
}

TEST(Fmu, PortsOfAnEnumerationHaveItsNamesAndOthersNone) {
    const FmuCode code = fmu_of(R"m(model: m
step: 0.1
enumerations: {Gait: {stand: 2, walk: 5}}
inputs: {gait: {type: Gait}, real: {}, whole: {type: int32}}
outputs: {now: {}, later: {}}
blocks:
  past: {block: UnitDelay, initial: 2}
  same: {block: Gain}
connections: {gait: past, past: now, real: same, same: later}
)m");
    const std::vector<std::pair<double, std::string>> names{{2, "stand"}, {5, "walk"}}, none;
    EXPECT_EQ(variable(code, "gait").names, names);
    EXPECT_EQ(variable(code, "gait").type, Type::int32);
    EXPECT_EQ(variable(code, "gait").start, std::vector<double>{2}) << "0 is none of its values";
    EXPECT_EQ(variable(code, "real").names, none);
    EXPECT_EQ(variable(code, "whole").names, none);
    EXPECT_EQ(variable(code, "whole").start, std::vector<double>{0});
}

/// An FMU of this model for n = 2, 1, 3, 5.
FmuCode sized_fmu(const std::string& text) {
    std::vector<Elaborated> all;
    std::vector<FmuModel> models;
    for (const int n : {2, 1, 3, 5}) {
        all.emplace_back(formats::read_yaml_text(
            "model: m\nstep: 0.1\nvariables: {n: " + std::to_string(n) + "}\n" + text, "m.yaml"));
        models.push_back({.diagram = nullptr,
                          .options = {.suffix = "_" + std::to_string(n)},
                          .structure = {static_cast<std::uint64_t>(n)}});
    }
    for (std::size_t m = 0; m < all.size(); ++m) models[m].diagram = &all[m].diagram;
    return generate_fmu(models, {.structural = {"n"}});
}

TEST(Fmu, SizesAreStructuralParametersAndWhatHasOthersIsLeftOut) {
    const FmuCode code = sized_fmu(R"m(solver: rk4
inputs: {u: {shape: [n]}, v: {shape: [2, n]}, w: {}}
outputs: {y: {}, total: {}}
blocks:
  each: {block: Gain, K: 3}
  sized: {block: Gain, K: "(1:n)'"}
  same: {block: Gain, K: "7*ones(n, 1)"}
  past: {block: UnitDelay, initial: 4}
  follows: {block: Gain, K: n}
  square: {block: Constant, value: "eye(n + 1)"}
  slopes: {block: Gain}
  x: {block: Integrator}
  sum: {block: SumOfElements}
connections: {u: [each, sized, same, past], each: y, w: follows, follows: x, v: slopes, past: sum, sum: total}
)m");
    const auto is_there = [&](const std::string& name) {
        return std::ranges::count(code.variables, name, &FmuVariable::name) == 1;
    };
    EXPECT_FALSE(is_there("n")) << "the description has it as a structural parameter";
    EXPECT_EQ(variable(code, "u").rows_by, 0);
    EXPECT_EQ(variable(code, "u").cols_by, -1);
    EXPECT_EQ(variable(code, "v").rows_by, -1);
    EXPECT_EQ(variable(code, "v").rows, 2);
    EXPECT_EQ(variable(code, "v").cols_by, 0);
    EXPECT_EQ(variable(code, "w").rows_by, -1);
    EXPECT_EQ(variable(code, "each.K").role, Role::parameter);
    EXPECT_EQ(variable(code, "each.K").start, std::vector<double>{3});
    EXPECT_EQ(variable(code, "same.K").role, Role::parameter) << "7 in all models";
    EXPECT_EQ(variable(code, "sized.K").role, Role::calculated) << "no one start value describes it";
    EXPECT_EQ(variable(code, "sized.K").rows_by, 0);
    EXPECT_TRUE(variable(code, "sized.K").start.empty());
    EXPECT_EQ(variable(code, "follows.K").role, Role::calculated);
    EXPECT_FALSE(is_there("square.value") || is_there("square.y")) << "n + 1 is no structural parameter";
    EXPECT_TRUE(is_there("x.x") && is_there("der(x.x)"));
    EXPECT_TRUE(code.has_model_exchange) << "one state in all models";
    std::set<std::string> models;
    for (const auto& source : code.sources) models.insert(source.substr(0, source.find('.')));
    for (const char* of : {"m_1", "m_2", "m_3", "m_5"}) EXPECT_TRUE(models.contains(of)) << of;
}

TEST(Fmu, StatesOfSizesThatNoParameterSaysAreNotExchanged) {
    const FmuCode code = sized_fmu("solver: rk4\ninputs: [u]\nblocks: {g: {block: Gain, K: \"ones(n + 1, "
                                   "1)\"}, x: {block: Integrator}}\n"
                                   "connections: {u: g, g: x}\n");
    EXPECT_FALSE(code.has_model_exchange);
    for (const auto& v : code.variables) EXPECT_TRUE(v.role != Role::state && v.role != Role::rate) << v.name;
    try {
        sized_fmu("inputs: [u]\noutputs: [y]\nblocks: {g: {block: Gain, K: \"ones(n + 1, "
                  "1)\"}}\nconnections: {u: g, g: y}\n");
        FAIL();
    } catch (const GenerationError& error) {
        EXPECT_STREQ(
            error.what(),
            "no FMU with structural parameters can be made of 'm': 'y' has as many rows as no structural "
            "parameter says (3 where n = 2, 2 where n = 1, 4 where n = 3, 6 where n = 5), which FMI 3.0 has "
            "no "
            "description for (section 2.4.7.2); divide it into parts of such sizes");
    }
}

/// An importer that knows the standard's functions alone. Value references are places in the list.
const char* const importer = R"c(
#include "bf/fmi/fmi3.h"
#include <stdio.h>
#include <stdlib.h>

static void check(int is) { if (!is) { printf("wrong\n"); exit(1); } }
static double get(fmi3Instance m, fmi3ValueReference at) {
    double value = 0;
    check(fmi3GetFloat64(m, &at, 1, &value, 1) == fmi3OK);
    return value;
}
static void set(fmi3Instance m, fmi3ValueReference at, double value) {
    check(fmi3SetFloat64(m, &at, 1, &value, 1) == fmi3OK);
}
static void numbers(void) {
    fmi3Instance m = fmi3InstantiateCoSimulation("m", TOKEN, NULL, false, false, false, false, NULL, 0, NULL, NULL, NULL);
    check(m != NULL);
    check(fmi3InstantiateCoSimulation("m", "{other}", NULL, false, false, false, false, NULL, 0, NULL, NULL, NULL) == NULL);
    set(m, X0, 0.25);
    check(fmi3EnterInitializationMode(m, false, 0, 0, false, 0) == fmi3OK);
    set(m, U, 2);
    check(fmi3ExitInitializationMode(m) == fmi3OK);
    for (int k = 0; k < 20; ++k) {
        bool event, end, early;
        double reached;
        if (k == 10) set(m, K, 4);
        printf("%.17g %.17g\n", get(m, Y), get(m, LATE));
        set(m, U, 2 + k);
        check(fmi3DoStep(m, 0.1 * k, 0.1, true, &event, &end, &early, &reached) == fmi3OK);
    }
    double much = 10;
    const fmi3ValueReference k = K;
    check(fmi3SetFloat64(m, &k, 1, &much, 1) != fmi3OK);
    fmi3FreeInstance(m);
}
static void exchange(void) {
    fmi3Instance m = fmi3InstantiateModelExchange("m", TOKEN, NULL, false, false, NULL, NULL);
    check(m != NULL);
    check(fmi3EnterInitializationMode(m, false, 0, 0, false, 0) == fmi3OK);
    set(m, U, 2);
    check(fmi3ExitInitializationMode(m) == fmi3OK);
    bool again, end, nominals, states, has_next;
    double next, x = 0, slope = 0, seed = 1, changes = 0;
    check(fmi3UpdateDiscreteStates(m, &again, &end, &nominals, &states, &has_next, &next) == fmi3OK && has_next);
    check(fmi3EnterContinuousTimeMode(m) == fmi3OK);
    size_t count = 0;
    check(fmi3GetNumberOfContinuousStates(m, &count) == fmi3OK && count == 1);
    check(fmi3GetNumberOfEventIndicators(m, &count) == fmi3OK && count == 0);
    check(fmi3GetContinuousStates(m, &x, 1) == fmi3OK);
    printf("%.17g %.17g\n", x, next);
    for (int k = 1; k < 4; ++k) {
        x = 10 * k;
        check(fmi3SetTime(m, 0.01 * k) == fmi3OK && fmi3SetContinuousStates(m, &x, 1) == fmi3OK);
        check(fmi3GetContinuousStateDerivatives(m, &slope, 1) == fmi3OK);
        printf("%.17g %.17g %.17g\n", slope, get(m, Y), get(m, RATE));
    }
    const fmi3ValueReference rate = RATE, knowns[] = {X, U, Y};
    for (int k = 0; k < 2; ++k) {
        check(fmi3GetDirectionalDerivative(m, &rate, 1, &knowns[k], 1, &seed, 1, &changes, 1) == fmi3OK);
        printf("%.17g\n", changes);
    }
    fmi3FreeInstance(m);
}
int main(void) {
    numbers();
    exchange();
    return 0;
}
)c";

TEST(Fmu, GivesAnImporterTheNumbersOfTheModel) {
    const FmuCode code = fmu_of(plant);
    const Folder folder("fmu");
    write(code.files, folder.path);
    std::string defines = "#define TOKEN \"" + code.token + "\"\n";
    for (const auto& [name, of] : {std::pair{"U", "u"},
                                   {"Y", "y"},
                                   {"LATE", "late"},
                                   {"K", "k"},
                                   {"X0", "x.initial"},
                                   {"X", "x.x"},
                                   {"RATE", "der(x.x)"}})
        defines += "#define " + std::string(name) + " " +
                   std::to_string(&variable(code, of) - code.variables.data() + 1) + "\n";
    write_text(folder.path / "importer.c",
               "#include <stdbool.h>\n#include <stddef.h>\n" + defines + importer);
    std::string sources;
    for (const auto& source : code.sources) sources += " " + source;
    ASSERT_EQ(std::system(("cd " + folder.path.string() +
                           " && " BF_CC " -std=c11 -I. -c importer.c && " BF_CXX
                           " -std=c++17 -O0 -ffp-contract=off -I. importer.o" +
                           sources + " -o importer && ./importer > out.txt")
                              .c_str()),
              0)
        << read_text(folder.path / "out.txt");
    std::istringstream out(read_text(folder.path / "out.txt"));
    double x = 0.25, last = 7, y = 0, late = 0;
    for (int k = 0; k < 20; ++k) {
        out >> y >> late;
        EXPECT_NEAR(y, x, 1e-12) << k;
        EXPECT_EQ(late, last) << k;
        last = 2 + k;
        x += 0.1 * ((k < 10 ? 3 : 4) * (2.0 + k) - 2 * x); // Euler's rule
    }
    double slope = 0, rate = 0, next = 0;
    out >> x >> next;
    EXPECT_EQ(x, 0.5);
    EXPECT_NEAR(next, 0.1, 1e-12) << "the delay is sampled";
    for (int k = 1; k < 4; ++k) {
        out >> slope >> y >> rate;
        EXPECT_EQ(slope, 3 * 2 - 2 * 10 * k);
        EXPECT_EQ(y, 10 * k);
        EXPECT_EQ(rate, slope);
    }
    double by_x = 0, by_u = 0;
    out >> by_x >> by_u;
    EXPECT_EQ(by_x, -2);
    EXPECT_EQ(by_u, 3);
    EXPECT_FALSE(out.fail());
}

} // namespace
} // namespace bf::codegen::test

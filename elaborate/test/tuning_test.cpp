#include "bf/elaborate/tuning.hpp"

#include "support.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::test {
namespace {

const std::string text = R"m(
model: m
step: T
variables:
  T: 0.01
  n: 2
  Gain: {Kp: 3, Kd: 2*sqrt(Gain.Kp), row: [1, 2]}
  limit: Gain.Kp + T
  mode: 'fast'
blocks:
  p: {block: Gain, K: Gain.Kp}
  d: {block: Gain, K: "Gain.Kd*[1 2]"}
  free: {block: Constant, value: 5}
  sized: {block: Constant, value: "zeros(n, 1)"}
  part:
    variables: {copy: Gain, factor: 2*copy.Kp}
    inputs: [u]
    outputs: [y]
    blocks:
      g: {block: Gain, K: "factor*copy.row(2)"}
    connections: {u: g, g: y}
connections: {free: [p, d, part.u]}
)m";

/// What elaboration gives the parameters with these overrides.
NamedValues elaborated(const Overrides& overrides, const NamedValues& names) {
    const auto model = elaborate_text(text, overrides);
    NamedValues values;
    for (const auto& [name, ignored] : names) {
        const auto dot = name.rfind('.');
        values.emplace_back(name, model.slot(name.substr(0, dot), name.substr(dot + 1)).initial);
    }
    return values;
}

TEST(Tuning, GivesTheParametersThatElaborationGivesWithTheSameOverride) {
    const auto model = elaborate_text(text);
    const Tuning tuning(model.diagram);
    const NamedValues followed = tuning.follow({{"Gain.Kp", {7}}});
    ASSERT_EQ(followed.size(), 3u);
    EXPECT_EQ(followed[0].first, "p.K");
    EXPECT_EQ(followed[1].first, "d.K");
    EXPECT_EQ(followed[2].first, "part.g.K");
    EXPECT_EQ(followed, elaborated({{"Gain.Kp", "7"}}, followed));
    const NamedValues row = tuning.follow({{"Gain.row", {1, 8}}});
    EXPECT_EQ(row, (NamedValues{{"part.g.K", {48}}}));
    EXPECT_EQ(row, elaborated({{"Gain.row", "[1 8]"}}, row));
}

TEST(Tuning, KeepsWhatWasGivenByName) {
    const auto model = elaborate_text(text);
    Tuning tuning(model.diagram);
    const NamedValues both{{"Gain.Kp", {7}}, {"Gain.Kd", {1}}, {"p.K", {9}}};
    const NamedValues followed = tuning.follow(both);
    EXPECT_EQ(followed, elaborated({{"Gain.Kp", "7"}, {"Gain.Kd", "1"}, {"p.K", "9"}}, followed));
    tuning.accept(both);
    EXPECT_EQ(tuning.follow({{"Gain.Kp", {8}}}), (NamedValues{{"part.g.K", {32}}}));
    for (const auto& variable : tuning.variables()) {
        if (variable.path != "Gain.Kd") continue;
        EXPECT_EQ(variable.values, std::vector<double>{1});
    }
}

/// Why the changes are refused; empty: they hold from now on.
std::string refusal(Tuning& tuning, const NamedValues& changes) {
    try {
        tuning.follow(changes);
        tuning.accept(changes);
    } catch (const TuningError& error) {
        return error.what();
    }
    return {};
}
std::string refusal(const NamedValues& changes) {
    const auto model = elaborate_text(text);
    Tuning tuning(model.diagram);
    return refusal(tuning, changes);
}

TEST(Tuning, LetsAVariableBeNanUntilAParameterFollows) {
    const std::string blocks = "model: m\nstep: 0.1\nvariables: {k: 1}\nblocks:\n";
    const auto limited = elaborate_text(blocks + "  a: {block: Constant, value: \"min(k, 2)\"}\n");
    EXPECT_EQ(Tuning(limited.diagram).follow({{"k", {0.0 / 0.0}}}), (NamedValues{{"a.value", {2}}}));
    const auto plain = elaborate_text(blocks + "  a: {block: Constant, value: k}\n");
    Tuning tuning(plain.diagram);
    EXPECT_EQ(refusal(tuning, {{"k", {0.0 / 0.0}}}), "parameter 'a.value' must be a number, but is NaN");
}

TEST(Tuning, RefusesParametersThatFollowAndAreNoIntegers) {
    const auto model =
        elaborate_text("model: m\nstep: 0.1\nvariables: {k: 1}\nblocks:\n  a: {block: Constant, value: "
                       "uint8(1)}\n  g: {block: Gain, K: k}\nconnections: {a: g}\n");
    Tuning tuning(model.diagram);
    EXPECT_EQ(refusal(tuning, {{"k", {0.5}}}),
              "parameter 'g.K' must be a whole number from 0 to 255, but is 0.5");
    EXPECT_EQ(refusal(tuning, {{"k", {3}}}), "");
}

TEST(Tuning, RefusesWhatIsFixedAndSaysWhy) {
    EXPECT_EQ(refusal({{"T", {0.1}}}),
              "variable 'T' cannot change in a run: 'step' follows from it: it is fixed when "
              "the model is elaborated");
    EXPECT_EQ(refusal({{"n", {3}}}),
              "'sized.value', which follows, would become a 3x1 double; it is a 2x1 double");
    EXPECT_EQ(refusal({{"Gain.row", {1}}}), "variable 'Gain.row' has 2 elements, not 1");
    EXPECT_EQ(refusal({{"Gain.Kp", {0.0 / 0.0}}}), "parameter 'p.K' must be a number, but is NaN");
    EXPECT_EQ(
        refusal({{"Gain.Kp", {-1}}}),
        "'Gain.Kd', which follows, has no value: sqrt(-1) is complex; complex numbers are not supported");
    EXPECT_EQ(refusal({{"mode", {1}}}), "variable 'mode' cannot change in a run: it is a text");
}

TEST(Tuning, RefusesParametersThatFollowOutsideOfTheirLimits) {
    const auto model =
        elaborate_text("model: m\nstep: 1\nvariables: {w: 4, twice: 2*w}\nblocks:\n"
                       "  inside:\n    blocks: {p: {block: Pulse, cycle: 1/w, width: twice}}\n");
    Tuning tuning(model.diagram);
    const auto refused = [&](const NamedValues& changes) { return refusal(tuning, changes); };
    EXPECT_EQ(refused({{"w", {60}}}), "parameter 'inside.p.width' must be from 0 to 100, but is 120");
    EXPECT_EQ(refused({{"w", {-4}}}), "parameter 'inside.p.cycle' must be greater than 0, but is -0.25");
    EXPECT_EQ(tuning.variables()[0].values, std::vector<double>{4});
    EXPECT_EQ(refused({{"w", {60}}, {"inside.p.width", {50}}}), "") << "what was given follows no more";
}

TEST(Tuning, ListsUnitsDocsAndWhatVariablesFollowFrom) {
    const auto model = elaborate_text(R"m(model: m
step: 1
variables:
  Gain: {Kp: {value: 3, unit: N/m, doc: stiffness}, Kd: 1}
  twice:
    value: 2*Gain.Kp
    doc: |
      in two
      lines
  name: 'text'
blocks:
  inside:
    variables:
      copy: Gain
      half: {value: copy.Kp/2, unit: N/m}
    blocks: {c: {block: Constant, value: half}}
)m");
    std::string list;
    for (const auto& variable : Tuning(model.diagram).variables())
        list += variable.path + " [" + variable.unit + "] " + variable.about + "\n";
    EXPECT_EQ(list, "Gain.Kp [N/m] stiffness\nGain.Kd [] \ntwice [] in two lines; = 2*Gain.Kp\n"
                    "inside.half [N/m] = copy.Kp/2\n");
}

TEST(Tuning, HoldsVariablesToTheirLimits) {
    const auto model = elaborate_text(R"m(
model: m
step: 1
variables:
  top: 100
  Gain: {Kp: {value: 3, minimum: 0, maximum: top}, Kd: 1}
  twice: {value: 2*Gain.Kp, maximum: 60}
  unused: {value: [1, 2], above: 0}
blocks:
  inside:
    variables: {copy: Gain, half: {value: twice/2, above: 1}}
    blocks: {c: {block: Constant, value: half + copy.Kp}}
)m");
    Tuning tuning(model.diagram);
    const auto refused = [&](const NamedValues& changes) { return refusal(tuning, changes); };
    EXPECT_EQ(refused({{"Gain.Kd", {2}}, {"Gain.Kp", {-1}}}),
              "variable 'Gain.Kp' must be from 0 to 100, but is -1");
    EXPECT_EQ(refused({{"Gain.Kp", {40}}}), "variable 'twice' must be at most 60, but is 80");
    EXPECT_EQ(refused({{"Gain.Kp", {0.5}}}), "variable 'inside.half' must be greater than 1, but is 0.5");
    EXPECT_EQ(refused({{"unused", {1, -2}}}),
              "variable 'unused' must be greater than 0, but element 2 is -2");
    EXPECT_EQ(refused({{"top", {200}}}), "variable 'top' cannot change in a run: 'Gain.Kp.maximum' follows "
                                         "from it: it is fixed when the model is elaborated");
    for (const auto& variable : tuning.variables()) {
        if (variable.path == "Gain.Kd") {
            EXPECT_EQ(variable.values, std::vector<double>{1});
        } else if (variable.path == "twice") {
            EXPECT_EQ(bf::text_of(variable.limits), "at most 60");
        }
    }
    EXPECT_EQ(refused({{"Gain.Kp", {40}}, {"twice", {60}}}), "") << "what was given follows no more";
}

TEST(Tuning, HoldsAStructToTheLimitsOfItsCopies) {
    const auto folder = std::filesystem::path(testing::TempDir()) / ("bf_copies_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "inner.yaml") << "model: inner\nvariables: {Gain: {Kp: {value: 1, maximum: 5}}}\n"
                                            "blocks: {c: {block: Constant, value: Gain.Kp}}\n";
    std::ofstream(folder / "outer.yaml")
        << "model: outer\nstep: 1\nvariables: {Gain: {Kp: {value: 2, minimum: "
           "0, maximum: 9}}}\nblocks: {a: {file: inner.yaml, with: {Gain: "
           "Gain}}}\n";
    const auto model = elaborate_model(formats::read_yaml(folder / "outer.yaml"));
    std::filesystem::remove_all(folder);
    EXPECT_EQ(Tuning(model.diagram).follow({{"Gain.Kp", {5}}}), (NamedValues{{"a.c.value", {5}}}));
    try {
        Tuning(model.diagram).follow({{"Gain.Kp", {6}}});
        ADD_FAILURE();
    } catch (const TuningError& error) {
        EXPECT_STREQ(error.what(), "variable 'Gain.Kp' must be from 0 to 5, but is 6");
    }
}

TEST(Tuning, IterationsKnowTheirNumberAndShareTheVariables) {
    const auto model = elaborate_text(R"m(
model: m
step: 1
variables: {k: 10}
blocks:
  c: {block: Constant, value: [1, 2]}
  each:
    execution: for_each
    iterations: 2
    inputs: {u: {each: true}}
    outputs: [y]
    blocks: {g: {block: Gain, K: k*iteration}}
    connections: {u: g, g: y}
connections: {c: each.u}
)m");
    EXPECT_EQ(Tuning(model.diagram).follow({{"k", {100}}}),
              (NamedValues{{"each(1).g.K", {100}}, {"each(2).g.K", {200}}}));
}

} // namespace
} // namespace bf::test

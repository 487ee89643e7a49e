// bf linearize and the responses of linear systems.
#include "bf/base/files.hpp"
#include "command.hpp"

#include <cmath>
#include <complex>

namespace bf::tools {

namespace {

/// y'' + 3 y' + 2 y = 2 u, in a loop with a gain of 5.
const std::string loop_model = R"(model: loop
step: 0.01
stop: 1
solver: rk4
inputs: [r]
outputs: [y]
blocks:
  error: {block: Sum, signs: +-}
  gain: {block: Gain, K: 5}
  plant: {block: TransferFunction, numerator: 2, denominator: "[1 3 2]"}
connections:
  r: error.u1
  error: gain
  gain: plant
  plant: [error.u2, y]
)";

class Linearize : public Command {
  protected:
    void SetUp() override {
        Command::SetUp();
        write("loop.yaml", loop_model);
    }
};

TEST_F(Linearize, PrintsMatricesByName) {
    const auto printed = bf("linearize loop.yaml --from gain --open gain");
    EXPECT_EQ(printed.code, 0) << printed.err;
    EXPECT_CONTAINS(printed.out, "at 0 s, in continuous time\n");
    EXPECT_CONTAINS(printed.out, "plant.x[1]");
    EXPECT_CONTAINS(printed.out, "poles\n  -2\n  -1\n");
}

TEST_F(Linearize, WritesJsonYamlAndMat) {
    EXPECT_EQ(bf("linearize loop.yaml -o a.json").out, "a.json\n");
    const auto system = json("a.json");
    EXPECT_EQ(system["inputs"][0], "r");
    EXPECT_EQ(system["states"].size(), 2u);
    EXPECT_EQ(system["A"].size(), 2u);
    EXPECT_EQ(system["period"], 0.0);
    EXPECT_EQ(bf("linearize loop.yaml -o a.yaml").code, 0);
    EXPECT_CONTAINS(read("a.yaml"), "states: [\"plant.x[1]\",\"plant.x[2]\"]\n");
    EXPECT_EQ(bf("linearize loop.yaml -o a.mat").code, 0);
    write("look.py", "import scipy.io, json\nm, j = scipy.io.loadmat('a.mat'), json.load(open('a.json'))\n"
                     "assert all((m[k] == j[k]).all() for k in 'ABCD'), m\n"
                     "assert m['Ts'] == 0 and m['StateName'][1][0][0] == 'plant.x[2]', m\n");
    EXPECT_EQ(std::system(("cd " + folder.string() + " && " BF_PYTHON " look.py").c_str()), 0);
}

TEST_F(Linearize, TellsTheMarginsOfALoopAndDrawsIt) {
    // |10 / ((jw + 1)(jw + 2))| = 1 where (w² + 1)(w² + 4) = 100.
    const double square = (-5 + std::sqrt(25 + 4 * 96.0)) / 2, crossover = std::sqrt(square);
    const double phase = 180 - (std::atan(crossover) + std::atan(crossover / 2)) * 180 / M_PI;
    for (const std::string verb : {"bode", "nyquist", "nichols"}) {
        const auto told = bf(verb + " loop.yaml --loop plant -o " + verb + ".png");
        ASSERT_EQ(told.code, 0) << told.err;
        char text[100];
        std::snprintf(text, sizeof text, "%.6g degrees at %.6g rad/s", phase, crossover);
        EXPECT_CONTAINS(told.out, text);
        EXPECT_CONTAINS(told.out, "gain margin     none");
        EXPECT_GT(read(verb + ".png").size(), 5000u);
    }
    const auto locus = bf("rootlocus loop.yaml --loop plant -o locus.svg");
    EXPECT_CONTAINS(locus.out, "-1.5 + 3.1225j"); // s² + 3 s + 12
    EXPECT_CONTAINS(read("locus.svg"), "open-loop poles");
    EXPECT_EQ(bf("rootlocus loop.yaml --loop plant").out.find("locus.svg"), std::string::npos);
    // L = 10 (-1)/((s + 1) (s + 2)) turns from -180 to -360 degrees.
    EXPECT_EQ(bf("bode loop.yaml --loop plant --set gain.K=-5 -o turned.svg").code, 0);
    EXPECT_CONTAINS(read("turned.svg"), "-180 degrees");
    EXPECT_CONTAINS(bf("bode loop.yaml --loop plant --set gain.K=-15").out, "unstable; the margins lead to");
    const auto step = bf("step loop.yaml -o step.png");
    EXPECT_CONTAINS(step.out, "final value     0.833333");
}

TEST_F(Linearize, FindsAnOperatingPointFromWhichRunsGoOn) {
    // y = 10/12 r.
    const auto found = bf("trim loop.yaml --free r --target y=2 -o held.snapshot");
    ASSERT_EQ(found.code, 0) << found.err;
    EXPECT_CONTAINS(found.out, "  r           2.4\n");
    EXPECT_CONTAINS(found.out, "held.snapshot\n");
    EXPECT_EQ(bf("linearize loop.yaml --from-snapshot held.snapshot -o a.json").code, 0);
    EXPECT_NEAR(json("a.json")["y"][0].get<double>(), 2, 1e-9);
    EXPECT_CONTAINS(bf("trim loop.yaml --free r").err,
                    "there are 3 free numbers (plant.x[1], plant.x[2], r) for 2 equations");
    EXPECT_CONTAINS(bf("trim loop.yaml --free r --target y").err,
                    "--target y has no number where it needs one");
    EXPECT_CONTAINS(bf("trim loop.yaml --free r --target y=2 --bound r=:1").err, "'r' is at its bound");
}

TEST_F(Linearize, MeasuresTheSameResponseInSimulation) {
    const auto found = bf(
        "frequency-response loop.yaml --loop gain --frequencies 1:10 --points 3 -o m.json -o m.png -o m.mat");
    EXPECT_EQ(found.code, 0) << found.err;
    EXPECT_CONTAINS(found.out, "from gain to gain at 0 s, amplitude 0.01\n");
    EXPECT_CONTAINS(found.out, "m.json\nm.png\nm.mat\n");
    EXPECT_EQ(read("m.png").substr(1, 3), "PNG");
    const auto measured = json("m.json");
    ASSERT_EQ(measured["omega"].size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::complex<double> s(0, measured["omega"][i]), L = 10.0 / (s * s + 3.0 * s + 2.0);
        EXPECT_NEAR(measured["real"][i], L.real(), 1e-4);
        EXPECT_NEAR(measured["imaginary"][i], L.imag(), 1e-4);
    }
    const auto swept =
        bf("frequency-response loop.yaml --from r --to y --frequencies 1:10 --points 4 --chirp -o m.yaml");
    EXPECT_EQ(swept.code, 0) << swept.err;
    EXPECT_CONTAINS(read("m.yaml"), "input: \"r\"\noutput: \"y\"\n");
    EXPECT_CONTAINS(read("m.yaml"), "distortion: [null,null,null,null]\n");
}

TEST_F(Linearize, TellsHowTheCostOfARunChangesWithParametersAndInputs) {
    // At rest, y comes to 10/12 r, whatever the gain.
    const auto found = bf("gradient loop.yaml --cost plant --by r --by gain.K --duration 20 --at-end");
    EXPECT_EQ(found.code, 0) << found.err;
    EXPECT_EQ(found.out, "cost  0\ngradient, forward\n  r       at 0  0.833333\n  gain.K  at 5  0\n");
    EXPECT_CONTAINS(bf("gradient loop.yaml --cost plant --by gian.K").err,
                    "no parameter, state or input 'gian.K'; did you mean 'gain.K'");
    EXPECT_CONTAINS(bf("gradient loop.yaml --cost plant --by gain.K --way back").err,
                    "--way: is cheaper, forward or adjoint, not back");
    EXPECT_EQ(bf("gradient loop.yaml --cost plant").code, 2);
}

TEST_F(Linearize, TunesALoopAndWritesItsGains) {
    // 2 k/(s² + 3 s + 2) is 1 at 3 rad/s for k = |(3j + 1) (3j + 2)|/2.
    const std::string tune = "tune loop.yaml --loop gain --by gain.K --crossover 3 ";
    const auto printed = bf(tune);
    EXPECT_EQ(printed.code, 0) << printed.err;
    const auto k = std::sqrt(10.0 * 13) / 2;
    EXPECT_CONTAINS(printed.out, "\ngain: {K: 5.70088}\n");
    EXPECT_NEAR(k, 5.70088, 1e-5);
    EXPECT_CONTAINS(bf(tune + "-o g.yaml --picture g.png").out, "g.yaml\ng.png\ng_bode.png\n");
    EXPECT_EQ(read("g.yaml"), "gain: {K: 5.70088}\n");
    EXPECT_CONTAINS(bf("bode loop.yaml --loop gain --params g.yaml").out, "at 3 rad/s");
    EXPECT_CONTAINS(bf(tune + "--edit --set stop=3").err,
                    "right with another 'stop'; change that in the file");
    EXPECT_CONTAINS(bf(tune + "--edit").out, "loop.yaml\n");
    std::string expected = loop_model;
    expected.replace(expected.find("K: 5"), 4, "K: 5.70088");
    EXPECT_EQ(read("loop.yaml"), expected);
}

TEST_F(Linearize, EditsWhatIsGivenToAModelInAFileOfItsOwn) {
    const std::string controller =
        "model: p\ninputs: [e]\noutputs: [u]\nvariables: {Gain: {Kp: 2}}\nblocks:\n"
        "  k: {block: Gain, K: Gain.Kp}\nconnections: {e: k, k: u}\n";
    write("p.yaml", controller);
    std::string text = loop_model;
    text.replace(text.find("gain: {block: Gain, K: 5}"), 25, "gain: {file: p.yaml}   # of the loop");
    write("uses.yaml", text);
    const auto done = bf("tune uses.yaml --loop gain --by gain.Gain.Kp --crossover 3 --edit");
    EXPECT_EQ(done.code, 0) << done.err;
    EXPECT_EQ(read("p.yaml"), controller);
    EXPECT_CONTAINS(read("uses.yaml"), "5.70088");
    EXPECT_CONTAINS(read("uses.yaml"), "# of the loop");
    EXPECT_CONTAINS(bf("bode uses.yaml --loop gain").out, "at 3 rad/s");
}

TEST_F(Linearize, TellsWhichVariableAGainNoLongerFollows) {
    std::string text = loop_model;
    text.replace(text.find("K: 5"), 4, "K: 2*k");
    text.replace(text.find("blocks:"), 7, "variables: {k: 2.5}\nblocks:");
    write("follows.yaml", text);
    EXPECT_CONTAINS(bf("tune follows.yaml --loop gain --by gain.K --crossover 3").err,
                    "gain.K no longer follows k; --by k tunes the variable\n");
    EXPECT_EQ(bf("tune follows.yaml --loop gain --by k --crossover 3").err.find("no longer"),
              std::string::npos);
}

TEST_F(Linearize, TellsWhenASimulatedStepEnds) {
    std::string text = loop_model;
    text.replace(text.find("connections:"), 0,
                 "  small: {block: CompareToConstant, operator: '<', constant: 0.0005}\n  fails: {block: "
                 "Assertion}\n");
    text += "  small: fails\n";
    text.replace(text.find("[error.u2, y]"), 13, "[error.u2, y, small]");
    write("ends.yaml", text);
    const auto done = bf("tune ends.yaml --loop gain --by gain.K --crossover 3 --picture ends.png");
    EXPECT_EQ(done.code, 0) << done.err;
    EXPECT_EQ(read("ends.png").substr(1, 3), "PNG"); // of what is linearised
    EXPECT_CONTAINS(done.out, "gain: {K: 5.70088}");
    EXPECT_CONTAINS(done.err, "after: the simulated step of 0.01 ends at ");
    EXPECT_CONTAINS(done.err, "fails: the asserted condition does not hold");
}

TEST_F(Linearize, SaysOfACheckWhichLimitIsNearer) {
    write("limits.yaml",
          "model: limits\nstep: 0.1\nstop: 1\nvariables: {k: {value: 2, maximum: 2.4}}\nblocks:\n"
          "  c: {block: Constant, value: k}\n  f: {block: Check, kind: final, at_least: 0, at_most: 3}\n"
          "connections: {c: f}\n");
    const auto found = bf("sensitivity limits.yaml");
    EXPECT_CONTAINS(found.out, "f = 2, at least 0, at most 3: 1 from its upper limit\n");
    EXPECT_CONTAINS(found.out, "3, beyond its own limits\n");
}

TEST_F(Linearize, EditsVariablesWhereTheyStand) {
    const std::string text =
        "model: v\nstep: 0.01\nvariables:\n  Gain: {Kp: 1}   # of the loop\nblocks:\n  c:\n"
        "    inputs: [e]\n    outputs: [u]\n    variables:\n      Ki: 0.1\n    blocks:\n"
        "      p: {block: Gain, K: -Gain.Kp}\n      i: {block: DiscreteIntegrator, gain: -Ki, period: 0.01}\n"
        "      s: {block: Sum, signs: ++}\n    connections: {e: [p, i], p: s.u1, i: s.u2, s: u}\n"
        "  plant: {block: DiscreteTransferFunction, numerator: 0.1, denominator: \"[1 -0.95]\", period: "
        "0.01}\n"
        "connections: {c: plant, plant: c.e}\n";
    write("v.yaml", text);
    const auto done =
        bf("tune v.yaml --loop c.u --by Gain.Kp --by c.Ki --crossover 12 --phase-margin 70 --edit");
    EXPECT_EQ(done.code, 0) << done.err;
    EXPECT_CONTAINS(read("v.yaml"), "   # of the loop\n");
    EXPECT_EQ(read("v.yaml").find("Kp: 1}"), std::string::npos);
    EXPECT_EQ(read("v.yaml").find("Ki: 0.1\n"), std::string::npos);
    const auto margins = bf("bode v.yaml --loop c.u");
    EXPECT_CONTAINS(margins.out, "stable\n");
    const auto at = margins.out.find("phase margin");
    ASSERT_NE(at, std::string::npos) << margins.out;
    EXPECT_NEAR(std::strtod(margins.out.c_str() + at + 12, nullptr), 70, 1e-3) << margins.out;
}

TEST_F(Linearize, LeavesElementsAsTheyAreBesideATunedOne) {
    const std::string text =
        "model: w\nstep: 0.01\nsolver: rk4\nvariables:\n  K: \"[0.123456789 5; 7 8]\"\nblocks:\n"
        "  g: {block: Gain, K: \"-K(1,2)\"}\n"
        "  plant: {block: TransferFunction, numerator: 1, denominator: \"[1 1]\"}\n"
        "connections: {g: plant, plant: g}\n";
    write("w.yaml", text);
    // K/(s + 1) is 1 at 2 rad/s for K = sqrt(5); of a matrix elements are counted column by column.
    const auto done = bf("tune w.yaml --loop g --by 'K[3]' --crossover 2 -o w_gains.yaml --edit");
    EXPECT_EQ(done.code, 0) << done.err;
    EXPECT_EQ(read("w_gains.yaml"), "K: \"[0.123456789 2.23607; 7 8]\"\n");
    EXPECT_CONTAINS(read("w.yaml"), "[0.123456789 2.23607; 7 8]");
}

TEST_F(Linearize, TellsHowNearChecksAreToTheirLimits) {
    write("checked.yaml",
          loop_model.substr(0, loop_model.find("connections:")) +
              "  high: {block: Check, kind: maximum, at_most: 1.5}\n"
              "connections:\n  r: error.u1\n  error: gain\n  gain: [plant, high]\n  plant: [error.u2, y]\n");
    const auto found = bf("sensitivity checked.yaml --by gain.K -o s.json");
    EXPECT_EQ(found.code, 0) << found.err;
    EXPECT_CONTAINS(found.out,
                    "high = 0, at most 1.5: 1.5 from its limit\n  nothing that was looked at changes it\n");
    EXPECT_CONTAINS(bf("sensitivity checked.yaml --by high.at_most").out,
                    "  high.at_most                           1.5               0  0\n");
    EXPECT_EQ(json("s.json")["names"][0], "gain.K");
    EXPECT_EQ(json("s.json")["checks"][0]["slopes"][0], 0.0);
    EXPECT_EQ(json("s.json")["checks"][0]["at_least"], nullptr);
}

TEST_F(Linearize, RefusesWithTheReason) {
    const auto expect_error = [&](const std::string& command, const std::string& text) {
        const auto refused = bf(command);
        EXPECT_NE(refused.code, 0) << command;
        EXPECT_CONTAINS(refused.err, text);
    };
    expect_error("linearize loop.yaml --from gian", "no signal or state 'gian'; did you mean 'gain'");
    expect_error("linearize loop.yaml -o a.txt", "give a name that ends in .yaml, .json or .mat");
    expect_error("linearize loop.yaml -o loop.yaml", "loop.yaml");
    expect_error("bode loop.yaml --to plant --to gain", "from one input to one output");
    expect_error("bode loop.yaml --loop plant --from r", "--from excludes --loop");
    expect_error("bode loop.yaml --loop r", "nothing comes back to 'r': no path leads from it to itself");
    expect_error("frequency-response loop.yaml --loop gain --frequencies 10:1",
                 "neither LOW:HIGH nor one number");
    expect_error("frequency-response loop.yaml --from r --frequencies 1",
                 "both ends by --from SIGNAL and --to SIGNAL");
    expect_error("frequency-response loop.yaml --loop gain --frequencies 1:1000",
                 "below half of the sampling frequency");
    expect_error("frequency-response loop.yaml --loop gain --frequencies 1 -o a.txt",
                 "give a name that ends in .png");
    expect_error("tune loop.yaml --loop gain --crossover 3", "name the gains by --by");
    expect_error("tune loop.yaml", "name a loop of the model by --loop SIGNAL, and its gains by --by NAME");
    expect_error("tune loop.yaml --loop gain --by gain.K --crossover 3 --step 0", "--step 0 is no height");
    expect_error("tune loop.yaml --loop gain --by gain.K --crossover 3 --step nan",
                 "--step nan is no height");
    expect_error("tune loop.yaml --loop gain --by gain.K --crossover 3 --bandwidth 2", "excludes");
    expect_error("tune loop.yaml --by gain.K", "--loop");
    expect_error("tune loop.yaml --loop gain --by gain.K --crossover 3 -o loop.yaml", "loop.yaml");
    expect_error("tune loop.yaml --loop gain --by gian.K --crossover 3", "did you mean 'gain.K'");
    expect_error("sensitivity loop.yaml", "the model has no check that reports a number");
    expect_error("sensitivity loop.yaml -o a.mat", "give a name that ends in .yaml or .json");
    expect_error("linearize loop.yaml --at -1", "--at");
    expect_error("linearize loop.yaml --from-snapshot nofile", "nofile");
}

} // namespace

} // namespace bf::tools

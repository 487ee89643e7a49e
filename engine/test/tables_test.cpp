// Claims about what a run says of itself.
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

struct Sensor {};
/// A device with an output of a unit, and inputs of several kinds of units.
struct Lens : Block {
    using Block::Block;
    Input<double> torque{this, "torque", {.unit = {"N m"}, .doc = "what to do"}};
    Output<Matrix> seen{this, "seen", {.shape = {2, 3}, .unit = {"m"}, .doc = "what it sees"}};
    Output<std::int16_t> count{this, "count", {.unit = {"1"}}};
    Output<double> any{this, "any", {.unit = any_unit}};
    Parameter<Vector> gains{this, "gains", {.shape = {3}, .initial = {1, 2, 3}, .unit = {"rad/s"}}};
    DiscreteState<double> x{this, "x"};
    OutsideState<Sensor> camera{this, [] { return std::make_shared<Sensor>(); }};
    Status update(Now, Next) const noexcept override { return ok; }
    Status output(Now, Out) const noexcept override { return ok; }
};

Library with_lens() {
    Library library("");
    library.group("test").add<Lens>("Lens", "A device.");
    return library;
}

const char* const with_everything = R"(model: m
step: 0.1
inputs: [u, v]
enumerations: {Mode: [idle, walk]}
blocks:
  one: {block: Constant, value: 1}
  wave: {block: Sine}
  s:
    outputs: {mode: {type: Mode}}
    blocks: {c: {block: Constant, value: Mode.walk}}
    connections: {c: mode}
  camera: {block: Lens, period: 0.2, offset: 0.1, gains: [4, 5, 6]}
  x: {block: Integrator}
connections: {u: camera, wave: x}
plots:
  first: [camera.any, x]
  second: [u]
)";

std::vector<std::string> paths(const std::vector<Quantity>& quantities) {
    std::vector<std::string> all;
    for (const auto& quantity : quantities) all.push_back(quantity.path);
    return all;
}

using Texts = std::vector<std::string>;

TEST(Tables, SayOfASignalItsTypeSizeUnitTextAndRate) {
    const Library more = with_lens();
    const Session run(with_everything, &more);
    const auto signals = run.simulation->signals();
    const auto rates = run.simulation->rates();
    const Quantity& seen = find(signals, "camera.seen");
    EXPECT_EQ(seen.type, Type::float64);
    EXPECT_EQ(seen.info.rows, 2u);
    EXPECT_EQ(seen.info.cols, 3u);
    EXPECT_TRUE(seen.info.is_matrix);
    EXPECT_EQ(seen.info.unit, "m");
    EXPECT_EQ(seen.info.doc, "what it sees");
    EXPECT_EQ(seen.info.period, 0.2);
    EXPECT_TRUE(seen.info.is_held);
    EXPECT_EQ(rates[static_cast<std::size_t>(seen.rate)].period, 0.2);
    EXPECT_EQ(reinterpret_cast<const void*>(seen.data),
              run.simulation->context().data(run.diagram.find_node("camera"), 1));
    const Quantity& count = find(signals, "camera.count");
    EXPECT_EQ(count.type, Type::int16);
    EXPECT_EQ(count.info.type, recording::ElementType::Int16);
    EXPECT_FALSE(count.info.is_matrix);
    EXPECT_EQ(count.info.unit, "") << "numbers without a dimension have none to show";
    EXPECT_EQ(find(signals, "camera.any").info.unit, "") << "nothing is known of it";
    const Quantity& x = find(signals, "x.y");
    EXPECT_FALSE(x.info.is_held);
    EXPECT_TRUE(rates[static_cast<std::size_t>(x.rate)].is_continuous);
    EXPECT_EQ(rates[static_cast<std::size_t>(x.rate)].period, 0);
    EXPECT_EQ(find(signals, "one.y").rate, 0);
    EXPECT_TRUE(find(signals, "one.y").info.is_held);
    EXPECT_EQ(find(signals, "s.mode").info.names,
              (std::vector<std::pair<double, std::string>>{{0, "idle"}, {1, "walk"}}));
    EXPECT_TRUE(x.info.names.empty());
}

TEST(Tables, SayOfAParameterWhatItsModelGave) {
    const Library more = with_lens();
    Session run(with_everything, &more);
    run.simulation->set_parameter("camera.gains", {7, 8, 9});
    const auto parameters = run.simulation->parameters();
    const Quantity& gains = find(parameters, "camera.gains");
    EXPECT_EQ(gains.values(), (Values{7, 8, 9}));
    Quantity given = gains;
    given.data = given.given.data();
    EXPECT_EQ(given.values(), (Values{4, 5, 6}));
    EXPECT_EQ(gains.info.unit, "rad/s");
    for (const auto& path : paths(parameters)) EXPECT_EQ(path.find("camera.x"), std::string::npos);
}

TEST(Tables, NameWhatReachesTheModelFromOutside) {
    const Library more = with_lens();
    const Session run(with_everything, &more);
    EXPECT_EQ(paths(run.simulation->inputs()), (Texts{"u", "v"}));
    EXPECT_EQ(paths(run.simulation->outside()),
              (Texts{"u", "v", "camera.seen", "camera.count", "camera.any"}));
}

TEST(Tables, NameThePlotsOfTheModelWithTheirSignals) {
    const Library more = with_lens();
    const Session run(with_everything, &more);
    const auto plots = run.simulation->plots();
    ASSERT_EQ(plots.size(), 2u);
    EXPECT_EQ(plots[0].title, "first");
    EXPECT_EQ(plots[0].signals, (Texts{"camera.any", "x"}));
    EXPECT_EQ(plots[1].signals, Texts{"u"});
}

TEST(Tables, SayWhyTheTimeOfAStepHasNoBound) {
    const auto why = [](const std::string& settings, const std::string& parts) {
        return Session("model: m\nstep: 0.1\n" + settings + "blocks:\n" + parts)
            .simulation->not_for_real_time();
    };
    const std::string loop = "  u: {block: Sine, period: 0.1}\n  a: {block: Sum, signs: \"+-\"}\n"
                             "  b: {block: Gain, K: 0.5}\nconnections: {u: a.u1, a: b, b: a.u2}\n",
                      state = "  u: {block: Sine}\n  x: {block: Integrator}\nconnections: {u: x}\n",
                      adaptive =
                          "\n  the solver 'dormand_prince45' chooses its own steps, as many as it takes; "
                          "choose one with fixed steps, e.g. solver: rk4",
                      iterated =
                          "\n  a: it stands in an algebraic loop, which is iterated until its equations "
                          "hold, as often as that takes; put a UnitDelay into the loop",
                      unbounded = "the time of a step is not bounded:";
    EXPECT_EQ(why("solver: rk4\n", state), "");
    EXPECT_EQ(why("solver: dormand_prince45\n", state), unbounded + adaptive);
    EXPECT_EQ(why("solver: dormand_prince45\n", "  u: {block: Sine, period: 0.1}\n"), "")
        << "nothing is integrated";
    EXPECT_EQ(why("algebraic_loops: solve\n", loop), unbounded + iterated);
}

} // namespace
} // namespace bf::test

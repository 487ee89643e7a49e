#include "standard_block.hpp"

namespace bf::test {
namespace {

const Values ramp{1, 2, 3, 4, 5};

TEST(UnitDelay, OutputsTheInputOfTheStepBefore) {
    for (const char* name : {"UnitDelay", "Memory"}) {
        auto delay = make(name).wire("u", scalar_size()).start().set("initial", Values{9}).reset();
        EXPECT_EQ(delay.respond("u", ramp), (Values{9, 1, 2, 3, 4})) << name;
        const auto& d = delay.declaration();
        EXPECT_FALSE(delay.block().feedthrough(d.find("y"), d.find("u")));
    }
}

TEST(UnitDelay, TakesItsSizeFromAnInitialVector) {
    EXPECT_EQ(make("UnitDelay").wire("initial", vector_size(3)).start().size("y"), vector_size(3));
    EXPECT_EQ(
        refusal([] { make("UnitDelay").wire("initial", vector_size(3)).wire("u", vector_size(2)).start(); }),
        "parameter 'initial' of size [3] and input 'u' of size [2] differ; give a scalar or as many "
        "elements");
}

TEST(Delay, OutputsTheInputOfSeveralStepsBefore) {
    auto delay = make("Delay", {{"steps", 3}}).wire("u", scalar_size()).start();
    EXPECT_EQ(delay.respond("u", ramp), (Values{0, 0, 0, 1, 2}));
    EXPECT_EQ(refusal([] {
                  make("Delay", {{"steps", 0}});
              }),
              "argument 'steps' must be from 1 to 1000000, but is 0");
}

TEST(DiscreteDerivative, IsTheDifferenceQuotient) {
    auto block = make("DiscreteDerivative").wire("u", scalar_size());
    block.period = 0.5;
    block.start().set("gain", Values{3});
    EXPECT_EQ(block.respond("u", {1, 3, 2}), (Values{6, 12, -6}));
}

TEST(RateLimit, FollowsAtMostSoFast) {
    auto block = make("RateLimit").wire("u", scalar_size());
    block.period = 0.5;
    block.start().set("rising", Values{2}).set("falling", Values{-4});
    EXPECT_EQ(block.respond("u", {5, 5, 1.5, -9}), (Values{1, 2, 1.5, -0.5}));
}

TEST(FirstSample, HoldsTheFirstInputWhateverFollows) {
    auto block = make("FirstSample").wire("u", scalar_size()).start();
    EXPECT_EQ(block.respond("u", {7, std::nan(""), 1}), (Values{7, 7, 7}));
    block.reset();
    EXPECT_EQ(block.respond("u", {3, 4}), (Values{3, 3}));
}

TEST(InitialCondition, ReplacesTheFirstSample) {
    auto block = make("InitialCondition").wire("u", scalar_size()).start().set("value", Values{9});
    EXPECT_EQ(block.respond("u", ramp), (Values{9, 2, 3, 4, 5}));
}

TEST(InitialValues, HaveOneElementOrAsManyAsTheSignal) {
    const std::vector<std::pair<const char*, const char*>> all{
        {"InitialCondition", "value"},    {"UnitDelay", "initial"},  {"SampleHold", "initial"},
        {"LimitedIntegrator", "initial"}, {"Integrator", "initial"}, {"DiscreteIntegrator", "initial"}};
    for (const auto& [name, parameter] : all) {
        const auto wrong = [name = name, parameter = parameter](int of_value, int of_signal) {
            return refusal([&] {
                make(name).wire(parameter, vector_size(of_value)).wire("u", vector_size(of_signal)).start();
            });
        };
        EXPECT_EQ(wrong(3, 3), "") << name;
        EXPECT_EQ(wrong(3, 2), std::string("parameter '") + parameter +
                                   "' of size [3] and input 'u' of size [2] differ; give a scalar or as many "
                                   "elements")
            << name;
        EXPECT_EQ(make(name).wire(parameter, scalar_size()).wire("u", vector_size(3)).start().size("y"),
                  vector_size(3))
            << name;
        EXPECT_EQ(make(name).wire(parameter, vector_size(3)).start().size("y"), vector_size(3)) << name;
    }
}

TEST(SampleHold, LetsItsInputThroughWhileTriggered) {
    auto block =
        make("SampleHold").wire("u", scalar_size()).wire("trigger", scalar_size(), Type::boolean).start();
    Values y;
    for (int i = 1; i <= 5; ++i) {
        block.set("u", Values{double(i)}).set("trigger", Values{double(i == 2 || i == 3)});
        ASSERT_TRUE(block.output());
        y.push_back(block.scalar("y"));
        ASSERT_TRUE(block.update());
        block.commit();
    }
    EXPECT_EQ(y, (Values{0, 2, 3, 3, 3}));
}

TEST(OnDelay, IgnoresShortPulses) {
    auto block =
        make("OnDelay").wire("u", scalar_size(), Type::boolean).start().set("duration", Values{0.02});
    EXPECT_EQ(block.respond("u", {1, 1, 0, 1, 1, 1, 1, 0}), (Values{0, 0, 0, 0, 0, 1, 1, 0}));
}

TEST(Counter, CountsStepsInWhichItsInputIsTrue) {
    auto block = make("Counter").wire("u", scalar_size(), Type::boolean).start();
    EXPECT_EQ(block.respond("u", {1, 0, 1, 1}), (Values{1, 1, 2, 3}));
    block.set("reset", Values{1});
    EXPECT_EQ(block.respond("u", {1}), (Values{0}));
}

RunBlock integrator(const Arguments& arguments) {
    auto block = make("DiscreteIntegrator", arguments).wire("u", scalar_size());
    for (const auto& [name, value] : arguments) {
        if (name == "reset") block.wire("reset", scalar_size(), Type::float64);
        if (name == "initial_source") block.wire("x0", scalar_size());
    }
    block.period = 0.5;
    return block.start();
}

TEST(DiscreteIntegrator, FollowsItsMethod) {
    auto forward = integrator({{"method", "forward"}});
    EXPECT_EQ(forward.respond("u", {2, 4, 6, 0}), (Values{0, 1, 3, 6}));
    auto backward = integrator({{"method", "backward"}});
    EXPECT_EQ(backward.respond("u", {2, 4, 6, 0}), (Values{1, 3, 6, 6}));
    auto trapezoidal = integrator({{"method", "trapezoidal"}});
    EXPECT_EQ(trapezoidal.respond("u", {2, 4, 6, 0}), (Values{0.5, 2, 4.5, 6}));
}

TEST(DiscreteIntegrator, HasFeedthroughOnlyWhereItsMethodNeedsIt) {
    const auto feeds = [](const Arguments& arguments, const char* input) {
        const auto block = integrator(arguments);
        const auto& d = block.declaration();
        return block.block().feedthrough(d.find("y", Role::output), d.find(input, Role::input));
    };
    EXPECT_FALSE(feeds({{"method", "forward"}}, "u"));
    EXPECT_TRUE(feeds({{"method", "backward"}}, "u"));
    EXPECT_FALSE(feeds({{"reset", "rising"}}, "u"));
    EXPECT_TRUE(feeds({{"reset", "rising"}}, "reset"));
    EXPECT_TRUE(feeds({{"initial_source", "external"}}, "x0"));
}

TEST(DiscreteIntegrator, StaysWithinItsLimits) {
    auto block = integrator({}).set("upper", Values{1.5}).set("gain", Values{2});
    EXPECT_EQ(block.respond("u", {1, 1, 1, -1, 0}), (Values{0, 1, 1.5, 1.5, 0.5}));
}

Values resets(const char* kind, const Values& reset) {
    auto block = integrator({{"reset", kind}}).set("u", Values{2}).set("initial", Values{10}).reset();
    return block.respond("reset", reset);
}

TEST(DiscreteIntegrator, ResetsOnEdgesAndLevels) {
    EXPECT_EQ(resets("rising", {0, 0, 1, 1, 0}), (Values{10, 11, 10, 11, 12}));
    EXPECT_EQ(resets("falling", {0, 1, 1, 0, 0}), (Values{10, 11, 12, 10, 11}));
    EXPECT_EQ(resets("either", {0, 1, 1, 0, 0}), (Values{10, 10, 11, 10, 11}));
    EXPECT_EQ(resets("level", {0, 1, 1, 0, 0}), (Values{10, 10, 10, 10, 11}));
}

TEST(DiscreteIntegrator, LoadsAnExternalInitialValueInTheFirstStep) {
    auto block = integrator({{"initial_source", "external"}, {"reset", "rising"}})
                     .set("u", Values{2})
                     .set("x0", Values{5});
    EXPECT_EQ(block.respond("reset", {0, 0, 1, 1}), (Values{5, 6, 5, 6}));
    auto plain = integrator({{"initial_source", "external"}}).set("u", Values{2});
    EXPECT_EQ(plain.respond("x0", {5, 100, 100}), (Values{5, 6, 7}));
}

} // namespace
} // namespace bf::test

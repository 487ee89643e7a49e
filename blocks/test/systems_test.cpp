// Discrete linear systems, PID controllers and delays, against scipy 1.17.1 and against each other.
#include "standard_block.hpp"

namespace bf::test {
namespace {

const Values input{1, 0, 2, -1, 0.5, 3};

void expect_near(const Values& actual, const Values& expected, double tolerance = 1e-12) {
    ASSERT_EQ(actual.size(), expected.size());
    for (std::size_t i = 0; i < actual.size(); ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << i;
}

bool feeds(const RunBlock& block, const char* from = "u", const char* to = "y") {
    const auto& d = block.declaration();
    return block.block().feedthrough(d.find(to, Role::output), d.find(from, Role::input));
}

TEST(DiscreteTransferFunction, EqualsScipys) {
    // signal.dlsim(signal.dlti([1, 0.5], [1, -1.2, 0.5]), u) and with numerator [2, 0.3, 1], denominator
    // times 2
    auto proper = make("DiscreteTransferFunction",
                       {{"numerator", row({1, 0.5})}, {"denominator", row({1, -1.2, 0.5})}});
    proper.wire("u", scalar_size()).start();
    EXPECT_FALSE(feeds(proper));
    expect_near(proper.respond("u", input), {0.0, 1.0, 1.7, 3.54, 3.398, 2.3076});
    auto direct = make("DiscreteTransferFunction",
                       {{"numerator", row({2, 0.3, 1})}, {"denominator", row({2, -1.2, 0.5})}});
    direct.wire("u", scalar_size()).start();
    EXPECT_TRUE(feeds(direct));
    expect_near(direct.respond("u", input), {1.0, 0.75, 2.7, 0.7325, 1.1145, 3.060575});
}

TEST(DiscreteZeroPole, EqualsScipysForComplexPoles) {
    // signal.dlsim(signal.dlti([0.5], [0.3+0.4j, 0.3-0.4j], 2.0), u)
    const Value poles((Matrix(2, 2) << 0.3, 0.4, 0.3, -0.4).finished());
    auto block = make("DiscreteZeroPole", {{"zeros", 0.5}, {"poles", poles}, {"gain", 2}});
    block.wire("u", scalar_size()).start();
    expect_near(block.respond("u", input), {0.0, 2.0, 0.2, 3.62, -1.878, -0.0318});
    EXPECT_EQ(
        refusal([] {
            make("DiscreteZeroPole", {{"poles", Value((Matrix(2, 2) << 0.3, 0.4, 0.3, 0.4).finished())}});
        }),
        "argument 'poles' holds a complex root without its conjugate; give both [real imaginary] and "
        "[real -imaginary]");
    EXPECT_EQ(refusal([] {
                  make("DiscreteZeroPole", {{"zeros", row({1, 2})}});
              }),
              "there are more zeros than poles, 2 and 1; give at least as many poles");
}

TEST(DiscreteFilter, EqualsScipysOnEveryElement) {
    // signal.lfilter([1, 2, 3], [4, 1, 0.5], u)
    const Values expected{0.25, 0.4375, 1.109375, 0.41796875, 0.8818359375, -0.022705078125};
    auto block = make("DiscreteFilter").wire("numerator", vector_size(3)).wire("denominator", vector_size(3));
    block.wire("u", vector_size(2)).start();
    block.set("numerator", Values{1, 2, 3}).set("denominator", Values{4, 1, 0.5});
    for (std::size_t k = 0; k < input.size(); ++k) {
        block.set("u", Values{input[k], -input[k]});
        ASSERT_TRUE(block.step());
        EXPECT_NEAR(block.get("y")(0), expected[k], 1e-14);
        EXPECT_NEAR(block.get("y")(1), -expected[k], 1e-14);
    }
}

TEST(FIRFilter, IsTheWeightedSumOfItsPast) {
    auto block = make("FIRFilter").wire("coefficients", vector_size(3)).wire("u", scalar_size()).start();
    block.set("coefficients", Values{3, 2, 1});
    EXPECT_EQ(block.respond("u", input), (Values{3, 2, 7, 1, 1.5, 9}));
}

TEST(DiscreteStateSpace, EqualsScipysAndBreaksLoopsWithoutD) {
    // signal.dlsim(signal.dlti([[.5, .1], [-.2, .7]], [[1], [.5]], [[1, 2]], [[.25]]), u)
    const auto system = [](const Arguments& arguments) {
        return make("DiscreteStateSpace", arguments)
            .wire("A", matrix_size(2, 2))
            .wire("B", matrix_size(2, 1))
            .wire("C", matrix_size(1, 2))
            .start()
            .set("A", (Matrix(2, 2) << 0.5, 0.1, -0.2, 0.7).finished())
            .set("B", Values{1, 0.5})
            .set("C", Values{1, 2});
    };
    auto direct = system({{"D", 0.25}});
    EXPECT_TRUE(feeds(direct));
    expect_near(direct.respond("u", input), {0.25, 2.0, 1.35, 4.03, -0.1535, 1.3822});
    auto proper = system({});
    EXPECT_FALSE(feeds(proper));
    expect_near(proper.respond("u", input), {0.0, 2.0, 0.85, 4.28, -0.2785, 0.6322});
    EXPECT_EQ(refusal([&] {
                  system({{"D", row({1, 2})}});
              }),
              "argument 'D' is 1x2, but input 'u' of size scalar and output 'y' of size scalar ask for "
              "1x1");
}

RunBlock pid(const char* name, const Arguments& arguments = {}) {
    auto block = make(name, arguments).wire(std::string(name) == "DiscretePID" ? "e" : "r", scalar_size());
    block.period = 0.1;
    return block.start();
}

TEST(DiscretePID, EqualsScipysForEachMethod) {
    // signal.lfilter of P, of I a(z) and of D N / (1 + N a(z)), with P, I, D, N = 2, 3, 0.5, 20
    const std::vector<std::pair<std::string, Values>> expected{
        {"forward", {12, -19.7, 44.3, -71.1, 86.6, -53.25}},
        {"backward",
         {5.633333333333333, -1.9222222222222223, 10.825925925925926, -9.424691358024692, 4.075102880658436,
          16.758367626886148}},
        {"trapezoidal", {7.15, -4.7, 14.6, -16.25, 9.175, 19.7}}};
    for (const auto& [method, y] : expected) {
        auto block = pid("DiscretePID", {{"method", method}, {"filter_method", method}});
        block.set("P", Values{2}).set("I", Values{3}).set("D", Values{0.5}).set("N", Values{20});
        expect_near(block.respond("e", input), y);
        auto two = pid("DiscretePID2", {{"method", method}, {"filter_method", method}});
        two.set("P", Values{2})
            .set("I", Values{3})
            .set("D", Values{0.5})
            .set("N", Values{20})
            .set("m", Values{0});
        expect_near(two.respond("r", input), y);
    }
}

TEST(DiscretePID, WithoutADerivativeItsFilterStandsStillAtAnyPeriod) {
    auto block = pid("DiscretePID").set("P", Values{1}).set("I", Values{0.5}).set("D", Values{0});
    block.set("N", Values{1000}); // N T = 100, with which the filter diverges
    const Values y = block.respond("e", Values(1000, 2.0));
    EXPECT_NEAR(y.back(), 2 + 0.5 * 0.1 * 999 * 2, 1e-9);
    EXPECT_EQ(block.scalar("x_d"), 0);
}

TEST(DiscretePID2, WeighsTheSetpoint) {
    auto block = pid("DiscretePID2").set("P", Values{2}).set("D", Values{1}).set("N", Values{5});
    block.set("b", Values{0.5}).set("c", Values{0}).set("m", Values{3});
    // P (b r - m) + N D (c r - m) in the first step
    EXPECT_EQ(block.respond("r", {4})[0], 2 * (2 - 3) + 5 * (0 - 3));
}

TEST(DiscretePID, DoesNotWindUp) {
    const auto recovers = [](const char* kind) {
        auto block = pid("DiscretePID", {{"anti_windup", kind}});
        block.set("P", Values{0})
            .set("I", Values{1})
            .set("tracking_time", Values{0.1})
            .set("upper", Values{1});
        block.respond("e", Values(100, 1.0)); // the integral would reach 10
        int steps = 0;
        while (block.respond("e", {-1})[0] >= 1) ++steps;
        return steps;
    };
    EXPECT_NEAR(recovers("none"), 90, 1);
    EXPECT_LE(recovers("back_calculation"), 2);
    EXPECT_LE(recovers("clamping"), 2);
}

TEST(DiscretePID, FollowsATrackedSignal) {
    auto block = pid("DiscretePID", {{"tracking", true}});
    block.set("P", Values{0}).set("I", Values{0}).set("tracking_time", Values{0.2}).set("tracked", Values{4});
    // x⁺ = x + T/T_t (4 - x)
    EXPECT_EQ(block.respond("e", {0, 0, 0}), (Values{0, 2, 3}));
}

TEST(DiscretePID, BeginsAnewAtAReset) {
    auto block = make("DiscretePID", {{"reset", "rising"}}).wire("e", scalar_size());
    block.wire("reset", scalar_size(), Type::boolean);
    block.period = 0.1;
    block.start()
        .set("P", Values{0})
        .set("I", Values{10})
        .set("initial", Values{5})
        .set("e", Values{1})
        .reset();
    EXPECT_EQ(block.respond("reset", {0, 0, 1, 1, 0}), (Values{5, 6, 5, 6, 7}));
}

TEST(Delay, BeginsAnewAtAReset) {
    auto block = make("Delay", {{"steps", 2}, {"reset", "rising"}}).wire("u", scalar_size());
    block.wire("reset", scalar_size(), Type::boolean).start().set("initial", Values{-1}).reset();
    Values y;
    for (int k = 0; k < 8; ++k) {
        block.set("u", Values{double(k)}).set("reset", Values{k == 4 ? 1.0 : 0.0});
        ASSERT_TRUE(block.output());
        y.push_back(block.scalar("y"));
        ASSERT_TRUE(block.update());
        block.commit();
    }
    EXPECT_EQ(y, (Values{-1, -1, 0, 1, -1, -1, 4, 5}));
}

TEST(TappedDelay, KeepsTheNewestFirst) {
    auto past = make("TappedDelay", {{"steps", 2}}).wire("u", scalar_size()).start();
    past.respond("u", {1, 2, 3});
    ASSERT_TRUE(past.output());
    EXPECT_EQ(list(past.get("y")), (Values{3, 2}));
    auto with =
        make("TappedDelay", {{"steps", 2}, {"include_current", true}}).wire("u", vector_size(2)).start();
    with.set("u", Values{1, 10});
    ASSERT_TRUE(with.step());
    with.set("u", Values{2, 20});
    ASSERT_TRUE(with.output());
    EXPECT_EQ(with.get("y"), (Matrix(3, 2) << 2, 20, 1, 10, 0, 0).finished());
}

TEST(RateTransition, HoldsOrDelays) {
    auto hold = make("RateTransition").wire("u", scalar_size()).start();
    EXPECT_EQ(hold.respond("u", {1, 2, 3}), (Values{1, 2, 3}));
    auto delay = make("RateTransition", {{"mode", "delay"}}).wire("u", scalar_size()).start();
    EXPECT_FALSE(feeds(delay));
    EXPECT_EQ(delay.set("initial", Values{7}).reset().respond("u", {1, 2, 3}), (Values{7, 1, 2}));
    auto zoh = make("ZeroOrderHold").wire("u", scalar_size()).start();
    EXPECT_EQ(zoh.respond("u", {1, 2}), (Values{1, 2}));
}

TEST(RateLimitDynamic, TakesItsLimitsFromSignals) {
    auto block = make("RateLimitDynamic").wire("u", scalar_size());
    block.period = 0.5;
    block.start().set("rising", Values{2}).set("falling", Values{-4});
    EXPECT_EQ(block.respond("u", {5, 5, 1.5, -9}), (Values{1, 2, 1.5, -0.5}));
}

} // namespace
} // namespace bf::test

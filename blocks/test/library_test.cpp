// Sources, discontinuities, logic and vectors.
#include "standard_block.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <regex>

namespace bf::test {
namespace {

/// The output of a source over the next steps.
Values produce(RunBlock& block, int steps) {
    Values y;
    for (int k = 0; k < steps; ++k) {
        if (!block.output()) throw std::runtime_error("a step failed");
        y.push_back(block.scalar("y"));
        if (!block.update()) throw std::runtime_error("a step failed");
        block.commit();
    }
    return y;
}

Values wave(const char* form) {
    auto block = make("SignalGenerator", {{"waveform", form}});
    block.period = 0.25;
    block.start().set("amplitude", Values{2}).set("frequency", Values{0.5});
    return produce(block, 9);
}

TEST(SignalGenerator, HasItsForms) {
    EXPECT_EQ(wave("square"), (Values{2, 2, 2, 2, -2, -2, -2, -2, 2}));
    EXPECT_EQ(wave("sawtooth"), (Values{-2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, -2}));
    EXPECT_EQ(wave("triangle"), (Values{-2, -1, 0, 1, 2, 1, 0, -1, -2}));
    const Values sine = wave("sine");
    for (std::size_t k = 0; k < sine.size(); ++k)
        EXPECT_NEAR(sine[k], 2 * std::sin(std::numbers::pi * 0.25 * double(k)), 1e-14);
}

TEST(RepeatingSequence, BeginsAgainAtItsLastTime) {
    auto block = make("RepeatingSequence", {{"times", row({0, 1, 2})}});
    block.period = 0.5;
    block.start().set("values", Values{0, 4, 2});
    EXPECT_EQ(produce(block, 7), (Values{0, 2, 4, 3, 0, 2, 4}));
    EXPECT_EQ(refusal([] {
                  make("RepeatingSequence", {{"times", row({0, 0})}});
              }),
              "argument 'times' must hold at least two times, each later than the one before");
}

TEST(RepeatingStair, TakesOneValuePerStep) {
    auto block = make("RepeatingStair").wire("values", vector_size(3)).start().set("values", Values{5, 7, 6});
    EXPECT_EQ(produce(block, 5), (Values{5, 7, 6, 5, 7}));
}

TEST(Counters, BeginAgainAfterTheirLimit) {
    auto limited = make("CounterLimited").start().set("limit", Values{2});
    EXPECT_EQ(produce(limited, 5), (Values{0, 1, 2, 0, 1}));
    auto free = make("CounterFree", {{"bits", 1}}).start();
    EXPECT_EQ(produce(free, 3), (Values{0, 1, 0}));
    EXPECT_EQ(refusal([] {
                  make("CounterFree", {{"bits", 40}});
              }),
              "argument 'bits' must be from 1 to 32, but is 40");
}

TEST(Random, GivesTheSequenceOfItsSeedAfterResetAndSnapshot) {
    for (const char* name : {"RandomUniform", "RandomNormal", "WhiteNoise"}) {
        auto block = make(name).start().set("seed", Values{3});
        const Values first = produce(block, 5);
        std::vector<std::byte> snapshot(block.context().snapshot_size());
        block.context().save(snapshot.data());
        const Values on = produce(block, 5);
        block.context().restore(snapshot.data());
        EXPECT_EQ(produce(block, 5), on) << name;
        block.reset();
        EXPECT_EQ(produce(block, 5), first) << name;
        block.set("seed", Values{4}).reset();
        EXPECT_NE(produce(block, 5), first) << name;
    }
}

TEST(WhiteNoise, HasTheVarianceOfItsPowerOverThePeriod) {
    auto block = make("WhiteNoise");
    block.period = 0.01;
    block.start().set("power", Values{0.04}).reset();
    double squares = 0;
    const Values y = produce(block, 20000);
    for (const double x : y) squares += x * x;
    EXPECT_NEAR(squares / 20000, 4, 0.2); // five standard deviations
}

TEST(Backlash, FollowsThroughItsPlay) {
    auto block = make("Backlash").wire("u", scalar_size()).start();
    EXPECT_EQ(block.respond("u", {0.4, 2, 1.8, 1, 0.5}), (Values{0, 1.5, 1.5, 1.5, 1}));
}

TEST(HitCrossing, TellsOfItsSide) {
    const auto hits = [](const char* direction) {
        auto block = make("HitCrossing", {{"direction", direction}}).wire("u", scalar_size()).start();
        return block.set("level", Values{1}).respond("u", {0, 1, 2, 1.5, 0, 3});
    };
    EXPECT_EQ(hits("either"), (Values{0, 1, 0, 0, 1, 1}));
    EXPECT_EQ(hits("rising"), (Values{0, 1, 0, 0, 0, 1}));
    EXPECT_EQ(hits("falling"), (Values{0, 0, 0, 0, 1, 0}));
}

TEST(SaturateDynamic, TakesItsLimitsFromSignals) {
    auto block = make("SaturateDynamic").wire("u", vector_size(3)).wire("lower", scalar_size());
    block.wire("upper", scalar_size()).start().set("u", Values{-5, 0, 5});
    block.set("lower", Values{-1}).set("upper", Values{2});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{-1, 0, 2}));
}

TEST(DeadZoneDynamic, TakesItsZoneFromSignals) {
    auto block = make("DeadZoneDynamic").wire("u", vector_size(3)).wire("start", scalar_size());
    block.wire("end", scalar_size()).start().set("u", Values{-5, 0, 5});
    block.set("start", Values{-1}).set("end", Values{2});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{-4, 0, 3}));
}

TEST(EdgeDetect, SeesEachKind) {
    const auto edges = [](const char* edge) {
        return make("EdgeDetect", {{"edge", edge}})
            .wire("u", scalar_size())
            .start()
            .respond("u", {0, 2, 3, 0, -1});
    };
    EXPECT_EQ(edges("rising"), (Values{0, 1, 0, 0, 0}));
    EXPECT_EQ(edges("falling"), (Values{0, 0, 0, 1, 0}));
    EXPECT_EQ(edges("either"), (Values{0, 1, 0, 1, 0}));
    EXPECT_EQ(edges("change"), (Values{0, 1, 1, 1, 1}));
    EXPECT_EQ(edges("increase"), (Values{0, 1, 1, 0, 0}));
    EXPECT_EQ(edges("decrease"), (Values{0, 0, 0, 1, 1}));
}

TEST(Bitwise, JoinsInputsAndElements) {
    auto two = make("Bitwise", {{"operator", "NAND"}, {"inputs", 2}});
    two.wire("u1", scalar_size(), Type::uint8).wire("u2", scalar_size()).start();
    two.set("u1", Values{12}).set("u2", Values{10});
    ASSERT_TRUE(two.output());
    EXPECT_EQ(two.scalar("y"), 247);
    auto one = make("Bitwise", {{"operator", "XOR"}, {"inputs", 1}});
    one.wire("u1", vector_size(3), Type::uint8).start().set("u1", Values{1, 3, 6});
    ASSERT_TRUE(one.output());
    EXPECT_EQ(one.scalar("y"), 4);
    auto inverted = make("Bitwise", {{"operator", "NOT"}}).wire("u", scalar_size(), Type::int8).start();
    EXPECT_EQ(inverted.respond("u", {5}), (Values{-6}));
    auto mask = make("Bitwise", {{"operator", "NOR"}}).wire("u", scalar_size(), Type::uint8).start();
    EXPECT_EQ(mask.set("mask", Values{3}).respond("u", {4}), (Values{248}));
}

TEST(CombinatorialLogic, ReadsItsTruthTable) {
    auto block =
        make("CombinatorialLogic", {{"table", Value((Matrix(4, 2) << 0, 1, 0, 2, 0, 3, 1, 4).finished())}});
    block.start().set("u", Values{1, 0});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{0, 3}));
    EXPECT_EQ(refusal([] {
                  make("CombinatorialLogic", {{"table", Value(Matrix::Ones(3, 1).eval())}});
              }),
              "argument 'table' has 3 rows, but needs one for each combination of inputs: 2, 4, 8, …");
}

TEST(IndexVector, TakesElementsOrStops) {
    auto block = make("IndexVector")
                     .wire("index", vector_size(2), Type::float64)
                     .wire("u", vector_size(3), Type::int16);
    block.start().set("u", Values{10, 20, 30}).set("index", Values{3, 1.9});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{30, 10}));
    block.set("index", Values{1, 4});
    EXPECT_EQ(block.output().text(), "an index is outside the signal");
}

TEST(FlipFlops, KeepTheirState) {
    auto sr = make("SRFlipFlop").start();
    sr.set("s", Values{1});
    ASSERT_TRUE(sr.step());
    sr.set("s", Values{0});
    ASSERT_TRUE(sr.step());
    EXPECT_EQ(sr.scalar("q"), 1);
    EXPECT_EQ(sr.scalar("nq"), 0);
    auto d = make("DFlipFlop").start();
    d.set("d", Values{1});
    EXPECT_EQ(d.respond("clock", {1, 0, 1, 1}, "q"), (Values{0, 0, 1, 1}));
    auto jk = make("JKFlipFlop").start();
    jk.set("j", Values{1}).set("k", Values{1});
    EXPECT_EQ(jk.respond("clock", {0, 1, 0, 1, 0}, "q"), (Values{0, 0, 1, 1, 0}));
}

TEST(IntervalTest, HasOpenEndsOnRequest) {
    auto block = make("IntervalTest", {{"closed_upper", false}}).wire("u", scalar_size()).start();
    EXPECT_EQ(block.respond("u", {-0.5, 0, 0.5, 0.6}), (Values{1, 1, 0, 0}));
}

TEST(Overflow, WrapsSaturatesOrStopsByName) {
    const auto sum = [](const char* on_overflow) {
        return make("Sum", {{"on_overflow", on_overflow}})
            .wire("u1", scalar_size(), Type::int8)
            .wire("u2", scalar_size())
            .start()
            .set("u1", Values{100})
            .set("u2", Values{100});
    };
    auto wraps = sum("wrap"), holds = sum("saturate"), stops = sum("error");
    ASSERT_TRUE(wraps.output());
    EXPECT_EQ(wraps.scalar("y"), -56);
    ASSERT_TRUE(holds.output());
    EXPECT_EQ(holds.scalar("y"), 127);
    EXPECT_EQ(stops.output().text(), "the sum leaves the range of its type: scale the signals, or choose "
                                     "on_overflow: saturate");
    auto gain = make("Gain", {{"on_overflow", "saturate"}})
                    .wire("K", scalar_size())
                    .wire("u", scalar_size(), Type::uint8);
    gain.start().set("K", Values{3});
    EXPECT_EQ(gain.respond("u", {100}), (Values{255}));
    auto quotient = make("Product", {{"operations", "*/"}, {"on_overflow", "error"}});
    quotient.wire("u1", scalar_size())
        .wire("u2", scalar_size())
        .start()
        .set("u1", Values{1})
        .set("u2", Values{0});
    EXPECT_FALSE(quotient.output());
    auto convert = make("Convert", {{"type", "int8"}, {"on_overflow", "error"}});
    convert.wire("u", scalar_size(), Type::float64).start().set("u", Values{std::nan("")});
    EXPECT_FALSE(convert.output());
    EXPECT_EQ(refusal([] {
                  make("Gain", {{"on_overflow", "error"}, {"multiplication", "K*u"}});
              }),
              "argument 'on_overflow' is for element-by-element operation; matrix products wrap");
}

TEST(Vectors, SortSumAndSearch) {
    auto sort =
        make("Sort", {{"order", "descending"}}).wire("u", vector_size(3)).start().set("u", Values{2, 9, 4});
    ASSERT_TRUE(sort.output());
    EXPECT_EQ(list(sort.get("y")), (Values{9, 4, 2}));
    EXPECT_EQ(list(sort.get("index")), (Values{2, 3, 1}));
    const Matrix m = (Matrix(2, 3) << 1, 2, 3, 4, 5, 6).finished();
    auto columns =
        make("SumOfElements", {{"along", "columns"}}).wire("u", matrix_size(2, 3)).start().set("u", m);
    ASSERT_TRUE(columns.output());
    EXPECT_EQ(columns.get("y"), (Matrix(1, 3) << 5, 7, 9).finished());
    auto rows = make("SumOfElements", {{"along", "rows"}}).wire("u", matrix_size(2, 3)).start().set("u", m);
    ASSERT_TRUE(rows.output());
    EXPECT_EQ(rows.get("y"), (Matrix(2, 1) << 6, 15).finished());
    auto assign = make("Assign", {{"indices", 2}, {"columns", row({1, 3})}});
    assign.wire("base", matrix_size(2, 3)).wire("u", matrix_size(1, 2)).start();
    assign.set("base", m).set("u", Values{8, 9});
    ASSERT_TRUE(assign.output());
    EXPECT_EQ(assign.get("y"), (Matrix(2, 3) << 1, 2, 3, 8, 5, 9).finished());
}

TEST(Polynomial, IsHornersRule) {
    auto block = make("Polynomial").wire("coefficients", vector_size(3)).wire("u", scalar_size()).start();
    EXPECT_EQ(block.set("coefficients", Values{2, -3, 1}).respond("u", {0, 1, 2, -1}), (Values{1, 0, 3, 6}));
}

TEST(RunningExtreme, BeginsAnewAtAReset) {
    auto block = make("RunningExtreme", {{"reset", "rising"}}).wire("u", scalar_size());
    block.wire("reset", scalar_size(), Type::boolean).start().set("reset", Values{0});
    EXPECT_EQ(block.respond("u", {-1, 3, 2}), (Values{0, 3, 3}));
    block.set("reset", Values{1});
    EXPECT_EQ(block.respond("u", {1, 0.5}), (Values{1, 1}));
    auto least = make("RunningExtreme", {{"function", "min"}}).wire("u", scalar_size()).start();
    EXPECT_EQ(least.respond("u", {-1, 3, -2}), (Values{-1, -1, -2}));
}

TEST(Page, NamesOnlyBlocksThatExist) {
    std::ifstream page(BF_SOURCE_DIRECTORY "/docs/how-to/find_a_block.md");
    const std::regex name("`([A-Z]\\w*)`");
    int count = 0;
    for (std::string line; std::getline(page, line);) {
        if (line.rfind("| ", 0) != 0) continue;
        for (std::sregex_iterator i(line.begin(), line.end(), name), end; i != end; ++i, ++count)
            EXPECT_NO_THROW(standard_class((*i)[1])) << (*i)[1];
    }
    EXPECT_GT(count, 90);
}

} // namespace
} // namespace bf::test

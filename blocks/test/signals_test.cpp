#include "standard_block.hpp"

#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace bf::test {
namespace {

TEST(Mux, Joins1DInOrder) {
    auto mux = make("Mux").wire("u1", vector_size(2)).wire("u2", matrix_size(1, 2)).start();
    mux.set("u1", Values{1, 2}).set("u2", Values{3, 4});
    ASSERT_TRUE(mux.output());
    EXPECT_EQ(list(mux.get("y")), (Values{1, 2, 3, 4}));
    EXPECT_EQ(mux.size("y"), vector_size(4));
}

TEST(Demux, SplitsByWidthsOrEqually) {
    auto widths =
        make("Demux", {{"sizes", row({1, 2})}}).wire("u", vector_size(3)).start().set("u", Values{1, 2, 3});
    ASSERT_TRUE(widths.output());
    EXPECT_EQ(list(widths.get("y1")), (Values{1}));
    EXPECT_EQ(list(widths.get("y2")), (Values{2, 3}));
    auto halves = make("Demux").wire("u", vector_size(4)).start().set("u", Values{1, 2, 3, 4});
    ASSERT_TRUE(halves.output());
    EXPECT_EQ(list(halves.get("y2")), (Values{3, 4}));
}

TEST(Demux, RefusesWidthsThatDoNotSumUp) {
    EXPECT_EQ(refusal([] {
                  make("Demux", {{"sizes", row({1, 2})}}).wire("u", vector_size(4)).start();
              }),
              "input 'u' of size [4] cannot be split into 2 outputs whose widths sum to 3; change argument "
              "'sizes'");
}

TEST(Selector, KeepsOrderRepeatsAndOneDimension) {
    auto one = make("Selector", {{"indices", row({3, 1, 3})}}).wire("u", vector_size(3)).start();
    one.set("u", Values{10, 20, 30});
    ASSERT_TRUE(one.output());
    EXPECT_EQ(list(one.get("y")), (Values{30, 10, 30}));
    EXPECT_EQ(one.size("y"), vector_size(3));
    const Matrix m = Matrix::Random(4, 4);
    auto two =
        make("Selector", {{"indices", row({1, 2, 3})}, {"columns", 4}}).wire("u", matrix_size(4, 4)).start();
    two.set("u", m);
    ASSERT_TRUE(two.output());
    EXPECT_EQ(two.get("y"), m.block(0, 3, 3, 1));
    EXPECT_EQ(two.size("y"), matrix_size(3, 1));
}

TEST(Selector, RefusesAnElementThatIsNotThere) {
    EXPECT_EQ(refusal([] {
                  make("Selector", {{"indices", row({1, 5})}}).wire("u", vector_size(4)).start();
              }),
              "input 'u' of size [4] has no element 5");
}

TEST(Convert, RoundsAndSaturates) {
    const auto convert = [](double u, const char* rounding, bool saturate) {
        auto c =
            make("Convert",
                 {{"type", "int8"}, {"rounding", rounding}, {"on_overflow", saturate ? "saturate" : "wrap"}});
        c.wire("u", scalar_size(), Type::float64).start().set("u", Values{u});
        EXPECT_TRUE(c.output());
        EXPECT_EQ(c.type("y"), Type::int8);
        return c.scalar("y");
    };
    EXPECT_EQ(convert(-2.5, "floor", false), -3);
    EXPECT_EQ(convert(-2.5, "zero", false), -2);
    EXPECT_EQ(convert(-2.5, "nearest", false), -2);
    EXPECT_EQ(convert(-2.5, "away", false), -3);
    EXPECT_EQ(convert(-2.5, "convergent", false), -2);
    EXPECT_EQ(convert(2.1, "ceil", false), 3);
    EXPECT_EQ(convert(300, "floor", true), 127);
    EXPECT_EQ(convert(300, "floor", false), 44);
}

TEST(Assign, ReplacesElements) {
    auto assign = make("Assign", {{"indices", row({2, 3})}});
    assign.wire("base", vector_size(3)).wire("u", vector_size(2)).start();
    assign.set("base", Values{1, 2, 3}).set("u", Values{8, 9});
    ASSERT_TRUE(assign.output());
    EXPECT_EQ(list(assign.get("y")), (Values{1, 8, 9}));
}

TEST(Width, CountsElements) {
    auto width = make("Width").wire("u", matrix_size(2, 3)).start();
    ASSERT_TRUE(width.output());
    EXPECT_EQ(width.scalar("y"), 6);
}

TEST(Constant, HasTheTypeAndSizeOfItsValue) {
    auto constant =
        make("Constant").wire("value", vector_size(2), Type::boolean).start().set("value", Values{1, 0});
    ASSERT_TRUE(constant.output());
    EXPECT_EQ(constant.type("y"), Type::boolean);
    EXPECT_EQ(list(constant.get("y")), (Values{1, 0}));
    const auto as_written = [](const Arguments& arguments) {
        const auto b = make("Constant", arguments);
        return b.resolution().slots[static_cast<std::size_t>(b.index("value"))].as_written;
    };
    EXPECT_FALSE(as_written({}));
    EXPECT_TRUE(as_written({{"vector_1d", false}}));
}

Values sources(const std::string& name, const std::vector<std::pair<std::string, double>>& parameters,
               double period, int steps) {
    auto block = make(name);
    block.period = period;
    block.start();
    for (const auto& [key, value] : parameters) block.set(key, Values{value});
    Values y;
    for (int i = 0; i < steps; ++i) {
        EXPECT_TRUE(block.output());
        y.push_back(block.scalar("y"));
        EXPECT_TRUE(block.update());
        block.commit();
    }
    return y;
}

TEST(Sources, AreFunctionsOfTime) {
    EXPECT_EQ(sources("Clock", {}, 0.5, 3), (Values{0, 0.5, 1}));
    EXPECT_EQ(sources("Step", {{"after", 3}}, 0.5, 4), (Values{0, 0, 3, 3}));
    EXPECT_EQ(sources("Ramp", {{"slope", 2}, {"start", 0.5}, {"initial", 1}}, 0.5, 4), (Values{1, 1, 2, 3}));
    EXPECT_EQ(sources("Pulse", {{"amplitude", 2}, {"width", 50}}, 0.25, 6), (Values{2, 2, 0, 0, 2, 2}));
    const auto sine =
        sources("Sine", {{"amplitude", 2}, {"frequency", 3}, {"phase", 0.1}, {"bias", 1}}, 0.5, 3);
    for (int i = 0; i < 3; ++i)
        EXPECT_DOUBLE_EQ(sine[static_cast<std::size_t>(i)], 2 * std::sin(3 * 0.5 * i + 0.1) + 1);
}

TEST(Sources, ThatRepeatNeverSlipASample) {
    // A cycle of n samples, whatever rounding makes of k times the period.
    for (const double period : {0.1, 0.01, 0.001, 1.0 / 3, 0.7})
        for (const int n : {2, 3, 6, 10, 14}) {
            const int steps = 3000;
            const double cycle = n * period;
            const auto pulse = sources("Pulse", {{"cycle", cycle}, {"delay", 3 * period}}, period, steps);
            const auto full = sources("Pulse", {{"cycle", cycle}, {"width", 100}}, period, steps);
            const auto saw = [&] {
                auto block = make("SignalGenerator", {{"waveform", "sawtooth"}});
                block.period = period;
                block.start().set("frequency", Values{1 / cycle});
                Values y;
                for (int k = 0; k < steps; ++k) {
                    EXPECT_TRUE(block.step());
                    y.push_back(block.scalar("y"));
                }
                return y;
            }();
            for (int k = 0; k < steps; ++k) {
                const auto i = static_cast<std::size_t>(k);
                ASSERT_EQ(pulse[i], k >= 3 && 2 * ((k - 3) % n) < n) << period << " " << n << " " << k;
                ASSERT_EQ(full[i], 1) << period << " " << n << " " << k;
                ASSERT_NEAR(saw[i], 2.0 * (k % n) / n - 1, 1e-9) << period << " " << n << " " << k;
            }
        }
}

class File : public testing::Test {
  protected:
    std::string path =
        (std::filesystem::temp_directory_path() / ("bf_signal_" + std::to_string(::getpid()) + ".csv"))
            .string();
    void write(const std::string& text) const { std::ofstream(path) << text; }
    std::string refused(const std::string& text) const {
        write(text);
        return refusal([&] { make("SignalFromFile", {{"file", path}}); });
    }
    ~File() override { std::filesystem::remove(path); }
};

TEST_F(File, ThatHasNoEndIsRefused) {
    EXPECT_EQ(refusal([] {
                  make("SignalFromFile", {{"file", std::string("/dev/zero")}});
              }),
              "file '/dev/zero' cannot be read: it is no regular file, which has an end; write its content "
              "to one");
}

TEST_F(File, IsPlayedBackHeldOrInterpolated) {
    write("time,a,b\n0,1,10\n1,3,20\n");
    for (const auto& [interpolation, expected] :
         {std::pair{"hold", Values{1, 1, 3, 3}}, {"linear", Values{1, 2, 3, 3}}}) {
        auto block = make("SignalFromFile", {{"file", path}, {"interpolation", interpolation}});
        block.period = 0.5;
        block.start();
        Values y;
        for (int i = 0; i < 4; ++i) {
            ASSERT_TRUE(block.step());
            y.push_back(block.get("y")(0, 0));
        }
        EXPECT_EQ(y, expected) << interpolation;
        EXPECT_EQ(block.size("y"), vector_size(2));
    }
}

TEST_F(File, MayHaveOneHeadingAndCommentsAnywhere) {
    write("# measured\nt,a\n# in the lab\n\n0,1\n# half-way\n0.5,2\n");
    auto block = make("SignalFromFile", {{"file", path}});
    block.period = 0.5;
    block.start();
    EXPECT_EQ(block.size("y"), vector_size(1));
    for (const double expected : {1, 2, 2}) {
        ASSERT_TRUE(block.step());
        EXPECT_EQ(block.get("y")(0, 0), expected);
    }
    EXPECT_EQ(refused("0,1\n1#,2\n"), "file '" + path + "', line 2: '1#' is no number");
    EXPECT_EQ(refused("t,a\nu,b\n0,1\n"), "file '" + path + "', line 2: 'u' is no number");
    EXPECT_EQ(refused("0\n"), "file '" + path + "', line 1: a row needs a time and at least one value");
}

TEST_F(File, IsRefusedWithItsLine) {
    EXPECT_EQ(refused("t,a\n0,1\n1,x\n"), "file '" + path + "', line 3: 'x' is no number");
    EXPECT_EQ(refused("0,1\n1,2,3\n"), "file '" + path + "', line 2: 3 columns, but the rows before have 2");
    EXPECT_EQ(refused("0,1\n0,2\n"),
              "file '" + path + "', line 2: the time does not grow; rows must be in order of time");
    EXPECT_EQ(refused("# nothing\n"), "file '" + path + "' has no row of numbers");
    std::filesystem::remove(path);
    EXPECT_EQ(refusal([&] {
                  make("SignalFromFile", {{"file", path}});
              }),
              "file '" + path + "' cannot be read: No such file or directory");
}

double logic(const char* op, const Values& u) {
    auto block = make("Logic", {{"operator", op}, {"inputs", static_cast<int>(u.size())}});
    for (std::size_t i = 1; i <= u.size(); ++i)
        block.wire("u" + std::to_string(i), scalar_size(), Type::boolean);
    block.start();
    for (std::size_t i = 1; i <= u.size(); ++i) block.set("u" + std::to_string(i), Values{u[i - 1]});
    EXPECT_TRUE(block.output());
    return block.scalar("y");
}

TEST(Logic, HasTheTruthTablesOfItsOperators) {
    for (const bool a : {false, true})
        for (const bool b : {false, true}) {
            const Values u{double(a), double(b)};
            EXPECT_EQ(logic("AND", u), a && b);
            EXPECT_EQ(logic("OR", u), a || b);
            EXPECT_EQ(logic("NAND", u), !(a && b));
            EXPECT_EQ(logic("NOR", u), !(a || b));
            EXPECT_EQ(logic("XOR", u), a != b);
            EXPECT_EQ(logic("XNOR", u), a == b);
        }
    EXPECT_EQ(logic("NOT", {0}), 1);
    auto numbers =
        make("Logic", {{"operator", "NOT"}}).wire("u1", vector_size(2)).start().set("u1", Values{2.5, 0});
    ASSERT_TRUE(numbers.output());
    EXPECT_EQ(list(numbers.get("y")), (Values{0, 1}));
    EXPECT_EQ(numbers.type("y"), Type::boolean);
}

TEST(Relational, HasTheMeaningOfItsOperators) {
    const std::pair<const char*, Values> cases[] = {{"==", {0, 1, 0}}, {"~=", {1, 0, 1}}, {"<", {1, 0, 0}},
                                                    {"<=", {1, 1, 0}}, {">", {0, 0, 1}},  {">=", {0, 1, 1}}};
    for (const auto& [op, expected] : cases) {
        auto two = make("Relational", {{"operator", op}})
                       .wire("u1", vector_size(3))
                       .wire("u2", scalar_size())
                       .start();
        two.set("u1", Values{1, 2, 3}).set("u2", Values{2});
        ASSERT_TRUE(two.output());
        EXPECT_EQ(list(two.get("y")), expected) << op;
        auto one = make("CompareToConstant", {{"operator", op}}).wire("u", vector_size(3)).start();
        one.set("u", Values{1, 2, 3}).set("constant", Values{2});
        ASSERT_TRUE(one.output());
        EXPECT_EQ(list(one.get("y")), expected) << op;
    }
}

TEST(Choices, EnableTheFirstThatHoldsOrElseTheLast) {
    for (int pattern = 0; pattern < 8; ++pattern) {
        auto block = make("If", {{"conditions", 3}});
        block.start();
        int first = 3;
        for (int i = 3; i-- > 0;) {
            const bool holds = (pattern >> i & 1) != 0;
            block.set("u" + std::to_string(i + 1), Values{double(holds)});
            if (holds) first = i;
        }
        ASSERT_TRUE(block.step());
        for (int i = 0; i < 4; ++i)
            EXPECT_EQ(block.get("y" + std::to_string(i + 1))(0, 0), i == first) << pattern << ", y" << i + 1;
        EXPECT_LT(block.declaration().find("y5"), 0) << "one for each condition, and else";
    }
    auto cases = make("SwitchCase", {{"cases", Value(row({3, -1}))}}).wire("u", scalar_size()).start();
    for (const auto& [u, chosen] : {std::pair(3.0, 1), {-1, 2}, {3.9, 1}, {-1.9, 2}, {0, 3}}) {
        cases.set("u", Values{u});
        ASSERT_TRUE(cases.step());
        for (int i = 1; i <= 3; ++i)
            EXPECT_EQ(cases.get("y" + std::to_string(i))(0, 0), i == chosen) << u << ", y" << i;
    }
    EXPECT_LT(cases.declaration().find("y4"), 0);
}

TEST(Switch, AppliesItsCriterion) {
    const std::pair<const char*, Values> cases[] = {{">=", {2, 1, 1}}, {">", {2, 2, 1}}, {"~=", {2, 1, 1}}};
    for (const auto& [criterion, expected] : cases) {
        auto block = make("Switch", {{"criterion", criterion}});
        block.wire("u1", scalar_size()).wire("u2", scalar_size()).wire("u3", scalar_size()).start();
        block.set("u1", Values{1}).set("u3", Values{2}).set("threshold", Values{0.5});
        EXPECT_EQ(block.respond("u2", {0, 0.5, 1}), expected) << criterion;
    }
}

TEST(Switch, TakesABooleanControlAndExpandsIt) {
    auto block = make("Switch", {{"criterion", ">"}});
    block.wire("u1", vector_size(2))
        .wire("u2", scalar_size(), Type::boolean)
        .wire("u3", vector_size(2))
        .start();
    block.set("u1", Values{1, 2}).set("u3", Values{3, 4}).set("u2", Values{1});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{1, 2}));
}

TEST(MultiportSwitch, ChoosesByIndexAndElseTheLast) {
    auto block = make("MultiportSwitch", {{"indices", row({4, 7})}});
    block.wire("control", scalar_size()).wire("u1", scalar_size()).wire("u2", scalar_size()).start();
    block.set("u1", Values{40}).set("u2", Values{70});
    EXPECT_EQ(block.respond("control", {4, 7, 4.9, 5}), (Values{40, 70, 40, 70}));
}

TEST(LookUpRow, ChoosesARowAndFailsOutside) {
    auto block = make("LookUpRow").wire("table", matrix_size(2, 3)).wire("row", scalar_size()).start();
    block.set("table", Values{1, 4, 2, 5, 3, 6}).set("row", Values{2});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{4, 5, 6}));
    EXPECT_EQ(block.size("y"), vector_size(3));
    block.set("row", Values{3});
    EXPECT_EQ(block.output().text(), "the row asked for is not in the table");
}

TEST(Bitwise, MasksIntegers) {
    auto block = make("Bitwise").wire("u", scalar_size(), Type::uint8).start().set("mask", Values{6});
    EXPECT_EQ(block.respond("u", {1, 3, 15}), (Values{0, 2, 6}));
}

TEST(Nonlinear, LimitsDeadZonesAndRelays) {
    auto saturate =
        make("Saturate").wire("u", scalar_size()).start().set("lower", Values{-1}).set("upper", Values{2});
    EXPECT_EQ(saturate.respond("u", {-3, 0.5, 3}), (Values{-1, 0.5, 2}));
    auto open = make("Saturate").wire("u", scalar_size()).start();
    EXPECT_EQ(open.respond("u", {-1e300, 1e300}), (Values{-1e300, 1e300}));
    auto zone = make("DeadZone").wire("u", scalar_size()).start();
    EXPECT_EQ(zone.respond("u", {-2, 0.25, 2}), (Values{-1.5, 0, 1.5}));
    auto steps = make("Quantize").wire("u", scalar_size()).start();
    EXPECT_EQ(steps.respond("u", {0.2, 0.3, -0.8}), (Values{0, 0.5, -1}));
    auto relay = make("Relay").wire("u", scalar_size()).start();
    EXPECT_EQ(relay.respond("u", {0.5, 1, 0.5, 0, 0.5}), (Values{0, 1, 1, 0, 0}));
}

TEST(Assertion, FailsWhenTheStepIsComplete) {
    auto block = make("Assertion").wire("u", vector_size(2), Type::boolean).start().set("u", Values{1, 1});
    EXPECT_TRUE(block.step());
    block.set("u", Values{1, 0});
    EXPECT_TRUE(block.output());
    EXPECT_EQ(block.update().text(), "the asserted condition does not hold");
    auto off = make("Assertion", {{"stop", false}}).wire("u", scalar_size()).start();
    EXPECT_TRUE(off.step());
}

TEST(StateMachine, TakesTheFirstTransitionWhoseConditionAndTimeHold) {
    Matrix transitions(3, 4);
    transitions << 1, 2, 1, 0.25, 2, 3, 0, 0.5, 3, 1, 2, 0;
    auto block = make("StateMachine",
                      {{"states", std::vector<std::string>{"a", "b", "c"}}, {"transitions", transitions}});
    block.period = 0.25;
    block.wire("conditions", vector_size(2), Type::boolean).start();
    const std::vector<Values> conditions{{1, 0}, {1, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 1}, {0, 0}};
    Values state, time, entered;
    for (const auto& c : conditions) {
        block.set("conditions", c);
        ASSERT_TRUE(block.output());
        state.push_back(block.scalar("state"));
        time.push_back(block.scalar("time_in_state"));
        entered.push_back(block.scalar("entered"));
        ASSERT_TRUE(block.update());
        block.commit();
    }
    EXPECT_EQ(state, (Values{1, 2, 2, 3, 3, 1, 1}));
    EXPECT_EQ(time, (Values{0, 0, 0.25, 0, 0.25, 0, 0.25}));
    EXPECT_EQ(entered, (Values{1, 1, 0, 1, 0, 1, 0}));
}

TEST(StateMachine, RefusesStatesAndConditionsThatDoNotExist) {
    const Matrix to_2 = (Matrix(1, 4) << 1, 2, 1, 0).finished(),
                 to_1 = (Matrix(1, 4) << 1, 1, 3, 0).finished();
    EXPECT_EQ(refusal([&] {
                  make("StateMachine", {{"transitions", to_2}});
              }),
              "argument 'transitions', row 1: to is 2, but states are numbered 1 to 1");
    EXPECT_EQ(
        refusal([&] {
            make("StateMachine", {{"transitions", Matrix(3, 0)}}).wire("conditions", scalar_size()).start();
        }),
        "");
    EXPECT_EQ(refusal([&] {
                  make("StateMachine", {{"transitions", to_1}}).wire("conditions", vector_size(2)).start();
              }),
              "input 'conditions' of size [2] is too short: 'transitions', row 1, names condition 3");
    EXPECT_EQ(refusal([&] {
                  make("StateMachine", {{"states", std::vector<std::string>(1001, "s")}});
              }),
              "argument 'states': the chart has 1001 states; 1000 are the most");
}

std::pair<double, bool> check(const char* kind, const Values& u, const Values& limits = {-1e9, 1e9},
                              double from = -1) {
    auto block = make("Check", {{"kind", kind}}).wire("u", scalar_size()).start();
    block.set("at_least", Values{limits[0]}).set("at_most", Values{limits[1]}).set("from_time", Values{from});
    for (const double x : u) {
        block.set("u", Values{x});
        EXPECT_TRUE(block.step());
    }
    return {block.scalar("value"), block.scalar("passed") != 0};
}

TEST(Check, SummarisesTheRun) {
    EXPECT_EQ(check("always", {1, 1}), (std::pair{1.0, true}));
    EXPECT_EQ(check("always", {1, 0, 1}), (std::pair{0.0, false}));
    EXPECT_EQ(check("final", {5, 7}), (std::pair{7.0, true}));
    EXPECT_EQ(check("maximum", {-5, -7}), (std::pair{-5.0, true}));
    EXPECT_EQ(check("minimum", {5, 7}), (std::pair{5.0, true}));
    EXPECT_EQ(check("mean", {5, 7}), (std::pair{6.0, true}));
    EXPECT_EQ(check("rms", {3, -4}), (std::pair{std::sqrt(12.5), true}));
    EXPECT_EQ(check("maximum", {5, 7}, {0, 6}), (std::pair{7.0, false}));
    EXPECT_EQ(check("maximum", {9, 5}, {0, 6}, 0.01), (std::pair{5.0, true}))
        << "the first sample is too early";
    EXPECT_EQ(check("maximum", {}), (std::pair{0.0, false})) << "nothing was checked";
    EXPECT_TRUE(std::isnan(check("maximum", {1, std::nan(""), 2}).first));
}

TEST(Check, ReportsValueAndVerdict) {
    const auto reported = [](const char* kind) {
        std::vector<std::string> names;
        const auto block = make("Check", {{"kind", kind}});
        for (const auto& slot : block.resolution().slots)
            if (slot.reported) names.push_back(slot.name);
        return names;
    };
    EXPECT_EQ(reported("rms"), (std::vector<std::string>{"value", "passed"}));
    EXPECT_EQ(reported("always"), std::vector<std::string>{"passed"}) << "a truth value is its own verdict";
}

} // namespace
} // namespace bf::test

#include "running.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace bf::toolbox::test {
namespace {

constexpr double h = 0.01;

std::string filter(const std::string& type, const std::string& settings, int n = 1,
                   const std::string& more_inputs = {}) {
    std::string text =
        "model: m\nstep: " + std::to_string(h) + "\ninputs:\n  u: {shape: " + std::to_string(n) + "}\n";
    std::string connections =
        "connections:\n  u: x." + std::string(type == "DiscreteFilter" ? "u" : "reference") + "\n";
    for (std::size_t from = 0; from < more_inputs.size();) {
        const auto to = std::min(more_inputs.find(' ', from), more_inputs.size());
        const auto name = more_inputs.substr(from, to - from);
        text += "  " + name + ": {shape: 1}\n";
        connections += "  " + name + ": x." + name + "\n";
        from = to + 1;
    }
    return text + "blocks:\n  x: {block: WholeBodyToolbox/" + type + settings + "}\n" + connections;
}

/// One step with input u; the output of that name.
double respond(Running& run, double u, const std::string& output = "x.y") {
    run.set("u", u);
    EXPECT_TRUE(run.step()) << run.simulation.failure();
    return run.scalar(output);
}

/// y[k] = (Σ b_i u[k-i] - Σ_{i≥1} a_i y[k-i]) / a_0, straight from the definition, at rest before k = 0.
std::vector<double> difference_equation(const std::vector<double>& b, const std::vector<double>& a,
                                        const std::vector<double>& u) {
    std::vector<double> y;
    for (std::size_t k = 0; k < u.size(); ++k) {
        double sum = 0;
        for (std::size_t i = 0; i < b.size() && i <= k; ++i) sum += b[i] * u[k - i];
        for (std::size_t i = 1; i < a.size() && i <= k; ++i) sum -= a[i] * y[k - i];
        y.push_back(sum / a[0]);
    }
    return y;
}

std::vector<double> random_signal(int count) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<double> u;
    for (int k = 0; k < count; ++k) u.push_back(normal(random));
    return u;
}

} // namespace

TEST(DiscreteFilter, FollowsTheDifferenceEquation) {
    const auto u = random_signal(100);
    const auto compare = [&](const std::string& settings, const std::vector<double>& b,
                             const std::vector<double>& a) {
        Running run(filter("DiscreteFilter", settings));
        const auto expected = difference_equation(b, a, u);
        for (std::size_t k = 0; k < u.size(); ++k)
            ASSERT_NEAR(respond(run, u[k]), expected[k], 1e-12) << k << settings;
    };
    compare(", numerator: [0.2, 0.3, -0.1], denominator: [2, -0.5, 0.25, 0.1]", {0.2, 0.3, -0.1},
            {2, -0.5, 0.25, 0.1});
    compare(", numerator: [1, -1], denominator: 1", {1, -1}, {1});
    compare(", numerator: 0.1, denominator: [1, -0.9]", {0.1}, {1, -0.9});
    const double tau = 1 / (2 * std::numbers::pi * 3);
    compare(", filter_type: FirstOrderLowPassFilter, cut_frequency: 3", {h, h}, {2 * tau + h, h - 2 * tau});
}

TEST(DiscreteFilter, IsTheTustinFormOfAFirstOrderLag) {
    // At the cut frequency the gain is 1/√2, but for the rule's frequency warping.
    Running run(filter("DiscreteFilter", ", filter_type: FirstOrderLowPassFilter, cut_frequency: 1"));
    const double w = 2 * std::numbers::pi, warped = 2 / h * std::atan(w * h / 2);
    double peak = 0;
    for (int k = 0; k < 2000; ++k) {
        const double y = respond(run, std::sin(warped * k * h));
        if (k > 1000) peak = std::max(peak, std::abs(y));
    }
    EXPECT_NEAR(peak, 1 / std::sqrt(2), 1e-3);
}

TEST(DiscreteFilter, TakesTheMedianOfItsWindow) {
    const auto u = random_signal(50);
    for (const int order : {1, 2, 3, 4, 7}) {
        Running run(filter("DiscreteFilter", ", filter_type: MedianFilter, order: " + std::to_string(order)));
        for (int k = 0; k < 50; ++k) {
            std::vector<double> window;
            for (int i = 0; i < order; ++i)
                window.push_back(k >= i ? u[static_cast<std::size_t>(k - i)] : 0.0);
            std::sort(window.begin(), window.end());
            const auto middle = static_cast<std::size_t>(order / 2);
            const double expected = order % 2 ? window[middle] : 0.5 * (window[middle] + window[middle - 1]);
            EXPECT_EQ(respond(run, u[static_cast<std::size_t>(k)]), expected) << order << ' ' << k;
        }
    }
}

TEST(DiscreteFilter, GivesNaNWhileTheWindowOfAMedianHoldsOne) {
    Running run(filter("DiscreteFilter", ", filter_type: MedianFilter, order: 3"));
    EXPECT_EQ(respond(run, 1), 0);
    run.set("u", std::numeric_limits<double>::infinity());
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("x.y"), 1) << "infinity has an order";
}

TEST(DiscreteFilter, StartsInTheSteadyStateOfItsInitialOutput) {
    // With the input that belongs to y0 it stays there.
    const auto stays = [](const std::string& settings, double u) {
        Running run(filter("DiscreteFilter", settings));
        for (int k = 0; k < 5; ++k) EXPECT_NEAR(respond(run, u), 4, 1e-12) << settings;
    };
    stays(", numerator: [0.2, 0.3], denominator: [2, -0.5, 0.25], y0: 4", 4 * 1.75 / 0.5);
    stays(", filter_type: FirstOrderLowPassFilter, cut_frequency: 3, y0: 4", 4);
    stays(", filter_type: MedianFilter, order: 3, y0: 4", 4);
}

TEST(DiscreteFilter, WithANumeratorThatSumsToZeroStartsAtTheInitialInputAndOutput) {
    // y[0] = (u[0] - u0 + 0.5 y[-1]) with y[-1] = y0 / 0.5, so that u[0] = u0 gives y0.
    Running run(filter("DiscreteFilter", ", numerator: [1, -1], denominator: [1, -0.5], y0: 4, u0: 7"));
    EXPECT_NEAR(respond(run, 7), 4, 1e-12);
    EXPECT_NEAR(respond(run, 7), 2, 1e-12);
    Running no_poles(
        filter("DiscreteFilter", ", numerator: [1, -1], denominator: [1, 0.5, -0.5], y0: 4, u0: 7"));
    EXPECT_NEAR(respond(no_poles, 7), 0, 1e-12) << "no steady state other than zero";
}

TEST(DiscreteFilter, WorksElementByElement) {
    Running run(filter("DiscreteFilter", ", numerator: 0.5, denominator: [1, -0.5], y0: [1 2 3]", 3));
    run.set("u", Vector3(1, 2, 5));
    ASSERT_TRUE(run.step());
    EXPECT_LT((run.get("x.y") - Vector3(1, 2, 4)).norm(), 1e-12);
}

TEST(DiscreteFilter, RefusesImpossibleArguments) {
    const auto text = [](const std::string& settings, int n = 1) {
        return refusal(filter("DiscreteFilter", settings, n));
    };
    expect_contains(text(", numerator: [0 0]"),
                    "x: argument 'numerator' has no coefficient other than 0; give b_0 b_1");
    expect_contains(text(", denominator: [0 1]"),
                    "x: argument 'denominator' must begin with a_0 other than 0");
    expect_contains(text(", filter_type: FirstOrderLowPassFilter, cut_frequency: 0"),
                    "x: argument 'cut_frequency' must be greater than 0, but is");
    expect_contains(text(", filter_type: MedianFilter, order: 0"),
                    "x: argument 'order' must be at least 1, but is 0");
    expect_contains(text(", filter_type: Median"), "x: ");
    expect_contains(text(", filter_type: Median"), "MedianFilter");
    expect_contains(text(", y0: [1 2]", 3),
                    "x: argument 'y0' has 2 elements, but the signal has 3; give one element or as "
                    "many as the signal has");
    expect_contains(text(", numerator: [1 -1], u0: [1 2]", 3),
                    "x: argument 'u0' has 2 elements, but the signal has 3");
}

namespace {

const std::string trajectory = "MinimumJerkTrajectoryGenerator";

/// Numerators of position, velocity, acceleration and the denominator, as published for settling time T.
struct Transfer {
    std::vector<double> position, velocity, acceleration, denominator;
    explicit Transfer(double T) {
        const double a = -150.765868956161 / (T * T * T), b = -84.9812819469538 / (T * T),
                     c = -15.9669610709384 / T;
        const double m = 4 * c * h, n = 2 * b * h * h, p = a * h * h * h;
        denominator = {m + n + p - 8, -m + n + 3 * p + 24, -m - n + 3 * p - 24, m - n + p + 8};
        for (const double k : {1, 3, 3, 1}) position.push_back(p * k);
        for (const double k : {1, 1, -1, -1}) velocity.push_back(2 * a * h * h * k);
        for (const double k : {1, -1, -1, 1}) acceleration.push_back(4 * a * h * k);
    }
};

} // namespace

TEST(MinimumJerk, FollowsThePublishedTransferFunctions) {
    std::vector<double> u(20, 0.0);
    for (const double x : random_signal(300)) u.push_back(x);
    for (const double T : {0.2, 1.0, 3.0}) {
        Running run(filter(trajectory, ", settling_time: " + std::to_string(T)));
        const Transfer f(T);
        const auto p = difference_equation(f.position, f.denominator, u);
        const auto v = difference_equation(f.velocity, f.denominator, u);
        const auto a = difference_equation(f.acceleration, f.denominator, u);
        const double scale = 1e-9 / (T * T);
        for (std::size_t k = 0; k < u.size(); ++k) {
            ASSERT_NEAR(respond(run, u[k], "x.position"), p[k], scale) << k << ' ' << T;
            ASSERT_NEAR(run.scalar("x.velocity"), v[k], scale) << k << ' ' << T;
            ASSERT_NEAR(run.scalar("x.acceleration"), a[k], 100 * scale) << k << ' ' << T;
        }
    }
}

TEST(MinimumJerk, StartsAtTheReferenceAtRest) {
    Running run(filter(trajectory, "", 2));
    for (int k = 0; k < 10; ++k) {
        run.set("u", Eigen::Vector2d(0.3, -7));
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("x.position"), Matrix(Eigen::Vector2d(0.3, -7)));
        EXPECT_EQ(run.get("x.velocity").norm(), 0);
        EXPECT_EQ(run.get("x.acceleration").norm(), 0);
    }
}

TEST(MinimumJerk, GoesNineTenthsOfTheWayFromTheInitialValueInTheSettlingTime) {
    Running run(filter(trajectory, ", settling_time: 1, read_initial_value: true", 1, "initial"));
    const Transfer f(1);
    const auto p = difference_equation(f.position, f.denominator, std::vector<double>(400, 1.0));
    run.set("initial", 2);
    double highest = 0;
    for (std::size_t k = 0; k < p.size(); ++k) {
        const double x = respond(run, 3, "x.position");
        ASSERT_NEAR(x, 2 + p[k], 1e-9) << k;
        highest = std::max(highest, x);
        if (k == 100) {
            EXPECT_NEAR(x, 2.9, 0.01);
        }
    }
    EXPECT_NEAR(run.scalar("x.position"), 3, 1e-4);
    EXPECT_LT(highest, 3.001);
}

TEST(MinimumJerk, DerivativesAreThoseOfThePosition) {
    Running run(filter(trajectory, ", settling_time: 0.5"));
    double p = respond(run, 0, "x.position"), v = 0, a = 0;
    for (const double u : random_signal(100)) {
        const double next = respond(run, u, "x.position"), next_v = run.scalar("x.velocity"),
                     next_a = run.scalar("x.acceleration");
        EXPECT_NEAR(next - p, h / 2 * (v + next_v), 1e-12) << "trapezoidal rule";
        EXPECT_NEAR(next_v - v, h / 2 * (a + next_a), 1e-11);
        p = next, v = next_v, a = next_a;
    }
}

TEST(MinimumJerk, GoesOnSmoothlyWhenTheSettlingTimeChanges) {
    Running run(filter(trajectory, ", read_external_settling_time: true", 1, "settling"));
    run.set("settling", 1);
    double p = respond(run, 0, "x.position"), v = 0, a = 0;
    for (int k = 0; k < 200; ++k) {
        run.set("settling", k < 30 ? 1 : k < 60 ? 3 : 0.8);
        const double next = respond(run, 1, "x.position"), next_v = run.scalar("x.velocity"),
                     next_a = run.scalar("x.acceleration");
        EXPECT_LT(std::abs(next - p), 0.04) << k;
        EXPECT_LT(std::abs(next_v - v), 0.3) << k;
        if (k == 30 || k == 60) {
            EXPECT_GT(std::abs(v), 0.1) << "it moves when the time changes";
            EXPECT_NEAR(next - p, h / 2 * (v + next_v), 1e-12) << "no jump";
            EXPECT_NEAR(next_v - v, h / 2 * (a + next_a), 1e-11);
        }
        p = next, v = next_v, a = next_a;
    }
    EXPECT_NEAR(p, 1, 0.01);
}

TEST(MinimumJerk, StartsAgainFromTheLastPositionWhereItIsToldTo) {
    Running run(filter(trajectory, ", read_external_settling_time: true, reset_on_settling_time_change: true",
                       1, "settling"));
    run.set("settling", 1);
    double p = respond(run, 0, "x.position");
    for (int k = 0; k < 40; ++k) p = respond(run, 1, "x.position");
    ASSERT_GT(run.scalar("x.velocity"), 0.5);
    // What follows is the response of a filter at rest at p to a reference of 1.
    const Transfer f(2);
    const auto expected = difference_equation(f.position, f.denominator, std::vector<double>(50, 1 - p));
    run.set("settling", 2);
    for (const double x : expected) ASSERT_NEAR(respond(run, 1, "x.position"), p + x, 1e-9);
}

TEST(MinimumJerk, FailsWithoutAPositiveSettlingTime) {
    for (const double T : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        Running run(filter(trajectory, ", read_external_settling_time: true", 1, "settling"));
        run.set("u", 0).set("settling", T);
        EXPECT_FALSE(run.step());
        EXPECT_EQ(run.simulation.failure(), "x: the settling time must be above 0 s");
    }
}

TEST(MinimumJerk, TakesAnInitialValueForAllElementsOrForEach) {
    const auto start = [](const std::string& size) {
        return "model: m\nstep: 0.01\ninputs: {u: {shape: 3}, start: {shape: " + size +
               "}}\nblocks: {x: {block: WholeBodyToolbox/MinimumJerkTrajectoryGenerator, read_initial_value: "
               "true}}\n"
               "connections: {u: x.reference, start: x.initial}\n";
    };
    Running each(start("3"));
    each.set("u", Vector3(1, 2, 3)).set("start", Vector3(1, 2, 3));
    ASSERT_TRUE(each.step());
    EXPECT_EQ(each.get("x.position"), Matrix(Vector3(1, 2, 3)));
    Running all(start("1"));
    all.set("u", Vector3(5, 5, 5)).set("start", 5);
    ASSERT_TRUE(all.step());
    EXPECT_EQ(all.get("x.position"), Matrix(Vector3(5, 5, 5)));
    expect_contains(refusal(start("2")),
                    "x: input 'initial' has 2 elements, but the reference has 3; give one element or "
                    "as many as the reference has");
}

} // namespace bf::toolbox::test

// Continuous states: transfer functions against their quotient of polynomials, the methods against their
// order conditions, delays against the line that they read.
#include "eigen_views.hpp"

#include "bf/kernels/continuous.hpp"
#include "bf/kernels/runge_kutta.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;

TEST(LimitedStates, RestAtALimitWhileTheInputLeadsFurtherOut) {
    const V lower{-1}, upper{2}, y{2, 2, 2, 1, -1, -1, -1, 3}, u{5, -5, 0, 5, -5, 5, 0, 5};
    EXPECT_EQ(elements(LimitedRate{}, 8, lower, upper, y, u), (D{0, -5, 0, 5, 0, 5, 0, 0}));
    EXPECT_EQ(elements<int>(HeldSide{}, 8, V{0}, lower, upper, y, u),
              (std::vector<int>{1, 0, 0, 0, -1, 0, 0, 1}));
    // Stopped at a side, y no longer counts.
    EXPECT_EQ(elements<int>(HeldSide{}, 4, V{1, 1, -1, -1}, lower, upper, V{0}, V{5, -5, -5, 5}),
              (std::vector<int>{1, 0, -1, 0}));
    EXPECT_EQ(elements(LimitReached{}, 5, lower, upper, V{-2, -1, 0, 2, 3}), (D{-1, -1, 0, 1, 1}));
}

TEST(Lag, IsTheDifferenceOverItsTime) { EXPECT_EQ(elements(Lag{}, 2, V{0.5, 2}, V{1, 1}, V{3}), (D{4, 1})); }

TEST(Companion, HasTheTransferFunctionOfItsPolynomials) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> number(-2, 2);
    for (const int n : {1, 2, 4}) {
        Eigen::VectorXd b(n + 1), a(n + 1);
        for (int i = 0; i <= n; ++i) b[i] = number(random), a[i] = number(random);
        a[0] = 1;
        // x' = A x + B u, y = C x + E u, column by column from the kernels.
        Eigen::MatrixXd A(n, n), C(1, n), x(n, 1), rate(n, 1);
        Eigen::VectorXd B(n), y(1);
        const Eigen::VectorXd zero = Eigen::VectorXd::Zero(1), one = Eigen::VectorXd::Ones(1);
        for (int j = 0; j < n; ++j) {
            x.setZero();
            x(j) = 1;
            CompanionRate{}(view(rate), view(a), view(x), view(zero));
            A.col(j) = rate;
            CompanionOutput{}(view(y), view(b), view(a), view(x), view(zero));
            C(j) = y[0];
        }
        x.setZero();
        CompanionRate{}(view(rate), view(a), view(x), view(one));
        B = rate;
        CompanionOutput{}(view(y), view(b), view(a), view(x), view(one));
        for (int k = 0; k < 5; ++k) {
            const std::complex<double> s(number(random), number(random));
            const Eigen::MatrixXcd resolvent =
                (s * Eigen::MatrixXcd::Identity(n, n) - A.cast<std::complex<double>>()).inverse();
            const std::complex<double> found =
                (C.cast<std::complex<double>>() * resolvent * B.cast<std::complex<double>>())(0) + y[0];
            std::complex<double> above = 0, below = 0;
            for (int i = 0; i <= n; ++i) above = above * s + b[i], below = below * s + a[i];
            EXPECT_LT(std::abs(found - above / below), 1e-9 * std::abs(above / below)) << n;
        }
    }
}

TEST(Companion, HasAColumnOfStatesForEachElement) {
    const Eigen::Vector3d b(1, 2, 3), a(1, 4, 5);
    Eigen::MatrixXd x(2, 2), rate(2, 2);
    x << 1, 3, 2, 4;
    Eigen::VectorXd y(2), u(2);
    u << 10, 20;
    CompanionOutput{}(view(y), view(b), view(a), view(x), view(u));
    EXPECT_EQ(y, Eigen::Vector2d(10 + (2 - 4) * 1 + (3 - 5) * 2, 20 + (2 - 4) * 3 + (3 - 5) * 4));
    CompanionRate{}(view(rate), view(a), view(x), view(u));
    EXPECT_EQ(rate.col(0), Eigen::Vector2d(10 - 4 * 1 - 5 * 2, 1));
    EXPECT_EQ(rate.col(1), Eigen::Vector2d(20 - 4 * 3 - 5 * 4, 3));
    CompanionOutput{}(view(y), *V{7}, *V{1}, View<const double>(nullptr, 0, 2), view(u));
    EXPECT_EQ(y, Eigen::Vector2d(70, 140)) << "without states it is a gain";
}

TEST(DifferenceQuotient, KeepsItsLastValueUntilTimeHasPassed) {
    const auto quotient = [](double started, double before, double now) {
        return elements(DifferenceQuotient{}, 2, V{started}, V{before}, V{1, 2}, V{7, 8}, V{now}, V{2, 5});
    };
    EXPECT_EQ(quotient(1, 1, 1.5), (D{2, 6}));
    EXPECT_EQ(quotient(0, 1, 1.5), (D{7, 8})) << "before the first sample";
    EXPECT_EQ(quotient(1, 1, 1), (D{7, 8})) << "at the same time";
    EXPECT_EQ(quotient(1, 0.5, 1), (D{2, 6})) << "less than a second later";
}

/// A ring of samples, as a delay keeps it.
struct Past {
    Eigen::VectorXd times;
    Eigen::MatrixXd values;
    unsigned count = 0;

    explicit Past(int capacity) : times(capacity), values(capacity, 2) {}
    void keep(double t, double first, double second) {
        const Eigen::VectorXd old_times = times;
        const Eigen::MatrixXd old_values = values;
        const unsigned old_count = count;
        const View<const unsigned> before(&old_count, 1);
        KeepSample{}(view(times), view(values), View<unsigned>(&count, 1), view(old_times), view(old_values),
                     before, *V{t}, *V{first, second});
    }
    /// What was `delay` before t; nothing where the ring is too short.
    D at(double t, double delay) const {
        Eigen::VectorXd y(2);
        const bool known = DelayedSample{}(view(y), *V{-1, -2}, *V{delay}, view(times), view(values),
                                           View<const unsigned>(&count, 1), *V{t});
        return known ? D{y[0], y[1]} : D{};
    }
};

TEST(Delay, ReadsTheLineBetweenItsSamples) {
    Past past(16);
    // Corners of a line at unequal distances, so that a neighbour's piece gives another value.
    const std::vector<std::pair<double, double>> corners{{0, 0}, {1, 4}, {1.5, 3}, {3, 9}, {5, -1}};
    EXPECT_EQ(past.at(0, 1), (D{-1, -2})) << "before the first sample";
    for (const auto& [t, x] : corners) past.keep(t, x, -2 * x);
    EXPECT_EQ(past.at(5, 6), (D{-1, -2})) << "the time before the first sample";
    const auto line = [&](double t) {
        std::size_t k = 0;
        while (k + 2 < corners.size() && t >= corners[k + 1].first) ++k;
        const auto [t0, x0] = corners[k];
        const auto [t1, x1] = corners[k + 1];
        return x0 + (t - t0) / (t1 - t0) * (x1 - x0);
    };
    for (double t = 0; t <= 6; t += 0.125) {
        const D y = past.at(t + 0.5, 0.5);
        ASSERT_EQ(y.size(), 2u);
        EXPECT_NEAR(y[0], line(t), 1e-12) << t << ": after the newest on the line of the last two";
        EXPECT_NEAR(y[1], -2 * line(t), 1e-12) << t;
    }
    EXPECT_EQ(past.at(3, -7), past.at(3, 0)) << "no look into the future";
}

TEST(Delay, ForgetsTheOldestWhereTheRingIsFull) {
    Past past(4);
    for (int k = 0; k < 4; ++k) past.keep(k, 10 * k, k);
    EXPECT_EQ(past.at(3, 4), (D{-1, -2})) << "the first sample is still there, and nothing was before";
    EXPECT_EQ(past.at(3, 3), (D{0, 0}));
    for (int k = 4; k < 11; ++k) {
        past.keep(k, 10 * k, k);
        EXPECT_EQ(past.count, static_cast<unsigned>(k + 1));
        EXPECT_EQ(past.at(k, 3.5), D{}) << "longer than what is kept";
        for (const double delay : {0.0, 0.25, 1.0, 2.5, 3.0})
            EXPECT_EQ(past.at(k, delay), (D{10 * (k - delay), k - delay})) << k << " - " << delay;
    }
}

TEST(Delay, ASampleOfTheSameTimeReplacesTheNewest) {
    Past past(3);
    past.keep(0, 1, 1);
    past.keep(0, 5, 6);
    EXPECT_EQ(past.count, 1u);
    EXPECT_EQ(past.at(0, 0), (D{5, 6})) << "one sample alone holds";
    EXPECT_EQ(past.at(9, 1), (D{5, 6}));
    for (int k = 1; k < 4; ++k) past.keep(k, k, k);
    past.keep(3, 30, 40);
    EXPECT_EQ(past.count, 4u);
    EXPECT_EQ(past.at(3, 0), (D{30, 40}));
    EXPECT_EQ(past.at(3, 1), (D{2, 2}));
}

// ---- Runge-Kutta methods

/// The conditions of Hairer, Nørsett, Wanner I, table II.2.2, for each rooted tree up to order 5.
std::vector<std::pair<int, double>> residuals(const ButcherTableau& m) {
    std::vector<std::pair<int, double>> all;
    const auto sum = [&](auto&& f) {
        double s = 0;
        for (int i = 0; i < m.stages; ++i) s += m.b[i] * f(i);
        return s;
    };
    const auto a = [&](int i, auto&& f) {
        double s = 0;
        for (int j = 0; j < m.stages; ++j) s += m.a[i][j] * f(j);
        return s;
    };
    const auto c = [&](int i) { return m.c[i]; };
    const auto c2 = [&](int i) { return m.c[i] * m.c[i]; };
    const auto c3 = [&](int i) { return m.c[i] * m.c[i] * m.c[i]; };
    const auto ac = [&](int i) { return a(i, c); };
    const auto ac2 = [&](int i) { return a(i, c2); };
    const auto aac = [&](int i) { return a(i, ac); };
    const auto add = [&](int order, double found, double wanted) { all.emplace_back(order, found - wanted); };
    add(1, sum([](int) { return 1; }), 1);
    add(2, sum(c), 1. / 2);
    add(3, sum(c2), 1. / 3);
    add(3, sum(ac), 1. / 6);
    add(4, sum(c3), 1. / 4);
    add(4, sum([&](int i) { return c(i) * ac(i); }), 1. / 8);
    add(4, sum(ac2), 1. / 12);
    add(4, sum(aac), 1. / 24);
    add(5, sum([&](int i) { return c(i) * c3(i); }), 1. / 5);
    add(5, sum([&](int i) { return c2(i) * ac(i); }), 1. / 10);
    add(5, sum([&](int i) { return ac(i) * ac(i); }), 1. / 20);
    add(5, sum([&](int i) { return c(i) * ac2(i); }), 1. / 15);
    add(5, sum([&](int i) { return a(i, c3); }), 1. / 20);
    add(5, sum([&](int i) { return c(i) * aac(i); }), 1. / 30);
    add(5, sum([&](int i) { return a(i, [&](int j) { return c(j) * ac(j); }); }), 1. / 40);
    add(5, sum([&](int i) { return a(i, ac2); }), 1. / 60);
    add(5, sum([&](int i) { return a(i, aac); }), 1. / 120);
    return all;
}

TEST(RungeKutta, MethodsMeetTheConditionsOfTheirOrderAndNotTheNext) {
    for (const auto* method : {&euler, &heun, &bogacki_shampine, &rk4, &dormand_prince}) {
        double worst_next = 0;
        for (const auto& [order, residual] : residuals(*method)) {
            if (order <= method->order) {
                EXPECT_NEAR(residual, 0, 1e-15) << method->order << ", " << order;
            }
            if (order == method->order + 1) worst_next = std::max(worst_next, std::abs(residual));
        }
        if (method->order < 5) {
            EXPECT_GT(worst_next, 1e-3) << method->order;
        }
        for (int i = 0; i < method->stages; ++i) {
            double sum = 0;
            for (int j = 0; j < 6; ++j) {
                sum += method->a[i][j];
                if (j >= i) {
                    EXPECT_EQ(method->a[i][j], 0) << "explicit";
                }
            }
            EXPECT_NEAR(sum, method->c[i], 1e-15);
        }
    }
}

TEST(RungeKutta, AsksForTheSlopesOfItsStagesInTheirOrderAndTime) {
    double x[2] = {1, 0}, rate[2], start[2], slopes[8];
    std::vector<int> stages;
    D times;
    const auto oscillator = [&](int stage, double t) {
        stages.push_back(stage);
        times.push_back(t);
        rate[0] = x[1], rate[1] = -x[0];
        return true;
    };
    const double h = 0.1;
    ASSERT_TRUE((runge_kutta_step<rk4>(2.0, h, 2, x, rate, start, slopes, oscillator)));
    EXPECT_EQ(stages, (std::vector<int>{0, 1, 2, 3}));
    EXPECT_EQ(times, (D{2, 2.05, 2.05, 2.1}));
    // The series of cos and -sin up to the order.
    EXPECT_NEAR(x[0], 1 - h * h / 2 + h * h * h * h / 24, 1e-16);
    EXPECT_NEAR(x[1], -h + h * h * h / 6, 1e-16);
    const double before[2] = {x[0], x[1]};
    EXPECT_FALSE((runge_kutta_step<rk4>(2.1, h, 2, x, rate, start, slopes, [&](int stage, double) {
        rate[0] = rate[1] = 1;
        return stage < 2;
    })));
    EXPECT_EQ(x[0], before[0]);
    EXPECT_EQ(x[1], before[1]) << "a step that fails leaves the state";
}

} // namespace
} // namespace bf::kernels

#include "eigen_views.hpp"

#include "bf/kernels/discrete.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace bf::kernels {
namespace {

using V = Vector<double>;
using D = std::vector<double>;

/// One scalar filter, run by the kernels.
struct Filter {
    Eigen::VectorXd b, a, s;

    double step(double u) {
        double y = 0;
        const View<const double> in{&u, 1};
        FilterOutput{}(View<double>{&y, 1}, view(b), view(a), view(s), in);
        FilterUpdate{}(view(s), view(b), view(a), view(s), View<const double>{&y, 1}, in);
        return y;
    }
    void start(double y0, double u0) { FilterInitial{}(view(s), view(b), view(a), *V{y0}, *V{u0}); }
};

TEST(Integrator, FollowsItsThreeRules) {
    const V gain{2}, period{0.5}, low{-inf}, high{inf}, x{1, 10}, u{1, 3};
    EXPECT_EQ(elements(Accumulate{}, 2, gain, period, low, high, x, u), (D{2, 13}));
    EXPECT_EQ(elements(AccumulateHalf{}, 2, gain, period, low, high, x, u), (D{1.5, 11.5}));
    EXPECT_EQ(elements(Accumulate{}, 2, gain, period, low, V{5}, x, u), (D{2, 5}));
}

TEST(Integrator, ResetsOnEdgesAndLevels) {
    const V before{0, 1, 1, 0, -1}, now{1, 0, 1, 0, 0};
    EXPECT_EQ(elements(RisingEdge{}, 5, before, now), (D{1, 0, 0, 0, 0}));
    EXPECT_EQ(elements(FallingEdge{}, 5, before, now), (D{0, 1, 0, 0, 0}));
    EXPECT_EQ(elements(EitherEdge{}, 5, before, now), (D{1, 1, 0, 0, 0}));
    EXPECT_EQ(elements(LevelReset{}, 5, before, now), (D{1, 1, 1, 0, 1}));
}

TEST(Filter, EqualsItsDifferenceEquation) {
    for (int order : {0, 1, 3}) {
        Filter f{Eigen::VectorXd::Random(order + 1), Eigen::VectorXd::Random(order + 1) * 0.3,
                 Eigen::VectorXd::Zero(order)};
        f.a[0] = 2;
        std::vector<double> u, y;
        for (int k = 0; k < 50; ++k) {
            u.push_back(std::sin(0.3 * k * k));
            double sum = 0;
            for (int i = 0; i <= order && i <= k; ++i) sum += f.b[i] * u[k - i] - (i ? f.a[i] * y[k - i] : 0);
            y.push_back(sum / f.a[0]);
            EXPECT_NEAR(f.step(u[k]), y[k], 1e-12);
        }
    }
}

TEST(Filter, TakesNumeratorsAndDenominatorsOfDifferentLength) {
    Filter delay{Eigen::Vector3d(0, 0, 1), Eigen::VectorXd::Ones(1), Eigen::Vector2d(7, 8)};
    EXPECT_EQ(delay.step(1), 7);
    EXPECT_EQ(delay.step(2), 8);
    EXPECT_EQ(delay.step(3), 1);
}

TEST(Filter, StartsAtItsInitialOutput) {
    Filter low{Eigen::Vector2d(1, 1), Eigen::Vector2d(5, -3), Eigen::VectorXd(1)};
    low.start(4, 0);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(low.step(4), 4, 1e-14); // gain 1: rests at its input
    Filter high{Eigen::Vector2d(1, -1), Eigen::Vector2d(2, -1), Eigen::VectorXd(1)};
    high.start(3, 8); // no gain at frequency 0
    EXPECT_NEAR(high.step(8), 3, 1e-14);
    Filter difference{Eigen::Vector2d(1, -1), Eigen::Vector2d(1, 0), Eigen::VectorXd(1)};
    difference.start(3, 8); // forgets its outputs at once
    EXPECT_EQ(difference.step(9), 1);
}

TEST(Filter, ChangesCoefficientsWithoutLosingItsPast) {
    Filter f{Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(4, 1, 0.5), Eigen::Vector2d(0, 0)}, g = f;
    double u[2] = {}, y[2] = {}; // newest first
    for (int k = 0; k < 5; ++k) {
        u[1] = u[0];
        y[1] = y[0];
        u[0] = k * k;
        y[0] = f.step(u[0]);
    }
    FilterState{}(view(g.s), view(g.b), view(g.a), View<const double>{y, 2}, View<const double>{u, 2});
    EXPECT_LE((g.s - f.s).norm(), 1e-12);
}

TEST(LowPass, IsTustinsRule) {
    Filter f{Eigen::VectorXd(2), Eigen::VectorXd(2), Eigen::VectorXd::Zero(1)};
    LowPassCoefficients{}(view(f.b), view(f.a), *V{5}, *V{0.01});
    const double tau = 1 / (2 * M_PI * 5);
    EXPECT_LE((f.b - Eigen::Vector2d(0.01, 0.01)).norm(), 1e-16);
    EXPECT_LE((f.a - Eigen::Vector2d(2 * tau + 0.01, 0.01 - 2 * tau)).norm(), 1e-16);
    double y = 0;
    for (int k = 0; k < 200; ++k) y = f.step(1);
    EXPECT_NEAR(y, 1, 1e-12);
}

TEST(MinimumJerk, FollowsItsDifferentialEquation) {
    const double T = 1e-3, ts = 0.5, alpha = -150.765868956161 / (ts * ts * ts);
    const double beta = -84.9812819469538 / (ts * ts), gamma = -15.9669610709384 / ts;
    Filter p{Eigen::VectorXd(4), Eigen::VectorXd(4), Eigen::VectorXd(3)}, v = p, w = p;
    MinimumJerkCoefficients{}(view(p.a), view(p.b), view(v.b), view(w.b), *V{ts}, *V{T});
    v.a = w.a = p.a;
    p.start(2, 0);
    v.start(0, 2);
    w.start(0, 2);
    Eigen::Vector3d x(2, 0, 0); // x''' = γ x'' + β x' + α (x - u), by the rule of Runge and Kutta
    const auto input = [](double t) { return 2 + std::pow(std::sin(t), 4); };
    const auto rate = [&](const Eigen::Vector3d& z, double u) {
        return Eigen::Vector3d(z[1], z[2], gamma * z[2] + beta * z[1] + alpha * (z[0] - u));
    };
    for (int k = 0; k < 1500; ++k) {
        EXPECT_NEAR(p.step(input(k * T)), x[0], 1e-5);
        EXPECT_NEAR(v.step(input(k * T)), x[1], 1e-4);
        EXPECT_NEAR(w.step(input(k * T)), x[2], 1e-3);
        const double middle = input((k + 0.5) * T);
        const Eigen::Vector3d k1 = rate(x, input(k * T)), k2 = rate(x + T / 2 * k1, middle);
        const Eigen::Vector3d k3 = rate(x + T / 2 * k2, middle), k4 = rate(x + T * k3, input((k + 1) * T));
        x += T / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
}

TEST(Median, IsTheMiddleOfTheWindow) {
    Eigen::MatrixXd past(2, 2);
    past << 5, 1, 9, 2;
    const Eigen::Vector2d u(7, 3);
    Eigen::Vector2d y;
    Eigen::VectorXd work(4);
    MedianFilter{}(view(y), view(past), view(u), view(work));
    EXPECT_EQ(y, Eigen::Vector2d(7, 2));
    const Eigen::MatrixXd odd = (Eigen::MatrixXd(3, 1) << 5, 9, std::nan("")).finished();
    MedianFilter{}(View<double>{y.data(), 1}, view(odd), *V{7}, view(work));
    EXPECT_EQ(y[0], 8);
}

TEST(Discrete, KeepsSamples) {
    Eigen::Matrix<double, 3, 1> past(1, 2, 3);
    Shift{}(view(past), view(past), *V{0});
    EXPECT_EQ(past, Eigen::Vector3d(0, 1, 2));
    EXPECT_EQ(elements(Difference{}, 2, V{0.5}, V{1, 2}, V{2, 5}), (D{2, 6}));
}

} // namespace
} // namespace bf::kernels

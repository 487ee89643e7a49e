// PID controllers against the equations of Åström, Hägglund, Advanced PID Control, §3.5 and §13.4.
#include "eigen_views.hpp"

#include "bf/kernels/pid.hpp"

#include <gtest/gtest.h>

namespace bf::kernels {
namespace {

using V = Vector<double>;

struct Terms {
    double anti_windup = 0, has_tracking = 0, theta_i = 0, theta_d = 0;
    double p = 2, i = 3, d = 5, n = 7, b = 0.5, c = 0.25, tracking_time = 4, lower = -inf, upper = inf;
    double period = 0.125, x_i = 0.75, x_d = -0.5, r = 1.5, m = 0.25, tracked = 0;
};
struct Found {
    double y, slope_i, slope_d;
    int branch;
};

Found run(const Terms& t) {
    Found found{};
    const V options{t.anti_windup, t.has_tracking, t.theta_i, t.theta_d}, p{t.p}, i{t.i}, d{t.d}, n{t.n},
        b{t.b}, c{t.c}, k{t.tracking_time}, low{t.lower}, high{t.upper}, h{t.period}, xi{t.x_i}, xd{t.x_d},
        r{t.r}, m{t.m}, a{t.tracked};
    Pid{}(View<double>(&found.y, 1), View<double>(&found.slope_i, 1), View<double>(&found.slope_d, 1),
          *options, *p, *i, *d, *n, *b, *c, *k, *low, *high, *h, *xi, *xd, *r, *m, *a);
    PidBranch{}(View<int>(&found.branch, 1), *options, *p, *i, *d, *n, *b, *c, *k, *low, *high, *h, *xi, *xd,
                *r, *m, *a);
    return found;
}

TEST(Pid, AddsItsThreeTerms) {
    const Terms t;
    const double q = t.n * (t.d * (t.c * t.r - t.m) - t.x_d);
    const Found found = run(t);
    EXPECT_DOUBLE_EQ(found.y, t.p * (t.b * t.r - t.m) + t.x_i + q);
    EXPECT_DOUBLE_EQ(found.slope_i, t.i * (t.r - t.m));
    EXPECT_DOUBLE_EQ(found.slope_d, q);
    EXPECT_EQ(found.branch, 0);
}

TEST(Pid, ItsStatesAreThoseOfTheRuleThatThetaNames) {
    for (const double theta : {0.5, 1.0}) {
        Terms t;
        t.theta_i = t.theta_d = theta;
        const Found found = run(t);
        // q = N (D (c r - m) - z) with z = x_d + θ T q, an equation that q must meet.
        const double z = t.x_d + theta * t.period * found.slope_d;
        EXPECT_NEAR(found.slope_d, t.n * (t.d * (t.c * t.r - t.m) - z), 1e-12);
        const double w = t.x_i + theta * t.period * t.i * (t.r - t.m);
        EXPECT_NEAR(found.y, t.p * (t.b * t.r - t.m) + w + found.slope_d, 1e-12);
    }
}

TEST(Pid, IsLimitedAndItsIntegralFollowsByItsAntiWindup) {
    Terms t;
    t.d = 0;
    const double v = run(t).y, drive = t.i * (t.r - t.m);
    ASSERT_GT(drive, 0);
    for (const double upper : {v - 1, v, v + 1}) {
        t.upper = upper;
        const bool is_over = v > upper;
        t.anti_windup = static_cast<double>(AntiWindup::none);
        EXPECT_EQ(run(t).y, std::min(v, upper));
        EXPECT_EQ(run(t).slope_i, drive);
        EXPECT_EQ(run(t).branch, is_over ? 2 : 0);
        t.anti_windup = static_cast<double>(AntiWindup::back_calculation);
        EXPECT_DOUBLE_EQ(run(t).slope_i, drive + (std::min(v, upper) - v) / t.tracking_time);
        t.anti_windup = static_cast<double>(AntiWindup::clamping);
        EXPECT_EQ(run(t).slope_i, is_over ? 0 : drive);
        EXPECT_EQ(run(t).branch, is_over ? 3 : 0);
    }
    // Below the lower limit the same drive leads back inside, and the integral goes on.
    t.upper = inf;
    t.lower = v + 1;
    EXPECT_EQ(run(t).y, v + 1);
    EXPECT_EQ(run(t).slope_i, drive);
    EXPECT_EQ(run(t).branch, -2);
    t.i = -t.i;
    EXPECT_EQ(run(t).slope_i, 0);
    EXPECT_EQ(run(t).branch, -1) << "-2 for the limit, +1 for the integral";
}

TEST(Pid, FollowsATrackedOutputWhereItHasOne) {
    Terms t;
    t.tracked = 10;
    EXPECT_EQ(run(t).slope_i, t.i * (t.r - t.m)) << "it has none";
    t.has_tracking = 1;
    const Found found = run(t);
    EXPECT_DOUBLE_EQ(found.slope_i, t.i * (t.r - t.m) + (10 - found.y) / t.tracking_time);
    t.upper = 1;
    EXPECT_DOUBLE_EQ(run(t).slope_i, t.i * (t.r - t.m) + (10 - 1) / t.tracking_time) << "the limited output";
}

TEST(Pid, TakesEachElementOfItsOperands) {
    double y[2], slope_i[2], slope_d[2];
    const V options{0, 0, 0, 0}, zero{0}, one{1}, i{1, 2}, low{-inf}, high{inf}, r{3, 4}, m{1, 1}, x{10, 20};
    Pid{}(View<double>(y, 2), View<double>(slope_i, 2), View<double>(slope_d, 2), *options, *zero, *i, *zero,
          *one, *one, *zero, *one, *low, *high, *one, *x, *zero, *r, *m, *zero);
    EXPECT_EQ(y[0], 10);
    EXPECT_EQ(y[1], 20);
    EXPECT_EQ(slope_i[0], 2);
    EXPECT_EQ(slope_i[1], 6);
}

TEST(Advance, IsTheIntegralOfAHeldSlope) {
    EXPECT_EQ(elements(Advance{}, 2, V{0.5}, V{4}, V{1, 2}, V{10, -10}), (std::vector<double>{21, -18}));
}

} // namespace
} // namespace bf::kernels

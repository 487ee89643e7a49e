#include "bf/walking/dcm.hpp"
#include "bf/walking/swing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace bf::walking {
namespace {

constexpr double pi = std::numbers::pi, omega = 4.4, infinity = std::numeric_limits<double>::infinity();
const Vrp vrp{{0.03, 0.005, 0.5}};

Eigen::Vector2d in_axes_of(const Foothold& frame, const Foothold& point) {
    return Eigen::Rotation2Dd(-frame[3]) * (point - frame).head<2>();
}

/// Feet that walk along a bend, the first from the left.
Eigen::Matrix<double, 4, 7> some_footholds() {
    Eigen::Matrix<double, 4, 7> feet;
    feet.col(0) = Foothold(0, 0.08, 0, 0);
    feet.col(1) = Foothold(0.01, -0.07, 0, 0);
    Side side = Side::right;
    for (int i = 2; i < 7; ++i, side = other(side)) {
        feet.col(i) = next_foothold(feet.col(i - 1), side, 0.15, {0.1, 0.01, 0.1});
        feet(2, i) = 0.01 * i;
    }
    return feet;
}

Step some_step(double time, int ahead = 5, bool from_rest = false) {
    return {time, 0.2, 0.6, 0.2, 0.6, Side::right, ahead, from_rest};
}

TEST(Footsteps, FollowTheArcThatIntegrationGives) {
    // The body moves at constant velocity in its own axes; Euler's method with small steps is the reference.
    for (const Eigen::Vector3d& motion :
         {Eigen::Vector3d(0.1, 0.02, 0.3), Eigen::Vector3d(0.1, 0, -0.2), Eigen::Vector3d(0.2, -0.1, 1e-9)}) {
        const Foothold stance(1, 2, 0.1, 0.7);
        Eigen::Vector2d body = stance.head<2>() + Eigen::Rotation2Dd(stance[3]) * Eigen::Vector2d(0, -0.075);
        double yaw = stance[3];
        const int count = 200000;
        for (int i = 0; i < count; ++i) {
            body += Eigen::Rotation2Dd(yaw + motion[2] / 2 / count) * motion.head<2>() / count;
            yaw += motion[2] / count;
        }
        const Foothold next = next_foothold(stance, Side::left, 0.15, motion);
        const Eigen::Vector2d foot = body + Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(0, -0.075);
        EXPECT_LT((next.head<2>() - foot).norm(), 1e-9);
        EXPECT_NEAR(next[3], yaw, 1e-10);
        EXPECT_EQ(next[2], 0.1);
    }
}

TEST(Footsteps, MotionToAGoalEndsThere) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 100; ++i) {
        const Side side = i % 2 ? Side::left : Side::right;
        const Foothold stance(uniform(random), uniform(random), 0, 4 * uniform(random));
        const Eigen::Vector3d goal(uniform(random), uniform(random), 3 * uniform(random));
        const Foothold foot = next_foothold(stance, side, 0.2, motion_to(goal, stance, side, 0.2));
        const double outwards = side == Side::left ? -1 : 1;
        const Eigen::Vector2d body =
            foot.head<2>() - Eigen::Rotation2Dd(foot[3]) * Eigen::Vector2d(0, outwards * 0.1);
        EXPECT_LT((body - goal.head<2>()).norm(), 1e-12);
        EXPECT_NEAR(wrapped(foot[3] - goal[2]), 0, 1e-12);
    }
}

TEST(Footsteps, AreBroughtWithinReachAndFeetNeverCross) {
    const Reach reach{0.2, 0.1, 0.12, 0.3, 0.4, 0.1};
    std::mt19937 random(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 1000; ++i) {
        const Side side = i % 2 ? Side::left : Side::right;
        const double outwards = side == Side::left ? -1 : 1;
        const Foothold stance(uniform(random), uniform(random), 0, 3 * uniform(random));
        const Foothold wanted(uniform(random), uniform(random), 0.3, 3 * uniform(random));
        const Foothold got = within_reach(wanted, stance, side, reach);
        const Eigen::Vector2d xy = in_axes_of(stance, got);
        EXPECT_LE(xy.x(), 0.2 + 1e-12);
        EXPECT_GE(xy.x(), -0.1 - 1e-12);
        EXPECT_GE(outwards * xy.y(), 0.12 - 1e-12);
        EXPECT_LE(outwards * xy.y(), 0.3 + 1e-12);
        EXPECT_LE(outwards * (got[3] - stance[3]), 0.4 + 1e-12);
        EXPECT_GE(outwards * (got[3] - stance[3]), -0.1 - 1e-12);
        EXPECT_EQ(got[2], 0.3);
        EXPECT_LT((within_reach(got, stance, side, reach) - got).norm(), 1e-12) << "what is within stays";
    }
    EXPECT_FALSE((Reach{0.2, 0.1, 0.3, 0.2, 0, 0}).is_possible());
}

TEST(Footsteps, SettleOnTheGroundBesideItsEdges) {
    const Sole sole{-0.05, 0.1, -0.03, 0.03};
    Eigen::MatrixXd boxes(1, 6);
    boxes << 0.6, 0, 0.015, 0.3, 0.5, 0.015; // from x = 0.3 to 0.9
    const Ground ground(boxes);
    Foothold foot(0, 0, 0, 0);
    ASSERT_TRUE(ground.settle(foot, sole, 0.02, 0.2, 0.2));
    EXPECT_EQ(foot, Foothold(0, 0, 0, 0));
    foot = {0.5, 0.1, 0, 0};
    ASSERT_TRUE(ground.settle(foot, sole, 0.02, 0.2, 0.2));
    EXPECT_EQ(foot, Foothold(0.5, 0.1, 0.03, 0)); // on the box
    foot = {0.252, 0, 0, 0};                      // its toes would be on the edge: back to 0.3 - 0.1 - 0.02
    ASSERT_TRUE(ground.settle(foot, sole, 0.02, 0.2, 0.2));
    EXPECT_LT((foot - Foothold(0.177, 0, 0, 0)).norm(), 1e-9);
    foot = {0.332, 0, 0, 0}; // on the box it stands from 0.3 + 0.05 + 0.02
    ASSERT_TRUE(ground.settle(foot, sole, 0.02, 0.2, 0.2));
    EXPECT_LT((foot - Foothold(0.372, 0, 0.03, 0)).norm(), 1e-9);
    foot = {0.332, 0, 0, 0}; // not so far
    ASSERT_TRUE(ground.settle(foot, sole, 0.02, 0.2, 0.03));
    EXPECT_LT((foot - Foothold(0.177, 0, 0, 0)).norm(), 1e-9);
    foot = {0.25, 0, 0, 0};
    EXPECT_FALSE(ground.settle(foot, sole, 0.02, 0.05, 0.05));
    EXPECT_LT((foot - Foothold(0.25, 0, 0.03, 0)).norm(), 1e-12); // stays, on what is highest
    foot = {0.195, 0, 0, 0};
    EXPECT_FALSE(ground.settle(foot, sole, 0.02, 0.005, 0.005));
    EXPECT_EQ(foot, Foothold(0.195, 0, 0, 0)) << "the edge is near, but not below it";

    EXPECT_THROW(Ground(Eigen::MatrixXd::Ones(1, 5)), std::invalid_argument);
    boxes(0, 4) = -1;
    EXPECT_THROW(Ground{boxes}, std::invalid_argument);
}

TEST(Footsteps, AStepIsReadAsItWasWrittenAndNonsenseIsRefused) {
    Step step;
    ASSERT_TRUE(Step::read(some_step(0.3).numbers(), step));
    EXPECT_EQ(step.numbers(), some_step(0.3).numbers());
    for (const int i : {0, 1, 2, 3, 4, 5, 6}) {
        auto numbers = some_step(0.3).numbers();
        numbers[i] = -1;
        EXPECT_FALSE(Step::read(numbers, step)) << i;
        numbers[i] = std::nan("");
        EXPECT_FALSE(Step::read(numbers, step)) << i;
    }
    for (const int i : {6, 7}) { // a count and a truth
        auto numbers = some_step(0.3).numbers();
        numbers[i] = 0.5;
        EXPECT_FALSE(Step::read(numbers, step)) << i;
    }
}

TEST(Dcm, KeepsItsDynamicsAndIsContinuousOverAWholeWalk) {
    // xi_dot = omega (xi - r), differenced; and no jump from the end of one step to the beginning of the
    // next.
    const auto feet = some_footholds();
    const double dt = 1e-5;
    for (const bool from_rest : {true, false})
        for (double time = 0; time < 0.8 - 2 * dt; time += 0.0137) {
            const auto a = plan_dcm(feet, some_step(time, 5, from_rest), vrp, omega),
                       b = plan_dcm(feet, some_step(time + dt, 5, from_rest), vrp, omega);
            EXPECT_LT(((b.dcm - a.dcm) / dt - (a.velocity + b.velocity) / 2).norm(), 1e-6) << time;
            EXPECT_LT((a.velocity - omega * (a.dcm - a.vrp)).norm(), 1e-12);
            if (std::abs(time - 0.2) < 2 * dt) continue;
            EXPECT_LT((b.vrp - a.vrp).norm(), 3 * dt); // VRP, and so the velocity, have no jump either
        }
    const auto end = plan_dcm(feet, some_step(0.8), vrp, omega);
    Step second = some_step(0, 4);
    second.stance = Side::left;
    const auto begin = plan_dcm(feet.rightCols<6>(), second, vrp, omega);
    EXPECT_LT((end.dcm - begin.dcm).norm(), 1e-12);
    EXPECT_LT((end.velocity - begin.velocity).norm(), 1e-12);
}

TEST(Dcm, FollowedForwardsEachStepEndsWhereTheNextBeginsAndTheLastAtRest) {
    const auto feet = some_footholds();
    Eigen::Matrix4Xd rest = feet;
    Side side = Side::right;
    const double dt = 1e-4;
    for (int ahead = 5; ahead >= 0; --ahead, side = other(side)) {
        const auto plan = [&](double time) {
            return plan_dcm(rest, {time, 0.2, 0.6, 0.2, 0.6, side, ahead, ahead == 5}, vrp, omega);
        };
        Eigen::Vector3d xi = plan(0).dcm;
        for (int i = 0; i < 8000; ++i) { // the planned VRP alone, by Heun's method
            const Eigen::Vector3d k1 = omega * (xi - plan(i * dt).vrp),
                                  k2 = omega * (xi + dt * k1 - plan((i + 1) * dt).vrp);
            xi += dt / 2 * (k1 + k2);
        }
        EXPECT_LT((xi - plan(0.8).dcm).norm(), 1e-6) << ahead;
        if (ahead > 0) rest = Eigen::Matrix4Xd(rest.rightCols(rest.cols() - 1));
    }
    const Eigen::Vector3d midway =
        0.5 * (vrp.over(feet.col(5), Side::right) + vrp.over(feet.col(6), Side::left));
    const auto last = plan_dcm(rest, {0.3, 0.2, 0.6, 0.2, 0.6, Side::left, 0, false}, vrp, omega);
    EXPECT_LT((last.dcm - midway).norm(), 1e-12);
    EXPECT_EQ(last.velocity.norm(), 0);
}

TEST(Dcm, ZeroMomentPointStaysWithinTheSoles) {
    const auto feet = some_footholds();
    const Sole sole{-0.05, 0.1, -0.03, 0.03};
    Eigen::Matrix<double, 2, max_corners> corners;
    for (double time = 0; time < 0.8; time += 0.003) {
        const Step step = some_step(time);
        const int count = support_corners(feet, step, sole, corners);
        EXPECT_EQ(count, time < 0.2 ? 8 : 4);
        const Eigen::Vector2d p = plan_dcm(feet, step, vrp, omega).vrp.head<2>();
        EXPECT_LT((nearest_in_hull(corners, count, p) - p).norm(), 1e-12) << time;
    }
}

TEST(Dcm, ControlLetsTheErrorDecayByItsGain) {
    const DcmReference wanted{{0.1, 0.2, 0.5}, {0.3, -0.2, 0.1}, {0, 0, 0}};
    const Eigen::Vector3d xi(0.15, 0.17, 0.52);
    const Eigen::Vector3d r = follow_dcm(xi, wanted, 3.0, omega);
    EXPECT_LT((omega * (xi - r) - (wanted.velocity - 3.0 * (xi - wanted.dcm))).norm(), 1e-12);
}

TEST(Dcm, NearestPointOfAHullIsTheProjection) {
    // The reference is the best of many convex combinations of the corners.
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int run = 0; run < 50; ++run) {
        Eigen::Matrix<double, 2, max_corners> corners;
        for (int i = 0; i < 8; ++i) corners.col(i) = Eigen::Vector2d(uniform(random), uniform(random));
        const Eigen::Vector2d p = 1.5 * Eigen::Vector2d(uniform(random), uniform(random));
        const Eigen::Vector2d got = nearest_in_hull(corners, 8, p);
        // Optimality: no corner lies beyond `got` towards p; and `got` is within the hull, as no direction
        // separates it from all corners.
        for (int i = 0; i < 8; ++i) EXPECT_LE((corners.col(i) - got).dot(p - got), 1e-12);
        for (double angle = 0; angle < 2 * pi; angle += 0.05) {
            const Eigen::Vector2d n(std::cos(angle), std::sin(angle));
            EXPECT_LE(n.dot(got), (n.transpose() * corners).maxCoeff() + 1e-12);
        }
    }
    Eigen::Matrix<double, 2, max_corners> one = Eigen::Matrix<double, 2, max_corners>::Zero();
    EXPECT_EQ(nearest_in_hull(one, 1, {1, 1}), Eigen::Vector2d(0, 0));
    EXPECT_EQ(nearest_in_hull(one, 4, {1, 1}), Eigen::Vector2d(0, 0)); // all the same
}

TEST(Adjustment, MovesThePlanToWhereThePushHasMovedTheDcm) {
    // With soles without extent the shifted plan's DCM is the disturbed one, so that the walk goes on; also
    // where the foot lands at another time, whatever that costs.
    auto feet = some_footholds();
    for (const double cost : {infinity, 3.0, 0.5, 0.05})
        for (const double time : {0.25, 0.5, 0.79}) {
            const Step step = some_step(time);
            const auto before = plan_dcm(feet, step, vrp, omega);
            const Eigen::Vector2d local =
                in_axes_of(feet.col(1), Foothold(before.vrp.x(), before.vrp.y(), 0, 0));
            const Sole point{local.x(), local.x(), local.y(), local.y()};
            const Eigen::Vector2d error(0.02, -0.01), dcm = before.dcm.head<2>() + error;
            const auto change = adjust_step(dcm, before, feet.col(1), step, point, omega, cost);
            auto moved = feet;
            moved.rightCols<5>().topRows<2>().colwise() += change.shift;
            Step later = step;
            later.single_support += change.delay;
            const auto after = plan_dcm(moved, later, vrp, omega);
            EXPECT_LT((after.dcm.head<2>() - dcm).norm(), 1e-9) << time << ' ' << cost;
            EXPECT_EQ(change.delay == 0, cost == infinity);
        }
}

TEST(Adjustment, IsTheCheapestOfAllTimes) {
    // Every other time within the bounds, whose shift is that of a step which has this time already, is
    // dearer.
    const auto feet = some_footholds();
    const Sole sole{-0.02, 0.04, -0.01, 0.01};
    const Step step = some_step(0.35);
    const auto plan = plan_dcm(feet, step, vrp, omega);
    const double left = step.duration() - step.time;
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(-0.06, 0.06);
    int moved = 0, earlier = 0, later = 0;
    for (int i = 0; i < 200; ++i) {
        const Eigen::Vector2d dcm = plan.dcm.head<2>() + Eigen::Vector2d(uniform(random), uniform(random));
        const double cost = 0.4;
        const auto cost_of = [&](const Eigen::Vector2d& shift, double delay) {
            return shift.squaredNorm() + std::pow(cost / omega * std::expm1(omega * delay), 2);
        };
        const auto best = adjust_step(dcm, plan, feet.col(1), step, sole, omega, cost);
        EXPECT_LE(std::abs(best.delay), left / 2 + 1e-9);
        moved += best.shift.norm() > 1e-9 && std::abs(best.delay) > 1e-4;
        earlier += best.delay < -1e-3;
        later += best.delay > 1e-3;
        for (double delay = -left / 2; delay <= left / 2; delay += left / 100) {
            Step other = step;
            other.single_support += delay;
            const auto shift =
                adjust_step(dcm, plan_dcm(feet, other, vrp, omega), feet.col(1), other, sole, omega, infinity)
                    .shift;
            EXPECT_GE(cost_of(shift, delay), cost_of(best.shift, best.delay) - 1e-7) << i << ' ' << delay;
        }
    }
    EXPECT_GT(moved, 50) << "both change";
    EXPECT_GT(earlier, 20);
    EXPECT_GT(later, 10);
}

TEST(Adjustment, LeavesToTheAnklesWhatTheyCanDo) {
    const Foothold stance(0.2, -0.1, 0, 0.3);
    const Step step = some_step(0.4);
    const Eigen::Rotation2Dd R(0.3);
    const Sole sole{-0.05, 0.1, -0.03, 0.03};
    const double growth = std::exp(omega * 0.4);
    DcmReference wanted{{0.25, -0.08, 0.5}, {}, {0.2, -0.1, 0.5}};
    // A constant displacement d of the ZMP takes (growth - 1) d away from what e grows to.
    const Eigen::Vector2d most = (growth - 1) / growth * Eigen::Vector2d(0.1, 0.03);
    const auto change = [&](const Eigen::Vector2d& local, double cost) {
        auto done = adjust_step(wanted.dcm.head<2>() + R * local, wanted, stance, step, sole, omega, cost);
        done.shift = R.inverse() * done.shift;
        return done;
    };
    EXPECT_LT(change(0.999 * most, infinity).shift.norm(), 1e-12);
    EXPECT_LT(change(0.999 * most, 0.1).shift.norm(), 1e-12);
    EXPECT_EQ(change(0.999 * most, 0.1).delay, 0);
    EXPECT_GT(change(1.01 * most, infinity).shift.minCoeff(), 1e-4);
    EXPECT_LT(change({-0.0501 * (growth - 1) / growth, 0}, infinity).shift.x(), -1e-5);
    EXPECT_EQ(adjust_step({1, 1}, wanted, stance, some_step(0.1), sole, omega, 1).shift,
              Eigen::Vector2d(0, 0))
        << "on both feet";
}

TEST(Swing, BeginsAndEndsAtRestAndRisesToItsApex) {
    const Foothold from(0, 0.1, 0, 0.1), to(0.2, 0.12, 0.03, 0.4);
    const double T = 0.6;
    const auto at = [&](double t) {
        const Motion along = towards({from.head<3>(), {0, 0, 0}, {0, 0, 0}}, to.head<3>(), T, t);
        return swing(along, yaw_rotation(from[3]), yaw_rotation(to[3]), 0.05, 0.3, t, T);
    };
    EXPECT_LT((at(0).pose - pose_of(from)).norm(), 1e-12);
    EXPECT_LT((at(T).pose - pose_of(to)).norm(), 1e-12);
    for (const double t : {0.0, T}) {
        EXPECT_LT(at(t).velocity.norm(), 1e-12);
        EXPECT_LT(at(t).acceleration.norm(), 1e-12);
    }
    EXPECT_NEAR(at(T / 2).pose(2, 3), 0.05 + 0.015, 1e-12);
    EXPECT_NEAR(at(3 * T / 8).pose(2, 0), -std::sin(0.3), 1e-12) << "the x axis points down";
    // Velocities and accelerations are the differences of poses.
    const double h = 1e-5;
    for (double t = 0.05; t < T - 0.01; t += 0.07) {
        const SwingState a = at(t - h), b = at(t), c = at(t + h);
        EXPECT_LT(((c.pose - a.pose).topRightCorner<3, 1>() / (2 * h) - b.velocity.head<3>()).norm(), 1e-7);
        EXPECT_LT(((c.velocity - a.velocity) / (2 * h) - b.acceleration).norm(), 1e-6);
        const Eigen::Matrix3d W =
            (c.pose - a.pose).topLeftCorner<3, 3>() / (2 * h) * b.pose.topLeftCorner<3, 3>().transpose();
        EXPECT_LT((Eigen::Vector3d(W(2, 1), W(0, 2), W(1, 0)) - b.velocity.tail<3>()).norm(), 1e-7);
    }
}

TEST(Swing, ClimbsBeforeAndSinksBehindTheMiddle) {
    const double T = 0.6, h = 1e-5;
    for (const auto& [from, to] : {std::pair(0.1, 0.13), std::pair(0.13, 0.1)}) {
        const auto at = [from = from, to = to, T](double t) {
            Motion motion{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
            climb(motion, from, to, t, T);
            EXPECT_EQ(motion.position.head<2>(), Eigen::Vector2d(1, 2));
            return Eigen::Vector3d(motion.position.z(), motion.velocity.z(), motion.acceleration.z());
        };
        EXPECT_LT((at(0) - Eigen::Vector3d(from, 0, 0)).norm(), 1e-12);
        EXPECT_LT((at(T) - Eigen::Vector3d(to, 0, 0)).norm(), 1e-12);
        EXPECT_LT((at(T / 2) - Eigen::Vector3d(0.13, 0, 0)).norm(), 1e-12);
        for (double t = 0.03; t < T; t += 0.07) {
            EXPECT_NEAR((at(t + h)[0] - at(t - h)[0]) / (2 * h), at(t)[1], 1e-7);
            EXPECT_NEAR((at(t + h)[1] - at(t - h)[1]) / (2 * h), at(t)[2], 1e-5);
        }
    }
}

TEST(Swing, FollowedInPartsIsTheWayInOneAndMayChangeItsTarget) {
    const Eigen::Vector3d target(0.2, -0.1, 0.03);
    const double T = 0.6, dt = 0.005;
    Motion parts;
    for (int i = 0; i < 60; ++i) parts = towards(parts, target, T - i * dt, dt);
    const Motion whole = towards({}, target, T, 60 * dt);
    EXPECT_LT((parts.position - whole.position).norm(), 1e-12);
    EXPECT_LT((parts.velocity - whole.velocity).norm(), 1e-11);
    EXPECT_LT((parts.acceleration - whole.acceleration).norm(), 1e-9);
    EXPECT_NEAR(whole.position.x(), 0.1, 1e-12); // midway at half the time
    // To another target: position, velocity and acceleration go on, and it ends there.
    const Eigen::Vector3d other_target(0.3, 0, 0);
    const Motion now = towards(parts, other_target, T / 2, 0);
    EXPECT_LT((now.position - parts.position).norm() + (now.velocity - parts.velocity).norm() +
                  (now.acceleration - parts.acceleration).norm(),
              1e-9);
    const Motion almost = towards(parts, other_target, T / 2, T / 2 - 1e-9);
    EXPECT_LT((almost.position - other_target).norm() + almost.velocity.norm() + almost.acceleration.norm(),
              1e-5);
    EXPECT_EQ(towards(parts, other_target, 0, dt).position, other_target);
}

} // namespace
} // namespace bf::walking

#include "bf/trajectory/cartesian_trajectory.hpp"
#include "bf/trajectory/joint_trajectory.hpp"

#include <Eigen/Geometry>
#include <unsupported/Eigen/MatrixFunctions>

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace bf::trajectory::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Timing = JointTrajectory::Timing;
using Synchronisation = JointTrajectory::Synchronisation;
using Status = JointTrajectory::Status;
constexpr double infinity = std::numeric_limits<double>::infinity();

VectorXd some(Eigen::Index size, std::mt19937& random, double width = 1.0) {
    std::uniform_real_distribution<double> uniform(-width, width);
    return VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); });
}

Matrix4d some_pose(std::mt19937& random) {
    Matrix4d H = Matrix4d::Identity();
    H.topLeftCorner<3, 3>() = dynamics::rotation_exp(some(3, random, 1.5));
    H.topRightCorner<3, 1>() = some(3, random);
    return H;
}

JointTrajectory one_joint(Timing timing, double way, double v, double a, double j) {
    JointTrajectory motion(1, timing);
    motion.question.target << way;
    motion.question.max_velocity << v;
    motion.question.max_acceleration << a;
    motion.question.max_jerk << j;
    return motion;
}

struct Instant {
    VectorXd p, v, a;
    Instant(const JointTrajectory& of, double t) : p(of.question.target), v(p), a(p) { of.at(t, p, v, a); }
};

/// Largest factor by which limits are exceeded on the way, sampled; checks that velocities are rates.
double sampled_excess(const JointTrajectory& of) {
    double worst = 0.0;
    const double T = of.duration(), dt = 1e-5 * T;
    for (int k = 1; k < 400; ++k) {
        const double t = T * k / 400.0;
        const Instant now(of, t), after(of, t + dt), before(of, t - dt);
        EXPECT_LT(((after.p - before.p) / (2 * dt) - now.v).norm(), 1e-3 * (1.0 + now.v.norm()));
        worst = std::max({worst, now.v.cwiseAbs().cwiseQuotient(of.question.max_velocity).maxCoeff(),
                          now.a.cwiseAbs().cwiseQuotient(of.question.max_acceleration).maxCoeff()});
    }
    return worst;
}

/// Finite differences of a frame's motion.
void expect_rates(const CartesianTrajectory& along, double t) {
    const double dt = 1e-4;
    const FrameMotion now = along.at(t), after = along.at(t + dt), before = along.at(t - dt);
    const auto turn = [](const FrameMotion& to, const FrameMotion& from) {
        return dynamics::rotation_log(to.pose.topLeftCorner<3, 3>() *
                                      from.pose.topLeftCorner<3, 3>().transpose());
    };
    Vector6 velocity;
    velocity << (after.pose - before.pose).topRightCorner<3, 1>(), turn(after, before);
    EXPECT_LT((velocity / (2 * dt) - now.velocity).norm(), 1e-5 * (1.0 + now.acceleration.norm())) << t;
    EXPECT_LT(((after.velocity - before.velocity) / (2 * dt) - now.acceleration).norm(),
              1e-5 * (1.0 + 100.0 * now.acceleration.norm()))
        << t;
    EXPECT_LT(
        (now.pose.topLeftCorner<3, 3>() * now.pose.topLeftCorner<3, 3>().transpose() - Matrix3d::Identity())
            .norm(),
        1e-13);
}

} // namespace

TEST(Quintic, LeavesTheStartAndRestsAtTheTarget) {
    std::mt19937 random(1);
    for (int k = 0; k < 10; ++k) {
        const VectorXd s = some(4, random);
        const Quintic motion({s[0], s[1], s[2]}, s[3], 0.7);
        EXPECT_NEAR(motion.at(0.0).position, s[0], 1e-14);
        EXPECT_NEAR(motion.at(0.0).velocity, s[1], 1e-14);
        EXPECT_NEAR(motion.at(0.0).acceleration, s[2], 1e-13);
        const Motion end = motion.at(0.7 * (1 - 1e-12));
        EXPECT_NEAR(end.position, s[3], 1e-10);
        EXPECT_NEAR(end.velocity, 0.0, 1e-9);
        EXPECT_NEAR(end.acceleration, 0.0, 1e-8);
        EXPECT_EQ(motion.at(5.0).position, s[3]);
    }
}

TEST(Quintic, KnowsItsPeaks) {
    const Quintic::Peaks rest = Quintic({1.0, 0.0, 0.0}, 3.0, 2.0).peaks();
    EXPECT_NEAR(rest.velocity, 1.875, 1e-12);
    EXPECT_NEAR(rest.acceleration, 10.0 / std::sqrt(3.0) * 2.0 / 4.0, 1e-12);
    EXPECT_NEAR(rest.jerk, 60.0 * 2.0 / 8.0, 1e-12);
    // The jerk 30 x - 36 x² is largest within.
    EXPECT_NEAR(Quintic({0.0, 1.0, -3.0}, 0.15, 1.0).peaks().jerk, 6.25, 1e-12);
    std::mt19937 random(2);
    for (int k = 0; k < 50; ++k) {
        const VectorXd s = some(4, random, 2.0);
        const Quintic motion({s[0], s[1], s[2]}, s[3], 1.3);
        double v = 0.0, a = 0.0, j = 0.0;
        for (int i = 0; i < 4000; ++i) {
            const double t = 1.3 * i / 4000.0;
            v = std::max(v, std::abs(motion.at(t).velocity));
            a = std::max(a, std::abs(motion.at(t).acceleration));
            j = std::max(j, std::abs(motion.at(t + 1e-5).acceleration - motion.at(t).acceleration) / 1e-5);
        }
        const Quintic::Peaks peaks = motion.peaks();
        EXPECT_NEAR(peaks.velocity, v, 1e-5 * v);
        EXPECT_NEAR(peaks.acceleration, a, 1e-3 * a);
        EXPECT_NEAR(peaks.jerk, j, 1e-2 * j);
    }
}

TEST(JointTrajectory, TakesTheTimesThatAreKnown) {
    const auto time = [](Timing timing, double way, double v, double a, double j) {
        JointTrajectory motion = one_joint(timing, way, v, a, j);
        EXPECT_EQ(motion.plan(), Status::planned);
        return motion.duration();
    };
    const Timing fast = Timing::time_optimal, smooth = Timing::minimum_jerk;
    EXPECT_NEAR(time(fast, 3.0, 2.0, 4.0, infinity), 3.0 / 2.0 + 2.0 / 4.0, 1e-9) << "a trapezium";
    EXPECT_NEAR(time(fast, 0.25, 2.0, 4.0, infinity), 2.0 * std::sqrt(0.25 / 4.0), 1e-9) << "a triangle";
    EXPECT_NEAR(time(fast, 3.0, 2.0, 4.0, 40.0), 3.0 / 2.0 + 2.0 / 4.0 + 4.0 / 40.0, 1e-9) << "seven phases";
    EXPECT_NEAR(time(fast, -0.01, 2.0, 4.0, 40.0), 4.0 * std::cbrt(0.01 / 80.0), 1e-9) << "the jerk alone";
    EXPECT_NEAR(time(smooth, 3.0, 2.0, infinity, infinity), 1.875 * 3.0 / 2.0, 1e-12);
    EXPECT_NEAR(time(smooth, -3.0, infinity, 4.0, infinity), std::sqrt(10.0 / std::sqrt(3.0) * 3.0 / 4.0),
                1e-12);
    EXPECT_NEAR(time(smooth, 3.0, 20.0, 40.0, 40.0), std::cbrt(60.0 * 3.0 / 40.0), 1e-12);
    EXPECT_EQ(time(fast, 0.0, 1.0, 1.0, 1.0), 0.0);
    EXPECT_EQ(time(smooth, 0.0, 1.0, 1.0, 1.0), 0.0);
    JointTrajectory slow = one_joint(smooth, 1.0, infinity, infinity, infinity);
    slow.question.shortest = 2.5;
    EXPECT_EQ(slow.plan(), Status::planned);
    EXPECT_EQ(slow.duration(), 2.5);
}

TEST(JointTrajectory, KeepsItsLimitsFromRestAndArrives) {
    std::mt19937 random(3);
    for (const Timing timing : {Timing::time_optimal, Timing::minimum_jerk})
        for (int k = 0; k < 10; ++k) {
            JointTrajectory motion(5, timing);
            motion.question.position = some(5, random);
            motion.question.target = some(5, random);
            motion.question.max_velocity = VectorXd::Constant(5, 1.1) + some(5, random);
            motion.question.max_acceleration = VectorXd::Constant(5, 4.0) + some(5, random);
            motion.question.max_jerk.setConstant(50.0);
            ASSERT_EQ(motion.plan(), Status::planned);
            const double worst = sampled_excess(motion);
            EXPECT_LT(worst, 1.0 + 1e-9);
            EXPECT_GT(worst, 0.6) << "it is as fast as it may";
            const Instant nearly(motion, motion.duration() - 1e-9), end(motion, motion.duration());
            EXPECT_LT((nearly.p - motion.question.target).norm(), 1e-7);
            EXPECT_LT(nearly.v.norm(), 1e-5);
            EXPECT_EQ(end.p, motion.question.target);
        }
}

TEST(JointTrajectory, GoesOnFromAStateUnderWay) {
    std::mt19937 random(4);
    for (const Timing timing : {Timing::time_optimal, Timing::minimum_jerk})
        for (int k = 0; k < 20; ++k) {
            JointTrajectory motion(3, timing);
            motion.question.max_velocity.setConstant(2.0);
            motion.question.max_acceleration.setConstant(6.0);
            motion.question.max_jerk.setConstant(80.0);
            motion.question.target = some(3, random, 2.0);
            ASSERT_EQ(motion.plan(), Status::planned);
            const Instant turn(motion, 0.4 * motion.duration());
            motion.question.position = turn.p;
            motion.question.velocity = turn.v;
            motion.question.acceleration = turn.a;
            motion.question.target = some(3, random, 2.0);
            ASSERT_EQ(motion.plan(), Status::planned);
            const Instant start(motion, 0.0);
            EXPECT_LT((start.p - turn.p).norm() + (start.v - turn.v).norm() + (start.a - turn.a).norm(),
                      1e-9);
            const double worst = sampled_excess(motion);
            EXPECT_LT(worst, timing == Timing::time_optimal ? 1.0 + 1e-6 : 1.3);
        }
}

TEST(JointTrajectory, FollowsAMovingTargetInAnyUnit) {
    // Of powers of two nothing is rounded, so that the motions are the same.
    for (const double unit : {1.0, 57.3, 1000.0, 1024.0, 1e4, 1e6, 1e-6}) {
        JointTrajectory motion = one_joint(Timing::time_optimal, 0.0, 3.0 * unit, 20.0 * unit, 1000.0 * unit),
                        metres = one_joint(Timing::time_optimal, 0.0, 3.0, 20.0, 1000.0);
        const double period = 0.001;
        const auto follow = [&](JointTrajectory& of, double target) {
            of.question.target << target;
            const Status status = of.plan();
            of.at(period, of.question.position, of.question.velocity, of.question.acceleration);
            return status;
        };
        for (int k = 0; k < 7000; ++k) {
            const double target = 0.8 * std::sin(6.0 * k * period);
            ASSERT_EQ(follow(metres, target), Status::planned) << unit << ' ' << k;
            ASSERT_EQ(follow(motion, target * unit), Status::planned) << unit << ' ' << k;
            if (unit == 1024.0) {
                ASSERT_EQ(motion.question.position, unit * metres.question.position) << k;
            }
        }
        EXPECT_NEAR(motion.question.position[0] / unit, metres.question.position[0], 1e-4) << unit;
    }
    // Far from zero a motion is what it is near it.
    JointTrajectory far = one_joint(Timing::time_optimal, 1e7 + 1.0, 3.0, 20.0, 1000.0);
    far.question.position << 1e7;
    EXPECT_EQ(far.plan(), Status::planned);
    JointTrajectory near = one_joint(Timing::time_optimal, 1.0, 3.0, 20.0, 1000.0);
    EXPECT_EQ(near.plan(), Status::planned);
    EXPECT_EQ(far.duration(), near.duration());
}

TEST(JointTrajectory, BrakesWhereLimitsAreLoweredOnTheWay) {
    for (const double limit : {0.1, 0.01, 1e-6}) {
        JointTrajectory motion = one_joint(Timing::minimum_jerk, 3.0, limit, 5.0, 100.0);
        motion.question.position << 0.069;
        motion.question.velocity << 0.238;
        motion.question.acceleration << 0.497;
        ASSERT_EQ(motion.plan(), Status::planned);
        const Instant start(motion, 0.0), end(motion, motion.duration());
        EXPECT_NEAR(start.p[0], 0.069, 1e-12);
        EXPECT_NEAR(start.v[0], 0.238, 1e-12);
        EXPECT_NEAR(start.a[0], 0.497, 1e-12);
        EXPECT_EQ(end.p[0], 3.0);
        Instant before = start;
        for (double t = 1e-3; t < motion.duration(); t *= 1.02) {
            const Instant now(motion, t);
            EXPECT_LT(std::abs(now.v[0]), t < 1.0 ? 0.26 : limit * (1.0 + 1e-9)) << limit << ' ' << t;
            EXPECT_GT(now.p[0], 0.069);
            EXPECT_LT(now.p[0], 3.0 + 1e-9);
            EXPECT_NEAR(now.p[0] - before.p[0], 0.5 * (now.v + before.v)[0] * t * (1.0 - 1.0 / 1.02),
                        1e-3 + 1e-2 * std::abs(now.p[0] - before.p[0]));
            before = now;
        }
    }
    // An acceleration that is beyond its new limit is what it brakes with.
    JointTrajectory weak = one_joint(Timing::minimum_jerk, 3.0, 1.0, 1e-5, 100.0);
    weak.question.velocity << 0.238;
    weak.question.acceleration << 0.497;
    ASSERT_EQ(weak.plan(), Status::planned);
    for (double t = 1e-3; t < weak.duration(); t *= 1.02) {
        const Instant now(weak, t);
        EXPECT_LT(std::abs(now.v[0]), 1.0);
        EXPECT_LT(now.p[0], 3.0 + 1e-9);
    }
}

TEST(JointTrajectory, TurnsRoundWithoutGoingAstray) {
    JointTrajectory motion = one_joint(Timing::minimum_jerk, 3.0, 1.0, 5.0, 100.0);
    ASSERT_EQ(motion.plan(), Status::planned);
    const Instant turn(motion, 2.0);
    motion.question.position = turn.p;
    motion.question.velocity = turn.v;
    motion.question.acceleration = turn.a;
    motion.question.target << -3.0;
    ASSERT_EQ(motion.plan(), Status::planned);
    for (double t = 0.0; t < motion.duration(); t += 0.01) {
        const Instant now(motion, t);
        EXPECT_LT(now.p[0], 3.0) << t;
        EXPECT_LT(std::abs(now.v[0]), 1.0 + 1e-6) << t;
    }
}

TEST(JointTrajectory, SynchronisesAsItIsAsked) {
    const auto along = [](Synchronisation how, double part) {
        JointTrajectory motion(2, Timing::time_optimal, how);
        motion.question.target << 2.0, 0.5;
        motion.question.max_jerk.setConstant(30.0);
        EXPECT_EQ(motion.plan(), Status::planned);
        return Instant(motion, part * motion.duration());
    };
    EXPECT_NEAR(along(Synchronisation::none, 0.7).p[1], 0.5, 1e-9);
    EXPECT_LT(along(Synchronisation::time, 0.7).p[1], 0.49);
    for (const double part : {0.1, 0.3, 0.8}) {
        const Instant now = along(Synchronisation::phase, part);
        EXPECT_NEAR(now.p[1], 0.25 * now.p[0], 1e-9);
    }
}

TEST(JointTrajectory, StaysOnTheLineWithLimitsOfWhichNoneIsTheTightestOfAll) {
    JointTrajectory motion(2, Timing::time_optimal, Synchronisation::phase);
    motion.question.target << 1.0, 1.0;
    motion.question.max_velocity << 1.0, 0.5;
    motion.question.max_acceleration << 2.0, 5.0;
    motion.question.max_jerk.setConstant(50.0);
    ASSERT_EQ(motion.plan(), Status::planned);
    EXPECT_NEAR(motion.duration(), 1.0 / 0.5 + 0.5 / 2.0 + 2.0 / 50.0, 1e-9) << "0.5, 2 and 50 count";
    EXPECT_LT(sampled_excess(motion), 1.0 + 1e-9);

    std::mt19937 random(8);
    for (int k = 0; k < 50; ++k) {
        JointTrajectory any(4, Timing::time_optimal, Synchronisation::phase);
        auto& q = any.question;
        const double unit = std::pow(1000.0, k % 3);
        q.position = some(4, random, unit);
        const VectorXd direction = some(4, random, unit);
        q.target = q.position + direction;
        for (VectorXd* limits : {&q.max_velocity, &q.max_acceleration, &q.max_jerk})
            *limits = unit * (some(4, random).array() + 1.5).matrix();
        // Then under way on the same line: to twice as far, and back to where it began.
        const VectorXd begin = q.position;
        for (const double end : {2.0, 0.0}) {
            ASSERT_EQ(any.plan(), Status::planned);
            EXPECT_LT(sampled_excess(any), 1.0 + 1e-6);
            for (double t = 0.0; t < any.duration(); t += 0.01 * any.duration()) {
                const Instant now(any, t);
                const double part = (now.p - begin).dot(direction) / direction.squaredNorm();
                ASSERT_LT((now.p - begin - part * direction).norm(), 1e-7 * unit) << k << ' ' << t;
            }
            const Instant turn(any, 0.4 * any.duration());
            q.position = turn.p;
            q.velocity = turn.v;
            q.acceleration = turn.a;
            q.target = begin + end * direction;
        }
    }
}

TEST(JointTrajectory, HasALineOfAnyLength) {
    for (const double way : {1e-320, 1e-300, 1e-100, 1e-12, 1e-3, 1e3}) {
        JointTrajectory motion(2, Timing::time_optimal, Synchronisation::phase);
        motion.question.target << way, 2.0 * way;
        ASSERT_EQ(motion.plan(), Status::planned) << way;
        EXPECT_TRUE(std::isfinite(motion.duration()));
        const Instant midway(motion, 0.5 * motion.duration());
        EXPECT_LE(std::abs(midway.p[1] - 2.0 * midway.p[0]), 1e-9 * way) << way;
    }
}

TEST(JointTrajectory, ArrivesTogetherWhereTheStartIsOnNoLine) {
    for (const auto how : {Synchronisation::phase, Synchronisation::time}) {
        JointTrajectory motion(2, Timing::time_optimal, how);
        motion.question.target << 1.0, 0.5;
        motion.question.velocity << 0.1, 0.9;
        ASSERT_EQ(motion.plan(), Status::planned);
        JointTrajectory same(2, Timing::time_optimal);
        same.question = motion.question;
        ASSERT_EQ(same.plan(), Status::planned);
        for (const double t : {0.2, 0.5, 1.0}) EXPECT_EQ(Instant(motion, t).p, Instant(same, t).p);
    }
}

TEST(JointTrajectory, TellsWhatIsNoQuestion) {
    for (const Timing timing : {Timing::time_optimal, Timing::minimum_jerk}) {
        JointTrajectory motion = one_joint(timing, NAN, 1.0, 1.0, 1.0);
        EXPECT_EQ(motion.plan(), Status::not_finite);
        motion.question.target << 1.0;
        motion.question.max_jerk << 0.0;
        EXPECT_EQ(motion.plan(), Status::bad_limits);
        motion.question.max_jerk << infinity;
        motion.question.max_acceleration << infinity;
        motion.question.max_velocity << infinity;
        EXPECT_EQ(motion.plan(), Status::bad_limits);
    }
    EXPECT_EQ(one_joint(Timing::time_optimal, 1e300, 1.0, 1.0, 1.0).plan(), Status::not_found);
    EXPECT_EQ(one_joint(Timing::minimum_jerk, 1e155, 1.0, 1.0, 1.0).plan(), Status::not_found);
    EXPECT_EQ(one_joint(Timing::time_optimal, 1.0, 1.0, infinity, 1.0).plan(), Status::bad_limits);
    EXPECT_THROW(JointTrajectory(0, Timing::time_optimal), std::invalid_argument);
}

TEST(CartesianTrajectory, MovesFromRestAlongTheGeodesics) {
    std::mt19937 random(5);
    for (int k = 0; k < 10; ++k) {
        FrameMotion start;
        start.pose = some_pose(random);
        const Matrix4d target = some_pose(random);
        const CartesianTrajectory straight(start, target, CartesianTrajectory::Path::straight, 1.5),
            screw(start, target, CartesianTrajectory::Path::screw, 1.5);
        const Matrix4d twist = Matrix4d(start.pose.inverse() * target).log();
        for (const double t : {0.0, 0.3, 0.8, 1.4}) {
            const double part = Quintic({}, 1.0, 1.5).at(t).position;
            const Matrix4d on_screw = start.pose * Matrix4d(part * twist).exp();
            EXPECT_LT((screw.at(t).pose - on_screw).norm(), 1e-10) << t;
            const Matrix3d between =
                Eigen::Quaterniond(Matrix3d(start.pose.topLeftCorner<3, 3>()))
                    .slerp(part, Eigen::Quaterniond(Matrix3d(target.topLeftCorner<3, 3>())))
                    .toRotationMatrix();
            const Vector3d on_line =
                (1.0 - part) * start.pose.topRightCorner<3, 1>() + part * target.topRightCorner<3, 1>();
            EXPECT_LT((straight.at(t).pose.topLeftCorner<3, 3>() - between).norm(), 1e-10) << t;
            EXPECT_LT((straight.at(t).pose.topRightCorner<3, 1>() - on_line).norm(), 1e-12) << t;
            if (t > 0.0) expect_rates(straight, t);
            if (t > 0.0) expect_rates(screw, t);
        }
        EXPECT_EQ(screw.at(1.5).pose, target);
        EXPECT_EQ(screw.at(9.0).velocity.norm(), 0.0);
    }
}

TEST(CartesianTrajectory, GoesOnFromAMotionWithoutAJump) {
    std::mt19937 random(6);
    for (const auto path : {CartesianTrajectory::Path::straight, CartesianTrajectory::Path::screw})
        for (int k = 0; k < 10; ++k) {
            FrameMotion start;
            start.pose = some_pose(random);
            start.velocity = some(6, random, 2.0);
            start.acceleration = some(6, random, 5.0);
            const Matrix4d target = some_pose(random);
            const CartesianTrajectory along(start, target, path, 0.8);
            const FrameMotion now = along.at(0.0), end = along.at(0.8 * (1 - 1e-9));
            EXPECT_LT((now.pose - start.pose).norm(), 1e-12);
            EXPECT_LT((now.velocity - start.velocity).norm(), 1e-11);
            EXPECT_LT((now.acceleration - start.acceleration).norm(), 1e-10);
            EXPECT_LT((end.pose - target).norm() + end.velocity.norm() + end.acceleration.norm(), 1e-5);
            for (const double t : {0.1, 0.4, 0.7}) expect_rates(along, t);
        }
}

TEST(CartesianTrajectory, KnowsTheTimeThatSpeedsNeed) {
    FrameMotion start;
    Matrix4d target = Matrix4d::Identity();
    target(0, 3) = 0.6;
    target.topLeftCorner<3, 3>() = dynamics::rotation_exp({0.0, 0.0, 1.0});
    const double T = CartesianTrajectory::shortest(start.pose, target, 0.5, 4.0);
    EXPECT_NEAR(T, 1.875 * 0.6 / 0.5, 1e-12);
    EXPECT_NEAR(CartesianTrajectory::shortest(start.pose, target, infinity, 4.0), 1.875 / 4.0, 1e-12);
    const CartesianTrajectory along(start, target, CartesianTrajectory::Path::straight, T);
    EXPECT_NEAR(along.at(0.5 * T).velocity.norm(), std::hypot(0.5, 1.875 / T), 1e-12);
}

} // namespace bf::trajectory::test

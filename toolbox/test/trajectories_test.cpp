#include "running.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

namespace bf::toolbox::test {
namespace {

std::string joints_move(const std::string& settings, bool has_initial = true,
                        const std::string& limits = "max_velocity: [1 2], max_acceleration: 4") {
    return "model: m\nstep: 0.01\ninputs: {target: {shape: 2}, start: {shape: 2}}\nblocks:\n  way: {block: "
           "WholeBodyToolbox/JointTrajectory, " +
           limits + settings +
           "}\n  end: {block: Terminator}\nconnections:\n  target: way.target\n  start: [end" +
           (has_initial ? ", way.initial" : "") + "]\n";
}

std::string frame_moves(const std::string& settings) {
    return "model: m\nstep: 0.01\ninputs: {target: {shape: \"[4 4]\"}, start: {shape: \"[4 4]\"}}\nblocks:\n "
           " way: "
           "{block: WholeBodyToolbox/CartesianTrajectory" +
           settings + "}\nconnections:\n  target: way.w_H_target\n  start: way.w_H_0\n";
}

Transform turned(double x, double angle) {
    Transform H = Transform::Identity();
    H.topLeftCorner<3, 3>() = Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix();
    H(0, 3) = x;
    return H;
}

} // namespace

TEST(JointTrajectoryBlock, GoesToTargetsThatChangeOnTheWayWithinItsLimits) {
    for (const std::string timing : {"time_optimal", "minimum_jerk"}) {
        SCOPED_TRACE(timing);
        Running run(joints_move(", max_jerk: 60, timing: " + timing));
        run.set("start", Eigen::Vector2d(0.2, -0.1)).set("target", Eigen::Vector2d(1.2, 0.5));
        Matrix last;
        for (int k = 0; k < 800; ++k) {
            if (k == 40) run.set("target", Eigen::Vector2d(-1, 1));
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            const Matrix p = run.get("way.position"), v = run.get("way.velocity");
            if (k == 0) {
                EXPECT_EQ(p, Matrix(Eigen::Vector2d(0.2, -0.1)));
            } else {
                EXPECT_LT((p - last - 0.01 * v).cwiseAbs().maxCoeff(), 0.5 * 0.01 * 0.01 * 4.8) << k;
            }
            const double allowed = timing == "time_optimal" ? 1 + 1e-9 : 1.15;
            EXPECT_LE(std::abs(v(0, 0)), allowed) << k;
            EXPECT_LE(std::abs(v(1, 0)), 2 * allowed) << k;
            last = p;
        }
        EXPECT_LT((last - Eigen::Vector2d(-1, 1)).norm(), 1e-12);
        EXPECT_EQ(run.get("way.velocity").norm(), 0);
        EXPECT_EQ(run.scalar("way.remaining"), 0);
    }
}

TEST(JointTrajectoryBlock, TakesTheTimeOfItsSlowestJoint) {
    Running run(joints_move(", max_jerk: inf"));
    run.set("target", Eigen::Vector2d(1, 0.1));
    ASSERT_TRUE(run.step());
    EXPECT_NEAR(run.scalar("way.remaining"), 1.0 / 1.0 + 1.0 / 4.0, 1e-9);
    ASSERT_TRUE(run.step());
    EXPECT_NEAR(run.scalar("way.remaining"), 1.24, 1e-9);
    Running slow(joints_move(", max_jerk: inf, shortest: 3"));
    slow.set("target", Eigen::Vector2d(1, 0.1));
    ASSERT_TRUE(slow.step());
    EXPECT_NEAR(slow.scalar("way.remaining"), 3, 1e-9);
}

TEST(JointTrajectoryBlock, RestsAtTheTargetWhereItHasNoStart) {
    Running run(joints_move("", false));
    run.set("target", Eigen::Vector2d(1, 0.1));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("way.position"), Matrix(Eigen::Vector2d(1, 0.1)));
    EXPECT_EQ(run.scalar("way.remaining"), 0);
}

TEST(JointTrajectoryBlock, NamesOnlyRemediesThatThereAre) {
    const auto says = [](const std::string& settings) {
        Running run(joints_move(settings, true, "max_velocity: Inf, max_acceleration: Inf, max_jerk: Inf"));
        run.set("target", Eigen::Vector2d(1, 1));
        return run.step() ? "" : run.simulation.failure();
    };
    EXPECT_EQ(says(""),
              "way: the limits allow no time: velocities must be finite, and accelerations too where "
              "jerks are");
    EXPECT_EQ(says(", shortest: 1"), says(""));
    EXPECT_EQ(says(", timing: minimum_jerk"), "way: the limits allow no time, as all are infinite; give one "
                                              "that is finite, or a shortest time");
    EXPECT_EQ(says(", timing: minimum_jerk, shortest: 1"), "");
}

TEST(JointTrajectoryBlock, StopsAtWhatIsNoTarget) {
    Running run(joints_move(""));
    run.set("target", Eigen::Vector2d(1, std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "way: target");
    Running endless(joints_move(", max_jerk: inf, timing: minimum_jerk", true,
                                "max_velocity: inf, max_acceleration: inf"));
    endless.set("target", Eigen::Vector2d(1, 1));
    EXPECT_FALSE(endless.step());
    expect_contains(endless.simulation.failure(), "way: the limits allow no time");
    expect_contains(refusal(joints_move(", max_jerk: 0")), "max_jerk");
}

TEST(CartesianTrajectoryBlock, GoesToPosesThatChangeOnTheWayWithoutAJump) {
    for (const std::string path : {"straight", "screw"}) {
        SCOPED_TRACE(path);
        Running run(frame_moves(", duration: 1, path: " + path));
        run.set("start", turned(0, 0.2)).set("target", turned(0.5, -1));
        Matrix last, last_v, last_a;
        for (int k = 0; k < 160; ++k) {
            if (k == 50) run.set("target", turned(-0.3, 1));
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            const Matrix H = run.get("way.w_H"), v = run.get("way.v"), a = run.get("way.a");
            if (k == 0) {
                EXPECT_LT((H - turned(0, 0.2)).norm(), 1e-12);
            }
            if (k > 0) {
                EXPECT_LT(
                    (H.topRightCorner(3, 1) - last.topRightCorner(3, 1) - 0.005 * (v + last_v).topRows(3))
                        .norm(),
                    5e-5)
                    << k;
                EXPECT_LT((v - last_v - 0.005 * (a + last_a)).norm(), 0.02) << k;
            }
            last = H;
            last_v = v;
            last_a = a;
        }
        EXPECT_EQ(last, Matrix(turned(-0.3, 1)));
        EXPECT_EQ(last_v.norm() + last_a.norm(), 0);
        EXPECT_EQ(run.scalar("way.remaining"), 0);
    }
}

TEST(CartesianTrajectoryBlock, TakesLongerWhereSpeedsNeedIt) {
    Running run(frame_moves(", duration: 0.1, max_speed: 0.25, max_angular_speed: 1"));
    run.set("start", turned(0, 0)).set("target", turned(0.5, 0));
    ASSERT_TRUE(run.step());
    EXPECT_NEAR(run.scalar("way.remaining"), 1.875 * 0.5 / 0.25, 1e-12);
    double fastest = 0;
    for (int k = 0; k < 380; ++k) {
        ASSERT_TRUE(run.step());
        fastest = std::max(fastest, run.get("way.v").norm());
    }
    EXPECT_NEAR(fastest, 0.25, 1e-5);
}

TEST(CartesianTrajectoryBlock, StopsAtPosesThatAreNone) {
    Running run(frame_moves(""));
    run.set("start", turned(0, 0)).set("target", Matrix::Zero(4, 4));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "way: w_H_target holds no rotation");
}

} // namespace bf::toolbox::test

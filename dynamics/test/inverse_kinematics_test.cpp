#include "bf/dynamics/inverse_kinematics.hpp"
#include "robots.hpp"

#include <gtest/gtest.h>
#include <iDynTree/EigenHelpers.h>
#include <iDynTree/KinDynComputations.h>
#include <iDynTree/ModelLoader.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <unistd.h>

namespace bf::dynamics::test {
namespace {

using Kind = Target::Kind;
using Status = InverseKinematics::Status;
constexpr double pi = std::numbers::pi;

/// Two links of 0.5 and 0.3 m in the x-y plane; the elbow bends one way, and both joints turn 1 rad/s at
/// most.
std::string planar_arm() {
    const std::string path = "/tmp/bf_planar_arm_" + std::to_string(getpid()) + ".urdf";
    const std::string inertial =
        "<inertial><origin xyz='0.25 0 0'/><mass value='1'/>"
        "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    std::ofstream(path) << "<robot name='arm'><link name='base'/><link name='upper'>" << inertial
                        << "<link name='lower'>" << inertial
                        << "<link name='tip'/><joint name='shoulder' type='revolute'><parent "
                           "link='base'/><child link='upper'/>"
                           "<axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>"
                           "<joint name='elbow' type='revolute'><parent link='upper'/><child "
                           "link='lower'/><origin xyz='0.5 0 0'/>"
                           "<axis xyz='0 0 1'/><limit lower='0' upper='2.5' effort='1' velocity='1'/></joint>"
                           "<joint name='end' type='fixed'><parent link='lower'/><child link='tip'/><origin "
                           "xyz='0.3 0 0'/></joint>"
                           "</robot>";
    return path;
}

Target target(const Model& model, Kind kind, const std::string& frame, const Eigen::Vector3d& p = {0, 0, 0}) {
    Target wanted;
    wanted.kind = kind;
    if (kind != Kind::center_of_mass) wanted.frame = model.frame(frame);
    wanted.pose.topRightCorner<3, 1>() = p;
    return wanted;
}

Eigen::VectorXd random_posture(const Model& model, std::mt19937& random) {
    const Eigen::VectorXd low = model.position_min().cwiseMax(-pi), high = model.position_max().cwiseMin(pi);
    const Eigen::VectorXd unit = 0.5 * (random_vector(low.size(), random).array() + 1.0);
    return low + unit.cwiseProduct(high - low);
}

Eigen::Matrix4d pose_at(const Model& model, const Eigen::VectorXd& s, Frame frame) {
    Data data(model);
    Eigen::Matrix4d H;
    set_position(model, data, Eigen::Matrix4d::Identity(), s);
    forward_kinematics(model, data, frame, H);
    return H;
}

Eigen::Vector3d position(const Eigen::Matrix4d& H) { return H.topRightCorner<3, 1>(); }
Eigen::Matrix3d rotation(const Eigen::Matrix4d& H) { return H.topLeftCorner<3, 3>(); }

bool is_within_limits(const Model& model, const Eigen::VectorXd& s) {
    return (s.array() >= model.position_min().array()).all() &&
           (s.array() <= model.position_max().array()).all();
}

/// The arm, its tip wanted at a point.
class PlanarArm : public testing::Test {
  protected:
    Status search(double x, double y, int restarts = 0) {
        ik.targets[0].pose.topRightCorner<3, 1>() << x, y, 0.0;
        return ik.search(base, s, restarts);
    }
    Status follow(double x, double y) {
        ik.targets[0].pose.topRightCorner<3, 1>() << x, y, 0.0;
        return ik.follow(base, s);
    }

    Model model = Model::load(planar_arm(), {}, {0.0, 0.0, -9.81}, {}, false);
    InverseKinematics ik{model, {target(model, Kind::position, "tip")}, false, {}};
    Eigen::Matrix4d base = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s = Eigen::Vector2d(0.3, 0.5);
};

/// The chain with most joints of a robot on a fixed base: how many random poses of its end, one of `trials`
/// postures within the limits each, are not found from the middle of the limits.
int missed(const Model& model, int trials, std::mt19937& random) {
    Data data(model);
    Matrix6X J(6, model.joints());
    Frame end;
    Eigen::Index longest = 0;
    for (int i = 0; i < static_cast<int>(model.frame_names().size()); ++i) {
        jacobian(model, data, Frame{i}, J);
        const auto length = (J.colwise().norm().array() > 0.0).count();
        if (length > longest) longest = length, end = Frame{i};
    }
    InverseKinematics ik(model, {{Kind::pose, end}}, false, {});
    int count = 0;
    for (int k = 0; k < trials; ++k) {
        ik.targets[0].pose = pose_at(model, random_posture(model, random), end);
        Eigen::VectorXd s = 0.5 * (model.position_min().cwiseMax(-pi) + model.position_max().cwiseMin(pi));
        Eigen::Matrix4d base = Eigen::Matrix4d::Identity();
        const bool reached = ik.search(base, s, 50) == Status::reached;
        EXPECT_TRUE(is_within_limits(model, s));
        EXPECT_TRUE(!reached || (pose_at(model, s, end) - ik.targets[0].pose).cwiseAbs().maxCoeff() < 2e-6);
        count += !reached;
    }
    return count;
}

} // namespace

/// cos(elbow) = (x² + y² - l1² - l2²) / (2 l1 l2)
TEST_F(PlanarArm, FindsTheAnglesOfTheLawOfCosines) {
    std::mt19937 random(1);
    for (int k = 0; k < 200; ++k) {
        const double elbow = 0.3 + 2.1 * k / 200.0, shoulder = 2.9 * random_vector(1, random)[0];
        const Eigen::Vector2d p(0.5 * std::cos(shoulder) + 0.3 * std::cos(shoulder + elbow),
                                0.5 * std::sin(shoulder) + 0.3 * std::sin(shoulder + elbow));
        s << 0.0, 1.0;
        ASSERT_EQ(search(p.x(), p.y(), 50), Status::reached);
        EXPECT_NEAR(s[1], std::acos((p.squaredNorm() - 0.34) / 0.3), 2e-5);
        EXPECT_NEAR(s[0], shoulder, 2e-5);
        EXPECT_LE(ik.error().topRows<3>().norm(), 1e-6);
    }
}

TEST_F(PlanarArm, StretchesTowardsWhatIsOutOfReach) {
    ASSERT_EQ(search(0.6, 0.9), Status::least_error);
    EXPECT_NEAR(s[0], std::atan2(0.9, 0.6), 1e-4);
    EXPECT_NEAR(s[1], 0.0, 1e-4);
    EXPECT_NEAR(ik.error().topRows<3>().norm(), std::hypot(0.6, 0.9) - 0.8, 1e-8);
    EXPECT_NEAR(ik.error()(0, 0) / ik.error()(1, 0), 0.6 / 0.9, 1e-3);
}

TEST_F(PlanarArm, LeavesTheLeastErrorThatTheLimitsAllow) {
    std::mt19937 random(2);
    for (int k = 0; k < 30; ++k) {
        const Eigen::Vector2d p = random_vector(2, random);
        s << 0.3, 0.5;
        search(p.x(), p.y(), 50);
        double least = 1e9; // of a grid
        for (double a = -3.0; a <= 3.0; a += 0.01)
            for (double b = 0.0; b <= 2.5; b += 0.01)
                least = std::min(least, std::hypot(0.5 * std::cos(a) + 0.3 * std::cos(a + b) - p.x(),
                                                   0.5 * std::sin(a) + 0.3 * std::sin(a + b) - p.y()));
        EXPECT_LE(ik.error().topRows<3>().norm(), least + 1e-6) << p.transpose();
        EXPECT_GE(ik.error().topRows<3>().norm(), least - 0.01);
        EXPECT_TRUE(is_within_limits(model, s));
    }
}

TEST_F(PlanarArm, BendsOutOfASingularPosture) {
    s << 0.0, 0.0; // the target is along the stretched arm, where no joint moves the tip
    EXPECT_EQ(search(0.5, 0.0), Status::reached);
    EXPECT_GT(s[1], 0.5);
}

TEST_F(PlanarArm, ComesBackFromOutOfReachWithoutAJump) {
    search(0.6, 0.0);
    ik.reach.setConstant(0.05);
    double largest = 0.0;
    for (int k = 0; k <= 1000; ++k) {
        const double x = 0.8 - 0.2 * std::cos(2.0 * pi * k / 1000.0); // from 0.6 to 1.0 and back
        const Eigen::VectorXd before = s;
        follow(x, 0.0);
        largest = std::max(largest, (s - before).cwiseAbs().maxCoeff());
        // The elbow opens as fast as it may where the tip leaves the edge of its reach.
        const double left = std::max(0.0, x - 0.8);
        EXPECT_NEAR(ik.error().topRows<3>().norm(), left, 2e-3) << x;
    }
    EXPECT_LE(largest, 0.05 + 1e-12);
}

TEST_F(PlanarArm, FollowsNoFasterThanItsReach) {
    search(0.6, 0.0);
    ik.reach << 0.01, 0.02;
    int steps = 0;
    for (; steps < 1000; ++steps) {
        const Eigen::VectorXd before = s;
        if (follow(-0.3, 0.4) == Status::reached) break;
        EXPECT_LE(std::abs(s[0] - before[0]), 0.01 + 1e-12);
        EXPECT_LE(std::abs(s[1] - before[1]), 0.02 + 1e-12);
    }
    EXPECT_GT(steps, 100);
    EXPECT_LT(steps, 400);
}

TEST_F(PlanarArm, FollowsAMovingTargetInTwoOrThreeSteps) {
    search(0.6, 0.0);
    for (int k = 0; k < 1000; ++k) {
        const double angle = 2.0 * pi * k / 1000.0;
        ASSERT_EQ(follow(0.5 + 0.1 * std::cos(angle), 0.1 * std::sin(angle)), Status::reached);
        ASSERT_LE(ik.iterations(), 3);
    }
}

/// Two targets of one frame that contradict each other meet at their weighted mean.
TEST_F(PlanarArm, WeighsTargetsThatContradictEachOther) {
    InverseKinematics both(model,
                           {target(model, Kind::position, "tip", {0.4, 0.3, 0.0}),
                            target(model, Kind::position, "tip", {0.5, 0.1, 0.0})},
                           false, {});
    both.targets[0].weight = 3.0;
    EXPECT_EQ(both.search(base, s, 0), Status::least_error);
    EXPECT_LT((position(pose_at(model, s, model.frame("tip"))) - Eigen::Vector3d(0.425, 0.25, 0.0)).norm(),
              1e-5);
    both.targets[0].weight = 0.0;
    EXPECT_EQ(both.search(base, s, 0), Status::reached) << "what weighs nothing is not wanted";
    EXPECT_NEAR(both.error().col(0).norm(), std::hypot(0.1, 0.2), 1e-5) << "and its error still told";
    both.targets[1].weight = 0.0;
    const Eigen::VectorXd before = s;
    EXPECT_EQ(both.search(base, s, 5), Status::reached);
    EXPECT_EQ(s, before) << "nothing is wanted";
}

TEST_F(PlanarArm, TakesThePostureAsFarAsTheLimitsAllow) {
    InverseKinematics alone(model, {}, false, {});
    alone.posture << 0.7, -1.0;
    alone.posture_weights << 1.0, 2.0;
    EXPECT_EQ(alone.search(base, s, 0), Status::reached);
    EXPECT_NEAR(s[0], 0.7, 1e-5);
    EXPECT_EQ(s[1], 0.0);
}

TEST_F(PlanarArm, BeginsWithinTheLimits) {
    s << 9.0, -9.0;
    search(0.5, 0.3);
    EXPECT_TRUE(is_within_limits(model, s));
}

TEST_F(PlanarArm, StopsAtItsLimitOfIterations) {
    InverseKinematics one(model, {target(model, Kind::position, "tip", {-0.3, 0.4, 0.0})}, false, {1, 1e-6});
    EXPECT_EQ(one.search(base, s, 0), Status::iteration_limit);
    EXPECT_EQ(one.iterations(), 1);
    one.search(base, s, 3);
    EXPECT_LE(one.iterations(), 4);
}

/// Both soles stay, the hand goes to a pose and the centre of mass over the feet; iDynTree says whether.
TEST(InverseKinematics, MovesAFloatingRobotWithItsContactsAndItsCentreOfMass) {
    const Model model = Model::load(icub, icub_joints);
    std::vector<Target> targets = {target(model, Kind::pose, "l_sole"), target(model, Kind::pose, "r_sole"),
                                   target(model, Kind::position, "r_hand"),
                                   target(model, Kind::orientation, "chest"),
                                   target(model, Kind::center_of_mass, {})};
    const Eigen::VectorXd home = Eigen::VectorXd::Zero(model.joints());
    targets[0].pose = pose_at(model, home, targets[0].frame);
    targets[1].pose = pose_at(model, home, targets[1].frame);
    targets[2].pose = pose_at(model, home, targets[2].frame);
    targets[2].pose.topRightCorner<3, 1>() += Eigen::Vector3d(-0.1, -0.05, 0.1); // forward of the iCub is -x
    targets[3].pose.topLeftCorner<3, 3>() =
        pose_at(model, home, targets[3].frame).topLeftCorner<3, 3>() *
        Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
    targets[4].pose.topRightCorner<3, 1>() =
        0.5 * (targets[0].pose + targets[1].pose).topRightCorner<3, 1>() + Eigen::Vector3d(0.0, 0.01, 0.53);
    InverseKinematics ik(model, targets, true, {});
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s = home;
    ASSERT_EQ(ik.search(w_H_b, s, 0), Status::reached);
    EXPECT_TRUE(is_within_limits(model, s));

    iDynTree::ModelLoader loader;
    iDynTree::KinDynComputations oracle;
    ASSERT_TRUE(loader.loadReducedModelFromFile(icub, icub_joints) && oracle.loadRobotModel(loader.model()));
    oracle.setFloatingBase("root_link");
    ASSERT_TRUE(
        oracle.setRobotState(w_H_b, s, Vector6::Zero().eval(), home, Eigen::Vector3d(0.0, 0.0, -9.81)));
    const auto pose = [&](const char* frame) -> Eigen::Matrix4d {
        return iDynTree::toEigen(oracle.getWorldTransform(frame).asHomogeneousTransform());
    };
    for (const std::size_t i : {0, 1})
        EXPECT_LT((pose(i == 0 ? "l_sole" : "r_sole") - targets[i].pose).cwiseAbs().maxCoeff(), 2e-6);
    EXPECT_LT((position(pose("r_hand")) - position(targets[2].pose)).norm(), 2e-6);
    EXPECT_LT((rotation(pose("chest")) - rotation(targets[3].pose)).norm(), 2e-6);
    const Eigen::Vector3d com = iDynTree::toEigen(oracle.getCenterOfMassPosition());
    EXPECT_LT((com - position(targets[4].pose)).norm(), 2e-6);
}

TEST(InverseKinematics, KeepsAGivenBaseWhereItIs) {
    std::mt19937 random(4);
    const Model model = Model::load(icub, icub_joints);
    InverseKinematics ik(model, {target(model, Kind::position, "l_hand")}, false, {});
    const State state = random_state(model.joints(), random);
    Data data(model);
    set(model, data, state);
    forward_kinematics(model, data, ik.targets[0].frame, ik.targets[0].pose);
    ik.targets[0].pose(2, 3) += 0.03;
    Eigen::Matrix4d w_H_b = state.w_H_b;
    Eigen::VectorXd s = state.s;
    EXPECT_EQ(ik.search(w_H_b, s, 20), Status::reached);
    EXPECT_LT((w_H_b - state.w_H_b).cwiseAbs().maxCoeff(), 1e-14);
}

/// Where the search rests out of reach, no joint by itself lowers the cost.
TEST(InverseKinematics, RestsWhereNoJointLowersTheError) {
    std::mt19937 random(5);
    const Model model = Model::load(icub, icub_joints, {0.0, 0.0, -9.81}, {}, false);
    InverseKinematics ik(model, {target(model, Kind::pose, "r_hand")}, false, {500, 1e-6});
    for (int trial = 0; trial < 20; ++trial) {
        Target& wanted = ik.targets[0];
        wanted.pose = random_state(1, random).w_H_b;
        Eigen::Matrix4d base = Eigen::Matrix4d::Identity();
        Eigen::VectorXd s = random_posture(model, random);
        ASSERT_EQ(ik.search(base, s, 0), Status::least_error);
        const auto cost = [&](const Eigen::VectorXd& at) {
            const Eigen::Matrix4d H = pose_at(model, at, wanted.frame);
            const Eigen::AngleAxisd turn((rotation(wanted.pose) * rotation(H).transpose()).eval());
            return 0.5 * (position(wanted.pose - H).squaredNorm() + std::pow(turn.angle(), 2));
        };
        const double least = cost(s);
        EXPECT_NEAR(least, 0.5 * ik.error().squaredNorm(), 1e-12);
        for (int j = 0; j < model.joints(); ++j) {
            for (const double way : {-1e-3, 1e-3}) {
                Eigen::VectorXd aside = s;
                aside[j] += way;
                EXPECT_TRUE(!is_within_limits(model, aside) || cost(aside) > least * (1.0 - 1e-5)) << j;
            }
        }
    }
}

TEST(InverseKinematics, AnswersTheSameQuestionWithTheSameBits) {
    std::mt19937 random(6);
    const Model model = Model::load(icub, icub_joints);
    InverseKinematics used(model, {target(model, Kind::pose, "r_hand")}, true, {});
    for (int k = 0; k < 20; ++k) {
        const State state = random_state(model.joints(), random);
        InverseKinematics fresh(model, {target(model, Kind::pose, "r_hand")}, true, {});
        fresh.targets[0].pose = used.targets[0].pose = random_state(1, random).w_H_b;
        Eigen::Matrix4d H = state.w_H_b, H_again = H;
        Eigen::VectorXd s = state.s, s_again = s;
        EXPECT_EQ(used.search(H, s, 3), fresh.search(H_again, s_again, 3));
        EXPECT_EQ(H, H_again);
        EXPECT_EQ(s, s_again);
    }
}

TEST(InverseKinematics, ReachesThePosesOfICubsHands) {
    std::mt19937 random(7);
    EXPECT_EQ(missed(Model::load(icub, icub_joints, {0.0, 0.0, -9.81}, {}, false), 1000, random), 0);
    EXPECT_EQ(missed(Model::load(icub, {}, {0.0, 0.0, -9.81}, {}, false), 1000, random), 0);
}

TEST(InverseKinematics, ReachesThePosesOfManyRobots) {
    const std::filesystem::path folder =
        BF_BINARY_DIRECTORY "/robots/cmeel.prefix/share/example-robot-data/robots";
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is missing: make robots";
    std::mt19937 random(8);
    int robots = 0, not_reached = 0;
    constexpr int trials = 200;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
        if (file.path().extension() != ".urdf") continue;
        SCOPED_TRACE(file.path().filename());
        try {
            const Model model = Model::load(file.path(), {}, {0.0, 0.0, -9.81}, {}, false);
            if (model.joints() < 3) continue;
            const int misses = missed(model, trials, random);
            EXPECT_LE(misses, trials / 50);
            not_reached += misses;
            ++robots;
        } catch (const std::exception&) { // docs/robots.md says why
        }
    }
    EXPECT_GT(robots, 20);
    EXPECT_LE(not_reached, robots * trials / 1000); // 99.9 %
}

} // namespace bf::dynamics::test

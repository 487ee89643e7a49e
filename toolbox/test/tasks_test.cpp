#include "bf/dynamics/tasks.hpp"

#include "running.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <random>

namespace bf::toolbox::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr int n = 23, v = 29, x_size = v + 12;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;

const dynamics::Model& icub_model() {
    static const auto model = dynamics::Model::load(
        BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf",
        {"torso_pitch",    "torso_roll",    "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
         "l_shoulder_yaw", "l_elbow",       "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
         "r_elbow",        "l_hip_pitch",   "l_hip_roll",       "l_hip_yaw",        "l_knee",
         "l_ankle_pitch",  "l_ankle_roll",  "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
         "r_knee",         "r_ankle_pitch", "r_ankle_roll"});
    return model;
}

/// A robot on two feet with three tasks; further settings of the solver, and parameters of the foot limits.
std::string standing(const std::string& solver, const std::string& feet) {
    return "model: m\nstep: 0.01\ninputs: {w_H_b: {shape: \"[4 4]\"}, s: {shape: 23}, v_b: {shape: 6}, "
           "s_dot: {shape: "
           "23}, p: {shape: 3}, hand: {shape: \"[4 4]\"}, posture: {shape: 23}, contacts: {shape: "
           "2}, extra: {shape: \"[1 32]\"}}\nblocks:\n"
           "  robot: {block: WholeBodyToolbox/Configuration, joints: \"" +
           icub_joints +
           "\"}\n  com: {block: WholeBodyToolbox/CenterOfMassTask, weights: [5 6 7]}\n"
           "  hand_task: {block: WholeBodyToolbox/CartesianTask, frame: r_hand, kp: 9, kd: 2, weights: [1 2 "
           "3 4 5 6]}\n"
           "  posture_task: {block: WholeBodyToolbox/PostureTask, weights: 0.1}\n"
           "  limits: {block: WholeBodyToolbox/JointLimits, max_acceleration: 300}\n"
           "  left: {block: WholeBodyToolbox/ContactLimits, frame: l_sole, " +
           feet +
           "}\n"
           "  right: {block: WholeBodyToolbox/ContactLimits, frame: r_sole, " +
           feet +
           "}\n"
           "  program: {block: WholeBodyToolbox/TaskSpaceInverseDynamics, surfaces: \"{'l_sole', "
           "'r_sole'}\", constraints: \"{'extra'}\", tasks: "
           "\"{'com', 'hand', 'posture'}\", " +
           solver +
           "}\nconnections:\n"
           "  w_H_b: [com.w_H_b, hand_task.w_H_b, left.w_H_b, right.w_H_b, program.w_H_b]\n"
           "  s: [com.s, hand_task.s, posture_task.s, limits.s, left.s, right.s, program.s]\n"
           "  v_b: [com.v_b, hand_task.v_b, program.v_b]\n"
           "  s_dot: [com.s_dot, hand_task.s_dot, posture_task.s_dot, limits.s_dot, program.s_dot]\n"
           "  p: com.p_target\n  hand: hand_task.w_H_target\n  posture: posture_task.s_target\n"
           "  extra: program.extra\n  contacts: program.contacts\n  com.task: program.com\n  hand_task.task: "
           "program.hand\n"
           "  posture_task.task: program.posture\n  left: program.limits_l_sole\n  right: "
           "program.limits_r_sole\n";
}
const std::string wide_feet = "friction: 1e6, torsion: 1e6, x: [-1e6 1e6], y: [-1e6 1e6]";
const std::string feet = "x: [-0.04 0.09], y: [-0.03 0.03], friction: 0.4, min_force: 5, faces: 6";

struct StandingState {
    Transform w_H_b = Transform::Identity();
    Vector s = Vector::Zero(n), s_dot = Vector::Zero(n);
    Vector6 v_b = Vector6::Zero();
};

/// A row without entries that asks for a value.
Matrix of_all(double value) {
    Matrix rows = Matrix::Zero(1, v + 3);
    rows.rightCols<3>() << value, value, 1;
    return rows;
}

/// Bent knees, a little motion.
StandingState some_state(std::mt19937& random) {
    std::normal_distribution<double> normal;
    StandingState state;
    state.s(14) = state.s(20) = -0.6;
    state.s(11) = state.s(17) = 0.3;
    state.s(15) = state.s(21) = -0.3;
    state.s(6) = state.s(10) = 0.8;
    state.w_H_b(2, 3) = 0.6;
    for (int i = 0; i < n; ++i) {
        state.s(i) += 0.03 * normal(random);
        state.s_dot(i) = 0.1 * normal(random);
    }
    for (int i = 0; i < 6; ++i) state.v_b(i) = 0.05 * normal(random);
    return state;
}

void set(Running& run, const StandingState& state, std::mt19937& random) {
    std::normal_distribution<double> normal;
    run.set("w_H_b", state.w_H_b).set("s", state.s).set("v_b", state.v_b).set("s_dot", state.s_dot);
    Transform hand = Transform::Identity();
    hand.topLeftCorner<3, 3>() = Eigen::AngleAxisd(0.1 * normal(random), Vector3::UnitX()).toRotationMatrix();
    hand.topRightCorner<3, 1>() = Vector3(0.2, -0.2, 0.6) + 0.02 * Vector3(normal(random), normal(random), 0);
    run.set("hand", hand).set("posture", state.s + 0.05 * Vector::Ones(n));
    run.set("p", Vector3(0.01 * normal(random), 0.01 * normal(random), 0.5));
    run.set("contacts", Eigen::Vector2d(1, 1)).set("extra", of_all(0));
}

/// Base wrench and torques that nu_dot needs beside the contact wrenches, by inverse dynamics.
Vector needed(const StandingState& state, const Vector& nu_dot, const Vector& f) {
    dynamics::Data data(icub_model());
    dynamics::set_state(icub_model(), data, state.w_H_b, state.s, state.v_b, state.s_dot);
    Vector all(v);
    dynamics::inverse_dynamics(icub_model(), data, nu_dot.head<6>(), nu_dot.tail(n), all);
    dynamics::add_wrench(icub_model(), data, icub_model().frame("l_sole"), -f.head<6>(), all);
    dynamics::add_wrench(icub_model(), data, icub_model().frame("r_sole"), -f.tail<6>(), all);
    return all;
}

/// x = argmin |W (A x - b)|² under C x = d, level by level, by SVD; then the least |x|.
struct Dense {
    Vector x = Vector::Zero(x_size);
    Matrix N = Matrix::Identity(x_size, x_size);

    void level(const Matrix& A, const Vector& b) {
        Eigen::JacobiSVD<Matrix> svd(A * N, Eigen::ComputeFullU | Eigen::ComputeFullV);
        svd.setThreshold(1e-9);
        x += N * svd.solve(b - A * x);
        N = (N * svd.matrixV().rightCols(N.cols() - svd.rank())).eval();
    }
    void rows(const std::vector<Matrix>& tasks) {
        Eigen::Index count = 0, at = 0;
        for (const Matrix& task : tasks) count += task.rows();
        Matrix A = Matrix::Zero(count, x_size);
        Vector b(count);
        for (const Matrix& task : tasks) {
            const Vector root = task.col(v + 2).cwiseSqrt();
            A.block(at, 0, task.rows(), v) = root.asDiagonal() * task.leftCols(v);
            b.segment(at, task.rows()) = root.cwiseProduct(task.col(v));
            at += task.rows();
        }
        level(A, b);
    }
};

/// Equations of motion of the base and contacts that stand.
Dense with_contacts(const StandingState& state) {
    dynamics::Data data(icub_model());
    dynamics::set_state(icub_model(), data, state.w_H_b, state.s, state.v_b, state.s_dot);
    Matrix A = Matrix::Zero(18, x_size), M(v, v);
    Vector b(18), h(v), nu(v);
    nu << state.v_b, state.s_dot;
    dynamics::mass_matrix(icub_model(), data, M);
    dynamics::bias_forces(icub_model(), data, h);
    A.topLeftCorner(6, v) = M.topRows<6>();
    b.head<6>() = -h.head<6>();
    int row = 6;
    for (const char* sole : {"l_sole", "r_sole"}) {
        Matrix6X J(6, v);
        Vector6 bias;
        dynamics::jacobian(icub_model(), data, icub_model().frame(sole), J);
        dynamics::bias_acceleration(icub_model(), data, icub_model().frame(sole), bias);
        A.block(0, v + row - 6, 6, 6) = -J.leftCols<6>().transpose();
        A.block(row, 0, 6, v) = J;
        b.segment<6>(row) = -bias - 10.0 * J * nu;
        row += 6;
    }
    Dense dense;
    dense.level(A, b);
    return dense;
}

Vector solution(const Running& run) {
    Vector x(x_size);
    x << run.get("program.nu_dot"), run.get("program.f");
    return x;
}

/// A HierarchicalQP of two variables, one constraint and two tasks of one row each.
std::string small(const std::string& settings) {
    return "model: m\nstep: 0.01\ninputs: {c: {shape: \"[1 5]\"}, a: {shape: \"[1 5]\"}, b: {shape: \"[1 "
           "5]\"}}\nblocks:\n"
           "  qp: {block: WholeBodyToolbox/HierarchicalQP, constraints: \"{'c'}\", tasks: \"{'a', 'b'}\"" +
           settings + "}\nconnections:\n  c: qp.c\n  a: qp.a\n  b: qp.b\n";
}
Matrix row(double x, double y, double lower, double upper, double weight = 1) {
    Matrix rows(1, 5);
    rows << x, y, lower, upper, weight;
    return rows;
}

} // namespace

TEST(TaskSpaceInverseDynamics, OfOneLevelIsTheWeightedProblemWhereNoLimitIsActive) {
    Running run(standing("max_torque: 1e5", wide_feet));
    std::mt19937 random(1);
    for (int k = 0; k < 3; ++k) {
        const StandingState state = some_state(random);
        set(run, state, random);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_EQ(run.scalar("program.status"), 0);
        Dense dense = with_contacts(state);
        dense.rows({run.get("com.task"), run.get("hand_task.task"), run.get("posture_task.task")});
        EXPECT_LT((solution(run) - dense.x).norm(), 1e-6 * dense.x.norm()) << k;
    }
}

TEST(TaskSpaceInverseDynamics, OfThreeLevelsIsTheRecursionByNullSpacesWhereNoLimitIsActive) {
    Running run(standing("levels: [1 2 3]", wide_feet));
    std::mt19937 random(2);
    for (int k = 0; k < 3; ++k) {
        const StandingState state = some_state(random);
        set(run, state, random);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_EQ(run.scalar("program.status"), 0);
        Dense dense = with_contacts(state);
        for (const char* task : {"com.task", "hand_task.task", "posture_task.task"})
            dense.rows({run.get(task)});
        EXPECT_LT((solution(run) - dense.x).norm(), 1e-6 * dense.x.norm()) << k;
        EXPECT_LT(run.get("program.violation")(0, 0), 1e-8);
        EXPECT_GT(run.get("program.violation")(2, 0), 0.1) << "the posture gives way";
    }
}

TEST(TaskSpaceInverseDynamics, GivesTorquesAndWrenchesThatMoveTheRobotSoWithinItsLimits) {
    Running run(standing("levels: [1 2 3], max_torque: 25", feet));
    std::mt19937 random(3);
    for (int k = 0; k < 5; ++k) {
        StandingState state = some_state(random);
        set(run, state, random);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_EQ(run.scalar("program.status"), 0);
        const Vector nu_dot = run.get("program.nu_dot"), f = run.get("program.f"),
                     tau = run.get("program.tau");
        Vector expected = Vector::Zero(v);
        expected.tail(n) = tau;
        EXPECT_LT((needed(state, nu_dot, f) - expected).norm(), 1e-6);
        EXPECT_LE(tau.cwiseAbs().maxCoeff(), 25 + 1e-5);
        for (int foot = 0; foot < 2; ++foot) {
            const Matrix rows = run.get(foot == 0 ? "left.limits" : "right.limits");
            const Vector value = rows.leftCols<6>() * f.segment<6>(6 * foot);
            EXPECT_GE((value - rows.col(6)).minCoeff(), -1e-5);
            EXPECT_LE((value - rows.col(7)).maxCoeff(), 1e-5);
        }
        dynamics::Data data(icub_model());
        dynamics::set_state(icub_model(), data, state.w_H_b, state.s, state.v_b, state.s_dot);
        Vector nu(v);
        nu << state.v_b, state.s_dot;
        for (const char* sole : {"l_sole", "r_sole"}) {
            Matrix6X J(6, v);
            Vector6 bias;
            dynamics::jacobian(icub_model(), data, icub_model().frame(sole), J);
            dynamics::bias_acceleration(icub_model(), data, icub_model().frame(sole), bias);
            EXPECT_LT((J * nu_dot + bias + 10 * J * nu).norm(), 1e-7) << "the contact moves";
        }
    }
}

TEST(TaskSpaceInverseDynamics, LetsGoOfAContactThatIsNotThere) {
    Running run(standing("levels: [1 2 3]", feet));
    std::mt19937 random(4);
    set(run, some_state(random), random);
    run.set("contacts", Eigen::Vector2d(1, 0));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    ASSERT_EQ(run.scalar("program.status"), 0);
    EXPECT_LT(run.get("program.f").bottomRows(6).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_GT(run.get("program.f")(2, 0), 5 - 1e-6);
}

TEST(TaskSpaceInverseDynamics, HoldsItsTorquesWhileTheConstraintsContradictEachOther) {
    Running run(standing("levels: [1 2 3]", feet));
    std::mt19937 random(5);
    set(run, some_state(random), random);
    ASSERT_TRUE(run.step());
    ASSERT_EQ(run.scalar("program.status"), 0);
    const std::vector<std::string> held = {"program.tau", "program.nu_dot", "program.f", "program.violation"};
    std::vector<Matrix> before;
    for (const auto& signal : held) before.push_back(run.get(signal));
    set(run, some_state(random), random);
    run.set("extra", of_all(1));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("program.status"), -2);
    for (std::size_t i = 0; i < held.size(); ++i) EXPECT_EQ(run.get(held[i]), before[i]) << held[i];
    run.set("extra", of_all(0));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("program.status"), 0);
    EXPECT_NE(run.get("program.tau"), before[0]);
}

TEST(TaskSpaceInverseDynamics, StopsTheRunWhereItIsToldTo) {
    std::mt19937 random(6);
    const auto failure = [&](const std::string& settings, const std::string& of_feet, double value) {
        Running run(standing("levels: [1 2 3], stop_when_fails: true" + settings, of_feet));
        set(run, some_state(random), random);
        run.set("extra", of_all(value));
        EXPECT_FALSE(run.step());
        return run.simulation.failure();
    };
    EXPECT_EQ(
        failure("", feet, 1),
        "program: extra[1][30] contradicts other equalities that must hold; relax it, or make it a task");
    EXPECT_EQ(failure("", feet, nan),
              "program: extra[1][30] or the upper bound beside it is no bound; use -inf and "
              "inf where there is none");
    // Without torques it falls, and that needs forces at the soles that are not half a metre beside them.
    EXPECT_EQ(failure(", max_torque: 0.001", "x: [0.5 0.6], min_force: 50", 0),
              "program: the constraints contradict each other; relax them, or make limits a task of the "
              "first level, "
              "which is violated as little as possible");
}

TEST(TaskSpaceInverseDynamics, RefusesWhatItCannotSolve) {
    expect_contains(
        refusal(standing("levels: [1 2]", feet)),
        "program: argument 'levels' has 2 elements, but there are 3 tasks; give one level for each");
    expect_contains(refusal(standing("levels: [1 2 4]", feet)), "levels go from 1, the first, to 3");
    expect_contains(refusal(standing("levels: [0 1 2]", feet)), "levels go from 1, the first, to 3");
    expect_contains(refusal(standing("points: \"{'l_sole'}\"", feet)), "'limits_l_sole' is listed twice");
    expect_contains(refusal(standing("points: \"{'l_sol'}\"", feet)), "program: ");
    expect_contains(refusal(standing("rank_tolerance: 0", feet)), "rank_tolerance");
}

TEST(HierarchicalQP, SolvesLevelsInTheirOrder) {
    Running strict(small(", levels: [1 2]")), weighted(small(""));
    for (Running* run : {&strict, &weighted}) {
        run->set("c", row(0, 1, -infinity, 1)).set("a", row(1, 0, 3, 3)).set("b", row(1, 1, 10, 10, 2));
        ASSERT_TRUE(run->step());
        EXPECT_EQ(run->scalar("qp.status"), 0);
    }
    // x1 = 3, then x2 as large as it may be; or the least (x1 - 3)² + 2 (x1 + 1 - 10)².
    EXPECT_LT((strict.get("qp.x") - Eigen::Vector2d(3, 1)).norm(), 1e-6);
    EXPECT_LT((strict.get("qp.violation") - Eigen::Vector2d(0, std::sqrt(2.0) * 6)).norm(), 1e-6);
    EXPECT_LT((weighted.get("qp.x") - Eigen::Vector2d(7, 1)).norm(), 1e-6);
    EXPECT_NEAR(weighted.scalar("qp.violation"), std::sqrt(16 + 2 * 4), 1e-6);
}

TEST(HierarchicalQP, HoldsTheLastSolutionWhileTheConstraintsFail) {
    Running run(small(", levels: [1 2]"));
    run.set("c", row(0, 1, -infinity, 1)).set("a", row(1, 0, 3, 3)).set("b", row(0, 1, 0.5, 0.5));
    ASSERT_TRUE(run.step());
    const Matrix x = run.get("qp.x"), violation = run.get("qp.violation");
    EXPECT_LT((x - Eigen::Vector2d(3, 0.5)).norm(), 1e-9);
    for (const auto& [bad, status] :
         {std::pair(row(0, 1, 2, 1), -2), {row(nan, 1, 0, 1), -1}, {row(0, 0, 1, 1), -2}}) {
        run.set("c", bad).set("a", row(1, 0, 9, 9));
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("qp.status"), status);
        EXPECT_EQ(run.get("qp.x"), x);
        EXPECT_EQ(run.get("qp.violation"), violation);
    }
    run.set("c", row(0, 1, -infinity, 1));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("qp.status"), 0);
    EXPECT_NEAR(run.get("qp.x")(0, 0), 9, 1e-9);
}

TEST(HierarchicalQP, StopsTheRunWithTheEntryAtFault) {
    const std::vector<std::pair<Matrix, std::string>> cases = {
        {row(1, nan, 0, 1), "qp: a[1][2] is not finite or above 1e100; look at what computes it"},
        {row(1, 1e300, 0, 1), "qp: a[1][2] is not finite or above 1e100; look at what computes it"},
        {row(1, 1, nan, 1),
         "qp: a[1][3] or the upper bound beside it is no bound; use -inf and inf where there is none"},
        {row(1, 1, 2, 1), "qp: a[1][3] is above the upper bound beside it; look at what computes them"},
        {row(1, 1, 0, 1, -1), "qp: a[1][5] is no weight; it must be from 0 to 1e100"},
        {row(1, 1, 0, 1, 1e308), "qp: a[1][5] is no weight; it must be from 0 to 1e100"}};
    for (const auto& [bad, text] : cases) {
        Running run(small(", stop_when_fails: true"));
        run.set("c", row(0, 1, 0, 1)).set("b", row(0, 1, 0, 0)).set("a", bad);
        EXPECT_FALSE(run.step());
        EXPECT_EQ(run.simulation.failure(), text);
        EXPECT_EQ(run.scalar("qp.status"), -1) << "nothing that must hold is at fault";
    }
    Running run(small(", stop_when_fails: true"));
    run.set("c", row(0, 0, 1, 1)).set("b", row(0, 1, 0, 0)).set("a", row(1, 0, 0, 0));
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(),
              "qp: c[1][3] contradicts other equalities that must hold; relax it, or make it a task");
}

TEST(HierarchicalQP, RefusesPortsAndLevelsThatDoNotFit) {
    expect_contains(refusal("model: m\nstep: 1\nblocks:\n  qp: {block: WholeBodyToolbox/HierarchicalQP}\n"),
                    "qp: it has no rows; name ports in tasks or constraints");
    expect_contains(refusal(small(", levels: [1]")),
                    "qp: argument 'levels' has 1 elements, but there are 2 tasks");
    auto text = small("");
    text.replace(text.find("a: {shape: \"[1 5]\""), 18, "a: {shape: \"[1 6]\"");
    expect_contains(refusal(text), "qp: ");
    expect_contains(
        refusal("model: m\nstep: 1\ninputs: {a: {shape: \"[2 3]\"}}\nblocks:\n  qp: {block: "
                "WholeBodyToolbox/HierarchicalQP, tasks: \"{'a'}\"}\nconnections:\n  a: qp.a\n"),
        "qp: its rows have no column of A; a row is [A, lower, upper, weight], at least 4 numbers");
}

TEST(HierarchicalQP, ContinuesASnapshotBitForBit) {
    Running run(small(", levels: [1 2]"));
    const auto go = [&](int from, std::vector<double>& seen) {
        for (int k = from; k < from + 10; ++k) {
            run.set("c", row(1, 1, -infinity, std::cos(0.5 * k))).set("a", row(1, std::sin(k), 2, 3));
            run.set("b", row(0, 1, 1, 1));
            ASSERT_TRUE(run.step());
            const Matrix x = run.get("qp.x");
            seen.insert(seen.end(), x.data(), x.data() + x.size());
        }
    };
    std::vector<double> before, first, second;
    go(0, before);
    const auto snapshot = run.simulation.snapshot();
    go(10, first);
    run.simulation.restore(snapshot);
    go(10, second);
    EXPECT_EQ(first, second);
}

TEST(TaskBlocks, StopAtTargetsThatAreNone) {
    const auto arm = [](const std::string& block, const std::string& shape, const std::string& port) {
        return "model: m\nstep: 0.01\ninputs: {t: {shape: \"" + shape +
               "\"}, s: {shape: 3}}\nblocks:\n  robot: {block: "
               "WholeBodyToolbox/Configuration, floating_base: false, joints: \"{'r_elbow', 'r_wrist_pitch', "
               "'r_wrist_yaw'}\"}\n  x: {block: WholeBodyToolbox/" +
               block + "}\nconnections:\n  s: [x.s, x.s_dot]\n  t: x." + port + "\n";
    };
    const auto failure = [&](const std::string& block, const std::string& shape, const std::string& port,
                             const Matrix& value) {
        Running run(arm(block, shape, port));
        run.set("t", value);
        EXPECT_FALSE(run.step());
        return run.simulation.failure();
    };
    Matrix pose = Matrix::Identity(4, 4);
    pose(1, 3) = nan;
    expect_contains(failure("CartesianTask, frame: r_hand", "[4 4]", "w_H_target", pose), "x: w_H_target");
    expect_contains(failure("CartesianTask, frame: r_hand", "[4 4]", "w_H_target", Matrix::Zero(4, 4)),
                    "x: w_H_target holds no rotation");
    expect_contains(
        failure("CartesianTask, frame: r_hand, what: orientation", "[3 3]", "R_target", Matrix::Ones(3, 3)),
        "x: R_target holds no rotation");
    expect_contains(
        failure("CartesianTask, frame: r_hand, what: position", "3", "p_target", Vector3(0, nan, 0)),
        "x: p_target[2] is not finite; look at what computes it");
    expect_contains(failure("CenterOfMassTask", "3", "p_target", Vector3(0, 0, infinity)),
                    "x: p_target[3] is not finite");
    expect_contains(failure("PostureTask", "3", "s_target", Vector3(0, nan, 0)),
                    "x: s_target[r_wrist_pitch] is not finite");
    expect_contains(refusal(arm("CartesianTask, frame: r_han", "[4 4]", "w_H_target")), "r_hand");
    expect_contains(refusal(arm("CartesianTask, what: place", "[4 4]", "w_H_target")), "position");
}

TEST(TaskBlocks, HaveRowsOverTheJointsAloneWhereTheBaseIsFixed) {
    Running run("model: m\nstep: 0.01\ninputs: {p: {shape: 3}, q: {shape: 4}, s: {shape: 4}, s_dot: {shape: "
                "4}}\nblocks:\n"
                "  robot: {block: WholeBodyToolbox/Configuration, floating_base: false, joints: "
                "\"{'r_shoulder_pitch', "
                "'r_shoulder_roll', 'r_shoulder_yaw', 'r_elbow'}\"}\n"
                "  hand: {block: WholeBodyToolbox/CartesianTask, frame: r_hand, what: position}\n"
                "  posture: {block: WholeBodyToolbox/PostureTask}\n"
                "  program: {block: WholeBodyToolbox/TaskSpaceInverseDynamics, tasks: \"{'hand', "
                "'posture'}\", levels: "
                "[1 2]}\nconnections:\n  p: hand.p_target\n  q: posture.s_target\n"
                "  s: [hand.s, posture.s, program.s]\n  s_dot: [hand.s_dot, posture.s_dot, program.s_dot]\n"
                "  hand.task: program.hand\n  posture.task: program.posture\n");
    run.set("s", Eigen::Vector4d(-0.3, 0.4, 0.1, 0.9)).set("s_dot", Eigen::Vector4d(0.1, 0, -0.1, 0.2));
    run.set("p", Vector3(-0.2, 0.2, 0.1)).set("q", Eigen::Vector4d(-0.3, 0.4, 0.1, 0.9));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.scalar("program.status"), 0);
    EXPECT_EQ(run.size("hand.task").cols, 7);
    const Matrix task = run.get("hand.task");
    EXPECT_LT((task.leftCols(4) * run.get("program.nu_dot") - task.col(4)).norm(), 1e-8);
}

TEST(TaskBlocks, HoldAccelerationsOverThePeriodOrTheHorizon) {
    const auto upper = [](const std::string& settings) {
        Running run(
            "model: m\nstep: 0.01\ninputs: {s: {shape: 1}, s_dot: {shape: 1}}\nblocks:\n  robot: {block: "
            "WholeBodyToolbox/Configuration, joints: \"{'r_elbow'}\"}\n  x: {block: "
            "WholeBodyToolbox/JointLimits, max_acceleration: 1000, max_speed: 1" +
            settings + "}\nconnections:\n  s: x.s\n  s_dot: x.s_dot\n");
        run.set("s", 0.8).set("s_dot", 0.5);
        EXPECT_TRUE(run.step()) << run.simulation.failure();
        return run.get("x")(0, 8);
    };
    EXPECT_NEAR(upper(""), 0.5 / 0.01, 1e-9);
    EXPECT_NEAR(upper(", horizon: 0.1"), 0.5 / 0.1, 1e-9);
}

} // namespace bf::toolbox::test

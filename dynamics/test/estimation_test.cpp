#include "bf/dynamics/estimation.hpp"
#include "bf/dynamics/impedance.hpp"
#include "bf/dynamics/lie.hpp"
#include "bf/dynamics/tasks.hpp"

#include "robots.hpp"

#include <gtest/gtest.h>

namespace bf::dynamics::test {
namespace {

const Model& standing_icub() {
    static const Model model = Model::load(icub, icub_joints);
    return model;
}
const Model& fixed_arm() {
    static const Model model = Model::load(icub,
                                           {"r_shoulder_pitch", "r_shoulder_roll", "r_shoulder_yaw",
                                            "r_elbow", "r_wrist_prosup", "r_wrist_pitch", "r_wrist_yaw"},
                                           {0.0, 0.0, -9.81}, {}, false);
    return model;
}

struct Balance {
    Eigen::VectorXd p, beta;
    Balance(const Model& model, Data& data, const State& state) : p(model.velocities()), beta(p) {
        set(model, data, state);
        Eigen::MatrixXd M(p.size(), p.size());
        Eigen::VectorXd nu(p.size());
        momentum_balance(model, data, state.nu_base, state.s_dot, p, beta, M, nu);
    }
};

} // namespace

TEST(Estimation, MomentumChangesByForcesAndByWhatNeedsNone) {
    std::mt19937 random(1);
    for (const Model* model : {&standing_icub(), &fixed_arm()}) {
        Data data(*model);
        State state = random_state(model->joints(), random);
        if (!model->has_floating_base()) {
            state.w_H_b.setIdentity();
            state.nu_base.setZero();
        }
        const Eigen::VectorXd forces = 5.0 * random_vector(model->velocities(), random);
        const Balance now(*model, data, state);
        Eigen::VectorXd nu_dot(model->velocities());
        set(*model, data, state);
        ASSERT_EQ(forward_dynamics(*model, data, forces, nu_dot), -1);
        const auto at = [&](double dt) {
            State later = moved(state, dt);
            if (model->has_floating_base()) later.nu_base += dt * nu_dot.head<6>();
            later.s_dot += dt * nu_dot.tail(model->joints());
            return Balance(*model, data, later).p;
        };
        const double dt = 1e-6;
        const Eigen::VectorXd rate = (at(dt) - at(-dt)) / (2 * dt);
        EXPECT_LT((rate - now.beta - forces).norm(), 1e-6 * (1.0 + nu_dot.norm()));
    }
}

TEST(Estimation, FindsTheWrenchesThatMakeForces) {
    std::mt19937 random(2);
    const Model& model = standing_icub();
    Data data(model);
    const State state = random_state(model.joints(), random);
    set(model, data, state);
    const std::vector<Frame> frames = {model.frame("l_sole"), model.frame("r_hand")};
    const Eigen::VectorXd expected = random_vector(12, random);
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(model.velocities()), found(12);
    for (int i = 0; i < 2; ++i)
        add_wrench(model, data, frames[static_cast<std::size_t>(i)], expected.segment<6>(6 * i), forces);
    WrenchesOfForces wrenches(model, frames);
    wrenches.find(model, data, forces, 0.0, found);
    EXPECT_LT((found - expected).norm(), 1e-8);
    wrenches.find(model, data, forces, 1e-3, found);
    EXPECT_LT((found - expected).norm(), 1e-2);
    EXPECT_GT((found - expected).norm(), 1e-10);
}

TEST(Estimation, PutsTheBaseWhereAFrameStands) {
    std::mt19937 random(3);
    const Model& model = standing_icub();
    Data data(model);
    State state = random_state(model.joints(), random);
    set(model, data, state);
    const Frame sole = model.frame("r_sole"), other = model.frame("l_sole");
    Eigen::Matrix4d stands, base;
    forward_kinematics(model, data, sole, stands);
    base_from_frame(model, data, sole, stands, base);
    EXPECT_LT((base - state.w_H_b).norm(), 1e-12);

    Matrix6X J(6, model.velocities());
    Vector6 velocity, moves;
    base_velocity_from_contacts(model, data, {other, sole}, Eigen::Vector2d(0, 1), state.s_dot, velocity, J);
    state.nu_base = velocity;
    set(model, data, state);
    frame_velocity(model, data, sole, moves);
    EXPECT_LT(moves.norm(), 1e-11);
    frame_velocity(model, data, other, moves);
    EXPECT_GT(moves.norm(), 1e-2);

    // Of two the sum of squares is least: any other velocity has more.
    base_velocity_from_contacts(model, data, {other, sole}, Eigen::Vector2d(1, 1), state.s_dot, velocity, J);
    const auto cost = [&](const Vector6& nu_base) {
        State tried = state;
        tried.nu_base = nu_base;
        set(model, data, tried);
        Vector6 left, right;
        frame_velocity(model, data, other, left);
        frame_velocity(model, data, sole, right);
        return left.squaredNorm() + right.squaredNorm();
    };
    for (int k = 0; k < 6; ++k)
        for (const double step : {1e-3, -1e-3})
            EXPECT_GT(cost(velocity + step * Vector6::Unit(k)), cost(velocity));
    base_velocity_from_contacts(model, data, {other, sole}, Eigen::Vector2d(0, 0), state.s_dot, velocity, J);
    EXPECT_EQ(velocity.norm(), 0.0);
}

TEST(Estimation, FindsTheBaseVelocityOfPointsThatStandFromWhatTurnsIt) {
    std::mt19937 random(8);
    const Model& model = standing_icub();
    Data data(model);
    State state = random_state(model.joints(), random);
    set(model, data, state);
    const std::vector<Frame> feet{model.frame("l_sole"), model.frame("r_sole")};
    const Eigen::Vector3d omega = state.nu_base.tail<3>();
    Matrix6X J(6, model.velocities());
    Vector6 velocity, moves;
    const auto velocities = [&](const Vector6& nu_base) {
        state.nu_base = nu_base;
        set(model, data, state);
        Eigen::Matrix<double, 3, 2> of;
        for (int i = 0; i < 2; ++i) {
            frame_velocity(model, data, feet[static_cast<std::size_t>(i)], moves);
            of.col(i) = moves.head<3>();
        }
        return of;
    };
    base_velocity_from_points(model, data, feet, Eigen::Vector2d(0, 1), omega, state.s_dot, velocity, J);
    EXPECT_EQ(Eigen::Vector3d(velocity.tail<3>()), omega);
    EXPECT_LT(velocities(velocity).col(1).norm(), 1e-11);
    EXPECT_GT(velocities(velocity).col(0).norm(), 1e-2);
    EXPECT_GT(moves.tail<3>().norm(), 1e-2) << "the point may turn";

    base_velocity_from_points(model, data, feet, Eigen::Vector2d(1, 3), omega, state.s_dot, velocity, J);
    const auto cost = [&](const Vector6& nu_base) {
        const Eigen::Matrix<double, 3, 2> of = velocities(nu_base);
        return of.col(0).squaredNorm() + 3 * of.col(1).squaredNorm();
    };
    for (int k = 0; k < 3; ++k)
        for (const double step : {1e-3, -1e-3})
            EXPECT_GT(cost(velocity + step * Vector6::Unit(k)), cost(velocity));
    base_velocity_from_points(model, data, feet, Eigen::Vector2d(0, 0), omega, state.s_dot, velocity, J);
    EXPECT_EQ(velocity.norm(), 0.0);
}

TEST(Estimation, CutsARobotIntoPartsThatWeighAsMuchAndMoveAlike) {
    const std::vector<Model::Part> parts =
        Model::load_parts(icub, icub_joints, {0.0, 0.0, -9.81}, {}, {"l_foot_ft_sensor", "l_leg_ft_sensor"});
    ASSERT_EQ(parts.size(), 3u);
    EXPECT_EQ(parts[0].parent, -1);
    EXPECT_EQ(parts[1].parent, 2) << "the foot hangs on the leg";
    EXPECT_EQ(parts[2].parent, 0);
    double mass = 0.0;
    int joints = 0;
    for (const Model::Part& part : parts) {
        mass += part.model.total_mass();
        joints += part.model.joints();
        EXPECT_TRUE(part.model.has_floating_base());
    }
    EXPECT_NEAR(mass, standing_icub().total_mass(), 1e-9);
    EXPECT_EQ(joints, standing_icub().joints());
    EXPECT_TRUE(parts[1].model.has_frame("l_sole"));
    EXPECT_FALSE(parts[0].model.has_frame("l_sole"));
    EXPECT_FALSE(parts[2].model.has_frame("l_sole"));
    const auto refusal = [](const std::vector<std::string>& cuts, const std::string& base = {}) {
        try {
            Model::load_parts(icub, icub_joints, {0.0, 0.0, -9.81}, base, cuts);
        } catch (const std::exception& wrong) {
            return std::string(wrong.what());
        }
        return std::string();
    };
    EXPECT_NE(refusal({"l_foot_f"}).find("'l_foot_f' is no fixed joint of '"), std::string::npos);
    EXPECT_NE(refusal({"l_foot_ft_sensor", "l_foot_ft_sensor"}).find("is cut twice"), std::string::npos);
    EXPECT_NE(refusal({"l_foot_ft_sensor"}, "l_sole").find("choose another base link"), std::string::npos);
}

TEST(Estimation, FindsTheWrenchesAndTorquesOfARobotThatMoves) {
    // Any motion and any wrenches: what the sensors read follows from the equations of the parts behind them,
    // by the whole robot's Jacobians and inverse dynamics alone where nothing else is behind them.
    std::mt19937 random(7);
    const Model& model = standing_icub();
    Data data(model);
    const State state = random_state(model.joints(), random);
    set(model, data, state);
    const Eigen::VectorXd nu_dot = random_vector(model.velocities(), random);
    const std::vector<std::string> contacts = {"l_sole", "r_sole", "chest"};
    // Without sensors the whole is one part, whose wrenches share by least norm: their sum is what the base
    // needs.
    ContactWrenches one(model, icub, {}, contacts);
    Matrix6X wrenches(6, 3), none(6, 0);
    Eigen::VectorXd tau(model.joints()), needed(model.velocities());
    one.find(model, data, state.s, state.s_dot, nu_dot, none, wrenches, tau);
    const auto rest = [&](const Matrix6X& f, const Eigen::VectorXd& torques) {
        set(model, data, state);
        inverse_dynamics(model, data, nu_dot.head<6>(), nu_dot.tail(model.joints()), needed);
        for (int i = 0; i < 3; ++i)
            add_wrench(model, data, model.frame(contacts[static_cast<std::size_t>(i)]), -f.col(i), needed);
        needed.tail(model.joints()) -= torques;
        return needed.norm();
    };
    EXPECT_LT(rest(wrenches, tau), 1e-8);

    // With sensors the equations of the whole robot hold as well, whatever is measured.
    ContactWrenches cut(model, icub, {"l_foot_ft_sensor", "r_leg_ft_sensor"}, contacts);
    const Matrix6X measured = 10.0 * Matrix6X::NullaryExpr(6, 2, [&](Eigen::Index, Eigen::Index) {
                                  return random_vector(1, random)[0];
                              });
    set(model, data, state);
    cut.find(model, data, state.s, state.s_dot, nu_dot, measured, wrenches, tau);
    EXPECT_LT(rest(wrenches, tau), 1e-8);
    const Matrix6X before = wrenches;
    Matrix6X more = measured;
    more(2, 0) += 1.0; // one newton along z of the left foot's sensor
    set(model, data, state);
    cut.find(model, data, state.s, state.s_dot, nu_dot, more, wrenches, tau);
    Eigen::Matrix4d foot;
    const Model::Part part = Model::load_parts(icub, icub_joints, {0, 0, -9.81}, {}, {"l_foot_ft_sensor"})[1];
    forward_kinematics(model, data, model.frame(part.model.base_link()), foot);
    EXPECT_LT((wrenches.col(0) - before.col(0)).head<3>().norm() - 1.0, 1e-9);
    EXPECT_LT(((wrenches.col(0) - before.col(0)).head<3>() - foot.block<3, 1>(0, 2)).norm(), 1e-9);
    EXPECT_LT((wrenches.col(1) - before.col(1)).norm(), 1e-9) << "the other leg has a sensor of its own";
}

TEST(Impedance, PullsAFrameAsASpringAndADamper) {
    std::mt19937 random(4);
    const Model& model = standing_icub();
    Data data(model);
    const State state = random_state(model.joints(), random);
    set(model, data, state);
    const Frame hand = model.frame("r_hand");
    Eigen::Matrix4d H, target = Eigen::Matrix4d::Identity();
    Vector6 now, wrench, error;
    forward_kinematics(model, data, hand, H);
    frame_velocity(model, data, hand, now);
    const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, 2, -1).normalized());
    target.topLeftCorner<3, 3>() = turn * H.topLeftCorner<3, 3>();
    target.topRightCorner<3, 1>() = H.topRightCorner<3, 1>() + Eigen::Vector3d(0.1, 0.2, 0.3);
    const Vector6 K(10, 20, 30, 1, 2, 3), D(4, 5, 6, 0.1, 0.2, 0.3), velocity = random_vector(6, random);
    cartesian_impedance(model, data, hand, target, velocity, {K, D, false}, wrench, error);
    Vector6 expected;
    expected << 0.1, 0.2, 0.3, 0.7 * turn.axis();
    EXPECT_LT((error - expected).norm(), 1e-12);
    EXPECT_LT((wrench - K.cwiseProduct(error) - D.cwiseProduct(velocity - now)).norm(), 1e-12);
    // In the target's axes the same spring, turned with it.
    const Eigen::Matrix3d R = target.topLeftCorner<3, 3>();
    cartesian_impedance(model, data, hand, target, now, {K, D, true}, wrench, error);
    EXPECT_LT((wrench.head<3>() - R * K.head<3>().asDiagonal() * R.transpose() * error.head<3>()).norm(),
              1e-12);
    EXPECT_LT((wrench.tail<3>() - R * K.tail<3>().asDiagonal() * R.transpose() * error.tail<3>()).norm(),
              1e-12);
}

TEST(Impedance, LeavesAFrameAloneInItsNullSpace) {
    std::mt19937 random(5);
    for (const Model* model : {&standing_icub(), &fixed_arm()}) {
        Data data(*model);
        State state = random_state(model->joints(), random);
        if (!model->has_floating_base()) state.nu_base.setZero();
        set(*model, data, state);
        const Frame hand = model->frame("r_hand");
        const Eigen::VectorXd given = random_vector(model->velocities(), random);
        Eigen::VectorXd forces = given, with(given), without(given);
        NullSpace null_space(model->velocities());
        null_space.project(*model, data, hand, forces);
        EXPECT_GT(forces.norm(), 1e-2);
        ASSERT_EQ(forward_dynamics(*model, data, forces, with), -1);
        ASSERT_EQ(forward_dynamics(*model, data, Eigen::VectorXd::Zero(given.size()), without), -1);
        Matrix6X J(6, model->velocities());
        jacobian(*model, data, hand, J);
        EXPECT_LT((J * (with - without)).norm(), 1e-7 * (with - without).norm());
        const Eigen::VectorXd once = forces;
        null_space.project(*model, data, hand, forces);
        EXPECT_LT((forces - once).norm(), 1e-6 * once.norm());
    }
}

TEST(ContactLimits, AreInequalitiesOverTheSameWrenches) {
    std::mt19937 random(6);
    ContactLimits limits;
    limits.faces = 6;
    limits.torsion = 0.2;
    limits.min_force = 0.8;
    limits.max_force = 2.0;
    limits.x_min = limits.y_min = -0.4;
    limits.x_max = limits.y_max = 0.6;
    const Eigen::Matrix3d R = rotation_exp(random_vector(3, random));
    for (const int size : {3, 6}) {
        const int count = contact_rows(size == 6, 6);
        Eigen::MatrixXd rows(count, size + row_extra), C(count + 1, size);
        Eigen::VectorXd d(count + 1);
        contact_limits(R, limits, rows);
        contact_inequalities(R, limits, C, d);
        int kept = 0;
        for (int k = 0; k < 2000; ++k) {
            Eigen::VectorXd f = random_vector(size, random);
            f.head<3>() += 1.2 * R.col(2);
            if (size == 6) f.tail<3>() *= 0.4;
            const Eigen::VectorXd value = rows.leftCols(size) * f;
            const bool by_rows = ((value - rows.col(size)).array() >= 0.0).all() &&
                                 ((value - rows.col(size + 1)).array() <= 0.0).all();
            EXPECT_EQ(by_rows, ((C * f - d).array() <= 0.0).all());
            kept += by_rows;
        }
        EXPECT_GT(kept, 20);
        EXPECT_LT(kept, 1980);
    }
}

} // namespace bf::dynamics::test

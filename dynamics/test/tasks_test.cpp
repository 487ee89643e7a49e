#include "bf/dynamics/tasks.hpp"

#include "robots.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <array>
#include <functional>

namespace bf::dynamics::test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Kind = Target::Kind;

const Model& robot() {
    static const Model model = Model::load(icub, icub_joints);
    return model;
}
const int v = 29, n = 23;

/// What a task asks for besides its target, at random.
struct Request {
    VectorXd velocity, acceleration, kp, kd, weight;
    Request(int rows, std::mt19937& random)
        : velocity(random_vector(rows, random)), acceleration(random_vector(rows, random)),
          kp(10.0 * random_vector(rows, random).cwiseAbs()), kd(5.0 * random_vector(rows, random).cwiseAbs()),
          weight(random_vector(rows, random).cwiseAbs()) {}
    Wanted wanted() const { return {velocity, acceleration, kp, kd, weight}; }
    VectorXd answer(const VectorXd& error, const VectorXd& now) const {
        return acceleration + kd.cwiseProduct(velocity - now) + kp.cwiseProduct(error);
    }
};

Eigen::Matrix4d random_pose(std::mt19937& random) { return random_state(1, random).w_H_b; }

/// Accelerates as the rows ask, and compares the change of a velocity with what it should be.
void expect_motion(const State& state, const MatrixXd& rows, const VectorXd& expected,
                   const std::function<VectorXd(Data&)>& velocity) {
    const MatrixXd A = rows.leftCols(v);
    const VectorXd nu_dot = A.completeOrthogonalDecomposition().solve(rows.col(v));
    const auto at = [&](double dt) {
        // Half the change of velocity is the mean one over dt.
        State mean = state;
        mean.nu_base += 0.5 * dt * nu_dot.head<6>();
        mean.s_dot += 0.5 * dt * nu_dot.tail(n);
        State later = moved(mean, dt);
        later.nu_base = state.nu_base + dt * nu_dot.head<6>();
        later.s_dot = state.s_dot + dt * nu_dot.tail(n);
        Data data(robot());
        set(robot(), data, later);
        return velocity(data);
    };
    const double dt = 1e-4;
    EXPECT_LT(((at(dt) - at(-dt)) / (2.0 * dt) - expected).norm(), 1e-4 * (1.0 + expected.norm()));
    EXPECT_EQ(rows.col(v), rows.col(v + 1));
}

} // namespace

TEST(Tasks, OfAFrameAccelerateItByFeedForwardAndErrors) {
    std::mt19937 random(1);
    const Frame hand = robot().frame("r_hand");
    for (int k = 0; k < 6; ++k) {
        const Kind kind =
            std::array{Kind::position, Kind::orientation, Kind::pose}[static_cast<std::size_t>(k % 3)];
        const int count = kind == Kind::pose ? 6 : 3, first = kind == Kind::orientation ? 3 : 0;
        const State state = random_state(n, random);
        const Eigen::Matrix4d target = random_pose(random);
        const Request request(count, random);
        Data data(robot());
        set(robot(), data, state);
        MatrixXd rows(count, v + 3);
        VectorXd error(count);
        Matrix6X J(6, v);
        cartesian_task(robot(), data, hand, kind, target, request.wanted(), rows, error, J);
        const VectorXd now = (J * state.nu()).segment(first, count);
        EXPECT_EQ(rows.leftCols(v), J.middleRows(first, count));
        EXPECT_EQ(rows.col(v + 2), request.weight);
        expect_motion(state, rows, request.answer(error, now), [&](Data& later) {
            Vector6 velocity;
            frame_velocity(robot(), later, hand, velocity);
            return VectorXd(velocity.segment(first, count));
        });

        // The error leads to the target: p + e = p_target, exp(e) R = R_target.
        Eigen::Matrix4d H;
        forward_kinematics(robot(), data, hand, H);
        if (kind != Kind::orientation) {
            EXPECT_LT((H.block<3, 1>(0, 3) + error.head<3>() - target.block<3, 1>(0, 3)).norm(), 1e-12);
        }
        if (kind == Kind::position) continue;
        const Eigen::Vector3d e = error.tail<3>();
        EXPECT_LE(e.norm(), M_PI + 1e-12);
        Eigen::Matrix3d power = Eigen::Matrix3d::Identity(), rotation = power, cross;
        cross << 0, -e.z(), e.y(), e.z(), 0, -e.x(), -e.y(), e.x(), 0;
        for (int i = 1; i < 40; ++i) rotation += (power = (power * cross / i).eval()); // the series of exp
        EXPECT_LT((rotation * H.topLeftCorner<3, 3>() - target.topLeftCorner<3, 3>()).norm(), 1e-9);
    }
}

TEST(Tasks, OfTheCentreOfMassAccelerateIt) {
    std::mt19937 random(2);
    for (int k = 0; k < 3; ++k) {
        const State state = random_state(n, random);
        const Eigen::Vector3d target = random_vector(3, random);
        const Request request(3, random);
        Data data(robot());
        set(robot(), data, state);
        MatrixXd rows(3, v + 3);
        VectorXd error(3);
        com_task(robot(), data, target, request.wanted(), rows, error);
        Eigen::Vector3d com, now;
        center_of_mass(robot(), data, com);
        center_of_mass_velocity(robot(), data, now);
        EXPECT_LT((error - (target - com)).norm(), 1e-14);
        expect_motion(state, rows, request.answer(error, now), [](Data& later) {
            Eigen::Vector3d velocity;
            center_of_mass_velocity(robot(), later, velocity);
            return VectorXd(velocity);
        });
    }
}

TEST(Tasks, OfTheMomentumChangeIt) {
    std::mt19937 random(3);
    for (int k = 0; k < 3; ++k) {
        const State state = random_state(n, random);
        const Vector6 target = random_vector(6, random), rate = random_vector(6, random);
        const VectorXd gain = random_vector(6, random).cwiseAbs(),
                       weight = random_vector(6, random).cwiseAbs();
        Data data(robot());
        set(robot(), data, state);
        MatrixXd rows(6, v + 3);
        VectorXd error(6);
        momentum_task(robot(), data, target, rate, gain, weight, rows, error);
        Vector6 now;
        centroidal_momentum(robot(), data, now);
        EXPECT_EQ(error, target - now);
        EXPECT_EQ(rows.col(v + 2), weight);
        expect_motion(state, rows, rate + gain.cwiseProduct(error), [](Data& later) {
            Vector6 momentum;
            centroidal_momentum(robot(), later, momentum);
            return VectorXd(momentum);
        });
    }
}

TEST(Tasks, OfThePostureAreOneJointEach) {
    std::mt19937 random(4);
    const State state = random_state(n, random);
    const VectorXd target = random_vector(n, random);
    const Request request(n, random);
    MatrixXd rows(n, v + 3);
    VectorXd error(n);
    posture_task(robot(), state.s, state.s_dot, target, request.wanted(), rows, error);
    EXPECT_EQ(error, target - state.s);
    EXPECT_EQ(rows.leftCols<6>().norm(), 0.0);
    EXPECT_EQ(rows.middleCols(6, n), MatrixXd::Identity(n, n));
    EXPECT_LT((rows.col(v) - request.answer(target - state.s, state.s_dot)).norm(), 1e-12);
    EXPECT_EQ(rows.col(v + 1), rows.col(v));
    EXPECT_EQ(rows.col(v + 2), request.weight);
}

TEST(Tasks, OfAPlacedContactTakeItsVelocityAway) {
    std::mt19937 random(5);
    const Frame sole = robot().frame("l_sole");
    for (const int count : {3, 6}) {
        const State state = random_state(n, random);
        Data data(robot());
        set(robot(), data, state);
        MatrixXd rows(count, v + 3);
        Matrix6X J(6, v);
        rigid_contact(robot(), data, sole, 7.0, rows, J);
        const VectorXd now = (J * state.nu()).head(count);
        expect_motion(state, rows, -7.0 * now, [&](Data& later) {
            Vector6 velocity;
            frame_velocity(robot(), later, sole, velocity);
            return VectorXd(velocity.head(count));
        });
        EXPECT_EQ(rows.col(v + 2), VectorXd::Ones(count));
    }
}

TEST(Tasks, HaveEquationsOfMotionThatInverseDynamicsConfirms) {
    std::mt19937 random(6);
    const State state = random_state(n, random);
    const std::vector<Contact> contacts{{robot().frame("l_sole"), 6}, {robot().frame("r_hand"), 3}};
    Data data(robot());
    set(robot(), data, state);
    MatrixXd matrix(v, v + 9);
    VectorXd h(v), tau(v);
    Matrix6X J(6, v);
    motion_equations(robot(), data, contacts, matrix, h, J);
    const VectorXd x = random_vector(v + 9, random);
    inverse_dynamics(robot(), data, x.head<6>(), x.segment(6, n), tau);
    add_wrench(robot(), data, contacts[0].frame, -x.segment<6>(v), tau);
    Vector6 force = Vector6::Zero();
    force.head<3>() = -x.tail<3>();
    add_wrench(robot(), data, contacts[1].frame, force, tau);
    EXPECT_LT((matrix * x + h - tau).norm(), 1e-10 * tau.norm());
}

TEST(ContactLimits, HoldExactlyTheWrenchesOfPressedCornersWithinThePyramid) {
    std::mt19937 random(7);
    ContactLimits limits{.faces = 6,
                         .friction = 0.7,
                         .torsion = 0.02,
                         .min_force = 5.0,
                         .max_force = 400.0,
                         .x_min = -0.05,
                         .x_max = 0.1,
                         .y_min = -0.03,
                         .y_max = 0.04};
    const Eigen::Matrix3d R = random_state(1, random).w_H_b.topLeftCorner<3, 3>();
    MatrixXd rows(contact_rows(true, 6), 9);
    contact_limits(R, limits, rows);
    const auto holds = [&](const Vector6& in_frame) {
        Vector6 f;
        f << R * in_frame.head<3>(), R * in_frame.tail<3>();
        const VectorXd value = rows.leftCols(6) * f;
        return (value.array() >= rows.col(6).array() - 1e-9).all() &&
               (value.array() <= rows.col(7).array() + 1e-9).all();
    };
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int k = 0; k < 300; ++k) {
        // Forces at one corner or at all, each a mixture of the edges of the pyramid, which lie on the cone.
        Vector6 f = Vector6::Zero();
        int corner = 0;
        for (const double x : {limits.x_min, limits.x_max})
            for (const double y : {limits.y_min, limits.y_max})
                for (int edge = k % 5 == 4 || corner++ == k % 5 ? 0 : 6; edge < 6; ++edge) {
                    const double angle = M_PI / 6.0 + M_PI / 3.0 * edge, size = 12.0 * uniform(random);
                    const Eigen::Vector3d force(0.7 * size * std::cos(angle), 0.7 * size * std::sin(angle),
                                                size);
                    f.head<3>() += force;
                    f.tail<3>() += Eigen::Vector3d(x, y, 0.0).cross(force);
                }
        f[5] = 0.02 * f[2] * (2.0 * uniform(random) - 1.0);
        EXPECT_TRUE(holds(f));
        // None of the limits is loose: twice the tangential force, a pressure beyond each edge, more torsion.
        const double z = f[2];
        for (const Vector6& outside :
             {Vector6(0.71 * z * std::cos(M_PI / 6), 0.71 * z * std::sin(M_PI / 6), z, 0, 0, 0),
              Vector6(0.7 * z, 0, z, 0, 0, 0), Vector6(0, 0, z, 0, -0.101 * z, 0),
              Vector6(0, 0, z, 0, 0.051 * z, 0), Vector6(0, 0, z, 0.041 * z, 0, 0),
              Vector6(0, 0, z, -0.031 * z, 0, 0), Vector6(0, 0, z, 0, 0, 0.021 * z),
              Vector6(0, 0, z, 0, 0, -0.021 * z), Vector6(0, 0, 4.9, 0, 0, 0), Vector6(0, 0, 401, 0, 0, 0)})
            EXPECT_FALSE(holds(outside)) << outside.transpose();
    }
    for (int edge = 0; edge < 6; ++edge) {
        const double angle = M_PI / 6.0 + M_PI / 3.0 * edge;
        EXPECT_TRUE(holds({0.7 * 9 * std::cos(angle), 0.7 * 9 * std::sin(angle), 9, 0, 0, 0}))
            << "an edge of the pyramid";
    }
}

TEST(ContactLimits, OfAPointAreThoseOfASurfaceWithoutMoments) {
    ContactLimits limits{.faces = 4, .friction = 0.5, .min_force = 1.0};
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    MatrixXd point(contact_rows(false, 4), 6), surface(contact_rows(true, 4), 9);
    contact_limits(R, limits, point);
    contact_limits(R, limits, surface);
    ASSERT_EQ(point.rows(), 5);
    EXPECT_EQ(point.leftCols<3>(), surface.topLeftCorner(5, 3));
    EXPECT_EQ(point.rightCols<3>(), surface.topRightCorner(5, 3));
    EXPECT_EQ(surface.block(0, 3, 5, 3).norm(), 0.0);
    // Four faces bound two components of the force by themselves.
    for (int k = 0; k < 2; ++k)
        EXPECT_LT((R.transpose() * (point.row(k).head<3>() - point.row(k + 2).head<3>()).transpose() -
                   2.0 * Eigen::Vector3d::Unit(k))
                      .norm(),
                  1e-12);
}

TEST(AccelerationBounds, KeepAJointWithinItsLimitsForEver) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int k = 0; k < 60; ++k) {
        const double T = 0.002 + 0.02 * uniform(random), speed = k % 3 == 0 ? infinity : 1.5,
                     a_max = 5.0 + 20.0 * uniform(random);
        const double low = -1.0, high = k % 4 == 0 ? infinity : 0.5;
        double s = 0.0, s_dot = 0.0;
        for (int step = 0; step < 2000; ++step) {
            const auto bounds = acceleration_bounds(s, s_dot, low, high, speed, a_max, T);
            ASSERT_LE(bounds.lower, bounds.upper);
            ASSERT_GE(bounds.lower, -a_max);
            ASSERT_LE(bounds.upper, a_max);
            // Long pushes to one side and to the other, and anything between.
            const double mix = step / 150 % 3 == 0 ? 1.0 : step / 150 % 3 == 1 ? 0.0 : uniform(random);
            const double a = bounds.lower + mix * (bounds.upper - bounds.lower);
            if (s_dot * (s_dot + T * a) < 0.0) { // it turns within the period
                const double turn = s - 0.5 * s_dot * s_dot / a;
                ASSERT_GE(turn, low - 1e-9);
                ASSERT_LE(turn, high + 1e-9);
            }
            s += T * s_dot + 0.5 * T * T * a;
            s_dot += T * a;
            ASSERT_GE(s, low - 1e-9) << "run " << k << ", step " << step;
            ASSERT_LE(s, high + 1e-9) << "run " << k << ", step " << step;
            ASSERT_LE(std::abs(s_dot), speed + 1e-9);
        }
    }
}

TEST(AccelerationBounds, AreNoTighterThanTheyMustBe) {
    // One that is pushed harder once cannot be stopped before the limit by the most that it may brake with.
    std::mt19937 random(9);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const double T = 0.01, a_max = 10.0, high = 0.5;
    int tried = 0;
    for (int k = 0; k < 2000; ++k) {
        double s = high - 0.3 * uniform(random), s_dot = 2.0 * uniform(random);
        const auto bounds = acceleration_bounds(s, s_dot, -infinity, high, infinity, a_max, T);
        if (bounds.upper >= a_max || bounds.upper <= -a_max) continue;
        ++tried;
        double a = bounds.upper + 1e-3, largest = s;
        for (int step = 0; step < 100; ++step, a = -a_max) {
            if (s_dot > 0.0 && s_dot + T * a < 0.0) largest = std::max(largest, s - 0.5 * s_dot * s_dot / a);
            s += T * s_dot + 0.5 * T * T * a;
            s_dot += T * a;
            largest = std::max(largest, s);
        }
        EXPECT_GT(largest, high) << k;
    }
    EXPECT_GT(tried, 100);
}

TEST(AccelerationBounds, LeadBackFromOutside) {
    for (const double s_dot : {-1.0, 0.0, 2.0}) {
        const auto above = acceleration_bounds(1.2, s_dot, -1, 1, 3, 8, 0.01),
                   below = acceleration_bounds(-1.2, -s_dot, -1, 1, 3, 8, 0.01);
        EXPECT_EQ(above.lower, -8.0);
        EXPECT_EQ(above.upper, -8.0);
        EXPECT_EQ(below.lower, 8.0);
        EXPECT_EQ(below.upper, 8.0);
    }
    EXPECT_EQ(acceleration_bounds(0, 9, -1, 1, 3, 8, 0.01).upper, -8.0) << "too fast";
}

} // namespace bf::dynamics::test

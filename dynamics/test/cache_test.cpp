#include "bf/dynamics/inverse_kinematics.hpp"
#include "heap.hpp"
#include "robots.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

namespace bf::dynamics::test {
namespace {

using bf::test::heap_calls;

class Cache : public testing::Test {
  protected:
    Quantities fresh(const State& at) {
        Data fresh_data(model);
        set(model, fresh_data, at);
        return ask(fresh_data);
    }

    Quantities ask(Data& of) {
        Quantities result(model);
        result.compute(model, of, frame, reference, nu_dot);
        return result;
    }

    std::mt19937 random{3};
    Model model = Model::load(icub, icub_joints);
    Data data{model};
    State state = random_state(model.joints(), random), other = random_state(model.joints(), random);
    Eigen::VectorXd nu_dot = random_vector(model.velocities(), random);
    Frame frame = model.frame("l_sole"), reference = model.frame("r_hand");
};

} // namespace

TEST_F(Cache, RelativeQuantitiesDependOnTheJointPositionsAloneBitForBit) {
    const auto relative = [&](Data& of) {
        Quantities result(model);
        set_joint_position(model, of, other.s);
        relative_transform(model, of, reference, frame, result.relative);
        relative_jacobian(model, of, reference, frame, result.relative_J);
        return std::pair(result.relative, result.relative_J);
    };
    set(model, data, state);
    ask(data);
    Data fresh_data(model);
    EXPECT_EQ(relative(data), relative(fresh_data));
}

TEST_F(Cache, ChangingOneInputAtATimeGivesWhatFreshDataGives) {
    set(model, data, state);
    ask(data);
    const auto change = [&](const char* what, auto&& apply) {
        SCOPED_TRACE(what);
        const Quantities before = fresh(state);
        apply();
        const Quantities after = fresh(state);
        EXPECT_FALSE(before == after) << "the change must matter";
        set(model, data, state);
        EXPECT_TRUE(ask(data) == after);
    };
    for (int round = 0; round < 2; ++round) {
        change("base position", [&] { state.w_H_b.col(3) = other.w_H_b.col(3); });
        change("base rotation", [&] { state.w_H_b.leftCols<3>() = other.w_H_b.leftCols<3>(); });
        change("one joint position", [&] { state.s[4] = other.s[4]; });
        change("all joint positions", [&] { state.s = other.s; });
        change("base linear velocity", [&] { state.nu_base.head<3>() = other.nu_base.head<3>(); });
        change("base angular velocity", [&] { state.nu_base.tail<3>() = other.nu_base.tail<3>(); });
        change("one joint velocity", [&] { state.s_dot[22] = other.s_dot[22]; });
        change("all joint velocities", [&] { state.s_dot = other.s_dot; });
        other = random_state(model.joints(), random);
    }
}

TEST_F(Cache, OrderOfQuestionsDoesNotMatter) {
    const Quantities expected = fresh(state);
    set(model, data, state);
    Quantities result(model);
    centroidal_momentum(model, data, result.H);
    relative_jacobian(model, data, reference, frame, result.relative_J);
    inverse_dynamics(model, data, nu_dot.head<6>(), nu_dot.tail(model.joints()), result.tau);
    com_bias_acceleration(model, data, result.com_J_dot_nu);
    mass_matrix(model, data, result.M);
    jacobian(model, data, frame, result.J);
    EXPECT_EQ(result.H, expected.H);
    EXPECT_EQ(result.relative_J, expected.relative_J);
    EXPECT_EQ(result.tau, expected.tau);
    EXPECT_EQ(result.com_J_dot_nu, expected.com_J_dot_nu);
    EXPECT_EQ(result.M, expected.M);
    EXPECT_EQ(result.J, expected.J);
}

TEST_F(Cache, CallersThatOnlyKnowThePositionKeepTheVelocities) {
    set(model, data, state);
    set_position(model, data, other.w_H_b, other.s);
    State mixed = other;
    mixed.nu_base = state.nu_base;
    mixed.s_dot = state.s_dot;
    EXPECT_TRUE(ask(data) == fresh(mixed));
    set_joint_position(model, data, state.s);
    mixed.s = state.s;
    EXPECT_TRUE(ask(data) == fresh(mixed));
}

TEST_F(Cache, QuestionsOnAStateSetAgainAreAnsweredFromTheCache) {
    using Clock = std::chrono::steady_clock;
    Quantities result(model);
    const auto expect_cached = [&](const char* what, auto&& question) {
        const auto fastest = [&](const State& a, const State& b) { // of many, because machines are shared
            auto best = Clock::duration::max();
            for (int repetition = 0; repetition < 2000; ++repetition) {
                const auto begin = Clock::now();
                for (const State* at : {&a, &b, &a, &b}) {
                    set(model, data, *at);
                    question();
                }
                best = std::min(best, Clock::now() - begin);
            }
            return best;
        };
        const auto same = fastest(state, state);
        EXPECT_LT(3 * same, fastest(state, other)) << what;
    };
    expect_cached("kinematics", [&] { forward_kinematics(model, data, frame, result.w_H_f); });
    expect_cached("inertia", [&] { center_of_mass(model, data, result.com); });
    expect_cached("bias", [&] { bias_forces(model, data, result.h); });
    expect_cached("momentum", [&] { centroidal_momentum(model, data, result.H); });
}

TEST_F(Cache, DefaultStateIsAtRestAtTheOrigin) {
    State rest;
    rest.s = rest.s_dot = Eigen::VectorXd::Zero(model.joints());
    rest.nu_base.setZero();
    EXPECT_TRUE(ask(data) == fresh(rest));
    EXPECT_EQ(ask(data).H, Vector6::Zero());
}

TEST_F(Cache, ModelIsSharedByThreadsWithTheirOwnData) {
    const Quantities expected = fresh(state), expected_other = fresh(other);
    bool right = true;
    std::thread thread([&] {
        for (int i = 0; i < 200; ++i) right = right && fresh(other) == expected_other;
    });
    for (int i = 0; i < 200; ++i) EXPECT_TRUE(fresh(state) == expected);
    thread.join();
    EXPECT_TRUE(right);
}

TEST_F(Cache, AlgorithmsDoNotAllocate) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP() << "not counted here";
    Quantities result(model);
    long before = heap_calls();
    const Eigen::VectorXd counted(10);
    [[maybe_unused]] const double* const volatile seen = counted.data(); // otherwise clang leaves it out
    ASSERT_GT(heap_calls(), before) << "the counter must see Eigen";
    before = heap_calls();
    for (int i = 0; i < 3; ++i) {
        set(model, data, state);
        result.compute(model, data, frame, reference, nu_dot);
        set_position(model, data, other.w_H_b, other.s);
        result.compute(model, data, reference, frame, nu_dot);
        set_joint_position(model, data, state.s);
        result.compute(model, data, frame, reference, nu_dot);
    }
    EXPECT_EQ(heap_calls(), before);
}

TEST_F(Cache, InverseKinematicsDoesNotAllocate) {
    const std::vector<Target> targets = {{Target::Kind::pose, frame},
                                         {Target::Kind::position, reference},
                                         {Target::Kind::orientation, reference},
                                         {Target::Kind::center_of_mass, {}}};
    InverseKinematics ik(model, targets, true, {});
    ik.posture_weights.setConstant(1e-3);
    Eigen::Matrix4d w_H_b = state.w_H_b;
    Eigen::VectorXd s = state.s;
    const long before = heap_calls();
    ik.search(w_H_b, s, 3);
    ik.follow(w_H_b, s);
    EXPECT_EQ(heap_calls(), before);
}
} // namespace bf::dynamics::test

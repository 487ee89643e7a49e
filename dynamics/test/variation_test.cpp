// Derivatives beside identities of motions and central differences of states.
#include "bf/dynamics/variation.hpp"

#include "robots.hpp"

#include <gtest/gtest.h>

namespace bf::dynamics {
namespace {

using test::Quantities;
using test::State;

/// Names, values and changes of all quantities that a state and its variation have.
struct Asked {
    std::string name;
    Eigen::VectorXd value;
    Eigen::MatrixXd changes;
};

constexpr int directions = 6; // more than are taken at once

std::vector<Asked> ask(const Model& model, Data& data, Variation& variation, const Eigen::VectorXd& given,
                       const Eigen::MatrixXd& given_changes) {
    const Frame frame = model.frame("l_hand"), reference = model.frame("r_upper_leg");
    Quantities q(model);
    q.compute(model, data, frame, reference, given);
    std::vector<Asked> all;
    const auto add = [&](const char* name, const auto& value, auto&& fill) {
        all.push_back({name, value.reshaped(), Eigen::MatrixXd::Constant(value.size(), directions, 1e9)});
        fill(all.back().changes);
    };
    using Changes = Eigen::MatrixXd&;
    const int n = model.joints(), v = model.velocities();
    add("w_H_f", q.w_H_f, [&](Changes d) { forward_kinematics(model, variation, frame, d); });
    add("J", q.J, [&](Changes d) { jacobian(model, variation, frame, d); });
    add("J_dot_nu", q.J_dot_nu, [&](Changes d) { bias_acceleration(model, variation, frame, d); });
    add("com", q.com, [&](Changes d) { center_of_mass(model, variation, d); });
    add("com_dot", q.com_dot, [&](Changes d) { center_of_mass_velocity(model, variation, d); });
    add("com_J", q.com_J, [&](Changes d) { com_jacobian(model, variation, d); });
    add("com_J_dot_nu", q.com_J_dot_nu, [&](Changes d) { com_bias_acceleration(model, variation, d); });
    add("M", q.M, [&](Changes d) { mass_matrix(model, variation, d); });
    add("h", q.h, [&](Changes d) { bias_forces(model, variation, d); });
    add("g", q.g, [&](Changes d) { gravity_forces(model, variation, d); });
    add("c", q.c, [&](Changes d) { coriolis_forces(model, variation, d); });
    add("C", q.C, [&](Changes d) { coriolis_matrix(model, variation, d); });
    add("M_dot", q.M_dot, [&](Changes d) { mass_matrix_derivative(model, variation, d); });
    add("tau", q.tau, [&](Changes d) {
        inverse_dynamics(model, variation, given.head<6>(), given.tail(n), given_changes.topRows(6),
                         given_changes.bottomRows(n), d);
    });
    add("push", q.push, [&](Changes d) {
        d.setZero();
        add_wrench(model, variation, frame, (test::Vector6() << 1.0, -2.0, 3.0, 0.5, 0.6, -0.7).finished(),
                   Eigen::MatrixXd(), d);
    });
    add("nu_dot", q.nu_dot,
        [&](Changes d) { forward_dynamics(model, variation, q.nu_dot, given_changes.bottomRows(v), d); });
    add("H", q.H, [&](Changes d) { centroidal_momentum(model, variation, d); });
    add("A", q.A, [&](Changes d) { centroidal_momentum_matrix(model, variation, d); });
    add("A_dot_nu", q.A_dot_nu, [&](Changes d) { centroidal_momentum_bias(model, variation, d); });
    add("relative", q.relative,
        [&](Changes d) { relative_transform(model, variation, reference, frame, d); });
    add("relative_J", q.relative_J,
        [&](Changes d) { relative_jacobian(model, variation, reference, frame, d); });
    return all;
}

/// The first direction is that in which the state itself moves; the others are random.
StateChanges random_changes(const State& state, std::mt19937& random) {
    const auto n = state.s.size();
    StateChanges changes{Eigen::MatrixXd::Zero(16, directions), Eigen::MatrixXd(n, directions),
                         Eigen::MatrixXd(6, directions), Eigen::MatrixXd(n, directions)};
    for (int k = 0; k < directions; ++k) {
        const Eigen::VectorXd turn = k == 0 ? Eigen::VectorXd(state.nu_base) : test::random_vector(6, random);
        Eigen::Matrix4d pose = Eigen::Matrix4d::Zero();
        for (int j = 0; j < 3; ++j)
            pose.col(j).head<3>() = turn.tail<3>().head<3>().cross(state.w_H_b.col(j).head<3>());
        pose.col(3).head<3>() = turn.head<3>();
        changes.w_H_b.col(k) = pose.reshaped();
        changes.s.col(k) = k == 0 ? state.s_dot : test::random_vector(n, random);
        changes.nu_base.col(k) = k == 0 ? Eigen::VectorXd::Zero(6) : test::random_vector(6, random);
        changes.s_dot.col(k) = k == 0 ? Eigen::VectorXd::Zero(n) : test::random_vector(n, random);
    }
    return changes;
}

class Variations : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Bases, Variations, testing::Values(true, false));

TEST_P(Variations, OfAllQuantitiesAreThoseOfCentralDifferencesAndAlongTheMotionTheirRates) {
    std::mt19937 random(5);
    const Model model = Model::load(test::icub, test::icub_joints, {0.3, -0.2, -9.81}, {}, GetParam());
    State state = test::random_state(model.joints(), random);
    if (!GetParam()) state.nu_base.setZero();
    const Eigen::VectorXd given = test::random_vector(6 + model.joints(), random);
    Eigen::MatrixXd given_changes(given.size(), directions);
    for (int k = 0; k < directions; ++k) given_changes.col(k) = test::random_vector(given.size(), random);
    given_changes.col(0).setZero();
    auto changes = random_changes(state, random);
    if (!GetParam()) changes.nu_base.setZero();

    Data data(model);
    Variation variation(model);
    const auto set_all = [&](double step, int k) {
        State at = state;
        at.w_H_b += step * changes.w_H_b.col(k).reshaped(4, 4);
        at.s += step * changes.s.col(k);
        at.nu_base += step * changes.nu_base.col(k);
        at.s_dot += step * changes.s_dot.col(k);
        test::set(model, data, at);
    };
    set_all(0, 0);
    set_state(model, variation, state.w_H_b, state.s, state.nu_base, state.s_dot, changes, directions);
    const auto exact = ask(model, data, variation, given, given_changes);
    for (int k = 0; k < directions; ++k) {
        const double step = 1e-6;
        std::vector<std::vector<Asked>> sides;
        for (const double side : {step, -step}) {
            set_all(side, k);
            sides.push_back(ask(model, data, variation, given + side * given_changes.col(k), given_changes));
        }
        for (std::size_t i = 0; i < exact.size(); ++i) {
            const Eigen::VectorXd slope = (sides[0][i].value - sides[1][i].value) / (2 * step);
            EXPECT_LT((exact[i].changes.col(k) - slope).norm(),
                      1e-6 * (1 + slope.norm() + exact[i].value.norm()))
                << exact[i].name << " along direction " << k;
        }
    }

    // Identities of the motion, exact to rounding.
    const auto find = [&](const char* name) -> const Asked& {
        for (const auto& one : exact)
            if (one.name == name) return one;
        throw std::runtime_error(name);
    };
    const Eigen::VectorXd nu = state.nu().tail(model.velocities());
    const auto rate = [&](const char* name) -> Eigen::VectorXd { return find(name).changes.col(0); };
    const auto near = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b, const char* what) {
        EXPECT_LT((a - b).norm(), 1e-11 * (1 + b.norm())) << what;
    };
    near(rate("M"), find("M_dot").value, "dM/dt");
    near(rate("com"), find("com_dot").value, "d com/dt");
    near(rate("J").reshaped(6, nu.size()) * nu, find("J_dot_nu").value, "dJ/dt nu");
    near(rate("com_J").reshaped(3, nu.size()) * nu, find("com_J_dot_nu").value, "dJ_com/dt nu");
    near(rate("A").reshaped(6, nu.size()) * nu, find("A_dot_nu").value, "dA/dt nu");
    near(rate("H"), find("A_dot_nu").value, "dH/dt");
}

TEST(Variation, KeepsWhatIsComputedWhileItsStateStays) {
    std::mt19937 random(6);
    const Model model = Model::load(test::icub, test::icub_joints);
    const State state = test::random_state(model.joints(), random);
    const auto changes = random_changes(state, random);
    Variation kept(model), fresh(model);
    Eigen::MatrixXd a(model.velocities(), directions), b(a), unused(6 * model.velocities(), directions);
    set_state(model, kept, state.w_H_b, state.s, state.nu_base, state.s_dot, changes, directions);
    bias_forces(model, kept, a);
    // Fewer directions and the position alone, and then the whole state again.
    StateChanges fewer{changes.w_H_b.leftCols(3), changes.s.leftCols(3), {}, {}};
    set_position(model, kept, state.w_H_b, state.s, fewer, 3);
    jacobian(model, kept, model.frame("l_hand"), unused);
    set_state(model, kept, state.w_H_b, state.s, state.nu_base, state.s_dot, changes, directions);
    bias_forces(model, kept, a);
    set_state(model, fresh, state.w_H_b, state.s, state.nu_base, state.s_dot, changes, directions);
    bias_forces(model, fresh, b);
    EXPECT_EQ(a, b);
}

} // namespace
} // namespace bf::dynamics

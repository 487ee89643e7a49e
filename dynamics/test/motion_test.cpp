// Forward dynamics, Coriolis terms and time derivatives, beside Pinocchio and the identities that define
// them.
#include "robots.hpp"

#include <gtest/gtest.h>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace bf::dynamics::test {
namespace {

using VectorIn = Eigen::Ref<const Eigen::VectorXd>; // Pinocchio's library is compiled for these arguments

/// Pinocchio, whose base has its velocity and its forces in its own axes.
class Pinocchio {
  public:
    Pinocchio(const std::string& urdf, const Model& model) : ours_(model) {
        if (model.has_floating_base())
            pinocchio::urdf::buildModel(urdf, pinocchio::JointModelFreeFlyer(), full_);
        else
            pinocchio::urdf::buildModel(urdf, full_);
        std::vector<pinocchio::JointIndex> locked;
        const auto& names = model.joint_names();
        for (pinocchio::JointIndex i = model.has_floating_base() ? 2 : 1; i < full_.names.size(); ++i)
            if (std::find(names.begin(), names.end(), full_.names[i]) == names.end()) locked.push_back(i);
        model_ = pinocchio::buildReducedModel(full_, locked, pinocchio::neutral(full_));
        model_.gravity.linear(model.gravity());
        data_ = pinocchio::Data(model_);
    }

    void set(const State& state) {
        R_ = state.w_H_b.topLeftCorner<3, 3>();
        q_ = pinocchio::neutral(model_);
        v_.setZero(model_.nv);
        if (ours_.has_floating_base()) {
            q_.head<3>() = state.w_H_b.topRightCorner<3, 1>();
            q_.segment<4>(3) = Eigen::Quaterniond(R_).coeffs();
            v_.head<3>() = R_.transpose() * state.nu_base.head<3>();
            v_.segment<3>(3) = R_.transpose() * state.nu_base.tail<3>();
        }
        for (int k = 0; k < ours_.joints(); ++k) {
            const auto i = joint(k);
            const auto at = model_.idx_qs[i];
            q_[at] = model_.nqs[i] == 2 ? std::cos(state.s[k]) : state.s[k];
            if (model_.nqs[i] == 2) q_[at + 1] = std::sin(state.s[k]);
            v_[model_.idx_vs[i]] = state.s_dot[k];
        }
    }

    /// nu_dot of generalised forces.
    Eigen::VectorXd accelerations(const Eigen::VectorXd& forces) {
        const int base = ours_.velocities() - ours_.joints();
        Eigen::VectorXd tau = Eigen::VectorXd::Zero(model_.nv), nu_dot = forces;
        for (int k = 0; k < ours_.joints(); ++k) tau[model_.idx_vs[joint(k)]] = forces[base + k];
        for (int at = 0; at < base; at += 3) tau.segment<3>(at) = R_.transpose() * forces.segment<3>(at);
        const Eigen::VectorXd a = pinocchio::aba(model_, data_, VectorIn(q_), VectorIn(v_), VectorIn(tau));
        for (int k = 0; k < ours_.joints(); ++k) nu_dot[base + k] = a[model_.idx_vs[joint(k)]];
        if (base == 0) return nu_dot;
        const Eigen::Vector3d v = v_.head<3>(), omega = v_.segment<3>(3);
        nu_dot.head<3>() =
            R_ * (a.head<3>() + omega.cross(v)); // of the origin, not of the point at rest there
        nu_dot.segment<3>(3) = R_ * a.segment<3>(3);
        return nu_dot;
    }

    /// C of a fixed base.
    Eigen::MatrixXd coriolis() {
        const Eigen::MatrixXd theirs =
            pinocchio::computeCoriolisMatrix(model_, data_, VectorIn(q_), VectorIn(v_));
        Eigen::MatrixXd C(model_.nv, model_.nv);
        for (int i = 0; i < C.rows(); ++i)
            for (int j = 0; j < C.cols(); ++j)
                C(i, j) = theirs(model_.idx_vs[joint(i)], model_.idx_vs[joint(j)]);
        return C;
    }

  private:
    pinocchio::JointIndex joint(int k) const {
        return model_.getJointId(ours_.joint_names()[static_cast<std::size_t>(k)]);
    }

    Model ours_;
    pinocchio::Model full_, model_;
    pinocchio::Data data_;
    Eigen::Matrix3d R_;
    Eigen::VectorXd q_, v_;
};

void expect_near(const Eigen::MatrixXd& ours, const Eigen::MatrixXd& theirs, double tolerance,
                 const std::string& what) {
    EXPECT_LT((ours - theirs).cwiseAbs().maxCoeff(), tolerance * std::max(1.0, theirs.cwiseAbs().maxCoeff()))
        << what;
}

/// The difference quotient of a quantity along a motion of constant nu.
template <class Of> auto rate(const Model& model, Data& data, const State& state, const Of& of) {
    const double dt = 1e-6;
    set(model, data, moved(state, dt));
    const auto after = of();
    set(model, data, moved(state, -dt));
    const auto before = of();
    set(model, data, state);
    return ((after - before) / (2.0 * dt)).eval();
}

/// All that defines the quantities, from M, h, g, J and A alone.
void check_identities(const Model& model, Data& data, State state, std::mt19937& random) {
    if (!model.has_floating_base()) state.nu_base.setZero();
    const Frame frame{static_cast<int>(model.frame_names().size()) - 1};
    const Eigen::VectorXd nu = state.nu().tail(model.velocities());
    const Eigen::VectorXd given = random_vector(6 + model.joints(), random);
    Quantities of(model), again(model);
    set(model, data, state);
    of.compute(model, data, frame, frame, given);
    expect_near(of.c, of.h - of.g, 1e-10, "c = h - g");
    expect_near(of.C * nu, of.c, 1e-10, "C nu");
    const Eigen::MatrixXd M_dot = rate(model, data, state, [&] {
        mass_matrix(model, data, again.M);
        return again.M;
    });
    expect_near(of.C + of.C.transpose(), M_dot, 1e-6, "C + C'");
    expect_near(of.M_dot, M_dot, 1e-6, "dM/dt");
    const Eigen::VectorXd A_dot_nu = rate(model, data, state, [&] {
        centroidal_momentum_matrix(model, data, again.A);
        return (again.A * nu).eval();
    });
    expect_near(of.A_dot_nu, A_dot_nu, 1e-6, "dA/dt nu");
    expect_near(of.push, of.J.transpose() * Vector6(1.0, -2.0, 3.0, 0.5, 0.6, -0.7), 1e-12, "J' f");
    expect_near(of.M * of.nu_dot + of.h, given.tail(model.velocities()), 1e-8, "forward dynamics");
}

void compare_with_pinocchio(Pinocchio&& pinocchio, const Model& model, std::mt19937& random) {
    Data data(model);
    Eigen::VectorXd nu_dot(model.velocities());
    Eigen::MatrixXd C(model.velocities(), model.velocities());
    for (int trial = 0; trial < 5; ++trial) {
        State state = random_state(model.joints(), random);
        if (!model.has_floating_base()) {
            state.w_H_b.setIdentity();
            state.nu_base.setZero();
        }
        set(model, data, state);
        pinocchio.set(state);
        const Eigen::VectorXd forces = random_vector(model.velocities(), random);
        ASSERT_EQ(forward_dynamics(model, data, forces, nu_dot), -1);
        expect_near(nu_dot, pinocchio.accelerations(forces), 1e-8, "forward dynamics");
        if (model.has_floating_base()) continue;
        coriolis_matrix(model, data, C);
        expect_near(C, pinocchio.coriolis(), 1e-10, "C");
    }
}

} // namespace

TEST(Motion, AgreesWithPinocchioOnICub) {
    std::mt19937 random(1);
    for (const bool floats : {true, false}) {
        for (const auto& joints : {icub_joints, {}}) {
            const Model model = Model::load(icub, joints, {0.5, -0.3, -9.7}, {}, floats);
            compare_with_pinocchio(Pinocchio(icub, model), model, random);
        }
    }
}

TEST(Motion, KeepsTheIdentitiesThatDefineItOnICub) {
    std::mt19937 random(2);
    for (const bool floats : {true, false}) {
        const Model model = Model::load(icub, icub_joints, {0.5, -0.3, -9.7}, {}, floats);
        Data data(model);
        for (int trial = 0; trial < 5; ++trial)
            check_identities(model, data, random_state(model.joints(), random), random);
    }
}

/// C(i, j) = ½ Σ (∂M_ij/∂s_k + ∂M_ik/∂s_j - ∂M_jk/∂s_i) s_dot_k, with difference quotients of M.
TEST(Motion, HasTheCoriolisMatrixOfTheChristoffelSymbols) {
    std::mt19937 random(3);
    const Model model =
        Model::load(icub, {"torso_yaw", "torso_pitch", "l_shoulder_roll", "l_elbow", "r_knee"},
                    {0.0, 0.0, -9.81}, {}, false);
    Data data(model);
    State state = random_state(5, random);
    state.nu_base.setZero();
    std::vector<Eigen::MatrixXd> by; // derivative of M by each joint
    for (int k = 0; k < 5; ++k) {
        State along = state;
        along.s_dot = Eigen::VectorXd::Unit(5, k);
        by.push_back(rate(model, data, along, [&] {
            Eigen::MatrixXd M(5, 5);
            mass_matrix(model, data, M);
            return M;
        }));
    }
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(5, 5), C(5, 5);
    const auto at = [&](int k) -> const Eigen::MatrixXd& { return by[static_cast<std::size_t>(k)]; };
    for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j)
            for (int k = 0; k < 5; ++k)
                expected(i, j) += 0.5 * (at(k)(i, j) + at(j)(i, k) - at(i)(j, k)) * state.s_dot[k];
    set(model, data, state);
    coriolis_matrix(model, data, C);
    expect_near(C, expected, 1e-7, "C");
}

/// What an external wrench does shows in the frame's acceleration alone: J nu_dot changes by J M⁻¹ Jᵀ f.
TEST(Motion, OfAWrenchIsThatOfItsGeneralisedForces) {
    std::mt19937 random(4);
    const Model model = Model::load(icub, icub_joints);
    Data data(model);
    set(model, data, random_state(model.joints(), random));
    const Frame frame = model.frame("r_hand");
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(29), with(29), without(29);
    Quantities of(model);
    of.compute(model, data, frame, frame, Eigen::VectorXd::Zero(29));
    const Vector6 f = random_vector(6, random);
    ASSERT_EQ(forward_dynamics(model, data, forces, without), -1);
    add_wrench(model, data, frame, f, forces);
    ASSERT_EQ(forward_dynamics(model, data, forces, with), -1);
    expect_near(with - without, of.M.ldlt().solve(of.J.transpose() * f), 1e-9, "nu_dot");
}

TEST(Motion, NamesWhatMovesNoInertia) {
    const auto path =
        std::filesystem::temp_directory_path() / ("bf_massless_" + std::to_string(getpid()) + ".urdf");
    std::ofstream(path) << R"(<robot name="r"><link name="base"><inertial><mass value="3"/>
      <inertia ixx="1" iyy="2" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="none"/>
      <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
      <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="tip"/>
      <joint name="a" type="continuous"><parent link="base"/><child link="none"/><axis xyz="0 1 0"/></joint>
      <joint name="b" type="continuous"><parent link="none"/><child link="arm"/><axis xyz="0 1 0"/></joint>
      <joint name="c" type="continuous"><parent link="arm"/><child link="tip"/><axis xyz="0 0 1"/></joint>
      </robot>)";
    const auto singular = [&](const std::vector<std::string>& joints, bool floats) {
        const Model model = Model::load(path, joints, {0.0, 0.0, -9.81}, {}, floats);
        Data data(model);
        Eigen::VectorXd forces = Eigen::VectorXd::Zero(model.velocities()), nu_dot = forces;
        return forward_dynamics(model, data, forces, nu_dot);
    };
    EXPECT_EQ(singular({"a"}, true), -1);
    EXPECT_EQ(singular({"a", "b"}, true), 6) << "two joints about one axis, with nothing between them";
    EXPECT_EQ(singular({"b", "a"}, false), 1);
    EXPECT_EQ(singular({"a", "c"}, false), 1) << "a tip without mass";
    std::filesystem::remove(path);
}

TEST(Motion, OfManyRobotsKeepsTheIdentitiesAndAgreesWithPinocchio) {
    const std::filesystem::path folder =
        BF_BINARY_DIRECTORY "/robots/cmeel.prefix/share/example-robot-data/robots";
    if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is missing: make robots";
    std::mt19937 random(5);
    int tried = 0, compared = 0;
    for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
        if (file.path().extension() != ".urdf") continue;
        SCOPED_TRACE(file.path().filename());
        for (const bool floats : {true, false}) {
            std::optional<Model> model;
            try {
                model = Model::load(file.path(), {}, {0.0, 0.0, -9.81}, {}, floats);
            } catch (const std::exception&) {
                continue; // docs/robots.md says why
            }
            Data data(*model);
            Eigen::VectorXd nu_dot = Eigen::VectorXd::Zero(model->velocities());
            if (model->joints() == 0 || forward_dynamics(*model, data, nu_dot, nu_dot) >= 0) continue;
            check_identities(*model, data, random_state(model->joints(), random), random);
            ++tried;
            if (!model->followers().empty()) continue;
            std::optional<Pinocchio> pinocchio; // refuses joints that are called like links
            try {
                pinocchio.emplace(file.path(), *model);
            } catch (const std::invalid_argument&) {
                continue;
            }
            compare_with_pinocchio(*std::move(pinocchio), *model, random);
            ++compared;
        }
    }
    EXPECT_GT(tried, 40);
    EXPECT_GT(compared, 40);
}

} // namespace bf::dynamics::test

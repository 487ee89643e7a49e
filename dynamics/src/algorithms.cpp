#include "bf/dynamics/algorithms.hpp"

#include "quantities.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace bf::dynamics {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// M = Lᵀ D L, joints from the tips to the base (Featherstone 2008, table 6.3), and the Cholesky factor of
/// what is then left for the base.
void update_factor(const Model::Content& model, Data::Content& data) {
    if (data.has_factor) return;
    update_mass(model, data);
    Eigen::MatrixXd& L = data.factor;
    L = data.M;
    data.singular = -1;
    for (const Elimination& elimination : model.eliminations) {
        const Eigen::Index j = 6 + elimination.joint;
        const double pivot = L(j, j);
        if (pivot <= 1e-14 * data.M(j, j)) data.singular = static_cast<int>(j);
        const Vector6 F = L.col(j).head<6>();
        L.col(j).head<6>() = F / pivot;
        L.topLeftCorner<6, 6>().noalias() -= F * L.col(j).head<6>().transpose();
        for (std::size_t k = 0; k < elimination.coupled.size(); ++k) {
            const Eigen::Index i = 6 + elimination.coupled[k];
            const double factor = L(i, j) / pivot;
            L.col(i).head<6>() -= factor * F;
            for (std::size_t later = k; later < elimination.coupled.size(); ++later)
                L(6 + elimination.coupled[later], i) -= factor * L(6 + elimination.coupled[later], j);
        }
        for (const int i : elimination.coupled) L(6 + i, j) /= pivot;
    }
    if (model.base_velocities != 0) {
        data.base_factor.compute(L.topLeftCorner<6, 6>());
        if (data.base_factor.info() != Eigen::Success && data.singular < 0) data.singular = 3;
    }
    data.has_factor = true;
}

} // namespace

Data::Data(const Model& model) : content_(std::make_unique<Content>(model.content())) {}
Data::~Data() = default;
Data::Data(Data&&) noexcept = default;
Data& Data::operator=(Data&&) noexcept = default;

void set_state(const Model&, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s, const Eigen::Ref<const Vector6>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot) noexcept {
    set_base(data.content(), w_H_b);
    set_joints(data.content(), s);
    set_velocities(data.content(), nu_base, s_dot);
}

void set_position(const Model&, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
                  const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    set_base(data.content(), w_H_b);
    set_joints(data.content(), s);
}

void set_joint_position(const Model&, Data& data, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    set_joints(data.content(), s);
}

void forward_kinematics(const Model& model, Data& data, Frame frame, Matrix4Out w_H_f) noexcept {
    forward_kinematics(model.content(), data.content(), frame, w_H_f);
}

void jacobian(const Model& model, Data& data, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.velocities());
    jacobian(model.content(), data.content(), frame, J);
}

void frame_velocity(const Model& model, Data& data, Frame frame, Vector6Out J_nu) noexcept {
    frame_velocity(model.content(), data.content(), frame, J_nu);
}

void bias_acceleration(const Model& model, Data& data, Frame frame, Vector6Out J_dot_nu) noexcept {
    bias_acceleration(model.content(), data.content(), frame, J_dot_nu);
}

void center_of_mass(const Model& model, Data& data, Vector3Out com) noexcept {
    center_of_mass(model.content(), data.content(), com);
}

void center_of_mass_velocity(const Model& model, Data& data, Vector3Out com_dot) noexcept {
    center_of_mass_velocity(model.content(), data.content(), com_dot);
}

void com_jacobian(const Model& model, Data& data, Matrix3XOut J) noexcept {
    assert(J.cols() == model.velocities());
    com_jacobian(model.content(), data.content(), J);
}

void com_bias_acceleration(const Model& model, Data& data, Vector3Out J_dot_nu) noexcept {
    com_bias_acceleration(model.content(), data.content(), J_dot_nu);
}

void mass_matrix(const Model& model, Data& data, MatrixOut M) noexcept {
    assert(M.rows() == model.velocities() && M.cols() == model.velocities());
    mass_matrix(model.content(), data.content(), M);
}

void bias_forces(const Model& model, Data& data, VectorOut h) noexcept {
    assert(h.size() == model.velocities());
    bias_forces(model.content(), data.content(), h);
}

void gravity_forces(const Model& model, Data& data, VectorOut g) noexcept {
    assert(g.size() == model.velocities());
    gravity_forces(model.content(), data.content(), g);
}

void coriolis_forces(const Model& model, Data& data, VectorOut c) noexcept {
    assert(c.size() == model.velocities());
    coriolis_forces(model.content(), data.content(), c);
}

void coriolis_matrix(const Model& model, Data& data, MatrixOut C) noexcept {
    assert(C.rows() == model.velocities() && C.cols() == model.velocities());
    coriolis_matrix(model.content(), data.content(), C);
}

void mass_matrix_derivative(const Model& model, Data& data, MatrixOut M_dot) noexcept {
    assert(M_dot.rows() == model.velocities() && M_dot.cols() == model.velocities());
    mass_matrix_derivative(model.content(), data.content(), M_dot);
}

void add_wrench(const Model& model, Data& data, Frame frame, const Eigen::Ref<const Vector6>& f,
                VectorOut forces) noexcept {
    assert(forces.size() == model.velocities());
    add_wrench(model.content(), data.content(), frame, f, forces);
}

int forward_dynamics(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& forces,
                     VectorOut nu_dot) noexcept {
    assert(forces.size() == model.velocities() && nu_dot.size() == model.velocities());
    Data::Content& d = data.content();
    update_factor(model.content(), d);
    update_bias(model.content(), d);
    if (d.singular >= 0) return d.singular - 6 + model.content().base_velocities;
    nu_dot = forces - d.h.tail(nu_dot.size());
    divide_by_mass(model, data, nu_dot);
    return -1;
}

void divide_by_mass(const Model& model, Data& data, VectorOut x) noexcept {
    Data::Content& d = data.content();
    update_factor(model.content(), d);
    const Eigen::Index first = model.content().base_velocities;
    Vector6 base = Vector6::Zero();
    auto joints = x.tail(d.s.size());
    for (const Elimination& elimination : model.content().eliminations) {
        const double y = joints[elimination.joint];
        base -= y * d.factor.col(6 + elimination.joint).head<6>();
        for (const int i : elimination.coupled) joints[i] -= y * d.factor(6 + i, 6 + elimination.joint);
    }
    if (first != 0)
        x.head<6>() = base = d.base_factor.solve(x.head<6>() + base);
    else
        base.setZero();
    for (auto e = model.content().eliminations.rbegin(); e != model.content().eliminations.rend(); ++e) {
        const auto column = d.factor.col(6 + e->joint);
        double y = joints[e->joint] / column[6 + e->joint] - base.dot(column.head<6>());
        for (const int i : e->coupled) y -= joints[i] * column[6 + i];
        joints[e->joint] = y;
    }
}

void inverse_dynamics(const Model& model, Data& data, const Eigen::Ref<const Vector6>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot, VectorOut tau) noexcept {
    assert(s_ddot.size() == model.joints());
    inverse_dynamics(model.content(), data.content(), base_acceleration, s_ddot, tau);
}

void centroidal_momentum(const Model& model, Data& data, Vector6Out H) noexcept {
    centroidal_momentum(model.content(), data.content(), H);
}

void centroidal_momentum_matrix(const Model& model, Data& data, Matrix6XOut A) noexcept {
    assert(A.cols() == model.velocities());
    centroidal_momentum_matrix(model.content(), data.content(), A);
}

void centroidal_momentum_bias(const Model& model, Data& data, Vector6Out A_dot_nu) noexcept {
    centroidal_momentum_bias(model.content(), data.content(), A_dot_nu);
}

void relative_transform(const Model& model, Data& data, Frame reference, Frame frame,
                        Matrix4Out reference_H_frame) noexcept {
    relative_transform(model.content(), data.content(), reference, frame, reference_H_frame);
}

void relative_jacobian(const Model& model, Data& data, Frame reference, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.joints());
    relative_jacobian(model.content(), data.content(), reference, frame, J);
}

} // namespace bf::dynamics

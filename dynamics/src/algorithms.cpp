#include "bf/dynamics/algorithms.hpp"

#include "content.hpp"

#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

// Pinocchio's generalised velocity is v = [Rᵀ pdot; Rᵀ omega; s_dot], ours nu = [pdot; omega; s_dot]. Nothing
// here converts matrices between the two, because of two symmetries of rigid-body motion in uniform gravity:
// - Shifting the world does not change the dynamics. Pinocchio therefore runs with the base at the world's
// origin:
//   its "world" columns are then columns about the base's origin in world axes, which is what the mixed
//   representation asks of joints, and the base's own columns need no computation. Results are as exact after
//   a walk of a kilometre as at the start, and a change of the base's position invalidates nothing.
// - Nor does an added uniform velocity. The bias terms are evaluated at pdot = 0, where the two accelerations
// agree:
//   nu_dot = X v_dot + [omega × pdot; 0; 0] = X v_dot.

namespace bf::dynamics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>; // Pinocchio's library is compiled for these arguments

/// Matrix of x ↦ a × x.
Matrix3d skew(const Vector3d& a) {
    Matrix3d A;
    A << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    return A;
}

/// Stores a value and says whether it differs, bit for bit, from the one before.
template <class Stored, class Given> bool replace(Stored& stored, const Given& given) {
    assert(stored.size() == given.size());
    const std::size_t bytes = sizeof(double) * static_cast<std::size_t>(stored.rows());
    bool changed = false;
    for (Eigen::Index c = 0; c < stored.cols(); ++c) {
        changed = changed || std::memcmp(stored.col(c).data(), given.col(c).data(), bytes) != 0;
    }
    if (changed) stored = given;
    return changed;
}

void set_base(Data::Content& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b) {
    data.p = w_H_b.block<3, 1>(0, 3);
    if (!replace(data.R, w_H_b.topLeftCorner<3, 3>())) return;
    data.q.segment<4>(3) = Eigen::Quaterniond(data.R).normalized().coeffs();
    data.has_kinematics = data.has_inertia = data.has_bias = data.has_momentum = false;
}

void set_joints(const Model::Content& model, Data::Content& data, const VectorIn& s) {
    if (!replace(data.s, s)) return;
    const auto put = [&](const JointIndex& joint, double value) {
        if (joint.angle) {
            data.q[joint.q] = std::cos(value);
            data.q[joint.q + 1] = std::sin(value);
        } else {
            data.q[joint.q] = value;
        }
    };
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
        put(model.joints[i], s[static_cast<Eigen::Index>(i)]);
    }
    for (const FollowerIndex& follower : model.moving_followers) {
        put(follower.index, follower.factor * s[follower.leader] + follower.offset);
    }
    data.has_kinematics = data.has_inertia = data.has_bias = data.has_momentum = false;
}

void update_kinematics(const Model::Content& model, Data::Content& data) {
    if (data.has_kinematics) return;
    pinocchio::computeJointJacobians(model.tree, data.tree, VectorIn(data.q));
    data.has_kinematics = true;
}

/// Inertia of one link about the base's origin: c = R c_link + p, I = R I_link Rᵀ + m (cᵀc 1 - c cᵀ).
RigidInertia in_world(const pinocchio::SE3& placement, const pinocchio::Inertia& link) {
    const Matrix3d& R = placement.rotation();
    const Vector3d c = R * link.lever() + placement.translation();
    RigidInertia inertia;
    inertia.mass = link.mass();
    inertia.moment = link.mass() * c;
    inertia.rotational = link.inertia().rotate(R).matrix();
    inertia.rotational -= link.mass() * Matrix3d(c * c.transpose());
    inertia.rotational.diagonal().array() += link.mass() * c.squaredNorm();
    return inertia;
}

/// Gᵀ M G for [nu; velocities of the followers] = G nu.
void fold_inertia(const Model::Content& model, Data::Content& data) {
    const Eigen::Index size = data.M.cols();
    data.M_folded = data.M_wide.leftCols(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        data.M_folded.col(6 + follower.leader) +=
            follower.factor * data.M_wide.col(size + static_cast<Eigen::Index>(k));
    }
    data.M = data.M_folded.topRows(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        data.M.row(6 + follower.leader) +=
            follower.factor * data.M_folded.row(size + static_cast<Eigen::Index>(k));
    }
}

/// M by the composite-rigid-body algorithm (Featherstone 2008, table 6.2), its columns about the base's
/// origin: with the momentum F = Y S of the subtree of joint j, M(base, j) = F and M(i, j) = Sᵢᵀ F for every
/// joint i that carries j. All other entries are zero since construction.
void update_inertia(const Model::Content& model, Data::Content& data) {
    if (data.has_inertia) return;
    update_kinematics(model, data);
    Eigen::MatrixXd& M = model.moving_followers.empty() ? data.M : data.M_wide;
    const std::size_t count = data.composite.size();
    for (std::size_t k = 1; k < count; ++k) {
        data.composite[k] = in_world(data.tree.oMi[k], model.tree.inertias[k]);
    }
    for (std::size_t k = count - 1; k > 1; --k) {
        const RigidInertia& Y = data.composite[k];
        const Support& own = model.own[k];
        const Vector3d v = data.tree.J.col(own.column).head<3>();
        const Vector3d omega = data.tree.J.col(own.column).tail<3>();
        const Eigen::Index j = 6 + own.joint;
        Vector6 F;
        F.head<3>() = Y.mass * v + omega.cross(Y.moment);
        F.tail<3>() = Y.rotational * omega + Y.moment.cross(v);
        M.col(j).head<6>() = F;
        M.row(j).head<6>() = F;
        for (const auto* supports : {&model.supports[k], &model.follower_supports[k]}) {
            for (const Support& support : *supports) {
                const Eigen::Index i = 6 + support.joint;
                M(i, j) = M(j, i) = data.tree.J.col(support.column).dot(F);
            }
        }
        data.composite[model.tree.parents[k]] += Y;
    }
    const RigidInertia& Y = data.composite[1];
    data.com = Y.moment / Y.mass;
    M.topLeftCorner<3, 3>() = Y.mass * Matrix3d::Identity();
    M.block<3, 3>(3, 0) = skew(Y.moment);
    M.block<3, 3>(0, 3) = -skew(Y.moment);
    M.block<3, 3>(3, 3) = Y.rotational;
    if (!model.moving_followers.empty()) fold_inertia(model, data);
    data.has_inertia = true;
}

void update_bias(const Model::Content& model, Data::Content& data) {
    if (data.has_bias) return;
    data.v.segment<3>(3) = data.R.transpose() * data.omega;
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
        data.v[model.joints[i].v] = data.s_dot[static_cast<Eigen::Index>(i)];
    }
    for (const FollowerIndex& follower : model.moving_followers) {
        data.v[follower.index.v] = follower.factor * data.s_dot[follower.leader];
    }
    const auto& nle = pinocchio::nonLinearEffects(model.tree, data.tree, VectorIn(data.q), VectorIn(data.v));
    data.h.head<3>() = data.R * nle.head<3>();
    data.h.segment<3>(3) = data.R * nle.segment<3>(3);
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
        data.h[6 + static_cast<Eigen::Index>(i)] = nle[model.joints[i].v];
    }
    for (const FollowerIndex& follower : model.moving_followers) {
        data.h[6 + follower.leader] += follower.factor * nle[follower.index.v];
    }
    data.has_bias = true;
}

void update_momentum(const Model::Content& model, Data::Content& data) {
    if (data.has_momentum) return;
    update_inertia(model, data);
    data.H.noalias() = data.M.topLeftCorner<6, 3>() * data.p_dot;
    data.H.noalias() += data.M.block<6, 3>(0, 3) * data.omega;
    for (Eigen::Index i = 0; i < data.s_dot.size(); ++i) {
        data.H += data.M.col(6 + i).head<6>() * data.s_dot[i];
    }
    data.H.tail<3>() -= data.com.cross(data.H.head<3>()); // from the base's origin to the centre of mass
    data.has_momentum = true;
}

/// Origin of a frame relative to the base's origin, world axes.
Vector3d origin(const Data::Content& data, const Placement& frame) {
    const pinocchio::SE3& joint = data.tree.oMi[frame.joint];
    return joint.rotation() * frame.translation + joint.translation();
}

Matrix3d orientation(const Data::Content& data, const Placement& frame) {
    return data.tree.oMi[frame.joint].rotation() * frame.rotation;
}

const Placement& placement(const Model::Content& model, Frame frame) {
    return model.frames[static_cast<std::size_t>(frame.index)];
}

/// Velocity of the point p of the body that a joint moves, per unit of joint velocity.
Vector6 point_velocity(const Data::Content& data, const Support& support, const Vector3d& p) {
    const Vector3d omega = data.tree.J.col(support.column).tail<3>();
    Vector6 column;
    column.head<3>() = data.tree.J.col(support.column).head<3>() + omega.cross(p);
    column.tail<3>() = omega;
    return column;
}

/// Adds what the followers that carry a body contribute to the Jacobian of its point p. `first` is the column
/// of the first joint.
void add_followers(const Model::Content& model, const Data::Content& data, std::size_t body,
                   const Vector3d& p, double sign, Eigen::Index first, Matrix6XOut J) {
    for (const Support& support : model.follower_supports[body]) {
        const FollowerIndex& follower =
            model.moving_followers[static_cast<std::size_t>(support.joint) - model.joints.size()];
        J.col(first + follower.leader) += sign * follower.factor * point_velocity(data, support, p);
    }
}

} // namespace

Data::Content::Content(const Model::Content& model)
    : s(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()))), s_dot(s), tree(model.tree),
      q(Eigen::VectorXd::Zero(model.tree.nq)), v(Eigen::VectorXd::Zero(model.tree.nv)),
      composite(static_cast<std::size_t>(model.tree.njoints)),
      M(Eigen::MatrixXd::Zero(6 + s.size(), 6 + s.size())), h(6 + s.size()) {
    q[6] = 1.0; // quaternion x, y, z, w
    for (const JointIndex& joint : model.joints) {
        if (joint.angle) q[joint.q] = 1.0;
    }
    for (const FollowerIndex& follower : model.moving_followers) {
        q[follower.index.q] = follower.index.angle ? std::cos(follower.offset) : follower.offset;
        if (follower.index.angle) q[follower.index.q + 1] = std::sin(follower.offset);
    }
    if (!model.moving_followers.empty()) {
        const Eigen::Index wide = M.cols() + static_cast<Eigen::Index>(model.moving_followers.size());
        M_wide.setZero(wide, wide);
        M_folded.resize(wide, M.cols());
    }
}

Data::Data(const Model& model) : content_(std::make_unique<Content>(model.content())) {}
Data::~Data() = default;
Data::Data(Data&&) noexcept = default;
Data& Data::operator=(Data&&) noexcept = default;

void set_state(const Model& model, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s, const Eigen::Ref<const Vector6>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot) noexcept {
    Data::Content& d = data.content();
    set_base(d, w_H_b);
    set_joints(model.content(), d, s);
    if (replace(d.p_dot, nu_base.head<3>())) d.has_momentum = false;
    if (replace(d.omega, nu_base.tail<3>())) d.has_bias = d.has_momentum = false;
    if (replace(d.s_dot, s_dot)) d.has_bias = d.has_momentum = false;
}

int state_size(const Model& model) { return 2 * model.joints() + 6 + 12; }

void save_state(const Data& data, double* to) noexcept {
    const Data::Content& d = data.content();
    const auto put = [&](const auto& values) {
        std::copy_n(values.data(), values.size(), to);
        to += values.size();
    };
    put(d.s);
    put(d.s_dot);
    put(d.p_dot);
    put(d.omega);
    put(d.R);
    put(d.p);
}

void restore_state(const Model& model, Data& data, const double* from) noexcept {
    const Eigen::Index n = model.joints();
    const Eigen::Map<const Eigen::VectorXd> s(from, n), s_dot(from + n, n);
    const Eigen::Map<const Vector6> nu_base(from + 2 * n);
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    w_H_b.topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4>>(from + 2 * n + 6);
    set_state(model, data, w_H_b, s, nu_base, s_dot);
}

void set_position(const Model& model, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
                  const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    set_base(data.content(), w_H_b);
    set_joints(model.content(), data.content(), s);
}

void set_joint_position(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    set_joints(model.content(), data.content(), s);
}

void forward_kinematics(const Model& model, Data& data, Frame frame, Matrix4Out w_H_f) noexcept {
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    w_H_f.topLeftCorner<3, 3>() = orientation(d, link);
    w_H_f.block<3, 1>(0, 3) = d.p + origin(d, link);
    w_H_f.row(3) << 0.0, 0.0, 0.0, 1.0;
}

void jacobian(const Model& model, Data& data, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.velocities());
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Vector3d p = origin(d, link);
    const Eigen::Index first = model.content().base_velocities;
    J.setZero();
    if (first != 0) {
        J.leftCols<6>().diagonal().setOnes();
        J.block<3, 3>(0, 3) = -skew(p);
    }
    for (const Support& support : model.content().supports[link.joint]) {
        J.col(first + support.joint) = point_velocity(d, support, p);
    }
    add_followers(model.content(), d, link.joint, p, 1.0, first, J);
}

void bias_acceleration(const Model& model, Data& data, Frame frame, Vector6Out J_dot_nu) noexcept {
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    update_bias(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Matrix3d& R = d.tree.oMi[link.joint].rotation();
    const pinocchio::Motion& velocity = d.tree.v[link.joint];
    const pinocchio::Motion& acceleration =
        d.tree.a_gf[link.joint]; // of a base that accelerates against gravity
    const Vector3d& omega = velocity.angular();
    const Vector3d point_velocity = velocity.linear() + omega.cross(link.translation);
    J_dot_nu.head<3>() = R * (acceleration.linear() + acceleration.angular().cross(link.translation) +
                              omega.cross(point_velocity)) +
                         model.content().gravity;
    J_dot_nu.tail<3>() = R * acceleration.angular();
}

void center_of_mass(const Model& model, Data& data, Vector3Out com) noexcept {
    update_inertia(model.content(), data.content());
    com = data.content().p + data.content().com;
}

void center_of_mass_velocity(const Model& model, Data& data, Vector3Out com_dot) noexcept {
    update_momentum(model.content(), data.content());
    com_dot = data.content().H.head<3>() / model.total_mass();
}

void com_jacobian(const Model& model, Data& data, Matrix3XOut J) noexcept {
    assert(J.cols() == model.velocities());
    update_inertia(model.content(), data.content());
    const double inverse_mass = 1.0 / model.total_mass();
    const auto own = data.content().M.rightCols(J.cols());
    for (Eigen::Index j = 0; j < J.cols(); ++j) J.col(j) = inverse_mass * own.col(j).head<3>();
}

void com_bias_acceleration(const Model& model, Data& data, Vector3Out J_dot_nu) noexcept {
    update_bias(model.content(), data.content());
    // The first rows of the equations of motion are those of the centre of mass: m J_dot_nu = h + m g.
    J_dot_nu = data.content().h.head<3>() / model.total_mass() + model.content().gravity;
}

void mass_matrix(const Model& model, Data& data, MatrixOut M) noexcept {
    update_inertia(model.content(), data.content());
    assert(M.rows() == model.velocities() && M.cols() == model.velocities());
    const auto own = data.content().M.bottomRightCorner(M.rows(), M.cols());
    for (Eigen::Index j = 0; j < M.cols(); ++j) std::copy_n(own.col(j).data(), M.rows(), M.col(j).data());
}

void bias_forces(const Model& model, Data& data, VectorOut h) noexcept {
    update_bias(model.content(), data.content());
    assert(h.size() == model.velocities());
    h = data.content().h.tail(h.size());
}

void gravity_forces(const Model& model, Data& data, VectorOut g) noexcept {
    update_inertia(model.content(), data.content());
    assert(g.size() == model.velocities());
    // Gravity acts like an acceleration of the base the other way.
    g.noalias() = data.content().M.bottomRows(g.size()).leftCols<3>() * -model.content().gravity;
}

void inverse_dynamics(const Model& model, Data& data, const Eigen::Ref<const Vector6>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot, VectorOut tau) noexcept {
    assert(s_ddot.size() == model.joints());
    bias_forces(model, data, tau);
    if (base_acceleration.isZero(0.0) && s_ddot.isZero(0.0)) return; // without it M is perhaps never needed
    update_inertia(model.content(), data.content());
    const auto M = data.content().M.bottomRows(tau.size());
    tau.noalias() += M.leftCols<6>() * base_acceleration;
    tau.noalias() += M.rightCols(s_ddot.size()) * s_ddot;
}

void centroidal_momentum(const Model& model, Data& data, Vector6Out H) noexcept {
    update_momentum(model.content(), data.content());
    H = data.content().H;
}

void centroidal_momentum_matrix(const Model& model, Data& data, Matrix6XOut A) noexcept {
    assert(A.cols() == model.velocities());
    update_inertia(model.content(), data.content());
    const Data::Content& d = data.content();
    const auto own = d.M.rightCols(A.cols());
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
        const Vector3d force = own.col(j).head<3>();
        A.col(j).head<3>() = force;
        A.col(j).tail<3>() = own.col(j).segment<3>(3) - d.com.cross(force);
    }
}

void relative_transform(const Model& model, Data& data, Frame reference, Frame frame,
                        Matrix4Out reference_H_frame) noexcept {
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& from = placement(model.content(), reference);
    const Placement& to = placement(model.content(), frame);
    const Matrix3d R_transpose = orientation(d, from).transpose();
    reference_H_frame.topLeftCorner<3, 3>() = R_transpose * orientation(d, to);
    reference_H_frame.block<3, 1>(0, 3) = R_transpose * (origin(d, to) - origin(d, from));
    reference_H_frame.row(3) << 0.0, 0.0, 0.0, 1.0;
}

void relative_jacobian(const Model& model, Data& data, Frame reference, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.joints());
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& from = placement(model.content(), reference);
    const Placement& to = placement(model.content(), frame);
    const Vector3d p = origin(d, to);
    const Matrix3d R_transpose = orientation(d, from).transpose();
    J.setZero();
    // A joint that carries both frames moves neither relative to the other: its two contributions cancel
    // exactly.
    for (const Support& support : model.content().supports[to.joint]) {
        J.col(support.joint) += point_velocity(d, support, p);
    }
    for (const Support& support : model.content().supports[from.joint]) {
        J.col(support.joint) -= point_velocity(d, support, p);
    }
    add_followers(model.content(), d, to.joint, p, 1.0, 0, J);
    add_followers(model.content(), d, from.joint, p, -1.0, 0, J);
    for (Eigen::Index j = 0; j < J.cols(); ++j) {
        const Vector6 column = J.col(j);
        J.col(j).head<3>() = R_transpose * column.head<3>();
        J.col(j).tail<3>() = R_transpose * column.tail<3>();
    }
}

} // namespace bf::dynamics

#include "bf/dynamics/algorithms.hpp"

#include "content.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

// The generalised velocity is nu = [pdot; omega; s_dot]. All spatial vectors are in world axes about the
// base's origin, so that nothing is transformed from body to body. Two symmetries of rigid-body motion in
// uniform gravity allow it:
// - Shifting the world does not change the dynamics. The base therefore stands at the world's origin: the
//   columns of joints are what the mixed representation asks of them, and the base's own columns need no
//   computation. Results are as exact after a walk of a kilometre as at the start, and a change of the base's
//   position invalidates nothing.
// - Nor does an added uniform velocity. The bias terms are evaluated at pdot = 0, where the derivative of nu
//   is the spatial acceleration.

namespace bf::dynamics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

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

void forget_velocity(Data::Content& data) { data.has_bias = data.has_coriolis = data.has_momentum = false; }

void forget_position(Data::Content& data) {
    data.has_kinematics = data.has_inertia = data.has_mass = data.has_factor = false;
    forget_velocity(data);
}

void set_base(Data::Content& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b) {
    data.p = w_H_b.block<3, 1>(0, 3);
    if (!replace(data.R, w_H_b.topLeftCorner<3, 3>())) return;
    forget_position(data);
}

void set_joints(Data::Content& data, const Eigen::Ref<const Eigen::VectorXd>& s) {
    if (!replace(data.s, s)) return;
    data.has_joints = false;
    forget_position(data);
}

/// Motion per unit of the velocity of the joint that moves a body, of the point at the origin of its pose.
Motion motion(const Body& body, const Pose& pose) {
    const Vector3d axis = pose.rotation * body.axis;
    return body.turns ? Motion{pose.translation.cross(axis), axis} : Motion{axis, Vector3d::Zero()};
}

/// Position or velocity of the joint that moves a body, of those of the listed joints.
double of_joint(const Model::Content& model, const Body& body, const Eigen::VectorXd& listed,
                double offsets) {
    if (body.joint < listed.size()) return listed[body.joint];
    const FollowerIndex& follower =
        model.moving_followers[static_cast<std::size_t>(body.joint - listed.size())];
    return follower.factor * listed[follower.leader] + offsets * follower.offset;
}

void update_joints(const Model::Content& model, Data::Content& data) {
    if (data.has_joints) return;
    for (std::size_t k = 1; k < model.bodies.size(); ++k) {
        const Body& body = model.bodies[k];
        const Pose& parent = data.in_base[body.parent];
        const double q = of_joint(model, body, data.s, 1.0);
        Pose& pose = data.in_base[k];
        pose.translation = parent.translation + parent.rotation * body.origin;
        if (body.turns) {
            const Matrix3d turned = body.fixed + std::cos(q) * body.cosine + std::sin(q) * body.sine;
            pose.rotation.noalias() = parent.rotation * turned;
        } else {
            pose.rotation.noalias() = parent.rotation * body.fixed;
            pose.translation += q * (pose.rotation * body.axis);
        }
    }
    data.has_joints = true;
}

void update_kinematics(const Model::Content& model, Data::Content& data) {
    if (data.has_kinematics) return;
    update_joints(model, data);
    data.in_world[0].rotation = data.R;
    for (std::size_t k = 1; k < model.bodies.size(); ++k) {
        Pose& pose = data.in_world[k];
        pose.rotation.noalias() = data.R * data.in_base[k].rotation;
        pose.translation.noalias() = data.R * data.in_base[k].translation;
        data.columns[k] = motion(model.bodies[k], pose);
    }
    data.has_kinematics = true;
}

/// Inertia of one body: c = R com + p, I = R I_com Rᵀ + m (cᵀc 1 - c cᵀ).
RigidInertia in_world(const Pose& pose, const Body& body) {
    const Matrix3d& R = pose.rotation;
    const Vector3d c = R * body.com + pose.translation;
    RigidInertia inertia;
    inertia.mass = body.mass;
    inertia.moment = body.mass * c;
    const Matrix3d half = R * body.inertia;
    inertia.rotational.noalias() = half * R.transpose();
    inertia.rotational -= inertia.moment * c.transpose();
    inertia.rotational.diagonal().array() += inertia.moment.dot(c);
    return inertia;
}

void update_inertia(const Model::Content& model, Data::Content& data) {
    if (data.has_inertia) return;
    update_kinematics(model, data);
    for (std::size_t k = 0; k < model.bodies.size(); ++k)
        data.inertia[k] = in_world(data.in_world[k], model.bodies[k]);
    data.has_inertia = true;
}

/// Momentum of a body that moves so.
Force operator*(const RigidInertia& Y, const Motion& v) {
    return {Y.mass * v.linear + v.angular.cross(Y.moment),
            Y.rotational * v.angular + Y.moment.cross(v.linear)};
}

/// result = Gᵀ wide G for [nu; velocities of the followers] = G nu.
void fold(const Model::Content& model, Data::Content& data, Eigen::MatrixXd& result) {
    const Eigen::Index size = result.cols();
    data.folded = data.wide.leftCols(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        data.folded.col(6 + follower.leader) +=
            follower.factor * data.wide.col(size + static_cast<Eigen::Index>(k));
    }
    result = data.folded.topRows(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        result.row(6 + follower.leader) +=
            follower.factor * data.folded.row(size + static_cast<Eigen::Index>(k));
    }
}

/// M by the composite-rigid-body algorithm (Featherstone 2008, table 6.2), its columns about the base's
/// origin: with the momentum F = Y S of the subtree of joint j, M(base, j) = F and M(i, j) = Sᵢᵀ F for every
/// joint i that carries j. All other entries are zero since construction.
void update_mass(const Model::Content& model, Data::Content& data) {
    if (data.has_mass) return;
    update_inertia(model, data);
    Eigen::MatrixXd& M = model.moving_followers.empty() ? data.M : data.wide;
    const std::size_t count = model.bodies.size();
    data.composite = data.inertia;
    for (std::size_t k = count - 1; k > 0; --k) {
        const Force F = data.composite[k] * data.columns[k];
        const Eigen::Index j = 6 + model.bodies[k].joint;
        M.block<3, 1>(0, j) = F.linear;
        M.block<3, 1>(3, j) = F.angular;
        M.block<1, 3>(j, 0) = F.linear;
        M.block<1, 3>(j, 3) = F.angular;
        for (const auto* supports : {&model.supports[k], &model.follower_supports[k]}) {
            for (const Support& support : *supports) {
                const Eigen::Index i = 6 + support.joint;
                const Motion& S = data.columns[support.body];
                M(i, j) = M(j, i) = S.linear.dot(F.linear) + S.angular.dot(F.angular);
            }
        }
        data.composite[model.bodies[k].parent] += data.composite[k];
    }
    const RigidInertia& Y = data.composite[0];
    data.com = Y.moment / Y.mass;
    M.topLeftCorner<3, 3>() = Y.mass * Matrix3d::Identity();
    M.block<3, 3>(3, 0) = skew(Y.moment);
    M.block<3, 3>(0, 3) = -skew(Y.moment);
    M.block<3, 3>(3, 3) = Y.rotational;
    if (!model.moving_followers.empty()) fold(model, data, data.M);
    data.has_mass = true;
}

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

/// The recursive Newton-Euler algorithm (Featherstone 2008, table 5.1) for nu_dot = 0: a = a_parent + v × S
/// qdot is the acceleration of a body, f = Y a + v × Y v the force that it needs, and h_j = Sᵀ of the sum of
/// all that j carries.
void update_bias(const Model::Content& model, Data::Content& data) {
    if (data.has_bias) return;
    update_inertia(model, data);
    data.velocity[0].angular = data.omega;
    data.acceleration[0].linear = -model.gravity;
    const std::size_t count = model.bodies.size();
    for (std::size_t k = 0; k < count; ++k) {
        Motion &v = data.velocity[k], &a = data.acceleration[k];
        if (k > 0) {
            const Motion &v_parent = data.velocity[model.bodies[k].parent],
                         &a_parent = data.acceleration[model.bodies[k].parent], &S = data.columns[k];
            const double q_dot = of_joint(model, model.bodies[k], data.s_dot, 0.0);
            const Motion own{q_dot * S.linear, q_dot * S.angular};
            v = {v_parent.linear + own.linear, v_parent.angular + own.angular};
            a = {a_parent.linear + v_parent.angular.cross(own.linear) + v_parent.linear.cross(own.angular),
                 a_parent.angular + v_parent.angular.cross(own.angular)};
        }
        const Force needed = data.inertia[k] * a, momentum = data.inertia[k] * v;
        data.force[k] = {needed.linear + v.angular.cross(momentum.linear),
                         needed.angular + v.angular.cross(momentum.angular) +
                             v.linear.cross(momentum.linear)};
    }
    data.h.setZero();
    for (std::size_t k = count - 1; k > 0; --k) {
        const Body& body = model.bodies[k];
        const Motion& S = data.columns[k];
        const Force& f = data.force[k];
        const double tau = S.linear.dot(f.linear) + S.angular.dot(f.angular);
        if (body.joint < data.s.size()) {
            data.h[6 + body.joint] += tau;
        } else {
            const FollowerIndex& follower =
                model.moving_followers[static_cast<std::size_t>(body.joint - data.s.size())];
            data.h[6 + follower.leader] += follower.factor * tau;
        }
        Force& below = data.force[body.parent];
        below.linear += f.linear;
        below.angular += f.angular;
    }
    data.h.head<3>() = data.force[0].linear;
    data.h.segment<3>(3) = data.force[0].angular;
    data.has_bias = true;
}

/// C by its composite-rigid-body algorithm (Echeandia, Wensing 2021): C(i, j) = Sᵢᵀ (Y Sⱼ' + B Sⱼ) with the
/// inertia Y and its rate B of all that the further of the two joints carries, and the time derivative
/// S' = v × S of a column. Those of the base stand still, as pdot = 0. With v×, v×* and the exchanged product
/// of that paper worked out for a rigid body, B is [0, -momentum×; 0, ω× (I - ½ tr I) - moment× v×].
void update_coriolis(const Model::Content& model, Data::Content& data) {
    if (data.has_coriolis) return;
    update_mass(model, data);
    update_bias(model, data);
    Eigen::MatrixXd& C = model.moving_followers.empty() ? data.C : data.wide;
    const std::size_t count = model.bodies.size();
    for (std::size_t k = 0; k < count; ++k) {
        const Motion &v = data.velocity[k], &S = data.columns[k];
        data.column_rates[k] = {v.angular.cross(S.linear) + v.linear.cross(S.angular),
                                v.angular.cross(S.angular)};
        const RigidInertia& Y = data.inertia[k];
        Matrix3d half = Y.rotational;
        half.diagonal().array() -= 0.5 * Y.rotational.trace();
        data.turning[k].momentum = (Y * v).linear;
        data.turning[k].rotational.noalias() = skew(v.angular) * half - skew(Y.moment) * skew(v.linear);
    }
    for (std::size_t k = count - 1; k > 0; --k) {
        const Motion &S = data.columns[k], &S_dot = data.column_rates[k];
        const InertiaRate& B = data.turning[k];
        const Force Y_S = data.composite[k] * S, Y_S_dot = data.composite[k] * S_dot;
        const Force F{Y_S_dot.linear + S.angular.cross(B.momentum),
                      Y_S_dot.angular + B.rotational * S.angular};
        const Vector3d from_angular =
            B.momentum.cross(S.linear) + B.rotational.transpose() * S.angular; // Bᵀ S
        const Eigen::Index j = 6 + model.bodies[k].joint;
        C.block<3, 1>(0, j) = F.linear;
        C.block<3, 1>(3, j) = F.angular;
        C.block<1, 3>(j, 3) = from_angular;
        for (const auto* supports : {&model.supports[k], &model.follower_supports[k]}) {
            for (const Support& support : *supports) {
                const Eigen::Index i = 6 + support.joint;
                const Motion &S_i = data.columns[support.body], &S_i_dot = data.column_rates[support.body];
                C(i, j) = S_i.linear.dot(F.linear) + S_i.angular.dot(F.angular);
                C(j, i) = S_i_dot.linear.dot(Y_S.linear) + S_i_dot.angular.dot(Y_S.angular) +
                          S_i.angular.dot(from_angular);
            }
        }
        data.turning[model.bodies[k].parent] += B;
    }
    C.block<3, 3>(0, 3) = -skew(data.turning[0].momentum);
    C.block<3, 3>(3, 3) = data.turning[0].rotational;
    if (!model.moving_followers.empty()) {
        C.leftCols<3>().setZero(); // where M was
        fold(model, data, data.C);
    }
    data.has_coriolis = true;
}

void update_momentum(const Model::Content& model, Data::Content& data) {
    if (data.has_momentum) return;
    update_mass(model, data);
    data.H.noalias() = data.M.topLeftCorner<6, 3>() * data.p_dot;
    data.H.noalias() += data.M.block<6, 3>(0, 3) * data.omega;
    for (Eigen::Index i = 0; i < data.s_dot.size(); ++i) {
        data.H += data.M.col(6 + i).head<6>() * data.s_dot[i];
    }
    data.H.tail<3>() -= data.com.cross(data.H.head<3>()); // from the base's origin to the centre of mass
    data.has_momentum = true;
}

const Placement& placement(const Model::Content& model, Frame frame) {
    return model.frames[static_cast<std::size_t>(frame.index)];
}

/// Pose of a frame where the bodies are at these poses.
Pose operator*(const std::vector<Pose>& bodies, const Placement& frame) {
    const Pose& body = bodies[frame.body];
    return {body.rotation * frame.rotation, body.rotation * frame.translation + body.translation};
}

/// Calls f(joint, body that it moves, factor) for each joint that carries a body, with the factor by which
/// the body's joint follows.
template <class F> void for_each_joint(const Model::Content& model, std::size_t body, const F& f) {
    for (const Support& support : model.supports[body]) f(support.joint, support.body, 1.0);
    for (const Support& support : model.follower_supports[body]) {
        const FollowerIndex& follower =
            model.moving_followers[static_cast<std::size_t>(support.joint) - model.joint_names.size()];
        f(follower.leader, support.body, follower.factor);
    }
}

/// Adds sign times what the joints that carry a body contribute to the velocity of its point p, each per unit
/// of its velocity. Column(k) is the motion that the joint of body k gives to the point at the origin.
/// `first` is the column of the first joint.
template <class Column>
void add_joints(const Model::Content& model, std::size_t body, const Vector3d& p, double sign,
                Eigen::Index first, const Column& column, Matrix6XOut J) {
    for_each_joint(model, body, [&](int joint, std::size_t k, double factor) {
        const Motion& S = column(k);
        J.col(first + joint).head<3>() += sign * factor * (S.linear + S.angular.cross(p));
        J.col(first + joint).tail<3>() += sign * factor * S.angular;
    });
}

} // namespace

Data::Content::Content(const Model::Content& model)
    : s(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joint_names.size()))), s_dot(s),
      in_base(model.bodies.size()), in_world(in_base), columns(in_base.size()), inertia(in_base.size()),
      composite(inertia), M(Eigen::MatrixXd::Zero(6 + s.size(), 6 + s.size())), factor(M),
      velocity(in_base.size()), acceleration(velocity), force(in_base.size()), h(6 + s.size()),
      column_rates(velocity), turning(in_base.size()), C(M) {
    if (!model.moving_followers.empty()) {
        const Eigen::Index size = M.cols() + static_cast<Eigen::Index>(model.moving_followers.size());
        wide.setZero(size, size);
        folded.resize(size, M.cols());
    }
}

Data::Data(const Model& model) : content_(std::make_unique<Content>(model.content())) {}
Data::~Data() = default;
Data::Data(Data&&) noexcept = default;
Data& Data::operator=(Data&&) noexcept = default;

void set_state(const Model&, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s, const Eigen::Ref<const Vector6>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot) noexcept {
    Data::Content& d = data.content();
    set_base(d, w_H_b);
    set_joints(d, s);
    if (replace(d.p_dot, nu_base.head<3>())) d.has_momentum = false;
    if (replace(d.omega, nu_base.tail<3>())) forget_velocity(d);
    if (replace(d.s_dot, s_dot)) forget_velocity(d);
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
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Pose pose = d.in_world * placement(model.content(), frame);
    w_H_f.topLeftCorner<3, 3>() = pose.rotation;
    w_H_f.block<3, 1>(0, 3) = d.p + pose.translation;
    w_H_f.row(3) << 0.0, 0.0, 0.0, 1.0;
}

void jacobian(const Model& model, Data& data, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.velocities());
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Vector3d p = (d.in_world * link).translation;
    const Eigen::Index first = model.content().base_velocities;
    J.setZero();
    if (first != 0) {
        J.leftCols<6>().diagonal().setOnes();
        J.block<3, 3>(0, 3) = -skew(p);
    }
    add_joints(
        model.content(), link.body, p, 1.0, first,
        [&](std::size_t k) -> const Motion& { return d.columns[k]; }, J);
}

void frame_velocity(const Model& model, Data& data, Frame frame, Vector6Out J_nu) noexcept {
    Data::Content& d = data.content();
    update_bias(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Motion& v = d.velocity[link.body];
    J_nu.head<3>() = d.p_dot + v.linear + v.angular.cross((d.in_world * link).translation);
    J_nu.tail<3>() = v.angular;
}

void bias_acceleration(const Model& model, Data& data, Frame frame, Vector6Out J_dot_nu) noexcept {
    Data::Content& d = data.content();
    update_bias(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Vector3d p = (d.in_world * link).translation;
    const Motion &v = d.velocity[link.body], &a = d.acceleration[link.body];
    J_dot_nu.head<3>() = a.linear + a.angular.cross(p) + v.angular.cross(v.linear + v.angular.cross(p)) +
                         model.content().gravity;
    J_dot_nu.tail<3>() = a.angular;
}

void center_of_mass(const Model& model, Data& data, Vector3Out com) noexcept {
    update_mass(model.content(), data.content());
    com = data.content().p + data.content().com;
}

void center_of_mass_velocity(const Model& model, Data& data, Vector3Out com_dot) noexcept {
    update_momentum(model.content(), data.content());
    com_dot = data.content().H.head<3>() / model.total_mass();
}

void com_jacobian(const Model& model, Data& data, Matrix3XOut J) noexcept {
    assert(J.cols() == model.velocities());
    update_mass(model.content(), data.content());
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
    update_mass(model.content(), data.content());
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
    update_mass(model.content(), data.content());
    assert(g.size() == model.velocities());
    // Gravity acts like an acceleration of the base the other way.
    g.noalias() = data.content().M.bottomRows(g.size()).leftCols<3>() * -model.content().gravity;
}

void coriolis_forces(const Model& model, Data& data, VectorOut c) noexcept {
    update_mass(model.content(), data.content());
    bias_forces(model, data, c);
    c.noalias() += data.content().M.bottomRows(c.size()).leftCols<3>() * model.content().gravity;
}

void coriolis_matrix(const Model& model, Data& data, MatrixOut C) noexcept {
    update_coriolis(model.content(), data.content());
    assert(C.rows() == model.velocities() && C.cols() == model.velocities());
    C = data.content().C.bottomRightCorner(C.rows(), C.cols());
}

void mass_matrix_derivative(const Model& model, Data& data, MatrixOut M_dot) noexcept {
    update_coriolis(model.content(), data.content());
    assert(M_dot.rows() == model.velocities() && M_dot.cols() == model.velocities());
    const auto C = data.content().C.bottomRightCorner(M_dot.rows(), M_dot.cols());
    M_dot.noalias() = C + C.transpose();
}

void add_wrench(const Model& model, Data& data, Frame frame, const Eigen::Ref<const Vector6>& f,
                VectorOut forces) noexcept {
    assert(forces.size() == model.velocities());
    Data::Content& d = data.content();
    update_kinematics(model.content(), d);
    const Placement& link = placement(model.content(), frame);
    const Vector3d force = f.head<3>();
    const Vector3d moment =
        f.tail<3>() + (d.in_world * link).translation.cross(force); // about the base's origin
    const Eigen::Index first = model.content().base_velocities;
    if (first != 0) {
        forces.head<3>() += force;
        forces.segment<3>(3) += moment;
    }
    for_each_joint(model.content(), link.body, [&](int joint, std::size_t k, double factor) {
        forces[first + joint] += factor * (d.columns[k].linear.dot(force) + d.columns[k].angular.dot(moment));
    });
}

int forward_dynamics(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& forces,
                     VectorOut nu_dot) noexcept {
    assert(forces.size() == model.velocities() && nu_dot.size() == model.velocities());
    Data::Content& d = data.content();
    update_factor(model.content(), d);
    update_bias(model.content(), d);
    const Eigen::Index first = model.content().base_velocities;
    if (d.singular >= 0) return d.singular - 6 + static_cast<int>(first);
    nu_dot = forces - d.h.tail(nu_dot.size());
    Vector6 base = Vector6::Zero();
    auto joints = nu_dot.tail(d.s.size());
    for (const Elimination& elimination : model.content().eliminations) {
        const double x = joints[elimination.joint];
        base -= x * d.factor.col(6 + elimination.joint).head<6>();
        for (const int i : elimination.coupled) joints[i] -= x * d.factor(6 + i, 6 + elimination.joint);
    }
    if (first != 0)
        nu_dot.head<6>() = base = d.base_factor.solve(nu_dot.head<6>() + base);
    else
        base.setZero();
    for (auto e = model.content().eliminations.rbegin(); e != model.content().eliminations.rend(); ++e) {
        const auto column = d.factor.col(6 + e->joint);
        double x = joints[e->joint] / column[6 + e->joint] - base.dot(column.head<6>());
        for (const int i : e->coupled) x -= joints[i] * column[6 + i];
        joints[e->joint] = x;
    }
    return -1;
}

void inverse_dynamics(const Model& model, Data& data, const Eigen::Ref<const Vector6>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot, VectorOut tau) noexcept {
    assert(s_ddot.size() == model.joints());
    bias_forces(model, data, tau);
    if (base_acceleration.isZero(0.0) && s_ddot.isZero(0.0)) return; // without it M is perhaps never needed
    update_mass(model.content(), data.content());
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
    update_mass(model.content(), data.content());
    const Data::Content& d = data.content();
    const auto own = d.M.rightCols(A.cols());
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
        const Vector3d force = own.col(j).head<3>();
        A.col(j).head<3>() = force;
        A.col(j).tail<3>() = own.col(j).segment<3>(3) - d.com.cross(force);
    }
}

void centroidal_momentum_bias(const Model& model, Data& data, Vector6Out A_dot_nu) noexcept {
    update_mass(model.content(), data.content());
    update_bias(model.content(), data.content());
    const Data::Content& d = data.content();
    // The forces h of this motion change the momentum; weight has no moment about the centre of mass.
    const Vector3d force = d.h.head<3>();
    A_dot_nu.head<3>() = force + model.total_mass() * model.content().gravity;
    A_dot_nu.tail<3>() = d.h.segment<3>(3) - d.com.cross(force);
}

void relative_transform(const Model& model, Data& data, Frame reference, Frame frame,
                        Matrix4Out reference_H_frame) noexcept {
    Data::Content& d = data.content();
    update_joints(model.content(), d);
    const Pose from = d.in_base * placement(model.content(), reference);
    const Pose to = d.in_base * placement(model.content(), frame);
    reference_H_frame.topLeftCorner<3, 3>() = from.rotation.transpose() * to.rotation;
    reference_H_frame.block<3, 1>(0, 3) = from.rotation.transpose() * (to.translation - from.translation);
    reference_H_frame.row(3) << 0.0, 0.0, 0.0, 1.0;
}

void relative_jacobian(const Model& model, Data& data, Frame reference, Frame frame, Matrix6XOut J) noexcept {
    assert(J.cols() == model.joints());
    Data::Content& d = data.content();
    update_joints(model.content(), d);
    const Placement &from = placement(model.content(), reference), &to = placement(model.content(), frame);
    const Vector3d p = (d.in_base * to).translation;
    const auto column = [&](std::size_t k) { return motion(model.content().bodies[k], d.in_base[k]); };
    J.setZero();
    // A joint that carries both frames moves neither relative to the other: its two contributions cancel
    // exactly.
    add_joints(model.content(), to.body, p, 1.0, 0, column, J);
    add_joints(model.content(), from.body, p, -1.0, 0, column, J);
    const Matrix3d R_transpose = (d.in_base * from).rotation.transpose();
    for (Eigen::Index j = 0; j < J.cols(); ++j) {
        const Vector6 moved = J.col(j);
        J.col(j).head<3>() = R_transpose * moved.head<3>();
        J.col(j).tail<3>() = R_transpose * moved.tail<3>();
    }
}

} // namespace bf::dynamics

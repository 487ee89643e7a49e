#include "bf/dynamics/estimation.hpp"

#include "bf/dynamics/lie.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <utility>

namespace bf::dynamics {

using Eigen::Index;
using Vector6 = Eigen::Matrix<double, 6, 1>;

void momentum_balance(const Model& model, Data& data, const Eigen::Ref<const Vector6>& nu_base,
                      const Eigen::Ref<const Eigen::VectorXd>& s_dot, VectorOut p, VectorOut beta,
                      MatrixOut M, VectorOut nu) noexcept {
    if (model.has_floating_base()) nu.head<6>() = nu_base;
    nu.tail(s_dot.size()) = s_dot;
    mass_matrix(model, data, M);
    p.noalias() = M.lazyProduct(nu);
    bias_forces(model, data, beta);
    mass_matrix_derivative(model, data, M);
    beta = -beta;
    beta.noalias() += M.lazyProduct(nu);
}

WrenchesOfForces::WrenchesOfForces(const Model& model, std::vector<Frame> frames)
    : frames_(std::move(frames)), of_frame_(6, model.velocities()),
      J_(6 * static_cast<Index>(frames_.size()), model.velocities()), JJt_(J_.rows(), J_.rows()),
      factor_(J_.rows()) {}

void WrenchesOfForces::find(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& r,
                            double damping, VectorOut wrenches) noexcept {
    Index row = 0;
    for (const Frame& frame : frames_) {
        jacobian(model, data, frame, of_frame_);
        J_.middleRows<6>(row) = of_frame_;
        row += 6;
    }
    JJt_.noalias() = J_.lazyProduct(J_.transpose());
    JJt_.diagonal().array() += damping * damping * JJt_.diagonal().maxCoeff();
    factor_.compute(JJt_);
    wrenches.noalias() = J_.lazyProduct(r);
    factor_.solveInPlace(wrenches);
}

ContactWrenches::ContactWrenches(const Model& model, const std::filesystem::path& urdf,
                                 const std::vector<std::string>& sensors,
                                 const std::vector<std::string>& contacts)
    : J_(6, model.velocities()) {
    const auto& names = model.joint_names();
    const auto parts = Model::load_parts(urdf, names, model.gravity(), model.base_link(), sensors);
    for (const Model::Part& part : parts) {
        const Frame root = part.model.frame(part.model.base_link());
        Part of{part.model,  Data(part.model),
                root,        model.frame(part.model.base_link()),
                part.parent, {},
                {},          {},
                {},          {},
                {},          {},
                {},          Eigen::Matrix4d::Identity()};
        if (of.parent >= 0)
            of.parent_link = parts[static_cast<std::size_t>(of.parent)].model.frame(part.parent_link);
        for (const std::string& joint : part.model.joint_names())
            of.joints.push_back(
                static_cast<int>(std::find(names.begin(), names.end(), joint) - names.begin()));
        of.s = of.s_dot = of.s_ddot = Eigen::VectorXd::Zero(part.model.joints());
        of.forces = Eigen::VectorXd::Zero(part.model.velocities());
        parts_.push_back(std::move(of));
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        static_cast<void>(model.frame(contacts[i])); // throws
        for (Part& part : parts_)
            if (part.model.has_frame(contacts[i])) {
                part.contacts.push_back(static_cast<int>(i));
                part.contact.push_back(part.model.frame(contacts[i]));
            }
    }
}

void ContactWrenches::find(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& s,
                           const Eigen::Ref<const Eigen::VectorXd>& s_dot,
                           const Eigen::Ref<const Eigen::VectorXd>& nu_dot,
                           const Eigen::Ref<const Eigen::Matrix<double, 6, Eigen::Dynamic>>& measured,
                           Matrix6XOut wrenches, VectorOut tau) noexcept {
    const auto moment = [](const Eigen::Vector3d& arm, const Vector6& f) {
        return Vector6((Vector6() << f.head<3>(), f.tail<3>() + arm.cross(f.head<3>())).finished());
    };
    // What each part needs to move as it does.
    for (Part& part : parts_) {
        Vector6 velocity, acceleration;
        forward_kinematics(model, data, part.in_whole, part.w_H_root);
        frame_velocity(model, data, part.in_whole, velocity);
        bias_acceleration(model, data, part.in_whole, acceleration);
        jacobian(model, data, part.in_whole, J_);
        acceleration.noalias() += J_.lazyProduct(nu_dot);
        for (std::size_t i = 0; i < part.joints.size(); ++i) {
            const Index k = static_cast<Index>(i), joint = part.joints[i];
            part.s[k] = s[joint];
            part.s_dot[k] = s_dot[joint];
            part.s_ddot[k] = nu_dot[nu_dot.size() - s.size() + joint];
        }
        set_state(part.model, part.data, part.w_H_root, part.s, velocity, part.s_dot);
        inverse_dynamics(part.model, part.data, acceleration, part.s_ddot, part.forces);
    }
    // What goes through the sensors.
    for (std::size_t k = 1; k < parts_.size(); ++k) {
        Part &part = parts_[k], &parent = parts_[static_cast<std::size_t>(part.parent)];
        const Eigen::Matrix3d R = part.w_H_root.topLeftCorner<3, 3>();
        const auto seen = measured.col(static_cast<Index>(k) - 1);
        Vector6 on_parent;
        on_parent << R * seen.head<3>(), R * seen.tail<3>();
        add_wrench(part.model, part.data, part.root, on_parent, part.forces);
        Eigen::Matrix4d w_H_link;
        forward_kinematics(parent.model, parent.data, part.parent_link, w_H_link);
        add_wrench(parent.model, parent.data, part.parent_link,
                   -moment((part.w_H_root - w_H_link).topRightCorner<3, 1>(), on_parent), parent.forces);
    }
    // What is left is of the contacts.
    wrenches.setZero();
    for (Part& part : parts_) {
        Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
        const auto arm = [&](Frame frame) -> Eigen::Vector3d {
            Eigen::Matrix4d H;
            forward_kinematics(part.model, part.data, frame, H);
            return (H - part.w_H_root).topRightCorner<3, 1>();
        };
        const auto to_root = [&](Frame frame) {
            Eigen::Matrix<double, 6, 6> X = Eigen::Matrix<double, 6, 6>::Identity();
            X.bottomLeftCorner<3, 3>() = skew(arm(frame));
            return X;
        };
        for (const Frame frame : part.contact) normal += to_root(frame) * to_root(frame).transpose();
        if (part.contact.empty()) continue;
        const Vector6 multiplier = normal.inverse() * part.forces.head<6>();
        for (std::size_t i = 0; i < part.contact.size(); ++i) {
            const Vector6 f = to_root(part.contact[i]).transpose() * multiplier;
            wrenches.col(part.contacts[i]) = f;
            add_wrench(part.model, part.data, part.contact[i], -f, part.forces);
        }
    }
    tau.setZero();
    for (const Part& part : parts_)
        for (std::size_t i = 0; i < part.joints.size(); ++i)
            tau[part.joints[i]] = part.forces[6 + static_cast<Index>(i)];
}

void base_from_frame(const Model& model, Data& data, Frame frame,
                     const Eigen::Ref<const Eigen::Matrix4d>& w_H_f, Matrix4Out w_H_b) noexcept {
    Eigen::Matrix4d f_H_b;
    relative_transform(model, data, frame, model.frame(model.base_link()), f_H_b);
    w_H_b.noalias() = w_H_f.lazyProduct(f_H_b);
}

void base_velocity_from_contacts(const Model& model, Data& data, const std::vector<Frame>& frames,
                                 const Eigen::Ref<const Eigen::VectorXd>& weights,
                                 const Eigen::Ref<const Eigen::VectorXd>& s_dot, Vector6Out nu_base,
                                 Matrix6XOut J) noexcept {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double weight = weights[static_cast<Index>(i)];
        if (!(weight > 0.0)) continue;
        jacobian(model, data, frames[i], J);
        const Eigen::Matrix<double, 6, 6> of_base = J.leftCols<6>();
        Vector6 of_joints;
        of_joints.noalias() = J.rightCols(s_dot.size()).lazyProduct(s_dot);
        normal.noalias() += weight * of_base.transpose() * of_base;
        right.noalias() -= weight * of_base.transpose() * of_joints;
    }
    nu_base.setZero();
    if (normal(0, 0) > 0.0) nu_base = normal.inverse() * right;
}

void base_velocity_from_points(const Model& model, Data& data, const std::vector<Frame>& frames,
                               const Eigen::Ref<const Eigen::VectorXd>& weights,
                               const Eigen::Ref<const Eigen::Vector3d>& omega,
                               const Eigen::Ref<const Eigen::VectorXd>& s_dot, Vector6Out nu_base,
                               Matrix6XOut J) noexcept {
    // The rows of the base's linear velocity are unit matrices, so that the least squares are a mean.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0.0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double weight = weights[static_cast<Index>(i)];
        if (!(weight > 0.0)) continue;
        jacobian(model, data, frames[i], J);
        sum.noalias() += weight * J.block<3, 3>(0, 3) * omega;
        sum.noalias() += weight * J.topRightCorner(3, s_dot.size()).lazyProduct(s_dot);
        total += weight;
    }
    nu_base.setZero();
    if (total > 0.0) nu_base << -sum / total, omega;
}

} // namespace bf::dynamics

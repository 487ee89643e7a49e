#include "bf/dynamics/inverse_kinematics.hpp"

#include "bf/dynamics/lie.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace bf::dynamics {
namespace {

using Eigen::Index;
using Kind = Target::Kind;

Index rows(Kind kind) { return kind == Kind::pose ? 6 : 3; }

/// L Lᵀ = A (lower triangle) in place. Its columns are short, so that no blocks are worth it, and many
/// entries are zero: joints of different limbs.
void factorise(Eigen::Ref<Eigen::MatrixXd> A) {
    const Index n = A.cols();
    for (Index j = 0; j < n; ++j) {
        auto column = A.col(j).tail(n - j);
        for (Index k = 0; k < j; ++k)
            if (const double factor = A(j, k); factor != 0.0) column -= factor * A.col(k).tail(n - j);
        column /= std::sqrt(column[0]);
    }
}

/// x = A⁻¹ x
void solve(const Eigen::Ref<const Eigen::MatrixXd>& L, VectorOut x) {
    const Index n = L.cols();
    for (Index j = 0; j < n; ++j) {
        x[j] /= L(j, j);
        x.tail(n - j - 1) -= x[j] * L.col(j).tail(n - j - 1);
    }
    for (Index j = n; j-- > 0;) x[j] = (x[j] - L.col(j).tail(n - j - 1).dot(x.tail(n - j - 1))) / L(j, j);
}

} // namespace

InverseKinematics::InverseKinematics(const Model& model, std::vector<Target> wanted, bool moves_base,
                                     const Options& options)
    : targets(std::move(wanted)), posture(Eigen::VectorXd::Zero(model.joints())), posture_weights(posture),
      reach(Eigen::VectorXd::Constant(posture.size(), std::numeric_limits<double>::infinity())),
      model_(model), data_(model), options_(options),
      base_(moves_base ? 6 : 0), found_{Eigen::Matrix4d::Identity(), posture, {}, 0.0}, low_(reach),
      high_(reach), of_frame_(6, model.velocities()), of_com_(3, model.velocities()) {
    assert(!moves_base || model.has_floating_base());
    Index count = 0;
    for (const Target& target : targets) count += rows(target.kind);
    const Index columns = base_ + model.joints();
    found_.error.setZero(6, static_cast<Index>(targets.size()));
    trial_ = best_ = found_;
    J_.setZero(count, columns);
    r_.setZero(count);
    H_.setZero(columns, columns);
    L_ = H_;
    gradient_.setZero(columns);
    delta_ = rest_ = x_ = gradient_;
    free_.reserve(static_cast<std::size_t>(columns));
}

void InverseKinematics::evaluate(Point& point) noexcept {
    set_position(model_, data_, point.w_H_b, point.s);
    point.cost = 0.5 * posture_weights.dot((posture - point.s).cwiseAbs2());
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const Target& target = targets[i];
        auto error = point.error.col(static_cast<Index>(i));
        Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
        if (target.kind == Kind::center_of_mass)
            center_of_mass(model_, data_, H.topRightCorner<3, 1>());
        else
            forward_kinematics(model_, data_, target.frame, H);
        error.setZero();
        if (target.kind != Kind::orientation)
            error.head<3>() = target.pose.topRightCorner<3, 1>() - H.topRightCorner<3, 1>();
        if (target.kind == Kind::orientation || target.kind == Kind::pose)
            error.tail<3>() =
                rotation_log(target.pose.topLeftCorner<3, 3>() * H.topLeftCorner<3, 3>().transpose());
        point.cost += 0.5 * target.weight * error.squaredNorm();
    }
}

bool InverseKinematics::is_reached() const noexcept {
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const auto error = found_.error.col(static_cast<Index>(i));
        if (targets[i].weight > 0.0 &&
            !(error.head<3>().norm() <= options_.tolerance && error.tail<3>().norm() <= options_.tolerance))
            return false;
    }
    return true;
}

/// Adds what a target with rows from `row` on asks to the Hessian and the gradient. Few joints move it.
template <int count> void InverseKinematics::add_square(Eigen::Index row) noexcept {
    const auto column = [&](Index j) { return J_.col(j).segment<count>(row); };
    free_.clear();
    for (Index j = 0; j < J_.cols(); ++j)
        if (!column(j).isZero(0.0)) free_.push_back(j);
    for (std::size_t a = 0; a < free_.size(); ++a) {
        const Eigen::Matrix<double, count, 1> left = column(free_[a]);
        gradient_[free_[a]] += left.dot(r_.segment<count>(row));
        for (std::size_t b = a; b < free_.size(); ++b) H_(free_[b], free_[a]) += left.dot(column(free_[b]));
    }
}

void InverseKinematics::linearise() noexcept {
    Index row = 0;
    H_.setZero();
    gradient_.setZero();
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const Target& target = targets[i];
        const double root = std::sqrt(target.weight);
        const auto error = found_.error.col(static_cast<Index>(i));
        const Index count = rows(target.kind), first = target.kind == Kind::orientation ? 3 : 0;
        r_.segment(row, count) = root * error.segment(first, count);
        if (target.kind == Kind::center_of_mass) {
            com_jacobian(model_, data_, of_com_);
            J_.middleRows(row, count) = root * of_com_.rightCols(J_.cols());
        } else {
            jacobian(model_, data_, target.frame, of_frame_);
            J_.middleRows(row, count) = root * of_frame_.rightCols(J_.cols()).middleRows(first, count);
        }
        count == 3 ? add_square<3>(row) : add_square<6>(row);
        row += count;
    }
    gradient_.tail(posture.size()) += posture_weights.cwiseProduct(posture - found_.s);
    H_.diagonal().tail(posture.size()) += posture_weights;
}

/// Is it a joint at a limit, and would its cost fall beyond?
bool InverseKinematics::is_pressed(Index column) const noexcept {
    const Index joint = column - base_;
    if (joint < 0) return false;
    return (gradient_[column] > 0.0 && found_.s[joint] >= high_[joint]) ||
           (gradient_[column] < 0.0 && found_.s[joint] <= low_[joint]);
}

/// Factorises the Hessian of the free columns, which are from the last to the first: tips before what carries
/// them, so that limbs stay apart in the factor (Featherstone 2008, §6.4).
void InverseKinematics::factorise_free(double damping) noexcept {
    const auto count = static_cast<Index>(free_.size());
    auto L = L_.topLeftCorner(count, count);
    for (Index j = 0; j < count; ++j) {
        const Index column = free_[static_cast<std::size_t>(j)];
        for (Index i = j; i < count; ++i) L(i, j) = H_(column, free_[static_cast<std::size_t>(i)]);
        L(j, j) += damping;
    }
    factorise(L);
}

/// The damped step delta_, and how far it lowers the quadratic cost. It goes straight to the minimum or to
/// the first limit, from there on without the joint that stopped, and so on: each part lowers the cost.
double InverseKinematics::step(double damping) noexcept {
    free_.clear();
    for (Index j = J_.cols(); j-- > 0;)
        if (H_(j, j) > 0.0 && !is_pressed(j)) free_.push_back(j);
    delta_.setZero();
    rest_ = gradient_;
    for (bool stops = !free_.empty(); stops && !free_.empty();) {
        factorise_free(damping);
        const auto count = static_cast<Index>(free_.size());
        auto x = x_.head(count);
        for (Index j = 0; j < count; ++j) x[j] = rest_[free_[static_cast<std::size_t>(j)]];
        solve(L_.topLeftCorner(count, count), x);
        double part = 1.0, end = 0.0;
        Index stopped = -1;
        for (Index j = 0; j < count; ++j) {
            const Index column = free_[static_cast<std::size_t>(j)], joint = column - base_;
            if (joint < 0 || x[j] == 0.0) continue;
            const double limit = (x[j] > 0.0 ? high_[joint] : low_[joint]) - found_.s[joint];
            if (const double way = (limit - delta_[column]) / x[j]; way < part)
                part = std::max(way, 0.0), end = limit, stopped = j;
        }
        for (Index j = 0; j < count; ++j) delta_[free_[static_cast<std::size_t>(j)]] += part * x[j];
        stops = stopped >= 0;
        if (stops) {
            delta_[free_[static_cast<std::size_t>(stopped)]] = end;
            free_.erase(free_.begin() + stopped);
        }
        rest_ = gradient_ - damping * delta_;
        rest_.noalias() -= H_.selfadjointView<Eigen::Lower>() * delta_;
    }
    return 0.5 * delta_.dot(gradient_ + rest_ + damping * delta_); // gᵀ Δ - ½ Δᵀ H Δ, as H Δ = g - rest - λ Δ
}

/// Evaluates found_ moved by delta_, within the limits, as trial_.
void InverseKinematics::try_delta() noexcept {
    trial_.s = (found_.s + delta_.tail(posture.size())).cwiseMin(high_).cwiseMax(low_);
    trial_.w_H_b = found_.w_H_b;
    if (base_ != 0) {
        const Eigen::Vector3d turn = delta_.segment<3>(3);
        trial_.w_H_b.topRightCorner<3, 1>() += delta_.head<3>();
        trial_.w_H_b.topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * found_.w_H_b.topLeftCorner<3, 3>();
    }
    evaluate(trial_);
}

/// Where the cost rests, is it lower along a direction that the Jacobians do not see? A stretched limb does
/// not see that it could bend.
bool InverseKinematics::bends() noexcept {
    free_.clear();
    for (Index j = J_.cols(); j-- > 0;)
        if (H_(j, j) > 0.0) free_.push_back(j);
    if (free_.empty()) return false;
    factorise_free(1e-8 * H_.diagonal().maxCoeff());
    const auto count = static_cast<Index>(free_.size());
    auto x = x_.head(count);
    for (Index j = 0; j < count; ++j) x[j] = j % 2 == 0 ? 1.0 : -1.0; // has a part in every direction
    solve(L_.topLeftCorner(count, count), x);
    x *= 0.01 / x.cwiseAbs().maxCoeff();
    delta_.setZero();
    for (Index j = 0; j < count; ++j) delta_[free_[static_cast<std::size_t>(j)]] = x[j];
    for (int way = 0; way < 2; ++way) {
        try_delta();
        if (trial_.cost < (1.0 - 1e-6) * found_.cost) {
            std::swap(found_, trial_);
            return true;
        }
        delta_ = -delta_;
    }
    return false;
}

InverseKinematics::Status InverseKinematics::descend() noexcept {
    const bool weighs_posture = !posture_weights.isZero(0.0);
    double factor = 1.0;
    evaluate(found_);
    for (int tried = 0;;) {
        const bool reached = is_reached();
        if (reached && !weighs_posture) return Status::reached;
        linearise();
        for (bool lowers = false; !lowers;) {
            if (tried++ == options_.iterations) return reached ? Status::reached : Status::iteration_limit;
            ++iterations_;
            const double predicted = step(factor * found_.cost + 1e-9 * H_.diagonal().maxCoeff());
            try_delta();
            const double ratio = (found_.cost - trial_.cost) / predicted;
            if (ratio < 0.25) factor = std::min(4.0 * factor, 1e8);
            if (ratio > 0.75) factor = std::max(0.25 * factor, 1e-8);
            lowers = ratio > 1e-4;
            if (lowers) std::swap(found_, trial_);
            if (predicted > 1e-6 * found_.cost) continue;
            if (is_reached()) return Status::reached; // this was the last step that matters
            if (!bends()) return Status::least_error;
            lowers = true;
        }
    }
}

/// Puts what to begin with into found_ and forgets the last search.
void InverseKinematics::begin(const Eigen::Matrix4d& w_H_b,
                              const Eigen::Ref<const Eigen::VectorXd>& s) noexcept {
    iterations_ = 0;
    found_.s = s.cwiseMin(high_).cwiseMax(low_);
    found_.w_H_b = w_H_b;
    const Eigen::Matrix3d R = w_H_b.topLeftCorner<3, 3>();
    found_.w_H_b.topLeftCorner<3, 3>() =
        Eigen::Quaterniond(R).normalized().toRotationMatrix(); // rounding adds up
}

InverseKinematics::Status InverseKinematics::follow(Eigen::Ref<Eigen::Matrix4d> w_H_b, VectorOut s) noexcept {
    low_ = model_.position_min();
    high_ = model_.position_max();
    begin(w_H_b, s);
    low_ = low_.cwiseMax(found_.s - reach);
    high_ = high_.cwiseMin(found_.s + reach);
    const Status status = descend();
    w_H_b = found_.w_H_b;
    s = found_.s;
    return status;
}

InverseKinematics::Status InverseKinematics::search(Eigen::Ref<Eigen::Matrix4d> w_H_b, VectorOut s,
                                                    int restarts) noexcept {
    low_ = model_.position_min();
    high_ = model_.position_max();
    begin(w_H_b, s);
    w_H_b = found_.w_H_b;
    Status best = descend();
    std::swap(best_, found_);
    std::minstd_rand random;
    for (int k = 0; k < restarts && best != Status::reached; ++k) {
        if (options_.is_interrupted && options_.is_interrupted()) break;
        found_.w_H_b = w_H_b;
        for (Index i = 0; i < s.size(); ++i) {
            const double unit = static_cast<double>(random()) / static_cast<double>(std::minstd_rand::max());
            const bool is_limited = std::isfinite(low_[i]) && std::isfinite(high_[i]);
            const double from = is_limited ? low_[i] : s[i] - std::numbers::pi,
                         to = is_limited ? high_[i] : s[i] + std::numbers::pi;
            found_.s[i] = from + unit * (to - from);
        }
        const Status status = descend();
        if (status != Status::reached && found_.cost >= best_.cost) continue;
        best = status;
        std::swap(best_, found_);
    }
    std::swap(best_, found_);
    w_H_b = found_.w_H_b;
    s = found_.s;
    return best;
}

} // namespace bf::dynamics

#include "bf/walking/footsteps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace bf::walking {

namespace {

/// +1: the foot is to the left of the body.
double sign_of(Side side) { return side == Side::left ? 1.0 : -1.0; }

/// ∫₀¹ R(s yaw) ds xy: where an arc of constant velocity ends.
Eigen::Vector2d along_arc(const Eigen::Vector2d& xy, double yaw) {
    const double sine = std::abs(yaw) < 1e-6 ? 1 - yaw * yaw / 6 : std::sin(yaw) / yaw;
    const double rest = std::abs(yaw) < 1e-6 ? yaw / 2 : (1 - std::cos(yaw)) / yaw;
    return {sine * xy.x() - rest * xy.y(), rest * xy.x() + sine * xy.y()};
}

Eigen::Vector2d turned(const Eigen::Vector2d& xy, double yaw) { return Eigen::Rotation2Dd(yaw) * xy; }

} // namespace

Eigen::Matrix3d yaw_rotation(double yaw) noexcept {
    return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Eigen::Matrix4d pose_of(const Foothold& foothold) noexcept {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() = yaw_rotation(foothold[3]);
    H.topRightCorner<3, 1>() = foothold.head<3>();
    return H;
}

Foothold foothold_of(const Eigen::Ref<const Eigen::Matrix4d>& pose) noexcept {
    return {pose(0, 3), pose(1, 3), pose(2, 3), std::atan2(pose(1, 0), pose(0, 0))};
}

double wrapped(double angle) noexcept {
    const double rest = std::remainder(angle, 2 * std::numbers::pi);
    return rest <= -std::numbers::pi ? std::numbers::pi : rest;
}

Eigen::Matrix<double, Step::size, 1> Step::numbers() const noexcept {
    Eigen::Matrix<double, size, 1> result;
    result << time, double_support, single_support, next_double_support, next_single_support,
        stance == Side::left ? 1.0 : 2.0, static_cast<double>(ahead), from_rest ? 1.0 : 0.0;
    return result;
}

bool Step::read(const Eigen::Ref<const Eigen::Matrix<double, size, 1>>& numbers, Step& step) noexcept {
    if (!numbers.allFinite() || !(numbers.head<5>().array() >= 0).all() || !(numbers[2] > 0) ||
        !(numbers[4] > 0))
        return false;
    if ((numbers[5] != 1 && numbers[5] != 2) || numbers[6] < 0 || numbers[6] > 1e6 ||
        numbers[6] != std::floor(numbers[6]) || (numbers[7] != 0 && numbers[7] != 1))
        return false;
    step = {numbers[0],
            numbers[1],
            numbers[2],
            numbers[3],
            numbers[4],
            numbers[5] == 1 ? Side::left : Side::right,
            static_cast<int>(numbers[6]),
            numbers[7] > 0.5};
    return true;
}

bool Reach::is_possible() const noexcept {
    return forward >= 0 && backward >= 0 && inner <= outer && turn_out >= 0 && turn_in >= 0;
}

Foothold within_reach(const Foothold& wanted, const Foothold& stance, Side stance_side,
                      const Reach& reach) noexcept {
    const double outwards = -sign_of(stance_side); // of the foot that moves, along y of the one that stands
    Eigen::Vector2d xy = turned(wanted.head<2>() - stance.head<2>(), -stance[3]);
    xy.x() = std::clamp(xy.x(), -reach.backward, reach.forward);
    xy.y() = outwards * std::clamp(outwards * xy.y(), reach.inner, reach.outer);
    const double turn =
        outwards * std::clamp(outwards * wrapped(wanted[3] - stance[3]), -reach.turn_in, reach.turn_out);
    Foothold result = wanted;
    result.head<2>() = stance.head<2>() + turned(xy, stance[3]);
    result[3] = stance[3] + turn;
    return result;
}

Foothold next_foothold(const Foothold& stance, Side stance_side, double width,
                       const Eigen::Vector3d& motion) noexcept {
    const Eigen::Vector2d half(0, -sign_of(stance_side) * width / 2);
    const double yaw = stance[3] + motion[2];
    Foothold next = stance;
    next.head<2>() += turned(half + along_arc(motion.head<2>(), motion[2]), stance[3]) + turned(half, yaw);
    next[3] = yaw;
    return next;
}

Eigen::Vector3d motion_to(const Eigen::Vector3d& goal, const Foothold& stance, Side stance_side,
                          double width) noexcept {
    const Eigen::Vector2d half(0, -sign_of(stance_side) * width / 2);
    const Eigen::Vector2d body = stance.head<2>() + turned(half, stance[3]);
    const double yaw = wrapped(goal[2] - stance[3]);
    const Eigen::Vector2d away = turned(goal.head<2>() - body, -stance[3]);
    // The inverse of along_arc; its determinant, (2 - 2 cos yaw)/yaw², is at least 4/pi².
    const Eigen::Vector2d x = along_arc({1, 0}, yaw), y = along_arc({0, 1}, yaw);
    const double determinant = x.x() * y.y() - x.y() * y.x();
    return {(y.y() * away.x() - y.x() * away.y()) / determinant,
            (x.x() * away.y() - x.y() * away.x()) / determinant, yaw};
}

Ground::Ground(const Eigen::Ref<const Eigen::MatrixXd>& boxes) {
    if (boxes.rows() > 0 && boxes.cols() != 6)
        throw std::invalid_argument("the ground has " + std::to_string(boxes.cols()) +
                                    " columns; a box is a row x y z a b c, its centre and half-sizes");
    for (Eigen::Index i = 0; i < boxes.rows(); ++i) {
        if (!boxes.row(i).allFinite() || !(boxes.row(i).tail<3>().array() > 0).all())
            throw std::invalid_argument("row " + std::to_string(i + 1) +
                                        " of the ground is no box; its half-sizes must be above 0");
        boxes_.emplace_back(boxes.row(i).transpose());
    }
}

bool Ground::is_level(const Foothold& foothold, const Sole& sole, double clearance,
                      double& height) const noexcept {
    // Extent of the sole along the axes of the world; exact for soles along these axes, and more otherwise.
    const std::array corners{Eigen::Vector2d(sole.x_min - clearance, sole.y_min - clearance),
                             Eigen::Vector2d(sole.x_min - clearance, sole.y_max + clearance),
                             Eigen::Vector2d(sole.x_max + clearance, sole.y_min - clearance),
                             Eigen::Vector2d(sole.x_max + clearance, sole.y_max + clearance)};
    Eigen::Array2d low(1e30, 1e30), high(-1e30, -1e30);
    for (const Eigen::Vector2d& corner : corners) {
        const Eigen::Array2d at = foothold.head<2>() + turned(corner, foothold[3]);
        low = low.min(at);
        high = high.max(at);
    }
    height = 0;
    for (const auto& box : boxes_) {
        const Eigen::Array2d first = box.head<2>() - box.segment<2>(3),
                             last = box.head<2>() + box.segment<2>(3);
        if ((high > first).all() && (low < last).all()) height = std::max(height, box[2] + box[5]);
    }
    // A box below all of it carries it; one that is as high or higher must not be touched elsewhere.
    bool covered = height == 0;
    for (const auto& box : boxes_) {
        const Eigen::Array2d first = box.head<2>() - box.segment<2>(3),
                             last = box.head<2>() + box.segment<2>(3);
        if (box[2] + box[5] == height && (low >= first).all() && (high <= last).all()) covered = true;
    }
    return covered;
}

bool Ground::settle(Foothold& foothold, const Sole& sole, double clearance, double backward,
                    double forward) const noexcept {
    constexpr double interval = 0.005;
    const Eigen::Vector2d along = turned({1, 0}, foothold[3]);
    double height = 0;
    for (int i = 0; i * interval <= std::max(backward, forward) + 1e-9; ++i) {
        for (const double way : {-1.0, 1.0}) { // shorter steps before longer ones
            if (i * interval > (way < 0 ? backward : forward) + 1e-9) continue;
            Foothold moved = foothold;
            moved.head<2>() += way * i * interval * along;
            if (!is_level(moved, sole, clearance, height)) continue;
            moved[2] = height;
            foothold = moved;
            return true;
        }
    }
    is_level(foothold, sole, 0, height); // it stands on what is below it, not on what is near
    foothold[2] = height;
    return false;
}

} // namespace bf::walking

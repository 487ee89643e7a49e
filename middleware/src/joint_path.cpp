#include "bf/middleware/joint_path.hpp"

#include "bf/base/names.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace bf::middleware {

JointPath::JointPath(const JointTrajectory& message, const std::vector<std::string>& joints) {
    for (const auto& name : message.joints) {
        const auto found = std::ranges::find(joints, name);
        if (found == joints.end())
            throw std::runtime_error("a trajectory that names '" + name + "', but the joints are " +
                                     name_list(joints));
        const Eigen::Index number = found - joints.begin();
        if (std::ranges::find(joints_, number) != joints_.end())
            throw std::runtime_error("a trajectory that names '" + name + "' twice");
        joints_.push_back(number);
    }
    const auto n = static_cast<Eigen::Index>(joints_.size());
    if (n == 0 || message.points.empty()) throw std::runtime_error("a trajectory without joints or points");
    start_.resize(static_cast<Eigen::Index>(joints.size()));
    points_.push_back({0, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)});
    for (std::size_t i = 0; i < message.points.size(); ++i) {
        const auto& given = message.points[i];
        const auto vector = [&](const std::vector<double>& values, const char* what) {
            const std::string its = "a trajectory whose point " + std::to_string(i + 1) + " has ";
            if (static_cast<Eigen::Index>(values.size()) != n)
                throw std::runtime_error(its + std::to_string(values.size()) + " " + what +
                                         ", but its joints are " + name_list(message.joints));
            if (!std::ranges::all_of(values, [](double x) { return std::isfinite(x); }))
                throw std::runtime_error(its + what + " that are not finite");
            return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(values.data(), n));
        };
        Point point{given.time, vector(given.positions, "positions"), {}};
        if (!given.velocities.empty()) point.velocities = vector(given.velocities, "velocities");
        if (point.time < points_.back().time || (i > 0 && point.time == points_.back().time))
            throw std::runtime_error("a trajectory whose times do not grow");
        points_.push_back(std::move(point));
    }
}

void JointPath::begin(double time, const Eigen::VectorXd& positions) {
    begin_ = time;
    start_ = positions;
    for (std::size_t i = 0; i < joints_.size(); ++i)
        points_[0].positions[static_cast<Eigen::Index>(i)] = positions[joints_[i]];
}

bool JointPath::at(double time, Eigen::VectorXd& positions) const noexcept {
    const double t = time - begin_;
    const auto next =
        std::find_if(points_.begin() + 1, points_.end(), [&](const Point& p) { return p.time > t; });
    const bool is_over = next == points_.end();
    const Point &b = is_over ? points_.back() : *next, &a = is_over ? points_.back() : *(next - 1);
    const double T = b.time - a.time, s = T > 0 ? std::max(t - a.time, 0.0) / T : 1;
    // Hermite's polynomials.
    const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s),
                 h01 = s * s * (3 - 2 * s), h11 = s * s * (s - 1);
    const bool is_cubic = a.velocities.size() > 0 && b.velocities.size() > 0;
    positions = start_;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        positions[joints_[i]] = is_over    ? b.positions[k]
                                : is_cubic ? h00 * a.positions[k] + h10 * T * a.velocities[k] +
                                                 h01 * b.positions[k] + h11 * T * b.velocities[k]
                                           : a.positions[k] + s * (b.positions[k] - a.positions[k]);
    }
    return !is_over;
}

} // namespace bf::middleware

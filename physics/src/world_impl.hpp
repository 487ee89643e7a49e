#pragma once

#include "robot_index.hpp"

#include <vector>

namespace bf::physics {

/// The model, and where in it each quantity of the interface lives.
struct World::Impl {
    WorldOptions options; ///< complete: joints, base link, IMU frame and F/T child links filled in
    ModelPtr model;

    RobotIndex robot;
    std::vector<int> foot_of_geom; ///< per geom: foot it belongs to, or -1
    std::vector<int> foot_sites;
    std::vector<std::string> warnings, bodies;

    Eigen::VectorXd start; ///< nq, qpos at t = 0
    double mass = 0.0;

    int n() const { return static_cast<int>(options.joints.size()); }

    /// Indices of a compiled model.
    void index();
    /// Fills `start`; places a fixed base.
    void place();
};

} // namespace bf::physics

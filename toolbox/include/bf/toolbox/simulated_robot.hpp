// A robot in a physics world, for those who draw it.
#pragma once

#include "bf/physics/world.hpp"
#include "bf/toolbox/robot.hpp"

namespace bf::toolbox {

/// What a MujocoWorld provides.
class SimulatedDevice : public RobotDevice {
  public:
    virtual const physics::World& world() const = 0;
};

} // namespace bf::toolbox

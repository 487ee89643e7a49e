// A control board of a served robot, as YARP's devices see it.
#pragma once

#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"

#include <memory>
#include <mutex>
#include <string>
#include <vector>
#include <yarp/dev/DeviceDriver.h>

namespace bf::yarp {

/// What somebody wishes of a joint, in this order in the exchange of its board.
struct Wish {
    enum : int { position, direct, velocity, torque, pwm, current, speed, acceleration, count };
    int mode = 0;     ///< a vocab of YARP's
    double times = 0; ///< how often a mode was set
    double values[count] = {};
    static constexpr int size = 2 + count;
};

/// The vector that the step shows to the boards: the time and the measurements, with infinities where there
/// are none, then of each joint the mode that it is in, as a vocab, and where its trajectory is.
struct ShownLayout {
    int n;
    int measurement(middleware::Measurement what) const { return 1 + static_cast<int>(what) * n; }
    int modes() const { return 1 + middleware::measurement_count * n; }
    int led() const { return modes() + n; }
    int size() const { return led() + n; }
};

/// Of the whole robot; whoever changes something has the lock, for which the step does not wait.
struct Settings {
    explicit Settings(Eigen::Index n) : position(n), torque(n), motors(n) {}
    std::mutex mutex;
    toolbox::Gains position, torque;
    toolbox::MotorParameters motors;
    int changed = 0; ///< 1 the position loop, 2 the torque loop, 4 motors, added up
};

/// What the boards of a robot have in common.
struct SharedBoard {
    explicit SharedBoard(const std::vector<std::string>& names)
        : joints(names), at{static_cast<int>(names.size())}, shown(at.size()),
          settings(static_cast<Eigen::Index>(names.size())) {}
    std::vector<std::string> joints;
    ShownLayout at;
    middleware::ExchangeBuffer shown;
    Settings settings;
    std::uint32_t measurements = 0, modes = 0; ///< a bit each
    bool has_position_gains = false, has_torque_gains = false, has_motor_parameters = false;
    std::vector<bool> is_prismatic; ///< of each joint
    Eigen::VectorXd position_min, position_max, velocity_min, velocity_max;
};

/// The device of one board. Its calls come in threads of YARP; the step reads its wishes.
class Panel {
  public:
    virtual ~Panel() = default;
    virtual ::yarp::dev::DeviceDriver& driver() = 0;
    /// Of the joints in its order, Wish::size numbers each.
    virtual const middleware::Exchange& wishes() const = 0;
    virtual const std::vector<int>& numbers() const = 0; ///< of its joints in the robot
};
std::unique_ptr<Panel> make_panel(const std::vector<std::string>& joints, SharedBoard& shared);

/// The mode of the world that moves joints of a mode of YARP, and -1: there is none.
int control_mode_of(int vocab);

} // namespace bf::yarp

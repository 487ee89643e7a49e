// A sensor of a robot behind YARP.
#pragma once

#include "bf/middleware/robot_frames.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <yarp/dev/MultipleAnalogSensorsInterfaces.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/BufferedPort.h>
#include <yarp/sig/Vector.h>

namespace bf::yarp {

/// One behind a server of MultipleAnalogSensors, or at a port that streams its numbers.
class SensorPort {
  public:
    /// `text` is name=/port.
    SensorPort(const std::string& text, middleware::Sensor kind);

    /// Connects to it by ports that begin with `local`. Throws std::runtime_error that says what is wrong.
    void start(const std::string& local);
    void stop() noexcept;
    /// Takes what is new, and says of which time it is, s; what came last stays where nothing new has come.
    double look();
    /// What came last, in SI units.
    void read(Eigen::Ref<Eigen::VectorXd> values);

    std::string name;

  private:
    [[noreturn]] void refuse(const std::string& why) const;
    /// Which of the client's sensors of a kind has the name; one that is alone needs none.
    template <class I, class Count, class Name> I* find(std::size_t& index, Count count, Name name_of);
    void find_in_client();

    const bool is_imu_;
    std::string from_;
    Eigen::VectorXd came_; ///< as YARP gives it
    double time_ = 0;      ///< of it, s
    std::unique_ptr<::yarp::os::BufferedPort<::yarp::os::Bottle>> port_;
    ::yarp::dev::PolyDriver client_;
    ::yarp::dev::ISixAxisForceTorqueSensors* wrench_ = nullptr;
    ::yarp::dev::IOrientationSensors* orientation_ = nullptr;
    ::yarp::dev::IThreeAxisLinearAccelerometers* acceleration_ = nullptr;
    ::yarp::dev::IThreeAxisGyroscopes* velocity_ = nullptr;
    ::yarp::dev::IThreeAxisMagnetometers* field_ = nullptr;
    std::size_t index_[4] = {};
    ::yarp::sig::Vector part_;
};

} // namespace bf::yarp

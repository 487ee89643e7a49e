// What the sensors of a served robot measure, as YARP's devices see it.
#pragma once

#include "bf/middleware/exchange.hpp"
#include "bf/middleware/robot_frames.hpp"
#include "units.hpp"

#include <cstddef>
#include <string>
#include <utility>
#include <vector>
#include <yarp/dev/DeviceDriver.h>
#include <yarp/dev/MultipleAnalogSensorsInterfaces.h>
#include <yarp/sig/Vector.h>

namespace bf::yarp {

/// What all sensors measure, as the step shows it: the time, then each wrench and each IMU, in SI units.
struct Senses {
    Senses(std::vector<std::string> its_wrenches, std::vector<std::string> its_imus)
        : wrenches(std::move(its_wrenches)), imus(std::move(its_imus)), shown(size()) {}
    int wrench(std::size_t i) const { return 1 + middleware::wrench_size * static_cast<int>(i); }
    int imu(std::size_t i) const {
        return wrench(wrenches.size()) + middleware::imu_size * static_cast<int>(i);
    }
    int size() const { return imu(imus.size()); }
    bool look(std::vector<double>& values) const {
        values.resize(static_cast<std::size_t>(size()));
        middleware::Stamp stamp;
        for (int tries = 0; tries < 100; ++tries)
            if (shown.read(values.data(), stamp)) return true;
        return false;
    }
    const std::vector<std::string> wrenches, imus;
    middleware::ExchangeBuffer shown;
};

/// The device behind a server of MultipleAnalogSensors. Its calls come in a thread of YARP.
class SensorDevice final : public ::yarp::dev::DeviceDriver,
                           public ::yarp::dev::IThreeAxisGyroscopes,
                           public ::yarp::dev::IThreeAxisLinearAccelerometers,
                           public ::yarp::dev::IOrientationSensors,
                           public ::yarp::dev::ISixAxisForceTorqueSensors {
  public:
    explicit SensorDevice(const Senses& senses) : senses_(senses) {}

    using Name = std::string;
    using Values = ::yarp::sig::Vector;
    std::size_t getNrOfThreeAxisGyroscopes() const override { return senses_.imus.size(); }
    ::yarp::dev::MAS_status getThreeAxisGyroscopeStatus(std::size_t) const override {
        return ::yarp::dev::MAS_OK;
    }
    bool getThreeAxisGyroscopeName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getThreeAxisGyroscopeFrameName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getThreeAxisGyroscopeMeasure(std::size_t i, Values& out, double& time) const override {
        return i < senses_.imus.size() && measure(senses_.imu(i) + 6, 3, degrees, out, time);
    }
    std::size_t getNrOfThreeAxisLinearAccelerometers() const override { return senses_.imus.size(); }
    ::yarp::dev::MAS_status getThreeAxisLinearAccelerometerStatus(std::size_t) const override {
        return ::yarp::dev::MAS_OK;
    }
    bool getThreeAxisLinearAccelerometerName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getThreeAxisLinearAccelerometerFrameName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getThreeAxisLinearAccelerometerMeasure(std::size_t i, Values& out, double& time) const override {
        return i < senses_.imus.size() && measure(senses_.imu(i) + 3, 3, 1, out, time);
    }
    std::size_t getNrOfOrientationSensors() const override { return senses_.imus.size(); }
    ::yarp::dev::MAS_status getOrientationSensorStatus(std::size_t) const override {
        return ::yarp::dev::MAS_OK;
    }
    bool getOrientationSensorName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getOrientationSensorFrameName(std::size_t i, Name& name) const override {
        return tell(senses_.imus, i, name);
    }
    bool getOrientationSensorMeasureAsRollPitchYaw(std::size_t i, Values& out, double& time) const override {
        return i < senses_.imus.size() && measure(senses_.imu(i), 3, degrees, out, time);
    }
    std::size_t getNrOfSixAxisForceTorqueSensors() const override { return senses_.wrenches.size(); }
    ::yarp::dev::MAS_status getSixAxisForceTorqueSensorStatus(std::size_t) const override {
        return ::yarp::dev::MAS_OK;
    }
    bool getSixAxisForceTorqueSensorName(std::size_t i, Name& name) const override {
        return tell(senses_.wrenches, i, name);
    }
    bool getSixAxisForceTorqueSensorFrameName(std::size_t i, Name& name) const override {
        return tell(senses_.wrenches, i, name);
    }
    bool getSixAxisForceTorqueSensorMeasure(std::size_t i, Values& out, double& time) const override {
        return i < senses_.wrenches.size() && measure(senses_.wrench(i), 6, 1, out, time);
    }

  private:
    static bool tell(const std::vector<std::string>& names, std::size_t i, std::string& name) {
        return i < names.size() && (name = names[i], true);
    }
    bool measure(int begin, int count, double factor, Values& out, double& time) const {
        std::vector<double> shown;
        if (!senses_.look(shown)) return false;
        out.resize(static_cast<std::size_t>(count));
        for (int k = 0; k < count; ++k)
            out[static_cast<std::size_t>(k)] = factor * shown[static_cast<std::size_t>(begin + k)];
        time = shown[0];
        return true;
    }
    const Senses& senses_;
};

} // namespace bf::yarp

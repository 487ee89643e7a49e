#include "sensor_port.hpp"

#include "units.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <yarp/os/Network.h>
#include <yarp/os/Property.h>
#include <yarp/os/Stamp.h>

namespace bf::yarp {

namespace os = ::yarp::os;
namespace dev = ::yarp::dev;

SensorPort::SensorPort(const std::string& text, middleware::Sensor kind)
    : is_imu_(kind == middleware::Sensor::imu) {
    const auto equals = text.find('=');
    name = text.substr(0, equals);
    from_ = text.substr(equals + 1);
    came_.setZero(is_imu_ ? middleware::imu_size : middleware::wrench_size);
}

void SensorPort::start(const std::string& local) {
    if (os::NetworkBase::exists(from_ + "/measures:o", true)) {
        os::Property wanted;
        wanted.put("device", "multipleanalogsensorsclient");
        wanted.put("remote", from_);
        wanted.put("local", local + "/" + name);
        if (!client_.open(wanted) || !client_.isValid()) refuse("its server does not answer");
        find_in_client();
    } else {
        port_ = std::make_unique<os::BufferedPort<os::Bottle>>();
        if (!port_->open(local + "/" + name + ":i") ||
            !os::NetworkBase::connect(from_, port_->getName(), "", true))
            refuse("there is no such port, and none at " + from_ + "/measures:o");
    }
}

void SensorPort::stop() noexcept {
    port_.reset();
    client_.close();
}

double SensorPort::look() {
    if (port_) {
        const auto* came = port_->read(false);
        const auto size = static_cast<std::size_t>(came_.size());
        if (came == nullptr || came->size() != size) return time_;
        for (std::size_t i = 0; i < size; ++i) came_[static_cast<Eigen::Index>(i)] = came->get(i).asFloat64();
        os::Stamp stamp;
        port_->getEnvelope(stamp);
        return time_ = stamp.getTime();
    }
    time_ = std::numeric_limits<double>::infinity(); // the oldest
    double time = 0;
    const auto take = [&](bool is_good, Eigen::Index begin, Eigen::Index count) {
        if (!is_good || part_.size() != static_cast<std::size_t>(count)) {
            time_ = -1;
            return;
        }
        came_.segment(begin, count) = Eigen::Map<const Eigen::VectorXd>(part_.data(), count);
        time_ = std::min(time_, time);
    };
    if (wrench_) take(wrench_->getSixAxisForceTorqueSensorMeasure(index_[0], part_, time), 0, 6);
    if (orientation_)
        take(orientation_->getOrientationSensorMeasureAsRollPitchYaw(index_[0], part_, time), 0, 3);
    if (acceleration_)
        take(acceleration_->getThreeAxisLinearAccelerometerMeasure(index_[1], part_, time), 3, 3);
    if (velocity_) take(velocity_->getThreeAxisGyroscopeMeasure(index_[2], part_, time), 6, 3);
    if (field_) take(field_->getThreeAxisMagnetometerMeasure(index_[3], part_, time), 9, 3);
    return time_;
}

void SensorPort::read(Eigen::Ref<Eigen::VectorXd> values) {
    look();
    values = came_;
    if (is_imu_) { // YARP gives angles and angular velocities in degrees
        values.head<3>() /= degrees;
        values.segment<3>(6) /= degrees;
    }
}

void SensorPort::refuse(const std::string& why) const {
    throw std::runtime_error(
        "the sensor '" + name + "' at " + from_ + ": " + why +
        "; give sensors as name=/port, of a stream or a server of MultipleAnalogSensors");
}

template <class I, class Count, class Name>
I* SensorPort::find(std::size_t& index, Count count, Name name_of) {
    I* view = nullptr;
    if (!client_.view(view)) return nullptr;
    const std::size_t number = (view->*count)();
    std::string its;
    for (index = 0; index < number; ++index)
        if ((view->*name_of)(index, its) && its == name) return view;
    index = 0;
    return number == 1 ? view : nullptr;
}

void SensorPort::find_in_client() {
    if (is_imu_) {
        orientation_ =
            find<dev::IOrientationSensors>(index_[0], &dev::IOrientationSensors::getNrOfOrientationSensors,
                                           &dev::IOrientationSensors::getOrientationSensorName);
        acceleration_ = find<dev::IThreeAxisLinearAccelerometers>(
            index_[1], &dev::IThreeAxisLinearAccelerometers::getNrOfThreeAxisLinearAccelerometers,
            &dev::IThreeAxisLinearAccelerometers::getThreeAxisLinearAccelerometerName);
        velocity_ =
            find<dev::IThreeAxisGyroscopes>(index_[2], &dev::IThreeAxisGyroscopes::getNrOfThreeAxisGyroscopes,
                                            &dev::IThreeAxisGyroscopes::getThreeAxisGyroscopeName);
        field_ = find<dev::IThreeAxisMagnetometers>(
            index_[3], &dev::IThreeAxisMagnetometers::getNrOfThreeAxisMagnetometers,
            &dev::IThreeAxisMagnetometers::getThreeAxisMagnetometerName);
        if (!orientation_ && !acceleration_ && !velocity_ && !field_)
            refuse("the server has no such inertial sensor");
    } else {
        wrench_ = find<dev::ISixAxisForceTorqueSensors>(
            index_[0], &dev::ISixAxisForceTorqueSensors::getNrOfSixAxisForceTorqueSensors,
            &dev::ISixAxisForceTorqueSensors::getSixAxisForceTorqueSensorName);
        if (!wrench_) refuse("the server has no such force/torque sensor");
    }
}

} // namespace bf::yarp

#include "panel.hpp"

#include "bf/middleware/clock.hpp"
#include "units.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/IPidControl.h>
#include <yarp/dev/IPreciselyTimed.h>
#include <yarp/os/Stamp.h>

namespace bf::yarp {

using middleware::ControlMode;
using middleware::ExchangeBuffer;
using middleware::Measurement;

namespace dev = ::yarp::dev;

int control_mode_of(int vocab) {
    switch (vocab) {
    case VOCAB_CM_POSITION:
    case VOCAB_CM_POSITION_DIRECT:
    case VOCAB_CM_VELOCITY: return static_cast<int>(ControlMode::position_direct);
    case VOCAB_CM_TORQUE:
    case VOCAB_CM_IDLE: return static_cast<int>(ControlMode::torque);
    case VOCAB_CM_PWM: return static_cast<int>(ControlMode::pwm);
    case VOCAB_CM_CURRENT: return static_cast<int>(ControlMode::current);
    default: return -1;
    }
}

namespace {

constexpr double default_speed = 10 / degrees; ///< rad/s or m/s
constexpr double unlimited = 1e6;              ///< rad/s2 or m/s2

class Device final : public Panel,
                     public dev::DeviceDriver,
                     public dev::IEncodersTimed,
                     public dev::IMotorEncoders,
                     public dev::IControlMode,
                     public dev::IPositionControl,
                     public dev::IPositionDirect,
                     public dev::IVelocityControl,
                     public dev::ITorqueControl,
                     public dev::IPWMControl,
                     public dev::ICurrentControl,
                     public dev::IControlLimits,
                     public dev::IPidControl,
                     public dev::IAxisInfo,
                     public dev::IInteractionMode,
                     public dev::IPreciselyTimed {
  public:
    Device(const std::vector<std::string>& joints, SharedBoard& shared)
        : shared_(shared), names_(joints), wishes_(static_cast<int>(joints.size()) * Wish::size),
          wished_(joints.size()) {
        for (const auto& joint : joints)
            numbers_.push_back(
                static_cast<int>(std::ranges::find(shared.joints, joint) - shared.joints.begin()));
        std::vector<double> shown;
        look(shown);
        for (std::size_t j = 0; j < wished_.size(); ++j) {
            Wish& wish = wished_[j];
            wish.mode = VOCAB_CM_POSITION;
            wish.values[Wish::position] = wish.values[Wish::direct] =
                shown[at(shared_.at.measurement(Measurement::joint_position) + numbers_[j])];
            wish.values[Wish::speed] = default_speed;
            wish.values[Wish::acceleration] = unlimited;
        }
        send();
    }

    dev::DeviceDriver& driver() override { return *this; }
    const middleware::Exchange& wishes() const override { return wishes_; }
    const std::vector<int>& numbers() const override { return numbers_; }

    // ---- measurements
    bool getAxes(int* n) override { return *n = size(), true; }
    bool getEncoder(int j, double* v) override { return one(Measurement::joint_position, j, v); }
    bool getEncoders(double* v) override { return all(Measurement::joint_position, v); }
    bool getEncoderSpeed(int j, double* v) override { return one(Measurement::joint_velocity, j, v); }
    bool getEncoderSpeeds(double* v) override { return all(Measurement::joint_velocity, v); }
    bool getEncoderAcceleration(int j, double* v) override {
        return one(Measurement::joint_acceleration, j, v);
    }
    bool getEncoderAccelerations(double* v) override { return all(Measurement::joint_acceleration, v); }
    bool getEncodersTimed(double* v, double* t) override { return timed(Measurement::joint_position, v, t); }
    bool getEncoderTimed(int j, double* v, double* t) override {
        return timed(Measurement::joint_position, j, v, t);
    }
    bool getNumberOfMotorEncoders(int* n) override { return getAxes(n); }
    bool getMotorEncoder(int j, double* v) override { return one(Measurement::motor_position, j, v); }
    bool getMotorEncoders(double* v) override { return all(Measurement::motor_position, v); }
    bool getMotorEncodersTimed(double* v, double* t) override {
        return timed(Measurement::motor_position, v, t);
    }
    bool getMotorEncoderTimed(int j, double* v, double* t) override {
        return timed(Measurement::motor_position, j, v, t);
    }
    bool getMotorEncoderSpeed(int j, double* v) override { return one(Measurement::motor_velocity, j, v); }
    bool getMotorEncoderSpeeds(double* v) override { return all(Measurement::motor_velocity, v); }
    bool getMotorEncoderAcceleration(int j, double* v) override {
        return one(Measurement::motor_acceleration, j, v);
    }
    bool getMotorEncoderAccelerations(double* v) override { return all(Measurement::motor_acceleration, v); }
    bool getTorque(int j, double* v) override { return one(Measurement::joint_torque, j, v); }
    bool getTorques(double* v) override { return all(Measurement::joint_torque, v); }
    bool getDutyCycle(int j, double* v) override { return one(Measurement::motor_pwm, j, v); }
    bool getDutyCycles(double* v) override { return all(Measurement::motor_pwm, v); }
    bool getCurrent(int j, double* v) override { return one(Measurement::motor_current, j, v); }
    bool getCurrents(double* v) override { return all(Measurement::motor_current, v); }
    ::yarp::os::Stamp getLastInputStamp() override {
        std::vector<double> shown;
        return look(shown) ? ::yarp::os::Stamp(0, shown[0]) : ::yarp::os::Stamp();
    }
    // A simulated encoder is where its joint is.
    bool resetEncoder(int) override { return false; }
    bool resetEncoders() override { return false; }
    bool setEncoder(int, double) override { return false; }
    bool setEncoders(const double*) override { return false; }
    bool resetMotorEncoder(int) override { return false; }
    bool resetMotorEncoders() override { return false; }
    bool setMotorEncoder(int, const double) override { return false; }
    bool setMotorEncoders(const double*) override { return false; }
    bool setMotorEncoderCountsPerRevolution(int, const double) override { return false; }
    bool getMotorEncoderCountsPerRevolution(int, double*) override { return false; }
    bool getTorqueRange(int, double*, double*) override { return false; }
    bool getTorqueRanges(double*, double*) override { return false; }
    bool getCurrentRange(int, double*, double*) override { return false; }
    bool getCurrentRanges(double*, double*) override { return false; }

    // ---- what the joints are
    bool getAxisName(int j, std::string& name) override { return has(j) && (name = names_[at(j)], true); }
    bool getJointType(int j, dev::JointTypeEnum& type) override {
        if (!has(j)) return false;
        type = is_prismatic(j) ? dev::VOCAB_JOINTTYPE_PRISMATIC : dev::VOCAB_JOINTTYPE_REVOLUTE;
        return true;
    }
    bool getLimits(int j, double* low, double* high) override {
        return limits(j, shared_.position_min, shared_.position_max, low, high);
    }
    bool getVelLimits(int j, double* low, double* high) override {
        return limits(j, shared_.velocity_min, shared_.velocity_max, low, high);
    }
    bool setLimits(int, double, double) override { return false; }
    bool setVelLimits(int, double, double) override { return false; }

    // ---- modes
    bool getControlMode(int j, int* mode) override {
        std::vector<double> shown;
        if (!has(j) || !look(shown)) return false;
        *mode = static_cast<int>(shown[static_cast<std::size_t>(shared_.at.modes() + numbers_[at(j)])]);
        return true;
    }
    bool getControlModes(int* modes) override {
        return every([&](int j, int k) { return getControlMode(j, &modes[k]); });
    }
    bool getControlModes(const int n, const int* joints, int* modes) override {
        return every(n, joints, [&](int j, int k) { return getControlMode(j, &modes[k]); });
    }
    bool setControlMode(const int j, const int mode) override { return set_modes(1, &j, &mode); }
    bool setControlModes(const int n, const int* joints, int* modes) override {
        return set_modes(n, joints, modes);
    }
    bool setControlModes(int* modes) override { return set_modes(size(), nullptr, modes); }
    bool getInteractionMode(int j, dev::InteractionModeEnum* mode) override {
        return has(j) && (*mode = dev::VOCAB_IM_STIFF, true);
    }
    bool getInteractionModes(int n, int* joints, dev::InteractionModeEnum* modes) override {
        return every(n, joints, [&](int j, int k) { return getInteractionMode(j, &modes[k]); });
    }
    bool getInteractionModes(dev::InteractionModeEnum* modes) override {
        return every([&](int j, int k) { return getInteractionMode(j, &modes[k]); });
    }
    bool setInteractionMode(int j, dev::InteractionModeEnum mode) override {
        return has(j) && mode == dev::VOCAB_IM_STIFF;
    }
    bool setInteractionModes(int n, int* joints, dev::InteractionModeEnum* modes) override {
        return every(n, joints, [&](int j, int k) { return setInteractionMode(j, modes[k]); });
    }
    bool setInteractionModes(dev::InteractionModeEnum* modes) override {
        return every([&](int j, int k) { return setInteractionMode(j, modes[k]); });
    }

    // ---- references
    bool positionMove(int j, double v) override { return set(Wish::position, 1, &j, &v); }
    bool positionMove(const double* v) override { return set(Wish::position, size(), nullptr, v); }
    bool positionMove(const int n, const int* joints, const double* v) override {
        return set(Wish::position, n, joints, v);
    }
    bool relativeMove(int j, double v) override { return move(1, &j, &v); }
    bool relativeMove(const double* v) override { return move(size(), nullptr, v); }
    bool relativeMove(const int n, const int* joints, const double* v) override { return move(n, joints, v); }
    bool checkMotionDone(int j, bool* is_done) override {
        std::vector<double> shown;
        double target = 0;
        if (!look(shown) || !get(Wish::position, 1, &j, &target)) return false;
        const double led = shown[static_cast<std::size_t>(shared_.at.led() + numbers_[at(j)])];
        *is_done = std::abs(led * unit(Wish::position, j) - target) < 1e-9;
        return true;
    }
    bool checkMotionDone(bool* are_done) override {
        *are_done = true;
        return every([&](int j, int) {
            bool is_done = false;
            const bool is_good = checkMotionDone(j, &is_done);
            *are_done = *are_done && is_done;
            return is_good;
        });
    }
    bool checkMotionDone(const int n, const int* joints, bool* are_done) override {
        *are_done = true;
        return every(n, joints, [&](int j, int) {
            bool is_done = false;
            const bool is_good = checkMotionDone(j, &is_done);
            *are_done = *are_done && is_done;
            return is_good;
        });
    }
    bool setRefSpeed(int j, double v) override { return set(Wish::speed, 1, &j, &v); }
    bool setRefSpeeds(const double* v) override { return set(Wish::speed, size(), nullptr, v); }
    bool setRefSpeeds(const int n, const int* joints, const double* v) override {
        return set(Wish::speed, n, joints, v);
    }
    bool getRefSpeed(int j, double* v) override { return get(Wish::speed, 1, &j, v); }
    bool getRefSpeeds(double* v) override { return get(Wish::speed, size(), nullptr, v); }
    bool getRefSpeeds(const int n, const int* joints, double* v) override {
        return get(Wish::speed, n, joints, v);
    }
    bool setRefAcceleration(int j, double v) override { return set(Wish::acceleration, 1, &j, &v); }
    bool setRefAccelerations(const double* v) override { return set(Wish::acceleration, size(), nullptr, v); }
    bool setRefAccelerations(const int n, const int* joints, const double* v) override {
        return set(Wish::acceleration, n, joints, v);
    }
    bool getRefAcceleration(int j, double* v) override { return get(Wish::acceleration, 1, &j, v); }
    bool getRefAccelerations(double* v) override { return get(Wish::acceleration, size(), nullptr, v); }
    bool getRefAccelerations(const int n, const int* joints, double* v) override {
        return get(Wish::acceleration, n, joints, v);
    }
    bool stop(int j) override { return halt(1, &j); }
    bool stop() override { return halt(size(), nullptr); }
    bool stop(const int n, const int* joints) override { return halt(n, joints); }
    bool getTargetPosition(const int j, double* v) override { return get(Wish::position, 1, &j, v); }
    bool getTargetPositions(double* v) override { return get(Wish::position, size(), nullptr, v); }
    bool getTargetPositions(const int n, const int* joints, double* v) override {
        return get(Wish::position, n, joints, v);
    }
    bool setPosition(int j, double v) override { return set(Wish::direct, 1, &j, &v); }
    bool setPositions(const double* v) override { return set(Wish::direct, size(), nullptr, v); }
    bool setPositions(const int n, const int* joints, const double* v) override {
        return set(Wish::direct, n, joints, v);
    }
    bool getRefPosition(const int j, double* v) override { return get(Wish::direct, 1, &j, v); }
    bool getRefPositions(double* v) override { return get(Wish::direct, size(), nullptr, v); }
    bool getRefPositions(const int n, const int* joints, double* v) override {
        return get(Wish::direct, n, joints, v);
    }
    bool velocityMove(int j, double v) override { return set(Wish::velocity, 1, &j, &v); }
    bool velocityMove(const double* v) override { return set(Wish::velocity, size(), nullptr, v); }
    bool velocityMove(const int n, const int* joints, const double* v) override {
        return set(Wish::velocity, n, joints, v);
    }
    bool getRefVelocity(const int j, double* v) override { return get(Wish::velocity, 1, &j, v); }
    bool getRefVelocities(double* v) override { return get(Wish::velocity, size(), nullptr, v); }
    bool getRefVelocities(const int n, const int* joints, double* v) override {
        return get(Wish::velocity, n, joints, v);
    }
    bool setRefTorque(int j, double v) override { return set(Wish::torque, 1, &j, &v); }
    bool setRefTorques(const double* v) override { return set(Wish::torque, size(), nullptr, v); }
    bool setRefTorques(const int n, const int* joints, const double* v) override {
        return set(Wish::torque, n, joints, v);
    }
    bool getRefTorque(int j, double* v) override { return get(Wish::torque, 1, &j, v); }
    bool getRefTorques(double* v) override { return get(Wish::torque, size(), nullptr, v); }
    bool getNumberOfMotors(int* n) override { return getAxes(n); }
    bool setRefDutyCycle(int j, double v) override { return set(Wish::pwm, 1, &j, &v); }
    bool setRefDutyCycles(const double* v) override { return set(Wish::pwm, size(), nullptr, v); }
    bool getRefDutyCycle(int j, double* v) override { return get(Wish::pwm, 1, &j, v); }
    bool getRefDutyCycles(double* v) override { return get(Wish::pwm, size(), nullptr, v); }
    bool setRefCurrent(int j, double v) override { return set(Wish::current, 1, &j, &v); }
    bool setRefCurrents(const double* v) override { return set(Wish::current, size(), nullptr, v); }
    bool setRefCurrents(const int n, const int* joints, const double* v) override {
        return set(Wish::current, n, joints, v);
    }
    bool getRefCurrent(int j, double* v) override { return get(Wish::current, 1, &j, v); }
    bool getRefCurrents(double* v) override { return get(Wish::current, size(), nullptr, v); }

    // ---- gains
    bool setPid(const dev::PidControlTypeEnum& type, int j, const dev::Pid& pid) override {
        auto* gains = gains_of(type);
        if (!gains || !has(j) || !std::isfinite(pid.kp) || !std::isfinite(pid.ki) || !std::isfinite(pid.kd))
            return false;
        const std::lock_guard lock(shared_.settings.mutex);
        const auto i = numbers_[at(j)];
        gains->P[i] = pid.kp;
        gains->I[i] = pid.ki;
        gains->D[i] = pid.kd;
        shared_.settings.changed |= type == dev::VOCAB_PIDTYPE_TORQUE ? 2 : 1;
        return true;
    }
    bool setPids(const dev::PidControlTypeEnum& type, const dev::Pid* pids) override {
        return every([&](int j, int k) { return setPid(type, j, pids[k]); });
    }
    bool getPid(const dev::PidControlTypeEnum& type, int j, dev::Pid* pid) override {
        const auto* gains = gains_of(type);
        if (!gains || !has(j)) return false;
        const std::lock_guard lock(shared_.settings.mutex);
        const auto i = numbers_[at(j)];
        pid->kp = gains->P[i];
        pid->ki = gains->I[i];
        pid->kd = gains->D[i];
        return true;
    }
    bool getPids(const dev::PidControlTypeEnum& type, dev::Pid* pids) override {
        return every([&](int j, int k) { return getPid(type, j, &pids[k]); });
    }
    bool getMotorTorqueParams(int j, dev::MotorTorqueParameters* parameters) override {
        if (!shared_.has_motor_parameters || !has(j)) return false;
        const std::lock_guard lock(shared_.settings.mutex);
        parameters->ktau = shared_.settings.motors.k_tau[numbers_[at(j)]];
        parameters->bemf = shared_.settings.motors.k_bemf[numbers_[at(j)]];
        return true;
    }
    bool setMotorTorqueParams(int j, const dev::MotorTorqueParameters parameters) override {
        if (!shared_.has_motor_parameters || !has(j) || !std::isfinite(parameters.ktau) ||
            !std::isfinite(parameters.bemf))
            return false;
        const std::lock_guard lock(shared_.settings.mutex);
        shared_.settings.motors.k_tau[numbers_[at(j)]] = parameters.ktau;
        shared_.settings.motors.k_bemf[numbers_[at(j)]] = parameters.bemf;
        shared_.settings.changed |= 4;
        return true;
    }
    // The loops of a world have gains, and nothing else that is told or changed.
    using Type = dev::PidControlTypeEnum;
    bool isPidEnabled(const Type& type, int j, bool* is) override {
        return gains_of(type) && has(j) && (*is = true, true);
    }
    bool setPidReference(const Type&, int, double) override { return false; }
    bool setPidReferences(const Type&, const double*) override { return false; }
    bool setPidErrorLimit(const Type&, int, double) override { return false; }
    bool setPidErrorLimits(const Type&, const double*) override { return false; }
    bool getPidError(const Type&, int, double*) override { return false; }
    bool getPidErrors(const Type&, double*) override { return false; }
    bool getPidOutput(const Type&, int, double*) override { return false; }
    bool getPidOutputs(const Type&, double*) override { return false; }
    bool getPidReference(const Type&, int, double*) override { return false; }
    bool getPidReferences(const Type&, double*) override { return false; }
    bool getPidErrorLimit(const Type&, int, double*) override { return false; }
    bool getPidErrorLimits(const Type&, double*) override { return false; }
    bool resetPid(const Type&, int) override { return false; }
    bool disablePid(const Type&, int) override { return false; }
    bool enablePid(const Type&, int) override { return false; }
    bool setPidOffset(const Type&, int, double) override { return false; }

  private:
    static std::size_t at(int j) { return static_cast<std::size_t>(j); }
    int size() const { return static_cast<int>(names_.size()); }
    bool has(int j) const { return j >= 0 && j < size(); }
    bool is_prismatic(int j) const { return shared_.is_prismatic[at(numbers_[at(j)])]; }
    /// YARP's for one of ours: degrees for angles, and m, N and what is raw as they are.
    double angle(int j) const { return is_prismatic(j) ? 1 : degrees; }
    double unit(Measurement what, int j) const { return is_of_angles(what) ? angle(j) : 1; }
    double unit(int wish, int j) const {
        return wish == Wish::torque || wish == Wish::pwm || wish == Wish::current ? 1 : angle(j);
    }

    /// f(joint, place in the list); null joints are all of them.
    template <class F> bool every(int n, const int* joints, F&& f) {
        if (n < 0 || n > size()) return false;
        for (int k = 0; k < n; ++k)
            if (const int j = joints ? joints[k] : k; !has(j) || !f(j, k)) return false;
        return true;
    }
    template <class F> bool every(F&& f) { return every(size(), nullptr, f); }

    bool look(std::vector<double>& shown) {
        shown.resize(at(shared_.at.size()));
        middleware::Stamp stamp;
        // A step that shows another state in the middle of this is over soon.
        for (int tries = 0; tries < 100; ++tries)
            if (shared_.shown.read(shown.data(), stamp)) return true;
        return false;
    }
    bool one(Measurement what, int j, double* v) {
        std::vector<double> shown;
        if (!has(j) || !measures(what) || !look(shown)) return false;
        *v = unit(what, j) * shown[at(shared_.at.measurement(what) + numbers_[at(j)])];
        return true;
    }
    bool all(Measurement what, double* v) {
        std::vector<double> shown;
        if (!measures(what) || !look(shown)) return false;
        for (int j = 0; j < size(); ++j)
            v[j] = unit(what, j) * shown[at(shared_.at.measurement(what) + numbers_[at(j)])];
        return true;
    }
    bool timed(Measurement what, double* v, double* t) {
        std::vector<double> shown;
        if (!measures(what) || !look(shown)) return false;
        for (int j = 0; j < size(); ++j)
            v[j] = unit(what, j) * shown[at(shared_.at.measurement(what) + numbers_[at(j)])];
        std::fill_n(t, size(), shown[0]);
        return true;
    }
    bool timed(Measurement what, int j, double* v, double* t) {
        std::vector<double> shown;
        if (!has(j) || !measures(what) || !look(shown)) return false;
        *v = unit(what, j) * shown[at(shared_.at.measurement(what) + numbers_[at(j)])];
        *t = shown[0];
        return true;
    }
    bool measures(Measurement what) const { return shared_.measurements >> static_cast<int>(what) & 1; }
    bool limits(int j, const Eigen::VectorXd& lowest, const Eigen::VectorXd& highest, double* low,
                double* high) {
        if (!has(j)) return false;
        *low = angle(j) * lowest[numbers_[at(j)]];
        *high = angle(j) * highest[numbers_[at(j)]];
        return true;
    }
    toolbox::Gains* gains_of(const dev::PidControlTypeEnum& type) {
        if (type == dev::VOCAB_PIDTYPE_POSITION && shared_.has_position_gains)
            return &shared_.settings.position;
        return type == dev::VOCAB_PIDTYPE_TORQUE && shared_.has_torque_gains ? &shared_.settings.torque
                                                                             : nullptr;
    }

    bool set(int what, int n, const int* joints, const double* values) {
        const std::lock_guard lock(mutex_);
        if (!every(n, joints, [&](int, int k) { return std::isfinite(values[k]); })) return false;
        every(n, joints, [&](int j, int k) {
            wished_[at(j)].values[what] = values[k] / unit(what, j);
            return true;
        });
        return send();
    }
    bool get(int what, int n, const int* joints, double* values) {
        const std::lock_guard lock(mutex_);
        return every(n, joints, [&](int j, int k) {
            values[k] = wished_[at(j)].values[what] * unit(what, j);
            return true;
        });
    }
    bool move(int n, const int* joints, const double* deltas) {
        std::vector<double> targets(names_.size());
        return every(n, joints, [&](int j, int k) { return getEncoder(j, &targets[at(k)]); }) &&
               (every(n, joints, [&](int, int k) { return targets[at(k)] += deltas[k], true; }),
                set(Wish::position, n, joints, targets.data()));
    }
    bool halt(int n, const int* joints) {
        const std::vector<double> zeros(names_.size());
        return set(Wish::velocity, n, joints, zeros.data()) && move(n, joints, zeros.data());
    }
    /// Joints that go over to another mode stay where they are, or go on with what their motors give.
    bool set_modes(int n, const int* joints, const int* modes) {
        std::vector<double> shown;
        if (!look(shown)) return false;
        const std::lock_guard lock(mutex_);
        const auto known = [&](int, int k) {
            const int mode = control_mode_of(vocab(modes[k]));
            return mode >= 0 && (shared_.modes >> mode & 1);
        };
        if (!every(n, joints, known)) return false;
        every(n, joints, [&](int j, int k) {
            Wish& wish = wished_[at(j)];
            const int mode = vocab(modes[k]);
            ++wish.times;
            if (wish.mode == mode && shown[at(shared_.at.modes() + numbers_[at(j)])] == mode) return true;
            wish.mode = mode;
            const auto measured = [&](Measurement what) {
                return measures(what) ? shown[at(shared_.at.measurement(what) + numbers_[at(j)])] : 0;
            };
            wish.values[Wish::position] = wish.values[Wish::direct] = measured(Measurement::joint_position);
            wish.values[Wish::velocity] = 0;
            wish.values[Wish::torque] = measured(Measurement::joint_torque);
            wish.values[Wish::pwm] = measured(Measurement::motor_pwm);
            wish.values[Wish::current] = measured(Measurement::motor_current);
            return true;
        });
        return send();
    }
    static int vocab(int mode) { return mode == VOCAB_CM_FORCE_IDLE ? VOCAB_CM_IDLE : mode; }
    bool send() {
        std::vector<double> values;
        for (const auto& wish : wished_) {
            values.push_back(wish.mode);
            values.push_back(wish.times);
            values.insert(values.end(), wish.values, wish.values + Wish::count);
        }
        wishes_.write(values.data(), middleware::now());
        return true;
    }

    SharedBoard& shared_;
    const std::vector<std::string> names_;
    std::vector<int> numbers_;
    ExchangeBuffer wishes_;
    std::mutex mutex_; ///< among threads of YARP
    std::vector<Wish> wished_;
};

} // namespace

std::unique_ptr<Panel> make_panel(const std::vector<std::string>& joints, SharedBoard& shared) {
    return std::make_unique<Device>(joints, shared);
}

} // namespace bf::yarp

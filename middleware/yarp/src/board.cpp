#include "board.hpp"

#include "bf/core/interrupt.hpp"
#include "bf/core/value.hpp"
#include "bf/middleware/clock.hpp"
#include "clients.hpp"
#include "devices.hpp"
#include "network.hpp"
#include "sensor_port.hpp"
#include "units.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <list>
#include <optional>
#include <stdexcept>
#include <unistd.h>
#include <utility>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/IPidControl.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/Network.h>
#include <yarp/os/Property.h>
#include <yarp/os/Stamp.h>
#include <yarp/os/SystemClock.h>
#include <yarp/os/Time.h>

namespace bf::yarp {

using Eigen::MatrixXd, Eigen::VectorXd;
using middleware::ControlMode;
using middleware::Limits;
using middleware::Loop;
using middleware::Measurement;
using middleware::Sensor;

namespace {

namespace os = ::yarp::os;
namespace dev = ::yarp::dev;

constexpr double longest_switch = 1;  ///< s until a board tells of a mode that was set
constexpr double longest_way = 0.2;   ///< s by which a state may be overtaken
constexpr double longest_stand = 0.2; ///< s between two states of a simulator that runs
constexpr double longest_wait = 4;    ///< s for what a simulator was told or measures to come
constexpr double no_time = 0;         ///< s, the stamps of boards without a clock
constexpr double never = -std::numeric_limits<double>::infinity();

os::Bottle list_of(const std::vector<std::string>& words) {
    os::Bottle list;
    for (const auto& word : words) list.addString(word);
    return list;
}

/// The modes of YARP's boards; 0: they have none like that.
int vocab_of(ControlMode mode) {
    switch (mode) {
    case ControlMode::position: return VOCAB_CM_POSITION;
    case ControlMode::position_direct: return VOCAB_CM_POSITION_DIRECT;
    case ControlMode::velocity: return VOCAB_CM_VELOCITY;
    case ControlMode::torque: return VOCAB_CM_TORQUE;
    case ControlMode::pwm: return VOCAB_CM_PWM;
    case ControlMode::current: return VOCAB_CM_CURRENT;
    case ControlMode::impedance: return 0;
    }
    return 0;
}

class Board final : public toolbox::RobotConnection {
  public:
    explicit Board(const BoardOptions& options)
        : options_(options), n_(static_cast<int>(options.joints.size())) {
        for (const auto& text : options.wrenches) wrenches_.emplace_back(text, Sensor::wrench);
        for (const auto& text : options.imus) imus_.emplace_back(text, Sensor::imu);
    }
    ~Board() override { stop(); }

    void start() override {
        stop();
        join();
        load_devices();
        const double end = middleware::now() + 0.9 * options_.start_timeout; // so that it says why itself
        os::Property wanted;
        wanted.put("device", "remotecontrolboardremapper");
        std::vector<std::string> boards;
        for (const auto& board : options_.boards) boards.push_back("/" + options_.robot + "/" + board);
        await(boards, end);
        const auto add = [&](const char* key, const std::vector<std::string>& words) {
            os::Bottle list = list_of(words);
            wanted.addGroup(key);
            os::Value value;
            value.fromString(("(" + list.toString() + ")").c_str());
            wanted.put(key, value);
        };
        add("axesNames", options_.joints);
        add("remoteControlBoards", boards);
        // The name server gives a name the socket of before again, which the system keeps closed for a
        // minute.
        const std::string local =
            !options_.local.empty() ? options_.local
                                    : "/blockfactory/" + std::to_string(getpid()) + "." +
                                          std::to_string(static_cast<std::int64_t>(middleware::now() * 1e6));
        auto& each = wanted.addGroup("REMOTE_CONTROLBOARD_OPTIONS");
        each.put("writeStrict", "on");
        each.put("carrier", options_.carrier);
        drives_.emplace(options_.joints);
        // Where packets are lost YARP may give up early.
        const auto opens = [&](int tries) {
            const std::string prefix = tries == 0 ? local : local + "." + std::to_string(tries);
            wanted.put("localPortPrefix", prefix);
            // The driver's port is there before others see that this one is connected.
            return drives_->open(prefix) && driver_.open(wanted) && driver_.isValid();
        };
        bool is_open = false;
        constexpr double longest_try = 2; // s
        for (int tries = 0; tries < 6 && !is_open; ++tries) {
            if (tries > 0 && middleware::now() + longest_try > end) break;
            is_open = opens(tries);
        }
        if (!is_open)
            throw std::runtime_error("its control boards " + list_of(boards).toString() +
                                     " do not open; look whether they have the joints " +
                                     list_of(options_.joints).toString() +
                                     ", and are of this version of YARP");
        await_joints(options_.robot, boards, options_.joints, wanted.find("localPortPrefix").asString(), end);
        driver_.view(encoders_);
        driver_.view(stamped_);
        driver_.view(motors_);
        driver_.view(modes_);
        driver_.view(positions_);
        driver_.view(direct_);
        driver_.view(velocities_);
        driver_.view(torques_);
        driver_.view(pwm_);
        driver_.view(currents_);
        driver_.view(limits_);
        driver_.view(pids_);
        if (!encoders_ || !stamped_ || !modes_)
            throw std::runtime_error("its boards have no encoders or no control modes");
        find_units();
        newest_ = States(n_);
        if (!waits_for([&] { return look(); }, std::max(longest_wait, end - middleware::now())))
            throw std::runtime_error("its encoders send nothing; look at the robot, or raise start_timeout");
        for (auto* ports : {&wrenches_, &imus_})
            for (auto& sensor : *ports) sensor.start(local);
        if (!options_.simulator.empty()) halt_simulator(local);
        speeds_.resize(n_);
        accelerations_.resize(n_);
        has_speeds_ = positions_ && positions_->getRefSpeeds(speeds_.data());
        has_accelerations_ = velocities_ && velocities_->getRefAccelerations(accelerations_.data());
        is_limited_ = false;
    }
    void stop() noexcept override {
        if (std::exchange(is_limited_, false)) {
            if (has_speeds_) positions_->setRefSpeeds(speeds_.data());
            if (has_accelerations_) velocities_->setRefAccelerations(accelerations_.data());
        }
        if (simulator_ && has_run_) simulator_->resume();
        simulator_.reset();
        for (auto* ports : {&wrenches_, &imus_})
            for (auto& sensor : *ports) sensor.stop();
        driver_.close();
        drives_.reset();
    }
    /// Of the newest measurements, by the clock of the boards, s.
    double time() { return newest_.stamps[0]; }
    double step_size() const { return simulator_->step_size(); }
    /// Lets the simulator do that many steps, and waits for what was measured then.
    bool advance(int steps) {
        due_ += steps * simulator_->step_size();
        const bool has_gone = simulator_->step(steps);
        if (has_gone && waits_for([&] { return has_come(); })) return true;
        std::snprintf(error_, sizeof error_, "%s",
                      has_gone ? "has gone on, and no measurements of that time have come within 4 s"
                               : "does not go on; look at its simulator");
        return false;
    }
    /// Where a simulator is led, which stands still meanwhile, its last state is that of now.
    double age() const noexcept override {
        return simulator_ ? 0 : middleware::now() - newest_.came.minCoeff();
    }

    /// Positions are looked at, and the others are those of the same state. Where it is led, that of the time
    /// has come before.
    bool read(Measurement what, Eigen::Ref<VectorXd> values) noexcept override {
        if (what == Measurement::joint_position && !simulator_ && !look()) return told(false, "no angles");
        return tell(what, values);
    }
    /// Of the newest state.
    bool tell(Measurement what, Eigen::Ref<VectorXd> values) noexcept {
        values = newest_.measured.col(static_cast<int>(what));
        if (newest_.has[static_cast<std::size_t>(what)]) return true;
        switch (what) {
        case Measurement::joint_torque: return told(false, "no joint torques");
        case Measurement::motor_current: return told(false, "no currents");
        case Measurement::motor_pwm: return told(false, "no PWM");
        default: return told(false, "no angles");
        }
    }
    bool read(Sensor kind, const std::string& name, Eigen::Ref<VectorXd> values) noexcept override {
        auto& ports = kind == Sensor::imu ? imus_ : wrenches_;
        for (auto& sensor : ports) {
            if (sensor.name != name) continue;
            sensor.read(values);
            return true;
        }
        return told(false, "no such sensor");
    }
    bool read(Limits which, Eigen::Ref<VectorXd> minimum, Eigen::Ref<VectorXd> maximum) noexcept override {
        for (int j = 0; j < n_; ++j) {
            double low = 0, high = 0;
            const bool is_known =
                limits_ && (which == Limits::position ? limits_->getLimits(j, &low, &high)
                                                      : limits_->getVelLimits(j, &low, &high));
            minimum[j] = is_known ? low * units_[j] : -std::numeric_limits<double>::infinity();
            maximum[j] = is_known ? high * units_[j] : std::numeric_limits<double>::infinity();
        }
        return true;
    }
    std::vector<std::string> sensors(Sensor kind) const override {
        std::vector<std::string> names;
        for (const auto& sensor : kind == Sensor::imu ? imus_ : wrenches_) names.push_back(sensor.name);
        return names;
    }
    bool set_mode(ControlMode mode) noexcept override {
        std::vector<int> all(static_cast<std::size_t>(n_), vocab_of(mode));
        const bool is_set = modes_->setControlModes(all.data());
        // While the answer was under way, states of the mode of before have come, which nobody looked at.
        look();
        agree(longest_switch);
        return told(is_set, "the mode was not set");
    }
    int joint_in_other_mode(ControlMode mode) noexcept override {
        const auto& all = newest_.modes;
        const auto other =
            std::find_if(all.begin(), all.end(), [&](int its) { return its != 0 && its != vocab_of(mode); });
        if (other == all.end()) {
            agree(longest_way);
            return -1;
        }
        // Its board tells of the mode of before for a while, by its own clock, which may begin again, and by
        // ours, as states wait for lost ones.
        const auto j = static_cast<int>(other - all.begin());
        const double stamp = newest_.stamps[j];
        agreed_ = std::min(agreed_, stamp);
        const bool is_since = stamp == no_time || stamp - agreed_ > patience_;
        return is_since && middleware::now() - agreed_at_ > patience_ ? j : -1;
    }
    bool set_trajectory_limit(ControlMode mode, double limit) noexcept override {
        const VectorXd all = VectorXd::Constant(n_, limit).cwiseQuotient(units_);
        is_limited_ = true;
        if (mode == ControlMode::position)
            return told(positions_ && positions_->setRefSpeeds(all.data()), "no speeds");
        if (mode == ControlMode::velocity)
            return told(velocities_ && velocities_->setRefAccelerations(all.data()), "no accelerations");
        return true;
    }
    bool write(ControlMode mode, const Eigen::Ref<const VectorXd>& references) noexcept override {
        const VectorXd ways = references.cwiseQuotient(units_), raw = references;
        VectorXd came(n_);
        // What is streamed comes at some time or gets lost, and a simulator goes on only when it has come.
        // Not all boards tell what they were given.
        const auto give = [&](auto* view, auto set, auto get, const VectorXd& what) {
            if (!view || !(view->*set)(what.data())) return false;
            double sent = middleware::now();
            return !simulator_ || waits_for([&] {
                if (!(view->*get)(came.data()) || (came - what).norm() <= 1e-9 * (1 + what.norm()))
                    return true;
                if (middleware::now() - sent > 0.02) {
                    (view->*set)(what.data());
                    sent = middleware::now();
                }
                return false;
            });
        };
        switch (mode) {
        case ControlMode::position: return positions_ && positions_->positionMove(ways.data());
        case ControlMode::position_direct:
            return give(direct_, All<dev::IPositionDirect>(&dev::IPositionDirect::setPositions),
                        Each<dev::IPositionDirect>(&dev::IPositionDirect::getRefPositions), ways);
        case ControlMode::velocity:
            return give(velocities_, All<dev::IVelocityControl>(&dev::IVelocityControl::velocityMove),
                        Each<dev::IVelocityControl>(&dev::IVelocityControl::getRefVelocities), ways);
        case ControlMode::torque:
            return give(torques_, All<dev::ITorqueControl>(&dev::ITorqueControl::setRefTorques),
                        Each<dev::ITorqueControl>(&dev::ITorqueControl::getRefTorques), raw);
        case ControlMode::pwm:
            return give(pwm_, All<dev::IPWMControl>(&dev::IPWMControl::setRefDutyCycles),
                        Each<dev::IPWMControl>(&dev::IPWMControl::getRefDutyCycles), raw);
        case ControlMode::current:
            return give(currents_, All<dev::ICurrentControl>(&dev::ICurrentControl::setRefCurrents),
                        Each<dev::ICurrentControl>(&dev::ICurrentControl::getRefCurrents), raw);
        case ControlMode::impedance: return false;
        }
        return false;
    }
    bool read_gains(Loop loop, toolbox::Gains& gains) noexcept override {
        std::vector<dev::Pid> pids(static_cast<std::size_t>(n_));
        if (!pids_ || !pids_->getPids(type_of(loop), pids.data())) return told(false, "no gains");
        for (int j = 0; j < n_; ++j) {
            const auto& pid = pids[static_cast<std::size_t>(j)];
            gains.P[j] = pid.kp;
            gains.I[j] = pid.ki;
            gains.D[j] = pid.kd;
        }
        return true;
    }
    bool write_gains(Loop loop, const toolbox::Gains& gains) noexcept override {
        std::vector<dev::Pid> pids(static_cast<std::size_t>(n_));
        if (!pids_ || !pids_->getPids(type_of(loop), pids.data())) return told(false, "no gains");
        for (int j = 0; j < n_; ++j) {
            auto& pid = pids[static_cast<std::size_t>(j)];
            pid.kp = gains.P[j];
            pid.ki = gains.I[j];
            pid.kd = gains.D[j];
        }
        return told(pids_->setPids(type_of(loop), pids.data()), "the gains were not set");
    }
    bool read_motor_parameters(toolbox::MotorParameters& parameters) noexcept override {
        for (int j = 0; j < n_; ++j) {
            dev::MotorTorqueParameters its;
            if (!torques_ || !torques_->getMotorTorqueParams(j, &its))
                return told(false, "no motor parameters");
            parameters.k_tau[j] = its.ktau;
            parameters.k_bemf[j] = its.bemf;
        }
        return true;
    }
    bool write_motor_parameters(const toolbox::MotorParameters& parameters) noexcept override {
        for (int j = 0; j < n_; ++j) {
            dev::MotorTorqueParameters its;
            if (!torques_ || !torques_->getMotorTorqueParams(j, &its))
                return told(false, "no motor parameters");
            its.ktau = parameters.k_tau[j];
            its.bemf = parameters.k_bemf[j];
            if (!torques_->setMotorTorqueParams(j, its))
                return told(false, "the motor parameters were not set");
        }
        return true;
    }
    const ErrorText& error() const noexcept override { return error_; }
    bool has_gains(Loop loop) {
        toolbox::Gains gains(n_);
        return read_gains(loop, gains);
    }
    bool has_motor_parameters() {
        toolbox::MotorParameters parameters(n_);
        return read_motor_parameters(parameters);
    }

  private:
    template <class I> using All = bool (I::*)(const double*);
    template <class I> using Each = bool (I::*)(double*);

    template <class F> static bool waits_for(F&& is_there, double patience = longest_wait) {
        for (const double end = middleware::now() + patience; !is_there();) {
            if (middleware::now() > end) return false;
            os::SystemClock::delaySystem(20e-6);
        }
        return true;
    }
    void await(const std::vector<std::string>& boards, double end) const {
        for (const auto& board : boards) {
            bool is_told = false;
            while (!is_there(board + "/stateExt:o")) { // the port that it opens last
                if (is_interrupted()) throw std::runtime_error(interrupted);
                if (middleware::now() > end)
                    throw std::runtime_error("there is no control board at " + board +
                                             " within start_timeout (" +
                                             bf::Value(options_.start_timeout).describe() +
                                             " s); start the robot's interface, or correct robot and boards");
                if (!std::exchange(is_told, true))
                    tell_wait(
                        ("the control board " + board + " of YARP robot '" + options_.robot + "'").c_str());
                os::SystemClock::delaySystem(0.05);
            }
        }
    }
    /// Prismatic joints are in m at both ends; a board that tells no kind has revolute ones.
    void find_units() {
        dev::IAxisInfo* axes = nullptr;
        driver_.view(axes);
        units_.setConstant(n_, 1 / degrees);
        for (int j = 0; axes && j < n_; ++j) {
            auto kind = dev::VOCAB_JOINTTYPE_UNKNOWN;
            if (axes->getJointType(j, kind) && kind == dev::VOCAB_JOINTTYPE_PRISMATIC) units_[j] = 1;
        }
    }
    void halt_simulator(const std::string& local) {
        simulator_ = Network().open()->open_simulator(options_.simulator, local + "/clock/rpc:o", 5);
        const double time = newest_.stamps.maxCoeff();
        has_run_ = waits_for([&] { return look() && newest_.stamps.maxCoeff() > time; }, longest_stand);
        if (!simulator_->pause() || !waits_for([&] { return look(); }))
            throw std::runtime_error("its boards tell no times, or " + options_.simulator +
                                     " does not pause it");
        // It may have gone on while it was halted, and the newest of all is what it stands at.
        for (const double end = middleware::now() + 0.05; middleware::now() < end; look())
            os::SystemClock::delaySystem(0.001);
        due_ = newest_.stamps.maxCoeff();
        if (!waits_for([&] { return has_come(); }))
            throw std::runtime_error("its joints or sensors send nothing of the time " +
                                     os::Value(due_).toString() + " s at which it was halted");
    }
    /// Is all of the newest step there?
    bool has_come() {
        const double from = due_ - simulator_->step_size() / 2;
        if (!look() || newest_.stamps.minCoeff() < from) return false;
        for (auto* ports : {&wrenches_, &imus_})
            for (auto& sensor : *ports)
                if (sensor.look() < from) return false;
        return true;
    }
    /// From the newest states on, joints may be in another mode for as long as that, s.
    void agree(double patience) {
        agreed_ = newest_.stamps.maxCoeff();
        agreed_at_ = middleware::now();
        patience_ = patience;
    }
    /// What was measured last of each joint.
    struct States {
        explicit States(int n = 0)
            : measured(MatrixXd::Zero(n, middleware::measurement_count)), modes(static_cast<std::size_t>(n)),
              stamps(VectorXd::Constant(n, never)), came(stamps) {}
        MatrixXd measured;
        std::array<bool, middleware::measurement_count> has{};
        std::vector<int> modes; ///< vocabs; 0: not told
        VectorXd stamps;        ///< by the clock of its board, s
        VectorXd came;          ///< by ours, s
    };
    /// What its boards tell at the moment, in our units; and of positions their stamps.
    bool get(Measurement what, double* to, double* stamps = nullptr) {
        const auto all = [&] {
            switch (what) {
            case Measurement::joint_position: return stamped_->getEncodersTimed(to, stamps);
            case Measurement::joint_velocity: return encoders_->getEncoderSpeeds(to);
            case Measurement::joint_acceleration: return encoders_->getEncoderAccelerations(to);
            case Measurement::joint_torque: return torques_ && torques_->getTorques(to);
            case Measurement::motor_position: return motors_ && motors_->getMotorEncoders(to);
            case Measurement::motor_velocity: return motors_ && motors_->getMotorEncoderSpeeds(to);
            case Measurement::motor_acceleration: return motors_ && motors_->getMotorEncoderAccelerations(to);
            case Measurement::motor_current: return currents_ && currents_->getCurrents(to);
            case Measurement::motor_pwm: return pwm_ && pwm_->getDutyCycles(to);
            }
            return false;
        };
        if (!all()) return false;
        Eigen::Map<VectorXd> values(to, n_);
        if (is_of_angles(what)) values.array() *= units_.array();
        return true;
    }
    /// Takes what is new of each joint. On their way states overtake each other, so one counts that is newer
    /// by its board's clock, where it has one. YARP's boards stamp a state with the time of the one before:
    /// several may have one stamp, of which nobody knows the order. Much older ones, when no newer ones
    /// come, are of a clock that has begun again. False: the boards tell nothing.
    bool look() {
        States now(n_);
        VectorXd none(n_), after(n_);
        for (int tries = 0; tries < 3; ++tries) {
            if (!get(Measurement::joint_position, now.measured.col(0).data(), now.stamps.data()))
                return false;
            for (int i = 0; i < middleware::measurement_count; ++i)
                now.has[static_cast<std::size_t>(i)] =
                    i == 0 || get(static_cast<Measurement>(i), now.measured.col(i).data());
            modes_->getControlModes(now.modes.data());
            if (!stamped_->getEncodersTimed(none.data(), after.data())) return false;
            newest_.has = now.has;
            const double time = middleware::now();
            for (int j = 0; j < n_; ++j) {
                const double stamp = now.stamps[j], newer = stamp - newest_.stamps[j];
                const bool has_begun_again =
                    !simulator_ && newer < -longest_way && time - newest_.came[j] > longest_way;
                if (after[j] != stamp || // another state has come meanwhile
                    !(newer > 0 || (newer == 0 && stamp == no_time) || has_begun_again))
                    continue;
                newest_.measured.row(j) = now.measured.row(j);
                newest_.modes[static_cast<std::size_t>(j)] = now.modes[static_cast<std::size_t>(j)];
                newest_.came[j] = time;
                newest_.stamps[j] = stamp;
            }
            if (after == now.stamps) break;
        }
        return newest_.stamps.minCoeff() > never;
    }
    static dev::PidControlTypeEnum type_of(Loop loop) {
        return loop == Loop::position ? dev::VOCAB_PIDTYPE_POSITION : dev::VOCAB_PIDTYPE_TORQUE;
    }
    bool told(bool is_good, const char* what) noexcept {
        if (!is_good) std::snprintf(error_, sizeof error_, "YARP robot %s: %s", options_.robot.c_str(), what);
        return is_good;
    }

    const BoardOptions options_;
    const int n_;
    std::optional<Driver> drives_;
    dev::PolyDriver driver_;
    dev::IEncoders* encoders_ = nullptr;
    dev::IEncodersTimed* stamped_ = nullptr;
    dev::IMotorEncoders* motors_ = nullptr;
    dev::IControlMode* modes_ = nullptr;
    dev::IPositionControl* positions_ = nullptr;
    dev::IPositionDirect* direct_ = nullptr;
    dev::IVelocityControl* velocities_ = nullptr;
    dev::ITorqueControl* torques_ = nullptr;
    dev::IPWMControl* pwm_ = nullptr;
    dev::ICurrentControl* currents_ = nullptr;
    dev::IControlLimits* limits_ = nullptr;
    dev::IPidControl* pids_ = nullptr;
    std::list<SensorPort> wrenches_, imus_;
    VectorXd units_;                  ///< ours for one of the board's, of each joint
    VectorXd speeds_, accelerations_; ///< of trajectories, before this program came, as the board has them
    bool has_speeds_ = false, has_accelerations_ = false, is_limited_ = false;
    States newest_;
    std::shared_ptr<toolbox::SimulatorConnection> simulator_; ///< null: it has a clock of its own
    bool has_run_ = false;                                    ///< before this program halted it
    double due_ = 0;                                          ///< time of the simulator, s
    double agreed_ = 0;    ///< when a mode was set or all joints were in it, by the boards' clock, s
    double agreed_at_ = 0; ///< the same by ours, s
    double patience_ = 0;  ///< for how long since then joints may be in another one, s
    ErrorText error_ = "";
};

/// Asked when the board has started.
class Device final : public toolbox::RobotDevice {
  public:
    Device(const BoardOptions& options, Board& board) : joints_(options.joints), board_(board) {}
    const std::vector<std::string>& joint_names() const override { return joints_; }
    void check_mode(ControlMode mode) const override {
        if (vocab_of(mode) == 0) throw std::runtime_error("YARP's boards have no such mode");
    }
    void check_measurement(Measurement what) const override {
        VectorXd values(joints());
        if (!board_.tell(what, values)) throw std::runtime_error(board_.error());
    }
    void check_gains(Loop loop) const override {
        if (!board_.has_gains(loop)) throw std::runtime_error(board_.error());
    }
    void check_motor_parameters() const override {
        if (!board_.has_motor_parameters()) throw std::runtime_error(board_.error());
    }
    std::shared_ptr<Live> open() const override { return nullptr; } // its driver opens it

  private:
    const std::vector<std::string> joints_;
    Board& board_;
};

} // namespace

middleware::WaitingDriver make_driver(const BoardOptions& options) {
    auto board = std::make_unique<Board>(options);
    auto device = std::make_unique<Device>(options, *board);
    Board* its = board.get();
    middleware::WaitingDriver driver{std::move(device), std::move(board)};
    driver.time = [its] { return its->time(); };
    if (!options.simulator.empty()) {
        driver.period = [its] { return its->step_size(); };
        driver.advance = [its](int steps) { return its->advance(steps); };
    }
    return driver;
}

} // namespace bf::yarp

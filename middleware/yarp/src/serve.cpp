// A robot of a running model as programs of YARP drive it.
#include "bf/core/value.hpp"
#include "bf/middleware/bell.hpp"
#include "bf/middleware/clock.hpp"
#include "bf/middleware/served_robot.hpp"
#include "clients.hpp"
#include "devices.hpp"
#include "network.hpp"
#include "panel.hpp"
#include "parts.hpp"
#include "senses.hpp"
#include "units.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <list>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <yarp/dev/IControlMode.h>
#include <yarp/dev/IMultipleWrapper.h>
#include <yarp/dev/IWrapper.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/dev/PolyDriverList.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/BufferedPort.h>
#include <yarp/os/Network.h>
#include <yarp/os/PeriodicThread.h>
#include <yarp/os/Property.h>
#include <yarp/os/Stamp.h>

namespace bf::yarp {

using Eigen::VectorXd;
using middleware::ControlMode;
using middleware::Limits;
using middleware::Loop;
using middleware::Measurement;
using middleware::Sensor;
using middleware::ServeRequest;

namespace {

namespace os = ::yarp::os;
namespace dev = ::yarp::dev;

template <class F> bool holds(F&& f) {
    try {
        f();
    } catch (const std::exception&) {
        return false;
    }
    return true;
}

/// What a thread of YARP's does every so often, done once; its own step() gives the processor away after
/// that.
struct Once : os::PeriodicThread {
    static void run_of(os::PeriodicThread& thread) { (thread.*&Once::run)(); }
};

/// A device for those who ask for a PolyDriver, which stays with its owner. One that was given away without
/// its owning it never counts down to 0 and keeps its memory (YARP 3.5).
class Lent {
  public:
    explicit Lent(dev::DeviceDriver& device) { driver_.give(&device, true); }
    ~Lent() { driver_.take(); }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    dev::PolyDriver* driver() { return &driver_; }

  private:
    dev::PolyDriver driver_;
};

/// A device of YARP that shows another one at ports, every so often in a thread of its own.
class Shown {
  public:
    Shown(const char* device, const std::string& name, dev::DeviceDriver& what, os::Property wanted)
        : what_(what) {
        wanted.put("device", device);
        wanted.put("name", name);
        if (!shows_.open(wanted) || !attach())
            throw std::runtime_error("the ports of " + name +
                                     " do not open; look whether another program has them");
        shows_.view(thread_);
    }
    /// Its memory stays: a port that is destroyed after its connection was lost tells the writers of messages
    /// it did not send, and those of controlBoard_nws_yarp (YARP 3.5) are destroyed before it.
    ~Shown() {
        static auto& closed = *new std::list<dev::DeviceDriver*>;
        if (auto* const device = shows_.take()) closed.emplace_back(device)->close();
    }
    /// From now on it shows only what show() asks for.
    void take_over() {
        if (thread_ == nullptr) throw std::runtime_error("this YARP's devices cannot be stepped");
        thread_->stop();
    }
    void show() { Once::run_of(*thread_); }

  private:
    bool attach() {
        dev::IWrapper* one = nullptr;
        dev::IMultipleWrapper* several = nullptr;
        if (shows_.view(several)) {
            dev::PolyDriverList list;
            list.push(what_.driver(), "robot");
            return several->attachAll(list);
        }
        return shows_.view(one) && one->attach(what_.driver());
    }
    Lent what_;
    dev::PolyDriver shows_;
    os::PeriodicThread* thread_ = nullptr;
};

/// A port that streams numbers with the time of the robot.
class Stream {
  public:
    Stream(const std::string& name, int begin, std::vector<double> factors)
        : begin_(begin), factors_(std::move(factors)) {
        open_port(port_, name, name);
    }
    void send(const std::vector<double>& shown, const os::Stamp& stamp) {
        auto& message = port_.prepare();
        message.clear();
        for (std::size_t k = 0; k < factors_.size(); ++k)
            message.addFloat64(factors_[k] * shown[static_cast<std::size_t>(begin_) + k]);
        os::Stamp its = stamp;
        port_.setEnvelope(its);
        port_.write();
    }

  private:
    const int begin_;
    const std::vector<double> factors_;
    os::BufferedPort<os::Bottle> port_;
};

/// Shows a robot as control boards. The world moves all joints in one mode; those in different ones of
/// POSITION, POSITION_DIRECT and VELOCITY, or of different limits, it holds where they are led here.
class YarpRobot final : public middleware::ServedRobot {
  public:
    explicit YarpRobot(const ServeRequest& request)
        : request_(request), robot_(request.robot), n_(request.device.joints()),
          shared_(request.device.joint_names()), mode_(static_cast<std::size_t>(n_), VOCAB_CM_POSITION),
          wished_(mode_.size()), overruled_(mode_.size(), {-1, 0}), led_(VectorXd::Zero(n_)),
          speed_(VectorXd::Zero(n_)), references_(VectorXd::Zero(n_)), values_(n_), s_(n_), before_(n_) {
        const auto& boards = request.options.find("board");
        parts_ = boards == request.options.end() ? parts_of(shared_.joints)
                                                 : read_parts(boards->second, shared_.joints);
        prefix_ = "/" + request.option("yarp");
        name_ = "robot " + prefix_ + " (YARP)";
        unsetenv("YARP_CLOCK"); // which this program is, for all others
        join();
        load_devices();
    }
    ~YarpRobot() override {
        is_over_ = true;
        shown_bell_.ring();
        over_bell_.ring();
        for (auto* thread : {&sends_, &looks_})
            if (thread->joinable()) thread->join();
    }

    void start(double period) override {
        period_ = period;
        senses_ = std::make_unique<Senses>(robot_.sensors(Sensor::wrench), robot_.sensors(Sensor::imu));
        describe();
        show_state(0);
        os::Property every;
        every.put("period", std::max(period, 0.001));
        for (const auto& name : {prefix_ + "/" + parts_.front().name + "/rpc:i", std::string("/clock")})
            if (is_there(name))
                throw std::runtime_error("another program has the port " + name +
                                         "; end it, or give this robot another name");
        for (const auto& part : parts_) {
            panels_.push_back(make_panel(part.joints, shared_));
            taken_.emplace_back();
            boards_.emplace_back("controlBoard_nws_yarp", prefix_ + "/" + part.name, panels_.back()->driver(),
                                 every);
        }
        sensor_device_ = std::make_unique<SensorDevice>(*senses_);
        every.put("period", std::max(1, static_cast<int>(std::lround(period * 1000))));
        if (!senses_->wrenches.empty() || !senses_->imus.empty())
            boards_.emplace_back("multipleanalogsensorsserver", prefix_ + "/sensors", *sensor_device_, every);
        open_streams();
        open_port(clock_port_, "/clock", "/clock");
        clock_ = serve_clock("/clock/rpc", period, request_.host.waits ? Led::always : Led::never);
        if (request_.host.waits)
            for (auto& board : boards_) board.take_over();
        else
            watch();
        take_joints();
    }

    void step(double time) noexcept override {
        show_state(time);
        if (!request_.host.waits) {
            shown_bell_.ring();
            clock_->next(0);
            take_wishes();
            // Whoever has sent something since then is another one.
            if (is_driven_ && left_after_ == commands_) let_go(Event::left);
            if (is_driven_ && is_streamed() && request_.host.watchdog > 0 &&
                middleware::now() - heard_ > request_.host.watchdog)
                let_go(Event::silent);
        } else {
            // What YARP sends may get lost on its way to a slow reader, and it must have come before the
            // robot goes on.
            send();
            for (int waited = 1; !clock_->next(0.002); ++waited) {
                take_led_wishes();
                if (waited % 8 == 1 || are_modes_new_) {
                    show_state(time);
                    send();
                }
                are_modes_new_ = false;
                if (waited % 25 == 0 && request_.host.goes_on && !request_.host.goes_on()) return;
            }
            take_led_wishes(); // somebody may have let it run freely before he left
        }
        lead();
    }

    const std::string& name() const noexcept override { return name_; }
    std::string take_news() override {
        const std::string then =
            request_.host.on_loss == middleware::OnLoss::limp ? "; its joints are limp" : "; its joints hold";
        if (seen_ == told_.load()) return "";
        switch (events_[seen_++ % events_.size()].load()) {
        case Event::came: return "a controller has come";
        case Event::refused: return "a command was refused";
        case Event::mixed:
            return "some joints are to be driven by torque, PWM or current, and others are not: they go over "
                   "when all of them are to";
        case Event::silent:
            return "no command for " + bf::Value(request_.host.watchdog).describe() + " s" + then;
        case Event::left: return "the controller has left" + then;
        }
        return "";
    }
    int gone() const noexcept override { return gone_; }

  private:
    enum class Event : std::uint8_t { came, refused, mixed, silent, left };

    void describe() {
        const auto& device = request_.device;
        for (int i = 0; i < middleware::measurement_count; ++i)
            if (holds([&] { device.check_measurement(static_cast<Measurement>(i)); }))
                shared_.measurements |= 1U << i;
        for (int j = 0; j < n_; ++j) shared_.is_prismatic.push_back(device.is_prismatic(j));
        for (int i = 0; i < middleware::mode_count; ++i)
            if (holds([&] { device.check_mode(static_cast<ControlMode>(i)); })) shared_.modes |= 1U << i;
        for (auto* limits :
             {&shared_.position_min, &shared_.position_max, &shared_.velocity_min, &shared_.velocity_max})
            limits->resize(n_);
        if (!robot_.read(Limits::position, shared_.position_min, shared_.position_max) ||
            !robot_.read(Limits::velocity, shared_.velocity_min, shared_.velocity_max))
            throw std::runtime_error(std::string("the robot tells no limits: ") + robot_.error());
        auto& its = shared_.settings;
        shared_.has_position_gains = holds([&] { device.check_gains(Loop::position); }) &&
                                     robot_.read_gains(Loop::position, its.position);
        shared_.has_torque_gains =
            holds([&] { device.check_gains(Loop::torque); }) && robot_.read_gains(Loop::torque, its.torque);
        shared_.has_motor_parameters =
            holds([&] { device.check_motor_parameters(); }) && robot_.read_motor_parameters(its.motors);
        before_.position = its.position;
        before_.torque = its.torque;
        before_.motors = its.motors;
        shown_.assign(static_cast<std::size_t>(shared_.at.size()), 0);
        sensed_.assign(static_cast<std::size_t>(senses_->size()), 0);
        wishes_.resize(mode_.size() * Wish::size);
    }

    void watch() {
        std::vector<std::string> boards;
        for (const auto& part : parts_) boards.push_back(prefix_ + "/" + part.name);
        leaving_ = std::make_unique<Leaving>(boards);
        sends_ = std::thread([this] { send_as_it_comes(); });
        looks_ = std::thread([this] { look_who_is_there(); });
    }
    void open_streams() {
        std::map<std::string, std::string> names; // of sensors, as the command says
        if (const auto given = request_.options.find("stream"); given != request_.options.end())
            for (const auto& text : given->second) {
                const auto equals = text.find("=/");
                const std::string sensor = text.substr(0, equals);
                const auto is_one = [&](const auto& list) {
                    return std::ranges::find(list, sensor) != list.end();
                };
                if (equals == text.npos || (!is_one(senses_->wrenches) && !is_one(senses_->imus)))
                    throw std::runtime_error(
                        "--stream '" + text +
                        "': write SENSOR=/PORT, with a sensor of the robot: " + sensor_names());
                names[sensor] = text.substr(equals + 1);
            }
        const auto open = [&](const std::string& sensor, const std::string& otherwise, int begin,
                              std::vector<double> factors) {
            const auto given = names.find(sensor);
            streams_.emplace_back(given == names.end() ? prefix_ + "/" + otherwise : given->second, begin,
                                  std::move(factors));
        };
        for (std::size_t i = 0; i < senses_->wrenches.size(); ++i)
            open(senses_->wrenches[i], stream_of(senses_->wrenches[i]), senses_->wrench(i),
                 std::vector<double>(middleware::wrench_size, 1));
        for (std::size_t i = 0; i < senses_->imus.size(); ++i)
            open(senses_->imus[i], i == 0 ? "inertial" : senses_->imus[i], senses_->imu(i),
                 {degrees, degrees, degrees, 1, 1, 1, degrees, degrees, degrees, 1, 1, 1});
    }
    std::string sensor_names() const {
        std::string text;
        for (const auto* list : {&senses_->wrenches, &senses_->imus})
            for (const auto& name : *list) text += (text.empty() ? "" : ", ") + name;
        return text.empty() ? "none" : text;
    }

    // ---- in the step

    void show_state(double time) noexcept {
        shown_[0] = time;
        for (int i = 0; i < middleware::measurement_count; ++i) {
            const auto what = static_cast<Measurement>(i);
            if (!(shared_.measurements >> i & 1) || !robot_.read(what, values_)) continue;
            if (what == Measurement::joint_position) s_ = values_;
            std::copy(values_.begin(), values_.end(), shown_.begin() + shared_.at.measurement(what));
        }
        for (int j = 0; j < n_; ++j) {
            shown_[static_cast<std::size_t>(shared_.at.modes() + j)] = mode_[static_cast<std::size_t>(j)];
            shown_[static_cast<std::size_t>(shared_.at.led() + j)] = led_[j];
        }
        shared_.shown.write(shown_.data(), middleware::now());
        double* to = sensed_.data();
        to[0] = time;
        for (std::size_t i = 0; i < senses_->wrenches.size(); ++i)
            robot_.read(Sensor::wrench, senses_->wrenches[i],
                        Eigen::Map<VectorXd>(to + senses_->wrench(i), middleware::wrench_size));
        for (std::size_t i = 0; i < senses_->imus.size(); ++i)
            robot_.read(Sensor::imu, senses_->imus[i],
                        Eigen::Map<VectorXd>(to + senses_->imu(i), middleware::imu_size));
        senses_->shown.write(to, middleware::now());
    }

    void take_wishes() noexcept {
        take_settings();
        for (std::size_t b = 0; b < panels_.size(); ++b) {
            const auto& wishes = panels_[b]->wishes();
            if (wishes.newest() == taken_[b].number || !wishes.read(wishes_.data(), taken_[b])) continue;
            const double* from = wishes_.data();
            for (const int j : panels_[b]->numbers()) {
                Wish& wish = wished_[static_cast<std::size_t>(j)];
                wish.mode = static_cast<int>(*from++);
                wish.times = *from++;
                std::copy_n(from, static_cast<int>(Wish::count), wish.values);
                from += static_cast<int>(Wish::count);
            }
            if (taken_[b].number == 1) continue; // the board's own first one
            heard_ = middleware::now();
            ++commands_;
        }
        if (!is_driven_ && is_asked()) {
            is_driven_ = true;
            tell(Event::came);
        }
        take_modes();
    }
    /// In lockstep whoever led the clock and is gone, after his last wishes, drives it no more.
    void take_led_wishes() noexcept {
        const bool has_clients = clock_->clients() > 0;
        take_wishes();
        if (is_driven_ && had_clients_ && !has_clients) let_go(Event::left);
        had_clients_ = has_clients;
    }

    /// Has a controller come since the last one left, who puts speeds back and whose references may be late?
    bool is_asked() const noexcept {
        for (std::size_t j = 0; j < overruled_.size(); ++j)
            if (overruled_[j] != asked(j)) return true;
        return false;
    }
    std::pair<double, double> asked(std::size_t j) const noexcept {
        return {wished_[j].times, wished_[j].values[Wish::position]};
    }
    /// Joints go over when all are asked for modes that the world has at once.
    void take_modes() noexcept {
        const bool was_streamed = is_streamed();
        int world = asked_of_world();
        if (world < 0) {
            // Boards are told one after the other, so that all of them are a moment later, mostly.
            if (mixed_since_ == 0) mixed_since_ = middleware::now();
            if (middleware::now() - mixed_since_ > 0.5) {
                if (!std::exchange(is_mixed_, true)) tell(Event::mixed);
            }
            world = has_own_way() ? static_cast<int>(ControlMode::position_direct) : world_mode_;
        } else {
            mixed_since_ = 0;
            is_mixed_ = false;
        }
        if (world != world_mode_) {
            if (!robot_.set_mode(static_cast<ControlMode>(world))) {
                tell(Event::refused);
                return;
            }
            // The world's own trajectories begin where its joints are, and ours go on where they end.
            if (world != static_cast<int>(ControlMode::position_direct) || !has_own_way()) {
                led_ = s_;
                speed_.setZero();
                std::ranges::fill(mode_, 0); // of before
            }
            world_mode_ = world;
            limit_ = -1;
            references_.setZero();
        }
        for (std::size_t j = 0; j < mode_.size(); ++j) {
            const int its = wanted(j);
            if (!(has_own_way() || control_mode_of(its) == world_mode_) || mode_[j] == its) continue;
            mode_[j] = its;
            speed_[static_cast<Eigen::Index>(j)] = 0;
            are_modes_new_ = true;
        }
        if (has_own_way() && limit_ != limit_of(0)) {
            limit_ = limit_of(0);
            robot_.set_trajectory_limit(static_cast<ControlMode>(world_mode_), limit_);
        }
        // Who ends gives the joints back; in lockstep he leaves a moment later.
        const bool leads = request_.host.waits && clock_->clients() > 0;
        if (is_driven_ && was_streamed && !is_streamed() && !leads) let_go(Event::left);
    }
    /// The mode of the world in which all joints can be moved as is asked; -1: there is none.
    int asked_of_world() const noexcept {
        int world = -2;
        bool is_one = true; // mode and limit
        for (std::size_t j = 0; j < mode_.size(); ++j) {
            const int its = control_mode_of(wanted(j));
            world = world == -2 || world == its ? its : -1;
            is_one = is_one && wanted(j) == wanted(0) && limit_of(j) == limit_of(0);
        }
        if (!is_one || world != static_cast<int>(ControlMode::position_direct)) return world;
        if (wanted(0) == VOCAB_CM_POSITION_DIRECT) return world;
        const auto own = wanted(0) == VOCAB_CM_VELOCITY ? ControlMode::velocity : ControlMode::position;
        return shared_.modes >> static_cast<int>(own) & 1 ? static_cast<int>(own) : world;
    }
    /// Does the world lead the joints, all in its mode of that name?
    bool has_own_way() const noexcept { return is_in(ControlMode::position) || is_in(ControlMode::velocity); }
    bool is_in(ControlMode mode) const noexcept { return world_mode_ == static_cast<int>(mode); }
    /// Of the joint's speed in POSITION, of its acceleration in VELOCITY.
    double limit_of(std::size_t j) const noexcept {
        return std::abs(wished_[j].values[wanted(j) == VOCAB_CM_VELOCITY ? Wish::acceleration : Wish::speed]);
    }
    /// What is wished of the joint, unless it was taken back since. Before the first controller nobody is
    /// lost.
    int wanted(std::size_t j) const {
        if (!is_overruled(j)) return wished_[j].mode;
        return gone_ > 0 && request_.host.on_loss == middleware::OnLoss::limp ? VOCAB_CM_IDLE
                                                                              : VOCAB_CM_POSITION;
    }
    bool is_overruled(std::size_t j) const { return overruled_[j].first == wished_[j].times; }
    /// Must somebody go on sending references?
    bool is_streamed() const {
        return !(is_in(ControlMode::position_direct) || is_in(ControlMode::position)) ||
               std::ranges::find(mode_, VOCAB_CM_VELOCITY) != mode_.end();
    }

    /// One step of the references.
    void lead() noexcept {
        for (int j = 0; j < n_; ++j) {
            const Wish& wish = wished_[static_cast<std::size_t>(j)];
            const bool is_old = is_overruled(static_cast<std::size_t>(j));
            const auto to = [&](int what) { return is_old ? 0.0 : wish.values[what]; };
            switch (mode_[static_cast<std::size_t>(j)]) {
            case VOCAB_CM_POSITION: {
                const double most = std::abs(wish.values[Wish::speed]) * period_;
                const double target = wish.values[Wish::position];
                const bool goes = !is_old || target != overruled_[static_cast<std::size_t>(j)].second;
                references_[j] = goes ? target : led_[j];
                led_[j] += std::clamp(references_[j] - led_[j], -most, most);
                break;
            }
            case VOCAB_CM_VELOCITY: {
                const double most = std::abs(wish.values[Wish::acceleration]) * period_;
                references_[j] = to(Wish::velocity);
                speed_[j] += std::clamp(references_[j] - speed_[j], -most, most);
                led_[j] = std::clamp(led_[j] + speed_[j] * period_, shared_.position_min[j],
                                     shared_.position_max[j]);
                break;
            }
            case VOCAB_CM_POSITION_DIRECT: led_[j] = is_old ? led_[j] : wish.values[Wish::direct]; break;
            // Of joints that are asked for another mode the last reference counts on.
            case VOCAB_CM_TORQUE:
                if (wanted(static_cast<std::size_t>(j)) == VOCAB_CM_TORQUE) references_[j] = to(Wish::torque);
                break;
            case VOCAB_CM_PWM:
                if (wanted(static_cast<std::size_t>(j)) == VOCAB_CM_PWM) references_[j] = to(Wish::pwm);
                break;
            case VOCAB_CM_CURRENT:
                if (wanted(static_cast<std::size_t>(j)) == VOCAB_CM_CURRENT)
                    references_[j] = to(Wish::current);
                break;
            default: references_[j] = 0;
            }
        }
        if (!robot_.write(static_cast<ControlMode>(world_mode_),
                          is_in(ControlMode::position_direct) ? led_ : references_))
            tell(Event::refused);
    }

    void take_settings() noexcept {
        auto& its = shared_.settings;
        if (!its.mutex.try_lock()) return; // in a step that follows
        const std::lock_guard lock(its.mutex, std::adopt_lock);
        const int which = std::exchange(its.changed, 0);
        if (which == 0) return;
        are_settings_changed_ = true;
        if ((which & 1 && !robot_.write_gains(Loop::position, its.position)) ||
            (which & 2 && !robot_.write_gains(Loop::torque, its.torque)) ||
            (which & 4 && !robot_.write_motor_parameters(its.motors)))
            tell(Event::refused);
    }

    void let_go(Event why) noexcept {
        if (!is_driven_.exchange(false)) return;
        ++gone_;
        if (std::exchange(are_settings_changed_, false)) {
            const std::lock_guard lock(shared_.settings.mutex);
            auto& its = shared_.settings;
            its.position = before_.position;
            its.torque = before_.torque;
            its.motors = before_.motors;
            its.changed = (shared_.has_position_gains ? 1 : 0) | (shared_.has_torque_gains ? 2 : 0) |
                          (shared_.has_motor_parameters ? 4 : 0);
        }
        overrule();
        take_modes();
        tell(why);
    }
    void take_joints() {
        for (int j = 0; j < n_; ++j) {
            wished_[static_cast<std::size_t>(j)].mode = VOCAB_CM_POSITION;
            wished_[static_cast<std::size_t>(j)].values[Wish::position] = s_[j];
        }
        overrule();
        take_modes();
    }
    void overrule() noexcept {
        for (std::size_t j = 0; j < mode_.size(); ++j) overruled_[j] = asked(j);
    }
    void tell(Event event) noexcept {
        const unsigned next = told_.load();
        if (next - seen_.load() == events_.size()) return; // nobody listens
        events_[next % events_.size()].store(event);
        told_.store(next + 1);
    }

    // ---- what others see

    void send() noexcept {
        std::vector<double> senses;
        if (!senses_->look(senses)) return;
        const double time = senses[0];
        const double seconds = std::floor(time + 1e-9);
        auto& now = clock_port_.prepare();
        now.clear();
        now.addInt32(static_cast<int>(seconds));
        now.addInt32(static_cast<int>(std::lround(std::max(0.0, time - seconds) * 1e9)));
        clock_port_.write();
        stamp_.update(time);
        for (auto& stream : streams_) stream.send(senses, stamp_);
        if (request_.host.waits)
            for (auto& board : boards_) board.show();
    }
    void send_as_it_comes() noexcept {
        for (std::uint64_t sent = 0; !is_over_;) {
            shown_bell_.wait(0.05, [&] { return senses_->shown.newest() != sent || is_over_; });
            if (senses_->shown.newest() == sent) continue;
            sent = senses_->shown.newest();
            send();
        }
    }
    /// Apart from what is sent, as a client that is asked may answer late.
    void look_who_is_there() noexcept {
        for (; !is_over_; over_bell_.wait(0.05, [&] { return is_over_.load(); })) {
            const auto commands = commands_.load();
            if (leaving_->look(commands, is_driven_)) left_after_ = commands;
        }
    }

    const ServeRequest request_;
    toolbox::RobotConnection& robot_;
    const int n_;
    SharedBoard shared_;
    std::vector<Part> parts_;
    std::string prefix_, name_;
    double period_ = 0; ///< s

    std::vector<int> mode_;    ///< that each joint is in, a vocab
    std::vector<Wish> wished_; ///< of each joint
    /// The Wish::times that count no more since the joint was taken back, and the position wished then.
    std::vector<std::pair<double, double>> overruled_;
    int world_mode_ = -1;
    VectorXd led_, speed_;             ///< of the modes of position
    VectorXd references_, values_, s_; ///< of the other modes; what was read; joint positions
    Settings before_;
    std::atomic<bool> is_driven_{false};
    bool is_mixed_ = false, had_clients_ = false, are_modes_new_ = false, are_settings_changed_ = false;
    double heard_ = 0, mixed_since_ = 0, limit_ = -1; ///< s, 0: not; that the world has, -1: none
    std::atomic<int> gone_{0};
    std::array<std::atomic<Event>, 64> events_{};
    std::atomic<unsigned> told_{0}, seen_{0};

    std::vector<double> shown_, sensed_, wishes_;
    std::unique_ptr<Senses> senses_;
    std::vector<std::unique_ptr<Panel>> panels_;
    std::vector<middleware::Stamp> taken_;
    std::unique_ptr<SensorDevice> sensor_device_;
    std::list<Stream> streams_;
    std::list<Shown> boards_; ///< closed before what they show
    os::BufferedPort<os::Bottle> clock_port_;
    std::shared_ptr<ClockServer> clock_;
    os::Stamp stamp_;
    middleware::Bell shown_bell_{}, over_bell_{};
    std::unique_ptr<Leaving> leaving_;                       ///< by the clock
    std::atomic<std::uint64_t> commands_{0}, left_after_{0}; ///< that came; of whoever has left since
    std::atomic<bool> is_over_{false};
    std::thread sends_, looks_;
};

} // namespace

} // namespace bf::yarp

extern "C" __attribute__((visibility("default"))) bf::middleware::ServedRobot* bf_serve_robot_v1(
    const bf::middleware::ServeRequest& request) {
    return new bf::yarp::YarpRobot(request);
}

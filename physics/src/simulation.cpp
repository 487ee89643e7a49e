#include "bf/physics/world.hpp"
#include "contacts.hpp"
#include "world_impl.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <utility>

namespace bf::physics {

namespace {

constexpr int state_signature = mjSTATE_INTEGRATION; // warm start included

/// Where each measurement stands in one flat vector, which is saved and restored as it is.
struct Layout {
    int size = 0;
    RobotLayout robot;
    int foot_poses, foot_wrenches, step;

    Layout(const RobotIndex& index, const RobotOptions& options, int feet) : robot(size, index, options) {
        const auto take = [this](int count) { return std::exchange(size, size + count); };
        foot_poses = take(16 * feet);
        foot_wrenches = take(6 * feet);
        step = take(1);
    }
};

int count(const auto& list) { return static_cast<int>(list.size()); }

} // namespace

struct Simulation::Impl {
    std::shared_ptr<const World> owner;
    const World::Impl& world;
    const mjModel* model;
    DataPtr data;
    Layout at;
    std::vector<double> measured;
    std::array<char, 256> error{};

    explicit Impl(std::shared_ptr<const World> shared)
        : owner(std::move(shared)), world(*owner->impl_), model(world.model.get()), data(make_data(model)),
          at(world.robot, world.options, count(world.foot_sites)), measured(static_cast<size_t>(at.size)) {}

    double* measurement(int offset) noexcept { return measured.data() + offset; }
    const double* measurement(int offset) const noexcept { return measured.data() + offset; }

    template <typename... Values> bool fail(const char* format, Values... values) noexcept {
        std::snprintf(error.data(), error.size(), format, values...);
        return false;
    }

    bool set_inputs(std::span<const double> tau, std::span<const double> wrenches) noexcept;
    bool disturb(const Disturbance& disturbance) noexcept;
    void measure_now() noexcept;
    void measure_last_interval() noexcept;
    /// Of the sensors of the robot, `offset` in the layout.
    const double* reading(int offset) const noexcept { return measurement(offset + at.robot.delivered); }
    std::uint64_t step() const noexcept { return static_cast<std::uint64_t>(*measurement(at.step)); }
    bool check_motion() noexcept;
    const char* owner_of_velocity(int index) const noexcept;
    template <typename Stages> void run(const Stages& stages) noexcept;
};

/// Runs MuJoCo, whose errors arrive as exceptions.
template <typename Stages> void Simulation::Impl::run(const Stages& stages) noexcept {
    try {
        stages();
    } catch (const std::exception& problem) {
        fail("t = %g s: %s", data->time, problem.what());
    }
}

bool Simulation::Impl::set_inputs(std::span<const double> tau, std::span<const double> wrenches) noexcept {
    const size_t n = world.options.joints.size();
    const size_t pushes = world.robot.push_sites.size();
    if (tau.size() != n) return fail("step got %zu torques; the world has %zu joints", tau.size(), n);
    if (!wrenches.empty() && wrenches.size() != 6 * pushes)
        return fail("step got %zu numbers as external wrenches; the world has %zu push links of 6 each",
                    wrenches.size(), pushes);
    for (size_t i = 0; i < n; ++i)
        if (!(std::abs(tau[i]) <= mjMAXVAL))
            return fail("t = %g s: the torque of joint '%s' is %g; torques must be finite and below 1e10",
                        data->time, world.options.joints[i].c_str(), tau[i]);
    for (size_t i = 0; i < wrenches.size(); ++i)
        if (!(std::abs(wrenches[i]) <= mjMAXVAL))
            return fail("t = %g s: the external wrench on '%s' has the component %g; it must be finite and "
                        "below 1e10",
                        data->time, world.options.push_links[i / 6].c_str(), wrenches[i]);

    for (size_t i = 0; i < n; ++i) data->ctrl[world.robot.motors[i]] = tau[i];
    const auto applied = [&](int site) { return data->xfrc_applied + 6 * model->site_bodyid[site]; };
    std::fill_n(data->xfrc_applied, 6 * model->nbody, 0.0);
    for (size_t i = 0; 6 * i < wrenches.size(); ++i) {
        const int site = world.robot.push_sites[i];
        const Eigen::Map<const Eigen::Vector3d> force(&wrenches[6 * i]), moment(&wrenches[6 * i + 3]);
        // MuJoCo applies it at the centre of the body, which is the link with all that is fused to it.
        const Eigen::Vector3d lever =
            Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * site) -
            Eigen::Map<const Eigen::Vector3d>(data->xipos + 3 * model->site_bodyid[site]);
        Eigen::Map<Eigen::Vector3d>(applied(site)) += force;
        Eigen::Map<Eigen::Vector3d>(applied(site) + 3) += moment + lever.cross(force);
    }
    return true;
}

bool Simulation::Impl::disturb(const Disturbance& disturbance) noexcept {
    if (disturbance.body == 0) return true;
    if (disturbance.body < 0 || disturbance.body >= model->nbody)
        return fail("t = %g s: a disturbance acts on body %d; the world has the bodies 1 to %d", data->time,
                    disturbance.body, model->nbody - 1);
    const double greatest =
        std::max(disturbance.point.cwiseAbs().maxCoeff(), disturbance.force.cwiseAbs().maxCoeff());
    if (!disturbance.point.allFinite() || !disturbance.force.allFinite() || greatest > mjMAXVAL)
        return fail(
            "t = %g s: the disturbance of '%s' has the component %g; it must be finite and below 1e10",
            data->time, world.bodies[static_cast<size_t>(disturbance.body - 1)].c_str(), greatest);
    const int body = disturbance.body;
    const Eigen::Vector3d acts_at =
        (transform(data->xpos + 3 * body, data->xmat + 9 * body) * disturbance.point.homogeneous()).head<3>();
    const Eigen::Vector3d lever = acts_at - Eigen::Map<const Eigen::Vector3d>(data->xipos + 3 * body);
    double* applied = data->xfrc_applied + 6 * body;
    Eigen::Map<Eigen::Vector3d>{applied} += disturbance.force;
    Eigen::Map<Eigen::Vector3d>{applied + 3} += lever.cross(disturbance.force);
    return true;
}

void Simulation::Impl::measure_now() noexcept {
    const mjData* d = data.get();
    physics::measure_now(model, d, world.robot, at.robot, world.options, step(), measured.data());
    deliver(at.robot, world.options, step(), measured.data());
    for (int i = 0; i < count(world.foot_sites); ++i)
        measure_pose(d, world.foot_sites[static_cast<size_t>(i)], measurement(at.foot_poses + 16 * i));
}

void Simulation::Impl::measure_last_interval() noexcept {
    const mjData* d = data.get();
    physics::measure_last_interval(d, world.robot, at.robot, world.options.noise, step(), measured.data());
    std::fill_n(measurement(at.foot_wrenches), 6 * world.foot_sites.size(), 0.0);
    for (int i = 0; i < d->ncon; ++i) {
        const mjContact& contact = d->contact[i];
        if (!is_active(contact)) continue;
        const bool second = world.foot_of_geom[static_cast<size_t>(contact.geom[1])] >= 0;
        const int foot = world.foot_of_geom[static_cast<size_t>(contact.geom[second])];
        if (foot < 0) continue;
        const Eigen::Vector3d force = (second ? 1.0 : -1.0) * touch(model, d, i).force;
        const Eigen::Vector3d lever =
            Eigen::Map<const Eigen::Vector3d>(contact.pos) -
            Eigen::Map<const Eigen::Vector3d>(d->site_xpos + 3 * world.foot_sites[static_cast<size_t>(foot)]);
        double* wrench = measurement(at.foot_wrenches + 6 * foot);
        Eigen::Map<Eigen::Vector3d>{wrench} += force;
        Eigen::Map<Eigen::Vector3d>{wrench + 3} += lever.cross(force);
    }
}

const char* Simulation::Impl::owner_of_velocity(int index) const noexcept {
    for (size_t i = 0; i < world.robot.velocity.size(); ++i)
        if (world.robot.velocity[i] == index || world.robot.play_velocity[i] == index)
            return world.options.joints[i].c_str();
    return world.options.base_link.c_str();
}

bool Simulation::Impl::check_motion() noexcept {
    if (error[0] != '\0') return false;
    const char* advice = "lower the gains or the time step, or add armature";
    const auto happened = [&](mjtWarning warning) { return data->warning[warning].number > 0; };
    const auto where = [&](mjtWarning warning) { return owner_of_velocity(data->warning[warning].lastinfo); };
    if (happened(mjWARN_BADQACC))
        return fail(
            "t = %g s: the simulation diverged, the acceleration of '%s' is not finite or above 1e10; %s",
            data->time, where(mjWARN_BADQACC), advice);
    if (happened(mjWARN_BADQVEL))
        return fail("t = %g s: the simulation diverged, the velocity of '%s' is not finite or above 1e10; %s",
                    data->time, where(mjWARN_BADQVEL), advice);
    for (int i = 0; i < mjNWARNING; ++i)
        if (happened(static_cast<mjtWarning>(i)))
            return fail("t = %g s: %s", data->time,
                        mju_warningText(i, static_cast<size_t>(data->warning[i].lastinfo)));
    return true;
}

Simulation::Simulation(std::shared_ptr<const World> world) : impl_(std::make_unique<Impl>(std::move(world))) {
    reset();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const World& Simulation::world() const noexcept { return *impl_->owner; }

void Simulation::reset() noexcept {
    Impl& self = *impl_;
    self.error[0] = '\0';
    *self.measurement(self.at.step) = 0.0;
    self.run([&] {
        mj_resetData(self.model, self.data.get());
        std::copy_n(self.world.start.data(), self.model->nq, self.data->qpos);
        mj_forward(self.model, self.data.get());
    });
    self.measure_last_interval();
    self.measure_now();
}

bool Simulation::step(std::span<const double> tau, std::span<const double> wrenches,
                      const Disturbance& disturbance) noexcept {
    Impl& self = *impl_;
    if (self.error[0] != '\0' || !self.set_inputs(tau, wrenches) || !self.disturb(disturbance)) return false;
    *self.measurement(self.at.step) += 1.0;
    self.run([&] {
        mj_step2(self.model, self.data.get()); // forces at t_k, then q and v at t_k+1
        self.measure_last_interval();          // before the contacts of t_k are forgotten
        mj_step1(self.model, self.data.get()); // kinematics, velocities and contacts at t_k+1
    });
    self.measure_now();
    return self.check_motion();
}

const char* Simulation::error() const noexcept { return impl_->error.data(); }
double Simulation::time() const noexcept { return impl_->data->time; }

Readings Simulation::readings() const noexcept {
    return impl_->at.robot.read(impl_->measured.data(), impl_->world.n(), impl_->at.robot.delivered);
}
Readings Simulation::readings_at_loops() const noexcept {
    return impl_->at.robot.read(impl_->measured.data(), impl_->world.n(), 0);
}
Simulation::Matrix4View Simulation::w_H_b() const noexcept {
    return Matrix4View(impl_->measurement(impl_->at.robot.w_H_b));
}
Simulation::Vector6View Simulation::v_b() const noexcept {
    return Vector6View(impl_->measurement(impl_->at.robot.v_b));
}
Simulation::Vector3View Simulation::com() const noexcept {
    return Vector3View(impl_->measurement(impl_->at.robot.com));
}
Simulation::Matrix3View Simulation::imu_rotation() const noexcept {
    return Matrix3View(impl_->measurement(impl_->at.robot.imu_rotation));
}
Simulation::Vector3View Simulation::imu_rpy() const noexcept {
    return Vector3View(impl_->reading(impl_->at.robot.imu_rpy));
}
Simulation::Vector3View Simulation::gyro() const noexcept {
    return Vector3View(impl_->reading(impl_->at.robot.gyro));
}
Simulation::Vector3View Simulation::accelerometer() const noexcept {
    return Vector3View(impl_->reading(impl_->at.robot.accelerometer));
}
Simulation::Matrix4View Simulation::foot_pose(int i) const noexcept {
    return Matrix4View(impl_->measurement(impl_->at.foot_poses + 16 * i));
}
Simulation::Vector6View Simulation::foot_wrench(int i) const noexcept {
    return Vector6View(impl_->measurement(impl_->at.foot_wrenches + 6 * i));
}
Simulation::Vector6View Simulation::ft_wrench(int i) const noexcept {
    return Vector6View(impl_->reading(impl_->at.robot.ft_wrenches + 6 * i));
}

int Simulation::state_size() const noexcept {
    return mj_stateSize(impl_->model, state_signature) + impl_->at.size;
}

void Simulation::save(double* state) const noexcept {
    mj_getState(impl_->model, impl_->data.get(), state, state_signature);
    std::copy(impl_->measured.begin(), impl_->measured.end(),
              state + mj_stateSize(impl_->model, state_signature));
}

void Simulation::restore(const double* state) noexcept {
    Impl& self = *impl_;
    self.error[0] = '\0';
    self.run([&] {
        for (mjWarningStat& warning : self.data->warning) warning = {};
        mj_setState(self.model, self.data.get(), state, state_signature);
        mj_step1(self.model, self.data.get());
    });
    const double* measured = state + mj_stateSize(self.model, state_signature);
    std::copy_n(measured, self.at.size, self.measured.begin());
}

} // namespace bf::physics

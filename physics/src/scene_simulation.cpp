#include "contacts.hpp"
#include "scene_impl.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <utility>

namespace bf::physics {

namespace {

using Cause = Failure::Cause;

constexpr int scene_state_signature = mjSTATE_INTEGRATION; // warm start included

/// Where everything that is measured or held stands in one flat vector, which is saved and restored as it is.
struct SceneLayout {
    int size = 0;
    std::vector<RobotLayout> robots;
    std::vector<int> wrenches; ///< per robot
    std::vector<int> torques;  ///< per robot: 1 and torques that pass the loops, or 0
    int poses, velocities;     ///< of objects
    int step;                  ///< how many were made

    SceneLayout(const std::vector<RobotIndex>& all, const SceneOptions& options, int objects) {
        const auto take = [this](int count) { return std::exchange(size, size + count); };
        for (size_t r = 0; r < all.size(); ++r) {
            robots.emplace_back(size, all[r], options.robots[r].options);
            wrenches.push_back(take(6 * static_cast<int>(all[r].push_sites.size())));
            torques.push_back(take(1 + all[r].n()));
        }
        poses = take(16 * objects);
        velocities = take(6 * objects);
        step = take(1);
    }
};

} // namespace

struct SceneSimulation::Impl {
    std::shared_ptr<const Scene> owner;
    const Scene::Impl& scene;
    const mjModel* model;
    ModelPtr exact; ///< the same, of another tolerance; only where it was asked for
    DataPtr data;
    SceneLayout at;
    std::vector<double> memory;
    std::vector<JointControl> controls; ///< per robot
    std::optional<ContactMemory> contacts;
    bool is_pushed = false; ///< some xfrc_applied may not be zero
    std::array<char, 256> error{};
    Failure failure; ///< what `error` says

    explicit Impl(std::shared_ptr<const Scene> shared)
        : owner(std::move(shared)), scene(*owner->impl_), model(scene.model.get()), data(make_data(model)),
          at(scene.robots, scene.options, static_cast<int>(scene.objects.size())),
          memory(static_cast<size_t>(at.size)) {
        for (const RobotIndex& robot : scene.robots) controls.push_back(robot.control());
    }

    double* in(int offset) noexcept { return memory.data() + offset; }
    const RobotLayout& of(auto robot) const noexcept { return at.robots[static_cast<size_t>(robot)]; }
    Readings read(int robot, int shift) const noexcept {
        return of(robot).read(memory.data(), scene.robot(robot).n(), shift);
    }
    /// Of the sensors of a robot, `offset` in its layout.
    const double* reading(int robot, int offset) noexcept { return in(offset + of(robot).delivered); }
    Eigen::Matrix4d w_H(int body) const noexcept {
        return transform(data->xpos + 3 * body, data->xmat + 9 * body);
    }
    std::uint64_t step() noexcept { return static_cast<std::uint64_t>(*in(at.step)); }

    template <typename... Values>
    bool fail(const Failure& why, const char* format, Values... values) noexcept {
        failure = why;
        std::snprintf(error.data(), error.size(), format, values...);
        return false;
    }
    void forget_failure() noexcept {
        error[0] = '\0';
        failure = {};
    }
    template <typename Stages> void run(const Stages& stages) noexcept {
        try {
            stages();
        } catch (const std::exception& problem) {
            fail({Cause::motion}, "t = %g s: %s", data->time, problem.what());
        }
    }

    bool check_inputs() noexcept;
    bool check(const Disturbance& disturbance) noexcept;
    void apply_inputs(const Disturbance& disturbance) noexcept;
    void measure_now() noexcept;
    void measure_last_interval() noexcept;
    bool check_motion() noexcept;
    const char* owner_of_velocity(int index) const noexcept;
};

bool SceneSimulation::Impl::check_inputs() noexcept {
    for (size_t r = 0; r < scene.robots.size(); ++r) {
        const SceneRobot& robot = scene.options.robots[r];
        const bool is_named = !robot.name.empty();
        const char* const of = is_named ? " of robot '" : "";
        const char* const end = is_named ? "'" : "";
        const double* direct = in(at.torques[r]);
        const bool is_direct = *direct != 0.0;
        const double* commanded = is_direct ? direct + 1 : controls[r].reference().data();
        for (int i = 0; i < scene.robots[r].n(); ++i)
            if (!(std::abs(commanded[i]) <= mjMAXVAL))
                return fail({Cause::reference, static_cast<int>(r), i},
                            "t = %g s: the %s of joint '%s'%s%s%s is %g; it must be finite and below 1e10",
                            data->time, is_direct ? "torque" : "reference",
                            robot.options.joints[static_cast<size_t>(i)].c_str(), of, robot.name.c_str(), end,
                            commanded[i]);
        const double* wrenches = in(at.wrenches[r]);
        for (size_t i = 0; i < 6 * robot.options.push_links.size(); ++i)
            if (!(std::abs(wrenches[i]) <= mjMAXVAL))
                return fail({Cause::wrench, static_cast<int>(r), static_cast<int>(i / 6)},
                            "t = %g s: the wrench on '%s'%s%s%s has the component %g; it must be finite and "
                            "below 1e10",
                            data->time, robot.options.push_links[i / 6].c_str(), of, robot.name.c_str(), end,
                            wrenches[i]);
    }
    for (const int i : scene.controls)
        if (!(std::abs(data->ctrl[i]) <= mjMAXVAL))
            return fail({Cause::control, 0, i},
                        "t = %g s: the control of actuator '%s' is %g; it must be finite and below 1e10",
                        data->time, mj_id2name(model, mjOBJ_ACTUATOR, i), data->ctrl[i]);
    return true;
}

bool SceneSimulation::Impl::check(const Disturbance& disturbance) noexcept {
    if (disturbance.body == 0) return true;
    if (disturbance.body < 0 || disturbance.body >= model->nbody)
        return fail({Cause::motion},
                    "t = %g s: a disturbance acts on body %d; the world has the bodies 1 to %d", data->time,
                    disturbance.body, model->nbody - 1);
    const double greatest =
        std::max(disturbance.point.cwiseAbs().maxCoeff(), disturbance.force.cwiseAbs().maxCoeff());
    if (!disturbance.point.allFinite() || !disturbance.force.allFinite() || greatest > mjMAXVAL)
        return fail(
            {Cause::motion},
            "t = %g s: the disturbance of '%s' has the component %g; it must be finite and below 1e10",
            data->time, scene.bodies[static_cast<size_t>(disturbance.body - 1)].c_str(), greatest);
    return true;
}

void SceneSimulation::Impl::apply_inputs(const Disturbance& disturbance) noexcept {
    for (size_t r = 0; r < scene.robots.size(); ++r) {
        const RobotIndex& robot = scene.robots[r];
        const int every = robot.loop_steps;
        const bool is_direct = *in(at.torques[r]) != 0.0;
        if (every == 1 || step() % static_cast<std::uint64_t>(every) == 0) {
            if (is_direct) {
                controls[r].pass(Eigen::Map<const Eigen::VectorXd>(in(at.torques[r]) + 1, robot.n()));
            } else {
                const Readings measured = read(static_cast<int>(r), 0);
                controls[r].advance(every * model->opt.timestep, measured.s, measured.s_dot, measured.tau);
            }
        }
        const Eigen::VectorXd& torques = controls[r].torques();
        for (size_t i = 0; i < robot.motors.size(); ++i) {
            const auto joint = static_cast<Eigen::Index>(i);
            double& torque = data->ctrl[robot.motors[i]];
            // MuJoCo takes no larger number, and clamps to the limits of effort only what it has taken.
            torque = std::clamp(torques[joint], -mjMAXVAL, mjMAXVAL);
            if (robot.dampers[i] < 0) continue;
            // Motor and damper give the torque together, as far as it depends on the velocity by the damper,
            // which the integrator differentiates. What stands at its limit does not depend on it.
            const bool depends = !is_direct && std::abs(torque) < robot.effort_limits[joint];
            const double damping = depends ? controls[r].damping(joint) : 0.0;
            data->ctrl[robot.dampers[i]] = damping;
            torque = std::clamp(torque + damping * data->qvel[robot.velocity[i]], -mjMAXVAL, mjMAXVAL);
        }
    }
    if (is_pushed) std::fill_n(data->xfrc_applied, 6 * model->nbody, 0.0);
    is_pushed = false;
    // MuJoCo applies it at the centre of the body, which is the link with all that is fused to it.
    const auto apply = [&](int body, const Eigen::Vector3d& force, const Eigen::Vector3d& moment,
                           const Eigen::Vector3d& at_point) {
        const Eigen::Vector3d lever = at_point - Eigen::Map<const Eigen::Vector3d>(data->xipos + 3 * body);
        is_pushed = true;
        double* applied = data->xfrc_applied + 6 * body;
        Eigen::Map<Eigen::Vector3d>{applied} += force;
        Eigen::Map<Eigen::Vector3d>{applied + 3} += moment + lever.cross(force);
    };
    for (size_t r = 0; r < scene.robots.size(); ++r) {
        const RobotIndex& robot = scene.robots[r];
        for (size_t i = 0; i < robot.push_sites.size(); ++i) {
            const double* wrench = in(at.wrenches[r]) + 6 * i;
            const int site = robot.push_sites[i];
            const Eigen::Map<const Eigen::Vector3d> force(wrench), moment(wrench + 3);
            apply(model->site_bodyid[site], force, moment,
                  Eigen::Map<const Eigen::Vector3d>(data->site_xpos + 3 * site));
        }
    }
    if (const int body = disturbance.body; body > 0)
        apply(body, disturbance.force, Eigen::Vector3d::Zero(),
              (w_H(body) * disturbance.point.homogeneous()).head<3>());
}

void SceneSimulation::Impl::measure_now() noexcept {
    const mjData* d = data.get();
    for (size_t r = 0; r < scene.robots.size(); ++r) {
        const RobotOptions& options = scene.options.robots[r].options;
        physics::measure_now(model, d, scene.robots[r], at.robots[r], options, step(), memory.data());
        deliver(at.robots[r], options, step(), memory.data());
    }
    for (size_t i = 0; i < scene.objects.size(); ++i) {
        const int body = scene.objects[i];
        if (step() > 0 && model->body_weldid[body] == 0) continue; // it stands where it stood at the start
        Eigen::Map<Eigen::Matrix4d>(in(at.poses) + 16 * i) = w_H(body);
        mjtNum velocity[6]; // angular first
        mj_objectVelocity(model, d, mjOBJ_XBODY, body, velocity, 0);
        double* out = in(at.velocities) + 6 * i;
        std::copy_n(velocity + 3, 3, out);
        std::copy_n(velocity, 3, out + 3);
    }
}

void SceneSimulation::Impl::measure_last_interval() noexcept {
    for (size_t r = 0; r < scene.robots.size(); ++r)
        physics::measure_last_interval(model, data.get(), scene.robots[r], at.robots[r],
                                       scene.options.robots[r].options.noise, step(), memory.data());
    if (contacts && !contacts->record(model, data.get()))
        fail({Cause::contacts},
             "t = %g s: more than %d contacts at a time, which the sensors of contacts do not remember; give "
             "bodies simpler shapes",
             data->time, ContactMemory::most);
}

const char* SceneSimulation::Impl::owner_of_velocity(int index) const noexcept {
    if (index < 0 || index >= model->nv) return "?";
    for (const RobotIndex& robot : scene.robots)
        for (size_t i = 0; i < robot.velocity.size(); ++i)
            if (robot.play_velocity[i] == index) index = robot.velocity[i];
    const char* joint = mj_id2name(model, mjOBJ_JOINT, model->dof_jntid[index]);
    return joint && *joint ? joint : mj_id2name(model, mjOBJ_BODY, model->dof_bodyid[index]);
}

bool SceneSimulation::Impl::check_motion() noexcept {
    if (error[0] != '\0') return false;
    for (const auto& [warning, what] : {std::pair{mjWARN_BADQACC, "acceleration"},
                                        {mjWARN_BADQVEL, "velocity"},
                                        {mjWARN_BADQPOS, "position"}})
        if (data->warning[warning].number > 0)
            return fail({Cause::motion},
                        "t = %g s: the simulation diverged, the %s of '%s' is not finite or above 1e10; "
                        "lower the gains or the time step, or add armature",
                        data->time, what, owner_of_velocity(data->warning[warning].lastinfo));
    for (int i = 0; i < mjNWARNING; ++i)
        if (data->warning[i].number > 0)
            return fail({Cause::motion}, "t = %g s: %s", data->time,
                        mju_warningText(i, static_cast<size_t>(data->warning[i].lastinfo)));
    return true;
}

SceneSimulation::SceneSimulation(std::shared_ptr<const Scene> scene)
    : impl_(std::make_unique<Impl>(std::move(scene))) {
    reset();
}
SceneSimulation::~SceneSimulation() = default;
SceneSimulation::SceneSimulation(SceneSimulation&&) noexcept = default;
SceneSimulation& SceneSimulation::operator=(SceneSimulation&&) noexcept = default;

const Scene& SceneSimulation::scene() const noexcept { return *impl_->owner; }

void SceneSimulation::reset() noexcept {
    Impl& self = *impl_;
    self.forget_failure();
    std::fill(self.memory.begin(), self.memory.end(), 0.0);
    for (JointControl& control : self.controls) control.reset();
    self.run([&] {
        mj_resetData(self.model, self.data.get());
        std::copy_n(self.scene.start.data(), self.model->nq, self.data->qpos);
        mj_forward(self.model, self.data.get());
    });
    self.measure_last_interval();
    self.measure_now();
}

JointControl& SceneSimulation::control(int robot) noexcept {
    return impl_->controls[static_cast<size_t>(robot)];
}

void SceneSimulation::set_mode(int robot, ControlMode mode) noexcept {
    control(robot).set_mode(mode, readings_at_loops(robot).s);
}

void SceneSimulation::set_torque(int robot, std::span<const double> tau) noexcept {
    if (control(robot).mode() != ControlMode::torque) set_mode(robot, ControlMode::torque);
    control(robot).set_reference(
        Eigen::Map<const Eigen::VectorXd>(tau.data(), impl_->scene.robot(robot).n()));
}

void SceneSimulation::command(int robot, std::span<const double> tau) noexcept {
    double* torques = impl_->in(impl_->at.torques[static_cast<size_t>(robot)]);
    *torques = tau.empty() ? 0.0 : 1.0;
    std::copy(tau.begin(), tau.end(), torques + 1);
}

void SceneSimulation::set_wrench(int robot, int i, const Vector6d& wrench) noexcept {
    std::copy_n(wrench.data(), 6, impl_->in(impl_->at.wrenches[static_cast<size_t>(robot)]) + 6 * i);
}

void SceneSimulation::set_control(int actuator, double value) noexcept {
    impl_->data->ctrl[actuator] = value;
}

bool SceneSimulation::step(int count, const Disturbance& disturbance) noexcept {
    Impl& self = *impl_;
    if (self.error[0] != '\0' || !self.check_inputs() || !self.check(disturbance)) return false;
    self.run([&] {
        for (int i = 0; i < count; ++i) {
            self.apply_inputs(disturbance);
            *self.in(self.at.step) += 1.0;
            mj_step2(self.model, self.data.get()); // forces at t_k, then q and v at t_k+1
            self.measure_last_interval();          // before the contacts of t_k are forgotten
            mj_step1(self.model, self.data.get()); // kinematics and contacts at t_k+1
            self.measure_now();
        }
    });
    return self.check_motion();
}

const char* SceneSimulation::error() const noexcept { return impl_->error.data(); }
Failure SceneSimulation::failure() const noexcept { return impl_->failure; }
double SceneSimulation::time() const noexcept { return impl_->data->time; }

Readings SceneSimulation::readings(int robot) const noexcept {
    return impl_->read(robot, impl_->of(robot).delivered);
}
Readings SceneSimulation::readings_at_loops(int robot) const noexcept { return impl_->read(robot, 0); }
SceneSimulation::VectorView SceneSimulation::s(int robot) const noexcept {
    return {impl_->reading(robot, impl_->of(robot).s), impl_->scene.robot(robot).n()};
}
SceneSimulation::VectorView SceneSimulation::s_dot(int robot) const noexcept {
    return {impl_->reading(robot, impl_->of(robot).s_dot), impl_->scene.robot(robot).n()};
}
SceneSimulation::VectorView SceneSimulation::s_ddot(int robot) const noexcept {
    return {impl_->reading(robot, impl_->of(robot).s_ddot), impl_->scene.robot(robot).n()};
}
SceneSimulation::VectorView SceneSimulation::tau(int robot) const noexcept {
    return {impl_->reading(robot, impl_->of(robot).tau), impl_->scene.robot(robot).n()};
}
SceneSimulation::Matrix4View SceneSimulation::w_H_b(int robot) const noexcept {
    return Matrix4View(impl_->in(impl_->of(robot).w_H_b));
}
SceneSimulation::Vector6View SceneSimulation::v_b(int robot) const noexcept {
    return Vector6View(impl_->in(impl_->of(robot).v_b));
}
SceneSimulation::Vector3View SceneSimulation::com(int robot) const noexcept {
    return Vector3View(impl_->in(impl_->of(robot).com));
}
Eigen::Vector3d SceneSimulation::imu_rpy(int robot) const noexcept {
    const Eigen::Map<const Eigen::Matrix3d> R(impl_->reading(robot, impl_->of(robot).imu_rotation));
    return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
            std::atan2(R(1, 0), R(0, 0))};
}
SceneSimulation::Vector3View SceneSimulation::gyro(int robot) const noexcept {
    return Vector3View(impl_->reading(robot, impl_->of(robot).gyro));
}
SceneSimulation::Vector3View SceneSimulation::accelerometer(int robot) const noexcept {
    return Vector3View(impl_->reading(robot, impl_->of(robot).accelerometer));
}
SceneSimulation::Vector6View SceneSimulation::ft_wrench(int robot, int i) const noexcept {
    return Vector6View(impl_->reading(robot, impl_->of(robot).ft_wrenches + 6 * i));
}
Eigen::Map<const Eigen::Matrix3d> SceneSimulation::imu_rotation(int robot) const noexcept {
    return Eigen::Map<const Eigen::Matrix3d>(impl_->in(impl_->of(robot).imu_rotation));
}
SceneSimulation::Matrix4View SceneSimulation::foot_pose(int robot, int i) const noexcept {
    return Matrix4View(impl_->in(impl_->of(robot).foot_poses + 16 * i));
}
SceneSimulation::Vector6View SceneSimulation::foot_wrench(int robot, int i) const noexcept {
    return Vector6View(impl_->in(impl_->of(robot).foot_wrenches + 6 * i));
}
SceneSimulation::Matrix4View SceneSimulation::w_H_o(int object) const noexcept {
    return Matrix4View(impl_->in(impl_->at.poses + 16 * object));
}
SceneSimulation::Vector6View SceneSimulation::v_o(int object) const noexcept {
    return Vector6View(impl_->in(impl_->at.velocities + 6 * object));
}
Eigen::Matrix4d SceneSimulation::w_H(const Frame& frame) const noexcept {
    return impl_->w_H(frame.body + 1) * frame.pose; // the world is 0
}

void SceneSimulation::remember_contacts() {
    Impl& self = *impl_;
    if (self.contacts) return;
    self.contacts.emplace(self.model);
    self.contacts->record(self.model, self.data.get());
}

Contact SceneSimulation::contact(const Frame& frame, std::optional<int> with) const noexcept {
    Contact sum;
    if (!impl_->contacts) return sum;
    const Eigen::Vector3d origin =
        (impl_->contacts->pose(frame.body + 1) * frame.pose).topRightCorner<3, 1>();
    impl_->contacts->visit(frame.body + 1, [&](int other, const Eigen::Vector3d& at, const Touch& touch) {
        if (with && other != *with + 1) return;
        sum.wrench.head<3>() += touch.force;
        sum.wrench.tail<3>() += touch.moment + (at - origin).cross(touch.force);
        ++sum.points;
    });
    return sum;
}

void SceneSimulation::pressures(const Patch& patch, Eigen::Ref<Eigen::MatrixXd> cells) const noexcept {
    cells.setZero();
    if (!impl_->contacts) return;
    const Eigen::Matrix4d patch_H_w = inverse(impl_->contacts->pose(patch.frame.body + 1) * patch.frame.pose);
    const Eigen::Array2d counts(static_cast<double>(cells.rows()), static_cast<double>(cells.cols()));
    const double area = patch.size.prod() / counts.prod();
    impl_->contacts->visit(patch.frame.body + 1, [&](int, const Eigen::Vector3d& at, const Touch& touch) {
        const Eigen::Vector3d p = (patch_H_w * at.homogeneous()).head<3>();
        const double force = -patch_H_w.row(2).head<3>().dot(touch.force);
        const bool is_within = std::abs(p.z()) <= patch.thickness && force > 0.0 &&
                               (p.head<2>().array().abs() <= 0.5 * patch.size.array()).all();
        if (!is_within) return;
        // In cells, from the middle of the first one.
        const Eigen::Array2d place =
            ((p.head<2>().array() / patch.size.array() + 0.5) * counts - 0.5).max(0.0).min(counts - 1.0);
        const Eigen::Array2d first = place.floor().min((counts - 2.0).max(0.0)), part = place - first;
        for (const int i : {0, 1})
            for (const int j : {0, 1}) {
                const double share = (i == 0 ? 1.0 - part[0] : part[0]) * (j == 0 ? 1.0 - part[1] : part[1]);
                if (share == 0.0) continue; // the neighbour may not be there
                cells(static_cast<Eigen::Index>(first[0]) + i, static_cast<Eigen::Index>(first[1]) + j) +=
                    share * force / area;
            }
    });
}

void SceneSimulation::measure_rays(const Frame& frame, const Eigen::Ref<const Eigen::Matrix3Xd>& directions,
                                   double range, Eigen::Ref<Eigen::VectorXd> distances) const noexcept {
    const mjData* d = impl_->data.get();
    const int id = frame.body < 0 ? -1 : frame.body + 1; // what does not see itself
    const Eigen::Matrix4d w_H_frame = w_H(frame);
    const Eigen::Vector3d origin = w_H_frame.topRightCorner<3, 1>();
    for (Eigen::Index i = 0; i < directions.cols(); ++i) {
        const Eigen::Vector3d along = w_H_frame.topLeftCorner<3, 3>() * directions.col(i);
        const double hit =
            mj_ray(impl_->model, d, origin.data(), along.data(), nullptr, 1, id, nullptr, nullptr);
        distances[i] = hit < 0.0 || hit > range ? range : hit;
    }
}

SceneSimulation::VectorView SceneSimulation::q() const noexcept {
    return {impl_->data->qpos, impl_->model->nq};
}

Eigen::Vector2d SceneSimulation::energy() const noexcept {
    mj_energyPos(impl_->model, impl_->data.get());
    mj_energyVel(impl_->model, impl_->data.get());
    return {impl_->data->energy[1], impl_->data->energy[0]}; // MuJoCo has the potential one first
}

void SceneSimulation::solve_exactly(bool does) {
    Impl& self = *impl_;
    if (does && !self.exact) {
        self.exact.reset(mj_copyModel(nullptr, self.scene.model.get()));
        if (!self.exact) throw std::bad_alloc();
        self.exact->opt.tolerance = 1e-16;
    }
    self.model = does ? self.exact.get() : self.scene.model.get();
}

int SceneSimulation::state_size() const noexcept {
    int size = 1 + mj_stateSize(impl_->model, scene_state_signature) + impl_->at.size;
    for (const JointControl& control : impl_->controls) size += control.state_size();
    return size + (impl_->contacts ? impl_->contacts->state_size() : 0);
}

void SceneSimulation::save(double* state) const noexcept {
    *state++ = impl_->scene.fingerprint;
    mj_getState(impl_->model, impl_->data.get(), state, scene_state_signature);
    state = std::copy(impl_->memory.begin(), impl_->memory.end(),
                      state + mj_stateSize(impl_->model, scene_state_signature));
    for (const JointControl& control : impl_->controls) {
        control.save(state);
        state += control.state_size();
    }
    if (impl_->contacts) std::copy_n(impl_->contacts->data(), impl_->contacts->state_size(), state);
}

bool SceneSimulation::is_of_this_scene(const double* state) const noexcept {
    return *state == impl_->scene.fingerprint;
}

void SceneSimulation::restore(const double* state) noexcept {
    Impl& self = *impl_;
    ++state; // the fingerprint
    self.forget_failure();
    self.run([&] {
        for (mjWarningStat& warning : self.data->warning) warning = {};
        mj_setState(self.model, self.data.get(), state, scene_state_signature);
        self.is_pushed = true;
        mj_step1(self.model, self.data.get());
    });
    state += mj_stateSize(self.model, scene_state_signature);
    std::copy_n(state, self.at.size, self.memory.begin());
    state += self.at.size;
    for (JointControl& control : self.controls) {
        control.restore(state);
        state += control.state_size();
    }
    if (self.contacts) std::copy_n(state, self.contacts->state_size(), self.contacts->data());
}

} // namespace bf::physics

#include "robot_index.hpp"
#include "bf/base/numbers.hpp"
#include "contacts.hpp"
#include "noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace bf::physics {

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

enum Channel : std::uint64_t { of_position, of_velocity, of_torque, channels, of_dropout = ~0ULL };

/// White noise of joint i.
double noise_of(double deviation, const Noise& noise, std::uint64_t step, Channel channel,
                size_t i) noexcept {
    return deviation == 0.0 ? 0.0 : deviation * gaussian(noise.seed, step, channels * i + channel);
}

/// The joint-wise list, complete.
Eigen::VectorXd complete(const std::vector<double>& list, Eigen::Index n) {
    Eigen::VectorXd all(n);
    for (Eigen::Index i = 0; i < n; ++i) all[i] = entry(list, static_cast<size_t>(i), 0.0);
    return all;
}

/// What the last step measured becomes what an encoder measures now.
struct Encoder {
    double resolution;
    bool counts_velocity, is_first;
    double period;

    void measure(double position, double velocity, double& s, double& s_dot) const noexcept {
        const double now = resolution > 0.0 ? resolution * std::round(position / resolution) : position;
        s_dot = !counts_velocity ? velocity : is_first ? 0.0 : (now - s) / period;
        s = now;
    }
};

void measure_rotation(const mjData* d, int site, auto&& out) noexcept { // MuJoCo's are row-major
    out = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d->site_xmat + 9 * site);
}

/// Writes the pose of a site to 16 doubles, column-major.
void measure_pose(const mjData* d, int site, double* out) noexcept {
    Eigen::Map<Eigen::Matrix4d> H(out);
    measure_rotation(d, site, H.topLeftCorner<3, 3>());
    H.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(d->site_xpos + 3 * site);
    H.row(3) << 0.0, 0.0, 0.0, 1.0;
}

} // namespace

RobotLayout::RobotLayout(int& at, const RobotIndex& robot, const RobotOptions& options) {
    const auto take = [&at](int count) { return std::exchange(at, at + count); };
    const int n = robot.n();
    for (int* joints : {&s, &s_dot, &s_ddot, &tau, &motor_position, &motor_velocity, &motor_acceleration})
        *joints = take(n);
    imu_rotation = take(9);
    gyro = take(3);
    accelerometer = take(3);
    ft_wrenches = take(6 * static_cast<int>(robot.ft_sites.size()));
    measured = at - s;
    w_H_b = take(16);
    v_b = take(6);
    com = take(3);
    foot_poses = take(16 * static_cast<int>(robot.foot_sites.size()));
    foot_wrenches = take(6 * static_cast<int>(robot.foot_sites.size()));
    if (robot.delay == 0 && options.imperfections.dropout == 0.0) return;
    slots = robot.delay + 1;
    memory = take(slots * measured);
    delivered = take(measured) - s;
}

Readings RobotLayout::read(const double* from, int n, int shift) const noexcept {
    const auto of = [&](int offset) { return Eigen::Map<const Eigen::VectorXd>(from + offset + shift, n); };
    return {of(s),
            of(s_dot),
            of(s_ddot),
            of(tau),
            of(motor_position),
            of(motor_velocity),
            of(motor_acceleration)};
}

int steps_of(const char* name, double seconds, double step, const char* of) {
    constexpr double most = 1e6;
    const double steps = seconds / step, whole = std::round(steps);
    if (steps >= most)
        throw std::runtime_error(std::string(name) + " is " + number_text(seconds) + " s, which is " + of +
                                 ", " + number_text(step) + " s, more than 999999 times; give less");
    if (steps >= 0.0 && steps < most && std::abs(steps - whole) <= 1e-6 * steps)
        return static_cast<int>(whole);
    std::ostringstream text;
    text << name << " is " << seconds << " s, which is no multiple of " << of << ", " << step
         << " s; give a whole number of them";
    throw std::runtime_error(text.str());
}

Eigen::Matrix4d transform(const mjtNum* position, const mjtNum* rotation) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H.topLeftCorner<3, 3>() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation);
    H.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(position);
    return H;
}

Eigen::Matrix4d inverse(const Eigen::Matrix4d& H) {
    Eigen::Matrix4d inverted = Eigen::Matrix4d::Identity();
    inverted.topLeftCorner<3, 3>() = H.topLeftCorner<3, 3>().transpose();
    inverted.topRightCorner<3, 1>() = -inverted.topLeftCorner<3, 3>() * H.topRightCorner<3, 1>();
    return inverted;
}

void RobotIndex::find(const mjModel* m, const RobotOptions& options, const std::string& prefix) {
    const auto sensor = [&](const std::string& name) {
        return m->sensor_adr[id_of(m, mjOBJ_SENSOR, prefix + mark(name))];
    };
    const auto site = [&](const std::string& name) { return id_of(m, mjOBJ_SITE, prefix + mark(name)); };
    const auto n = static_cast<Eigen::Index>(options.joints.size());
    lower_limits.setConstant(n, -unlimited);
    upper_limits.setConstant(n, unlimited);
    effort_limits.setConstant(n, unlimited);
    for (Eigen::Index i = 0; i < n; ++i) {
        const std::string name = prefix + options.joints[static_cast<size_t>(i)];
        const int joint = id_of(m, mjOBJ_JOINT, name);
        position.push_back(m->jnt_qposadr[joint]);
        velocity.push_back(m->jnt_dofadr[joint]);
        motors.push_back(id_of(m, mjOBJ_ACTUATOR, prefix + mark(options.joints[static_cast<size_t>(i)])));
        dampers.push_back(mj_name2id(m, mjOBJ_ACTUATOR,
                                     (prefix + damper_of(options.joints[static_cast<size_t>(i)])).c_str()));
        if (m->jnt_limited[joint]) {
            lower_limits[i] = m->jnt_range[2 * joint];
            upper_limits[i] = m->jnt_range[2 * joint + 1];
        }
        if (m->jnt_actfrclimited[joint]) effort_limits[i] = m->jnt_actfrcrange[2 * joint + 1];
        const int play =
            mj_name2id(m, mjOBJ_JOINT, (prefix + play_of(options.joints[static_cast<size_t>(i)])).c_str());
        play_position.push_back(play < 0 ? -1 : m->jnt_qposadr[play]);
        play_velocity.push_back(play < 0 ? -1 : m->jnt_dofadr[play]);
    }
    encoder_resolution = complete(options.imperfections.encoder_resolution, n);
    motor_encoder_resolution = complete(options.imperfections.motor_encoder_resolution, n);
    delay = steps_of("measurement_delay", options.imperfections.delays.measurement, m->opt.timestep,
                     "the time step");
    followers = follower_addresses(m, options, prefix);
    base_site = site("base");
    imu_site = site("imu");
    gyro = sensor("gyro");
    accelerometer = sensor("accelerometer");
    for (size_t i = 0; i < options.ft_sensors.size(); ++i) {
        const std::string index = std::to_string(i);
        const int at = site("ft:" + index);
        if (m->body_subtreemass[m->site_bodyid[at]] < 1e-9)
            throw std::runtime_error("force/torque sensor at '" + options.ft_sensors[i] +
                                     "' carries no mass, so it would always read 0; name the fixed joint "
                                     "that joins the two parts of the limb, such as l_foot_ft_sensor");
        ft_sites.push_back(at);
        force_sensors.push_back(sensor("force:" + index));
        torque_sensors.push_back(sensor("torque:" + index));
    }
    for (size_t i = 0; i < options.push_links.size(); ++i)
        push_sites.push_back(site("push:" + std::to_string(i)));
    if (options.feet.empty()) return;
    foot_of_geom.assign(static_cast<size_t>(m->ngeom), -1);
    for (size_t i = 0; i < options.feet.size(); ++i) {
        const std::string name = prefix + "foot:" + std::to_string(i);
        foot_sites.push_back(id_of(m, mjOBJ_SITE, name));
        for (int geom = 0; geom < m->ngeom; ++geom)
            if (const char* shape = mj_id2name(m, mjOBJ_GEOM, geom);
                shape && std::string_view(shape).starts_with(name + ":"))
                foot_of_geom[static_cast<size_t>(geom)] = static_cast<int>(i);
    }
}

void put_joints(const RobotIndex& robot, const RobotOptions& options, double* qpos) {
    for (int i = 0; i < robot.n(); ++i) {
        const auto& s = options.initial_joints;
        // A joint whose limits exclude zero would be thrown to them.
        const double value = s.empty() ? std::clamp(0.0, robot.lower_limits[i], robot.upper_limits[i])
                                       : s[s.size() == 1 ? 0 : static_cast<size_t>(i)];
        qpos[robot.position[static_cast<size_t>(i)]] = value;
        if (!s.empty() && (value < robot.lower_limits[i] || value > robot.upper_limits[i])) {
            std::ostringstream text;
            text << "the initial position of joint '" << options.joints[static_cast<size_t>(i)] << "' is "
                 << value << "; the robot's file limits it to [" << robot.lower_limits[i] << ", "
                 << robot.upper_limits[i] << "]";
            throw std::runtime_error(text.str());
        }
    }
    for (const FollowerAddress& follower : robot.followers) follower.put(qpos);
}

namespace {

/// The inertia (n, kg m2) that each joint sees at positions qpos, its armature and followers included.
Eigen::VectorXd joint_inertias(const mjModel* m, const RobotIndex& robot, const Eigen::VectorXd& qpos) {
    const DataPtr data = make_data(m);
    std::copy_n(qpos.data(), m->nq, data->qpos);
    mj_forward(m, data.get());
    Eigen::VectorXd inertias(robot.n()), direction(m->nv), momentum(m->nv);
    for (int i = 0; i < robot.n(); ++i) {
        direction.setZero();
        direction[robot.velocity[static_cast<size_t>(i)]] = 1.0;
        for (const FollowerAddress& follower : robot.followers)
            if (follower.leader == robot.position[static_cast<size_t>(i)])
                direction[follower.velocity] = follower.multiplier;
        mj_mulM(m, data.get(), momentum.data(), direction.data());
        inertias[i] = direction.dot(momentum);
    }
    return inertias;
}

} // namespace

void RobotIndex::drive(const mjModel* m, const RobotOptions& options, const MotorOptions& motors_given,
                       double loop_period, const Eigen::VectorXd& start) {
    loop_steps = std::max(1, steps_of("loop_period", loop_period, m->opt.timestep, "the time step"));
    command_delay = steps_of("command_delay", options.imperfections.delays.command,
                             loop_steps * m->opt.timestep, "the period of the loops");
    inertias = joint_inertias(m, *this, start);
    drives.emplace(motors_given, options.joints, inertias);
    // MuJoCo's other integrator takes no actuator implicitly, and what is held for longer is not implicit.
    if (loop_steps > 1 || m->opt.integrator != mjINT_IMPLICITFAST) dampers.assign(motors.size(), -1);
}

std::vector<std::string> RobotIndex::unstable_loops(const mjModel* m, const RobotOptions& options) const {
    const double step = m->opt.timestep, period = loop_steps * step;
    std::vector<std::string> all;
    const auto check = [&](double growth, const std::string& joint, const auto&... text) {
        if (growth <= 1.0 + 1e-4) return; // what grows more slowly is lost in friction
        std::ostringstream line;
        line << "joint '" << joint << "': ";
        (line << ... << text);
        line << "; as it is, what disturbs the loop grows " << growth << "-fold in each period";
        all.push_back(line.str());
    };
    for (Eigen::Index i = 0; i < n(); ++i) {
        const auto at = static_cast<size_t>(i);
        const std::string& joint = options.joints[at];
        const double inertia = inertias[i], damping = m->dof_damping[velocity[at]];
        const auto growth = [&](double P, double I, double D) {
            const bool is_implicit = dampers[at] >= 0;
            return LoopGrowth{P, I, is_implicit ? 0.0 : D}.position(
                inertia, is_implicit ? damping + D : damping, step, loop_steps);
        };
        const auto remedy = [&] {
            std::ostringstream text;
            text
                << ", which a loop of " << period << " s cannot hold with the inertia of " << inertia
                << " that the joint sees at the start; lower the gains (D is to be below 2 inertia / period, "
                << 2 * inertia / period << ", P below 4 inertia / period^2, "
                << 4 * inertia / (period * period) << "), shorten the step or loop_period, or add armature";
            return text.str();
        };
        const Gains& p = drives->position;
        check(growth(p.P[i], p.I[i], p.D[i]), joint, "its position_gains are P ", p.P[i], ", I ", p.I[i],
              ", D ", p.D[i], remedy());
        const double K = drives->stiffness[i], D = drives->damping[i];
        check(growth(K, 0.0, D), joint, "its impedance_gains are K ", K, ", D ", D, remedy());
        const Gains& t = drives->torque;
        const double k_tau = drives->parameters.k_tau[i];
        check(LoopGrowth{t.P[i], t.I[i], t.D[i]}.torque(k_tau, period), joint, "its torque_gains are P ",
              t.P[i], ", I ", t.I[i], ", D ", t.D[i], " at a k_tau of ", k_tau,
              ", but the loop measures the torque of its last period; keep P + 2 D / period + I period / 2 "
              "below k_tau");
    }
    return all;
}

void measure_now(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                 const RobotOptions& options, std::uint64_t step, double* out) noexcept {
    const Noise& noise = options.noise;
    const double* const ratios = robot.drives->gear_ratio.data();
    for (size_t i = 0; i < robot.position.size(); ++i) {
        const auto joint = static_cast<Eigen::Index>(i);
        const double ratio = ratios[i];
        const bool plays = robot.play_position[i] >= 0;
        double motor = d->qpos[robot.position[i]], motor_dot = d->qvel[robot.velocity[i]];
        if (noise.position != 0.0) motor += noise_of(noise.position, noise, step, of_position, i);
        if (noise.velocity != 0.0) motor_dot += noise_of(noise.velocity, noise, step, of_velocity, i);
        Encoder encoder{robot.encoder_resolution[joint], options.imperfections.velocities_from_encoders,
                        step == 0, m->opt.timestep};
        encoder.measure(plays ? motor + d->qpos[robot.play_position[i]] : motor,
                        plays ? motor_dot + d->qvel[robot.play_velocity[i]] : motor_dot, out[at.s + joint],
                        out[at.s_dot + joint]);
        encoder.resolution = robot.motor_encoder_resolution[joint];
        encoder.measure(ratio * motor, ratio * motor_dot, out[at.motor_position + joint],
                        out[at.motor_velocity + joint]);
    }

    measure_pose(d, robot.base_site, out + at.w_H_b);
    mjtNum velocity[6]; // angular first
    mj_objectVelocity(m, d, mjOBJ_SITE, robot.base_site, velocity, 0);
    std::copy_n(velocity + 3, 3, out + at.v_b);
    std::copy_n(velocity, 3, out + at.v_b + 3);
    if (robot.roots.empty()) {
        std::copy_n(d->subtree_com, 3, out + at.com);
    } else {
        Eigen::Map<Eigen::Vector3d> com(out + at.com);
        com.setZero();
        double mass = 0.0;
        for (const int body : robot.roots) {
            com += m->body_subtreemass[body] * Eigen::Map<const Eigen::Vector3d>(d->subtree_com + 3 * body);
            mass += m->body_subtreemass[body];
        }
        if (mass > 0.0) com /= mass;
    }

    measure_rotation(d, robot.imu_site, Eigen::Map<Eigen::Matrix3d>(out + at.imu_rotation));
    std::copy_n(d->sensordata + robot.gyro, 3, out + at.gyro);
    for (size_t i = 0; i < robot.foot_sites.size(); ++i)
        measure_pose(d, robot.foot_sites[i], out + at.foot_poses + 16 * i);
}

void measure_last_interval(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                           const Noise& noise, std::uint64_t step, double* out) noexcept {
    for (size_t i = 0; i < robot.velocity.size(); ++i) {
        const auto joint = static_cast<Eigen::Index>(i);
        const double motor = d->qacc[robot.velocity[i]];
        out[at.s_ddot + joint] = robot.play_velocity[i] < 0 ? motor : motor + d->qacc[robot.play_velocity[i]];
        out[at.motor_acceleration + joint] = robot.drives->gear_ratio[joint] * motor;
        out[at.tau + joint] =
            d->qfrc_actuator[robot.velocity[i]] + noise_of(noise.torque, noise, step, of_torque, i);
    }
    std::copy_n(d->sensordata + robot.accelerometer, 3, out + at.accelerometer);
    for (size_t i = 0; i < robot.ft_sites.size(); ++i) {
        // MuJoCo gives what the parent exerts on the child.
        double* wrench = out + at.ft_wrenches + 6 * i;
        for (int j = 0; j < 3; ++j) {
            wrench[j] = -d->sensordata[robot.force_sensors[i] + j];
            wrench[3 + j] = -d->sensordata[robot.torque_sensors[i] + j];
        }
    }
    if (robot.foot_sites.empty()) return;
    std::fill_n(out + at.foot_wrenches, 6 * robot.foot_sites.size(), 0.0);
    for (int i = 0; i < d->ncon; ++i) {
        const mjContact& contact = d->contact[i];
        if (!is_active(contact)) continue;
        const bool second = robot.foot_of_geom[static_cast<size_t>(contact.geom[1])] >= 0;
        const int foot = robot.foot_of_geom[static_cast<size_t>(contact.geom[second])];
        if (foot < 0) continue;
        const Eigen::Vector3d force = (second ? 1.0 : -1.0) * touch(m, d, i).force;
        const Eigen::Vector3d lever =
            Eigen::Map<const Eigen::Vector3d>(contact.pos) -
            Eigen::Map<const Eigen::Vector3d>(d->site_xpos + 3 * robot.foot_sites[static_cast<size_t>(foot)]);
        double* wrench = out + at.foot_wrenches + 6 * foot;
        Eigen::Map<Eigen::Vector3d>{wrench} += force;
        Eigen::Map<Eigen::Vector3d>{wrench + 3} += lever.cross(force);
    }
}

void deliver(const RobotLayout& at, const RobotOptions& options, std::uint64_t step, double* out) noexcept {
    if (at.slots == 0) return;
    const double* fresh = out + at.s;
    const auto slot = [&](std::uint64_t of) {
        return out + at.memory + at.measured * static_cast<int>(of % static_cast<std::uint64_t>(at.slots));
    };
    if (step == 0) { // as if it had stood there for long
        for (int i = 0; i < at.slots; ++i)
            std::copy_n(fresh, at.measured, slot(static_cast<std::uint64_t>(i)));
    } else {
        const bool is_lost =
            uniform(key_of(options.noise.seed, step, of_dropout)) < options.imperfections.dropout;
        if (!is_lost || at.slots > 1) std::copy_n(is_lost ? slot(step - 1) : fresh, at.measured, slot(step));
    }
    std::copy_n(slot(step + 1), at.measured, out + at.s + at.delivered); // the oldest there is
}

} // namespace bf::physics

#include "robot_index.hpp"
#include "noise.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace bf::physics {

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

void add_noise(double* out, const std::vector<int>& source, const mjtNum* values, double deviation,
               const Noise& noise, std::uint64_t step, std::uint64_t kind) noexcept {
    for (size_t i = 0; i < source.size(); ++i) out[i] = values[source[i]];
    if (deviation == 0.0) return;
    for (size_t i = 0; i < source.size(); ++i) out[i] += deviation * gaussian(noise.seed, step, 3 * i + kind);
}

void measure_rotation(const mjData* d, int site, auto&& out) noexcept { // MuJoCo's are row-major
    out = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d->site_xmat + 9 * site);
}

} // namespace

RobotLayout::RobotLayout(int& at, int n, int ft_sensors) {
    const auto take = [&at](int count) { return std::exchange(at, at + count); };
    s = take(n);
    s_dot = take(n);
    s_ddot = take(n);
    tau = take(n);
    w_H_b = take(16);
    v_b = take(6);
    com = take(3);
    imu_rotation = take(9);
    imu_rpy = take(3);
    gyro = take(3);
    accelerometer = take(3);
    ft_wrenches = take(6 * ft_sensors);
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
        if (m->jnt_limited[joint]) {
            lower_limits[i] = m->jnt_range[2 * joint];
            upper_limits[i] = m->jnt_range[2 * joint + 1];
        }
        if (m->jnt_actfrclimited[joint]) effort_limits[i] = m->jnt_actfrcrange[2 * joint + 1];
    }
    followers = follower_addresses(m, options, prefix);
    base_site = site("base");
    imu_site = site("imu");
    gyro = sensor("gyro");
    accelerometer = sensor("accelerometer");
    for (size_t i = 0; i < options.ft_sensors.size(); ++i) {
        const std::string index = std::to_string(i);
        const int at = site("ft:" + index);
        if (m->body_subtreemass[m->site_bodyid[at]] < 1e-9)
            throw std::runtime_error(
                "force/torque sensor at '" + options.ft_sensors[i] +
                "' carries no mass, so it would always read 0; name the fixed joint that "
                "joins the two parts of the limb, such as l_foot_ft_sensor");
        ft_sites.push_back(at);
        force_sensors.push_back(sensor("force:" + index));
        torque_sensors.push_back(sensor("torque:" + index));
    }
    for (size_t i = 0; i < options.push_links.size(); ++i)
        push_sites.push_back(site("push:" + std::to_string(i)));
}

void put_joints(const RobotIndex& robot, const RobotOptions& options, double* qpos) {
    for (int i = 0; i < robot.n(); ++i) {
        const auto& s = options.initial_joints;
        const double value = s.empty() ? 0.0 : s[s.size() == 1 ? 0 : static_cast<size_t>(i)];
        qpos[robot.position[static_cast<size_t>(i)]] = value;
        if (!s.empty() && (value < robot.lower_limits[i] || value > robot.upper_limits[i])) {
            std::ostringstream text;
            text << "initial_joints puts joint '" << options.joints[static_cast<size_t>(i)] << "' at "
                 << value << "; the URDF limits it to [" << robot.lower_limits[i] << ", "
                 << robot.upper_limits[i] << "]";
            throw std::runtime_error(text.str());
        }
    }
    for (const FollowerAddress& follower : robot.followers) follower.put(qpos);
}

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

void measure_pose(const mjData* d, int site, double* out) noexcept {
    Eigen::Map<Eigen::Matrix4d> H(out);
    measure_rotation(d, site, H.topLeftCorner<3, 3>());
    H.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(d->site_xpos + 3 * site);
    H.row(3) << 0.0, 0.0, 0.0, 1.0;
}

void measure_now(const mjModel* m, const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                 const Noise& noise, std::uint64_t step, double* out) noexcept {
    add_noise(out + at.s, robot.position, d->qpos, noise.position, noise, step, 0);
    add_noise(out + at.s_dot, robot.velocity, d->qvel, noise.velocity, noise, step, 1);

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

    Eigen::Map<Eigen::Matrix3d> R(out + at.imu_rotation);
    measure_rotation(d, robot.imu_site, R);
    double* rpy = out + at.imu_rpy; // R = Rz(yaw) Ry(pitch) Rx(roll)
    rpy[0] = std::atan2(R(2, 1), R(2, 2));
    rpy[1] = std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)));
    rpy[2] = std::atan2(R(1, 0), R(0, 0));
    std::copy_n(d->sensordata + robot.gyro, 3, out + at.gyro);
}

void measure_last_interval(const mjData* d, const RobotIndex& robot, const RobotLayout& at,
                           const Noise& noise, std::uint64_t step, double* out) noexcept {
    add_noise(out + at.s_ddot, robot.velocity, d->qacc, 0.0, noise, step, 0);
    add_noise(out + at.tau, robot.velocity, d->qfrc_actuator, noise.torque, noise, step, 2);
    std::copy_n(d->sensordata + robot.accelerometer, 3, out + at.accelerometer);
    for (size_t i = 0; i < robot.ft_sites.size(); ++i) {
        // MuJoCo gives what the parent exerts on the child.
        double* wrench = out + at.ft_wrenches + 6 * i;
        for (int j = 0; j < 3; ++j) {
            wrench[j] = -d->sensordata[robot.force_sensors[i] + j];
            wrench[3 + j] = -d->sensordata[robot.torque_sensors[i] + j];
        }
    }
}

} // namespace bf::physics

#include "world_impl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace bf::physics {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Fills in what the options leave to the URDF and checks every name against it.
void complete(WorldOptions& options, const Urdf& urdf) {
    if (options.joints.empty())
        for (const UrdfJoint& joint : urdf.joints)
            if (joint.is_movable()) options.joints.push_back(joint.name);
    std::set<std::string> seen;
    for (const std::string& name : options.joints) {
        urdf.require_motor(name);
        if (!seen.insert(name).second)
            throw std::runtime_error("joint '" + name + "' is listed twice in joints; list each joint once");
    }

    for (const Follower& follower : options.followers) {
        urdf.require_motor(follower.joint);
        if (seen.contains(follower.joint))
            throw std::runtime_error("joint '" + follower.joint +
                                     "' is listed in joints and among the followers; list it once");
        if (!follower.leader.empty() && !seen.contains(follower.leader))
            throw std::runtime_error("joint '" + follower.joint + "' follows '" + follower.leader +
                                     "', which is not in the list of joints; add it");
    }

    if (options.base_link.empty()) options.base_link = urdf.first_heavy_link();
    urdf.require_link(options.base_link, "base link");
    if (options.floating_base && options.base_link == "world")
        throw std::runtime_error(
            "the link 'world' of '" + urdf.file.string() +
            "' stands still by its name and cannot float; set floating_base to false, or "
            "choose another base_link, such as '" +
            urdf.first_heavy_link() + "'");

    if (options.imu_frame.empty()) options.imu_frame = options.base_link;
    urdf.require_link(options.imu_frame, "frame of the IMU");
    for (const Foot& foot : options.feet) urdf.require_link(foot.frame, "frame of a foot");
    for (const std::string& link : options.push_links) urdf.require_link(link, "link to push");
    for (std::string& sensor : options.ft_sensors) {
        if (const UrdfJoint* joint = urdf.find_joint(sensor)) sensor = joint->child;
        urdf.require_link(sensor, "child of a force/torque sensor (name the fixed joint or its child link)");
        if (sensor == urdf.root())
            throw std::runtime_error("force/torque sensor at '" + sensor +
                                     "': the root has no parent to exert a wrench on; name a fixed joint");
    }
}

bool limited(const mjModel& model, int joint) { return model.jnt_limited[joint] != 0; }

/// Height of the lowest point of a geom above the world's origin; of other shapes than spheres and boxes that
/// of the box around them.
double lowest_point(const mjModel& model, const mjData& data, int geom) {
    const mjtNum* down = data.geom_xmat + 9 * geom + 6; // z row of the rotation
    const double height = data.geom_xpos[3 * geom + 2];
    if (model.geom_type[geom] == mjGEOM_SPHERE) return height - model.geom_size[3 * geom];
    const mjtNum* centre = model.geom_aabb + 6 * geom;
    const mjtNum* size = centre + 3;
    const double middle = down[0] * centre[0] + down[1] * centre[1] + down[2] * centre[2];
    const double reach =
        std::abs(down[0]) * size[0] + std::abs(down[1]) * size[1] + std::abs(down[2]) * size[2];
    return height + middle - reach;
}

} // namespace

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

void World::Impl::index() {
    const mjModel* m = model.get();
    const auto sensor = [&](const std::string& name) { return m->sensor_adr[id_of(m, mjOBJ_SENSOR, name)]; };
    const auto site = [&](const std::string& name) { return id_of(m, mjOBJ_SITE, name); };
    lower_limits.setConstant(n(), -infinity);
    upper_limits.setConstant(n(), infinity);
    effort_limits.setConstant(n(), infinity);
    for (int i = 0; i < n(); ++i) {
        const int joint = id_of(m, mjOBJ_JOINT, options.joints[static_cast<size_t>(i)]);
        position.push_back(m->jnt_qposadr[joint]);
        velocity.push_back(m->jnt_dofadr[joint]);
        if (limited(*m, joint)) {
            lower_limits[i] = m->jnt_range[2 * joint];
            upper_limits[i] = m->jnt_range[2 * joint + 1];
        }
        if (m->jnt_actfrclimited[joint]) effort_limits[i] = m->jnt_actfrcrange[2 * joint + 1];
    }
    followers = follower_addresses(m, options);
    for (int body = 1; body < m->nbody; ++body) bodies.emplace_back(mj_id2name(m, mjOBJ_BODY, body));
    base_site = site("base");
    imu_site = site("imu");
    gyro = sensor("gyro");
    accelerometer = sensor("accelerometer");
    foot_of_geom.assign(static_cast<size_t>(m->ngeom), -1);
    for (size_t i = 0; i < options.feet.size(); ++i) {
        const std::string name = "foot:" + std::to_string(i);
        foot_sites.push_back(site(name));
        for (int geom = 0; geom < m->ngeom; ++geom)
            if (const char* shape = mj_id2name(m, mjOBJ_GEOM, geom);
                shape && std::string_view(shape).starts_with(name + ":"))
                foot_of_geom[static_cast<size_t>(geom)] = static_cast<int>(i);
    }
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

void World::Impl::place() {
    const auto kinematics = [&](const DataPtr& data) {
        std::copy_n(start.data(), start.size(), data->qpos);
        mj_kinematics(model.get(), data.get());
    };
    start = Eigen::Map<const Eigen::VectorXd>(model->qpos0, model->nq);
    for (int i = 0; i < n(); ++i) {
        const auto& s = options.initial_joints;
        const double value = s.empty() ? 0.0 : s[s.size() == 1 ? 0 : static_cast<size_t>(i)];
        start[position[static_cast<size_t>(i)]] = value;
        if (!s.empty() && (value < lower_limits[i] || value > upper_limits[i])) {
            std::ostringstream text;
            text << "initial_joints puts joint '" << options.joints[static_cast<size_t>(i)] << "' at "
                 << value << "; the URDF limits it to [" << lower_limits[i] << ", " << upper_limits[i] << "]";
            throw std::runtime_error(text.str());
        }
    }
    for (const FollowerAddress& follower : followers) follower.put(start.data());
    if (options.floating_base)
        std::copy_n(std::array{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}.data(), 7, start.data());

    // Move everything by X, so that the base, or the feet, come to lie where they should.
    DataPtr data = make_data(model.get());
    kinematics(data);
    const auto site = [&](int id) { return transform(data->site_xpos + 3 * id, data->site_xmat + 9 * id); };
    const Eigen::Matrix4d base = site(base_site);
    Eigen::Matrix4d X = options.initial_w_H_b.value_or(Eigen::Matrix4d::Identity()) * inverse(base);
    if (!options.initial_w_H_b && options.floating_base && !foot_sites.empty()) {
        Eigen::Vector3d forward = Eigen::Vector3d::Zero();
        for (int id : foot_sites) forward += X.topLeftCorner<3, 3>() * site(id).block<3, 1>(0, 0);
        Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
        turn.topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(-std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ())
                .toRotationMatrix();
        X = turn * X;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (int id : foot_sites) middle += (X * site(id)).topRightCorner<3, 1>();
        X.topRightCorner<2, 1>() -= middle.head<2>() / static_cast<double>(foot_sites.size());
    }

    const Eigen::Quaterniond q(Eigen::Matrix3d(X.topLeftCorner<3, 3>()));
    const std::array<double, 7> pose{X(0, 3), X(1, 3), X(2, 3), q.w(), q.x(), q.y(), q.z()};
    if (!options.floating_base) {
        for (int body = 1; body < model->nbody; ++body) {
            if (model->body_parentid[body] != 0) continue;
            mjtNum moved[7];
            mju_mulPose(moved, moved + 3, pose.data(), pose.data() + 3, model->body_pos + 3 * body,
                        model->body_quat + 4 * body);
            std::copy_n(moved, 3, model->body_pos + 3 * body);
            std::copy_n(moved + 3, 4, model->body_quat + 4 * body);
        }
        return;
    }
    std::copy_n(pose.data(), 7, start.data());
    if (options.initial_w_H_b || foot_sites.empty()) return;
    kinematics(data);
    double lowest = infinity;
    for (int geom = 0; geom < model->ngeom; ++geom)
        if (foot_of_geom[static_cast<size_t>(geom)] >= 0)
            lowest = std::min(lowest, lowest_point(*model, *data, geom));
    start[2] -= lowest + 0.05e-3;
}

World::World(WorldOptions options) : impl_(std::make_unique<Impl>()) {
    options.validate();
    silence_mujoco();
    const Urdf urdf = Urdf::read(options.urdf);
    complete(options, urdf);
    options.validate(); // the number of joints is known only now
    impl_->options = std::move(options);
    const SpecPtr spec = make_spec(impl_->options, urdf, Looks::none, &impl_->warnings);
    impl_->mass = total_mass(spec.get());
    impl_->model = compile(spec.get(), urdf);
    impl_->index();
    impl_->place();
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const WorldOptions& World::options() const { return impl_->options; }
int World::joint_count() const { return impl_->n(); }
const std::vector<std::string>& World::joint_names() const { return impl_->options.joints; }
const std::string& World::base_link() const { return impl_->options.base_link; }
const Eigen::VectorXd& World::lower_limits() const { return impl_->lower_limits; }
const Eigen::VectorXd& World::upper_limits() const { return impl_->upper_limits; }
const Eigen::VectorXd& World::effort_limits() const { return impl_->effort_limits; }
const std::vector<std::string>& World::bodies() const { return impl_->bodies; }
double World::mass() const { return impl_->mass; }
const std::vector<std::string>& World::warnings() const { return impl_->warnings; }

} // namespace bf::physics

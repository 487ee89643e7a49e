#include "world_impl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>

namespace bf::physics {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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

void World::Impl::index() {
    const mjModel* m = model.get();
    robot.find(m, options);
    for (int body = 1; body < m->nbody; ++body) bodies.emplace_back(mj_id2name(m, mjOBJ_BODY, body));
    foot_of_geom.assign(static_cast<size_t>(m->ngeom), -1);
    for (size_t i = 0; i < options.feet.size(); ++i) {
        const std::string name = "foot:" + std::to_string(i);
        foot_sites.push_back(id_of(m, mjOBJ_SITE, name));
        for (int geom = 0; geom < m->ngeom; ++geom)
            if (const char* shape = mj_id2name(m, mjOBJ_GEOM, geom);
                shape && std::string_view(shape).starts_with(name + ":"))
                foot_of_geom[static_cast<size_t>(geom)] = static_cast<int>(i);
    }
}

void World::Impl::place() {
    const auto kinematics = [&](const DataPtr& data) {
        std::copy_n(start.data(), start.size(), data->qpos);
        mj_kinematics(model.get(), data.get());
    };
    start = Eigen::Map<const Eigen::VectorXd>(model->qpos0, model->nq);
    put_joints(robot, options, start.data());
    if (options.floating_base)
        std::copy_n(std::array{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}.data(), 7, start.data());

    // Move everything by X, so that the base, or the feet, come to lie where they should.
    DataPtr data = make_data(model.get());
    kinematics(data);
    const auto site = [&](int id) { return transform(data->site_xpos + 3 * id, data->site_xmat + 9 * id); };
    const Eigen::Matrix4d base = site(robot.base_site);
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
    impl_->model = compile(spec.get(), urdf.file);
    impl_->index();
    impl_->place();
    impl_->robot.drive(impl_->model.get(), impl_->options, impl_->options.motors, 0.0, impl_->start);
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const WorldOptions& World::options() const { return impl_->options; }
int World::joint_count() const { return impl_->n(); }
const std::vector<std::string>& World::joint_names() const { return impl_->options.joints; }
const std::string& World::base_link() const { return impl_->options.base_link; }
const Eigen::VectorXd& World::lower_limits() const { return impl_->robot.lower_limits; }
const Eigen::VectorXd& World::upper_limits() const { return impl_->robot.upper_limits; }
const Eigen::VectorXd& World::effort_limits() const { return impl_->robot.effort_limits; }
JointControl World::control() const { return impl_->robot.control(); }
const std::vector<std::string>& World::bodies() const { return impl_->bodies; }
double World::mass() const { return impl_->mass; }
const std::vector<std::string>& World::warnings() const { return impl_->warnings; }

} // namespace bf::physics

#include "bf/base/names.hpp"
#include "scene_impl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

namespace bf::physics {

namespace {

constexpr double longest_usual_step = 0.005; ///< s, of physics with contacts

[[noreturn]] void unknown_part(const std::string& owner, const char* kind, const std::string& name,
                               const std::vector<std::string>& names) {
    const auto nearest = nearest_first(name, names, 1);
    const bool near = !nearest.empty() && edit_distance(name, nearest[0]) <= 1 + name.size() / 3;
    throw std::runtime_error(owner + " has no " + kind + " '" + name + "'" +
                             (near ? "; did you mean '" + nearest[0] + "'?" : ";") +
                             " there are: " + (names.empty() ? "none" : name_list(names)));
}

template <class Items> int number_of_named(const Items& items, const std::string& name, const char* kind) {
    std::vector<std::string> names;
    for (const auto& item : items) {
        if (item.name == name) return static_cast<int>(names.size());
        names.push_back(item.name);
    }
    unknown_part("the world", kind, name, names);
}

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

[[noreturn]] void refuse(const SceneRobot& robot, const std::exception& error) {
    throw std::runtime_error(begin_of_message(robot.where) +
                             (robot.name.empty() ? "" : "robot '" + robot.name + "': ") + error.what());
}

void add_terrain(mjSpec* spec, const SceneOptions& options) {
    for (const SceneObject& object : options.objects) {
        const std::string begin = begin_of_message(object.where) + "object '" + object.name + "': ";
        if (object.mass)
            throw std::runtime_error(begin +
                                     "feet touch what is fixed to the world, and it has a mass; leave mass "
                                     "out, or use a World");
        if (mjs_findBody(spec, object.name.c_str()))
            throw std::runtime_error(begin +
                                     "a link, the world or an object before it has this name; rename it");
        add_object(spec, object);
    }
}

/// What stands before the names of a robot's parts.
std::string prefix_of(const SceneRobot& robot) { return robot.name.empty() ? "" : robot.name + "/"; }

} // namespace

void Scene::Impl::compile_all(mjSpec* spec, const std::filesystem::path& file) {
    try {
        model = compile(spec, file);
    } catch (const std::runtime_error&) {
        check_each_object(options);
        throw;
    }
}

void Scene::Impl::index() {
    const mjModel* m = model.get();
    for (int body = 1; body < m->nbody; ++body) bodies.emplace_back(mj_id2name(m, mjOBJ_BODY, body));
    for (const SceneRobot& robot : options.robots) {
        const std::string prefix = prefix_of(robot);
        RobotIndex& found = robots.emplace_back();
        try {
            found.find(m, robot.options, prefix);
        } catch (const std::exception& error) {
            refuse(robot, error);
        }
        if (prefix.empty()) continue; // it is all there is
        for (int body = 1; body < m->nbody; ++body)
            if (m->body_parentid[body] == 0 && bodies[static_cast<size_t>(body - 1)].starts_with(prefix))
                found.roots.push_back(body);
    }
    for (const SceneRobot& robot : options.robots) {
        auto& names = actuators.emplace_back();
        for (int i = 0; i < m->nu; ++i) {
            const char* name = mj_id2name(m, mjOBJ_ACTUATOR, i);
            const std::string prefix = prefix_of(robot);
            if (!name || !std::string_view(name).starts_with(prefix)) continue;
            const std::string own(name + prefix.size());
            if (own.starts_with(mark(""))) continue;
            names.push_back(own);
            controls.push_back(i);
        }
    }
    for (const SceneObject& object : options.objects) objects.push_back(id_of(m, mjOBJ_BODY, object.name));
}

void Scene::Impl::index_links(const std::vector<Attached>& all) {
    std::map<std::string, const Attached*> of_name;
    for (const Attached& body : all) of_name.emplace(body.name, &body);
    for (const Attached& link : all) {
        Frame frame;
        std::string at = link.name;
        while (!at.empty() && mj_name2id(model.get(), mjOBJ_BODY, at.c_str()) < 0) {
            const Attached& part = *of_name.at(at);
            frame.pose = part.pose * frame.pose;
            at = part.parent;
        }
        if (at.empty() || at == link.name) continue; // a body without a name can not be asked for
        frame.body = mj_name2id(model.get(), mjOBJ_BODY, at.c_str()) - 1; // the world is 0
        links.emplace(link.name, frame);
    }
}

void Scene::Impl::place() {
    mjModel* m = model.get();
    start = Eigen::Map<const Eigen::VectorXd>(m->qpos0, m->nq);
    for (size_t i = 0; i < robots.size(); ++i) {
        const std::string prefix = options.robots[i].name + "/";
        for (const auto& [joint, values] : starts[i].positions)
            if (const int id = mj_name2id(m, mjOBJ_JOINT, (prefix + joint).c_str()); id >= 0)
                std::copy(values.begin(), values.end(), start.data() + m->jnt_qposadr[id]);
        if (starts[i].is_mjcf && options.robots[i].options.initial_joints.empty()) continue;
        try {
            put_joints(robots[i], options.robots[i].options, start.data());
        } catch (const std::exception& error) {
            refuse(options.robots[i], error);
        }
    }
    const DataPtr data = make_data(m);
    std::copy_n(start.data(), start.size(), data->qpos);
    mj_kinematics(m, data.get());
    for (size_t i = 0; i < robots.size();
         ++i) {                          // moves each by X, so that its base comes to lie where it should
        if (starts[i].is_mjcf) continue; // its origin has been placed
        const int site = robots[i].base_site;
        const Eigen::Matrix4d X =
            options.robots[i].options.initial_w_H_b.value_or(Eigen::Matrix4d::Identity()) *
            inverse(transform(data->site_xpos + 3 * site, data->site_xmat + 9 * site));
        if ((X - Eigen::Matrix4d::Identity()).norm() < 1e-12) continue; // the root is the base
        const Eigen::Quaterniond q(Eigen::Matrix3d(X.topLeftCorner<3, 3>()));
        const mjtNum position[] = {X(0, 3), X(1, 3), X(2, 3)}, rotation[] = {q.w(), q.x(), q.y(), q.z()};
        for (const int body : robots[i].roots) {
            const int joint = m->body_jntadr[body];
            const bool floats = joint >= 0 && m->jnt_type[joint] == mjJNT_FREE;
            mjtNum* at = floats ? start.data() + m->jnt_qposadr[joint] : m->body_pos + 3 * body;
            mjtNum* turned = floats ? at + 3 : m->body_quat + 4 * body;
            mjtNum moved[7];
            mju_mulPose(moved, moved + 3, position, rotation, at, turned);
            std::copy_n(moved, 3, at);
            std::copy_n(moved + 3, 4, turned);
        }
    }
}

void Scene::Impl::stand() {
    const RobotIndex& robot = robots[0];
    const RobotOptions& own = options.robots[0].options;
    const auto kinematics = [&](const DataPtr& data) {
        std::copy_n(start.data(), start.size(), data->qpos);
        mj_kinematics(model.get(), data.get());
    };
    start = Eigen::Map<const Eigen::VectorXd>(model->qpos0, model->nq);
    put_joints(robot, own, start.data());
    if (own.floating_base) std::copy_n(std::array{0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0}.data(), 7, start.data());

    // Move everything by X, so that the base, or the feet, come to lie where they should.
    DataPtr data = make_data(model.get());
    kinematics(data);
    const auto site = [&](int id) { return transform(data->site_xpos + 3 * id, data->site_xmat + 9 * id); };
    const Eigen::Matrix4d base = site(robot.base_site);
    Eigen::Matrix4d X = own.initial_w_H_b.value_or(Eigen::Matrix4d::Identity()) * inverse(base);
    if (!own.initial_w_H_b && own.floating_base && !robot.foot_sites.empty()) {
        Eigen::Vector3d forward = Eigen::Vector3d::Zero();
        for (int id : robot.foot_sites) forward += X.topLeftCorner<3, 3>() * site(id).block<3, 1>(0, 0);
        Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
        turn.topLeftCorner<3, 3>() =
            Eigen::AngleAxisd(-std::atan2(forward.y(), forward.x()), Eigen::Vector3d::UnitZ())
                .toRotationMatrix();
        X = turn * X;
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (int id : robot.foot_sites) middle += (X * site(id)).topRightCorner<3, 1>();
        X.topRightCorner<2, 1>() -= middle.head<2>() / static_cast<double>(robot.foot_sites.size());
    }

    const Eigen::Quaterniond q(Eigen::Matrix3d(X.topLeftCorner<3, 3>()));
    const std::array<double, 7> pose{X(0, 3), X(1, 3), X(2, 3), q.w(), q.x(), q.y(), q.z()};
    if (!own.floating_base) {
        for (int body = 1; body < model->nbody; ++body) {
            if (model->body_parentid[body] != 0 ||
                std::find(objects.begin(), objects.end(), body) != objects.end())
                continue;
            mjtNum moved[7];
            mju_mulPose(moved, moved + 3, pose.data(), pose.data() + 3, model->body_pos + 3 * body,
                        model->body_quat + 4 * body);
            std::copy_n(moved, 3, model->body_pos + 3 * body);
            std::copy_n(moved + 3, 4, model->body_quat + 4 * body);
        }
        return;
    }
    std::copy_n(pose.data(), 7, start.data());
    if (own.initial_w_H_b || robot.foot_sites.empty()) return;
    kinematics(data);
    double lowest = std::numeric_limits<double>::infinity();
    for (int geom = 0; geom < model->ngeom; ++geom)
        if (robot.foot_of_geom[static_cast<size_t>(geom)] >= 0)
            lowest = std::min(lowest, lowest_point(*model, *data, geom));
    start[2] -= lowest + 0.05e-3;
}

void Scene::Impl::make_loops() {
    for (size_t r = 0; r < robots.size(); ++r) {
        const SceneRobot& robot = options.robots[r];
        try {
            robots[r].drive(model.get(), robot.options, robot.motors, robot.loop_period, start);
            const auto& joints = robot.options.joints;
            Gains& gains = robots[r].drives->position;
            for (size_t i = 0; i < joints.size() && robot.motors.position_gains.size() == 0; ++i)
                if (const auto found = starts[r].gains.find(joints[i]); found != starts[r].gains.end())
                    std::tie(gains.P[static_cast<Eigen::Index>(i)], gains.D[static_cast<Eigen::Index>(i)]) =
                        found->second;
            for (const std::string& line : robots[r].unstable_loops(model.get(), robot.options))
                loop_warnings.push_back(begin_of_message(robot.where) +
                                        (robot.name.empty() ? "" : "robot '" + robot.name + "': ") + line);
        } catch (const std::exception& error) {
            refuse(robot, error);
        }
    }
}

Scene::Scene(SceneOptions options) : impl_(std::make_unique<Impl>()) {
    silence_mujoco();
    impl_->options = std::move(options);
    const SpecPtr spec = make_scene(impl_->options, Looks::none, impl_->starts, impl_->warnings);
    const std::vector<Attached> attached = bodies_of(spec.get());
    impl_->compile_all(spec.get(), "the world");
    impl_->index();
    impl_->index_links(attached);
    impl_->place();
    impl_->make_loops();
    impl_->make_fingerprint();
}

Scene::Scene(const WorldOptions& options) : impl_(std::make_unique<Impl>()) {
    options.validate();
    silence_mujoco();
    static_cast<PhysicsOptions&>(impl_->options) = options;
    SceneRobot& robot = impl_->options.robots.emplace_back();
    robot.options = options;
    robot.motors = options.motors;
    const Urdf urdf = Urdf::read(options.urdf);
    complete(robot.options, urdf);
    robot.options.validate(); // the number of joints is known only now
    const SpecPtr spec = make_spec(robot.options, options, urdf, Looks::none, &impl_->warnings);
    if (options.time_step > longest_usual_step) {
        std::ostringstream line;
        line
            << "the world steps by " << options.time_step
            << " s, as its inputs do unless it has a period of its own; contacts and quick joints are coarse "
               "by more than "
            << longest_usual_step << " s: give it a shorter period";
        impl_->loop_warnings.push_back(line.str());
    }
    impl_->starts.resize(1);
    impl_->starts[0].mass = total_mass(spec.get());
    impl_->options.objects = options.terrain;
    add_terrain(spec.get(), impl_->options);
    const std::vector<Attached> attached = bodies_of(spec.get());
    impl_->compile_all(spec.get(), urdf.file);
    impl_->index();
    impl_->index_links(attached);
    impl_->stand();
    impl_->make_loops();
    impl_->make_fingerprint();
}

Scene::~Scene() = default;
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;

const SceneOptions& Scene::options() const { return impl_->options; }
int Scene::robot_count() const { return static_cast<int>(impl_->robots.size()); }
int Scene::object_count() const { return static_cast<int>(impl_->objects.size()); }
int Scene::robot(const std::string& name) const {
    return number_of_named(impl_->options.robots, name, "robot");
}
int Scene::object(const std::string& name) const {
    return number_of_named(impl_->options.objects, name, "object");
}
bool Scene::is_mjcf(int robot) const { return impl_->starts[static_cast<size_t>(robot)].is_mjcf; }
int Scene::body(const std::string& name) const {
    const auto found = std::find(impl_->bodies.begin(), impl_->bodies.end(), name);
    if (found == impl_->bodies.end()) unknown_part("the world", "body", name, impl_->bodies);
    return static_cast<int>(found - impl_->bodies.begin());
}
Frame Scene::frame(const std::string& name, const Eigen::MatrixXd& pose) const {
    if (!is_rigid(pose))
        throw std::runtime_error("argument 'pose' is no pose; give [R p; 0 0 0 1] with a rotation R");
    Frame frame;
    if (const auto link = impl_->links.find(name); link != impl_->links.end())
        frame = link->second;
    else if (const auto own = std::ranges::find(impl_->bodies, name); own != impl_->bodies.end())
        frame.body = static_cast<int>(own - impl_->bodies.begin());
    else if (!name.empty()) {
        std::vector<std::string> names = impl_->bodies;
        for (const auto& fixed : impl_->links) names.push_back(fixed.first);
        unknown_part("the world", "body", name, names);
    }
    frame.pose = frame.pose * pose;
    return frame;
}
int Scene::joint_count(int robot) const { return impl_->robot(robot).n(); }
const std::vector<std::string>& Scene::joint_names(int robot) const {
    return impl_->options.robots[static_cast<size_t>(robot)].options.joints;
}
bool Scene::is_prismatic(int robot, int joint) const {
    const mjModel* m = impl_->model.get();
    return m->jnt_type[m->dof_jntid[impl_->robot(robot).velocity[static_cast<size_t>(joint)]]] == mjJNT_SLIDE;
}
const Eigen::VectorXd& Scene::lower_limits(int robot) const { return impl_->robot(robot).lower_limits; }
const Eigen::VectorXd& Scene::upper_limits(int robot) const { return impl_->robot(robot).upper_limits; }
const Eigen::VectorXd& Scene::effort_limits(int robot) const { return impl_->robot(robot).effort_limits; }
const std::vector<std::string>& Scene::actuators(int robot) const {
    return impl_->actuators[static_cast<size_t>(robot)];
}
int Scene::actuator(int robot, const std::string& name) const {
    const std::string& owner = impl_->options.robots[static_cast<size_t>(robot)].name;
    const auto& names = actuators(robot);
    if (std::find(names.begin(), names.end(), name) == names.end())
        unknown_part("robot '" + owner + "'", "actuator", name, names);
    return id_of(impl_->model.get(), mjOBJ_ACTUATOR, owner + "/" + name);
}
double Scene::mass(int robot) const { return impl_->starts[static_cast<size_t>(robot)].mass; }
int Scene::position_count() const { return static_cast<int>(impl_->model->nq); }
std::vector<std::string> Scene::position_names() const {
    const mjModel* m = impl_->model.get();
    std::vector<std::string> names;
    const auto add = [&](const char* owner, std::initializer_list<const char*> parts) {
        for (const char* part : parts) names.push_back(std::string(owner) + part);
    };
    for (int joint = 0; joint < m->njnt; ++joint) {
        const char* body = mj_id2name(m, mjOBJ_BODY, m->jnt_bodyid[joint]);
        const char* name = mj_id2name(m, mjOBJ_JOINT, joint);
        const char* const own = name && *name ? name : body;
        if (m->jnt_type[joint] == mjJNT_FREE) add(body, {".x", ".y", ".z", ".qw", ".qx", ".qy", ".qz"});
        if (m->jnt_type[joint] == mjJNT_BALL) add(own, {".qw", ".qx", ".qy", ".qz"});
        if (m->jnt_type[joint] == mjJNT_HINGE || m->jnt_type[joint] == mjJNT_SLIDE) add(own, {""});
    }
    return names;
}
const std::vector<std::string>& Scene::bodies() const { return impl_->bodies; }
const std::vector<std::string>& Scene::warnings() const { return impl_->warnings; }
const std::vector<std::string>& Scene::loop_warnings() const { return impl_->loop_warnings; }

} // namespace bf::physics

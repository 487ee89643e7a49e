#include "scenery.hpp"
#include "bf/physics/figure.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "bf/toolbox/simulated_robot.hpp"
#include "robots.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>
#include <span>
#include <sstream>

namespace bf::tools {

namespace {

template <class T> void append(std::string& bytes, const std::vector<T>& values) {
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

std::string meshes_of(const physics::Figure& figure) {
    std::string bytes;
    for (int i = 0; i < figure.mesh_count(); ++i) {
        const physics::Mesh mesh = figure.mesh(i);
        append(bytes, std::vector{static_cast<std::uint32_t>(mesh.vertices.size() / 3),
                                  static_cast<std::uint32_t>(mesh.triangles.size() / 3)});
        append(bytes, mesh.vertices);
        append(bytes, mesh.normals);
        append(bytes, mesh.triangles);
    }
    return bytes;
}

std::vector<service::SceneShape> shapes_of(const physics::Figure& figure) {
    std::vector<service::SceneShape> shapes;
    for (const auto& shape : figure.shapes())
        shapes.push_back({static_cast<service::ShapeKind>(shape.kind),
                          shape.body,
                          shape.mesh,
                          {shape.pose.begin(), shape.pose.end()},
                          {shape.size.begin(), shape.size.end()},
                          {shape.colour.begin(), shape.colour.end()}});
    return shapes;
}

void write_poses(const physics::Figure& figure, std::vector<double>& values) {
    for (int body = 0; body < static_cast<int>(figure.bodies().size()); ++body) {
        const auto pose = figure.pose(body);
        values.insert(values.end(), pose.begin(), pose.end());
    }
}

void write_com(const physics::Figure& figure, std::vector<double>& values) {
    const Eigen::Vector3d com = figure.com();
    values.insert(values.end(), com.begin(), com.end());
}

const double* data_of(const Quantity& quantity) { return reinterpret_cast<const double*>(quantity.data); }

/// Null for what a recording lacks.
const double* data_if_known(const std::vector<Quantity>& signals, const std::string& path) {
    const auto found = std::ranges::find(signals, path, &Quantity::path);
    return found == signals.end() ? nullptr : data_of(*found);
}

void write_contact(const std::optional<physics::ContactForce>& contact, std::vector<double>& values) {
    const physics::ContactForce shown =
        contact.value_or(physics::ContactForce{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    values.insert(values.end(), shown.origin.begin(), shown.origin.end());
    values.insert(values.end(), shown.force.begin(), shown.force.end());
}

/// The positions that a signal holds, which a recording may have of another world.
Quantity positions(const std::vector<Quantity>& signals, const std::string& path, std::size_t count) {
    Quantity found = find(signals, path);
    if (found.info.elements() != count)
        throw std::runtime_error(path + " has " + std::to_string(found.info.elements()) +
                                 " elements, but the world has " + std::to_string(count) +
                                 " positions now; its files were changed");
    return found;
}

/// A world that several robots share.
class SharedScenery final : public service::Scenery {
  public:
    SharedScenery(const physics::Scene& scene, const std::string& path,
                  const std::vector<std::pair<std::string, const toolbox::ContactSensor*>>& sensors,
                  std::shared_ptr<physics::Figure> figure)
        : figure_(std::move(figure)), wrenches_(sensors.size()),
          position_count_(static_cast<std::size_t>(scene.position_count())) {
        // The scene lives as long as the diagram, which is longer than this function.
        const physics::SceneSimulation start(
            std::shared_ptr<const physics::Scene>(std::shared_ptr<void>(), &scene));
        world_.path = path;
        world_.bodies = figure_->bodies();
        world_.has_floor = scene.options().floor.enabled;
        for (const auto& [block, sensor] : sensors) {
            world_.feet.push_back(block);
            sensors_.push_back(sensor->frame());
        }
        world_.shapes = shapes_of(*figure_);
        write({start.q().data(), static_cast<std::size_t>(start.q().size())}, world_.start);
    }

    const service::SceneWorld& world() const override { return world_; }
    std::string meshes() const override { return meshes_of(*figure_); }
    void bind(const std::vector<Quantity>& signals) override {
        q_ = positions(signals, world_.path + ".q", position_count_);
        for (std::size_t i = 0; i < sensors_.size(); ++i)
            wrenches_[i] = data_if_known(signals, world_.feet[i] + ".wrench");
    }
    void look(std::vector<double>& values) noexcept override {
        write({reinterpret_cast<const double*>(q_.data), q_.info.elements()}, values);
    }

  private:
    void write(std::span<const double> q, std::vector<double>& values) {
        figure_->place(q);
        write_poses(*figure_, values);
        for (std::size_t i = 0; i < sensors_.size(); ++i) {
            const auto pose = figure_->pose(sensors_[i].body);
            const Eigen::Vector3d in_body = sensors_[i].pose.topRightCorner<3, 1>();
            const Eigen::Vector3d origin = Eigen::Map<const Eigen::Vector3d>(pose.data()) +
                                           Eigen::Quaterniond(pose[3], pose[4], pose[5], pose[6]) * in_body;
            write_contact(
                wrenches_[i] ? physics::axial_force(origin, Eigen::Map<const physics::Vector6d>(wrenches_[i]))
                             : std::nullopt,
                values);
        }
        write_com(*figure_, values);
    }

    const std::shared_ptr<physics::Figure> figure_;
    service::SceneWorld world_;
    std::vector<physics::Frame> sensors_; ///< of the contacts that are the world's `feet`
    std::vector<const double*> wrenches_; ///< of sensors; null: a recording lacks it
    const std::size_t position_count_;
    Quantity q_;
};

class RobotScenery final : public service::Scenery {
  public:
    RobotScenery(const physics::World& world, const std::string& path,
                 std::shared_ptr<physics::Figure> figure)
        : figure_(std::move(figure)), joint_count_(world.joint_names().size()) {
        // The world lives as long as the diagram, which is longer than this function.
        const physics::Simulation start(
            std::shared_ptr<const physics::World>(std::shared_ptr<void>(), &world));
        world_.path = path;
        world_.bodies = figure_->bodies();
        if (world_.bodies == world.bodies()) world_.disturbance = path + ".disturbance";
        for (const auto& foot : world.options().feet) world_.feet.push_back(foot.frame);
        world_.has_floor = world.options().floor.enabled;
        world_.shapes = shapes_of(*figure_);
        write(start.w_H_b(), {start.s().data(), static_cast<std::size_t>(start.s().size())}, world_.start);
        for (int i = 0; i < static_cast<int>(world_.feet.size()); ++i)
            write_contact(physics::contact_force(start.foot_pose(i), start.foot_wrench(i)), world_.start);
        world_.start.insert(world_.start.end(), start.com().begin(), start.com().end());
    }

    const service::SceneWorld& world() const override { return world_; }

    std::string meshes() const override { return meshes_of(*figure_); }

    void bind(const std::vector<Quantity>& signals) override {
        const auto known = [&](const std::string& name) {
            return data_if_known(signals, world_.path + "." + name);
        };
        base_ = data_of(find(signals, world_.path + ".w_H_b"));
        if (joint_count_ > 0) joints_ = positions(signals, world_.path + ".s", joint_count_);
        com_ = known("com");
        feet_.clear();
        for (const auto& foot : world_.feet)
            feet_.emplace_back(known("pose_" + foot), known("wrench_" + foot));
    }

    void look(std::vector<double>& values) noexcept override {
        write(Eigen::Map<const Eigen::Matrix4d>(base_),
              {reinterpret_cast<const double*>(joints_.data), joint_count_}, values);
        for (const auto& [pose, wrench] : feet_)
            write_contact(pose && wrench ? physics::contact_force(Eigen::Map<const Eigen::Matrix4d>(pose),
                                                                  Eigen::Map<const physics::Vector6d>(wrench))
                                         : std::nullopt,
                          values);
        if (com_)
            values.insert(values.end(), com_, com_ + 3);
        else
            write_com(*figure_, values);
    }

  private:
    void write(const Eigen::Matrix4d& w_H_b, std::span<const double> s, std::vector<double>& values) {
        figure_->place(w_H_b, s);
        write_poses(*figure_, values);
    }
    const std::shared_ptr<physics::Figure> figure_;
    service::SceneWorld world_;
    const std::size_t joint_count_;
    const double *base_ = nullptr, *com_ = nullptr;
    Quantity joints_;
    std::vector<std::pair<const double*, const double*>> feet_; ///< pose and wrench
};

/// All of a world that decides what its figure is.
std::string looks_of(const physics::World& world) {
    const auto& options = world.options();
    std::error_code error;
    std::ostringstream text;
    text << options.urdf.string() << '\n'
         << std::filesystem::last_write_time(options.urdf, error).time_since_epoch().count() << '\n'
         << options.base_link << options.floor.enabled;
    for (const auto& joint : options.joints) text << '\n' << joint;
    for (const auto& f : options.followers)
        text << '\n' << f.joint << ' ' << f.leader << ' ' << f.multiplier << ' ' << f.offset;
    for (const auto& path : options.package_paths) text << '\n' << path.string();
    for (const auto& sensor : options.ft_sensors) text << '\n' << sensor; // cuts a link in two bodies
    return text.str();
}

std::string looks_of(const physics::Scene& scene) {
    const auto& options = scene.options();
    std::error_code error;
    std::ostringstream text;
    const auto add = [&](const std::filesystem::path& file) {
        text << file.string() << ' '
             << std::filesystem::last_write_time(file, error).time_since_epoch().count() << '\n';
    };
    for (const auto& robot : options.robots) {
        add(robot.options.urdf);
        text << robot.name << ' ' << robot.body << ' ' << robot.options.floating_base;
        if (robot.options.initial_w_H_b) text << ' ' << *robot.options.initial_w_H_b;
        for (const auto& list : {robot.options.joints, robot.options.ft_sensors})
            for (const auto& name : list) text << ' ' << name;
        text << '\n';
    }
    for (const auto& object : options.objects) {
        add(object.file);
        text << object.name << ' ' << static_cast<int>(object.kind) << ' ' << object.count << ' '
             << object.size.transpose() << ' ' << object.w_H_o << ' ' << object.mass.has_value();
        for (const float part : object.colour) text << ' ' << part;
        text << '\n';
    }
    return text.str();
}

} // namespace

service::MakeSceneries scenery_maker() {
    // Figures of the last models; one is seen in one run at a time.
    auto known = std::make_shared<std::map<std::string, std::shared_ptr<physics::Figure>>>();
    return [known](const Diagram& diagram) {
        service::Sceneries all;
        std::map<std::string, std::shared_ptr<physics::Figure>> used;
        const auto figure_of = [&](const std::string& path, const auto& world) {
            const std::string key = path + '\n' + looks_of(world);
            const auto found = known->find(key);
            return used[key] =
                       found == known->end() ? std::make_shared<physics::Figure>(world) : found->second;
        };
        for (const auto& [path, world] : worlds_of(diagram))
            all.push_back(std::make_unique<RobotScenery>(*world, path, figure_of(path, *world)));
        for (const auto& [path, scene] : shared_worlds_of(diagram))
            all.push_back(std::make_unique<SharedScenery>(*scene, path, contact_sensors_of(diagram, *scene),
                                                          figure_of(path, *scene)));
        *known = std::move(used);
        return all;
    };
}

} // namespace bf::tools

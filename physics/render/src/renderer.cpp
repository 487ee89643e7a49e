#include "bf/physics/renderer.hpp"

#include "bf/physics/figure.hpp"
#include "canvas.hpp"
#include "scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace bf::physics {

namespace {

constexpr int max_geoms = 20000;
constexpr mjtRndFlag scenery[] = {mjRND_SHADOW, mjRND_SKYBOX, mjRND_HAZE};

/// Counterclockwise seen from above, by A. M. Andrew, Another efficient algorithm for convex hulls in two
/// dimensions, 1979.
std::vector<Eigen::Vector3d> convex_hull(std::vector<Eigen::Vector3d> points) {
    std::ranges::sort(points, {}, [](const Eigen::Vector3d& p) { return std::pair(p.x(), p.y()); });
    std::vector<Eigen::Vector3d> hull;
    const auto add = [&](const Eigen::Vector3d& p, size_t first) {
        const auto turns_left = [&] {
            const Eigen::Vector3d a = hull.back() - hull[hull.size() - 2], b = p - hull.back();
            return a.x() * b.y() - a.y() * b.x() > 0;
        };
        while (hull.size() >= first + 2 && !turns_left()) hull.pop_back();
        hull.push_back(p);
    };
    for (const auto& p : points) add(p, 0);
    const size_t below = hull.size();
    if (below < 2) return hull;
    for (size_t i = points.size() - 1; i-- > 0;) add(points[i], below - 1);
    hull.pop_back();
    return hull;
}

} // namespace

void RenderOptions::validate() const {
    std::ostringstream text;
    const auto require = [&](bool rule, const char* name, double value, const char* remedy) {
        if (!rule) text << "\n- " << name << " is " << value << "; " << remedy;
    };
    require(width > 0 && width <= 8192, "width", width, "it must be 1 to 8192 pixels");
    require(height > 0 && height <= 8192, "height", height, "it must be 1 to 8192 pixels");
    require(samples >= 0 && samples <= 64, "samples", samples, "it must be 0 to 64");
    require(!distance || *distance > 0.0, "distance", distance.value_or(0), "it must be positive (m)");
    require(metres_per_newton >= 0.0, "metres_per_newton", metres_per_newton, "it must not be negative");
    if (!text.str().empty()) throw std::invalid_argument("render options:" + text.str());
}

struct Renderer::Impl {
    /// The bodies of a robot, by their ids.
    struct Robot {
        std::vector<int> bodies;
        bool floats;
    };

    RenderOptions options;
    Puppet puppet;
    size_t positions; ///< how many place it
    std::vector<Robot> robots;
    std::optional<Frame> followed;
    Stage stage;
    std::vector<std::uint8_t> overlay;
    std::optional<Eigen::Vector3d> base;             ///< of a World's robot
    std::optional<Eigen::Vector3d> looked_at;        ///< where the camera looks
    Eigen::Vector3d shift = Eigen::Vector3d::Zero(); ///< of that from what is followed
    double distance = 0;

    template <class Made>
    Impl(const Made& made, const Scene& scene, const RenderOptions& wanted, size_t count)
        : options(wanted), puppet(made, [this](mjSpec* spec) { decorate(spec, options); }), positions(count),
          stage(puppet.model(), max_geoms, options.height < 900 ? mjFONTSCALE_100 : mjFONTSCALE_200) {
        if (!options.followed.empty()) followed = scene.frame(options.followed);
    }

    const char* name_of(int id) const { return mj_id2name(puppet.model(), mjOBJ_BODY, id); }

    /// A part of the model that begins with `prefix`.
    void add_robot(const std::string& prefix, bool floats) {
        Robot& robot = robots.emplace_back();
        robot.floats = floats;
        for (int id = 1; id < puppet.model()->nbody; ++id)
            if (std::string_view(name_of(id)).starts_with(prefix)) robot.bodies.push_back(id);
    }

    void require(size_t given) const {
        if (given != positions)
            throw std::invalid_argument("render got " + std::to_string(given) +
                                        " joint positions; the robot has " + std::to_string(positions));
    }

    Eigen::Vector3d position(const Frame& frame) const {
        const int id = frame.body + 1; // the world is 0
        const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(puppet.data()->xmat + 9 * id);
        return Eigen::Map<const Eigen::Vector3d>(puppet.data()->xpos + 3 * id) +
               R * frame.pose.topRightCorner<3, 1>();
    }

    /// The box around all that is seen of robots and of what moves.
    Eigen::AlignedBox3d extent() const {
        const mjModel* m = puppet.model();
        std::vector<bool> is_seen(static_cast<size_t>(m->nbody));
        for (int id = 1; id < m->nbody; ++id) is_seen[static_cast<size_t>(id)] = m->body_weldid[id] != 0;
        for (const Robot& robot : robots)
            for (const int id : robot.bodies) is_seen[static_cast<size_t>(id)] = true;
        Eigen::AlignedBox3d box;
        for (int geom = 0; geom < m->ngeom; ++geom) {
            if (!is_seen[static_cast<size_t>(m->geom_bodyid[geom])]) continue;
            const mjtNum* aabb = m->geom_aabb + 6 * geom;
            const Eigen::Map<const Eigen::Vector3d> at(puppet.data()->geom_xpos + 3 * geom), middle(aabb),
                half(aabb + 3);
            const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(puppet.data()->geom_xmat +
                                                                                   9 * geom);
            const Eigen::Vector3d centre = at + R * middle, reach = R.cwiseAbs() * half;
            box.extend(Eigen::Vector3d(centre - reach));
            box.extend(Eigen::Vector3d(centre + reach));
        }
        if (box.isEmpty()) box = {Eigen::Vector3d(-0.5, -0.5, 0), Eigen::Vector3d(0.5, 0.5, 1)};
        return box;
    }

    /// Where the camera looks from now on.
    void aim() {
        const std::optional<Eigen::Vector3d> target = followed ? std::optional(position(*followed)) : base;
        if (!looked_at) {
            const Eigen::AlignedBox3d box = extent();
            looked_at = target.value_or(box.center());
            if (!followed) looked_at->z() = box.center().z();
            if (options.look_at_height) looked_at->z() = *options.look_at_height;
            shift = *looked_at - target.value_or(*looked_at);
            Eigen::Vector3d farthest = Eigen::Vector3d::Zero();
            for (int axis = 0; axis < 3; ++axis)
                farthest[axis] =
                    std::max(box.max()[axis] - (*looked_at)[axis], (*looked_at)[axis] - box.min()[axis]);
            const double half_view = puppet.model()->vis.global.fovy / 2 * std::numbers::pi / 180,
                         aspect = static_cast<double>(options.width) / options.height;
            distance =
                options.distance.value_or(farthest.norm() / std::sin(half_view) / std::min(aspect, 1.0));
        }
        if (!target || !options.follows) return;
        looked_at->head<2>() = (*target + shift).head<2>();
        if (followed && !options.look_at_height) looked_at->z() = target->z();
    }
};

Renderer::Renderer(const World& world, RenderOptions options) {
    options.validate();
    impl_ = std::make_unique<Impl>(world, *world.scene(), options, world.joint_names().size());
    impl_->add_robot("", world.options().floating_base);
}

Renderer::Renderer(const Scene& scene, RenderOptions options) {
    options.validate();
    impl_ = std::make_unique<Impl>(scene, scene, options, static_cast<size_t>(scene.position_count()));
    const mjModel* m = impl_->puppet.model();
    for (const SceneRobot& robot : scene.options().robots) {
        const std::string prefix = robot.name + "/";
        bool floats = false;
        for (int joint = 0; joint < m->njnt; ++joint)
            floats |= m->jnt_type[joint] == mjJNT_FREE &&
                      std::string_view(impl_->name_of(m->jnt_bodyid[joint])).starts_with(prefix);
        impl_->add_robot(prefix, floats);
    }
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const RenderOptions& Renderer::options() const { return impl_->options; }
int Renderer::robot_count() const { return static_cast<int>(impl_->robots.size()); }
Eigen::Vector3d Renderer::position(const Frame& frame) const { return impl_->position(frame); }

void Renderer::place(const Eigen::Matrix4d& w_H_b, std::span<const double> s) {
    impl_->require(s.size());
    impl_->puppet.place(w_H_b, s);
    impl_->base = w_H_b.topRightCorner<3, 1>();
}

void Renderer::place(std::span<const double> q) {
    impl_->require(q.size());
    impl_->puppet.place(q);
}

Eigen::Vector3d Renderer::com(int robot) const {
    const mjModel* m = impl_->puppet.model();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double mass = 0;
    for (const int id : impl_->robots[static_cast<size_t>(robot)].bodies) {
        sum += m->body_mass[id] * Eigen::Map<const Eigen::Vector3d>(impl_->puppet.data()->xipos + 3 * id);
        mass += m->body_mass[id];
    }
    return mass > 0 ? Eigen::Vector3d(sum / mass) : sum;
}

std::vector<Eigen::Vector3d> Renderer::support(int robot) {
    const Impl::Robot& own = impl_->robots[static_cast<size_t>(robot)];
    if (!own.floats) return {};
    const mjModel* m = impl_->puppet.model();
    mjData* data = impl_->puppet.data();
    mj_collision(m, data);
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < data->ncon; ++i) {
        const mjContact& contact = data->contact[i];
        const int a = m->geom_bodyid[contact.geom[0]], b = m->geom_bodyid[contact.geom[1]];
        const auto is_own = [&](int id) { return std::ranges::find(own.bodies, id) != own.bodies.end(); };
        const auto stands = [&](int id) { return m->body_weldid[id] == 0 && !is_own(id); };
        if ((is_own(a) && stands(b)) || (is_own(b) && stands(a)))
            points.emplace_back(contact.pos[0], contact.pos[1], contact.pos[2]);
    }
    return convex_hull(std::move(points));
}

void Renderer::draw(const Marks& marks, Image& image) {
    Impl& self = *impl_;
    const mjModel* model = self.puppet.model();
    mjData* data = self.puppet.data();
    mj_camlight(model, data);
    self.aim();

    mjvOption option;
    mjv_defaultOption(&option);
    mjvCamera camera;
    mjv_defaultFreeCamera(model, &camera);
    camera.azimuth = self.options.azimuth;
    camera.elevation = self.options.elevation;
    camera.distance = self.distance;
    std::copy_n(self.looked_at->data(), 3, camera.lookat);
    mjvScene& scene = self.stage.scene;
    self.stage.update(model, data, option, camera);
    self.stage.light_around((*self.looked_at)[0], (*self.looked_at)[1]);
    for (const Line& line : marks.lines)
        if (line.kind == Line::Kind::trail) add_line(scene, line);
    const int first_shining = scene.ngeom;
    for (const Line& line : marks.lines)
        if (line.kind == Line::Kind::outline) add_line(scene, line);
    for (const Arrow& arrow : marks.arrows) add_arrow(scene, arrow);
    for (const Eigen::Vector3d& centre : marks.centres) add_centre(scene, centre);

    const size_t row = 3 * static_cast<size_t>(self.options.width);
    image.width = self.options.width;
    image.height = self.options.height;
    image.pixels.resize(row * static_cast<size_t>(image.height));
    const mjrRect whole{0, 0, image.width, image.height};
    const Drawing active(self.stage.canvas);
    for (mjtRndFlag flag : scenery) scene.flags[flag] = 1;
    self.stage.draw(whole, image.pixels.data(), nullptr, marks.caption);
    if (scene.ngeom > first_shining) {
        std::copy(scene.geoms + first_shining, scene.geoms + scene.ngeom, scene.geoms);
        scene.ngeom -= first_shining;
        for (mjtRndFlag flag : scenery) scene.flags[flag] = 0;
        self.overlay.resize(image.pixels.size());
        self.stage.draw(whole, self.overlay.data(), nullptr); // what shines alone, on black
        for (size_t i = 0; i < image.pixels.size(); i += 3) {
            const std::uint8_t* shine = &self.overlay[i];
            if (std::max({shine[0], shine[1], shine[2]}) < 60) continue;
            for (size_t c = 0; c < 3; ++c)
                image.pixels[i + c] = static_cast<std::uint8_t>((2 * image.pixels[i + c] + 3 * shine[c]) / 5);
        }
    }
    for (int top = 0, bottom = image.height - 1; top < bottom;
         ++top, --bottom) { // OpenGL starts at the bottom
        const auto line = [&](int y) { return image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * y; };
        std::swap_ranges(line(top), line(top + 1), line(bottom));
    }
}

void Renderer::render(const Eigen::Matrix4d& w_H_b, std::span<const double> s, std::span<const Arrow> arrows,
                      Image& image) {
    place(w_H_b, s);
    draw({.arrows = {arrows.begin(), arrows.end()}}, image);
}

void Renderer::render(const Simulation& simulation, Image& image) {
    const auto s = simulation.s();
    const std::vector<Arrow> arrows = force_arrows(simulation);
    render(Eigen::Matrix4d(simulation.w_H_b()), {s.data(), static_cast<size_t>(s.size())}, arrows, image);
}

std::vector<Arrow> Renderer::force_arrows(const Simulation& simulation) const {
    std::vector<Arrow> arrows;
    const int feet = static_cast<int>(simulation.world().options().feet.size());
    for (int i = 0; i < feet; ++i) {
        if (const auto contact = contact_force(simulation.foot_pose(i), simulation.foot_wrench(i)))
            arrows.push_back(
                {contact->origin, impl_->options.metres_per_newton * contact->force, Arrow::Kind::contact});
    }
    return arrows;
}

} // namespace bf::physics

#include "bf/physics/renderer.hpp"

#include "bf/physics/figure.hpp"
#include "canvas.hpp"
#include "scene.hpp"

#include <algorithm>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace bf::physics {

namespace {

constexpr int max_geoms = 2000;
constexpr mjtRndFlag scenery[] = {mjRND_SHADOW, mjRND_SKYBOX, mjRND_HAZE};

} // namespace

void RenderOptions::validate() const {
    std::ostringstream text;
    const auto require = [&](bool rule, const char* name, double value, const char* remedy) {
        if (!rule) text << "\n- " << name << " is " << value << "; " << remedy;
    };
    require(width > 0 && width <= 8192, "width", width, "it must be 1 to 8192 pixels");
    require(height > 0 && height <= 8192, "height", height, "it must be 1 to 8192 pixels");
    require(samples >= 0 && samples <= 64, "samples", samples, "it must be 0 to 64");
    require(distance > 0.0, "distance", distance, "it must be positive (m)");
    require(metres_per_newton >= 0.0, "metres_per_newton", metres_per_newton, "it must not be negative");
    if (!text.str().empty()) throw std::invalid_argument("render options:" + text.str());
}

struct Renderer::Impl {
    RenderOptions options;
    Puppet puppet;
    Stage stage;
    std::vector<std::uint8_t> overlay;
    std::optional<Eigen::Vector2d> looked_at; ///< x and y of the point that the camera looks at

    Impl(const World& world, const RenderOptions& wanted)
        : options(wanted), puppet(world, [this](mjSpec* spec) { decorate(spec, options); }),
          stage(puppet.model(), max_geoms) {}
};

Renderer::Renderer(const World& world, RenderOptions options) {
    options.validate();
    impl_ = std::make_unique<Impl>(world, options);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const RenderOptions& Renderer::options() const { return impl_->options; }

void Renderer::render(const Eigen::Matrix4d& w_H_b, std::span<const double> s, std::span<const Arrow> arrows,
                      Image& image) {
    Impl& self = *impl_;
    if (static_cast<int>(s.size()) != self.puppet.joint_count())
        throw std::invalid_argument("render got " + std::to_string(s.size()) +
                                    " joint positions; the robot has " +
                                    std::to_string(self.puppet.joint_count()));
    self.puppet.place(w_H_b, s);
    const mjModel* model = self.puppet.model();
    mjData* data = self.puppet.data();
    mj_comPos(model, data);
    mj_camlight(model, data);

    mjvOption option;
    mjv_defaultOption(&option);
    mjvCamera camera;
    mjv_defaultFreeCamera(model, &camera);
    camera.azimuth = self.options.azimuth;
    camera.elevation = self.options.elevation;
    camera.distance = self.options.distance;
    if (self.options.follows || !self.looked_at)
        self.looked_at = Eigen::Vector2d(w_H_b.topRightCorner<2, 1>());
    std::copy_n(self.looked_at->data(), 2, camera.lookat);
    camera.lookat[2] = self.options.look_at_height;
    mjvScene& scene = self.stage.scene;
    mjv_updateScene(model, data, &option, nullptr, &camera, mjCAT_ALL, &scene);
    self.stage.light_around((*self.looked_at)[0], (*self.looked_at)[1]);
    const int first_arrow = scene.ngeom;
    for (const Arrow& arrow : arrows) add_arrow(scene, arrow);

    const size_t row = 3 * static_cast<size_t>(self.options.width);
    image.width = self.options.width;
    image.height = self.options.height;
    image.pixels.resize(row * static_cast<size_t>(image.height));
    const mjrRect whole{0, 0, image.width, image.height};
    const Drawing active(self.stage.canvas);
    for (mjtRndFlag flag : scenery) scene.flags[flag] = 1;
    self.stage.draw(whole, image.pixels.data(), nullptr);
    if (scene.ngeom > first_arrow) {
        std::copy(scene.geoms + first_arrow, scene.geoms + scene.ngeom, scene.geoms);
        scene.ngeom -= first_arrow;
        for (mjtRndFlag flag : scenery) scene.flags[flag] = 0;
        self.overlay.resize(image.pixels.size());
        self.stage.draw(whole, self.overlay.data(), nullptr); // the arrows alone, on black
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

#include "bf/physics/camera.hpp"

#include "bf/physics/renderer.hpp"
#include "canvas.hpp"
#include "noise.hpp"
#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

namespace bf::physics {

namespace {

constexpr const char* camera_name = "bf:camera";

/// The light and the sky of films, and a camera that stands where it is put.
void add_camera(mjSpec* spec, const CameraOptions& options) {
    RenderOptions looks;
    looks.width = options.width;
    looks.height = options.height;
    looks.samples = 0; // a mean of two depths, or of two numbers of bodies, is neither
    decorate(spec, looks);
    spec->visual.quality.shadowsize = 1024;
    mjsCamera* camera = mjs_addCamera(mjs_findBody(spec, "world"), nullptr);
    mjs_setName(camera->element, camera_name);
    camera->fovy = options.field_of_view * 180.0 / std::numbers::pi;
}

} // namespace

void CameraOptions::validate() const {
    std::ostringstream text;
    const auto require = [&](bool rule, const char* name, double value, const char* remedy) {
        if (!rule) text << "\n- " << name << " is " << value << "; " << remedy;
    };
    require(width > 0 && width <= 8192, "width", width, "it must be 1 to 8192 pixels");
    require(height > 0 && height <= 8192, "height", height, "it must be 1 to 8192 pixels");
    // A picture takes time that nothing interrupts.
    require(static_cast<double>(width) * height <= 9e6, "width times height", 1.0 * width * height,
            "it must be at most 9e6 pixels, of which 3840 x 2160 are 8.3e6");
    require(field_of_view > 0.0 && field_of_view < 3.0, "field_of_view", field_of_view,
            "it must be above 0 and below 3 rad");
    require(range > 0.0 && std::isfinite(range), "range", range, "it must be positive (m)");
    for (const double part : noise)
        require(part >= 0.0 && std::isfinite(part), "noise", part, "it must not be negative");
    if (!text.str().empty()) throw std::invalid_argument("camera options:" + text.str());
}

struct Camera::Impl {
    CameraOptions options;
    Puppet puppet;
    Stage stage;
    mjvOption visible;
    mjvCamera camera;
    std::vector<unsigned char> pixels, numbers; ///< rows from bottom to top
    std::vector<float> depths;
    std::vector<std::int32_t> body_of; ///< per number of a geom in the scene

    Impl(const Scene& scene, const CameraOptions& wanted)
        : options(wanted), puppet(scene, [this](mjSpec* spec) { add_camera(spec, options); }),
          stage(puppet.model(), 100 + 2 * puppet.model()->ngeom),
          pixels(3 * static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height)),
          numbers(pixels.size()), depths(pixels.size() / 3),
          body_of(static_cast<std::size_t>(stage.scene.maxgeom) + 2) {
        mjv_defaultOption(&visible);
        mjv_defaultCamera(&camera);
        camera.type = mjCAMERA_FIXED;
        camera.fixedcamid = id_of(puppet.model(), mjOBJ_CAMERA, camera_name);
    }

    mjrRect whole() const { return {0, 0, options.width, options.height}; }
    /// Place of a pixel among those that OpenGL gives.
    std::size_t at(Eigen::Index row, Eigen::Index column) const {
        return static_cast<std::size_t>((options.height - 1 - row) * options.width + column);
    }
};

Camera::Camera(const Scene& scene, const CameraOptions& options) {
    options.validate();
    impl_ = std::make_unique<Impl>(scene, options);
}
Camera::~Camera() = default;
Camera::Camera(Camera&&) noexcept = default;
Camera& Camera::operator=(Camera&&) noexcept = default;

bool Camera::look(std::span<const double> q, const Eigen::Matrix4d& w_H_camera) noexcept {
    Impl& self = *impl_;
    self.puppet.place(q);
    const mjModel* model = self.puppet.model();
    mjData* data = self.puppet.data();
    mj_camlight(model, data);
    // MuJoCo's cameras look along -z, with y up.
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = w_H_camera.topLeftCorner<3, 3>();
    R.rightCols<2>() *= -1.0;
    std::copy_n(w_H_camera.col(3).data(), 3, data->cam_xpos + 3 * self.camera.fixedcamid);
    std::copy_n(R.data(), 9, data->cam_xmat + 9 * self.camera.fixedcamid);
    self.stage.update(model, data, self.visible, self.camera);
    self.stage.light_around(w_H_camera(0, 3), w_H_camera(1, 3));
    if (!self.stage.canvas.bind()) return false;
    mjvScene& scene = self.stage.scene;
    const CameraOptions& options = self.options;
    if (options.has_colour || options.has_depth)
        self.stage.draw(self.whole(), options.has_colour ? self.pixels.data() : nullptr,
                        options.has_depth ? self.depths.data() : nullptr);
    if (options.has_segmentation) {
        scene.flags[mjRND_SEGMENT] = scene.flags[mjRND_IDCOLOR] = 1;
        self.stage.draw(self.whole(), self.numbers.data(), nullptr);
        scene.flags[mjRND_SEGMENT] = scene.flags[mjRND_IDCOLOR] = 0;
    }
    self.stage.canvas.release();
    std::fill(self.body_of.begin(), self.body_of.end(), -1);
    for (int i = 0; i < scene.ngeom; ++i) { // a colour is the number of a geom, counted from 1
        const mjvGeom& geom = scene.geoms[i];
        if (geom.segid >= 0 && geom.objtype == mjOBJ_GEOM)
            self.body_of[static_cast<std::size_t>(geom.segid) + 1] = model->geom_bodyid[geom.objid];
    }
    return true;
}

void Camera::colour(Colours picture) const noexcept {
    const Impl& self = *impl_;
    const Eigen::Index width = self.options.width;
    for (Eigen::Index column = 0; column < width; ++column) {
        const unsigned char* pixel = &self.pixels[3 * self.at(0, column)];
        std::uint8_t* planes[] = {&picture(0, column), &picture(0, width + column),
                                  &picture(0, 2 * width + column)};
        for (Eigen::Index row = 0; row < picture.rows(); ++row, pixel -= 3 * width)
            for (const int part : {0, 1, 2}) planes[part][row] = pixel[part];
    }
}

void Camera::depth(Eigen::Ref<Eigen::MatrixXd> picture, std::uint64_t picture_number) const noexcept {
    const Impl& self = *impl_;
    const double extent = self.puppet.model()->stat.extent;
    const double nearest = self.puppet.model()->vis.map.znear * extent;
    const double farthest = self.puppet.model()->vis.map.zfar * extent;
    const double range = self.options.range;
    const Eigen::Vector2d& noise = self.options.noise;
    for (Eigen::Index column = 0; column < picture.cols(); ++column)
        for (Eigen::Index row = 0; row < picture.rows(); ++row) {
            // What OpenGL keeps is linear in 1/z: 0 at the nearest, 1 at the farthest plane.
            const double kept = self.depths[self.at(row, column)];
            double z = nearest / (1.0 - kept * (1.0 - nearest / farthest));
            if (z < range && !noise.isZero(0.0))
                z += (noise[0] + noise[1] * z * z) *
                     gaussian(self.options.seed, picture_number, self.at(row, column));
            picture(row, column) = std::clamp(z, 0.0, range);
        }
}

void Camera::segmentation(Bodies picture) const noexcept {
    const Impl& self = *impl_;
    for (Eigen::Index column = 0; column < picture.cols(); ++column)
        for (Eigen::Index row = 0; row < picture.rows(); ++row) {
            const unsigned char* pixel = &self.numbers[3 * self.at(row, column)];
            const std::size_t number = static_cast<std::size_t>(pixel[0] | pixel[1] << 8 | pixel[2] << 16);
            picture(row, column) = number < self.body_of.size() ? self.body_of[number] : -1;
        }
}

} // namespace bf::physics

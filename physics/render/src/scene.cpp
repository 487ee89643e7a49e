#include "scene.hpp"

#include <algorithm>
#include <array>

namespace bf::physics {

namespace {

void set(auto& out, std::initializer_list<double> values) { std::copy(values.begin(), values.end(), out); }

mjsTexture* add_texture(mjSpec* spec, const char* name, mjtTexture type, mjtBuiltin pattern,
                        std::initializer_list<double> rgb1, std::initializer_list<double> rgb2, int size) {
    mjsTexture* texture = mjs_addTexture(spec, nullptr);
    mjs_setName(texture->element, name);
    texture->type = type;
    texture->builtin = pattern;
    set(texture->rgb1, rgb1);
    set(texture->rgb2, rgb2);
    texture->width = size;
    texture->height = type == mjTEXTURE_SKYBOX ? 6 * size : size;
    return texture;
}

mjsMaterial* add_floor_material(mjSpec* spec) {
    mjsTexture* checker = add_texture(spec, "checker", mjTEXTURE_2D, mjBUILTIN_CHECKER, {0.80, 0.83, 0.86},
                                      {0.68, 0.72, 0.77}, 512);
    checker->mark = mjMARK_EDGE;
    set(checker->markrgb, {0.90, 0.92, 0.94});
    mjsMaterial* material = mjs_addMaterial(spec, nullptr);
    mjs_setName(material->element, "checker");
    mjs_setInStringVec(material->textures, mjTEXROLE_RGB, "checker");
    set(material->texrepeat, {2.0, 2.0}); // squares of 0.25 m
    material->texuniform = 1;
    material->specular = 0.2F;
    return material;
}

void add_lamp(mjSpec* spec, std::initializer_list<double> from, double brightness, bool casts_shadow) {
    mjsLight* lamp = mjs_addLight(mjs_findBody(spec, "world"), nullptr);
    lamp->type = mjLIGHT_DIRECTIONAL;
    lamp->castshadow = casts_shadow;
    set(lamp->pos, from);
    std::transform(from.begin(), from.end(), lamp->dir, std::negate<>{});
    set(lamp->diffuse, {brightness, brightness, brightness});
    set(lamp->specular, {0.25, 0.25, 0.25});
    set(lamp->ambient, {0.0, 0.0, 0.0});
}

} // namespace

void decorate(mjSpec* spec, const RenderOptions& options) {
    spec->visual.global.offwidth = options.width;
    spec->visual.global.offheight = options.height;
    spec->visual.global.fovy = 32.0F;
    spec->visual.quality.offsamples = options.samples;
    spec->visual.quality.shadowsize = 4096;
    spec->visual.map.znear = 0.02F;
    spec->visual.map.zfar = 60.0F;
    spec->visual.map.haze = 0.35F;
    spec->visual.map.shadowclip = 1.6F;
    set(spec->visual.headlight.ambient, {0.32, 0.33, 0.35});
    set(spec->visual.headlight.diffuse, {0.22, 0.22, 0.22});
    set(spec->visual.headlight.specular, {0.05, 0.05, 0.05});
    set(spec->visual.rgba.haze, {0.90, 0.94, 0.98, 1.0});
    spec->stat.extent = 1.2; // fixes the scale of lengths below whatever the robot's size
    set(spec->stat.center, {0.0, 0.0, 0.5});

    add_texture(spec, "sky", mjTEXTURE_SKYBOX, mjBUILTIN_GRADIENT, {0.62, 0.76, 0.92}, {0.93, 0.96, 0.99},
                256);
    add_lamp(spec, {1.2, 1.0, 3.4}, 0.55, true);
    add_lamp(spec, {-1.5, -2.0, 2.0}, 0.18, false);
    if (mjsElement* floor = mjs_findElement(spec, mjOBJ_GEOM, "floor")) {
        add_floor_material(spec);
        mjs_setString(mjs_asGeom(floor)->material, "checker");
    }
}

namespace {

using Colour = std::array<float, 4>; ///< red, green, blue, opacity

/// A shape of its own colour, which shines a little; null: the scene is full.
mjvGeom* add_shape(mjvScene& scene, mjtGeom kind, const Colour& colour) {
    if (scene.ngeom >= scene.maxgeom) return nullptr;
    mjvGeom& geom = scene.geoms[scene.ngeom++];
    mjv_initGeom(&geom, kind, nullptr, nullptr, nullptr, colour.data());
    geom.emission = 0.3F;
    return &geom;
}

} // namespace

void add_arrow(mjvScene& scene, const Arrow& arrow) {
    if (arrow.vector.norm() < 1e-3) return;
    const Colour contact{0.10F, 0.65F, 0.35F, 1.0F}, push{0.90F, 0.30F, 0.15F, 1.0F};
    const Eigen::Vector3d tip =
        arrow.origin + 2.0 * arrow.vector; // MuJoCo draws arrows half as long as it is told
    if (mjvGeom* geom = add_shape(scene, mjGEOM_ARROW, arrow.kind == Arrow::Kind::contact ? contact : push))
        mjv_connector(geom, mjGEOM_ARROW, 0.014, arrow.origin.data(), tip.data());
}

void add_line(mjvScene& scene, const Line& line) {
    constexpr std::array<Colour, 6> trails{Colour{0.11F, 0.37F, 0.85F, 1}, Colour{0.85F, 0.37F, 0.05F, 1},
                                           Colour{0.55F, 0.20F, 0.65F, 1}, Colour{0.05F, 0.55F, 0.55F, 1},
                                           Colour{0.75F, 0.10F, 0.35F, 1}, Colour{0.35F, 0.45F, 0.10F, 1}};
    constexpr Colour outline{0.10F, 0.45F, 0.90F, 1};
    const bool is_trail = line.kind == Line::Kind::trail;
    const Colour& colour = is_trail ? trails[static_cast<size_t>(line.number) % trails.size()] : outline;
    for (size_t i = 1; i < line.points.size(); ++i)
        if (mjvGeom* geom = add_shape(scene, mjGEOM_CAPSULE, colour))
            mjv_connector(geom, mjGEOM_CAPSULE, is_trail ? 0.004 : 0.005, line.points[i - 1].data(),
                          line.points[i].data());
}

void add_centre(mjvScene& scene, const Eigen::Vector3d& centre) {
    constexpr Colour yellow{0.90F, 0.68F, 0.02F, 1};
    for (const bool is_shadow : {false, true})
        if (mjvGeom* geom = add_shape(scene, is_shadow ? mjGEOM_ELLIPSOID : mjGEOM_SPHERE, yellow)) {
            const std::array<mjtNum, 3> size{0.022, 0.022, is_shadow ? 0.002 : 0.022};
            const std::array<mjtNum, 3> at{centre.x(), centre.y(), is_shadow ? 0.002 : centre.z()};
            mjv_initGeom(geom, geom->type, size.data(), at.data(), nullptr, yellow.data());
            geom->emission = 0.3F;
        }
}

} // namespace bf::physics

// What pages are told of what stands in space.
#pragma once

#include <string>
#include <vector>

namespace bf::service {

enum class ShapeKind { mesh, sphere, box, cylinder, capsule, ellipsoid };

/// A visible part of a body.
struct SceneShape {
    ShapeKind kind = ShapeKind::mesh;
    int body = 0, mesh = -1;    ///< numbers in the lists of the world
    std::vector<double> pose;   ///< in the body: x y z [m] qw qx qy qz
    std::vector<double> size;   ///< radius; half-sizes; radius and half-length along z; half-axes [m]
    std::vector<double> colour; ///< red, green, blue, opacity, 0 to 1
};
struct SceneWorld {
    std::string path;                ///< of the block
    std::vector<std::string> bodies; ///< names of their links
    std::vector<SceneShape> shapes;
    std::vector<std::string> feet;
    bool has_floor = true;
    std::vector<double> start;    ///< values of a binary frame before the first step
    std::string disturbance = {}; ///< parameter with a body's number (from 1), a point in it and a force
};
/// Of the run, or of the model where nothing runs.
struct Scene {
    int number = 0; ///< counts scenes
    std::vector<SceneWorld> worlds = {};
    std::string failure = {}; ///< why there are none
};

} // namespace bf::service

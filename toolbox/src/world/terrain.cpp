#include "world/terrain.hpp"

#include "bf/physics/scene_options.hpp"

#include <stdexcept>

namespace bf::toolbox {

std::vector<physics::SceneObject> read_terrain(const std::string& file) {
    auto scene = physics::SceneOptions::read(file);
    if (!scene.robots.empty())
        throw std::runtime_error(scene.robots[0].where + ": robot '" + scene.robots[0].name +
                                 "' is no terrain; take it out, or use a World");
    return std::move(scene.objects);
}

Matrix read_boxes(const std::string& file) {
    using Kind = physics::SceneObject::Kind;
    std::vector<Eigen::Matrix<double, 6, 1>> boxes;
    for (const auto& object : read_terrain(file)) {
        const auto R = object.w_H_o.topLeftCorner<3, 3>();
        const Eigen::Matrix3d turned = R.cwiseAbs();
        const bool is_parallel = (turned - turned.array().round().matrix()).cwiseAbs().maxCoeff() < 1e-6;
        if (object.mass || !is_parallel || (object.kind != Kind::box && object.kind != Kind::steps))
            throw std::runtime_error(object.where + ": object '" + object.name +
                                     "' is no ground for level soles; give boxes and steps that are fixed "
                                     "and parallel to the axes of the world");
        const auto add = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& edges) {
            boxes.emplace_back();
            boxes.back() << object.w_H_o.topRightCorner<3, 1>() + R * centre, turned * edges / 2;
        };
        const Eigen::Vector3d& size = object.size;
        if (object.kind == Kind::box) add(Eigen::Vector3d::Zero(), size);
        for (int i = 0; object.kind == Kind::steps && i < object.count; ++i) {
            const double height = (i + 1) * size[2];
            add({(i + 0.5) * size[0], 0, height / 2}, {size[0], size[1], height});
        }
    }
    Matrix rows(static_cast<Eigen::Index>(boxes.size()), 6);
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
        rows.row(i) = boxes[static_cast<std::size_t>(i)].transpose();
    return rows;
}

} // namespace bf::toolbox

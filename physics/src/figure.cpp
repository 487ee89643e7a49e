#include "bf/physics/figure.hpp"
#include "puppet.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace bf::physics {

namespace {

constexpr int first_hidden_group = 3; // shapes of contacts

Shape shape_of(const mjModel& m, int geom) {
    static const std::map<int, Shape::Kind> kinds = {
        {mjGEOM_MESH, Shape::Kind::mesh},       {mjGEOM_SPHERE, Shape::Kind::sphere},
        {mjGEOM_BOX, Shape::Kind::box},         {mjGEOM_CYLINDER, Shape::Kind::cylinder},
        {mjGEOM_CAPSULE, Shape::Kind::capsule}, {mjGEOM_ELLIPSOID, Shape::Kind::ellipsoid}};
    Shape shape;
    shape.kind = kinds.at(m.geom_type[geom]);
    shape.body = m.geom_bodyid[geom] - 1;
    shape.mesh = shape.kind == Shape::Kind::mesh ? m.geom_dataid[geom] : -1;
    std::copy_n(m.geom_pos + 3 * geom, 3, shape.pose.begin());
    std::copy_n(m.geom_quat + 4 * geom, 4, shape.pose.begin() + 3);
    std::copy_n(m.geom_size + 3 * geom, 3, shape.size.begin());
    const int material = m.geom_matid[geom];
    std::copy_n(material < 0 ? m.geom_rgba + 4 * geom : m.mat_rgba + 4 * material, 4, shape.colour.begin());
    return shape;
}

} // namespace

std::optional<ContactForce> contact_force(const Eigen::Matrix4d& w_H_foot, const Vector6d& wrench) {
    const auto R = w_H_foot.topLeftCorner<3, 3>();
    const Eigen::Vector3d force = R.transpose() * wrench.head<3>(), moment = R.transpose() * wrench.tail<3>();
    if (!(force.z() >= 1)) return {};
    const Eigen::Vector3d pressure(-moment.y() / force.z(), moment.x() / force.z(), 0);
    return ContactForce{w_H_foot.topRightCorner<3, 1>() + R * pressure, wrench.head<3>()};
}

struct Figure::Impl {
    Puppet puppet;
    std::vector<std::string> bodies;
    std::vector<Shape> shapes;

    explicit Impl(const World& world) : puppet(world) {
        const mjModel& m = *puppet.model();
        for (int body = 1; body < m.nbody; ++body) bodies.emplace_back(mj_id2name(&m, mjOBJ_BODY, body));
        for (int geom = 0; geom < m.ngeom; ++geom)
            if (m.geom_bodyid[geom] > 0 && m.geom_group[geom] < first_hidden_group &&
                m.geom_type[geom] != mjGEOM_PLANE)
                shapes.push_back(shape_of(m, geom));
    }
};

Figure::Figure(const World& world) : impl_(std::make_unique<Impl>(world)) {}
Figure::~Figure() = default;
Figure::Figure(Figure&&) noexcept = default;
Figure& Figure::operator=(Figure&&) noexcept = default;

const std::vector<std::string>& Figure::bodies() const { return impl_->bodies; }
const std::vector<Shape>& Figure::shapes() const { return impl_->shapes; }
int Figure::mesh_count() const { return impl_->puppet.model()->nmesh; }

Mesh Figure::mesh(int number) const {
    // MuJoCo counts positions and normals apart; a vertex of ours is a pair that some triangle has.
    const mjModel& m = *impl_->puppet.model();
    const float* positions = m.mesh_vert + 3 * m.mesh_vertadr[number];
    const float* normals = m.mesh_normal + 3 * m.mesh_normaladr[number];
    const int first = m.mesh_faceadr[number];
    Mesh mesh;
    std::map<std::pair<int, int>, std::uint32_t> known;
    for (int corner = 3 * first; corner < 3 * (first + m.mesh_facenum[number]); ++corner) {
        const int v = m.mesh_face[corner], n = m.mesh_facenormal[corner];
        const auto [at, is_new] =
            known.try_emplace({v, n}, static_cast<std::uint32_t>(mesh.vertices.size() / 3));
        if (is_new) {
            mesh.vertices.insert(mesh.vertices.end(), positions + 3 * v, positions + 3 * v + 3);
            mesh.normals.insert(mesh.normals.end(), normals + 3 * n, normals + 3 * n + 3);
        }
        mesh.triangles.push_back(at->second);
    }
    return mesh;
}

void Figure::place(const Eigen::Matrix4d& w_H_b, std::span<const double> s) noexcept {
    impl_->puppet.place(w_H_b, s);
}

std::array<double, 7> Figure::pose(int body) const noexcept {
    const mjData* d = impl_->puppet.data();
    std::array<double, 7> pose{};
    std::copy_n(d->xpos + 3 * (body + 1), 3, pose.begin());
    std::copy_n(d->xquat + 4 * (body + 1), 4, pose.begin() + 3);
    return pose;
}

} // namespace bf::physics

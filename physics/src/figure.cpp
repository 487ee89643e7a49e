#include "bf/physics/figure.hpp"
#include "puppet.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace bf::physics {

namespace {

constexpr int first_hidden_group = 3; // shapes of contacts

const std::map<int, Shape::Kind>& shape_kinds() {
    static const std::map<int, Shape::Kind> kinds = {
        {mjGEOM_MESH, Shape::Kind::mesh},          {mjGEOM_HFIELD, Shape::Kind::mesh},
        {mjGEOM_SPHERE, Shape::Kind::sphere},      {mjGEOM_BOX, Shape::Kind::box},
        {mjGEOM_CYLINDER, Shape::Kind::cylinder},  {mjGEOM_CAPSULE, Shape::Kind::capsule},
        {mjGEOM_ELLIPSOID, Shape::Kind::ellipsoid}};
    return kinds;
}

Shape shape_of(const mjModel& m, int geom) {
    Shape shape;
    shape.kind = shape_kinds().at(m.geom_type[geom]);
    shape.body = m.geom_bodyid[geom] - 1;
    shape.mesh = shape.kind == Shape::Kind::mesh ? m.geom_dataid[geom] : -1;
    if (m.geom_type[geom] == mjGEOM_HFIELD) shape.mesh += static_cast<int>(m.nmesh); // after the meshes
    std::copy_n(m.geom_pos + 3 * geom, 3, shape.pose.begin());
    std::copy_n(m.geom_quat + 4 * geom, 4, shape.pose.begin() + 3);
    std::copy_n(m.geom_size + 3 * geom, 3, shape.size.begin());
    const int material = m.geom_matid[geom];
    std::copy_n(material < 0 ? m.geom_rgba + 4 * geom : m.mat_rgba + 4 * material, 4, shape.colour.begin());
    return shape;
}

/// The upper side of a height field, two triangles for each cell.
Mesh mesh_of_heights(const mjModel& m, int number) {
    const int rows = m.hfield_nrow[number], columns = m.hfield_ncol[number];
    const float* data = m.hfield_data + m.hfield_adr[number];
    const mjtNum* size = m.hfield_size + 4 * number;
    const auto point = [&](int r, int c) {
        r = std::clamp(r, 0, rows - 1);
        c = std::clamp(c, 0, columns - 1);
        return Eigen::Vector3d(size[0] * (2.0 * c / (columns - 1) - 1), size[1] * (2.0 * r / (rows - 1) - 1),
                               size[2] * static_cast<double>(data[r * columns + c]));
    };
    Mesh mesh;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            const Eigen::Vector3d p = point(r, c);
            const Eigen::Vector3d normal =
                (point(r, c + 1) - point(r, c - 1)).cross(point(r + 1, c) - point(r - 1, c)).normalized();
            for (int i = 0; i < 3; ++i) {
                mesh.vertices.push_back(static_cast<float>(p[i]));
                mesh.normals.push_back(static_cast<float>(normal[i]));
            }
            if (r + 1 == rows || c + 1 == columns) continue;
            const auto first = static_cast<std::uint32_t>(r * columns + c);
            const auto above = first + static_cast<std::uint32_t>(columns);
            mesh.triangles.insert(mesh.triangles.end(),
                                  {first, first + 1, above, above, first + 1, above + 1});
        }
    return mesh;
}

} // namespace

std::optional<ContactForce> axial_force(const Eigen::Vector3d& point, const Vector6d& wrench) {
    const Eigen::Vector3d force = wrench.head<3>(), moment = wrench.tail<3>();
    if (!(force.norm() >= 1)) return {};
    return ContactForce{point + force.cross(moment) / force.squaredNorm(), force};
}

std::optional<ContactForce> contact_force(const Eigen::Matrix4d& w_H_foot, const Vector6d& wrench) {
    const auto R = w_H_foot.topLeftCorner<3, 3>();
    const Eigen::Vector3d force = R.transpose() * wrench.head<3>(), moment = R.transpose() * wrench.tail<3>();
    if (!(force.norm() >= 1 && force.z() >= force.norm() / 2))
        return axial_force(w_H_foot.topRightCorner<3, 1>(), wrench);
    const Eigen::Vector3d pressure(-moment.y() / force.z(), moment.x() / force.z(), 0);
    return ContactForce{w_H_foot.topRightCorner<3, 1>() + R * pressure, wrench.head<3>()};
}

struct Figure::Impl {
    Puppet puppet;
    std::vector<std::string> bodies;
    std::vector<Shape> shapes;

    template <class Made> explicit Impl(const Made& made) : puppet(made) {
        const mjModel& m = *puppet.model();
        for (int body = 1; body < m.nbody; ++body) bodies.emplace_back(mj_id2name(&m, mjOBJ_BODY, body));
        for (int geom = 0; geom < m.ngeom; ++geom)
            if (m.geom_bodyid[geom] > 0 && m.geom_group[geom] < first_hidden_group &&
                shape_kinds().contains(m.geom_type[geom]))
                shapes.push_back(shape_of(m, geom));
    }
};

Figure::Figure(const World& world) : impl_(std::make_unique<Impl>(world)) {}
Figure::Figure(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Figure::~Figure() = default;
Figure::Figure(Figure&&) noexcept = default;
Figure& Figure::operator=(Figure&&) noexcept = default;

const std::vector<std::string>& Figure::bodies() const { return impl_->bodies; }
const std::vector<Shape>& Figure::shapes() const { return impl_->shapes; }
int Figure::mesh_count() const {
    const mjModel& m = *impl_->puppet.model();
    return static_cast<int>(m.nmesh + m.nhfield);
}

Mesh Figure::mesh(int number) const {
    // MuJoCo counts positions and normals apart; a vertex of ours is a pair that some triangle has.
    const mjModel& m = *impl_->puppet.model();
    if (number >= m.nmesh) return mesh_of_heights(m, number - static_cast<int>(m.nmesh));
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

void Figure::place(std::span<const double> q) noexcept { impl_->puppet.place(q); }
Eigen::Vector3d Figure::com() const noexcept {
    return Eigen::Map<const Eigen::Vector3d>(impl_->puppet.data()->subtree_com);
}

std::array<double, 7> Figure::pose(int body) const noexcept {
    const mjData* d = impl_->puppet.data();
    std::array<double, 7> pose{};
    std::copy_n(d->xpos + 3 * (body + 1), 3, pose.begin());
    std::copy_n(d->xquat + 4 * (body + 1), 4, pose.begin() + 3);
    return pose;
}

} // namespace bf::physics

#include "inertia.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

namespace bf::physics {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double least_eigenvalue = 1e-14; // kg m2, what MuJoCo takes for positive
constexpr double least_mass = 1e-6;        // kg, of a link that moves
constexpr double least_radius = 1e-3;      // m, radius of gyration of a link that moves
constexpr double largest_change = 0.75;    // of the largest principal moment
constexpr double nothing = 1e-12;          // kg m2: rounding of zero

/// MuJoCo's order of a symmetric matrix.
Matrix3d full_inertia(const mjsBody* body) {
    const double* f = body->fullinertia;
    Matrix3d I;
    I << f[0], f[3], f[4], f[3], f[1], f[5], f[4], f[5], f[2];
    return I;
}

void set_full_inertia(mjsBody* body, const Matrix3d& I) {
    const double values[] = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
    std::copy_n(values, 6, body->fullinertia);
    std::fill_n(body->inertia, 3, 0.0);
}

std::string text(const Vector3d& moments) {
    std::ostringstream out;
    out << "(" << moments.transpose() << ")";
    return out.str();
}

/// Makes the inertia of one link possible.
void repair(mjsBody* body, const std::string& name, const Urdf& urdf, std::vector<std::string>& warnings) {
    if (!std::isfinite(body->fullinertia[0])) return; // zeros
    const Matrix3d I = full_inertia(body);
    mjtNum moments[3], vectors[9], quaternion[4];
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = I;
    mju_eig3(moments, vectors, quaternion, rows.data()); // falling; the eigenvalues that MuJoCo will look at
    if (moments[2] >= least_eigenvalue && moments[1] + moments[2] >= moments[0]) return;

    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(I);
    const Vector3d given = solver.eigenvalues();
    const double half_trace = given.sum() / 2.0;
    const Vector3d spread =
        (Vector3d::Constant(half_trace) - given).cwiseMax(std::max(2e-6 * half_trace, least_eigenvalue));
    const Vector3d possible = Vector3d::Constant(spread.sum()) - spread;
    const double largest = std::max(given.cwiseAbs().maxCoeff(), nothing);
    const double change = (possible - given).cwiseAbs().maxCoeff() / largest;
    const std::string where = "link '" + name + "' of '" + urdf.file.filename().string() +
                              "' has principal moments of inertia " + text(given) +
                              " kg m2, which no body has";
    if (change > largest_change)
        throw std::runtime_error(where + " nor comes near to (they would change by " +
                                 std::to_string(static_cast<int>(std::round(100.0 * change))) +
                                 " %); correct its <inertial>");
    warnings.push_back(where + "; the world takes " + text(possible));
    const Matrix3d& axes = solver.eigenvectors();
    set_full_inertia(body, axes * possible.asDiagonal() * axes.transpose());
}

/// Mass and inertia of what moves as one.
struct Moving {
    mjsBody* body;   ///< the one with the joint
    mjsBody* anchor; ///< that which receives mass or inertia: the heaviest
    double mass = 0.0;
    bool has_inertia = false;
};

} // namespace

void repair_inertias(mjSpec* spec, const Urdf& urdf, std::vector<std::string>& warnings) {
    const auto name_of = [](mjsBody* body) { return std::string(mjs_getString(mjs_getName(body->element))); };
    std::map<mjsBody*, Moving> moving; // by the body with the joint
    std::map<mjsBody*, mjsBody*> carrier{{mjs_findBody(spec, "world"), nullptr}};
    for (mjsElement* element = mjs_firstElement(spec, mjOBJ_BODY); element;
         element = mjs_nextElement(spec, element)) {
        mjsBody* body = mjs_asBody(element);
        const std::string name = name_of(body);
        repair(body, name, urdf, warnings);
        mjsBody* parent = mjs_getParent(element);
        if (!parent) continue;
        const bool has_joint = mjs_firstChild(body, mjOBJ_JOINT, 0) != nullptr;
        mjsBody* by = carrier[body] = has_joint ? body : carrier.at(parent);
        if (!by) continue;
        Moving& group = moving.try_emplace(by, Moving{by, body}).first->second;
        if (body->mass > group.anchor->mass) group.anchor = body;
        group.mass += body->mass;
        group.has_inertia |= std::isfinite(body->fullinertia[0]) || body->inertia[0] > 0.0;
    }
    for (auto& [body, group] : moving) {
        if (group.mass >= least_mass && group.has_inertia) continue;
        mjsBody* anchor = group.anchor;
        anchor->mass = std::max(anchor->mass, least_mass);
        anchor->explicitinertial = 1;
        std::ostringstream line;
        line << "link '" << name_of(anchor) << "' of '" << urdf.file.filename().string() << "' moves without "
             << (group.mass >= least_mass ? "inertia" : "mass") << "; the world gives it " << anchor->mass
             << " kg with a radius of gyration of " << 1e3 * least_radius << " mm";
        if (!group.has_inertia)
            set_full_inertia(anchor, anchor->mass * least_radius * least_radius * Matrix3d::Identity());
        warnings.push_back(line.str());
    }
}

} // namespace bf::physics

#include "bf/physics/world_options.hpp"
#include "spec.hpp"

#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>

namespace bf::physics {

ContactShape ContactShape::sphere(const Eigen::Vector3d& centre, double radius) {
    return {Kind::sphere, centre, {radius, 0.0, 0.0}};
}

ContactShape ContactShape::box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_sizes) {
    return {Kind::box, centre, half_sizes};
}

std::vector<ContactShape> four_spheres() {
    std::vector<ContactShape> shapes;
    for (double x : {-0.0485, 0.1015})
        for (double y : {-0.031, 0.031}) shapes.push_back(ContactShape::sphere({x, y, 0.005}, 0.005));
    return shapes;
}

namespace {

/// Collects violated rules, so that all of them are reported at once.
class Complaints {
  public:
    template <typename... Parts> void require(bool rule, const Parts&... parts) {
        if (rule) return;
        text_ << (count_++ > 0 ? "\n- " : "");
        (text_ << ... << parts);
    }
    void report() const {
        if (count_ == 0) return;
        throw std::invalid_argument((count_ > 1 ? "world options:\n- " : "") + text_.str());
    }

  private:
    std::ostringstream text_;
    int count_ = 0;
};

void check_list(Complaints& complaints, const char* name, const std::vector<double>& values, size_t n,
                bool may_be_negative = false) {
    complaints.require(values.size() <= 1 || n == 0 || values.size() == n, name, " holds ", values.size(),
                       " values; give none, one for all joints, or one for each of the ", n, " joints");
    for (double value : values)
        complaints.require(std::abs(value) <= mjMAXVAL && (may_be_negative || value >= 0.0), name, " holds ",
                           value, "; it must be finite, ", may_be_negative ? "" : "not negative, ",
                           "and at most 1e10");
}

/// Positions are divided by it.
void check_resolution(Complaints& complaints, const char* name, const std::vector<double>& values, size_t n) {
    check_list(complaints, name, values, n);
    for (double value : values)
        complaints.require(!(value > 0.0 && value < 1e-12), name, " holds ", value,
                           "; give 0, which is exact, or at least 1e-12");
}

void check_names(Complaints& complaints, const char* list, const std::vector<std::string>& names) {
    std::set<std::string> seen;
    for (const std::string& name : names)
        complaints.require(seen.insert(name).second, list, " names '", name, "' twice; name it once");
}

void check(Complaints& complaints, const PhysicsOptions& p) {
    complaints.require(p.time_step > 0.0 && p.time_step <= 0.1, "time_step is ", p.time_step,
                       " s; it must be above 0 and at most 0.1 (0.001 suits torque control)");
    complaints.require(p.impratio > 0.0 && p.impratio <= mjMAXVAL, "impratio is ", p.impratio,
                       "; it must be positive (1 to 100)");
    complaints.require(p.gravity.cwiseAbs().maxCoeff() <= mjMAXVAL && p.gravity.allFinite(), "gravity is (",
                       p.gravity.transpose(), "); it must be finite and at most 1e10");
    const std::string floor = p.floor.complaint();
    complaints.require(floor.empty(), "floor.", floor);
}

void check(Complaints& complaints, const RobotOptions& r) {
    complaints.require(!r.urdf.empty(), "urdf is empty; give the path of the robot's URDF file");
    for (const Foot& foot : r.feet) {
        complaints.require(!foot.frame.empty(), "a foot has no frame; name the link of its sole");
        complaints.require(!foot.shapes.empty() || foot.has_urdf_shapes, "foot '", foot.frame,
                           "' has no contact shape");
        for (const ContactShape& shape : foot.shapes) {
            const bool positive = shape.kind == ContactShape::Kind::sphere ? shape.size.x() > 0.0
                                                                           : (shape.size.array() > 0.0).all();
            complaints.require(positive && shape.size.allFinite() && shape.position.allFinite(), "foot '",
                               foot.frame, "' has a contact shape of size (", shape.size.transpose(),
                               ") at (", shape.position.transpose(),
                               "); radius and half-sizes must be positive");
        }
    }
    check_list(complaints, "armature", r.armature, r.joints.size());
    check_list(complaints, "damping", r.damping, r.joints.size());
    check_list(complaints, "friction", r.friction, r.joints.size());
    check_list(complaints, "the list of initial positions", r.initial_joints, r.joints.size(), true);
    check_list(complaints, "noise", {r.noise.position, r.noise.velocity, r.noise.torque}, 3);
    const Imperfections& i = r.imperfections;
    check_list(complaints, "command_delay", {i.delays.command}, 1);
    check_list(complaints, "measurement_delay", {i.delays.measurement}, 1);
    complaints.require(i.dropout >= 0.0 && i.dropout < 1.0, "dropout is ", i.dropout,
                       "; it is a probability, from 0 to below 1");
    check_list(complaints, "backlash", i.backlash, r.joints.size());
    check_resolution(complaints, "encoder_resolution", i.encoder_resolution, r.joints.size());
    check_resolution(complaints, "motor_encoder_resolution", i.motor_encoder_resolution, r.joints.size());
    const std::string surface = r.surface.value_or(Surface()).complaint();
    complaints.require(surface.empty(), surface);
    check_names(complaints, "ft_sensors", r.ft_sensors);
    check_names(complaints, "push_links", r.push_links);
    if (r.initial_w_H_b) {
        complaints.require(is_rigid(*r.initial_w_H_b),
                           "initial_w_H_b is no homogeneous transform; its rotation must be orthonormal and "
                           "its last row (0, 0, 0, 1)");
    }
}

} // namespace

bool is_rigid(const Eigen::MatrixXd& H) {
    if (H.rows() != 4 || H.cols() != 4 || !H.allFinite()) return false;
    const Eigen::Matrix3d R = H.topLeftCorner<3, 3>();
    return (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-6 && R.determinant() > 0.0 &&
           H.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
}

std::string Surface::complaint() const {
    std::ostringstream text;
    const auto [least, most, width, midpoint, power] = solimp;
    if (!(friction >= 0.0 && friction <= 1e6))
        text << "friction is " << friction << "; give 0 to 1e6";
    else if (!((solref.array() > 0.0).all() && (solref.array() <= 1e6).all()))
        text << "solref is (" << solref.transpose()
             << "); time constant and damping ratio must be positive, as in (0.005, 1)";
    else if (!(least > 0.0 && least < 1.0 && most > 0.0 && most < 1.0 && width > 0.0 && width <= 1e6 &&
               midpoint > 0.0 && midpoint < 1.0 && power >= 1.0 && power <= 1e6))
        text << "solimp is (" << least << ' ' << most << ' ' << width << ' ' << midpoint << ' ' << power
             << "); impedances and midpoint lie between 0 and 1, the width is above 0 and the power at least "
                "1, as in (0.9 0.95 0.001 0.5 2)";
    return text.str();
}

void PhysicsOptions::validate() const {
    Complaints complaints;
    check(complaints, *this);
    complaints.report();
}

void RobotOptions::validate() const {
    Complaints complaints;
    check(complaints, *this);
    complaints.report();
}

void WorldOptions::validate() const {
    Complaints complaints;
    check(complaints, static_cast<const PhysicsOptions&>(*this));
    check(complaints, static_cast<const RobotOptions&>(*this));
    complaints.report();
}

} // namespace bf::physics

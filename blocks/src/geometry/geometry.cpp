// Rotations, quaternions and poses; conventions as in the notation page: a_H_b, [w x y z], rad, m.
#include "bf/kernels/geometry.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Vector4d;

constexpr const char* rotation = "rotation matrix";
const About a_rotation{.doc = rotation};
const About a_quaternion{.doc = "quaternion [w x y z]"};
const About a_pose{.unit = mixed_units, .doc = "pose: rotation [1], position [m]"};
const About angles{.unit = unit<"rad">, .doc = "[roll pitch yaw]"};
const About a_position{.unit = unit<"m">, .doc = "position of the frame's origin"};
const About a_rotation_vector{.unit = unit<"rad">, .doc = "rotation vector, angle times axis"};

/// y = kernel(u) for a fixed kind of each.
template <class Kernel, class To, const About& about_y, class From, const About& about_u>
class Conversion final : public Block {
  public:
    using Block::Block;
    Input<From> u{this, "u", about_u};
    Output<To> y{this, "y", about_y};
    OutputRule rule{this, Kernel{}, y, u};
};

/// R = R_axis(angle).
class RotationAboutAxis final : public Block {
  public:
    explicit RotationAboutAxis(const Arguments& arguments) : Block(arguments) {
        if (*axis == "x")
            OutputRule(this, kernels::RotationX{}, R, angle);
        else if (*axis == "y")
            OutputRule(this, kernels::RotationY{}, R, angle);
        else
            OutputRule(this, kernels::RotationZ{}, R, angle);
    }
    Argument<std::string> axis{this, "axis", {.initial = "z", .doc = "axis", .choices = {"x", "y", "z"}}};
    Input<double> angle{this, "angle", {.unit = unit<"rad">, .doc = "angle about the axis"}};
    Output<Matrix3> R{this, "R", a_rotation};
};

/// a_H_c = a_H_b b_H_c.
class ComposePoses final : public Block {
  public:
    using Block::Block;
    Input<Transform> a_H_b{this, "a_H_b", a_pose};
    Input<Transform> b_H_c{this, "b_H_c", a_pose};
    Output<Transform> a_H_c{this, "a_H_c", a_pose};
    OutputRule rule{this, kernels::PoseComposition{}, a_H_c, a_H_b, b_H_c};
};

/// H = [R p; 0 1].
class PoseFromParts final : public Block {
  public:
    using Block::Block;
    Input<Matrix3> R{this, "R", a_rotation};
    Input<Vector3> p{this, "p", a_position};
    Output<Transform> H{this, "H", a_pose};
    OutputRule rule{this, kernels::PoseFromRotationPosition{}, H, R, p};
};

/// e = ½ of the skew part of R1 R2ᵀ, as a vector; or the rotation vector of R1 R2ᵀ.
class RotationError final : public Block {
  public:
    using Block::Block;
    Input<Matrix3> R1{this, "R1", a_rotation};
    Input<Matrix3> R2{this, "R2", a_rotation};
    Output<Vector3> e{
        this, "e", {.doc = "sin(angle) times axis of the rotation from R2 to R1, in world axes"}};
    OutputRule rule{this, kernels::RotationErrorSkew{}, e, R1, R2};
};

} // namespace

void add_geometry(Library& library) {
    library.group("geometry")
        .add<Conversion<kernels::RotationFromRollPitchYaw, Matrix3, a_rotation, Vector3, angles>>(
            "RotationFromRollPitchYaw", "Rotation of roll, pitch and yaw. R = Rz(yaw) Ry(pitch) Rx(roll).")
        .add<Conversion<kernels::RollPitchYawFromRotation, Vector3, angles, Matrix3, a_rotation>>(
            "RollPitchYawFromRotation",
            "Roll, pitch and yaw of a rotation. R = Rz(yaw) Ry(pitch) Rx(roll), pitch in "
            "[-π/2, π/2]; at its ends roll is 0.")
        .add<RotationAboutAxis>("RotationAboutAxis", "Rotation about a coordinate axis. R = R_axis(angle).")
        .add<Conversion<kernels::QuaternionFromRotation, Quaternion, a_quaternion, Matrix3, a_rotation>>(
            "QuaternionFromRotation",
            "Quaternion of a rotation. q = [w x y z] of norm 1 with w ≥ 0, by Shepperd's method.")
        .add<Conversion<kernels::RotationFromQuaternion, Matrix3, a_rotation, Quaternion, a_quaternion>>(
            "RotationFromQuaternion", "Rotation of a quaternion of any norm but 0. R = I + s (w S + S²), S = "
                                      "skew([x y z]), s = 2/(w² + "
                                      "x² + y² + z²); a quaternion 0 stops the run.")
        .add<Conversion<kernels::RotationLog, Vector3, a_rotation_vector, Matrix3, a_rotation>>(
            "RotationVectorFromRotation", "Rotation vector of a rotation. R = exp(skew(y)), |y| ≤ π.")
        .add<Conversion<kernels::RotationExp, Matrix3, a_rotation, Vector3, a_rotation_vector>>(
            "RotationFromRotationVector", "Rotation of a rotation vector. R = exp(skew(u)).")
        .add<RotationError>("RotationError",
                            "Difference of two rotations. e = vector of the skew part of R1 R2ᵀ.")
        .add<Conversion<kernels::PoseInverse, Transform, a_pose, Transform, a_pose>>(
            "InversePose", "Inverse of a pose. y = [Rᵀ, -Rᵀ p; 0 1].")
        .add<ComposePoses>("ComposePoses", "Product of two poses. a_H_c = a_H_b b_H_c.")
        .add<Conversion<kernels::PosePosition, Vector3, a_position, Transform, a_pose>>(
            "PosePosition", "Position of a pose. y = p of H = [R p; 0 1].")
        .add<Conversion<kernels::PoseRotation, Matrix3, a_rotation, Transform, a_pose>>(
            "PoseRotation", "Rotation of a pose. y = R of H = [R p; 0 1].")
        .add<PoseFromParts>("PoseFromParts", "Pose of a rotation and a position. H = [R p; 0 1].");
}

} // namespace bf::blocks

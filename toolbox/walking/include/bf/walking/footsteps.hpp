#pragma once

#include <Eigen/Dense>

#include <vector>

/// Planning and control of a walking biped: footsteps, divergent component of motion (DCM), swing foot. No
/// function allocates memory, throws, or checks that numbers are finite, unless it says so.
namespace bf::walking {

/// Where a sole stands: the origin of its frame [x y z] and its yaw. Soles are level. As a column of a matrix
/// of footholds: [x y z yaw].
using Foothold = Eigen::Vector4d;

enum class Side { left = 0, right = 1 };
constexpr Side other(Side side) { return side == Side::left ? Side::right : Side::left; }

/// Rotation about the vertical axis.
Eigen::Matrix3d yaw_rotation(double yaw) noexcept;
/// Pose (4×4) of a sole.
Eigen::Matrix4d pose_of(const Foothold& foothold) noexcept;
/// The foothold nearest to a pose: its position, and the yaw of its x axis.
Foothold foothold_of(const Eigen::Ref<const Eigen::Matrix4d>& pose) noexcept;
/// An angle in (-pi, pi].
double wrapped(double angle) noexcept;

/// Where a walk is. A step begins with a phase on both feet, in which the weight goes from the foot of
/// foothold 1 to that of foothold 2; then foothold 1 is left for foothold 3. Footholds from 4 on are those of
/// the steps after it. `ahead` counts the steps that are planned, this one included; 0: it stands, or comes
/// to a stand, between footholds 1 and 2.
struct Step {
    double time = 0.0;                ///< s, since the step began
    double double_support = 0.0;      ///< s, duration of the phase on both feet
    double single_support = 0.0;      ///< s, duration of the phase on one
    double next_double_support = 0.0; ///< s, of the steps after it, and of coming to a stand
    double next_single_support = 0.0; ///< s, of the steps after it
    Side stance = Side::right;        ///< the foot of foothold 2
    int ahead = 0;
    bool from_rest = true; ///< the weight begins midway between footholds 1 and 2

    double duration() const { return double_support + single_support; }
    bool on_both_feet() const { return ahead == 0 || time < double_support; }
    static constexpr int size = 8; ///< numbers of it on a wire
    /// As numbers, in the order above; the stance is 1 (left) or 2 (right).
    Eigen::Matrix<double, size, 1> numbers() const noexcept;
    /// Of such numbers. False where they are none of a step: not finite, a time or duration below zero,
    /// a single support of no duration, another stance, a negative count.
    static bool read(const Eigen::Ref<const Eigen::Matrix<double, size, 1>>& numbers, Step& step) noexcept;
};

/// What one step can do, in the axes of the foot that stands, for the origin of the other one.
struct Reach {
    double forward = 0.2, backward = 0.1; ///< along x, both positive
    double inner = 0.1, outer = 0.3;      ///< sideways distance, away from the standing foot
    double turn_out = 0.4, turn_in = 0.1; ///< yaw, both positive
    /// False where it is empty.
    bool is_possible() const noexcept;
};

/// The foothold of the foot beside `stance` that is nearest to `wanted` within reach, in each coordinate of
/// the standing foot by itself; its z stays.
Foothold within_reach(const Foothold& wanted, const Foothold& stance, Side stance_side,
                      const Reach& reach) noexcept;

/// Where the foot beside `stance` goes when the body, midway between feet `width` apart, moves by `motion`
/// [x y yaw] along a circular arc of constant velocity, in its own axes: the motion of a unicycle when y is
/// 0. Not limited.
Foothold next_foothold(const Foothold& stance, Side stance_side, double width,
                       const Eigen::Vector3d& motion) noexcept;

/// The motion [x y yaw] in body axes along one arc that leads the body to `goal` [x y yaw].
/// The body is midway between feet `width` apart, beside `stance`.
Eigen::Vector3d motion_to(const Eigen::Vector3d& goal, const Foothold& stance, Side stance_side,
                          double width) noexcept;

/// Rectangle of a sole in its axes.
struct Sole {
    double x_min = 0.0, x_max = 0.0, y_min = 0.0, y_max = 0.0;
};

/// Ground of boxes on the plane z = 0, whose edges are parallel to the axes of the world.
class Ground {
  public:
    Ground() = default;
    /// Rows x y z a b c: centre and half-sizes. Throws std::invalid_argument naming the row that is no box.
    explicit Ground(const Eigen::Ref<const Eigen::MatrixXd>& boxes);

    /// The same foothold where a sole can stand: at the height of what is below it; where the sole, with
    /// `clearance` around it, would be over an edge it moves by the least multiple of 5 mm along its x axis
    /// that avoids that, at most by `backward` or `forward`, the shorter step first. False where there is
    /// none; then it stays, at the greatest height below it.
    bool settle(Foothold& foothold, const Sole& sole, double clearance, double backward,
                double forward) const noexcept;

  private:
    /// Height below a sole, and whether all of it is at one height.
    bool is_level(const Foothold& foothold, const Sole& sole, double clearance,
                  double& height) const noexcept;

    std::vector<Eigen::Matrix<double, 6, 1>> boxes_;
};

} // namespace bf::walking

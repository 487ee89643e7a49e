#pragma once

#include "bf/dynamics/algorithms.hpp"

#include <vector>

namespace bf::dynamics {

/// What inverse kinematics wants of a frame or of the centre of mass.
struct Target {
    enum class Kind { position, orientation, pose, center_of_mass };

    Kind kind = Kind::pose;
    Frame frame;         ///< unused for the centre of mass
    double weight = 1.0; ///< of the squared error, 1/m² and 1/rad²; 0: not wanted
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity(); ///< in the world; what the kind leaves out is unused
};

/// Joint positions, and on demand a base pose, at which frames are nearest to their targets:
///
///   min ½ Σ w |e|² + ½ Σ w_s (posture - s)²   subject to   position_min ≤ s ≤ position_max,
///
/// with the errors e = p_target - p and e = log(R_target Rᵀ), the rotation vector, both in world axes.
///
/// Damped least squares: (Jᵀ W J + W_s + λ 1) Δ = Jᵀ W e + W_s (posture - s), with the damping λ in
/// proportion to what is left of the cost (T. Sugihara, Solvability-unconcerned inverse kinematics by the
/// Levenberg-Marquardt method, 2011), by a factor that follows how well the last step was predicted (J. Fan,
/// A modified Levenberg-Marquardt algorithm for singular system of nonlinear equations, 2003). A step stops
/// at each limit and goes on without that joint. Where the cost rests, it is tried a little along the
/// direction that the Jacobians see least, so that a stretched limb bends again. The cost never rises, so
/// what cannot be reached gives the least error near where the search began; with posture weights the
/// solution is a compromise with the posture. The same question has the same answer, bit for bit.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class InverseKinematics {
  public:
    enum class Status {
        reached = 0,         ///< every target of positive weight is within the tolerance
        iteration_limit = 1, ///< the cost was still falling
        least_error = 2      ///< no motion lowers the cost: out of reach, or at odds with each other
    };
    struct Options {
        int iterations = 50;     ///< most of one search
        double tolerance = 1e-6; ///< m and rad, of each target
        /// Asked before each search from another posture whether to leave it.
        bool (*is_interrupted)() noexcept = nullptr;
    };

    /// `moves_base`: the base pose is found, too. It cannot be where the robot's base is fixed.
    InverseKinematics(const Model& model, std::vector<Target> wanted, bool moves_base,
                      const Options& options);

    std::vector<Target> targets;     ///< poses and weights may change between searches
    Eigen::VectorXd posture;         ///< (n) wanted joint positions
    Eigen::VectorXd posture_weights; ///< (n), zero at first

    Eigen::VectorXd reach; ///< (n) most that `follow` moves a joint, infinite at first; rad or m

    /// Goes on from w_H_b and s, the last solution, and writes there what it finds; for targets that move. At
    /// a given reach no joint jumps, even where the least error suddenly lies elsewhere.
    Status follow(Eigen::Ref<Eigen::Matrix4d> w_H_b, VectorOut s) noexcept;

    /// Searches from w_H_b and s, and where that does not reach the targets, at most `restarts` times from
    /// other postures between the limits (of joints without: half a turn or 3.1 m to each side), which are
    /// the same each time. Writes the first that reaches them, or the least error.
    Status search(Eigen::Ref<Eigen::Matrix4d> w_H_b, VectorOut s, int restarts) noexcept;

    /// Errors [position; orientation] (6×targets) that the search left, zeros where the kind wants nothing.
    const Eigen::Matrix<double, 6, Eigen::Dynamic>& error() const { return found_.error; }
    /// Steps that the last search tried, those from other postures included.
    int iterations() const { return iterations_; }

  private:
    /// A configuration and what it costs.
    struct Point {
        Eigen::Matrix4d w_H_b;
        Eigen::VectorXd s;
        Eigen::Matrix<double, 6, Eigen::Dynamic> error;
        double cost;
    };

    void begin(const Eigen::Matrix4d& w_H_b, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept;
    Status descend() noexcept;
    void evaluate(Point& point) noexcept;
    bool is_reached() const noexcept;
    template <int count> void add_square(Eigen::Index row) noexcept;
    void linearise() noexcept;
    bool is_pressed(Eigen::Index column) const noexcept;
    void factorise_free(double damping) noexcept;
    double step(double damping) noexcept;
    void try_delta() noexcept;
    bool bends() noexcept;

    Model model_;
    Data data_;
    Options options_;
    Eigen::Index base_; ///< columns of the base, 6 or 0
    int iterations_ = 0;
    Point found_, trial_, best_;
    Eigen::VectorXd low_, high_; ///< between which joints are searched
    Eigen::MatrixXd J_;          ///< rows of all targets, each times the root of its weight
    Eigen::VectorXd r_;          ///< errors alike
    Eigen::MatrixXd H_, L_;      ///< Gauss-Newton Hessian, and the factor of its free part; lower triangles
    Eigen::VectorXd gradient_, delta_, rest_, x_;
    std::vector<Eigen::Index> free_;                    ///< columns that a step may move
    Eigen::Matrix<double, 6, Eigen::Dynamic> of_frame_; ///< Jacobian of one frame
    Eigen::Matrix<double, 3, Eigen::Dynamic> of_com_;
};

} // namespace bf::dynamics

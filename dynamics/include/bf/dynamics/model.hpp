#pragma once

#include <Eigen/Core>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace bf::dynamics {

/// A link of a Model, or a frame that a fixed joint ties to one; Model::frame gives it.
struct Frame {
    int index = 0; ///< position in Model::frame_names()

    bool operator==(const Frame&) const = default;
};

/// A joint that is not listed but moves: `position = multiplier * (position of the leader) + offset`. Without
/// a leader it stands at `offset`.
struct Follower {
    std::string joint;
    std::string leader; ///< a listed joint, or empty
    double multiplier = 1.0;
    double offset = 0.0; ///< rad or m
};

/// A robot with n independent joints of one degree of freedom each, on a floating or a fixed base. Immutable:
/// copies share one description, and any number of threads may use it, each with its own Data.
///
/// Everything joint-wise is in the order of joint_names().
class Model {
  public:
    /// Reads a URDF file and keeps the listed joints, in the listed order. Of the others, one that mimics a
    /// listed joint, directly or through more that mimic, follows it; all else is locked at zero. A listed
    /// joint is independent even where the URDF lets it mimic another. An empty list keeps every movable
    /// joint that mimics none, in the order of the file. Gravity is in the world frame, m/s².
    ///
    /// `base_link` is the link whose pose and velocity are those of the base; empty: the root of the URDF. A
    /// base that does not float has no velocity, and the generalised velocity is that of the joints.
    ///
    /// Throws std::runtime_error for a missing or unreadable file, an unknown base link, and for a joint that
    /// is unknown, fixed, listed twice or of more than one degree of freedom.
    static Model load(const std::filesystem::path& urdf, const std::vector<std::string>& joints = {},
                      const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81}, const std::string& base_link = {},
                      bool floating_base = true);

    struct Part;
    /// The robot cut at fixed joints, such as those with force/torque sensors: first the part of the base,
    /// then for each of `cuts` (joints or their child links) what hangs behind it. Each is a robot whose base
    /// floats, and lists those of `joints` that it has.
    ///
    /// Throws as `load`, and for a cut that is no fixed joint, is listed twice, or lies between the root of
    /// the URDF and the base link.
    static std::vector<Part> load_parts(const std::filesystem::path& urdf,
                                        const std::vector<std::string>& joints,
                                        const Eigen::Vector3d& gravity, const std::string& base_link,
                                        const std::vector<std::string>& cuts);

    const std::vector<std::string>& joint_names() const;
    /// Number of joints, n.
    int joints() const;
    /// What moves without being listed, and what stands elsewhere than at zero.
    const std::vector<Follower>& followers() const;
    bool has_floating_base() const;
    /// Size of the generalised velocity: 6 + n for nu = [pdot; omega; s_dot] of a floating base, n for nu =
    /// s_dot of a fixed one.
    int velocities() const { return (has_floating_base() ? 6 : 0) + joints(); }

    /// kg, all links.
    double total_mass() const;
    /// World frame, m/s².
    const Eigen::Vector3d& gravity() const;
    /// Name of the link that is the base.
    const std::string& base_link() const;

    /// Names of all links, those behind fixed or locked joints included.
    const std::vector<std::string>& frame_names() const;
    bool has_frame(const std::string& name) const;
    /// Throws std::runtime_error for an unknown name and lists the most similar ones.
    Frame frame(const std::string& name) const;

    /// Position limits (n), rad or m; -inf and +inf where the URDF gives none. Exporters write zeros where
    /// they know no limit: a range of no width, and a velocity or an effort of zero, are none.
    const Eigen::VectorXd& position_min() const;
    const Eigen::VectorXd& position_max() const;
    /// Velocity limits (n), rad/s or m/s; +inf where the URDF gives none.
    const Eigen::VectorXd& velocity_max() const;
    /// Effort limits (n), Nm or N; +inf where the URDF gives none.
    const Eigen::VectorXd& effort_max() const;

    struct Content;
    const Content& content() const { return *content_; } ///< for the algorithms of this folder

  private:
    explicit Model(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

    std::shared_ptr<const Content> content_;
};

/// A part of a robot. Its base link is the child of the joint where it was cut off.
struct Model::Part {
    Model model;
    int parent = -1;         ///< number of the part that carries it; -1: that of the base
    std::string parent_link; ///< link of that part on which it hangs
};

} // namespace bf::dynamics

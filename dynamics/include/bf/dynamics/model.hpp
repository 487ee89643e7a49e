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

/// A floating-base robot with n joints of one degree of freedom each. Immutable: copies share one
/// description, and any number of threads may use it, each with its own Data.
///
/// Everything joint-wise is in the order of joint_names(). The base is the root link of the URDF.
class Model {
  public:
    /// Reads a URDF file and keeps the listed joints, in the listed order; all others are locked at zero. An
    /// empty list keeps every movable joint in the order of the file. Gravity is in the world frame, m/s². A
    /// joint that mimics another counts as independent.
    ///
    /// Throws std::runtime_error for a missing or unreadable file, and for a joint that is unknown, fixed,
    /// listed twice or of more than one degree of freedom.
    static Model load(const std::filesystem::path& urdf, const std::vector<std::string>& joints = {},
                      const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

    const std::vector<std::string>& joint_names() const;
    /// Number of joints, n.
    int joints() const;
    /// Size of the generalised velocity nu = [pdot; omega; s_dot]: 6 + n.
    int velocities() const { return 6 + joints(); }

    /// kg, all links.
    double total_mass() const;
    /// World frame, m/s².
    const Eigen::Vector3d& gravity() const;
    /// Name of the root link of the URDF.
    const std::string& base_link() const;

    /// Names of all links, those behind fixed or locked joints included.
    const std::vector<std::string>& frame_names() const;
    bool has_frame(const std::string& name) const;
    /// Throws std::runtime_error for an unknown name and lists the most similar ones.
    Frame frame(const std::string& name) const;

    /// Position limits (n), rad or m; -inf and +inf where the URDF gives none.
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

} // namespace bf::dynamics

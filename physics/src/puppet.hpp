#pragma once

#include "bf/physics/scene.hpp"
#include "bf/physics/world.hpp"
#include "spec.hpp"

#include <functional>
#include <span>
#include <vector>

namespace bf::physics {

/// MuJoCo's model of a World or a Scene with its looks. That of a World hangs on bodies that can be put
/// anywhere, so that a base is drawn where it is, floating or fixed.
class Puppet {
  public:
    /// `decorate` may add to the model before it is compiled. Throws std::runtime_error.
    explicit Puppet(const World& world, const std::function<void(mjSpec*)>& decorate = {});

    explicit Puppet(const Scene& scene, const std::function<void(mjSpec*)>& decorate = {});

    const mjModel* model() const { return model_.get(); }
    mjData* data() { return data_.get(); }
    const mjData* data() const { return data_.get(); }
    int joint_count() const { return static_cast<int>(position_.size()); }

    /// Puts the base at `w_H_b` and the joints at `s`, in the World's order.
    void place(const Eigen::Matrix4d& w_H_b, std::span<const double> s);

    /// Puts all of a Scene where SceneSimulation::q says.
    void place(std::span<const double> q);

  private:
    void compute(); ///< what depends on the positions
    void place_root(const Eigen::Matrix4d& w_H_root);

    ModelPtr model_;
    DataPtr data_;
    std::vector<int> position_; ///< joint → index in qpos
    std::vector<FollowerAddress> followers_;
    std::vector<Eigen::Matrix4d>
        roots_; ///< poses of the bodies that hang on the world, in the order of MuJoCo's mocap
    int base_site_ = -1;
};

} // namespace bf::physics

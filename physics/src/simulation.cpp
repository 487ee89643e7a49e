#include "bf/physics/scene.hpp"

#include <array>
#include <cstdio>
#include <utility>

namespace bf::physics {

struct Simulation::Impl {
    std::shared_ptr<const World> world;
    SceneSimulation scene;
    std::array<char, 128> error{}; ///< of what the scene does not see

    explicit Impl(std::shared_ptr<const World> shared) : world(std::move(shared)), scene(world->scene()) {}

    template <typename... Values> bool fail(const char* format, Values... values) noexcept {
        std::snprintf(error.data(), error.size(), format, values...);
        return false;
    }
};

Simulation::Simulation(std::shared_ptr<const World> world)
    : impl_(std::make_unique<Impl>(std::move(world))) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const World& Simulation::world() const noexcept { return *impl_->world; }

void Simulation::reset() noexcept {
    impl_->error[0] = '\0';
    impl_->scene.reset();
}

bool Simulation::step(std::span<const double> tau, std::span<const double> wrenches,
                      const Disturbance& disturbance) noexcept {
    Impl& self = *impl_;
    const auto joints = static_cast<size_t>(self.world->joint_count());
    const size_t pushes = self.world->options().push_links.size();
    if (self.error[0] != '\0') return false;
    if (tau.size() != joints)
        return self.fail("step got %zu torques; the world has %zu joints", tau.size(), joints);
    if (!wrenches.empty() && wrenches.size() != 6 * pushes)
        return self.fail("step got %zu numbers as external wrenches; the world has %zu push links of 6 each",
                         wrenches.size(), pushes);
    self.scene.command(0, tau);
    for (size_t i = 0; i < pushes; ++i)
        self.scene.set_wrench(0, static_cast<int>(i),
                              wrenches.empty() ? Vector6d(Vector6d::Zero())
                                               : Vector6d(Eigen::Map<const Vector6d>(&wrenches[6 * i])));
    return self.scene.step(1, disturbance);
}

const char* Simulation::error() const noexcept {
    return impl_->error[0] != '\0' ? impl_->error.data() : impl_->scene.error();
}
double Simulation::time() const noexcept { return impl_->scene.time(); }

Readings Simulation::readings() const noexcept { return impl_->scene.readings(0); }
Readings Simulation::readings_at_loops() const noexcept { return impl_->scene.readings_at_loops(0); }
Simulation::Matrix4View Simulation::w_H_b() const noexcept { return impl_->scene.w_H_b(0); }
Simulation::Vector6View Simulation::v_b() const noexcept { return impl_->scene.v_b(0); }
Simulation::Vector3View Simulation::com() const noexcept { return impl_->scene.com(0); }
Simulation::Matrix3View Simulation::imu_rotation() const noexcept { return impl_->scene.imu_rotation(0); }
Eigen::Vector3d Simulation::imu_rpy() const noexcept { return impl_->scene.imu_rpy(0); }
Simulation::Vector3View Simulation::gyro() const noexcept { return impl_->scene.gyro(0); }
Simulation::Vector3View Simulation::accelerometer() const noexcept { return impl_->scene.accelerometer(0); }
Simulation::Matrix4View Simulation::foot_pose(int i) const noexcept { return impl_->scene.foot_pose(0, i); }
Simulation::Vector6View Simulation::foot_wrench(int i) const noexcept {
    return impl_->scene.foot_wrench(0, i);
}
Simulation::Vector6View Simulation::ft_wrench(int i) const noexcept { return impl_->scene.ft_wrench(0, i); }

int Simulation::state_size() const noexcept { return impl_->scene.state_size(); }
void Simulation::save(double* state) const noexcept { impl_->scene.save(state); }
void Simulation::restore(const double* state) noexcept {
    impl_->error[0] = '\0';
    impl_->scene.restore(state);
}

} // namespace bf::physics

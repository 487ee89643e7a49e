#include "bf/physics/scene.hpp"

#include <utility>

namespace bf::physics {

struct World::Impl {
    WorldOptions options; ///< complete
    std::shared_ptr<const Scene> scene;
};

World::World(WorldOptions options) : impl_(std::make_unique<Impl>()) {
    impl_->scene = std::make_shared<const Scene>(options);
    impl_->options = std::move(options);
    static_cast<RobotOptions&>(impl_->options) = impl_->scene->options().robots[0].options;
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const std::shared_ptr<const Scene>& World::scene() const { return impl_->scene; }
const WorldOptions& World::options() const { return impl_->options; }
int World::joint_count() const { return impl_->scene->joint_count(0); }
const std::vector<std::string>& World::joint_names() const { return impl_->options.joints; }
const std::string& World::base_link() const { return impl_->options.base_link; }
const Eigen::VectorXd& World::lower_limits() const { return impl_->scene->lower_limits(0); }
const Eigen::VectorXd& World::upper_limits() const { return impl_->scene->upper_limits(0); }
const Eigen::VectorXd& World::effort_limits() const { return impl_->scene->effort_limits(0); }
const std::vector<std::string>& World::bodies() const { return impl_->scene->bodies(); }
double World::mass() const { return impl_->scene->mass(0); }
const std::vector<std::string>& World::warnings() const { return impl_->scene->warnings(); }

} // namespace bf::physics

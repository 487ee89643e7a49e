// A world of several robots and objects, for the blocks that look at it and for those who draw it.
#pragma once

#include "bf/physics/scene.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf::toolbox {

/// What a World block provides. All blocks around it see one simulation, which that block alone advances.
struct SharedWorld {
    static constexpr const char* resource = "world";

    struct Live {
        Live(std::shared_ptr<const physics::Scene> scene, std::filesystem::path its_file)
            : simulation(std::move(scene)), file(std::move(its_file)) {}
        physics::SceneSimulation simulation;
        std::filesystem::path file;

        int state_size() const { return simulation.state_size(); }
        void save(double* to) const { simulation.save(to); }
        /// Warns, naming the file, of a state that was saved of another world.
        void restore(const double* from);
    };

    std::filesystem::path file;
    std::vector<std::filesystem::path> search_directories;
    std::shared_ptr<const physics::Scene> scene;
    /// Per robot: its force/torque sensors, named as in the file.
    std::vector<std::vector<std::string>> sensors;

    std::shared_ptr<Live> open() const { return std::make_shared<Live>(scene, file); }
};

/// A block that tells, as its output `wrench`, what all that touches a body exerts on it at a frame's origin,
/// for those who draw it.
class ContactSensor {
  public:
    virtual ~ContactSensor() = default;
    virtual const physics::Scene& scene() const = 0; ///< in which the body is
    virtual physics::Frame frame() const = 0;
};

} // namespace bf::toolbox

// The description of a robot, which model blocks compute with, beside the device that measures and actuates.
#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"
#include "bf/dynamics/variation.hpp"
#include "bf/toolbox/robot_device.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace bf::toolbox {

/// The description of a robot: URDF, joint list, gravity. Resource of every model block around it. All of
/// them share one workspace in a running diagram, so that nothing is computed twice for the same state.
struct RobotConfiguration {
    static constexpr const char* resource = "robot configuration";
    struct Live {
        static constexpr bool is_cache = true;
        const dynamics::Model& model;
        dynamics::Data data{model};
        std::optional<dynamics::Variation> variation = {}; ///< made by the first who wants derivatives
    };
    dynamics::Model model;
    std::filesystem::path urdf;
    std::vector<std::filesystem::path> search_directories; ///< where meshes and other robots are looked for

    std::shared_ptr<Live> open() const { return std::shared_ptr<Live>(new Live{model}); }
};

} // namespace bf::toolbox

#pragma once

#include "bf/physics/world_options.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace bf::physics {

struct UrdfJoint {
    std::string name, type, parent, child;
    std::string leader; ///< the joint that this one mimics, or empty
    double multiplier = 1.0, offset = 0.0;
    bool is_movable() const { return type == "revolute" || type == "continuous" || type == "prismatic"; }
};

struct UrdfLink {
    std::string name;
    bool has_inertia = false;
};

/// Names and tree of a URDF. MuJoCo forgets fixed joints, and its errors do not know what else the file
/// offers.
struct Urdf {
    std::filesystem::path file;
    std::string text; ///< without comments
    std::vector<UrdfLink> links;
    std::vector<UrdfJoint> joints;

    /// Throws std::runtime_error when the file is missing or describes no robot.
    static Urdf read(const std::filesystem::path& file);

    const std::string& root() const; ///< the link without parent
    /// First link with inertia going breadth-first from the root. Throws std::runtime_error when there is
    /// none.
    const std::string& first_heavy_link() const;
    const UrdfJoint* find_joint(std::string_view name) const;
    bool has_link(std::string_view name) const;

    /// Throws std::runtime_error "… has no link 'x', wanted as <role>; similar names: …".
    void require_link(const std::string& name, const std::string& role) const;
    /// Returns the joint. Throws std::runtime_error when it is unknown, or has no motor because of its type.
    const UrdfJoint& require_motor(const std::string& name) const;

    /// Movable joints outside of `listed` that mimic one in it, directly or through others, and those that
    /// stand elsewhere than at zero because what they mimic is locked.
    std::vector<Follower> followers_of(const std::vector<std::string>& listed) const;

    /// Path of a mesh given as package://name/path, model://name/path, file://path, or relative to the URDF
    /// or to its folder `meshdir`. Throws std::runtime_error that lists the places searched.
    std::filesystem::path mesh_file(const std::string& address, const std::string& link,
                                    const std::vector<std::filesystem::path>& package_paths,
                                    const std::string& meshdir = {}) const;
};

} // namespace bf::physics

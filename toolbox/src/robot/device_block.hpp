// What all blocks over a robot that is measured and actuated share.
#pragma once

#include "bf/core/block.hpp"
#include "bf/toolbox/robot.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace bf::toolbox {

/// Looks a text up in a table of (text, value).
template <class T, std::size_t N>
const T* find(const std::array<std::pair<const char*, T>, N>& table, const std::string& text) {
    for (const auto& [name, value] : table)
        if (text == name) return &value;
    return nullptr;
}
template <class T, std::size_t N>
std::vector<std::string> choices(const std::array<std::pair<const char*, T>, N>& table) {
    std::vector<std::string> names;
    for (const auto& [name, value] : table) names.emplace_back(name);
    return names;
}

/// What blocks that command the joints of a robot claim.
inline constexpr char claimed_references[] = "the references of the robot's joints";

/// Base of the blocks over a robot device.
class DeviceBlock : public Block {
  public:
    using Block::Block;
    Requires<RobotDevice> robot{this, "the robot that is measured and actuated"};
    Dim n{this, "n", [this]() -> Dim::Names {
              if (!robot.is_bound()) return std::nullopt;
              return robot->joint_names();
          }};
};

} // namespace bf::toolbox

// What of a diagram does not depend on values and sizes.
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace bf {

/// A part of a diagram, and a number that stands for its structure.
struct StructurePart {
    std::string name; ///< path of a block or conditional subsystem, or what else it is
    std::uint64_t hash;
    bool operator==(const StructurePart&) const = default;
};

/// Blocks with their types, ports, wires and operations, sample times, conditions and the order of execution.
/// Two diagrams with equal structures run by the same sequence of operations, on quantities that may differ
/// in size.
std::vector<StructurePart> structure_of(const Diagram& diagram);

} // namespace bf

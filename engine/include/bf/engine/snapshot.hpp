// Snapshots of a running simulation as the content of a file.
#pragma once

#include "bf/engine/simulation.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace bf {

/// A number that tells diagrams apart: blocks, sizes, types, rates, wiring, order and the constants of rules
/// count, values of parameters do not.
std::uint64_t fingerprint(const Diagram& diagram);

/// What `restore_snapshot` needs to go on bit for bit, with a header that names version, byte order, model
/// and fingerprint, and a checksum. Between two steps. Throws RunError naming a block that refuses.
std::vector<std::byte> make_snapshot(const Simulation& simulation);

/// Goes on from there, in a started simulation. A parameter keeps the value it had in the snapshot, unless
/// the diagram gives it another one than the diagram of the snapshot did: then that counts, so that variants
/// can start from one state. Throws RunError, in which `name` stands for the file: no snapshot, cut, damaged,
/// of another version, byte order or model.
void restore_snapshot(Simulation& simulation, std::span<const std::byte> snapshot, const std::string& name);

} // namespace bf

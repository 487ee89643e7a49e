// Snapshots of a run as the content of a file.
#pragma once

#include "bf/run/run.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace bf {

/// What `restore_snapshot` needs to go on bit for bit, with a header that names version, byte order, model
/// and fingerprint, and a checksum. Between two steps. Throws RunError naming a block that refuses.
std::vector<std::byte> make_snapshot(const Run& run);

/// Goes on from there, in a started run. A parameter keeps the value it had in the snapshot, unless
/// the model gives it another one than the model of the snapshot did: then that counts, so that variants
/// can start from one state. Throws RunError, in which `name` stands for the file: no snapshot, cut, damaged,
/// of another version, byte order or model, or of one that gives a block another argument.
void restore_snapshot(Run& run, std::span<const std::byte> snapshot, const std::string& name);

} // namespace bf

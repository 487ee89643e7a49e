#pragma once

#include "bf/model/operation.hpp"

namespace bf::model {

/// Marks the blocks of this document, and returns their paths: that of mark i is at i - 1.
std::vector<std::string> mark_blocks(Model& model);
/// Which of the marked blocks have other paths now; what a subsystem takes along is not listed. Takes the
/// marks away.
std::vector<Moved> moved_blocks(Model& model, const std::vector<std::string>& paths);

/// Of what goes into another document.
void take_marks_away(System& system);

std::vector<Moved> reversed(std::vector<Moved> moves);

} // namespace bf::model

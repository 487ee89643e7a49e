// What a path leads into.
#pragma once

#include "bf/model/model.hpp"

#include <memory>
#include <string>

namespace bf::editor {

/// Where the content of a subsystem or a state machine stands: the file, which has the positions, and the
/// path there.
struct Inside {
    const model::System* system; ///< of a state machine the one around it
    const model::Layout* layout;
    std::string path;
    std::shared_ptr<const std::string> file; ///< null: it was never read from one
    const model::Block* machine = nullptr;
    std::string state = {}; ///< of the machine's chart: the one whose states are meant
};

/// Of the file.
std::string folder_of(const Inside& place);

/// The signal of the active states of the chart that stands at the path.
std::string active_of(const Inside& place, const std::string& path);

/// Throws model::Errors where there is neither.
Inside inside(const model::Model& model, const std::string& path);

} // namespace bf::editor

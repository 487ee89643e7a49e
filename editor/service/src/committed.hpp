#pragma once

#include "bf/formats/yaml.hpp"

#include <filesystem>

namespace bf::service {

/// The model as it stands in the last commit of git, with the files that it refers to; those that no commit
/// has are as they are now. Throws std::runtime_error where there is no git, no commit, or the model is in
/// none.
model::Model committed(const std::filesystem::path& file);

} // namespace bf::service

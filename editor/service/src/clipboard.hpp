#pragma once

#include "bf/model/operation.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace bf::service {

/// These blocks of a subsystem, the wires among them and where they stand, as a model of their own in YAML.
/// Throws model::Errors for a block or subsystem that is not there.
std::string copied(const model::Model& model, const std::string& system,
                   const std::vector<std::string>& names);

/// What puts a copied text into a subsystem, its upper left corner at `at`. A name that is taken gets a
/// number; files that the text names are those of `folder`. Throws model::Errors where it is no model.
model::Operation pasted(const model::Model& model, const std::string& system, const std::string& text,
                        const std::filesystem::path& folder, model::Point at);

} // namespace bf::service

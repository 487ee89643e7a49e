#pragma once

#include "bf/model/model.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

/// The YAML form of a model, described in formats/yaml/README.md and by formats/yaml/model.schema.json.
namespace bf::formats {

/// Reads a model file and the files it refers to. Throws model::Errors with everything wrong in all of them.
model::Model read_yaml(const std::filesystem::path& path);

/// Texts of files by their absolute path.
using Files = std::map<std::filesystem::path, std::string>;

/// The same; what is in `files` is not read from the disk, and what is read from the disk is added to them.
model::Model read_yaml(const std::filesystem::path& path, Files& files);

/// Reads a model from text. `name` stands for the file in diagnostics; references are relative to its folder.
model::Model read_yaml_text(std::string_view text, const std::string& name = "model.yaml");

/// Reads a mapping of names and values, written as `variables` of a model are. `name` stands for the file in
/// diagnostics. Throws model::Errors.
std::vector<model::Variable> read_yaml_variables(std::string_view text, const std::string& name);

/// The canonical text: two blanks of indentation, a block on one line where it fits in 110 columns, order and
/// comments kept. Reading it gives the same model, and writing that gives the same text.
std::string write_yaml(const model::Model& model);

} // namespace bf::formats

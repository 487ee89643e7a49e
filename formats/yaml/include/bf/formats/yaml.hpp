#pragma once

#include "bf/model/model.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
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

/// The same of texts alone: a file that is not among them is a mistake, whether it is there or not.
model::Model read_yaml_given(const std::filesystem::path& path, Files files);

/// Reads a model from text. `name` stands for the file in diagnostics; references are relative to its folder.
model::Model read_yaml_text(std::string_view text, const std::string& name = "model.yaml");

/// Reads a mapping of names and values, written as `variables` of a model are. `name` stands for the file in
/// diagnostics. Throws model::Errors.
std::vector<model::Variable> read_yaml_variables(std::string_view text, const std::string& name);

/// The text of a model file. Of a model that was read from a text, all that has not changed keeps its bytes:
/// comments, order, spelling and line ends; a model that was not changed gives its text back. What is new is
/// written in the canonical form. Reading it gives an equal model.
std::string write_yaml(const model::Model& model);

/// Writes a model again and again as it changes, as `write_yaml` does: what it was read from is read once.
class Rewriter {
  public:
    Rewriter();
    ~Rewriter();
    Rewriter(const Rewriter&) = delete;
    Rewriter& operator=(const Rewriter&) = delete;

    struct Written {
        std::string text;
        /// As it is read from that text, with the places there; without comments, and without the models of
        /// files that it refers to.
        std::shared_ptr<const model::Model> model;
    };
    Written write(const model::Model& model);

  private:
    struct Reading;
    friend std::optional<std::string> edited_yaml(const model::Model& model);
    static std::optional<Written> edited(const Reading& reading, const model::Model& model);
    std::unique_ptr<Reading> reading_;
};

/// The canonical text: two blanks of indentation, a block on one line where it fits in 110 columns, order and
/// comments kept. Reading it gives an equal model, and the canonical text of that is the same.
std::string canonical_yaml(const model::Model& model);

} // namespace bf::formats

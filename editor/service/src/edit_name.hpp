#pragma once

#include "json.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace bf::service {

/// What a person did: "load.after = 0.06", "Tt = 4", "connect pd → motor.u".
struct EditPart {
    std::string name;
    bool is_of_drawing = false; ///< or of what is recorded and watched: nothing to a run
};

/// Of an operation in its text form; a batch has many.
std::vector<EditPart> parts_of(const Json& operation);

/// What was done to a document, by the revisions to which it led.
class EditNames {
  public:
    /// Revisions ascend.
    void add(std::int64_t revision, std::vector<EditPart> parts);
    /// Names all that was done after that revision as far as it matters to a run: "rename load and 2 more".
    std::string since(std::int64_t before) const;

  private:
    struct Edit {
        std::int64_t revision;
        std::vector<EditPart> parts;
    };
    std::vector<Edit> all_;
};

} // namespace bf::service

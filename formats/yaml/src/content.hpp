#pragma once

#include "bf/model/model.hpp"

#include <string>
#include <vector>

/// What is to be written, before it is decided how.
namespace bf::formats {

struct Item {
    struct Content {
        enum class Kind { scalar, literal, list, map };

        Kind kind = Kind::scalar;
        std::string text = {};                    ///< of a scalar, ready to print; of a literal, as it is
        bool may_flow = true;                     ///< whether it may stand in braces
        std::vector<Item> items = {};             ///< of lists (keys empty) and maps
        const model::Expression* value = nullptr; ///< that a scalar spells, where it is one
    };
    std::string key;
    Content content;
    const model::Comments* comments = nullptr;
    const model::Location* where = nullptr; ///< where the model's file has it
};
using Content = Item::Content;

Content content_of(const model::Model& model);

} // namespace bf::formats

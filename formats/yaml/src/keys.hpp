#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

/// The keys of each kind of mapping, in canonical order. The reader refuses any other; model.schema.json has
/// the same.
namespace bf::formats::keys {

using Keys = std::vector<std::string>;

inline const Keys system = {"execution", "states", "inputs", "outputs", "variables", "blocks", "connections"};
inline const Keys model = {"model",
                           "doc",
                           "plugins",
                           "step",
                           "stop",
                           "solver",
                           "relative_tolerance",
                           "absolute_tolerance",
                           "max_step",
                           "execution",
                           "states",
                           "inputs",
                           "outputs",
                           "variables",
                           "blocks",
                           "connections",
                           "record",
                           "plots",
                           "layout"};
inline const Keys subsystem = {"doc",    "period",  "offset",    "execution", "states",
                               "inputs", "outputs", "variables", "blocks",    "connections"};
inline const Keys library_block = {"block", "doc", "period", "offset"}; ///< and the block's settings
inline const Keys reference = {"file", "with", "doc", "period", "offset"};
inline const Keys input = {"shape", "type", "unit", "doc"};
inline const Keys output = {"shape", "type", "unit", "doc", "when_disabled", "initial"};

inline const Keys executions = {"virtual", "atomic", "enabled"}; ///< in the order of model::Execution
inline const Keys held_or_reset = {"held", "reset"};             ///< in the order of States and WhenDisabled

inline bool contains(const Keys& keys, std::string_view key) {
    return std::ranges::find(keys, key) != keys.end();
}

} // namespace bf::formats::keys

#pragma once

#include "bf/model/choices.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

/// The keys of each kind of mapping, in canonical order. The reader refuses any other; model.schema.json has
/// the same.
namespace bf::formats::keys {

using Keys = std::vector<std::string>;
using namespace model::choices;

inline Keys joined(Keys keys, const Keys& more, const Keys& last = {}) {
    keys.insert(keys.end(), more.begin(), more.end());
    keys.insert(keys.end(), last.begin(), last.end());
    return keys;
}

inline const Keys system = {"execution", "states",      "trigger", "reset",        "iterations",
                            "icon",      "inputs",      "outputs", "enumerations", "variables",
                            "blocks",    "connections", "signals"};
inline const Keys model =
    joined({"model", "doc", "plugins", "step", "stop", "solver", "relative_tolerance", "absolute_tolerance",
            "max_step", "algebraic_loops", "rate_transitions", "non_finite"},
           system, {"record", "plots", "layout"});
inline const Keys subsystem = joined({"doc", "when", "period", "offset"}, system);
inline const Keys library_block = {"block", "doc", "when", "period", "offset"}; ///< and the block's settings
inline const Keys reference = {"file", "with", "doc", "when", "period", "offset"};
inline const Keys input = {"shape", "type", "unit", "doc", "each"};
inline const Keys output = {"shape", "type", "unit", "doc", "when_disabled", "initial"};

inline const Keys variable = {"value",   "minimum", "above",
                              "maximum", "unit",    "doc"}; ///< of one that declares more than its value

inline const Keys placement = {"x", "y", "width", "height", "flipped", "rotated", "sides"};
inline const Keys note = {"text", "image", "in", "x", "y", "width", "height"};
inline const Keys layout = {"blocks", "wires", "notes", "displays"};
inline const Keys display = {"shows", "signals"};

inline constexpr std::string_view labels = "labels"; ///< of a wire, instead of corners

inline const Keys no_or_yes = {"false", "true"};

inline bool contains(const Keys& keys, std::string_view key) {
    return std::ranges::find(keys, key) != keys.end();
}

} // namespace bf::formats::keys

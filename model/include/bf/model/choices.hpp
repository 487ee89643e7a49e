#pragma once

#include "bf/base/fields.hpp"

/// The words for the values of enumerations, in files and in operations.
namespace bf::model::choices {

using bf::Words;

inline const Words executions = {"virtual", "atomic", "enabled", "triggered", "enabled_and_triggered",
                                 "for",     "while",  "for_each"};              ///< in the order of Execution
inline const Words triggers = {"rising", "falling", "either", "function_call"}; ///< in the order of Edge
inline const Words resets = {"rising", "falling", "either", "level_hold"};      ///< in the order of Edge
inline const Words rate_transitions = {"allowed", "checked", "inserted"}; ///< in the order of RateTransitions
inline const Words algebraic_loops = {"error", "solve"};                  ///< in the order of AlgebraicLoops
inline const Words non_finite = {"allowed", "error"};                     ///< in the order of NonFinite
inline const Words held_or_reset = {"held", "reset"};          ///< in the order of States and WhenDisabled
inline const Words sides = {"left", "right", "top", "bottom"}; ///< in the order of Side
inline const Words rotations = {"0", "90", "180", "270"};      ///< in the order of Rotation
inline const Words shows = {"lines",    "xy",      "bars",
                            "heat_map", "numbers", "states"};         ///< in the order of Shows
inline const Words quotes = {"none", "single", "twofold", "literal"}; ///< in the order of Quotes

} // namespace bf::model::choices

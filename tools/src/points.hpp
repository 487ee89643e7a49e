// What the points of a sweep are, as the command line says it.
#pragma once

#include "bf/library/sweep.hpp"

#include <string>

namespace bf::tools {

/// NAME=EXPRESSION. The elements of a row or column, or of a cell array, are its values ('Kp=1:0.5:3',
/// 'q0={[1 2] [3 4]}'); a scalar, a text and an expression of the model's variables are one value. Throws
/// CommandError, which names the option.
Axis parse_axis(const std::string& set, const std::string& option = "--set");

/// NAME~normal(MEAN,DEVIATION), NAME~uniform(LEAST,MOST) or NAME~integers(LEAST,MOST). Throws CommandError.
Random parse_random(const std::string& text);

} // namespace bf::tools

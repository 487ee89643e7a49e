#pragma once

#include "bf/core/value.hpp"

#include <matrix.h>

namespace bf::simulink {

/// A parameter as MATLAB gives it: numbers of any class and logicals as number, vector or matrix; a row of
/// characters as text; a cell array as list of texts or as vector. Throws std::runtime_error for anything
/// else.
Value value_of(const mxArray* array);

} // namespace bf::simulink

#pragma once

#include "json.hpp"

#include <string>

namespace bf::service {

/// What a person did by an operation in its text form: "load.after = 0.06", "Tt = 4", "connect pd → motor.u",
/// "rename load and 2 more".
std::string edit_name(const Json& operation);

} // namespace bf::service

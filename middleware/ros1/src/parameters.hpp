// Parameters of a running model as those of the master.
#pragma once

#include "bf/middleware/served_parameters.hpp"

#include <memory>
#include <string>

namespace bf::ros1 {

/// As NAMESPACE/model/NAME with / for each dot of the name, which others set there. Values that are there
/// already are taken first; at the end is there what was before. A value that the model does not take is put
/// back, and NAMESPACE/model_refused says why. Throws std::runtime_error.
std::unique_ptr<middleware::ServedParameters> serve_parameters(middleware::ParameterSource& source,
                                                               const std::string& name_space);

} // namespace bf::ros1

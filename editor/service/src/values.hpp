#pragma once

#include "bf/elaborate/tuning.hpp"

#include <map>
#include <string>
#include <vector>

namespace bf::service {

using Values = std::map<std::string, std::vector<double>>; ///< by path

Values values_of_variables(const Tuning& tuning);
/// Those that the model begins with.
Values values_of_parameters(const Diagram& diagram);

} // namespace bf::service

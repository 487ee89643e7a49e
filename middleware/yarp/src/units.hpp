// Units of YARP's programs.
#pragma once

#include <cmath>

namespace bf::yarp {

inline constexpr double degrees = 180 / M_PI; ///< for one rad

} // namespace bf::yarp

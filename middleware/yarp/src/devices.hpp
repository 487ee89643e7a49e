// YARP's own devices, which this plugin opens by their names.
#pragma once

#include <string>

namespace bf::yarp {

/// Loads the libraries of these devices, from where this plugin finds the others that it needs, and tells
/// YARP of them, once: so YARP needs none of its files that say where they are. What is not there YARP looks
/// for itself. Why that is; empty: all are there.
const std::string& load_devices();

} // namespace bf::yarp

// A plugin that throws while it registers.
#include "bf/core/registry.hpp"

#include <stdexcept>

extern "C" void bf_plugin_v1(bf::Library&) { throw std::runtime_error("no licence"); }

// A plugin that needs a function which no library brings.
#include "bf/core/registry.hpp"

extern "C" void bf_test_function_that_nobody_defines();
extern "C" void bf_plugin_v1(bf::Library&) { bf_test_function_that_nobody_defines(); }

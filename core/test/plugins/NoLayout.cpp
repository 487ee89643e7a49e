// A plugin from before plugins carried a layout; touching the library would end the process.
#include <cstdlib>

extern "C" void bf_plugin_v1(void*) { std::abort(); }

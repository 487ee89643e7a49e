// A plugin as another version of the headers would make it; touching the library would end the process.
#include <cstdint>
#include <cstdlib>

extern "C" void bf_plugin_v1(void*) { std::abort(); }
extern "C" std::uint64_t bf_plugin_layout() { return std::uint64_t{7} << 32 | 0xabc; }

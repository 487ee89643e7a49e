// A shared library that is no plugin of this interface version.
extern "C" void bf_plugin_v0() {}

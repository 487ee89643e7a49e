// The plugin Ros1.
#include "connection.hpp"

extern "C" void bf_plugin_v1(bf::Library& library) {
    bf::ros1::add_node(library);
    bf::ros1::add_bag(library);
    bf::ros1::add_topics(library);
    bf::ros1::add_robot(library);
}

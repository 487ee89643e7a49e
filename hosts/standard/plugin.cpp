#include "bf/blocks/standard.hpp"

extern "C" __attribute__((visibility("default"))) void bf_plugin_v1(bf::Library& library) {
    const bf::Library standard = bf::standard_library();
    for (bf::BlockClass block_class : standard.classes()) {
        block_class.library = library.name();
        library.add(std::move(block_class));
    }
}

// The plugin FMI: FMUs as blocks.
#include "fmu_block.hpp"

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("fmi");
    bf::fmi::add_co_simulation(library);
    bf::fmi::add_model_exchange(library);
}

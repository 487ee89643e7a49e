// Plugins that are part of the program.
#pragma once

#include "bf/core/registry.hpp"

namespace bf::generated {

/// The blocks that a plugin's entry lists.
inline Library linked(const char* plugin, void (*entry)(Library&)) {
    Library library(plugin);
    entry(library);
    return library;
}

} // namespace bf::generated

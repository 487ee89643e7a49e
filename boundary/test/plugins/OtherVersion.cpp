// Exports its class for another version of the factory's interface.
#define SHLIBPP_SYSTEM_VERSION 4
#include "LegacyPlugin.hpp"

#include <sharedlibpp/SharedLibraryClassApi.h>

SHLIBPP_DEFINE_SHARED_SUBCLASS(Matrices, legacy_test::Matrices, blockfactory::core::Block)

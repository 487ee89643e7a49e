// Exports its class for another version of the factory's interface, in the words of the headers of 2019.
#include "LegacyPlugin.hpp"

#include <shlibpp/SharedLibraryClassApi.h>

SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM(SHLIBPP_DEFAULT_START_CHECK, SHLIBPP_DEFAULT_END_CHECK, 4, Matrices,
                                      legacy_test::Matrices, blockfactory::core::Block)
// Not ours at all.
SHLIBPP_DEFINE_SHARED_SUBCLASS_CUSTOM(1, 2, 3, Foreign, legacy_test::Matrices, blockfactory::core::Block)

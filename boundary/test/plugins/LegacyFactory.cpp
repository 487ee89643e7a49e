#include "LegacyPlugin.hpp"

#include <sharedlibpp/SharedLibraryClassApi.h>

SHLIBPP_DEFINE_SHARED_SUBCLASS(Accumulate, legacy_test::Accumulate, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(AllParameters, legacy_test::AllParameters, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(Matrices, legacy_test::Matrices, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(Offset, legacy_test::Offset, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(LateOffset, legacy_test::LateOffset, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(Misbehaves, legacy_test::Misbehaves, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(CannotBeMade, legacy_test::CannotBeMade, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(Nothing, legacy_test::Nothing, blockfactory::core::Block)
SHLIBPP_DEFINE_SHARED_SUBCLASS(Diary, legacy_test::Diary, blockfactory::core::Block)

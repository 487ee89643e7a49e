// What sharedlibpp/SharedLibraryFactory.h was called until BlockFactory 1.0.
#ifndef SHLIBPP_SHAREDLIBRARYFACTORY_H
#define SHLIBPP_SHAREDLIBRARYFACTORY_H

#include "sharedlibpp/SharedLibraryFactory.h"

#endif

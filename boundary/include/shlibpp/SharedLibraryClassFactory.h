// What sharedlibpp/SharedLibraryClassFactory.h was called until BlockFactory 1.0.
#ifndef SHLIBPP_SHAREDLIBRARYCLASSFACTORY_H
#define SHLIBPP_SHAREDLIBRARYCLASSFACTORY_H

#include "sharedlibpp/SharedLibraryClassFactory.h"

#endif

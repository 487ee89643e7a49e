// What sharedlibpp/SharedLibraryClassApi.h was called until BlockFactory 1.0.
#ifndef SHLIBPP_SHAREDLIBRARYCLASSAPI_H
#define SHLIBPP_SHAREDLIBRARYCLASSAPI_H

#include "sharedlibpp/SharedLibraryClassApi.h"

#endif

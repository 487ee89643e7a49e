// What sharedlibpp/SharedLibrary.h was called until BlockFactory 1.0.
#ifndef SHLIBPP_SHAREDLIBRARY_H
#define SHLIBPP_SHAREDLIBRARY_H

#include "sharedlibpp/SharedLibrary.h"

#endif

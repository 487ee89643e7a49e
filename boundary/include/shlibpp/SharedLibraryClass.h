// What sharedlibpp/SharedLibraryClass.h was called until BlockFactory 1.0.
#ifndef SHLIBPP_SHAREDLIBRARYCLASS_H
#define SHLIBPP_SHAREDLIBRARYCLASS_H

#include "sharedlibpp/SharedLibraryClass.h"

#endif

#ifndef RTW_HEADER_TestModel_private_h_
#define RTW_HEADER_TestModel_private_h_
#include "TestModel_types.h"
#include "rtwtypes.h"
#endif

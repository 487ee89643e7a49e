#ifndef RTW_HEADER_TestModel_types_h_
#define RTW_HEADER_TestModel_types_h_
#include "rtwtypes.h"

typedef struct P_TestModel_T_ P_TestModel_T;
typedef struct tag_RTM_TestModel_T RT_MODEL_TestModel_T;

#endif

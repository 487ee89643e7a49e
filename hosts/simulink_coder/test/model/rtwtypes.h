#ifndef RTWTYPES_H
#define RTWTYPES_H
#include "simstruc_types.h"
#include "tmwtypes.h"
#endif

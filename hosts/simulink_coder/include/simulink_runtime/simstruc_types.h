/* What generated models use of the types of a simulation. */
#ifndef BLOCKFACTORY_SIMSTRUC_TYPES_H
#define BLOCKFACTORY_SIMSTRUC_TYPES_H

#include "tmwtypes.h"

typedef enum { MINOR_TIME_STEP, MAJOR_TIME_STEP } SimTimeStep;

typedef enum {
    SS_DOUBLE,
    SS_SINGLE,
    SS_INT8,
    SS_UINT8,
    SS_INT16,
    SS_UINT16,
    SS_INT32,
    SS_UINT32,
    SS_BOOLEAN
} BuiltInDTypeId;

#ifndef utAssert
#define utAssert(condition) ((void)0)
#endif

#endif

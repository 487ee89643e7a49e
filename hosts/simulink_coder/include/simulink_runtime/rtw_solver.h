/* The solver's data in a generated model. */
#ifndef BLOCKFACTORY_RTW_SOLVER_H
#define BLOCKFACTORY_RTW_SOLVER_H

#include "simstruc_types.h"

typedef struct {
    void* rtModelPtr;
    SimTimeStep* simTimeStepPtr;
    SimTimeStep simTimeStep;
    time_T** tPtr;
    time_T* stepSizePtr;
    const char_T** errStatusPtr;
    const char_T* solverName;
    void* solverData;
    real_T** dXPtr;
    real_T** contStatesPtr;
    int_T* numContStatesPtr;
} RTWSolverInfo;

#define rtsiSetRTModelPtr(S, rtmp) ((S)->rtModelPtr = (rtmp))
#define rtsiGetRTModelPtr(S) ((S)->rtModelPtr)
#define rtsiSetSimTimeStepPtr(S, stp) ((S)->simTimeStepPtr = (stp))
#define rtsiGetSimTimeStepPtr(S) ((S)->simTimeStepPtr)
#define rtsiSetSimTimeStep(S, st) (*((S)->simTimeStepPtr) = (st))
#define rtsiGetSimTimeStep(S) (*((S)->simTimeStepPtr))
#define rtsiSetTPtr(S, tp) ((S)->tPtr = (tp))
#define rtsiSetT(S, t) ((*((S)->tPtr))[0] = (t))
#define rtsiGetT(S) ((*((S)->tPtr))[0])
#define rtsiSetStepSizePtr(S, ssp) ((S)->stepSizePtr = (ssp))
#define rtsiSetStepSize(S, ss) (*((S)->stepSizePtr) = (ss))
#define rtsiGetStepSize(S) (*((S)->stepSizePtr))
#define rtsiSetErrorStatusPtr(S, esp) ((S)->errStatusPtr = (esp))
#define rtsiSetErrorStatus(S, es) (*((S)->errStatusPtr) = (es))
#define rtsiGetErrorStatus(S) (*((S)->errStatusPtr))
#define rtsiSetSolverName(S, sn) ((S)->solverName = (sn))
#define rtsiGetSolverName(S) ((S)->solverName)
#define rtsiSetSolverData(S, sd) ((S)->solverData = (void*)(sd))
#define rtsiGetSolverData(S) ((S)->solverData)
#define rtsiSetdXPtr(S, dxp) ((S)->dXPtr = (dxp))
#define rtsiSetContStatesPtr(S, xp) ((S)->contStatesPtr = (xp))
#define rtsiSetNumContStatesPtr(S, np) ((S)->numContStatesPtr = (np))

#endif

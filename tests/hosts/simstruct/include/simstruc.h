/* The SimStruct of a level-2 S-function: the functions and constants that ours uses, by their documented
   names and meanings. Simulink has most of them as macros. */
#ifndef BLOCKFACTORY_SIMSTRUCT_SIMSTRUC_H
#define BLOCKFACTORY_SIMSTRUCT_SIMSTRUC_H

#include "matrix.h"
#include "simstruc_types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct SimStruct_tag SimStruct;
typedef int_T DTypeId;
typedef struct {
    int_T width;   /* number of elements, or DYNAMICALLY_SIZED */
    int_T numDims; /* 1 or 2, or DYNAMICALLY_SIZED */
    int_T* dims;
} DimsInfo_T;

#define DYNAMICALLY_SIZED (-1)
#define DYNAMICALLY_TYPED (-1)
extern DimsInfo_T* const DYNAMIC_DIMENSION;

#define INHERITED_SAMPLE_TIME (-1.0)
#define CONTINUOUS_SAMPLE_TIME (0.0)
#define FIXED_IN_MINOR_STEP_OFFSET (1.0)

#define SS_PRM_NOT_TUNABLE 0
#define SS_PRM_TUNABLE 1
#define SS_PRM_SIM_ONLY_TUNABLE 2

#define SS_NOT_REUSABLE_AND_GLOBAL 0
#define USE_CUSTOM_SIM_STATE 3

#define SS_OPTION_EXCEPTION_FREE_CODE 0x0001u
#define SS_OPTION_ALLOW_INPUT_SCALAR_EXPANSION 0x0002u
#define SS_OPTION_USE_TLC_WITH_ACCELERATOR 0x0004u
#define SS_OPTION_CALL_TERMINATE_ON_EXIT 0x0008u
#define SS_OPTION_WORKS_WITH_CODE_REUSE 0x0010u

#define SSWRITE_VALUE_QSTR 1
#define SSWRITE_VALUE_NUM 2
#define SSWRITE_VALUE_VECT 3

/* The block. */
const char* ssGetPath(SimStruct* S);
void ssSetErrorStatus(SimStruct* S, const char* message);
const char* ssGetErrorStatus(SimStruct* S);
void ssWarning(SimStruct* S, const char* message);
void ssSetOptions(SimStruct* S, uint_T options);
void ssSetSimStateCompliance(SimStruct* S, int compliance);

/* Parameters of its dialog. */
void ssSetNumSFcnParams(SimStruct* S, int_T number);
int_T ssGetNumSFcnParams(SimStruct* S);
int_T ssGetSFcnParamsCount(SimStruct* S);
const mxArray* ssGetSFcnParam(SimStruct* S, int_T index);
void ssSetSFcnParamTunable(SimStruct* S, int_T index, int_T tunable);

/* Ports. */
int ssSetNumInputPorts(SimStruct* S, int_T number); /* 0 on failure */
int ssSetNumOutputPorts(SimStruct* S, int_T number);
int_T ssGetNumInputPorts(SimStruct* S);
int_T ssGetNumOutputPorts(SimStruct* S);
int ssSetInputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info);
int ssSetOutputPortDimensionInfo(SimStruct* S, int_T port, const DimsInfo_T* info);
int ssSetInputPortVectorDimension(SimStruct* S, int_T port, int_T width);
int ssSetOutputPortVectorDimension(SimStruct* S, int_T port, int_T width);
int ssSetInputPortMatrixDimensions(SimStruct* S, int_T port, int_T rows, int_T cols);
int ssSetOutputPortMatrixDimensions(SimStruct* S, int_T port, int_T rows, int_T cols);
int_T ssGetInputPortWidth(SimStruct* S, int_T port);
int_T ssGetOutputPortWidth(SimStruct* S, int_T port);
int_T ssGetInputPortNumDimensions(SimStruct* S, int_T port);
int_T ssGetOutputPortNumDimensions(SimStruct* S, int_T port);
int_T* ssGetInputPortDimensions(SimStruct* S, int_T port);
int_T* ssGetOutputPortDimensions(SimStruct* S, int_T port);
void ssSetInputPortDataType(SimStruct* S, int_T port, DTypeId type);
void ssSetOutputPortDataType(SimStruct* S, int_T port, DTypeId type);
DTypeId ssGetInputPortDataType(SimStruct* S, int_T port);
DTypeId ssGetOutputPortDataType(SimStruct* S, int_T port);
void ssSetInputPortDirectFeedThrough(SimStruct* S, int_T port, int_T feedthrough);
void ssSetInputPortRequiredContiguous(SimStruct* S, int_T port, int_T required);
void ssSetInputPortOptimOpts(SimStruct* S, int_T port, uint_T options);
void ssSetOutputPortOptimOpts(SimStruct* S, int_T port, uint_T options);
int_T ssGetInputPortConnected(SimStruct* S, int_T port);
const void* ssGetInputPortSignal(SimStruct* S, int_T port);
void* ssGetOutputPortSignal(SimStruct* S, int_T port);

/* Sample times. */
void ssSetNumSampleTimes(SimStruct* S, int_T number);
void ssSetSampleTime(SimStruct* S, int_T index, time_T period);
void ssSetOffsetTime(SimStruct* S, int_T index, time_T offset);
time_T ssGetSampleTime(SimStruct* S, int_T index);
time_T ssGetOffsetTime(SimStruct* S, int_T index);
void ssSetModelReferenceSampleTimeDefaultInheritance(SimStruct* S);
time_T ssGetT(SimStruct* S);
time_T ssGetFixedStepSize(SimStruct* S);
int_T ssIsMajorTimeStep(SimStruct* S);
int_T ssIsVariableStepSolver(SimStruct* S);

/* States and work. */
void ssSetNumContStates(SimStruct* S, int_T number);
void ssSetNumDiscStates(SimStruct* S, int_T number);
real_T* ssGetContStates(SimStruct* S);
real_T* ssGetdX(SimStruct* S);
void ssSetSolverNeedsReset(SimStruct* S);
void ssSetNumNonsampledZCs(SimStruct* S, int_T number);
real_T* ssGetNonsampledZCs(SimStruct* S);
void ssSetNumPWork(SimStruct* S, int_T number);
void** ssGetPWork(SimStruct* S); /* null until the model is compiled */
int ssSetNumDWork(SimStruct* S, int_T number);
void ssSetDWorkWidth(SimStruct* S, int_T index, int_T width);
void ssSetDWorkDataType(SimStruct* S, int_T index, DTypeId type);
void ssSetDWorkName(SimStruct* S, int_T index, char_T* name);
void ssSetDWorkUsedAsDState(SimStruct* S, int_T index, int_T used);
void* ssGetDWork(SimStruct* S, int_T index);

/* The record for generated code. The settings: kind, name, value; vectors with their length behind. */
int ssWriteRTWParamSettings(SimStruct* S, int_T number, ...);
int ssWriteRTWWorkVect(SimStruct* S, const char* vector, int_T number, const char* name, int_T width);

#ifdef __cplusplus
}
#endif

#endif

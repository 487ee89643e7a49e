/* Ends the source of an S-function, as Simulink's file of that name does: gathers the methods that the source
   has, for whoever runs it. */
#include "simstruct/methods.h"

#ifdef __cplusplus
extern "C"
#endif
    const SimStructMethods simstruct_methods = {
        mdlInitializeSizes,
        mdlInitializeSampleTimes,
        mdlOutputs,
        mdlTerminate,
#ifdef MDL_CHECK_PARAMETERS
        mdlCheckParameters,
#else
        NULL,
#endif
#ifdef MDL_PROCESS_PARAMETERS
        mdlProcessParameters,
#else
        NULL,
#endif
#ifdef MDL_SET_INPUT_PORT_DIMENSION_INFO
        mdlSetInputPortDimensionInfo,
#else
        NULL,
#endif
#ifdef MDL_SET_OUTPUT_PORT_DIMENSION_INFO
        mdlSetOutputPortDimensionInfo,
#else
        NULL,
#endif
#ifdef MDL_SET_DEFAULT_PORT_DIMENSION_INFO
        mdlSetDefaultPortDimensionInfo,
#else
        NULL,
#endif
#ifdef MDL_SET_INPUT_PORT_DATA_TYPE
        mdlSetInputPortDataType,
#else
        NULL,
#endif
#ifdef MDL_SET_OUTPUT_PORT_DATA_TYPE
        mdlSetOutputPortDataType,
#else
        NULL,
#endif
#ifdef MDL_SET_DEFAULT_PORT_DATA_TYPES
        mdlSetDefaultPortDataTypes,
#else
        NULL,
#endif
#ifdef MDL_SET_WORK_WIDTHS
        mdlSetWorkWidths,
#else
        NULL,
#endif
#ifdef MDL_START
        mdlStart,
#else
        NULL,
#endif
#ifdef MDL_INITIALIZE_CONDITIONS
        mdlInitializeConditions,
#else
        NULL,
#endif
#ifdef MDL_UPDATE
        mdlUpdate,
#else
        NULL,
#endif
#ifdef MDL_DERIVATIVES
        mdlDerivatives,
#else
        NULL,
#endif
#ifdef MDL_ZERO_CROSSINGS
        mdlZeroCrossings,
#else
        NULL,
#endif
#ifdef MDL_SIM_STATE
        mdlGetSimState,
        mdlSetSimState,
#else
        NULL,
        NULL,
#endif
#ifdef MDL_RTW
        mdlRTW,
#else
        NULL,
#endif
};

// A class of the shape that Simulink Coder documents, written for the tests: two blocks of a plugin, a
// constant parameter, a unit delay, root ports, two tasks of one rate.
#ifndef RTW_HEADER_TestModel_h_
#define RTW_HEADER_TestModel_h_
#include <cstring>
#ifndef TestModel_COMMON_INCLUDES_
#define TestModel_COMMON_INCLUDES_
#include "rtw_continuous.h"
#include "rtw_solver.h"
#include "rtwtypes.h"
#endif
#include "TestModel_types.h"

#define rtmGetErrorStatus(rtm) ((rtm)->errorStatus)
#define rtmSetErrorStatus(rtm, val) ((rtm)->errorStatus = (val))
#define rtmGetT(rtm) (rtmGetTPtr((rtm))[0])
#define rtmGetTPtr(rtm) ((rtm)->Timing.t)

// Block signals.
typedef struct {
    real_T Delay[3];
    real_T Accumulate[3];
} B_TestModel_T;

// States and work vectors.
typedef struct {
    real_T Delay_DSTATE[3];
    struct {
        void* blockPWork[2];
    } Accumulate_PWORK;
    struct {
        void* blockPWork[2];
    } Misbehaves_PWORK;
} DW_TestModel_T;

typedef struct {
    real_T input2[3];
} ExtU_TestModel_T;

typedef struct {
    real_T Result[3];
    real_T Ones[3];
} ExtY_TestModel_T;

struct P_TestModel_T_ {
    real_T Constant_Value[3];
    real_T Delay_InitialCondition;
};

struct tag_RTM_TestModel_T {
    const char_T* errorStatus;
    RTWSolverInfo solverInfo;
    struct {
        uint32_T clockTick0;
        uint32_T clockTickH0;
        time_T stepSize0;
        uint32_T clockTick1;
        uint32_T clockTickH1;
        SimTimeStep simTimeStep;
        time_T* t;
        time_T tArray[2];
    } Timing;
};

// Stands for a parameter that differs between the tests: what the block "Misbehaves" does.
extern const char* TestModel_misdeed;

class TestModelModelClass {
  public:
    ExtU_TestModel_T TestModel_U;
    ExtY_TestModel_T TestModel_Y;

    void initialize();
    void step();
    void terminate();
    TestModelModelClass();
    ~TestModelModelClass();
    RT_MODEL_TestModel_T* getRTM();

  private:
    static P_TestModel_T TestModel_P;
    B_TestModel_T TestModel_B;
    DW_TestModel_T TestModel_DW;
    RT_MODEL_TestModel_T TestModel_M;
};

#endif

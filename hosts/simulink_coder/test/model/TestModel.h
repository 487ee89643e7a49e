// A class of the shape that Simulink Coder documents, written for the tests: two blocks of a plugin, a
// constant parameter, a unit delay, root ports, two tasks of one rate.
#ifndef RTW_HEADER_TestModel_h_
#define RTW_HEADER_TestModel_h_

#include "TestModel_types.h"
#include "rtw_continuous.h"
#include "rtw_solver.h"
#include "rtwtypes.h"

#include <BlockFactory/Core/Parameters.h>
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#define rtmGetErrorStatus(rtm) ((rtm)->errorStatus)
#define rtmSetErrorStatus(rtm, val) ((rtm)->errorStatus = (val))
#define rtmGetTPtr(rtm) ((rtm)->Timing.t)

enum { TestModel_width = 3 };

struct B_TestModel_T { // signals
    real_T Delay[TestModel_width], Accumulate[TestModel_width];
};
struct DW_TestModel_T { // states and work vectors
    real_T Delay_DSTATE[TestModel_width];
    struct {
        void* blockPWork[2];
    } Accumulate_PWORK, Misbehaves_PWORK;
};
struct ExtU_TestModel_T { // root inputs
    real_T summand[TestModel_width];
};
struct ExtY_TestModel_T { // root outputs
    real_T sum[TestModel_width], ones[TestModel_width];
};
struct P_TestModel_T_ { // parameters
    real_T Offset_Value[TestModel_width];
    real_T Delay_InitialCondition;
};
struct tag_RTM_TestModel_T { // what drivers see
    const char_T* errorStatus;
    RTWSolverInfo solverInfo;
    struct {
        uint32_T clockTick0, clockTickH0;
        time_T stepSize0;
        uint32_T clockTick1, clockTickH1;
        SimTimeStep simTimeStep;
        time_T* t;
        time_T tArray[2];
    } Timing;
};

// Stands for a parameter that differs between the tests: what the block "Misbehaves" does.
extern const char* TestModel_misdeed;

class TestModelModelClass {
  public:
    TestModelModelClass();
    ~TestModelModelClass();
    void initialize();
    void step();
    void terminate();
    RT_MODEL_TestModel_T* getRTM();

    ExtU_TestModel_T TestModel_U;
    ExtY_TestModel_T TestModel_Y;

  private:
    bool start(void** work, const std::string& type, blockfactory::core::Parameters parameters,
               const std::vector<const real_T*>& inputs, real_T* output);
    void end(void** work, const std::string& type);
    bool failed(const char* phase);

    static P_TestModel_T TestModel_P;
    B_TestModel_T TestModel_B;
    DW_TestModel_T TestModel_DW;
    RT_MODEL_TestModel_T TestModel_M;
};

#endif

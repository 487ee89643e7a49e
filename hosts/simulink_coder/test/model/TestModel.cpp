// For each block of a plugin it does what generated code documents for start, step and end.
#include "TestModel.h"
#include "TestModel_private.h"

#include <BlockFactory/Core/Block.h>
#include <BlockFactory/Core/FactorySingleton.h>
#include <BlockFactory/Core/Log.h>
#include <BlockFactory/SimulinkCoder/CoderBlockInformation.h>

using namespace blockfactory::core;
using blockfactory::coder::CoderBlockInformation;

const char* TestModel_misdeed = "none";

P_TestModel_T TestModelModelClass::TestModel_P = {{1, 2, 3}, 0};

namespace {

using Factory = ClassFactorySingleton::ClassFactoryPtr;

Factory factory_of(const std::string& type) {
    return ClassFactorySingleton::getInstance().getClassFactory({"LegacyPlugin", type});
}

Port::Info row(Port::Index index) { return {index, {1, TestModel_width}, Port::DataType::DOUBLE}; }

// A block that is destroyed unless it is released.
std::unique_ptr<Block, std::function<void(Block*)>> held(const Factory& factory, Block* block) {
    return {block, [factory](Block* end) { factory->destroy(end); }};
}

// Slot 1 of the work vector keeps what the block is told, slot 0 the block.
CoderBlockInformation* information_in(void** work) { return static_cast<CoderBlockInformation*>(work[1]); }
Block* block_in(void** work) { return static_cast<Block*>(work[0]); }

} // namespace

bool TestModelModelClass::failed(const char* phase) {
    // The status is read until the model is gone, and no longer than 1023 characters.
    static std::string status;
    status = (phase + Log::getSingleton().getErrors()).substr(0, 1023);
    rtmSetErrorStatus(getRTM(), status.c_str());
    return false;
}

bool TestModelModelClass::start(void** work, const std::string& type, Parameters parameters,
                                const std::vector<const real_T*>& inputs, real_T* output) {
    parameters.storeParameter(type, {ParameterType::STRING, 0, 1, 1, "className"});
    parameters.storeParameter(std::string("LegacyPlugin"), {ParameterType::STRING, 1, 1, 1, "libName"});
    auto* information = new CoderBlockInformation;
    work[1] = information;
    information->setUniqueBlockName("TestModel/" + type);
    information->storeRTWParameters(parameters);
    for (std::size_t i = 0; i < inputs.size(); ++i)
        information->setInputPort(row(i), const_cast<real_T*>(inputs[i]));
    information->setOutputPort(row(0), output);

    const Factory factory = factory_of(type);
    if (!factory) return failed("[Initialize]");
    // Classes that keep indices of their ports in static variables learn them from an object that is not run.
    CoderBlockInformation not_run;
    not_run.storeRTWParameters(parameters);
    held(factory, factory->create())->configureSizeAndPorts(&not_run);

    auto block = held(factory, factory->create());
    if (!block->initialize(information)) return failed("[Initialize]");
    if (!block->initializeInitialConditions(information)) return failed("[InitializeInitialConditions]");
    factory->addRef();
    work[0] = block.release();
    return true;
}

void TestModelModelClass::end(void** work, const std::string& type) {
    const std::unique_ptr<CoderBlockInformation> information(information_in(work));
    Block* const running = block_in(work);
    work[0] = work[1] = nullptr;
    if (!running) return;
    Factory factory = factory_of(type);
    factory->removeRef();
    {
        const auto block = held(factory, running);
        if (!block->terminate(information.get())) failed("[Terminate]");
    }
    const bool was_last = factory->getReferenceCount() == 1;
    factory.reset();
    if (was_last) ClassFactorySingleton::getInstance().destroyFactory({"LegacyPlugin", type});
}

void TestModelModelClass::initialize() {
    TestModel_M.Timing.t = TestModel_M.Timing.tArray;
    TestModel_M.Timing.stepSize0 = 0.01;
    RTWSolverInfo* solver = &TestModel_M.solverInfo;
    rtsiSetRTModelPtr(solver, &TestModel_M);
    rtsiSetErrorStatusPtr(solver, &rtmGetErrorStatus(&TestModel_M));
    rtsiSetTPtr(solver, &rtmGetTPtr(&TestModel_M));
    rtsiSetStepSizePtr(solver, &TestModel_M.Timing.stepSize0);
    rtsiSetSimTimeStepPtr(solver, &TestModel_M.Timing.simTimeStep);
    rtsiSetSimTimeStep(solver, MAJOR_TIME_STEP);
    rtsiSetSolverName(solver, "FixedStepDiscrete");

    for (real_T& state : TestModel_DW.Delay_DSTATE) state = TestModel_P.Delay_InitialCondition;
    Parameters accumulate, misbehaves;
    accumulate.storeParameter(2.0, {ParameterType::DOUBLE, 2, 1, 1, "factor"});
    accumulate.storeParameter(std::vector<double>{0.5, 0.25, 0.125},
                              {ParameterType::DOUBLE, 3, 1, 3, "bias"});
    misbehaves.storeParameter(std::string(TestModel_misdeed), {ParameterType::STRING, 2, 1, 1, "misdeed"});
    if (start(TestModel_DW.Accumulate_PWORK.blockPWork, "Accumulate", accumulate,
              {TestModel_B.Delay, TestModel_U.summand}, TestModel_B.Accumulate))
        start(TestModel_DW.Misbehaves_PWORK.blockPWork, "Misbehaves", misbehaves, {TestModel_B.Accumulate},
              TestModel_Y.ones);
}

void TestModelModelClass::step() {
    std::copy_n(TestModel_DW.Delay_DSTATE, TestModel_width, TestModel_B.Delay);
    void** work = TestModel_DW.Accumulate_PWORK.blockPWork;
    if (!block_in(work)->output(information_in(work))) {
        failed("[Output]");
        return;
    }
    std::copy_n(TestModel_B.Accumulate, TestModel_width, TestModel_Y.sum);
    work = TestModel_DW.Misbehaves_PWORK.blockPWork;
    if (!block_in(work)->output(information_in(work))) {
        failed("[Output]");
        return;
    }

    for (int i = 0; i < TestModel_width; ++i)
        TestModel_DW.Delay_DSTATE[i] = TestModel_U.summand[i] + TestModel_P.Offset_Value[i];
    auto& timing = TestModel_M.Timing;
    // A tick is of 32 bits; what it carries is counted apart. Both tasks have one rate.
    if (++timing.clockTick0 == 0) ++timing.clockTickH0;
    timing.clockTick1 = timing.clockTick0;
    timing.clockTickH1 = timing.clockTickH0;
    timing.t[0] = timing.stepSize0 * (timing.clockTick0 + 4294967296.0 * timing.clockTickH0);
}

void TestModelModelClass::terminate() {
    end(TestModel_DW.Accumulate_PWORK.blockPWork, "Accumulate");
    end(TestModel_DW.Misbehaves_PWORK.blockPWork, "Misbehaves");
}

TestModelModelClass::TestModelModelClass()
    : TestModel_U(), TestModel_Y(), TestModel_B(), TestModel_DW(), TestModel_M() {}
TestModelModelClass::~TestModelModelClass() = default;
RT_MODEL_TestModel_T* TestModelModelClass::getRTM() { return &TestModel_M; }

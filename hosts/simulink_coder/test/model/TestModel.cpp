#include "TestModel.h"
#include "TestModel_private.h"

#include <BlockFactory/Core/Block.h>
#include <BlockFactory/Core/FactorySingleton.h>
#include <BlockFactory/Core/Log.h>
#include <BlockFactory/Core/Parameter.h>
#include <BlockFactory/Core/Parameters.h>
#include <BlockFactory/SimulinkCoder/CoderBlockInformation.h>
#include <cstdio>

const char* TestModel_misdeed = "none";

// Model step function
void TestModelModelClass::step() {
    // UnitDelay: '<Root>/Delay'
    std::memcpy(&TestModel_B.Delay[0], &TestModel_DW.Delay_DSTATE[0], 3U * sizeof(real_T));

    {
        // Get the CoderBlockInformation from the PWork
        blockfactory::core::BlockInformation* blockInfo = nullptr;
        blockInfo =
            static_cast<blockfactory::core::BlockInformation*>(TestModel_DW.Accumulate_PWORK.blockPWork[1]);

        // Get the Block from the PWork
        blockfactory::core::Block* blockPtr = nullptr;
        blockPtr = static_cast<blockfactory::core::Block*>(TestModel_DW.Accumulate_PWORK.blockPWork[0]);

        // Calculate the output
        bool ok;
        ok = blockPtr->output(blockInfo);

        // Report errors
        if (!ok) {
            std::string error = "[Output]" + blockfactory::core::Log::getSingleton().getErrors();

            // Trim the message if needed
            if (error.length() >= 1024) {
                error = error.substr(0, 1024 - 1);
            }

            // This shouldn't happen
            if (getRTM()->errorStatus) {
                fprintf(stderr, "%s\n", rtmGetErrorStatus(getRTM()));
                delete getRTM()->errorStatus;
            }

            const char* const message = new char[1024];
            std::snprintf(const_cast<char*>(message), error.length() + 1, "%s", error.c_str());
            rtmSetErrorStatus(getRTM(), message);
            return;
        }
    }

    // Outport: '<Root>/Result'
    std::memcpy(&TestModel_Y.Result[0], &TestModel_B.Accumulate[0], 3U * sizeof(real_T));

    {
        blockfactory::core::BlockInformation* blockInfo = nullptr;
        blockInfo =
            static_cast<blockfactory::core::BlockInformation*>(TestModel_DW.Misbehaves_PWORK.blockPWork[1]);
        blockfactory::core::Block* blockPtr = nullptr;
        blockPtr = static_cast<blockfactory::core::Block*>(TestModel_DW.Misbehaves_PWORK.blockPWork[0]);
        bool ok;
        ok = blockPtr->output(blockInfo);
        if (!ok) {
            std::string error = "[Output]" + blockfactory::core::Log::getSingleton().getErrors();
            if (error.length() >= 1024) {
                error = error.substr(0, 1024 - 1);
            }
            const char* const message = new char[1024];
            std::snprintf(const_cast<char*>(message), error.length() + 1, "%s", error.c_str());
            rtmSetErrorStatus(getRTM(), message);
            return;
        }
    }

    // Update for UnitDelay: '<Root>/Delay'
    for (int_T i = 0; i < 3; i++) {
        TestModel_DW.Delay_DSTATE[i] = TestModel_U.input2[i] + TestModel_P.Constant_Value[i];
    }

    // Update absolute time
    if (!(++TestModel_M.Timing.clockTick0)) {
        ++TestModel_M.Timing.clockTickH0;
    }
    TestModel_M.Timing.t[0] = TestModel_M.Timing.clockTick0 * TestModel_M.Timing.stepSize0 +
                              TestModel_M.Timing.clockTickH0 * TestModel_M.Timing.stepSize0 * 4294967296.0;
    TestModel_M.Timing.clockTick1++;
    if (!TestModel_M.Timing.clockTick1) {
        TestModel_M.Timing.clockTickH1++;
    }
}

// Model initialize function
void TestModelModelClass::initialize() {
    {
        // Setup solver object
        rtsiSetSimTimeStepPtr(&(&TestModel_M)->solverInfo, &(&TestModel_M)->Timing.simTimeStep);
        rtsiSetTPtr(&(&TestModel_M)->solverInfo, &rtmGetTPtr((&TestModel_M)));
        rtsiSetStepSizePtr(&(&TestModel_M)->solverInfo, &(&TestModel_M)->Timing.stepSize0);
        rtsiSetErrorStatusPtr(&(&TestModel_M)->solverInfo, (&rtmGetErrorStatus((&TestModel_M))));
        rtsiSetRTModelPtr(&(&TestModel_M)->solverInfo, (&TestModel_M));
    }
    rtsiSetSimTimeStep(&(&TestModel_M)->solverInfo, MAJOR_TIME_STEP);
    rtsiSetSolverName(&(&TestModel_M)->solverInfo, "FixedStepDiscrete");
    (&TestModel_M)->Timing.t = &(&TestModel_M)->Timing.tArray[0];
    (&TestModel_M)->Timing.stepSize0 = 0.01;

    {
        // Create and store the CoderBlockInformation object
        blockfactory::coder::CoderBlockInformation* blockInfo = nullptr;
        blockInfo = new blockfactory::coder::CoderBlockInformation();
        TestModel_DW.Accumulate_PWORK.blockPWork[1] = static_cast<void*>(blockInfo);

        // Initialize the parameters
        blockfactory::core::Parameters params;
        params.storeParameter<double>(2.0, blockfactory::core::ParameterMetadata(
                                               blockfactory::core::ParameterType::DOUBLE, 2, 1, 1, "factor"));
        {
            std::vector<double> valueVector;
            valueVector.reserve(3);
            valueVector.push_back(0.5);
            valueVector.push_back(0.25);
            valueVector.push_back(0.125);
            params.storeParameter<double>(
                valueVector, blockfactory::core::ParameterMetadata(blockfactory::core::ParameterType::DOUBLE,
                                                                   3, 1, 3, "bias"));
        }
        params.storeParameter<std::string>(
            "Accumulate", blockfactory::core::ParameterMetadata(blockfactory::core::ParameterType::STRING, 0,
                                                                1, 1, "className"));
        params.storeParameter<std::string>(
            "LegacyPlugin", blockfactory::core::ParameterMetadata(blockfactory::core::ParameterType::STRING,
                                                                  1, 1, 1, "libName"));

        // Set the block name and store the parameters in the CoderBlockInformation object
        blockInfo->setUniqueBlockName("TestModel/Accumulate");
        blockInfo->storeRTWParameters(params);

        // Inputs and outputs
        blockInfo->setInputPort({0, {1, 3}, blockfactory::core::Port::DataType::DOUBLE},
                                const_cast<void*>(static_cast<const void*>(&TestModel_B.Delay[0])));
        blockInfo->setInputPort({1, {1, 3}, blockfactory::core::Port::DataType::DOUBLE},
                                const_cast<void*>(static_cast<const void*>(TestModel_U.input2)));
        blockInfo->setOutputPort({0, {1, 3}, blockfactory::core::Port::DataType::DOUBLE},
                                 static_cast<void*>(TestModel_B.Accumulate));

        // Get the class factory
        blockfactory::core::ClassFactorySingleton::ClassFactoryPtr factory;
        factory = blockfactory::core::ClassFactorySingleton::getInstance().getClassFactory(
            {"LegacyPlugin", "Accumulate"});
        if (!factory) {
            rtmSetErrorStatus(getRTM(), "no factory");
            return;
        }

        // Run a dummy configureSizeAndPorts on a temporary block
        {
            blockfactory::coder::CoderBlockInformation tmpInfo;
            tmpInfo.storeRTWParameters(params);
            auto* tmpBlock = factory->create();
            tmpBlock->configureSizeAndPorts(&tmpInfo);
            factory->destroy(tmpBlock);
        }

        // Allocate the block object
        blockfactory::core::Block* blockPtr = nullptr;
        blockPtr = factory->create();
        factory->addRef();

        bool ok;
        ok = blockPtr->initialize(blockInfo);
        if (!ok) {
            std::string error = "[Initialize]" + blockfactory::core::Log::getSingleton().getErrors();
            const char* const message = new char[1024];
            std::snprintf(const_cast<char*>(message), 1024, "%s", error.c_str());
            rtmSetErrorStatus(getRTM(), message);
            return;
        }
        ok = blockPtr->initializeInitialConditions(blockInfo);
        if (!ok) {
            rtmSetErrorStatus(getRTM(), "[InitializeInitialConditions]");
            return;
        }

        // Store the block in the PWork vector
        TestModel_DW.Accumulate_PWORK.blockPWork[0] = blockPtr;
    }

    {
        blockfactory::coder::CoderBlockInformation* blockInfo = nullptr;
        blockInfo = new blockfactory::coder::CoderBlockInformation();
        TestModel_DW.Misbehaves_PWORK.blockPWork[1] = static_cast<void*>(blockInfo);
        blockfactory::core::Parameters params;
        params.storeParameter<std::string>(
            TestModel_misdeed, blockfactory::core::ParameterMetadata(
                                   blockfactory::core::ParameterType::STRING, 2, 1, 1, "misdeed"));
        params.storeParameter<std::string>(
            "Misbehaves", blockfactory::core::ParameterMetadata(blockfactory::core::ParameterType::STRING, 0,
                                                                1, 1, "className"));
        params.storeParameter<std::string>(
            "LegacyPlugin", blockfactory::core::ParameterMetadata(blockfactory::core::ParameterType::STRING,
                                                                  1, 1, 1, "libName"));
        blockInfo->setUniqueBlockName("TestModel/Misbehaves");
        blockInfo->storeRTWParameters(params);
        blockInfo->setInputPort({0, {1, 3}, blockfactory::core::Port::DataType::DOUBLE},
                                const_cast<void*>(static_cast<const void*>(TestModel_B.Accumulate)));
        blockInfo->setOutputPort({0, {1, 3}, blockfactory::core::Port::DataType::DOUBLE},
                                 static_cast<void*>(TestModel_Y.Ones));
        blockfactory::core::ClassFactorySingleton::ClassFactoryPtr factory;
        factory = blockfactory::core::ClassFactorySingleton::getInstance().getClassFactory(
            {"LegacyPlugin", "Misbehaves"});
        if (!factory) {
            rtmSetErrorStatus(getRTM(), "no factory");
            return;
        }
        {
            blockfactory::coder::CoderBlockInformation tmpInfo;
            tmpInfo.storeRTWParameters(params);
            auto* tmpBlock = factory->create();
            tmpBlock->configureSizeAndPorts(&tmpInfo);
            factory->destroy(tmpBlock);
        }
        blockfactory::core::Block* blockPtr = nullptr;
        blockPtr = factory->create();
        factory->addRef();
        bool ok;
        ok = blockPtr->initialize(blockInfo);
        if (!ok) {
            std::string error = "[Initialize]" + blockfactory::core::Log::getSingleton().getErrors();
            const char* const message = new char[1024];
            std::snprintf(const_cast<char*>(message), 1024, "%s", error.c_str());
            rtmSetErrorStatus(getRTM(), message);
            factory->destroy(blockPtr);
            factory->removeRef();
            return;
        }
        blockPtr->initializeInitialConditions(blockInfo);
        TestModel_DW.Misbehaves_PWORK.blockPWork[0] = blockPtr;
    }

    // InitializeConditions for UnitDelay: '<Root>/Delay'
    for (int_T i = 0; i < 3; i++) {
        TestModel_DW.Delay_DSTATE[i] = TestModel_P.Delay_InitialCondition;
    }
}

// Model terminate function
void TestModelModelClass::terminate() {
    struct {
        void** work;
        const char* name;
    } blocks[] = {{TestModel_DW.Accumulate_PWORK.blockPWork, "Accumulate"},
                  {TestModel_DW.Misbehaves_PWORK.blockPWork, "Misbehaves"}};
    for (auto& block : blocks) {
        auto* blockInfo = static_cast<blockfactory::coder::CoderBlockInformation*>(block.work[1]);
        auto* blockPtr = static_cast<blockfactory::core::Block*>(block.work[0]);
        blockfactory::core::ClassFactorySingleton::ClassFactoryPtr factory =
            blockfactory::core::ClassFactorySingleton::getInstance().getClassFactory(
                {"LegacyPlugin", block.name});
        if (blockPtr) {
            blockPtr->terminate(blockInfo);
            factory->destroy(blockPtr);
            factory->removeRef();
        }
        if (factory->getReferenceCount() == 1) {
            factory.reset();
            blockfactory::core::ClassFactorySingleton::getInstance().destroyFactory(
                {"LegacyPlugin", block.name});
        }
        delete blockInfo;
        block.work[0] = block.work[1] = nullptr;
    }
}

TestModelModelClass::TestModelModelClass()
    : TestModel_U(), TestModel_Y(), TestModel_B(), TestModel_DW(), TestModel_M() {}
TestModelModelClass::~TestModelModelClass() {}
RT_MODEL_TestModel_T* TestModelModelClass::getRTM() { return (&TestModel_M); }

// Block parameters
P_TestModel_T TestModelModelClass::TestModel_P = {
    {1.0, 2.0, 3.0}, // '<Root>/Constant'
    0.0              // '<Root>/Delay'
};

// A class of the generated shape, compiled and run without MATLAB.
#include "TestModel.h"

#include <BlockFactory/Core/FactorySingleton.h>
#include <BlockFactory/Core/Parameters.h>
#include <BlockFactory/SimulinkCoder/CoderBlockInformation.h>
#include <BlockFactory/SimulinkCoder/GeneratedCodeWrapper.h>
#include <gtest/gtest.h>

namespace blockfactory::coder {
namespace {

using namespace blockfactory::core;

struct GeneratedModel : testing::Test {
    GeneratedCodeWrapper<TestModelModelClass> model{"TestModel", 2};
    GeneratedModel() {
        static const bool once = [] {
            ClassFactorySingleton::getInstance().extendPluginSearchPath(BF_TEST_PLUGINS);
            return true;
        }();
        (void)once;
        Log::getSingleton().clear();
        TestModel_misdeed = "none";
    }
    ~GeneratedModel() override { model.terminate(); }
};

TEST_F(GeneratedModel, RunsItsBlocksAndStates) {
    ASSERT_TRUE(model.initialize()) << model.getErrors();
    EXPECT_EQ(Log::getSingleton().getErrors(), ""); // the dummy configuration leaves no noise
    for (int i = 0; i < 3; ++i) model.model()->TestModel_U.summand[i] = 10 * i;
    for (int step = 0; step < 4; ++step) {
        ASSERT_TRUE(model.step()) << model.getErrors();
        const double offset[] = {0.5, 0.25, 0.125};
        for (int i = 0; i < 3; ++i) {
            const double delayed = step == 0 ? 0 : 10 * i + i + 1;
            EXPECT_EQ(model.model()->TestModel_Y.sum[i], 2 * (delayed + 10 * i) + offset[i]);
            EXPECT_EQ(model.model()->TestModel_Y.ones[i], 1);
        }
    }
    EXPECT_NEAR(model.model()->getRTM()->Timing.t[0], 0.04, 1e-15);
    EXPECT_TRUE(model.terminate());
    ASSERT_TRUE(model.initialize()); // again, a new model
    EXPECT_TRUE(model.step());
}

TEST_F(GeneratedModel, GivesTheParametersOfItsBlocksByName) {
    ASSERT_TRUE(model.initialize());
    ASSERT_EQ(model.parameters().size(), 2u);
    double factor = 0;
    EXPECT_TRUE(model.parameters().at("TestModel/Accumulate").getParameter("factor", factor));
    EXPECT_EQ(factor, 2);
}

TEST_F(GeneratedModel, ReportsAFailedInitialisation) {
    TestModel_misdeed = "initialize returns false";
    EXPECT_FALSE(model.initialize());
    EXPECT_NE(model.getErrors().find("[Initialize]"), std::string::npos) << model.getErrors();
    EXPECT_NE(model.getErrors().find("refused on purpose"), std::string::npos) << model.getErrors();
    EXPECT_FALSE(model.step());
}

TEST_F(GeneratedModel, ReportsAFailedStepAndStops) {
    TestModel_misdeed = "output returns false";
    ASSERT_TRUE(model.initialize()) << model.getErrors();
    EXPECT_FALSE(model.step());
    EXPECT_NE(model.getErrors().find("[Output]"), std::string::npos) << model.getErrors();
    EXPECT_NE(model.getErrors().find("refused on purpose"), std::string::npos) << model.getErrors();
    EXPECT_LT(model.getErrors().size(), 1024u);
    EXPECT_FALSE(model.step());
}

TEST_F(GeneratedModel, SurvivesABlockThatThrows) {
    for (const char* how : {"throws", "throws 7"}) {
        const std::string reason =
            std::string(how) == "throws" ? ": thrown on purpose {0}" : " of unknown type";
        const auto misdeed = [&](const char* call) { return call + std::string(" ") + how; };
        const std::string initialize = misdeed("initialize"), output = misdeed("output"),
                          terminate = misdeed("terminate");
        TestModel_misdeed = initialize.c_str();
        EXPECT_FALSE(model.initialize());
        EXPECT_EQ(model.getErrors(), "[Initialize]a block threw an exception" + reason);
        TestModel_misdeed = output.c_str();
        ASSERT_TRUE(model.initialize()) << model.getErrors();
        EXPECT_FALSE(model.step());
        EXPECT_EQ(model.getErrors(), "[Output]a block threw an exception" + reason);
        TestModel_misdeed = terminate.c_str();
        ASSERT_TRUE(model.initialize()) << model.getErrors();
        EXPECT_FALSE(model.terminate());
        EXPECT_EQ(model.getErrors(), "[Terminate]a block threw an exception" + reason);
    }
}

TEST_F(GeneratedModel, SaysThatThereIsNoneYet) {
    EXPECT_FALSE(model.step());
    EXPECT_FALSE(model.terminate());
    EXPECT_EQ(model.getErrors(), "The model was not initialised.");
}

struct Information : testing::Test {
    CoderBlockInformation information;
    double memory[6] = {};
    Information() { Log::getSingleton().clear(); }
    static std::string errors() {
        const auto text = Log::getSingleton().getErrors();
        Log::getSingleton().clear();
        return text;
    }
};

TEST_F(Information, RefusesPortsThatCannotBe) {
    const auto type = Port::DataType::DOUBLE;
    EXPECT_TRUE(information.setInputPort({0, {1, 6}, type}, memory));
    EXPECT_FALSE(information.setInputPort({0, {1, 6}, type}, memory));
    EXPECT_NE(errors().find("input port 0 is set twice"), std::string::npos);
    EXPECT_FALSE(information.setOutputPort({0, {1, 6}, type}, nullptr));
    EXPECT_NE(errors().find("output port 0 has a null address"), std::string::npos);
    EXPECT_FALSE(information.setOutputPort({0, {1, 2, 3}, type}, memory));
    EXPECT_NE(errors().find("has 3 dimensions"), std::string::npos);
    EXPECT_FALSE(information.setOutputPort({0, {1, -1}, type}, memory));
    EXPECT_NE(errors().find("has size {1, -1}"), std::string::npos);
    EXPECT_TRUE(information.setOutputPort({0, {3, 1}, Port::DataType::SINGLE}, memory));
    EXPECT_EQ(information.getOutputPortWidth(0), 3); // a column has three elements as a row has
    EXPECT_EQ(information.getInputPortMatrixSize(0).cols, 6);
    EXPECT_EQ(information.getInputPortSignal(1), nullptr);
    EXPECT_NE(errors().find("there is no input port 1"), std::string::npos);
    EXPECT_EQ(information.getInputPortSignal(0).get(), information.getInputPortSignal(0).get());
}

TEST_F(Information, IsCalledAsTheGeneratedCodeSays) {
    std::string name = "?";
    EXPECT_TRUE(information.getUniqueName(name)); // code that gives no name has an empty one
    EXPECT_EQ(name, "");
    EXPECT_TRUE(information.setBlockName("model/old"));
    EXPECT_TRUE(information.getUniqueName(name));
    EXPECT_EQ(name, "model/old");
}

TEST_F(Information, ComparesDeclaredPortsWithTheGeneratedOnes) {
    const auto type = Port::DataType::DOUBLE;
    information.setUniqueBlockName("model/block");
    EXPECT_TRUE(information.setPortsInfo({{0, {2}, type}}, {})); // no ports known: a temporary object
    information.setInputPort({0, {1, 6}, type}, memory);
    EXPECT_TRUE(information.setPortsInfo({{0, {Port::DynamicSize}, type}}, {}));
    EXPECT_TRUE(information.setPortsInfo({{0, {6}, type}}, {}));
    EXPECT_FALSE(information.setPortsInfo({{0, {5}, type}}, {}));
    EXPECT_NE(
        errors().find("block 'model/block': input port 0 is declared {5}, the generated code has {1, 6}"),
        std::string::npos);
    EXPECT_FALSE(information.setPortsInfo({}, {}));
    EXPECT_NE(errors().find("it declares 0 input ports, the generated code has 1"), std::string::npos);
}

TEST_F(Information, GivesParametersWhoseDeclarationsMatch) {
    Parameters stored, read;
    EXPECT_FALSE(information.storeRTWParameters(stored));
    stored.storeParameter(std::vector<double>{1, 2}, {ParameterType::DOUBLE, 2, 1, 2, "gains"});
    stored.storeParameter(1, {ParameterType::INT, 3, 1, 1, "count"});
    ASSERT_TRUE(information.storeRTWParameters(stored));
    for (int again = 0; again < 2; ++again) { // the declarations are consumed
        ASSERT_TRUE(information.addParameterMetadata(
            {ParameterType::DOUBLE, 2, 1, ParameterMetadata::DynamicSize, "gains"}));
        ASSERT_TRUE(information.parseParameters(read)) << errors();
    }
    EXPECT_TRUE(read.existName("count")); // all of them, not only the declared
    errors();
    information.addParameterMetadata({ParameterType::BOOL, 3, 1, 1, "count"});
    EXPECT_FALSE(information.addParameterMetadata({ParameterType::BOOL, 3, 1, 1, "count"}));
    EXPECT_NE(errors().find("parameter 'count' is declared twice"), std::string::npos);
    EXPECT_FALSE(information.parseParameters(read));
    EXPECT_NE(errors().find(
                  "parameter 'count' is declared with index 3, size 1x1 and type 1, the generated code has"),
              std::string::npos);
    information.addParameterMetadata({ParameterType::BOOL, 4, 1, 1, "none"});
    EXPECT_FALSE(information.parseParameters(read));
    EXPECT_NE(errors().find("the generated code has no parameter 'none'"), std::string::npos);
}

} // namespace
} // namespace blockfactory::coder

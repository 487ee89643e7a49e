// What a user of the S-function sees: parameters of every encoding, sizes, states, changes, errors.
#include "BlockFactory/SimulinkCoder/CoderBlockInformation.h"
#include "bf/boundary/hosted_block.hpp"
#include "simstruct/model.hpp"

#include <BlockFactory/Core/Block.h>
#include <BlockFactory/Core/FactorySingleton.h>
#include <BlockFactory/Core/Log.h>
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

extern "C" const SimStructMethods simstruct_methods;

namespace {

using simstruct::Error;
using simstruct::logical;
using simstruct::matrix;
using simstruct::Model;
using simstruct::number;
using simstruct::text;
using simstruct::texts;

// Read once, when the first plugin is asked for.
[[maybe_unused]] const bool path_is_set =
    setenv("BLOCKFACTORY_PLUGIN_PATH",
           BF_TEST_PLUGINS ":" BF_PLUGIN_DIRECTORY ":" BF_PLUGIN_DIRECTORY "/legacy", 1) == 0;

std::vector<mxArray*> legacy(const char* name, std::vector<mxArray*> rest) {
    rest.insert(rest.begin(), {text(name), text("LegacyPlugin")});
    return rest;
}
std::vector<mxArray*> standard(const char* name, std::vector<mxArray*> rest) {
    rest.insert(rest.begin(), {text(name), text("standard")});
    return rest;
}
mxArray* structure(const char* name, mxArray* value) {
    mxArray* made = mxCreateStructMatrix(1, 1, 1, &name);
    mxSetField(made, 0, name, value);
    return made;
}
std::vector<double> output(const Model& model, int block, int count, int port = 0) {
    const auto* data = static_cast<const double*>(model.output(block, port));
    return {data, data + count};
}
void write(Model& model, int source, const std::vector<double>& values) {
    std::memcpy(model.input(source), values.data(), values.size() * sizeof(double));
}
template <class F> std::string error_of(F&& f) {
    try {
        f();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}
#define EXPECT_HAS(whole, part)                                                                              \
    EXPECT_NE(std::string(whole).find(part), std::string::npos) << "text: " << whole

/// A model of one block whose inputs have these widths.
struct One {
    Model model{simstruct_methods, 0.01};
    int block;
    std::vector<int> inputs;
    One(std::vector<mxArray*> parameters, const std::vector<int>& widths)
        : block(model.add("m/b", parameters)) {
        for (std::size_t i = 0; i < widths.size(); ++i) {
            inputs.push_back(model.add_input(widths[i], 0, SS_DOUBLE));
            model.connect(inputs.back(), 0, block, static_cast<int>(i));
        }
    }
    One& go() {
        model.compile();
        model.start();
        return *this;
    }
};
std::string refusal(std::vector<mxArray*> parameters, const std::vector<int>& widths = {}, int steps = 0) {
    One one(std::move(parameters), widths);
    return error_of([&] {
        one.go();
        for (int i = 0; i < steps; ++i) one.model.step();
    });
}

// ---- parameters

TEST(SFunctionParameters, OfAllEncodingsReachAnOldBlock) {
    One one(legacy("AllParameters", {matrix(1, 1, {7}, mxINT32_CLASS), logical(true), number(2.5),
                                     text("four"), matrix(1, 3, {1, 2, 3}, mxSINGLE_CLASS), texts({"a", "b"}),
                                     structure("field", number(-1))}),
            {});
    one.go().model.step();
    EXPECT_EQ(output(one.model, one.block, 9), (std::vector<double>{7, 1, 2.5, 4, 1, 2, 3, 2, -1}));
}

TEST(SFunctionParameters, OfTheBaseOfAnOldBlockAreGivenWithItsOwn) {
    for (const char* name : {"Offset", "LateOffset"}) {
        const char* names[] = {"gain", "unit"};
        mxArray* fields = mxCreateStructMatrix(1, 1, 2, names);
        mxSetField(fields, 0, "gain", number(2));
        mxSetField(fields, 0, "unit", text("m"));
        std::vector<mxArray*> parameters{fields, text("four"), number(0.5)};
        if (name == std::string("LateOffset")) parameters.push_back(text("never read"));
        One one(legacy(name, parameters), {1});
        one.go();
        write(one.model, one.inputs[0], {10});
        one.model.step();
        EXPECT_EQ(output(one.model, one.block, 1), (std::vector<double>{24.5})) << name;
    }
}

TEST(SFunctionParameters, OfANativeBlockAreMatricesTextsListsAndSwitches) {
    One gain(standard("Gain", {text("K*u"), text("wrap"), matrix(2, 3, {1, 2, 3, 4, 5, 6}), number(-1)}),
             {3});
    gain.go();
    write(gain.model, gain.inputs[0], {1, 10, 100});
    gain.model.step();
    EXPECT_EQ(output(gain.model, gain.block, 2), (std::vector<double>{531, 642}));
    // The type of a value decides where nothing else does.
    One constant(standard("Constant", {logical(true), matrix(1, 2, {3, 4}, mxUINT8_CLASS), number(-1)}), {});
    constant.go();
    EXPECT_EQ(constant.model.output_type(constant.block, 0), SS_UINT8);
    // A cell array of numbers, as it is and as the field of a struct.
    for (const bool in_struct : {false, true}) {
        mxArray* cells = mxCreateCellMatrix(1, 3);
        for (std::size_t i = 0; i < 3; ++i) mxSetCell(cells, i, i == 1 ? logical(true) : number(4));
        One listed(
            standard("Constant", {logical(true), in_struct ? structure("value", cells) : cells, number(-1)}),
            {});
        listed.go().model.step();
        EXPECT_EQ(output(listed.model, listed.block, 3), (std::vector<double>{4, 1, 4}));
    }
}

TEST(SFunctionParameters, ThatDoNotFitAreNamedWithPathAndCallback) {
    EXPECT_EQ(refusal({number(1)}),
              "m/b, mdlInitializeSizes: it needs at least two parameters: 'Class', 'Library'");
    EXPECT_HAS(refusal(standard("Gain", {})),
               "m/b, mdlInitializeSizes: it has 2 parameters, but takes 6: 'Gain', "
               "'standard', multiplication, on_overflow, K, sample_time");
    EXPECT_HAS(refusal({number(1), text("standard")}),
               "parameter 1 is the block's class and must be a text, not");
    EXPECT_HAS(refusal({text("Gian"), text("standard")}), "there is no block 'Gian'; did you mean 'Gain'");
    EXPECT_HAS(refusal({text("X"), text("NoPlugin")}), "plugin 'NoPlugin' was not found: searched ");
    EXPECT_HAS(refusal(standard("Gain", {text("K+u"), text("wrap"), number(1), number(-1)})),
               "'multiplication' is 'K+u', but must be one of");
    EXPECT_HAS(refusal(standard("Gain", {text("elementwise"), text("wrap"), text("two"), number(-1)})),
               "parameter 'K' must be a number, not");
    EXPECT_HAS(
        refusal(standard("Gain", {text("elementwise"), text("wrap"), structure("k", number(1)), number(-1)})),
        "parameter 'K' is not among the fields of its struct");
    EXPECT_HAS(refusal(standard("Gain", {text("elementwise"), text("wrap"), number(1), number(-2)})),
               "sample_time must be -1 (inherited), 0 (continuous), a period, or [period offset], not -2");
    EXPECT_HAS(refusal(standard("Quantize", {number(0), number(-1)}), {1}),
               "parameter 'interval' must be greater than 0, but is 0");
    EXPECT_HAS(refusal(standard("CounterFree", {number(40), number(-1)})),
               "argument 'bits' must be from 1 to 32, but is 40");
    EXPECT_HAS(refusal(legacy("AllParameters",
                              {number(7.5), logical(true), number(2.5), text("four"), matrix(1, 3, {1, 2, 3}),
                               texts({"a"}), structure("field", number(1))})),
               "parameter 'period' must be a whole number, not 7.5");
    EXPECT_HAS(refusal(legacy("AllParameters",
                              {number(7), logical(true), number(2.5), number(4), matrix(1, 3, {1, 2, 3}),
                               texts({"a"}), structure("field", number(1))})),
               "parameter 'text' must be a text, not 4");
}

// ---- sizes, types, feedthrough

TEST(SFunctionPorts, TakeTheirSizesFromEitherSideOfAWire) {
    // A vector product takes 3-vectors: so the delay that it reads has three elements.
    Model model(simstruct_methods, 0.01);
    const int delay = model.add("m/delay", standard("UnitDelay", {number(0.5), number(-1)}));
    const int cross = model.add("m/cross", standard("Cross", {number(-1)}));
    const int source = model.add_input(3, 0, SS_DOUBLE);
    model.connect(delay, 0, cross, 0);
    model.connect(source, 0, cross, 1);
    model.compile();
    EXPECT_EQ(model.output_dimensions(delay, 0), std::vector<int>{3});
    const auto& calls = model.calls(delay);
    EXPECT_NE(std::find(calls.begin(), calls.end(), "mdlSetOutputPortDimensionInfo"), calls.end());
}

TEST(SFunctionPorts, FeedThroughOnlyWhatTheOutputReads) {
    // A sum that reads its own delayed value is no loop; without the delay it is one.
    Model model(simstruct_methods, 0.01);
    const int sum = model.add("m/sum", standard("Sum", {text("++"), text("wrap"), number(-1)}));
    const int delay = model.add("m/delay", standard("UnitDelay", {number(0), number(-1)}));
    const int source = model.add_input(3, 0, SS_DOUBLE);
    model.connect(source, 0, sum, 0);
    model.connect(delay, 0, sum, 1);
    model.connect(sum, 0, delay, 0);
    model.compile();
    EXPECT_FALSE(model.feeds_through(delay, 0));
    EXPECT_TRUE(model.feeds_through(sum, 0));
    model.start();
    write(model, source, {2, 3, 4});
    for (int i = 0; i < 5; ++i) model.step();
    EXPECT_EQ(output(model, sum, 3), (std::vector<double>{10, 15, 20}));

    Model loop(simstruct_methods, 0.01);
    const int a =
        loop.add("m/a", standard("Gain", {text("elementwise"), text("wrap"), number(2), number(-1)}));
    loop.connect(a, 0, a, 0);
    EXPECT_EQ(error_of([&] { loop.compile(); }), "m/a: it is in an algebraic loop");
}

TEST(SFunctionPorts, ThatNothingSizesAreScalars) {
    One one(standard("Abs", {number(-1)}), {});
    one.go();
    EXPECT_EQ(one.model.output_dimensions(one.block, 0), std::vector<int>{1});
}

TEST(SFunctionPorts, ThatContradictTheWiringAreNamed) {
    EXPECT_HAS(
        refusal(standard("Sum", {text("++"), text("wrap"), number(-1)}), {3, 4}),
        "m/b, mdlSetInputPortDimensionInfo: input 'u1' of size [3] and input 'u2' of size [4] cannot be "
        "combined");
    // A size that the block fixes is known to Simulink before it comes to the wire.
    EXPECT_EQ(refusal(standard("Cross", {number(-1)}), {4, 4}),
              "m/b: input port 1 has size [3] but is driven by [4]");
    EXPECT_HAS(refusal(standard("SumOfElements", {number(1), number(-1), number(0)}), {4}),
               "parameters, but takes");
    EXPECT_HAS(
        refusal(standard("Gain", {text("K*u"), text("wrap"), matrix(2, 3, {1, 2, 3, 4, 5, 6}), number(-1)}),
                {4}),
        "m/b, mdlSetInputPortDimensionInfo: ");
}

// ---- states, order of calls

TEST(SFunctionStates, AreSeenAndOwnedBySimulink) {
    One one(standard("UnitDelay", {matrix(1, 2, {8, 9}), number(-1)}), {2});
    one.go();
    ASSERT_EQ(one.model.state_names(one.block), std::vector<std::string>{"x"});
    const auto state = [&] {
        const auto* x = static_cast<const double*>(one.model.state(one.block, "x"));
        return std::vector<double>{x[0], x[1]};
    };
    EXPECT_EQ(state(), (std::vector<double>{8, 9}));
    write(one.model, one.inputs[0], {1, 2});
    one.model.step();
    EXPECT_EQ(state(), (std::vector<double>{1, 2}));
    // Simulink writes a state; the block goes on from there.
    *static_cast<double*>(const_cast<void*>(one.model.state(one.block, "x"))) = 5;
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 2), (std::vector<double>{5, 2}));
}

TEST(SFunctionStates, ThatAreContinuousAreIntegratedBySimulink) {
    // x' = -x by feedback; classical Runge-Kutta of one step is 1 - h + h^2/2 - h^3/6 + h^4/24
    Model model(simstruct_methods, 0.1, simstruct::Solver::runge_kutta_4);
    const int x = model.add("m/x", standard("Integrator", {number(1), number(-1)}));
    const int minus = model.add("m/minus", standard("Negate", {number(-1)}));
    model.connect(x, 0, minus, 0);
    model.connect(minus, 0, x, 0);
    model.compile();
    ASSERT_EQ(model.continuous_states(x).size(), 1u);
    EXPECT_FALSE(model.feeds_through(x, 0));
    model.start();
    model.step();
    const double h = 0.1;
    EXPECT_NEAR(model.continuous_states(x)[0], 1 - h + h * h / 2 - h * h * h / 6 + h * h * h * h / 24, 1e-15);
}

TEST(SFunctionStates, JumpWhereAGuardCrossesZero) {
    Model model(simstruct_methods, 0.25);
    const int saw = model.add("m/saw", {text("Sawtooth"), text("NativePlugin"), number(-1)});
    model.compile();
    model.start();
    std::vector<double> seen;
    for (int k = 0; k < 7; ++k) {
        model.step();
        seen.push_back(output(model, saw, 1)[0]);
    }
    EXPECT_EQ(seen, (std::vector<double>{1, 0.75, 0.5, 0.25, 1, 0.75, 0.5}));
}

TEST(SFunctionStates, GoBackToTheirInitialValuesWhenASubsystemResets) {
    One delay(standard("UnitDelay", {number(4), number(-1)}), {1});
    delay.go();
    write(delay.model, delay.inputs[0], {1});
    delay.model.step();
    delay.model.reset(delay.block);
    delay.model.step();
    EXPECT_EQ(output(delay.model, delay.block, 1)[0], 4);
}

TEST(SFunctionStates, AreSavedAndRestoredExactly) {
    One one(standard("UnitDelay", {number(0), number(-1)}), {1});
    one.go();
    write(one.model, one.inputs[0], {3});
    one.model.step();
    mxArray* saved = one.model.save(one.block);
    write(one.model, one.inputs[0], {7});
    one.model.step();
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 1)[0], 7);
    one.model.restore(one.block, saved);
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 1)[0], 3);
    mxDestroyArray(saved);
    mxArray* wrong = number(1);
    EXPECT_EQ(error_of([&] { one.model.restore(one.block, wrong); }),
              "m/b, mdlSetSimState: the saved state is of another block or of other sizes");
    mxDestroyArray(wrong);
}

TEST(SFunctionStates, ThatAnOldBlockHidesAreNotSaved) {
    One one(legacy("Accumulate", {number(1), matrix(1, 2, {0, 0})}), {2, 2});
    one.go().model.step();
    EXPECT_EQ(error_of([&] { one.model.save(one.block); }),
              "m/b, mdlGetSimState: its state lies outside and cannot be saved");
}

TEST(SFunctionLifeCycle, IsTheDocumentedOne) {
    One one(standard("UnitDelay", {number(0), number(-1)}), {2});
    one.go().model.step();
    one.model.terminate();
    EXPECT_EQ(one.model.calls(one.block),
              (std::vector<std::string>{"mdlInitializeSizes", "mdlSetInputPortDimensionInfo",
                                        "mdlSetInputPortDataType", "mdlInitializeSampleTimes",
                                        "mdlSetWorkWidths", "mdlStart", "mdlInitializeConditions",
                                        "mdlOutputs", "mdlUpdate", "mdlTerminate"}));
}

TEST(SFunctionLifeCycle, OfAnOldBlockIsTheOneItKnows) {
    const auto lives = [] {
        void* plugin = dlopen(BF_TEST_PLUGINS "/libLegacyPlugin.so", RTLD_NOW);
        std::istringstream lines(reinterpret_cast<const char* (*)()>(dlsym(plugin, "legacy_diary"))());
        std::map<int, std::vector<std::string>> calls; // by object
        std::string call;
        for (int object = 0; lines >> object >> call;) calls[object].push_back(call);
        return calls;
    };
    lives();
    {
        One one(legacy("Diary", {}), {1});
        one.go();
        for (int step = 0; step < 2; ++step) one.model.step();
        one.model.reset(one.block);
        one.model.step();
        one.model.terminate();
    }
    int ran = 0;
    for (const auto& [object, life] : lives()) {
        EXPECT_EQ(life.front(), "create");
        EXPECT_EQ(life.back(), "destroy");
        if (life.size() == 3) {
            EXPECT_TRUE(life[1] == "parseParameters" || life[1] == "configureSizeAndPorts") << life[1];
            continue;
        }
        ++ran;
        EXPECT_EQ(life, (std::vector<std::string>{"create", "initialize", "initializeInitialConditions",
                                                  "output", "updateDiscreteState", "output",
                                                  "updateDiscreteState", "initializeInitialConditions",
                                                  "output", "updateDiscreteState", "terminate", "destroy"}));
    }
    EXPECT_EQ(ran, 1);
}

TEST(SFunctionLifeCycle, MayEndAtAnyPointAndBeginAgain) {
    for (int round = 0; round < 3; ++round) {
        One one(standard("UnitDelay", {number(1), number(-1)}), {1});
        if (round > 0) one.model.compile();
        if (round > 1) one.model.start();
        EXPECT_NO_THROW(one.model.terminate());
        EXPECT_NO_THROW(one.go().model.step());
        EXPECT_EQ(output(one.model, one.block, 1)[0], 1);
    }
}

TEST(SFunctionRates, HoldASlowBlockBetweenItsHits) {
    Model model(simstruct_methods, 0.01);
    const int source = model.add_input(1, 0, SS_DOUBLE);
    const int slow = model.add("m/slow", standard("UnitDelay", {number(0), matrix(1, 2, {0.02, 0.01})}));
    model.connect(source, 0, slow, 0);
    model.compile();
    model.start();
    std::vector<double> seen;
    for (int k = 1; k <= 6; ++k) {
        write(model, source, {static_cast<double>(k)});
        model.step();
        seen.push_back(output(model, slow, 1)[0]);
    }
    EXPECT_EQ(seen, (std::vector<double>{0, 0, 0, 2, 2, 4}));
}

// ---- changes while running

TEST(SFunctionTuning, ChangesAParameterBetweenTwoSteps) {
    One one(standard("Gain", {text("elementwise"), text("wrap"), number(2), number(-1)}), {2});
    one.go();
    write(one.model, one.inputs[0], {1, 2});
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 2), (std::vector<double>{2, 4}));
    one.model.change(one.block, 4, number(5));
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 2), (std::vector<double>{5, 10}));
    EXPECT_EQ(error_of([&] {
                  one.model.change(one.block, 4, matrix(1, 3, {1, 2, 3}));
              }).substr(0, 24),
              "m/b, mdlCheckParameters:");
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 2), (std::vector<double>{5, 10}));
    EXPECT_HAS(error_of([&] { one.model.change(one.block, 2, text("K*u")); }), "cannot change in a run");
}

TEST(SFunctionTuning, RefusesValuesOutsideOfTheirLimits) {
    One one(standard("Quantize", {number(0.5), number(-1)}), {1});
    one.go();
    EXPECT_EQ(error_of([&] { one.model.change(one.block, 2, number(0)); }),
              "m/b, mdlCheckParameters: parameter 'interval' must be greater than 0, but is 0");
    write(one.model, one.inputs[0], {1.6});
    one.model.step();
    EXPECT_EQ(output(one.model, one.block, 1), (std::vector<double>{1.5}));
}

// ---- what goes wrong in an old block

TEST(SFunctionErrors, OfOldBlocksCarryPathPluginBlockAndCall) {
    const auto misbehave = [](const char* misdeed) {
        return refusal(legacy("Misbehaves", {text(misdeed)}), {3}, 1);
    };
    const std::pair<const char*, const char*> cases[] = {
        {"parseParameters returns false", "parseParameters: returned false: refused on purpose"},
        {"configureSizeAndPorts throws", "configureSizeAndPorts: threw an exception: thrown on purpose"},
        {"initialize throws 7", "initialize: threw an exception of unknown type"},
        {"initializeInitialConditions returns false",
         "initializeInitialConditions: returned false: refused on purpose"},
        {"output throws", "output: threw an exception: thrown on purpose"},
        {"updateDiscreteState returns false", "updateDiscreteState: returned false: refused on purpose"},
        {"ports twice", "the ports are declared twice"},
        {"port index twice", "output port 0 is declared twice"},
        {"wrong type", "The parameter 'misdeed' is of another type"},
        {"signal too early", "input port 0 has no signal yet"},
        {"grows", "4 elements were set in a signal that has 3"}};
    for (const auto& [misdeed, text] : cases) {
        const auto error = misbehave(misdeed);
        EXPECT_HAS(error, text);
        EXPECT_HAS(error, "m/b, mdl");
        EXPECT_HAS(error, "plugin 'LegacyPlugin', block 'Misbehaves'");
    }
    EXPECT_EQ(misbehave("none"), "");
}

TEST(SFunctionErrors, ThatDoNotEndARunAreWarnings) {
    One one(legacy("Misbehaves", {text("shrinks")}), {3});
    one.go().model.step();
    ASSERT_FALSE(one.model.warnings(one.block).empty());
    EXPECT_HAS(one.model.warnings(one.block)[0], "Only 2 of the 3 elements");
    EXPECT_NO_THROW(one.model.step());
}

// ---- generated code

/// What the printed code of BlockFactory.tlc does with the record.
blockfactory::core::Parameters stored(const std::vector<std::vector<simstruct::Setting>>& record) {
    using namespace blockfactory::core;
    Parameters parameters;
    for (std::size_t i = 1; i < record.size(); ++i) {
        const auto get = [&](const std::string& name) {
            for (const auto& setting : record[i])
                if (setting.name == name) return setting.value;
            throw Error("the record has no " + name);
        };
        const auto number_of = [&](const char* name) {
            return static_cast<int>(std::get<double>(get(name)));
        };
        const auto values = std::get<std::vector<double>>(get("value"));
        const auto lengths = std::get<std::vector<double>>(get("lengths"));
        const std::string storage = std::get<std::string>(get("storage"));
        const ParameterMetadata metadata(static_cast<ParameterType>(number_of("type")),
                                         static_cast<unsigned>(number_of("index")), number_of("rows"),
                                         number_of("cols"), std::get<std::string>(get("name")));
        const bool is_scalar = number_of("isScalar") != 0;
        if (storage == "std::string") {
            std::vector<std::string> all;
            auto code = values.begin();
            for (int t = 0; t < number_of("texts"); ++t) {
                all.emplace_back(code, code + static_cast<int>(lengths[static_cast<std::size_t>(t)]));
                code += static_cast<int>(lengths[static_cast<std::size_t>(t)]);
            }
            is_scalar ? parameters.storeParameter(all.at(0), metadata)
                      : parameters.storeParameter(all, metadata);
        } else {
            const std::vector<double> all(values.begin(), values.begin() + number_of("values"));
            is_scalar ? parameters.storeParameter(all.at(0), metadata)
                      : parameters.storeParameter(all, metadata);
        }
    }
    return parameters;
}

/// Steps of the class behind the record, as generated code makes them.
std::vector<std::vector<double>> run_record(const std::vector<std::vector<simstruct::Setting>>& record,
                                            const std::vector<std::vector<double>>& inputs, int width,
                                            int steps) {
    using namespace blockfactory;
    const auto parameters = stored(record);
    coder::CoderBlockInformation information;
    information.setUniqueBlockName("m/b");
    information.storeRTWParameters(parameters);
    std::vector<std::vector<double>> in = inputs;
    std::vector<double> out(static_cast<std::size_t>(width));
    for (std::size_t i = 0; i < in.size(); ++i)
        information.setInputPort({i, {1, static_cast<int>(in[i].size())}, core::Port::DataType::DOUBLE},
                                 in[i].data());
    information.setOutputPort({0, {1, width}, core::Port::DataType::DOUBLE}, out.data());
    const auto text_of = [&](const char* name) {
        for (const auto& setting : record[0])
            if (setting.name == name) return std::get<std::string>(setting.value);
        throw Error("the record has no name");
    };
    const auto factory = core::ClassFactorySingleton::getInstance().getClassFactory(
        {text_of("libName"), text_of("className")});
    if (!factory) throw Error(core::Log::getSingleton().getErrors());
    core::Block* block = factory->create();
    std::vector<std::vector<double>> all;
    if (!block->initialize(&information) || !block->initializeInitialConditions(&information))
        throw Error(core::Log::getSingleton().getErrors());
    for (int k = 0; k < steps; ++k) {
        if (!block->output(&information)) throw Error(core::Log::getSingleton().getErrors());
        all.push_back(out);
    }
    block->terminate(&information);
    factory->destroy(block);
    return all;
}

TEST(SFunctionRecord, GivesGeneratedCodeTheSameBlock) {
    struct Case {
        std::vector<mxArray*> parameters;
        int inputs;
    };
    for (auto& c :
         {Case{legacy("Accumulate", {number(2), matrix(1, 3, {1, 2, 3})}), 2},
          Case{{text("Accumulate"), text("NativePlugin"), number(2), matrix(1, 3, {1, 2, 3}), number(-1)}, 2},
          Case{standard("UnitDelay", {matrix(1, 3, {1, 2, 3}), number(-1)}), 1},
          Case{{text("DiscreteFilter"), text("WholeBodyToolbox"), text("Generic"), matrix(1, 2, {1, 0.5}),
                matrix(1, 2, {1, -0.25}), number(1), number(3), matrix(0, 0, {}), matrix(0, 0, {}),
                number(-1)},
               1}}) {
        One one(c.parameters, std::vector<int>(static_cast<std::size_t>(c.inputs), 3));
        one.go();
        const auto record = one.model.rtw(one.block);
        const std::vector<std::vector<double>> inputs(static_cast<std::size_t>(c.inputs), {0.5, 1.5, 2.5});
        for (int i = 0; i < c.inputs; ++i)
            write(one.model, one.inputs[static_cast<std::size_t>(i)], inputs[0]);
        std::vector<std::vector<double>> expected;
        for (int k = 0; k < 4; ++k) {
            one.model.step();
            expected.push_back(output(one.model, one.block, 3));
        }
        // Generated code has no update phase for old blocks, whose state the test's class advances there.
        if (std::get<std::string>(record[0][3].value) == "LegacyPlugin") expected.resize(1);
        EXPECT_EQ(run_record(record, inputs, 3, static_cast<int>(expected.size())), expected)
            << std::get<std::string>(record[0][2].value);
    }
}

TEST(SFunctionRecord, RefusesWhatGeneratedCodeCannotRun) {
    One one(standard("Integrator", {number(0), number(-1)}), {1});
    one.go();
    EXPECT_EQ(error_of([&] { one.model.rtw(one.block); }),
              "m/b, mdlRTW: it has continuous states, which generated code cannot integrate");
}

} // namespace

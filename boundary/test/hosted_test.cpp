// Blocks of an old plugin in our engines.
#include "bf/boundary/hosted_block.hpp"

#include "../../blocks/test/run_block.hpp"
#include "BlockFactory/Core/Log.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

namespace bf::boundary {
namespace {

using test::RunBlock;

struct Hosted : testing::Test {
    Registry registry;
    Hosted() {
        registry.add_search_path(BF_TEST_PLUGINS);
        blockfactory::core::Log::getSingleton().clear();
    }
    RunBlock make(const std::string& name, const Arguments& arguments) {
        return RunBlock(registry.find("LegacyPlugin/" + name), arguments);
    }
    RunBlock misbehave(const std::string& misdeed) {
        return make("Misbehaves", {{"misdeed", misdeed}}).wire("u1", test::vector_size(3)).start();
    }
    /// What making or starting a misbehaving block reports.
    std::string error_of(const std::string& misdeed) {
        try {
            misbehave(misdeed).context().start(0);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    }
    static std::string where(const std::string& call) {
        return "plugin 'LegacyPlugin', block 'Misbehaves', " + call + ": ";
    }
    static bool has(const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    }
};

TEST_F(Hosted, AnOldPluginIsLoadedLikeAnyOther) {
    registry.load_plugin("LegacyPlugin");
    std::vector<std::string> names;
    for (const auto& known : registry.classes()) names.push_back(known->qualified_name());
    EXPECT_EQ(names, (std::vector<std::string>{
                         "LegacyPlugin/Accumulate", "LegacyPlugin/AllParameters", "LegacyPlugin/CannotBeMade",
                         "LegacyPlugin/Diary", "LegacyPlugin/LateOffset", "LegacyPlugin/Matrices",
                         "LegacyPlugin/Misbehaves", "LegacyPlugin/Nothing", "LegacyPlugin/Offset"}));
}

TEST_F(Hosted, ParametersAreArgumentsAndOpenSizesAreWired) {
    auto run = make("Accumulate", {{"factor", 2.0}, {"bias", Matrix(Matrix::Ones(1, 3))}});
    run.wire("u1", test::vector_size(3)).wire("u2", test::vector_size(3)).start();
    EXPECT_EQ(run.size("y1"), test::vector_size(3));
    run.context().start(0);
    run.set("u1", std::vector<double>{1, 2, 3}).set("u2", std::vector<double>{10});
    for (int step = 0; step < 3; ++step) {
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("y1"), Eigen::Vector3d(23 + step, 25 + step, 27 + step));
    }
    run.reset();
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("y1")(0), 23);
    run.context().stop(0);
    EXPECT_FALSE(run.output());
}

TEST_F(Hosted, ParametersOfAllTypesArrive) {
    Matrix three(1, 3);
    three << 7, 8, 9;
    auto run = make("AllParameters", {{"period_", 3}, // a model file keeps `period` for itself
                                      {"flag", true},
                                      {"real", 0.5},
                                      {"text", "four"},
                                      {"three", three},
                                      {"cells", std::vector<std::string>{"a", "b"}},
                                      {"field", 6.5}});
    run.start().context().start(0);
    ASSERT_TRUE(run.step());
    Vector told(9);
    told << 3, 1, 0.5, 4, 7, 8, 9, 2, 6.5;
    EXPECT_EQ(run.get("y1"), told);
}

TEST_F(Hosted, ParametersThatABaseClassDeclaresAreAmongThem) {
    const Arguments given{{"gain", 2.0}, {"unit", "m"}, {"label", "four"}, {"shift", 0.5}};
    for (const std::string name : {"Offset", "LateOffset"}) {
        SCOPED_TRACE(name);
        auto run = make(name, given);
        std::vector<std::string> arguments;
        for (const auto& argument : run.declaration().arguments) arguments.push_back(argument.name);
        std::vector<std::string> expected{"gain", "unit", "label", "shift"};
        if (name == "LateOffset") expected.push_back("ParamIndex_5"); // counted, and never declared
        EXPECT_EQ(arguments, expected);
        run.start().context().start(0);
        run.set("u1", std::vector<double>{10});
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("y1")(0), 2 * 10 + 4 + 0.5);

        const auto stored = stored_parameters("LegacyPlugin", name, given); // for generated code
        double shift = 0, gain = 0;
        EXPECT_TRUE(stored.getParameter("shift", shift) && stored.getParameter("gain", gain));
        EXPECT_EQ(gain + shift, 2.5);
        try {
            make(name, {{"gain", 2.0}, {"unit", "m"}, {"shift", 0.5}});
            FAIL() << "made without a label";
        } catch (const std::exception& error) {
            EXPECT_TRUE(has(error.what(), "the argument 'label' is missing; give a value")) << error.what();
        }
        try {
            make(name, {{"gain", "much"}, {"unit", "m"}, {"label", "four"}, {"shift", 0.5}});
            FAIL() << "made with a text for a number";
        } catch (const std::exception& error) {
            EXPECT_TRUE(has(error.what(), "parameter 'gain' must be a number")) << error.what();
        }
    }
}

TEST_F(Hosted, LivesByTheOrderOfCallsThatOldEnginesKeep) {
    registry.load_plugin("LegacyPlugin");
    void* plugin = dlopen(BF_TEST_PLUGINS "/libLegacyPlugin.so", RTLD_NOW | RTLD_NOLOAD);
    ASSERT_NE(plugin, nullptr);
    const auto diary = reinterpret_cast<const char* (*)()>(dlsym(plugin, "legacy_diary"));
    ASSERT_NE(diary, nullptr);
    diary();
    {
        auto run = make("Diary", {});
        run.start();
        run.context().start(0);
        for (int step = 0; step < 2; ++step) ASSERT_TRUE(run.step());
        run.reset();
        ASSERT_TRUE(run.step());
        run.context().stop(0);
    }
    std::map<int, std::vector<std::string>> calls; // by object
    std::istringstream lines(diary());
    std::string call;
    for (int object = 0; lines >> object >> call;) calls[object].push_back(call);
    dlclose(plugin);

    // Objects that tell parameters and sizes are gone before the one that runs begins; it is never
    // configured.
    const std::vector<std::string> parsed{"create", "parseParameters", "destroy"},
        sized{"create", "configureSizeAndPorts", "destroy"},
        ran{"create",
            "initialize",
            "initializeInitialConditions",
            "output",
            "updateDiscreteState",
            "output",
            "updateDiscreteState",
            "initializeInitialConditions",
            "output",
            "updateDiscreteState",
            "terminate",
            "destroy"};
    ASSERT_EQ(calls.size(), 3u);
    std::vector<std::vector<std::string>> lives;
    for (const auto& [object, life] : calls) lives.push_back(life);
    EXPECT_EQ(lives, (std::vector<std::vector<std::string>>{parsed, sized, ran}));
}

TEST_F(Hosted, ElementTypesAndMatricesPass) {
    auto run = make("Matrices", {});
    run.wire("u1", test::matrix_size(2, 3), Type::float32).start();
    EXPECT_EQ(run.type("y1"), Type::float32);
    run.context().start(0);
    run.set("u1", std::vector<double>{1, 2, 3, 4, 5, 6});
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("y1")(1, 2), 12);
}

TEST_F(Hosted, TheHiddenStateRefusesSnapshots) {
    auto run = make("Matrices", {}).wire("u1", test::matrix_size(2, 3), Type::float32).start();
    EXPECT_EQ(run.context().refuses_snapshot(), 0);
}

TEST_F(Hosted, MissingAndWrongArgumentsAreNamed) {
    const auto problem = [&](const std::string& name, const Arguments& arguments) -> std::string {
        try {
            make(name, arguments);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_TRUE(has(problem("Accumulate", {}),
                    "plugin 'LegacyPlugin', block 'Accumulate', parseParameters: the "
                    "arguments 'factor', 'bias' are missing; give a value"));
    const Arguments given{{"period_", 3.5}, {"flag", true}, {"real", 0.5}, {"text", "four"},
                          {"three", 1},     {"cells", "a"}, {"field", 1}};
    const auto text = problem("AllParameters", given);
    EXPECT_TRUE(has(text, "parameter 'period' must be a whole number, not 3.5")) << text;
    EXPECT_TRUE(has(text, "parameter 'three' must have 3 elements, not 1")) << text;
    EXPECT_TRUE(has(problem("Misbehaves", {{"misdeed", 3}}), "parameter 'misdeed' must be a text, not 3"));
    EXPECT_TRUE(has(problem("Accumulate", {{"factor", 1}, {"bias", Matrix(Matrix::Ones(2, 2))}}),
                    "parameter 'bias' is a 2x2 matrix: 2D parameters are not supported"));
}

TEST_F(Hosted, EveryFailingStageIsReportedWithPluginBlockAndCall) {
    for (const std::string call :
         {"parseParameters", "configureSizeAndPorts", "initialize", "initializeInitialConditions"}) {
        EXPECT_TRUE(has(error_of(call + " returns false"), "returned false: "))
            << error_of(call + " returns false");
        EXPECT_TRUE(has(error_of(call + " returns false"), "refused on purpose"));
        EXPECT_TRUE(has(error_of(call + " returns false"), where(call))) << error_of(call + " returns false");
        EXPECT_EQ(error_of(call + " throws").substr(0, where(call).size()), where(call));
        EXPECT_TRUE(has(error_of(call + " throws"), "threw an exception: thrown on purpose (0)"));
        EXPECT_TRUE(has(error_of(call + " throws 7"), where(call) + "threw an exception of unknown type"));
    }
    for (const std::string call : {"output", "updateDiscreteState"}) {
        const auto fail = [&](const std::string& how) {
            auto run = misbehave(call + how);
            run.context().start(0);
            return run.step().text();
        };
        EXPECT_TRUE(has(fail(" returns false"), where(call) + "returned false: ")) << fail(" returns false");
        EXPECT_EQ(fail(" throws"), where(call) + "threw an exception: thrown on purpose (0)");
        EXPECT_EQ(fail(" throws 7"), where(call) + "threw an exception of unknown type");
    }
    for (const std::string how : {" returns false", " throws", " throws 7"}) {
        auto run = misbehave("terminate" + how);
        run.context().start(0);
        run.context().stop(0);
        EXPECT_TRUE(has(blockfactory::core::Log::getSingleton().getWarnings(), where("terminate")));
        blockfactory::core::Log::getSingleton().clear();
    }
    EXPECT_EQ(error_of("none"), "");
}

TEST_F(Hosted, MisuseOfTheInterfaceIsReported) {
    EXPECT_TRUE(has(error_of("ports twice"), where("configureSizeAndPorts") + "returned false: "));
    EXPECT_TRUE(has(error_of("ports twice"), "the ports are declared twice"));
    EXPECT_TRUE(has(error_of("port index twice"), "output port 0 is declared twice"))
        << error_of("port index twice");
    EXPECT_TRUE(has(error_of("wrong type"), "The parameter 'misdeed' is of another type"))
        << error_of("wrong type");
    EXPECT_TRUE(has(error_of("signal too early"), "input port 0 has no signal yet"))
        << error_of("signal too early");
    EXPECT_TRUE(has(error_of("logs in a log"), "parameter 7 is called '', which is wrong\n"
                                               "There is no parameter of index 7."))
        << error_of("logs in a log");
    auto grows = misbehave("grows");
    grows.context().start(0);
    EXPECT_TRUE(has(grows.step().text(), "4 elements were set in a signal that has 3"));
}

TEST_F(Hosted, AShrunkSignalKeepsItsWidthAndIsReported) {
    auto run = misbehave("shrinks");
    run.context().start(0);
    for (int step = 0; step < 2; ++step) ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("y1"), Eigen::Vector3d(1, 1, 0));
    const auto warnings = blockfactory::core::Log::getSingleton().getWarnings();
    EXPECT_TRUE(has(warnings, where("output"))) << warnings;
    EXPECT_TRUE(has(warnings, "Only 2 of the 3 elements")) << warnings;
}

TEST_F(Hosted, AConstructorThatThrowsIsReported) {
    try {
        make("CannotBeMade", {});
        FAIL();
    } catch (const std::exception& error) {
        EXPECT_TRUE(has(error.what(), "plugin 'LegacyPlugin', block 'CannotBeMade', constructor: threw an "
                                      "exception: no device"))
            << error.what();
    }
}

TEST_F(Hosted, PluginsThatCannotBeHostedAreRefused) {
    const auto refusal = [&](const std::string& plugin) -> std::string {
        try {
            registry.load_plugin(plugin);
        } catch (const PluginError& error) {
            return error.what();
        }
        return "";
    };
    for (int again = 0; again < 2; ++again) {
        EXPECT_TRUE(has(refusal("NoFactory"), "libNoFactory.so exports no block: it needs bf_plugin_v1 or "
                                              "SHLIBPP_DEFINE_SHARED_SUBCLASS"));
        EXPECT_TRUE(has(refusal("OtherVersion"), "plugin 'OtherVersion', block 'Matrices': "));
        EXPECT_TRUE(has(refusal("OtherVersion"), "built against another interface version (4, here 5)"));
    }
}

} // namespace
} // namespace bf::boundary

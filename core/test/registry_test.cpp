#include "bf/base/files.hpp"
#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/core/resolve.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf {
namespace {

namespace fs = std::filesystem;

const std::string folder = std::string(BF_BINARY_DIRECTORY) + "/test_plugins";

template <class F> std::string plugin_error_of(F&& f) {
    try {
        f();
    } catch (const PluginError& error) {
        return error.what();
    }
    return "";
}

struct Gain : Block {
    using Block::Block;
};
Library library_with(const char* name) {
    Library library("");
    library.add<Gain>(name, "Test.");
    return library;
}

TEST(Registry, FindsAndLoadsAPluginByTheNameOfItsBlock) {
    Registry registry;
    registry.add_search_path(folder);
    const BlockClass& found = registry.find("TestPlugin/Double");
    EXPECT_EQ(found.group, "test");
    EXPECT_EQ(found.doc, "y = 2 u.");
    EXPECT_TRUE(found.methods.output);
    EXPECT_FALSE(found.methods.update);

    const auto block = found.make({});
    propagate(*block);
    Context context({{block.get(), found.methods, {}, {}, 0}});
    *static_cast<double*>(context.data(0, 0)) = 21;
    ASSERT_TRUE(context.task(0, Phase::output, 0)());
    EXPECT_EQ(*static_cast<double*>(context.data(0, 1)), 42);
}

TEST(Registry, LoadsAPluginByPathAndOnlyOnce) {
    Registry registry;
    registry.load_plugin(folder + "/TestPlugin.so");
    registry.load_plugin(folder + "/TestPlugin.so");
    EXPECT_EQ(registry.classes().size(), 1u);
}

TEST(Registry, ListsPluginsOfItsSearchPath) {
    Registry registry;
    registry.add_search_path(folder);
    registry.add_search_path("/a folder that does not exist");
    const auto all = registry.available_plugins();
    EXPECT_EQ(std::count(all.begin(), all.end(), "TestPlugin"), 1);
}

TEST(Registry, ReadsItsSearchPathFromTheEnvironment) {
    ::setenv("BLOCKFACTORY_PLUGIN_PATH", ("/first::" + folder).c_str(), 1);
    Registry registry;
    ::unsetenv("BLOCKFACTORY_PLUGIN_PATH");
    ASSERT_EQ(registry.search_path().size(), 2u);
    EXPECT_EQ(registry.search_path()[0], "/first");
    EXPECT_NO_THROW(registry.find("TestPlugin/Double"));
}

TEST(Registry, SaysWhereItSearchedAndWhatIsSimilar) {
    Registry registry;
    registry.add_search_path(folder);
    EXPECT_EQ(plugin_error_of([&] { registry.load_plugin("TestPlugn"); }),
              "plugin 'TestPlugn' was not found: searched " + folder +
                  "; did you mean 'TestPlugin'?; set BLOCKFACTORY_PLUGIN_PATH to the folder that holds "
                  "TestPlugn.so, or let the model name the file: plugins: [FOLDER/TestPlugn.so]");
}

TEST(Registry, NamesThePluginOfABlockThatIsAskedForWithoutIt) {
    Registry registry;
    registry.add_search_path(folder);
    for (int again = 0; again < 2; ++again)
        EXPECT_EQ(
            plugin_error_of([&] { registry.find("Double"); }),
            "there is no block 'Double'; did you mean 'TestPlugin/Double'? It is in a plugin, which the "
            "model names by plugins: [TestPlugin]");
}

TEST(Registry, NamesTheSymbolThatAPluginMisses) {
    Registry registry;
    const auto text = plugin_error_of([&] { registry.load_plugin(folder + "/MissesASymbol.so"); });
    EXPECT_NE(text.find("MissesASymbol.so cannot be loaded: "), std::string::npos) << text;
    EXPECT_NE(text.find("undefined symbol: bf_test_function_that_nobody_defines"), std::string::npos) << text;
    EXPECT_NE(text.find("install what it misses or build it against this version"), std::string::npos)
        << text;
}

TEST(Registry, RefusesALibraryWithoutTheEntryOfThisVersion) {
    Registry registry;
    EXPECT_EQ(plugin_error_of([&] { registry.load_plugin(folder + "/HasNoEntry.so"); }),
              "plugin " + folder +
                  "/HasNoEntry.so has no symbol bf_plugin_v1: it is no BlockFactory plugin or was built for "
                  "another "
                  "interface version; rebuild it");
}

TEST(Registry, RefusesAPluginOfAnotherLayoutBeforeItTouchesAnything) {
    Registry registry;
    const auto other = plugin_error_of([&] { registry.load_plugin(folder + "/OtherLayout.so"); });
    EXPECT_TRUE(other.starts_with(
        "plugin " + folder + "/OtherLayout.so was built for interface layout 7.abc, this program has 1."))
        << other;
    EXPECT_TRUE(other.ends_with("; build the plugin again with the headers of this installation")) << other;
    const auto none = plugin_error_of([&] { registry.load_plugin(folder + "/NoLayout.so"); });
    EXPECT_NE(none.find("NoLayout.so was built for interface layout 0 (none is given), this program has 1."),
              std::string::npos)
        << none;
}

TEST(Registry, RefusesAFileThatIsNoLibrary) {
    Registry registry;
    const auto text = plugin_error_of([&] { registry.load_plugin(folder + "/IsNoLibrary.so"); });
    EXPECT_NE(text.find("IsNoLibrary.so cannot be loaded: "), std::string::npos) << text;
    EXPECT_NE(text.find("file too short"), std::string::npos) << text;
}

TEST(Registry, RefusesAPluginThatIsCutWhereverItIsCut) {
    const std::string whole = read_text_file(folder + "/TestPlugin.so");
    const fs::path file = fs::temp_directory_path() / ("CutPlugin_" + std::to_string(::getpid()) + ".so");
    for (std::size_t length : {std::size_t{100}, std::size_t{5000}, whole.size() / 2, whole.size() - 1}) {
        std::ofstream(file, std::ios::binary) << whole.substr(0, length);
        Registry registry;
        EXPECT_EQ(plugin_error_of([&] { registry.load_plugin(file.string()); }),
                  "plugin " + file.string() +
                      " cannot be loaded: it is cut or damaged: its headers speak of " +
                      std::to_string(whole.size()) + " bytes, and it has " + std::to_string(length) +
                      "; copy or build it again");
    }
    std::ofstream(file, std::ios::binary) << whole;
    Registry registry;
    EXPECT_EQ(plugin_error_of([&] { registry.load_plugin(file.string()); }), "");
    fs::remove(file);
}

TEST(Registry, NamesThePluginWhoseRegistrationThrows) {
    Registry registry;
    EXPECT_EQ(plugin_error_of([&] { registry.load_plugin(folder + "/ThrowsAtOnce.so"); }),
              "plugin " + folder + "/ThrowsAtOnce.so cannot register its blocks: no licence");
}

TEST(Registry, NamesTheBlockThatThrowsWhatIsNoException) {
    Registry registry;
    registry.add_search_path(folder);
    EXPECT_EQ(plugin_error_of([&] { registry.find("Throws/NumberThrower").make({}); }),
              "the constructor of block 'Throws/NumberThrower' throws what is no std::exception; throw one, "
              "which says what is wrong");
    EXPECT_THROW(registry.find("Throws/Thrower").make({}), std::runtime_error);
}

TEST(Registry, RefusesTwoBlocksOfOneName) {
    Registry registry;
    EXPECT_EQ(plugin_error_of([&] { registry.load_plugin(folder + "/RegistersTwice.so"); }),
              "block 'RegistersTwice/Same' is registered twice; give one of them another name");
    registry.add(library_with("Gain"));
    EXPECT_EQ(plugin_error_of([&] { registry.add(library_with("Gain")); }),
              "block 'Gain' is registered twice; give one of them another name");
}

TEST(Registry, SuggestsBlocksLikeTheOneAskedFor) {
    Registry registry;
    registry.add(library_with("Gain"));
    registry.add_search_path(folder);
    registry.load_plugin("TestPlugin");
    EXPECT_EQ(plugin_error_of([&] { registry.find("gian"); }),
              "there is no block 'gian'; did you mean 'Gain'?");
    EXPECT_EQ(
        plugin_error_of([&] { registry.find("Double"); }),
        "there is no block 'Double'; did you mean 'TestPlugin/Double'? It is in a plugin, which the model "
        "names by plugins: [TestPlugin]");
    EXPECT_EQ(plugin_error_of([&] { registry.find("Nonsense"); }),
              "there is no block 'Nonsense'; `bf describe` lists all blocks");
}

TEST(Registry, KnowsNothingOfAnotherRegistry) {
    Registry one, two;
    one.add(library_with("Gain"));
    EXPECT_TRUE(two.classes().empty());
}

} // namespace
} // namespace bf

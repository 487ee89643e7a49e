// The paper's API itself: the semantics that plugins and engines rely on.
#include "BlockFactory/Core/Block.h"
#include "BlockFactory/Core/BlockInformation.h"
#include "BlockFactory/Core/ConvertStdVector.h"
#include "BlockFactory/Core/FactorySingleton.h"
#include "BlockFactory/Core/Signal.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <future>
#include <gtest/gtest.h>
#include <thread>
#include <unistd.h>

namespace blockfactory::core {
namespace {

std::string errors() {
    const std::string text = Log::getSingleton().getErrors();
    Log::getSingleton().clear();
    return text;
}

TEST(LegacySignal, ZeroCopySharesMemoryAndCopiesOfItDoToo) {
    double memory[] = {1, 2, 3};
    Signal signal;
    ASSERT_TRUE(signal.initializeBufferFromContiguousZeroCopy(memory, 3));
    const Signal copy(signal);
    EXPECT_TRUE(signal.set(1, 5));
    EXPECT_EQ(memory[1], 5);
    EXPECT_EQ(copy.get<double>(1), 5);
    EXPECT_EQ(copy.getBuffer<double>(), memory);
}

TEST(LegacySignal, OwnedElementsAreCopiedWithTheSignal) {
    const float memory[] = {1, 2, 3};
    Signal signal(Signal::DataFormat::CONTIGUOUS, Port::DataType::SINGLE);
    ASSERT_TRUE(signal.initializeBufferFromContiguous(memory, 3));
    Signal copy(signal);
    EXPECT_TRUE(copy.set(0, 9));
    EXPECT_EQ(signal.get<float>(0), 1);
    EXPECT_EQ(copy.get<float>(0), 9);
    const Signal moved(std::move(copy));
    EXPECT_EQ(moved.get<float>(0), 9);
    EXPECT_FALSE(copy.isValid()); // NOLINT(bugprone-use-after-move)
}

TEST(LegacySignal, ReadsOnePointerPerElementOfANonContiguousBuffer) {
    const double a = 1, b = 2;
    const void* pointers[] = {&b, &a};
    Signal signal(Signal::DataFormat::NONCONTIGUOUS);
    ASSERT_TRUE(signal.initializeBufferFromNonContiguous(pointers, 2));
    EXPECT_EQ(signal.get<double>(0), 2);
    EXPECT_EQ(signal.get<double>(1), 1);
    EXPECT_FALSE(signal.setBuffer(&a, 1));
    errors();
}

TEST(LegacySignal, RefusesWrongFormatsNullAndNothing) {
    double x = 0;
    Signal signal;
    EXPECT_FALSE(signal.isValid());
    EXPECT_FALSE(signal.initializeBufferFromContiguous(&x, 1));
    EXPECT_FALSE(signal.initializeBufferFromContiguousZeroCopy(nullptr, 1));
    EXPECT_FALSE(signal.initializeBufferFromContiguousZeroCopy(&x, 0));
    EXPECT_NE(errors().find("another data format"), std::string::npos);
}

TEST(LegacySignal, AnswersZeroAndAnErrorOutsideAndForAnotherType) {
    double memory[] = {1, 2};
    Signal signal;
    signal.initializeBufferFromContiguousZeroCopy(memory, 2);
    EXPECT_EQ(signal.get<double>(2), 0);
    EXPECT_NE(errors().find("Element 2 was asked of a signal that has 2."), std::string::npos);
    EXPECT_EQ(signal.get<int>(0), 0);
    EXPECT_NE(errors().find("elements of type double, not int32"), std::string::npos);
    EXPECT_EQ(signal.getBuffer<float>(), nullptr);
    EXPECT_FALSE(signal.set(2, 1));
    errors();
}

TEST(LegacySignal, KeepsItsWidthWhenFewerElementsAreSet) {
    double memory[] = {1, 2, 3};
    const double two[] = {7, 8, 9, 10};
    Signal signal;
    signal.initializeBufferFromContiguousZeroCopy(memory, 3);
    EXPECT_TRUE(signal.setBuffer(two, 2));
    EXPECT_EQ(signal.getWidth(), 3u);
    EXPECT_EQ(memory[0], 7);
    EXPECT_EQ(memory[2], 3);
    EXPECT_NE(Log::getSingleton().getWarnings().find("Only 2 of the 3 elements"), std::string::npos);
    EXPECT_FALSE(signal.setBuffer(two, 4));
    errors();
    Signal empty(Signal::DataFormat::CONTIGUOUS);
    EXPECT_FALSE(empty.setBuffer(two, 2));
    EXPECT_NE(errors().find("The signal has no memory yet."), std::string::npos);
}

TEST(LegacyParameters, ConvertValuesOnTheWayInAndOut) {
    Parameters p;
    ASSERT_TRUE(p.storeParameter(2.9, {ParameterType::INT, 2, 1, 1, "int"}));
    ASSERT_TRUE(p.storeParameter(0.5, {ParameterType::BOOL, 3, 1, 1, "bool"}));
    ASSERT_TRUE(p.storeParameter(std::string("3.5"), {ParameterType::DOUBLE, 4, 1, 1, "double"}));
    ASSERT_TRUE(p.storeParameter(7, {ParameterType::STRING, 5, 1, 1, "text"}));
    ASSERT_TRUE(
        p.storeParameter(std::vector<int>{1, 0}, {ParameterType::STRUCT_CELL_BOOL, 6, 1, 2, "flags"}));
    int i = 0;
    bool b = false;
    double d = 0;
    std::string s;
    std::vector<double> v;
    EXPECT_TRUE(p.getParameter("int", i) && i == 2);
    EXPECT_TRUE(p.getParameter("bool", b) && b);
    EXPECT_TRUE(p.getParameter("double", d) && d == 3.5);
    EXPECT_TRUE(p.getParameter("text", s) && s == "7");
    EXPECT_TRUE(p.getParameter("flags", v));
    EXPECT_EQ(v, (std::vector<double>{1, 0}));
    EXPECT_TRUE(p.getParameter("text", d) && d == 7);
}

TEST(LegacyParameters, ReportWhatCannotBeConvertedInsteadOfThrowing) {
    Parameters p;
    EXPECT_FALSE(p.storeParameter(std::string("fast"), {ParameterType::DOUBLE, 2, 1, 1, "speed"}));
    EXPECT_NE(errors().find("'speed' cannot be stored: the text 'fast' is no number"), std::string::npos);
    for (const auto type : {ParameterType::INT, ParameterType::BOOL}) {
        EXPECT_FALSE(p.storeParameter(std::string("0.5"), {type, 2, 1, 1, "half"}));
        EXPECT_NE(errors().find("the text '0.5' is no whole number"), std::string::npos);
    }
    EXPECT_FALSE(p.storeParameter(1e30, {ParameterType::INT, 2, 1, 1, "count"}));
    EXPECT_NE(errors().find("does not fit an int"), std::string::npos);
    ASSERT_TRUE(p.storeParameter(std::string("fast"), {ParameterType::STRING, 2, 1, 1, "speed"}));
    double d = 0;
    EXPECT_FALSE(p.getParameter("speed", d));
    EXPECT_NE(errors().find("'speed' is of another type"), std::string::npos);
}

TEST(LegacyParameters, KeepNamesOnceShapesApartAndTheOrderOfStoring) {
    Parameters p;
    ASSERT_TRUE(p.storeParameter(1.0, {ParameterType::STRUCT_DOUBLE, 2, 1, 1, "z"}));
    ASSERT_TRUE(p.storeParameter(2.0, {ParameterType::STRUCT_DOUBLE, 2, 1, 1, "a"}));
    EXPECT_FALSE(p.storeParameter(3.0, {ParameterType::DOUBLE, 3, 1, 1, "a"}));
    EXPECT_FALSE(p.storeParameter(std::vector<double>(6), {ParameterType::DOUBLE, 3, 2, 3, "m"}));
    EXPECT_NE(errors().find("2D parameters are not supported"), std::string::npos);
    std::vector<double> v;
    EXPECT_FALSE(p.getParameter("a", v));
    EXPECT_EQ(p.getParamName(2), "a"); // the last one of a shared index
    EXPECT_EQ(p.getParamIndex("z"), 2);
    EXPECT_EQ(p.getParamIndex("?"), PARAM_INVALID_INDEX);
    EXPECT_EQ(p.getParameterMetadata("?").name, "dummy");
    ASSERT_EQ(p.getDoubleParameters().size(), 2u);
    EXPECT_EQ(p.getDoubleParameters()[0].getMetadata().name, "z");
    Parameters copy;
    copy = p;
    EXPECT_EQ(copy.getNumberOfParameters(), 2u);
    errors();
}

TEST(LegacyParameters, MetadataCanBeAssigned) {
    ParameterMetadata a(ParameterType::INT, 2, 1, 1), b(ParameterType::STRING, 3, 1, 1, "b");
    EXPECT_EQ(a.name, "ParamIndex_2");
    a = b;
    EXPECT_EQ(a, b);
    std::vector<Parameter<int>> list(1, {1, a});
    list[0] = Parameter<int>(2, b);
    EXPECT_EQ(list[0].getScalarParameter(), 2);
}

TEST(LegacyLog, CollectsUntilClearedFromAllThreads) {
    Log::getSingleton().clear();
    bfError << "one " << 1;
    std::thread([] { bfError << "two"; }).join();
    bfWarning << "careful";
    const std::string text = Log::getSingleton().getErrors();
    EXPECT_NE(text.find("one 1"), std::string::npos);
    EXPECT_NE(text.find("two"), std::string::npos);
    EXPECT_EQ(Log::getSingleton().getErrors(), text);
    Log::getSingleton().clearErrors();
    EXPECT_EQ(Log::getSingleton().getErrors(), "");
    EXPECT_NE(Log::getSingleton().getWarnings(), "");
    Log::getSingleton().clear();
}

TEST(LegacyLog, KeepsTextsApartThatAreWrittenWithinEachOther) {
    Log::getSingleton().clear();
    const auto many = [] {
        for (int i = 0; i < 20; ++i) bfWarning << "inner " << i;
        return "middle";
    };
    bfError << "outer " << many() << " end";
    EXPECT_EQ(Log::getSingleton().getErrors(), "outer middle end\n");
    EXPECT_NE(Log::getSingleton().getWarnings().find("inner 0\ninner 1\n"), std::string::npos);
    const auto clear = [] {
        Log::getSingleton().clear();
        return 7;
    };
    bfError << "cleared " << clear() << " while it is written";
    EXPECT_EQ(Log::getSingleton().getErrors(), "");
}

TEST(LegacyLog, ShowsAllThreadsWhatOneHasWritten) {
    Log::getSingleton().clear();
    std::promise<void> written, read;
    std::thread other([&] {
        bfError << "from a thread that lives on";
        written.set_value();
        read.get_future().wait();
    });
    written.get_future().wait();
    EXPECT_EQ(Log::getSingleton().getErrors(), "from a thread that lives on\n");
    read.set_value();
    other.join();
    Log::getSingleton().clear();
}

TEST(LegacyLog, IsBounded) {
    for (int i = 0; i < 5000; ++i) bfError << "x";
    EXPECT_LT(Log::getSingleton().getErrors().size(), 200000u);
    Log::getSingleton().clear();
}

TEST(LegacyFactory, SaysWhyThereIsNone) {
    auto& singleton = ClassFactorySingleton::getInstance();
    singleton.extendPluginSearchPath(BF_TEST_PLUGINS);
    EXPECT_EQ(singleton.getClassFactory({"NoSuchPlugin", "Matrices"}), nullptr);
    auto text = errors();
    EXPECT_NE(text.find("Failed to create factory"), std::string::npos) << text;
    EXPECT_NE(text.find("Factory error (2): the plugin 'NoSuchPlugin' was not found: searched "),
              std::string::npos)
        << text;
    EXPECT_EQ(singleton.getClassFactory({"LegacyPlugin", "NoSuchBlock"}), nullptr);
    text = errors();
    EXPECT_NE(text.find("Factory error (4): the plugin 'LegacyPlugin' has no class 'NoSuchBlock'"),
              std::string::npos)
        << text;
    EXPECT_EQ(singleton.getClassFactory({"NoFactory", "Matrices"}), nullptr);
    text = errors();
    EXPECT_NE(text.find("Factory error (4): the plugin 'NoFactory' has no class 'Matrices'"),
              std::string::npos)
        << text;
    EXPECT_EQ(singleton.getClassFactory({"OtherVersion", "Matrices"}), nullptr);
    text = errors();
    EXPECT_NE(
        text.find("Factory error (5): the plugin 'OtherVersion', class 'Matrices', was built against another "
                  "interface version (4, here 5): rebuild it"),
        std::string::npos)
        << text;
}

TEST(LegacyFactory, OpensAClassOfOtherMarksWhenItIsAskedFor) {
    const std::string file = BF_TEST_PLUGINS "/libOtherVersion.so";
    const shlibpp::SharedLibraryClassFactory<Block> other(file.c_str(), SHLIBPP_DEFAULT_START_CHECK,
                                                          SHLIBPP_DEFAULT_END_CHECK, 4, "Matrices");
    EXPECT_TRUE(other.isValid()) << other.getError();
    Block* block = other.create();
    ASSERT_NE(block, nullptr);
    other.destroy(block);
    const shlibpp::SharedLibraryClassFactory<Block> own(file.c_str(), "Matrices");
    EXPECT_EQ(own.getStatus(), shlibpp::SharedLibraryFactory::Status::FactoryNotFunctional);
}

TEST(LegacyFactory, RefusesAPluginThatIsCut) {
    const std::string file = testing::TempDir() + "CutLegacyPlugin_" + std::to_string(::getpid()) + ".so";
    std::ifstream whole(BF_TEST_PLUGINS "/libLegacyPlugin.so", std::ios::binary);
    std::string bytes(5000, '\0');
    ASSERT_TRUE(whole.read(bytes.data(), static_cast<std::streamsize>(bytes.size())));
    std::ofstream(file, std::ios::binary) << bytes;
    const shlibpp::SharedLibraryClassFactory<Block> cut(file.c_str(), "Matrices");
    EXPECT_EQ(cut.getStatus(), shlibpp::SharedLibraryFactory::Status::LibraryNotLoaded);
    EXPECT_NE(cut.getError().find(file + " cannot be loaded: it is cut or damaged"), std::string::npos)
        << cut.getError();
    std::remove(file.c_str());
}

TEST(LegacyFactory, IsMadeOnceAndDestroyedWhenNobodyHoldsIt) {
    auto& singleton = ClassFactorySingleton::getInstance();
    singleton.extendPluginSearchPath(BF_TEST_PLUGINS);
    const ClassFactorySingleton::ClassFactoryData data{"LegacyPlugin", "Matrices"};
    auto factory = singleton.getClassFactory(data);
    ASSERT_NE(factory, nullptr) << errors();
    EXPECT_EQ(singleton.getClassFactory(data), factory);
    EXPECT_EQ(factory->getClassName(), "legacy_test::Matrices");
    EXPECT_EQ(factory->getReferenceCount(), 1);
    {
        sharedlibpp::SharedLibraryClass<Block> block(*factory);
        ASSERT_TRUE(block.isValid());
        EXPECT_EQ(block->numberOfParameters(), 2u);
        EXPECT_EQ(factory->getReferenceCount(), 2);
    }
    EXPECT_EQ(factory->getReferenceCount(), 1);
    EXPECT_FALSE(singleton.destroyFactory(data));
    factory.reset();
    EXPECT_TRUE(singleton.destroyFactory(data));
    EXPECT_FALSE(singleton.destroyFactory(data));
    errors();
}

TEST(BlockfactoryExists, TellsByItsExitStatus) {
    const std::string program = "BLOCKFACTORY_PLUGIN_PATH=" BF_TEST_PLUGINS " " BF_BINARY_DIRECTORY
                                "/bin/blockfactory-exists 2>/dev/null ";
    EXPECT_EQ(std::system((program + "LegacyPlugin Accumulate").c_str()), 0);
    EXPECT_EQ(std::system((program + "NativePlugin Accumulate").c_str()), 0);
    EXPECT_NE(std::system((program + "LegacyPlugin NoSuchBlock").c_str()), 0);
    EXPECT_NE(std::system((program + "NoSuchPlugin Accumulate").c_str()), 0);
}

} // namespace
} // namespace blockfactory::core

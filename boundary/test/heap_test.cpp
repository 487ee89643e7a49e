// Steps at the boundary do not use the heap, in either direction.
#include "../../blocks/test/run_block.hpp"
#include "BlockFactory/Core/Signal.h"
#include "heap.hpp"
#include "legacy_class.hpp"

#include <gtest/gtest.h>

namespace bf::boundary {
namespace {

using test::heap_calls;
namespace core = blockfactory::core;

TEST(BoundaryHeap, IsNotUsedToReadASignal) {
    if (!test::heap_is_counted()) GTEST_SKIP() << "not counted here";
    std::vector<double> memory(23, 2.0);
    core::Signal signal;
    signal.initializeBufferFromContiguousZeroCopy(memory.data(), memory.size());
    double sum = 0;
    const long before = heap_calls();
    for (std::size_t i = 0; i < signal.getWidth(); ++i) sum += signal.get<double>(i);
    const double* all = signal.getBuffer<double>();
    EXPECT_EQ(heap_calls() - before, 0);
    EXPECT_EQ(sum, 46);
    EXPECT_EQ(all, memory.data());
}

TEST(BoundaryHeap, IsNotUsedByAHostedStep) {
    if (!test::heap_is_counted()) GTEST_SKIP() << "not counted here";
    Registry registry;
    registry.add_search_path(BF_TEST_PLUGINS);
    test::RunBlock run(registry.find("LegacyPlugin/Accumulate"),
                       {{"factor", 2.0}, {"bias", Matrix(Matrix::Ones(1, 3))}});
    run.wire("u1", test::vector_size(3)).wire("u2", test::vector_size(3)).start();
    run.context().start(0);
    const long before = heap_calls();
    bool good = true;
    for (int i = 0; i < 3; ++i) good = good && bool(run.step());
    EXPECT_EQ(heap_calls() - before, 0);
    EXPECT_TRUE(good);
}

TEST(BoundaryHeap, IsNotUsedByAStepAsLegacy) {
    if (!test::heap_is_counted()) GTEST_SKIP() << "not counted here";
    auto legacy = std::make_shared<const LegacyClass>(std::string(BF_TEST_PLUGINS) + "/NativePlugin.so",
                                                      "NativePlugin", "Accumulate");
    LegacyObject object(legacy,
                        {{"factor", 2.0}, {"bias", Matrix(Matrix::Ones(1, 3))}, {"sample_time", 0.01}});
    const core::Port::Info port{0, {3}, core::Port::DataType::DOUBLE};
    double memory[3][3] = {{1, 2, 3}, {4, 5, 6}, {}};
    object.information.run_on({port, {1, {3}, core::Port::DataType::DOUBLE}}, {port});
    object.information.point(false, 0, memory[0]);
    object.information.point(false, 1, memory[1]);
    object.information.point(true, 0, memory[2]);
    ASSERT_TRUE(object.call("initialize", [](core::Block& b, HostInformation& i) {
        return b.initialize(&i);
    })) << object.message();
    const long before = heap_calls();
    bool good = true;
    for (int k = 0; k < 3; ++k)
        good = good && object.call("output", [](core::Block& b, HostInformation& i) { return b.output(&i); });
    EXPECT_EQ(heap_calls() - before, 0);
    EXPECT_TRUE(good);
    EXPECT_EQ(memory[2][0], 2 * (1 + 4) + 1 + 2);
}

} // namespace
} // namespace bf::boundary

#include "bf/fmi/instance.hpp"
#include "heap.hpp"
#include "odd.hpp"

namespace bf::fmi::test {
namespace {

TEST(RemoteInstance, AllocatesNothingFromItsFirstStepOn) {
    const TemporaryFolder folder("remote_test");
    const auto archive = odd_fmu("odd", folder.path());
    const Description d = description_of(archive);
    const auto instance = make_remote_instance(archive, d, Kind::co_simulation, "odd", 60, {});
    Values u(3, Type::float64), y(3, Type::float64), v(3, Type::float32);
    u.add(d.variables.at(2)), y.add(d.variables.at(3)), v.add(d.variables.at(4));
    const long before = bf::test::heap_calls();
    bool is_good = instance->enter_initialization(0) && instance->exit_initialization();
    for (int k = 0; k < 3; ++k) {
        u.set(0, k);
        is_good = is_good && instance->set(u) && instance->get(y) && instance->get(v) &&
                  instance->do_step(0.01 * k, 0.01);
    }
    const long calls = bf::test::heap_calls() - before;
    EXPECT_TRUE(is_good) << instance->failure();
    EXPECT_EQ(y[0], 3);
    EXPECT_EQ(calls, 0);
}

} // namespace
} // namespace bf::fmi::test

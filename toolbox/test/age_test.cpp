// What references do when measurements are too old.
#include "running.hpp"

#include <tuple>

namespace bf::toolbox::test::ages {
namespace {

/// The knee of an iCub that hangs in the air; references and their age are inputs.
std::string model(const std::string& settings) {
    return "model: m\nstep: 0.001\ninputs: {u: {shape: 1}, age: {}}\nblocks:\n"
           "  robot: {block: WholeBodyToolbox/Configuration, joints: \"{'l_knee'}\"}\n"
           "  world: {block: WholeBodyToolbox/MujocoWorld, floating_base: false, floor: false}\n"
           "  drive: {block: WholeBodyToolbox/SetReferences" +
           settings +
           "}\n  s: {block: WholeBodyToolbox/GetMeasurement, with_age: true}\n"
           "connections: {u: drive.u, age: drive.age}\n";
}

/// The torque of the step after that reference of that age.
double torque(Running& run, double u, double age) {
    run.set("u", u).set("age", age);
    EXPECT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_TRUE(run.step()) << run.simulation.failure();
    return run.scalar("world.tau_measured");
}

} // namespace

TEST(AgeOfMeasurements, IsNoneInASimulation) {
    Running run(model(", age_limit: 1"));
    run.set("u", 0.0).set("age", 0.0);
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("s.age"), 0);
}

TEST(AgeOfMeasurements, HoldsTheReferencesOfBefore) {
    Running run(model(", age_limit: 0.01, when_old: hold"));
    EXPECT_EQ(torque(run, 2, 0.01), 2);
    EXPECT_EQ(torque(run, 7, 0.0101), 2);
    EXPECT_EQ(torque(run, std::nan(""), 1), 2);
    EXPECT_EQ(torque(run, 3, 0), 3) << "fresh again";
}

TEST(AgeOfMeasurements, RampsReferencesDown) {
    Running run(model(", age_limit: 0.01, when_old: ramp_down, ramp_time: 0.01"));
    EXPECT_EQ(torque(run, 2, 0), 2);
    run.set("age", 1.0);
    // The torque of step k is measured in the next one.
    std::vector<double> found;
    for (int k = 0; k < 14; ++k) {
        ASSERT_TRUE(run.step());
        found.push_back(run.scalar("world.tau_measured"));
    }
    for (int k = 1; k < 14; ++k)
        EXPECT_NEAR(found[static_cast<std::size_t>(k)], 2 * std::max(0.0, 1 - k / 10.0), 1e-12) << k;
    EXPECT_EQ(torque(run, 3, 0), 3) << "fresh again";
    expect_contains(
        refusal(model(", age_limit: 1, when_old: ramp_down, control_type: Position Direct")),
        "when_old is ramp_down, which would move the joints of control_type Position Direct to zero; "
        "give hold or stop");
}

TEST(AgeOfMeasurements, EndsTheRun) {
    Running run(model(", age_limit: 0.01"));
    EXPECT_EQ(torque(run, 2, 0.01), 2);
    run.set("age", 0.05);
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(),
              "drive: the measurements are 50 ms old, and age_limit is 10 ms; look at the "
              "robot's connection");
}

TEST(AgeOfMeasurements, EndsTheRunWithNumbersThatSayWhichIsLarger) {
    for (const auto& [limit, age, text] :
         {std::tuple("0.0004", 0.0009, "900 us old, and age_limit is 400 us;"),
          std::tuple("0.0096", 0.0104, "10400 us old, and age_limit is 9600 us;"),
          std::tuple("1e-9", 2e-6, "2 us old, and age_limit is 1 us;")}) {
        Running run(model(std::string(", age_limit: ") + limit));
        EXPECT_EQ(torque(run, 2, 0), 2);
        run.set("age", age);
        EXPECT_FALSE(run.step());
        expect_contains(run.simulation.failure(), text);
    }
}

} // namespace bf::toolbox::test::ages

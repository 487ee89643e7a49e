#include "bf/fmi/call_order.hpp"

#include <gtest/gtest.h>
#include <string>

namespace bf::fmi::test {
namespace {

struct Text {
    char text[400] = "";
};

/// The first call that is not allowed, or "".
std::string run(CallOrder order, std::initializer_list<Call> calls) {
    Text problem;
    int at = 0;
    for (const Call call : calls) {
        const std::string name = "call" + std::to_string(++at);
        if (!order.check(call, name.c_str(), problem)) return problem.text;
        order.done(call);
    }
    return "";
}

TEST(CallOrders, AllowWhatBothStandardsShow) {
    using C = Call;
    EXPECT_EQ(
        run({3, true, false}, {C::set_values, C::enter_initialization, C::get_values, C::exit_initialization,
                               C::do_step, C::get_values, C::save_state, C::terminate, C::get_values,
                               C::reset, C::enter_initialization, C::free_instance}),
        "");
    EXPECT_EQ(
        run({3, true, true},
            {C::enter_initialization, C::exit_initialization, C::update_discrete_states, C::enter_step_mode,
             C::do_step, C::enter_event_mode, C::update_discrete_states, C::enter_step_mode, C::terminate}),
        "");
    EXPECT_EQ(run({3, false, false},
                  {C::enter_configuration, C::set_values, C::exit_configuration, C::enter_initialization,
                   C::exit_initialization, C::update_discrete_states, C::enter_continuous_time, C::set_time,
                   C::set_continuous_states, C::get_continuous, C::completed_integrator_step,
                   C::enter_event_mode, C::update_discrete_states, C::enter_continuous_time, C::terminate}),
              "");
    EXPECT_EQ(run({2, true, false}, {C::setup_experiment, C::enter_initialization, C::exit_initialization,
                                     C::do_step, C::get_step_status, C::terminate}),
              "");
    EXPECT_EQ(run({2, false, false},
                  {C::setup_experiment, C::get_nominals, C::set_time, C::enter_initialization,
                   C::get_continuous, C::exit_initialization, C::update_discrete_states,
                   C::enter_continuous_time, C::set_time, C::completed_integrator_step, C::terminate}),
              "");
}

TEST(CallOrders, RefuseTheRestAndSayWhatIsAllowed) {
    using C = Call;
    EXPECT_EQ(run({3, true, false}, {C::enter_initialization, C::do_step}),
              "call2 is called in the state 'Initialization Mode', but is allowed in: Step Mode (FMI 3.0, "
              "section 4.2)");
    EXPECT_EQ(run({3, false, false}, {C::do_step}), "call1 is called in the state 'Instantiated', but is "
                                                    "allowed in: none of this kind of instance (FMI 3.0, "
                                                    "section 3.2)");
    EXPECT_EQ(run({2, false, false}, {C::enter_initialization}),
              "call1 is called before fmi2SetupExperiment (FMI 2.0.4, section 2.1.6)");
    EXPECT_EQ(run({2, true, false}, {C::setup_experiment, C::enter_initialization, C::exit_initialization,
                                     C::enter_event_mode}),
              "call4 is called in the state 'Step Mode', but is allowed in: none of this kind of instance "
              "(FMI 2.0.4, "
              "section 4.2.4)");
    EXPECT_EQ(run({3, false, false}, {C::enter_initialization, C::exit_initialization, C::enter_event_mode}),
              "call3 is called in the state 'Event Mode', but is allowed in: Continuous-Time Mode (FMI 3.0, "
              "section "
              "3.2)");
    EXPECT_EQ(run({3, true, false}, {C::terminate}), "call1 is called in the state 'Instantiated', but is "
                                                     "allowed in: Event Mode, Continuous-Time Mode, Step "
                                                     "Mode (FMI 3.0, section 4.2)");
    EXPECT_EQ(
        run({3, true, false}, {C::enter_initialization, C::exit_initialization, C::terminate, C::set_values}),
        "call4 is called in the state 'Terminated', but is allowed in: Instantiated, Configuration Mode, "
        "Initialization Mode, Event Mode, Continuous-Time Mode, Step Mode, Intermediate Update Mode (FMI "
        "3.0, "
        "section 4.2)");
}

TEST(CallOrders, AllowAfterAnErrorOnlyToLookAndToBeginAnew) {
    CallOrder order(3, true, false);
    order.fail();
    Text problem;
    for (const Call call : {Call::get_values, Call::reset, Call::free_instance, Call::set_debug_logging})
        EXPECT_TRUE(order.check(call, "call", problem));
    for (const Call call : {Call::set_values, Call::save_state, Call::do_step, Call::terminate})
        EXPECT_FALSE(order.check(call, "call", problem));
    order.done(Call::reset);
    EXPECT_EQ(order.state(), instantiated);
}

} // namespace
} // namespace bf::fmi::test

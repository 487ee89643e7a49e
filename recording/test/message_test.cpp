#include "bf/recording/message.hpp"

#include <gtest/gtest.h>

namespace bf::recording {
namespace {

TEST(Messages, TellTypeAndShapeByTheirNames) {
    for (int type = 0; type <= static_cast<int>(ElementType::Boolean); ++type)
        for (const ChannelInfo& shape :
             {ChannelInfo{}, ChannelInfo{.rows = 23}, ChannelInfo{.rows = 3, .cols = 4, .is_matrix = true},
              ChannelInfo{.rows = 1, .cols = 1, .is_matrix = true}}) {
            ChannelInfo info = shape;
            info.type = static_cast<ElementType>(type);
            EXPECT_EQ(channel_of(message_type(info)), info) << message_type(info);
        }
    for (const char* other : {"", "bf_msgs/msg/", "std_msgs/msg/Double", "bf_msgs/msg/Half",
                              "bf_msgs/msg/Doublex3", "bf_msgs/msg/Double3x", "bf_msgs/msg/Double3x4x5",
                              "bf_msgs/msg/Double-3", "bf_msgs/msg/Double99999999999"})
        EXPECT_EQ(channel_of(other), std::nullopt) << other;
}

TEST(Messages, TopicsAreNamesOfSignalsAndBack) {
    EXPECT_EQ(topic_of("controller.tau"), "/controller/tau");
    EXPECT_EQ(signal_of("/controller/tau"), "controller.tau");
    EXPECT_EQ(signal_of("tau"), "tau");
}

} // namespace
} // namespace bf::recording

// What a node has its lock for.
#include "messages.hpp"
#include "node.hpp"
#include "peer.hpp"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>
#include <sstream>
#include <vector>

namespace {

std::atomic<bool> is_watched{false}, were_two{false};
std::atomic<int> inside{0};

/// While a thread makes or ends an end of a node.
struct Inside {
    Inside() {
        if (!is_watched) return;
        if (inside++ > 0) were_two = true;
        usleep(200); // for others to come
    }
    ~Inside() {
        if (is_watched) --inside;
    }
};

} // namespace

// The linker leads calls of these functions of rcl here (--wrap).
#define BF_WATCHED(end, support_t)                                                                           \
    rcl_ret_t __real_rcl_##end##_init(rcl_##end##_t*, const rcl_node_t*, const support_t*, const char*,      \
                                      const rcl_##end##_options_t*);                                         \
    rcl_ret_t __wrap_rcl_##end##_init(rcl_##end##_t* its, const rcl_node_t* node, const support_t* type,     \
                                      const char* name, const rcl_##end##_options_t* options) {              \
        const Inside look;                                                                                   \
        return __real_rcl_##end##_init(its, node, type, name, options);                                      \
    }                                                                                                        \
    rcl_ret_t __real_rcl_##end##_fini(rcl_##end##_t*, rcl_node_t*);                                          \
    rcl_ret_t __wrap_rcl_##end##_fini(rcl_##end##_t* its, rcl_node_t* node) {                                \
        const Inside look;                                                                                   \
        return __real_rcl_##end##_fini(its, node);                                                           \
    }
extern "C" {
BF_WATCHED(publisher, rosidl_message_type_support_t)
BF_WATCHED(subscription, rosidl_message_type_support_t)
BF_WATCHED(service, rosidl_service_type_support_t)
BF_WATCHED(client, rosidl_service_type_support_t)
}

namespace bf::ros2::test {

using Ros2Node = Alone;

/// Neither other computers nor names that stay in shared memory where it is killed, by which Fast DDS can
/// crash, too.
TEST_F(Ros2Node, HasSocketsOfThisComputerAndNothingElse) {
    const auto names = [] {
        using Files = std::filesystem::directory_iterator;
        return std::count_if(Files("/dev/shm"), Files(), [](const auto& file) {
            return file.path().filename().string().find("fastdds_") != std::string::npos;
        });
    };
    const auto before = names();
    Node node({});
    node.open();
    std::ifstream sockets("/proc/self/net/udp"); // those of this network
    std::string line, number, address;
    std::getline(sockets, line); // the head
    int count = 0;
    for (; std::getline(sockets, line); ++count) {
        std::istringstream(line) >> number >> address;
        EXPECT_EQ(address.substr(0, 8), "0100007F") << line; // 127.0.0.1
    }
    EXPECT_GE(count, 3) << "of discovery and of data";
    if (middleware::test::has_own_shared_memory) {
        EXPECT_EQ(names(), before);
    }
}

/// rcl notes the types of a node's ends in a map without a lock.
TEST_F(Ros2Node, MakesAndEndsItsEndsOneAtATime) {
    Node node({});
    node.open();
    is_watched = true;
    const std::vector<std::function<void(const std::string&)>> uses{
        [&](const auto& name) { node.advertise(messages::clock(), name, {}); },
        [&](const auto& name) { node.subscribe(messages::imu(), name, {}, [](auto...) {}); },
        [&](const auto& name) {
            messages::serve(node, name, std::function<std::string(bool&)>([](bool&) { return ""; }));
        },
        [&](const auto& name) { messages::trigger(node, name, [](bool, const std::string&) {}); }};
    for (const auto& first : uses)
        for (const auto& second : uses) {
            std::vector<std::future<void>> both;
            for (const auto* use : {&first, &second})
                both.push_back(
                    std::async(std::launch::async, [use, name = "/t" + std::to_string(both.size())] {
                        for (int k = 0; k < 5; ++k) (*use)(name);
                    }));
            for (auto& each : both) each.get();
            EXPECT_FALSE(were_two.exchange(false))
                << &first - uses.data() << " and " << &second - uses.data();
        }
    node.close(); // which ends what its thread still had
    is_watched = false;
}

} // namespace bf::ros2::test

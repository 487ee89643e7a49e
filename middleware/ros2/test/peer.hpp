// Programs of ROS 2 that are not ours, and the network that the tests have for themselves.
#pragma once

#include "cycles.hpp"
#include "own_network.hpp"
#include "program.hpp"

#include <gtest/gtest.h>
#include <string>
#include <unistd.h>
#include <vector>

namespace bf::ros2::test {

/// What tests of ROS 2 derive from.
class Alone : public ::testing::Test {
  protected:
    void SetUp() override {
        static const bool is_alone = middleware::test::enter_network_of_our_own();
        if (!is_alone) GTEST_SKIP() << "this system gives a program no network of its own";
    }
};

using middleware::test::Folder;

/// A program that speaks ROS 2; in another network where one is given.
class Program : public middleware::test::Program {
  public:
    explicit Program(std::vector<std::string> words, int network = -1)
        : middleware::test::Program(
              std::move(words),
              {.variables = {{"ROS_AUTOMATIC_DISCOVERY_RANGE", network >= 0 ? "SUBNET" : "LOCALHOST"},
                             {"AMENT_PREFIX_PATH", BF_ROS2_MESSAGES ":" BF_ROS2_PREFIX},
                             {"PYTHONPATH", BF_ROS2_MESSAGES "/lib/python3.11/site-packages"}},
               .network = network}) {}
};

/// test/peer.py. Its verbs are said there.
class Peer : public Program {
  public:
    explicit Peer(std::vector<std::string> words, int network = -1)
        : Program(with_python(std::move(words)), network) {}
    static bool is_there() { return access(BF_ROS2_PREFIX "/lib/python3.11/site-packages/rclpy", R_OK) == 0; }

  private:
    static std::vector<std::string> with_python(std::vector<std::string> words) {
        words.insert(words.begin(),
                     {BF_ROS2_PREFIX "/bin/python", BF_SOURCE_DIRECTORY "/middleware/ros2/test/peer.py"});
        return words;
    }
};

} // namespace bf::ros2::test

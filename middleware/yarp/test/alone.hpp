// Ports of YARP listen to everybody, so its tests run in a network of their own that ends at this computer.
#pragma once

#include "own_network.hpp"

#include <cstdlib>
#include <gtest/gtest.h>

namespace bf::yarp::test {

/// What tests of YARP derive from.
class Alone : public ::testing::Test {
  protected:
    static bool is_alone() {
        static const bool is = middleware::test::enter_network_of_our_own() &&
                               setenv("YARP_DATA_DIRS", BF_YARP_PREFIX "/share/yarp", 1) == 0;
        return is;
    }
    void SetUp() override {
        if (!is_alone()) GTEST_SKIP() << "this system gives a program no network of its own";
    }
};

} // namespace bf::yarp::test

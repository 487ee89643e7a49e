// What `bf deploy` packs: the devices that runs open, which are libraries.
#include "devices.hpp"

#include <stdexcept>

extern "C" __attribute__((visibility("default"))) const char* const* bf_deploy_v1() {
    static const char* const none[] = {nullptr};
    if (const auto& missing = bf::yarp::load_devices(); !missing.empty()) throw std::runtime_error(missing);
    return none;
}

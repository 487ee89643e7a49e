#include "devices.hpp"

#include <dlfcn.h>
#include <link.h>
#include <utility>
#include <yarp/dev/Drivers.h>

namespace bf::yarp {

namespace {

/// Why it is not there.
std::string load(const std::string& device, const std::string& library) {
    // The name of a file without a folder is looked for where the libraries are that this one needs.
    void* const handle = ::dlopen((library + ".so").c_str(), RTLD_NOW | RTLD_NODELETE);
    link_map* map = nullptr;
    if (!handle || ::dlinfo(handle, RTLD_DI_LINKMAP, static_cast<void*>(&map)) != 0)
        return "YARP's device " + device + " is not there: " + ::dlerror();
    ::yarp::dev::Drivers::factory().add(new ::yarp::dev::StubDriverCreator(
        device.c_str(), "", "", map->l_name, device.c_str())); // which YARP deletes
    return "";
}

} // namespace

const std::string& load_devices() {
    static const std::string why_not = [] {
        std::string missing;
        for (const auto& [device, library] :
             {std::pair("remotecontrolboardremapper", "yarp_controlboardremapper"),
              {"remote_controlboard", "yarp_remote_controlboard"},
              {"multipleanalogsensorsclient", "yarp_multipleanalogsensorsclient"},
              {"controlBoard_nws_yarp", "yarp_controlBoard_nws_yarp"},
              {"multipleanalogsensorsserver", "yarp_multipleanalogsensorsserver"}})
            if (std::string why = load(device, library); missing.empty()) missing = std::move(why);
        return missing;
    }();
    return why_not;
}

} // namespace bf::yarp

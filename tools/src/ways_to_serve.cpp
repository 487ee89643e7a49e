#include "ways_to_serve.hpp"

#include "bf/shared_memory/robot.hpp"
#include "bf/udp/robot.hpp"
#include "model_parameters.hpp"

#include <algorithm>
#include <cctype>
#include <dlfcn.h>
#include <stdexcept>

namespace bf::tools {

using middleware::ServedRobot;
using middleware::ServeRequest;

namespace {

std::string wrong_name(const std::string& name) { return shared_memory::wrong_name(name); }
std::string wrong_address(const std::string& address) { return udp::wrong_address(address); }

std::string wrong_prefix(const std::string& prefix) {
    const auto is_fine = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
    };
    return !prefix.empty() && std::ranges::all_of(prefix, is_fine)
               ? ""
               : "the robot's name is '" + prefix + "'; write letters, digits, _ and -";
}

std::unique_ptr<ServedRobot> in_shared_memory(const ServeRequest& request) {
    const std::string name = request.option("shm") + (request.is_alone ? "" : "." + request.path);
    return middleware::make_served_robot(name, request, shared_memory::make_end(name));
}

std::unique_ptr<ServedRobot> over_udp(const ServeRequest& request) {
    return middleware::make_served_robot(request.path, request,
                                         udp::make_end(request.option("udp"), request.option("key")));
}

} // namespace

const std::vector<WayToServe>& ways_to_serve() {
    static const std::vector<WayToServe> ways{
        {.option = {"--shm", "NAME",
                    "serve the robot under this name through shared memory, to programs of this user on this "
                    "computer; several robots: NAME.BLOCK"},
         .more = {},
         .wrong = wrong_name,
         .alone = nullptr,
         .plugin = nullptr,
         .make = in_shared_memory},
        {.option = {"--udp", "WHERE",
                    "serve it over UDP at PORT, to programs of this computer, or at HOST:PORT"},
         .more = {{"--key", "FILE",
                   "with --udp: the token that controllers must know is the line in this file, which is made "
                   "if it is not there",
                   true}},
         .wrong = wrong_address,
         .alone = "an address is that of one; serve them by --shm",
         .plugin = nullptr,
         .make = over_udp},
        {.option = {"--yarp", "ROBOT",
                    "show it to programs of YARP as control boards /ROBOT/BOARD, sensors and a clock, e.g. "
                    "icubSim"},
         .more = {{"--board", "NAME=JOINTS",
                   "with --yarp: a control board and its joints, separated by commas; each joint on one of "
                   "them (torso, head, arms and legs by the names of the joints by default)",
                   false, true},
                  {"--stream", "SENSOR=/PORT",
                   "with --yarp: the port that streams this sensor's 6 or 12 numbers", false, true}},
         .wrong = wrong_prefix,
         .alone = "YARP's clock is that of one; serve them by --shm",
         .plugin = "Yarp",
         .make = nullptr},
        {.option = {"--ros1", "NAMESPACE",
                    "serve it in this namespace of ROS 1, as / or /icub: joint_states, imu, wrench and "
                    "/clock, and the commands of ros_control's controllers; the model's parameters are the "
                    "master's at NAMESPACE/model"},
         .more = {},
         .wrong = wrong_namespace,
         .alone = "/clock is that of one; serve them by --shm",
         .plugin = "Ros1",
         .make = nullptr,
         .has_reset = true,
         .parameters_by = "ROS 1"},
        {.option =
             {"--ros2", "NAMESPACE",
              "serve it in this namespace of ROS 2, as / or /icub: joint_states, imu, wrench and /clock, and "
              "the commands of ros2_control's controllers; the model's parameters are those of the node "
              "NAMESPACE/model"},
         .more = {},
         .wrong = wrong_namespace,
         .alone = "/clock is that of one; serve them by --shm",
         .plugin = "Ros2",
         .make = nullptr,
         .has_reset = true,
         .parameters_by = "ROS 2"},
    };
    return ways;
}

const WayToServe& way_to_serve(const std::string& option) {
    return *std::ranges::find(ways_to_serve(), option, [](const WayToServe& way) { return way.option.name; });
}

void* function_of(const char* plugin, const char* function, const std::string& option, Registry& registry) {
    try {
        registry.load_plugin(plugin);
    } catch (const PluginError& error) {
        throw std::runtime_error(option + " needs the plugin " + plugin +
                                 ", of which `bf doctor` says how to get it: " + error.what());
    }
    for (const auto& folder : registry.search_path())
        // The registry keeps it open.
        if (void* its = dlopen((folder / (std::string(plugin) + ".so")).c_str(), RTLD_NOW | RTLD_NOLOAD)) {
            void* found = dlsym(its, function);
            dlclose(its);
            if (found == nullptr) break;
            return found;
        }
    throw std::runtime_error(std::string("the plugin ") + plugin + " does not serve what " + option +
                             " asks for; build it again with this BlockFactory");
}

std::unique_ptr<ServedRobot> make_served_robot(const WayToServe& way, const ServeRequest& request,
                                               Registry& registry) {
    if (way.make) return way.make(request);
    void* serve = function_of(way.plugin, middleware::serve_symbol, way.option.name, registry);
    return std::unique_ptr<ServedRobot>(
        reinterpret_cast<ServedRobot* (*)(const ServeRequest&)>(serve)(request));
}

} // namespace bf::tools

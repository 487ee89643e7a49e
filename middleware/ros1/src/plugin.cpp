// The plugin Ros1.
#include "bf/middleware/served_robot.hpp"
#include "connection.hpp"
#include "parameters.hpp"
#include "robot.hpp"

extern "C" bf::middleware::ServedRobot* bf_serve_robot_v1(const bf::middleware::ServeRequest& request) {
    return bf::middleware::make_served_robot(request.path, request,
                                             bf::ros1::make_end(request.option("ros1"), request.host.waits))
        .release();
}

extern "C" bf::middleware::ServedParameters* bf_serve_parameters_v1(bf::middleware::ParameterSource& source,
                                                                    const std::string& where) {
    return bf::ros1::serve_parameters(source, where).release();
}

extern "C" void bf_plugin_v1(bf::Library& library) {
    bf::ros1::add_node(library);
    bf::ros1::add_bag(library);
    bf::ros1::add_topics(library);
    bf::ros1::add_calls(library);
    bf::ros1::add_transforms(library);
    bf::ros1::add_frames(library);
    bf::ros1::add_robot(library);
}

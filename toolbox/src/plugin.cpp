// The Whole-Body Toolbox: lists its blocks.
#include "filters/filters.hpp"
#include "qp/qp_block.hpp"
#include "rigid_body/rigid_body.hpp"
#include "robot/robot.hpp"
#include "world/world.hpp"

extern "C" __attribute__((visibility("default"))) void bf_plugin_v1(bf::Library& library) {
    bf::toolbox::add_robot(library);
    bf::toolbox::add_rigid_body(library);
    bf::toolbox::add_qp(library);
    bf::toolbox::add_filters(library);
    bf::toolbox::add_world(library);
}

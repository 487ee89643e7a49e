#include "names.hpp"

#include <cstddef>
#include <iterator>
#include <rcl/arguments.h>
#include <rcl/error_handling.h>
#include <rcl/expand_topic_name.h>
#include <rcl/validate_topic_name.h>
#include <rmw/validate_full_topic_name.h>
#include <rmw/validate_namespace.h>
#include <rmw/validate_node_name.h>

namespace bf::ros2 {

namespace {

/// By a function that looks at `whole`, which is what `name` stands for, and one that says what it has found.
template <class Check, class Why>
std::string wrong_name(const std::string& name, const std::string& whole, Check check, Why why) {
    int result = 0;
    std::size_t place = 0;
    if (check(whole.c_str(), &result, &place) != RCL_RET_OK) rcl_reset_error();
    const char* const text = why(result);
    return text == nullptr ? "" : "'" + name + "' is no name of ROS 2: " + text;
}

/// In a namespace that every node may have, without what stands for others in it.
std::string whole_name(const std::string& topic) {
    auto none = rcutils_get_zero_initialized_string_map();
    auto allocator = rcl_get_default_allocator();
    char* whole = nullptr;
    if (rcutils_string_map_init(&none, 0, allocator) != RCUTILS_RET_OK ||
        rcl_expand_topic_name(topic.c_str(), "node", "/", &none, allocator, &whole) != RCL_RET_OK)
        rcl_reset_error();
    const std::string text = whole == nullptr ? topic : whole;
    allocator.deallocate(whole, allocator.state);
    if (rcutils_string_map_fini(&none) != RCUTILS_RET_OK) rcl_reset_error();
    return text;
}

std::string wrong_topic(const std::string& name) {
    const auto wrong =
        wrong_name(name, name, rcl_validate_topic_name, rcl_topic_name_validation_result_string);
    if (!wrong.empty()) return wrong;
    return wrong_name(name, whole_name(name), rmw_validate_full_topic_name,
                      rmw_full_topic_name_validation_result_string);
}
std::string wrong_namespace(const std::string& name) {
    const std::string whole = name.starts_with('/') ? name : "/" + name;
    return wrong_name(name, whole, rmw_validate_namespace, rmw_namespace_validation_result_string);
}
std::string wrong_node(const std::string& name) {
    return wrong_name(name, name, rmw_validate_node_name, rmw_node_name_validation_result_string);
}
std::string wrong_remapping(const std::string& rule) {
    const char* const words[] = {"--ros-args", "-r", rule.c_str()};
    auto parsed = rcl_get_zero_initialized_arguments();
    const bool is_one =
        rcl_parse_arguments(std::size(words), words, rcl_get_default_allocator(), &parsed) == RCL_RET_OK;
    if (!is_one || rcl_arguments_fini(&parsed) != RCL_RET_OK) rcl_reset_error();
    return is_one ? "" : "'" + rule + "' is not given as from:=to, such as imu:=base/imu";
}

} // namespace

const middleware::NameRules name_rules{wrong_topic, wrong_namespace, wrong_node, wrong_remapping};

} // namespace bf::ros2

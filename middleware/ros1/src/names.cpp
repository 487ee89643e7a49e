#include "names.hpp"

#include <algorithm>
#include <string_view>

namespace bf::ros1 {

namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_inner(char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; }

/// A name of letters, digits, '_' and, between its parts, '/', which begins with a letter or one of `begins`.
/// roscpp takes '//' and '/' at the end, too, and leaves them out, so that one topic has several names.
std::string wrong_name(const std::string& name, std::string_view begins, bool has_parts = true) {
    const char* why = nullptr;
    if (name.empty())
        why = "it is empty";
    else if (!is_letter(name.front()) && begins.find(name.front()) == begins.npos)
        why = "it does not begin with a letter";
    else if (!std::all_of(name.begin() + 1, name.end(),
                          [&](char c) { return is_inner(c) || (has_parts && c == '/'); }))
        why = "it has more than letters, digits and '_'";
    else if (name.find("//") != name.npos || name.back() == '/')
        why = "it has a part without letters";
    return why == nullptr ? "" : "'" + name + "' is no name of ROS 1: " + why;
}

/// A NodeHandle takes no private names, which begin with '~'.
std::string wrong_topic(const std::string& name) { return wrong_name(name, "/"); }
std::string wrong_namespace(const std::string& name) {
    return name.empty() || name == "/" ? "" : wrong_name(name, "/~");
}
std::string wrong_node(const std::string& name) { return wrong_name(name, "", false); }

/// Beside those of names there are rules of roscpp itself, __key:=value, and of parameters of the node,
/// _name:=value (https://wiki.ros.org/Remapping%20Arguments).
std::string wrong_remapping(const std::string& rule) {
    const auto at = rule.find(":=");
    if (at == rule.npos || at == 0 || at + 2 == rule.size())
        return "'" + rule + "' is not given as from:=to, such as imu:=base/imu";
    const std::string from = rule.substr(0, at), to = rule.substr(at + 2);
    if (from.front() == '_') return wrong_node(from.substr(from.starts_with("__") ? 2 : 1));
    const std::string wrong = wrong_name(from, "/~");
    return wrong.empty() ? wrong_name(to, "/~") : wrong;
}

} // namespace

const middleware::NameRules name_rules{wrong_topic, wrong_namespace, wrong_node, wrong_remapping};

} // namespace bf::ros1

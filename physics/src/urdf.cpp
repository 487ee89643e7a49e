#include "urdf.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/base/packages.hpp"
#include "bf/base/text_file.hpp"
#include "bf/urdf/check.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace bf::physics {

namespace {

namespace fs = std::filesystem;

/// Text without <!-- comments -->, of which the line breaks stay.
std::string without_comments(std::string_view text) {
    std::string result;
    for (size_t at = 0;;) {
        const size_t begin = text.find("<!--", at);
        result += text.substr(at, begin - at);
        if (begin == text.npos) return result;
        at = text.find("-->", begin);
        if (at == text.npos) return result;
        for (const char c : text.substr(begin, at - begin))
            if (c == '\n') result += c;
        at += 3;
    }
}

/// Value of an attribute inside one tag, quoted either way; empty when absent.
std::string attribute(std::string_view tag, std::string_view name) {
    for (size_t at = tag.find(name); at != tag.npos; at = tag.find(name, at + 1)) {
        size_t after = tag.find_first_not_of(" \t\r\n", at + name.size());
        if (at == 0 || !std::isspace(static_cast<unsigned char>(tag[at - 1])) || after == tag.npos ||
            tag[after] != '=')
            continue;
        after = tag.find_first_of("\"'", after);
        if (after == tag.npos) return {};
        const size_t end = tag.find(tag[after], after + 1);
        return std::string(tag.substr(after + 1, end - after - 1));
    }
    return {};
}

bool is_tag(std::string_view tag, std::string_view name) {
    return tag.starts_with(name) &&
           (tag.size() == name.size() || std::isspace(static_cast<unsigned char>(tag[name.size()])) ||
            tag[name.size()] == '/');
}

double number_or(const std::string& text, double otherwise) {
    return number_of(text.starts_with('+') ? text.substr(1) : text).value_or(otherwise);
}

std::string similar_names(std::string_view wanted, std::vector<std::string> names) {
    std::string text;
    for (const auto& name : nearest_first(wanted, std::move(names)))
        text += (text.empty() ? "" : ", ") + name;
    return text;
}

} // namespace

Urdf Urdf::read(const fs::path& file) {
    std::string text_of_file;
    if (const std::string wrong = read_file(file.string(), text_of_file); !wrong.empty())
        throw std::runtime_error("cannot read the URDF '" + file.string() + "': " + wrong +
                                 "; check the path");
    Urdf urdf;
    urdf.file = fs::absolute(file).lexically_normal();
    check_urdf(text_of_file, urdf.file.string());
    urdf.text = without_comments(std::move(text_of_file));

    const std::string& text = urdf.text;
    bool in_joint = false;
    bool in_link = false;
    for (size_t begin = text.find('<'); begin != text.npos; begin = text.find('<', begin + 1)) {
        const size_t end = text.find('>', begin);
        if (end == text.npos) break;
        const std::string_view tag = std::string_view(text).substr(begin + 1, end - begin - 1);
        const bool is_empty = tag.ends_with('/');
        if (is_tag(tag, "link")) {
            urdf.links.push_back({attribute(tag, "name")});
            in_link = !is_empty;
        } else if (is_tag(tag, "joint") &&
                   !attribute(tag, "type").empty()) { // transmissions name joints as well
            urdf.joints.push_back({attribute(tag, "name"), attribute(tag, "type"), {}, {}, {}});
            in_joint = !is_empty;
        } else if (is_tag(tag, "/link"))
            in_link = false;
        else if (is_tag(tag, "/joint"))
            in_joint = false;
        else if (in_link && is_tag(tag, "inertial"))
            urdf.links.back().has_inertia = true;
        else if (in_joint && is_tag(tag, "parent"))
            urdf.joints.back().parent = attribute(tag, "link");
        else if (in_joint && is_tag(tag, "child"))
            urdf.joints.back().child = attribute(tag, "link");
        else if (in_joint && is_tag(tag, "mimic")) { // check_urdf has looked at the numbers
            UrdfJoint& joint = urdf.joints.back();
            joint.leader = attribute(tag, "joint");
            joint.multiplier = number_or(attribute(tag, "multiplier"), 1.0);
            joint.offset = number_or(attribute(tag, "offset"), 0.0);
        }
    }
    if (urdf.links.empty())
        throw std::runtime_error("'" + urdf.file.string() + "' contains no <link>; a URDF robot is expected");
    return urdf;
}

const std::string& Urdf::root() const {
    for (const UrdfLink& link : links)
        if (std::none_of(joints.begin(), joints.end(),
                         [&](const UrdfJoint& j) { return j.child == link.name; }))
            return link.name;
    throw std::runtime_error("'" + file.string() +
                             "' has no root: every link is the child of a joint, in a loop");
}

const std::string& Urdf::first_heavy_link() const {
    std::vector<std::string_view> level{root()};
    for (size_t i = 0; i < level.size() && i < links.size(); ++i) {
        for (const UrdfLink& link : links)
            if (link.name == level[i] && link.has_inertia) return link.name;
        for (const UrdfJoint& joint : joints)
            if (joint.parent == level[i]) level.push_back(joint.child);
    }
    throw std::runtime_error("no link of '" + file.string() +
                             "' has an <inertial>; a robot needs mass to move");
}

const UrdfJoint* Urdf::find_joint(std::string_view name) const {
    const auto found =
        std::find_if(joints.begin(), joints.end(), [&](const auto& j) { return j.name == name; });
    return found == joints.end() ? nullptr : &*found;
}

std::vector<Follower> Urdf::followers_of(const std::vector<std::string>& listed) const {
    const auto is_listed = [&](const std::string& name) {
        return std::find(listed.begin(), listed.end(), name) != listed.end();
    };
    std::vector<Follower> followers;
    for (const UrdfJoint& joint : joints) {
        if (!joint.is_movable() || joint.leader.empty() || is_listed(joint.name)) continue;
        Follower follower{joint.name, joint.leader, joint.multiplier, joint.offset};
        for (size_t steps = 0; !follower.leader.empty() && !is_listed(follower.leader); ++steps) {
            if (steps > joints.size())
                throw std::runtime_error("joint '" + joint.name + "' of '" + file.string() +
                                         "' mimics itself through others; list one of them as a joint");
            const UrdfJoint* leader = find_joint(follower.leader);
            if (!leader)
                throw std::runtime_error("joint '" + joint.name + "' of '" + file.string() + "' mimics '" +
                                         follower.leader +
                                         "', which is no joint there; correct the name in <mimic>, or leave "
                                         "<mimic> out");
            if (leader->leader.empty()) {
                follower.leader.clear(); // which is locked at zero
                break;
            }
            follower.offset += follower.multiplier * leader->offset;
            follower.multiplier *= leader->multiplier;
            follower.leader = leader->leader;
        }
        if (!follower.leader.empty() || follower.offset != 0.0) followers.push_back(std::move(follower));
    }
    return followers;
}

bool Urdf::has_link(std::string_view name) const {
    return std::any_of(links.begin(), links.end(), [&](const auto& link) { return link.name == name; });
}

void Urdf::require_link(const std::string& name, const std::string& role) const {
    if (has_link(name)) return;
    std::vector<std::string> names;
    for (const UrdfLink& link : links) names.push_back(link.name);
    throw std::runtime_error("'" + file.string() + "' has no link '" + name + "', wanted as " + role +
                             "; similar names: " + similar_names(name, std::move(names)));
}

const UrdfJoint& Urdf::require_motor(const std::string& name) const {
    const UrdfJoint* joint = find_joint(name);
    if (joint && joint->is_movable()) return *joint;
    if (joint)
        throw std::runtime_error("joint '" + name + "' of '" + file.string() +
                                 "' has no motor: its type is " + joint->type +
                                 "; controlled joints are revolute, continuous or prismatic");
    std::vector<std::string> names;
    for (const UrdfJoint& other : joints)
        if (other.is_movable()) names.push_back(other.name);
    throw std::runtime_error("'" + file.string() + "' has no joint '" + name +
                             "'; similar names: " + similar_names(name, std::move(names)));
}

fs::path Urdf::mesh_file(const std::string& address, const std::string& link,
                         const std::vector<fs::path>& package_paths, const std::string& meshdir) const {
    std::string searched;
    for (const fs::path& candidate : mesh_candidates(address, file, package_paths, meshdir)) {
        if (fs::is_regular_file(candidate)) return candidate.lexically_normal();
        searched += "\n- " + candidate.string();
    }
    throw std::runtime_error("mesh '" + address + "' of link '" + link + "' in '" + file.string() +
                             "' was not found; add the folder that holds the package to " +
                             package_variables + "; searched:" + searched);
}

} // namespace bf::physics

#include "parts.hpp"

#include "bf/base/names.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace bf::yarp {

namespace {

/// "left_", "right_" or "", which is taken off the name.
std::string take_side(std::string& name) {
    for (const auto& [prefix, side] : {std::pair("l_", "left_"), {"r_", "right_"}})
        for (const std::string& begin : {std::string(prefix), std::string(side)})
            if (name.starts_with(begin)) {
                name.erase(0, begin.size());
                return side;
            }
    return "";
}

std::string part_of(std::string joint) {
    static const std::pair<const char*, std::vector<const char*>> words[] = {
        {"leg", {"hip", "knee", "ankle", "leg", "foot", "toe"}},
        {"arm",
         {"shoulder", "elbow", "wrist", "arm", "hand", "thumb", "index", "middle", "ring", "little", "pinkie",
          "pinky"}},
        {"torso", {"torso", "waist", "chest", "spine"}},
        {"head", {"neck", "head", "eye"}}};
    const std::string side = take_side(joint);
    for (const auto& [part, names] : words) {
        const bool has_sides = part[0] == 'l' || part[0] == 'a';
        if (has_sides == side.empty() && part[0] != 'h') continue;
        for (const char* name : names)
            if (joint.find(name) != joint.npos) return has_sides ? side + part : part;
    }
    return "body";
}

} // namespace

std::vector<Part> parts_of(const std::vector<std::string>& joints) {
    std::vector<Part> parts;
    for (const auto& joint : joints) {
        const std::string name = part_of(joint);
        const auto known = std::ranges::find(parts, name, &Part::name);
        (known == parts.end() ? parts.emplace_back(Part{name, {}}) : *known).joints.push_back(joint);
    }
    return parts;
}

std::vector<Part> read_parts(const std::vector<std::string>& texts, const std::vector<std::string>& joints) {
    std::vector<Part> parts;
    std::vector<std::string> left = joints;
    for (const auto& text : texts) {
        const auto refuse = [&](const std::string& why) {
            throw std::runtime_error("--board '" + text + "': " + why);
        };
        const auto equals = text.find('=');
        if (equals == text.npos || equals == 0)
            refuse("write it as NAME=JOINT,JOINT,..., such as torso=torso_yaw,torso_roll,torso_pitch");
        Part part{text.substr(0, equals), {}};
        if (part.name.find('/') != part.name.npos) refuse("its name has no /; the robot's is before it");
        if (std::ranges::find(parts, part.name, &Part::name) != parts.end())
            refuse("there are two boards of that name");
        for (std::size_t begin = equals + 1; begin <= text.size();) {
            const auto end = std::min(text.find(',', begin), text.size());
            const std::string joint = text.substr(begin, end - begin);
            const auto found = std::ranges::find(left, joint);
            if (found == left.end())
                refuse(std::ranges::find(joints, joint) != joints.end()
                           ? "the joint '" + joint + "' is on two boards"
                           : "the robot has no joint '" + joint + "'" + did_you_mean(joint, joints));
            part.joints.push_back(joint);
            left.erase(found);
            begin = end + 1;
        }
        parts.push_back(std::move(part));
    }
    if (!left.empty())
        throw std::runtime_error("--board: the joint '" + left.front() +
                                 "' is on no board; give each joint a board, or leave --board out");
    return parts;
}

std::string stream_of(const std::string& sensor) {
    std::string name = sensor;
    for (const std::string end : {"_ft_sensor", "_ft"})
        if (name.ends_with(end)) name.erase(name.size() - end.size());
    const std::string side = take_side(name);
    return side + name + "/analog:o";
}

} // namespace bf::yarp

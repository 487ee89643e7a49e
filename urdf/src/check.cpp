#include "bf/urdf/check.hpp"

#include "bf/base/value_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tinyxml2.h>
#include <vector>

namespace bf {
namespace {

using tinyxml2::XMLElement;

std::string text_of(const XMLElement& element, const char* attribute) {
    const char* text = element.Attribute(attribute);
    return text ? text : "";
}

class Check {
  public:
    explicit Check(const std::string& file) : file_(file) {}

    void link(const XMLElement& link) const {
        if (const auto* inertial = link.FirstChildElement("inertial")) {
            origin(link, *inertial);
            if (const auto* mass = inertial->FirstChildElement("mass")) {
                if (!mass->Attribute("value"))
                    fail(link, *mass, "value", "it is missing; give the mass in kg");
                not_negative(link, *mass, "value");
            }
            if (const auto* inertia = inertial->FirstChildElement("inertia")) {
                for (const char* moment : {"ixx", "iyy", "izz"}) not_negative(link, *inertia, moment);
                for (const char* product : {"ixy", "ixz", "iyz"}) finite(link, *inertia, product, 1);
            }
        }
        for (const char* part : {"visual", "collision"})
            for (const auto* shape = link.FirstChildElement(part); shape;
                 shape = shape->NextSiblingElement(part))
                origin(link, *shape);
    }

    void joint(const XMLElement& joint) const {
        origin(joint, joint);
        const std::string type = text_of(joint, "type");
        constexpr std::array types{"revolute", "continuous", "prismatic", "fixed", "floating", "planar"};
        if (std::find(types.begin(), types.end(), type) == types.end())
            fail(joint, joint, "type",
                 "a joint is revolute, continuous, prismatic, fixed, floating or planar; choose one of them");
        const bool has_limits = type == "revolute" || type == "prismatic";
        if (const auto* axis = joint.FirstChildElement("axis")) {
            const auto xyz = finite(joint, *axis, "xyz", 3);
            const bool is_used = has_limits || type == "continuous" || type == "planar";
            if (is_used && !xyz.empty() &&
                std::all_of(xyz.begin(), xyz.end(), [](double x) { return x == 0; }))
                fail(joint, *axis, "xyz", "an axis has a direction; give one, e.g. 0 0 1");
        }
        if (const auto* limit = joint.FirstChildElement("limit")) {
            for (const char* name : {"effort", "velocity"})
                for (const double value : numbers(joint, *limit, name, 1))
                    if (value < 0) fail(joint, *limit, name, "it is negative; give 0 or more");
            const auto lower = numbers(joint, *limit, "lower", 1), upper = numbers(joint, *limit, "upper", 1);
            const double least = lower.empty() ? 0 : lower[0], most = upper.empty() ? 0 : upper[0];
            if (has_limits && least > most)
                fail(joint, *limit, "lower",
                     "it is above the upper limit, '" + text_of(*limit, "upper") + "'; exchange them");
            // Exporters write zeros where they know no limits.
            if (has_limits && least == most && least != 0)
                fail(joint, *limit, "lower",
                     "it is the upper limit, too, which leaves the joint no way; make it fixed with this "
                     "angle or length in its origin, or give it a range; 0 for both stands for no limits");
        }
        if (const auto* dynamics = joint.FirstChildElement("dynamics"))
            for (const char* name : {"damping", "friction"}) finite(joint, *dynamics, name, 1);
        if (const auto* mimic = joint.FirstChildElement("mimic"))
            for (const char* name : {"multiplier", "offset"}) finite(joint, *mimic, name, 1);
    }

    /// No two links, or joints, have one name.
    void is_new(const XMLElement& element, std::set<std::string>& names) const {
        if (!names.insert(text_of(element, "name")).second)
            fail(element, element, "name",
                 std::string("another ") + element.Name() + " has this name; rename one of them");
    }

    /// What the joints say of links and of each other.
    void tree(const std::vector<const XMLElement*>& joints) const {
        std::map<std::string, std::string> parent_joints; // of a link
        std::map<std::string, const XMLElement*> above;   // a link, by its name
        for (const auto* joint : joints) {
            const std::string name = text_of(*joint, "name");
            const auto* parent = joint->FirstChildElement("parent");
            const auto* child = joint->FirstChildElement("child");
            if (parent && child) {
                const std::string link = text_of(*child, "link");
                if (link == text_of(*parent, "link"))
                    fail(*joint, *child, "link", "it is the parent of this joint, too; give two links");
                const auto [known, is_first] = parent_joints.emplace(link, name);
                above.emplace(link, joint);
                if (!is_first)
                    fail(*joint, *child, "link",
                         "it is the child of the joint '" + known->second +
                             "' already; the joints of a robot form a tree: leave one of them out");
            }
            const auto* mimic = joint->FirstChildElement("mimic");
            // One of another file, of which this is a part, is left out by whoever reads it.
            if (mimic && text_of(*mimic, "joint") == name)
                fail(*joint, *mimic, "joint", "a joint cannot mimic itself; name another one");
        }
        std::set<const XMLElement*> checked; // they lead to a link without a parent
        for (const auto* joint : joints) {
            std::set<const XMLElement*> way;
            for (const auto* at = joint; at && !checked.contains(at);) {
                const auto* parent = at->FirstChildElement("parent");
                if (!parent || !at->FirstChildElement("child")) break;
                if (!way.insert(at).second)
                    fail(*at, *parent, "link",
                         "it hangs on this joint's own child, in a loop; the joints of a robot form a tree: "
                         "leave one of them out");
                const auto next = above.find(text_of(*parent, "link"));
                at = next == above.end() ? nullptr : next->second;
            }
            checked.insert(way.begin(), way.end());
        }
    }

  private:
    [[noreturn]] void fail(const XMLElement& owner, const XMLElement& element, const char* attribute,
                           const std::string& rule) const {
        throw std::runtime_error("'" + file_ + "', line " + std::to_string(element.GetLineNum()) + ": " +
                                 owner.Name() + " '" + text_of(owner, "name") + "', <" + element.Name() +
                                 " " + attribute + "=\"" + text_of(element, attribute) + "\">: " + rule);
    }

    /// The numbers of an attribute; none where it is left out.
    std::vector<double> numbers(const XMLElement& owner, const XMLElement& element, const char* attribute,
                                std::size_t count) const {
        std::vector<double> values;
        if (!element.Attribute(attribute)) return values;
        std::istringstream words(text_of(element, attribute));
        for (std::string word; words >> word;) {
            double value = 0;
            // The libraries that read the file know no exponents after d.
            if (word.find_first_of("dD") != word.npos || !read_value(word, value).empty() ||
                std::isnan(value))
                fail(owner, element, attribute,
                     "'" + word + "' is no number that fits; write digits with a point, e.g. 1.5 or 2e-3");
            values.push_back(value);
        }
        if (values.size() != count)
            fail(owner, element, attribute,
                 "it has " + std::to_string(values.size()) + " numbers; give " + std::to_string(count));
        return values;
    }

    std::vector<double> finite(const XMLElement& owner, const XMLElement& element, const char* attribute,
                               std::size_t count) const {
        const auto values = numbers(owner, element, attribute, count);
        for (const double value : values)
            if (std::isinf(value))
                fail(owner, element, attribute, "it is infinite; give a finite number");
            else if (std::abs(value) > 1e10) // whose squares and products may overflow
                fail(owner, element, attribute, "it is too large; give numbers from -1e10 to 1e10");
        return values;
    }

    void not_negative(const XMLElement& owner, const XMLElement& element, const char* attribute) const {
        constexpr double rounding = 1e-12; // exporters write moments of massless links as -5e-20
        for (const double value : finite(owner, element, attribute, 1))
            if (value < -rounding) fail(owner, element, attribute, "it is negative; give 0 or more");
    }

    void origin(const XMLElement& owner, const XMLElement& element) const {
        if (const auto* origin = element.FirstChildElement("origin"))
            for (const char* name : {"xyz", "rpy"}) finite(owner, *origin, name, 3);
    }

    const std::string& file_;
};

} // namespace

void check_urdf(const std::string& xml, const std::string& file) {
    tinyxml2::XMLDocument document;
    if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) return;
    const auto* robot = document.FirstChildElement("robot");
    if (!robot) return;
    if (const auto* second = robot->NextSiblingElement())
        throw std::runtime_error("'" + file + "', line " + std::to_string(second->GetLineNum()) +
                                 ": a file describes one robot; remove what follows </robot>");
    // Those who read the file call themselves once per link of a chain.
    constexpr int most_links = 1000;
    int links = 0;
    for (const auto* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
        ++links;
    if (links > most_links)
        throw std::runtime_error("'" + file + "' has " + std::to_string(links) +
                                 " links; a robot has at most " + std::to_string(most_links) +
                                 ": join those that fixed joints hold together");
    const Check check(file);
    std::set<std::string> names_of_links, names_of_joints;
    for (const auto* link = robot->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
        check.is_new(*link, names_of_links);
        check.link(*link);
    }
    std::vector<const XMLElement*> joints;
    for (const auto* joint = robot->FirstChildElement("joint"); joint;
         joint = joint->NextSiblingElement("joint")) {
        check.is_new(*joint, names_of_joints);
        check.joint(*joint);
        joints.push_back(joint);
    }
    check.tree(joints);
}

} // namespace bf

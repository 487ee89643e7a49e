#include "bf/dynamics/model.hpp"

#include "content.hpp"

#include "bf/base/names.hpp"

#include <console_bridge/console.h>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <mutex>
#include <numeric>
#include <set>
#include <sstream>
#include <stdexcept>

namespace bf::dynamics {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    if (!fs::is_regular_file(path) || !file || (file.peek() != EOF && !(text << file.rdbuf()))) {
        throw std::runtime_error("URDF file '" + path.string() +
                                 "' cannot be read: check the path, or look the robot up with find_urdf");
    }
    return text.str();
}

/// Receives what urdfdom would print.
class Messages : public console_bridge::OutputHandler {
  public:
    Messages() { console_bridge::useOutputHandler(this); }
    ~Messages() override { console_bridge::restorePreviousOutputHandler(); }
    void log(const std::string& line, console_bridge::LogLevel, const char*, int) override {
        text += line + "; ";
    }

    std::string text;
};

urdf::ModelInterfaceSharedPtr parse(const std::string& xml, const fs::path& path) {
    static std::mutex one_at_a_time; // the receiver of messages is one for the whole process
    const std::lock_guard lock(one_at_a_time);
    Messages messages;
    const urdf::ModelInterfaceSharedPtr urdf = urdf::parseURDF(xml);
    if (!urdf) {
        throw std::runtime_error("'" + path.string() + "' is not a valid URDF: " + messages.text +
                                 "it must be an XML document with one <robot> whose joints form one tree");
    }
    return urdf;
}

std::string quoted(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
    return text;
}

/// The names most similar to a wrong one, best first.
std::string similar(const std::string& name, std::vector<std::string> names) {
    return names.empty() ? "none" : quoted(nearest_first(name, std::move(names)));
}

bool is_single(const urdf::Joint& joint) {
    return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
           joint.type == urdf::Joint::PRISMATIC;
}

/// Value of an attribute in the text of one XML tag; empty when absent.
std::string attribute(const std::string& tag, const std::string& name) {
    for (std::size_t at = tag.find(name); at != std::string::npos; at = tag.find(name, at + 1)) {
        const std::size_t equals = tag.find_first_not_of(" \t\r\n", at + name.size());
        if (!std::isspace(static_cast<unsigned char>(tag[at - 1])) || equals == std::string::npos ||
            tag[equals] != '=') {
            continue;
        }
        const std::size_t quote = tag.find_first_of("'\"", equals);
        if (quote == std::string::npos) break;
        return tag.substr(quote + 1, tag.find(tag[quote], quote + 1) - quote - 1);
    }
    return {};
}

/// Movable joints in the order of the file, which urdfdom forgets. Joints that transmissions and simulators
/// mention have no type.
std::vector<std::string> movable_joints(const std::string& xml, const urdf::ModelInterface& urdf) {
    std::vector<std::string> names;
    for (std::size_t at = 0; at < xml.size();) {
        const std::size_t tag = xml.find('<', at);
        if (tag == std::string::npos) break;
        const bool comment = xml.compare(tag, 4, "<!--") == 0;
        const std::size_t end = comment ? xml.find("-->", tag) : xml.find('>', tag);
        at = end == std::string::npos ? xml.size() : end + 1;
        const std::string text = xml.substr(tag, at - tag);
        if (!text.starts_with("<joint") || attribute(text, "type").empty()) continue;
        const auto joint = urdf.joints_.find(attribute(text, "name"));
        if (joint != urdf.joints_.end() && joint->second->type != urdf::Joint::FIXED)
            names.push_back(joint->first);
    }
    return names;
}

void check_joints(const std::vector<std::string>& wanted, const urdf::ModelInterface& urdf,
                  const fs::path& path) {
    std::vector<std::string> known;
    for (const auto& [name, joint] : urdf.joints_) {
        if (is_single(*joint)) known.push_back(name);
    }
    const std::string where = "' of '" + path.string() + "' ";
    std::set<std::string> seen;
    for (const std::string& name : wanted) {
        const auto joint = urdf.joints_.find(name);
        if (joint == urdf.joints_.end()) {
            throw std::runtime_error("joint '" + name + where +
                                     "does not exist; most similar: " + similar(name, known));
        }
        if (joint->second->type == urdf::Joint::FIXED) {
            throw std::runtime_error("joint '" + name + where +
                                     "is fixed and has no position; remove it from the list of joints");
        }
        if (!is_single(*joint->second)) {
            throw std::runtime_error(
                "joint '" + name + where +
                "has more than one degree of freedom; only revolute, continuous and prismatic "
                "joints can be listed, and any other is locked when the list leaves it out");
        }
        if (!seen.insert(name).second) {
            throw std::runtime_error("joint '" + name + where + "is listed twice; list every joint once");
        }
    }
}

/// The tree of the wanted joints below a free-flying base.
pinocchio::Model build(const urdf::ModelInterfaceSharedPtr& urdf, const std::vector<std::string>& wanted) {
    pinocchio::Model full;
    pinocchio::urdf::buildModel(urdf, pinocchio::JointModelFreeFlyer(), full);
    std::vector<pinocchio::JointIndex> locked;
    for (pinocchio::JointIndex i = 2; i < full.names.size(); ++i) {
        if (std::find(wanted.begin(), wanted.end(), full.names[i]) == wanted.end()) locked.push_back(i);
    }
    return pinocchio::buildReducedModel(full, locked, pinocchio::neutral(full));
}

void read_limits(const urdf::ModelInterface& urdf, Model::Content& content) {
    const auto n = static_cast<Eigen::Index>(content.joint_names.size());
    content.position_max.setConstant(n, std::numeric_limits<double>::infinity());
    content.position_min = -content.position_max;
    content.velocity_max = content.effort_max = content.position_max;
    for (Eigen::Index i = 0; i < n; ++i) {
        const urdf::Joint& joint = *urdf.joints_.at(content.joint_names[static_cast<std::size_t>(i)]);
        if (!joint.limits) continue;
        content.velocity_max[i] = joint.limits->velocity;
        content.effort_max[i] = joint.limits->effort;
        if (joint.type == urdf::Joint::CONTINUOUS) continue;
        content.position_min[i] = joint.limits->lower;
        content.position_max[i] = joint.limits->upper;
    }
}

void number_joints(Model::Content& content) {
    const pinocchio::Model& tree = content.tree;
    std::vector<int> listed(static_cast<std::size_t>(tree.njoints), -1);
    for (const std::string& name : content.joint_names) {
        const pinocchio::JointIndex number = tree.getJointId(name);
        listed[number] = static_cast<int>(content.joints.size());
        content.joints.push_back(
            {static_cast<int>(number), tree.idx_qs[number], tree.idx_vs[number], tree.nqs[number] == 2});
    }
    content.supports.resize(listed.size());
    for (std::size_t i = 2; i < listed.size(); ++i) {
        content.supports[i] = content.supports[tree.parents[i]];
        content.supports[i].push_back({tree.idx_vs[i], listed[i]});
    }
}

void number_frames(Model::Content& content) {
    for (const pinocchio::Frame& frame : content.tree.frames) {
        if (frame.type != pinocchio::BODY) continue;
        content.frame_index.emplace(frame.name, static_cast<int>(content.frames.size()));
        content.frame_names.push_back(frame.name);
        content.frames.push_back(
            {frame.parentJoint, frame.placement.rotation(), frame.placement.translation()});
    }
}

} // namespace

Model Model::load(const fs::path& path, const std::vector<std::string>& joints,
                  const Eigen::Vector3d& gravity) {
    const std::string xml = read(path);
    const urdf::ModelInterfaceSharedPtr urdf = parse(xml, path);
    auto content = std::make_shared<Content>();
    content->joint_names = joints.empty() ? movable_joints(xml, *urdf) : joints;
    check_joints(content->joint_names, *urdf, path);
    try {
        content->tree = build(urdf, content->joint_names);
    } catch (const std::exception& error) {
        throw std::runtime_error("'" + path.string() + "' has no rigid-body model: " + error.what());
    }
    content->tree.gravity.linear() = content->gravity = gravity;
    content->base_link = urdf->getRoot()->name;
    for (const pinocchio::Inertia& inertia : content->tree.inertias) content->total_mass += inertia.mass();
    number_joints(*content);
    number_frames(*content);
    read_limits(*urdf, *content);
    return Model(std::move(content));
}

const std::vector<std::string>& Model::joint_names() const { return content_->joint_names; }
int Model::joints() const { return static_cast<int>(content_->joints.size()); }
double Model::total_mass() const { return content_->total_mass; }
const Eigen::Vector3d& Model::gravity() const { return content_->gravity; }
const std::string& Model::base_link() const { return content_->base_link; }
const std::vector<std::string>& Model::frame_names() const { return content_->frame_names; }
bool Model::has_frame(const std::string& name) const { return content_->frame_index.contains(name); }

Frame Model::frame(const std::string& name) const {
    const auto found = content_->frame_index.find(name);
    if (found == content_->frame_index.end()) {
        throw std::runtime_error("frame '" + name + "' is not a link of robot '" + content_->tree.name +
                                 "'; most similar: " + similar(name, content_->frame_names));
    }
    return {found->second};
}

const Eigen::VectorXd& Model::position_min() const { return content_->position_min; }
const Eigen::VectorXd& Model::position_max() const { return content_->position_max; }
const Eigen::VectorXd& Model::velocity_max() const { return content_->velocity_max; }
const Eigen::VectorXd& Model::effort_max() const { return content_->effort_max; }

} // namespace bf::dynamics

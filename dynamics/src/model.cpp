#include "bf/dynamics/model.hpp"

#include "content.hpp"

#include "bf/base/names.hpp"
#include "bf/base/text_file.hpp"
#include "bf/urdf/check.hpp"

#include <console_bridge/console.h>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <sstream>
#include <stdexcept>

namespace bf::dynamics {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
    std::string text;
    if (const std::string wrong = read_file(path.string(), text); !wrong.empty())
        throw std::runtime_error("URDF file '" + path.string() + "' cannot be read: " + wrong +
                                 "; check the path, or look the robot up with find_urdf");
    return text;
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
std::string most_similar(const std::string& name, std::vector<std::string> names) {
    return names.empty() ? "none" : quoted(nearest_first(name, std::move(names)));
}

bool is_single(const urdf::Joint& joint) {
    return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
           joint.type == urdf::Joint::PRISMATIC;
}

/// Joints of one degree of freedom that the URDF lets follow another such joint.
std::map<std::string, urdf::JointMimic> mimics(const urdf::ModelInterface& urdf) {
    std::map<std::string, urdf::JointMimic> found;
    for (const auto& [name, joint] : urdf.joints_) {
        if (!joint->mimic || !is_single(*joint)) continue;
        const auto leader = urdf.joints_.find(joint->mimic->joint_name);
        if (leader != urdf.joints_.end() && is_single(*leader->second)) found.emplace(name, *joint->mimic);
    }
    return found;
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

/// Movable joints that mimic none, in the order of the file, which urdfdom forgets. Joints that transmissions
/// and simulators mention have no type.
std::vector<std::string> movable_joints(const std::string& xml, const urdf::ModelInterface& urdf) {
    const std::map<std::string, urdf::JointMimic> mimicking = mimics(urdf);
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
        if (joint != urdf.joints_.end() && joint->second->type != urdf::Joint::FIXED &&
            !mimicking.contains(joint->first))
            names.push_back(joint->first);
    }
    return names;
}

/// What the joints do that are not listed but mimic another.
std::vector<Follower> find_followers(const std::vector<std::string>& listed, const urdf::ModelInterface& urdf,
                                     const fs::path& path) {
    const std::map<std::string, urdf::JointMimic> mimicking = mimics(urdf);
    const auto is_listed = [&](const std::string& name) {
        return std::find(listed.begin(), listed.end(), name) != listed.end();
    };
    std::vector<Follower> followers;
    for (const auto& [name, mimic] : mimicking) {
        if (is_listed(name)) continue;
        Follower follower{name, name, 1.0, 0.0};
        for (std::size_t steps = 0; !follower.leader.empty() && !is_listed(follower.leader); ++steps) {
            const auto next = mimicking.find(follower.leader);
            if (next == mimicking.end()) {
                follower.leader.clear(); // locked at zero
                break;
            }
            if (steps > mimicking.size()) {
                throw std::runtime_error("joint '" + name + "' of '" + path.string() +
                                         "' mimics itself through others; list one of them as a joint");
            }
            follower.offset += follower.multiplier * next->second.offset;
            follower.multiplier *= next->second.multiplier;
            follower.leader = next->second.joint_name;
        }
        if (!follower.leader.empty() || follower.offset != 0.0) followers.push_back(follower);
    }
    return followers;
}

/// Pinocchio keeps joints and links in one list of names, a URDF in two. No name of a URDF begins like this,
/// because XML turns line breaks of attributes into spaces.
std::string inner_name(const std::string& joint) { return "\n" + joint; }
std::string outer_name(const std::string& inner) { return inner.substr(1); }

/// Makes `base` the root: every joint on the way turns around. A joint places its child C in its parent P by
/// P_H_C = T R(q). The reversed joint moves a link V by C_H_V = R(-q), to which P is fixed by V_H_P = T⁻¹.
void make_root(urdf::ModelInterface& urdf, const std::string& base) {
    std::vector<urdf::JointSharedPtr> way;
    for (urdf::LinkSharedPtr link = urdf.links_.at(base); link->parent_joint;
         link = urdf.links_.at(link->parent_joint->parent_link_name)) {
        way.push_back(link->parent_joint);
    }
    for (const urdf::JointSharedPtr& joint : way) {
        const urdf::LinkSharedPtr child = urdf.links_.at(joint->child_link_name);
        const urdf::LinkSharedPtr parent = urdf.links_.at(joint->parent_link_name);
        std::erase(parent->child_joints, joint);
        std::erase(parent->child_links, child);

        const auto moved = std::make_shared<urdf::Link>();
        moved->name = inner_name(parent->name);
        const auto fixed = std::make_shared<urdf::Joint>();
        fixed->name = inner_name(moved->name);
        fixed->type = urdf::Joint::FIXED;
        fixed->parent_link_name = moved->name;
        fixed->child_link_name = parent->name;
        const urdf::Pose& T = joint->parent_to_joint_origin_transform;
        urdf::Pose& inverse = fixed->parent_to_joint_origin_transform;
        inverse.rotation = T.rotation.GetInverse();
        const urdf::Vector3 p = inverse.rotation * T.position;
        inverse.position = urdf::Vector3(-p.x, -p.y, -p.z);
        moved->child_joints = {fixed};
        moved->child_links = {parent};
        moved->parent_joint = joint;
        moved->setParent(child);
        parent->parent_joint = fixed;
        parent->setParent(moved);

        joint->parent_link_name = child->name;
        joint->child_link_name = moved->name;
        joint->parent_to_joint_origin_transform.clear();
        joint->axis = urdf::Vector3(-joint->axis.x, -joint->axis.y, -joint->axis.z);
        child->child_joints.push_back(joint);
        child->child_links.push_back(moved);
        urdf.links_.emplace(moved->name, moved);
    }
    const urdf::LinkSharedPtr root = urdf.links_.at(base);
    root->parent_joint.reset();
    root->setParent(nullptr);
    urdf.root_link_ = root;
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
                                     "does not exist; most similar: " + most_similar(name, known));
        }
        if (joint->second->type == urdf::Joint::FIXED) {
            throw std::runtime_error("joint '" + name + where +
                                     "is fixed and has no position; remove it from the list of joints");
        }
        if (!is_single(*joint->second)) {
            throw std::runtime_error(
                "joint '" + name + where +
                "has more than one degree of freedom; only revolute, continuous and prismatic joints can be "
                "listed, and any other is locked when the list leaves it out");
        }
        if (!seen.insert(name).second) {
            throw std::runtime_error("joint '" + name + where + "is listed twice; list every joint once");
        }
    }
}

/// The tree of the joints that move, below a free-flying base.
pinocchio::Model build(const urdf::ModelInterfaceSharedPtr& urdf, const Model::Content& content) {
    for (const auto& [name, joint] : urdf->joints_) joint->name = inner_name(name);
    pinocchio::Model full;
    pinocchio::urdf::buildModel(urdf, pinocchio::JointModelFreeFlyer(), inner_name(""), full);
    std::set<std::string> moving;
    for (const std::string& name : content.joint_names) moving.insert(inner_name(name));
    Eigen::VectorXd q = pinocchio::neutral(full);
    for (const Follower& follower : content.followers) {
        if (!follower.leader.empty()) {
            moving.insert(inner_name(follower.joint));
            continue;
        }
        const pinocchio::JointIndex i = full.getJointId(inner_name(follower.joint));
        const bool angle = full.nqs[i] == 2;
        q[full.idx_qs[i]] = angle ? std::cos(follower.offset) : follower.offset;
        if (angle) q[full.idx_qs[i] + 1] = std::sin(follower.offset);
    }
    std::vector<pinocchio::JointIndex> locked;
    for (pinocchio::JointIndex i = 2; i < full.names.size(); ++i) {
        if (!moving.contains(full.names[i])) locked.push_back(i);
    }
    return pinocchio::buildReducedModel(full, locked, q);
}

void read_limits(const urdf::ModelInterface& urdf, Model::Content& content) {
    const auto n = static_cast<Eigen::Index>(content.joint_names.size());
    content.position_max.setConstant(n, std::numeric_limits<double>::infinity());
    content.position_min = -content.position_max;
    content.velocity_max = content.effort_max = content.position_max;
    for (Eigen::Index i = 0; i < n; ++i) {
        const urdf::Joint& joint = *urdf.joints_.at(content.joint_names[static_cast<std::size_t>(i)]);
        if (!joint.limits) continue;
        if (joint.limits->velocity > 0.0) content.velocity_max[i] = joint.limits->velocity;
        if (joint.limits->effort > 0.0) content.effort_max[i] = joint.limits->effort;
        if (joint.type == urdf::Joint::CONTINUOUS || joint.limits->lower >= joint.limits->upper) continue;
        content.position_min[i] = joint.limits->lower;
        content.position_max[i] = joint.limits->upper;
    }
}

/// Pinocchio's joint 0 is the world and joint 1 the base, which is our body 0.
std::size_t body_of(pinocchio::JointIndex joint) { return joint - 1; }

Body describe(const pinocchio::Model& tree, pinocchio::JointIndex i, const urdf::ModelInterface& urdf) {
    Body body;
    const pinocchio::Inertia& inertia = tree.inertias[i];
    body.mass = inertia.mass();
    body.com = inertia.lever();
    body.inertia = inertia.inertia().matrix();
    if (i == 1) return body;
    body.parent = body_of(tree.parents[i]);
    const pinocchio::SE3& placement = tree.jointPlacements[i];
    body.origin = placement.translation();
    const urdf::Joint& joint = *urdf.joints_.at(outer_name(tree.names[i]));
    body.turns = joint.type != urdf::Joint::PRISMATIC;
    body.axis = Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
    for (int c = 0; c < 3; ++c) { // all but along x, y or z is along it, as Pinocchio has it
        const Eigen::Vector3d unit = Eigen::Vector3d::Unit(c);
        if (body.axis.isApprox(unit)) body.axis = unit;
    }
    body.fixed = placement.rotation();
    if (body.turns) { // Rodrigues: R(q) = a aᵀ + cos(q) (1 - a aᵀ) + sin(q) [a]×
        const Eigen::Vector3d& a = body.axis;
        body.fixed = placement.rotation() * a * a.transpose();
        body.cosine = placement.rotation() - body.fixed;
        for (int c = 0; c < 3; ++c)
            body.sine.col(c) = placement.rotation() * a.cross(Eigen::Vector3d::Unit(c));
    }
    return body;
}

void number_joints(const pinocchio::Model& tree, const urdf::ModelInterface& urdf, Model::Content& content) {
    const auto count = static_cast<pinocchio::JointIndex>(tree.njoints);
    for (pinocchio::JointIndex i = 1; i < count; ++i) {
        content.bodies.push_back(describe(tree, i, urdf));
        content.total_mass += tree.inertias[i].mass();
    }
    const auto number = [&](const std::string& name, std::size_t position) {
        content.bodies[body_of(tree.getJointId(inner_name(name)))].joint = static_cast<int>(position);
    };
    const std::size_t n = content.joint_names.size();
    for (std::size_t i = 0; i < n; ++i) number(content.joint_names[i], i);
    for (const Follower& follower : content.followers) {
        if (follower.leader.empty()) continue;
        const auto leader =
            std::find(content.joint_names.begin(), content.joint_names.end(), follower.leader);
        number(follower.joint, n + content.moving_followers.size());
        content.moving_followers.push_back(
            {static_cast<int>(leader - content.joint_names.begin()), follower.multiplier, follower.offset});
    }
    content.supports.resize(content.bodies.size());
    content.follower_supports.resize(content.bodies.size());
    for (std::size_t k = 1; k < content.bodies.size(); ++k) {
        const Body& body = content.bodies[k];
        content.supports[k] = content.supports[body.parent];
        content.follower_supports[k] = content.follower_supports[body.parent];
        const bool follows = static_cast<std::size_t>(body.joint) >= n;
        (follows ? content.follower_supports : content.supports)[k].push_back({k, body.joint});
    }
}

/// With joints eliminated from the tips to the base, the factor of M is as sparse as M itself (Featherstone
/// 2008, §6.4), but for leaders of followers, whose fill is found here.
void find_eliminations(Model::Content& content) {
    const std::size_t n = content.joint_names.size();
    std::vector<int> joints;            // in the order of elimination
    std::vector<std::size_t> places(n); // in that order, by joint
    for (std::size_t k = content.bodies.size(); k-- > 1;) {
        const auto joint = static_cast<std::size_t>(content.bodies[k].joint);
        if (joint >= n) continue;
        places[joint] = joints.size();
        joints.push_back(content.bodies[k].joint);
    }
    std::vector<std::set<std::size_t>> coupled(n); // by place
    const auto couple = [&](const std::set<std::size_t>& all) {
        for (auto first = all.begin(); first != all.end(); ++first)
            coupled[*first].insert(std::next(first), all.end());
    };
    for (std::size_t k = 1; k < content.bodies.size(); ++k) {
        std::set<std::size_t> carrying;
        for (const Support& support : content.supports[k])
            carrying.insert(places[static_cast<std::size_t>(support.joint)]);
        for (const Support& support : content.follower_supports[k]) {
            const auto leader = content.moving_followers[static_cast<std::size_t>(support.joint) - n].leader;
            carrying.insert(places[static_cast<std::size_t>(leader)]);
        }
        couple(carrying);
    }
    for (std::size_t place = 0; place < n; ++place) {
        couple(coupled[place]);
        content.eliminations.push_back({joints[place], {}});
        for (const std::size_t later : coupled[place])
            content.eliminations.back().coupled.push_back(joints[later]);
    }
}

void number_frames(const pinocchio::Model& tree, Model::Content& content) {
    for (const pinocchio::Frame& frame : tree.frames) {
        if (frame.type != pinocchio::BODY || frame.name.starts_with(inner_name(""))) continue;
        content.frame_index.emplace(frame.name, static_cast<int>(content.frames.size()));
        content.frame_names.push_back(frame.name);
        content.frames.push_back(
            {{frame.placement.rotation(), frame.placement.translation()}, body_of(frame.parentJoint)});
    }
}

/// The joint that a cut names.
urdf::JointSharedPtr find_cut(const urdf::ModelInterface& urdf, const std::string& name,
                              const fs::path& path) {
    auto joint = urdf.joints_.find(name);
    if (joint == urdf.joints_.end()) {
        const auto link = urdf.links_.find(name);
        if (link != urdf.links_.end() && link->second->parent_joint)
            joint = urdf.joints_.find(link->second->parent_joint->name);
    }
    if (joint == urdf.joints_.end() || joint->second->type != urdf::Joint::FIXED) {
        std::vector<std::string> known;
        for (const auto& [other, of] : urdf.joints_)
            if (of->type == urdf::Joint::FIXED) known.push_back(other);
        throw std::runtime_error("'" + name + "' is no fixed joint of '" + path.string() +
                                 "', where it could be cut; most similar: " + most_similar(name, known));
    }
    return joint->second;
}

/// Takes away a link with all that hangs on it.
void remove(urdf::ModelInterface& urdf, const urdf::LinkSharedPtr& link) {
    for (const urdf::LinkSharedPtr& child : link->child_links) remove(urdf, child);
    if (link->parent_joint) urdf.joints_.erase(link->parent_joint->name);
    urdf.links_.erase(link->name);
}

/// Leaves what hangs on `root`, without what is behind the fixed joints `cuts`.
void keep_part(urdf::ModelInterface& urdf, const std::string& root,
               const std::vector<urdf::JointSharedPtr>& cuts) {
    for (const urdf::JointSharedPtr& joint : cuts) {
        const urdf::LinkSharedPtr parent = urdf.links_.at(joint->parent_link_name),
                                  child = urdf.links_.at(joint->child_link_name);
        std::erase(parent->child_joints, joint);
        std::erase(parent->child_links, child);
        urdf.joints_.erase(joint->name);
        child->parent_joint.reset();
        child->setParent(nullptr);
    }
    const urdf::LinkSharedPtr kept = urdf.links_.at(root);
    for (const urdf::JointSharedPtr& joint : cuts)
        if (joint->child_link_name != root) remove(urdf, urdf.links_.at(joint->child_link_name));
    if (urdf.root_link_ != kept) remove(urdf, urdf.links_.at(urdf.root_link_->name));
    urdf.root_link_ = kept;
}

std::shared_ptr<Model::Content> make_content(const urdf::ModelInterfaceSharedPtr& urdf, const fs::path& path,
                                             const std::vector<std::string>& joints,
                                             const Eigen::Vector3d& gravity, bool floating_base) {
    auto content = std::make_shared<Model::Content>();
    content->joint_names = joints;
    content->followers = find_followers(content->joint_names, *urdf, path);
    content->base_velocities = floating_base ? 6 : 0;
    try {
        const pinocchio::Model tree = build(urdf, *content);
        content->name = tree.name;
        number_joints(tree, *urdf, *content);
        find_eliminations(*content);
        number_frames(tree, *content);
    } catch (const std::exception& error) {
        throw std::runtime_error("'" + path.string() + "' has no rigid-body model: " + error.what());
    }
    content->gravity = gravity;
    content->base_link = urdf->getRoot()->name;
    read_limits(*urdf, *content);
    return content;
}

/// The tree of a file with `base_link` as its root.
struct Tree {
    urdf::ModelInterfaceSharedPtr urdf;
    std::vector<std::string> joints;

    Tree(const fs::path& path, const std::vector<std::string>& wanted, const std::string& base_link) {
        const std::string xml = read(path);
        check_urdf(xml, path.string());
        urdf = parse(xml, path);
        joints = wanted.empty() ? movable_joints(xml, *urdf) : wanted;
        check_joints(joints, *urdf, path);
        if (!base_link.empty() && !urdf->links_.contains(base_link)) {
            std::vector<std::string> links;
            for (const auto& [name, link] : urdf->links_) links.push_back(name);
            throw std::runtime_error("base link '" + base_link + "' is not a link of '" + path.string() +
                                     "'; most similar: " + most_similar(base_link, links));
        }
        if (!base_link.empty()) make_root(*urdf, base_link);
    }
};

} // namespace

Model Model::load(const fs::path& path, const std::vector<std::string>& joints,
                  const Eigen::Vector3d& gravity, const std::string& base_link, bool floating_base) {
    const Tree tree(path, joints, base_link);
    return Model(make_content(tree.urdf, path, tree.joints, gravity, floating_base));
}

std::vector<Model::Part> Model::load_parts(const fs::path& path, const std::vector<std::string>& joints,
                                           const Eigen::Vector3d& gravity, const std::string& base_link,
                                           const std::vector<std::string>& cuts) {
    std::vector<Part> parts;
    for (std::size_t k = 0; k <= cuts.size(); ++k) {
        // Cutting takes the tree apart, so that each part begins with a new one.
        const Tree tree(path, joints, base_link);
        std::vector<urdf::JointSharedPtr> at;
        for (const std::string& name : cuts) {
            at.push_back(find_cut(*tree.urdf, name, path));
            if (std::count(at.begin(), at.end(), at.back()) > 1)
                throw std::runtime_error("'" + name + "' is cut twice; list every sensor once");
            if (!tree.urdf->links_.at(at.back()->child_link_name)->parent_joint ||
                at.back()->child_link_name.starts_with(inner_name("")))
                throw std::runtime_error("'" + name + "' lies between the root of '" + path.string() +
                                         "' and the base link; choose another base link");
        }
        const std::string root = k == 0 ? tree.urdf->getRoot()->name : at[k - 1]->child_link_name;
        const std::string parent_link = k == 0 ? std::string() : at[k - 1]->parent_link_name;
        keep_part(*tree.urdf, root, at);
        std::vector<std::string> kept;
        for (const std::string& name : tree.joints)
            if (tree.urdf->joints_.contains(name)) kept.push_back(name);
        parts.push_back({Model(make_content(tree.urdf, path, kept, gravity, true)), -1, parent_link});
    }
    for (std::size_t k = 1; k < parts.size(); ++k)
        for (std::size_t other = 0; other < parts.size(); ++other)
            if (parts[other].model.has_frame(parts[k].parent_link)) parts[k].parent = static_cast<int>(other);
    return parts;
}

const std::vector<std::string>& Model::joint_names() const { return content_->joint_names; }
int Model::joints() const { return static_cast<int>(content_->joint_names.size()); }
const std::vector<Follower>& Model::followers() const { return content_->followers; }
bool Model::has_floating_base() const { return content_->base_velocities != 0; }
double Model::total_mass() const { return content_->total_mass; }
const Eigen::Vector3d& Model::gravity() const { return content_->gravity; }
const std::string& Model::base_link() const { return content_->base_link; }
const std::vector<std::string>& Model::frame_names() const { return content_->frame_names; }
bool Model::has_frame(const std::string& name) const { return content_->frame_index.contains(name); }

Frame Model::frame(const std::string& name) const {
    const auto found = content_->frame_index.find(name);
    if (found == content_->frame_index.end()) {
        throw std::runtime_error("frame '" + name + "' is not a link of robot '" + content_->name +
                                 "'; most similar: " + most_similar(name, content_->frame_names));
    }
    return {found->second};
}

const Eigen::VectorXd& Model::position_min() const { return content_->position_min; }
const Eigen::VectorXd& Model::position_max() const { return content_->position_max; }
const Eigen::VectorXd& Model::velocity_max() const { return content_->velocity_max; }
const Eigen::VectorXd& Model::effort_max() const { return content_->effort_max; }

} // namespace bf::dynamics

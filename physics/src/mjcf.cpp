#include "mjcf.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/base/text_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>
#include <tinyxml2.h>

namespace bf::physics {

namespace {

namespace fs = std::filesystem;

std::string element_name(mjsElement* element) { return mjs_getString(mjs_getName(element)); }

template <typename Visit> void visit_all(mjSpec* spec, mjtObj type, const Visit& visit) {
    for (mjsElement* element = mjs_firstElement(spec, type); element;) {
        mjsElement* next = mjs_nextElement(spec, element); // before visit() may delete this one
        visit(element);
        element = next;
    }
}

/// A file that an element of an MJCF names, other than one that is included.
struct Asset {
    std::string element, attribute, name, where;
};

/// `file`, as an element in `where` names it, must be in `folder`, also behind symbolic links.
void check_inside(const std::string& where, const std::string& what, const std::string& name,
                  const fs::path& file, const fs::path& folder) {
    const fs::path inside = fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder));
    if (fs::path(name).is_absolute() || inside.empty() || *inside.begin() == "..")
        throw std::runtime_error(where + ": <" + what + "=\"" + name + "\"> is outside of the folder '" +
                                 folder.string() + "'; move the file into it");
}

/// Reads a file and those that it includes; each must be in `folder`.
void check_includes(const fs::path& file, const fs::path& folder, std::set<fs::path>& seen,
                    std::vector<Asset>& assets) {
    if (!seen.insert(file).second) return; // MuJoCo says what it does not include twice
    std::string text;
    if (const std::string wrong = read_file(file.string(), text); !wrong.empty())
        throw std::runtime_error("cannot read the MJCF '" + file.string() + "': " + wrong +
                                 "; check the path, relative ones start at the folder of the description");
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) refuse_xml(file, document);
    const auto look = [&](const auto& self, const tinyxml2::XMLElement* element) -> void {
        for (; element; element = element->NextSiblingElement()) {
            const char* name = element->Attribute("file");
            const std::string where =
                "'" + file.string() + "', line " + std::to_string(element->GetLineNum());
            if (std::string(element->Name()) == "include" && name) {
                const fs::path included = (folder / name).lexically_normal();
                check_inside(where, "include file", name, included, folder);
                if (!fs::is_regular_file(included))
                    throw std::runtime_error(where + ": <include file=\"" + name + "\">: there is no file '" +
                                             included.string() + "'");
                check_includes(included, folder, seen, assets);
            } else {
                // A texture may have a file for each side of a cube: fileright, fileleft, ...
                for (const auto* a = element->FirstAttribute(); a; a = a->Next())
                    if (std::string_view(a->Name()).starts_with("file"))
                        assets.push_back({element->Name(), a->Name(), a->Value(), where});
            }
            self(self, element->FirstChildElement());
        }
    };
    look(look, document.FirstChildElement());
}

/// Names of files are what follows their last folder.
void strip_paths(mjSpec* spec) {
    // MuJoCo's strings have the layout of another library.
    const auto strip = [](mjString* file) {
        mjs_setString(file, fs::path(mjs_getString(file)).filename().c_str());
    };
    visit_all(spec, mjOBJ_MESH, [&](mjsElement* element) { strip(mjs_asMesh(element)->file); });
    visit_all(spec, mjOBJ_HFIELD, [&](mjsElement* element) { strip(mjs_asHField(element)->file); });
    visit_all(spec, mjOBJ_SKIN, [&](mjsElement* element) { strip(mjs_asSkin(element)->file); });
    visit_all(spec, mjOBJ_TEXTURE, [&](mjsElement* element) { strip(mjs_asTexture(element)->file); });
}

bool is_single(const mjsJoint* joint) { return joint->type == mjJNT_HINGE || joint->type == mjJNT_SLIDE; }

/// Names of what is below `body`, in the order of the file.
std::vector<std::string> names_in(mjsBody* body, mjtObj type) {
    std::vector<std::string> names;
    for (mjsElement* element = mjs_firstChild(body, type, 1); element;
         element = mjs_nextChild(body, element, 1))
        if (std::string name = element_name(element); !name.empty()) names.push_back(std::move(name));
    return names;
}

[[noreturn]] void unknown(const fs::path& file, const std::string& kind, const std::string& name,
                          const std::string& role, std::vector<std::string> names) {
    const auto near = nearest_first(name, std::move(names));
    throw std::runtime_error("'" + file.string() + "' has no " + kind + " '" + name + "'" +
                             (role.empty() ? "" : ", wanted as " + role) +
                             (near.empty() ? "" : "; similar names: " + name_list(near)));
}

/// Torque that the actuator can give at most, as an interval; none where it has no limit.
bool torque_limits(const mjsActuator& actuator, double* range) {
    const auto limited = [](mjtLimited said, const double* r) {
        return said == mjLIMITED_TRUE || (said == mjLIMITED_AUTO && r[0] < r[1]);
    };
    const double gear = actuator.gear[0];
    double scale = gear;
    const double* from = actuator.forcerange;
    if (!limited(actuator.forcelimited, actuator.forcerange)) {
        const bool is_motor = actuator.gaintype == mjGAIN_FIXED && actuator.biastype == mjBIAS_NONE;
        if (!is_motor || !limited(actuator.ctrllimited, actuator.ctrlrange)) return false;
        from = actuator.ctrlrange;
        scale *= actuator.gainprm[0];
    }
    range[0] = std::min(scale * from[0], scale * from[1]);
    range[1] = std::max(scale * from[0], scale * from[1]);
    return range[0] < range[1];
}

/// Controlled joints that are not named: those that the file moves by actuators of their own; where it has no
/// actuators, all that do not follow others.
std::vector<std::string> controlled(mjSpec* spec, mjsBody* body) {
    std::set<std::string> driven, following;
    bool has_actuators = false;
    visit_all(spec, mjOBJ_ACTUATOR, [&](mjsElement* element) {
        const mjsActuator* actuator = mjs_asActuator(element);
        has_actuators = true;
        if (actuator->trntype == mjTRN_JOINT) driven.insert(mjs_getString(actuator->target));
    });
    visit_all(spec, mjOBJ_EQUALITY, [&](mjsElement* element) {
        const mjsEquality* equality = mjs_asEquality(element);
        if (equality->type == mjEQ_JOINT) following.insert(mjs_getString(equality->name1));
    });
    std::vector<std::string> joints;
    for (const std::string& name : names_in(body, mjOBJ_JOINT)) {
        const mjsJoint* joint = mjs_asJoint(mjs_findElement(spec, mjOBJ_JOINT, name.c_str()));
        if (is_single(joint) && (has_actuators ? driven.contains(name) : !following.contains(name)))
            joints.push_back(name);
    }
    return joints;
}

void check_joints(mjSpec* spec, mjsBody* body, const RobotOptions& options) {
    const auto known = names_in(body, mjOBJ_JOINT);
    std::set<std::string> seen;
    for (const std::string& name : options.joints) {
        if (std::find(known.begin(), known.end(), name) == known.end())
            unknown(options.urdf, "joint", name, "", known);
        if (!seen.insert(name).second)
            throw std::runtime_error("joint '" + name + "' is listed twice in joints; list each joint once");
        if (!is_single(mjs_asJoint(mjs_findElement(spec, mjOBJ_JOINT, name.c_str()))))
            throw std::runtime_error("joint '" + name + "' of '" + options.urdf.string() +
                                     "' cannot be controlled; controlled joints are hinges and slides");
    }
}

/// What floats with the link stands where it begins.
void hold(mjsBody* link) {
    for (mjsBody* body = link; body; body = mjs_getParent(body->element))
        for (mjsElement* at = mjs_firstChild(body, mjOBJ_JOINT, 0); at;) {
            mjsElement* const joint = at;
            at = mjs_nextChild(body, joint, 0);
            if (mjs_asJoint(joint)->type == mjJNT_FREE) mjs_delete(mjs_getSpec(joint), joint);
        }
}

/// The file's actuators of controlled joints go, and leave their limits and gains.
void take_actuators(mjSpec* spec, const RobotOptions& options, Mjcf& robot) {
    visit_all(spec, mjOBJ_ACTUATOR, [&](mjsElement* element) {
        const mjsActuator* actuator = mjs_asActuator(element);
        const std::string target = mjs_getString(actuator->target);
        const auto found = std::find(options.joints.begin(), options.joints.end(), target);
        if (actuator->trntype != mjTRN_JOINT || found == options.joints.end()) return;
        const double gear2 = actuator->gear[0] * actuator->gear[0];
        if (actuator->gaintype == mjGAIN_FIXED && actuator->biastype == mjBIAS_AFFINE)
            robot.gains[target] = {-gear2 * actuator->biasprm[1], -gear2 * actuator->biasprm[2]};
        mjsJoint* joint = mjs_asJoint(mjs_findElement(spec, mjOBJ_JOINT, target.c_str()));
        const bool has_limits =
            joint->actfrclimited == mjLIMITED_TRUE ||
            (joint->actfrclimited == mjLIMITED_AUTO && joint->actfrcrange[0] < joint->actfrcrange[1]);
        double range[2];
        if (!has_limits && torque_limits(*actuator, range)) {
            joint->actfrclimited = mjLIMITED_TRUE;
            std::copy_n(range, 2, joint->actfrcrange);
        }
        joint->armature += gear2 * actuator->armature;
        mjs_delete(spec, element);
    });
}

/// An actuator with torque = -control velocity, which MuJoCo's implicit integrator takes as it takes the
/// damping of position actuators.
void add_damper(mjSpec* spec, const std::string& joint) {
    mjsActuator* damper = add_motor(spec, damper_of(joint), joint);
    damper->gaintype = mjGAIN_AFFINE;
    std::fill_n(damper->gainprm, mjNGAIN, 0.0);
    damper->gainprm[2] = -1.0;
    damper->armature = 0.0; // the motor has what the file's defaults say
    std::fill_n(damper->damping, mjNPOLY + 1, 0.0);
}

void read_key(const mjModel* model, const std::string& key, const fs::path& file, Mjcf& robot) {
    if (key.empty()) return;
    const int id = mj_name2id(model, mjOBJ_KEY, key.c_str());
    if (id < 0) {
        std::vector<std::string> names;
        for (int i = 0; i < model->nkey; ++i)
            if (const char* name = mj_id2name(model, mjOBJ_KEY, i)) names.emplace_back(name);
        unknown(file, "key frame", key, "", std::move(names));
    }
    for (int joint = 0; joint < model->njnt; ++joint) {
        const char* name = mj_id2name(model, mjOBJ_JOINT, joint);
        const int type = model->jnt_type[joint];
        if (!name || !*name || type == mjJNT_FREE) continue; // what floats is placed as a whole
        const mjtNum* begin = model->key_qpos + id * model->nq + model->jnt_qposadr[joint];
        const std::vector<double> values(begin, begin + (type == mjJNT_BALL ? 4 : 1));
        for (const double value : values)
            if (!(std::abs(value) <= mjMAXVAL))
                throw std::runtime_error("key frame '" + key + "' of '" + file.string() + "' puts joint '" +
                                         name + "' at " + number_text(value) +
                                         "; positions are finite and at most 1e10");
        robot.start[name] = values;
    }
}

} // namespace

bool is_mjcf(const fs::path& file) {
    std::string text;
    tinyxml2::XMLDocument document;
    if (!read_file(file.string(), text).empty()) return false;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) // a URDF may hold <mujoco>, too
        return text.find("<mujoco") != text.npos && text.find("<robot") == text.npos;
    const auto* root = document.RootElement();
    return root && std::string(root->Name()) == "mujoco";
}

void refuse_xml(const fs::path& file, const tinyxml2::XMLDocument& document) {
    const int line = document.ErrorLineNum();
    throw std::runtime_error("'" + file.string() + "'" + (line > 0 ? ", line " + std::to_string(line) : "") +
                             ": it is no XML (" + document.ErrorName() + "); " +
                             (line > 0 ? "correct this line" : "it is empty, or a file of another kind"));
}

Mjcf read_mjcf(SceneRobot& robot) {
    RobotOptions& options = robot.options;
    options.urdf = fs::absolute(options.urdf).lexically_normal();
    const fs::path& file = options.urdf;
    std::set<fs::path> seen;
    std::vector<Asset> assets;
    check_includes(file, file.parent_path(), seen, assets);
    std::array<char, 1024> error{};
    Mjcf result;
    result.spec.reset(mj_parseXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    mjSpec* spec = result.spec.get();
    if (!spec) throw std::runtime_error("MuJoCo cannot read '" + file.string() + "': " + error.data());
    for (const Asset& asset : assets) {
        const bool is_texture = asset.element == "texture", is_model = asset.element == "model";
        const fs::path name(asset.name);
        const std::string directory =
            is_model ? "" : mjs_getString(is_texture ? spec->compiler.texturedir : spec->compiler.meshdir);
        check_inside(asset.where, asset.element + ' ' + asset.attribute, asset.name,
                     file.parent_path() / directory / (spec->strippath ? name.filename() : name),
                     file.parent_path());
    }
    if (spec->strippath) strip_paths(spec); // a spec that is attached loses the setting
    mjsBody* world = mjs_findBody(spec, "world");
    const std::vector<std::string> bodies = names_in(world, mjOBJ_BODY);
    const auto require = [&](const std::string& name, const std::string& role) {
        mjsBody* found = mjs_findBody(spec, name.c_str());
        if (!found || name == "world") unknown(file, "body", name, role, bodies);
        return found;
    };
    result.body = robot.body.empty() ? world : require(robot.body, "the robot");

    if (options.joints.empty()) options.joints = controlled(spec, result.body);
    check_joints(spec, result.body, options);
    if (options.base_link.empty() || options.base_link == mark("base")) {
        mjsElement* first = mjs_firstChild(world, mjOBJ_BODY, 0);
        if (!robot.body.empty()) first = result.body->element;
        if (!first) throw std::runtime_error("'" + file.string() + "' has no <body>; a robot has one");
        if (element_name(first).empty()) mjs_setName(first, mark("base").c_str());
        options.base_link = element_name(first);
    }
    for (const auto& [type, kind] : {std::pair{mjOBJ_BODY, "body:"}, {mjOBJ_JOINT, "joint:"}}) {
        int made = 0; // everything here is found by its name
        for (mjsElement* at = mjs_firstElement(spec, type); at; at = mjs_nextElement(spec, at))
            if (element_name(at).empty()) mjs_setName(at, mark(kind + std::to_string(++made)).c_str());
    }
    require(options.base_link, "base link");
    if (options.imu_frame.empty()) options.imu_frame = options.base_link;
    require(options.imu_frame, "body of the IMU");
    for (const std::string& name : options.ft_sensors) require(name, "child of a force/torque sensor");
    for (const std::string& name : options.push_links) require(name, "body to push");
    options.validate();

    const ModelPtr model = compile(spec, file); // which says what is wrong in this file
    read_key(model.get(), robot.key, file, result);
    result.mass = model->body_subtreemass[mj_name2id(model.get(), mjOBJ_BODY,
                                                     robot.body.empty() ? "world" : robot.body.c_str())];
    visit_all(spec, mjOBJ_KEY, [&](mjsElement* element) { mjs_delete(spec, element); });
    if (robot.is_held) hold(mjs_findBody(spec, options.base_link.c_str()));
    take_actuators(spec, options, result);
    add_motors(spec, options);
    for (const auto& [joint, gains] : result.gains) add_damper(spec, joint);
    add_marks(spec, options);
    visit_all(spec, mjOBJ_BODY, [&](mjsElement* element) { // a fixed base keeps its mass and its place
        const mjsBody* parent = mjs_getParent(element);
        if (parent && element_name(parent->element) == "world") mjs_asBody(element)->fuse = 0;
    });
    return result;
}

} // namespace bf::physics

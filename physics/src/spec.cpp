#include "spec.hpp"
#include "inertia.hpp"
#include "mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>
#include <tinyxml2.h>

namespace bf::physics {

namespace {

// The floor collides with feet, and what lands as they do, only, and these with the floor only.
constexpr int floor_bit = 1;
constexpr int foot_bit = 2;

template <typename Visit> void for_each(mjSpec* spec, mjtObj type, const Visit& visit) {
    for (mjsElement* element = mjs_firstElement(spec, type); element;) {
        mjsElement* next = mjs_nextElement(spec, element); // before visit() may delete this one
        visit(element);
        element = next;
    }
}

std::string name_of(mjsElement* element) { return mjs_getString(mjs_getName(element)); }

mjsBody* body_of(mjSpec* spec, const std::string& link) {
    mjsBody* body = mjs_findBody(spec, link.c_str());
    if (!body) throw std::runtime_error("MuJoCo dropped link '" + link + "' of the URDF");
    return body;
}

tinyxml2::XMLElement& child(tinyxml2::XMLElement& parent, const char* name) {
    auto* found = parent.FirstChildElement(name);
    return found ? *found : *parent.InsertNewChildElement(name);
}

/// The URDF with the attribute discardvisual in its element <compiler> of <mujoco>, from which MuJoCo reads
/// its settings; a URDF may have these elements already, and MuJoCo takes each but once.
std::string with_setting(const Urdf& urdf, Looks looks) {
    tinyxml2::XMLDocument document;
    if (document.Parse(urdf.text.data(), urdf.text.size()) != tinyxml2::XML_SUCCESS)
        return urdf.text; // MuJoCo says what is wrong
    auto* robot = document.FirstChildElement("robot");
    if (!robot)
        throw std::runtime_error("'" + urdf.file.string() + "' has no element <robot>; a URDF is expected");
    child(child(*robot, "mujoco"), "compiler").SetAttribute("discardvisual", looks != Looks::meshes);
    tinyxml2::XMLPrinter printer;
    document.Print(&printer);
    return printer.CStr();
}

SpecPtr parse(const Urdf& urdf, Looks looks) {
    const std::string text = with_setting(urdf, looks);
    std::array<char, 1024> error{};
    SpecPtr spec(mj_parseXMLString(text.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    if (!spec) throw std::runtime_error("MuJoCo cannot read '" + urdf.file.string() + "': " + error.data());
    return spec;
}

void set_contact(mjsGeom* geom, const Surface& surface) {
    geom->condim = 3;
    set_surface(geom, surface);
}

void make_ground_shape(mjsGeom* geom, const Surface& surface) {
    geom->mass = 0.0;
    geom->group = 3; // not drawn
    geom->contype = foot_bit;
    geom->conaffinity = floor_bit;
    set_contact(geom, surface);
}

void make_foot_shape(mjsGeom* geom, const std::string& name, const Surface& surface) {
    mjs_setName(geom->element, name.c_str());
    make_ground_shape(geom, surface);
}

/// The links of the feet, and all that moves with them: a sole is often a frame of the link above it.
std::set<std::string> links_of_feet(const RobotOptions& options, const Urdf& urdf) {
    std::set<std::string> links;
    for (const Foot& foot : options.feet) links.insert(foot.frame);
    const auto moves = [&](const std::string& joint) {
        return std::ranges::find(options.joints, joint) != options.joints.end() ||
               std::ranges::find(options.followers, joint, &Follower::joint) != options.followers.end();
    };
    for (size_t before = 0; before != links.size();) {
        before = links.size();
        for (const UrdfJoint& joint : urdf.joints)
            if (!moves(joint.name) && (links.contains(joint.parent) || links.contains(joint.child)))
                links.insert({joint.parent, joint.child});
    }
    return links;
}

/// Collision shapes go, but for those that a foot touches with; visual ones stay on request. The files of
/// their meshes are found.
void keep_shapes(mjSpec* spec, const RobotOptions& options, const Surface& surface, const Urdf& urdf,
                 Looks looks, Touching touching) {
    const bool all = touching == Touching::everything;
    const bool lands = touching == Touching::ground;
    const std::set<std::string> feet = lands ? links_of_feet(options, urdf) : std::set<std::string>();
    std::set<std::string> used, seen; // meshes; links with visual shapes
    if (all && looks != Looks::none)
        for_each(spec, mjOBJ_GEOM, [&](mjsElement* element) {
            if (mjs_asGeom(element)->contype == 0) seen.insert(name_of(mjs_getParent(element)->element));
        });
    std::vector<int> shapes(options.feet.size(), 0);
    for_each(spec, mjOBJ_GEOM, [&](mjsElement* element) {
        mjsGeom* geom = mjs_asGeom(element);
        const std::string link = name_of(mjs_getParent(element)->element);
        const auto foot = std::find_if(options.feet.begin(), options.feet.end(),
                                       [&](const Foot& f) { return f.has_urdf_shapes && f.frame == link; });
        const bool is_foot = foot != options.feet.end();
        if (geom->contype == 0 ? looks == Looks::none
                               : !is_foot && !all && !(lands && !feet.contains(link))) {
            mjs_delete(spec, element);
            return;
        }
        if (geom->contype != 0 && all) {
            set_contact(geom, surface);
            if (seen.contains(link)) geom->group = 3; // not drawn
        } else if (geom->contype != 0 && !is_foot) {
            make_ground_shape(geom, surface);
        } else if (geom->contype != 0) {
            const auto i = static_cast<size_t>(foot - options.feet.begin());
            make_foot_shape(geom, "foot:" + std::to_string(i) + ":urdf" + std::to_string(shapes[i]++),
                            surface);
        }
        geom->mass = 0.0;
        const std::string mesh_name = mjs_getString(geom->meshname);
        if (geom->type != mjGEOM_MESH) return;
        mjsMesh* mesh = mjs_asMesh(mjs_findElement(spec, mjOBJ_MESH, mesh_name.c_str()));
        if (!used.insert(mesh_name).second) return;
        mesh->inertia = mjMESH_INERTIA_SHELL; // shapes have no mass here, and the volume of some is zero
        const auto file = urdf.mesh_file(mjs_getString(mesh->file), link, options.package_paths,
                                         mjs_getString(spec->compiler.meshdir));
        if (mujoco_reads(file))
            mjs_setString(mesh->file, file.c_str());
        else
            import_mesh(mesh, file);
    });
    for (size_t i = 0; i < options.feet.size(); ++i)
        if (options.feet[i].has_urdf_shapes && options.feet[i].shapes.empty() && shapes[i] == 0)
            throw std::runtime_error("link '" + options.feet[i].frame + "' of '" + urdf.file.string() +
                                     "' has no <collision> to touch the floor with; give contact points");
    for_each(spec, mjOBJ_MESH, [&](mjsElement* element) {
        if (!used.contains(name_of(element))) mjs_delete(spec, element);
    });
}

/// Takes a joint away and leaves its child where it is at `position`.
void lock(mjSpec* spec, mjsElement* element, double position) {
    const mjsJoint* joint = mjs_asJoint(element);
    if (position != 0.0) {
        mjsBody* body = mjs_getParent(element);
        const Eigen::Vector3d axis = Eigen::Map<const Eigen::Vector3d>(joint->axis).normalized();
        const Eigen::Quaterniond q(body->quat[0], body->quat[1], body->quat[2], body->quat[3]);
        if (joint->type == mjJNT_SLIDE) {
            Eigen::Map<Eigen::Vector3d>{body->pos} += q * (position * axis);
        } else {
            const Eigen::Quaterniond turned = q * Eigen::AngleAxisd(position, axis);
            const double values[] = {turned.w(), turned.x(), turned.y(), turned.z()};
            std::copy_n(values, 4, body->quat);
        }
    }
    mjs_delete(spec, element);
}

/// position = multiplier * leader + offset, as hard as MuJoCo makes a constraint: a share of 1e-4 of the
/// violating acceleration is left, and a drift fades within two steps.
void couple(mjSpec* spec, const Follower& follower, double time_step) {
    mjsEquality* equality = mjs_addEquality(spec, nullptr);
    equality->type = mjEQ_JOINT;
    equality->objtype = mjOBJ_JOINT;
    mjs_setString(equality->name1, follower.joint.c_str());
    mjs_setString(equality->name2, follower.leader.c_str());
    std::fill_n(equality->data, mjNEQDATA, 0.0);
    equality->data[0] = follower.offset;
    equality->data[1] = follower.multiplier;
    equality->solref[0] = 2.0 * time_step;
    equality->solref[1] = 1.0;
    equality->solimp[0] = equality->solimp[1] = 0.9999;
}

void set_joints(mjSpec* spec, const RobotOptions& options, double time_step, const Urdf& urdf) {
    for_each(spec, mjOBJ_EQUALITY, [&](mjsElement* element) { mjs_delete(spec, element); });
    for_each(spec, mjOBJ_JOINT, [&](mjsElement* element) {
        const std::string name = name_of(element);
        const auto found = std::find(options.joints.begin(), options.joints.end(), name);
        if (found == options.joints.end()) {
            const auto follower = std::find_if(options.followers.begin(), options.followers.end(),
                                               [&](const Follower& f) { return f.joint == name; });
            if (follower == options.followers.end())
                lock(spec, element, 0.0);
            else if (follower->leader.empty())
                lock(spec, element, follower->offset);
            else
                couple(spec, *follower, time_step);
        }
    });
    add_motors(spec, options);
    if (options.floating_base) {
        mjs_addFreeJoint(body_of(spec, floating_link(urdf)));
    } else { // what is fused to the world loses its mass and its place in the centre of mass
        for_each(spec, mjOBJ_BODY, [&](mjsElement* element) {
            const mjsBody* parent = mjs_getParent(element);
            if (parent && name_of(parent->element) == "world") mjs_asBody(element)->fuse = 0;
        });
    }
}

void add_foot_shape(mjsBody* body, const ContactShape& shape, const std::string& name,
                    const Surface& surface) {
    mjsGeom* geom = mjs_addGeom(body, nullptr);
    geom->type = shape.kind == ContactShape::Kind::sphere ? mjGEOM_SPHERE : mjGEOM_BOX;
    std::copy_n(shape.size.data(), 3, geom->size);
    std::copy_n(shape.position.data(), 3, geom->pos);
    make_foot_shape(geom, name, surface);
}

mjsSite* add_site(mjsBody* body, const std::string& name) {
    mjsSite* site = mjs_addSite(body, nullptr);
    mjs_setName(site->element, name.c_str());
    std::fill_n(site->pos, 3, 0.0); // whatever a file's defaults say
    std::copy_n(std::array{1.0, 0.0, 0.0, 0.0}.data(), 4, site->quat);
    site->group = 4; // not drawn
    return site;
}

void add_sensor(mjSpec* spec, mjtSensor type, const std::string& name, const std::string& site) {
    mjsSensor* sensor = mjs_addSensor(spec);
    mjs_setName(sensor->element, name.c_str());
    sensor->type = type;
    sensor->objtype = mjOBJ_SITE;
    mjs_setString(sensor->objname, site.c_str());
}

/// Lets the link of a joint move by `backlash` against the joint, whose motor is its armature. Both ends of
/// the play are as hard as MuJoCo makes a limit, and a link that meets them does not bounce.
void add_play(mjSpec* spec, const mjsJoint& joint, const std::string& name, double backlash) {
    mjsBody* body = mjs_getParent(joint.element);
    if (!(joint.armature > 0.0))
        throw std::runtime_error("joint '" + name +
                                 "' has backlash, but its motor has no inertia, with which it turns between "
                                 "the flanks; give armature");
    if (mjs_firstChild(body, mjOBJ_JOINT, 0) != joint.element || mjs_nextChild(body, joint.element, 0))
        throw std::runtime_error(
            "joint '" + name +
            "' has backlash, but its link has several joints; give backlash to joints that are alone");
    mjsJoint* play = mjs_addJoint(body, nullptr);
    mjs_setName(play->element, play_of(name).c_str());
    play->type = joint.type;
    std::copy_n(joint.pos, 3, play->pos);
    std::copy_n(joint.axis, 3, play->axis);
    play->limited = mjLIMITED_TRUE;
    const bool in_degrees = spec->compiler.degree && joint.type == mjJNT_HINGE;
    play->range[1] = 0.5 * backlash * (in_degrees ? 180.0 / mjPI : 1.0);
    play->range[0] = -play->range[1];
    play->solref_limit[0] = 1e-3; // MuJoCo raises it to two time steps
    play->solref_limit[1] = 1.0;
    play->solimp_limit[0] = play->solimp_limit[1] = 0.9999;
    // Whatever a file's defaults say:
    play->actfrclimited = mjLIMITED_FALSE;
    play->ref = play->springref = play->margin = play->frictionloss = play->armature = 0.0;
    std::fill_n(play->stiffness, std::size(play->stiffness), 0.0);
    std::fill_n(play->damping, std::size(play->damping), 0.0);
    std::fill_n(play->springdamper, std::size(play->springdamper), 0.0);
}

} // namespace

void silence_mujoco() {
    static std::once_flag once;
    std::call_once(once, [] {
        mju_setLogHandler([](const mjLogMessage* message) {
            if (message->level == mjLOG_ERROR)
                throw std::runtime_error(std::string("MuJoCo: ") + message->subject);
        });
    });
}

void set_surface(mjsGeom* geom, const Surface& surface) {
    geom->friction[0] = surface.friction;
    std::copy_n(surface.solref.data(), 2, geom->solref);
    std::copy(surface.solimp.begin(), surface.solimp.end(), geom->solimp);
}

void complete(RobotOptions& options, const Urdf& urdf) {
    if (options.joints.empty())
        for (const UrdfJoint& joint : urdf.joints)
            if (joint.is_movable()) options.joints.push_back(joint.name);
    std::set<std::string> seen;
    for (const std::string& name : options.joints) {
        urdf.require_motor(name);
        if (!seen.insert(name).second)
            throw std::runtime_error("joint '" + name + "' is listed twice in joints; list each joint once");
    }

    for (const Follower& follower : options.followers) {
        urdf.require_motor(follower.joint);
        if (seen.contains(follower.joint))
            throw std::runtime_error("joint '" + follower.joint +
                                     "' is listed in joints and among the followers; list it once");
        if (!follower.leader.empty() && !seen.contains(follower.leader))
            throw std::runtime_error("joint '" + follower.joint + "' follows '" + follower.leader +
                                     "', which is not in the list of joints; add it");
    }

    if (options.base_link.empty()) options.base_link = urdf.first_heavy_link();
    urdf.require_link(options.base_link, "base link");
    if (options.floating_base && options.base_link == "world")
        throw std::runtime_error("the link 'world' of '" + urdf.file.string() +
                                 "' stands still by its name and cannot float; set floating_base to false, "
                                 "or choose another base_link, such as '" +
                                 urdf.first_heavy_link() + "'");

    if (options.imu_frame.empty()) options.imu_frame = options.base_link;
    urdf.require_link(options.imu_frame, "frame of the IMU");
    for (const Foot& foot : options.feet) urdf.require_link(foot.frame, "frame of a foot");
    for (const std::string& link : options.push_links) urdf.require_link(link, "link to push");
    const auto moves = [&](const std::string& joint) {
        return seen.contains(joint) ||
               std::any_of(options.followers.begin(), options.followers.end(),
                           [&](const Follower& follower) { return follower.joint == joint; });
    };
    for (std::string& sensor : options.ft_sensors) {
        for (const UrdfJoint& joint : urdf.joints)
            if ((joint.name == sensor || joint.child == sensor) && moves(joint.name))
                throw std::runtime_error("force/torque sensor at '" + sensor + "': the joint '" + joint.name +
                                         "' moves, its type is " + joint.type +
                                         "; name the fixed joint that carries the sensor");
        if (const UrdfJoint* joint = urdf.find_joint(sensor)) sensor = joint->child;
        urdf.require_link(sensor, "child of a force/torque sensor (name the fixed joint or its child link)");
        if (sensor == urdf.root())
            throw std::runtime_error("force/torque sensor at '" + sensor +
                                     "': the root has no parent to exert a wrench on; name a fixed joint");
    }
}

const std::string& floating_link(const Urdf& urdf) {
    return urdf.root() == "world" ? urdf.first_heavy_link() : urdf.root();
}

std::vector<FollowerAddress> follower_addresses(const mjModel* model, const RobotOptions& options,
                                                const std::string& prefix) {
    const auto position = [&](const std::string& joint) {
        return model->jnt_qposadr[id_of(model, mjOBJ_JOINT, prefix + joint)];
    };
    std::vector<FollowerAddress> addresses;
    for (const Follower& follower : options.followers)
        if (!follower.leader.empty())
            addresses.push_back({position(follower.joint),
                                 model->jnt_dofadr[id_of(model, mjOBJ_JOINT, prefix + follower.joint)],
                                 position(follower.leader), follower.multiplier, follower.offset});
    return addresses;
}

void add_floor(mjSpec* spec, const Floor& floor) {
    mjsGeom* geom = mjs_addGeom(mjs_findBody(spec, "world"), nullptr);
    mjs_setName(geom->element, "floor");
    geom->type = mjGEOM_PLANE;
    geom->size[2] = 0.05; // infinite in x and y
    geom->contype = floor_bit;
    geom->conaffinity = foot_bit;
    set_contact(geom, floor);
}

void add_marks(mjSpec* spec, const RobotOptions& options) {
    add_site(body_of(spec, options.base_link), mark("base"));
    add_site(body_of(spec, options.imu_frame), mark("imu"));
    add_sensor(spec, mjSENS_ACCELEROMETER, mark("accelerometer"), mark("imu"));
    add_sensor(spec, mjSENS_GYRO, mark("gyro"), mark("imu"));
    for (size_t i = 0; i < options.ft_sensors.size(); ++i) {
        const std::string index = std::to_string(i);
        mjsBody* body = body_of(spec, options.ft_sensors[i]);
        body->fuse = 0; // the wrench between child and parent exists only while they are two bodies
        add_site(body, mark("ft:" + index));
        add_sensor(spec, mjSENS_FORCE, mark("force:" + index), mark("ft:" + index));
        add_sensor(spec, mjSENS_TORQUE, mark("torque:" + index), mark("ft:" + index));
    }
    for (size_t i = 0; i < options.push_links.size(); ++i) {
        mjsBody* body = body_of(spec, options.push_links[i]);
        mjsSite* site = add_site(body, mark("push:" + std::to_string(i)));
        if (std::isfinite(body->ipos[0]))
            std::copy_n(body->ipos, 3, site->pos); // before fusing: the link's own centre
    }
}

mjsActuator* add_motor(mjSpec* spec, const std::string& name, const std::string& joint) {
    mjsActuator* motor = mjs_addActuator(spec, nullptr);
    motor->trntype = mjTRN_JOINT;
    mjs_setName(motor->element, name.c_str());
    mjs_setString(motor->target, joint.c_str());
    mjs_setToMotor(motor);
    motor->ctrllimited = motor->forcelimited = mjLIMITED_FALSE; // whatever a file's defaults say
    std::fill_n(motor->gear, 6, 0.0);
    motor->gear[0] = 1.0;
    return motor;
}

void add_motors(mjSpec* spec, const RobotOptions& options) {
    for (size_t i = 0; i < options.joints.size(); ++i) {
        const std::string& name = options.joints[i];
        mjsJoint* joint = mjs_asJoint(mjs_findElement(spec, mjOBJ_JOINT, name.c_str()));
        joint->armature = entry(options.armature, i, joint->armature);
        joint->damping[0] = entry(options.damping, i, joint->damping[0]);
        joint->frictionloss = entry(options.friction, i, joint->frictionloss);
        add_motor(spec, mark(name), name);
        if (const double backlash = entry(options.imperfections.backlash, i, 0.0); backlash > 0.0)
            add_play(spec, *joint, name, backlash);
    }
}

SpecPtr make_robot(const RobotOptions& options, const PhysicsOptions& physics, const Urdf& urdf, Looks looks,
                   Touching touching, std::vector<std::string>& warnings) {
    SpecPtr owner = parse(urdf, looks);
    mjSpec* spec = owner.get();
    const Surface surface = options.surface.value_or(physics.floor);
    keep_shapes(spec, options, surface, urdf, looks, touching);
    set_joints(spec, options, physics.time_step, urdf);
    repair_inertias(spec, urdf, warnings);
    for (const UrdfJoint& joint : urdf.joints) {
        const bool is_base = options.floating_base && joint.child == floating_link(urdf);
        if ((joint.type == "floating" || joint.type == "planar") && !is_base)
            warnings.push_back("joint '" + joint.name + "' of '" + urdf.file.filename().string() + "' is " +
                               joint.type +
                               ", and what moves here are revolute, continuous and prismatic joints: it is "
                               "locked where it begins");
    }

    for (size_t i = 0; i < options.feet.size(); ++i) {
        const std::string name = "foot:" + std::to_string(i);
        mjsBody* body = body_of(spec, options.feet[i].frame);
        add_site(body, name);
        const auto& shapes = options.feet[i].shapes;
        for (size_t j = 0; j < shapes.size(); ++j)
            add_foot_shape(body, shapes[j], name + ":" + std::to_string(j), surface);
    }

    add_marks(spec, options);
    return owner;
}

void set_physics(mjSpec* spec, const PhysicsOptions& options) {
    spec->option.timestep = options.time_step;
    spec->option.integrator = options.integrator == Integrator::euler ? mjINT_EULER : mjINT_IMPLICITFAST;
    spec->option.cone = options.cone == FrictionCone::elliptic ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL;
    spec->option.impratio = options.impratio;
    std::copy_n(options.gravity.data(), 3, spec->option.gravity);
    spec->option.disableflags |= mjDSBL_AUTORESET; // a diverged motion is an error, not a silent restart
    spec->compiler.fusestatic = 1;
}

SpecPtr make_spec(const RobotOptions& options, const PhysicsOptions& physics, const Urdf& urdf, Looks looks,
                  std::vector<std::string>* warnings) {
    std::vector<std::string> ignored;
    SpecPtr spec =
        make_robot(options, physics, urdf, looks, options.lands ? Touching::ground : Touching::feet,
                   warnings ? *warnings : ignored);
    if (physics.floor.enabled) add_floor(spec.get(), physics.floor);
    set_physics(spec.get(), physics);
    // One robot on a floor is one island, and feet are few shapes: to search for islands, or to arrange the
    // shapes of a foot in a tree, takes longer than it saves.
    spec->option.disableflags |= mjDSBL_ISLAND | mjDSBL_MIDPHASE;
    return spec;
}

double total_mass(mjSpec* spec) {
    double mass = 0.0;
    for_each(spec, mjOBJ_BODY, [&](mjsElement* element) { mass += mjs_asBody(element)->mass; });
    return mass;
}

ModelPtr compile(mjSpec* spec, const std::filesystem::path& file) {
    ModelPtr model(mj_compile(spec, nullptr));
    if (!model)
        throw std::runtime_error("MuJoCo cannot compile '" + file.string() + "': " + mjs_getError(spec) +
                                 "; look at the link that is named");
    return model;
}

DataPtr make_data(const mjModel* model) {
    DataPtr data(mj_makeData(model));
    if (!data) throw std::bad_alloc();
    return data;
}

int id_of(const mjModel* model, mjtObj type, const std::string& name) {
    const int id = mj_name2id(model, type, name.c_str());
    if (id < 0) throw std::logic_error("MuJoCo's model has lost '" + name + "'");
    return id;
}

} // namespace bf::physics

#include "spec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>

namespace bf::physics {

namespace {

// The floor collides with feet only, feet with the floor only.
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

SpecPtr parse(const Urdf& urdf, Looks looks) {
    // MuJoCo reads compiler settings of a URDF from an element <mujoco> inside <robot>.
    std::string text = urdf.text;
    const size_t robot = text.find("<robot");
    const size_t end = robot == text.npos ? robot : text.find('>', robot);
    if (end == text.npos)
        throw std::runtime_error("'" + urdf.file.string() + "' has no element <robot>; a URDF is expected");
    text.insert(end + 1, looks == Looks::meshes ? "<mujoco><compiler discardvisual=\"false\"/></mujoco>"
                                                : "<mujoco><compiler discardvisual=\"true\"/></mujoco>");
    std::array<char, 1024> error{};
    SpecPtr spec(mj_parseXMLString(text.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
    if (!spec) throw std::runtime_error("MuJoCo cannot read '" + urdf.file.string() + "': " + error.data());
    return spec;
}

/// Collisions go (feet bring their own shapes); visual meshes stay on request, with their files found.
void keep_visuals(mjSpec* spec, const WorldOptions& options, const Urdf& urdf, Looks looks) {
    std::set<std::string> used;
    for_each(spec, mjOBJ_GEOM, [&](mjsElement* element) {
        mjsGeom* geom = mjs_asGeom(element);
        if (looks == Looks::none || geom->contype != 0) {
            mjs_delete(spec, element);
            return;
        }
        geom->mass = 0.0;
        const std::string mesh_name = mjs_getString(geom->meshname);
        if (geom->type != mjGEOM_MESH || !used.insert(mesh_name).second) return;
        mjsMesh* mesh = mjs_asMesh(mjs_findElement(spec, mjOBJ_MESH, mesh_name.c_str()));
        const std::string link = name_of(mjs_getParent(element)->element);
        const auto file = urdf.mesh_file(mjs_getString(mesh->file), link, options.package_paths);
        mjs_setString(mesh->file, file.c_str());
    });
    for_each(spec, mjOBJ_MESH, [&](mjsElement* element) {
        if (!used.contains(name_of(element))) mjs_delete(spec, element);
    });
}

/// Entry i of a joint-wise list, or `otherwise` when the list is empty.
double entry(const std::vector<double>& list, size_t i, double otherwise) {
    return list.empty() ? otherwise : list[list.size() == 1 ? 0 : i];
}

void set_joints(mjSpec* spec, const WorldOptions& options, const std::string& floating_link) {
    for_each(spec, mjOBJ_JOINT, [&](mjsElement* element) {
        const auto found = std::find(options.joints.begin(), options.joints.end(), name_of(element));
        if (found == options.joints.end()) {
            mjs_delete(spec, element);
            return;
        }
        const size_t i = static_cast<size_t>(found - options.joints.begin());
        mjsJoint* joint = mjs_asJoint(element);
        joint->armature = entry(options.armature, i, joint->armature);
        joint->damping[0] = entry(options.damping, i, joint->damping[0]);
        joint->frictionloss = entry(options.friction, i, joint->frictionloss);
    });
    for (const std::string& name : options.joints) {
        mjsActuator* motor = mjs_addActuator(spec, nullptr);
        motor->trntype = mjTRN_JOINT;
        mjs_setString(motor->target, name.c_str());
        mjs_setToMotor(motor);
    }
    if (options.floating_base) mjs_addFreeJoint(body_of(spec, floating_link));
}

void set_contact(mjsGeom* geom, const Floor& floor) {
    geom->condim = 3;
    geom->friction[0] = floor.friction;
    std::copy_n(floor.solref.data(), 2, geom->solref);
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

void add_foot_shape(mjsBody* body, const ContactShape& shape, const std::string& name, const Floor& floor) {
    mjsGeom* geom = mjs_addGeom(body, nullptr);
    mjs_setName(geom->element, name.c_str());
    geom->type = shape.kind == ContactShape::Kind::sphere ? mjGEOM_SPHERE : mjGEOM_BOX;
    std::copy_n(shape.size.data(), 3, geom->size);
    std::copy_n(shape.position.data(), 3, geom->pos);
    geom->mass = 0.0;
    geom->group = 3; // not drawn
    geom->contype = foot_bit;
    geom->conaffinity = floor_bit;
    set_contact(geom, floor);
}

mjsSite* add_site(mjsBody* body, const std::string& name) {
    mjsSite* site = mjs_addSite(body, nullptr);
    mjs_setName(site->element, name.c_str());
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

SpecPtr make_spec(const WorldOptions& options, const Urdf& urdf, Looks looks) {
    SpecPtr owner = parse(urdf, looks);
    mjSpec* spec = owner.get();
    keep_visuals(spec, options, urdf, looks);
    set_joints(spec, options, urdf.first_heavy_link());

    if (options.floor.enabled) add_floor(spec, options.floor);
    for (size_t i = 0; i < options.feet.size(); ++i) {
        const std::string name = "foot:" + std::to_string(i);
        mjsBody* body = body_of(spec, options.feet[i].frame);
        add_site(body, name);
        const auto& shapes = options.feet[i].shapes;
        for (size_t j = 0; j < shapes.size(); ++j)
            add_foot_shape(body, shapes[j], name + ":" + std::to_string(j), options.floor);
    }

    add_site(body_of(spec, options.base_link), "base");
    add_site(body_of(spec, options.imu_frame), "imu");
    add_sensor(spec, mjSENS_ACCELEROMETER, "accelerometer", "imu");
    add_sensor(spec, mjSENS_GYRO, "gyro", "imu");
    for (size_t i = 0; i < options.ft_sensors.size(); ++i) {
        const std::string index = std::to_string(i);
        mjsBody* body = body_of(spec, options.ft_sensors[i]);
        body->fuse = 0; // the wrench between child and parent exists only while they are two bodies
        add_site(body, "ft:" + index);
        add_sensor(spec, mjSENS_FORCE, "force:" + index, "ft:" + index);
        add_sensor(spec, mjSENS_TORQUE, "torque:" + index, "ft:" + index);
    }
    for (size_t i = 0; i < options.push_links.size(); ++i) {
        mjsBody* body = body_of(spec, options.push_links[i]);
        mjsSite* site = add_site(body, "push:" + std::to_string(i));
        if (std::isfinite(body->ipos[0]))
            std::copy_n(body->ipos, 3, site->pos); // before fusing: the link's own centre
    }

    spec->option.timestep = options.time_step;
    spec->option.integrator = options.integrator == Integrator::euler ? mjINT_EULER : mjINT_IMPLICITFAST;
    spec->option.cone = options.cone == FrictionCone::elliptic ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL;
    spec->option.impratio = options.impratio;
    std::copy_n(options.gravity.data(), 3, spec->option.gravity);
    spec->option.disableflags |= mjDSBL_AUTORESET; // a diverged motion is an error, not a silent restart
    // One robot on a floor is one island, and feet are few shapes: to search for islands, or to arrange the
    // shapes of a foot in a tree, takes longer than it saves.
    spec->option.disableflags |= mjDSBL_ISLAND | mjDSBL_MIDPHASE;
    spec->compiler.fusestatic = 1;
    return owner;
}

double total_mass(mjSpec* spec) {
    double mass = 0.0;
    for_each(spec, mjOBJ_BODY, [&](mjsElement* element) { mass += mjs_asBody(element)->mass; });
    return mass;
}

ModelPtr compile(mjSpec* spec, const Urdf& urdf) {
    ModelPtr model(mj_compile(spec, nullptr));
    if (!model)
        throw std::runtime_error("MuJoCo cannot compile '" + urdf.file.string() + "': " + mjs_getError(spec) +
                                 "; moving links need a positive mass and a physically possible inertia");
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

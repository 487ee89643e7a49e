#include "bf/base/numbers.hpp"
#include "bf/base/text_file.hpp"
#include "bf/base/value_text.hpp"
#include "mesh.hpp"
#include "mjcf.hpp"
#include "scene_impl.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace bf::physics {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& where, const std::string& text) {
    throw std::runtime_error(begin_of_message(where) + text);
}

void put(const Eigen::Matrix4d& H, double* position, double* quaternion) {
    const Eigen::Quaterniond q(Eigen::Matrix3d(H.topLeftCorner<3, 3>()));
    const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
    std::copy_n(H.col(3).data(), 3, position);
    std::copy_n(wxyz, 4, quaternion);
}

/// Names are known once, and part of the names of what they have.
void check_names(const SceneOptions& options) {
    std::map<std::string, std::string> known{{"world", {}}, {"floor", {}}}; // and where
    const auto check = [&](const std::string& name, const std::string& where, const std::string& kind) {
        if (name.empty()) refuse(where, "a " + kind + " has no name; give it one");
        if (name.find_first_of("/\n") != name.npos)
            refuse(where, "the " + kind + " '" + name +
                              "' has a '/' or a line break in its name, which stands between a robot and its "
                              "links; choose another one");
        const auto [first, is_new] = known.emplace(name, where);
        if (is_new) return;
        refuse(where, "the name '" + name + "' is taken" +
                          (first->second.empty() ? "" : " at " + first->second) + "; rename this " + kind);
    };
    for (const SceneRobot& robot : options.robots) check(robot.name, robot.where, "robot");
    for (const SceneObject& object : options.objects) check(object.name, object.where, "object");
}

void attach(mjSpec* world, const std::string& name, mjsBody* body, const Eigen::Matrix4d& pose) {
    mjsFrame* frame = mjs_addFrame(mjs_findBody(world, "world"), nullptr);
    put(pose, frame->pos, frame->quat);
    if (!mjs_attach(frame->element, body->element, (name + "/").c_str(), ""))
        throw std::runtime_error(std::string("MuJoCo cannot place it: ") + mjs_getError(world));
}

void add_urdf(mjSpec* world, SceneRobot& robot, const PhysicsOptions& physics, Looks looks, RobotStart& start,
              std::vector<std::string>& warnings) {
    RobotOptions& options = robot.options;
    const Urdf urdf = Urdf::read(options.urdf);
    if (options.joints.empty())
        for (const UrdfJoint& joint : urdf.joints)
            if (joint.is_movable() && joint.leader.empty()) options.joints.push_back(joint.name);
    options.followers = urdf.followers_of(options.joints);
    complete(options, urdf);
    options.validate(); // the number of joints is known only now
    std::vector<std::string> said;
    const SpecPtr spec = make_robot(options, physics, urdf, looks, Touching::everything, said);
    for (const std::string& line : said) warnings.push_back("robot '" + robot.name + "': " + line);
    start.mass = total_mass(spec.get());
    attach(world, robot.name, mjs_findBody(spec.get(), "world"),
           options.initial_w_H_b.value_or(Eigen::Matrix4d::Identity()));
}

void add_robot(mjSpec* world, SceneRobot& robot, const PhysicsOptions& physics, Looks looks,
               RobotStart& start, std::vector<std::string>& warnings) {
    try {
        robot.options.validate();
        start.is_mjcf = is_mjcf(robot.options.urdf);
        if (!start.is_mjcf) {
            for (const std::string* word : {&robot.body, &robot.key})
                if (!word->empty())
                    throw std::runtime_error("only an MJCF has bodies and key frames, and '" +
                                             robot.options.urdf.string() +
                                             "' is a URDF; leave body and key out");
            add_urdf(world, robot, physics, looks, start, warnings);
            return;
        }
        if (robot.options.surface)
            throw std::runtime_error(
                "an MJCF says itself how its shapes touch; leave friction, solref and solimp out");
        const Mjcf mjcf = read_mjcf(robot);
        start.mass = mjcf.mass;
        start.positions = mjcf.start;
        start.gains = mjcf.gains;
        attach(world, robot.name, mjcf.body,
               robot.options.initial_w_H_b.value_or(Eigen::Matrix4d::Identity()));
    } catch (const std::exception& error) {
        refuse(robot.where, "robot '" + robot.name + "': " + error.what());
    }
}

bool is_terrain(SceneObject::Kind kind) { return kind >= SceneObject::Kind::slope; }

/// What the elements of SceneObject::size are called in a file.
std::vector<const char*> names_of_sizes(SceneObject::Kind kind) {
    using Kind = SceneObject::Kind;
    switch (kind) {
    case Kind::sphere: return {"radius"};
    case Kind::cylinder: return {"radius", "length"};
    case Kind::mesh: return {"scale", "scale", "scale"};
    case Kind::slope: return {"length", "width", "height"};
    case Kind::steps: return {"depth", "width", "height"};
    case Kind::heights: return {"size", "size", "height"};
    case Kind::box: break;
    }
    return {"size", "size", "size"};
}

void check_object(const SceneObject& object) {
    const auto require = [&](bool rule, const std::string& text) {
        if (!rule) refuse(object.where, "object '" + object.name + "': " + text);
    };
    require(is_rigid(object.w_H_o), "its pose is no homogeneous transform; its numbers must be finite");
    const auto& sizes = names_of_sizes(object.kind);
    for (size_t i = 0; i < sizes.size(); ++i) {
        const double size = object.size[static_cast<Eigen::Index>(i)];
        require(size > 1e-9 && size < 1e6, "its " + std::string(sizes[i]) + " has " + number_text(size) +
                                               "; give numbers above 1e-9 and below 1e6");
    }
    require(object.count >= 1 && object.count <= 1000,
            "it has " + std::to_string(object.count) + " steps; give 1 to 1000");
    if (object.mass) {
        require(!is_terrain(object.kind), "terrain has no mass, as it is fixed to the world; leave it out");
        require(*object.mass >= 1e-9 && *object.mass < 1e9,
                "its mass is " + number_text(*object.mass) +
                    " kg; give at least 1e-9 and less than 1e9 kg; what is fixed to the world has none");
    }
    require(object.surface.complaint().empty(), "its " + object.surface.complaint());
    for (const float part : object.colour)
        require(part >= 0.0F && part <= 1.0F,
                "its colour has " + number_text(part) + "; its parts are numbers from 0 to 1");
    if (object.kind == SceneObject::Kind::mesh || object.kind == SceneObject::Kind::heights)
        require(fs::is_regular_file(object.file),
                "there is no file '" + object.file.string() +
                    "'; names of files begin at the folder of the description");
}

mjsGeom* add_geom(mjsBody* body, const SceneObject& object) {
    mjsGeom* geom = mjs_addGeom(body, nullptr);
    geom->mass = object.mass.value_or(0.0);
    geom->condim = 4; // a box that lies flat resists turning by itself; what rolls or is held needs this
    set_surface(geom, object.surface);
    std::copy_n(object.colour.data(), 4, geom->rgba);
    return geom;
}

void set_box(mjsGeom* geom, const Eigen::Vector3d& centre, const Eigen::Vector3d& edges) {
    geom->type = mjGEOM_BOX;
    std::copy_n(centre.data(), 3, geom->pos);
    for (int i = 0; i < 3; ++i) geom->size[i] = edges[i] / 2;
}

void set_mesh(mjSpec* spec, mjsGeom* geom, const SceneObject& object) {
    mjsMesh* mesh = mjs_addMesh(spec, nullptr);
    mjs_setName(mesh->element, object.name.c_str());
    mesh->inertia = mjMESH_INERTIA_CONVEX; // it touches with its hull, too
    std::copy_n(object.size.data(), 3, mesh->scale);
    try {
        if (mujoco_reads(object.file))
            mjs_setString(mesh->file, fs::absolute(object.file).c_str());
        else
            import_mesh(mesh, object.file);
    } catch (const std::exception& error) {
        refuse(object.where, "object '" + object.name + "': " + error.what());
    }
    geom->type = mjGEOM_MESH;
    mjs_setString(geom->meshname, object.name.c_str());
}

/// Rises along x from the origin; it is thick enough for what falls on it.
void set_slope(mjsGeom* geom, const SceneObject& object) {
    constexpr double thickness = 0.1;
    const double length = object.size[0], height = object.size[2];
    const double angle = std::atan2(height, length);
    const Eigen::Vector3d up(-std::sin(angle), 0.0, std::cos(angle));
    set_box(geom, Eigen::Vector3d(length / 2, 0.0, height / 2) - thickness / 2 * up,
            {std::hypot(length, height), object.size[1], thickness});
    geom->quat[0] = std::cos(angle / 2);
    geom->quat[2] = -std::sin(angle / 2);
}

/// Rows of numbers, the last one first, as MuJoCo has them from the lowest y on.
struct Heights {
    int rows = 0, columns = 0;
    std::vector<double> values;
};

Heights read_heights(const SceneObject& object) {
    const auto fail = [&](int line, const std::string& text) {
        refuse(object.where, "object '" + object.name + "': '" + object.file.string() + "', line " +
                                 std::to_string(line) + ": " + text);
    };
    std::string text;
    if (const std::string wrong = read_file(object.file.string(), text, 1 << 26); !wrong.empty())
        refuse(object.where,
               "object '" + object.name + "': cannot read '" + object.file.string() + "': " + wrong);
    for (char& c : text)
        if (c == ',' || c == ';' || c == '\r') c = ' ';
    Heights heights;
    std::istringstream lines(text);
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        std::istringstream words(line);
        std::vector<double> row;
        for (std::string word; words >> word;) {
            double value = 0;
            if (!read_value(word, value).empty() || !std::isfinite(value))
                fail(number, "'" + word + "' is no finite number; write rows of numbers, or a PNG image");
            row.push_back(object.size[2] * value);
        }
        if (row.empty()) continue;
        if (heights.rows > 0 && static_cast<int>(row.size()) != heights.columns)
            fail(number, "it has " + std::to_string(row.size()) + " numbers, and those above have " +
                             std::to_string(heights.columns) + "; give every row as many");
        heights.columns = static_cast<int>(row.size());
        ++heights.rows;
        heights.values.insert(heights.values.begin(), row.begin(), row.end());
    }
    if (heights.rows < 2 || heights.columns < 2) fail(number, "heights have at least 2 rows and 2 columns");
    return heights;
}

/// MuJoCo says only later, and not of which object, that it cannot read a file.
void check_png(const SceneObject& object) {
    const std::string_view signature("\x89PNG\r\n\x1a\n");
    std::string begin(signature.size(), '\0');
    std::ifstream(object.file, std::ios::binary).read(begin.data(), std::ssize(begin));
    if (begin != signature)
        refuse(object.where, "object '" + object.name + "': '" + object.file.string() +
                                 "' is no PNG image; give a PNG image, or a text of rows of numbers");
}

void set_heights(mjSpec* spec, mjsGeom* geom, const SceneObject& object) {
    constexpr double base = 0.1; // what is below the lowest point, m
    mjsHField* field = mjs_addHField(spec);
    mjs_setName(field->element, object.name.c_str());
    double lowest = 0.0, range = object.size[2];
    if (object.file.extension() == ".png") {
        check_png(object);
        mjs_setString(field->file, fs::absolute(object.file).c_str());
    } else {
        const Heights heights = read_heights(object);
        const auto [least, most] = std::minmax_element(heights.values.begin(), heights.values.end());
        lowest = *least;
        range = std::max(*most - *least, 1e-9);
        field->nrow = heights.rows;
        field->ncol = heights.columns;
        const std::vector<float> values(heights.values.begin(), heights.values.end());
        mjs_setFloat(field->userdata, values.data(), static_cast<int>(values.size()));
    }
    const double size[] = {object.size[0] / 2, object.size[1] / 2, range, base};
    std::copy_n(size, 4, field->size);
    geom->type = mjGEOM_HFIELD;
    geom->pos[2] = lowest;
    mjs_setString(geom->hfieldname, object.name.c_str());
}

} // namespace

void add_object(mjSpec* spec, const SceneObject& object) {
    using Kind = SceneObject::Kind;
    check_object(object);
    mjsBody* body = mjs_addBody(mjs_findBody(spec, "world"), nullptr);
    mjs_setName(body->element, object.name.c_str());
    body->fuse = 0; // it is asked for by its name
    put(object.w_H_o, body->pos, body->quat);
    if (object.mass) mjs_addFreeJoint(body);
    mjsGeom* geom = add_geom(body, object);
    const Eigen::Vector3d& size = object.size;
    switch (object.kind) {
    case Kind::box: set_box(geom, Eigen::Vector3d::Zero(), size); break;
    case Kind::sphere:
        geom->type = mjGEOM_SPHERE;
        geom->size[0] = size[0];
        break;
    case Kind::cylinder:
        geom->type = mjGEOM_CYLINDER;
        geom->size[0] = size[0];
        geom->size[1] = size[1] / 2;
        break;
    case Kind::mesh: set_mesh(spec, geom, object); break;
    case Kind::slope: set_slope(geom, object); break;
    case Kind::steps:
        for (int i = 0; i < object.count; ++i) {
            if (i > 0) geom = add_geom(body, object);
            const double height = (i + 1) * size[2];
            set_box(geom, {(i + 0.5) * size[0], 0.0, height / 2}, {size[0], size[1], height});
        }
        break;
    case Kind::heights: set_heights(spec, geom, object); break;
    }
}

void check_each_object(const SceneOptions& options) {
    for (const SceneObject& object : options.objects) {
        const SpecPtr alone(mj_makeSpec());
        add_object(alone.get(), object);
        if (const ModelPtr model{mj_compile(alone.get(), nullptr)}) continue;
        const std::string error = mjs_getError(alone.get());
        refuse(object.where, "object '" + object.name + "': MuJoCo cannot make it (" +
                                 error.substr(0, error.find('\n')) + "); look at its file and its numbers");
    }
}

std::vector<Attached> bodies_of(mjSpec* spec) {
    std::vector<Attached> all;
    const auto pose_of = [&](const double* position, const double* quaternion, const mjsOrientation& alt) {
        double wxyz[4];
        std::copy_n(quaternion, 4, wxyz);
        if (alt.type != mjORIENTATION_QUAT)
            mjs_resolveOrientation(wxyz, spec->compiler.degree, spec->compiler.eulerseq, &alt);
        Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
        H.topLeftCorner<3, 3>() =
            Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
        H.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(position);
        return H;
    };
    for (mjsElement* at = mjs_firstElement(spec, mjOBJ_BODY); at; at = mjs_nextElement(spec, at)) {
        const mjsBody* body = mjs_asBody(at);
        const mjsBody* parent = mjs_getParent(at);
        const std::string name = mjs_getString(mjs_getName(at));
        if (!parent || name.empty()) continue;
        Attached found{name, mjs_getString(mjs_getName(parent->element)),
                       pose_of(body->pos, body->quat, body->alt)};
        for (mjsFrame* frame = mjs_getFrame(at); frame; frame = mjs_getFrame(frame->element))
            found.pose = pose_of(frame->pos, frame->quat, frame->alt) * found.pose;
        all.push_back(std::move(found));
    }
    return all;
}

SpecPtr make_scene(SceneOptions& options, Looks looks, std::vector<RobotStart>& starts,
                   std::vector<std::string>& warnings) {
    options.PhysicsOptions::validate();
    check_names(options);
    SpecPtr spec(mj_makeSpec());
    set_physics(spec.get(), options);
    if (options.floor.enabled) add_floor(spec.get(), options.floor);
    if (mjsElement* floor = mjs_findElement(spec.get(), mjOBJ_GEOM, "floor"))
        mjs_asGeom(floor)->contype = mjs_asGeom(floor)->conaffinity = 1; // as everything here
    starts.resize(options.robots.size());
    for (size_t i = 0; i < options.robots.size(); ++i)
        add_robot(spec.get(), options.robots[i], options, looks, starts[i], warnings);
    for (const SceneObject& object : options.objects) add_object(spec.get(), object);
    set_physics(spec.get(), options); // what robots were attached with is forgotten
    return spec;
}

} // namespace bf::physics

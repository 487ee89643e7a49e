// The XML description of a scene.
#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/base/text_file.hpp"
#include "bf/base/value_text.hpp"
#include "bf/physics/scene_options.hpp"
#include "mjcf.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tinyxml2.h>

namespace bf::physics {

namespace {

namespace fs = std::filesystem;
using Numbers = std::vector<double>;

/// One element, whose attributes are asked for by name; what was not asked for is refused at the end.
class Element {
  public:
    Element(const tinyxml2::XMLElement& xml, std::string file) : xml_(xml), file_(std::move(file)) {}

    std::string kind() const { return xml_.Name(); }
    std::string where() const { return "'" + file_ + "', line " + std::to_string(xml_.GetLineNum()); }

    [[noreturn]] void fail(const std::string& text) const {
        throw std::runtime_error(where() + ": <" + kind() + ">: " + text);
    }

    bool has(const char* name) const { return xml_.Attribute(name) != nullptr; }
    std::string text(const char* name, const std::string& otherwise = {}) {
        known_.insert(name);
        const char* value = xml_.Attribute(name);
        return value ? value : otherwise;
    }
    std::string needed(const char* name, const char* example) {
        std::string value = text(name);
        if (value.empty())
            fail(std::string("it has no ") + name + "; add one, e.g. " + name + "=\"" + example + "\"");
        return value;
    }
    std::vector<std::string> words(const char* name) {
        std::istringstream stream(text(name));
        std::vector<std::string> all;
        for (std::string word; stream >> word;) all.push_back(word);
        return all;
    }
    /// Any count of numbers where `count` is 0. MuJoCo takes what is larger than 1e10 for a motion that
    /// diverged.
    Numbers numbers(const char* name, size_t count, Numbers otherwise = {}, double most = 1e10) {
        if (!has(name)) return known_.insert(name), otherwise;
        Numbers values;
        for (const std::string& word : words(name)) {
            double value = 0;
            if (!read_value(word, value).empty() || !std::isfinite(value))
                fail(std::string(name) + "=\"" + text(name) + "\": '" + word +
                     "' is no finite number; write digits with a point, e.g. 1.5 or 2e-3");
            if (std::abs(value) > most)
                fail(std::string(name) + "=\"" + text(name) + "\": '" + word +
                     "' is too large; give numbers from " + number_text(-most) + " to " + number_text(most));
            values.push_back(value);
        }
        if (count != 0 && values.size() != count)
            fail(std::string(name) + "=\"" + text(name) + "\" has " + std::to_string(values.size()) +
                 " numbers; give " + std::to_string(count));
        return values;
    }
    /// Numbers of rows one after the other.
    Eigen::MatrixXd rows(const char* name, int columns) {
        Numbers all = numbers(name, 0);
        if (all.size() % static_cast<size_t>(columns) != 0)
            fail(std::string(name) + "=\"" + text(name) + "\" has " + std::to_string(all.size()) +
                 " numbers; give " + std::to_string(columns) + ", or as many for each joint");
        return Eigen::Map<Eigen::MatrixXd>(all.data(), columns, std::ssize(all) / columns).transpose();
    }
    double number(const char* name, double otherwise, double most = 1e10) {
        return numbers(name, 1, {otherwise}, most)[0];
    }
    double number_from(double least, double most, const char* name, double otherwise) {
        const double value = number(name, otherwise);
        if (value < least || value > most)
            fail(std::string(name) + "=\"" + text(name) + "\" is out of range; give a number from " +
                 number_text(least) + " to " + number_text(most));
        return value;
    }
    int whole_from(int least, int most, const char* name, int otherwise) {
        const double value = number(name, otherwise);
        if (value < least || value > most || value != std::floor(value))
            fail(std::string(name) + "=\"" + text(name) + "\" is no whole number from " +
                 std::to_string(least) + " to " + std::to_string(most));
        return static_cast<int>(value);
    }
    template <class T> T choice(const char* name, std::initializer_list<std::pair<const char*, T>> choices) {
        const std::string value = text(name, choices.begin()->first);
        std::string list;
        for (const auto& [word, meaning] : choices) {
            if (value == word) return meaning;
            list += (list.empty() ? "" : ", ") + std::string(word);
        }
        fail(std::string(name) + "=\"" + value + "\" is none of: " + list);
    }
    /// From `position` (m) and `rpy` (rad): R = Rz(yaw) Ry(pitch) Rx(roll).
    Eigen::Matrix4d pose() {
        const Numbers p = numbers("position", 3, {0, 0, 0}), a = numbers("rpy", 3, {0, 0, 0});
        using Eigen::AngleAxisd, Eigen::Vector3d;
        Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
        H.topLeftCorner<3, 3>() = (AngleAxisd(a[2], Vector3d::UnitZ()) * AngleAxisd(a[1], Vector3d::UnitY()) *
                                   AngleAxisd(a[0], Vector3d::UnitX()))
                                      .toRotationMatrix();
        H.topRightCorner<3, 1>() = Vector3d(p[0], p[1], p[2]);
        return H;
    }
    fs::path path(const char* name, const char* example) {
        fs::path path = fs::path(file_).parent_path() / needed(name, example);
        if (!fs::is_regular_file(path))
            fail(std::string(name) + "=\"" + text(name) + "\": there is no file '" + path.string() +
                 "'; names of files begin at the folder of the description");
        return path;
    }
    /// Refuses text in it.
    void check_content() const {
        for (const auto* node = xml_.FirstChild(); node; node = node->NextSibling())
            if (node->ToText())
                fail("it holds the text '" + std::string(node->Value()) +
                     "', which says nothing here; give attributes and elements, or a comment");
    }

    /// Refuses attributes that nobody asked for.
    void finish() const {
        for (const auto* a = xml_.FirstAttribute(); a; a = a->Next()) {
            if (known_.contains(a->Name())) continue;
            const auto nearest = nearest_first(a->Name(), {known_.begin(), known_.end()}, 1);
            fail("it knows no attribute '" + std::string(a->Name()) + "'" +
                 (!nearest.empty() && edit_distance(a->Name(), nearest[0]) <= 2
                      ? "; did you mean '" + nearest[0] + "'?"
                      : "; it knows " + name_list(std::vector<std::string>(known_.begin(), known_.end()))));
        }
    }

  private:
    const tinyxml2::XMLElement& xml_;
    std::string file_;
    std::set<std::string> known_;
};

Surface read_surface(Element& e, Surface surface) {
    surface.friction = e.number("friction", surface.friction);
    const Numbers solref = e.numbers("solref", 2, {surface.solref[0], surface.solref[1]});
    surface.solref = {solref[0], solref[1]};
    const Numbers solimp = e.numbers("solimp", 0);
    if (solimp.size() > surface.solimp.size())
        e.fail("solimp has " + std::to_string(solimp.size()) +
               " numbers; give impedance at the surface and below it, width, midpoint and power, or the "
               "first of them");
    std::copy(solimp.begin(), solimp.end(), surface.solimp.begin());
    return surface;
}

SceneRobot read_robot(Element& e, const Surface& floor, const std::vector<fs::path>& package_paths,
                      size_t number) {
    SceneRobot robot;
    robot.where = e.where();
    robot.name = e.needed("name", "left");
    RobotOptions& o = robot.options;
    o.urdf = e.path("file", "arm.urdf");
    o.package_paths = package_paths;
    o.package_paths.push_back(o.urdf.parent_path());
    robot.body = e.text("body");
    robot.key = e.text("key");
    if (e.has("base") && is_mjcf(o.urdf))
        e.fail("an MJCF says itself whether its base floats; leave base out");
    o.floating_base = e.choice<bool>("base", {{"fixed", false}, {"floating", true}});
    const Surface surface = read_surface(e, floor);
    if (e.has("friction") || e.has("solref") || e.has("solimp")) o.surface = surface;
    o.initial_w_H_b = e.pose();
    o.joints = e.words("joints");
    o.base_link = e.text("base_link");
    o.initial_joints = e.numbers("initial", 0);
    o.armature = e.numbers("armature", 0);
    o.damping = e.numbers("damping", 0);
    o.friction = e.numbers("joint_friction", 0);
    robot.loop_period = e.number("loop_period", 0);
    MotorOptions& m = robot.motors;
    m.gear_ratio = e.numbers("gear_ratio", 0);
    m.torque_constant = e.numbers("torque_constant", 0);
    m.k_tau = e.numbers("k_tau", 0);
    m.k_bemf = e.numbers("k_bemf", 0);
    m.position_gains = e.rows("position_gains", 3);
    m.torque_gains = e.rows("torque_gains", 3);
    m.impedance_gains = e.rows("impedance_gains", 2);
    const Numbers noise = e.numbers("noise", 3, {0, 0, 0});
    const double seed = e.number("seed", static_cast<double>(number + 1), 1e15);
    if (!(seed >= 0 && seed < 1e15 && seed == std::floor(seed)))
        e.fail("seed=\"" + e.text("seed") + "\" is no whole number from 0 to 1e15");
    o.noise = {noise[0], noise[1], noise[2], static_cast<std::uint64_t>(seed)};
    Imperfections& i = o.imperfections;
    i.delays = {e.number("command_delay", 0), e.number("measurement_delay", 0)};
    i.dropout = e.number("dropout", 0);
    i.backlash = e.numbers("backlash", 0);
    i.encoder_resolution = e.numbers("encoder_resolution", 0);
    i.motor_encoder_resolution = e.numbers("motor_encoder_resolution", 0);
    i.velocities_from_encoders =
        e.choice<bool>("velocities_from_encoders", {{"false", false}, {"true", true}});
    o.imu_frame = e.text("imu");
    o.ft_sensors = e.words("ft_sensors");
    o.push_links = e.words("push_links");
    return robot;
}

const std::map<std::string, SceneObject::Kind>& kinds() {
    using Kind = SceneObject::Kind;
    static const std::map<std::string, Kind> all{
        {"box", Kind::box},     {"sphere", Kind::sphere}, {"cylinder", Kind::cylinder}, {"mesh", Kind::mesh},
        {"slope", Kind::slope}, {"steps", Kind::steps},   {"heights", Kind::heights}};
    return all;
}

SceneObject read_object(Element& e, SceneObject::Kind kind) {
    using Kind = SceneObject::Kind;
    SceneObject object;
    object.where = e.where();
    object.kind = kind;
    object.name = e.needed("name", "parcel");
    object.w_H_o = e.pose();
    const auto three = [&](const char* name, const Numbers& otherwise) {
        const Numbers size = e.numbers(name, 3, otherwise);
        return Eigen::Vector3d(size[0], size[1], size[2]);
    };
    switch (kind) {
    case Kind::box: object.size = three("size", {0.1, 0.1, 0.1}); break;
    case Kind::sphere: object.size[0] = e.number("radius", 0.05); break;
    case Kind::cylinder:
        object.size[0] = e.number("radius", 0.05);
        object.size[1] = e.number("length", 0.1);
        break;
    case Kind::mesh:
        object.file = e.path("file", "part.stl");
        object.size = three("scale", {1, 1, 1});
        break;
    case Kind::slope:
        object.size = {e.number("length", 1), e.number("width", 1), e.number("height", 0.1)};
        break;
    case Kind::steps:
        object.size = {e.number("depth", 0.3), e.number("width", 1), e.number("height", 0.15)};
        object.count = e.whole_from(1, 1000, "count", 3);
        break;
    case Kind::heights: {
        object.file = e.path("file", "ground.png");
        const Numbers size = e.numbers("size", 2, {1, 1});
        object.size = {size[0], size[1], e.number("height", 1)};
        break;
    }
    }
    if (e.has("mass")) object.mass = e.number("mass", 0);
    e.text("mass"); // known also where it is left out
    object.surface = read_surface(e, object.surface);
    const Numbers colour = e.numbers("colour", 0, {0.8, 0.6, 0.3});
    if (colour.size() != 3 && colour.size() != 4)
        e.fail("colour has " + std::to_string(colour.size()) +
               " numbers; give red, green, blue and, if you want, opacity, each from 0 to 1");
    for (size_t i = 0; i < colour.size(); ++i) object.colour[i] = static_cast<float>(colour[i]);
    return object;
}

} // namespace

SceneOptions SceneOptions::read(const fs::path& file, const std::vector<fs::path>& package_paths) {
    std::string text;
    if (const std::string wrong = read_file(file.string(), text); !wrong.empty())
        throw std::runtime_error("cannot read the world '" + file.string() + "': " + wrong +
                                 "; check the path, relative ones start at the model's folder");
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) refuse_xml(file, document);
    const auto* root = document.RootElement();
    if (!root || std::string(root->Name()) != "world")
        throw std::runtime_error("'" + file.string() + "' does not begin with <world>, but with <" +
                                 (root ? root->Name() : "") + ">; a description of a world is expected");
    SceneOptions options;
    if (const auto* second = root->NextSiblingElement())
        throw std::runtime_error("'" + file.string() + "', line " + std::to_string(second->GetLineNum()) +
                                 ": a file describes one world; put what follows </world> into it, or remove "
                                 "it");
    Element world(*root, file.string());
    world.check_content();
    options.time_step = world.number_from(1e-6, 0.1, "step", options.time_step);
    options.impratio = world.number_from(1e-6, 1e6, "impratio", options.impratio);
    const Numbers g = world.numbers("gravity", 3, {0, 0, -9.81});
    options.gravity = {g[0], g[1], g[2]};
    options.cone = world.choice<FrictionCone>(
        "cone", {{"elliptic", FrictionCone::elliptic}, {"pyramidal", FrictionCone::pyramidal}});
    options.integrator = world.choice<Integrator>(
        "integrator", {{"implicit_fast", Integrator::implicit_fast}, {"euler", Integrator::euler}});
    world.finish();
    options.floor.enabled = false;
    std::string floor;        // where it stands
    Surface surface_of_floor; // which robots have that stand before it
    if (const auto* xml = root->FirstChildElement("floor")) {
        Element e(*xml, file.string());
        surface_of_floor = read_surface(e, {});
    }
    for (const auto* xml = root->FirstChildElement(); xml; xml = xml->NextSiblingElement()) {
        Element e(*xml, file.string());
        const std::string kind = e.kind();
        if (kind == "floor") {
            if (options.floor.enabled)
                e.fail("there is a floor already, " + floor + "; leave one of them out");
            options.floor.enabled = true;
            floor = e.where();
            static_cast<Surface&>(options.floor) = read_surface(e, {});
            if (const std::string wrong = options.floor.complaint(); !wrong.empty()) e.fail("its " + wrong);
        } else if (kind == "robot") {
            options.robots.push_back(read_robot(e, surface_of_floor, package_paths, options.robots.size()));
        } else if (const auto known = kinds().find(kind); known != kinds().end()) {
            options.objects.push_back(read_object(e, known->second));
        } else {
            e.fail("a world holds floor, robot, box, sphere, cylinder, mesh, slope, steps and heights");
        }
        e.finish();
        e.check_content();
        if (xml->FirstChildElement())
            e.fail("it holds <" + std::string(xml->FirstChildElement()->Name()) +
                   ">, which belongs beside it, into <world>");
    }
    return options;
}

} // namespace bf::physics

#include "bf/middleware/robot_frames.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace bf::middleware {

const char* const measurement_names[measurement_count] = {
    "joint positions",  "joint velocities",    "joint accelerations", "joint torques", "motor positions",
    "motor velocities", "motor accelerations", "motor currents",      "motor PWM"};
const char* const mode_names[mode_count] = {"Position", "Position Direct", "Velocity", "Torque",
                                            "PWM",      "Current",         "Impedance"};

namespace {

using Json = nlohmann::json;

/// JSON knows no infinity, which stands for no limit.
Json json_of(const Eigen::VectorXd& values) {
    Json list = Json::array();
    for (const double value : values) list.push_back(std::isfinite(value) ? Json(value) : Json());
    return list;
}

Eigen::VectorXd limits_in(const Json& json, const char* key, std::size_t n, double none) {
    const Json& list = json.at(key);
    if (!list.is_array() || list.size() != n)
        throw std::runtime_error(std::string("'") + key + "' has " + std::to_string(list.size()) +
                                 " elements for " + std::to_string(n) + " joints");
    Eigen::VectorXd values(static_cast<Eigen::Index>(n));
    for (std::size_t i = 0; i < n; ++i)
        values[static_cast<Eigen::Index>(i)] = list[i].is_null() ? none : list[i].get<double>();
    return values;
}

std::vector<std::string> names_in(const Json& json, const char* key) {
    auto names = json.at(key).get<std::vector<std::string>>();
    if (names.size() > 10'000) throw std::runtime_error(std::string("'") + key + "' names more than 10000");
    for (const auto& name : names)
        if (name.size() > 255) throw std::runtime_error(std::string("a name in '") + key + "' is too long");
    return names;
}

} // namespace

std::string RobotDescription::text() const {
    return Json{{"version", version},
                {"name", name},
                {"process", process},
                {"period", period},
                {"waits", waits},
                {"watchdog", watchdog},
                {"joints", joints},
                {"wrenches", wrenches},
                {"imus", imus},
                {"measurements", measurements},
                {"modes", modes},
                {"position_gains", has_position_gains},
                {"torque_gains", has_torque_gains},
                {"motor_parameters", has_motor_parameters},
                {"position_min", json_of(position_min)},
                {"position_max", json_of(position_max)},
                {"velocity_min", json_of(velocity_min)},
                {"velocity_max", json_of(velocity_max)}}
        .dump();
}

RobotDescription RobotDescription::read(const std::string& text) {
    try {
        const Json json = Json::parse(text);
        if (const int its = json.at("version").get<int>(); its != version)
            throw std::runtime_error("it speaks version " + std::to_string(its) +
                                     ", and this program version " + std::to_string(version) +
                                     "; use the same BlockFactory on both sides");
        RobotDescription d;
        d.name = json.at("name").get<std::string>();
        d.process = json.at("process").get<int>();
        d.period = json.at("period").get<double>();
        d.waits = json.at("waits").get<bool>();
        d.watchdog = json.at("watchdog").get<double>();
        d.joints = names_in(json, "joints");
        d.wrenches = names_in(json, "wrenches");
        d.imus = names_in(json, "imus");
        d.measurements = json.at("measurements").get<std::uint32_t>();
        d.modes = json.at("modes").get<std::uint32_t>();
        d.has_position_gains = json.at("position_gains").get<bool>();
        d.has_torque_gains = json.at("torque_gains").get<bool>();
        d.has_motor_parameters = json.at("motor_parameters").get<bool>();
        constexpr double infinity = std::numeric_limits<double>::infinity();
        d.position_min = limits_in(json, "position_min", d.joints.size(), -infinity);
        d.position_max = limits_in(json, "position_max", d.joints.size(), infinity);
        d.velocity_min = limits_in(json, "velocity_min", d.joints.size(), -infinity);
        d.velocity_max = limits_in(json, "velocity_max", d.joints.size(), infinity);
        if (!(d.period > 0)) throw std::runtime_error("its period is not above 0");
        return d;
    } catch (const Json::exception&) {
        throw std::runtime_error("what it says of itself cannot be read; start its server anew, and use the "
                                 "same BlockFactory on both sides");
    }
}

} // namespace bf::middleware

// Runs models written as YAML text with the real plugin.
#pragma once

#include "bf/blocks/standard.hpp"
#include "bf/core/registry.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

namespace bf::toolbox::test {

/// The 23 joints of a balancing iCub, as MATLAB text.
inline const std::string icub_joints =
    "{'torso_pitch', 'torso_roll', 'torso_yaw', 'l_shoulder_pitch', 'l_shoulder_roll', 'l_shoulder_yaw', "
    "'l_elbow', 'r_shoulder_pitch', 'r_shoulder_roll', 'r_shoulder_yaw', 'r_elbow', 'l_hip_pitch', "
    "'l_hip_roll', 'l_hip_yaw', 'l_knee', 'l_ankle_pitch', 'l_ankle_roll', 'r_hip_pitch', 'r_hip_roll', "
    "'r_hip_yaw', 'r_knee', 'r_ankle_pitch', 'r_ankle_roll'}";

/// The standard blocks and, on demand, the plugin.
struct Blocks : Registry {
    Blocks() {
        add(standard_library());
        add_search_path(BF_PLUGIN_DIRECTORY);
    }
};

/// A model in execution. Values are written to the inputs of its root and read by the path of their signal.
class Running {
  public:
    explicit Running(const std::string& text)
        : diagram_(elaborate(formats::read_yaml_text(text), blocks_)), simulation(diagram_) {
        simulation.start();
    }

    Running& set(const std::string& input, const Matrix& value) {
        for (const auto& port : diagram_.inputs) {
            if (port.path != input) continue;
            const Slot& slot = diagram_.slot(port.end);
            if (slot.size.count() != value.size())
                throw std::runtime_error("input '" + input + "' has size " + slot.size.text());
            write_values(simulation.context().data(port.end.node, port.end.slot), slot.type,
                         slot.size.count(), {value.data(), value.data() + value.size()});
            return *this;
        }
        throw std::runtime_error("no input '" + input + "'");
    }
    Running& set(const std::string& input, double value) { return set(input, Matrix::Constant(1, 1, value)); }

    Matrix get(const std::string& path) const {
        const auto end = diagram_.find_signal(path);
        if (end.node < 0) throw std::runtime_error("no signal '" + path + "'");
        const Slot& slot = diagram_.slot(end);
        Matrix value(slot.size.rows, slot.size.cols);
        for (int i = 0; i < slot.size.count(); ++i)
            value.data()[i] = read_value(simulation.context().data(end.node, end.slot), slot.type, i);
        return value;
    }
    double scalar(const std::string& path) const { return get(path)(0, 0); }
    Size size(const std::string& path) const { return diagram_.slot(diagram_.find_signal(path)).size; }

    bool step() { return bool(simulation.step()); }
    const Diagram& diagram() const { return diagram_; }

  private:
    Blocks blocks_;
    Diagram diagram_;

  public:
    Simulation simulation;
};

/// Path of a file with this text, in the folder of temporary files.
inline std::string temporary_file(const std::string& name, const std::string& text) {
    const auto path = std::filesystem::temp_directory_path() / (std::to_string(getpid()) + "_" + name);
    std::ofstream(path) << text;
    return path.string();
}

/// An argument as a model has it.
inline std::string yaml(const Value& value) {
    if (value.kind == Value::Kind::text) return value.text;
    if (value.type == Type::boolean) return value.data.at(0) != 0 ? "true" : "false";
    if (value.kind == Value::Kind::number && value.rows * value.cols == 1) return value.describe();
    if (value.kind == Value::Kind::number) {
        std::string text = "\"[";
        for (int i = 0; i < value.rows; ++i) {
            for (int j = 0; j < value.cols; ++j)
                text += (j > 0 ? " " : "") +
                        Value(value.data[static_cast<std::size_t>(i + j * value.rows)]).describe();
            text += i + 1 < value.rows ? "; " : "]\"";
        }
        return text;
    }
    std::string list;
    for (const auto& item : value.texts) list += (list.empty() ? "'" : ", '") + item + "'";
    return "\"{" + list + "}\"";
}

/// A block of the toolbox as a line of a model.
inline std::string yaml(const std::string& name, const std::string& block, const Arguments& arguments) {
    std::string text = "  " + name + ": {block: WholeBodyToolbox/" + block;
    for (const auto& [key, value] : arguments) text += ", " + key + ": " + yaml(value);
    return text + "}\n";
}

/// All that elaboration or the start says against a model; empty when it runs.
inline std::string refusal(const std::string& text) {
    try {
        const Running run(text);
    } catch (const std::exception& error) {
        return error.what();
    }
    return {};
}

inline void expect_contains(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << "text: " << text << "\npart: " << part;
}

} // namespace bf::toolbox::test

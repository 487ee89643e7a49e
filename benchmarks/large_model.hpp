// Generated models of many blocks, for measurements of the editor.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

namespace bf::benchmarks {

/// A model in a folder of its own, which goes with the object.
class LargeModel {
  public:
    /// Five levels: subsystems of gains in a row, with two subsystems alike in each.
    explicit LargeModel(int blocks)
        : LargeModel("  top:\n" + system(0, blocks / 100, "    "), "connections: {c: top}\n") {}
    ~LargeModel() { std::filesystem::remove_all(file.parent_path()); }
    LargeModel(const LargeModel&) = delete;
    LargeModel& operator=(const LargeModel&) = delete;

    /// All of them in one drawing: rows of fifty gains.
    static LargeModel flat(int blocks) {
        std::string text, heads, wires;
        for (int i = 0; i < blocks; ++i) {
            const std::string name = "g" + std::to_string(i), last = "g" + std::to_string(i - 1);
            text += "  " + name + ": {block: Gain, K: 0.5}\n";
            if (i % 50 == 0)
                heads += (heads.empty() ? "" : ", ") + name;
            else
                wires += "  " + last + ": " + name + "\n";
        }
        return {text, "connections:\n  c: [" + heads + "]\n" + wires};
    }

    const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                       ("bf_editor_benchmark_" + std::to_string(::getpid())) / "large.yaml";

  private:
    LargeModel(const std::string& blocks, const std::string& rest) {
        std::filesystem::create_directories(file.parent_path());
        std::ofstream(file) << "model: large\nstep: 0.01\nblocks:\n  c: {block: Constant}\n" + blocks + rest;
    }

    static std::string system(int level, int row, const std::string& indent) {
        const int count = level == 4 ? 5 * row : row;
        std::string text = indent + "inputs: [u]\n" + indent + "outputs: [y]\n" + indent + "blocks:\n";
        std::string wires = indent + "connections:\n" + indent + "  u: g0\n", last = "g0";
        const auto add = [&](const std::string& name) {
            wires += indent + "  " + last + ": " + name + "\n";
            last = name;
        };
        for (int i = 0; i < count; ++i) {
            const std::string name = "g" + std::to_string(i);
            text += indent + "  " + name + ": {block: Gain, K: 0.5}\n";
            if (i > 0) add(name);
        }
        for (int i = 0; i < 2 && level < 4; ++i) {
            const std::string name = "s" + std::to_string(i);
            text += indent + "  " + name + ":\n" + system(level + 1, row, indent + "    ");
            add(name);
        }
        return text + wires + indent + "  " + last + ": y\n";
    }
};

} // namespace bf::benchmarks

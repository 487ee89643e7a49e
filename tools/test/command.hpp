// Runs `bf` as a person would: a process in a folder of its own.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <sys/wait.h>

namespace bf::tools {

struct Outcome {
    int code = -1;
    std::string out, err;
};

/// A test in an empty temporary folder.
class Command : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = std::filesystem::temp_directory_path() / "bf_tools_XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    /// The shell's `bf ARGUMENTS` in the folder, with variables set in front of it.
    Outcome bf(const std::string& arguments, const std::string& environment = "") const {
        return shell(environment + " '" BF_PROGRAM "' " + arguments);
    }
    Outcome shell(const std::string& command) const {
        const int status =
            std::system(("cd '" + folder.string() + "' && { " + command + "; } >.out 2>.err").c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(".out"), read(".err")};
    }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder / name) << text;
    }
    std::string read(const std::string& name) const {
        std::ostringstream text;
        text << std::ifstream(folder / name, std::ios::binary).rdbuf();
        return text.str();
    }
    nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(read(name)); }
    bool exists(const std::string& name) const { return std::filesystem::exists(folder / name); }
    /// What is in the folder besides the outputs of the last command, in order, with blanks between.
    std::string files() const {
        std::set<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            names.insert(entry.path().filename());
        std::string text;
        for (const auto& name : names)
            if (name != ".out" && name != ".err") text += (text.empty() ? "" : " ") + name;
        return text;
    }
    int lines(const std::string& name) const {
        const std::string text = read(name);
        return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
    }

    std::filesystem::path folder;
};

/// A model of 0.01 s with a sine of amplitude Gain.Kp through a gain.
inline const std::string sine_model = R"(model: sine
step: 0.01
stop: 1
variables:
  Gain: {Kp: 2, Kd: 1}
blocks:
  source: {block: Sine, amplitude: Gain.Kp, frequency: 2*pi}
  gain: {block: Gain, K: 3}
  largest: {block: Check, kind: maximum, at_most: 10}
connections:
  source: gain
  gain: largest
record: [source.y, gain.y]
plots:
  Both: [source.y, gain.y]
)";

/// A step that takes hours: a loop of 100,000 loops of 100,000 iterations.
inline const std::string hanging_model = R"(model: hang
step: 0.01
stop: 5
blocks:
  outer:
    execution: for
    iterations: 100000
    outputs: [y]
    blocks:
      inner:
        execution: for
        iterations: 100000
        outputs: [y]
        blocks: {n: {block: Iteration}, m: {block: UnitDelay}, s: {block: Sum}}
        connections: {n: s.u1, m: s.u2, s: [m, y]}
    connections: {inner: y}
record: [outer.y]
)";

#define EXPECT_CONTAINS(text, part) EXPECT_NE((text).find(part), std::string::npos) << "in: " << (text)

} // namespace bf::tools

// BlockFactory.tlc prints code for the record that the S-function writes; the code is built and run without
// MATLAB, and does what the S-function does.
#include "simstruct/model.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <unistd.h>

extern "C" const SimStructMethods simstruct_methods;

namespace generated_code {
namespace {

using simstruct::logical;
using simstruct::matrix;
using simstruct::Model;
using simstruct::number;
using simstruct::text;
using simstruct::texts;

constexpr int steps = 4;
const std::array<double, 3> signal{0.5, 1.5, -2.5};

using Json = nlohmann::ordered_json;

/// JSON has no infinity and no NaN: they are {"float": "inf"} and the like.
Json json(double x) { return std::isfinite(x) ? Json(x) : Json{{"float", std::to_string(x)}}; }
Json json(const std::string& text) { return text; }
Json json(const std::vector<double>& list) {
    Json all = Json::array();
    for (const double x : list) all.push_back(json(x));
    return all;
}

/// Blocks beside each other: each has `inputs` inputs of three elements.
struct Beside {
    Model model{simstruct_methods, 0.01};
    std::vector<int> blocks, inputs;

    void add(const std::string& path, std::vector<mxArray*> parameters, int count) {
        blocks.push_back(model.add(path, std::move(parameters)));
        inputs.push_back(count);
        for (int i = 0; i < count; ++i) {
            const int source = model.add_input(3, 0, SS_DOUBLE);
            model.connect(source, 0, blocks.back(), i);
            sources_.push_back(source);
        }
    }
    /// Outputs of all blocks, step by step.
    std::vector<double> run() {
        model.compile();
        model.start();
        for (const int source : sources_) std::memcpy(model.input(source), signal.data(), sizeof(signal));
        std::vector<double> all;
        for (int k = 0; k < steps; ++k) {
            model.step();
            for (const int block : blocks)
                for (int port = 0; port < model.outputs(block); ++port) {
                    const auto* y = static_cast<const double*>(model.output(block, port));
                    all.insert(all.end(), y, y + model.output_dimensions(block, port).at(0));
                }
        }
        return all;
    }
    Json record() {
        Json all = Json::array();
        for (std::size_t b = 0; b < blocks.size(); ++b) {
            const int block = blocks[b];
            Json made{{"name", "b" + std::to_string(b)}, {"PWork", Json::object()}};
            for (const char* list : {"settings", "inputs", "outputs"}) made[list] = Json::array();
            for (const auto& record : model.rtw(block)) {
                Json& settings = made["settings"].emplace_back(Json::object());
                for (const auto& [name, value] : record)
                    settings[name] = std::visit([](const auto& v) { return json(v); }, value);
            }
            // The S-function names them with its record.
            for (const auto& [name, width] : model.pointer_names(block)) made["PWork"][name] = width;
            for (int i = 0; i < inputs[b]; ++i)
                made["inputs"].push_back({{"dims", Json::array({3})}, {"type", 0}, {"values", signal}});
            for (int i = 0; i < model.outputs(block); ++i)
                made["outputs"].push_back(
                    {{"dims", Json::array({model.output_dimensions(block, i).at(0)})}, {"type", 0}});
            all.push_back(std::move(made));
        }
        return {{"steps", steps}, {"blocks", all}};
    }

  private:
    std::vector<int> sources_;
};

/// What the program that is made of the record prints.
std::string printed(const Json& record) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(testing::TempDir()) / ("bf_tlc_" + std::to_string(getpid()));
    fs::create_directories(folder);
    std::ofstream(folder / "record.json") << record;
    const std::string in = folder.string() + "/", source = BF_SOURCE_DIRECTORY "/",
                      library = BF_BINARY_DIRECTORY "/lib";
    const std::string command = "python3 " + source + "tests/hosts/simstruct/test/expand_tlc.py " + source +
                                "hosts/simulink/BlockFactory.tlc " + in + "record.json " + in +
                                "code.cpp && " BF_COMPILE " -DMODEL=M -I" + source + "boundary/include -I" +
                                source + "hosts/simulink_coder/include " + in + "code.cpp -o " + in +
                                "code -L" + library +
                                " -lBlockFactorySimulinkCoder -lBlockFactoryCore -Wl,-rpath," + library +
                                " && BLOCKFACTORY_PLUGIN_PATH=" BF_TEST_PLUGINS ":" BF_PLUGIN_DIRECTORY
                                ":" BF_PLUGIN_DIRECTORY "/legacy " +
                                in + "code >" + in + "printed";
    const int status = std::system(command.c_str());
    std::ifstream file(folder / "printed");
    std::stringstream text;
    text << file.rdbuf();
    fs::remove_all(folder);
    return text.str() + (status == 0 ? "" : "failed\n");
}

TEST(GeneratedCode, PrintedForTheRecordsOfBlocksRunsAsTheSFunction) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const char* field = "field";
    mxArray* structure = mxCreateStructMatrix(1, 1, 1, &field);
    mxSetField(structure, 0, field, number(-1));
    Beside beside;
    beside.add("m/all \"kinds\"\n of \\ them",
               {text("AllParameters"), text("LegacyPlugin"), number(7), logical(true), number(0.1),
                text("f\"o\nu\\r"), matrix(1, 3, {1, 2, 3}), texts({"a", ""}), structure},
               0);
    beside.add("m/old",
               {text("Accumulate"), text("LegacyPlugin"), number(2), matrix(1, 3, {0.1, 0.2, 1e-300})}, 2);
    beside.add("m/new",
               {text("Accumulate"), text("NativePlugin"), number(2), matrix(1, 3, {1, 2, 3}), number(-1)}, 2);
    beside.add("m/limits", {text("Saturate"), text("standard"), number(-infinity), number(1), number(-1)}, 1);
    beside.add("m/delay", {text("UnitDelay"), text("standard"), matrix(1, 3, {1, 2, 3}), number(-1)}, 1);
    std::ostringstream expected;
    for (const double y : beside.run()) {
        char digits[32];
        std::snprintf(digits, sizeof(digits), "%.17g\n", y);
        expected << digits;
    }
    const std::string names =
        "block m/all \"kinds\"\n of \\ them\nblock m/delay\nblock m/limits\nblock m/new\nblock m/old\n";
    EXPECT_EQ(printed(beside.record()), names + expected.str());
}

TEST(GeneratedCode, PrintedForABlockThatFailsSaysWhichAndWhy) {
    const auto failing = [](const char* misdeed) {
        Beside beside;
        beside.add("m/bad", {text("Misbehaves"), text("LegacyPlugin"), text("none")}, 1);
        beside.run();
        Json record = beside.record();
        // The record of a block that sizes well and fails only when it runs.
        const auto codes = [](std::string_view text) {
            return json(std::vector<double>(text.begin(), text.end()));
        };
        int found = 0;
        for (auto& settings : record["blocks"][0]["settings"])
            if (settings.contains("value") && settings["value"] == codes("none")) {
                settings["value"] = codes(misdeed);
                settings["lengths"] = json(std::vector<double>{double(std::strlen(misdeed))});
                ++found;
            }
        EXPECT_EQ(found, 1);
        return printed(record);
    };
    const std::string block = "plugin 'LegacyPlugin', block 'm/bad', ";
    EXPECT_EQ(failing("initialize returns false"),
              "block m/bad\n[Initialize]" + block + "initialize: refused on purpose\n\nfailed\n");
    EXPECT_EQ(failing("initialize throws"),
              "block m/bad\n[Initialize]" + block +
                  "initialize: threw an exception: thrown on purpose {0}\n\nfailed\n");
    EXPECT_EQ(failing("initializeInitialConditions throws 7"),
              "block m/bad\n[InitializeInitialConditions]" + block +
                  "initializeInitialConditions: threw an exception of unknown type\n\nfailed\n");
    const auto ends = [](const std::string& text, const std::string& end) { return text.ends_with(end); };
    EXPECT_TRUE(
        ends(failing("output returns false"), "[Output]" + block + "output: refused on purpose\n\nfailed\n"));
    EXPECT_TRUE(ends(failing("updateDiscreteState throws"),
                     "[Update]" + block +
                         "updateDiscreteState: threw an exception: thrown on purpose {0}\n\nfailed\n"));
    EXPECT_TRUE(ends(failing("terminate returns false"),
                     "[Terminate]" + block + "terminate: refused on purpose\n\nfailed\n"));
}

} // namespace
} // namespace generated_code

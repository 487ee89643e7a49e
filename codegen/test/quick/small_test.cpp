// Generated code of few models beside the engine, within seconds; that of all is compared by the other
// program.
#include "../c_models.hpp"
#include "../compare.hpp"
#include "../folder.hpp"
#include "../write_models.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <set>
#include <tuple>

namespace bf::codegen::test {
namespace {

/// One of each kind: rates, conditions, solvers, events, loops, charts, tables, names, failures, functions
/// that are split.
std::vector<Case> small_cases() {
    std::set<std::string> names{"chain_30",
                                "multirate",
                                "enabled_reset",
                                "rk4_held",
                                "class",
                                "becomes_nan",
                                "triggered_rising",
                                "reset_either",
                                "actions",
                                "loops_reset",
                                "crossings_rk4_reset",
                                "crossing_and_either",
                                "infinite",
                                "tables",
                                "charts",
                                "endless",
                                "three_rates",
                                "functions"};
    std::vector<Case> cases;
    for (auto* make : {structure_cases, control_cases, rate_cases})
        for (auto& one : make())
            if (names.erase(one.elaborated.diagram.name) > 0) cases.push_back(std::move(one));
    EXPECT_EQ(names, std::set<std::string>());
    cases.push_back({Elaborated(formats::read_yaml_text(calling, "m.yaml")), 20});
    // Conversions that overflow sooner or later: of real and of whole numbers, and to narrower real ones.
    for (const auto& [name, input, type] : {std::tuple{"real_overflows", "{}", "int8"},
                                            {"whole_overflows", "{type: int16}", "uint8"},
                                            {"width_overflows", "{}", "single"}})
        cases.push_back({Elaborated(formats::read_yaml_text(
                             "model: " + std::string(name) + "\nstep: 0.1\ninputs: {u: " + input +
                                 "}\nblocks:\n  big: {block: Gain, K: " +
                                 (std::string(type) == "single" ? "2e38" : "50") +
                                 "}\n  c: {block: Convert, on_overflow: error, type: " + type +
                                 "}\nconnections: {u: big, big: c}\n",
                             "m.yaml")),
                         20});
    return cases;
}

int system_in(const fs::path& folder, const std::string& command) {
    return std::system(("cd " + folder.string() + " && " + command).c_str());
}

TEST(GeneratedCode, EqualsTheEngineForAModelOfEachKind) {
    const Folder folder("small");
    write_models({small_cases}, folder.path, 1);
    std::set<std::string> not_in_c;
    for (const auto& one : small_cases())
        if (!is_c_case(one)) not_in_c.insert(one.elaborated.diagram.name);
    EXPECT_EQ(not_in_c, std::set<std::string>()) << "the others are compared in C, too";
    const std::string places = " -I" BF_SOURCE_DIRECTORY "/codegen/test -I. -Iinclude ";
    ASSERT_EQ(system_in(folder.path, BF_CXX " -std=c++17 -O0 -ffp-contract=off" + places +
                                         "part_0.cpp driver.cpp -o driver"),
              0);
    ASSERT_EQ(
        system_in(folder.path, BF_CC " -std=c11 -O0 -ffp-contract=off -Wall -Wextra -Wconversion -Werror" +
                                   places + "c_part_0.c c_part_1.c c_driver.c -lm -o c_driver"),
        0);
    const auto recordings =
        compare_all(small_cases(), {folder.path / "driver", folder.path / "c_driver", "", BF_TEST_PLUGINS});
    EXPECT_EQ(recordings.at("library").failure, "");
    for (const char* name : {"real_overflows", "whole_overflows", "width_overflows"})
        EXPECT_TRUE(recordings.at(name).failure.starts_with("c: "))
            << name << ": " << recordings.at(name).failure;
}

} // namespace
} // namespace bf::codegen::test

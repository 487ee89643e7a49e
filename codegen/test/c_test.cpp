// Generated C: which models it is for, and the rules of MISRA C:2012 that it keeps. That it computes what the
// engine computes is a part of the comparison of all cases.
#include "c_models.hpp"
#include "folder.hpp"

#include <cstdlib>
#include <gtest/gtest.h>
#include <regex>
#include <set>

namespace bf::codegen::test {
namespace {

TEST(GeneratedC, IsWrittenForMostOfTheCases) {
    std::size_t all = 0, in_c = 0;
    for (auto* make : families())
        for (const auto& one : make()) {
            ++all;
            in_c += is_c_case(one);
        }
    EXPECT_GT(5 * in_c, 4 * all) << in_c << " of " << all;
}

/// The deviations that docs/how-to/generate_code.md lists, each with its reason.
const std::set<std::string> deviations{"2.4", "2.5", "5.7", "8.7", "8.9", "12.1", "15.5"};

TEST(GeneratedC, KeepsTheRulesOfMisraButForTheDeviationsOfTheDocs) {
    if (std::system("command -v cppcheck >/dev/null") != 0) GTEST_SKIP() << "cppcheck is not installed";
    const Folder folder("misra");
    std::string files;
    const auto add = [&](const Case& one) {
        if (!is_c_case(one)) return;
        const std::string name = file_name(one.elaborated.diagram);
        for (const auto& [file, text] : c_files(one))
            if (file.starts_with(name + ".")) write_text(folder.path / file, text);
        files += " " + name + ".c";
    };
    for (const auto& one : example_cases()) add(one);
    for (const auto& one : control_cases()) add(one);
    write_text(folder.path / "m.c", in_c(motor).at("m.c"));
    write_text(folder.path / "m.h", in_c(motor).at("m.h"));
    write_text(folder.path / "library.c", in_c(calling).at("library.c"));
    write_text(folder.path / "library.h", in_c(calling).at("library.h"));
    ASSERT_EQ(
        std::system(("cd " + folder.path.string() +
                     " && cppcheck --addon=misra --std=c11 --enable=warning,style,portability,performance "
                     "--suppress=missingIncludeSystem -q m.c library.c" +
                     files + " 2>report.txt")
                        .c_str()),
        0);
    const std::string report = read_text(folder.path / "report.txt");
    const std::regex remark(R"(\n?([^\n]*): [^\n]*\[([\w.-]+)\]\n)");
    for (std::sregex_iterator at(report.begin(), report.end(), remark), end; at != end; ++at) {
        const std::string id = (*at)[2];
        const std::string rule = id.starts_with("misra-c2012-") ? id.substr(12) : id;
        EXPECT_TRUE(deviations.contains(rule)) << (*at)[0];
    }
    EXPECT_NE(report.find("misra-c2012-15.5"), std::string::npos) << "the addon did not run: " << report;
}

} // namespace
} // namespace bf::codegen::test

#include "bf/fmi/archive.hpp"
#include "bf/fmi/check.hpp"

#include <fstream>
#include <gtest/gtest.h>

namespace bf::fmi::test {
namespace {

namespace fs = std::filesystem;

class Terminals : public ::testing::Test {
  protected:
    Terminals() {
        d_.variables = {{"u"}, {"flow.in"}, {"flow.out"}};
        fs::create_directories(folder_.path() / "terminalsAndIcons");
        write("icon.png", "");
    }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_.path() / "terminalsAndIcons" / name, std::ios::binary) << text;
    }
    static std::string member(const std::string& attributes) {
        return "<TerminalMemberVariable variableKind=\"signal\" " + attributes + "/>";
    }
    /// All of it, with `inside` in one terminal.
    static std::string document(const std::string& inside, const std::string& rule = "bus") {
        return "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><GraphicalRepresentation><Icon/>"
               "</GraphicalRepresentation><Terminals><Terminal name=\"t\" matchingRule=\"" +
               rule + "\">" + inside + "</Terminal></Terminals></fmiTerminalsAndIcons>";
    }
    std::string problems(const std::string& xml) const {
        write("terminalsAndIcons.xml", xml);
        std::string all;
        for (const auto& problem : problems_of_terminals(folder_.path(), "x.fmu", d_)) {
            const std::string where = "x.fmu: terminalsAndIcons/terminalsAndIcons.xml:1: ",
                              rule = " (FMI 3.0, section 2.4.9)";
            EXPECT_TRUE(problem.starts_with(where)) << problem;
            EXPECT_TRUE(problem.ends_with(rule)) << problem;
            all += (all.empty() ? "" : "; ") +
                   problem.substr(where.size(), problem.size() - where.size() - rule.size());
        }
        return all;
    }
    Description d_;
    const TemporaryFolder folder_{"terminals_test"};
};

TEST_F(Terminals, OfVariablesThatThereAreWithTheirPicturesAreRight) {
    write("plug.png", "");
    EXPECT_EQ(problems(document(member("variableName=\"u\" memberName=\"a\"") +
                                "<TerminalStreamMemberVariable inStreamMemberName=\"i\" "
                                "outStreamMemberName=\"o\" inStreamVariableName=\"flow.in\" "
                                "outStreamVariableName=\"flow.out\"/>"
                                "<Terminal name=\"t\" matchingRule=\"none\"/>"
                                "<TerminalGraphicalRepresentation iconBaseName=\"plug\"/>")),
              "");
    EXPECT_EQ(problems(document(member("variableName=\"u\""), "sequence")), "");
}

TEST_F(Terminals, AreWrongWithUnknownVariablesAmbiguousNamesAndMissingPictures) {
    EXPECT_EQ(problems(document(member("variableName=\"v\" memberName=\"a\""))),
              "the terminal 't' has the variable 'v', which the FMU has not");
    EXPECT_EQ(problems(document(member("variableName=\"u\""), "plug")),
              "a member of the terminal 't' has no 'memberName', by which terminals of the rule 'plug' are "
              "matched");
    const std::string one = member("variableName=\"u\" memberName=\"a\"");
    EXPECT_EQ(problems(document(one + one)), "two members of the terminal 't' are called 'a'");
    const std::string inner = "<Terminal name=\"i\" matchingRule=\"bus\"/>";
    EXPECT_EQ(problems(document(inner + inner)), "two terminals are called 't.i'");
    EXPECT_EQ(problems(document("<TerminalGraphicalRepresentation iconBaseName=\"../icon\"/>")),
              "there is no picture 'terminalsAndIcons/../icon.png' beside it");
    EXPECT_EQ(problems(document("<Terminal name=\"i\"/>")), "<Terminal> lacks its attribute 'matchingRule'");
    EXPECT_EQ(problems("<other/>"), "its root is no <fmiTerminalsAndIcons>");
    fs::remove(folder_.path() / "terminalsAndIcons" / "icon.png");
    EXPECT_EQ(problems(document(one)), "there is no picture 'terminalsAndIcons/icon.png' beside it");
}

TEST_F(Terminals, ThatStandTooDeepAndNoXmlAreOneProblem) {
    std::string begin, end;
    for (int i = 0; i < 150; ++i) {
        begin += "<Terminal name=\"s\" matchingRule=\"bus\">";
        end += "</Terminal>";
    }
    write("terminalsAndIcons.xml", document(begin + end));
    const auto deep = problems_of_terminals(folder_.path(), "x.fmu", d_);
    ASSERT_EQ(deep.size(), 1u);
    EXPECT_EQ(deep[0],
              "x.fmu: terminalsAndIcons/terminalsAndIcons.xml:1: terminals stand too deep in each other");
    write("terminalsAndIcons.xml", "<fmiTerminalsAndIcons");
    EXPECT_EQ(problems_of_terminals(folder_.path(), "x.fmu", d_).size(), 1u);
    fs::remove(folder_.path() / "terminalsAndIcons" / "terminalsAndIcons.xml");
    EXPECT_TRUE(problems_of_terminals(folder_.path(), "x.fmu", d_).empty()) << "it is optional";
}

} // namespace
} // namespace bf::fmi::test

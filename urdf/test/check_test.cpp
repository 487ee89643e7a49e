// Descriptions that say what no robot is are refused by name; sloppy but harmless ones are not.
#include "bf/urdf/check.hpp"

#include <gtest/gtest.h>
#include <stdexcept>
#include <string>

namespace bf {
namespace {

const std::string robot = R"(<robot name="r">
<link name="a"/>
<link name="b"><inertial><mass value="1.5"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual><origin xyz="0 0 1" rpy="0 0 0"/></visual></link>
<link name="c"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="10" velocity="10"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/><mimic joint="j" multiplier="2"/></joint>
</robot>)";

/// "", or what is wrong with the robot after `from` became `to`.
std::string wrong(const std::string& from, const std::string& to) {
    std::string text = robot;
    text.replace(text.find(from), from.size(), to);
    try {
        check_urdf(text, "r.urdf");
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(UrdfCheck, NamesFileLineLinkAttributeValueAndRemedy) {
    EXPECT_EQ(wrong("1.5", "1,5"),
              "'r.urdf', line 3: link 'b', <mass value=\"1,5\">: '1,5' is no number that "
              "fits; write digits with a point, e.g. 1.5 or 2e-3");
    EXPECT_EQ(wrong("1.5", "-1"),
              "'r.urdf', line 3: link 'b', <mass value=\"-1\">: it is negative; give 0 or more");
    EXPECT_EQ(wrong("1.5", ""), "'r.urdf', line 3: link 'b', <mass value=\"\">: it has 0 numbers; give 1");
    EXPECT_EQ(wrong(" value=\"1.5\"", ""),
              "'r.urdf', line 3: link 'b', <mass value=\"\">: it is missing; give the mass in kg");
    EXPECT_EQ(wrong("0 1 0", "0 0 0"), "'r.urdf', line 7: joint 'j', <axis xyz=\"0 0 0\">: an axis has a "
                                       "direction; give one, e.g. 0 0 1");
    EXPECT_EQ(wrong("lower=\"-3\"", "lower=\"4\""),
              "'r.urdf', line 8: joint 'j', <limit lower=\"4\">: it is above the upper limit, '3'; exchange "
              "them");
    EXPECT_EQ(
        wrong("lower=\"-3\"", "lower=\"3\""),
        "'r.urdf', line 8: joint 'j', <limit lower=\"3\">: it is the upper limit, too, which leaves the "
        "joint no way; make it fixed with this angle or length in its origin, or give it a range; 0 for "
        "both stands for no limits");
    EXPECT_EQ(wrong("lower=\"-3\" upper=\"3\"", "lower=\"0\" upper=\"0\""), "") << "as exporters write it";
}

TEST(UrdfCheck, RefusesNumbersTypesAndNamesThatNoRobotHas) {
    EXPECT_EQ(wrong("effort=\"10\"", "effort=\"-10\""),
              "'r.urdf', line 8: joint 'j', <limit effort=\"-10\">: it is negative; give 0 or more");
    EXPECT_EQ(wrong("0 1 0", "1e308 0 0"), "'r.urdf', line 7: joint 'j', <axis xyz=\"1e308 0 0\">: it is too "
                                           "large; give numbers from -1e10 to 1e10");
    EXPECT_EQ(
        wrong("continuous", "ball"),
        "'r.urdf', line 9: joint 'k', <joint type=\"ball\">: a joint is revolute, continuous, prismatic, "
        "fixed, floating or planar; choose one of them");
    EXPECT_EQ(
        wrong("<link name=\"c\"", "<link name=\"a\""),
        "'r.urdf', line 6: link 'a', <link name=\"a\">: another link has this name; rename one of them");
    EXPECT_EQ(wrong("name=\"k\"", "name=\"j\""),
              "'r.urdf', line 9: joint 'j', <joint name=\"j\">: another joint has this name; rename one of "
              "them");
}

TEST(UrdfCheck, RefusesWhatIsNoFiniteNumber) {
    for (const auto* text : {"1kg", "nan", "1e400", "0x10", "1d2", "1 2", "inf", "--1"})
        EXPECT_NE(wrong("1.5", text), "") << text;
    for (const auto* text : {"ixx=\"-1\"", "ixx=\"nan\""}) EXPECT_NE(wrong("ixx=\"1\"", text), "") << text;
    EXPECT_NE(wrong("0 0 1", "0 0"), "");
    EXPECT_NE(wrong("0 1 0", "0 1,0 0"), "");
    EXPECT_NE(wrong("multiplier=\"2\"", "multiplier=\"x\""), "");
}

TEST(UrdfCheck, RefusesJointsThatFormNoTree) {
    EXPECT_EQ(
        wrong("child link=\"b\"", "child link=\"a\""),
        "'r.urdf', line 7: joint 'j', <child link=\"a\">: it is the parent of this joint, too; give two "
        "links");
    EXPECT_EQ(
        wrong("<parent link=\"b\"/><child link=\"c\"/>", "<parent link=\"a\"/><child link=\"b\"/>"),
        "'r.urdf', line 9: joint 'k', <child link=\"b\">: it is the child of the joint 'j' already; the "
        "joints of a robot form a tree: leave one of them out");
    EXPECT_EQ(wrong("parent link=\"a\"", "parent link=\"c\""),
              "'r.urdf', line 7: joint 'j', <parent link=\"c\">: it hangs on this joint's own child, in a "
              "loop; the "
              "joints of a robot form a tree: leave one of them out");
    EXPECT_EQ(
        wrong("mimic joint=\"j\"", "mimic joint=\"k\""),
        "'r.urdf', line 9: joint 'k', <mimic joint=\"k\">: a joint cannot mimic itself; name another one");
}

TEST(UrdfCheck, RefusesWhatFollowsTheRobot) {
    const std::string refused = "'r.urdf', line 11: a file describes one robot; remove what follows </robot>";
    EXPECT_EQ(wrong("</robot>", "</robot>\n" + robot), refused);
    EXPECT_EQ(wrong("</robot>", "</robot>\n<!-- made by hand -->\n"), "");
}

TEST(UrdfCheck, RefusesMoreLinksThanARobotHas) {
    std::string links;
    for (int i = 0; i < 997; ++i) links += "<link name=\"l" + std::to_string(i) + "\"/>";
    EXPECT_EQ(wrong("<link name=\"a\"/>", "<link name=\"a\"/>" + links), "");
    EXPECT_EQ(
        wrong("<link name=\"a\"/>", "<link name=\"a\"/><link name=\"m\"/>" + links),
        "'r.urdf' has 1001 links; a robot has at most 1000: join those that fixed joints hold together");
}

TEST(UrdfCheck, TakesWhatExportersWrite) {
    EXPECT_EQ(wrong("1.5", "0"), "");
    EXPECT_EQ(wrong("1.5", " +1.5E0 "), "");
    EXPECT_EQ(wrong("<axis xyz=\"0 1 0\"/>", ""), "");
    EXPECT_EQ(wrong("ixx=\"1\"", "ixx=\"-5.42101e-20\""), "");
    EXPECT_EQ(wrong("mimic joint=\"j\"", "mimic joint=\"of_the_other_hand\""), "");
    EXPECT_EQ(wrong("effort=\"10\"", "effort=\"inf\""), "");
    EXPECT_EQ(wrong("lower=\"-3\" upper=\"3\"", ""), "");
    EXPECT_EQ(wrong("type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 1 0\"/>\n<limit "
                    "lower=\"-3\"",
                    "type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 0 0\"/>\n<limit "
                    "lower=\"4\""),
              "");
    EXPECT_EQ(wrong("</robot>", ""), "") << "left to whoever reads it";
}

} // namespace
} // namespace bf

#include "robots.hpp"

#include "bf/dynamics/find_urdf.hpp"

#include <gtest/gtest.h>
#include <iDynTree/Model.h>
#include <iDynTree/ModelLoader.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

namespace bf::dynamics::test {
namespace {

namespace fs = std::filesystem;

template <class Action> std::string error_of(Action&& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "no error";
}

void expect_parts(const std::string& text, std::initializer_list<std::string> parts) {
    for (const std::string& part : parts) {
        EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is missing in: " << text;
    }
}

class Files : public testing::Test {
  protected:
    Files() { fs::create_directories(folder); }
    ~Files() override { fs::remove_all(folder); }

    fs::path write(const fs::path& name, const std::string& text) {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name) << text;
        return folder / name;
    }

    fs::path folder =
        fs::temp_directory_path() /
        (std::string("bf_dynamics_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& limit = "") {
    return "<joint type='" + type + "' name=\"" + name + "\"><parent link='" + parent + "'/><child link='" +
           child + "'/><axis xyz='0 0 1'/>" + limit + "</joint>\n";
}

const std::string body = "<inertial><mass value='1'/>"
                         "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>";

/// Joints in the order z, a, m of every movable type, one fixed, one planar.
const std::string assorted =
    "<robot name='assorted'><transmission name='t'><joint name='m'/></transmission>"
    "<link name='l0'>" +
    body + "</link><link name='l1'>" + body + "</link><link name='l2'>" + body + "</link><link name='l3'>" +
    body + "</link><link name='l4'/><link name='l5'>" + body + "</link>\n" +
    joint("z", "revolute", "l0", "l1", "<limit lower='-1' upper='2' velocity='3' effort='4'/>") +
    joint("a", "continuous", "l1", "l2") +
    joint("m", "prismatic", "l2", "l3", "<limit lower='0' upper='0.5' velocity='0.1' effort='7'/>") +
    joint("glue", "fixed", "l3", "l4") + joint("table", "planar", "l0", "l5") + "</robot>";

} // namespace

TEST(Model, KeepsTheListedJointsInTheListedOrder) {
    const Model model = Model::load(icub, icub_joints);
    EXPECT_EQ(model.joint_names(), icub_joints);
    EXPECT_EQ(model.joints(), 23);
    EXPECT_EQ(model.velocities(), 29);
    EXPECT_EQ(model.base_link(), "root_link");
    EXPECT_NEAR(model.total_mass(), 33.061673, 1e-6);
    EXPECT_EQ(model.gravity(), Eigen::Vector3d(0.0, 0.0, -9.81));
}

TEST(Model, KnowsTheLinksBehindFixedAndLockedJoints) {
    const Model model = Model::load(icub, {"l_knee"});
    EXPECT_TRUE(model.has_frame("l_sole"));
    EXPECT_TRUE(model.has_frame("head"));
    EXPECT_FALSE(model.has_frame("com"));
    EXPECT_FALSE(model.has_frame("l_knee"));
    EXPECT_EQ(model.frame_names()[static_cast<std::size_t>(model.frame("l_sole").index)], "l_sole");
    EXPECT_EQ(model.frame_names().size(), 213u);
    iDynTree::ModelLoader loader;
    ASSERT_TRUE(loader.loadModelFromFile(icub));
    for (const std::string& name : model.frame_names())
        EXPECT_TRUE(loader.model().isFrameNameUsed(name)) << name;
}

TEST(Model, ReadsTheLimitsThatIDynTreeReads) {
    const Model model = Model::load(icub);
    EXPECT_EQ(model.joints(), 32);
    iDynTree::ModelLoader loader;
    ASSERT_TRUE(loader.loadModelFromFile(icub));
    for (int i = 0; i < model.joints(); ++i) {
        const iDynTree::Model& other = loader.model();
        const auto* joint =
            other.getJoint(other.getJointIndex(model.joint_names()[static_cast<std::size_t>(i)]));
        EXPECT_EQ(model.position_min()[i], joint->getMinPosLimit(0));
        EXPECT_EQ(model.position_max()[i], joint->getMaxPosLimit(0));
    }
    EXPECT_EQ(model.effort_max().size(), 32);
}

TEST_F(Files, EmptyListOfJointsKeepsTheOrderOfTheFile) {
    std::string text = assorted;
    text.replace(text.find("planar"), 6, "fixed");
    const Model model = Model::load(write("robot.urdf", text));
    EXPECT_EQ(model.joint_names(), (std::vector<std::string>{"z", "a", "m"}));
    EXPECT_EQ(model.base_link(), "l0");
}

TEST_F(Files, LimitsAreInfiniteWhereTheUrdfGivesNone) {
    const Model model = Model::load(write("robot.urdf", assorted), {"a", "m", "z"});
    EXPECT_EQ(model.position_min(), Eigen::Vector3d(-infinity, 0.0, -1.0));
    EXPECT_EQ(model.position_max(), Eigen::Vector3d(infinity, 0.5, 2.0));
    EXPECT_EQ(model.velocity_max(), Eigen::Vector3d(infinity, 0.1, 3.0));
    EXPECT_EQ(model.effort_max(), Eigen::Vector3d(infinity, 7.0, 4.0));
}

TEST_F(Files, ZerosThatExportersWriteAreNoLimits) {
    std::string text = assorted;
    text.replace(text.find("lower='-1' upper='2' velocity='3' effort='4'"), 44, "velocity='0' effort='0'");
    const Model model = Model::load(write("robot.urdf", text), {"z"});
    EXPECT_EQ(model.position_max()[0], infinity);
    EXPECT_EQ(model.position_min()[0], -infinity);
    EXPECT_EQ(model.velocity_max()[0], infinity);
    EXPECT_EQ(model.effort_max()[0], infinity);
}

TEST_F(Files, JointAndLinkMayHaveOneName) {
    const std::string text = "<robot name='r'><link name='l0'>" + body + "</link><link name='z'>" + body +
                             "</link><link name='root_joint'/>" + joint("z", "continuous", "l0", "z") +
                             joint("root_joint", "fixed", "z", "root_joint") + "</robot>";
    const Model model = Model::load(write("robot.urdf", text));
    EXPECT_EQ(model.joint_names(), std::vector<std::string>{"z"});
    EXPECT_EQ(model.frame_names(), (std::vector<std::string>{"l0", "z", "root_joint"}));
    EXPECT_EQ(Model::load(write("robot.urdf", text), {"z"}).total_mass(), 2.0);
}

TEST_F(Files, MimickingJointsFollowUnlessTheyAreListed) {
    const auto mimic = [](const std::string& leader, const std::string& multiplier,
                          const std::string& offset) {
        return "<mimic joint='" + leader + "' multiplier='" + multiplier + "' offset='" + offset + "'/>";
    };
    const std::string text =
        "<robot name='r'><link name='l0'>" + body + "</link><link name='l1'>" + body +
        "</link><link name='l2'>" + body + "</link><link name='l3'>" + body + "</link>" +
        joint("a", "continuous", "l0", "l1") + joint("b", "continuous", "l1", "l2", mimic("a", "-2", "0.3")) +
        joint("c", "prismatic", "l2", "l3",
              "<limit lower='-1' upper='1' effort='9' velocity='9'/>" + mimic("b", "3", "0.1")) +
        "</robot>";
    const fs::path path = write("robot.urdf", text);
    const auto followers = [&](const std::vector<std::string>& listed) {
        const Model model = Model::load(path, listed);
        std::string found;
        for (const Follower& f : model.followers())
            found += f.joint + "=" + std::to_string(f.multiplier) + "*" + f.leader + "+" +
                     std::to_string(f.offset) + " ";
        return found;
    };
    EXPECT_EQ(Model::load(path).joint_names(), std::vector<std::string>{"a"});
    EXPECT_EQ(followers({}), "b=-2.000000*a+0.300000 c=-6.000000*a+1.000000 ");
    EXPECT_EQ(followers({"a", "b"}), "c=3.000000*b+0.100000 ");
    EXPECT_EQ(followers({"a", "b", "c"}), "");
    EXPECT_EQ(followers({"c"}), "b=-2.000000*+0.300000 ");
    std::string circle = text;
    circle.replace(circle.find("<mimic joint='a'"), 16, "<mimic joint='c'");
    expect_parts(error_of([&] { Model::load(write("circle.urdf", circle), {"a"}); }),
                 {"joint 'b'", "mimics itself through others; list one of them"});
}

TEST_F(Files, UnknownBaseLinkListsSimilarOnes) {
    const fs::path path = write("robot.urdf", assorted);
    expect_parts(error_of([&] {
                     Model::load(path, {"z"}, {0, 0, -9.81}, "l33");
                 }),
                 {"base link 'l33' is not a link of", "most similar: 'l3'"});
}

TEST_F(Files, WrongJointsAreNamedWithTheRemedy) {
    const fs::path path = write("robot.urdf", assorted);
    const auto load = [&](const std::vector<std::string>& joints) {
        return error_of([&] { Model::load(path, joints); });
    };
    EXPECT_EQ(load({"z", "glue"}), "joint 'glue' of '" + path.string() +
                                       "' is fixed and has no position; remove it from the list of joints");
    EXPECT_EQ(load({"z", "a", "z"}),
              "joint 'z' of '" + path.string() + "' is listed twice; list every joint once");
    EXPECT_EQ(load({"zz"}),
              "joint 'zz' of '" + path.string() + "' does not exist; most similar: 'z', 'a', 'm'");
    expect_parts(load({"table"}),
                 {"joint 'table' of '" + path.string() + "' has more than one degree of freedom"});
    expect_parts(load({}), {"'table'"});
}

TEST_F(Files, UnreadableFilesAreNamed) {
    EXPECT_EQ(error_of([&] { Model::load(folder / "none.urdf"); }),
              "URDF file '" + (folder / "none.urdf").string() +
                  "' cannot be read: No such file or directory; check the path, or look the robot up with "
                  "find_urdf");
    expect_parts(error_of([&] { Model::load(folder); }), {"cannot be read"});
}

TEST_F(Files, InvalidUrdfIsRejectedWithTheParsersReasonAndNothingIsPrinted) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    const fs::path garbage = write("garbage.urdf", "this is no XML");
    expect_parts(error_of([&] { Model::load(garbage); }),
                 {"'" + garbage.string() + "' is not a valid URDF: ", "one <robot>"});
    const fs::path orphan = write("orphan.urdf", "<robot name='r'><link name='a'/>" +
                                                     joint("j", "continuous", "a", "nowhere") + "</robot>");
    expect_parts(error_of([&] { Model::load(orphan); }), {"nowhere"});
    expect_parts(error_of([&] { Model::load(write("empty.urdf", "")); }), {"is not a valid URDF"});
    expect_parts(error_of([&] { Model::load(write("bare.urdf", "<robot name='r'/>")); }),
                 {"is not a valid URDF"});
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST_F(Files, ThreadsThatLoadAtTheSameTimeGetTheirOwnErrors) {
    const auto load = [&](const std::string& name) {
        const fs::path path = write(name + ".urdf", "<robot name='r'><link name='a'/>" +
                                                        joint("j", "continuous", "a", name) + "</robot>");
        for (int i = 0; i < 500; ++i) {
            const std::string error = error_of([&] { Model::load(path); });
            expect_parts(error, {"is not a valid URDF", "child link [" + name + "]"});
        }
    };
    std::thread other([&] { load("lost"); });
    load("gone");
    other.join();
}

TEST(Model, UnknownFrameListsSimilarOnes) {
    const Model model = Model::load(icub, {"l_knee"});
    expect_parts(error_of([&] { model.frame("l_sol"); }),
                 {"frame 'l_sol' is not a link of robot 'iCub'; most similar: 'l_sole'"});
}

TEST(FindUrdf, FindsRobotsOfTheModelsPackageByName) {
    EXPECT_EQ(find_urdf("iCubGazeboV2_5", {BF_SHARE}), fs::path(icub));
    EXPECT_EQ(find_urdf("iCubGazeboV2_5/model.urdf", {fs::path(BF_SHARE) / "iCub/robots"}), fs::path(icub));
    EXPECT_EQ(find_urdf("package://iCub/robots/iCubGazeboV2_5/model.urdf", {BF_SHARE}), fs::path(icub));
    EXPECT_EQ(find_urdf("model://iCub/robots/iCubGazeboV2_5/model.urdf", {fs::path(BF_SHARE) / "iCub"}),
              fs::path(icub));
    EXPECT_EQ(find_urdf(icub), fs::path(icub));
}

TEST_F(Files, SearchTakesExplicitFoldersBeforeTheEnvironment) {
    const fs::path first = write("one/arm.urdf", "x"), second = write("two/share/arm/arm.urdf", "y");
    const std::string environment = (folder / "none").string() + "::" + (folder / "two").string();
    ASSERT_EQ(setenv("ROS_PACKAGE_PATH", environment.c_str(), 1), 0);
    EXPECT_EQ(find_urdf("arm", {folder / "one"}), first);
    EXPECT_EQ(find_urdf("arm"), second);
    EXPECT_EQ(find_urdf("package://arm/arm.urdf"), second);
    unsetenv("ROS_PACKAGE_PATH");
}

TEST_F(Files, FailedSearchListsWhereItLooked) {
    expect_parts(
        error_of([&] {
            find_urdf("nobody", {folder, "/nowhere"});
        }),
        {"robot description 'nobody' was not found; searched in:\n  " + folder.string() + "\n  /nowhere",
         "ROS_PACKAGE_PATH"});
    EXPECT_EQ(
        error_of([&] { find_urdf("/nowhere/robot.urdf"); }),
        "robot description '/nowhere/robot.urdf' cannot be read: No such file or directory; check the path");
}

} // namespace bf::dynamics::test

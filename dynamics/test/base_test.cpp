// Bases that are fixed or another link, and joints that follow others: each is a linear map of the velocities
// of the floating robot whose joints are all independent, which other tests compare with iDynTree.
#include "robots.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace bf::dynamics::test {
namespace {

void expect_close(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const char* what) {
    ASSERT_EQ(a.rows(), b.rows()) << what;
    ASSERT_EQ(a.cols(), b.cols()) << what;
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-10) << what;
}

const Eigen::Vector3d tilted(0.3, -0.2, -9.7);

} // namespace

TEST(FixedBase, LeavesOutWhatBelongsToTheVelocityOfTheBase) {
    std::mt19937 random(1);
    const Model floating = Model::load(icub, icub_joints, tilted);
    const Model fixed = Model::load(icub, icub_joints, tilted, {}, false);
    const int n = floating.joints();
    EXPECT_FALSE(fixed.has_floating_base());
    EXPECT_EQ(fixed.velocities(), n);
    State state = random_state(n, random);
    state.nu_base.setZero();
    Data a(floating), b(fixed);
    set(floating, a, state);
    set(fixed, b, state);
    const Frame frame = floating.frame("l_hand"), reference = floating.frame("chest");
    Eigen::VectorXd nu_dot = Eigen::VectorXd::Zero(6 + n);
    nu_dot.tail(n) = random_vector(n, random);
    Quantities all(floating), joints(fixed);
    all.compute(floating, a, frame, reference, nu_dot);
    joints.compute(fixed, b, frame, reference, nu_dot);
    EXPECT_EQ(joints.M, all.M.bottomRightCorner(n, n));
    EXPECT_EQ(joints.h, all.h.tail(n));
    expect_close(joints.g, all.g.tail(n), "g");
    expect_close(joints.tau, all.tau.tail(n), "tau");
    EXPECT_EQ(joints.C, all.C.bottomRightCorner(n, n));
    EXPECT_EQ(joints.M_dot, all.M_dot.bottomRightCorner(n, n));
    EXPECT_EQ(joints.push, all.push.tail(n));
    EXPECT_EQ(joints.A_dot_nu, all.A_dot_nu);
    expect_close(joints.c, all.c.tail(n), "c");
    expect_close(joints.M * joints.nu_dot + joints.h, nu_dot.tail(n), "forward dynamics");
    EXPECT_EQ(joints.J, all.J.rightCols(n));
    EXPECT_EQ(joints.A, all.A.rightCols(n));
    EXPECT_EQ(joints.com_J, all.com_J.rightCols(n));
    EXPECT_EQ(joints.com, all.com);
    EXPECT_EQ(joints.w_H_f, all.w_H_f);
    EXPECT_EQ(joints.J_dot_nu, all.J_dot_nu);
    EXPECT_EQ(joints.relative_J, all.relative_J);
}

/// nu of another base is X nu of the root with X = [J of that link; 0 1]. The same motion needs the
/// generalised forces tau = X' tau_of_the_other.
TEST(BaseLink, DescribesTheSameMotionFromAnotherLink) {
    std::mt19937 random(2);
    const Model rooted = Model::load(icub, icub_joints, tilted);
    const Model other = Model::load(icub, icub_joints, tilted, "l_sole");
    EXPECT_EQ(other.base_link(), "l_sole");
    EXPECT_EQ(other.frame_names().size(), rooted.frame_names().size());
    EXPECT_NEAR(other.total_mass(), rooted.total_mass(), 1e-12);
    const int n = rooted.joints();
    const State state = random_state(n, random);
    const Eigen::VectorXd nu_dot = random_vector(6 + n, random);
    Data a(rooted), b(other);
    set(rooted, a, state);
    Eigen::MatrixXd X = Eigen::MatrixXd::Identity(6 + n, 6 + n);
    Quantities from_root(rooted), from_other(other);
    from_root.compute(rooted, a, rooted.frame("l_sole"), rooted.frame("chest"), nu_dot);
    X.topRows<6>() = from_root.J;
    State seen = state;
    seen.w_H_b = from_root.w_H_f;
    seen.nu_base = from_root.J * state.nu();
    set(other, b, seen);
    Eigen::VectorXd seen_dot = X * nu_dot;
    seen_dot.head<6>() += from_root.J_dot_nu;

    from_root.compute(rooted, a, rooted.frame("r_hand"), rooted.frame("chest"), nu_dot);
    from_other.compute(other, b, other.frame("r_hand"), other.frame("chest"), seen_dot);
    expect_close(from_other.w_H_f, from_root.w_H_f, "pose");
    expect_close(from_other.com, from_root.com, "com");
    expect_close(from_other.J * X, from_root.J, "J");
    expect_close(from_other.J * seen_dot + from_other.J_dot_nu, from_root.J * nu_dot + from_root.J_dot_nu,
                 "acceleration");
    expect_close(X.transpose() * from_other.M * X, from_root.M, "M");
    expect_close(X.transpose() * from_other.tau, from_root.tau, "tau");
    expect_close(X.transpose() * from_other.g, from_root.g, "g");
    expect_close(from_other.H, from_root.H, "momentum");
    expect_close(from_other.relative_J, from_root.relative_J, "relative J");
}

/// With s_wide = G s + c of the robot whose joints are all listed: M = G' M_wide G, J = J_wide G, h = G'
/// h_wide.
TEST(Followers, AreFoldedIntoTheirLeaders) {
    std::ifstream file(icub);
    std::string text((std::istreambuf_iterator<char>(file)), {});
    const auto mimic = [&](const std::string& joint, const std::string& leader, const char* numbers) {
        const std::string name = "<joint name=\"" + joint + "\"";
        const std::size_t end = text.find("</joint>", text.find(name));
        ASSERT_NE(text.find(name), std::string::npos) << joint;
        text.insert(end, "<mimic joint='" + leader + "' " + numbers + "/>");
    };
    mimic("l_elbow", "r_knee", "multiplier='-0.7' offset='0.2'"); // on another limb, after its leader's
    mimic("torso_roll", "l_knee", "multiplier='0.4' offset='-0.1'");
    mimic("l_hip_yaw", "l_knee", "multiplier='1.5' offset='0'"); // above its leader
    const auto path =
        std::filesystem::temp_directory_path() / ("bf_followers_" + std::to_string(getpid()) + ".urdf");
    std::ofstream(path) << text;

    std::vector<std::string> listed;
    for (const std::string& name : icub_joints)
        if (name != "l_elbow" && name != "torso_roll" && name != "l_hip_yaw") listed.push_back(name);
    std::vector<std::string> wide_names = listed;
    wide_names.insert(wide_names.end(), {"l_elbow", "torso_roll", "l_hip_yaw"});
    const Model folded = Model::load(path, listed, tilted), wide = Model::load(path, wide_names, tilted);
    std::filesystem::remove(path);
    ASSERT_EQ(folded.followers().size(), 3u);
    const int n = folded.joints();
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n + 3, n);
    G.topRows(n).setIdentity();
    Eigen::VectorXd c = Eigen::VectorXd::Zero(n + 3);
    const auto column = [&](const char* name) {
        return std::find(listed.begin(), listed.end(), name) - listed.begin();
    };
    G(n, column("r_knee")) = -0.7, c[n] = 0.2;
    G(n + 1, column("l_knee")) = 0.4, c[n + 1] = -0.1;
    G(n + 2, column("l_knee")) = 1.5;
    Eigen::MatrixXd big = Eigen::MatrixXd::Identity(9 + n, 6 + n);
    big.bottomRightCorner(n + 3, n) = G;

    std::mt19937 random(3);
    Data a(folded), b(wide);
    for (int i = 0; i < 3; ++i) { // the cache of the wide matrices is used again
        const State state = random_state(n, random);
        State all = state;
        all.s = G * state.s + c;
        all.s_dot = G * state.s_dot;
        set(folded, a, state);
        set(wide, b, all);
        const Eigen::VectorXd nu_dot = random_vector(6 + n, random);
        Quantities ours(folded), theirs(wide);
        ours.compute(folded, a, folded.frame("l_hand"), folded.frame("l_sole"), nu_dot);
        theirs.compute(wide, b, wide.frame("l_hand"), wide.frame("l_sole"), big * nu_dot);
        expect_close(ours.w_H_f, theirs.w_H_f, "pose");
        expect_close(ours.J, theirs.J * big, "J");
        expect_close(ours.J_dot_nu, theirs.J_dot_nu, "J_dot_nu");
        expect_close(ours.com_J, theirs.com_J * big, "J of the centre of mass");
        expect_close(ours.M, big.transpose() * theirs.M * big, "M");
        expect_close(ours.h, big.transpose() * theirs.h, "h");
        expect_close(ours.g, big.transpose() * theirs.g, "g");
        expect_close(ours.c, big.transpose() * theirs.c, "c");
        expect_close(ours.C, big.transpose() * theirs.C * big, "C");
        expect_close(ours.M_dot, big.transpose() * theirs.M_dot * big, "dM/dt");
        expect_close(ours.push, big.transpose() * theirs.push, "wrench");
        expect_close(ours.M * ours.nu_dot + ours.h, nu_dot, "forward dynamics");
        expect_close(ours.tau, big.transpose() * theirs.tau, "tau");
        expect_close(ours.H, theirs.H, "momentum");
        expect_close(ours.A, theirs.A * big, "A");
        expect_close(ours.A_dot_nu, theirs.A_dot_nu, "dA/dt nu");
        expect_close(ours.relative_J, theirs.relative_J * G, "relative J");
    }
}

} // namespace bf::dynamics::test

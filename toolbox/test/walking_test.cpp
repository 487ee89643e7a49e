#include "bf/walking/dcm.hpp"
#include "bf/walking/swing.hpp"

#include "running.hpp"

#include <cmath>
#include <limits>

namespace bf::toolbox::test {
namespace {

/// A planner by itself, whose feet land where they should: the poses of the soles are those of SwingFoot.
std::string planned_walk(const std::string& planner, const std::string& swing = "") {
    return "model: m\nstep: 0.005\ninputs: {command: {shape: 3}, shift: {shape: 2}, delay: {shape: 1}, com: "
           "{shape: "
           "3}, com_dot: {shape: 3}}\n"
           "blocks:\n"
           "  feet: {block: WholeBodyToolbox/FootstepPlanner, double_support: 0.2, single_support: 0.5, "
           "start_time: 0.1, first_double_support: 0.2, width: 0.16, x: [-0.05 0.1], y: [-0.03 0.03]" +
           planner +
           "}\n"
           "  plan: {block: WholeBodyToolbox/DcmPlanner, height: 0.5, zmp: [0.03 0.005]}\n"
           "  soles: {block: WholeBodyToolbox/SwingFoot, apex: 0.05" +
           swing +
           "}\n"
           "  law: {block: WholeBodyToolbox/DcmController, height: 0.5, gain: 3}\n"
           "  left: {block: UnitDelay, initial: [1 0 0 0; 0 1 0 0.08; 0 0 1 0; 0 0 0 1]}\n"
           "  right: {block: UnitDelay, initial: [1 0 0 0; 0 1 0 -0.08; 0 0 1 0; 0 0 0 1]}\n"
           "connections:\n  command: feet.command\n  shift: feet.shift\n  delay: feet.delay\n"
           "  left: feet.w_H_left\n  right: feet.w_H_right\n"
           "  feet.footholds: [plan.footholds, soles.footholds, law.footholds]\n"
           "  feet.step: [plan.step, soles.step, law.step]\n"
           "  soles.w_H_left: left\n  soles.w_H_right: right\n"
           "  plan.dcm: law.dcm_target\n  plan.dcm_dot: law.dcm_dot_target\n  com: law.com\n  com_dot: "
           "law.com_dot\n";
}

Vector3 position_of(const Matrix& pose) { return pose.topRightCorner<3, 1>(); }

TEST(FootstepPlanner, WalksTheStepsThatItIsToldAndStandsWithItsFeetSideBySide) {
    Running run(planned_walk(", steps: 6, max_forward: 0.2"));
    run.set("command", Vector3(0.1 / 0.7, 0, 0));
    int lifted[2] = {0, 0};
    Eigen::Vector2d before(1, 1);
    for (int k = 0; k < 6 * 140 + 200; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Eigen::Vector2d contacts = run.get("feet.contacts");
        EXPECT_GE(contacts.sum(), 1) << "a foot always stands";
        for (int i = 0; i < 2; ++i) lifted[i] += before[i] == 1 && contacts[i] == 0;
        before = contacts;
    }
    EXPECT_EQ(run.scalar("feet.steps_done"), 6);
    EXPECT_EQ(lifted[0], 3);
    EXPECT_EQ(lifted[1], 3);
    const Vector3 left = position_of(run.get("soles.w_H_left")),
                  right = position_of(run.get("soles.w_H_right"));
    EXPECT_LT((left - Vector3(0.5, 0.08, 0)).norm(), 2e-4); // five steps of 0.1 m and one that closes
    EXPECT_LT((right - Vector3(0.5, -0.08, 0)).norm(), 2e-4);
    EXPECT_EQ(run.get("feet.step")(6, 0), 0);
}

TEST(FootstepPlanner, ComesToAGoalInSteps) {
    for (const char* first : {"left", "right"}) {
        Running run(planned_walk(
            std::string(", follow: goal, max_forward: 0.12, max_turn: 0.3, first_foot: ") + first));
        const Vector3 goal(0.5, -0.3, -1);
        run.set("command", goal);
        for (int k = 0; k < 6000; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Matrix left = run.get("soles.w_H_left"), right = run.get("soles.w_H_right");
        EXPECT_LT(((position_of(left) + position_of(right)) / 2 - Vector3(0.5, -0.3, 0)).norm(), 0.01);
        EXPECT_NEAR(std::atan2(left(1, 0), left(0, 0)), -1, 0.05);
        EXPECT_NEAR((position_of(left) - position_of(right)).norm(), 0.16, 0.01);
        const double done = run.scalar("feet.steps_done");
        for (int k = 0; k < 300; ++k) ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("feet.steps_done"), done) << "it stands";
        run.set("command", Vector3(0, 0, 0)); // another goal
        for (int k = 0; k < 300; ++k) ASSERT_TRUE(run.step());
        EXPECT_GT(run.scalar("feet.steps_done"), done) << "it goes on";
    }
}

TEST(FootstepPlanner, TakesWhatIsBeyondReachInReachAndStaysAtVelocityZero) {
    Running run(planned_walk(", max_forward: 0.15, min_width: 0.12, max_width: 0.25, max_turn: 0.3"));
    run.set("command", Vector3(5, 5, 20));
    for (int k = 0; k < 2000; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Matrix feet = run.get("feet.footholds");
        if (run.get("feet.step")(6, 0) == 0) continue;
        const bool left_stands = run.get("feet.step")(5, 0) == 1;
        const Eigen::Vector2d xy = Eigen::Rotation2Dd(-feet(3, 1)) * (feet.col(2) - feet.col(1)).head<2>();
        EXPECT_LE(xy.x(), 0.15 + 1e-9);
        EXPECT_GE((left_stands ? -1 : 1) * xy.y(), 0.12 - 1e-9);
        EXPECT_LE((left_stands ? -1 : 1) * xy.y(), 0.25 + 1e-9);
        EXPECT_LE(std::abs(feet(3, 2) - feet(3, 1)), 0.3 + 1e-9);
    }
    EXPECT_GT(run.scalar("feet.steps_done"), 10);
    Running stands(planned_walk(""));
    for (int k = 0; k < 500; ++k) ASSERT_TRUE(stands.step());
    EXPECT_EQ(stands.scalar("feet.steps_done"), 0);
}

TEST(FootstepPlanner, StepsOntoABoxAndNeverOnItsEdge) {
    Running run(planned_walk(", ground: [0.6 0 0.015 0.25 0.5 0.015], steps: 12"));
    run.set("command", Vector3(0.12 / 0.7, 0, 0));
    bool was_up = false;
    for (int k = 0; k < 12 * 140 + 200; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Matrix feet = run.get("feet.footholds");
        for (int i = 0; i < feet.cols(); ++i) {
            const double heel = feet(0, i) - 0.05, toe = feet(0, i) + 0.1;
            const bool on = heel > 0.35 && toe < 0.85, off = toe < 0.35 || heel > 0.85;
            EXPECT_TRUE(on || off) << feet.col(i).transpose();
            EXPECT_EQ(feet(2, i), on ? 0.03 : 0.0) << feet.col(i).transpose();
            was_up = was_up || on;
        }
    }
    EXPECT_TRUE(was_up);
    EXPECT_GT(position_of(run.get("soles.w_H_left")).x(), 0.9) << "and down again";
}

TEST(FootstepPlanner, SaysWhereNoStepLeadsOn) {
    // The soles would have to reach 0.19 m over the edge; a goal before it is reached.
    Running run(planned_walk(", follow: goal, max_forward: 0.1, ground: [1 0 0.015 0.5 0.5 0.015]"));
    const auto ends = [&](double x) {
        run.set("command", Vector3(x, 0, 0));
        for (int k = 0; k < 1500; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.get("feet.step")(6, 0), 0) << "it stands";
    };
    ends(0.3);
    EXPECT_EQ(run.scalar("feet.blocked"), 0);
    ends(0.9);
    EXPECT_EQ(run.scalar("feet.blocked"), 1);
    EXPECT_LT(position_of(run.get("soles.w_H_left")).x(), 0.4);
    ends(0.1);
    EXPECT_EQ(run.scalar("feet.blocked"), 0);
}

TEST(FootstepPlanner, IsNotBlockedBeforeAStepHoweverShort) {
    // Of 15 mm: the foot that steps first goes from 10 mm on, the other one from 20 mm on.
    Running run(planned_walk(", max_forward: 0.015"));
    run.set("command", Vector3(0.1, 0, 0));
    for (int k = 0; k < 300; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        EXPECT_EQ(run.scalar("feet.blocked"), 0) << "in step " << k;
    }
    EXPECT_EQ(run.get("feet.step")(6, 0), 4) << "it walks";
}

TEST(FootstepPlanner, MovesTheFootholdOfTheFootInTheAirAlone) {
    Running run(planned_walk(", freeze: 0.1"));
    run.set("command", Vector3(0.1, 0, 0));
    Matrix last = Matrix::Zero(4, 6);
    for (int k = 0; k < 150; ++k) {
        ASSERT_TRUE(run.step());
        const Matrix step = run.get("feet.step"), feet = run.get("feet.footholds");
        if (step(6, 0) > 0 && step(0, 0) > 0.01) { // not where one step ends and another begins
            const double moved = feet(1, 2) - last(1, 2), time = step(0, 0);
            if (time < 0.2 + 0.003 || time > 0.6 + 0.008) {
                EXPECT_EQ(moved, 0) << time;
            } else if (time < 0.6 - 0.003) {
                EXPECT_NEAR(moved, 1e-4, 1e-12) << time;
            }
            EXPECT_NEAR(feet(1, 3) - feet(1, 2), last(1, 3) - last(1, 2), 1e-12) << "the others follow";
        }
        last = feet;
        run.set("shift", Eigen::Vector2d(0, 1e-4));
    }
}

TEST(FootstepPlanner, FindsItsGroundInTheFileOfAWorld) {
    const std::string file = temporary_file(
        "ground.xml",
        R"(<world><floor/><box name="low" size="1 0.5 0.03" position="0.6013 0 0.015" rpy="0 0 1.5707963267949"/>
                         <steps name="high" count="2" depth="0.3" width="1" height="0.02" position="0.8517 0 0"/></world>)");
    Running listed(planned_walk(
        ", steps: 12, ground: [0.6013 0 0.015 0.25 0.5 0.015; 1.0017 0 0.01 0.15 0.5 0.01; 1.3017 0 0.02 "
        "0.15 0.5 0.02]")),
        read(planned_walk(", steps: 12, terrain: " + file));
    double highest = 0;
    for (auto* run : {&listed, &read}) run->set("command", Vector3(0.12 / 0.7, 0, 0));
    for (int k = 0; k < 1500; ++k) {
        ASSERT_TRUE(listed.step() && read.step());
        const Matrix feet = read.get("feet.footholds");
        EXPECT_LT((feet - listed.get("feet.footholds")).norm(), 1e-9);
        highest = std::max(highest, feet.row(2).maxCoeff());
    }
    EXPECT_NEAR(highest, 0.04, 1e-12);
    const auto with = [](const std::string& parts) {
        return refusal(
            planned_walk(", terrain: " + temporary_file("odd.xml", "<world>\n" + parts + "</world>")));
    };
    for (const char* odd :
         {R"(<slope name="odd"/>)", R"(<box name="odd" rpy="0 0 0.1"/>)", R"(<box name="odd" mass="1"/>)"})
        expect_contains(with(odd),
                        "odd.xml', line 2: object 'odd' is no ground for level soles; give boxes and steps");
    expect_contains(refusal(planned_walk(", terrain: nowhere.xml")), "cannot read the world");
}

TEST(FootstepPlanner, LetsTheFootInTheAirLandLaterOrEarlier) {
    for (const double sign : {-1.0, 1.0}) {
        Running run(planned_walk(", freeze: 0.1, min_single_support: 0.4, max_single_support: 0.7"));
        run.set("command", Vector3(0.1, 0, 0));
        double last = 0.5, most = 0;
        for (int k = 0; k < 400; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            const Matrix step = run.get("feet.step");
            if (step(6, 0) == 0) continue;
            const double T = step(2, 0), time = step(0, 0);
            if (time < 0.2 + 0.003) {
                EXPECT_EQ(T, 0.5) << "each step begins as planned";
            } else {
                EXPECT_LE(std::abs(T - last), 0.005 + 1e-12) << "a period in a period";
                EXPECT_GE(sign * (T - last), 0);
                if (0.2 + last - (time - 0.005) < 0.1 - 0.003) {
                    EXPECT_EQ(T, last) << "soon before landing it stays";
                }
            }
            EXPECT_EQ(step(4, 0), 0.5) << "the steps after it keep theirs";
            last = T;
            most = std::max(most, sign * (T - 0.5));
            run.set("delay", time > 0.3 ? sign * 0.02 : 0);
        }
        EXPECT_NEAR(most, sign < 0 ? 0.1 : 0.2, 1e-12);
        EXPECT_GE(run.scalar("feet.steps_done"), 2);
        run.set("delay", std::numeric_limits<double>::quiet_NaN());
        EXPECT_FALSE(run.step());
        EXPECT_EQ(run.simulation.failure(), "feet: delay is not finite; look at what computes it");
    }
}

TEST(FootstepPlanner, RefusesNonsenseWithItsPlace) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Running run(planned_walk(""));
    ASSERT_TRUE(run.step());
    run.set("command", Vector3(0, nan, 0));
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(), "feet: command[2] is not finite; look at what computes it");
    Running shifted(planned_walk(""));
    shifted.set("shift", Eigen::Vector2d(nan, 0));
    EXPECT_FALSE(shifted.step());
    EXPECT_EQ(shifted.simulation.failure(), "feet: shift[1] is not finite; look at what computes it");
    expect_contains(refusal(planned_walk(", preview: 0")), "preview");
    expect_contains(refusal(planned_walk(", max_forward: -0.1")), "max_forward");
    expect_contains(refusal(planned_walk(", min_width: 0.4")), "max_width");
    expect_contains(refusal(planned_walk(", ground: [1 2 3]")), "a box is a row x y z a b c");
    for (const char* wrong : {"double_support: 0", "single_support: -0.5", "width: 0"}) {
        std::string text = planned_walk("");
        const std::string name = std::string(wrong).substr(0, std::string(wrong).find(':'));
        const auto at = text.find(name + ": ");
        text.replace(at, text.find(',', at) - at, wrong);
        expect_contains(refusal(text), name);
    }
}

TEST(DcmPlanner, IsThePlanOfTheLibraryAndContinuousFromStepToStep) {
    Running run(planned_walk(", steps: 5"));
    run.set("command", Vector3(0.2, 0.02, 0.1));
    const double omega = walking::natural_frequency(0.5);
    Vector3 last = Vector3::Zero(), velocity = Vector3::Zero();
    for (int k = 0; k < 5 * 140 + 200; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        walking::Step step;
        ASSERT_TRUE(walking::Step::read(run.get("feet.step"), step));
        const auto wanted = walking::plan_dcm(run.get("feet.footholds"), step, {{0.03, 0.005, 0.5}}, omega);
        const Vector3 dcm = run.get("plan.dcm"), dcm_dot = run.get("plan.dcm_dot"), r = run.get("plan.vrp");
        EXPECT_EQ(dcm, wanted.dcm);
        EXPECT_LT((dcm_dot - omega * (dcm - r)).norm(), 1e-12);
        // Steps beyond the preview of four change it by e^(-omega 4 0.7), 4e-6 of their length.
        // The VRP leaves its rest with a jump.
        if (k > 0 && !(step.from_rest && step.ahead > 0 && step.time == 0)) {
            EXPECT_LT((dcm - last - 0.0025 * (dcm_dot + velocity)).norm(), 3e-5) << k;
        }
        last = dcm;
        velocity = dcm_dot;
    }
    EXPECT_EQ(velocity.norm(), 0);
}

TEST(SwingFoot, MovesWithoutAJumpAlsoWhereItsFootholdDoes) {
    Running run(planned_walk(", steps: 4"));
    run.set("command", Vector3(0.2, 0, 0.2));
    Vector3 last_p = Vector3::Zero(), last_v = Vector3::Zero();
    double highest = 0;
    for (int k = 0; k < 4 * 140 + 100; ++k) {
        const double time = k > 0 ? run.get("feet.step")(0, 0) : 0;
        run.set("shift", time > 0.3 && time < 0.4 ? Eigen::Vector2d(0.002, 0.001) : Eigen::Vector2d(0, 0));
        run.set("delay", time > 0.25 && time < 0.35 ? -0.003 : 0.0);
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Vector3 p = position_of(run.get("soles.w_H_left")), v = run.get("soles.v_left").topRows(3);
        if (k > 0) {
            EXPECT_LT((p - last_p - 0.0025 * (v + last_v)).norm(), 1e-4) << k;
            EXPECT_LT((v - last_v).norm(), 0.1) << k; // 20 m/s² in 5 ms
        }
        if (run.get("feet.contacts")(0, 0) == 1) {
            EXPECT_EQ(v.norm(), 0);
        }
        last_p = p;
        last_v = v;
        highest = std::max(highest, p.z());
    }
    EXPECT_NEAR(highest, 0.05, 1e-3);
}

TEST(DcmController, AsksForNothingOnItsTargetAndKeepsTheZeroMomentPointInTheSoles) {
    Running run(planned_walk(", steps: 4"));
    run.set("command", Vector3(0.2, 0, 0));
    const double omega = walking::natural_frequency(0.5);
    for (int k = 0; k < 4 * 140; ++k) {
        // A centre of mass at rest in last step's DCM: an error of one step.
        if (k > 0)
            run.set("com", run.get("plan.dcm") + (k % 50 == 49 ? Vector3(0, 0.2, 0) : Vector3(0, 0, 0)));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Vector3 r = run.get("law.vrp");
        walking::Step step;
        ASSERT_TRUE(walking::Step::read(run.get("feet.step"), step));
        Eigen::Matrix<double, 2, walking::max_corners> corners;
        const int count = walking::support_corners(run.get("feet.footholds"), step,
                                                   {-0.045, 0.098, -0.028, 0.028}, corners);
        EXPECT_LT((walking::nearest_in_hull(corners, count, r.head<2>()) - r.head<2>()).norm(), 1e-12);
        const Vector3 com = run.get("law.dcm");
        EXPECT_LT((Vector3(run.get("law.com_ddot")) - omega * omega * (com - r)).norm(), 1e-9);
        if (k % 50 != 49) {
            EXPECT_LT(run.get("law.shift").norm(), 0.01) << "errors are of one period";
        } else if (!step.on_both_feet() && step.time > 0.3) {
            EXPECT_GT(run.get("law.shift")(1, 0), 0.1);
        }
    }
}

TEST(Walking, BlocksRefuseStepsThatNoPlannerMade) {
    const std::string text =
        "model: m\nstep: 0.01\ninputs: {footholds: {shape: \"[4 4]\"}, step: {shape: 8}}\nblocks: "
        "{plan: {block: WholeBodyToolbox/DcmPlanner}}\n"
        "connections: {footholds: plan.footholds, step: plan.step}\n";
    const auto says = [&](const walking::Step& step, double foothold) {
        Running run(text);
        run.set("step", step.numbers()).set("footholds", Matrix::Constant(4, 4, foothold));
        return run.step() ? "" : run.simulation.failure();
    };
    EXPECT_EQ(says({0.1, 0.2, 0.5, 0.2, 0.5, walking::Side::left, 2, false}, 0), "");
    expect_contains(says({-0.1, 0.2, 0.5, 0.2, 0.5, walking::Side::left, 2, false}, 0),
                    "plan: step is no step");
    Running odd(text);
    auto numbers = walking::Step{0.1, 0.2, 0.5, 0.2, 0.5, walking::Side::left, 2, false}.numbers();
    numbers[6] = 1.5;
    odd.set("step", numbers).set("footholds", Matrix::Zero(4, 4));
    EXPECT_FALSE(odd.step());
    expect_contains(odd.simulation.failure(), "plan: step is no step");
    expect_contains(says({0.1, 0.2, 0, 0.2, 0.5, walking::Side::left, 2, false}, 0), "plan: step is no step");
    expect_contains(says({0.1, 0.2, 0.5, 0.2, 0.5, walking::Side::left, 3, false}, 0),
                    "plan: the step plans 3 steps, but there are 4 footholds");
    expect_contains(says({0.1, 0.2, 0.5, 0.2, 0.5, walking::Side::left, 2, false}, std::nan("")),
                    "plan: footholds[1][1] is not finite");
}

TEST(FootstepPlanner, RefusesFeetThatDoNotStandSideBySideAndWalksThatAreNone) {
    const auto says = [](const std::string& planner, const Matrix& left, const Matrix& right) {
        Running run("model: m\nstep: 0.01\ninputs: {left: {shape: \"[4 4]\"}, right: {shape: \"[4 4]\"}}\n"
                    "blocks: {x: {block: WholeBodyToolbox/FootstepPlanner" +
                    planner +
                    "}, still: {block: Constant, value: \"zeros(3, 1)\"}}\n"
                    "connections: {left: x.w_H_left, right: x.w_H_right, still: x.command}\n");
        run.set("left", left).set("right", right);
        return run.step() ? "" : run.simulation.failure();
    };
    Matrix left = Matrix::Identity(4, 4), right = left, lying = left;
    left(1, 3) = 0.07;
    right(1, 3) = -0.07;
    lying.topRows(3) << 1, 0, 0, 0, 0, 0, -1, 0.07, 0, 1, 0, 0;
    EXPECT_EQ(says("", left, right), "");
    expect_contains(says("", Matrix::Zero(4, 4), right), "x: w_H_left holds no rotation");
    expect_contains(says("", left, Matrix::Zero(4, 4)), "x: w_H_right holds no rotation");
    expect_contains(says("", lying, right), "x: w_H_left is no sole that stands");
    expect_contains(says("", right, left), "x: w_H_left is not at the left of w_H_right");
    expect_contains(says("", left, left), "x: w_H_left is not at the left of w_H_right");
    expect_contains(says(", steps: 2.5", left, right), "x: steps is no whole number");
    expect_contains(says(", width: 0.5", left, right), "x: width is not from min_width to max_width");
    expect_contains(says(", y: [1 -1]", left, right), "x: y goes from a larger to a smaller value");
    expect_contains(refusal(planned_walk(", min_single_support: 2, max_single_support: 1")),
                    "max_single_support");
}

TEST(FootstepPlanner, TurnsTheWayThatItIsToldHoweverFast) {
    for (const double rate : {0.5, 3.0, 3.8, 4.7, 6.2, 9.0})
        for (const double way : {1.0, -1.0}) {
            Running run(planned_walk(", max_turn: 0.3, steps: 6"));
            run.set("command", Vector3(0, 0, way * rate));
            for (int k = 0; k < 900; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
            const Matrix H = run.get("soles.w_H_left");
            EXPECT_GT(way * std::atan2(H(1, 0), H(0, 0)), 0.4) << way * rate;
        }
}

TEST(FootstepPlanner, ComesToItsGoalWithWhicheverFootIsAway) {
    const auto stands = [](Running& run, double x, double y) {
        const Vector3 left = position_of(run.get("soles.w_H_left")),
                      right = position_of(run.get("soles.w_H_right"));
        EXPECT_LT((0.5 * (left + right) - Vector3(x, y, 0)).norm(), 0.011);
        EXPECT_LT((left - right - Vector3(0, 0.16, 0)).norm(), 0.011);
        EXPECT_EQ(run.get("feet.step")(6, 0), 0) << "it stands";
    };
    // The left foot stands 10 cm ahead, and the right one, which is to move first, at the goal.
    for (const std::string first : {"left", "right"}) {
        std::string text = planned_walk(", follow: goal, first_foot: " + first);
        text.replace(text.find("[1 0 0 0; 0 1 0 0.08"), 20, "[1 0 0 0.1; 0 1 0 0.08");
        Running run(text);
        for (int k = 0; k < 1000; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
        stands(run, first == "left" ? 0 : 0, 0);
        EXPECT_EQ(run.scalar("feet.steps_done"), 1);
    }
    // A push moves each foothold in turn, that of the last step too.
    for (const int instant : {150, 250, 350, 450, 550, 650, 750}) {
        Running run(planned_walk(", follow: goal"));
        run.set("command", Vector3(0.4, 0, 0));
        for (int k = 0; k < 3000; ++k) {
            run.set("shift", Eigen::Vector2d(0, k >= instant && k < instant + 20 ? 0.004 : 0.0));
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        stands(run, 0.4, 0);
    }
}

TEST(Walking, ContinuesASnapshotBitForBit) {
    Running run(planned_walk(""));
    run.set("command", Vector3(0.2, 0, 0.1)).set("shift", Eigen::Vector2d(1e-4, 0));
    for (int k = 0; k < 137; ++k) ASSERT_TRUE(run.step());
    const auto go = [&] {
        std::vector<Matrix> seen;
        for (int k = 0; k < 300; ++k) {
            EXPECT_TRUE(run.step());
            for (const char* name : {"feet.footholds", "plan.dcm", "soles.w_H_left", "soles.a_right"})
                seen.push_back(run.get(name));
        }
        return seen;
    };
    const auto snapshot = run.simulation.snapshot();
    const auto first = go();
    run.simulation.restore(snapshot);
    EXPECT_EQ(go(), first);
}

} // namespace
} // namespace bf::toolbox::test

#include "bf/control/riccati.hpp"

#include "running.hpp"

#include <cmath>
#include <limits>

namespace bf::toolbox::test {
namespace {

/// A cart on a rail: position and speed, pushed; 0.1 s a step.
const std::string cart = "A: \"[1 0.1; 0 1]\", B: \"[0.005; 0.1]\", Q: \"diag([1 0.1])\", R: 0.01";

std::string regulated(const std::string& settings) {
    return "model: m\nstep: 0.1\ninputs: {x: {shape: 2}, target: {shape: 2}}\nblocks:\n  lqr: {block: "
           "WholeBodyToolbox/LQR, " +
           settings + "}\nconnections:\n  x: lqr.x\n  target: lqr.x_target\n";
}

/// The cart in a loop with its controller.
std::string predicted(const std::string& settings, const std::string& reference = "{shape: 2}") {
    return "model: m\nstep: 0.1\ninputs: {r: " + reference +
           ", d: {shape: 2}}\nblocks:\n  mpc: {block: WholeBodyToolbox/MPC, " + cart + settings +
           "}\n  cart: {block: DiscreteStateSpace, A: \"[1 0.1; 0 1]\", B: \"[0.005 1 0; 0.1 0 1]\", C: "
           "eye(2), "
           "initial: \"[0; 0]\"}\n  force: {block: Mux, inputs: 2}\nconnections:\n  cart: mpc.x\n  r: "
           "mpc.reference\n  mpc.u: force.u1\n  d: force.u2\n  force: cart\n";
}

} // namespace

TEST(LqrBlock, HasTheGainOfTheRegulatorAndFollowsItsTarget) {
    Running run(regulated(cart));
    Matrix A(2, 2), B(2, 1);
    A << 1, 0.1, 0, 1;
    B << 0.005, 0.1;
    control::Regulator regulator(2, 1, control::Regulator::Time::discrete);
    ASSERT_EQ(regulator.solve(A, B, Eigen::Vector2d(1, 0.1).asDiagonal().toDenseMatrix(),
                              Matrix::Constant(1, 1, 0.01)),
              control::Regulator::Status::solved);
    run.set("x", Eigen::Vector2d(0.3, -1)).set("target", Eigen::Vector2d(1, 0));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.get("lqr.K"), regulator.K());
    EXPECT_NEAR(run.scalar("lqr.u"), -(regulator.K() * Eigen::Vector2d(-0.7, -1))(0), 1e-12);
    EXPECT_EQ(run.scalar("lqr.status"), 0);
}

TEST(LqrBlock, TakesModelsThatChangeAndKeepsItsGainWhereThereIsNone) {
    Running run("model: m\nstep: 0.1\ninputs: {x: {shape: 2}, A: {shape: \"[2 2]\"}, B: {shape: \"[2 "
                "1]\"}}\nblocks:\n  lqr: {block: WholeBodyToolbox/LQR, model_inputs: true, stop_when_fails: "
                "false, time: "
                "continuous, Q: eye(2), R: 1}\nconnections:\n  x: lqr.x\n  A: lqr.A\n  B: lqr.B\n");
    run.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished()).set("B", Eigen::Vector2d(0, 1));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_LT((run.get("lqr.K") - Eigen::RowVector2d(1, std::sqrt(3.0))).norm(), 1e-12);
    run.set("B", Eigen::Vector2d(0, 0));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("lqr.status"), 1);
    EXPECT_LT((run.get("lqr.K") - Eigen::RowVector2d(1, std::sqrt(3.0))).norm(), 1e-12);
    run.set("B", Eigen::Vector2d(0, 2));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("lqr.status"), 0);
}

TEST(LqrBlock, StopsWhereThereIsNoGain) {
    const auto failure = [](const std::string& settings) {
        Running run(regulated(settings));
        EXPECT_FALSE(run.step());
        return run.simulation.failure();
    };
    expect_contains(failure("A: \"[2 0; 0 1]\", B: \"[0; 1]\", Q: eye(2), R: 1"),
                    "lqr: no gain stabilises A, B");
    expect_contains(failure("A: \"[1 0.1; 0 1]\", B: \"[0; 0.1]\", Q: eye(2), R: 0"),
                    "lqr: R is not positive definite; give each input a cost");
    expect_contains(failure("A: \"[1 0.1; 0 1]\", B: \"[0; 0.1]\", Q: \"diag([1 -1])\", R: 1"),
                    "lqr: Q is not positive semidefinite");
    Running run(regulated(cart));
    run.set("x", Eigen::Vector2d(0, NAN));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(), "is not finite; look at what computes it");
    expect_contains(refusal(regulated("A: \"[1 0.1]\", B: \"[0; 0.1]\", Q: eye(2), R: 1")), "lqr");
}

TEST(MpcBlock, DrivesACartWithinItsBoundsInBothForms) {
    Matrix way[2];
    for (const bool is_sparse : {false, true}) {
        Running run(
            predicted(std::string(", horizon: 15, u_min: -2, u_max: 2, bounded: 2, x_min: -0.8, x_max: 0.8, "
                                  "form: ") +
                      (is_sparse ? "sparse" : "condensed")));
        run.set("r", Eigen::Vector2d(1, 0));
        Matrix seen(2, 60);
        for (int k = 0; k < 60; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            ASSERT_EQ(run.scalar("mpc.status"), 0);
            seen.col(k) = run.get("cart");
            EXPECT_LE(std::abs(run.scalar("mpc.u")), 2 + 1e-6);
        }
        EXPECT_NEAR(seen.row(1).maxCoeff(), 0.8, 1e-5) << "as fast as it may";
        EXPECT_NEAR(seen(0, 59), 1, 1e-3);
        way[is_sparse] = seen;
    }
    EXPECT_LT((way[0] - way[1]).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(MpcBlock, ChangesItsInputAsFastAsItMay) {
    for (const std::string form : {"condensed", "sparse"}) {
        Running run(predicted(", horizon: 10, limit_rates: true, du_min: -0.5, du_max: 0.25, form: " + form));
        run.set("r", Eigen::Vector2d(10, 0));
        double last = 0, fastest = 0;
        for (int k = 0; k < 40; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            ASSERT_EQ(run.scalar("mpc.status"), 0) << form << k;
            const double rate = run.scalar("mpc.u") - last;
            if (k < 4) {
                EXPECT_NEAR(rate, 0.25, 1e-6) << form << k;
            }
            EXPECT_LT(rate, 0.25 + 1e-6);
            fastest = std::min(fastest, rate);
            last = run.scalar("mpc.u");
        }
        EXPECT_NEAR(fastest, -0.5, 1e-6) << form;
    }
}

TEST(MpcBlock, CountsRatesFromWhatIsInForce) {
    std::string model = predicted(", horizon: 5, limit_rates: true, du_min: -0.5, du_max: 0.5, u_max: 3");
    model.replace(model.find("d: {shape: 2}"), 1, "v: {}, d");
    Running run(model + "  v: mpc.u_last\n");
    run.set("r", Eigen::Vector2d(10, 0)).set("v", Eigen::VectorXd::Constant(1, 2.0));
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_NEAR(run.scalar("mpc.u"), 2.5, 1e-6);
    run.set("v", Eigen::VectorXd::Constant(1, 4.0)); // 3.5 is the least that is left
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("mpc.status"), -2);
}

TEST(MpcBlock, WithoutBoundsIsTheRegulator) {
    Running run(predicted(", horizon: 3, terminal: lqr")), gain(regulated(cart));
    run.set("d", Eigen::Vector2d(0.1, -0.2));
    for (int k = 0; k < 10; ++k) {
        ASSERT_TRUE(run.step());
        gain.set("x", run.get("cart"));
        ASSERT_TRUE(gain.step());
        EXPECT_NEAR(run.scalar("mpc.u"), gain.scalar("lqr.u"), 1e-7);
        run.set("d", Eigen::Vector2d::Zero());
    }
}

TEST(MpcBlock, GoesOnAlongItsPlanWhileThereIsNone) {
    Running run(predicted(", horizon: 5, u_min: -1, u_max: 1, bounded: [1 2], x_min: -1, x_max: 1"));
    run.set("r", Eigen::Vector2d(0.9, 0));
    ASSERT_TRUE(run.step());
    run.set("d", Eigen::Vector2d(5, 0)); // to where no plan leads back within its bounds
    ASSERT_TRUE(run.step());
    for (int k = 0; k < 2; ++k) {
        const Matrix before = run.get("mpc.plan"), states = run.get("mpc.states");
        EXPECT_GT(before.norm(), 0.1);
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.scalar("mpc.status"), -2);
        EXPECT_EQ(run.get("mpc.plan").leftCols(4), before.rightCols(4));
        EXPECT_EQ(run.get("mpc.plan")(0, 4), before(0, 4));
        EXPECT_EQ(run.get("mpc.states").leftCols(4), states.rightCols(4));
        EXPECT_EQ(run.scalar("mpc.u"), before(0, 1));
    }
}

TEST(MpcBlock, RefusesAndStopsWithItsReasons) {
    expect_contains(refusal(predicted(", horizon: 5", "{shape: \"[2 3]\"}")),
                    "input 'reference' has 3 columns, but the horizon has 5 steps");
    expect_contains(refusal(predicted(", bounded: 3")),
                    "bounded states are listed once each, from the first to number 2");
    expect_contains(refusal(predicted(", bounded: [1 1]")), "bounded states are listed once each");
    expect_contains(refusal(predicted(", horizon: 0")), "horizon");
    expect_contains(refusal(predicted(", horizon: 2001")),
                    "mpc: a problem has at most 2000 variables, but a horizon of 2001 steps needs more");
    Running run(predicted(", horizon: 5, bounded: 1, x_min: 0.5, u_max: 0.1, stop_when_fails: true"));
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(),
                    "mpc: no inputs within their bounds keep the states within theirs");
    Running slow(predicted(
        ", horizon: 5, bounded: 1, x_min: 0.5, limit_rates: true, du_max: 0.1, stop_when_fails: true"));
    EXPECT_FALSE(slow.step());
    expect_contains(slow.simulation.failure(), "no inputs within their bounds and rates keep the states");
    expect_contains(refusal(predicted(", limit_rates: true, du_min: 1, du_max: -1")), "du_max");
    expect_contains(refusal(predicted(", du_max: 1")), "du_max");
    for (const std::string bound : {"u_min: Inf, u_max: Inf", "limit_rates: true, du_min: Inf, du_max: Inf",
                                    "bounded: 1, x_min: Inf, x_max: Inf", "u_min: -Inf, u_max: -Inf"})
        expect_contains(refusal(predicted(", " + bound)), ", but is ");
    for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        Running broken(predicted(", horizon: 5"));
        broken.set("r", Eigen::Vector2d(0, wrong));
        EXPECT_FALSE(broken.step());
        expect_contains(broken.simulation.failure(), "mpc: reference[2");
    }
}

TEST(MpcBlock, SeesReferencesComing) {
    Running run(predicted(", horizon: 10", "{shape: \"[2 10]\"}"));
    Matrix reference = Matrix::Zero(2, 10);
    reference.row(0).tail(3).setOnes();
    run.set("r", reference);
    ASSERT_TRUE(run.step());
    EXPECT_GT(run.scalar("mpc.u"), 0.01);
    EXPECT_GT(run.get("mpc.states")(0, 9), 0.5);
}

} // namespace bf::toolbox::test

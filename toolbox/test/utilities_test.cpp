#include "running.hpp"

#include <Eigen/SVD>
#include <limits>
#include <random>

namespace bf::toolbox::test::utilities {
namespace {

std::string one(const std::string& block, const std::string& inputs, const std::string& lines) {
    return "model: m\nstep: 0.01\ninputs: {" + inputs + "}\nblocks:\n  x: {block: WholeBodyToolbox/" + block +
           "}\nconnections:\n" + lines;
}

} // namespace

TEST(Holder, KeepsTheFirstSampleWhateverComesLater) {
    Running run(one("Holder", "s: {shape: 2}", "  s: x\n"));
    run.set("s", Eigen::Vector2d(3, -4));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x"), Matrix(Eigen::Vector2d(3, -4)));
    for (const double later :
         {7.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        run.set("s", Eigen::Vector2d(later, later));
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("x"), Matrix(Eigen::Vector2d(3, -4)));
    }
    run.simulation.start();
    run.set("s", Eigen::Vector2d(1, 2));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x"), Matrix(Eigen::Vector2d(1, 2)));
}

TEST(Errors, AreAbsoluteAndRelative) {
    Running run(one("Errors", "a: {shape: 3}, b: {shape: 3}", "  a: x.x\n  b: x.y\n"));
    run.set("a", Vector3(3, 1, 2)).set("b", Vector3(2, -4, 0));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x.absolute"), Matrix(Vector3(1, 5, 2)));
    EXPECT_EQ(run.get("x.relative"), Matrix(Vector3(0.5, -1.25, std::numeric_limits<double>::infinity())));
}

TEST(MatchSignalSizes, GivesASignalTheSizeOfAnother) {
    // The size of a signal that nothing else decides.
    Running run(one("MatchSignalSizes", "a: {shape: 3}, b: {}", "  a: x.reference\n  b: x.signal\n"));
    run.set("b", Vector3(1, 2, 3));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x"), Matrix(Vector3(1, 2, 3)));
    expect_contains(
        refusal(one("MatchSignalSizes", "a: {shape: 3}, b: {shape: 2}", "  a: x.reference\n  b: x.signal\n")),
        "x: ");
}

TEST(Pinv, DampedAndTruncatedAgreeWithTheSingularValueDecomposition) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (const auto& [rows, cols] : {std::pair{3, 5}, std::pair{5, 3}, std::pair{4, 4}}) {
        Matrix A = Matrix::NullaryExpr(rows, cols, [&] { return normal(random); });
        A.row(rows - 1) = A.row(0); // lost rank
        const Eigen::JacobiSVD<Matrix> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
        const auto by = [&](auto inverse) {
            return Matrix(svd.matrixV() * svd.singularValues().unaryExpr(inverse).asDiagonal() *
                          svd.matrixU().transpose());
        };
        const std::string shape =
            "u: {shape: \"[" + std::to_string(rows) + " " + std::to_string(cols) + "]\"}";
        Running damped(one("DampPinv, tol: 0.01", shape, "  u: x\n")),
            truncated(one("TruncPinv, tol: 0.01", shape, "  u: x\n"));
        for (Running* run : {&damped, &truncated}) {
            run->set("u", A);
            ASSERT_TRUE(run->step()) << run->simulation.failure();
        }
        EXPECT_LT((damped.get("x") - by([](double s) { return s / (s * s + 0.01); })).norm(), 1e-10);
        EXPECT_LT((truncated.get("x") - by([](double s) { return s > 0.01 ? 1 / s : 0; })).norm(), 1e-10);
    }
    expect_contains(refusal(one("DampPinv, tol: -1", "u: {shape: \"[2 2]\"}", "  u: x\n")), "tol");
}

} // namespace bf::toolbox::test::utilities

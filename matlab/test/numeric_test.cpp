#include "bf/matlab/formula.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace bf::matlab;
using Eigen::MatrixXd;

namespace {

Workspace random_matrices() {
    std::srand(1);
    Workspace w;
    MatrixXd G = MatrixXd::Random(6, 6);
    w.set("A", Value(G));
    w.set("M", Value(MatrixXd(G * G.transpose() + MatrixXd::Identity(6, 6))));
    w.set("B", Value(MatrixXd(MatrixXd::Random(6, 3))));
    w.set("J", Value(MatrixXd(MatrixXd::Random(3, 6))));
    w.set("T", Value(MatrixXd(MatrixXd::Random(8, 3))));
    w.set("t", Value(MatrixXd(MatrixXd::Random(8, 1))));
    return w;
}

double difference(const Workspace& w, const char* a, const MatrixXd& b) {
    const MatrixXd value = evaluate(a, w).matrix();
    if (value.rows() != b.rows() || value.cols() != b.cols()) return HUGE_VAL;
    return b.size() == 0 ? 0 : (value - b).cwiseAbs().maxCoeff() / (1 + b.cwiseAbs().maxCoeff());
}

} // namespace

TEST(LinearAlgebra, AgreesWithOtherFactorisations) {
    const Workspace w = random_matrices();
    const MatrixXd A = w.at("A").matrix(), M = w.at("M").matrix(), B = w.at("B").matrix(),
                   J = w.at("J").matrix();
    const MatrixXd T = w.at("T").matrix(), t = w.at("t").matrix();
    EXPECT_LT(difference(w, "A*B", A * B), 1e-14);
    EXPECT_LT(difference(w, "inv(A)", A.fullPivLu().inverse()), 1e-11);
    EXPECT_LT(difference(w, "A\\B", A.fullPivLu().solve(B)), 1e-11);
    EXPECT_LT(difference(w, "J/M", M.ldlt().solve(J.transpose()).transpose()), 1e-12);
    EXPECT_LT(difference(w, "J/M*B", M.ldlt().solve(J.transpose()).transpose() * B), 1e-12);
    EXPECT_LT(difference(w, "T\\t", (T.transpose() * T).ldlt().solve(T.transpose() * t)), 1e-12);
    EXPECT_LT(difference(w, "pinv(J)", J.transpose() * (J * J.transpose()).inverse()), 1e-12);
    EXPECT_LT(difference(w, "eye(6)/A", A.inverse()), 1e-11);
    EXPECT_LT(difference(w, "det(A)", MatrixXd::Constant(1, 1, A.fullPivLu().determinant())), 1e-13);
    EXPECT_LT(
        difference(w, "norm(J)^2",
                   MatrixXd::Constant(
                       1, 1, (J * J.transpose()).selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff())),
        1e-12);
    EXPECT_LT(difference(w, "A^3", A * A * A), 1e-13);
    EXPECT_LT(difference(w, "A^-1", A.inverse()), 1e-11);
}

TEST(LinearAlgebra, PinvCountsSmallSingularValuesAsZero) {
    Workspace w;
    const MatrixXd rank_one = Eigen::Vector3d(1, 2, 2) * Eigen::RowVector2d(3, 4);
    w.set("R", Value(rank_one));
    // (u vᵀ)⁺ = v uᵀ / (|u|² |v|²)
    EXPECT_LT(difference(w, "pinv(R)", rank_one.transpose() / 225), 1e-15);
    EXPECT_LT(difference(w, "pinv(diag([1 1e-9]), 1e-6)", Eigen::Vector2d(1, 0).asDiagonal().toDenseMatrix()),
              1e-15);
    EXPECT_LT(
        difference(w, "pinv(diag([1 1e-3]), 1e-6)", Eigen::Vector2d(1, 1e3).asDiagonal().toDenseMatrix()),
        1e-15);
    EXPECT_EQ(difference(w, "pinv(zeros(2,3))", MatrixXd::Zero(3, 2)), 0);
    EXPECT_EQ(difference(w, "pinv(2, 2)", MatrixXd::Zero(1, 1)), 0)
        << "a value equal to the tolerance is zero";
}

TEST(LinearAlgebra, SingularSystemsFollowIeee) {
    EXPECT_EQ(evaluate("inv([1 2; 2 4])", Workspace()).to_text(), "[inf inf; inf inf]");
    EXPECT_EQ(evaluate("inv(0)", Workspace()).to_text(), "inf");
    EXPECT_EQ(evaluate("any(isfinite([1 2; 2 4] \\ [1; 1]))", Workspace()).to_text(), "false");
}

TEST(LinearAlgebra, EmptyOperandsGiveEmptyOrZero) {
    EXPECT_EQ(evaluate("zeros(2,0) * zeros(0,3)", Workspace()).to_text(), "[0 0 0; 0 0 0]");
    EXPECT_EQ(evaluate("inv([])", Workspace()).to_text(), "[]");
    EXPECT_EQ(evaluate("det([])", Workspace()).to_text(), "1");
    EXPECT_EQ(evaluate("norm([])", Workspace()).to_text(), "0");
    EXPECT_EQ(evaluate("pinv(zeros(0,3))", Workspace()).to_text(), "zeros(3,0)");
}

TEST(Functions, AreThoseOfTheMathematicsLibrary) {
    const Workspace w;
    for (const double x : {-0.9, -0.1, 0.0, 0.3, 0.99}) {
        Workspace at;
        at.set("x", Value(x));
        EXPECT_EQ(evaluate("sin(x)", at).scalar(), std::sin(x));
        EXPECT_EQ(evaluate("cos(x)", at).scalar(), std::cos(x));
        EXPECT_EQ(evaluate("tan(x)", at).scalar(), std::tan(x));
        EXPECT_EQ(evaluate("asin(x)", at).scalar(), std::asin(x));
        EXPECT_EQ(evaluate("acos(x)", at).scalar(), std::acos(x));
        EXPECT_EQ(evaluate("atan(x)", at).scalar(), std::atan(x));
        EXPECT_EQ(evaluate("tanh(x)", at).scalar(), std::tanh(x));
        EXPECT_EQ(evaluate("atanh(x)", at).scalar(), std::atanh(x));
        EXPECT_EQ(evaluate("exp(x)", at).scalar(), std::exp(x));
        EXPECT_EQ(evaluate("abs(x)", at).scalar(), std::abs(x));
        EXPECT_EQ(evaluate("atan2(x, -2)", at).scalar(), std::atan2(x, -2));
        EXPECT_NEAR(evaluate("log(exp(x)) + sqrt(x^2)", at).scalar(), x + std::abs(x), 1e-15);
    }
    EXPECT_EQ(evaluate("2*sqrt([4 9])/20", w).to_text(), "[0.2 0.3]");
    EXPECT_EQ(evaluate("110.8*1e-3", w).scalar(), 110.8 * 1e-3);
    EXPECT_EQ(evaluate("[1 2 3]*pi/180", w)[2], 3 * std::numbers::pi / 180);
}

TEST(Range, IsSymmetricAndEndsAtItsBound) {
    const Value x = evaluate("-1:0.1:1", Workspace());
    ASSERT_EQ(x.numel(), 21);
    for (Index i = 0; i < 21; ++i) EXPECT_EQ(x[i], -x[20 - i]);
    EXPECT_EQ(evaluate("0:0.01:10", Workspace())[1000], 10);
    EXPECT_EQ(evaluate("numel(0:0.3:1)", Workspace()).scalar(), 4);
}

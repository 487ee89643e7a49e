#include "standard_block.hpp"

#include <random>

namespace bf::test {
namespace {

TEST(Gain, MultipliesElementByElementAndExpandsScalars) {
    auto gain = make("Gain").wire("u", vector_size(3)).start().set("K", Values{2}).set("u", Values{1, -2, 3});
    ASSERT_TRUE(gain.output());
    EXPECT_EQ(list(gain.get("y")), (Values{2, -4, 6}));
    EXPECT_FALSE(gain.size("y").is_matrix);
}

TEST(Gain, MakesAColumnOfAScalarAndAColumnOfGains) {
    auto gain = make("Gain").wire("u", scalar_size()).wire("K", matrix_size(3, 1)).start();
    gain.set("K", Values{0, 0, 5}).set("u", Values{2});
    ASSERT_TRUE(gain.output());
    EXPECT_EQ(list(gain.get("y")), (Values{0, 0, 10}));
    EXPECT_EQ(gain.size("y"), matrix_size(3, 1));
    EXPECT_EQ(make("Gain").wire("u", scalar_size()).wire("K", matrix_size(1, 3)).start().size("y"),
              vector_size(3));
}

TEST(Gain, MultipliesMatricesFromBothSides) {
    const Matrix K = Matrix::Random(2, 3), u = Matrix::Random(3, 2);
    auto left = make("Gain", {{"multiplication", "K*u"}});
    left.wire("K", matrix_size(2, 3)).wire("u", matrix_size(3, 2)).start().set("K", K).set("u", u);
    ASSERT_TRUE(left.output());
    EXPECT_TRUE(left.get("y").isApprox(K * u, 1e-14));
    auto right = make("Gain", {{"multiplication", "u*K"}});
    right.wire("K", matrix_size(2, 3)).wire("u", matrix_size(3, 2)).start().set("K", K).set("u", u);
    ASSERT_TRUE(right.output());
    EXPECT_TRUE(right.get("y").isApprox(u * K, 1e-14));
}

TEST(Gain, KeepsA1DSignal1DInAMatrixProduct) {
    auto gain = make("Gain", {{"multiplication", "K*u"}});
    gain.wire("K", matrix_size(2, 3)).wire("u", vector_size(3)).start();
    EXPECT_EQ(gain.size("y"), vector_size(2));
}

TEST(Gain, ScalesByAScalarInAMatrixProduct) {
    auto gain = make("Gain", {{"multiplication", "K*u"}});
    gain.wire("u", vector_size(3)).start().set("K", Values{2}).set("u", Values{1, 2, 3});
    ASSERT_TRUE(gain.output());
    EXPECT_EQ(list(gain.get("y")), (Values{2, 4, 6}));
}

TEST(Gain, RefusesBooleans) {
    const auto text = refusal([] { make("Gain").wire("u", scalar_size(), Type::boolean).start(); });
    EXPECT_NE(text.find("cannot be of type boolean"), std::string::npos) << text;
    EXPECT_NE(text.find("insert a Convert block"), std::string::npos) << text;
}

TEST(Sum, AddsAndSubtractsBySigns) {
    auto sum = make("Sum", {{"signs", "|+-"}});
    sum.wire("u1", vector_size(2))
        .wire("u2", scalar_size())
        .start()
        .set("u1", Values{5, 7})
        .set("u2", Values{2});
    ASSERT_TRUE(sum.output());
    EXPECT_EQ(list(sum.get("y")), (Values{3, 5}));
}

TEST(Sum, TakesANumberOfInputs) {
    EXPECT_GE(make("Sum", {{"signs", 3}}).declaration().find("u3"), 0);
    EXPECT_GE(make("Sum", {{"signs", "3"}}).declaration().find("u3"), 0);
    EXPECT_LT(make("Sum", {{"signs", "3"}}).declaration().find("u4"), 0);
}

TEST(Sum, CollapsesASingleInputOverItsElements) {
    auto plus = make("Sum", {{"signs", "+"}});
    plus.wire("u1", matrix_size(2, 2)).start().set("u1", Values{1, 2, 3, 4});
    ASSERT_TRUE(plus.output());
    EXPECT_EQ(plus.scalar("y"), 10);
    auto minus = make("Sum", {{"signs", "-"}});
    minus.wire("u1", vector_size(2)).start().set("u1", Values{1, 2});
    ASSERT_TRUE(minus.output());
    EXPECT_EQ(minus.scalar("y"), -3);
    const auto& d = minus.declaration();
    EXPECT_TRUE(minus.block().feedthrough(d.find("y"), d.find("u1"))) << "through the workspace";
}

TEST(Sum, NamesPortsAndSizesThatDoNotFit) {
    const auto text =
        refusal([] { make("Sum").wire("u1", vector_size(3)).wire("u2", vector_size(4)).start(); });
    EXPECT_EQ(text,
              "input 'u1' of size [3] and input 'u2' of size [4] cannot be combined element by element; "
              "sizes must be equal or scalar");
}

TEST(Sum, RefusesSignsItDoesNotKnow) {
    EXPECT_EQ(
        refusal([] {
            make("Sum", {{"signs", "+*"}});
        }),
        "argument 'signs' is the text '+*', but must be made of '+' and '-', one per input, or be the number "
        "of inputs");
}

TEST(Sum, TakesTheFormOfAColumnBesideA1DSignal) {
    EXPECT_EQ(make("Sum").wire("u1", vector_size(3)).wire("u2", matrix_size(3, 1)).start().size("y"),
              matrix_size(3, 1));
    EXPECT_EQ(make("Sum").wire("u1", vector_size(3)).wire("u2", matrix_size(1, 3)).start().size("y"),
              matrix_size(1, 3));
}

Matrix product(const std::string& operations, const std::vector<Matrix>& operands) {
    auto block = make("Product", {{"operations", operations}, {"multiplication", "matrix"}});
    int i = 0;
    for (const auto& m : operands)
        block.wire("u" + std::to_string(++i),
                   matrix_size(static_cast<int>(m.rows()), static_cast<int>(m.cols())));
    block.start();
    i = 0;
    for (const auto& m : operands) block.set("u" + std::to_string(++i), m);
    const Status status = block.output();
    EXPECT_TRUE(status) << status.text();
    const auto& d = block.declaration();
    for (i = 1; i <= static_cast<int>(operands.size()); ++i)
        EXPECT_TRUE(block.block().feedthrough(d.find("y"), d.find("u" + std::to_string(i))));
    return block.get("y");
}

TEST(Product, MultipliesAndDividesMatricesFromLeftToRight) {
    std::srand(1);
    const Matrix a = Matrix::Random(3, 3), b = Matrix::Random(3, 3), c = Matrix::Random(3, 2);
    const auto inv = [](const Matrix& m) -> Matrix { return m.inverse(); };
    EXPECT_TRUE(product("**", {a, c}).isApprox(a * c, 1e-12));
    EXPECT_TRUE(product("***", {a, b, c}).isApprox(a * b * c, 1e-12));
    EXPECT_TRUE(product("/", {a}).isApprox(inv(a), 1e-12));
    EXPECT_TRUE(product("/*", {a, c}).isApprox(inv(a) * c, 1e-12));
    EXPECT_TRUE(product("*/", {a, b}).isApprox(a * inv(b), 1e-12));
    EXPECT_TRUE(product("*/*", {a, b, c}).isApprox(a * inv(b) * c, 1e-12));
    EXPECT_TRUE(product("//", {a, b}).isApprox(inv(a) * inv(b), 1e-12));
    EXPECT_TRUE(product("/**", {a, b, c}).isApprox(inv(a) * b * c, 1e-12));
    EXPECT_TRUE(product("*", {c}).isApprox(c, 0));
    EXPECT_TRUE(product("**", {Matrix::Constant(1, 1, 2.0), c}).isApprox(2 * c, 0));
}

TEST(Product, FailsOnASingularMatrix) {
    auto block = make("Product", {{"operations", "/"}, {"multiplication", "matrix"}});
    block.wire("u1", matrix_size(2, 2)).start().set("u1", Values{1, 2, 2, 4});
    EXPECT_FALSE(block.output());
}

TEST(Product, DividesElementByElement) {
    auto block = make("Product", {{"operations", "*/"}});
    block.wire("u1", vector_size(2))
        .wire("u2", scalar_size())
        .start()
        .set("u1", Values{3, 5})
        .set("u2", Values{2});
    ASSERT_TRUE(block.output());
    EXPECT_EQ(list(block.get("y")), (Values{1.5, 2.5}));
}

TEST(Product, CollapsesASingleInput) {
    for (const auto& [operations, expected] : {std::pair{"*", 24.0}, std::pair{"/", 1 / 24.0}}) {
        auto block = make("Product", {{"operations", operations}});
        block.wire("u1", vector_size(4)).start().set("u1", Values{1, 2, 3, 4});
        ASSERT_TRUE(block.output());
        EXPECT_DOUBLE_EQ(block.scalar("y"), expected);
    }
}

TEST(Product, RefusesMatricesThatDoNotFit) {
    const auto text = refusal([] {
        make("Product", {{"multiplication", "matrix"}})
            .wire("u1", matrix_size(3, 2))
            .wire("u2", matrix_size(3, 3))
            .start();
    });
    EXPECT_NE(text.find("input 'u1' of size 3x2 and input 'u2' of size 3x3 cannot be multiplied"),
              std::string::npos)
        << text;
}

double of_one(const std::string& block, double u, const Arguments& arguments = {}) {
    auto b = make(block, arguments).wire("u", scalar_size()).start().set("u", Values{u});
    EXPECT_TRUE(b.output());
    return b.scalar("y");
}

TEST(Functions, AreThoseOfTheStandardLibrary) {
    const auto by = [](const char* name) { return Arguments{{"function", name}}; };
    EXPECT_EQ(of_one("Abs", -3), 3);
    EXPECT_EQ(of_one("Sign", -3), -1);
    EXPECT_EQ(of_one("Square", -3), 9);
    EXPECT_EQ(of_one("Negate", 2), -2);
    EXPECT_EQ(of_one("Reciprocal", 4), 0.25);
    EXPECT_EQ(of_one("Sqrt", 2), std::sqrt(2.0));
    EXPECT_EQ(of_one("Sqrt", -4, by("signed")), -2);
    EXPECT_EQ(of_one("Sqrt", 4, by("reciprocal")), 0.5);
    EXPECT_EQ(of_one("Exp", 1), std::exp(1.0));
    EXPECT_EQ(of_one("Exp", 2, by("10")), 100);
    EXPECT_EQ(of_one("Log", 2), std::log(2.0));
    EXPECT_EQ(of_one("Log", 1000, by("10")), std::log10(1000.0));
    EXPECT_EQ(of_one("Round", -2.5), -3);
    EXPECT_EQ(of_one("Round", -2.5, by("floor")), -3);
    EXPECT_EQ(of_one("Round", -2.5, by("ceil")), -2);
    EXPECT_EQ(of_one("Round", -2.5, by("fix")), -2);
    const double x = 0.3;
    const std::pair<const char*, double (*)(double)> all[] = {
        {"sin", std::sin},   {"cos", std::cos},     {"tan", std::tan},    {"asin", std::asin},
        {"acos", std::acos}, {"atan", std::atan},   {"sinh", std::sinh},  {"cosh", std::cosh},
        {"tanh", std::tanh}, {"asinh", std::asinh}, {"atanh", std::atanh}};
    for (const auto& [name, f] : all) EXPECT_DOUBLE_EQ(of_one("Trigonometry", x, by(name)), f(x)) << name;
    EXPECT_DOUBLE_EQ(of_one("Trigonometry", 2, by("acosh")), std::acosh(2.0));
}

TEST(Functions, SineCosineGivesTheNumbersOfSineAndOfCosine) {
    constexpr int n = 10000;
    std::mt19937_64 bits(1);
    Values angles(n);
    for (int i = 0; i < n; ++i)
        angles[std::size_t(i)] = std::ldexp(double(std::int64_t(bits())), -63 + i % 24);
    const auto of = [&](RunBlock block, const char* output) {
        block.wire("u", vector_size(n)).start().set("u", angles);
        EXPECT_TRUE(block.output());
        return list(block.get(output));
    };
    for (const char* function : {"sin", "cos"})
        EXPECT_EQ(of(make("SineCosine"), function), of(make("Trigonometry", {{"function", function}}), "y"))
            << function;
}

double of_two(const std::string& block, double a, double b) {
    auto two = make(block).wire("u1", scalar_size()).wire("u2", scalar_size()).start();
    two.set("u1", Values{a}).set("u2", Values{b});
    EXPECT_TRUE(two.output());
    return two.scalar("y");
}

TEST(Functions, OfTwoArgumentsAreThoseOfTheStandardLibrary) {
    EXPECT_EQ(of_two("Power", 2, 0.5), std::pow(2, 0.5));
    EXPECT_EQ(of_two("Hypot", 3, 4), 5);
    EXPECT_EQ(of_two("Atan2", 1, -1), std::atan2(1, -1));
    EXPECT_EQ(of_two("Mod", -7, 3), 2);
    EXPECT_EQ(of_two("Rem", -7, 3), -1);
    EXPECT_EQ(of_two("Minimum", -7, 3), -7);
    EXPECT_EQ(of_two("Maximum", -7, 3), 3);
}

TEST(Reductions, AgreeWithEigen) {
    const Vector u = Vector::Random(5), v = Vector::Random(5);
    const auto of = [&](const char* name, const Arguments& arguments = {}) {
        auto b = make(name, arguments).wire("u", vector_size(5)).start().set("u", u);
        EXPECT_TRUE(b.output());
        return b.scalar("y");
    };
    EXPECT_NEAR(of("SumOfElements"), u.sum(), 1e-15);
    EXPECT_NEAR(of("ProductOfElements"), u.prod(), 1e-15);
    EXPECT_NEAR(of("Norm"), u.norm(), 1e-15);
    EXPECT_NEAR(of("Norm", {{"kind", "1"}}), u.lpNorm<1>(), 1e-15);
    EXPECT_EQ(of("Norm", {{"kind", "inf"}}), u.lpNorm<Eigen::Infinity>());
    auto dot =
        make("Dot").wire("u1", vector_size(5)).wire("u2", vector_size(5)).start().set("u1", u).set("u2", v);
    ASSERT_TRUE(dot.output());
    EXPECT_NEAR(dot.scalar("y"), u.dot(v), 1e-15);
    auto cross = make("Cross").wire("u1", vector_size(3)).wire("u2", vector_size(3)).start();
    const Vector3 a = u.head<3>(), b = v.head<3>();
    cross.set("u1", Matrix(a)).set("u2", Matrix(b));
    ASSERT_TRUE(cross.output());
    EXPECT_TRUE(cross.get("y").isApprox(a.cross(b), 1e-14));
}

TEST(LinearSolve, AgreesWithEigenForEveryMethod) {
    std::srand(2);
    const Matrix r = Matrix::Random(4, 4), A = r * r.transpose() + Matrix::Identity(4, 4),
                 b = Matrix::Random(4, 2);
    for (const char* method : {"lu", "cholesky", "least_squares"}) {
        auto solve = make("LinearSolve", {{"method", method}});
        solve.wire("A", matrix_size(4, 4)).wire("b", matrix_size(4, 2)).start().set("A", A).set("b", b);
        ASSERT_TRUE(solve.output()) << method;
        EXPECT_TRUE(solve.get("x").isApprox(A.partialPivLu().solve(b), 1e-11)) << method;
    }
    auto right = make("LinearSolve", {{"side", "right"}});
    right.wire("A", matrix_size(4, 4))
        .wire("b", matrix_size(2, 4))
        .start()
        .set("A", A)
        .set("b", Matrix(b.transpose()));
    ASSERT_TRUE(right.output());
    EXPECT_TRUE(right.get("x").isApprox(b.transpose() * A.inverse(), 1e-11));
}

TEST(LinearSolve, OfTooFewOrDependentEquationsIsTheSolutionOfSmallestNorm) {
    std::srand(4);
    const Matrix wide = Matrix::Random(3, 5), lost = Matrix::Random(6, 2) * Matrix::Random(2, 4);
    for (const Matrix& A : {wide, lost}) {
        const int rows = static_cast<int>(A.rows()), cols = static_cast<int>(A.cols());
        const Matrix b = Matrix::Random(rows, 1);
        auto solve = make("LinearSolve", {{"method", "least_squares"}});
        solve.wire("A", matrix_size(rows, cols))
            .wire("b", matrix_size(rows, 1))
            .start()
            .set("A", A)
            .set("b", b);
        ASSERT_TRUE(solve.output());
        EXPECT_TRUE(solve.get("x").isApprox(A.completeOrthogonalDecomposition().solve(b), 1e-11));
    }
}

TEST(LinearSolve, RefusesCholeskyFromTheRight) {
    EXPECT_EQ(refusal([] {
                  make("LinearSolve", {{"side", "right"}, {"method", "cholesky"}});
              }),
              "argument 'method' is 'cholesky', but b / A is solved by 'lu' only");
}

TEST(PseudoInverse, AgreesWithItsDefinition) {
    std::srand(3);
    const Matrix u = Matrix::Random(2, 4);
    auto damped = make("PseudoInverse").wire("u", matrix_size(2, 4)).start();
    damped.set("u", u).set("tolerance", Values{0.1});
    ASSERT_TRUE(damped.output());
    EXPECT_TRUE(damped.get("y").isApprox(
        u.transpose() * (u * u.transpose() + 0.1 * Matrix::Identity(2, 2)).inverse(), 1e-12));
    auto truncated =
        make("PseudoInverse", {{"method", "truncated"}}).wire("u", matrix_size(2, 4)).start().set("u", u);
    ASSERT_TRUE(truncated.output());
    EXPECT_TRUE(truncated.get("y").isApprox(u.completeOrthogonalDecomposition().pseudoInverse(), 1e-12));
}

TEST(MatrixInverse, RefusesARectangle) {
    EXPECT_EQ(refusal([] { make("MatrixInverse").wire("u", matrix_size(2, 3)).start(); }),
              "input 'u' of size 2x3 must be square");
}

TEST(Matrices, AreRearranged) {
    const Matrix m = (Matrix(2, 3) << 1, 2, 3, 4, 5, 6).finished();
    auto transpose = make("Transpose").wire("u", matrix_size(2, 3)).start().set("u", m);
    ASSERT_TRUE(transpose.output());
    EXPECT_EQ(transpose.get("y"), m.transpose());
    auto reshape = make("Reshape", {{"size", Matrix((Matrix(1, 2) << 3, 2).finished())}});
    reshape.wire("u", matrix_size(2, 3)).start().set("u", m);
    ASSERT_TRUE(reshape.output());
    EXPECT_EQ(reshape.get("y"), (Matrix(3, 2) << 1, 5, 4, 3, 2, 6).finished());
    EXPECT_EQ(make("Reshape").wire("u", matrix_size(2, 3)).start().size("y"), vector_size(6));
    auto part = make("Submatrix", {{"row", 1}, {"column", 2}, {"rows", 2}, {"columns", 2}});
    part.wire("u", matrix_size(2, 3)).start().set("u", m);
    ASSERT_TRUE(part.output());
    EXPECT_EQ(part.get("y"), m.block(0, 1, 2, 2));
    for (const bool beside : {true, false}) {
        auto join = make("ConcatenateMatrices", {{"direction", beside ? "horizontal" : "vertical"}});
        join.wire("u1", matrix_size(2, 3)).wire("u2", matrix_size(2, 3)).start().set("u1", m).set("u2", m);
        ASSERT_TRUE(join.output());
        Matrix expected(beside ? 2 : 4, beside ? 6 : 3);
        if (beside)
            expected << m, m;
        else
            expected << m, m;
        EXPECT_EQ(join.get("y"), expected);
    }
    auto blocks = make("BlockDiagonal").wire("u1", matrix_size(2, 3)).wire("u2", scalar_size()).start();
    blocks.set("u1", m).set("u2", Values{7});
    ASSERT_TRUE(blocks.output());
    Matrix expected = Matrix::Zero(3, 4);
    expected.topLeftCorner(2, 3) = m;
    expected(2, 3) = 7;
    EXPECT_EQ(blocks.get("y"), expected);
    auto skew = make("Skew").start().set("u", Values{1, 2, 3});
    ASSERT_TRUE(skew.output());
    const Vector3 v(4, 5, 7);
    EXPECT_EQ(Vector3(skew.get("y") * v), Vector3(1, 2, 3).cross(v));
    auto diagonal = make("DiagonalMatrix").wire("u", vector_size(2)).start().set("u", Values{2, 3});
    ASSERT_TRUE(diagonal.output());
    EXPECT_EQ(diagonal.get("y"), (Matrix(2, 2) << 2, 0, 0, 3).finished());
    auto identity = make("Identity", {{"size", 2}}).start();
    ASSERT_TRUE(identity.output());
    EXPECT_EQ(identity.get("y"), Matrix::Identity(2, 2));
}

TEST(Matrices, RefuseWhatDoesNotFit) {
    EXPECT_EQ(refusal([] {
                  make("Reshape", {{"size", Matrix((Matrix(1, 2) << 2, 2).finished())}})
                      .wire("u", vector_size(3))
                      .start();
              }),
              "input 'u' of size [3] has 3 elements and cannot become 2x2; change argument 'size'");
    EXPECT_EQ(refusal([] {
                  make("Submatrix", {{"row", 3}}).wire("u", matrix_size(2, 2)).start();
              }),
              "input 'u' of size 2x2 has no rows 3 to 3 and columns 1 to 1");
}

TEST(Geometry, PosesAndRotationsKeepTheirIdentities) {
    const Values rpy{0.3, -0.4, 1.1};
    auto from_rpy = make("RotationFromRollPitchYaw").start().set("u", rpy);
    ASSERT_TRUE(from_rpy.output());
    const Eigen::Matrix3d R = from_rpy.get("y");
    const Eigen::Matrix3d expected =
        (Eigen::AngleAxisd(rpy[2], Vector3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3::UnitY()) *
         Eigen::AngleAxisd(rpy[0], Vector3::UnitX()))
            .toRotationMatrix();
    EXPECT_TRUE(R.isApprox(expected, 1e-14));
    const auto convert = [](const char* name, const Matrix& u) {
        auto block = make(name).start().set("u", u);
        EXPECT_TRUE(block.output());
        return block.get("y");
    };
    EXPECT_TRUE(convert("RollPitchYawFromRotation", R).isApprox(column({0.3, -0.4, 1.1}), 1e-14));
    EXPECT_TRUE(convert("RotationFromQuaternion", convert("QuaternionFromRotation", R)).isApprox(R, 1e-14));
    EXPECT_TRUE(
        convert("RotationFromRotationVector", convert("RotationVectorFromRotation", R)).isApprox(R, 1e-14));
    const Matrix twice = 2 * convert("QuaternionFromRotation", R);
    EXPECT_TRUE(convert("RotationFromQuaternion", twice).isApprox(R, 1e-14));
    auto of_zero = make("RotationFromQuaternion").start().set("u", Values{0, 0, 0, 0});
    EXPECT_FALSE(of_zero.output());
    auto pose = make("PoseFromParts").start().set("R", Matrix(R)).set("p", Values{1, 2, 3});
    ASSERT_TRUE(pose.output());
    const Matrix H = pose.get("H");
    EXPECT_EQ(list(convert("PosePosition", H)), (Values{1, 2, 3}));
    EXPECT_EQ(convert("PoseRotation", H), R);
    EXPECT_TRUE(convert("InversePose", H).isApprox(H.inverse(), 1e-13));
    auto compose = make("ComposePoses").start().set("a_H_b", H).set("b_H_c", H);
    ASSERT_TRUE(compose.output());
    EXPECT_TRUE(compose.get("a_H_c").isApprox(H * H, 1e-14));
    for (const auto& [axis, unit] : {std::pair{"x", Vector3(1, 0, 0)}, std::pair{"y", Vector3(0, 1, 0)},
                                     std::pair{"z", Vector3(0, 0, 1)}}) {
        auto about = make("RotationAboutAxis", {{"axis", axis}}).start().set("angle", Values{0.7});
        ASSERT_TRUE(about.output());
        EXPECT_TRUE(about.get("R").isApprox(Eigen::AngleAxisd(0.7, unit).toRotationMatrix(), 1e-15));
    }
}

} // namespace
} // namespace bf::test

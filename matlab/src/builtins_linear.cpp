#include "builtins.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <cmath>

namespace bf::matlab {
namespace {

void require_square(const Call& call) {
    if (call[0].rows() != call[0].cols())
        throw Error("'" + std::string(call.name) + "' needs a square matrix, got " + call[0].size_text());
}

/// Charges the cost of a factorisation before it runs.
Matrix factorable(const Call& call) {
    call.budget().spend(10 * double(call[0].numel()) * double(std::max(call[0].rows(), call[0].cols())));
    return call[0].matrix();
}
Matrix finite(const Call& call) {
    const Matrix a = factorable(call);
    if (!a.allFinite()) throw Error("'" + std::string(call.name) + "' needs finite elements");
    return a;
}

/// The result in single precision when the argument is.
Value like(const Value& x, const Matrix& result) {
    return Value(result).as(x.type() == Class::Single ? Class::Single : Class::Double);
}

Value norm(const Call& call) {
    const Value& x = call[0];
    const bool frobenius = call.size() == 2 && call[1].is_text() && call.text(1) == "fro";
    double p = 2;
    if (call.size() == 2 && !frobenius)
        p = call[1].is_text() && (call.text(1) == "inf" || call.text(1) == "Inf") ? HUGE_VAL : call.scalar(1);
    const auto a = x.view();
    double result = 0;
    if (x.is_empty())
        result = 0;
    else if (frobenius || (x.is_vector() && p == 2))
        result = a.stableNorm();
    else if (x.is_vector() && p == HUGE_VAL)
        result = a.cwiseAbs().maxCoeff();
    else if (x.is_vector() && p == -HUGE_VAL)
        result = a.cwiseAbs().minCoeff();
    else if (x.is_vector() && p > 0)
        result = p == 1 ? a.cwiseAbs().sum() : std::pow(a.array().abs().pow(p).sum(), 1 / p);
    else if (p == 1)
        result = a.cwiseAbs().colwise().sum().maxCoeff();
    else if (p == HUGE_VAL)
        result = a.cwiseAbs().rowwise().sum().maxCoeff();
    else if (p == 2)
        result = Eigen::JacobiSVD<Matrix>(finite(call)).singularValues()(0);
    else
        throw Error("norm(A,p) of a matrix needs p = 1, 2, inf or 'fro', got " + call[1].describe());
    return like(x, Matrix::Constant(1, 1, result));
}

Value inv(const Call& call) {
    require_square(call);
    return like(call[0], inverse(factorable(call)));
}
Value pinv(const Call& call) {
    return like(call[0], pseudo_inverse(finite(call), call.size() == 2 ? call.scalar(1) : -1));
}
Value det(const Call& call) {
    require_square(call);
    const Matrix a = factorable(call);
    return like(call[0], Matrix::Constant(1, 1, a.size() == 0 ? 1 : a.partialPivLu().determinant()));
}
Value trace(const Call& call) {
    require_square(call);
    return Value(call[0].view().trace()).as(number_class(call[0].type()));
}
Value rank(const Call& call) {
    const Matrix a = finite(call);
    if (a.size() == 0) return 0;
    const double tolerance = call.size() == 2 ? call.scalar(1) : default_tolerance(a);
    return Index((Eigen::JacobiSVD<Matrix>(a).singularValues().array() > tolerance).count());
}
Value cond(const Call& call) {
    const Matrix a = finite(call);
    if (a.size() == 0) return 0;
    const Eigen::VectorXd s = Eigen::JacobiSVD<Matrix>(a).singularValues();
    return s(0) / s(s.size() - 1);
}
Value svd(const Call& call) {
    const Matrix a = finite(call);
    if (a.size() == 0) return Value::filled(Class::Double, 0, 1, 0);
    return like(call[0], Eigen::JacobiSVD<Matrix>(a).singularValues());
}
Value eig(const Call& call) {
    require_square(call);
    const Matrix a = finite(call);
    if (a.size() == 0) return Value::filled(Class::Double, 0, 1, 0);
    if (a == a.transpose())
        return like(call[0], Eigen::SelfAdjointEigenSolver<Matrix>(a, false).eigenvalues());
    const Eigen::VectorXcd values = Eigen::EigenSolver<Matrix>(a, false).eigenvalues();
    if (values.imag().cwiseAbs().maxCoeff() > 0)
        throw Error("the matrix has complex eigenvalues; complex numbers are not supported");
    return like(call[0], values.real());
}
Value chol(const Call& call) {
    require_square(call);
    const Eigen::LLT<Matrix> factor(factorable(call));
    if (call[0].numel() > 0 && factor.info() != Eigen::Success)
        throw Error("chol needs a positive definite matrix");
    return like(call[0], Matrix(factor.matrixU()));
}

Value dot(const Call& call) {
    if (!call[0].is_vector() || !call[1].is_vector() || call[0].numel() != call[1].numel())
        throw Error("size mismatch: dot of " + call[0].size_text() + " and " + call[1].size_text() +
                    "; it needs two vectors of equal length");
    double sum = 0;
    for (Index i = 0; i < call[0].numel(); ++i) sum += call[0][i] * call[1][i];
    return Value(sum).as(arithmetic_class(call[0], call[1]));
}
Value cross(const Call& call) {
    const Value &a = call[0], &b = call[1];
    if (a.numel() != 3 || b.numel() != 3 || !a.is_vector() || !b.is_vector())
        throw Error("size mismatch: cross of " + a.size_text() + " and " + b.size_text() +
                    "; it needs two vectors of 3 elements");
    const double *x = a.data(), *y = b.data();
    return Value::array(Class::Double, a.rows(), a.cols(),
                        {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]})
        .as(arithmetic_class(a, b));
}
Value kron(const Call& call) {
    const auto a = call[0].view(), b = call[1].view();
    call.budget().allocate(double(a.rows()) * double(b.rows()), double(a.cols()) * double(b.cols()));
    Matrix result(a.rows() * b.rows(), a.cols() * b.cols());
    for (Index j = 0; j < a.cols(); ++j)
        for (Index i = 0; i < a.rows(); ++i)
            result.block(i * b.rows(), j * b.cols(), b.rows(), b.cols()) = a(i, j) * b;
    return Value(result).as(arithmetic_class(call[0], call[1]));
}

} // namespace

void add_linear_algebra(Builtins& t) {
    t["norm"] = {1, 2, norm};
    t["inv"] = {1, 1, inv};
    t["pinv"] = {1, 2, pinv};
    t["det"] = {1, 1, det};
    t["trace"] = {1, 1, trace};
    t["rank"] = {1, 2, rank};
    t["cond"] = {1, 1, cond};
    t["svd"] = {1, 1, svd};
    t["eig"] = {1, 1, eig};
    t["chol"] = {1, 1, chol};
    t["dot"] = {2, 2, dot};
    t["cross"] = {2, 2, cross};
    t["kron"] = {2, 2, kron};
}

} // namespace bf::matlab

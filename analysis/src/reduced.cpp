#include "reduced.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Householder>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bf::analysis {

Vector balance(Matrix& A) {
    Vector scale = Vector::Ones(A.rows());
    constexpr int most_rounds = 100;
    bool goes_on = true;
    for (int round = 0; goes_on && round < most_rounds; ++round) {
        goes_on = false;
        for (Eigen::Index i = 0; i < A.rows(); ++i) {
            const double own = std::abs(A(i, i)), column = A.col(i).lpNorm<1>() - own,
                         row = A.row(i).lpNorm<1>() - own;
            if (!(column > 0) || !(row > 0)) continue;
            const double factor = std::exp2(std::round(0.5 * (std::log2(row) - std::log2(column))));
            if (!(column * factor + row / factor < 0.95 * (column + row))) continue;
            A.col(i) *= factor;
            A.row(i) /= factor;
            scale(i) *= factor;
            goes_on = true;
        }
    }
    return scale;
}

std::vector<Complex> eigenvalues(const Matrix& A) {
    if (A.rows() == 0) return {};
    Matrix balanced = A;
    balance(balanced);
    const Eigen::VectorXcd values = balanced.eigenvalues();
    return {values.data(), values.data() + values.size()};
}

Reduced::Reduced(const LinearSystem& one) : H_(one.A), d_(one.D(0, 0)), period_(one.period) {
    const auto n = H_.rows();
    if (n == 0) return;
    const Vector scale = balance(H_);
    Vector b = one.B.col(0).cwiseQuotient(scale);
    c_ = one.C.row(0).transpose().cwiseProduct(scale);
    Vector tail(n - 1), workspace(n);
    double tau = 0;
    b.makeHouseholder(tail, tau, beta_);
    H_.applyHouseholderOnTheLeft(tail, tau, workspace.data());
    H_.applyHouseholderOnTheRight(tail, tau, workspace.data());
    c_.applyHouseholderOnTheLeft(tail, tau, workspace.data());
    if (n < 3) return;
    const Eigen::HessenbergDecomposition<Matrix> hessenberg(H_);
    c_ = (hessenberg.matrixQ().adjoint() * c_).eval(); // which leaves the first unit vector as it is
    H_ = hessenberg.matrixH();
}

Complex Reduced::operator()(double omega) const {
    const Complex s = period_ > 0 ? std::polar(1.0, omega * period_) : Complex(0, omega);
    const auto n = H_.rows();
    if (n == 0) return d_;
    // Columns of s I - H are combined from the last one on, each time so that the last row becomes 0: what is
    // left of them is r e₁, and of C, combined alike, γ. So C (s I - H)⁻¹ β e₁ = γ β / r.
    Eigen::VectorXcd left = -H_.col(n - 1).cast<Complex>(), next(n);
    left(n - 1) += s;
    Complex gamma = c_(n - 1);
    double size = std::abs(left(0)); // of what r is the difference of
    for (Eigen::Index k = n - 1; k > 0; --k) {
        next.head(k + 1) = -H_.col(k - 1).head(k + 1).cast<Complex>();
        next(k - 1) += s;
        Complex its = c_(k - 1);
        if (std::abs(next(k)) > std::abs(left(k))) {
            left.swap(next);
            std::swap(gamma, its);
        }
        // Where both are 0 the state is not reached from the input, and its pole does not count.
        const Complex factor = left(k) == 0.0 ? 0 : next(k) / left(k);
        size = std::abs(next(0)) + std::abs(factor * left(0));
        left.head(k) = next.head(k) - factor * left.head(k);
        gamma = its - factor * gamma;
    }
    const Complex r = left(0);
    if (std::abs(r) <= 4 * std::numeric_limits<double>::epsilon() * size)
        return std::numeric_limits<double>::infinity();
    return gamma * beta_ / r + d_;
}

std::vector<Complex> Reduced::poles(double gain) const {
    if (gain == 0 || H_.rows() == 0) return eigenvalues(H_);
    Matrix closed = H_;
    closed.row(0) -= gain / (1 + gain * d_) * beta_ * c_.transpose();
    return eigenvalues(closed);
}

std::vector<Complex> Reduced::zeros() const {
    const auto n = H_.rows();
    if (n == 0) return {};
    // With D = 0 the first state is what moves the others as an input does: without it the system has the
    // same zeros, C = (γ ...) gives D = γ, and the column under H₁₁ gives B. Source: Emami-Naeini and Van
    // Dooren, Automatica 18 (1982).
    constexpr double rounding = 1e-13;
    const double speed = H_.norm(), size = c_.norm();
    double d = speed > 0 && std::abs(d_) * speed <= rounding * size * std::abs(beta_) ? 0 : d_, beta = beta_;
    Eigen::Index k = 0;
    for (; d == 0 && k < n; ++k) {
        d = std::abs(c_(k)) > rounding * size ? c_(k) : 0;
        beta = k + 1 < n ? H_(k + 1, k) : 0;
    }
    if (d == 0 || k == n) return {};
    Matrix inverse = H_.bottomRightCorner(n - k, n - k);
    inverse.row(0) -= beta / d * c_.tail(n - k).transpose();
    return eigenvalues(inverse);
}

} // namespace bf::analysis

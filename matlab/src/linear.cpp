#include "operators.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <cmath>
#include <limits>

namespace bf::matlab {

Matrix multiply(const Eigen::Ref<const Matrix>& a, const Eigen::Ref<const Matrix>& b) {
    // c_ij sums over k in ascending order, whatever the sizes
    Matrix c = Matrix::Zero(a.rows(), b.cols());
    for (Index j = 0; j < b.cols(); ++j)
        for (Index k = 0; k < a.cols(); ++k)
            for (Index i = 0; i < a.rows(); ++i) c(i, j) += a(i, k) * b(k, j);
    return c;
}

Matrix solve(const Matrix& a, const Matrix& b) {
    if (a.size() == 0 || b.size() == 0) return Matrix::Zero(a.cols(), b.cols());
    if (a.rows() == a.cols()) return a.partialPivLu().solve(b);
    return a.colPivHouseholderQr().solve(b);
}

Matrix inverse(const Matrix& a) {
    if (a.size() == 0) return a;
    const Eigen::PartialPivLU<Matrix> lu(a);
    if ((lu.matrixLU().diagonal().array() == 0).any())
        return Matrix::Constant(a.rows(), a.cols(), std::numeric_limits<double>::infinity());
    return lu.inverse();
}

Matrix pseudo_inverse(const Matrix& a, double tolerance) {
    if (a.size() == 0) return Matrix::Zero(a.cols(), a.rows());
    if (!a.allFinite()) throw Error("pinv needs finite elements");
    const Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
    Eigen::VectorXd inverted = svd.singularValues();
    for (double& s : inverted) s = s > tolerance ? 1 / s : 0;
    return svd.matrixV() * inverted.asDiagonal() * svd.matrixU().transpose();
}

double default_tolerance(const Matrix& a) {
    if (a.size() == 0 || !a.allFinite()) return 0;
    const double norm = Eigen::JacobiSVD<Matrix>(a).singularValues()(0);
    return double(std::max(a.rows(), a.cols())) * spacing(norm);
}

double spacing(double x) {
    x = std::abs(x);
    if (!std::isfinite(x)) return std::numeric_limits<double>::quiet_NaN();
    return std::nextafter(x, std::numeric_limits<double>::infinity()) - x;
}

} // namespace bf::matlab

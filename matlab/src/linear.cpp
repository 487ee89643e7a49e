#include "operators.hpp"

#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/svd.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>

#include <cmath>
#include <limits>

namespace bf::matlab {
namespace {

kernels::View<double> view(Matrix& m) {
    return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols())};
}
kernels::View<const double> view(const Matrix& m) {
    return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols())};
}

} // namespace

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
    if (a.rows() != a.cols()) return a.colPivHouseholderQr().solve(b);
    Matrix x(b.rows(), b.cols()), work(a.rows(), a.cols());
    kernels::Solve{}(view(x), view(a), view(b), view(work));
    return x;
}

Matrix inverse(const Matrix& a) {
    if (a.size() == 0) return a;
    Matrix y(a.rows(), a.cols()), work(a.rows(), a.cols());
    if (!kernels::Inverse{}(view(y), view(a), view(work)) && a.allFinite())
        y.setConstant(std::numeric_limits<double>::infinity());
    return y;
}

Matrix pseudo_inverse(const Matrix& a, double tolerance) {
    if (a.size() == 0) return Matrix::Zero(a.cols(), a.rows());
    const Index k = std::min(a.rows(), a.cols());
    Matrix y(a.cols(), a.rows()), work(k * k + a.size(), 1);
    kernels::TruncatedPinv{}(view(y), view(Matrix::Constant(1, 1, tolerance)), view(a), view(work));
    return y;
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

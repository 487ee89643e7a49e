#include "reduced.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace bf::analysis {

namespace {

using ComplexMatrix = Eigen::MatrixXcd;

/// Of a row, as a part of what it was computed from.
constexpr double rounding_of_row = 1e-13;

/// A balanced system while modes are taken out of it, with what rounding is a part of: |A|, and by rows and
/// columns C and B as they were.
struct Modes {
    Matrix A, B, C, sizes;
    Vector input_sizes, output_sizes;

    explicit Modes(const LinearSystem& system) : A(system.A) {
        const Vector scale = balance(A);
        B = scale.cwiseInverse().asDiagonal() * system.B;
        C = system.C * scale.asDiagonal();
        sizes = A.cwiseAbs();
        input_sizes = B.colwise().norm();
        output_sizes = C.rowwise().norm();
    }

    /// To the dual system, in which observable is what was controllable.
    void transpose() {
        A.transposeInPlace();
        sizes.transposeInPlace();
        B.transposeInPlace();
        C.transposeInPlace();
        B.swap(C);
        input_sizes.swap(output_sizes);
    }

    /// Of the rows of [A - λ I; C]; those of 0 have nothing to be measured.
    Vector row_sizes(const Complex& lambda) const {
        Vector all(sizes.rows() + output_sizes.size());
        all << (sizes.rowwise().norm().array() + std::abs(lambda)).matrix(), output_sizes;
        return (all.array() > 0).select(all, 1);
    }

    /// [A - λ I; C], each row by its size: where columns depend on one another there are v with A v = λ v
    /// and C v = 0, modes that are not observable. Source: the test of Popov, Belevitch and Hautus; Kailath,
    /// Linear Systems (1980).
    ComplexMatrix pencil(const Complex& lambda) const {
        const auto n = A.rows();
        ComplexMatrix all(n + C.rows(), n);
        all << A.cast<Complex>() - lambda * ComplexMatrix::Identity(n, n), C.cast<Complex>();
        return row_sizes(lambda).cwiseInverse().asDiagonal() * all;
    }

    /// Of the space of the pencil's rows.
    Eigen::ColPivHouseholderQR<ComplexMatrix> span(const Complex& lambda) const {
        Eigen::ColPivHouseholderQR<ComplexMatrix> rows;
        rows.setThreshold(rounding_of_row).compute(pencil(lambda).adjoint());
        return rows;
    }

    /// Takes out the modes at λ, and at its conjugate, that are not observable: because A v = λ v and
    /// C v = 0, what is orthogonal to v goes on without them. Were there any?
    bool take_out(const Complex& lambda) {
        const auto n = A.rows();
        const auto rows = span(lambda);
        const auto count = n - rows.rank();
        if (count == 0) return false;
        const ComplexMatrix v = ComplexMatrix(rows.householderQ()).rightCols(count);
        Matrix hidden = v.real();
        if (lambda.imag() != 0) {
            hidden.conservativeResize(n, 2 * count);
            hidden.rightCols(count) = v.imag();
        }
        // Rows are exchanged so that states without a part in what is hidden stay as they are.
        const Matrix basis = Eigen::FullPivHouseholderQR<Matrix>(hidden).matrixQ(),
                     kept = basis.rightCols(n - hidden.cols());
        A = (kept.transpose() * A * kept).eval();
        B = (kept.transpose() * B).eval();
        C = (C * kept).eval();
        sizes = (kept.cwiseAbs().transpose() * sizes * kept.cwiseAbs()).eval();
        return true;
    }
};

/// Where the pencil of a mode at jω is nearest to dependent columns, by Newton's method on its least singular
/// value: an eigenvalue that others nearly equal, or that is slow beside others, is less exact than that. It
/// stays as it is where nothing is hidden near it.
Complex refined(const Modes& modes, const Complex& from, bool is_sampled) {
    constexpr int most_rounds = 4;
    constexpr double near = 1e-5;
    const auto span = modes.span(from);
    if (span.matrixQR().diagonal().cwiseAbs().minCoeff() > 10 * near * span.maxPivot()) return from;
    Complex lambda = from;
    for (int round = 0; round < most_rounds; ++round) {
        const Eigen::JacobiSVD<ComplexMatrix> svd(modes.pencil(lambda),
                                                  Eigen::ComputeThinU | Eigen::ComputeThinV);
        const auto n = modes.A.rows();
        const double least = svd.singularValues()(n - 1);
        if (least <= 1e-2 * rounding_of_row * svd.singularValues()(0)) break;
        const Eigen::VectorXcd u =
            svd.matrixU().col(n - 1).cwiseQuotient(modes.row_sizes(lambda).cast<Complex>());
        lambda += least / u.head(n).dot(svd.matrixV().col(n - 1));
        lambda = is_sampled ? lambda / std::abs(lambda) : Complex(0, lambda.imag());
    }
    return std::abs(lambda - from) <= near * std::abs(from) ? lambda : from;
}

/// 0, or 1 and -1 of a sampled system, whatever an eigenvalue says, which of a chain of integrators is a root
/// of its rounding; and eigenvalues that are on the boundary but for rounding.
std::vector<Complex> boundary(const Matrix& A, double period) {
    std::vector<Complex> all = period > 0 ? std::vector<Complex>{1, -1} : std::vector<Complex>{0};
    constexpr double near = 1e-6;
    for (const auto& value : eigenvalues(A)) {
        const Complex s = in_s(value, period);
        if (value.imag() > near * std::abs(value) && std::abs(s.real()) <= near * std::abs(s))
            all.push_back(period > 0 ? value / std::abs(value) : Complex(0, value.imag()));
    }
    return all;
}

} // namespace

LinearSystem without_hidden(LinearSystem system) {
    if (system.A.rows() == 0) return system;
    Modes modes(system);
    bool is_changed = false;
    const auto all = boundary(system.A, system.period);
    for (int side = 0; side < 2; ++side, modes.transpose())
        for (const auto& at : all)
            // Of a chain one integrator after another is seen to be hidden.
            while (modes.A.rows() > 0 &&
                   modes.take_out(at.imag() == 0 ? at : refined(modes, at, system.period > 0)))
                is_changed = true;
    if (!is_changed) return system;
    system.A = modes.A;
    system.B = modes.B;
    system.C = modes.C;
    system.states.clear();
    return system;
}

} // namespace bf::analysis

#include "polynomial.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

namespace bf::blocks {

namespace {

void problem(Block& block, std::string text) {
    bf::detail::declared_by(block).problems.push_back(std::move(text));
}

/// Coefficients of Π(x - root), highest power first.
std::vector<double> expand(Block& block, const char* argument, const Matrix& roots) {
    const bool are_complex = roots.cols() == 2 && roots.rows() != 1;
    if (!are_complex && roots.size() > 0 && roots.rows() != 1 && roots.cols() != 1)
        problem(block, "argument '" + std::string(argument) + "' has " + std::to_string(roots.cols()) +
                           " columns; give a row of real roots, or one row [real imaginary] for each root");
    std::vector<std::complex<double>> product{1};
    const auto count = are_complex ? roots.rows() : roots.size();
    for (Eigen::Index r = 0; r < count; ++r) {
        const std::complex<double> root =
            are_complex ? std::complex<double>(roots(r, 0), roots(r, 1)) : roots.data()[r];
        product.push_back(0);
        for (std::size_t i = product.size() - 1; i > 0; --i) product[i] -= root * product[i - 1];
    }
    std::vector<double> real;
    double largest = 0, imaginary = 0;
    for (const auto& c : product) {
        real.push_back(c.real());
        largest = std::max(largest, std::abs(c.real()));
        imaginary = std::max(imaginary, std::abs(c.imag()));
    }
    if (imaginary > 1e-9 * largest)
        problem(block, "argument '" + std::string(argument) +
                           "' holds a complex root without its conjugate; give both [real imaginary] and "
                           "[real -imaginary]");
    return real;
}

} // namespace

Rational rational(Block& block, const std::vector<double>& numerator,
                  const std::vector<double>& denominator) {
    Rational result;
    if (denominator.empty() || denominator.front() == 0) {
        problem(block, "argument 'denominator' must begin with a coefficient other than 0");
        return result;
    }
    if (numerator.empty() || numerator.size() > denominator.size()) {
        problem(block, "argument 'numerator' has " + std::to_string(numerator.size()) +
                           " coefficients, the denominator " + std::to_string(denominator.size()) +
                           "; give at least one and at most as many");
        return result;
    }
    result.b.assign(denominator.size() - numerator.size(), 0.0);
    result.b.insert(result.b.end(), numerator.begin(), numerator.end());
    result.a = denominator;
    for (auto* list : {&result.b, &result.a})
        for (double& c : *list) c /= denominator.front();
    return result;
}

Rational rational(Block& block, const Matrix& zeros, const Matrix& poles, double gain) {
    const auto numerator = expand(block, "zeros", zeros), denominator = expand(block, "poles", poles);
    if (numerator.size() > denominator.size()) {
        problem(block, "there are more zeros than poles, " + std::to_string(numerator.size() - 1) + " and " +
                           std::to_string(denominator.size() - 1) + "; give at least as many poles");
        return {};
    }
    Rational result = rational(block, numerator, denominator);
    for (double& c : result.b) c *= gain;
    return result;
}

} // namespace bf::blocks

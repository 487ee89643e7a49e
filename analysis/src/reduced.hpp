// One input and one output of a linear system, in a form that is quick at many frequencies and gains.
#pragma once

#include "bf/analysis/response.hpp"

namespace bf::analysis {

/// Makes A balanced and returns the diagonal of D: D⁻¹ A D with rows and columns of like size, D of powers of
/// 2, so that what is fast does not hide what is slow in its rounding. Source: Parlett and Reinsch,
/// Numerische Mathematik 13 (1969).
Vector balance(Matrix& A);
/// Of a balanced matrix.
std::vector<Complex> eigenvalues(const Matrix& A);
/// The root in s of one in z, where it is sampled.
inline Complex in_s(const Complex& root, double period) {
    return period > 0 ? std::log(root) / period : root;
}
/// As `is_stable` says it.
bool are_stable(const std::vector<Complex>& poles, double period);

/// The same transfer function without modes on the boundary of stability (0 and jω, or |z| = 1) that are not
/// controllable or not observable: a rigid body's angle in a loop of its speed. They decide nothing of what
/// loops of these signals do, and rounding would say on which side of the boundary they are. All others stay,
/// hidden ones that grow, too. States have no names where some are gone.
LinearSystem without_hidden(LinearSystem system);
/// With one input and one output, and `without_hidden` for these.
LinearSystem single(const LinearSystem& system, int output, int input);

/// The transfer function of `single` with A balanced and an upper Hessenberg matrix H, and with B = β e₁: a
/// frequency costs O(n²), and H - k B C is such a matrix again. Source: Laub, IEEE Transactions on Automatic
/// Control 26 (1981), and Van Dooren and Verhaegen, Contemporary Mathematics 47 (1985).
class Reduced {
  public:
    Reduced(const LinearSystem& system, int output, int input) : Reduced(single(system, output, input)) {}

    /// C (s I - H)⁻¹ B + D at s = jω, or at s = exp(jω T); infinite at a pole. ω [rad/s].
    Complex operator()(double omega) const;
    /// Of the loop that is closed by negative feedback with this gain.
    std::vector<Complex> poles(double gain = 0) const;
    std::vector<Complex> zeros() const;
    double direct() const { return d_; } ///< D: at infinite frequency in continuous time
    double period() const { return period_; }

  private:
    explicit Reduced(const LinearSystem& one);

    Matrix H_;
    double beta_ = 0, d_;
    Vector c_; ///< C as a column
    double period_;
};

} // namespace bf::analysis

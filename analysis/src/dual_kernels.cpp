#include "dual_kernels.hpp"

namespace bf::analysis {

namespace {

namespace by = detail::by_name;
namespace k = kernels;
/// Kernels of which a symbol of each number would be too much text.
constexpr auto larger = by::table<Dual, ListOperand::none>(
    Kernels<k::Solve, k::SolveRight, k::Inverse, k::CholeskySolve, k::DampedPinv, k::LeastSquares,
            k::RollPitchYawFromRotation, k::QuaternionFromRotation, k::RotationLog, k::RotationExp>{});

} // namespace

const NamedKernel<Dual>* dual_kernel(std::string_view name) {
    for (const auto& one : larger)
        if (one.name == name) return &one;
    return find_kernel<Dual>(name);
}

} // namespace bf::analysis

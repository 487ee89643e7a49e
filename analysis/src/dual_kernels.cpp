#include "dual_kernels.hpp"

#include <type_traits>

namespace bf::analysis {

namespace {

namespace by = detail::by_name;
namespace k = kernels;
/// Kernels of which a symbol of each number would be too much text.
constexpr auto larger = by::table<Dual, ListOperand::none>(
    Kernels<k::Solve, k::SolveRight, k::Inverse, k::CholeskySolve, k::DampedPinv, k::LeastSquares,
            k::RollPitchYawFromRotation, k::QuaternionFromRotation, k::RotationLog, k::RotationExp>{});

template <class K> constexpr bool is_one_of(Kernels<>) { return false; }
template <class K, class First, class... Rest> constexpr bool is_one_of(Kernels<First, Rest...>) {
    return std::is_same_v<K, First> || is_one_of<K>(Kernels<Rest...>{});
}
/// Those that do not say it of themselves, as an engine would not gain by it.
using Moves = Kernels<k::BlockDiagonal, k::PartOf, k::Submatrix, k::Transpose, k::Diagonal, k::DiagonalOf,
                      k::PosePosition, k::PoseRotation>;

Structure structure(std::string_view name) {
    auto found = Structure::any;
    for_each_named_kernel([&]<class K>(K) {
        if (K::name != name) return;
        if constexpr (requires { K::is_move; } || is_one_of<K>(Moves{}))
            found = Structure::move;
        else if constexpr (requires { K::is_elementwise; })
            found = Structure::elementwise;
    });
    return found;
}

} // namespace

DualKernel dual_kernel(std::string_view name) {
    for (const auto& one : larger)
        if (one.name == name) return {&one, Structure::any};
    return {find_kernel<Dual>(name), structure(name)};
}

} // namespace bf::analysis

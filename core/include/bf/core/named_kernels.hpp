// The kernels that are templates over their numbers alone, so that they run on others than the machine's: on
// symbols, on numbers with a derivative.
#pragma once

#include "bf/kernels/chart.hpp"
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/events.hpp"
#include "bf/kernels/expression.hpp"
#include "bf/kernels/geometry.hpp"
#include "bf/kernels/guards.hpp"
#include "bf/kernels/limits.hpp"
#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/pid.hpp"
#include "bf/kernels/reduce.hpp"
#include "bf/kernels/routing.hpp"
#include "bf/kernels/sources.hpp"
#include "bf/kernels/standard.hpp"

#include <array>
#include <string_view>
#include <type_traits>
#include <utility>

namespace bf {

/// Which operand of a kernel is a list of views.
enum class ListOperand { none, first, last };

template <class... K> struct Kernels {};

namespace detail::by_name {
namespace k = kernels;
using Plain = Kernels<
    k::Copy, k::Gain, k::Add, k::Subtract, k::Multiply, k::Divide, k::Negate, k::Abs, k::Sign, k::Square,
    k::Minimum, k::Maximum, k::Mod, k::Rem, k::Sqrt, k::SignedSqrt, k::ReciprocalSqrt, k::Reciprocal, k::Exp,
    k::Log, k::Log10, k::Pow10, k::Sin, k::Cos, k::Tan, k::Asin, k::Acos, k::Atan, k::Sinh, k::Cosh, k::Tanh,
    k::Asinh, k::Acosh, k::Atanh, k::Floor, k::Ceil, k::Round, k::Fix, k::Power, k::Atan2, k::Hypot,
    k::Polynomial, k::Saturate, k::DeadZone, k::RateLimit, k::RelayMode, k::ShownMode, k::Choose, k::Backlash,
    k::Friction, k::WrapToZero, k::HitCrossing, k::Accumulate, k::AccumulateHalf, k::RisingEdge,
    k::FallingEdge, k::EitherEdge, k::LevelReset, k::Difference, k::FilterOutput, k::FilterUpdate, k::Shift,
    k::Step, k::Ramp, k::SineWave, k::LimitedRate, k::LimitReached, k::Lag, k::CompanionOutput,
    k::CompanionRate, k::DifferenceQuotient, k::Equal, k::NotEqual, k::Less, k::LessEqual, k::Greater,
    k::GreaterEqual, k::Not, k::All, k::Any, k::Inside, k::Changed, k::Increased, k::Decreased, k::SetReset,
    k::DFlipFlop, k::Advance, k::SumOfElements, k::ProductOfElements, k::MinimumOfElements,
    k::MaximumOfElements, k::Dot, k::Cross, k::PartOf, k::SineCosine, k::Pulse, k::Interpolate, k::CountUp,
    k::ElementOf, k::CountAlong, k::Quantize, k::FirstRow, k::FilterState, k::FilterInitial,
    k::LowPassCoefficients, k::MinimumJerkCoefficients, k::Place, k::Select, k::SelectMatrix, k::Submatrix,
    k::Assign, k::AssignMatrix, k::RotationX, k::RotationY, k::RotationZ, k::RotationFromRollPitchYaw,
    k::Skew, k::SkewVee, k::RotationFromQuaternion, k::QuaternionDerivative, k::RotationErrorSkew,
    k::PoseFromRotationPosition, k::PosePosition, k::PoseRotation, k::PoseComposition, k::PoseInverse,
    k::AnyPositive, k::TruthTable, k::MatrixProduct, k::ScalarOrMatrixProduct, k::StateSpace, k::Transpose,
    k::Diagonal, k::DiagonalOf, k::Identity, k::SumOfColumns, k::SumOfRows, k::Norm1, k::Norm2, k::NormInf,
    k::CumulativeSum, k::Sort, k::FindFirst, k::LookUpRow, k::Assert, k::Count, k::OnDelay, k::ActiveStates,
    k::IsCase, k::AlwaysTrue, k::Wave, k::WithinCycle, k::JKFlipFlop, k::Chirp, k::StoppedState,
    k::StoppedSide, k::BegunState, k::SwitchedMode, k::Margin, k::PositiveSign, k::StopMargins,
    k::Check<k::CheckKind::always>, k::Check<k::CheckKind::final>, k::Check<k::CheckKind::maximum>,
    k::Check<k::CheckKind::minimum>, k::Check<k::CheckKind::rms>, k::Check<k::CheckKind::mean>>;
using OfLists =
    Kernels<k::Sum, k::ElementProduct, k::MinimumOfList, k::MaximumOfList, k::And, k::Or, k::Nand, k::Nor,
            k::Xor, k::Xnor, k::Concatenate, k::ConcatenateVertically, k::BlockDiagonal, k::MultiportSwitch,
            k::IsFirst, k::Expression, k::StateMachine, k::Chart, k::ChartUpdate>;
using ToLists = Kernels<k::Split>;
} // namespace detail::by_name

/// A kernel that runs on numbers of another kind.
template <class Number> struct NamedKernel {
    using View = kernels::View<Number>;
    using List = kernels::ListView<Number>;
    std::string_view name;
    int operands; ///< a list counts as one
    ListOperand list;
    /// `views` are the operands that are no list. False where the kernel says that its operands are wrong.
    bool (*run)(const View* views, const List& list);
};

namespace detail::by_name {

template <class Number, ListOperand list, std::size_t i, std::size_t count>
decltype(auto) operand(const kernels::View<Number>* views, const kernels::ListView<Number>& its) {
    if constexpr ((list == ListOperand::first && i == 0) || (list == ListOperand::last && i + 1 == count))
        return (its);
    else
        return (views[i - (list == ListOperand::first ? 1 : 0)]);
}
template <class Number, class K, ListOperand list, std::size_t... i>
constexpr bool takes(std::index_sequence<i...>) {
    return std::is_invocable_v<const K&, decltype(operand<Number, list, i, sizeof...(i)>(
                                             std::declval<const kernels::View<Number>*>(),
                                             std::declval<const kernels::ListView<Number>&>()))...>;
}
template <class Number, class K, ListOperand list, std::size_t... i>
bool run(const kernels::View<Number>* views, const kernels::ListView<Number>& its,
         std::index_sequence<i...>) {
    constexpr auto count = sizeof...(i);
    if constexpr (std::is_same_v<decltype(K{}(operand<Number, list, i, count>(views, its)...)), bool>)
        return K{}(operand<Number, list, i, count>(views, its)...);
    K{}(operand<Number, list, i, count>(views, its)...);
    return true;
}
template <class Number, ListOperand list, class K, std::size_t count = 1>
constexpr NamedKernel<Number> named() {
    if constexpr (!takes<Number, K, list>(std::make_index_sequence<count>{}))
        return named<Number, list, K, count + 1>();
    else
        return {K::name, static_cast<int>(count), list,
                [](const kernels::View<Number>* views, const kernels::ListView<Number>& its) {
                    return run<Number, K, list>(views, its, std::make_index_sequence<count>{});
                }};
}
template <class Number, ListOperand list, class... K> constexpr auto table(Kernels<K...>) {
    return std::array<NamedKernel<Number>, sizeof...(K)>{named<Number, list, K>()...};
}
template <class Number> inline constexpr auto plain = table<Number, ListOperand::none>(Plain{});
template <class Number>
inline constexpr std::array variadic{named<Number, ListOperand::none, kernels::Pid, 19>()};
template <class Number> inline constexpr auto of_lists = table<Number, ListOperand::last>(OfLists{});
template <class Number> inline constexpr auto to_lists = table<Number, ListOperand::first>(ToLists{});

} // namespace detail::by_name

/// f(kernel) for each of them, a Kernel{} of its type.
template <class F> void for_each_named_kernel(F&& f) {
    const auto each = [&]<class... K>(Kernels<K...>) { (f(K{}), ...); };
    each(detail::by_name::Plain{});
    each(Kernels<kernels::Pid>{});
    each(detail::by_name::OfLists{});
    each(detail::by_name::ToLists{});
}

/// The kernel that prints so; null: it needs numbers of the machine.
template <class Number> const NamedKernel<Number>* find_kernel(std::string_view name) {
    namespace by = detail::by_name;
    const NamedKernel<Number>* found = nullptr;
    const auto look = [&](const auto& all) {
        for (const auto& one : all)
            if (one.name == name) found = &one;
    };
    look(by::plain<Number>);
    look(by::variadic<Number>);
    look(by::of_lists<Number>);
    look(by::to_lists<Number>);
    return found;
}

} // namespace bf

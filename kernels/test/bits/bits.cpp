// Calls every kernel with compile-time and with run-time extents and prints the bits of all operands. Built
// by several compilers and at several levels, the program must print the same text; it returns 1 when the two
// kinds of extents differ.
#include "bf/kernels/chart.hpp"
#include "bf/kernels/continuous.hpp"
#include "bf/kernels/convert.hpp"
#include "bf/kernels/discrete.hpp"
#include "bf/kernels/events.hpp"
#include "bf/kernels/expression.hpp"
#include "bf/kernels/geometry.hpp"
#include "bf/kernels/guards.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/lookup.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/overflow.hpp"
#include "bf/kernels/pid.hpp"
#include "bf/kernels/random.hpp"
#include "bf/kernels/routing.hpp"
#include "bf/kernels/sources.hpp"
#include "bf/kernels/standard.hpp"
#include "bf/kernels/svd.hpp"

#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <string>

using namespace bf::kernels;

namespace {

template <class T, int R, int C = 1> struct Array {
    T data[R * C] = {};
    bool blank = false; // `run` fills it
    FixedView<T, R, C> fixed() { return FixedView<T, R, C>{data}; }
    View<T> free() { return {data, R, C}; }
    static constexpr int size = R * C;
};

/// N arrays of R elements behind one ListView.
template <class T, int N, int R> struct List {
    T data[N * R] = {};
    bool blank = false;
    View<T> views[N];
    static constexpr int size = N * R;
    ListView<T> fixed() {
        for (int i = 0; i < N; ++i) views[i] = {data + i * R, R};
        return views;
    }
    ListView<T> free() { return fixed(); }
};

unsigned seed = 1;

template <class T> T number() {
    seed = seed * 1664525u + 1013904223u;
    const unsigned high = seed >> 8;
    if constexpr (std::is_same_v<T, bool>)
        return high % 2 == 0;
    else if constexpr (is_integer<T>)
        return static_cast<T>(high);
    else
        return static_cast<T>(static_cast<double>(high) / 4194304.0 - 2.0); // [-2, 2)
}

template <class A> [[gnu::noinline]] void fill(A& a) {
    for (int i = 0; i < A::size; ++i) a.data[i] = number<std::decay_t<decltype(a.data[0])>>();
    a.blank = false;
}

/// Random operand of a call; filled later since compilers evaluate arguments in different orders.
template <class A> A random() {
    A a;
    a.blank = true;
    return a;
}

/// Random operand at once.
template <class A> A drawn() {
    A a;
    fill(a);
    return a;
}

template <class T, class... S> Array<T, sizeof...(S)> values(S... s) {
    return {{static_cast<T>(s)...}, false};
}

struct Bytes {
    const void* data;
    int count, width;
    bool real;
};

template <class A> Bytes bytes(const A& a) {
    using T = std::decay_t<decltype(a.data[0])>;
    return {a.data, A::size, sizeof(T), is_real<T>};
}

std::string text(std::initializer_list<Bytes> operands) {
    std::string out;
    for (const Bytes& o : operands)
        for (int i = 0; i < o.count; ++i) {
            const char* const at = static_cast<const char*>(o.data) + i * o.width;
            unsigned long long bits = 0;
            std::memcpy(&bits, at, static_cast<std::size_t>(o.width));
            const auto infinity = o.width == 8 ? 0x7ff0000000000000ull : 0x7f800000ull;
            const bool nan = o.real && (bits & ~(1ull << (8 * o.width - 1))) > infinity;
            char buffer[32];
            std::snprintf(buffer, sizeof buffer, " %llx", bits);
            out += nan ? " nan" : buffer;
        }
    return out;
}

bool same = true;

[[gnu::noinline]] void report(const char* name, bool fixed_ok, bool free_ok,
                              std::initializer_list<Bytes> fixed_operands,
                              std::initializer_list<Bytes> free_operands) {
    const std::string fixed = text(fixed_operands), free = text(free_operands);
    std::printf("%s %d%s\n", name, fixed_ok, fixed.c_str());
    if (fixed == free && fixed_ok == free_ok) return;
    same = false;
    std::printf("differs from run-time extents %d%s\n", free_ok, free.c_str());
}

template <class K, class... V> bool call(K kernel, V... views) {
    if constexpr (std::is_void_v<decltype(kernel(views...))>)
        return kernel(views...), true;
    else
        return kernel(views...);
}

// There are hundreds of these: whatever knows no types stands in `report`.
template <class K, class... A> [[gnu::noinline]] void run(K kernel, A... operands) {
    ((operands.blank ? fill(operands) : void()), ...);
    const auto compare = [&](A... copies) {
        const bool fixed_ok = call(kernel, operands.fixed()...), free_ok = call(kernel, copies.free()...);
        report(K::name, fixed_ok, free_ok, {bytes(operands)...}, {bytes(copies)...});
    };
    compare(operands...);
}

template <class T> using A5 = Array<T, 5>;
template <class T> using One = Array<T, 1>;
template <class T> using A33 = Array<T, 3, 3>;
template <class T> using A44 = Array<T, 4, 4>;

template <class T, class... K> void unary(K... k) { (run(k, A5<T>(), random<A5<T>>()), ...); }
template <class Y, class T, class... K> void binary(K... k) {
    (run(k, A5<Y>(), random<A5<T>>(), random<A5<T>>()), ...);
    (run(k, A5<Y>(), random<A5<T>>(), random<One<T>>()), ...);
}
template <class Y, class T, class... K> void list(K... k) { (run(k, A5<Y>(), random<List<T, 3, 5>>()), ...); }

template <class T> void numbers() {
    unary<T>(Copy{}, Negate{}, Abs{}, Sign{}, Square{});
    binary<T, T>(Gain{}, Add{}, Subtract{}, Multiply{}, Divide{}, Minimum{}, Maximum{}, Mod{}, Rem{});
    binary<bool, T>(Equal{}, NotEqual{}, Less{}, LessEqual{}, Greater{}, GreaterEqual{});
    list<T, T>(MinimumOfList{}, MaximumOfList{});
    list<bool, T>(And{}, Or{}, Nand{}, Nor{}, Xor{}, Xnor{});
    run(Sum{}, A5<T>(), values<int>(-1, 1, -1), random<List<T, 3, 5>>());
    run(ElementProduct{}, A5<T>(), values<int>(1, -1, 1), random<List<T, 3, 5>>());
    run(Saturate{}, A5<T>(), values<T>(1), random<A5<T>>(), random<A5<T>>());
    run(DeadZone{}, A5<T>(), values<T>(0), values<T>(1), random<A5<T>>());
    run(RelayMode{}, A5<bool>(), values<T>(1), values<T>(0), random<A5<bool>>(), random<A5<T>>());
    for (const double period : {0.0, 0.1})
        run(ShownMode{}, A5<bool>(), values<double>(period), values<bool>(true), random<A5<bool>>(),
            random<A5<bool>>());
    unary<T>(Not{});
    for (auto ok : {0, 1}) {
        const One<T> control = values<T>(ok);
        run(Choose{}, A5<T>(), random<A5<T>>(), control, random<One<T>>());
        run(MultiportSwitch{}, A5<T>(), values<int>(0, 1, 2), control, random<List<T, 3, 5>>());
    }
    const auto a = drawn<A5<T>>();
    run(SumOfElements{}, One<T>(), a);
    run(ProductOfElements{}, One<T>(), a);
    run(MinimumOfElements{}, One<T>(), a);
    run(MaximumOfElements{}, One<T>(), a);
    run(Dot{}, One<T>(), a, random<A5<T>>());
    run(All{}, One<bool>(), a);
    run(Any{}, One<bool>(), a);
    run(AnyPositive{}, One<bool>(), a);
    run(RisingEdge{}, A5<bool>(), random<A5<T>>(), a);
    run(FallingEdge{}, A5<bool>(), random<A5<T>>(), a);
    run(EitherEdge{}, A5<bool>(), random<A5<T>>(), a);
    run(LevelReset{}, A5<bool>(), random<A5<T>>(), a);
    run(FirstRow{}, A5<T>(), random<Array<T, 3, 5>>());
    const auto m = drawn<Array<T, 3, 4>>();
    run(SumOfColumns{}, Array<T, 4>(), m);
    run(SumOfRows{}, Array<T, 3>(), m);
    run(Transpose{}, Array<T, 4, 3>(), m);
    run(DiagonalOf{}, Array<T, 3>(), m);
    run(Diagonal{}, Array<T, 5, 5>(), a);
    run(Identity{}, Array<T, 3, 4>());
    run(MatrixProduct{}, Array<T, 7, 5>(), random<Array<T, 7, 4>>(), random<Array<T, 4, 5>>());
    run(Concatenate{}, Array<T, 15>(), random<List<T, 3, 5>>());
    run(PartOf{}, A5<T>(), random<Array<T, 15>>(), values<double>(2));
    run(ConcatenateVertically{}, Array<T, 15>(), random<List<T, 3, 5>>());
    run(BlockDiagonal{}, Array<T, 15, 3>(), random<List<T, 3, 5>>());
    run(Split{}, List<T, 3, 5>(), random<Array<T, 15>>());
    run(Select{}, A5<T>(), values<int>(5, 1, 0, 6, 2), a);
    run(SelectMatrix{}, Array<T, 2, 2>(), values<int>(3, 1), values<int>(4, 4), m);
    run(Submatrix{}, Array<T, 2, 2>(), values<int>(2), values<int>(3), m);
    run(Assign{}, A5<T>(), values<int>(5, 1), a, random<Array<T, 2>>());
    run(AssignMatrix{}, Array<T, 3, 4>(), values<int>(3, 1), values<int>(4), m, random<One<T>>());
    run(Shift{}, Array<T, 3, 5>(), random<Array<T, 3, 5>>(), a);
    run(WrapToZero{}, A5<T>(), values<T>(1), a);
    run(Inside{}, A5<bool>(), values<int>(1, 0), values<T>(0), values<T>(1), a);
    run(TruthTable{}, Array<T, 2>(), random<Array<double, 8>>(), values<T>(1, 0));
    run(Changed{}, A5<bool>(), random<A5<T>>(), a);
    run(Increased{}, A5<bool>(), random<A5<T>>(), a);
    run(Decreased{}, A5<bool>(), random<A5<T>>(), a);
    run(CumulativeSum{}, A5<T>(), a);
    run(Margin{}, A5<double>(), a, values<T>(1));
    run(PositiveSign{}, A5<double>(), a);
    run(ElementOf{}, One<T>(), a, values<std::uint32_t>(3));
    run(CountAlong{}, One<std::uint32_t>(), a, values<std::uint32_t>(4));
    run(Sort{}, A5<T>(), A5<double>(), values<double>(1), a);
    run(FindFirst{}, One<T>(), a);
    run(Place{}, A5<double>(), values<double>(1), a);
    run(BoundedSum{}, A5<T>(), values<double>(1), values<int>(-1, 1, -1), random<List<T, 3, 5>>());
    run(BoundedProduct{}, A5<T>(), values<double>(1), values<int>(1, -1, 1), random<List<T, 3, 5>>());
    run(BoundedGain{}, A5<T>(), values<double>(0), random<A5<T>>(), a);
    for (const int how : {0, 1, 2})
        run(Lookup{}, A5<T>(), values<double>(how, how - 1, 3, 2, -1, 0, 1.5, 0, 1), random<Array<T, 6>>(),
            random<List<T, 2, 5>>(), Array<std::int32_t, 2>());
    for (const int how : {0, 1, 2})
        run(TablePiece{}, A5<std::int32_t>(), values<double>(how, how - 1), values<double>(-1, 0, 1.5), a);
    for (const int rounding : {0, 1, 2, 3, 4, 5}) {
        run(RoundingEdges{}, A5<std::int32_t>(), values<double>(rounding), a);
        run(QuotientEdges{}, A5<std::int32_t>(), values<double>(rounding), a, random<A5<T>>());
    }
    run(ExtremeElement{}, One<std::int32_t>(), values<double>(1), a);
    run(ExtremeOperand{}, A5<std::int32_t>(), values<double>(-1), random<List<T, 3, 5>>());
    run(ElementAt{}, A5<T>(), values<double>(1, 0), m, random<List<double, 2, 5>>());
    run(Prelookup{}, A5<std::uint32_t>(), A5<double>(), values<double>(0), values<double>(-1, 0, 1.5), a,
        One<std::int32_t>());
    run(Step{}, A5<T>(), values<double>(1), random<A5<T>>(), a, values<double>(1.5));
    run(Pulse{}, A5<T>(), a, values<double>(2), values<double>(50), values<double>(0.5), values<double>(4.6));
}

template <class T> void integers() {
    binary<T, T>(BitAnd{}, BitOr{}, BitXor{});
    unary<T>(BitNot{});
    list<T, T>(BitAndOfList{}, BitOrOfList{}, BitXorOfList{}, BitNandOfList{}, BitNorOfList{});
    for (const double places : {3, -2, 40})
        run(ShiftBits{}, A5<T>(), values<double>(places), random<A5<T>>());
    for (const int rounding : {0, 1, 2, 3, 4, 5})
        for (const int overflow : {0, 1, 2}) {
            const auto options = values<double>(rounding, overflow);
            run(Convert{}, A5<T>(), options, random<A5<double>>());
            run(Convert{}, A5<T>(), options, values<double>(1e12 + 7, -1e12 - 7, 300, -300, 0.5));
        }
}

/// Places 0 and 1 with fractions, as Prelookup gives them.
List<double, 2, 5> places() {
    List<double, 2, 5> list;
    for (int i = 0; i < 5; ++i) {
        list.data[i] = i % 2;
        list.data[5 + i] = 0.2 * i;
    }
    return list;
}

void states() {
    for (const int kind : {0, 1, 2}) {
        const auto with = [&](const auto& kernel, const auto&... results) {
            run(kernel, results..., values<double>(kind, kind == 1, 0.5, 1), random<A5<double>>(),
                random<A5<double>>(), random<A5<double>>(), values<double>(20), random<A5<double>>(),
                random<A5<double>>(), values<double>(0.5), values<double>(-1), values<double>(1),
                values<double>(0.01), random<A5<double>>(), random<A5<double>>(), random<A5<double>>(),
                random<A5<double>>(), random<A5<double>>());
        };
        with(Pid{}, A5<double>(), A5<double>(), A5<double>());
        with(PidBranch{}, A5<std::int32_t>());
    }
    const auto x = random<Array<double, 3, 5>>();
    const auto e = random<A5<double>>();
    const auto b = values<double>(0.5, 1, -1, 2), a = values<double>(1, 0.3, 0.2, 0.1);
    run(LimitedRate{}, A5<double>(), values<double>(-1), values<double>(1), e, e);
    run(HeldSide{}, A5<std::int32_t>(), values<std::int32_t>(0), values<double>(-1), values<double>(1), e, e);
    run(HeldSide{}, A5<std::int32_t>(), values<std::int32_t>(1), values<double>(-1), values<double>(1), e, e);
    run(PulseEdges{}, A5<double>(), values<double>(2), values<double>(50), e, values<double>(4.6));
    for (const int waveform : {0, 1, 2, 3})
        run(WaveEdges{}, A5<std::int32_t>(), values<double>(waveform), e, values<double>(4.6));
    run(CycleEdges{}, One<std::int32_t>(), values<double>(-1, 0, 2), values<double>(4.6));
    run(WholeNumber{}, A5<std::int32_t>(), e);
    run(LimitReached{}, A5<double>(), values<double>(-1), values<double>(1), e);
    run(Lag{}, A5<double>(), values<double>(0.3), e, e);
    run(ScalarOrMatrixProduct{}, Array<double, 3, 5>(), values<double>(0.3), x);
    run(ScalarOrMatrixProduct{}, Array<double, 3>(), x, e);
    for (const double row : {0., 2., 2.6, 4.}) run(LookUpRow{}, A5<double>(), x, values<double>(row));
    run(Assert{}, e);
    run(Assert{}, values<bool>(0));
    run(Count{}, One<double>(), values<double>(3), values<double>(1), values<bool>(0));
    run(OnDelay{}, One<bool>(), One<double>(), values<double>(0.2), values<double>(0.1), values<double>(0.1),
        values<bool>(1));
    // {inputs: u, events: go, variables: {n: 1}, states: {a: {exit: n = n*0.1 + u, transitions: [{to: b,
    // after: 0.3,
    //  if: u > 0}]}, b: {states: {c: {during: n = sin(n), transitions: [{to: a, on: go}]}, d: {}}}}}
    const auto chart = values<double>(
        4, 2, 1, 0, 1, 1, 1, 0, 0, 0, 0, 1, 19, 108, 89, 120, 121, 121, 122, 0, 1, 0, 1, 0, 4, 0, 0, 0, 0, 0,
        96, 0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 98, 0, 1, 0, 0, 0, 0, 1, 1, 3, 0, 4, 0, 0, 0, 0, 0, 102, 0, 0, 2, 0,
        0, 0, 4, 3, 0, 104, 0, 1, 1, 0, 0, 0, 2, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 1, 1, 1, 1,
        1, 1, 1, 0, 0, 35, 1, 3, 1, 0, 0, 51, 1, 0, 90, 0, 1, 0, 3, 0, 92, 94, 0, 0, 0, 1, 33, 3, 1, 0, 0,
        1e-06, 0, 3, 2, 0, 35, 0, 0, 33, 0, 0, 0, 0.3, 0, 41, 0, 0, 2, 0, 0, 0, 0, 0, 40, 0, 0, 44, 0, 0, 15,
        3, 0, 0, 0, 0.1, 0, 35, 0, 0, 2, 0, 0, 33, 0, 0, 6, 3, 0, 0, 12, 0, 0);
    for (const bool started : {false, true})
        for (const double state : {1., 2.}) {
            const auto p = values<double>(1), time = values<double>(0.9), period = values<double>(0.1);
            const auto x = values<double>(state, 3);
            const auto memory = values<double>(0.4, 0.4, 0.7);
            const auto was = values<bool>(started);
            const auto u = random<List<double, 2, 1>>();
            run(StateMachine{}, One<double>(), One<double>(), One<bool>(), chart, p, x, memory, was, time,
                period, u);
            run(Chart{}, One<double>(), One<double>(), One<bool>(), One<double>(), chart, p, x, memory, was,
                time, period, u);
            run(ChartUpdate{}, Array<double, 2>(), Array<double, 3>(), One<bool>(), chart, p, x, memory, was,
                time, period, u);
            run(ActiveStates{}, Array<bool, 4>(), chart, p);
        }
    for (const double which : {0., 1., 2.}) {
        run(IsFirst{}, One<bool>(), values<double>(which), random<List<bool, 2, 1>>());
        run(IsCase{}, One<bool>(), values<double>(which), values<double>(3, -1), values<double>(-1.7));
    }
    run(AlwaysTrue{}, One<bool>(), e);
    run(CompanionOutput{}, A5<double>(), b, a, x, e);
    run(CompanionRate{}, Array<double, 3, 5>(), a, x, e);
    run(DifferenceQuotient{}, A5<double>(), values<bool>(1), values<double>(0.1), e, e, values<double>(0.4),
        e);
    const auto times = values<double>(4, 2.5, 3);
    for (const double delay : {0.5, 1.7, 9.0})
        run(DelayedSample{}, A5<double>(), values<double>(7), values<double>(delay), times, x,
            values<std::uint32_t>(4), values<double>(5));
    run(KeepSample{}, Array<double, 3>(), Array<double, 3, 5>(), One<std::uint32_t>(), times, x,
        values<std::uint32_t>(4), values<double>(5), e);
    run(Advance{}, A5<double>(), values<double>(0.5), values<double>(0.01), random<A5<double>>(),
        random<A5<double>>());
    run(NextDraw{}, Array<std::uint32_t, 2>(), values<std::uint32_t>(0xFFFFFFFFu, 3));
    run(CountUp{}, One<std::uint32_t>(), values<std::uint32_t>(3), values<std::uint32_t>(3));
    const auto bit = random<One<bool>>();
    run(SetReset{}, One<bool>(), One<bool>(), bit, bit, bit);
    run(DFlipFlop{}, One<bool>(), One<bool>(), bit, bit, bit, bit);
    run(JKFlipFlop{}, One<bool>(), One<bool>(), bit, bit, bit, bit, bit);
}

template <class T> void reals() {
    unary<T>(Sqrt{}, SignedSqrt{}, ReciprocalSqrt{}, Reciprocal{}, Exp{}, Log{}, Log10{}, Pow10{}, Sin{},
             Cos{}, Tan{}, Asin{}, Acos{}, Atan{}, Sinh{}, Cosh{}, Tanh{}, Asinh{}, Acosh{}, Atanh{}, Floor{},
             Ceil{}, Round{}, Fix{});
    binary<T, T>(Power{}, Atan2{}, Hypot{}, Quantize{});
    for (double e : {2.0, -1.0, 0.5, 3.0}) run(Power{}, A5<T>(), random<A5<T>>(), values<T>(e));
    run(Power{}, A5<T>(), values<T>(2), random<A5<T>>());
    const auto u = drawn<A5<T>>();
    run(RateLimit{}, A5<T>(), values<T>(1), values<T>(-2), values<double>(0.1), random<A5<T>>(), u);
    run(SineCosine{}, A5<T>(), A5<T>(), u);
    run(Norm1{}, One<T>(), u);
    run(Norm2{}, One<T>(), u);
    run(NormInf{}, One<T>(), u);
    const auto x3 = drawn<Array<T, 3>>();
    run(Cross{}, Array<T, 3>(), x3, random<Array<T, 3>>());
    run(StateSpace{}, A5<T>(), random<Array<T, 5, 5>>(), random<Array<T, 5, 2>>(), u, random<Array<T, 2>>());

    const auto square = drawn<Array<T, 7, 7>>();
    auto positive = square; // its lower triangle, with a dominant diagonal
    for (int i = 0; i < 7; ++i) positive.fixed()(i, i) += T(30);
    const auto wide = drawn<Array<T, 4, 7>>();
    const auto tall = drawn<Array<T, 7, 4>>();
    run(Solve{}, Array<T, 7, 4>(), square, tall, Array<T, 49>());
    run(SolveRight{}, Array<T, 4, 7>(), wide, square, Array<T, 77>());
    run(Inverse{}, Array<T, 7, 7>(), square, Array<T, 49>());
    run(CholeskySolve{}, Array<T, 7, 4>(), positive, tall, Array<T, 133>());
    run(CholeskySolve{}, Array<T, 7, 13>(), positive, random<Array<T, 7, 13>>(), Array<T, 196>());
    run(MatrixProduct{}, Array<T, 23, 3>(), random<Array<T, 23, 5>>(), random<Array<T, 5, 3>>());
    run(DampedPinv{}, Array<T, 7, 4>(), values<T>(0.01), wide, Array<T, 44>());
    run(DampedPinv{}, Array<T, 4, 7>(), values<T>(0.01), tall, Array<T, 44>());
    run(TruncatedPinv{}, Array<T, 7, 4>(), values<T>(0.01), wide, Array<T, 44>());
    run(TruncatedPinv{}, Array<T, 4, 7>(), values<T>(-1), tall, Array<T, 44>());
    run(LeastSquares{}, Array<T, 4, 2>(), tall, random<Array<T, 7, 2>>(), Array<T, 46>());
    run(LeastSquares{}, Array<T, 7, 2>(), wide, random<Array<T, 4, 2>>(), Array<T, 43>());

    const auto period = values<double>(0.01);
    const auto low = values<T>(-1), high = values<T>(1);
    run(Accumulate{}, A5<T>(), values<T>(0.3), period, low, high, u, random<A5<T>>());
    run(AccumulateHalf{}, A5<T>(), values<T>(0.3), period, low, high, u, random<A5<T>>());
    run(Difference{}, A5<T>(), period, random<A5<T>>(), u);
    const auto b = drawn<Array<T, 4>>(), a = drawn<Array<T, 4>>();
    const auto s = drawn<Array<T, 3, 5>>();
    run(FilterOutput{}, A5<T>(), b, a, s, u);
    run(FilterUpdate{}, Array<T, 3, 5>(), b, a, s, random<A5<T>>(), u);
    run(FilterState{}, Array<T, 3, 5>(), b, a, s, random<Array<T, 3, 5>>());
    run(FilterInitial{}, Array<T, 3, 5>(), b, a, u, random<A5<T>>());
    run(LowPassCoefficients{}, Array<T, 2>(), Array<T, 2>(), values<T>(3), values<T>(0.01));
    run(MinimumJerkCoefficients{}, Array<T, 4>(), Array<T, 4>(), Array<T, 4>(), Array<T, 4>(), values<T>(3),
        values<T>(0.01));
    run(MedianFilter{}, A5<T>(), s, u, Array<T, 4>());

    run(RotationX{}, A33<T>(), random<One<T>>());
    run(RotationY{}, A33<T>(), random<One<T>>());
    run(RotationZ{}, A33<T>(), random<One<T>>());
    A33<T> r, r2;
    RotationFromRollPitchYaw{}(r.fixed(), drawn<Array<T, 3>>().fixed());
    RotationExp{}(r2.fixed(), drawn<Array<T, 3>>().fixed());
    run(RotationFromRollPitchYaw{}, A33<T>(), x3);
    run(RollPitchYawFromRotation{}, Array<T, 3>(), r);
    run(Skew{}, A33<T>(), x3);
    run(SkewVee{}, Array<T, 3>(), random<A33<T>>());
    run(RotationFromQuaternion{}, A33<T>(), random<Array<T, 4>>());
    run(QuaternionFromRotation{}, Array<T, 4>(), r);
    run(QuaternionDerivative{}, Array<T, 4>(), values<T>(1), random<Array<T, 4>>(), x3);
    run(RotationLog{}, Array<T, 3>(), r2);
    run(RotationExp{}, A33<T>(), x3);
    run(RotationErrorSkew{}, Array<T, 3>(), r, r2);
    const auto h = drawn<A44<T>>();
    run(PoseFromRotationPosition{}, A44<T>(), r, x3);
    run(PosePosition{}, Array<T, 3>(), h);
    run(PoseRotation{}, A33<T>(), h);
    run(PoseComposition{}, A44<T>(), h, random<A44<T>>());
    run(PoseInverse{}, A44<T>(), h);

    run(StopMargins{}, A5<double>(), A5<double>(), values<T>(0.5), random<A5<T>>(), u);
    const auto side = random<A5<T>>(), other_side = random<A5<T>>();
    run(StoppedState{}, A5<T>(), side, other_side, values<T>(-2), values<T>(3), values<T>(0.5), u);
    run(StoppedSide{}, A5<T>(), side, other_side, u);
    for (const double edge : {-1, 0, 1})
        run(BegunState{}, A5<T>(), values<double>(edge), side, values<T>(0.5), u);
    run(SwitchedMode{}, A5<T>(), side, other_side, u);
    run(QuantizeEdges{}, A5<std::int32_t>(), values<T>(0.5), u);
    run(AngleEdge{}, A5<std::int32_t>(), u, random<A5<T>>());
    run(SideOfNumber{}, One<std::int32_t>(), values<T>(-0.5));
    run(FarthestElement{}, One<std::int32_t>(), u);
    run(Polynomial{}, A5<T>(), random<Array<T, 4>>(), u);
    run(Backlash{}, A5<T>(), values<T>(0.5), random<A5<T>>(), u);
    run(Friction{}, A5<T>(), values<T>(0.5), values<T>(2), u);
    run(HitCrossing{}, A5<bool>(), values<double>(0), values<T>(0.1), values<bool>(1), random<A5<T>>(), u);
    const auto points = values<double>(-2, -1, 0.5, 1, 1.5);
    run(SplineSlopes{}, A5<double>(), points, u, A5<double>());
    run(AkimaSlopes{}, A5<double>(), points, u);
    run(Hermite{}, A5<T>(), values<double>(0), points, u, random<A5<double>>(), random<A5<T>>(),
        One<std::int32_t>());
    run(InterpolateAt{}, A5<T>(), values<double>(3), random<Array<T, 3>>(), places());

    const auto time = values<double>(1.7);
    for (const int waveform : {0, 1, 2, 3})
        run(Wave{}, A5<T>(), values<double>(waveform), u, random<A5<T>>(), time);
    run(WithinCycle{}, One<T>(), values<double>(0.5, 1, 1.25), time);
    const auto drawn_before = values<std::uint32_t>(7, 1);
    run(RandomUniform{}, A5<T>(), values<T>(-1), values<T>(3), values<std::uint32_t>(5), drawn_before);
    run(RandomNormal{}, A5<T>(), values<T>(0), values<T>(2), values<double>(0.1), values<std::uint32_t>(5),
        drawn_before);
    run(Ramp{}, A5<T>(), values<T>(0.3), values<T>(1), values<T>(2), time);
    run(SineWave{}, A5<T>(), u, random<A5<T>>(), random<A5<T>>(), values<T>(0.5), time);
    run(Chirp{}, A5<T>(), values<T>(0.1), values<T>(2), values<T>(10), time);
    run(Interpolate{}, A5<T>(), values<T>(-1, 0, 1.5), random<Array<T, 3>>(), u);
    const auto both = random<List<T, 2, 5>>();
    const auto first = double(Operation::negative), two = double(Operation::plus),
               end = double(Operation::rem) + 1;
    for (double operation = first; operation < two; ++operation) // of p(1) - u1
        run(Expression{}, A5<T>(), values<double>(3, 0, 0, 1, 0, 0, two + 1, 0, 0, operation, 0, 0),
            values<double>(0.3), both);
    for (double operation = two; operation < end; ++operation) // of u1 and u2(4)
        run(Expression{}, A5<T>(), values<double>(1, 0, 0, 2, 1, 3, operation, 0, 0), values<double>(0.3),
            both);
    // floor(u1) < u2(4)
    const auto below = double(Operation::less), floor = double(Operation::floor);
    run(ExpressionEdges{}, Array<std::int32_t, 2, 5>(),
        values<double>(1, 0, 0, floor, 0, 0, 2, 1, 3, below, 0, 0), values<double>(0.3), both);
}

} // namespace

int main() {
    numbers<double>();
    numbers<float>();
    numbers<std::int8_t>();
    numbers<std::uint32_t>();
    integers<std::int8_t>();
    integers<std::int16_t>();
    integers<std::int32_t>();
    integers<std::uint32_t>();
    reals<double>();
    reals<float>();
    states();
    unary<bool>(Copy{}, Not{});
    list<bool, bool>(And{}, Xor{});
    return same ? 0 : 1;
}

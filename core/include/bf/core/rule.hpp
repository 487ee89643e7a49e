// Rules: a kernel bound to the keys it works on. The engine runs them, the code generator prints them.
#pragma once

#include "bf/core/access.hpp"
#include "bf/core/status.hpp"
#include "bf/kernels/lanes.hpp"
#include "bf/kernels/view.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <tuple>
#include <vector>

namespace bf {

/// One resolved operand of a rule: where, and how large. Same layout as kernels::View.
struct Operand {
    void* data;
    int rows, cols;
};

/// Constant numbers that a block derives from its arguments, as an operand of rules (e.g. the signs of a
/// Sum).
class Constants {
  public:
    explicit Constants(std::vector<double> values)
        : values_(std::make_shared<const std::vector<double>>(std::move(values))) {}
    const std::shared_ptr<const std::vector<double>>& values() const { return values_; }

  private:
    std::shared_ptr<const std::vector<double>> values_;
};

/// Operands that stand for the time and the period of the step [s], and for 1 where a trigger runs it, else
/// 0.
struct AtTime {};
struct AtPeriod {};
struct AtTrigger {};
inline constexpr AtTime at_time;
inline constexpr AtPeriod at_period;
inline constexpr AtTrigger at_trigger;

/// The next value of a discrete state, target of an UpdateRule.
template <class T> struct NextOf { int index; };
template <class T> NextOf<T> next(const DiscreteState<T>& x) { return {x.index()}; }

/// What a state is after an event, target of an EventRule; as an operand what the rules before it wrote.
template <class T> struct AfterOf { int index; };
template <class T> AfterOf<T> after(const DiscreteState<T>& x) { return {x.index()}; }
template <class T> AfterOf<T> after(const ContinuousState<T>& x) { return {x.index()}; }

/// The derivative of a continuous state, target of a DerivativeRule.
template <class T> struct DerivativeOf { int index; };
template <class T> DerivativeOf<T> derivative(const ContinuousState<T>& x) { return {x.index()}; }

/// A kernel call as declared: what is printed, what is run for each element type, on which operands.
struct Call {
    enum class Source : std::uint8_t { slot, next, rate, time, period, trigger, constants };
    struct Reference {
        Source source = Source::slot;
        int slot = -1;
        bool is_written = false;
        std::shared_ptr<const std::vector<double>> constants;
    };
    using Run = Status (*)(const void* operands, int count);

    std::string_view kernel;         ///< how the generator prints it
    std::vector<Reference> operands; ///< a list operand has one reference per element
    int list_from = -1;              ///< where the list begins, -1: no list
    int list_size = 0;
    bool can_fail = false;      ///< the kernel returns whether it could do its work
    bool is_arithmetic = false; ///< see kernels::Arithmetic
    bool is_move = false;       ///< each result is an element of an operand
    int symbols = 0;            ///< how many element types the wiring decides
    std::span<const Run> run;   ///< by element type (symbols = 1) or pair of types; null: not accepted
    Run run_widest = nullptr;   ///< for doubles, with the widest registers of this processor
    Run run_scalars = nullptr;  ///< where all operands but constants are of type double with one element

    bool writes(int slot) const {
        for (const auto& o : operands)
            if (o.is_written && o.slot == slot) return true;
        return false;
    }
    bool reads(int slot) const {
        for (const auto& o : operands)
            if (!o.is_written && o.slot == slot) return true;
        return false;
    }
};

namespace detail {

template <class Q, class T0, class T1> struct Chosen { using type = typename ElementOf<Q>::type; };
template <class T0, class T1> struct Chosen<Any, T0, T1> { using type = T0; };
template <class T0, class T1> struct Chosen<Other, T0, T1> { using type = T1; };

/// How an operand of a rule reaches the kernel: element type, constness, whether it is a list.
template <class K> struct OperandTraits;
template <class T, Role role> struct OperandTraits<Key<T, role>> {
    using Quantity = T;
    static constexpr bool is_list = false;
    static constexpr bool is_target = role == Role::output || role == Role::workspace || role == Role::guard;
    static void add(Call& call, const Key<T, role>& key, bool written) {
        if (key.is_present()) call.operands.push_back({Call::Source::slot, key.index(), written, nullptr});
    }
};
template <class T, Role role> struct OperandTraits<KeyList<T, role>> {
    using Quantity = T;
    static constexpr bool is_list = true;
    static constexpr bool is_target = role == Role::output;
    static void add(Call& call, const KeyList<T, role>& list, bool written) {
        call.list_from = static_cast<int>(call.operands.size());
        call.list_size = list.size();
        for (const auto& key : list)
            call.operands.push_back({Call::Source::slot, key.index(), written, nullptr});
    }
};
template <> struct OperandTraits<Constants> {
    using Quantity = Vector;
    static constexpr bool is_list = false, is_target = false;
    static void add(Call& call, const Constants& c, bool) {
        call.operands.push_back({Call::Source::constants, -1, false, c.values()});
    }
};
template <> struct OperandTraits<AtTime> {
    using Quantity = double;
    static constexpr bool is_list = false, is_target = false;
    static void add(Call& call, AtTime, bool) {
        call.operands.push_back({Call::Source::time, -1, false, nullptr});
    }
};
template <> struct OperandTraits<AtPeriod> {
    using Quantity = double;
    static constexpr bool is_list = false, is_target = false;
    static void add(Call& call, AtPeriod, bool) {
        call.operands.push_back({Call::Source::period, -1, false, nullptr});
    }
};
template <> struct OperandTraits<AtTrigger> {
    using Quantity = double;
    static constexpr bool is_list = false, is_target = false;
    static void add(Call& call, AtTrigger, bool) {
        call.operands.push_back({Call::Source::trigger, -1, false, nullptr});
    }
};
template <class T> struct OperandTraits<NextOf<T>> {
    using Quantity = T;
    static constexpr bool is_list = false, is_target = true;
    static void add(Call& call, NextOf<T> x, bool) {
        call.operands.push_back({Call::Source::next, x.index, true, nullptr});
    }
};
template <class T> struct OperandTraits<AfterOf<T>> {
    using Quantity = T;
    static constexpr bool is_list = false, is_target = true;
    static void add(Call& call, AfterOf<T> x, bool written) {
        call.operands.push_back({Call::Source::next, x.index, written, nullptr});
    }
};
template <class T> struct OperandTraits<DerivativeOf<T>> {
    using Quantity = T;
    static constexpr bool is_list = false, is_target = true;
    static void add(Call& call, DerivativeOf<T> x, bool) {
        call.operands.push_back({Call::Source::rate, x.index, true, nullptr});
    }
};

/// How an operand reaches the kernel, whichever key it has: elements E, const where they are only read, of a
/// list of ports, or constants. Rules whose operands reach it alike share its code.
template <class E, bool is_list_, bool is_constant> struct Passed {
    static constexpr bool is_list = is_list_;
    static_assert(sizeof(Operand) == sizeof(kernels::View<E>));

    /// The view of operand i, or of the list of `length` operands that begins there. All operands but
    /// constants are scalars where `scalars` is not 0; it then is what a list has if the compiler knows it,
    /// or -1.
    template <int scalars> static auto view(const Operand* o, int i, int length) {
        if constexpr (is_list && scalars != 0)
            return kernels::ScalarListView<E, scalars>{reinterpret_cast<const kernels::View<E>*>(o + i),
                                                       length};
        else if constexpr (scalars != 0 && !is_constant)
            return kernels::FixedView<E, 1>(static_cast<E*>(o[i].data));
        else if constexpr (is_list)
            return kernels::ListView<E>(reinterpret_cast<const kernels::View<E>*>(o + i), length);
        else
            return kernels::View<E>(static_cast<E*>(o[i].data), o[i].rows, o[i].cols);
    }
};
template <class K, class T0, class T1>
using ElementOfOperand = typename Chosen<typename OperandTraits<K>::Quantity, T0, T1>::type;
template <class K, bool is_written, class T0, class T1>
using PassedAs =
    Passed<std::conditional_t<is_written, ElementOfOperand<K, T0, T1>, const ElementOfOperand<K, T0, T1>>,
           OperandTraits<K>::is_list, std::is_same_v<K, Constants>>;

template <class Kernel, class... Views> Status apply(const Views&... views) {
    if constexpr (std::is_same_v<decltype(Kernel{}(views...)), bool>) {
        if (Kernel{}(views...)) return ok;
        if constexpr (requires { Kernel::failure; })
            return Status::failure(Kernel::failure);
        else
            return Status::failure("the result is not defined for these inputs");
    } else {
        Kernel{}(views...);
        return ok;
    }
}

template <class Kernel, int scalars, class... Operands> struct Instance {
    static Status run(const void* operands, int count) { return body(operands, count); }
    /// The same, optimised for size: most element types are those of few models.
    [[gnu::cold]] static Status run_seldom(const void* operands, int count) { return body(operands, count); }
    [[gnu::always_inline]] static inline Status body(const void* operands, int count) {
        constexpr std::array<bool, sizeof...(Operands)> is_list{Operands::is_list...};
        constexpr auto list =
            static_cast<std::size_t>(std::find(is_list.begin(), is_list.end(), true) - is_list.begin());
        const auto* o = static_cast<const Operand*>(operands);
        return [&]<std::size_t... i>(std::index_sequence<i...>) {
            const int length =
                count - static_cast<int>(sizeof...(Operands)) + 1; // of the list, if there is one
            return apply<Kernel>(Operands::template view<scalars>(
                o, static_cast<int>(i) + (i > list ? length - 1 : 0), length)...);
        }
        (std::index_sequence_for<Operands...>{});
    }
    static constexpr bool can_fail =
        std::is_same_v<decltype(Kernel{}(Operands::template view<scalars>(nullptr, 0, 0)...)), bool>;
};
template <class Kernel, class T0, class T1, int scalars, class Written, class... Keys> struct InstanceOf;
template <class Kernel, class T0, class T1, int scalars, bool... written, class... Keys>
struct InstanceOf<Kernel, T0, T1, scalars, std::integer_sequence<bool, written...>, Keys...>
    : Instance<Kernel, scalars, PassedAs<Keys, written, T0, T1>...> {};

template <class Kernel, class T> constexpr bool accepted() {
    if constexpr (requires { Kernel::template accepts<T>; })
        return Kernel::template accepts<T>;
    else
        return true;
}

using ElementTypes = std::tuple<double, float, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t,
                                std::int32_t, std::uint32_t, bool>;

/// Does an operand leave that element type to the wiring?
template <int symbol, class... Keys>
inline constexpr bool has_symbol = ((type_symbol<typename OperandTraits<Keys>::Quantity> == symbol) || ...);

/// The kernel for element type t, or for the pair of types t / type_count and t % type_count. A type that no
/// operand has makes no difference: the kernel is compiled for one of them only.
template <int symbols, class Kernel, class Written, std::size_t t, class... Keys>
constexpr Call::Run instance() {
    constexpr std::size_t first = symbols == 2 ? t / type_count : t,
                          second = symbols == 2 ? t % type_count : 0;
    using T1 = std::tuple_element_t<second, ElementTypes>;
    using T0 = std::conditional_t<has_symbol<0, Keys...>, std::tuple_element_t<first, ElementTypes>, double>;
    using Symbol = std::conditional_t<has_symbol<0, Keys...>, T0, T1>;
    using Its = InstanceOf<Kernel, T0, T1, 0, Written, Keys...>;
    if constexpr (symbols != 0 && !accepted<Kernel, Symbol>())
        return nullptr;
    else if constexpr (std::is_floating_point_v<T0> &&
                       (!has_symbol<1, Keys...> || std::is_floating_point_v<T1>))
        return Its::run;
    else
        return Its::run_seldom;
}

template <int symbols, class Kernel, class Written, class... Keys> struct Instances {
    static constexpr std::size_t count = symbols == 0   ? 1
                                         : symbols == 1 ? type_count
                                                        : type_count * type_count;
    static constexpr std::array<Call::Run, count> run = []<std::size_t... t>(std::index_sequence<t...>) {
        return std::array<Call::Run, count>{instance<symbols, Kernel, Written, t, Keys...>()...};
    }
    (std::make_index_sequence<count>{});
};

/// Which operands a rule writes: workspaces, and the targets before the first operand that is read.
template <class... Keys> constexpr auto written_operands() {
    std::array<bool, sizeof...(Keys)> written{};
    constexpr std::array<bool, sizeof...(Keys)> target{OperandTraits<Keys>::is_target...};
    bool leading = true;
    for (std::size_t i = 0; i < target.size(); ++i) {
        leading = leading && target[i];
        written[i] = leading;
    }
    return written;
}
template <class K> inline constexpr bool is_workspace = false;
template <class T> inline constexpr bool is_workspace<Key<T, Role::workspace>> = true;

template <class Kernel, class... Keys> Call make_call(Kernel, const Keys&... keys) {
    constexpr auto leading = written_operands<Keys...>();
    constexpr int symbols = std::max({type_symbol<typename OperandTraits<Keys>::Quantity>...}) + 1;
    static_assert(symbols <= 2, "a rule may leave two element types to the wiring");
    Call call;
    call.kernel = Kernel::name;
    call.symbols = symbols;
    std::size_t i = 0;
    ((OperandTraits<Keys>::add(call, keys, leading[i] || is_workspace<Keys>), ++i), ...);
    i = 0;
    [&]<std::size_t... n>(Call & c, std::index_sequence<n...>) {
        constexpr auto first = written_operands<Keys...>();
        using Written = std::integer_sequence<bool, (first[n] || is_workspace<Keys>)...>;
        c.is_arithmetic = requires { Kernel::is_arithmetic; };
        c.is_move = requires { Kernel::is_move; };
        c.can_fail = InstanceOf<Kernel, double, double, 0, Written, Keys...>::can_fail;
        c.run = Instances<symbols, Kernel, Written, Keys...>::run;
        if constexpr (requires { Kernel::is_elementwise; }) {
            c.run_widest =
                kernels::Widest<InstanceOf<Kernel, double, double, 0, Written, Keys...>::run>::get();
            if constexpr (symbols <= 1) {
                c.run_scalars = InstanceOf<Kernel, double, double, -1, Written, Keys...>::run;
                if constexpr ((OperandTraits<Keys>::is_list || ...)) // most have two
                    if (c.list_size == 2)
                        c.run_scalars = InstanceOf<Kernel, double, double, 2, Written, Keys...>::run;
            }
        }
    }
    (call, std::index_sequence_for<Keys...>{});
    return call;
}

std::vector<Call>& output_rules(Block& owner);
std::vector<Call>& update_rules(Block& owner);
std::vector<Call>& derivative_rules(Block& owner);
std::vector<Call>& guard_rules(Block& owner);
std::vector<Call>& event_rules(Block& owner);

} // namespace detail

/// Declares outputs = kernel(operands): OutputRule rule{this, kernels::Gain{}, y, K, u}. Leading output keys
/// and all workspaces are written, everything else is read. One of the operands may be a list of ports.
class OutputRule {
  public:
    template <class Kernel, class... Keys> OutputRule(Block* owner, Kernel kernel, const Keys&... keys) {
        detail::output_rules(*owner).push_back(detail::make_call(kernel, keys...));
    }
};

/// Declares next states = kernel(operands): UpdateRule rule{this, kernels::Copy{}, next(x), u}.
class UpdateRule {
  public:
    template <class Kernel, class... Keys> UpdateRule(Block* owner, Kernel kernel, const Keys&... keys) {
        detail::update_rules(*owner).push_back(detail::make_call(kernel, keys...));
    }
};

/// Declares derivatives = kernel(operands): DerivativeRule rule{this, kernels::Copy{}, derivative(x), u}.
class DerivativeRule {
  public:
    template <class Kernel, class... Keys> DerivativeRule(Block* owner, Kernel kernel, const Keys&... keys) {
        detail::derivative_rules(*owner).push_back(detail::make_call(kernel, keys...));
    }
};

/// Declares zero-crossing functions = kernel(operands): GuardRule rule{this, kernels::Subtract{}, zero, u,
/// limit}. They are looked at in continuous time only, with the outputs of that instant.
class GuardRule {
  public:
    template <class Kernel, class... Keys> GuardRule(Block* owner, Kernel kernel, const Keys&... keys) {
        detail::guard_rules(*owner).push_back(detail::make_call(kernel, keys...));
    }
};

/// Declares states after an event = kernel(operands): EventRule rule{this, kernels::BegunState{}, after(x),
/// edge, guard, initial, x}. Guards hold their crossings then: 1 where they rose, -1 where they fell, else 0.
/// The rules run in their order, before the block's method `event`.
class EventRule {
  public:
    template <class Kernel, class... Keys> EventRule(Block* owner, Kernel kernel, const Keys&... keys) {
        detail::event_rules(*owner).push_back(detail::make_call(kernel, keys...));
    }
};

} // namespace bf

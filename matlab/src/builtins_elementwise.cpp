#include "builtins.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace bf::matlab {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

template <Operation op> Value apply(const Call& call) {
    return map(call[0], function_class(op, call[0].type()), computed<op>);
}
template <bool (*F)(double)> Value test(const Call& call) {
    if (!call[0].is_array()) return Value::filled(Class::Logical, call[0].rows(), call[0].cols(), 0);
    return map(call[0], Class::Logical, [](double x) { return double(F(x)); });
}
template <Operation op> Value apply_two(const Call& call) {
    const Class type = function_class(op, call[0].type(), call[1].type());
    // Numbers of class single are rounded as such, which decides what is an integer but for rounding.
    const bool is_rounded = op == Operation::mod || op == Operation::rem;
    return broadcast(call[0], call[1], type, call.name, call.budget(),
                     is_rounded && type == Class::Single ? computed_single<op> : computed_two<op>);
}
Value operate(const Call& call) {
    const Operator op = operator_functions().at(call.name);
    return is_unary(op) ? unary(op, call[0], call.budget()) : binary(op, call[0], call[1], call.budget());
}
template <Class Type> Value convert(const Call& call) { return call[0].as(Type); }

bool isnan_(double x) { return std::isnan(x); }
bool isinf_(double x) { return std::isinf(x); }
bool isfinite_(double x) { return std::isfinite(x); }

Value round_digits(const Call& call) {
    if (call.size() == 1) return apply<Operation::round>(call);
    const Class type = number_class(call[0].type());
    const double scale = std::pow(10.0, call.scalar(1));
    // An integer would saturate before it is divided again.
    const Value scaled =
        binary(Operator::Times, is_integer(type) ? call[0].as(Class::Double) : call[0], scale, call.budget());
    return binary(Operator::Rdivide, map(scaled, scaled.type(), computed<Operation::round>), scale,
                  call.budget())
        .as(type);
}

Value eps_(const Call& call) {
    if (call.size() == 0) return epsilon;
    if (call[0].type() == Class::Single)
        return map(call[0], Class::Single, [](double x) {
            const float f = std::abs(static_cast<float>(x));
            return double(std::nextafter(f, std::numeric_limits<float>::infinity()) - f);
        });
    return map(call[0], Class::Double, spacing);
}

Value exclusive_or(const Call& call) {
    return broadcast(call[0], call[1], Class::Logical, "xor", call.budget(), [](double x, double y) {
        return double(cast(x, Class::Logical) != cast(y, Class::Logical));
    });
}

/// The functions of the table, each by its name; min and max have other forms as well.
template <int op> void add_operation(Builtins& t) {
    constexpr auto operation = static_cast<Operation>(op);
    constexpr bool has_two = operation >= Operation::atan2;
    if constexpr (has_two)
        t[kernels::name_of(operation)] = {2, 2, apply_two<operation>};
    else if constexpr (operation >= Operation::abs && operation < Operation::plus)
        t[kernels::name_of(operation)] = {1, 1, apply<operation>};
}
template <int... op> void add_operations(Builtins& t, std::integer_sequence<int, op...>) {
    (add_operation<op>(t), ...);
}

template <int... type> void add_conversions(Builtins& t, std::integer_sequence<int, type...>) {
    ((t[class_name(static_cast<Class>(type))] = {1, 1, convert<static_cast<Class>(type)>}), ...);
}

} // namespace

void add_elementwise(Builtins& t) {
    add_operations(t, std::make_integer_sequence<int, kernels::operation_count>());
    t["round"] = {1, 2, round_digits};
    t["isnan"] = {1, 1, test<isnan_>};
    t["isinf"] = {1, 1, test<isinf_>};
    t["isfinite"] = {1, 1, test<isfinite_>};
    t["eps"] = {0, 1, eps_};
    t["xor"] = {2, 2, exclusive_or};

    for (const auto& [name, op] : operator_functions()) {
        const int operands = is_unary(op) ? 1 : 2;
        t[name] = {operands, operands, operate};
    }

    add_conversions(t, std::make_integer_sequence<int, static_cast<int>(Class::Logical) + 1>());
    t["boolean"] = {1, 1, convert<Class::Logical>};
}

} // namespace bf::matlab

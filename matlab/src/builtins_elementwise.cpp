#include "builtins.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace bf::matlab {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

template <bool (*F)(double)> Value test(const Call& call) {
    if (!call[0].is_array()) return Value::filled(Class::Logical, call[0].rows(), call[0].cols(), 0);
    return map(call[0], Class::Logical, [](double x) { return double(F(x)); });
}
template <Class type> Value convert(const Call& call) { return call[0].as(type); }

bool isnan_(double x) { return std::isnan(x); }
bool isinf_(double x) { return std::isinf(x); }
bool isfinite_(double x) { return std::isfinite(x); }

Value round_digits(const Call& call) {
    const Class type = number_class(call[0].type());
    const double scale = std::pow(10.0, call.scalar(1));
    // An integer would saturate before it is divided again.
    const Value scaled =
        binary(Operator::Times, is_integer(type) ? call[0].as(Class::Double) : call[0], scale, call.budget());
    return binary(Operator::Rdivide, computed(Operation::round, scaled), scale, call.budget()).as(type);
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
    const Type type = expanded(Class::Logical, shape_of(call[0]), "xor", shape_of(call[1]));
    return broadcast(call[0], call[1], type, call.budget(), [](double x, double y) {
        return double(cast(x, Class::Logical) != cast(y, Class::Logical));
    });
}

template <int... type> void add_conversions(Builtins& t, std::integer_sequence<int, type...>) {
    ((t[class_name(static_cast<Class>(type))] = {1, 1, convert<static_cast<Class>(type)>}), ...);
}

} // namespace

void add_elementwise(Builtins& t) {
    // Those of one form are computed by the rules of operators.
    for (int i = 0; i < kernels::operation_count; ++i) {
        const std::string_view name = kernels::name_of(static_cast<Operation>(i));
        for (const int operands : {1, 2})
            if (element_function(name, static_cast<std::size_t>(operands))) t[name] = {operands, operands};
    }
    t["round"] = {1, 2, round_digits};
    t["isnan"] = {1, 1, test<isnan_>};
    t["isinf"] = {1, 1, test<isinf_>};
    t["isfinite"] = {1, 1, test<isfinite_>};
    t["eps"] = {0, 1, eps_};
    t["xor"] = {2, 2, exclusive_or};

    for (const auto& [name, op] : operator_functions()) {
        const int operands = is_unary(op) ? 1 : 2;
        t[name] = {operands, operands};
    }

    add_conversions(t, std::make_integer_sequence<int, static_cast<int>(Class::Logical) + 1>());
    t["boolean"] = {1, 1, convert<Class::Logical>};
}

} // namespace bf::matlab

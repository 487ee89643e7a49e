#include "bf/kernels/scalar.hpp"

#include "builtins.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace bf::matlab {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// The class of f(x): logicals and characters become double.
Class numeric_class(const Value& x) {
    if (!x.is_array()) throw Error("expected numbers, got " + x.describe());
    return x.is_numeric() ? x.type() : Class::Double;
}

double require(bool real, const char* name, double x) {
    if (!real)
        throw Error(std::string(name) + "(" + number_text(x) +
                    ") is complex; complex numbers are not supported");
    return x;
}

template <double (*F)(double)> Value apply(const Call& call) {
    return map(call[0], numeric_class(call[0]), F);
}
template <bool (*F)(double)> Value test(const Call& call) {
    if (!call[0].is_array()) return Value::filled(Class::Logical, call[0].rows(), call[0].cols(), 0);
    return map(call[0], Class::Logical, [](double x) { return double(F(x)); });
}
template <double (*F)(double, double)> Value apply_two(const Call& call) {
    return broadcast(call[0], call[1], arithmetic_class(call[0], call[1]), call.name, call.budget(), F);
}
template <Operator Op> Value operate(const Call& call) { return binary(Op, call[0], call[1], call.budget()); }
template <Operator Op> Value operate_one(const Call& call) { return unary(Op, call[0], call.budget()); }
template <Class Type> Value convert(const Call& call) { return call[0].as(Type); }

double sqrt_(double x) { return std::sqrt(require(!(x < 0), "sqrt", x)); }
double log_(double x) { return std::log(require(!(x < 0), "log", x)); }
double log2_(double x) { return std::log2(require(!(x < 0), "log2", x)); }
double log10_(double x) { return std::log10(require(!(x < 0), "log10", x)); }
double log1p_(double x) { return std::log1p(require(!(x < -1), "log1p", x)); }
double asin_(double x) { return std::asin(require(!(std::abs(x) > 1), "asin", x)); }
double acos_(double x) { return std::acos(require(!(std::abs(x) > 1), "acos", x)); }
double acosh_(double x) { return std::acosh(require(!(x < 1), "acosh", x)); }
double atanh_(double x) { return std::atanh(require(!(std::abs(x) > 1), "atanh", x)); }
double sign(double x) { return std::isnan(x) ? x : double(x > 0) - double(x < 0); }
double sin_(double x) { return std::sin(x); }
double cos_(double x) { return std::cos(x); }
double tan_(double x) { return std::tan(x); }
double atan_(double x) { return std::atan(x); }
double sinh_(double x) { return std::sinh(x); }
double cosh_(double x) { return std::cosh(x); }
double tanh_(double x) { return std::tanh(x); }
double asinh_(double x) { return std::asinh(x); }
double exp_(double x) { return std::exp(x); }
double expm1_(double x) { return std::expm1(x); }
double abs_(double x) { return std::abs(x); }
double floor_(double x) { return std::floor(x); }
double ceil_(double x) { return std::ceil(x); }
double fix_(double x) { return std::trunc(x); }
double deg2rad(double x) { return std::numbers::pi / 180 * x; }
double rad2deg(double x) { return 180 / std::numbers::pi * x; }
double atan2_(double y, double x) { return std::atan2(y, x); }
double hypot_(double x, double y) { return std::hypot(x, y); }
bool isnan_(double x) { return std::isnan(x); }
bool isinf_(double x) { return std::isinf(x); }
bool isfinite_(double x) { return std::isfinite(x); }

/// Numbers of class single are rounded as such, which decides what is an integer but for rounding.
template <double (*F)(double, double), float (*G)(float, float)> Value apply_real(const Call& call) {
    const Class type = arithmetic_class(call[0], call[1]);
    if (type != Class::Single) return apply_two<F>(call);
    return broadcast(call[0], call[1], type, call.name, call.budget(), [](double x, double y) {
        return double(G(static_cast<float>(x), static_cast<float>(y)));
    });
}

Value round_digits(const Call& call) {
    const Class type = numeric_class(call[0]);
    if (call.size() == 1) return map(call[0], type, [](double x) { return std::round(x); });
    const double scale = std::pow(10.0, call.scalar(1));
    const Value scaled = binary(Operator::Times, call[0], scale, call.budget());
    return binary(Operator::Rdivide, map(scaled, type, [](double x) { return std::round(x); }), scale,
                  call.budget());
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
    return broadcast(call[0], call[1], Class::Logical, "xor", call.budget(),
                     [](double x, double y) { return double((x != 0) != (y != 0)); });
}

} // namespace

void add_elementwise(Builtins& t) {
    t["sin"] = {1, 1, apply<sin_>};
    t["cos"] = {1, 1, apply<cos_>};
    t["tan"] = {1, 1, apply<tan_>};
    t["asin"] = {1, 1, apply<asin_>};
    t["acos"] = {1, 1, apply<acos_>};
    t["atan"] = {1, 1, apply<atan_>};
    t["sinh"] = {1, 1, apply<sinh_>};
    t["cosh"] = {1, 1, apply<cosh_>};
    t["tanh"] = {1, 1, apply<tanh_>};
    t["asinh"] = {1, 1, apply<asinh_>};
    t["acosh"] = {1, 1, apply<acosh_>};
    t["atanh"] = {1, 1, apply<atanh_>};
    t["exp"] = {1, 1, apply<exp_>};
    t["expm1"] = {1, 1, apply<expm1_>};
    t["log"] = {1, 1, apply<log_>};
    t["log2"] = {1, 1, apply<log2_>};
    t["log10"] = {1, 1, apply<log10_>};
    t["log1p"] = {1, 1, apply<log1p_>};
    t["sqrt"] = {1, 1, apply<sqrt_>};
    t["abs"] = {1, 1, apply<abs_>};
    t["sign"] = {1, 1, apply<sign>};
    t["floor"] = {1, 1, apply<floor_>};
    t["ceil"] = {1, 1, apply<ceil_>};
    t["fix"] = {1, 1, apply<fix_>};
    t["round"] = {1, 2, round_digits};
    t["deg2rad"] = {1, 1, apply<deg2rad>};
    t["rad2deg"] = {1, 1, apply<rad2deg>};
    t["atan2"] = {2, 2, apply_two<atan2_>};
    t["hypot"] = {2, 2, apply_two<hypot_>};
    t["mod"] = {2, 2, apply_real<kernels::modulo, kernels::modulo>};
    t["rem"] = {2, 2, apply_real<kernels::remainder, kernels::remainder>};
    t["isnan"] = {1, 1, test<isnan_>};
    t["isinf"] = {1, 1, test<isinf_>};
    t["isfinite"] = {1, 1, test<isfinite_>};
    t["eps"] = {0, 1, eps_};
    t["xor"] = {2, 2, exclusive_or};

    t["plus"] = {2, 2, operate<Operator::Plus>};
    t["minus"] = {2, 2, operate<Operator::Minus>};
    t["times"] = {2, 2, operate<Operator::Times>};
    t["mtimes"] = {2, 2, operate<Operator::Mtimes>};
    t["rdivide"] = {2, 2, operate<Operator::Rdivide>};
    t["mrdivide"] = {2, 2, operate<Operator::Mrdivide>};
    t["mldivide"] = {2, 2, operate<Operator::Mldivide>};
    t["power"] = {2, 2, operate<Operator::Power>};
    t["mpower"] = {2, 2, operate<Operator::Mpower>};
    t["eq"] = {2, 2, operate<Operator::Equal>};
    t["ne"] = {2, 2, operate<Operator::NotEqual>};
    t["lt"] = {2, 2, operate<Operator::Less>};
    t["le"] = {2, 2, operate<Operator::LessEqual>};
    t["gt"] = {2, 2, operate<Operator::Greater>};
    t["ge"] = {2, 2, operate<Operator::GreaterEqual>};
    t["and"] = {2, 2, operate<Operator::And>};
    t["or"] = {2, 2, operate<Operator::Or>};
    t["not"] = {1, 1, operate_one<Operator::Not>};
    t["uminus"] = {1, 1, operate_one<Operator::UnaryMinus>};
    t["transpose"] = {1, 1, operate_one<Operator::Transpose>};
    t["ctranspose"] = {1, 1, operate_one<Operator::Transpose>};

    t["double"] = {1, 1, convert<Class::Double>};
    t["single"] = {1, 1, convert<Class::Single>};
    t["int8"] = {1, 1, convert<Class::Int8>};
    t["int16"] = {1, 1, convert<Class::Int16>};
    t["int32"] = {1, 1, convert<Class::Int32>};
    t["uint8"] = {1, 1, convert<Class::Uint8>};
    t["uint16"] = {1, 1, convert<Class::Uint16>};
    t["uint32"] = {1, 1, convert<Class::Uint32>};
    t["logical"] = {1, 1, convert<Class::Logical>};
    t["boolean"] = {1, 1, convert<Class::Logical>};
}

} // namespace bf::matlab

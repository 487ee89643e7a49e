#include "operators.hpp"

#include <algorithm>
#include <cmath>

namespace bf::matlab {
namespace {

Value multiply_values(const Value& a, const Value& b, Budget& budget) {
    const Class type = matrix_class(a.type(), b.type());
    if (a.cols() != b.rows()) throw Error(product_mismatch(a.size_text(), a.cols(), b.size_text(), b.rows()));
    budget.allocate(double(a.rows()), double(b.cols()));
    budget.spend(double(a.rows()) * double(a.cols()) * double(b.cols()));
    return Value(multiply(a.view(), b.view())).as(type);
}

Value left_divide(const Value& a, const Value& b, Budget& budget) {
    const Class type = matrix_class(a.type(), b.type());
    if (a.rows() != b.rows())
        throw Error("size mismatch: " + a.size_text() + " \\ " + b.size_text() + " (" +
                    std::to_string(a.rows()) + " and " + std::to_string(b.rows()) + " rows differ)");
    budget.allocate(double(a.cols()), double(b.cols()));
    budget.spend(double(a.numel()) * double(std::max(a.rows(), a.cols()) + b.cols()));
    return Value(solve(a.matrix(), b.matrix())).as(type);
}

Value right_divide(const Value& a, const Value& b, Budget& budget) {
    if (a.cols() != b.cols())
        throw Error("size mismatch: " + a.size_text() + " / " + b.size_text() + " (" +
                    std::to_string(a.cols()) + " and " + std::to_string(b.cols()) +
                    " columns differ); use './' for an element-wise quotient");
    return transpose(left_divide(transpose(b), transpose(a), budget));
}

Value matrix_power(const Value& a, const Value& b, Budget& budget) {
    const Class type = matrix_class(a.type(), b.type());
    if (a.rows() != a.cols() || !b.is_scalar() || b.scalar() != std::round(b.scalar()))
        throw Error("'^' needs a square matrix and a whole number, got " + a.size_text() + " ^ " +
                    b.describe() + "; use '.^' for element-wise powers");
    double n = b.scalar();
    if (std::abs(n) > 1e6) throw Error("the exponent " + number_text(n) + " exceeds 1e6");
    Matrix base = n < 0 ? inverse(a.matrix()) : a.matrix();
    Matrix result = Matrix::Identity(a.rows(), a.rows());
    for (auto bits = static_cast<std::uint64_t>(std::abs(n)); bits != 0; bits >>= 1) {
        budget.spend(2 * std::pow(double(a.rows()), 3));
        if (bits & 1) result = multiply(result, base);
        if (bits > 1) base = multiply(base, base);
    }
    return Value(result).as(type);
}

template <Operation op> double computed_swapped(double x, double y) { return computed(op, y, x); }
template <Operation op> constexpr ElementRule arithmetic{op, computed_two<op>, false, false};
template <Operation op> constexpr ElementRule comparison{op, computed_two<op>, true, false};

} // namespace

std::string_view symbol(Operator op) {
    constexpr std::string_view symbols[] = {"",   "+",  "-",  ".*", "*", "./", "/", ".\\", "\\",
                                            ".^", "^",  "==", "~=", "<", "<=", ">", ">=",  "&",
                                            "|",  "&&", "||", "~",  "+", "-",  "'"};
    return symbols[static_cast<std::size_t>(op)];
}

bool is_unary(Operator op) {
    return op == Operator::Not || op == Operator::UnaryMinus || op == Operator::UnaryPlus ||
           op == Operator::Transpose;
}

const std::unordered_map<std::string_view, Operator>& operator_functions() {
    static const std::unordered_map<std::string_view, Operator> all{{"plus", Operator::Plus},
                                                                    {"minus", Operator::Minus},
                                                                    {"times", Operator::Times},
                                                                    {"mtimes", Operator::Mtimes},
                                                                    {"rdivide", Operator::Rdivide},
                                                                    {"mrdivide", Operator::Mrdivide},
                                                                    {"ldivide", Operator::Ldivide},
                                                                    {"mldivide", Operator::Mldivide},
                                                                    {"power", Operator::Power},
                                                                    {"mpower", Operator::Mpower},
                                                                    {"eq", Operator::Equal},
                                                                    {"ne", Operator::NotEqual},
                                                                    {"lt", Operator::Less},
                                                                    {"le", Operator::LessEqual},
                                                                    {"gt", Operator::Greater},
                                                                    {"ge", Operator::GreaterEqual},
                                                                    {"and", Operator::And},
                                                                    {"or", Operator::Or},
                                                                    {"not", Operator::Not},
                                                                    {"uminus", Operator::UnaryMinus},
                                                                    {"uplus", Operator::UnaryPlus},
                                                                    {"transpose", Operator::Transpose},
                                                                    {"ctranspose", Operator::Transpose}};
    return all;
}

void Budget::spend(double operations) {
    work_ -= operations;
    if (!(work_ >= 0)) throw Error("the computation takes too many steps; is there an endless loop?");
}

void Budget::allocate(double rows, double cols) {
    if (!(rows * cols <= elements_))
        throw Error("an array of " + number_text(rows) + "x" + number_text(cols) + " exceeds the limit of " +
                    number_text(elements_) + " elements");
    spend(8 * rows * cols); // also bounds the memory that many arrays take together
}

void require_array(Class type, std::string_view symbol) {
    if (type > Class::Char)
        throw Error("operator '" + std::string(symbol) + "' does not apply to a " +
                    std::string(class_name(type)));
}

Class arithmetic_class(Class x, Class y) {
    const Class a = number_class(x), b = number_class(y);
    if (is_integer(a) && is_integer(b) && a != b)
        throw Error("integers of different classes do not mix: " + std::string(class_name(a)) + " and " +
                    std::string(class_name(b)) + "; cast one of them");
    if (is_integer(a)) return a;
    if (is_integer(b)) return b;
    return a == Class::Single || b == Class::Single ? Class::Single : Class::Double;
}

Class function_class(Operation function, Class a, Class b) {
    const Class type = arithmetic_class(a, b);
    switch (function) {
    case Operation::abs:
    case Operation::sign:
    case Operation::floor:
    case Operation::ceil:
    case Operation::round:
    case Operation::fix:
    case Operation::min:
    case Operation::max:
    case Operation::mod:
    case Operation::rem: return type;
    default: break;
    }
    if (is_integer(type))
        throw Error("'" + std::string(kernels::name_of(function)) +
                    "' computes with double or single, not with " + std::string(class_name(type)) +
                    "; cast with double(x)");
    return type;
}

Class matrix_class(Class a, Class b) {
    const Class type = arithmetic_class(a, b);
    if (is_integer(type))
        throw Error("products, quotients and powers of matrices are not computed with " +
                    std::string(class_name(type)) + "; cast with double(x)");
    return type;
}

Class joined_class(std::optional<Class> before, Class next) {
    if (next == Class::Struct || next == Class::Function)
        throw Error(next == Class::Struct ? "arrays of structs are not supported; use a cell array {a, b}"
                                          : "function handles form no array; use a cell array {f, g}");
    if (!before || *before == next) return next;
    for (const Class strongest : {Class::Cell, Class::Char})
        if (*before == strongest || next == strongest) return strongest;
    if (is_integer(*before)) return *before; // the first integer class decides
    return arithmetic_class(*before, next);
}

const ElementRule* element_rule(Operator op, bool is_scalar_a, bool is_scalar_b) {
    static constexpr ElementRule left_quotient{Operation::over, computed_swapped<Operation::over>, false,
                                               true};
    switch (op) {
    case Operator::Plus: return &arithmetic<Operation::plus>;
    case Operator::Minus: return &arithmetic<Operation::minus>;
    case Operator::Mtimes:
        if (!is_scalar_a && !is_scalar_b) return nullptr;
        [[fallthrough]];
    case Operator::Times: return &arithmetic<Operation::times>;
    case Operator::Mrdivide:
        if (!is_scalar_b) return nullptr;
        [[fallthrough]];
    case Operator::Rdivide: return &arithmetic<Operation::over>;
    case Operator::Mldivide:
        if (!is_scalar_a) return nullptr;
        [[fallthrough]];
    case Operator::Ldivide: return &left_quotient;
    case Operator::Mpower:
        if (!is_scalar_a || !is_scalar_b) return nullptr;
        [[fallthrough]];
    case Operator::Power: return &arithmetic<Operation::power>;
    case Operator::Equal: return &comparison<Operation::equal>;
    case Operator::NotEqual: return &comparison<Operation::not_equal>;
    case Operator::Less: return &comparison<Operation::less>;
    case Operator::LessEqual: return &comparison<Operation::less_equal>;
    case Operator::Greater: return &comparison<Operation::greater>;
    case Operator::GreaterEqual: return &comparison<Operation::greater_equal>;
    case Operator::And: return &comparison<Operation::logical_and>;
    case Operator::Or: return &comparison<Operation::logical_or>;
    default: return nullptr;
    }
}

std::string size_mismatch(const std::string& a, std::string_view what, const std::string& b) {
    return "size mismatch: " + a + " " + std::string(what) + " " + b +
           "; sizes must be equal, or 1 where they differ";
}

std::string product_mismatch(const std::string& a, Index cols, const std::string& b, Index rows) {
    return "size mismatch: " + a + " * " + b + " (inner lengths " + std::to_string(cols) + " and " +
           std::to_string(rows) + " differ); use '.*' for an element-wise product";
}

std::string join_mismatch(const std::string& a, Index of_a, const std::string& b, Index of_b, bool is_row) {
    return "size mismatch: " + a + (is_row ? " beside " : " above ") + b + " (" + std::to_string(of_a) +
           " and " + std::to_string(of_b) + (is_row ? " rows differ)" : " columns differ)");
}

Value broadcast(const Value& a, const Value& b, Class type, std::string_view what, Budget& budget,
                double (*f)(double, double)) {
    if (a.is_scalar() && b.is_scalar())
        return Value::array(type, 1, 1, {cast(f(*a.data(), *b.data()), type)});
    const auto all_rows = expanded(a.rows(), b.rows()), all_cols = expanded(a.cols(), b.cols());
    if (!all_rows || !all_cols) throw Error(size_mismatch(a.size_text(), what, b.size_text()));
    const Index rows = *all_rows, cols = *all_cols;
    budget.allocate(double(rows), double(cols));
    const double *x = a.data(), *y = b.data();
    const Index x_row = a.rows() != 1, y_row = b.rows() != 1;
    const Index x_col = a.cols() != 1 ? a.rows() : 0, y_col = b.cols() != 1 ? b.rows() : 0;
    Value::Numbers result(rows * cols);
    for (Index j = 0; j < cols; ++j)
        for (Index i = 0; i < rows; ++i)
            result[i + j * rows] = cast(f(x[i * x_row + j * x_col], y[i * y_row + j * y_col]), type);
    return Value::array(type, rows, cols, std::move(result));
}

Value map(const Value& a, Class type, double (*f)(double)) {
    Value::Numbers result(a.data(), a.data() + a.numel());
    for (double& x : result) x = cast(f(x), type);
    return Value::array(type, a.rows(), a.cols(), std::move(result));
}

double computed(Operation op, double x) {
    if (!kernels::is_defined(op, x)) {
        if (op == Operation::logical_not) throw Error("NaN cannot become logical; test it with isnan");
        throw Error(std::string(kernels::name_of(op)) + "(" + number_text(x) +
                    ") is complex; complex numbers are not supported");
    }
    return kernels::value_of(op, x);
}

double computed(Operation op, double x, double y) {
    if (!kernels::is_defined(op, x, y)) {
        if (op != Operation::power) throw Error("NaN cannot become logical; test it with isnan");
        throw Error(number_text(x) + "^" + number_text(y) + " is complex; complex numbers are not supported");
    }
    return kernels::value_of(op, x, y);
}

Value binary(Operator op, const Value& a, const Value& b, Budget& budget) {
    const std::string_view what = symbol(op);
    require_array(a.type(), what);
    require_array(b.type(), what);
    if (const ElementRule* rule = element_rule(op, a.is_scalar(), b.is_scalar()))
        return broadcast(a, b, rule->result(a.type(), b.type()), what, budget, rule->value);
    switch (op) {
    case Operator::Mtimes: return multiply_values(a, b, budget);
    case Operator::Mrdivide: return right_divide(a, b, budget);
    case Operator::Mldivide: return left_divide(a, b, budget);
    case Operator::Mpower: return matrix_power(a, b, budget);
    default: throw Error("operator '" + std::string(what) + "' takes one operand");
    }
}

Value unary(Operator op, const Value& a, Budget& budget) {
    if (op == Operator::Transpose) {
        budget.spend(double(a.numel()));
        return transpose(a);
    }
    require_array(a.type(), symbol(op));
    budget.spend(double(a.numel()));
    const Class type = number_class(a.type());
    if (op == Operator::UnaryMinus) return map(a, type, computed<Operation::negative>);
    if (op == Operator::UnaryPlus) return a.as(type);
    return map(a, Class::Logical, computed<Operation::logical_not>);
}

Value range(const Value& first, const Value& step, const Value& last, Budget& budget) {
    const Class type = arithmetic_class(first, last);
    const double a = first.scalar(), d = step.scalar(), b = last.scalar();
    if (std::isnan(a) || std::isnan(d) || std::isnan(b) || std::isinf(a) || std::isinf(d))
        throw Error("a range needs finite bounds, got " + number_text(a) + ":" + number_text(d) + ":" +
                    number_text(b));
    const double direction = d > 0 ? 1 : -1;
    if (d == 0 || direction * (b - a) < 0) return Value::array(type, 1, 0, {});
    // the number of steps tolerates that bounds such as 0:0.1:1 are rounded
    const double tolerance = 2 * spacing(std::max(std::abs(a), std::abs(b)));
    double steps = std::round((b - a) / d);
    if (direction * (a + steps * d - b) > tolerance) steps -= 1;
    budget.allocate(1, steps + 1);
    const auto n = static_cast<Index>(steps);
    double end = a + steps * d;
    if (direction * (end - b) > -tolerance) end = b;
    Value::Numbers result(n + 1);
    for (Index k = 0; k <= n / 2; ++k) { // both halves count from their own end, so 0 stays 0 in -1:0.1:1
        result[n - k] = cast(end - double(k) * d, type);
        result[k] = cast(a + double(k) * d, type);
    }
    if (n > 0 && n % 2 == 0) result[n / 2] = cast((a + end) / 2, type);
    return Value::array(type, 1, n + 1, std::move(result));
}

Value transpose(const Value& a) {
    const Index rows = a.rows(), cols = a.cols();
    if (a.is_cell()) {
        Value result = Value::cell(cols, rows);
        for (Index i = 0; i < rows; ++i)
            for (Index j = 0; j < cols; ++j) result.set_at(j + i * cols, a.at(i + j * rows));
        return result;
    }
    if (!a.is_array()) return a;
    if (a.is_vector()) return a.reshaped(cols, rows);
    Value::Numbers result(a.numel());
    for (Index i = 0; i < rows; ++i)
        for (Index j = 0; j < cols; ++j) result[j + i * cols] = a[i + j * rows];
    return Value::array(a.type(), cols, rows, std::move(result));
}

} // namespace bf::matlab

#include "operators.hpp"

#include <algorithm>
#include <cmath>

namespace bf::matlab {
namespace {

Class matrix_class(Class a, Class b) {
    const Class type = arithmetic_class(a, b);
    if (is_integer(type))
        throw Error("products, quotients and powers of matrices are not computed with " +
                    std::string(class_name(type)) + "; cast with double(x)");
    return type;
}

void require_array(const Type& type, std::string_view symbol) {
    if (type.element > Class::Char)
        throw Error("operator '" + std::string(symbol) + "' does not apply to a " +
                    std::string(class_name(type.element)));
}

Value multiply_values(const Value& a, const Value& b, const Type& type, Budget& budget) {
    budget.allocate(double(a.rows()), double(b.cols()));
    budget.spend(double(a.rows()) * double(a.cols()) * double(b.cols()));
    return Value(multiply(a.view(), b.view())).as(type.element);
}

Value left_divide(const Value& a, const Value& b, const Type& type, Budget& budget) {
    if (a.rows() != b.rows())
        throw Error("size mismatch: " + a.size_text() + " \\ " + b.size_text() + " (" +
                    std::to_string(a.rows()) + " and " + std::to_string(b.rows()) + " rows differ)");
    budget.allocate(double(a.cols()), double(b.cols()));
    budget.spend(double(a.numel()) * double(std::max(a.rows(), a.cols()) + b.cols()));
    return Value(solve(a.matrix(), b.matrix())).as(type.element);
}

Value right_divide(const Value& a, const Value& b, const Type& type, Budget& budget) {
    if (a.cols() != b.cols())
        throw Error("size mismatch: " + a.size_text() + " / " + b.size_text() + " (" +
                    std::to_string(a.cols()) + " and " + std::to_string(b.cols()) +
                    " columns differ); use './' for an element-wise quotient");
    return transpose(left_divide(transpose(b), transpose(a), type, budget));
}

Value matrix_power(const Value& a, const Value& b, const Type& type, Budget& budget) {
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
    return Value(result).as(type.element);
}

/// Does the function keep the class of integers?
bool keeps_integers(Operation function) {
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
    case Operation::rem: return true;
    default: return false;
    }
}

/// The class of a concatenation, from that of the parts before and that of the next part.
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

Class function_class(Operation function, Class type) {
    if (is_integer(type) && !keeps_integers(function))
        throw Error("'" + std::string(kernels::name_of(function)) +
                    "' computes with double or single, not with " + std::string(class_name(type)) +
                    "; cast with double(x)");
    return type;
}

double number(Operation op, double x) {
    if (!kernels::is_defined(op, x)) {
        if (op == Operation::logical_not) throw Error("NaN cannot become logical; test it with isnan");
        throw Error(std::string(kernels::name_of(op)) + "(" + number_text(x) +
                    ") is complex; complex numbers are not supported");
    }
    return kernels::value_of(op, x);
}

double number(Operation op, double x, double y, Class type) {
    if (!kernels::is_defined(op, x, y)) {
        if (op != Operation::power) throw Error("NaN cannot become logical; test it with isnan");
        throw Error(number_text(x) + "^" + number_text(y) + " is complex; complex numbers are not supported");
    }
    // Numbers of class single are rounded as such, which decides what is an integer but for rounding.
    if (type == Class::Single && (op == Operation::mod || op == Operation::rem))
        return kernels::value_of(op, static_cast<float>(x), static_cast<float>(y));
    return kernels::value_of(op, x, y);
}

template <class F> Value each(const Value& a, Class type, F f) {
    if (a.is_scalar()) return Value::array(type, 1, 1, {cast(f(a[0]), type)});
    Value::Numbers result(a.data(), a.data() + a.numel());
    for (double& x : result) x = cast(f(x), type);
    return Value::array(type, a.rows(), a.cols(), std::move(result));
}

template <class F> Value each(const Value& a, const Value& b, const Type& type, Budget& budget, F f) {
    if (a.is_scalar() && b.is_scalar())
        return Value::array(type.element, 1, 1, {cast(f(*a.data(), *b.data()), type.element)});
    budget.allocate(double(type.rows), double(type.cols));
    const double *x = a.data(), *y = b.data();
    const Index x_row = a.rows() != 1, y_row = b.rows() != 1;
    const Index x_col = a.cols() != 1 ? a.rows() : 0, y_col = b.cols() != 1 ? b.rows() : 0;
    Value::Numbers result(type.rows * type.cols);
    for (Index j = 0; j < type.cols; ++j)
        for (Index i = 0; i < type.rows; ++i)
            result[i + j * type.rows] =
                cast(f(x[i * x_row + j * x_col], y[i * y_row + j * y_col]), type.element);
    return Value::array(type.element, type.rows, type.cols, std::move(result));
}

Value computed(Operation op, const Value& a, const Value& b, const Type& type, Budget& budget) {
    const Class rounded = type.element;
    return each(a, b, type, budget, [=](double x, double y) { return number(op, x, y, rounded); });
}

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

Class arithmetic_class(Class x, Class y) {
    const Class a = number_class(x), b = number_class(y);
    if (is_integer(a) && is_integer(b) && a != b)
        throw Error("integers of different classes do not mix: " + std::string(class_name(a)) + " and " +
                    std::string(class_name(b)) + "; cast one of them");
    if (is_integer(a)) return a;
    if (is_integer(b)) return b;
    return a == Class::Single || b == Class::Single ? Class::Single : Class::Double;
}

Type expanded(Class element, const Type& a, std::string_view what, const Type& b) {
    const auto fit = [](Index x, Index y) { return x == y || x == 1 || y == 1; };
    if (!fit(a.rows, b.rows) || !fit(a.cols, b.cols))
        throw Error("size mismatch: " + a.size_text() + " " + std::string(what) + " " + b.size_text() +
                    "; sizes must be equal, or 1 where they differ");
    return {element, a.rows == 1 ? b.rows : a.rows, a.cols == 1 ? b.cols : a.cols};
}

Type type_of(Operation function, const Type& a) {
    return {function_class(function, number_class(a.element)), a.rows, a.cols};
}

Type type_of(Operation function, const Type& a, const Type& b) {
    return expanded(function_class(function, arithmetic_class(a.element, b.element)), a,
                    kernels::name_of(function), b);
}

Type type_of(Operator op, const Type& a) {
    if (op == Operator::Transpose) return {a.element, a.cols, a.rows};
    require_array(a, symbol(op));
    return {op == Operator::Not ? Class::Logical : number_class(a.element), a.rows, a.cols};
}

Type type_of(Operator op, const Type& a, const Type& b) {
    require_array(a, symbol(op));
    require_array(b, symbol(op));
    if (const auto rule = element_rule(op, a, b))
        return expanded(rule->is_comparison ? Class::Logical : arithmetic_class(a.element, b.element), a,
                        symbol(op), b);
    const Class element = matrix_class(a.element, b.element);
    if (op == Operator::Mtimes && a.cols != b.rows)
        throw Error("size mismatch: " + a.size_text() + " * " + b.size_text() + " (inner lengths " +
                    std::to_string(a.cols) + " and " + std::to_string(b.rows) +
                    " differ); use '.*' for an element-wise product");
    return {element, a.rows, b.cols}; // of quotients and powers only the class
}

Type joined(const std::vector<Type>& parts, bool side_by_side) {
    std::optional<Class> classes;
    bool has_elements = false;
    for (const Type& part : parts) {
        has_elements = has_elements || part.numel() > 0;
        if (part.element != Class::Double || part.rows != 0 || part.cols != 0)
            classes = joined_class(classes, part.element);
    }
    const Class element = classes.value_or(Class::Double);
    const auto across = [&](const Type& part) { return side_by_side ? part.rows : part.cols; };
    Type first{element, 0, 0};
    Index length = 0;
    bool is_first = true;
    for (Type part : parts) {
        if (!counts(part, has_elements)) continue;
        if (element == Class::Cell && part.element != Class::Cell) part = {Class::Cell}; // an element of it
        if (std::exchange(is_first, false)) first = part;
        if (across(part) != across(first))
            throw Error("size mismatch: " + first.size_text() + (side_by_side ? " beside " : " above ") +
                        part.size_text() + " (" + std::to_string(across(first)) + " and " +
                        std::to_string(across(part)) + (side_by_side ? " rows differ)" : " columns differ)"));
        length += side_by_side ? part.cols : part.rows;
    }
    return side_by_side ? Type{element, across(first), length} : Type{element, length, across(first)};
}

std::optional<ElementRule> element_rule(Operator op, const Type& a, const Type& b) {
    const bool is_scalar_a = a.is_scalar(), is_scalar_b = b.is_scalar();
    switch (op) {
    case Operator::Plus: return ElementRule{Operation::plus, false, false};
    case Operator::Minus: return ElementRule{Operation::minus, false, false};
    case Operator::Mtimes:
        if (!is_scalar_a && !is_scalar_b) return std::nullopt;
        [[fallthrough]];
    case Operator::Times: return ElementRule{Operation::times, false, false};
    case Operator::Mrdivide:
        if (!is_scalar_b) return std::nullopt;
        [[fallthrough]];
    case Operator::Rdivide: return ElementRule{Operation::over, false, false};
    case Operator::Mldivide:
        if (!is_scalar_a) return std::nullopt;
        [[fallthrough]];
    case Operator::Ldivide: return ElementRule{Operation::over, false, true};
    case Operator::Mpower:
        if (!is_scalar_a || !is_scalar_b) return std::nullopt;
        [[fallthrough]];
    case Operator::Power: return ElementRule{Operation::power, false, false};
    case Operator::Equal: return ElementRule{Operation::equal, true, false};
    case Operator::NotEqual: return ElementRule{Operation::not_equal, true, false};
    case Operator::Less: return ElementRule{Operation::less, true, false};
    case Operator::LessEqual: return ElementRule{Operation::less_equal, true, false};
    case Operator::Greater: return ElementRule{Operation::greater, true, false};
    case Operator::GreaterEqual: return ElementRule{Operation::greater_equal, true, false};
    case Operator::And: return ElementRule{Operation::logical_and, true, false};
    case Operator::Or: return ElementRule{Operation::logical_or, true, false};
    default: return std::nullopt;
    }
}

std::optional<Operation> element_function(std::string_view name, std::size_t operands) {
    static const auto functions = [] {
        std::unordered_map<std::string_view, Operation> all;
        for (int i = 0; i < kernels::operation_count; ++i) {
            const auto operation = static_cast<Operation>(i);
            if (operation >= Operation::min || (operation >= Operation::abs && operation < Operation::plus))
                all[kernels::name_of(operation)] = operation;
        }
        return all;
    }();
    const auto found = functions.find(name);
    if (found == functions.end() || operands != (found->second < Operation::plus ? 1 : 2))
        return std::nullopt;
    return found->second;
}

Value broadcast(const Value& a, const Value& b, const Type& type, Budget& budget,
                double (*f)(double, double)) {
    return each(a, b, type, budget, f);
}

Value map(const Value& a, Class type, double (*f)(double)) { return each(a, type, f); }

Value computed(Operation function, const Value& a) {
    return each(a, type_of(function, shape_of(a)).element, [=](double x) { return number(function, x); });
}

Value computed(Operation function, const Value& a, const Value& b, Budget& budget) {
    return computed(function, a, b, type_of(function, shape_of(a), shape_of(b)), budget);
}

Value binary(Operator op, const Value& a, const Value& b, Budget& budget) {
    const Type left = shape_of(a), right = shape_of(b), type = type_of(op, left, right);
    if (const auto rule = element_rule(op, left, right))
        return rule->is_swapped ? computed(rule->operation, b, a, type, budget)
                                : computed(rule->operation, a, b, type, budget);
    switch (op) {
    case Operator::Mtimes: return multiply_values(a, b, type, budget);
    case Operator::Mrdivide: return right_divide(a, b, type, budget);
    case Operator::Mldivide: return left_divide(a, b, type, budget);
    default: return matrix_power(a, b, type, budget);
    }
}

Value unary(Operator op, const Value& a, Budget& budget) {
    const Type type = type_of(op, shape_of(a));
    budget.spend(double(a.numel()));
    if (op == Operator::Transpose) return transpose(a);
    if (op == Operator::UnaryPlus) return a.as(type.element);
    const Operation operation = op == Operator::Not ? Operation::logical_not : Operation::negative;
    return each(a, type.element, [=](double x) { return number(operation, x); });
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

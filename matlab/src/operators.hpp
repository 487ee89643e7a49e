#pragma once

#include "bf/matlab/formula.hpp"

#include <functional>
#include <optional>
#include <string_view>
#include <unordered_map>

namespace bf::matlab {

/// What evaluating one node of a syntax tree costs, in elementary operations.
constexpr double interpreted_step = 20;

/// Counts work and bounds array sizes; every function that allocates or loops takes part.
class Budget {
  public:
    Budget(double elements, double work) : elements_(elements), work_(work) {}
    void spend(double operations);           ///< throws Error when the work is used up
    void allocate(double rows, double cols); ///< throws Error when the array is too large

  private:
    double elements_;
    double work_;
};

/// a op b, element-wise operators with implicit expansion. Integers saturate; mixing two integer classes,
/// complex results and unequal sizes throw Error.
Value binary(Operator op, const Value& a, const Value& b, Budget& budget);
Value unary(Operator op, const Value& a, Budget& budget);
/// first:step:last with the elements of MATLAB's colon, last clamped to `last`.
Value range(const Value& first, const Value& step, const Value& last, Budget& budget);
Value transpose(const Value& a);

// What operators mean for classes and sizes. `resolve` infers by the same rules.

/// The class of an arithmetic result of two classes. Throws Error for integers that do not mix and for what
/// has no elements.
Class arithmetic_class(Class a, Class b);
inline Class arithmetic_class(const Value& a, const Value& b) { return arithmetic_class(a.type(), b.type()); }
/// The class of a function of one or two numbers. Throws Error also for integers where it computes with
/// double and single alone.
Class function_class(Operation function, Class a, Class b);
inline Class function_class(Operation function, Class a) { return function_class(function, a, a); }
/// The class of a product or quotient of matrices. Throws Error also for integers.
Class matrix_class(Class a, Class b);
/// The class of a concatenation, from that of the parts before and that of the next part. Parts that are a
/// 0x0 double do not count.
Class joined_class(std::optional<Class> before, Class next);
/// How long two extents are together, when one of them is 1 or both are the same.
inline std::optional<Index> expanded(Index a, Index b) {
    if (a == b || b == 1) return a;
    return a == 1 ? std::optional(b) : std::nullopt;
}
/// An operator that computes element by element.
struct ElementRule {
    Operation operation;
    double (*value)(double, double); ///< of the operands in the operator's order
    bool is_comparison;              ///< the result is logical, else of the arithmetic class
    bool is_swapped;                 ///< the operation has the operands in the other order
    Class result(Class a, Class b) const { return is_comparison ? Class::Logical : arithmetic_class(a, b); }
};
/// Null where the operator has one operand, leaves out the second one, or computes with whole matrices.
const ElementRule* element_rule(Operator op, bool is_scalar_a, bool is_scalar_b);
void require_array(Class type, std::string_view symbol); ///< throws Error

// The rules that sizes, as texts, break.
std::string size_mismatch(const std::string& a, std::string_view symbol, const std::string& b);
std::string product_mismatch(const std::string& a, Index cols, const std::string& b, Index rows);
/// Of two parts, across which the extents are these.
std::string join_mismatch(const std::string& a, Index of_a, const std::string& b, Index of_b, bool is_row);
std::string_view symbol(Operator op);
bool is_unary(Operator op);

/// MATLAB's functions that are operators, by their names.
const std::unordered_map<std::string_view, Operator>& operator_functions();
/// f element by element with implicit expansion; the elements are cast to `type`.
Value broadcast(const Value& a, const Value& b, Class type, std::string_view symbol, Budget& budget,
                double (*f)(double, double));
Value map(const Value& a, Class type, double (*f)(double));

/// The operation's value. Throws Error where it has none in real numbers.
double computed(Operation op, double x);
double computed(Operation op, double x, double y);
/// The same as functions of numbers; the last one computes in class single.
template <Operation op> double computed(double x) { return computed(op, x); }
template <Operation op> double computed_two(double x, double y) { return computed(op, x, y); }
template <Operation op> double computed_single(double x, double y) {
    return kernels::value_of(op, static_cast<float>(x), static_cast<float>(y));
}

// Linear algebra on doubles; singular systems give inf or NaN, as IEEE division does.
using Matrix = Eigen::MatrixXd;
Matrix multiply(const Eigen::Ref<const Matrix>& a, const Eigen::Ref<const Matrix>& b);
Matrix solve(const Matrix& a, const Matrix& b); ///< a \ b: LU with partial pivoting, or least squares by QR
Matrix inverse(const Matrix& a);
Matrix pseudo_inverse(const Matrix& a,
                      double tolerance);   ///< singular values not above `tolerance` count as zero
double default_tolerance(const Matrix& a); ///< max(size(a)) * eps(norm(a))
double spacing(double x);                  ///< eps(x)

// Concatenation and indexing
Value concatenate_columns(const std::vector<Value>& parts, Budget& budget); ///< [a b c]
Value concatenate_rows(const std::vector<Value>& parts, Budget& budget);    ///< [a; b; c]

/// Positions along one extent, counted from 0.
struct Selection {
    std::vector<Index> positions;
    Index rows = 0; ///< shape of the index itself
    Index cols = 0;
    bool all = false;  ///< a bare colon
    bool mask = false; ///< logical
    Index largest = 0; ///< largest position + 1
    bool scalar() const { return rows == 1 && cols == 1; }
};
Selection select(const Value& index, Index extent, Budget& budget);
Selection select_all(Index extent, Budget& budget);

Value index(const Value& base, const std::vector<Selection>& at, Budget& budget);
/// base(at) = value, growing the array; an empty base takes the class of `value`.
void assign_index(Value& base, const std::vector<Selection>& at, const Value& value, Budget& budget);
void delete_index(Value& base, const std::vector<Selection>& at, Budget& budget);

} // namespace bf::matlab

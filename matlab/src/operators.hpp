#pragma once

#include "bf/matlab/formula.hpp"

#include <functional>
#include <optional>
#include <string_view>
#include <unordered_map>

namespace bf::matlab {

/// What resolving one node of a syntax tree costs, in elementary operations.
constexpr double resolved_step = 20;

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

// What operators and functions of numbers mean for classes and sizes. Values are computed by these rules, and
// the types of formulas are inferred by them. All throw Error for what breaks a rule.

/// Without the fields of structs.
inline Type shape_of(const Value& value) { return {value.type(), value.rows(), value.cols()}; }
/// Integers do not mix; cells, structs and functions have no arithmetic.
Class arithmetic_class(Class a, Class b);
inline Class arithmetic_class(const Value& a, const Value& b) { return arithmetic_class(a.type(), b.type()); }
/// Extents are the same, or 1 where they differ.
Type expanded(Class element, const Type& a, std::string_view symbol, const Type& b);
/// Of a function of one number or two, element by element. Some compute with double and single alone.
Type type_of(Operation function, const Type& a);
Type type_of(Operation function, const Type& a, const Type& b);
Type type_of(Operator op, const Type& a);
/// Of quotients and powers of matrices only the class.
Type type_of(Operator op, const Type& a, const Type& b);
/// Does a part of a concatenation count for its size? Without elements only where no part has some, and not
/// as 0x0.
inline bool counts(const Type& part, bool has_elements) {
    return part.numel() > 0 || (!has_elements && (part.rows != 0 || part.cols != 0));
}
/// Of parts side by side, or one above the other. The class of a 0x0 double does not count.
Type joined(const std::vector<Type>& parts, bool side_by_side);

/// An operator that computes element by element.
struct ElementRule {
    Operation operation;
    bool is_comparison; ///< the result is logical, else of the arithmetic class
    bool is_swapped;    ///< the operation has the operands in the other order
};
/// Nothing where the operator has one operand, leaves out the second one, or computes with whole matrices.
std::optional<ElementRule> element_rule(Operator op, const Type& a, const Type& b);
/// The function with this name and number of operands that computes element by element.
std::optional<Operation> element_function(std::string_view name, std::size_t operands);
/// MATLAB's functions that are operators, by their names.
const std::unordered_map<std::string_view, Operator>& operator_functions();
std::string_view symbol(Operator op);
bool is_unary(Operator op);

// Values

/// a op b and op a. Integers saturate; complex results throw Error.
Value binary(Operator op, const Value& a, const Value& b, Budget& budget);
Value unary(Operator op, const Value& a, Budget& budget);
/// A function of numbers, element by element. Throws Error where it has no value in real numbers.
Value computed(Operation function, const Value& a);
Value computed(Operation function, const Value& a, const Value& b, Budget& budget);
/// f element by element with implicit expansion; the elements are cast to the type.
Value broadcast(const Value& a, const Value& b, const Type& type, Budget& budget,
                double (*f)(double, double));
Value map(const Value& a, Class type, double (*f)(double));
/// first:step:last with the elements of MATLAB's colon, last clamped to `last`.
Value range(const Value& first, const Value& step, const Value& last, Budget& budget);
Value transpose(const Value& a);

// Linear algebra on doubles; singular systems give inf or NaN, as IEEE division does.
using Matrix = Eigen::MatrixXd;
Matrix multiply(const Eigen::Ref<const Matrix>& a, const Eigen::Ref<const Matrix>& b);
Matrix solve(const Matrix& a, const Matrix& b); ///< a \ b: LU with partial pivoting, or least squares by QR
Matrix inverse(const Matrix& a);
/// Singular values not above `tolerance` count as zero; a negative one is default_tolerance(a).
Matrix pseudo_inverse(const Matrix& a, double tolerance);
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

} // namespace bf::matlab

#pragma once

#include "bf/kernels/expression.hpp"
#include "bf/matlab/syntax.hpp"
#include "bf/matlab/workspace.hpp"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// What expressions mean: names are bound, classes and sizes known. What depends on no quantity that may
/// change is a value; the rest is a formula for whoever computes it later.
namespace bf::matlab {

using kernels::Operation;

/// The class of a value and its extents. It has room for all of MATLAB's arrays: `resolve` alone says which
/// of them are computed, and refuses the others by name.
struct Type {
    Class element = Class::Double;
    Index rows = 1, cols = 1;
    std::vector<Index> further = {}; ///< extents beyond the second
    bool is_complex = false;
    std::vector<std::pair<std::string, Type>> fields = {}; ///< of each element of an array of structs

    Index numel() const;
    bool is_scalar() const { return numel() == 1; }
    bool is_vector() const { return rows == 1 || cols == 1; }
    std::string size_text() const; ///< `2x3`
    std::string text() const;      ///< `2x3 complex double`
};
Type type_of(const Value& value);

/// A resolved expression.
struct Formula {
    enum class Kind : std::uint8_t {
        constant,  ///< `value`
        slot,      ///< the quantity `slot`; the element at `places`, where there is one
        operation, ///< `operation`, element by element; rows and columns of length 1 expand
        multiply,  ///< the matrix product
        transpose,
        elements, ///< those at `places` of the operand; 0 where a place is negative
        at,       ///< the element of the first operand at the others, which count from 1
        row,      ///< side by side
        column,   ///< one above the other
        both,     ///< `a && b`, of which the second counts only if the first is true
        either,   ///< `a || b`, only if it is false
    };
    Kind kind = Kind::constant;
    Type type;
    Operation operation = Operation::number;
    Value value;
    int slot = -1;
    std::vector<Index> places; ///< counted from 0, column by column
    std::vector<Formula> operands;
    Span span;

    bool is_known() const { return kind == Kind::constant; }
};

/// A quantity that a formula reads when it is computed.
struct Slot {
    int number;
    Type type;
};

/// Bounds that turn hostile text into an Error.
struct Limits {
    double elements = 1e7; ///< of one array
    double work = 5e8;     ///< elementary operations of one expression
    int depth = 1000;      ///< nested expressions and calls
};

/// What the names of an expression mean.
struct Scope {
    /// The slot that a name (`a`, `Gain.Kp`) stands for; one with a negative number where the name has slots
    /// among its fields. Throws Error, whose place is added. Empty: there are none.
    std::function<std::optional<Slot>(const std::string& name)> find;
    /// What else the expression knows: these values are part of it.
    const Workspace& constants;
    /// Each slot is any element of a quantity, for all of which the formula is computed; an index means
    /// another one.
    bool is_elementwise = false;
    std::string names = {}; ///< behind the message that a name is unknown: what the names are
    Limits limits = {};
    Suggestions* suggestions = nullptr; ///< of all expressions of a document; null: this one's own
};

/// A formula that is more than what a Formula can say. The place is that of the part which is.
struct Unresolved : Error {
    Unresolved(const std::string& message, const Expression& part) : Error(message, part.span), part(part) {}
    const Expression& part;
};

/// Binds names, computes what depends on no slot, and infers classes and sizes of the rest. Names are, in
/// this order: parameters of the function around them, slots, constants, built-in functions. Throws Error:
/// Unresolved for what only values can tell. A slot that is complex, of a 64-bit class, of more than two
/// dimensions or an array of structs is refused.
Formula resolve(const Expression& expression, const Scope& scope);

/// The value of an expression without slots. Throws Error.
Value evaluate(const Expression& expression, const Workspace& variables, Suggestions* suggestions = nullptr);
/// `start` says where the text stands.
Value evaluate(std::string_view text, const Workspace& variables, const Location& start = {});

/// The number a plain literal (`0.999`, `-3`, `1e-5`, blanks around) stands for; anything else gives none.
std::optional<double> plain_number(std::string_view text);

/// The names in an expression (`Gain.Kp`, `sin`) whose roots are no parameters of an `@(...)` around them,
/// each once, in the order of their first use.
std::vector<std::string> free_names(const Expression& expression);

/// One instruction of a kernels::Expression.
using Instruction = std::array<double, 3>;
/// The formula of numbers as a program of kernels::Expression; `read` gives the instruction that reads a
/// slot. Throws Error where it is more than numbers.
std::vector<double> scalar_program(const Formula& formula,
                                   const std::function<Instruction(const Formula& slot)>& read);

} // namespace bf::matlab

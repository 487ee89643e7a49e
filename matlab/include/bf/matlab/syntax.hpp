#pragma once

#include "bf/matlab/error.hpp"
#include "bf/matlab/value.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace bf::matlab {

/// Operators by meaning; `Times` is `.*`, `Mtimes` is `*`, and so on as in MATLAB's function names.
enum class Operator : std::uint8_t {
    None,
    Plus,
    Minus,
    Times,
    Mtimes,
    Rdivide,
    Mrdivide,
    Ldivide,
    Mldivide,
    Power,
    Mpower,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
    AndAlso, ///< `&&`
    OrElse,  ///< `||`
    Not,
    UnaryPlus,
    UnaryMinus,
    Transpose,
};

/// What an expression node is, and what `parts` then holds.
enum class Kind : std::uint8_t {
    Literal,      ///< number or text: `value`
    Name,         ///< variable or function: `name`
    Colon,        ///< the whole extent, inside an index
    End,          ///< the last index, inside an index
    Unary,        ///< `op`; the operand
    Binary,       ///< `op`; left, right
    Range,        ///< first, last or first, step, last
    Matrix,       ///< `[...]`: rows, each a Row
    Cell,         ///< `{...}`: rows, each a Row
    Row,          ///< the elements of one row
    Index,        ///< `a(...)`, also a call: base, arguments...
    CellIndex,    ///< `a{...}`: base, arguments...
    Field,        ///< `a.name`: base; `name`
    DynamicField, ///< `a.(expr)`: base, expr
    Handle,       ///< `@name`
    Lambda,       ///< `@(parameters) body`: body; `parameters`
};

struct Expression;
using ExpressionPtr = std::shared_ptr<const Expression>;

/// A node of the syntax tree; immutable once parsed.
struct Expression {
    Kind kind = Kind::Literal;
    Operator op = Operator::None;
    Span span;
    std::string name;
    Value value;
    std::vector<ExpressionPtr> parts;
    std::vector<std::string> parameters;
    int depth = 1; ///< levels of nodes below and including this one
};

/// `wbc.skew` of a chain of plain fields on a name, else nothing.
std::string dotted_name(const Expression& expression);

/// What a function handle holds: a named function, or parameters, a body and the variables it captured.
struct Closure {
    std::string name;     ///< of `@name`; empty for a lambda
    ExpressionPtr lambda; ///< the Lambda node
    Value::Fields captured;
};

/// Parses one expression that ends with the text. `start` is where the text stands in its file.
/// Throws Error on anything else, also when it nests too deeply.
ExpressionPtr parse_expression(std::string_view text, const Location& start = {});

} // namespace bf::matlab

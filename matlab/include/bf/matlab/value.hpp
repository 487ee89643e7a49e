#pragma once

#include <Eigen/Core>

#include <concepts>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace bf {
class Suggestions;
}

namespace bf::matlab {

using Index = Eigen::Index;
struct Closure;

/// The class of a type. No value has one of the 64-bit integers yet: a double does not hold their elements.
enum class Class : std::uint8_t {
    Double,
    Single,
    Int8,
    Int16,
    Int32,
    Int64,
    Uint8,
    Uint16,
    Uint32,
    Uint64,
    Logical,
    Char,
    Cell,
    Struct,
    Function,
};

/// MATLAB's name: `double`, `int8`, `function_handle`, ...
std::string_view class_name(Class type);
bool is_integer(Class type);
/// The class of arithmetic with one operand: logicals and characters count as doubles. Throws Error for what
/// has no elements.
Class number_class(Class type);
/// Why no value is of this class, with the remedy; empty when some are.
std::string unsupported(Class type);

/// `x` as an element of `type`: integers round half away from zero and saturate (NaN becomes 0), single
/// rounds to nearest, logical becomes 0 or 1 (NaN throws Error). Classes without elements and 64-bit integers
/// throw Error.
double cast(double x, Class type);

/// A MATLAB value: a matrix of numbers, logicals or characters, a cell array, one struct, or a function
/// handle. Values are cheap to copy: copies share their data until one of them is changed.
///
/// Elements of every number class are kept as doubles, column-major; each class' values are exact in a
/// double. Characters are bytes (UTF-8 text stays as it is). Wrong use throws Error without a place.
class Value {
  public:
    using Numbers = std::vector<double>;
    using Cells = std::vector<Value>;
    using Fields = std::vector<std::pair<std::string, Value>>; ///< in the order they were added

    Value() = default; ///< `[]`, 0x0 double
    Value(std::same_as<bool> auto x) : type_(Class::Logical), rows_(1), cols_(1), scalar_(x) {}
    template <typename T>
    requires std::is_arithmetic_v<T> &&(!std::same_as<T, bool>)Value(T x)
        : rows_(1), cols_(1), scalar_(static_cast<double>(x)) {}
    explicit Value(std::string_view text); ///< a row of characters, 0x0 when empty
    explicit Value(const Eigen::MatrixXd& matrix);
    explicit Value(std::shared_ptr<const Closure> function);

    /// A matrix whose elements already are values of `type`; `data` holds rows*cols of them.
    static Value array(Class type, Index rows, Index cols, Numbers data);
    static Value filled(Class type, Index rows, Index cols, double element);
    static Value cell(Index rows, Index cols, Cells data);
    static Value cell(Index rows, Index cols) { return cell(rows, cols, Cells(rows * cols)); }
    static Value structure(Fields fields = {});

    Class type() const { return type_; }
    std::string_view type_name() const { return class_name(type_); }
    Index rows() const { return rows_; }
    Index cols() const { return cols_; }
    Index numel() const { return rows_ * cols_; }
    bool is_empty() const { return numel() == 0; }
    bool is_scalar() const { return rows_ == 1 && cols_ == 1; }
    bool is_vector() const { return rows_ == 1 || cols_ == 1; }
    bool is_numeric() const { return type_ <= Class::Uint64; } ///< double, single or integer
    bool is_array() const { return type_ <= Class::Char; }     ///< elements are numbers, logicals, characters
    bool is_logical() const { return type_ == Class::Logical; }
    bool is_text() const { return type_ == Class::Char && (rows_ == 1 || numel() == 0); }
    bool is_cell() const { return type_ == Class::Cell; }
    bool is_struct() const { return type_ == Class::Struct; }
    bool is_function() const { return type_ == Class::Function; }

    double scalar() const;                          ///< the element of a 1x1 array
    bool truth() const;                             ///< as a condition: not empty and every element nonzero
    std::string text() const;                       ///< the characters of a row
    Eigen::MatrixXd matrix() const;                 ///< the elements of an array, any number class
    Eigen::Map<const Eigen::MatrixXd> view() const; ///< the same without a copy; valid while this value is
    const double* data() const;                     ///< elements of an array, column-major
    double operator[](Index i) const { return data()[i]; }
    const Value& at(Index i) const; ///< element of a cell array, counted from 0, column-major
    const Fields& fields() const;   ///< of a struct
    const Value* find_field(std::string_view name) const; ///< null when there is none
    /// Throws with the nearest name, as far as `suggestions` lets it be looked for (null: always).
    const Value& field(std::string_view name, Suggestions* suggestions = nullptr) const;
    const Closure& function() const;

    /// Write access; copies the data first when it is shared.
    double* mutable_data();
    void set_at(Index i, Value element);
    void set_field(std::string_view name, Value value);
    void erase_field(std::string_view name);
    Value reshaped(Index rows, Index cols) const;
    Value as(Class type) const; ///< the array cast element by element

    /// Same class, shape and elements; NaN equals NaN.
    bool operator==(const Value& other) const;

    /// An expression that evaluates to this very value (a handle prints its source text).
    std::string to_text() const;
    std::string size_text() const; ///< `2x3`
    /// Short description for messages: the value when it is small, else `2x3 double`.
    std::string describe() const;

  private:
    void contain(const Value& element);

    Class type_ = Class::Double;
    std::uint16_t nesting_ = 0; ///< levels of cells and structs, 0 for a matrix
    Index rows_ = 0;
    Index cols_ = 0;
    double scalar_ = 0; // the element of a 1x1 array, which then has no Numbers
    std::variant<std::monostate, std::shared_ptr<Numbers>, std::shared_ptr<Cells>, std::shared_ptr<Fields>,
                 std::shared_ptr<const Closure>>
        data_;
};

/// The shortest text that reads back as `x`: `0.1`, `-0`, `inf`, `NaN`.
std::string number_text(double x);

/// `; did you mean 'KP'?` for the candidate nearest to `name`, or nothing.
std::string suggestion(std::string_view name, const std::vector<std::string_view>& candidates);

} // namespace bf::matlab

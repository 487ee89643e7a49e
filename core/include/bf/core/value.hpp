// Values that a model gives to arguments and parameters.
#pragma once

#include "bf/core/types.hpp"

#include <string>
#include <utility>
#include <vector>

namespace bf {

/// A number, vector, matrix, text or list of texts. Numbers are held as double, which represents every
/// element type exactly.
struct Value {
    enum class Kind : std::uint8_t { number, text, texts };

    Kind kind = Kind::number;
    Type type = Type::float64;
    int rows = 0, cols = 0;
    std::vector<double> data; ///< column-major
    std::string text;
    std::vector<std::string> texts;

    Value() = default;
    Value(double x) : rows(1), cols(1), data{x} {}
    Value(int x) : Value(static_cast<double>(x)) {}
    Value(bool x) : type(Type::boolean), rows(1), cols(1), data{x ? 1.0 : 0.0} {}
    Value(std::string x) : kind(Kind::text), text(std::move(x)) {}
    Value(const char* x) : Value(std::string(x)) {}
    Value(std::vector<std::string> x) : kind(Kind::texts), texts(std::move(x)) {}
    Value(const Matrix& x)
        : rows(static_cast<int>(x.rows())), cols(static_cast<int>(x.cols())),
          data(x.data(), x.data() + x.size()) {}

    /// What a message calls it: "a text", "a 3x4 matrix", "0.5".
    std::string describe() const;

    bool operator==(const Value&) const = default;
};

/// The values given to one block, by name.
struct Arguments : std::vector<std::pair<std::string, Value>> {
    using vector::vector;
    std::string folder; ///< of the model file: relative file names are meant from there
};

} // namespace bf

#include "mx_value.hpp"

#include <optional>
#include <stdexcept>

namespace bf::simulink {

namespace {

std::optional<Type> type_of_class(mxClassID id) {
    switch (id) {
    case mxSINGLE_CLASS: return Type::float32;
    case mxINT8_CLASS: return Type::int8;
    case mxUINT8_CLASS: return Type::uint8;
    case mxINT16_CLASS: return Type::int16;
    case mxUINT16_CLASS: return Type::uint16;
    case mxINT32_CLASS: return Type::int32;
    case mxUINT32_CLASS: return Type::uint32;
    case mxLOGICAL_CLASS: return Type::boolean;
    case mxDOUBLE_CLASS: return Type::float64;
    default: return std::nullopt;
    }
}

Value number(const mxArray* array, Type type) {
    Value value;
    value.type = type;
    value.rows = static_cast<int>(mxGetM(array));
    value.cols = static_cast<int>(mxGetN(array));
    with_type(type, [&](auto t) {
        const auto* data = static_cast<const typename decltype(t)::type*>(mxGetData(array));
        value.data.assign(data, data + mxGetNumberOfElements(array));
    });
    return value;
}

Value text(const mxArray* array) {
    if (mxGetM(array) > 1) throw std::runtime_error("is a matrix of characters; give one row");
    char* characters = mxArrayToString(array);
    if (!characters) throw std::runtime_error("cannot be read as text");
    Value value{std::string(characters)};
    mxFree(characters);
    return value;
}

Value list(const mxArray* array) {
    Value value{std::vector<std::string>{}};
    std::vector<double> numbers;
    for (std::size_t i = 0; i < mxGetNumberOfElements(array); ++i) {
        const mxArray* cell = mxGetCell(array, i);
        const Value element = cell ? value_of(cell) : Value(Matrix());
        if (element.kind == Value::Kind::text)
            value.texts.push_back(element.text);
        else if (element.kind == Value::Kind::number && element.data.size() == 1)
            numbers.push_back(element.data[0]);
        else
            throw std::runtime_error("has a cell that is neither a text nor one number");
    }
    if (numbers.empty()) return value;
    if (!value.texts.empty()) throw std::runtime_error("has cells of texts and of numbers; give either");
    return Value(Matrix(
        Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size())).transpose()));
}

} // namespace

Value value_of(const mxArray* array) {
    if (mxIsChar(array)) return text(array);
    if (mxIsCell(array)) return list(array);
    if (mxGetNumberOfDimensions(array) > 2) throw std::runtime_error("has more than two dimensions");
    const auto type = type_of_class(mxGetClassID(array));
    if (!type)
        throw std::runtime_error("is of class " + std::string(mxGetClassName(array)) +
                                 "; give a number, a text in single quotes, or a cell array of texts");
    if (mxIsComplex(array)) throw std::runtime_error("is complex; give a real value");
    if (mxIsSparse(array)) throw std::runtime_error("is sparse; give full(...)");
    return number(array, *type);
}

} // namespace bf::simulink

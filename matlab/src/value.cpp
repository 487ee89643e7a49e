#include "bf/matlab/value.hpp"
#include "bf/base/names.hpp"

#include "bf/matlab/error.hpp"
#include "bf/matlab/syntax.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bf::matlab {
namespace {

constexpr std::array<std::string_view, 15> names{"double",  "single", "int8",   "int16",  "int32",
                                                 "int64",   "uint8",  "uint16", "uint32", "uint64",
                                                 "logical", "char",   "cell",   "struct", "function_handle"};
constexpr int deepest_nesting = 200; // destructors of nested values recurse

template <typename T> double saturated(double x) {
    if (std::isnan(x)) return 0;
    return std::clamp(std::round(x), double(std::numeric_limits<T>::min()),
                      double(std::numeric_limits<T>::max())) +
           0.0; // integers have no -0
}

/// The object behind `pointer`, copied first when somebody else holds it.
template <typename T> T& unshared(std::shared_ptr<T>& pointer) {
    if (pointer.use_count() > 1) pointer = std::make_shared<T>(*pointer);
    return *pointer;
}

[[noreturn]] void wrong_class(std::string_view wanted, const Value& got) {
    throw Error("expected " + std::string(wanted) + ", got " + got.describe());
}

bool same_number(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

} // namespace

std::string_view class_name(Class type) { return names[static_cast<std::size_t>(type)]; }

bool is_integer(Class type) { return type >= Class::Int8 && type <= Class::Uint64; }

Class number_class(Class type) {
    if (type > Class::Char) throw Error("expected numbers, got a " + std::string(class_name(type)));
    return type <= Class::Uint64 ? type : Class::Double;
}

std::string unsupported(Class type) {
    if (type != Class::Int64 && type != Class::Uint64) return {};
    return std::string(class_name(type)) +
           " is not supported; use int32 or uint32, or double, which holds whole numbers up to 2^53";
}

double cast(double x, Class type) {
    switch (type) {
    case Class::Double: return x;
    case Class::Single: return static_cast<float>(x);
    case Class::Int8: return saturated<std::int8_t>(x);
    case Class::Int16: return saturated<std::int16_t>(x);
    case Class::Int32: return saturated<std::int32_t>(x);
    case Class::Uint8: return saturated<std::uint8_t>(x);
    case Class::Uint16: return saturated<std::uint16_t>(x);
    case Class::Uint32: return saturated<std::uint32_t>(x);
    case Class::Char: return saturated<std::uint8_t>(x);
    case Class::Logical:
        if (std::isnan(x)) throw Error("NaN cannot become logical; test it with isnan");
        return x != 0;
    case Class::Int64:
    case Class::Uint64: throw Error(unsupported(type));
    default: throw Error("a number cannot become a " + std::string(class_name(type)));
    }
}

Value::Value(std::string_view text) : type_(Class::Char), rows_(!text.empty()), cols_(Index(text.size())) {
    if (text.size() == 1) {
        scalar_ = static_cast<unsigned char>(text[0]);
    } else {
        auto numbers = std::make_shared<Numbers>(text.size());
        std::ranges::transform(text, numbers->begin(), [](unsigned char c) { return c; });
        data_ = std::move(numbers);
    }
}

Value::Value(const Eigen::MatrixXd& matrix)
    : Value(array(Class::Double, matrix.rows(), matrix.cols(),
                  Numbers(matrix.data(), matrix.data() + matrix.size()))) {}

Value::Value(std::shared_ptr<const Closure> function) : type_(Class::Function), rows_(1), cols_(1) {
    for (const auto& [name, value] : function->captured) contain(value);
    data_ = std::move(function);
}

Value Value::array(Class type, Index rows, Index cols, Numbers data) {
    Value value;
    value.type_ = type;
    value.rows_ = rows;
    value.cols_ = cols;
    if (rows == 1 && cols == 1) {
        value.scalar_ = data[0];
    } else if (!data.empty()) {
        value.data_ = std::make_shared<Numbers>(std::move(data));
    }
    return value;
}

Value Value::filled(Class type, Index rows, Index cols, double element) {
    return array(type, rows, cols, Numbers(rows * cols, element));
}

Value Value::cell(Index rows, Index cols, Cells data) {
    Value value;
    value.type_ = Class::Cell;
    value.rows_ = rows;
    value.cols_ = cols;
    value.nesting_ = 1;
    for (const Value& element : data) value.contain(element);
    value.data_ = std::make_shared<Cells>(std::move(data));
    return value;
}

Value Value::structure(Fields fields) {
    Value value;
    value.type_ = Class::Struct;
    value.rows_ = value.cols_ = 1;
    value.nesting_ = 1;
    for (const auto& [name, field] : fields) value.contain(field);
    value.data_ = std::make_shared<Fields>(std::move(fields));
    return value;
}

void Value::contain(const Value& element) {
    if (element.nesting_ >= deepest_nesting)
        throw Error("cells and structs nest deeper than " + std::to_string(deepest_nesting) + " levels");
    nesting_ = std::max<std::uint16_t>(nesting_, element.nesting_ + 1);
}

const double* Value::data() const {
    if (!is_array()) wrong_class("numbers", *this);
    const auto* numbers = std::get_if<std::shared_ptr<Numbers>>(&data_);
    return numbers ? (*numbers)->data() : &scalar_;
}

double Value::scalar() const {
    if (!is_array() || !is_scalar()) wrong_class("one number", *this);
    return scalar_;
}

bool Value::truth() const {
    if (!is_array()) wrong_class("a condition (numbers or logicals)", *this);
    const double* x = data();
    const bool all = std::all_of(x, x + numel(), [](double e) { return e != 0; });
    if (std::any_of(x, x + numel(), [](double e) { return std::isnan(e); }))
        throw Error("NaN is no condition; test it with isnan");
    return all && !is_empty();
}

std::string Value::text() const {
    if (!is_text()) wrong_class("text", *this);
    std::string text(numel(), ' ');
    std::transform(data(), data() + numel(), text.begin(),
                   [](double c) { return static_cast<char>(static_cast<unsigned char>(c)); });
    return text;
}

Eigen::Map<const Eigen::MatrixXd> Value::view() const { return {data(), rows_, cols_}; }
Eigen::MatrixXd Value::matrix() const { return view(); }

const Value& Value::at(Index i) const {
    if (!is_cell()) wrong_class("a cell array", *this);
    return (*std::get<std::shared_ptr<Cells>>(data_))[i];
}

const Value::Fields& Value::fields() const {
    if (!is_struct()) wrong_class("a struct", *this);
    return *std::get<std::shared_ptr<Fields>>(data_);
}

const Value* Value::find_field(std::string_view name) const {
    for (const auto& [key, value] : fields())
        if (key == name) return &value;
    return nullptr;
}

const Value& Value::field(std::string_view name, Suggestions* suggestions) const {
    if (const Value* value = find_field(name)) return *value;
    const std::string what = "the struct has no field '" + std::string(name) + "'";
    if (suggestions && !suggestions->take()) throw Error(what);
    std::vector<std::string_view> present;
    for (const auto& entry : fields()) present.push_back(entry.first);
    throw Error(what + suggestion(name, present));
}

const Closure& Value::function() const {
    if (!is_function()) wrong_class("a function handle", *this);
    return *std::get<std::shared_ptr<const Closure>>(data_);
}

double* Value::mutable_data() {
    if (!is_array()) wrong_class("numbers", *this);
    auto* numbers = std::get_if<std::shared_ptr<Numbers>>(&data_);
    return numbers ? unshared(*numbers).data() : &scalar_;
}

void Value::set_at(Index i, Value element) {
    contain(element);
    unshared(std::get<std::shared_ptr<Cells>>(data_))[i] = std::move(element);
}

void Value::set_field(std::string_view name, Value value) {
    if (!is_struct()) wrong_class("a struct", *this);
    contain(value);
    auto& fields = unshared(std::get<std::shared_ptr<Fields>>(data_));
    const auto entry = std::ranges::find(fields, name, &Fields::value_type::first);
    if (entry != fields.end())
        entry->second = std::move(value);
    else
        fields.emplace_back(name, std::move(value));
}

void Value::erase_field(std::string_view name) {
    field(name);
    std::erase_if(unshared(std::get<std::shared_ptr<Fields>>(data_)),
                  [name](const auto& entry) { return entry.first == name; });
}

Value Value::reshaped(Index rows, Index cols) const {
    if (double(rows) * double(cols) != double(numel()))
        throw Error("cannot reshape " + size_text() + " to " + std::to_string(rows) + "x" +
                    std::to_string(cols) + ": the number of elements differs");
    Value result = *this;
    result.rows_ = rows;
    result.cols_ = cols;
    return result;
}

Value Value::as(Class type) const {
    if (type == type_) return *this;
    if (!is_array()) wrong_class("numbers", *this);
    Numbers numbers(data(), data() + numel());
    for (double& x : numbers) x = cast(x, type);
    return array(type, rows_, cols_, std::move(numbers));
}

bool Value::operator==(const Value& other) const {
    if (type_ != other.type_ || rows_ != other.rows_ || cols_ != other.cols_) return false;
    if (is_array()) return std::equal(data(), data() + numel(), other.data(), same_number);
    if (is_cell())
        return *std::get<std::shared_ptr<Cells>>(data_) == *std::get<std::shared_ptr<Cells>>(other.data_);
    if (is_struct()) return fields() == other.fields();
    return &function() == &other.function();
}

} // namespace bf::matlab

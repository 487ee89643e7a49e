#include "bf/core/block.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace bf {

namespace {

template <class T> constexpr const char* wanted = "";
template <> constexpr const char* wanted<double> = "a number";
template <> constexpr const char* wanted<int> = "a whole number";
template <> constexpr const char* wanted<bool> = "true or false";
template <> constexpr const char* wanted<std::string> = "a text";
template <> constexpr const char* wanted<Matrix> = "a matrix";
template <> constexpr const char* wanted<std::vector<double>> = "a vector";
template <> constexpr const char* wanted<std::vector<int>> = "a vector of whole numbers";
template <> constexpr const char* wanted<std::vector<std::string>> = "a list of texts";
template <> constexpr const char* wanted<Value> = "anything";

bool is_whole(double x) { return std::isfinite(x) && x == std::floor(x) && std::abs(x) < 2147483648.0; }

/// Is what an int cannot hold a whole number all the same?
template <class T> bool is_too_large(const Value& v) {
    constexpr bool is_whole = std::is_same_v<T, int> || std::is_same_v<T, std::vector<int>>;
    return is_whole && !v.data.empty() &&
           std::ranges::all_of(v.data, [](double x) { return std::isfinite(x) && x == std::floor(x); });
}

bool read(const Value& v, double& to) {
    if (v.kind != Value::Kind::number || v.data.size() != 1) return false;
    to = v.data[0];
    return true;
}
bool read(const Value& v, int& to) {
    double x = 0;
    if (!read(v, x) || !is_whole(x)) return false;
    to = static_cast<int>(x);
    return true;
}
bool read(const Value& v, bool& to) {
    double x = 0;
    if (!read(v, x) || (x != 0 && x != 1)) return false;
    to = x != 0;
    return true;
}
bool read(const Value& v, std::string& to) {
    if (v.kind != Value::Kind::text) return false;
    to = v.text;
    return true;
}
bool read(const Value& v, Matrix& to) {
    if (v.kind != Value::Kind::number) return false;
    to = Eigen::Map<const Matrix>(v.data.data(), v.rows, v.cols);
    return true;
}
bool read(const Value& v, std::vector<double>& to) {
    if (v.kind != Value::Kind::number || (v.rows > 1 && v.cols > 1)) return false;
    to = v.data;
    return true;
}
bool read(const Value& v, std::vector<int>& to) {
    std::vector<double> numbers;
    if (!read(v, numbers) || !std::all_of(numbers.begin(), numbers.end(), is_whole)) return false;
    to.clear();
    for (const double x : numbers) to.push_back(static_cast<int>(x));
    return true;
}
bool read(const Value& v, std::vector<std::string>& to) {
    if (v.kind == Value::Kind::text)
        to = {v.text};
    else if (v.kind == Value::Kind::texts)
        to = v.texts;
    else if (v.data.empty())
        to.clear();
    else
        return false;
    return true;
}

bool read(const Value& v, Value& to) {
    to = v;
    return true;
}

template <class T> Value to_value(const T& x) { return Value(x); }
template <> Value to_value(const std::vector<double>& x) {
    Value v(Matrix(Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size())).transpose()));
    return v;
}
template <> Value to_value(const std::vector<int>& x) {
    return to_value(std::vector<double>(x.begin(), x.end()));
}

} // namespace

Block::Block(const Arguments& arguments) : arguments_(&arguments), folder_(arguments.folder) {}
Block::~Block() = default;

const Arguments& Block::no_arguments() {
    static const Arguments none;
    return none;
}

std::string Block::path_of(const std::string& file) const {
    return (std::filesystem::path(folder_) / file).lexically_normal().string();
}

template <class T>
Argument<T>::Argument(Block* owner, const char* name, AboutArgument<T> about) : value_(about.initial) {
    auto& d = owner->declaration_;
    const Limits limits{about.minimum, about.above, about.maximum};
    d.arguments.push_back(
        {name, about.doc, to_value(about.initial), about.choices, limits, about.from_path, about.is_secret});
    const auto given = std::find_if(owner->arguments_->begin(), owner->arguments_->end(),
                                    [&](const auto& a) { return a.first == name; });
    if (given == owner->arguments_->end()) return;
    if (!read(given->second, value_)) {
        owner->problem("argument '" + std::string(name) + "' must be " + wanted<T> +
                       (is_too_large<T>(given->second) ? " of less than 2^31" : "") + ", not " +
                       given->second.describe());
        return;
    }
    if (const auto wrong = outside(limits, to_value(value_).data); !wrong.empty()) {
        owner->problem("argument '" + std::string(name) + "' " + wrong);
        value_ = about.initial; // so that ports which follow from it have a size
    }
    if constexpr (std::is_same_v<T, std::string>)
        if (!about.choices.empty() &&
            std::find(about.choices.begin(), about.choices.end(), value_) == about.choices.end()) {
            std::string list;
            for (const auto& choice : about.choices) list += (list.empty() ? "'" : ", '") + choice + "'";
            owner->problem("argument '" + std::string(name) + "' is '" + value_ + "', but must be one of " +
                           list);
            value_ = about.initial;
        }
}

template class Argument<double>;
template class Argument<int>;
template class Argument<bool>;
template class Argument<std::string>;
template class Argument<Matrix>;
template class Argument<std::vector<double>>;
template class Argument<std::vector<int>>;
template class Argument<std::vector<std::string>>;
template class Argument<Value>;

} // namespace bf

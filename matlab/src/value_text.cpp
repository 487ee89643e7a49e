#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/matlab/error.hpp"
#include "bf/matlab/syntax.hpp"
#include "bf/matlab/value.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace bf::matlab {
namespace {

/// `[a b; c d]` with the given brackets, from the text of each element.
std::string rows_text(const Value& value, const char* brackets, const char* separator,
                      const std::function<std::string(Index)>& element) {
    std::string text(1, brackets[0]);
    for (Index i = 0; i < value.rows(); ++i) {
        if (i > 0) text += "; ";
        for (Index j = 0; j < value.cols(); ++j) {
            if (j > 0) text += separator;
            text += element(i + j * value.rows());
        }
    }
    return text + brackets[1];
}

/// A number of a single: the short text of a float where it reads back exactly.
std::string single_text(double x) {
    const std::string text = bf::number_text(static_cast<float>(x));
    const auto back = number_of(text);
    return std::isfinite(x) && back && static_cast<float>(*back) == x ? text : number_text(x);
}

std::string in_quotes(std::string_view text) {
    const bool plain = std::ranges::all_of(text, [](unsigned char c) { return c >= ' '; });
    std::string out = plain ? "'" : "['";
    for (const unsigned char c : text) {
        if (c == '\'')
            out += "''";
        else if (c >= ' ')
            out += static_cast<char>(c);
        else
            out += "' char(" + std::to_string(c) + ") '";
    }
    return out + (plain ? "'" : "']");
}

std::string char_text(const Value& value) {
    if (value.rows() == 0 && value.cols() == 0) return "''";
    if (value.is_empty())
        return "char(zeros(" + std::to_string(value.rows()) + "," + std::to_string(value.cols()) + "))";
    std::string out;
    for (Index i = 0; i < value.rows(); ++i) {
        std::string row;
        for (Index j = 0; j < value.cols(); ++j) row += static_cast<char>(value[i + j * value.rows()]);
        out += (i > 0 ? "; " : "") + in_quotes(row);
    }
    return value.rows() == 1 ? out : "[" + out + "]";
}

std::string array_text(const Value& value) {
    const Class type = value.type();
    const std::string name(value.type_name());
    if (type == Class::Char) return char_text(value);
    if (value.is_empty()) {
        const bool square = value.rows() == 0 && value.cols() == 0;
        const std::string zeros =
            square ? "[]"
                   : "zeros(" + std::to_string(value.rows()) + "," + std::to_string(value.cols()) + ")";
        return type == Class::Double ? zeros : name + "(" + zeros + ")";
    }
    const auto element = [&](Index i) -> std::string {
        if (type == Class::Logical) return value[i] != 0 ? "true" : "false";
        return type == Class::Single ? single_text(value[i]) : number_text(value[i]);
    };
    const std::string text = value.is_scalar() ? element(0) : rows_text(value, "[]", " ", element);
    return type == Class::Double || type == Class::Logical ? text : name + "(" + text + ")";
}

std::string struct_text(const Value& value) {
    std::string text;
    for (const auto& [name, field] : value.fields()) {
        if (!text.empty()) text += ", ";
        // struct() takes a cell for one element per struct, so a field that is a cell needs another one
        text += "'" + name + "', " + (field.is_cell() ? "{" + field.to_text() + "}" : field.to_text());
    }
    return "struct(" + text + ")";
}

} // namespace

std::string number_text(double x) {
    if (std::isnan(x)) return "NaN";
    if (std::isinf(x)) return x > 0 ? "inf" : "-inf";
    return bf::number_text(x);
}

std::string suggestion(std::string_view name, const std::vector<std::string_view>& candidates) {
    if (name.size() > 64) return "";
    std::size_t best = std::max<std::size_t>(1, name.size() / 3) + 1;
    std::string_view nearest;
    for (const std::string_view candidate : candidates) {
        if (candidate.size() > name.size() + 3) continue;
        const std::size_t d = edit_distance(name, candidate);
        if (d < best) {
            best = d;
            nearest = candidate;
        }
    }
    return nearest.empty() ? "" : "; did you mean '" + std::string(nearest) + "'?";
}

std::string Value::size_text() const { return std::to_string(rows_) + "x" + std::to_string(cols_); }

std::string Value::describe() const {
    if (is_array() && numel() <= 16 && !is_empty()) {
        const std::string text = to_text();
        if (text.size() <= 40) return text;
    }
    return size_text() + " " + std::string(type_name());
}

std::string Value::to_text() const {
    if (is_array()) return array_text(*this);
    if (is_struct()) return struct_text(*this);
    if (is_cell()) {
        if (is_empty())
            return rows_ == 0 && cols_ == 0
                       ? "{}"
                       : "cell(" + std::to_string(rows_) + "," + std::to_string(cols_) + ")";
        return rows_text(*this, "{}", ", ", [&](Index i) { return at(i).to_text(); });
    }
    const Closure& closure = function();
    return closure.lambda ? std::string(closure.lambda->span.text()) : "@" + closure.name;
}

} // namespace bf::matlab

// Parameter files, whose values are checked against a model's tables before it takes any of them.
#pragma once

#include "bf/base/text_file.hpp"
#include "bf/codegen/number_locale.hpp"
#include "bf/codegen/parameter_text.hpp"
#include "bf/codegen/quantity.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace bf::generated {

namespace detail {

template <class Model, class = void> struct HasArguments : std::false_type {};
template <class Model>
struct HasArguments<Model, std::void_t<decltype(&Model::argument_table)>> : std::true_type {};

/// Is it the name of an argument of a block that the program makes?
template <class Model> bool is_argument(const std::string& name) {
    if constexpr (HasArguments<Model>::value)
        for (const FixedName& argument : Model::argument_table())
            if (name == argument.name) return true;
    return false;
}

} // namespace detail

/// The changes of numbers that entries make, with the memory that they point to.
class ParameterChanges {
  public:
    /// Checks an entry against the model's tables. Empty, or what is wrong.
    template <class Model> std::string add(const Model& model, const Entry& entry) {
        const Quantity* q = model.find_parameter(entry.name.c_str());
        if (!q) {
            for (const FixedName& fixed : model.fixed_table())
                if (entry.name == fixed.name) return "'" + entry.name + "' cannot change: " + fixed.reason;
            if (detail::is_argument<Model>(entry.name))
                return "'" + entry.name +
                       "' cannot change: it is an argument, which is read before the first step only";
            return "there is no parameter or variable '" + entry.name + "'; --list names all";
        }
        std::vector<double> values;
        if (std::string errors = detail::numbers_of(entry, values); !errors.empty())
            return "'" + entry.name + "': " + errors;
        const char* wrong_value = check_count(*q, static_cast<int>(values.size()));
        // One element expands, and a vector may be written as a row or as a column.
        const bool is_vector = std::min(entry.rows, entry.cols) == 1 && std::min(q->rows, q->cols) == 1;
        if (!wrong_value && values.size() != 1 && !is_vector &&
            (entry.rows != q->rows || entry.cols != q->cols))
            wrong_value = "wrong shape";
        if (wrong_value)
            return "'" + entry.name + "': " + wrong_value + " (it has " + std::to_string(q->rows) + "x" +
                   std::to_string(q->cols) + ", the file gives " + std::to_string(entry.rows) + "x" +
                   std::to_string(entry.cols) + ")";
        Problem problem;
        const auto value = [&](int i) { return values[static_cast<std::size_t>(i)]; };
        if (check_limits(*q, static_cast<int>(values.size()), value, problem)) return problem.text;
        names_.push_back(q->name);
        values_.push_back(std::move(values));
        return "";
    }
    /// Valid as long as this object and until the next add.
    const std::vector<NewValue>& all() {
        changes_.clear();
        for (std::size_t i = 0; i < names_.size(); ++i)
            changes_.push_back({names_[i], values_[i].data(), static_cast<int>(values_[i].size())});
        return changes_;
    }

  private:
    std::vector<const char*> names_;
    std::vector<std::vector<double>> values_;
    std::vector<NewValue> changes_;
};

/// Gives a model all values of a file, or none. Returns an empty text, or every mistake on a line of its own.
template <class Model> std::string load_parameters(Model& model, const std::string& file) {
    const NumberLocale locale;
    std::string text;
    if (const std::string wrong = read_file(file, text); !wrong.empty())
        return "cannot read the parameter file " + file + ": " + wrong + "\n";
    ParsedParameters parsed = parse_parameters(without_mark(text), file);
    ParameterChanges changes;
    std::vector<Entry> arguments;
    for (const Entry& entry : parsed.entries) {
        if (detail::is_argument<Model>(entry.name)) {
            arguments.push_back(entry);
            continue;
        }
        if (const std::string wrong = changes.add(model, entry); !wrong.empty())
            parsed.errors += file + ":" + std::to_string(entry.line) + ": " + wrong + "\n";
    }
    if (!parsed.errors.empty()) return parsed.errors;
    const auto& all = changes.all();
    if (const char* wrong = model.set_parameters(all.data(), static_cast<int>(all.size())))
        return file + ": " + wrong + "\n";
    if constexpr (detail::HasArguments<Model>::value) model.set_arguments(std::move(arguments));
    return "";
}

/// A short text that reads back as the same number.
inline std::string number_text(double x) {
    char text[40];
    for (const int digits : {15, 16, 17}) {
        std::snprintf(text, sizeof text, "%.*g", digits, x);
        if (std::strtod(text, nullptr) == x) break;
    }
    return text;
}

namespace detail {
/// A comment must not end where its text has a new line.
inline std::string one_line(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < ' ') c = ' ';
    return text;
}
} // namespace detail

/// A line of this format: the name, the value whose element i is `element(i)`, and in a comment the size,
/// unit, doc and limits.
template <class F> std::string line_of(const Quantity& q, F&& element) {
    std::string value;
    for (int i = 0; i < (q.cols == 1 ? 1 : q.rows); ++i) {
        value += value.empty() ? "[" : ", [";
        const int count = q.cols == 1 ? q.rows : q.cols;
        for (int j = 0; j < count; ++j)
            value += (j ? ", " : "") + number_text(element(q.cols == 1 ? j : i + j * q.rows));
        value += "]";
    }
    if (q.size() == 1) value = number_text(element(0));
    if (q.cols > 1 && q.rows > 1) value = "[" + value + "]";
    char limits[96];
    kernels::describe(q.limits, limits, sizeof limits);
    return detail::key_text(q.name) + ": " + value + "  # " + std::to_string(q.rows) + "x" +
           std::to_string(q.cols) + (*q.unit ? " [" + detail::one_line(q.unit) + "]" : "") +
           (*q.doc ? " " : "") + detail::one_line(q.doc) + (*limits ? "; " : "") + limits + "\n";
}

} // namespace bf::generated

// Tables of named quantities, and numbers in and out of them.
#pragma once

#include "bf/kernels/limits.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <type_traits>

namespace bf::generated {

enum class Type : std::uint8_t { float64, float32, int8, uint8, int16, uint16, int32, uint32, boolean };

/// In which structure of the model a quantity lies.
enum class Where : std::uint8_t { inputs, outputs, parameters, variables, signals, states, continuous };

/// A parameter, a variable, a recorded signal or a reported state under the name that the diagram gives it.
struct Quantity {
    const char* name;
    const char* unit;
    const char* doc;
    Type type;
    Where where;
    int rows, cols; ///< column by column
    std::size_t offset;
    int formula; ///< number of the formula that gives its value, or -1
    kernels::Limits limits = {};
    const char* elements = ""; ///< names of the elements of a vector, a line each; an empty line: none
    int at_least = -1;         ///< row of the parameter that no element of this one is below
    int size() const noexcept { return rows * cols; }
};

/// Rows of a table.
struct Quantities {
    const Quantity* first;
    int count;
    const Quantity* begin() const noexcept { return first; }
    const Quantity* end() const noexcept { return first + count; }
    /// The row of that name, or null.
    const Quantity* find(const char* name) const noexcept {
        for (const Quantity& q : *this)
            if (std::strcmp(q.name, name) == 0) return &q;
        return nullptr;
    }
};

/// A name whose value is fixed in the program, and why.
struct FixedName {
    const char* name;
    const char* reason;
};
struct FixedNames {
    const FixedName* first;
    int count;
    const FixedName* begin() const noexcept { return first; }
    const FixedName* end() const noexcept { return first + count; }
};

/// A new value of a parameter or variable: all elements, column by column, or one that expands.
struct NewValue {
    const char* name;
    const double* values;
    int count;
};

/// What is wrong with a value, written where nothing may allocate.
struct Problem {
    char text[400];
    Problem() noexcept { text[0] = '\0'; } // as most go unused, the rest is left as it is
};

/// Calls f with a null pointer of the element type.
template <class F> auto with_type(Type type, F&& f) noexcept {
    switch (type) {
    case Type::float32: return f(static_cast<float*>(nullptr));
    case Type::int8: return f(static_cast<std::int8_t*>(nullptr));
    case Type::uint8: return f(static_cast<std::uint8_t*>(nullptr));
    case Type::int16: return f(static_cast<std::int16_t*>(nullptr));
    case Type::uint16: return f(static_cast<std::uint16_t*>(nullptr));
    case Type::int32: return f(static_cast<std::int32_t*>(nullptr));
    case Type::uint32: return f(static_cast<std::uint32_t*>(nullptr));
    case Type::boolean: return f(static_cast<bool*>(nullptr));
    case Type::float64: break;
    }
    return f(static_cast<double*>(nullptr));
}

/// Element i as a double, which holds every value of every type.
inline double read(const void* from, Type type, int i) noexcept {
    return with_type(type, [&](auto* t) {
        using T = std::remove_pointer_t<decltype(t)>;
        return static_cast<double>(static_cast<const T*>(from)[i]);
    });
}

/// Element i = x, of integer types and bool a number that they hold.
inline void write(void* to, Type type, int i, double x) noexcept {
    with_type(type, [&](auto* t) {
        using T = std::remove_pointer_t<decltype(t)>;
        if constexpr (std::is_same_v<T, bool>) {
            static_cast<T*>(to)[i] = x != 0;
        } else {
            static_cast<T*>(to)[i] = static_cast<T>(x);
        }
    });
}

/// The numbers that the quantity's type holds.
inline kernels::Range range_of(const Quantity& q) noexcept {
    return with_type(q.type, [](auto* t) { return kernels::range_of<std::remove_pointer_t<decltype(t)>>(); });
}

/// Are there `count` elements, or one for all? Null, or what is wrong.
inline const char* check_count(const Quantity& q, int count) noexcept {
    return count == q.size() || count == 1 ? nullptr : "wrong number of elements";
}

/// "parameter", for a message about it.
inline const char* kind_of(const Quantity& q) noexcept {
    return q.where == Where::variables ? "variable" : q.where == Where::inputs ? "input" : "parameter";
}
/// The same with the name and the numbers, in `problem`.
inline const char* check_count(const Quantity& q, int count, Problem& problem) noexcept {
    return kernels::is_wrong_count(kind_of(q), q.name, q.size(), count, problem.text, sizeof problem.text)
               ? problem.text
               : nullptr;
}

/// Do value(0), ..., value(count - 1) keep the quantity's limits, and does its type hold them? A variable may
/// be NaN as long as no parameter follows NaN from it. Null, or what is wrong, in `problem`.
template <class F>
const char* check_limits(const Quantity& q, int count, F&& value, Problem& problem) noexcept {
    char wrong[192];
    const bool is_variable = q.where == Where::variables;
    if (!kernels::find_outside(q.limits, count, value, wrong, sizeof wrong) &&
        (is_variable || !kernels::find_outside(range_of(q), count, value, wrong, sizeof wrong)))
        return nullptr;
    std::snprintf(problem.text, sizeof problem.text, "%s '%.190s' %s", kind_of(q), q.name, wrong);
    return problem.text;
}

/// The same where formatting a number would need a heap: a text of its own kind.
template <class F> const char* check_limits(const Quantity& q, int count, F&& value) noexcept {
    const kernels::Range range = range_of(q);
    for (int i = 0; i < count; ++i) {
        if (!q.limits.allow(value(i))) return "a value is outside of its limits";
        if (q.where != Where::variables && !range.holds(value(i)))
            return "a value is none of the quantity's type, which has no NaN and rounds to no integer";
    }
    return nullptr;
}

/// The same of all variables and parameters of a model that follow from variables, with their present values.
template <class Model, class... To> const char* check_following(const Model& model, To&... problem) noexcept {
    for (const Quantities& table : {model.variable_table(), model.parameter_table()})
        for (const Quantity& q : table) {
            if (q.formula < 0) continue;
            const void* const data = model.data(q);
            const auto value = [&](int i) { return read(data, q.type, i); };
            if (const char* wrong = check_limits(q, q.size(), value, problem...)) return wrong;
        }
    return nullptr;
}

/// Is each parameter at least the one that it must be, with their present values? Null, or what is wrong.
/// `data` gives the memory of a row.
template <class F>
const char* check_order(const Quantities& parameters, F&& data, Problem& problem) noexcept {
    for (const Quantity& q : parameters) {
        if (q.at_least < 0) continue;
        const Quantity& least = parameters.first[q.at_least];
        const char* const dot = std::strrchr(least.name, '.');
        if (kernels::find_below(
                q.name, q.size(), [&](int i) { return read(data(q), q.type, i); }, dot ? dot + 1 : least.name,
                least.size(), [&](int i) { return read(data(least), least.type, i); }, problem.text,
                sizeof problem.text))
            return problem.text;
    }
    return nullptr;
}

/// The same where formatting a number would need a heap: a text of its own kind.
template <class F> const char* check_order(const Quantities& parameters, F&& data) noexcept {
    for (const Quantity& q : parameters) {
        if (q.at_least < 0) continue;
        const Quantity& least = parameters.first[q.at_least];
        const int count = q.size() > least.size() ? q.size() : least.size();
        for (int i = 0; i < count; ++i)
            if (read(data(q), q.type, q.size() == 1 ? 0 : i) <
                read(data(least), least.type, least.size() == 1 ? 0 : i))
                return "a value is below another that it must be at least";
    }
    return nullptr;
}

/// Are the changes of quantities that there are, each with as many values as it has and within its limits?
template <class Model, class... To>
const char* check_changes(const Model& model, const NewValue* changes, int count, To&... problem) noexcept {
    for (int i = 0; i < count; ++i) {
        const Quantity* const q = model.find_parameter(changes[i].name);
        if (!q) return "there is no parameter of this name";
        if (const char* wrong = check_count(*q, changes[i].count, problem...)) return wrong;
        const auto value = [&](int e) { return changes[i].values[e]; };
        if (const char* wrong = check_limits(*q, changes[i].count, value, problem...)) return wrong;
    }
    return nullptr;
}

/// Writes values that were checked.
inline void write_all(void* to, const Quantity& q, const double* values, int count) noexcept {
    for (int i = 0; i < q.size(); ++i) write(to, q.type, i, values[count == 1 ? 0 : i]);
}

} // namespace bf::generated

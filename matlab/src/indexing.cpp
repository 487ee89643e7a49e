#include "operators.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bf::matlab {
namespace {

/// An array of base's class whose element k is base's element `source(k)`.
template <typename F> Value build(const Value& base, Index rows, Index cols, F source) {
    const Index n = rows * cols;
    if (base.is_cell()) {
        Value::Cells cells(n);
        for (Index k = 0; k < n; ++k) cells[k] = base.at(source(k));
        return Value::cell(rows, cols, std::move(cells));
    }
    Value::Numbers numbers(n);
    const double* data = base.data();
    for (Index k = 0; k < n; ++k) numbers[k] = data[source(k)];
    return Value::array(base.type(), rows, cols, std::move(numbers));
}

std::string count(Index n, std::string_view what) {
    return std::to_string(n) + " " + std::string(what) + (n == 1 ? "" : "s");
}

void check_bound(const Selection& at, Index extent, std::string_view what) {
    if (at.largest > extent)
        throw Error("index " + std::to_string(at.largest) + " exceeds the " + count(extent, what));
}

/// Trailing indices beyond the second must select the one layer a matrix has.
void check_layers(const std::vector<Selection>& at) {
    for (std::size_t k = 2; k < at.size(); ++k)
        if (at[k].positions != std::vector<Index>{0})
            throw Error("arrays have two dimensions; index " + std::to_string(k + 1) + " must be 1");
}

void check_indexable(const Value& base) {
    if (!base.is_array() && !base.is_cell())
        throw Error("a " + std::string(base.type_name()) + " cannot be indexed with '()' here");
}

/// [a b c] when `across`, else [a; b; c].
Value concatenate(const std::vector<Value>& parts, bool across, Budget& budget) {
    if (parts.size() == 1 && parts[0].type() != Class::Function) return parts[0];
    std::vector<Type> types;
    for (const Value& part : parts) types.push_back(shape_of(part));
    const Type type = joined(types, across);
    const bool is_cell = type.element == Class::Cell;
    const Index rows = type.rows, cols = type.cols;
    budget.allocate(double(rows), double(cols));
    Value::Numbers numbers(is_cell ? 0 : rows * cols);
    Value::Cells cells(is_cell ? rows * cols : 0);
    Index row = 0, col = 0;
    const bool has_elements = !std::ranges::all_of(parts, &Value::is_empty);
    for (const Value& part : parts) {
        if (!counts(shape_of(part), has_elements)) continue;
        const bool is_element = is_cell && !part.is_cell();
        const Index height = is_element ? 1 : part.rows(), width = is_element ? 1 : part.cols();
        for (Index j = 0; j < width; ++j) {
            for (Index i = 0; i < height; ++i) {
                const Index to = row + i + (col + j) * rows, from = i + j * height;
                if (is_cell)
                    cells[to] = is_element ? part : part.at(from);
                else
                    numbers[to] = cast(part[from], type.element);
            }
        }
        (across ? col : row) += across ? width : height;
    }
    return is_cell ? Value::cell(rows, cols, std::move(cells))
                   : Value::array(type.element, rows, cols, std::move(numbers));
}

} // namespace

Value concatenate_columns(const std::vector<Value>& parts, Budget& budget) {
    return concatenate(parts, true, budget);
}
Value concatenate_rows(const std::vector<Value>& parts, Budget& budget) {
    return concatenate(parts, false, budget);
}

Selection select_all(Index extent, Budget& budget) {
    budget.spend(double(extent));
    Selection result;
    result.positions.resize(extent);
    std::iota(result.positions.begin(), result.positions.end(), Index(0));
    result.rows = result.largest = extent;
    result.cols = 1;
    result.all = true;
    return result;
}

Selection select(const Value& index, Index extent, Budget& budget) {
    budget.spend(double(index.numel()));
    if (index.is_text() && index.is_scalar() && index[0] == ':') return select_all(extent, budget);
    if (!index.is_array()) throw Error("an index must be numbers, logicals or ':', got " + index.describe());
    Selection result;
    if (index.is_logical()) {
        for (Index i = 0; i < index.numel(); ++i)
            if (index[i] != 0) result.positions.push_back(i);
        const auto n = static_cast<Index>(result.positions.size());
        result.rows = index.rows() == 1 ? 1 : n;
        result.cols = index.rows() == 1 ? n : 1;
        result.mask = true;
    } else {
        result.positions.reserve(index.numel());
        for (Index i = 0; i < index.numel(); ++i) {
            const double x = index[i];
            if (!(x >= 1) || x != std::floor(x) || x > 1e15)
                throw Error("index " + number_text(x) + " is not a whole number from 1 on");
            result.positions.push_back(static_cast<Index>(x) - 1);
        }
        result.rows = index.rows();
        result.cols = index.cols();
    }
    for (const Index p : result.positions) result.largest = std::max(result.largest, p + 1);
    return result;
}

Value index(const Value& base, const std::vector<Selection>& at, Budget& budget) {
    if (at.empty()) return base;
    if (base.is_struct()) {
        for (const Selection& s : at)
            if (s.positions != std::vector<Index>{0})
                throw Error("arrays of structs are not supported; a struct has only element 1, use a cell "
                            "array, c{i}.field");
        return base;
    }
    check_indexable(base);
    if (at.size() == 1) {
        const Selection& s = at[0];
        check_bound(s, base.numel(), "element");
        const auto n = static_cast<Index>(s.positions.size());
        Index rows = s.rows, cols = s.cols;
        const bool takes_base_direction =
            !s.all && base.is_vector() && !base.is_scalar() && (rows == 1 || cols == 1);
        if (takes_base_direction) {
            rows = base.rows() == 1 ? 1 : n;
            cols = base.rows() == 1 ? n : 1;
        }
        budget.spend(double(n));
        return build(base, rows, cols, [&](Index k) { return s.positions[k]; });
    }
    check_layers(at);
    check_bound(at[0], base.rows(), "row");
    check_bound(at[1], base.cols(), "column");
    const auto rows = static_cast<Index>(at[0].positions.size()),
               cols = static_cast<Index>(at[1].positions.size());
    budget.allocate(double(rows), double(cols));
    return build(base, rows, cols, [&](Index k) {
        return at[0].positions[k % rows] + at[1].positions[k / rows] * base.rows();
    });
}

} // namespace bf::matlab

#include "operators.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bf::matlab {
namespace {

/// An array of base's class whose element k is base's element `source(k)`, or the class' zero for -1.
template <typename F> Value build(const Value& base, Index rows, Index cols, F source) {
    const Index n = rows * cols;
    if (base.is_cell()) {
        Value::Cells cells(n);
        for (Index k = 0; k < n; ++k)
            if (const Index from = source(k); from >= 0) cells[k] = base.at(from);
        return Value::cell(rows, cols, std::move(cells));
    }
    Value::Numbers numbers(n);
    const double* data = base.data();
    for (Index k = 0; k < n; ++k)
        if (const Index from = source(k); from >= 0) numbers[k] = data[from];
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

Value resized(const Value& base, Index rows, Index cols, Budget& budget) {
    budget.allocate(double(rows), double(cols));
    return build(base, rows, cols, [&](Index k) {
        const Index i = k % rows, j = k / rows;
        return i < base.rows() && j < base.cols() ? i + j * base.rows() : -1;
    });
}

/// Grows `base` so that linear position `largest` - 1 exists.
void grow_linear(Value& base, Index largest, Budget& budget) {
    if (largest <= base.numel()) return;
    if (base.cols() == 1 && base.rows() != 1 && !base.is_empty())
        base = resized(base, largest, 1, budget);
    else if (base.rows() <= 1 || base.is_empty())
        base = resized(base, 1, largest, budget);
    else
        throw Error("index " + std::to_string(largest) + " exceeds the " + count(base.numel(), "element") +
                    " of a " + base.size_text() + " matrix; give row and column to grow it");
}

/// [a b c] when `across`, else [a; b; c].
Value concatenate(const std::vector<Value>& parts, bool across, Budget& budget) {
    if (parts.size() == 1 && parts[0].type() != Class::Function) return parts[0];
    std::optional<Class> joined;
    for (const Value& part : parts)
        if (part.type() != Class::Double || part.rows() != 0 || part.cols() != 0)
            joined = joined_class(joined, part.type());
    const Class type = joined.value_or(Class::Double);
    std::vector<const Value*> kept;
    std::vector<Value> wrapped; // elements that join a cell array
    wrapped.reserve(parts.size());
    const auto extent = [across](const Value& v) { return across ? v.rows() : v.cols(); };
    bool some_elements = false;
    for (const Value& part : parts) some_elements = some_elements || !part.is_empty();
    for (const Value& part : parts) {
        if (part.is_empty() && (some_elements || (part.rows() == 0 && part.cols() == 0))) continue;
        if (type == Class::Cell && !part.is_cell()) {
            wrapped.push_back(Value::cell(1, 1, {part}));
            kept.push_back(&wrapped.back());
        } else {
            kept.push_back(&part);
        }
    }
    if (kept.empty()) return type == Class::Cell ? Value::cell(0, 0) : Value::array(type, 0, 0, {});
    Index length = 0;
    for (const Value* part : kept) {
        if (extent(*part) != extent(*kept[0]))
            throw Error(join_mismatch(kept[0]->size_text(), extent(*kept[0]), part->size_text(),
                                      extent(*part), across));
        length += across ? part->cols() : part->rows();
    }
    const Index rows = across ? extent(*kept[0]) : length, cols = across ? length : extent(*kept[0]);
    budget.allocate(double(rows), double(cols));
    Value::Numbers numbers(type == Class::Cell ? 0 : rows * cols);
    Value::Cells cells(type == Class::Cell ? rows * cols : 0);
    Index row = 0, col = 0;
    for (const Value* part : kept) {
        for (Index j = 0; j < part->cols(); ++j) {
            for (Index i = 0; i < part->rows(); ++i) {
                const Index to = row + i + (col + j) * rows, from = i + j * part->rows();
                if (type == Class::Cell)
                    cells[to] = part->at(from);
                else
                    numbers[to] = cast((*part)[from], type);
            }
        }
        (across ? col : row) += across ? part->cols() : part->rows();
    }
    return type == Class::Cell ? Value::cell(rows, cols, std::move(cells))
                               : Value::array(type, rows, cols, std::move(numbers));
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

void assign_index(Value& base, const std::vector<Selection>& selections, const Value& value, Budget& budget) {
    const bool fresh = base.type() == Class::Double && base.rows() == 0 && base.cols() == 0;
    if (fresh && value.is_cell()) base = Value::cell(0, 0);
    if (fresh && value.is_array()) base = Value::array(value.type(), 0, 0, {});
    check_indexable(base);
    if (selections.empty()) throw Error("an indexed assignment needs an index");
    if (base.is_cell() != value.is_cell() || !(value.is_array() || value.is_cell()))
        throw Error("a " + std::string(value.type_name()) + " cannot become an element of a " +
                    std::string(base.type_name()) + " array" + (base.is_cell() ? "; use '{}'" : ""));
    std::vector<Selection> at = selections;
    check_layers(at);
    if (at.size() > 2) at.resize(2);
    if (base.rows() == 0 && base.cols() == 0) { // a colon takes its extent from the value
        const bool one = at.size() == 1;
        if (at[0].all) at[0] = select_all(one ? value.numel() : value.rows(), budget);
        if (!one && at[1].all) at[1] = select_all(value.cols(), budget);
    }
    const auto m = static_cast<Index>(at[0].positions.size());
    const auto n = at.size() == 1 ? Index(1) : static_cast<Index>(at[1].positions.size());
    const bool fits = value.is_scalar() || (at.size() == 1 && value.numel() == m) ||
                      (value.rows() == m && value.cols() == n) ||
                      ((m == 1 || n == 1) && value.is_vector() && value.numel() == m * n);
    if (!fits)
        throw Error("size mismatch: " + value.size_text() + " assigned to " +
                    (at.size() == 1 ? count(m, "element")
                                    : std::to_string(m) + "x" + std::to_string(n) + " elements"));
    if (m * n == 0) return;
    Value::Numbers converted; // before anything changes, because a cast may throw
    if (base.is_array() && value.type() != base.type())
        for (Index k = 0; k < value.numel(); ++k) converted.push_back(cast(value[k], base.type()));
    budget.spend(double(m * n));
    if (at.size() == 1)
        grow_linear(base, at[0].largest, budget);
    else if (at[0].largest > base.rows() || at[1].largest > base.cols())
        base =
            resized(base, std::max(base.rows(), at[0].largest), std::max(base.cols(), at[1].largest), budget);
    const Index stride = base.rows(), step = value.is_scalar() ? 0 : 1;
    const auto place = [&](Index k) {
        return at.size() == 1 ? at[0].positions[k] : at[0].positions[k % m] + at[1].positions[k / m] * stride;
    };
    if (base.is_cell()) {
        for (Index k = 0; k < m * n; ++k) base.set_at(place(k), value.at(k * step));
    } else {
        const Value source = value; // the value may be the base itself
        const double* from = converted.empty() ? source.data() : converted.data();
        double* to = base.mutable_data();
        for (Index k = 0; k < m * n; ++k) to[place(k)] = from[k * step];
    }
}

void delete_index(Value& base, const std::vector<Selection>& at, Budget& budget) {
    check_indexable(base);
    const auto kept = [&](const Selection& s, Index extent, std::string_view what) {
        check_bound(s, extent, what);
        std::vector<bool> gone(extent, false);
        for (const Index p : s.positions) gone[p] = true;
        std::vector<Index> rest;
        for (Index p = 0; p < extent; ++p)
            if (!gone[p]) rest.push_back(p);
        return rest;
    };
    budget.spend(double(base.numel()));
    if (at.size() == 1 && (base.is_vector() || at[0].all)) {
        const std::vector<Index> rest = kept(at[0], base.numel(), "element");
        const auto n = static_cast<Index>(rest.size());
        const bool column = base.cols() == 1 && base.rows() != 1;
        base = build(base, column ? n : at[0].all ? 0 : 1, column ? 1 : n, [&](Index k) { return rest[k]; });
    } else if (at.size() == 2 && at[0].all) {
        const std::vector<Index> rest = kept(at[1], base.cols(), "column");
        const Index rows = base.rows();
        base =
            build(base, rows, Index(rest.size()), [&](Index k) { return k % rows + rest[k / rows] * rows; });
    } else if (at.size() == 2 && at[1].all) {
        const std::vector<Index> rest = kept(at[0], base.rows(), "row");
        const auto rows = static_cast<Index>(rest.size());
        const Index stride = base.rows();
        base = build(base, rows, base.cols(), [&](Index k) { return rest[k % rows] + k / rows * stride; });
    } else {
        throw Error("only whole rows or columns can be deleted from a " + base.size_text() + " matrix");
    }
}

} // namespace bf::matlab

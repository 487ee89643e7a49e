#include "builtins.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bf::matlab {
namespace {

/// The dimension argument `at`, else the first that is not 1: 1 goes down columns, 2 along rows.
int dimension(const Call& call, std::size_t at) {
    if (call.size() <= at) return call[0].rows() == 1 ? 2 : 1;
    const double d = call.scalar(at);
    if (d != 1 && d != 2) throw Error("the dimension must be 1 or 2, got " + number_text(d));
    return int(d);
}

/// Runs f(line, lines, i) over the columns (dim 1) or rows (dim 2) of x; `line` holds its elements.
template <typename F> void for_each_line(const Value& x, int dim, F f) {
    const Index length = dim == 1 ? x.rows() : x.cols(), lines = dim == 1 ? x.cols() : x.rows();
    std::vector<double> line(length);
    for (Index k = 0; k < lines; ++k) {
        for (Index i = 0; i < length; ++i) line[i] = dim == 1 ? x[i + k * x.rows()] : x[k + i * x.rows()];
        f(line, k);
    }
}

/// One value per line.
template <typename F> Value reduced(const Value& x, int dim, Class type, F f) {
    if (x.rows() == 0 && x.cols() == 0 && dim == 1) return Value::array(type, 1, 1, {cast(f({}), type)});
    Value::Numbers result(dim == 1 ? x.cols() : x.rows());
    for_each_line(x, dim, [&](const std::vector<double>& line, Index k) { result[k] = cast(f(line), type); });
    const auto n = static_cast<Index>(result.size());
    return Value::array(type, dim == 1 ? 1 : n, dim == 1 ? n : 1, std::move(result));
}

/// As many values per line as it has.
template <typename F> Value scanned(const Value& x, int dim, Class type, F f) {
    Value result = Value::filled(type, x.rows(), x.cols(), 0);
    double* data = result.mutable_data();
    for_each_line(x, dim, [&](std::vector<double> line, Index k) {
        f(line);
        for (Index i = 0; i < Index(line.size()); ++i)
            data[dim == 1 ? i + k * x.rows() : k + i * x.rows()] = cast(line[i], type);
    });
    return result;
}

/// Accumulates in the class itself, so that singles round and integers saturate at every step.
template <typename F> double accumulated(const std::vector<double>& line, double start, Class type, F f) {
    double result = start;
    for (const double x : line) result = cast(f(result, x), type);
    return result;
}

/// The same for each element with those before it.
template <typename F> Value accumulated_along(const Call& call, F f) {
    const Class type = number_class(call[0].type());
    return scanned(call[0], dimension(call, 1), type, [&](std::vector<double>& line) {
        for (std::size_t i = 1; i < line.size(); ++i) line[i] = cast(f(line[i - 1], line[i]), type);
    });
}

Value sum(const Call& call) {
    const Class type = number_class(call[0].type());
    return reduced(call[0], dimension(call, 1), type, [type](const std::vector<double>& line) {
        return accumulated(line, 0, type, std::plus());
    });
}
Value prod(const Call& call) {
    const Class type = number_class(call[0].type());
    return reduced(call[0], dimension(call, 1), type, [type](const std::vector<double>& line) {
        return accumulated(line, 1, type, std::multiplies());
    });
}
/// The class of a mean: double but of numbers of class single.
Class float_class(const Value& x) { return x.type() == Class::Single ? Class::Single : Class::Double; }
Value mean(const Call& call) {
    return reduced(call[0], dimension(call, 1), float_class(call[0]), [](const std::vector<double>& line) {
        return std::accumulate(line.begin(), line.end(), 0.0) / double(line.size());
    });
}
Value variance(const Call& call) {
    return reduced(call[0], dimension(call, 2), float_class(call[0]), [](const std::vector<double>& line) {
        if (line.size() == 1) return 0.0;
        const double m = std::accumulate(line.begin(), line.end(), 0.0) / double(line.size());
        double total = 0;
        for (const double x : line) total += (x - m) * (x - m);
        return total / double(line.size() - 1);
    });
}
Value deviation(const Call& call) {
    return map(variance(call), float_class(call[0]), [](double x) { return std::sqrt(x); });
}
Value any(const Call& call) {
    return reduced(call[0], dimension(call, 1), Class::Logical, [](const std::vector<double>& line) {
        return double(std::ranges::any_of(line, [](double x) { return x != 0 && !std::isnan(x); }));
    });
}
Value all(const Call& call) {
    return reduced(call[0], dimension(call, 1), Class::Logical, [](const std::vector<double>& line) {
        return double(std::ranges::all_of(line, [](double x) { return x != 0; }));
    });
}
Value nnz(const Call& call) {
    const double* x = call[0].data();
    return Index(std::count_if(x, x + call[0].numel(), [](double e) { return e != 0; }));
}
Value cumsum(const Call& call) { return accumulated_along(call, std::plus()); }
Value cumprod(const Call& call) { return accumulated_along(call, std::multiplies()); }

Value diff(const Call& call) {
    const Value& x = call[0];
    if (x.is_scalar()) return Value::array(number_class(x.type()), 0, 0, {});
    const bool rows = dimension(call, 2) == 1;
    const Index n = rows ? x.rows() : x.cols();
    if (n < 2) return Value::filled(number_class(x.type()), rows ? 0 : x.rows(), rows ? x.cols() : 0, 0);
    Selection head = select_all(n - 1, call.budget()), tail = head;
    for (Index& p : tail.positions) ++p;
    const Selection other = select_all(rows ? x.cols() : x.rows(), call.budget());
    const auto part = [&](const Selection& s) {
        return index(x, rows ? std::vector{s, other} : std::vector{other, s}, call.budget());
    };
    tail.largest = n;
    return binary(Operator::Minus, part(tail), part(head), call.budget());
}

/// min and max along a dimension, NaN ignored.
template <bool Max> Value extremum(const Call& call) {
    const Value& x = call[0];
    const Class type = number_class(x.type());
    if (x.is_empty()) return Value::array(type, 0, 0, {});
    return reduced(x, dimension(call, 2), type, [](const std::vector<double>& line) {
        double best = line[0];
        for (const double e : line)
            if (std::isnan(best) || (Max ? e > best : e < best)) best = e;
        return best;
    });
}

Value find(const Call& call) {
    const Value& x = call[0];
    const double most = call.size() >= 2 ? call.scalar(1) : double(x.numel());
    const bool from_end = call.size() == 3 && call.text(2) == "last";
    Value::Numbers places;
    for (Index k = 0; k < x.numel() && double(places.size()) < most; ++k) {
        const Index i = from_end ? x.numel() - 1 - k : k;
        if (x[i] != 0) places.push_back(double(i + 1));
    }
    if (from_end) std::ranges::reverse(places);
    const auto n = static_cast<Index>(places.size());
    const bool row = x.rows() == 1 && x.cols() != 1;
    if ((x.rows() == 0 && x.cols() == 0) || (x.is_scalar() && n == 0)) return {};
    return Value::array(Class::Double, row ? 1 : n, row ? n : 1, std::move(places));
}

/// Sorts text, for sort and unique.
std::vector<std::string> texts(const Value& cell) {
    std::vector<std::string> result;
    for (Index i = 0; i < cell.numel(); ++i) result.push_back(cell.at(i).text());
    return result;
}
Value text_cell(const std::vector<std::string>& list, bool row) {
    Value::Cells cells;
    for (const std::string& text : list) cells.emplace_back(std::string_view(text));
    const auto n = static_cast<Index>(cells.size());
    return Value::cell(row ? 1 : n, row ? n : 1, std::move(cells));
}

bool descends(const Call& call) {
    for (std::size_t i = 1; i < call.size(); ++i) {
        if (!call[i].is_text()) continue;
        if (call.text(i) == "descend") return true;
        if (call.text(i) != "ascend")
            throw Error("the order must be 'ascend' or 'descend', got " + call[i].describe());
    }
    return false;
}

Value sort(const Call& call) {
    const Value& x = call[0];
    const bool down = descends(call);
    if (x.is_cell()) {
        std::vector<std::string> list = texts(x);
        std::ranges::sort(list);
        if (down) std::ranges::reverse(list);
        return text_cell(list, x.rows() == 1);
    }
    const int dim = call.size() > 1 && !call[1].is_text() ? dimension(call, 1) : x.rows() == 1 ? 2 : 1;
    call.budget().spend(double(x.numel()) * 10);
    return scanned(x, dim, x.type(), [down](std::vector<double>& line) {
        std::ranges::stable_sort(line, [down](double a, double b) { // NaN counts as the largest
            const double p = down ? b : a, q = down ? a : b;
            return std::isnan(q) ? !std::isnan(p) : p < q;
        });
    });
}

Value unique(const Call& call) {
    const Value& x = call[0];
    if (x.is_cell()) {
        std::vector<std::string> list = texts(x);
        std::ranges::sort(list);
        list.erase(std::unique(list.begin(), list.end()), list.end());
        return text_cell(list, x.rows() == 1 && x.cols() > 1);
    }
    call.budget().spend(double(x.numel()) * 10);
    Value::Numbers list(x.data(), x.data() + x.numel());
    const auto nan = std::stable_partition(list.begin(), list.end(), [](double e) { return !std::isnan(e); });
    std::sort(list.begin(), nan);
    list.erase(std::unique(list.begin(), nan), nan);
    const auto n = static_cast<Index>(list.size());
    const bool row = x.rows() == 1 && x.cols() > 1;
    return Value::array(x.type(), row ? 1 : n, row ? n : n == 0 ? 0 : 1, std::move(list));
}

Value ismember(const Call& call) {
    const Value &x = call[0], &set = call[1];
    Value::Numbers found;
    if (!set.is_cell()) {
        call.budget().spend(double(x.numel()) * double(set.numel()));
        const double *first = set.data(), *last = first + set.numel();
        for (Index i = 0; i < x.numel(); ++i) found.push_back(std::find(first, last, x[i]) != last);
        return Value::array(Class::Logical, x.rows(), x.cols(), std::move(found));
    }
    const std::vector<std::string> list = texts(set);
    const std::vector<std::string> wanted = x.is_cell() ? texts(x) : std::vector<std::string>{x.text()};
    call.budget().spend(double(list.size()) * double(wanted.size()));
    for (const std::string& text : wanted) found.push_back(std::ranges::find(list, text) != list.end());
    return Value::array(Class::Logical, x.is_cell() ? x.rows() : 1, x.is_cell() ? x.cols() : 1,
                        std::move(found));
}

} // namespace

void add_reductions(Builtins& t) {
    t["sum"] = {1, 2, sum};
    t["prod"] = {1, 2, prod};
    t["mean"] = {1, 2, mean};
    t["var"] = {1, 1, variance};
    t["std"] = {1, 1, deviation};
    t["any"] = {1, 2, any};
    t["all"] = {1, 2, all};
    t["nnz"] = {1, 1, nnz};
    t["cumsum"] = {1, 2, cumsum};
    t["cumprod"] = {1, 2, cumprod};
    t["diff"] = {1, 1, diff};
    t["min"] = {1, 3, extremum<false>};
    t["max"] = {1, 3, extremum<true>};
    t["find"] = {1, 3, find};
    t["sort"] = {1, 3, sort};
    t["unique"] = {1, 1, unique};
    t["ismember"] = {2, 2, ismember};
}

} // namespace bf::matlab

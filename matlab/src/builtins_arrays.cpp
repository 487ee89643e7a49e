#include "builtins.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bf::matlab {
namespace {

/// The class a trailing name such as 'int8' asks for.
Class class_named(const std::string& name) {
    for (int k = 0; k <= static_cast<int>(Class::Logical); ++k)
        if (class_name(static_cast<Class>(k)) == name) {
            if (const std::string why = unsupported(static_cast<Class>(k)); !why.empty()) throw Error(why);
            return static_cast<Class>(k);
        }
    throw Error("'" + name +
                "' is no number class; use 'double', 'single', 'int8' ... 'uint32' or 'logical'");
}

/// zeros(n), zeros(m,n), zeros([m n]), each with an optional class name.
template <int Element> Value filled(const Call& call, double element = Element) {
    std::size_t n = call.size();
    Class type = Class::Double;
    if (n > 0 && call[n - 1].is_text() && !call[n - 1].is_empty()) {
        const bool like = n > 1 && call[n - 2].is_text() && call.text(n - 2) == "like";
        type = like ? call[n - 1].type() : class_named(call.text(n - 1));
        n -= 1;
    }
    double rows = 1, cols = 1;
    if (n == 1 && !call[0].is_scalar()) {
        const Value& size = call[0];
        for (Index i = 0; i < size.numel(); ++i)
            if (i >= 2 && size[i] != 1) throw Error("arrays have two dimensions; use a cell array for more");
        if (size.numel() < 2) throw Error("a size needs two elements, got " + size.describe());
        std::vector<Value> two{size[0], size[1]};
        const Call split{call.name, two, call.context};
        rows = double(split.length(0));
        cols = double(split.length(1));
    } else if (n >= 1) {
        rows = double(call.length(0));
        cols = n == 1 ? rows : double(call.length(1));
        for (std::size_t i = 2; i < n; ++i)
            if (call.scalar(i) != 1) throw Error("arrays have two dimensions; use a cell array for more");
    }
    call.budget().allocate(rows, cols);
    return Value::filled(type, Index(rows), Index(cols), element);
}

Value zeros(const Call& call) { return filled<0>(call); }
Value ones(const Call& call) { return filled<1>(call); }
Value infinity(const Call& call) { return filled<0>(call, std::numeric_limits<double>::infinity()); }
Value not_a_number(const Call& call) { return filled<0>(call, std::numeric_limits<double>::quiet_NaN()); }
Value true_(const Call& call) { return filled<1>(call).as(Class::Logical); }
Value false_(const Call& call) { return filled<0>(call).as(Class::Logical); }
Value pi(const Call&) { return std::numbers::pi; }

Value eye(const Call& call) {
    Value result = filled<0>(call);
    double* data = result.mutable_data();
    for (Index i = 0; i < std::min(result.rows(), result.cols()); ++i) data[i + i * result.rows()] = 1;
    return result;
}

Value cell(const Call& call) {
    const Value shape = filled<0>(call);
    return Value::cell(shape.rows(), shape.cols());
}

Value size(const Call& call) {
    const Value& x = call[0];
    if (call.size() == 1) return Value::array(Class::Double, 1, 2, {double(x.rows()), double(x.cols())});
    const double d = call.scalar(1);
    if (!(d >= 1) || d != std::floor(d)) throw Error("a dimension counts from 1, got " + number_text(d));
    return d == 1 ? x.rows() : d == 2 ? x.cols() : Index(1);
}

Value length(const Call& call) {
    return call[0].is_empty() ? Index(0) : std::max(call[0].rows(), call[0].cols());
}
Value numel(const Call& call) { return call[0].numel(); }
Value ndims(const Call&) { return 2; }

Value diag(const Call& call) {
    const Value& x = call[0];
    const double offset = call.size() == 2 ? call.scalar(1) : 0;
    if (offset != std::floor(offset) || std::abs(offset) > 1e9)
        throw Error("diag needs a whole number for the diagonal, got " + number_text(offset));
    const auto k = static_cast<Index>(offset);
    const Index down = std::max<Index>(-k, 0), right = std::max<Index>(k, 0);
    if (x.is_vector() && !x.is_empty()) {
        const Index n = x.numel() + std::abs(k);
        call.budget().allocate(double(n), double(n));
        Value result = Value::filled(x.type(), n, n, 0);
        for (Index i = 0; i < x.numel(); ++i) {
            const double element = x[i];
            result.mutable_data()[i + down + (i + right) * n] = element;
        }
        return result;
    }
    Value::Numbers diagonal;
    for (Index i = 0; i + down < x.rows() && i + right < x.cols(); ++i)
        diagonal.push_back(x[i + down + (i + right) * x.rows()]);
    const auto n = static_cast<Index>(diagonal.size());
    return Value::array(x.type(), n, n == 0 ? 0 : 1, std::move(diagonal));
}

Value blkdiag(const Call& call) {
    Index rows = 0, cols = 0;
    for (const Value& block : call.arguments) {
        rows += block.rows();
        cols += block.cols();
    }
    call.budget().allocate(double(rows), double(cols));
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows, cols);
    rows = cols = 0;
    for (const Value& block : call.arguments) {
        result.block(rows, cols, block.rows(), block.cols()) = block.view();
        rows += block.rows();
        cols += block.cols();
    }
    return Value(result);
}

Value repmat(const Call& call) {
    double m = 0, n = 0;
    if (call.size() == 2 && !call[1].is_scalar()) {
        if (call[1].numel() != 2) throw Error("repmat needs two counts, got " + call[1].describe());
        m = std::max(0.0, call[1][0]);
        n = std::max(0.0, call[1][1]);
    } else {
        m = double(call.length(1));
        n = call.size() == 3 ? double(call.length(2)) : m;
    }
    const Value& x = call[0];
    call.budget().allocate(m * double(x.rows()), n * double(x.cols()));
    call.budget().allocate(m, n);
    const Selection rows = select_all(x.rows(), call.budget()), cols = select_all(x.cols(), call.budget());
    const auto repeated = [](const Selection& s, double times) {
        Selection result = s;
        result.positions.clear();
        for (Index k = 0; k < Index(times) && !s.positions.empty(); ++k)
            result.positions.insert(result.positions.end(), s.positions.begin(), s.positions.end());
        return result;
    };
    return index(x, {repeated(rows, m), repeated(cols, n)}, call.budget());
}

Value reshape(const Call& call) {
    const Value& x = call[0];
    if (call.size() == 2) {
        if (call[1].numel() != 2) throw Error("reshape needs two sizes, got " + call[1].describe());
        std::vector<Value> sizes{call[1][0], call[1][1]};
        const Call split{call.name, sizes, call.context};
        return x.reshaped(split.length(0), split.length(1));
    }
    if (call[1].is_empty() && call[2].is_empty()) throw Error("reshape can find only one of its sizes");
    const Index n = x.numel();
    const auto other = [n](Index known) {
        if (known == 0 || n % known != 0)
            throw Error(std::to_string(n) + " elements do not divide by " + std::to_string(known));
        return n / known;
    };
    const Index rows = call[1].is_empty() ? other(call.length(2)) : call.length(1);
    const Index cols = call[2].is_empty() ? other(rows) : call.length(2);
    return x.reshaped(rows, cols);
}

Value permute(const Call& call) {
    const Value &x = call[0], &order = call[1];
    if (order.numel() == 2 && order[0] == 1 && order[1] == 2) return x;
    if (order.numel() == 2 && order[0] == 2 && order[1] == 1) return transpose(x);
    throw Error("permute needs the order [1 2] or [2 1], as there are two dimensions; got " +
                order.describe());
}

Value linspace(const Call& call) {
    const double a = call.scalar(0), b = call.scalar(1);
    const Index n = call.size() == 3 ? std::max<Index>(1, call.length(2)) : 100;
    call.budget().allocate(1, double(n));
    Value::Numbers points(n);
    for (Index k = 0; k < n; ++k) points[k] = a + double(k) * (b - a) / double(n - 1);
    points[n - 1] = b;
    return Value::array(Class::Double, 1, n, std::move(points));
}

Value colon(const Call& call) {
    return call.size() == 2 ? range(call[0], 1, call[1], call.budget())
                            : range(call[0], call[1], call[2], call.budget());
}

Value horzcat(const Call& call) { return concatenate_columns(call.arguments, call.budget()); }
Value vertcat(const Call& call) { return concatenate_rows(call.arguments, call.budget()); }
Value cat(const Call& call) {
    const std::vector<Value> parts(call.arguments.begin() + 1, call.arguments.end());
    if (call.scalar(0) == 1) return concatenate_rows(parts, call.budget());
    if (call.scalar(0) == 2) return concatenate_columns(parts, call.budget());
    throw Error("arrays have two dimensions; cat needs 1 or 2, got " + number_text(call.scalar(0)));
}

/// x(positions) along the rows or the columns.
Value rearranged(const Call& call, bool rows, Selection s) {
    const Value& x = call[0];
    s.largest = 0;
    return rows ? index(x, {s, select_all(x.cols(), call.budget())}, call.budget())
                : index(x, {select_all(x.rows(), call.budget()), s}, call.budget());
}
Value flipud(const Call& call) {
    Selection s = select_all(call[0].rows(), call.budget());
    std::ranges::reverse(s.positions);
    return rearranged(call, true, s);
}
Value fliplr(const Call& call) {
    Selection s = select_all(call[0].cols(), call.budget());
    std::ranges::reverse(s.positions);
    return rearranged(call, false, s);
}
Value flip(const Call& call) {
    const double d = call.size() == 2 ? call.scalar(1) : call[0].rows() != 1 ? 1 : 2;
    return d == 1 ? flipud(call) : fliplr(call);
}
Value circshift(const Call& call) {
    const bool rows = call.size() == 3 ? call.scalar(2) == 1 : call[0].rows() != 1;
    Selection s = select_all(rows ? call[0].rows() : call[0].cols(), call.budget());
    const auto n = static_cast<Index>(s.positions.size());
    if (n == 0) return call[0];
    const double shift = std::fmod(call.scalar(1), double(n));
    if (!(shift == std::floor(shift)))
        throw Error("circshift needs a whole number, got " + call[1].describe());
    std::rotate(s.positions.begin(), s.positions.begin() + (n - Index(shift)) % n, s.positions.end());
    return rearranged(call, rows, s);
}

template <bool Lower> Value triangle(const Call& call) {
    const double k = call.size() == 2 ? call.scalar(1) : 0;
    Value result = call[0];
    double* data = result.mutable_data();
    for (Index j = 0; j < result.cols(); ++j)
        for (Index i = 0; i < result.rows(); ++i)
            if (Lower ? double(j - i) > k : double(j - i) < k) data[i + j * result.rows()] = 0;
    return result;
}

/// The first of its arrays.
Value meshgrid(const Call& call) {
    const Value &x = call[0], &y = call[call.size() - 1];
    number_class(y.type()); // refuses what is no array
    const Index rows = y.numel();
    call.budget().allocate(double(rows), double(x.numel()));
    Value::Numbers result;
    for (Index j = 0; j < x.numel(); ++j) result.insert(result.end(), rows, x[j]);
    return Value::array(Class::Double, rows, x.numel(), std::move(result));
}

} // namespace

void add_arrays(Builtins& t) {
    t["zeros"] = {0, -1, zeros};
    t["ones"] = {0, -1, ones};
    t["eye"] = {0, 3, eye};
    t["cell"] = {0, 2, cell};
    t["inf"] = t["Inf"] = {0, 3, infinity};
    t["nan"] = t["NaN"] = {0, 3, not_a_number};
    t["true"] = {0, 2, true_};
    t["false"] = {0, 2, false_};
    t["pi"] = {0, 0, pi};
    t["size"] = {1, 2, size};
    t["length"] = {1, 1, length};
    t["numel"] = {1, 1, numel};
    t["ndims"] = {1, 1, ndims};
    t["diag"] = {1, 2, diag};
    t["blkdiag"] = {0, -1, blkdiag};
    t["repmat"] = {2, 3, repmat};
    t["reshape"] = {2, 3, reshape};
    t["permute"] = {2, 2, permute};
    t["linspace"] = {2, 3, linspace};
    t["colon"] = {2, 3, colon};
    t["horzcat"] = {0, -1, horzcat};
    t["vertcat"] = {0, -1, vertcat};
    t["cat"] = {1, -1, cat};
    t["flipud"] = {1, 1, flipud};
    t["fliplr"] = {1, 1, fliplr};
    t["flip"] = {1, 2, flip};
    t["circshift"] = {2, 3, circshift};
    t["tril"] = {1, 2, triangle<true>};
    t["triu"] = {1, 2, triangle<false>};
    t["meshgrid"] = {1, 2, meshgrid};
}

} // namespace bf::matlab

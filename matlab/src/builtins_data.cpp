#include "builtins.hpp"

#include <algorithm>

namespace bf::matlab {
namespace {

/// isequal: sizes and contents agree, number classes and the order of fields do not matter, NaN differs.
bool equal(const Value& a, const Value& b) {
    if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
    if (a.is_array() && b.is_array()) return std::equal(a.data(), a.data() + a.numel(), b.data());
    if (a.type() != b.type()) return false;
    if (a.is_cell()) {
        for (Index i = 0; i < a.numel(); ++i)
            if (!equal(a.at(i), b.at(i))) return false;
        return true;
    }
    if (!a.is_struct()) return a == b;
    return a.fields().size() == b.fields().size() && std::ranges::all_of(a.fields(), [&](const auto& entry) {
               const Value* other = b.find_field(entry.first);
               return other && equal(entry.second, *other);
           });
}

Value isequal(const Call& call) {
    for (std::size_t i = 1; i < call.size(); ++i)
        if (!equal(call[0], call[i])) return false;
    return true;
}

Value struct_(const Call& call) {
    if (call.size() % 2 != 0) throw Error("struct needs pairs of field names and values");
    Value result = Value::structure();
    for (std::size_t i = 0; i < call.size(); i += 2) {
        const Value& value = call[i + 1];
        if (value.is_cell() && value.numel() != 1)
            throw Error("arrays of structs are not supported; write the cell of field '" + call.text(i) +
                        "' in another pair of braces, {{...}}");
        result.set_field(call.text(i), value.is_cell() ? value.at(0) : value);
    }
    return result;
}

Value fieldnames(const Call& call) {
    Value::Cells names;
    for (const auto& entry : call[0].fields()) names.emplace_back(std::string_view(entry.first));
    const auto n = static_cast<Index>(names.size());
    return Value::cell(n, 1, std::move(names));
}

Value isfield(const Call& call) {
    const Value &s = call[0], &names = call[1];
    if (!names.is_cell()) return s.is_struct() && names.is_text() && s.find_field(names.text()) != nullptr;
    Value::Numbers result;
    for (Index i = 0; i < names.numel(); ++i)
        result.push_back(s.is_struct() && s.find_field(names.at(i).text()));
    return Value::array(Class::Logical, names.rows(), names.cols(), std::move(result));
}

Value getfield(const Call& call) { return call[0].field(call.text(1), &call.context.suggestions); }
Value setfield(const Call& call) {
    Value result = call[0];
    result.set_field(call.text(1), call[2]);
    return result;
}
Value rmfield(const Call& call) {
    Value result = call[0];
    result.erase_field(call.text(1));
    return result;
}

Value class_of(const Call& call) { return Value(call[0].type_name()); }
Value isa(const Call& call) {
    const Value& x = call[0];
    const std::string wanted = call.text(1);
    return x.type_name() == wanted || (wanted == "numeric" && x.is_numeric()) ||
           (wanted == "float" && x.type() <= Class::Single) || (wanted == "integer" && is_integer(x.type()));
}
template <bool (*F)(const Value&)> Value test(const Call& call) { return F(call[0]); }
bool is_cellstr(const Value& x) {
    if (!x.is_cell()) return false;
    for (Index i = 0; i < x.numel(); ++i)
        if (!x.at(i).is_text()) return false;
    return true;
}
bool is_text(const Value& x) { return x.type() == Class::Char; }
bool is_float(const Value& x) { return x.type() <= Class::Single; }
bool is_real(const Value& x) { return x.is_array(); }
bool is_row(const Value& x) { return x.rows() == 1; }
bool is_column(const Value& x) { return x.cols() == 1; }
bool is_square(const Value& x) { return x.rows() == x.cols(); }
bool is_numeric(const Value& x) { return x.is_numeric(); }
bool is_logical(const Value& x) { return x.is_logical(); }
bool is_cell(const Value& x) { return x.is_cell(); }
bool is_struct(const Value& x) { return x.is_struct(); }
bool is_empty(const Value& x) { return x.is_empty(); }
bool is_scalar(const Value& x) { return x.is_scalar(); }
bool is_vector(const Value& x) { return x.is_vector() && !x.is_empty(); }

Value num2cell(const Call& call) {
    Value result = Value::cell(call[0].rows(), call[0].cols());
    for (Index i = 0; i < call[0].numel(); ++i)
        result.set_at(i, Value::array(call[0].type(), 1, 1, {call[0][i]}));
    return result;
}
Value cell2mat(const Call& call) {
    const Value& c = call[0];
    std::vector<Value> rows;
    for (Index i = 0; i < c.rows(); ++i) {
        std::vector<Value> row;
        for (Index j = 0; j < c.cols(); ++j) row.push_back(c.at(i + j * c.rows()));
        rows.push_back(concatenate_columns(row, call.budget()));
    }
    return rows.empty() ? Value() : concatenate_rows(rows, call.budget());
}

/// The function that an argument is or names.
Value function_of(const Value& function) {
    if (!function.is_text()) return function;
    auto closure = std::make_shared<Closure>();
    closure->name = function.text();
    return Value(std::shared_ptr<const Closure>(std::move(closure)));
}

/// cellfun and arrayfun: one call per element; 'UniformOutput', false collects the results in a cell.
Value apply_each(const Call& call) {
    std::size_t n = call.size();
    bool uniform = true;
    if (n >= 4 && call[n - 2].is_text() && call.text(n - 2) == "UniformOutput") {
        uniform = call[n - 1].truth();
        n -= 2;
    }
    const Value function = function_of(call[0]);
    const Value& shape = call[1];
    const bool cells = call.name == "cellfun";
    for (std::size_t i = 1; i < n; ++i) {
        if (cells && !call[i].is_cell()) throw Error("cellfun needs cell arrays, got " + call[i].describe());
        if (call[i].numel() != shape.numel())
            throw Error("size mismatch: " + shape.size_text() + " and " + call[i].size_text());
    }
    Value::Cells results;
    for (Index k = 0; k < shape.numel(); ++k) {
        std::vector<Value> arguments;
        for (std::size_t i = 1; i < n; ++i)
            arguments.push_back(
                cells ? call[i].at(k)
                      : index(call[i], {select(k + 1, call[i].numel(), call.budget())}, call.budget()));
        results.push_back(call.context.apply(function, std::move(arguments)));
        if (uniform && (!results.back().is_array() || !results.back().is_scalar()))
            throw Error("the function gives " + results.back().describe() +
                        " where one number is needed; add 'UniformOutput', false");
    }
    if (!uniform) return Value::cell(shape.rows(), shape.cols(), std::move(results));
    if (results.empty()) return Value::filled(Class::Double, shape.rows(), shape.cols(), 0);
    return concatenate_columns(results, call.budget()).reshaped(shape.rows(), shape.cols());
}

Value feval(const Call& call) {
    return call.context.apply(function_of(call[0]), {call.arguments.begin() + 1, call.arguments.end()});
}
Value func2str(const Call& call) { return Value(call[0].to_text()); }
Value str2func(const Call& call) {
    if (call.text(0).starts_with("@"))
        throw Error("write the function itself instead of str2func('" + call.text(0) + "')");
    return function_of(call[0]);
}

/// An identifier may stand before the message.
Value error_(const Call& call) {
    const std::string head = call.text(0);
    const bool has_identifier = call.size() > 1 && head.find(':') != std::string::npos &&
                                head.find_first_of(" \t%") == std::string::npos;
    throw Error(formatted(call.text(has_identifier), call.arguments, has_identifier + 1));
}

} // namespace

void add_data(Builtins& t) {
    t["isequal"] = {2, -1, isequal};
    t["struct"] = {0, -1, struct_};
    t["fieldnames"] = {1, 1, fieldnames};
    t["isfield"] = {2, 2, isfield};
    t["getfield"] = {2, 2, getfield};
    t["setfield"] = {3, 3, setfield};
    t["rmfield"] = {2, 2, rmfield};
    t["class"] = {1, 1, class_of};
    t["isa"] = {2, 2, isa};
    t["isnumeric"] = {1, 1, test<is_numeric>};
    t["islogical"] = {1, 1, test<is_logical>};
    t["ischar"] = t["isstring"] = {1, 1, test<is_text>};
    t["isfloat"] = {1, 1, test<is_float>};
    t["isreal"] = {1, 1, test<is_real>};
    t["iscell"] = {1, 1, test<is_cell>};
    t["iscellstr"] = {1, 1, test<is_cellstr>};
    t["isstruct"] = {1, 1, test<is_struct>};
    t["isempty"] = {1, 1, test<is_empty>};
    t["isscalar"] = {1, 1, test<is_scalar>};
    t["isvector"] = {1, 1, test<is_vector>};
    t["isrow"] = {1, 1, test<is_row>};
    t["iscolumn"] = {1, 1, test<is_column>};
    t["issquare"] = {1, 1, test<is_square>};
    t["num2cell"] = {1, 1, num2cell};
    t["cell2mat"] = {1, 1, cell2mat};
    t["cellfun"] = t["arrayfun"] = {2, -1, apply_each};
    t["feval"] = {1, -1, feval};
    t["func2str"] = {1, 1, func2str};
    t["str2func"] = {1, 1, str2func};
    t["error"] = {1, -1, error_};
}

} // namespace bf::matlab

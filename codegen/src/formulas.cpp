#include "formulas.hpp"

#include "bf/matlab/interpreter.hpp"
#include "names.hpp"

#include <algorithm>
#include <set>

namespace bf::codegen {

namespace {

using matlab::Kind;
using matlab::Operator;

/// An expression that is not printed: why, and the variables that must be fixed for it.
struct NotPrinted {
    std::string reason;
    std::set<int> variables;
};

/// The names of functions of bf::generated::Formula with one and with two operands, as in MATLAB.
const std::set<std::string, std::less<>> one_operand{
    "sin",   "cos", "tan",   "asin",    "acos",    "atan",   "sinh",  "cosh", "tanh",   "asinh",    "acosh",
    "atanh", "exp", "expm1", "log",     "log2",    "log10",  "log1p", "sqrt", "abs",    "sign",     "floor",
    "ceil",  "fix", "round", "deg2rad", "rad2deg", "double", "diag",  "not",  "uminus", "transpose"};
const std::set<std::string, std::less<>> two_operands{
    "atan2", "hypot", "mod", "rem", "min", "max", "plus", "minus", "times", "rdivide", "mtimes", "power"};
/// Of a size that does not change.
const std::set<std::string, std::less<>> of_the_size{"size", "numel", "length", "ndims", "isempty"};

/// Of a size that their arguments give.
const std::set<std::string, std::less<>> sized_by_value{"zeros", "ones", "eye", "repmat", "linspace"};

std::string dotted_name(const matlab::Expression& e) {
    if (e.kind == Kind::Name) return e.name;
    if (e.kind != Kind::Field) return {};
    const std::string base = dotted_name(*e.parts[0]);
    return base.empty() ? base : base + "." + e.name;
}

class Printer {
  public:
    Printer(const Definition& definition, const std::vector<matlab::Value>& values,
            const std::vector<std::string>& fixed, const std::map<int, std::string>& members)
        : definition_(definition), fixed_(fixed), members_(members),
          variables_(variables_of(definition, values)) {}

    std::string print(const matlab::Expression& e) {
        if (!changes(e)) return constant(e);
        if (const int variable = variable_of(e); variable >= 0) return "variables." + members_.at(variable);
        switch (e.kind) {
        case Kind::Unary:
            if (e.op == Operator::UnaryPlus) return print(*e.parts[0]);
            return call(e.op == Operator::UnaryMinus  ? "uminus"
                        : e.op == Operator::Transpose ? "transpose"
                                                      : "logical_not",
                        e.parts);
        case Kind::Binary: return call(function_of(e), e.parts);
        case Kind::Matrix: return matrix(e);
        case Kind::Index: return index(e);
        case Kind::Range: refuse(e, "a range whose length may change is not computed there");
        default: refuse(e, "its expression is more than arithmetic");
        }
    }

  private:
    int variable_of(const matlab::Expression& e) const {
        const std::string name = dotted_name(e);
        for (const auto& [used, variable] : definition_.uses)
            if (!name.empty() && used == name) return variable;
        return -1;
    }
    /// The variables in an expression that may change.
    void add_changing(const matlab::Expression& e, std::set<int>& variables) const {
        const std::string name = dotted_name(e);
        for (const auto& [used, variable] : definition_.uses)
            if (!name.empty() && !is_fixed(variable) &&
                (used == name || used.starts_with(name + ".") || name.starts_with(used + ".")))
                variables.insert(variable);
        if (name.empty())
            for (const auto& part : e.parts) add_changing(*part, variables);
    }
    [[noreturn]] void refuse(const matlab::Expression& e, const std::string& reason) const {
        std::set<int> variables;
        add_changing(e, variables);
        throw NotPrinted{reason, variables};
    }
    [[noreturn]] void refuse_index(const matlab::Expression& e) const {
        std::set<int> variables;
        for (std::size_t i = 1; i < e.parts.size(); ++i) add_changing(*e.parts[i], variables);
        throw NotPrinted{"a list of indices that may change is not computed there", variables};
    }
    bool is_fixed(int variable) const { return !fixed_[static_cast<std::size_t>(variable)].empty(); }

    /// Does the value depend on a variable that may change? A whole struct or a part of a variable does.
    bool changes(const matlab::Expression& e) const {
        const std::string name = dotted_name(e);
        if (!name.empty())
            return std::any_of(definition_.uses.begin(), definition_.uses.end(), [&](const auto& use) {
                const bool is_same = use.first == name || use.first.starts_with(name + ".") ||
                                     name.starts_with(use.first + ".");
                return is_same && !is_fixed(use.second);
            });
        if (e.kind == Kind::Index && of_the_size.contains(dotted_name(*e.parts[0])) && e.parts.size() == 2)
            return false;
        return std::any_of(e.parts.begin(), e.parts.end(), [&](const auto& part) { return changes(*part); });
    }

    matlab::Value value_of(const matlab::Expression& e) const {
        try {
            return matlab::Interpreter().evaluate(e, variables_);
        } catch (const matlab::Error& error) {
            refuse(e, "its expression is more than arithmetic");
        }
    }

    std::string constant(const matlab::Expression& e) const {
        const matlab::Value value = value_of(e);
        if (!value.is_array() || (value.type() != matlab::Class::Double && !value.is_logical()))
            throw NotPrinted{"it is computed with a " + std::string(value.type_name()), {}};
        if (value.is_scalar()) return literal(value[0], Type::float64);
        std::string list;
        for (matlab::Index i = 0; i < value.numel(); ++i)
            list += (i ? ", " : "") + literal(value[i], Type::float64);
        return "bf::generated::Matrix<double, " + std::to_string(value.rows()) + ", " +
               std::to_string(value.cols()) + ">{{" + list + "}}";
    }

    std::string call(const std::string& function, const std::vector<matlab::ExpressionPtr>& operands,
                     std::size_t first = 0) {
        std::string text = "f." + function + "(";
        for (std::size_t i = first; i < operands.size(); ++i)
            text += (i > first ? ", " : "") + print(*operands[i]);
        return text + ")";
    }

    std::string function_of(const matlab::Expression& e) const {
        const auto is_scalar = [&](std::size_t i) { return value_of(*e.parts[i]).is_scalar(); };
        switch (e.op) {
        case Operator::Plus: return "plus";
        case Operator::Minus: return "minus";
        case Operator::Times: return "times";
        case Operator::Mtimes: return "mtimes";
        case Operator::Rdivide: return "rdivide";
        case Operator::Mrdivide:
            if (is_scalar(1)) return "rdivide";
            break;
        case Operator::Ldivide: return "ldivide";
        case Operator::Mldivide:
            if (is_scalar(0)) return "ldivide";
            break;
        case Operator::Power: return "power";
        case Operator::Mpower:
            if (is_scalar(0) && is_scalar(1)) return "power";
            break;
        case Operator::Equal: return "equal";
        case Operator::NotEqual: return "not_equal";
        case Operator::Less: return "less";
        case Operator::LessEqual: return "less_equal";
        case Operator::Greater: return "greater";
        case Operator::GreaterEqual: return "greater_equal";
        case Operator::And: return "logical_and";
        case Operator::Or: return "logical_or";
        case Operator::AndAlso: return "both";
        case Operator::OrElse: return "either";
        default: break;
        }
        refuse(e, "a system of equations or a power of a matrix is not computed there");
    }

    std::string matrix(const matlab::Expression& e) {
        std::vector<std::string> rows;
        for (const auto& row : e.parts) {
            std::vector<std::string> items;
            for (const auto& part : row->parts)
                if (changes(*part) || !value_of(*part).is_empty()) items.push_back(print(*part));
            if (items.empty()) continue;
            rows.push_back(items.size() == 1 ? items[0] : "f.row(" + joined(items) + ")");
        }
        return rows.size() == 1 ? rows[0] : "f.stack(" + joined(rows) + ")";
    }
    static std::string joined(const std::vector<std::string>& items) {
        std::string text;
        for (const auto& item : items) text += (text.empty() ? "" : ", ") + item;
        return text;
    }

    /// A call, or elements at constant places.
    std::string index(const matlab::Expression& e) {
        const std::string name = dotted_name(*e.parts[0]);
        const bool is_variable =
            changes(*e.parts[0]) || (!name.empty() && variables_.contains(name.substr(0, name.find('.'))));
        if (!is_variable) {
            const std::size_t n = e.parts.size() - 1;
            if (!(n == 1 && one_operand.contains(name)) && !(n == 2 && two_operands.contains(name)))
                refuse(e, sized_by_value.contains(name) ? "its size would change"
                                                        : "'" + name + "' is not computed there");
            return call(name == "not" ? "logical_not" : name == "double" ? "same" : name, e.parts, 1);
        }
        const matlab::Value base = value_of(*e.parts[0]);
        const auto is_changed = [&](const auto& part) { return changes(*part); };
        if (std::any_of(e.parts.begin() + 1, e.parts.end(), is_changed)) {
            for (std::size_t i = 1; i < e.parts.size(); ++i)
                if (e.parts[i]->kind == Kind::Colon || !value_of(*e.parts[i]).is_scalar() ||
                    value_of(*e.parts[i]).is_logical())
                    refuse_index(e);
            return call("element", e.parts);
        }
        // Which elements: the same index of a matrix that holds its own places.
        matlab::Value::Numbers places(static_cast<std::size_t>(base.numel()));
        for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<double>(i);
        const auto number = std::make_shared<matlab::Expression>();
        number->kind = Kind::Literal;
        number->value =
            matlab::Value::array(matlab::Class::Double, base.rows(), base.cols(), std::move(places));
        matlab::Expression of_places = e;
        of_places.parts[0] = number;
        const matlab::Value chosen = value_of(of_places);
        std::string list;
        for (matlab::Index i = 0; i < chosen.numel(); ++i)
            list += ", " + std::to_string(static_cast<int>(chosen[i]));
        if (chosen.is_empty()) throw NotPrinted{"it uses no element of a vector", {}};
        return "f.pick<" + std::to_string(chosen.rows()) + ", " + std::to_string(chosen.cols()) + list +
               ">(" + print(*e.parts[0]) + ")";
    }

    const Definition& definition_;
    const std::vector<std::string>& fixed_;
    const std::map<int, std::string>& members_;
    const matlab::Workspace variables_;
};

} // namespace

Formulas formulas_of(const Diagram& diagram) {
    const auto& all = diagram.definitions;
    std::vector<std::string> fixed = fixed_definitions(diagram);
    std::vector<matlab::Value> values;
    for (const auto& definition : all) values.push_back(definition.value);
    const auto is_free = [&](int definition) { return fixed[static_cast<std::size_t>(definition)].empty(); };
    // A variable that cannot be followed is fixed, and so is all that it follows from, until nothing new is.
    for (;;) {
        Formulas result;
        std::map<int, std::string> members;
        std::set<std::string> taken;
        bool again = false;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const int number = static_cast<int>(i);
            if (all[i].kind == Definition::Kind::variable && is_free(number)) {
                members[number] = unique_identifier(all[i].path, taken);
                result.variables.push_back({number, members[number]});
            }
            const bool follows = std::any_of(all[i].uses.begin(), all[i].uses.end(),
                                             [&](const auto& use) { return is_free(use.second); });
            if (!follows || !is_free(number)) continue;
            try {
                result.formulas.push_back(
                    {number, Printer(all[i], values, fixed, members).print(*all[i].expression)});
            } catch (const NotPrinted& not_printed) {
                again = true;
                if (not_printed.variables.empty()) fixed[i] = not_printed.reason;
                for (const int variable : not_printed.variables)
                    fixed[static_cast<std::size_t>(variable)] =
                        "'" + all[i].path + "' follows from it: " + not_printed.reason;
            }
        }
        if (again) {
            fixed = fixed_definitions(diagram, std::move(fixed));
            continue;
        }
        for (std::size_t i = 0; i < all.size(); ++i)
            if (all[i].kind == Definition::Kind::variable && !fixed[i].empty())
                result.fixed.emplace_back(all[i].path, fixed[i]);
        return result;
    }
}

} // namespace bf::codegen

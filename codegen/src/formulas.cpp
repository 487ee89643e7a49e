#include "formulas.hpp"

#include "bf/matlab/formula.hpp"
#include "names.hpp"

#include <algorithm>
#include <set>

namespace bf::codegen {

namespace {

using Form = matlab::Formula::Kind;
using kernels::Operation;

/// An expression that is not printed: why, and the variables that must be fixed for it.
struct NotPrinted {
    std::string reason;
    std::set<int> variables;
};

std::string number(matlab::Index x) { return std::to_string(x); }

/// How the arithmetic of two numbers is written.
const char* infix(Operation operation) {
    switch (operation) {
    case Operation::plus: return " + ";
    case Operation::minus: return " - ";
    case Operation::times: return " * ";
    case Operation::over: return " / ";
    case Operation::less: return " < ";
    case Operation::less_equal: return " <= ";
    case Operation::greater: return " > ";
    case Operation::greater_equal: return " >= ";
    case Operation::equal: return " == ";
    case Operation::not_equal: return " != ";
    default: return nullptr;
    }
}

class Printer {
  public:
    Printer(const Definition& definition, const std::vector<matlab::Value>& values,
            const std::vector<std::string>& fixed, const std::map<int, std::string>& members)
        : definition_(definition), values_(values), fixed_(fixed), members_(members),
          variables_(variables_of(definition, values)) {}

    std::string print() const {
        try {
            return print(matlab::resolve(*definition_.expression, scope()));
        } catch (const matlab::Unresolved& unresolved) {
            NotPrinted not_printed{unresolved.message(), {}};
            add_changing(unresolved.part, not_printed.variables);
            throw not_printed;
        } catch (const matlab::Error&) {
            NotPrinted not_printed{"its expression is more than arithmetic", {}};
            add_changing(*definition_.expression, not_printed.variables);
            throw not_printed;
        }
    }

  private:
    bool is_free(int variable) const { return fixed_[static_cast<std::size_t>(variable)].empty(); }

    matlab::Scope scope() const {
        return {[this](const std::string& name) { return slot(name); }, variables_};
    }
    std::optional<matlab::Slot> slot(const std::string& name) const {
        std::optional<matlab::Slot> found;
        for (const auto& [used, variable] : definition_.uses) {
            if (!is_free(variable)) continue;
            const auto& value = values_[static_cast<std::size_t>(variable)];
            if (used == name) return matlab::Slot{variable, matlab::type_of(value)};
            if (used.starts_with(name + ".") || name.starts_with(used + ".")) found = matlab::Slot{-1, {}};
        }
        return found;
    }
    /// The variables in an expression that may change.
    void add_changing(const matlab::Expression& e, std::set<int>& variables) const {
        for (const std::string& name : matlab::free_names(e))
            for (const auto& [used, variable] : definition_.uses)
                if (is_free(variable) &&
                    (used == name || used.starts_with(name + ".") || name.starts_with(used + ".")))
                    variables.insert(variable);
    }

    std::string print(const matlab::Formula& f) const {
        if (f.type.element != matlab::Class::Double && f.type.element != matlab::Class::Logical)
            throw NotPrinted{"it is computed with a " + std::string(class_name(f.type.element)), {}};
        switch (f.kind) {
        case Form::constant: return constant(f.value);
        case Form::slot: return "variables." + members_.at(f.slot);
        case Form::operation: return operation(f);
        case Form::multiply: return call("mtimes", f);
        case Form::transpose: return call("transpose", f);
        case Form::at: return call("element", f);
        case Form::row: return call("row", f);
        case Form::column: return call("stack", f);
        case Form::both: return both(f, " && ");
        case Form::either: return both(f, " || ");
        case Form::elements: break;
        }
        std::string list;
        for (const auto place : f.places) list += ", " + number(place);
        return call("pick<" + number(f.type.rows) + ", " + number(f.type.cols) + list + ">", f);
    }

    std::string constant(const matlab::Value& value) const {
        if (value.is_scalar()) return literal(value[0], Type::float64);
        std::string list;
        for (matlab::Index i = 0; i < value.numel(); ++i)
            list += (i ? ", " : "") + literal(value[i], Type::float64);
        return "bf::generated::Matrix<double, " + number(value.rows()) + ", " + number(value.cols()) + ">{{" +
               list + "}}";
    }

    std::string call(const std::string& function, const matlab::Formula& f) const {
        std::string text = "f." + function + "(";
        for (std::size_t i = 0; i < f.operands.size(); ++i) text += (i ? ", " : "") + print(f.operands[i]);
        return text + ")";
    }

    std::string operation(const matlab::Formula& f) const {
        const auto& operands = f.operands;
        if (const char* sign = infix(f.operation); sign && f.type.is_scalar()) {
            const std::string text = "(" + print(operands[0]) + sign + print(operands[1]) + ")";
            return f.type.element == matlab::Class::Logical ? "f.number" + text : text;
        }
        return call("of<bf::kernels::Operation::" + std::string(name_of(f.operation)) + ">", f);
    }

    std::string both(const matlab::Formula& f, const char* sign) const {
        return "f.number(f.truth(" + print(f.operands[0]) + ")" + sign + "f.truth(" + print(f.operands[1]) +
               "))";
    }

    const Definition& definition_;
    const std::vector<matlab::Value>& values_;
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
                result.formulas.push_back({number, Printer(all[i], values, fixed, members).print()});
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

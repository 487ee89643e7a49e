#include "bf/matlab/formula.hpp"

#include "builtins.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bf::matlab {
namespace {

using Form = Formula::Kind;

bool is_of_the_size(std::string_view name) {
    constexpr std::string_view names[] = {"size", "numel", "length", "ndims", "isempty"};
    return std::ranges::find(names, name) != std::end(names);
}
bool is_sized_by_value(std::string_view name) {
    constexpr std::string_view names[] = {"zeros", "ones", "eye", "repmat", "linspace"};
    return std::ranges::find(names, name) != std::end(names);
}

/// Refuses a quantity whose type no part of a formula computes with.
void require_supported(const Type& type) {
    const std::string this_is = "this is a " + type.text() + "; ";
    if (type.is_complex)
        throw Error(this_is +
                    "complex numbers are not supported; compute with real and imaginary parts of their own");
    if (const std::string why = unsupported(type.element); !why.empty()) throw Error(this_is + why);
    if (type.extents.size() > 2)
        throw Error(this_is + "arrays have two dimensions; use a cell array for more");
    if (type.element == Class::Struct && !type.is_scalar())
        throw Error(this_is + "arrays of structs are not supported; use a cell array, c{i}.field");
}

class Resolver {
  public:
    explicit Resolver(const Scope& scope) : scope_(scope) {}

    Formula resolve(const Expression& e) {
        try {
            Formula formula = is_open(e) ? open(e) : constant(e);
            formula.span = e.span;
            return formula;
        } catch (const Unresolved&) {
            throw;
        } catch (const Error& error) {
            if (error.located()) throw;
            throw Error(error.message(), e.span);
        }
    }

    bool is_open(const Expression& e) const {
        if (const std::string name = dotted_name(e); !name.empty()) {
            if (slot(e, name)) return true;
            return e.kind == Kind::Field && is_open(*e.parts[0]);
        }
        if (e.kind == Kind::Index && e.parts.size() == 2 && is_size(*e.parts[0])) return false;
        return std::ranges::any_of(e.parts, [&](const auto& part) { return is_open(*part); });
    }

  private:
    std::optional<Slot> slot(const Expression& e, const std::string& name) const {
        try {
            return scope_.find(name);
        } catch (const Error& error) {
            throw Error(error.message(), e.span);
        }
    }
    /// A function of an operand's size, which no slot changes.
    bool is_size(const Expression& function) const {
        return !scope_.is_elementwise && function.kind == Kind::Name && is_of_the_size(function.name) &&
               !scope_.constants.contains(function.name);
    }

    void require_known(const Expression& e) const {
        if (e.kind == Kind::Lambda) return;
        if (e.kind == Kind::Name && !is_builtin(e.name) && !scope_.constants.contains(e.name))
            throw Error("unknown variable or function '" + e.name + "'" + nearest(e.name) + scope_.names,
                        e.span);
        for (const ExpressionPtr& part : e.parts) require_known(*part);
    }
    std::string nearest(const std::string& name) const {
        std::vector<std::string_view> known = scope_.constants.names();
        const std::size_t variables = known.size();
        for (const auto& [builtin, entry] : builtins()) known.push_back(builtin);
        std::sort(known.begin() + std::ptrdiff_t(variables), known.end()); // a hash table has no order
        return suggestion(name, known);
    }

    bool is_size_of_slot(const Expression& e) const {
        return e.kind == Kind::Index && e.parts.size() == 2 && is_size(*e.parts[0]) && is_open(*e.parts[1]);
    }
    /// The expression with the sizes of slots as numbers.
    Expression with_sizes(const Expression& e) {
        Expression known = e;
        if (is_size_of_slot(e)) {
            const Type of = resolve(*e.parts[1]).type;
            Workspace workspace;
            workspace.set("x", Value::filled(Class::Double, of.rows(), of.cols(), 0));
            known.kind = Kind::Literal;
            known.value = evaluate(e.parts[0]->name + "(x)", workspace);
            known.parts.clear();
        }
        for (ExpressionPtr& part : known.parts) part = std::make_shared<const Expression>(with_sizes(*part));
        return known;
    }
    Value value_of(const Expression& e) {
        const Expression known = with_sizes(e);
        require_known(known);
        return Interpreter().evaluate(known, scope_.constants);
    }

    Formula constant(const Expression& e) {
        Formula formula;
        formula.value = value_of(e);
        formula.type = type_of(formula.value);
        return formula;
    }

    Formula open(const Expression& e) {
        if (const std::string name = dotted_name(e); !name.empty()) {
            const auto found = slot(e, name);
            if (found) require_supported(found->type);
            if (!found || found->number < 0) throw Unresolved("its expression is more than arithmetic", e);
            Formula formula;
            formula.kind = Form::slot;
            formula.slot = found->number;
            formula.type = found->type;
            return formula;
        }
        switch (e.kind) {
        case Kind::Unary:
        case Kind::Binary: return operation(e, e.op, e.parts, 0);
        case Kind::Matrix: return matrix(e);
        case Kind::Index: return index(e);
        case Kind::Range: throw Unresolved("a range whose length may change is not computed there", e);
        default: throw Unresolved("its expression is more than arithmetic", e);
        }
    }

    static Formula made(Form kind, Class element, Index rows, Index cols, std::vector<Formula> operands) {
        Formula formula;
        formula.kind = kind;
        formula.type = {element, {rows, cols}};
        formula.operands = std::move(operands);
        return formula;
    }

    /// Of one operand or two, element by element.
    static Formula elementwise(Operation operation, Class element, std::vector<Formula> operands,
                               std::string_view symbol) {
        const Type &a = operands.front().type, &b = operands.back().type;
        const auto rows = expanded(a.rows(), b.rows()), cols = expanded(a.cols(), b.cols());
        if (!rows || !cols) throw Error(size_mismatch(a.size_text(), symbol, b.size_text()));
        Formula formula = made(Form::operation, element, *rows, *cols, std::move(operands));
        formula.operation = operation;
        return formula;
    }

    Formula operation(const Expression& e, Operator op, const std::vector<ExpressionPtr>& parts,
                      std::size_t first) {
        std::vector<Formula> operands;
        for (std::size_t i = first; i < parts.size(); ++i) operands.push_back(resolve(*parts[i]));
        const Type a = operands.front().type, b = operands.back().type;
        if (op == Operator::Transpose)
            return made(Form::transpose, a.element, a.cols(), a.rows(), std::move(operands));
        if (op == Operator::AndAlso || op == Operator::OrElse) {
            for (const Formula& operand : operands)
                if (operand.type.element > Class::Char)
                    throw Error("expected a condition (numbers or logicals), got a " + operand.type.text());
            return made(op == Operator::AndAlso ? Form::both : Form::either, Class::Logical, 1, 1,
                        std::move(operands));
        }
        require_array(a.element, symbol(op));
        require_array(b.element, symbol(op));
        if (op == Operator::UnaryPlus) {
            operands[0].type.element = number_class(a.element);
            return operands[0];
        }
        if (op == Operator::UnaryMinus)
            return elementwise(Operation::negative, number_class(a.element), std::move(operands), "-");
        if (op == Operator::Not)
            return elementwise(Operation::logical_not, Class::Logical, std::move(operands), "~");
        if (const ElementRule* rule = element_rule(op, a.is_scalar(), b.is_scalar())) {
            Formula formula = elementwise(rule->operation, rule->result(a.element, b.element),
                                          std::move(operands), symbol(op));
            if (rule->is_swapped) std::swap(formula.operands.front(), formula.operands.back());
            return formula;
        }
        if (op != Operator::Mtimes)
            throw Unresolved("a system of equations or a power of a matrix is not computed there", e);
        const Class element = matrix_class(a.element, b.element);
        if (a.cols() != b.rows())
            throw Error(product_mismatch(a.size_text(), a.cols(), b.size_text(), b.rows()));
        return made(Form::multiply, element, a.rows(), b.cols(), std::move(operands));
    }

    /// Rows one above the other, or elements side by side. What is empty leaves no trace but its class.
    Formula joined(Form kind, std::vector<Formula> parts, const Expression& e) {
        if (parts.size() == 1) return std::move(parts[0]);
        std::optional<Class> classes;
        bool has_extent = false;
        for (const Formula& part : parts) {
            const bool is_nothing = part.type.rows() == 0 && part.type.cols() == 0;
            has_extent = has_extent || !is_nothing;
            if (part.type.element != Class::Double || !is_nothing)
                classes = joined_class(classes, part.type.element);
        }
        const Class element = classes.value_or(Class::Double);
        if (element == Class::Cell) throw Unresolved("its expression is more than arithmetic", e);
        std::erase_if(parts, [](const Formula& part) { return part.type.numel() == 0; });
        if (parts.empty()) return made(kind, element, has_extent ? 1 : 0, 0, {});
        const bool is_row = kind == Form::row;
        Index length = 0;
        const auto across = [&](const Formula& part) { return is_row ? part.type.rows() : part.type.cols(); };
        for (const Formula& part : parts) {
            if (across(part) != across(parts[0]))
                throw Error(join_mismatch(parts[0].type.size_text(), across(parts[0]), part.type.size_text(),
                                          across(part), is_row));
            length += is_row ? part.type.cols() : part.type.rows();
        }
        const Index other = across(parts[0]);
        return made(kind, element, is_row ? other : length, is_row ? length : other, std::move(parts));
    }
    Formula matrix(const Expression& e) {
        std::vector<Formula> rows;
        for (const ExpressionPtr& row : e.parts) {
            std::vector<Formula> items;
            for (const ExpressionPtr& part : row->parts) items.push_back(resolve(*part));
            rows.push_back(joined(Form::row, std::move(items), e));
        }
        Formula all = joined(Form::column, std::move(rows), e);
        if (all.type.numel() == 0) throw Unresolved("it has no element", e);
        return all;
    }

    Formula index(const Expression& e) {
        const std::string name = dotted_name(*e.parts[0]);
        const bool is_slot = is_open(*e.parts[0]);
        if (!is_slot && !name.empty() && !scope_.constants.contains(name.substr(0, name.find('.'))))
            return call(e, name);
        Formula base = resolve(*e.parts[0]);
        if (scope_.is_elementwise && is_slot) return element_of(std::move(base), e);
        const bool is_computed =
            std::any_of(e.parts.begin() + 1, e.parts.end(), [&](const auto& part) { return is_open(*part); });
        return is_computed ? computed_element(std::move(base), e) : chosen(std::move(base), e);
    }

    Formula call(const Expression& e, const std::string& name) {
        const std::size_t count = e.parts.size() - 1;
        if (const auto op = operator_functions().find(name);
            op != operator_functions().end() && count == (is_unary(op->second) ? 1 : 2))
            return operation(e, op->second, e.parts, 1);
        if (name == "double" && count == 1) {
            Formula operand = resolve(*e.parts[1]);
            const Class from = number_class(operand.type.element);
            // What computed an integer rounds it, which its new class would hide.
            if (from != Class::Double && operand.kind != Form::slot)
                throw Unresolved("it is computed with a " + std::string(class_name(from)), e);
            operand.type.element = Class::Double;
            return operand;
        }
        if (name == "diag" && count == 1) {
            std::vector<Formula> operand{resolve(*e.parts[1])};
            const Type type = operand[0].type;
            const Index n = type.is_vector() ? type.numel() : std::min(type.rows(), type.cols());
            if (n == 0) throw Unresolved("it has no element", e);
            return made(Form::diagonal, type.element, n, type.is_vector() ? n : 1, std::move(operand));
        }
        for (int i = static_cast<int>(Operation::abs); i < kernels::operation_count; ++i) {
            const auto operation = static_cast<Operation>(i);
            if (name != kernels::name_of(operation) || count != (operation < Operation::plus ? 1 : 2))
                continue;
            std::vector<Formula> operands;
            for (std::size_t k = 1; k <= count; ++k) operands.push_back(resolve(*e.parts[k]));
            const Class element =
                function_class(operation, operands.front().type.element, operands.back().type.element);
            return elementwise(operation, element, std::move(operands), name);
        }
        require_known(*e.parts[0]);
        throw Unresolved(
            is_sized_by_value(name) ? "its size would change" : "'" + name + "' is not computed there", e);
    }

    /// The element of a slot for which the formula is not computed anew: u(3).
    Formula element_of(Formula base, const Expression& e) {
        const Expression& at = *e.parts.back();
        const bool is_number = e.parts.size() == 2 && at.kind != Kind::Colon && !is_open(at);
        const Value value = is_number ? value_of(at) : Value();
        if (!value.is_numeric() || !value.is_scalar() || value[0] < 1 || value[0] > 1e9 ||
            value[0] != std::floor(value[0]))
            throw Error("elements are counted by whole numbers from 1", at.span);
        base.places = {static_cast<Index>(value[0]) - 1};
        return base;
    }

    /// The element at indices that change.
    Formula computed_element(Formula base, const Expression& e) {
        std::vector<Formula> operands{std::move(base)};
        for (std::size_t i = 1; i < e.parts.size(); ++i) {
            const bool is_list = e.parts[i]->kind == Kind::Colon || e.parts[i]->kind == Kind::Range;
            if (!is_list) operands.push_back(resolve(*e.parts[i]));
            if (is_list || !operands.back().type.is_scalar() ||
                operands.back().type.element == Class::Logical)
                throw Unresolved("a list of indices that may change is not computed there", *e.parts[i]);
        }
        if (operands.size() > 3)
            throw Unresolved("arrays have two dimensions; more indices are not computed there", e);
        const Class element = operands[0].type.element;
        return made(Form::at, element, 1, 1, std::move(operands));
    }
    /// Which elements: the same index of a matrix that holds its own places.
    Formula chosen(Formula base, const Expression& e) {
        const Type type = base.type;
        auto places = std::make_shared<Expression>();
        Value::Numbers numbers(static_cast<std::size_t>(type.numel()));
        std::iota(numbers.begin(), numbers.end(), 0.0);
        places->value = Value::array(Class::Double, type.rows(), type.cols(), std::move(numbers));
        Expression of_places = e;
        of_places.parts[0] = places;
        const Value value = value_of(of_places);
        if (value.is_empty()) throw Unresolved("it uses no element of a vector", e);
        std::vector<Formula> operand;
        operand.push_back(std::move(base));
        Formula formula = made(Form::elements, type.element, value.rows(), value.cols(), std::move(operand));
        for (Index i = 0; i < value.numel(); ++i) formula.places.push_back(static_cast<Index>(value[i]));
        return formula;
    }

    const Scope& scope_;
};

/// Appends the instructions of a formula, which leave one number more on a stack of this height.
void append(const Formula& f, const std::function<Instruction(const Formula&)>& read, int height,
            std::vector<double>& code) {
    const auto push = [&](const Instruction& instruction) {
        code.insert(code.end(), instruction.begin(), instruction.end());
    };
    if (!f.type.is_scalar() || !f.value.is_array() ||
        !(f.type.element == Class::Double || f.type.element == Class::Logical))
        throw Error("a step computes this formula with numbers of class double, this is a " + f.type.text(),
                    f.span);
    if (height >= kernels::Expression::depth)
        throw Error("it nests too deeply; split it into two blocks", f.span);
    const auto operation = f.kind == Form::both     ? Operation::logical_and
                           : f.kind == Form::either ? Operation::logical_or
                                                    : f.operation;
    switch (f.kind) {
    case Form::constant: return push({static_cast<double>(Operation::number), f.value[0], 0});
    case Form::slot: return push(read(f));
    case Form::operation:
    case Form::both:
    case Form::either:
        for (std::size_t i = 0; i < f.operands.size(); ++i)
            append(f.operands[i], read, height + static_cast<int>(i), code);
        return push({static_cast<double>(operation), 0, 0});
    case Form::transpose:
    case Form::diagonal:
    case Form::row:
    case Form::column: return append(f.operands[0], read, height, code); // of one number: itself
    case Form::multiply:
    case Form::elements:
    case Form::at: throw Error("a step computes this formula with numbers, not with matrices", f.span);
    }
}

} // namespace

Index Type::numel() const {
    return std::accumulate(extents.begin(), extents.end(), Index(1), std::multiplies());
}

std::string Type::size_text() const {
    std::string text;
    for (const Index extent : extents) text += (text.empty() ? "" : "x") + std::to_string(extent);
    return text;
}

std::string Type::text() const {
    return size_text() + (is_complex ? " complex " : " ") + std::string(class_name(element));
}

Type type_of(const Value& value) {
    Type type{value.type(), {value.rows(), value.cols()}};
    if (value.is_struct())
        for (const auto& [name, field] : value.fields()) type.fields.emplace_back(name, type_of(field));
    return type;
}

Formula resolve(const Expression& expression, const Scope& scope) {
    return Resolver(scope).resolve(expression);
}

std::vector<double> scalar_program(const Formula& formula,
                                   const std::function<Instruction(const Formula& slot)>& read) {
    std::vector<double> code;
    append(formula, read, 0, code);
    return code;
}

} // namespace bf::matlab

#include "bf/matlab/formula.hpp"

#include "bf/base/numbers.hpp"
#include "builtins.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <unordered_set>

namespace bf::matlab {
namespace {

using Form = Formula::Kind;
using Formulas = std::vector<Formula>;

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
    return std::ranges::find(names, name) != names.end();
}
bool are_known(const Formulas& parts) { return std::ranges::all_of(parts, &Formula::is_known); }

/// Refuses a quantity whose type no part of a formula computes with.
void require_supported(const Type& type) {
    const std::string this_is = "this is a " + type.text() + "; ";
    if (type.is_complex)
        throw Error(this_is +
                    "complex numbers are not supported; compute with real and imaginary parts of their own");
    if (const std::string why = unsupported(type.element); !why.empty()) throw Error(this_is + why);
    if (!type.further.empty()) throw Error(this_is + "arrays have two dimensions; use a cell array for more");
    if (type.element == Class::Struct && !type.is_scalar())
        throw Error(this_is + "arrays of structs are not supported; use a cell array, c{i}.field");
}

Formula constant(Value value) {
    Formula formula;
    formula.type = shape_of(value);
    formula.value = std::move(value);
    return formula;
}
Formula made(Form kind, Type type, Formulas operands) {
    Formula formula;
    formula.kind = kind;
    formula.type = std::move(type);
    formula.operands = std::move(operands);
    return formula;
}
Value function_handle(Closure closure) { return Value(std::make_shared<const Closure>(std::move(closure))); }

/// Computes what is known and makes formulas of the rest, in one walk over the syntax tree.
class Resolver final : Context {
  public:
    explicit Resolver(const Scope& scope)
        : Context(budget_, scope.suggestions ? *scope.suggestions : own_suggestions_), scope_(scope),
          budget_(scope.limits.elements, scope.limits.work), variables_(&scope.constants) {}

    Formula resolve(const Expression& e) {
        Formula formula = located(e, [&] { return part(e); });
        formula.span = e.span;
        return formula;
    }

  private:
    /// What f gives; its errors stand at e.
    template <class F> std::invoke_result_t<F> located(const Expression& e, F&& f) {
        try {
            const Level level(*this);
            budget_.spend(resolved_step);
            return f();
        } catch (const Unresolved&) {
            throw;
        } catch (const Error& error) {
            if (error.located()) throw;
            throw Error(error.message(), e.span);
        }
    }

    /// Counts the depth while it lives.
    struct Level {
        explicit Level(Resolver& r) : resolver(r) {
            const int deepest = r.scope_.limits.depth;
            if (r.depth_ >= deepest)
                throw Error("calls and expressions nest deeper than " + std::to_string(deepest) +
                            " levels; is there an endless recursion?");
            ++r.depth_;
        }
        ~Level() { --resolver.depth_; }
        Resolver& resolver;
    };
    /// Sets a member while it lives.
    template <class T> struct Scoped {
        Scoped(T& m, T value) : member(m), before(std::exchange(m, std::move(value))) {}
        ~Scoped() { member = std::move(before); }
        T& member;
        T before;
    };

    Formula part(const Expression& e) {
        switch (e.kind) {
        case Kind::Literal: return constant(e.value);
        case Kind::Name: return named(e, e.name);
        case Kind::Colon: return constant(Value(":"));
        case Kind::End:
            if (!end_) throw Error("'end' stands for the last index only when a variable is indexed");
            return constant(*end_);
        case Kind::Unary:
        case Kind::Binary:
            if (e.op == Operator::AndAlso || e.op == Operator::OrElse) return condition(e);
            return operation(e, e.op, operands_of(e));
        case Kind::Range: return range_of(e);
        case Kind::Matrix: return matrix(e);
        case Kind::Cell: return cell(e);
        case Kind::Row: break; // of a matrix or a cell, which take its parts
        case Kind::Index: return index_of(e);
        case Kind::CellIndex: {
            Formulas elements = elements_of(e);
            if (elements.empty()) throw Error("this gives no value");
            if (elements.size() > 1)
                throw Error("'{}' selects " + std::to_string(elements.size()) +
                            " elements where one is needed");
            return std::move(elements[0]);
        }
        case Kind::Field:
        case Kind::DynamicField: return field(e);
        case Kind::Handle: return constant(function_handle({e.name, nullptr, {}}));
        case Kind::Lambda: return lambda(e);
        }
        throw more(e);
    }

    static Unresolved more(const Expression& e) { return {"its expression is more than arithmetic", e}; }

    // Names

    std::optional<Slot> slot(const std::string& name) const {
        if (!scope_.find || variables_ != &scope_.constants) return std::nullopt;
        return scope_.find(name);
    }
    /// Is this a slot, a variable, or a field of one?
    bool is_quantity(const std::string& name) const {
        return slot(name) || variables_->contains(std::string_view(name).substr(0, name.find('.')));
    }

    std::optional<Formula> slot_of(const Expression& e, const std::string& name) const {
        const std::optional<Slot> found = slot(name);
        if (!found) return std::nullopt;
        require_supported(found->type);
        if (found->number < 0) throw more(e);
        Formula formula = made(Form::slot, found->type, {});
        formula.slot = found->number;
        return formula;
    }

    Formula named(const Expression& e, const std::string& name) {
        if (auto quantity = slot_of(e, name)) return std::move(*quantity);
        if (const Value* value = variables_->find(name)) return constant(*value);
        return call(e, name, {});
    }

    Formula field(const Expression& e) {
        if (const std::string name = dotted_name(e); !name.empty()) {
            if (auto quantity = slot_of(e, name)) return std::move(*quantity);
            if (!is_quantity(name) && !builtins().contains(std::string_view(name).substr(0, name.find('.'))))
                unknown(name);
        }
        const Formula base = resolve(*e.parts[0]);
        if (!base.is_known()) throw more(e);
        if (e.kind == Kind::Field) return constant(base.value.field(e.name, &suggestions));
        const Formula name = resolve(*e.parts[1]);
        if (!name.is_known()) throw more(e);
        return constant(base.value.field(name.value.text(), &suggestions));
    }

    [[noreturn]] void unknown(const std::string& name) {
        std::string what = "unknown variable or function '" + name + "'";
        if (suggestions.take()) {
            std::vector<std::string_view> candidates = variables_->names();
            const std::size_t variables = candidates.size();
            for (const auto& [builtin, entry] : builtins()) candidates.push_back(builtin);
            // A hash table has no order.
            std::sort(candidates.begin() + std::ptrdiff_t(variables), candidates.end());
            what += suggestion(std::string_view(name).substr(0, name.find('.')), candidates);
        }
        throw Error(what + scope_.names);
    }

    // Operators

    Formula operation(const Expression& e, Operator op, Formulas operands) {
        const Type &a = operands.front().type, &b = operands.back().type;
        if (are_known(operands))
            return constant(is_unary(op) ? unary(op, operands[0].value, budget_)
                                         : binary(op, operands[0].value, operands[1].value, budget_));
        if (is_unary(op)) {
            Type type = matlab::type_of(op, a);
            if (op == Operator::Transpose) return made(Form::transpose, std::move(type), std::move(operands));
            if (op == Operator::UnaryPlus) {
                operands[0].type = std::move(type);
                return std::move(operands[0]);
            }
            return elementwise(op == Operator::Not ? Operation::logical_not : Operation::negative,
                               std::move(type), std::move(operands));
        }
        const auto rule = element_rule(op, a, b);
        Type type = matlab::type_of(op, a, b);
        if (!rule && op != Operator::Mtimes)
            throw Unresolved("a system of equations or a power of a matrix is not computed there", e);
        if (!rule) return made(Form::multiply, std::move(type), std::move(operands));
        if (rule->is_swapped) std::swap(operands.front(), operands.back());
        return elementwise(rule->operation, std::move(type), std::move(operands));
    }

    static Formula elementwise(Operation operation, Type type, Formulas operands) {
        Formula formula = made(Form::operation, std::move(type), std::move(operands));
        formula.operation = operation;
        return formula;
    }

    /// The second operand counts, and is looked at, only where the first one leaves it open.
    Formula condition(const Expression& e) {
        const bool is_and = e.op == Operator::AndAlso;
        Formulas operands{resolve(*e.parts[0])};
        if (operands[0].is_known() && operands[0].value.truth() != is_and) return constant(!is_and);
        operands.push_back(resolve(*e.parts[1]));
        if (are_known(operands)) return constant(operands[1].value.truth());
        for (const Formula& operand : operands)
            if (operand.type.element > Class::Char)
                throw Error("expected a condition (numbers or logicals), got a " + operand.type.text());
        return made(is_and ? Form::both : Form::either, {Class::Logical}, std::move(operands));
    }

    Formula range_of(const Expression& e) {
        const Formulas bounds = operands_of(e);
        if (!are_known(bounds)) throw Unresolved("a range whose length may change is not computed there", e);
        return constant(range(bounds.front().value, bounds.size() == 3 ? bounds[1].value : Value(1),
                              bounds.back().value, budget_));
    }

    // Arrays

    Formulas operands_of(const Expression& e) {
        Formulas operands;
        operands.reserve(e.parts.size());
        for (const ExpressionPtr& part : e.parts) operands.push_back(resolve(*part));
        return operands;
    }
    /// Elements or arguments from one on; `c{:}` counts as many.
    Formulas list(const Expression& e, std::size_t first) {
        Formulas parts;
        parts.reserve(e.parts.size() - first);
        for (std::size_t i = first; i < e.parts.size(); ++i) {
            const Expression& part = *e.parts[i];
            if (part.kind == Kind::CellIndex)
                std::ranges::move(elements_of(part), std::back_inserter(parts));
            else
                parts.push_back(resolve(part));
        }
        return parts;
    }
    static std::vector<Value> values_of(Formulas parts) {
        std::vector<Value> values;
        values.reserve(parts.size());
        for (Formula& part : parts) values.push_back(std::move(part.value));
        return values;
    }

    /// Rows one above the other, or elements side by side. What is empty leaves no trace but its class.
    Formula joined(Form kind, Formulas parts, const Expression& e) {
        const bool is_row = kind == Form::row;
        if (are_known(parts)) {
            const std::vector<Value> values = values_of(std::move(parts));
            return constant(is_row ? concatenate_columns(values, budget_)
                                   : concatenate_rows(values, budget_));
        }
        if (parts.size() == 1) return std::move(parts[0]);
        std::vector<Type> types;
        for (const Formula& part : parts) types.push_back(part.type);
        Type type = matlab::joined(types, is_row);
        if (type.element == Class::Cell) throw more(e);
        std::erase_if(parts, [](const Formula& part) { return part.type.numel() == 0; });
        return made(kind, std::move(type), std::move(parts));
    }
    Formula matrix(const Expression& e) {
        Formulas rows;
        for (const ExpressionPtr& row : e.parts) rows.push_back(joined(Form::row, list(*row, 0), e));
        if (rows.empty()) return constant({});
        Formula all = joined(Form::column, std::move(rows), e);
        if (!all.is_known() && all.type.numel() == 0) throw Unresolved("it has no element", e);
        return all;
    }

    Formula cell(const Expression& e) {
        std::vector<Value> rows;
        for (const ExpressionPtr& row : e.parts) {
            Formulas elements = list(*row, 0);
            if (!are_known(elements)) throw more(e);
            const auto n = static_cast<Index>(elements.size());
            budget_.allocate(1, double(n));
            if (n > 0) rows.push_back(Value::cell(1, n, values_of(std::move(elements))));
        }
        return constant(rows.empty() ? Value::cell(0, 0) : concatenate_rows(rows, budget_));
    }

    // Indices

    /// Those of an array of this type.
    Formulas indices_of(const Expression& e, const Type& base) {
        const std::size_t count = e.parts.size() - 1;
        Formulas indices;
        for (std::size_t k = 0; k < count; ++k) {
            const Scoped end(end_, std::optional<Index>(extent(base, k, count)));
            const Expression& part = *e.parts[k + 1];
            if (part.kind == Kind::CellIndex) // c{:}
                std::ranges::move(elements_of(part), std::back_inserter(indices));
            else
                indices.push_back(resolve(part));
        }
        return indices;
    }
    static Index extent(const Type& base, std::size_t position, std::size_t count) {
        if (count == 1) return base.numel();
        return position == 0 ? base.rows : position == 1 ? base.cols : 1;
    }
    Value selected(const Value& base, const Formulas& indices) {
        std::vector<Selection> at;
        for (std::size_t k = 0; k < indices.size(); ++k)
            at.push_back(select(indices[k].value, extent(shape_of(base), k, indices.size()), budget_));
        return index(base, at, budget_);
    }

    /// The elements that `c{...}` selects.
    Formulas elements_of(const Expression& e) {
        return located(e, [&] {
            const Formula base = resolve(*e.parts[0]);
            if (!base.is_known()) throw more(e);
            if (!base.value.is_cell())
                throw Error("'{}' indexes cell arrays only, this is a " + base.type.text());
            const Formulas indices = indices_of(e, base.type);
            if (!are_known(indices)) throw more(e);
            const Value chosen = selected(base.value, indices);
            Formulas elements;
            for (Index i = 0; i < chosen.numel(); ++i) elements.push_back(constant(chosen.at(i)));
            return elements;
        });
    }

    /// Elements of an array, or the call of a function.
    Formula index_of(const Expression& e) {
        if (const std::string name = dotted_name(*e.parts[0]); !name.empty() && !is_quantity(name))
            return call(e, name, list(e, 1));
        Formula base = resolve(*e.parts[0]);
        if (base.value.is_function()) {
            Formulas arguments = list(e, 1);
            if (!are_known(arguments)) throw more(e);
            return constant(apply(base.value, values_of(std::move(arguments))));
        }
        if (scope_.is_elementwise && base.kind == Form::slot) return element_of(std::move(base), e);
        Formulas indices = indices_of(e, base.type);
        if (!are_known(indices)) return computed_element(std::move(base), std::move(indices), e);
        if (base.is_known()) return constant(selected(base.value, indices));
        const Value places = selected(places_of(base.type), indices);
        return elements_at(places, std::move(base), e);
    }

    /// A matrix that holds its own places, which count from 1. What puts its elements elsewhere says what
    /// becomes of those of any other matrix; a 0 is a zero of its own.
    static Value places_of(const Type& type) {
        Value::Numbers numbers(static_cast<std::size_t>(type.numel()));
        std::iota(numbers.begin(), numbers.end(), 1.0);
        return Value::array(Class::Double, type.rows, type.cols, std::move(numbers));
    }
    static Formula elements_at(const Value& places, Formula base, const Expression& e) {
        if (places.is_empty()) throw Unresolved("it has no element", e);
        Formula formula = made(Form::elements, {base.type.element, places.rows(), places.cols()}, {});
        for (Index i = 0; i < places.numel(); ++i)
            formula.places.push_back(static_cast<Index>(places[i]) - 1);
        formula.operands.push_back(std::move(base));
        return formula;
    }

    /// The element of a slot for which the formula is not computed anew: u(3).
    Formula element_of(Formula base, const Expression& e) {
        const Formulas indices = e.parts.size() == 2 ? list(e, 1) : Formulas();
        const Value value = indices.size() == 1 && indices[0].is_known() ? indices[0].value : Value();
        if (!value.is_numeric() || !value.is_scalar() || value[0] < 1 || value[0] > 1e9 ||
            value[0] != std::floor(value[0]))
            throw Error("elements are counted by whole numbers from 1", e.parts.back()->span);
        base.places = {static_cast<Index>(value[0]) - 1};
        return base;
    }

    /// The element at indices that change.
    static Formula computed_element(Formula base, Formulas indices, const Expression& e) {
        for (std::size_t i = 0; i < indices.size(); ++i)
            if (!indices[i].type.is_scalar() || indices[i].type.element >= Class::Logical)
                throw Unresolved("a list of indices that may change is not computed there", *e.parts[i + 1]);
        if (indices.size() > 2)
            throw Unresolved("arrays have two dimensions; more indices are not computed there", e);
        const Type type{base.type.element};
        indices.insert(indices.begin(), std::move(base));
        return made(Form::at, type, std::move(indices));
    }

    // Functions

    Formula lambda(const Expression& e) {
        Closure closure{{}, std::make_shared<const Expression>(e), {}};
        for (const std::string& name : free_names(e)) {
            if (slot(name)) throw more(e);
            const std::string root = name.substr(0, name.find('.'));
            const Value* value = variables_->find(root);
            const auto known = std::ranges::find(closure.captured, root, &Value::Fields::value_type::first);
            if (value && known == closure.captured.end()) closure.captured.emplace_back(root, *value);
        }
        return constant(function_handle(std::move(closure)));
    }

    Value apply(const Value& function, std::vector<Value> arguments) override {
        const Level level(*this);
        const Closure& closure = function.function();
        Workspace own;
        const Scoped variables(variables_, static_cast<const Workspace*>(&own));
        const Scoped end(end_, std::optional<Index>());
        if (!closure.lambda) {
            Formulas known;
            for (Value& argument : arguments) known.push_back(constant(std::move(argument)));
            return call(Expression(), closure.name, std::move(known)).value;
        }
        const std::vector<std::string>& parameters = closure.lambda->parameters;
        if (arguments.size() > parameters.size())
            throw Error("the function takes " + std::to_string(parameters.size()) + " arguments, got " +
                        std::to_string(arguments.size()));
        for (const auto& [name, value] : closure.captured) own.set(name, value);
        for (std::size_t i = 0; i < arguments.size(); ++i) own.set(parameters[i], std::move(arguments[i]));
        return resolve(*closure.lambda->parts[0]).value;
    }

    Formula call(const Expression& e, const std::string& name, Formulas arguments) {
        const auto found = builtins().find(name);
        if (found == builtins().end()) unknown(name);
        const auto& [builtin_name, builtin] = *found;
        const std::size_t count = arguments.size();
        check_count(builtin_name, builtin, static_cast<int>(count));
        if (const auto op = operator_functions().find(name); op != operator_functions().end())
            return operation(e, op->second, std::move(arguments));
        if (const auto function = element_function(name, count)) {
            if (are_known(arguments))
                return constant(count == 1
                                    ? computed(*function, arguments[0].value)
                                    : computed(*function, arguments[0].value, arguments[1].value, budget_));
            Type type = count == 1 ? matlab::type_of(*function, arguments[0].type)
                                   : matlab::type_of(*function, arguments[0].type, arguments[1].type);
            return elementwise(*function, std::move(type), std::move(arguments));
        }
        // No slot changes its size.
        if (count > 0 && !scope_.is_elementwise && !arguments[0].is_known() &&
            is_one_of(name, {"size", "numel", "length", "ndims", "isempty"})) {
            const Type& type = arguments[0].type;
            arguments[0] = constant(Value::filled(Class::Double, type.rows, type.cols, 0));
        }
        const bool is_moved = count > 0 && !arguments[0].is_known() &&
                              is_one_of(name, {"diag", "reshape", "repmat", "permute", "flipud", "fliplr",
                                               "flip", "circshift", "tril", "triu"});
        Formula moved =
            is_moved ? std::exchange(arguments[0], constant(places_of(arguments[0].type))) : Formula();
        if (!are_known(arguments)) return open_call(e, name, std::move(arguments));
        std::vector<Value> values = values_of(std::move(arguments));
        double elements = 1;
        for (const Value& value : values) elements += double(value.numel());
        budget_.spend(elements);
        Value value = builtin.value(Call{builtin_name, values, *this});
        return is_moved ? elements_at(value, std::move(moved), e) : constant(std::move(value));
    }

    static void check_count(std::string_view name, const Builtin& builtin, int n) {
        if (n >= builtin.least && (builtin.most < 0 || n <= builtin.most)) return;
        std::string wanted = std::to_string(builtin.least);
        if (builtin.most < 0)
            wanted = "at least " + wanted;
        else if (builtin.most > builtin.least)
            wanted += " to " + std::to_string(builtin.most);
        throw Error("'" + std::string(name) + "' takes " + wanted +
                    (wanted == "1" ? " argument" : " arguments") + ", got " + std::to_string(n));
    }

    /// Of arguments that are not all known.
    Formula open_call(const Expression& e, const std::string& name, Formulas arguments) {
        const Type& type = arguments[0].type;
        if (name == "double") {
            const Class from = number_class(type.element);
            // What computed an integer rounds it, which its new class would hide.
            if (from != Class::Double && arguments[0].kind != Form::slot)
                throw Unresolved("it is computed with a " + std::string(class_name(from)), e);
            arguments[0].type.element = Class::Double;
            return std::move(arguments[0]);
        }
        if (is_one_of(name, {"zeros", "ones", "eye", "repmat", "linspace"}))
            throw Unresolved("its size would change", e);
        throw Unresolved("'" + name + "' is not computed there", e);
    }

    const Scope& scope_;
    Suggestions own_suggestions_;
    Budget budget_;
    int depth_ = 0;
    const Workspace* variables_; ///< those that are known here; a function has its own
    std::optional<Index> end_;   ///< what `end` means
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
    case Form::elements:
        if (f.places[0] < 0) return push({static_cast<double>(Operation::number), 0, 0});
        [[fallthrough]];
    case Form::transpose:
    case Form::row:
    case Form::column: return append(f.operands[0], read, height, code); // of one number: itself
    case Form::multiply:
    case Form::at: throw Error("a step computes this formula with numbers, not with matrices", f.span);
    }
}

} // namespace

Index Type::numel() const {
    return std::accumulate(further.begin(), further.end(), rows * cols, std::multiplies());
}

std::string Type::size_text() const {
    std::string text = std::to_string(rows) + "x" + std::to_string(cols);
    for (const Index extent : further) text += "x" + std::to_string(extent);
    return text;
}

std::string Type::text() const {
    return size_text() + (is_complex ? " complex " : " ") + std::string(class_name(element));
}

Type type_of(const Value& value) {
    Type type = shape_of(value);
    if (value.is_struct())
        for (const auto& [name, field] : value.fields()) type.fields.emplace_back(name, type_of(field));
    return type;
}

Formula resolve(const Expression& expression, const Scope& scope) {
    return Resolver(scope).resolve(expression);
}

Value evaluate(const Expression& expression, const Workspace& variables, Suggestions* suggestions) {
    return resolve(expression, {{}, variables, false, {}, {}, suggestions}).value;
}

Value evaluate(std::string_view text, const Workspace& variables, const Location& start) {
    if (const std::optional<double> number = plain_number(text)) return *number;
    return evaluate(*parse_expression(text, start), variables);
}

std::optional<double> plain_number(std::string_view text) {
    constexpr std::string_view blanks = " \t\r\n";
    const std::size_t begin = text.find_first_not_of(blanks);
    if (begin == std::string_view::npos) return std::nullopt;
    text = text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
    const std::size_t sign = text[0] == '-';
    if (text.size() <= sign) return std::nullopt;
    const char first = text[sign];
    if (first != '.' && !(first >= '0' && first <= '9')) return std::nullopt;
    return number_of(text);
}

std::string dotted_name(const Expression& e) {
    if (e.kind == Kind::Name) return e.name;
    if (e.kind != Kind::Field) return "";
    const std::string base = dotted_name(*e.parts[0]);
    return base.empty() ? "" : base + "." + e.name;
}

std::vector<std::string> free_names(const Expression& expression) {
    std::vector<std::string> names, bound;
    std::unordered_set<std::string> known;
    const std::function<void(const Expression&)> visit = [&](const Expression& e) {
        if (const std::string name = dotted_name(e); !name.empty()) {
            const bool is_free = std::ranges::find(bound, name.substr(0, name.find('.'))) == bound.end();
            if (is_free && known.insert(name).second) names.push_back(name);
            return;
        }
        const std::size_t before = bound.size();
        bound.insert(bound.end(), e.parameters.begin(), e.parameters.end());
        for (const ExpressionPtr& part : e.parts) visit(*part);
        bound.resize(before);
    };
    visit(expression);
    return names;
}

std::vector<double> scalar_program(const Formula& formula,
                                   const std::function<Instruction(const Formula& slot)>& read) {
    std::vector<double> code;
    append(formula, read, 0, code);
    return code;
}

} // namespace bf::matlab

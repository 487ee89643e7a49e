#include "equation.hpp"

#include "names.hpp"

namespace bf::codegen {

std::string EquationPrinter::element(int argument, int index) const {
    const auto& a = arguments_[static_cast<std::size_t>(argument)];
    if (!a.is_array) return a.text;
    return a.text + "[" + (index == loop_ ? "i" : number(index)) + "]";
}

Text EquationPrinter::number_text(double value, Type type) const {
    const std::string text = literal(value, type);
    return {text, text[0] == '-' ? sign : whole};
}

Text EquationPrinter::call_text(const Term& call, Type type) const {
    std::string list;
    for (const auto& one : call.of) {
        std::string text = (*this)(one, type).text;
        if (one->kind == TermKind::number && is_whole(type))
            text = std::string(cpp_name(type)) + "(" + text + ")";
        list += (list.empty() ? "" : ", ") + text;
    }
    return {"math::" + call.op + "(" + list + ")"};
}

Text EquationPrinter::conversion_text(const TermPtr& x, Type type) const {
    return {"math::as<" + std::string(cpp_name(type)) + ">(" + (*this)(x, type).text + ")"};
}

Text EquationPrinter::operator()(const TermPtr& x, Type type) const {
    if (x->type) type = *x->type;
    if (std::string name = name_of(x); !name.empty()) return {std::move(name)};
    switch (x->kind) {
    case TermKind::number: return x->op.empty() ? number_text(x->value, type) : Text{x->op};
    case TermKind::element: return {element(x->argument, x->index)};
    case TermKind::negative: return {"-" + (*this)(x->of[0], type).at(whole), sign};
    case TermKind::arithmetic: {
        const Level level = x->op == "+" || x->op == "-" ? sum : product;
        const Text right = (*this)(x->of[1], type);
        return {(*this)(x->of[0], type).at(level) + " " + x->op + " " +
                    (right.level == sign ? right.at(whole) : right.at(Level(level + 1))),
                level};
    }
    case TermKind::call: return call_text(*x, type);
    case TermKind::conversion: return conversion_text(x->of[0], type);
    case TermKind::comparison: return compared(x, x->op);
    case TermKind::negation:
        if (x->of[0]->kind == TermKind::difference) return differing(x->of[0], " == ");
        if (x->of[0]->kind == TermKind::comparison && x->of[0]->op == "!=") return compared(x->of[0], "==");
        return {"!" + (*this)(x->of[0], type).at(whole), sign};
    case TermKind::conjunction: return {joined(x, " && "), both};
    case TermKind::disjunction: return {joined(x, " || "), either};
    case TermKind::difference: return differing(x, " != ");
    case TermKind::choice:
        return {(*this)(x->of[0], Type::boolean).at(either) + " ? " + (*this)(x->of[1], type).at(either) +
                    " : " + (*this)(x->of[2], type).text,
                chosen};
    }
    return {};
}

Text EquationPrinter::compared(const TermPtr& x, const std::string& op) const {
    const Type type = x->of[0]->type ? *x->of[0]->type : x->of[1]->type ? *x->of[1]->type : Type::float64;
    return {(*this)(x->of[0], type).at(sum) + " " + op + " " + (*this)(x->of[1], type).at(sum),
            op == "==" || op == "!=" ? equality : order};
}
Text EquationPrinter::differing(const TermPtr& x, const char* op) const {
    return {(*this)(x->of[0], Type::boolean).at(sign) + op + (*this)(x->of[1], Type::boolean).at(sign),
            equality};
}
std::string EquationPrinter::joined(const TermPtr& x, const char* op) const {
    std::string text;
    for (const auto& one : x->of) text += (text.empty() ? "" : op) + (*this)(one, Type::boolean).at(equality);
    return text;
}

Text CEquationPrinter::number_text(double value, Type type) const {
    return {c_literal(value, type), c_literal(value, type)[0] == '-' ? sign : whole};
}

Text CEquationPrinter::call_text(const Term& call, Type type) const {
    std::string list;
    for (const auto& one : call.of) list += (list.empty() ? "" : ", ") + (*this)(one, type).text;
    const CFunction function{call.op, type};
    functions_.insert(function);
    return {c_name(function, prefix_) + "(" + list + ")"};
}

Text CEquationPrinter::conversion_text(const TermPtr& x, Type type) const {
    if (type == Type::boolean) return {(*this)(x, type).at(sum) + " != " + c_literal(0, *x->type), equality};
    if (*x->type != Type::boolean) return {"(" + c_name(type) + ")" + (*this)(x, type).at(whole), sign};
    const CFunction function{"number_of", type};
    functions_.insert(function);
    return {c_name(function, prefix_) + "(" + (*this)(x, type).text + ")"};
}

std::string CEquationPrinter::name_of(const TermPtr& x) const {
    const auto found = names_.find(x->key);
    return found == names_.end() ? "" : found->second;
}

bool is_itself(const TermPtr& x, int argument, int index) {
    return x->kind == TermKind::element && x->argument == argument && x->index == index;
}

bool fits(const TermPtr& x, Type type) {
    switch (x->kind) {
    case TermKind::choice: return fits(x->of[1], type) && fits(x->of[2], type);
    case TermKind::number:
        return (!x->type || *x->type == type) &&
               (type != Type::boolean || is_number(x, 0) || is_number(x, 1));
    default: return !x->type || *x->type == type;
    }
}

} // namespace bf::codegen

#include "bf/library/declared.hpp"

#include "bf/base/numbers.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace bf {

namespace {

std::string extent_text(const Declaration& d, const Extent& e) {
    if (e.dim < 0) return std::to_string(e.plus);
    const std::string name = d.dims[static_cast<std::size_t>(e.dim)].name;
    return e.plus ? name + (e.plus > 0 ? "+" : "") + std::to_string(e.plus) : name;
}

std::string size_text(const Declaration& d, const SlotDeclaration& slot) {
    if (slot.shape.symbol >= 0) return "any";
    const std::string rows = extent_text(d, slot.shape.rows);
    if (slot.shape.is_matrix) return rows + " x " + extent_text(d, slot.shape.cols);
    return rows == "1" ? "scalar" : rows;
}

std::string element_text(double x, bool is_boolean) {
    return is_boolean ? (x != 0 ? "true" : "false") : number_text(x + 0.0);
}

std::string value_text(const Value& v) {
    std::string text;
    if (v.kind == Value::Kind::text) return "'" + v.text + "'";
    if (v.kind == Value::Kind::texts) {
        for (const auto& item : v.texts) text += (text.empty() ? "'" : ", '") + item + "'";
        return "{" + text + "}";
    }
    for (int i = 0; i < v.rows; ++i)
        for (int j = 0; j < v.cols; ++j)
            text += (j   ? " "
                     : i ? "; "
                         : "") +
                    element_text(v.data[static_cast<std::size_t>(i + j * v.rows)], v.type == Type::boolean);
    return v.data.size() == 1 ? text : "[" + text + "]";
}

constexpr const char* by_path = "by the path"; // decides the default

std::string initial_text(const SlotDeclaration& slot) {
    const bool is_boolean = slot.type_symbol < 0 && slot.type == Type::boolean;
    if (slot.from_path) return by_path;
    if (slot.initial.empty()) return element_text(0, is_boolean);
    std::string text;
    for (const double x : slot.initial) text += (text.empty() ? "" : " ") + element_text(x, is_boolean);
    return slot.initial.size() == 1 ? text : "[" + text + "]";
}

std::string type_text(const Value& v) {
    switch (v.kind) {
    case Value::Kind::text: return "text";
    case Value::Kind::texts: return "list of texts";
    case Value::Kind::number: break;
    }
    return v.type == Type::boolean ? "boolean" : v.data.size() == 1 ? "number" : "matrix";
}

bool is_shown(const SlotDeclaration& slot) {
    return std::any_of(std::begin(shown_roles), std::end(shown_roles),
                       [&](const auto& r) { return r.first == slot.role; });
}

DeclaredQuantity quantity(const Declaration& d, const SlotDeclaration& slot) {
    const bool has_initial = slot.role != Role::output && (slot.role != Role::input || slot.optional);
    return {slot.role,
            slot.name,
            size_text(d, slot),
            slot.type_symbol < 0 ? name(slot.type) : "any",
            std::string(slot.unit.text),
            slot.doc,
            slot.initial_from >= 0 ? d.slots[static_cast<std::size_t>(slot.initial_from)].name
            : has_initial          ? initial_text(slot)
                                   : "",
            "",
            slot.limits,
            slot.at_least < 0 ? "" : d.slots[static_cast<std::size_t>(slot.at_least)].name};
}

/// Another value of the argument, and what to call it: does it bring ports, or take them away?
std::vector<std::pair<Value, std::string>> other_values(const ArgumentDeclaration& argument) {
    std::vector<std::pair<Value, std::string>> others;
    const Value& initial = argument.initial;
    if (initial.kind == Value::Kind::number && initial.type == Type::boolean && initial.data.size() == 1) {
        const bool other = initial.data[0] == 0;
        others.emplace_back(Value(other), other ? "true" : "false");
    } else if (initial.kind == Value::Kind::number && initial.data.size() == 1 &&
               std::isinf(initial.data[0])) { // no limit, where one may be given
        others.emplace_back(Value(1.0), "finite");
    } else if (initial.kind == Value::Kind::text) {
        for (const auto& choice : argument.choices)
            if (choice != initial.text) others.emplace_back(Value(choice), choice);
    } else if (initial.kind == Value::Kind::texts && initial.texts.empty()) {
        others.emplace_back(Value(std::vector<std::string>{"NAME"}), "[NAME, ...]");
    }
    return others;
}

/// The block with these arguments, or nothing when they are wrong together.
std::unique_ptr<Block> make(const BlockClass& type, const Arguments& arguments) {
    try {
        auto block = type.make(arguments);
        return block->declaration().problems.empty() ? std::move(block) : nullptr;
    } catch (const std::exception&) {
        return nullptr;
    }
}

std::string setting(const std::string& name, const std::string& value) { return name + ": " + value; }

/// What the argument has to be for a quantity that goes when it is `other`, and which further argument brings
/// the quantity back.
std::string condition_of(const BlockClass& type, const Declaration& d, const ArgumentDeclaration& argument,
                         const Value& other, const DeclaredQuantity& q) {
    std::string condition =
        setting(argument.name, argument.initial.kind == Value::Kind::text ? argument.initial.text
                                                                          : value_text(argument.initial));
    for (const auto& further : d.arguments) {
        if (further.name == argument.name) continue;
        for (const auto& [value, text] : other_values(further)) {
            Arguments both;
            both.emplace_back(argument.name, other);
            both.emplace_back(further.name, value);
            const auto block = make(type, both);
            if (block && block->declaration().find(q.name, q.role) >= 0)
                condition += " or " + setting(further.name, text);
        }
    }
    return condition;
}

/// Looks at what comes and goes when the argument has another value. The first `always` quantities are there
/// by default.
void vary(Declared& declared, const BlockClass& type, const Declaration& d,
          const ArgumentDeclaration& argument, std::ptrdiff_t always) {
    const auto before = std::ssize(declared.quantities);
    for (const auto& [value, text] : other_values(argument)) {
        Arguments arguments;
        arguments.emplace_back(argument.name, value);
        const auto block = make(type, arguments);
        if (!block) continue;
        const Declaration& varied = block->declaration();
        for (auto& q : declared.quantities)
            if (q.condition.empty() && varied.find(q.name, q.role) < 0)
                q.condition = condition_of(type, d, argument, value, q);
        for (const auto& slot : varied.slots) {
            const auto known =
                std::find_if(declared.quantities.begin(), declared.quantities.end(),
                             [&](const auto& q) { return q.role == slot.role && q.name == slot.name; });
            if (!is_shown(slot)) continue;
            if (known == declared.quantities.end()) {
                declared.quantities.push_back(quantity(varied, slot));
                declared.quantities.back().condition = setting(argument.name, text);
            } else if (known - declared.quantities.begin() >= before) {
                known->condition += " or " + text;
            } else if (known - declared.quantities.begin() >= always) {
                known->condition += " or " + setting(argument.name, text);
            }
        }
    }
}

} // namespace

std::string first_sentence(const std::string& doc) {
    const auto end = doc.find(". ");
    return doc.substr(0, end == std::string::npos && doc.ends_with('.') ? doc.size() - 1 : end);
}

std::string with_limits(const std::string& doc, const Limits& limits, const std::string& at_least) {
    std::string text = text_of(limits);
    if (!at_least.empty()) text += (text.empty() ? "at least " : ", at least ") + at_least;
    return doc + (doc.empty() || text.empty() ? "" : "; ") + text;
}

Declared declared(const BlockClass& type) {
    const auto block = type.make({});
    const Declaration& d = block->declaration();
    Declared result{type.library, type.name, type.qualified_name(), type.group, type.doc, {}, {}, {}, {}};
    for (const auto& slot : d.slots)
        if (is_shown(slot)) result.quantities.push_back(quantity(d, slot));
    const auto always = std::ssize(result.quantities);
    for (const auto& argument : d.arguments) {
        result.arguments.push_back({argument.name, type_text(argument.initial),
                                    argument.from_path ? by_path : value_text(argument.initial), argument.doc,
                                    argument.choices, argument.limits});
        vary(result, type, d, argument, always);
    }
    for (const auto& r : d.requirements) result.needs.push_back({r.type, r.doc});
    for (const auto& p : d.provisions) result.provides.push_back({p.type, ""});
    return result;
}

} // namespace bf

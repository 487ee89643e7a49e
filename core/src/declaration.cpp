#include "bf/core/block.hpp"

#include <algorithm>

namespace bf {

const char* name(Role role) {
    switch (role) {
    case Role::input: return "input";
    case Role::output: return "output";
    case Role::parameter: return "parameter";
    case Role::discrete_state: return "discrete state";
    case Role::continuous_state: return "continuous state";
    case Role::workspace: return "workspace";
    case Role::guard: return "guard";
    }
    return "";
}

std::string text_of(const Limits& limits) {
    char text[96];
    kernels::describe(limits, text, sizeof text);
    return text;
}

template <class Bounds>
static std::string text_outside(const Bounds& bounds, const std::vector<double>& values) {
    char text[192];
    const auto value = [&](int i) { return values[static_cast<std::size_t>(i)]; };
    const bool is_found =
        kernels::find_outside(bounds, static_cast<int>(values.size()), value, text, sizeof text);
    return is_found ? text : "";
}

std::string outside(const Limits& limits, const std::vector<double>& values) {
    return text_outside(limits, values);
}

std::string outside(Type type, const std::vector<double>& values) {
    return with_type(
        type, [&](auto t) { return text_outside(kernels::range_of<typename decltype(t)::type>(), values); });
}

Dim::Dim(Block* owner, const char* name, std::function<int()> rule) {
    auto& dims = detail::declared_by(*owner).dims;
    id_ = static_cast<int>(dims.size());
    dims.push_back({name, std::move(rule), {}});
}

Dim::Dim(Block* owner, const char* name, std::function<Names()> names)
    : Dim(owner, name, [names] {
          const auto known = names();
          return known ? static_cast<int>(known->size()) : -1;
      }) {
    detail::declared_by(*owner).dims.back().names = std::move(names);
}

AnyShape::AnyShape(Block* owner) { id_ = detail::declared_by(*owner).shapes++; }

int Declaration::find(std::string_view slot_name) const {
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].name == slot_name) return static_cast<int>(i);
    return -1;
}

int Declaration::find(std::string_view slot_name, Role role) const {
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].role == role && slots[i].name == slot_name) return static_cast<int>(i);
    return -1;
}

std::vector<std::string> Declaration::element_names(int slot) const {
    const Shape& shape = slots[static_cast<std::size_t>(slot)].shape;
    if (shape.symbol >= 0 || shape.is_matrix || shape.rows.dim < 0 || shape.rows.plus != 0) return {};
    const auto& names = dims[static_cast<std::size_t>(shape.rows.dim)].names;
    return names ? names().value_or(std::vector<std::string>()) : std::vector<std::string>();
}

namespace {

/// Does rule-written `slot` depend on `input`, through workspaces and outputs written by the rules before?
bool depends(const Declaration& d, int slot, int input, std::size_t rules) {
    for (std::size_t i = 0; i < rules; ++i)
        if (d.output_rules[i].writes(slot))
            for (const auto& operand : d.output_rules[i].operands)
                if (operand.slot >= 0 && (operand.slot == input || depends(d, operand.slot, input, i)))
                    return true;
    return false;
}

} // namespace

bool Block::feedthrough(int output, int input) const {
    const auto& rules = declaration_.output_rules;
    for (const Call& rule : rules)
        if (rule.writes(output)) return depends(declaration_, output, input, rules.size());
    return declaration_.slots[static_cast<std::size_t>(input)].feedthrough;
}

bool Block::needs(int input) const { return !declaration_.slots[static_cast<std::size_t>(input)].optional; }

namespace detail {

Declaration& declared_by(Block& owner) { return owner.declaration_; }

int declare(Block& owner, Role role, std::string name, const About& about, Shape shape, Type type,
            int symbol) {
    if (!about.present) return -1;
    auto& d = declared_by(owner);
    SlotDeclaration slot;
    slot.role = role;
    slot.name = std::move(name);
    slot.doc = about.doc;
    slot.unit = about.unit;
    slot.shape = shape;
    slot.type_symbol = symbol;
    slot.type = type;
    slot.feedthrough = about.feedthrough;
    slot.optional = about.optional;
    slot.reported = about.reported;
    slot.as_written = about.as_written;
    slot.from_path = about.from_path;
    slot.initial_from = about.initial_from;
    slot.initial = about.initial;
    slot.value_names.assign(about.value_names.begin(), about.value_names.end());
    if (role == Role::parameter) {
        slot.limits = {about.minimum, about.above, about.maximum};
        slot.at_least = about.at_least;
    }
    if (role == Role::input || role == Role::output)
        for (const auto& other : d.slots)
            if (other.role == role && other.name == slot.name)
                d.problems.push_back("there are two " + std::string(bf::name(role)) + "s '" + slot.name +
                                     "'; name once what they are called after");
    d.types = std::max(d.types, symbol + 1);
    d.slots.push_back(std::move(slot));
    return static_cast<int>(d.slots.size()) - 1;
}

int declare(Block& owner, ObjectDeclaration object) {
    auto& objects = declared_by(owner).objects;
    objects.push_back(std::move(object));
    return static_cast<int>(objects.size()) - 1;
}

} // namespace detail
} // namespace bf

namespace bf {

const std::vector<Call>& Declaration::rules(Phase phase) const {
    switch (phase) {
    case Phase::output: break;
    case Phase::update: return update_rules;
    case Phase::derivative: return derivative_rules;
    case Phase::guards: return guard_rules;
    case Phase::event: return event_rules;
    }
    return output_rules;
}

} // namespace bf

namespace bf::detail {

std::vector<Call>& output_rules(Block& owner) { return declared_by(owner).output_rules; }
std::vector<Call>& update_rules(Block& owner) { return declared_by(owner).update_rules; }
std::vector<Call>& derivative_rules(Block& owner) { return declared_by(owner).derivative_rules; }
std::vector<Call>& guard_rules(Block& owner) { return declared_by(owner).guard_rules; }
std::vector<Call>& event_rules(Block& owner) { return declared_by(owner).event_rules; }

} // namespace bf::detail

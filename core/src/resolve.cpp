#include "bf/core/resolve.hpp"

#include "bf/base/elements.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bf {

namespace {

std::string label(const Slot& slot) { return std::string(name(slot.role)) + " '" + slot.name + "'"; }

/// A 1-D signal fits an n x 1 matrix and conversely: same elements, same order.
bool same_elements(const Size& a, const Size& b) { return a.rows == b.rows && a.cols == b.cols; }

bool unify_extent(Resolution& r, const Slot& slot, const Extent& extent, int actual) {
    const int wanted = actual - extent.plus;
    if (extent.dim < 0) {
        if (extent.plus != actual)
            throw ResolutionError(label(slot) + " has length " + std::to_string(extent.plus) +
                                  ", but is wired to length " + std::to_string(actual));
        return false;
    }
    if (wanted < 0)
        throw ResolutionError(label(slot) + " has at least " + std::to_string(extent.plus) +
                              " elements, but is wired to length " + std::to_string(actual));
    const auto& [name, rule, names] = r.declaration().dims[static_cast<std::size_t>(extent.dim)];
    int& value = r.dims[static_cast<std::size_t>(extent.dim)];
    if (rule && value < 0) value = rule(); // the rule goes before the wiring
    if (value == wanted) return false;
    if (value >= 0) {
        // A parameter may be the one that is wrong, and is told by whoever finds it.
        const auto has_decided = [&](const Slot& other) {
            const auto tells = [&](const Extent& e, int length) {
                return e.dim == extent.dim && length - e.plus == value;
            };
            return other.role == Role::parameter && &other != &slot && other.size_known &&
                   other.size.count() > 1 && other.shape.symbol < 0 &&
                   (tells(other.shape.rows, other.size.rows) || tells(other.shape.cols, other.size.cols));
        };
        const auto parameter = std::ranges::find_if(r.slots, has_decided);
        throw ResolutionError(label(slot) + " needs " + name + " = " + std::to_string(wanted) + ", but " +
                              name + " is already " + std::to_string(value) +
                              (parameter == r.slots.end() ? "" : ", as " + label(*parameter) + " has it"));
    }
    value = wanted;
    return true;
}

/// The size a declared shape has as far as its symbols are known.
bool known_size(const Resolution& r, const Slot& slot, Size& size) {
    if (slot.shape.symbol >= 0) {
        const auto& known = r.shapes[static_cast<std::size_t>(slot.shape.symbol)];
        size = known.value_or(Size{});
        return known.has_value();
    }
    const auto extent = [&](const Extent& e) {
        if (e.dim < 0) return e.plus;
        const int value = r.dims[static_cast<std::size_t>(e.dim)];
        return value < 0 ? -1 : value + e.plus;
    };
    size = {extent(slot.shape.rows), extent(slot.shape.cols), slot.shape.is_matrix};
    return size.rows >= 0 && size.cols >= 0;
}

/// Asks the rules of lengths, which know more once resources are bound. Throws where a value that was given
/// before has decided otherwise.
void ask_rules(Resolution& r) {
    const auto& dims = r.declaration().dims;
    for (std::size_t i = 0; i < dims.size(); ++i) {
        if (!dims[i].rule) continue;
        const int known = dims[i].rule();
        if (known < 0) continue;
        r.dims[i] = known;
        for (const auto& slot : r.slots) {
            if (!slot.size_known || slot.shape.symbol >= 0) continue;
            const auto check = [&](const Extent& extent, int actual) {
                if (extent.dim == static_cast<int>(i)) unify_extent(r, slot, extent, actual);
            };
            check(slot.shape.rows, slot.size.rows);
            check(slot.shape.cols, slot.size.cols);
        }
    }
}

/// Throws when the element types that wiring decided are not among those that a rule can work on.
void check_types(const Resolution& r) {
    for (const Phase phase : phases)
        for (const Call& call : r.declaration().rules(phase)) {
            std::size_t version = 0;
            bool known = true;
            for (int symbol = 0; symbol < call.symbols; ++symbol) {
                const auto s = static_cast<std::size_t>(symbol);
                known = known && s < r.types.size() && r.types[s];
                version = version * type_count + (known ? static_cast<std::size_t>(*r.types[s]) : 0);
            }
            if (!known || call.run[version]) continue;
            for (const auto& operand : call.operands)
                if (operand.slot >= 0 && r.slots[static_cast<std::size_t>(operand.slot)].type_symbol == 0)
                    throw TypeError(label(r.slots[static_cast<std::size_t>(operand.slot)]) +
                                    " cannot be of type " + name(*r.types[0]) +
                                    ", for which this operation is not defined; insert a Convert block");
        }
}

} // namespace

bool offer(Resolution& r, int index, const Size& offered) {
    Slot& slot = r.slots[static_cast<std::size_t>(index)];
    if (slot.shape.symbol >= 0) {
        auto& known = r.shapes[static_cast<std::size_t>(slot.shape.symbol)];
        if (known && !same_elements(*known, offered))
            throw ResolutionError(label(slot) + " must have size " + known->text() +
                                  " like the other quantities of its shape, but is wired to size " +
                                  offered.text());
        if (known) return false;
        known = offered;
        slot.size = offered;
        slot.size_known = true;
        return true;
    }
    bool news = !slot.size_known;
    if (!slot.shape.is_matrix && offered.cols != 1)
        throw ResolutionError(label(slot) + " is a 1-D signal, but is wired to a " + offered.text() +
                              " matrix");
    news = unify_extent(r, slot, slot.shape.rows, offered.rows) || news;
    news = unify_extent(r, slot, slot.shape.cols, offered.cols) || news;
    slot.size = {offered.rows, offered.cols, slot.shape.is_matrix};
    slot.size_known = true;
    return news;
}

bool offer(Resolution& r, int index, Type type) {
    const Slot& slot = r.slots[static_cast<std::size_t>(index)];
    if (slot.type_symbol < 0) {
        if (slot.type != type)
            throw TypeError(label(slot) + " is of type " + name(slot.type) + ", but is wired to type " +
                            name(type) + "; insert a Convert block");
        return false;
    }
    auto& known = r.types[static_cast<std::size_t>(slot.type_symbol)];
    if (known && *known != type)
        throw TypeError(label(slot) + " must be of type " + name(*known) +
                        " like the other quantities of its kind, but is wired to type " + name(type) +
                        "; insert a Convert block");
    const bool news = !known;
    known = type;
    return news;
}

namespace {

Size size_of(const Slot& slot, const Value& value) {
    if (value.rows == 1 && value.cols == 1) return {1, 1, slot.shape.is_matrix};
    const bool is_vector = value.rows == 1 || value.cols == 1;
    if (slot.shape.is_matrix || slot.as_written || !is_vector) return {value.rows, value.cols, true};
    return {value.rows * value.cols, 1, false};
}

/// Where an input shares the parameter's shape, one element expands to what is wired.
bool has_own_shape(const Resolution& r, const Slot& slot) {
    if (slot.shape.symbol < 0) return false;
    return std::none_of(r.slots.begin(), r.slots.end(), [&](const Slot& s) {
        return s.role == Role::input && s.shape.symbol == slot.shape.symbol;
    });
}

} // namespace

void give(Resolution& r, int index, const Value& value) {
    Slot& slot = r.slots[static_cast<std::size_t>(index)];
    slot.initial = value.data;
    if (has_own_shape(r, slot) || value.data.size() > 1) offer(r, index, size_of(slot, value));
    if (value.type != Type::float64 && slot.type_symbol >= 0) offer(r, index, value.type);
}

std::string outside_limits(const Slot& slot, const std::vector<double>& values, const std::string& path) {
    std::string wrong = outside(slot.limits, values);
    if (wrong.empty()) wrong = outside(slot.type, values); // double until it is known
    return wrong.empty() ? wrong : "parameter '" + (path.empty() ? slot.name : path) + "' " + wrong;
}

std::string wrong_size(const Slot& slot, bool is_connected) {
    const auto elements = std::int64_t{slot.size.rows} * slot.size.cols;
    if (elements > std::numeric_limits<int>::max())
        return label(slot) + " is " + slot.size.text() + ", more elements than can be counted";
    const auto given = static_cast<std::int64_t>(slot.initial.size());
    if (given <= 1 || given == elements || is_connected) return "";
    const char* const whose = slot.role == Role::parameter ? "" : "the initial value of ";
    return whose + label(slot) + " has " + std::to_string(given) + " elements, but needs " +
           std::to_string(elements);
}

std::string below_another(const Resolution& r, int parameter) {
    const auto value = [&](int slot, int i) {
        const auto& values = r.slots[static_cast<std::size_t>(slot)].initial;
        const auto element = values.size() == 1 ? 0 : static_cast<std::size_t>(i);
        // A wrong number of elements is a mistake of its own.
        return values.empty() ? 0 : element < values.size() ? values[element] : NAN;
    };
    char wrong[320];
    const std::string& path = r.slots[static_cast<std::size_t>(parameter)].name;
    return is_below_another(r, parameter, value, path.c_str(), wrong, sizeof wrong) ? wrong : "";
}

std::string outside_remedy(const Slot& slot) {
    if (slot.type_symbol < 0 || slot.type == Type::float64) return {}; // not decided by signals
    return std::string("the parameter has the type of its signals, ") + name(slot.type) +
           ": give a value of that type, or convert the signals before the block with a Convert block";
}

Size size_of_value(const Slot& slot) {
    return {std::max(1, static_cast<int>(slot.initial.size())), 1, slot.shape.is_matrix};
}

void give_defaults(Resolution& r) {
    for (std::size_t i = 0; i < r.slots.size(); ++i) {
        const Slot& slot = r.slots[i];
        if (slot.role != Role::parameter || !has_own_shape(r, slot)) continue;
        if (!r.shapes[static_cast<std::size_t>(slot.shape.symbol)])
            offer(r, static_cast<int>(i), size_of_value(slot));
    }
}

bool propagate(Block& block) {
    Resolution& r = block.resolution();
    ask_rules(r);
    bool learned = false;
    for (bool again = true; again;) {
        again = false;
        for (auto& slot : r.slots) {
            if (!slot.size_known && known_size(r, slot, slot.size)) slot.size_known = again = true;
            if (slot.type_known) continue;
            if (const auto& known = r.types[static_cast<std::size_t>(slot.type_symbol)]) {
                slot.type = *known;
                slot.type_known = again = true;
            }
        }
        const auto count = [&] {
            std::size_t known = 0;
            for (const auto& size : r.shapes) known += size.has_value();
            for (const auto& type : r.types) known += type.has_value();
            for (const int length : r.dims) known += length >= 0;
            for (const auto& slot : r.slots) known += slot.size_known;
            return known;
        };
        const std::size_t before = count();
        Inference inference(r);
        r.same_elements.clear();
        block.infer(inference);
        again = again || count() != before;
        learned = learned || again;
    }
    check_types(r);
    return learned;
}

std::vector<int> sized_by_initial(const Resolution& r, const Slot& state) {
    std::vector<int> inputs;
    if (state.initial_from < 0) return inputs;
    const Slot& initial = r.slots[static_cast<std::size_t>(state.initial_from)];
    for (std::size_t i = 0; initial.size_known && i < r.slots.size(); ++i) {
        const Slot& input = r.slots[i];
        const bool is_alike = state.shape.symbol >= 0 && input.shape.symbol == state.shape.symbol;
        if (input.role == Role::input && !input.size_known && (is_alike || initial.size.is_scalar()))
            inputs.push_back(static_cast<int>(i));
    }
    return inputs;
}

void settle_sizes(Block& block) {
    Resolution& r = block.resolution();
    const auto decide = [&](std::size_t slot, const Size& size) {
        if (r.slots[slot].size_known) return;
        offer(r, static_cast<int>(slot), size);
        propagate(block);
    };
    propagate(block);
    for (std::size_t i = 0; i < r.slots.size(); ++i)
        if (const Slot& slot = r.slots[i]; slot.role == Role::parameter || slot.optional)
            decide(i, size_of_value(slot));
    for (const Slot& state : r.slots)
        if (!state.size_known && state.initial_from >= 0)
            for (const int input : sized_by_initial(r, state))
                decide(static_cast<std::size_t>(input),
                       r.slots[static_cast<std::size_t>(state.initial_from)].size);
    for (const Role role : {Role::input, Role::output})
        for (std::size_t i = 0; i < r.slots.size(); ++i)
            if (r.slots[i].role == role) decide(i, Size{});
}

void settle_types(Block& block) {
    for (std::size_t i = 0; i < block.resolution().slots.size(); ++i)
        if (!block.resolution().type_of(static_cast<int>(i))) {
            offer(block.resolution(), static_cast<int>(i), Type::float64);
            propagate(block);
        }
}

std::vector<int> unresolved(const Resolution& r) {
    std::vector<int> found;
    for (std::size_t i = 0; i < r.slots.size(); ++i)
        if (!r.slots[i].size_known || !r.slots[i].type_known) found.push_back(static_cast<int>(i));
    return found;
}

void require(Block& block, int requirement, std::shared_ptr<const void> resource) {
    const auto i = static_cast<std::size_t>(requirement);
    block.declaration().requirements[i].bind(resource);
    block.resolution().required[i] = std::move(resource);
}

void provide(Block& block) {
    auto& provided = block.resolution().provided;
    for (std::size_t i = 0; i < provided.size(); ++i)
        if (!provided[i]) provided[i] = block.declaration().provisions[i].make();
}

// ---- what is known

Resolution::Resolution(const Declaration& d)
    : slots(d.slots.size()), dims(d.dims.size(), -1), shapes(static_cast<std::size_t>(d.shapes)),
      types(static_cast<std::size_t>(d.types)), required(d.requirements.size()),
      provided(d.provisions.size()), declaration_(&d) {
    for (std::size_t i = 0; i < slots.size(); ++i) {
        static_cast<SlotDeclaration&>(slots[i]) = d.slots[i];
        slots[i].type_known = d.slots[i].type_symbol < 0;
    }
}

std::string Resolution::element_name(int slot, int element) const {
    const Slot& of = slots[static_cast<std::size_t>(slot)];
    return of.name + element_text(of.size.rows, of.size.cols, element, declaration_->element_names(slot));
}

std::optional<Type> Resolution::type_of(int slot) const {
    const Slot& of = slots[static_cast<std::size_t>(slot)];
    return of.type_symbol < 0 ? of.type : types[static_cast<std::size_t>(of.type_symbol)];
}

bool Resolution::is_bound() const {
    return std::find(required.begin(), required.end(), nullptr) == required.end();
}

const void* Resolution::find_provided(std::string_view type) const {
    for (std::size_t i = 0; i < provided.size(); ++i)
        if (declaration_->provisions[i].type == type) return provided[i].get();
    return nullptr;
}

Resolution& Block::resolution() {
    if (!resolution_) resolution_ = std::make_unique<Resolution>(declaration_);
    return *resolution_;
}
const Resolution& Block::resolution() const { return const_cast<Block*>(this)->resolution(); }

const Size* Inference::size(int slot) const {
    if (slot < 0) return nullptr;
    const auto& s = resolution_->slots[static_cast<std::size_t>(slot)];
    return s.size_known ? &s.size : nullptr;
}
const Type* Inference::type(int slot) const {
    if (slot < 0) return nullptr;
    const auto& s = resolution_->slots[static_cast<std::size_t>(slot)];
    return s.type_known ? &s.type : nullptr;
}
void Inference::set(int slot, Size size) {
    if (slot >= 0) offer(*resolution_, slot, size);
}
void Inference::set(int slot, Type type) {
    if (slot >= 0) offer(*resolution_, slot, type);
}
void Inference::same_elements(SameElements elements) {
    resolution_->same_elements.push_back(std::move(elements));
}
void Inference::claim(Claim claim) {
    auto& claims = resolution_->claims;
    const bool is_new = std::none_of(claims.begin(), claims.end(), [&](const Claim& made) {
        return made.of == claim.of && made.what == claim.what;
    });
    if (is_new) claims.push_back(std::move(claim));
}
void Inference::refuse(const std::string& message) const { throw ResolutionError(message); }

} // namespace bf

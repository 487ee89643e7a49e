#include "bf/core/resolve.hpp"

#include <algorithm>

namespace bf {

namespace {

std::string label(const Slot& slot) { return std::string(name(slot.role)) + " '" + slot.name + "'"; }

/// A 1-D signal fits an n x 1 matrix and conversely: same elements, same order.
bool same_elements(const Size& a, const Size& b) { return a.rows == b.rows && a.cols == b.cols; }

bool unify_extent(Declaration& d, const Slot& slot, const Extent& extent, int actual) {
    const int wanted = actual - extent.plus;
    if (extent.dim < 0) {
        if (extent.plus != actual)
            throw ResolutionError(label(slot) + " has length " + std::to_string(extent.plus) +
                                  ", but is wired to length " + std::to_string(actual));
        return false;
    }
    auto& dim = d.dims[static_cast<std::size_t>(extent.dim)];
    if (dim.rule && dim.value < 0) dim.value = dim.rule(); // the rule goes before the wiring
    if (dim.value == wanted) return false;
    if (dim.value >= 0 || wanted < 0)
        throw ResolutionError(label(slot) + " needs " + dim.name + " = " + std::to_string(wanted) + ", but " +
                              dim.name + " is already " + std::to_string(dim.value));
    dim.value = wanted;
    return true;
}

/// The size a declared shape has as far as its symbols are known.
bool known_size(const Declaration& d, const Slot& slot, Size& size) {
    if (slot.shape.symbol >= 0) {
        const auto& symbol = d.shapes[static_cast<std::size_t>(slot.shape.symbol)];
        size = symbol.size;
        return symbol.known;
    }
    const auto extent = [&](const Extent& e) {
        if (e.dim < 0) return e.plus;
        const int value = d.dims[static_cast<std::size_t>(e.dim)].value;
        return value < 0 ? -1 : value + e.plus;
    };
    size = {extent(slot.shape.rows), extent(slot.shape.cols), slot.shape.is_matrix};
    return size.rows >= 0 && size.cols >= 0;
}

/// Throws when the element types that wiring decided are not among those that a rule can work on.
void check_types(const Declaration& d) {
    for (const auto* rules : {&d.output_rules, &d.update_rules, &d.derivative_rules, &d.guard_rules})
        for (const Call& call : *rules) {
            std::size_t version = 0;
            bool known = true;
            for (int symbol = 0; symbol < call.symbols; ++symbol) {
                const auto s = static_cast<std::size_t>(symbol);
                known = known && s < d.types.size() && d.types[s].known;
                version = version * type_count + (known ? static_cast<std::size_t>(d.types[s].type) : 0);
            }
            if (!known || call.run[version]) continue;
            for (const auto& operand : call.operands)
                if (operand.slot >= 0 && d.slots[static_cast<std::size_t>(operand.slot)].type_symbol == 0)
                    throw ResolutionError(
                        label(d.slots[static_cast<std::size_t>(operand.slot)]) + " cannot be of type " +
                        name(d.types[0].type) +
                        ", for which this operation is not defined; insert a Convert block");
        }
}

} // namespace

bool offer(Declaration& d, int index, const Size& offered) {
    Slot& slot = d.slots[static_cast<std::size_t>(index)];
    if (slot.shape.symbol >= 0) {
        auto& symbol = d.shapes[static_cast<std::size_t>(slot.shape.symbol)];
        if (symbol.known && !same_elements(symbol.size, offered))
            throw ResolutionError(label(slot) + " must have size " + symbol.size.text() +
                                  " like the other quantities of its shape, but is wired to size " +
                                  offered.text());
        if (symbol.known) return false;
        symbol = {offered, true};
        slot.size = offered;
        slot.size_known = true;
        return true;
    }
    bool news = !slot.size_known;
    if (!slot.shape.is_matrix && offered.cols != 1)
        throw ResolutionError(label(slot) + " is a 1-D signal, but is wired to a " + offered.text() +
                              " matrix");
    news = unify_extent(d, slot, slot.shape.rows, offered.rows) || news;
    news = unify_extent(d, slot, slot.shape.cols, offered.cols) || news;
    slot.size = {offered.rows, offered.cols, slot.shape.is_matrix};
    slot.size_known = true;
    return news;
}

bool offer(Declaration& d, int index, Type type) {
    Slot& slot = d.slots[static_cast<std::size_t>(index)];
    if (slot.type_symbol < 0) {
        if (slot.type != type)
            throw ResolutionError(label(slot) + " is of type " + name(slot.type) + ", but is wired to type " +
                                  name(type) + "; insert a Convert block");
        return false;
    }
    auto& symbol = d.types[static_cast<std::size_t>(slot.type_symbol)];
    if (symbol.known && symbol.type != type)
        throw ResolutionError(label(slot) + " must be of type " + name(symbol.type) +
                              " like the other quantities of its kind, but is wired to type " + name(type) +
                              "; insert a Convert block");
    const bool news = !symbol.known;
    symbol = {type, true};
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
bool has_own_shape(const Declaration& d, const Slot& slot) {
    if (slot.shape.symbol < 0) return false;
    return std::none_of(d.slots.begin(), d.slots.end(), [&](const Slot& s) {
        return s.role == Role::input && s.shape.symbol == slot.shape.symbol;
    });
}

} // namespace

void give(Declaration& d, int index, const Value& value) {
    Slot& slot = d.slots[static_cast<std::size_t>(index)];
    slot.initial = value.data;
    if (has_own_shape(d, slot) || value.data.size() > 1) offer(d, index, size_of(slot, value));
    if (value.type != Type::float64 && slot.type_symbol >= 0) offer(d, index, value.type);
}

std::string outside_limits(const Slot& slot, const std::vector<double>& values, const std::string& path) {
    std::string wrong = outside(slot.limits, values);
    const bool is_typed = slot.type_known || slot.type_symbol < 0;
    if (wrong.empty()) wrong = outside(is_typed ? slot.type : Type::float64, values);
    return wrong.empty() ? wrong : "parameter '" + (path.empty() ? slot.name : path) + "' " + wrong;
}

std::string outside_remedy(const Slot& slot) {
    if (slot.type_symbol < 0 || !slot.type_known || slot.type == Type::float64) return {};
    return std::string("the parameter has the type of its signals, ") + name(slot.type) +
           ": give a value of that type, or convert the signals before the block with a Convert block";
}

void give_defaults(Declaration& d) {
    for (std::size_t i = 0; i < d.slots.size(); ++i) {
        const Slot& slot = d.slots[i];
        if (slot.role != Role::parameter || !has_own_shape(d, slot)) continue;
        if (!d.shapes[static_cast<std::size_t>(slot.shape.symbol)].known)
            offer(d, static_cast<int>(i), Size{std::max(static_cast<int>(slot.initial.size()), 1), 1, false});
    }
}

bool propagate(Block& block) {
    auto& d = block.declaration();
    for (auto& dim : d.dims)
        if (dim.rule && dim.value < 0) dim.value = dim.rule();
    bool learned = false;
    for (bool again = true; again;) {
        again = false;
        for (auto& slot : d.slots) {
            if (!slot.size_known && known_size(d, slot, slot.size)) slot.size_known = again = true;
            if (!slot.type_known) {
                const auto& symbol = d.types[static_cast<std::size_t>(slot.type_symbol)];
                if (symbol.known) {
                    slot.type = symbol.type;
                    slot.type_known = again = true;
                }
            }
        }
        const auto count = [&] {
            std::size_t known = 0;
            for (const auto& symbol : d.shapes) known += symbol.known;
            for (const auto& symbol : d.types) known += symbol.known;
            for (const auto& dim : d.dims) known += dim.value >= 0;
            for (const auto& slot : d.slots) known += slot.size_known;
            return known;
        };
        const std::size_t before = count();
        Inference inference(d);
        d.same_elements.clear();
        block.infer(inference);
        again = again || count() != before;
        learned = learned || again;
    }
    check_types(d);
    return learned;
}

std::vector<int> unresolved(const Declaration& d) {
    std::vector<int> found;
    for (std::size_t i = 0; i < d.slots.size(); ++i)
        if (!d.slots[i].size_known || !d.slots[i].type_known) found.push_back(static_cast<int>(i));
    return found;
}

const Size* Inference::size(int slot) const {
    if (slot < 0) return nullptr;
    const auto& s = declaration_->slots[static_cast<std::size_t>(slot)];
    return s.size_known ? &s.size : nullptr;
}
const Type* Inference::type(int slot) const {
    if (slot < 0) return nullptr;
    const auto& s = declaration_->slots[static_cast<std::size_t>(slot)];
    return s.type_known ? &s.type : nullptr;
}
void Inference::set(int slot, Size size) {
    if (slot >= 0) offer(*declaration_, slot, size);
}
void Inference::set(int slot, Type type) {
    if (slot >= 0) offer(*declaration_, slot, type);
}
void Inference::same_elements(SameElements elements) {
    declaration_->same_elements.push_back(std::move(elements));
}
void Inference::refuse(const std::string& message) const { throw ResolutionError(message); }

} // namespace bf

#include "bf/library/stand_ins.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/formats/yaml.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

namespace bf {

namespace {

using Json = nlohmann::ordered_json;

/// A declared quantity with what a diagram decided about it; nothing: its wiring decides.
struct KnownSlot {
    SlotDeclaration slot;
    std::string unit;
    std::vector<int> si; ///< exponents of the unit
    std::optional<Size> size;
    std::optional<Type> type;
    std::vector<std::string> names; ///< of its elements
};

/// What a class of blocks declares with some arguments.
struct Made {
    std::vector<ArgumentDeclaration> arguments;
    std::vector<KnownSlot> quantities;
    std::vector<std::string> dims;             ///< names of lengths that wires decide
    int shapes = 0, types = 0;                 ///< symbols of sizes and types that wires decide
    std::vector<std::vector<int>> feedthrough; ///< outputs and inputs, by slot
    Traits traits;
    bool has_objects = false; ///< so that its outputs may change by themselves
    bool is_bound = false;    ///< is it known which input reaches which output?
};

struct Stored {
    std::string name, group, doc;
    Block::Methods methods;
    std::map<std::string, Made> made; ///< by arguments, see key_of
};

// ---- as JSON: what is written and read follows from one list of members for each struct ----

template <class T, class Visit> void each_member(Visit&& visit, T& value) {
    if constexpr (std::is_same_v<T, Limits>) {
        visit("minimum", value.minimum), visit("above", value.above), visit("maximum", value.maximum);
    } else if constexpr (std::is_same_v<T, Size>) {
        visit("rows", value.rows), visit("cols", value.cols), visit("is_matrix", value.is_matrix);
    } else if constexpr (std::is_same_v<T, Extent>) {
        visit("dim", value.dim), visit("plus", value.plus);
    } else if constexpr (std::is_same_v<T, Shape>) {
        visit("rows", value.rows), visit("cols", value.cols), visit("is_matrix", value.is_matrix);
        visit("is_given", value.is_given), visit("symbol", value.symbol);
    } else if constexpr (std::is_same_v<T, Value>) {
        visit("kind", value.kind), visit("type", value.type), visit("rows", value.rows),
            visit("cols", value.cols);
        visit("data", value.data), visit("text", value.text), visit("texts", value.texts);
    } else if constexpr (std::is_same_v<T, ArgumentDeclaration>) {
        visit("name", value.name), visit("doc", value.doc), visit("initial", value.initial);
        visit("choices", value.choices), visit("limits", value.limits), visit("from_path", value.from_path);
        visit("is_secret", value.is_secret);
    } else if constexpr (std::is_same_v<T, KnownSlot>) {
        SlotDeclaration& slot = value.slot;
        visit("role", slot.role), visit("name", slot.name), visit("doc", slot.doc);
        visit("unit", value.unit), visit("si", value.si), visit("unit_kind", slot.unit.kind);
        visit("shape", slot.shape), visit("type_symbol", slot.type_symbol);
        visit("feedthrough", slot.feedthrough), visit("optional", slot.optional),
            visit("reported", slot.reported);
        visit("as_written", slot.as_written), visit("from_path", slot.from_path);
        visit("initial_from", slot.initial_from), visit("initial", slot.initial),
            visit("limits", slot.limits);
        visit("at_least", slot.at_least), visit("size", value.size), visit("type", value.type);
        visit("names", value.names);
    } else if constexpr (std::is_same_v<T, Traits>) {
        visit("is_root_input", value.is_root_input), visit("merges", value.merges);
        visit("changes_rate", value.changes_rate), visit("goes_on", value.goes_on);
        visit("is_displayed", value.is_displayed), visit("counts", value.counts);
        visit("first_value", value.first_value), visit("again", value.again), visit("begin", value.begin);
        visit("most", value.most);
    } else if constexpr (std::is_same_v<T, Made>) {
        visit("arguments", value.arguments), visit("quantities", value.quantities);
        visit("dims", value.dims), visit("shapes", value.shapes), visit("types", value.types);
        visit("feedthrough", value.feedthrough), visit("traits", value.traits),
            visit("has_objects", value.has_objects), visit("is_bound", value.is_bound);
    } else if constexpr (std::is_same_v<T, Block::Methods>) {
        visit("reset", value.reset), visit("output", value.output), visit("update", value.update);
        visit("derivative", value.derivative), visit("guards", value.guards), visit("event", value.event);
    } else {
        static_assert(std::is_same_v<T, Stored>);
        visit("name", value.name), visit("group", value.group), visit("doc", value.doc);
        visit("methods", value.methods), visit("made", value.made);
    }
}

template <class T> Json written(T value) {
    if constexpr (std::is_enum_v<T>) {
        return static_cast<int>(value);
    } else if constexpr (std::is_same_v<T, double>) { // JSON has no infinity
        return std::isfinite(value) ? Json(value) : Json(std::to_string(value));
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
        return value;
    } else if constexpr (requires { value.has_value(); }) {
        return value ? written(*value) : Json();
    } else if constexpr (requires { value.push_back(value[0]); }) {
        Json list = Json::array();
        for (const auto& item : value) list.push_back(written(item));
        return list;
    } else if constexpr (requires { typename T::mapped_type; }) {
        Json object = Json::object();
        for (const auto& [name, item] : value) object[name] = written(item);
        return object;
    } else {
        Json object = Json::object();
        each_member([&](const char* name, const auto& member) { object[name] = written(member); }, value);
        return object;
    }
}

/// Throws Json::exception, std::exception.
template <class T> void read(const Json& json, T& value) {
    if constexpr (std::is_enum_v<T>) {
        constexpr int most = std::is_same_v<T, Role>   ? static_cast<int>(Role::guard)
                             : std::is_same_v<T, Type> ? type_count - 1
                                                       : 2;
        const int number = json.get<int>();
        if (number < 0 || number > most)
            throw std::runtime_error("there is no kind " + std::to_string(number));
        value = static_cast<T>(number);
    } else if constexpr (std::is_same_v<T, double>) {
        value = json.is_string() ? std::stod(json.get<std::string>()) : json.get<double>();
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
        value = json.get<T>();
    } else if constexpr (requires { value.has_value(); }) {
        value.reset();
        if (!json.is_null()) read(json, value.emplace());
    } else if constexpr (requires { value.push_back(value[0]); }) {
        for (const auto& item : json) read(item, value.emplace_back());
    } else if constexpr (requires { typename T::mapped_type; }) {
        for (const auto& [name, item] : json.items()) read(item, value[name]);
    } else {
        each_member([&](const char* name, auto& member) { read(json.at(name), member); }, value);
    }
}

// ---- writing down ----

/// Arguments as a text. The last digits of numbers do not count: expressions may come to other ones
/// elsewhere.
std::string key_of(const Arguments& arguments) {
    nlohmann::json key = nlohmann::json::object(); // in the order of names
    for (const auto& [name, value] : arguments) {
        nlohmann::json numbers = nlohmann::json::array();
        for (const double x : value.data) {
            char text[32];
            std::snprintf(text, sizeof text, "%.12g", x);
            numbers.push_back(text);
        }
        key[name] = {value.rows, value.cols, numbers, value.text, value.texts};
    }
    return key.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Made noted(const Block& block) {
    const Declaration& d = block.declaration();
    Made made{d.arguments, {}, {}, d.shapes, d.types, {}, d.traits, !d.objects.empty()};
    for (const auto& dim : d.dims) made.dims.push_back(dim.name);
    for (const auto& slot : d.slots) {
        KnownSlot quantity{
            slot, std::string(slot.unit.text), {slot.unit.si.begin(), slot.unit.si.end()}, {}, {}, {}};
        if (slot.type_symbol < 0) quantity.type = slot.type;
        made.quantities.push_back(std::move(quantity));
    }
    return made;
}

Made noted(const DiagramNode& node) {
    const Block& block = *node.block;
    Made made = noted(block);
    made.is_bound = true;
    for (int i = 0; i < static_cast<int>(made.quantities.size()); ++i) {
        auto& [declaration, unit, si, size, type, names] = made.quantities[static_cast<std::size_t>(i)];
        const Slot& slot = block.resolution().slots[static_cast<std::size_t>(i)];
        if (slot.size_known) size = slot.size;
        if (slot.type_known) type = slot.type;
        if (const auto known = node.element_names.find(i); known != node.element_names.end())
            names = known->second;
        if (slot.role != Role::input) continue;
        declaration.optional = !block.needs(i);
        for (int o = 0; o < static_cast<int>(made.quantities.size()); ++o)
            if (made.quantities[static_cast<std::size_t>(o)].slot.role == Role::output &&
                block.feedthrough(o, i))
                made.feedthrough.push_back({o, i});
    }
    return made;
}

/// Of two blocks with the same arguments: what the wiring of one alone has decided is left to the wiring.
void merge(Made& known, const Made& other) {
    for (std::size_t i = 0; i < std::min(known.quantities.size(), other.quantities.size()); ++i) {
        KnownSlot& a = known.quantities[i];
        const KnownSlot& b = other.quantities[i];
        if (a.size != b.size) a.size.reset();
        if (a.type != b.type) a.type.reset();
        if (a.names != b.names) a.names.clear();
    }
}

// ---- standing in ----

class StandIn final : public Block {
  public:
    StandIn(std::shared_ptr<const Made> made, const Arguments& arguments)
        : Block(arguments), made_(std::move(made)) {
        Declaration& d = detail::declared_by(*this);
        d.arguments = made_->arguments;
        d.traits = made_->traits;
        d.shapes = made_->shapes;
        d.types = made_->types;
        if (made_->has_objects) d.objects.push_back({[] { return Object(); }});
        for (const auto& dim : made_->dims) d.dims.push_back({dim, {}, {}});
        for (const auto& quantity : made_->quantities) {
            SlotDeclaration& slot = d.slots.emplace_back(quantity.slot);
            slot.unit.text = quantity.unit;
            std::copy_n(quantity.si.begin(), std::min(quantity.si.size(), slot.unit.si.size()),
                        slot.unit.si.begin());
            if (quantity.size) slot.shape = shape_of(quantity);
            if (quantity.type) slot.type_symbol = -1;
            slot.type = quantity.type.value_or(Type::float64);
        }
    }

    bool feedthrough(int output, int input) const override {
        if (!made_->is_bound) return Block::feedthrough(output, input);
        return std::ranges::find(made_->feedthrough, std::vector{output, input}) != made_->feedthrough.end();
    }
    void start(Now) const override {
        throw std::runtime_error(
            "only the declaration of this block is here; run the model where its plugin is");
    }

  private:
    Shape shape_of(const KnownSlot& quantity) {
        const auto& [rows, cols, is_matrix] = *quantity.size;
        if (is_matrix) return {rows, cols};
        if (!quantity.names.empty())
            return Extent(Dim(this, quantity.slot.name.c_str(),
                              [made = made_, &quantity] { return Dim::Names(quantity.names); }));
        return rows == 1 ? Shape() : Shape(rows);
    }

    const std::shared_ptr<const Made> made_;
};

/// Throws std::runtime_error where it would lead blocks out of their slots.
void check(const Made& made) {
    const int count = static_cast<int>(made.quantities.size());
    constexpr int most = 1 << 20;
    if (made.shapes < 0 || made.shapes > most || made.types < 0 || made.types > most)
        throw std::runtime_error("there are too many symbols");
    const auto require = [&](int index, Role role) {
        if (index < 0) return;
        if (index >= count || made.quantities[static_cast<std::size_t>(index)].slot.role != role)
            throw std::runtime_error("there is no " + std::string(bf::name(role)) + " " +
                                     std::to_string(index));
    };
    for (const auto& quantity : made.quantities) {
        const Shape& shape = quantity.slot.shape;
        const int dims = static_cast<int>(made.dims.size());
        if (shape.symbol >= made.shapes || quantity.slot.type_symbol >= made.types ||
            shape.rows.dim >= dims || shape.cols.dim >= dims)
            throw std::runtime_error("'" + quantity.slot.name + "' has a symbol that is not there");
        require(quantity.slot.initial_from, Role::parameter);
        require(quantity.slot.at_least, Role::parameter);
        if (const auto& size = quantity.size;
            size && (size->rows < 0 || size->cols < 0 || size->rows > most || size->cols > most))
            throw std::runtime_error("'" + quantity.slot.name + "' has no size");
        if (!quantity.names.empty() && (!quantity.size || quantity.size->cols != 1 ||
                                        quantity.size->rows != static_cast<int>(quantity.names.size())))
            throw std::runtime_error("'" + quantity.slot.name + "' has other elements than names");
    }
    for (const auto& [value, role] : {std::pair(made.traits.first_value, Role::parameter),
                                      {made.traits.again, Role::input},
                                      {made.traits.begin, Role::input},
                                      {made.traits.most, Role::parameter}})
        require(value, role);
}

} // namespace

std::map<std::string, std::string> declarations_of(const Diagram& diagram, Registry& registry) {
    std::map<std::string, std::map<std::string, Stored>> plugins;
    for (const auto& node : diagram.nodes) {
        if (node.library.empty()) continue;
        const BlockClass& type = registry.find(node.type);
        const auto [at, is_new] = plugins[type.library].try_emplace(type.name);
        Stored& stored = at->second;
        if (is_new) {
            const auto block = type.make({});
            const Declaration& d = block->declaration();
            stored = {type.name, type.group, type.doc, type.methods, {{key_of({}), noted(*block)}}};
            // Rules become methods, which say as much of when the block runs.
            Block::Methods& m = stored.methods;
            for (const auto& [method, phase] : {std::pair(&m.output, Phase::output),
                                                {&m.update, Phase::update},
                                                {&m.derivative, Phase::derivative},
                                                {&m.guards, Phase::guards},
                                                {&m.event, Phase::event}})
                *method = *method || !d.rules(phase).empty();
        }
        Made made = noted(node);
        const auto [known, is_first] = stored.made.try_emplace(key_of(node.arguments), made);
        if (!is_first && known->second.is_bound)
            merge(known->second, made);
        else
            known->second = std::move(made);
    }
    std::map<std::string, std::string> texts;
    for (const auto& [library, blocks] : plugins) {
        Json all = Json::array();
        for (const auto& [name, stored] : blocks) all.push_back(written(stored));
        texts[library] =
            Json{{"plugin", library}, {"blocks", all}}.dump(-1, ' ', false, Json::error_handler_t::replace);
    }
    return texts;
}

std::string block_that_differs(const LoadedModel& loaded,
                               const std::map<std::string, std::string>& declarations) {
    Registry registry;
    registry.add(standard_library());
    for (const auto& [plugin, text] : declarations) registry.add(stand_ins(text));
    formats::Files texts = loaded.source.texts;
    const model::Model model = formats::read_yaml(loaded.source.file, texts);
    const Examined found = examine(model, registry, {{}, loaded.source.file.parent_path().string()});
    if (!found.diagnostics.empty()) return found.diagnostics.front().path;
    const auto is_same_slot = [](const Slot& a, const Slot& b) {
        return a.name == b.name && a.role == b.role && a.size == b.size && a.type == b.type;
    };
    for (std::size_t n = 0; n < loaded.diagram.nodes.size(); ++n) {
        const DiagramNode &a = loaded.diagram.nodes[n], &b = found.diagram.nodes[n];
        const bool is_same =
            a.path == b.path && a.element_names == b.element_names && a.condition == b.condition &&
            loaded.diagram.rates.at(static_cast<std::size_t>(a.rate)) ==
                found.diagram.rates.at(static_cast<std::size_t>(b.rate)) &&
            std::ranges::equal(a.block->resolution().slots, b.block->resolution().slots, is_same_slot);
        if (!is_same) return a.path;
    }
    return {};
}

Library stand_ins(const std::string& text) {
    try {
        const Json json = Json::parse(text);
        Library library(json.at("plugin").get<std::string>());
        for (const auto& block : json.at("blocks")) {
            Stored stored;
            read(block, stored);
            std::map<std::string, std::shared_ptr<const Made>> made;
            for (auto& [key, one] : stored.made) {
                check(one);
                made[key] = std::make_shared<const Made>(std::move(one));
            }
            library.add(
                BlockClass{library.name(), stored.name, stored.group, stored.doc,
                           [made = std::move(made)](const Arguments& arguments) -> std::unique_ptr<Block> {
                               const auto found = made.find(key_of(arguments));
                               if (found == made.end())
                                   throw PluginError("the plugin of this block is not here, and nothing says "
                                                     "what the block is with these arguments");
                               return std::make_unique<StandIn>(found->second, arguments);
                           },
                           stored.methods});
        }
        return library;
    } catch (const PluginError&) {
        throw;
    } catch (const std::exception& error) {
        throw PluginError(std::string("these are no declarations of blocks: ") + error.what());
    }
}

} // namespace bf

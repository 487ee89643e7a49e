#include "right_model.hpp"

#include "bf/base/numbers.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/core/resolve.hpp"
#include "standard_variants.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace bf::fuzz {

namespace {

/// What a wire may begin with.
struct Signal {
    std::string path;
    Size size;
    Type type = Type::float64;
    Unit unit = any_unit;
};

/// What may stand in a subsystem.
struct Place {
    int depth = 0;
    bool is_timed = true; ///< its blocks may have periods and continuous states: no trigger or loop around
};

const Library& library() {
    static const Library made = standard_library();
    return made;
}

std::string text_of(double x) { return number_text(x); }

/// A value as a model writes it.
std::string text_of(const Value& value) {
    if (value.kind == Value::Kind::text) return "'" + value.text + "'";
    std::string text;
    if (value.kind == Value::Kind::texts) {
        for (const auto& part : value.texts) text += (text.empty() ? "" : ", ") + part;
        return "[" + text + "]";
    }
    if (value.type == Type::boolean) return value.data[0] != 0 ? "true" : "false";
    for (int i = 0; i < value.rows; ++i) {
        if (i > 0) text += "; ";
        for (int j = 0; j < value.cols; ++j)
            text += (j == 0 ? "" : " ") + text_of(value.data[static_cast<std::size_t>(i + j * value.rows)]);
    }
    if (value.rows != 1 || value.cols != 1) text = "[" + text + "]";
    return value.type == Type::float64 && text.front() != '[' ? text
           : value.type == Type::float64                      ? "\"" + text + "\""
                                         : "\"" + std::string(name(value.type)) + "(" + text + ")\"";
}

class Writer {
  public:
    explicit Writer(Chance& chance) : chance_(chance) {
        for (const auto& block_class : library().classes())
            // These need a file, a loop around them, conditional subsystems before them, or luck.
            if (const auto& n = block_class.name;
                n != "SignalFromFile" && n != "Iteration" && n != "While" && n != "Merge" && n != "Assertion")
                classes_.push_back(&block_class);
    }

    std::string model(const std::string& name, bool has_fixed_steps) {
        static constexpr std::array solvers{"euler", "rk4", "dormand_prince45", "cvode_bdf", "cvode_adams"};
        std::string text = "model: " + name + "\nstep: 0.1\nstop: 2\n";
        text += std::string("solver: ") + solvers[chance_.below(has_fixed_steps ? 2 : solvers.size())] + "\n";
        std::vector<Signal> none;
        return text + system("", {}, {}, none);
    }

  private:
    /// A block that accepts what is wired to it.
    struct Made {
        std::string settings;
        std::vector<std::pair<std::string, std::string>> wires; ///< source, port
        std::vector<Signal> outputs;                            ///< path: the port's name
        bool is_continuous = false;
    };
    /// One system while it is written.
    struct System {
        Place place;
        std::string indent, blocks;
        std::vector<Signal> signals; ///< known so far
        std::vector<std::pair<std::string, std::vector<std::string>>> wires;
        std::vector<Signal> delays; ///< path: an input that still wants a signal of this size
    };

    static void connect(System& s, const std::string& from, const std::string& to) {
        // A source stands once in the mapping, so its receivers are collected.
        auto at =
            std::find_if(s.wires.begin(), s.wires.end(), [&](const auto& w) { return w.first == from; });
        if (at == s.wires.end()) at = s.wires.insert(at, {from, {}});
        at->second.push_back(to);
    }

    /// The text of a system with the given inputs; its outputs are added to `outputs`.
    std::string system(const std::string& indent, const Place& place, std::vector<Signal> inputs,
                       std::vector<Signal>& outputs) {
        System s{place, indent, {}, std::move(inputs), {}, {}};
        if (s.signals.empty() || chance_.one_in(2)) add_constant(s, "c");
        const std::size_t count = 3 + chance_.below(place.depth == 0 ? 12 : 5);
        for (std::size_t i = 0; i < count; ++i) {
            const std::string name = "b" + std::to_string(i);
            if (chance_.one_in(8))
                add_delay(s, name);
            else if (place.depth < 2 && chance_.one_in(5))
                add_subsystem(s, name);
            else
                add_block(s, name);
        }
        for (const auto& delay : s.delays) {
            std::vector<const Signal*> alike;
            for (const auto& signal : s.signals)
                if (signal.size == delay.size && signal.type == delay.type) alike.push_back(&signal);
            connect(s, chance_.of(alike)->path, delay.path);
        }
        for (auto& output : outputs) {
            const Signal& from = chance_.of(s.signals);
            connect(s, from.path, output.path);
            output = {output.path, from.size, from.type, from.unit};
        }
        std::string text = indent + "blocks:\n" + s.blocks + indent + "connections:\n";
        for (const auto& [from, to] : s.wires) {
            text += indent + "  " + from + ": [";
            for (const auto& end : to) text += (text.back() == '[' ? "" : ", ") + end;
            text += "]\n";
        }
        return text;
    }

    void add_constant(System& s, const std::string& name) {
        static constexpr std::array values{"1", "-2.5", "[1, 2, 3]", "[0.5, -1]", "[[2, 1], [0, 3]]", "true"};
        static const std::array<Size, 6> sizes{{{}, {}, {3, 1, false}, {2, 1, false}, {2, 2, true}, {}}};
        const std::size_t i = chance_.below(values.size());
        s.blocks += s.indent + "  " + name + ": {block: Constant, value: " + values[i] + "}\n";
        s.signals.push_back(
            {name + ".y", sizes[i], i == values.size() - 1 ? Type::boolean : Type::float64, any_unit});
    }

    /// The output of a delay exists before its input does: so loops arise.
    void add_delay(System& s, const std::string& name) {
        static constexpr std::array kinds{"UnitDelay", "Memory"};
        const Size size = chance_.one_in(2) ? Size{} : chance_.of(s.signals).size;
        const bool is_possible = std::any_of(s.signals.begin(), s.signals.end(), [&](const Signal& signal) {
            return signal.size == size && signal.type == Type::float64;
        });
        if (!is_possible) return;
        s.blocks +=
            s.indent + "  " + name + ": {block: " + chance_.of(kinds) + ", initial: \"" +
            (size.is_matrix  ? "ones(" + std::to_string(size.rows) + ", " + std::to_string(size.cols) + ")"
             : size.rows > 1 ? "0.5*(1:" + std::to_string(size.rows) + ")"
                             : std::string("0.25")) +
            "\"}\n";
        s.delays.push_back({name + ".u", size, Type::float64, any_unit});
        s.signals.push_back({name + ".y", size, Type::float64, any_unit});
    }

    void add_block(System& s, const std::string& name) {
        for (int attempt = 0; attempt < 40; ++attempt) {
            const BlockClass& block_class = *chance_.of(classes_);
            const auto made = make(s, block_class);
            if (!made || (made->is_continuous && !s.place.is_timed)) continue;
            put(s, name, block_class, *made);
            return;
        }
    }

    void put(System& s, const std::string& name, const BlockClass& block_class, const Made& made) {
        static constexpr std::array periods{"0.1", "0.2", "0.3", "0.2, offset: 0.1", "0.4, offset: 0.3"};
        s.blocks += s.indent + "  " + name + ": {block: " + block_class.qualified_name() + made.settings;
        if (s.place.is_timed && !made.is_continuous && chance_.one_in(6))
            s.blocks += std::string(", period: ") + chance_.of(periods);
        s.blocks += "}\n";
        for (const auto& [from, port] : made.wires) connect(s, from, name + "." + port);
        for (Signal output : made.outputs) {
            output.path = name + "." + output.path;
            s.signals.push_back(std::move(output));
        }
    }

    /// Asks a block of that class, with settings of chance, what it makes of signals of chance.
    std::optional<Made> make(System& s, const BlockClass& block_class) {
        try {
            Made made;
            conformance::Settings settings = settings_of(block_class);
            Arguments arguments;
            const auto plain = block_class.make({});
            for (const auto& [key, value] : settings) {
                const auto& known = plain->declaration().arguments;
                if (std::any_of(known.begin(), known.end(),
                                [&, &key = key](const auto& a) { return a.name == key; }))
                    arguments.emplace_back(key, value);
                made.settings += ", " + key + ": " + text_of(value);
            }
            const auto block = block_class.make(arguments);
            const auto& d = block->declaration();
            Resolution& r = block->resolution();
            if (!d.problems.empty()) return std::nullopt;
            for (const auto& [key, value] : settings)
                if (const int i = d.find(key, Role::parameter); i >= 0)
                    give(r, i, value);
                else if (std::none_of(d.arguments.begin(), d.arguments.end(),
                                      [&, &key = key](const auto& a) { return a.name == key; }))
                    return std::nullopt;
            give_defaults(r);
            propagate(*block);
            for (std::size_t i = 0; i < r.slots.size(); ++i) {
                if (r.slots[i].role == Role::continuous_state) made.is_continuous = true;
                if (r.slots[i].role != Role::input || (r.slots[i].optional && chance_.one_in(2))) continue;
                const Signal* from = source(s, r.slots[i], made);
                if (!from) return std::nullopt;
                offer(r, static_cast<int>(i), from->size);
                offer(r, static_cast<int>(i), from->type);
                propagate(*block);
                made.wires.emplace_back(from->path, d.slots[i].name);
            }
            settle(*block);
            if (!unresolved(r).empty() || !works(r)) return std::nullopt;
            for (const auto& slot : r.slots)
                if (slot.role == Role::output)
                    made.outputs.push_back({slot.name, slot.size, slot.type, slot.unit});
            return made;
        } catch (const std::exception&) {
            return std::nullopt;
        }
    }

    conformance::Settings settings_of(const BlockClass& block_class) {
        conformance::Settings settings;
        const auto [first, last] = conformance::variants().equal_range(block_class.name);
        const auto variants = static_cast<std::size_t>(std::distance(first, last));
        if (const std::size_t which = chance_.below(2 * variants + 1); which < variants)
            settings = std::next(first, static_cast<std::ptrdiff_t>(which))->second;
        const auto plain = block_class.make({});
        const auto add = [&](const std::string& key, Value value) {
            const bool is_given = std::any_of(settings.begin(), settings.end(),
                                              [&](const auto& given) { return given.first == key; });
            if (!is_given) settings.emplace_back(key, std::move(value));
        };
        for (const auto& argument : plain->declaration().arguments) {
            if (!argument.choices.empty() && chance_.one_in(6))
                add(argument.name, chance_.of(argument.choices));
            if (argument.initial.kind == Value::Kind::number && argument.initial.type == Type::boolean &&
                chance_.one_in(6))
                add(argument.name, chance_.one_in(2));
        }
        static constexpr std::array numbers{0.5, 1.0, 2.0, -1.0, 3.0};
        for (const auto& slot : plain->resolution().slots)
            if (slot.role == Role::parameter && chance_.one_in(10))
                if (const double x = chance_.of(numbers); slot.limits.allow(x)) add(slot.name, x);
        return settings;
    }

    /// A signal for an input; after the first one most often one like those that the block has already.
    const Signal* source(const System& s, const Slot& input, const Made& made) {
        const Signal* first = nullptr;
        if (!made.wires.empty())
            for (const auto& signal : s.signals)
                if (signal.path == made.wires.front().first) first = &signal;
        for (int attempt = 0; attempt < 12; ++attempt) {
            const Signal& candidate = chance_.of(s.signals);
            const bool is_alike = !first || (candidate.size == first->size && candidate.type == first->type);
            const bool fits = (!input.size_known || input.size == candidate.size) &&
                              (!input.type_known || input.type == candidate.type);
            if (candidate.unit.agrees_with(input.unit) && fits &&
                (is_alike || input.size_known || attempt > 8))
                return &candidate;
        }
        return nullptr;
    }

    /// What elaboration decides where the wiring does not.
    static void settle(Block& block) {
        settle_types(block);
        Resolution& r = block.resolution();
        for (std::size_t i = 0; i < r.slots.size(); ++i) {
            if (r.slots[i].role == Role::input && r.slots[i].optional && !r.slots[i].size_known)
                offer(r, static_cast<int>(i), Size{});
            propagate(block);
        }
    }

    static bool works(const Resolution& r) {
        const Declaration& d = r.declaration();
        for (const Phase phase : phases)
            for (const Call& call : d.rules(phase))
                if (call.symbols == 1 && !call.run[static_cast<std::size_t>(*r.types[0])]) return false;
        for (const auto& slot : r.slots) {
            if (slot.initial_from < 0) continue;
            const int given = r.slots[static_cast<std::size_t>(slot.initial_from)].size.count();
            if (given != 1 && given != slot.size.count()) return false;
        }
        return d.requirements.empty();
    }

    void add_subsystem(System& s, const std::string& name) {
        enum Kind { plain, atomic, enabled, triggered, both, for_loop, while_loop, for_each, count };
        const auto kind = static_cast<Kind>(chance_.below(count));
        const bool resets = kind != for_each && chance_.one_in(6);
        Place place{s.place.depth + 1, s.place.is_timed};
        const bool is_triggered = kind == triggered || kind == both;
        if (is_triggered || kind == for_loop || kind == while_loop) place.is_timed = false;
        const Signal& u = chance_.of(s.signals);
        Signal inside = u;
        inside.path = "u";
        const int parts = u.size.is_matrix ? u.size.cols : u.size.rows;
        if (kind == for_each) inside.size = u.size.is_matrix ? Size{u.size.rows, 1, true} : Size{};
        static constexpr std::array keys{"",
                                         "execution: atomic",
                                         "execution: enabled",
                                         "execution: triggered",
                                         "execution: enabled_and_triggered",
                                         "execution: for",
                                         "execution: while",
                                         "execution: for_each"};
        static constexpr std::array edges{"rising", "falling", "either", "function_call"},
            resets_at{"rising", "falling", "either", "level_hold"};
        const std::string indent = s.indent + "    ";
        std::string text = s.indent + "  " + name + ":\n";
        const auto key = [&](const std::string& line) { text += indent + line + "\n"; };
        if (kind != plain) key(keys[kind]);
        if (is_triggered && chance_.one_in(2)) key(std::string("trigger: ") + chance_.of(edges));
        if (kind != plain && kind != atomic && kind != for_each && kind != triggered && chance_.one_in(2))
            key("states: reset");
        if (resets) key(std::string("reset: ") + chance_.of(resets_at));
        if (kind == for_loop) key("iterations: " + std::to_string(1 + chance_.below(3)));
        if (kind == for_each) key("iterations: " + std::to_string(parts));
        if (place.is_timed && chance_.one_in(6)) key("period: 0.2");
        key(kind == for_each ? "inputs: {u: {each: true}}" : "inputs: [u]");
        const bool is_conditional = kind == enabled || is_triggered;
        key(is_conditional && chance_.one_in(2) ? "outputs: {y: {when_disabled: reset, initial: 1}}"
                                                : "outputs: [y]");
        std::vector<Signal> outputs{{"y", {}, Type::float64, any_unit}};
        std::string content = system(indent, place, {inside}, outputs);
        if (kind == while_loop)
            content.insert(content.find("blocks:\n") + 8,
                           indent + "  number: {block: Iteration}\n" + indent +
                               "  more: {block: CompareToConstant, operator: '<', constant: 3}\n" + indent +
                               "  again: {block: While}\n"),
                content += indent + "  number: more\n" + indent + "  more: again.condition\n";
        s.blocks += text + content;
        Signal y = outputs.front();
        y.path = name + ".y";
        if (kind == for_each)
            y.size = y.size.is_matrix ? Size{y.size.rows, y.size.cols * parts, true}
                                      : Size{y.size.rows * parts, 1, false};
        const std::string from = u.path;
        connect(s, from, name + ".u");
        if (kind == enabled || kind == both) connect(s, chance_.of(s.signals).path, name + ".enable");
        if (is_triggered) connect(s, chance_.of(s.signals).path, name + ".trigger");
        if (resets) connect(s, chance_.of(s.signals).path, name + ".reset");
        s.signals.push_back(std::move(y));
    }

    Chance& chance_;
    std::vector<const BlockClass*> classes_;
};

} // namespace

std::string right_model(Chance& chance, const std::string& name, bool has_fixed_steps) {
    return Writer(chance).model(name, has_fixed_steps);
}

} // namespace bf::fuzz

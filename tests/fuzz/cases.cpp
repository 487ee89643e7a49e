#include "cases.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/core/hash.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/run/snapshot.hpp"
#include "right_model.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace bf::fuzz {

namespace {

constexpr std::array tame{"1", "2", "0.5", "-1", "[1 2 3]", "0.1*[1 2 3]", "3"};
constexpr std::array wild{
    "0",      "-1",          "NaN",         "Inf",       "-Inf",     "1e308",          "1e-320",
    "true",   "int8(4)",     "single(2.5)", "uint32(7)", "[]",       "eye(2)",         "[1;2;3]",
    "1:5",    "[1 2; 3 4]",  "zeros(3,0)",  "'text'",    "{1, 'a'}", "nothing",        "(1",
    "1/0",    "-2147483649", "100000",      "2^31",      "pi*(1:3)", "step",           "[0 0.1]",
    "@(x) x", "ones(40)",    "[1 NaN]",     "[3 1 2]",   "'+-'",     "\"[1 -2 0.5]\"", "{}",
    "1e9"};
constexpr std::array periods{"0.1", "0.2", "0.3", "0", "-1", "0.05", "Inf", "0.1001"};

struct Ports {
    std::string name;
    std::vector<std::string> inputs, outputs;
};

const std::vector<const BlockClass*>& classes() {
    static const Library library = standard_library();
    static const std::vector<const BlockClass*> all = [] {
        std::vector<const BlockClass*> list;
        for (const auto& block_class : library.classes()) list.push_back(&block_class);
        return list;
    }();
    return all;
}

/// The ports of a block with default arguments: with others it may have others, and the wiring is wrong.
Ports ports_of(const BlockClass& block_class, std::string name) {
    Ports ports{std::move(name), {}, {}};
    const auto block = block_class.make({});
    for (const auto& slot : block->resolution().slots) {
        if (slot.role == Role::input) ports.inputs.push_back(slot.name);
        if (slot.role == Role::output) ports.outputs.push_back(slot.name);
    }
    return ports;
}

/// Writes a model that may have anything anywhere: one system with its blocks, systems inside, connections.
class Writer {
  public:
    explicit Writer(Chance& chance) : chance_(chance) {}

    std::string model() {
        std::string head = "model: chance\n";
        if (!chance_.one_in(8)) head += std::string("step: ") + chance_.of(periods) + "\n";
        if (chance_.one_in(4))
            head += "variables:\n  step_: 3\n  gains: {a: {value: 1, maximum: 9}, b: \"[1 2]\"}\n";
        if (chance_.one_in(5)) head += std::string("solver: ") + (chance_.one_in(2) ? "heun" : "none") + "\n";
        return head + system("", 0, {}, {});
    }

  private:
    std::string value() { return chance_.one_in(2) ? chance_.of(tame) : chance_.of(wild); }

    static std::string scalar(const std::string& text) {
        return text.find_first_of("[]{}:,'\"@(") == std::string::npos || text.front() == '"' ||
                       text.front() == '\''
                   ? text
                   : "\"" + text + "\"";
    }

    std::string settings(const BlockClass& block_class) {
        std::string text;
        const auto block = block_class.make({});
        const auto& d = block->declaration();
        for (const auto& argument : d.arguments) {
            if (!chance_.one_in(3)) continue;
            if (!argument.choices.empty() && !chance_.one_in(8))
                text += ", " + argument.name + ": '" + chance_.of(argument.choices) + "'";
            else
                text += ", " + argument.name + ": " + scalar(value());
        }
        for (const auto& slot : d.slots)
            if (slot.role == Role::parameter && chance_.one_in(3))
                text += ", " + slot.name + ": " + scalar(value());
        if (chance_.one_in(30)) text += ", typo: 1";
        if (chance_.one_in(6)) text += std::string(", period: ") + chance_.of(periods);
        return text;
    }

    std::string system(const std::string& indent, int depth, const std::vector<std::string>& inputs,
                       const std::vector<std::string>& outputs) {
        std::vector<Ports> blocks;
        std::string text = indent + "blocks:\n";
        const std::size_t count = 2 + chance_.below(7);
        for (std::size_t i = 0; i < count; ++i) {
            const std::string name = "b" + std::to_string(i);
            if (depth < 2 && chance_.one_in(9)) {
                Ports ports{name, {"u"}, {"y"}};
                text += indent + "  " + name + ":\n";
                const std::size_t kind = chance_.below(4);
                if (kind == 1) text += indent + "    execution: atomic\n";
                if (kind == 2) text += indent + "    execution: enabled\n";
                if (kind == 2 && chance_.one_in(2)) text += indent + "    states: reset\n";
                if (kind == 2) ports.inputs.push_back("enable");
                text += indent + "    inputs: [u]\n" + indent + "    outputs: [y]\n";
                text += system(indent + "    ", depth + 1, {"u"}, {"y"});
                blocks.push_back(ports);
                continue;
            }
            const BlockClass& block_class = *chance_.of(classes());
            const std::string type = chance_.one_in(60) ? "Gian" : block_class.qualified_name();
            text += indent + "  " + name + ": {block: " + type + settings(block_class) + "}\n";
            blocks.push_back(ports_of(block_class, name));
        }
        return text + connections(indent, blocks, inputs, outputs);
    }

    /// Mostly from blocks before to blocks behind; a delay closes loops now and then, other blocks make them
    /// errors.
    std::string connections(const std::string& indent, const std::vector<Ports>& blocks,
                            const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
        std::string text;
        std::vector<std::pair<std::string, std::vector<std::string>>> wires;
        const auto source = [&](std::size_t before) {
            std::vector<std::string> ends(inputs);
            for (std::size_t i = 0; i < (before == 0 ? blocks.size() : before); ++i)
                for (const auto& port : blocks[i].outputs) ends.push_back(blocks[i].name + "." + port);
            return ends.empty() ? std::string() : chance_.of(ends);
        };
        const auto connect = [&](const std::string& from, const std::string& to) {
            // A source stands once in the mapping, so its receivers are collected.
            const auto at =
                std::find_if(wires.begin(), wires.end(), [&](const auto& w) { return w.first == from; });
            if (at == wires.end())
                wires.push_back({from, {to}});
            else
                at->second.push_back(to);
        };
        for (std::size_t i = 0; i < blocks.size(); ++i)
            for (const auto& port : blocks[i].inputs) {
                if (chance_.one_in(12)) continue;
                const std::string from = source(!chance_.one_in(6) ? i : 0);
                if (!from.empty()) connect(from, blocks[i].name + "." + port);
            }
        for (const auto& output : outputs)
            if (const std::string from = source(0); !from.empty()) connect(from, output);
        if (chance_.one_in(20)) connect("b0", "b99.u");
        for (const auto& [from, to] : wires) {
            text += indent + "  " + from + ": [";
            for (const auto& end : to) text += (text.back() == '[' ? "" : ", ") + end;
            text += "]\n";
        }
        return text.empty() ? "" : indent + "connections:\n" + text;
    }

    Chance& chance_;
};

std::string mangled(std::string text, Chance& chance) {
    constexpr std::string_view marks = "[]{}:,'\"#\n\t -|>&*!%@`0\\\x80\xff";
    for (std::size_t n = 1 + chance.below(4); n > 0 && !text.empty(); --n) {
        const std::size_t at = chance.below(text.size()),
                          length = std::min(text.size() - at, chance.below(40));
        switch (chance.below(5)) {
        case 0: text[at] = static_cast<char>(chance()); break;
        case 1: text.erase(at, length); break;
        case 2: text.insert(at, text.substr(chance.below(text.size()), length)); break;
        case 3: text.insert(at, 1, chance.of(marks)); break;
        default: std::swap(text[at], text[chance.below(text.size())]);
        }
    }
    return text;
}

/// Everything that a step shows.
std::uint64_t hash_of(const Simulation& simulation, std::uint64_t hash) {
    const auto& nodes = simulation.diagram().nodes;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
        const auto& slots = nodes[n].block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::output && slots[i].role != Role::discrete_state) continue;
            const auto* data = static_cast<const std::byte*>(
                simulation.context().data(static_cast<int>(n), static_cast<int>(i)));
            hash =
                fnv1a({data, static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type))}, hash);
        }
    }
    return hash;
}

/// Hashes after each step; shorter where a step fails.
std::vector<std::uint64_t> follow(Simulation& simulation, int steps) {
    std::vector<std::uint64_t> hashes;
    for (int k = 0; k < steps && simulation.step(); ++k) hashes.push_back(hash_of(simulation, fnv1a({})));
    return hashes;
}

std::uint64_t hash_of(std::string_view text) { return fnv1a(std::as_bytes(std::span(text))); }

} // namespace

std::string model_of(std::uint64_t seed) {
    Chance chance(seed);
    switch (seed % 3) {
    case 0: return right_model(chance);
    case 1: return Writer(chance).model();
    default: return mangled(chance.one_in(2) ? right_model(chance) : Writer(chance).model(), chance);
    }
}

Outcome try_model(std::string_view text, std::uint64_t seed) {
    constexpr int steps = 8;
    Outcome outcome;
    const auto refused = [&](const std::exception& error) {
        outcome.refusal = error.what();
        outcome.hash = hash_of(outcome.refusal);
        if (outcome.refusal.empty()) outcome.violation = "it is refused without a message";
        return outcome;
    };
    try {
        const model::Model model = formats::read_yaml_text(text, "chance.yaml");
        Registry registry;
        registry.add(standard_library());
        const Diagram diagram = elaborate(model, registry), again = elaborate(model, registry);
        if (fingerprint(diagram) != fingerprint(again)) outcome.violation = "it elaborates to two diagrams";
        outcome.is_accepted = true;
        Simulation one(diagram), other(again);
        one.start();
        other.start();
        // CVODE begins anew where a snapshot is taken, so both runs take one.
        const int instant = static_cast<int>(seed / 3 % steps);
        const auto run = [&](Simulation& simulation, bool restores) {
            auto hashes = follow(simulation, instant);
            if (!simulation.failure().empty()) return hashes;
            const auto snapshot = make_snapshot(simulation);
            if (restores) {
                follow(simulation, 3);
                restore_snapshot(simulation, snapshot, "snapshot");
            }
            const auto rest = follow(simulation, steps - instant);
            hashes.insert(hashes.end(), rest.begin(), rest.end());
            return hashes;
        };
        const auto expected = run(one, false), restored = run(other, true);
        outcome.hash = fnv1a(std::as_bytes(std::span(expected)), hash_of(one.failure()));
        if (restored != expected || other.failure() != one.failure())
            outcome.violation = "it runs otherwise after a snapshot before step " + std::to_string(instant);
    } catch (const model::Errors& errors) {
        for (const auto& diagnostic : errors.diagnostics())
            if (diagnostic.message.empty()) outcome.violation = "a diagnostic says nothing";
        return refused(errors);
    } catch (const RunError& error) {
        return refused(error);
    } catch (const std::exception& error) {
        outcome.violation = std::string("an exception that is no diagnostic: ") + error.what();
    }
    return outcome;
}

} // namespace bf::fuzz

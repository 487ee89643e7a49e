#include "cases.hpp"

#include "bf/formats/yaml.hpp"
#include "bf/kernels/expression.hpp"
#include "bf/model/builder.hpp"
#include "standard_variants.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace bf::codegen::test {
namespace {

using conformance::Settings;

/// A system that the builder does not reach: ports with declared shapes and types.
struct InputPort {
    std::string name, shape, type;
};

void declare(model::Model& model, const std::vector<InputPort>& ports) {
    for (const auto& port : ports)
        for (auto& input : model.root.inputs)
            if (input.name == port.name) {
                if (!port.shape.empty()) input.shape = model::Expression{.text = port.shape};
                input.type = port.type;
            }
}

std::string expression(const Value& value) {
    if (value.kind == Value::Kind::text) return "'" + value.text + "'";
    std::string text = "[";
    for (int i = 0; i < value.rows; ++i)
        for (int j = 0; j < value.cols; ++j)
            text += (j   ? " "
                     : i ? "; "
                         : "") +
                    std::to_string(value.data[static_cast<std::size_t>(i + j * value.rows)]);
    return text + "]";
}

/// How the inputs of one block are wired.
struct Wiring {
    std::vector<std::string> shapes; ///< per input
    Type type;                       ///< of all inputs
};

/// Adds block `name` with an input port of its own for every input.
void add_block(model::Builder& m, std::vector<InputPort>& ports, const std::string& name,
               const BlockClass& type, const std::vector<std::string>& inputs, const Wiring& wiring) {
    m.add(name, type.qualified_name());
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const std::string port = name + "_" + inputs[i];
        ports.push_back({port, wiring.shapes[i], bf::name(wiring.type)});
        m.connect(m.input(port), model::End{name, inputs[i]});
    }
}

model::Model finish(model::Builder& m, const std::vector<InputPort>& ports, const Settings& settings) {
    model::Model model = m.build();
    declare(model, ports);
    for (auto& block : model.root.blocks)
        for (const auto& [name, value] : settings)
            block.settings.push_back({.name = name, .value = {.text = expression(value)}});
    return model;
}

} // namespace

std::vector<Case> block_cases() {
    std::vector<Case> cases;
    const Library library = standard_library();
    const std::vector<std::string> shapes{"", "3", "[3 3]", "4", "[4 4]"};
    int number = 0;
    for (const auto& type : library.classes()) {
        std::vector<Settings> tried{{}};
        const auto [first, last] = conformance::variants().equal_range(type.name);
        for (auto v = first; v != last; ++v) tried.push_back(v->second);
        for (const auto& settings : tried) {
            Arguments arguments;
            for (const auto& [name, value] : settings) arguments.emplace_back(name, value);
            std::unique_ptr<Block> block;
            try {
                block = type.make(arguments);
            } catch (const std::exception&) {
                continue; // reads a file that is not there
            }
            std::vector<std::string> inputs;
            for (const auto& slot : block->resolution().slots)
                if (slot.role == Role::input) inputs.push_back(slot.name);
            std::vector<Wiring> accepted;
            const auto attempt = [&](const Wiring& wiring) {
                try {
                    model::Builder m("attempt");
                    m.step(0.01);
                    std::vector<InputPort> ports;
                    add_block(m, ports, "b", type, inputs, wiring);
                    const Elaborated one(finish(m, ports, settings));
                    generate(one.diagram);
                    accepted.push_back(wiring);
                    return true;
                } catch (const std::exception&) {
                    return false;
                }
            };
            std::vector<std::vector<std::string>> combinations{{}};
            for (std::size_t i = 0; i < inputs.size(); ++i) {
                std::vector<std::vector<std::string>> longer;
                for (const auto& start : combinations)
                    for (const auto& shape : shapes) {
                        if (inputs.size() > 2 && i > 0 && !(shape == start[0] || shape.empty())) continue;
                        longer.push_back(start);
                        longer.back().push_back(shape);
                    }
                combinations = std::move(longer);
            }
            for (const auto& combination : combinations) {
                const bool is_first = accepted.empty();
                for (int t = 0; t < type_count; ++t)
                    if (attempt({combination, static_cast<Type>(t)}) && !is_first) break;
                if (inputs.empty()) break;
                if (accepted.size() > 9) break;
            }
            if (type.name == "Ground") continue; // its reader decides its size
            if (accepted.empty()) continue;
            model::Builder m("case_" + std::to_string(++number) + "_" + type.name);
            m.step(0.01);
            std::vector<InputPort> ports;
            for (std::size_t i = 0; i < accepted.size(); ++i)
                add_block(m, ports, "b" + std::to_string(i), type, inputs, accepted[i]);
            cases.push_back({Elaborated(finish(m, ports, settings))});
        }
    }
    return cases;
}

namespace {

// ---- structure of models

/// The chain of 1,010 blocks of the peer benchmark: gains and sums in series, closed through delays.
model::Model chain(int pairs, int delays) {
    model::Builder m("chain_" + std::to_string(pairs));
    m.step(0.001).stop(0.1);
    m.add("one", "Constant", {{"value", 1}});
    for (int i = 0; i < delays; ++i) m.add("delay" + std::to_string(i), "UnitDelay");
    std::string last = "delay" + std::to_string(delays - 1);
    for (int i = 0; i < pairs; ++i) {
        const std::string gain = "gain" + std::to_string(i), sum = "sum" + std::to_string(i);
        m.add(gain, "Gain", {{"K", 0.999}});
        m.add(sum, "Sum");
        m.connect(model::End{last}, model::End{gain});
        m.connect(model::End{gain}, model::End{sum, "u1"});
        m.connect(model::End{"one"}, model::End{sum, "u2"});
        last = sum;
    }
    for (int i = 0; i < delays; ++i) {
        const std::string delay = "delay" + std::to_string(i);
        m.connect(model::End{last}, model::End{delay});
        last = delay;
    }
    m.record({"sum" + std::to_string(pairs - 1)});
    return m.build();
}

/// Blocks at rates 1, 2 and 3, one of them late, that read each other.
model::Model multirate() {
    model::Builder m("multirate");
    m.step(0.01);
    for (const auto& [name, period] :
         {std::pair{"fast", ""}, {"slow", "0.02"}, {"slower", "0.03"}, {"late", "0.02"}}) {
        auto s = m.atomic_subsystem(name, period);
        s.input("u");
        s.output("y");
        s.add("filter", "DiscreteIntegrator", {{"gain", 0.3}});
        s.add("time", "Clock");
        s.add("sum", "Sum", {{"signs", "'++-'"}});
        s.connect(model::End{"", "u"}, {model::End{"filter", "u"}, model::End{"sum", "u1"}});
        s.connect(model::End{"filter"}, model::End{"sum", "u2"});
        s.connect(model::End{"time"}, model::End{"sum", "u3"});
        s.connect(model::End{"sum"}, model::End{"", "y"});
    }
    m.connect(m.input("u"), model::End{"fast"});
    m.connect(model::End{"fast"}, {model::End{"slow"}, model::End{"late"}});
    m.connect(model::End{"slow"}, model::End{"slower"});
    m.add("join", "Sum", {{"signs", "'+++'"}});
    m.connect(model::End{"slower"}, model::End{"join", "u1"});
    m.connect(model::End{"late"}, model::End{"join", "u2"});
    m.connect(model::End{"fast"}, model::End{"join", "u3"});
    m.connect(model::End{"join"}, m.output("y"));
    model::Model model = m.build();
    for (auto& block : model.root.blocks)
        if (block.name == "late") block.offset = model::Expression{.text = "0.01"};
    return model;
}

/// Enabled subsystems, one inside another, with states and outputs held or reset.
model::Model enabled(bool resets) {
    model::Builder m(resets ? "enabled_reset" : "enabled_held");
    m.step(0.01);
    const auto states = resets ? model::States::reset : model::States::held;
    m.input("u");
    m.add("on", "CompareToConstant", {{"operator", "'>'"}, {"constant", -0.5}});
    m.add("inner_on", "CompareToConstant", {{"operator", "'>'"}, {"constant", 0}});
    m.connect(model::End{"", "u"}, {model::End{"on", "u"}, model::End{"inner_on", "u"}});
    auto outer = m.enabled_subsystem("outer", states);
    outer.input("u");
    outer.input("inner_on");
    outer.output("y");
    outer.output("z");
    outer.add("count", "DiscreteIntegrator", {{"initial", 3}});
    outer.connect(model::End{"", "u"}, model::End{"count", "u"});
    outer.connect(model::End{"count"}, model::End{"", "y"});
    auto inner = outer.enabled_subsystem("inner", states);
    inner.input("u");
    inner.output("y");
    inner.add("hold", "UnitDelay", {{"initial", "[1 2 3]"}});
    inner.add("spread", "Gain", {{"K", "[1 2 3]"}});
    inner.connect(model::End{"", "u"}, model::End{"spread"});
    inner.connect(model::End{"spread"}, model::End{"hold"});
    inner.connect(model::End{"hold"}, model::End{"", "y"});
    outer.connect(model::End{"", "u"}, model::End{"inner", "u"});
    outer.connect(model::End{"", "inner_on"}, model::End{"inner", "enable"});
    outer.connect(model::End{"inner"}, model::End{"", "z"});
    m.connect(model::End{"", "u"}, model::End{"outer", "u"});
    m.connect(model::End{"inner_on"}, model::End{"outer", "inner_on"});
    m.connect(model::End{"on"}, model::End{"outer", "enable"});
    m.connect(model::End{"outer", "y"}, m.output("y"));
    m.connect(model::End{"outer", "z"}, m.output("z"));
    model::Model model = m.build();
    auto* system = model.root.find_block("outer")->system.get();
    for (auto* s : {system, system->find_block("inner")->system.get()})
        for (auto& port : s->outputs) {
            port.when_disabled = resets ? model::WhenDisabled::reset : model::WhenDisabled::held;
            port.initial = model::Expression{.text = port.name == "z" || s != system ? "[7 -8 9]" : "5"};
        }
    return model;
}

/// Names that are no identifiers, keywords, or the same identifier.
model::Model odd_names() {
    model::Builder m("class");
    m.step(0.01);
    for (const char* name : {"static", "a b", "a_b", "line break", "back\\slash\\", "\"quote\"", "3rd",
                             "日本", "// ?\?/", "M_PI"}) {
        m.add(name, "Gain", {{"K", 2}});
        m.connect(m.input(std::string("in ") + name), model::End{name});
    }
    m.connect(model::End{"static"}, m.output("double"));
    m.connect(model::End{"a b"}, m.output("errno"));
    auto s = m.subsystem("a");
    s.input("u");
    s.add("b", "UnitDelay");
    s.connect(model::End{"", "u"}, model::End{"b"});
    m.connect(model::End{"a_b"}, model::End{"a", "u"});
    return m.build();
}

/// An oscillator beside a discrete block, a filter that runs only at times, and time itself integrated.
model::Model continuous(const std::string& name, const std::string& solver, const std::string& states) {
    return formats::read_yaml_text("model: " + name + "\nstep: 0.02\nsolver: " + solver + R"m(
blocks:
  v: {block: Integrator}
  x: {block: Integrator, initial: 1}
  k: {block: Gain, K: -30}
  spread: {block: Gain, K: "[1 2 3]"}
  xs: {block: Integrator, initial: "[1 2 3]"}
  t: {block: Clock}
  s: {block: Integrator}
  d: {block: UnitDelay, period: 0.04}
  slow: {block: Gain, K: 2, period: 0.06}
  on: {block: Pulse, cycle: 0.1, period: 0.02}
  filter:
    execution: enabled
    states: )m" + states + R"m(
    inputs: [u]
    outputs: {y: {initial: 4, when_disabled: )m" +
                                       states + R"m(}}
    blocks:
      p: {block: StateSpace, A: "[-1 2; 0 -3]", B: "[0; 1]", C: "[1 1]", initial: 0.5}
      sum: {block: Sum}
      n: {block: UnitDelay}
    connections:
      u: p
      p: [sum.u1, n]
      n: sum.u2
      sum: y
connections: {x: [k, d, spread], spread: xs, k: v, v: x, t: [s, slow], s: filter.u, on: filter.enable}
)m",
                                   "m.yaml");
}

/// Blocks that are made through the factory beside blocks that are printed.
model::Model hosted(const std::string& states) {
    return formats::read_yaml_text("model: hosted_" + states + R"m(
step: 0.02
solver: rk4
blocks:
  r: {block: Step, time: 0.3, before: 2, after: 0.5}
  e: {block: Sum, signs: "+-"}
  c: {block: PID, P: 2, I: 2, D: 0.1, lower: -1, upper: 1, tracking_time: 0.2}
  plant: {block: StateSpace, A: "[-1 -3; 1 0]", B: "[1; 0]", C: "[1 2]"}
  wave: {block: Sine, frequency: 8}
  on: {block: CompareToConstant, operator: ">", constant: 0}
  size: {block: Width}
  part:
    execution: enabled
    states: )m" + states + R"m(
    inputs: [u]
    outputs: {y: {initial: 4, when_disabled: )m" +
                                       states + R"m(}}
    blocks:
      limited: {block: TransferFunction, denominator: [1, 0.5]}
      filter: {block: Gain, K: 3}
    connections: {u: limited, limited: filter, filter: y}
connections: {r: e.u1, plant: [e.u2, part.u], e: c, c: [plant, size], wave: on, on: part.enable}
)m",
                                   "m.yaml");
}

/// A block of the paper's API, whose state nobody else sees, in a subsystem that resets it; at last one that
/// fails.
model::Model legacy() {
    return formats::read_yaml_text(R"m(model: legacy
step: 0.01
blocks:
  u: {block: Sine, frequency: 7}
  spread: {block: Gain, K: [1, 2]}
  wave: {block: Sine, frequency: 50}
  part:
    execution: enabled
    states: reset
    inputs: [u]
    outputs: {y: {initial: [7, 8]}}
    blocks:
      sum: {block: LegacyPlugin/Accumulate, factor: 0.3, bias: [1, -2]}
      past: {block: UnitDelay}
    connections: {u: [sum.u1, past], past: sum.u2, sum: y}
  last: {block: Step, time: 0.3}
  three: {block: Gain, K: [1, 2, 3]}
  fails:
    execution: enabled
    inputs: [u]
    blocks: {bad: {block: LegacyPlugin/Misbehaves, misdeed: "'output throws'"}}
    connections: {u: bad.u1}
connections: {u: [spread, three], spread: part.u, wave: part.enable, last: fails.enable, three: fails.u}
)m",
                                   "m.yaml");
}

/// A continuous state that becomes NaN in the third step.
model::Model continuous_nan() {
    return formats::read_yaml_text(R"m(model: continuous_nan
step: 1
blocks:
  late: {block: Step, time: 2, before: 1, after: 0}
  inverse: {block: Product, operations: "/"}
  zero: {block: Gain, K: 0}
  x: {block: Integrator}
  y: {block: Integrator}
connections: {late: [inverse, y], inverse: zero, zero: x}
)m",
                                   "m.yaml");
}

/// A continuous state that grows 1e9 times in each step, beyond all numbers in the thirty-fifth.
model::Model continuous_overflow() {
    return formats::read_yaml_text(R"m(model: continuous_overflow
step: 1
solver: euler
blocks:
  t: {block: Clock}
  fine: {block: Integrator}
  x: {block: Integrator, initial: 1}
  g: {block: Gain, K: 1e9}
connections: {t: fine, x: g, g: x}
)m",
                                   "m.yaml");
}

/// Every pair of numbers at the limits of a type, in the rules that are printed as equations: one number and
/// four of them. Of real types these are zeros of both signs, infinities, NaN and the smallest and largest.
model::Model extremes(const std::string& type, const std::vector<std::string>& values) {
    const bool is_real = type == "double" || type == "single";
    std::string blocks, connections, to_a, to_b;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::string n = std::to_string(i), group = i < 4 ? "a" : "b";
        const std::string value = values[i] == "NaN" ? "0" : values[i];
        blocks += "  c" + n + ": {block: Constant, value: \"" + value + "\"}\n  s" + n +
                  ": {block: Convert, type: " + type + "}\n";
        if (values[i] == "NaN") {
            blocks += "  inf: {block: Constant, value: Inf}\n  nan: {block: Product}\n";
            connections += ", c" + n + ": nan.u1, inf: nan.u2, nan: s" + n;
        } else {
            connections += ", c" + n + ": s" + n;
        }
        connections += ", s" + n + ": [" + group + ".u" + std::to_string(i % 4 + 1);
        // Pairs of this number with all in a and b.
        int count = 0;
        const auto pair = [&](const std::string& block, const std::vector<std::string>& inputs) {
            for (const std::string side : {"a", "b"}) {
                const std::string name = "p" + n + side + std::to_string(count++);
                blocks += "  " + name + ": {block: " + block + "}\n";
                auto& to = side == "a" ? to_a : to_b;
                to += ", " + name + "." + inputs[0];
                connections += ", " + name + "." + inputs[1];
                if (inputs.size() > 2) to += ", " + name + "." + inputs[2];
            }
        };
        const std::vector<std::string> two{"u1", "u2"}, back{"u2", "u1"};
        for (const char* block : {"Sum, signs: \"+-\"", "Sum, signs: \"-+\"", "Product, operations: \"*/\"",
                                  "Product, operations: \"/*\"", "Minimum", "Maximum", "Mod", "Rem"}) {
            pair(block, two);
            pair(block, back);
        }
        for (const char* op : {"==", "~=", "<", "<=", ">", ">="})
            pair("Relational, operator: \"" + std::string(op) + "\"", two);
        for (const char* op : {"AND", "OR", "XOR", "NAND", "NOR", "XNOR"})
            pair("Logic, operator: " + std::string(op), two);
        for (const char* criterion : {">=", ">", "~="})
            pair("Switch, criterion: \"" + std::string(criterion) + "\"", {"u1", "u2", "u3"});
        pair("SaturateDynamic", {"u", "lower", "upper"});
        pair("SaturateDynamic", {"upper", "u", "lower"});
        pair("DeadZoneDynamic", {"u", "start", "end"});
        pair("DeadZoneDynamic", {"end", "u", "start"});
        connections += "]";
    }
    int count = 0;
    const auto one = [&](const std::string& block) {
        for (const std::string side : {"a", "b"}) {
            const std::string name = "one" + side + std::to_string(count++);
            blocks += "  " + name + ": {block: " + block + "}\n";
            (side == "a" ? to_a : to_b) += ", " + name;
        }
    };
    for (const char* block :
         {"Abs", "Sign", "Negate", "Square", "DeadZone, start: 0, end: 1", "Saturate, lower: 0, upper: 1",
          "WrapToZero, threshold: 1", "CompareToZero, operator: \">\"", "Logic, operator: NOT", "Bias"})
        one(block);
    if (is_real)
        for (const char* block : {"Friction", "Sqrt", "Reciprocal"}) one(block);
    return formats::read_yaml_text(
        "model: extremes_" + type + "\nstep: 0.1\nblocks:\n" + blocks +
            "  a: {block: Mux, inputs: 4}\n  b: {block: Mux, inputs: 4}\nconnections: {" +
            connections.substr(2) + ", a: [" + to_a.substr(2) + "], b: [" + to_b.substr(2) + "]}\n",
        "m.yaml");
}

/// A state that becomes NaN in the fourth step.
model::Model nan_model() {
    model::Builder m("becomes_nan");
    m.step(0.01);
    m.add("late", "Step", {{"time", 0.03}, {"before", 1}, {"after", 0}});
    m.add("zero", "Constant", {{"value", 0}});
    m.add("inverse", "Product", {{"operations", "'/'"}});
    m.add("times_zero", "Product");
    m.add("memory", "UnitDelay");
    m.connect(model::End{"late"}, model::End{"inverse"});
    m.connect(model::End{"inverse"}, model::End{"times_zero", "u1"});
    m.connect(model::End{"zero"}, model::End{"times_zero", "u2"});
    m.connect(model::End{"times_zero"}, model::End{"memory"});
    return m.build();
}

} // namespace

std::string functions_model() {
    std::string blocks = "  wave: {block: Sine, amplitude: 0.3, bias: 0.5, frequency: 7}\n"
                         "  half: {block: Constant, value: 0.4}\n",
                one, two;
    const auto add = [&](kernels::Operation function, const std::string& arguments) {
        const std::string name = kernels::name_of(function);
        blocks += "  of_" + name + ": {block: Fcn, expression: \"" + name + arguments + "\"}\n";
        return "of_" + name + ", ";
    };
    for (int i = static_cast<int>(kernels::Operation::abs); i < kernels::operation_count; ++i) {
        const auto function = static_cast<kernels::Operation>(i);
        if (function < kernels::Operation::plus)
            one += add(function, kernels::is_defined(function, 0.5) ? "(u)" : "(1 + u)");
        else if (function >= kernels::Operation::min) {
            const std::string block = add(function, "(u1, u2)"), name = block.substr(0, block.size() - 2);
            one += name + ".u1, ";
            two += name + ".u2, ";
        }
    }
    return "model: functions\nstep: 0.01\nblocks:\n" + blocks + "connections: {wave: [" + one + "], half: [" +
           two + "]}\n";
}

/// Cubic tables of three points and more, within them and beyond.
model::Model smooth_tables() {
    std::string blocks, tables;
    for (const std::string kind : {"spline", "akima"})
        for (const auto& [points, values] : {std::pair{"-3, -1, 2.5", "1, -2, 5"},
                                             {"-3, -1, 2.5, 3", "1, -2, 5, 5"},
                                             {"-3, -1, 0, 0.5, 2, 3", "1, -2, 5, 3, 3, 0.1"}}) {
            const std::string name = kind + std::to_string(tables.size());
            blocks += "  " + name + ": {block: Lookup1D, extrapolation: linear, interpolation: " + kind +
                      ", breakpoints: [" + points + "], table: [" + values + "]}\n";
            tables += (tables.empty() ? "" : ", ") + name;
        }
    return formats::read_yaml_text(
        "model: smooth_tables\nstep: 0.01\nblocks:\n  wave: {block: Sine, frequency: "
        "12, amplitude: 4}\n" +
            blocks + "connections: {wave: [" + tables + "]}\n",
        "m.yaml");
}

std::vector<Case> structure_cases() {
    std::vector<Case> cases;
    cases.push_back({Elaborated(chain(500, 10)), 100});
    cases.push_back(
        {Elaborated(chain(30, 10)), 20, {.statements_per_function = 7, .statements_per_file = 20}});
    cases.push_back({Elaborated(multirate()), 25});
    cases.push_back({Elaborated(enabled(false)), 60});
    cases.push_back({Elaborated(enabled(true)), 60});
    for (const auto& [name, method] : solver_methods) {
        if (is_adaptive(method)) continue;
        for (const std::string states : {"held", "reset"})
            cases.push_back(
                {Elaborated(continuous(std::string(name) + "_" + states, std::string(name), states)), 40});
    }
    for (const std::string states : {"held", "reset"}) cases.push_back({Elaborated(hosted(states)), 60});
    cases.push_back({Elaborated(legacy()), 40});
    cases.push_back({Elaborated(continuous_nan()), 5});
    cases.push_back({Elaborated(continuous_overflow()), 40});
    for (const std::string type : {"double", "single"})
        cases.push_back(
            {Elaborated(extremes(type, {"0", "-0.0", "Inf", "-Inf", "NaN", "-5e-324", "1e-310", "3e38"})),
             2});
    cases.push_back({Elaborated(extremes("int8", {"0", "1", "-1", "2", "-128", "127", "-127", "64"})), 2});
    cases.push_back(
        {Elaborated(extremes("uint32", {"0", "1", "2", "3", "4294967295", "2147483648", "65536", "7"})), 2});
    cases.push_back({Elaborated(odd_names()), 5});
    cases.push_back({Elaborated(smooth_tables()), 60});
    cases.push_back({Elaborated(nan_model()), 6});
    cases.push_back({Elaborated(formats::read_yaml_text(functions_model(), "functions.yaml")), 20});
    return cases;
}

} // namespace bf::codegen::test

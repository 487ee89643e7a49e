#include "batch.hpp"

#include <algorithm>
#include <iostream>
#include <map>

namespace bf::codegen::test {
namespace {

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

void compile_and_compare(Batch& batch) {
    batch.expect_equal(BF_CXX, "-O0 -Wall -Wextra -Wshadow=local -Werror");
    batch.expect_equal(BF_CXX, "-O3");
    if (*BF_CLANG) {
        batch.expect_equal(BF_CLANG, "-O0");
        batch.expect_equal(BF_CLANG, "-O3 -march=native");
    }
}

// ---- every standard block

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

using Settings = std::vector<std::pair<std::string, Value>>;

Value row(std::initializer_list<double> values) {
    return Value(Matrix(
        Eigen::Map<const Vector>(values.begin(), static_cast<Eigen::Index>(values.size())).transpose()));
}

/// Settings beside the defaults that change which rules a block has.
const std::multimap<std::string, Settings>& variants() {
    static const std::multimap<std::string, Settings> all = [] {
        std::multimap<std::string, Settings> v{
            {"Gain", {{"multiplication", "K*u"}}},
            {"Gain", {{"K", 0.1}}},
            {"Constant", {{"value", row({1.5, -2, 0.1})}}},
            {"Sine", {{"frequency", row({200, 300})}, {"phase", 0.3}}},
            {"Step", {{"time", 0.02}}},
            {"Ramp", {{"slope", row({0.1, -0.3})}, {"start", 0.01}}},
            {"Pulse", {{"cycle", 0.03}, {"amplitude", 2.5}}},
            {"Chirp", {{"f0", 3}, {"f1", 40}, {"target", 1}}},
            {"Sum", {{"signs", "+-+"}}},
            {"Sum", {{"signs", "-"}}},
            {"Product", {{"operations", "*/"}}},
            {"Product", {{"operations", "/"}}},
            {"Product", {{"operations", "/"}, {"multiplication", "matrix"}}},
            {"Product", {{"operations", "/*"}, {"multiplication", "matrix"}}},
            {"Product", {{"operations", "*/*"}, {"multiplication", "matrix"}}},
            {"Minimum", {{"inputs", 1}}},
            {"Norm", {{"kind", "1"}}},
            {"Norm", {{"kind", "inf"}}},
            {"Reshape", {{"size", row({3, 3})}}},
            {"ConcatenateMatrices", {{"direction", "vertical"}}},
            {"PseudoInverse", {{"method", "truncated"}}},
            {"LinearSolve", {{"method", "cholesky"}}},
            {"LinearSolve", {{"method", "least_squares"}}},
            {"LinearSolve", {{"side", "right"}}},
            {"RotationAboutAxis", {{"axis", "x"}}},
            {"Demux", {{"sizes", row({1, 2})}}},
            {"Selector", {{"indices", row({3, 1})}, {"columns", 2}}},
            {"Convert", {{"type", "uint8"}, {"saturate", true}}},
            {"Convert", {{"type", "int16"}, {"rounding", "nearest"}}},
            {"Logic", {{"operator", "NOT"}}},
            {"Logic", {{"operator", "XOR"}, {"inputs", 1}}},
            {"Switch", {{"criterion", ">"}}},
            {"Switch", {{"criterion", "~="}}},
            {"StateMachine", {{"transitions", row({1, 1, 1, 0})}}},
            {"DiscreteIntegrator", {{"method", "backward"}, {"reset", "level"}}},
            {"DiscreteIntegrator", {{"method", "trapezoidal"}, {"initial_source", "external"}}},
            {"DiscreteIntegrator", {{"reset", "rising"}, {"initial_source", "external"}}},
        };
        for (const char* kind : {"final", "maximum", "minimum", "rms", "mean"})
            v.insert({"Check", {{"kind", kind}}});
        return v;
    }();
    return all;
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

TEST(GeneratedCode, EqualsTheEngineForEveryStandardBlock) {
    Batch batch("blocks");
    const Library library = standard_library();
    const std::vector<std::string> shapes{"", "3", "[3 3]", "4", "[4 4]"};
    int number = 0, wirings = 0;
    for (const auto& type : library.classes()) {
        if (type.methods.output || type.methods.update) continue; // refused
        std::vector<Settings> tried{{}};
        const auto [first, last] = variants().equal_range(type.name);
        for (auto v = first; v != last; ++v) tried.push_back(v->second);
        for (const auto& settings : tried) {
            Arguments arguments;
            for (const auto& [name, value] : settings) arguments.emplace_back(name, value);
            const auto block = type.make(arguments);
            const auto& slots = block->declaration().slots;
            if (std::any_of(slots.begin(), slots.end(),
                            [](const Slot& slot) {
                                return slot.role == Role::continuous_state || slot.role == Role::guard;
                            }) ||
                type.methods.derivative || type.methods.guards || type.methods.event)
                continue; // generated code has no solver
            std::vector<std::string> inputs;
            for (const auto& slot : block->declaration().slots)
                if (slot.role == Role::input) inputs.push_back(slot.name);
            std::vector<Wiring> accepted;
            const auto attempt = [&](const Wiring& wiring) {
                try {
                    model::Builder m("attempt");
                    m.step(0.01);
                    std::vector<InputPort> ports;
                    add_block(m, ports, "b", type, inputs, wiring);
                    const Elaborated one(finish(m, ports, settings));
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
            ASSERT_FALSE(accepted.empty()) << type.name << " accepts nothing that was tried";
            model::Builder m("case_" + std::to_string(++number) + "_" + type.name);
            m.step(0.01);
            std::vector<InputPort> ports;
            for (std::size_t i = 0; i < accepted.size(); ++i)
                add_block(m, ports, "b" + std::to_string(i), type, inputs, accepted[i]);
            wirings += static_cast<int>(accepted.size());
            batch.add(Elaborated(finish(m, ports, settings)));
        }
    }
    EXPECT_GT(wirings, 400);
    std::cout << batch.size() << " models, " << wirings << " wirings\n";
    compile_and_compare(batch);
}

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

TEST(GeneratedCode, EqualsTheEngineForEveryStructure) {
    Batch batch("structures");
    batch.add(Elaborated(chain(500, 10)), 100);
    batch.add(Elaborated(chain(30, 2)), 20, {.statements_per_function = 7, .statements_per_file = 20});
    batch.add(Elaborated(multirate()), 25);
    batch.add(Elaborated(enabled(false)), 60);
    batch.add(Elaborated(enabled(true)), 60);
    batch.add(Elaborated(odd_names()), 5);
    batch.add(Elaborated(nan_model()), 6);
    compile_and_compare(batch);
    EXPECT_DOUBLE_EQ(batch.expected("chain_500").rows.back().at(batch.column("chain_500", "sum499.y")),
                     993.278888040133);
    EXPECT_EQ(batch.expected("becomes_nan").rows.size(), 4u);
    EXPECT_EQ(batch.expected("becomes_nan").failure.substr(0, 29), "memory: a state became NaN: l");
}

// ---- the program of a project, and refusals

template <class F> std::string refusal(F&& f) {
    try {
        f();
    } catch (const GenerationError& error) {
        return error.what();
    }
    return "";
}

/// A folder of this test alone, removed at its end.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("bf_codegen_folder_" + std::to_string(getpid()));
    Folder() { fs::remove_all(path); }
    ~Folder() { fs::remove_all(path); }
};

TEST(GeneratedProgram, TakesAllParametersOfAFileOrNone) {
    model::Builder m("two gains");
    m.step(0.1).stop(0.2);
    m.add("one", "Constant", {{"value", "[1 2]"}});
    m.add("K", "Gain", {{"K", 3}});
    m.connect(model::End{"one"}, model::End{"K"});
    m.record({"K.y"});
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram = elaborate(m.build(), registry);
    const Folder folder;
    write(generate(diagram), folder.path);
    const std::string at = "cd " + folder.path.string() + " && ";
    ASSERT_EQ(std::system(
                  (at + BF_CXX + " -std=c++17 -Wall -Wextra -Werror -I. -Iinclude *.cpp -o program").c_str()),
              0);
    const auto run = [&](const std::string& parameters) {
        Batch::write_text(folder.path / "p.txt", parameters);
        const int code =
            std::system((at + "./program --parameters p.txt --csv out.csv 2> errors.txt").c_str());
        return code == 0 ? Batch::read_text(folder.path / "out.csv")
                         : Batch::read_text(folder.path / "errors.txt");
    };
    EXPECT_EQ(run(""), "time,\"K.y(1)\",\"K.y(2)\"\n0,3,6\n0.10000000000000001,3,6\n");
    EXPECT_EQ(run("# a comment\none.value = 4, 5 # constants follow\nK.K = -0.5\n"),
              "time,\"K.y(1)\",\"K.y(2)\"\n0,-2,-2.5\n0.10000000000000001,-2,-2.5\n");
    EXPECT_EQ(run("one.value = 1 2 3\nK.k = 1\nK.K = nan\nK.K 1\nK.K = 1x\n"),
              "p.txt:1: parameter 'one.value': wrong number of elements (it has 2, the line gives 3)\n"
              "p.txt:2: there is no parameter 'K.k'; --list names all\n"
              "p.txt:3: parameter 'K.K': a value is not a number (it has 1, the line gives 1)\n"
              "p.txt:4: write name = values, not 'K.K 1'\n"
              "p.txt:5: '1x' is no list of numbers\n");
}

TEST(Generate, RefusesBlocksThatAreMoreThanRules) {
    model::Builder m("sizes");
    m.step(0.1);
    m.add("one", "Constant", {{"value", 1}});
    m.add("n", "Width");
    m.connect(model::End{"one"}, model::End{"n"});
    const Elaborated elaborated(m.build());
    EXPECT_EQ(
        refusal([&] { generate(elaborated.diagram); }),
        "no code can be generated for 'sizes':\n  n (Width): it is computed by methods of its class instead "
        "of rules, "
        "which cannot be printed\nreplace these blocks, or generate the part of the model without them");
}

TEST(Generate, WritesIntoEmptyFoldersOnly) {
    const Folder folder;
    write({{"a/b.txt", "text"}}, folder.path);
    EXPECT_EQ(Batch::read_text(folder.path / "a" / "b.txt"), "text");
    EXPECT_EQ(refusal([&] {
                  write({{"c.txt", "text"}}, folder.path);
              }),
              "cannot generate into " + folder.path.string() +
                  ": the folder is not empty; empty it or name another one");
    EXPECT_FALSE(fs::exists(folder.path / "c.txt"));
    EXPECT_EQ(refusal([&] {
                  write({{"c.txt", "text"}}, folder.path / "a" / "b.txt");
              }),
              "cannot generate into " + (folder.path / "a" / "b.txt").string() +
                  ": it is a file; name a folder");
    EXPECT_NE(refusal([&] { write({{"c.txt", "text"}}, "/proc/no/folder"); }), "");
}

} // namespace
} // namespace bf::codegen::test

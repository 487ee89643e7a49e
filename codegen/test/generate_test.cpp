#include "cases.hpp"
#include "compare.hpp"
#include "program.hpp"

#include "bf/codegen/parameter_file.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/builder.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <unistd.h>

namespace bf::codegen::test {
namespace {

namespace fs = std::filesystem;

const Drivers drivers{BF_CASE_DRIVERS, BF_C_DRIVERS, BF_HOSTED_DRIVER, BF_TEST_PLUGINS};

TEST(GeneratedCode, EqualsTheEngineForEveryStandardBlock) {
    const auto cases = block_cases();
    std::size_t wirings = 0;
    std::set<std::string> missing;
    const Library library = standard_library();
    for (const auto& type : library.classes()) missing.insert(type.name);
    for (const auto& one : cases)
        for (const auto& node : one.elaborated.diagram.nodes) {
            wirings += node.path.starts_with("b");
            missing.erase(node.type);
        }
    EXPECT_GT(wirings, 400u);
    // One reads a file, one has the size of its reader, two stand in loops.
    for (const char* known : {"SignalFromFile", "Ground", "Iteration", "While"}) missing.erase(known);
    EXPECT_EQ(missing, std::set<std::string>());
    compare_all(cases, drivers);
}

TEST(GeneratedCode, EqualsTheEngineForEveryStructure) {
    const auto cases = structure_cases();
    const auto recordings = compare_all(cases, drivers);
    const Diagram& chain = cases.front().elaborated.diagram;
    std::size_t column = 1;
    for (const auto& signal : chain.record) {
        if (signal.path == "sum499.y") break;
        column += static_cast<std::size_t>(chain.slot(signal.end).size.count());
    }
    EXPECT_DOUBLE_EQ(recordings.at("chain_500").rows.back().at(column), 993.278888040133);
    EXPECT_EQ(recordings.at("legacy").failure, "fails.bad: plugin 'LegacyPlugin', block 'Misbehaves', "
                                               "output: threw an exception: thrown on purpose (0)");
    EXPECT_EQ(recordings.at("becomes_nan").rows.size(), 4u);
    EXPECT_EQ(recordings.at("becomes_nan").failure.substr(0, 29), "memory: a state became NaN: l");
    EXPECT_EQ(recordings.at("continuous_overflow").rows.size(), 35u);
    EXPECT_EQ(recordings.at("continuous_overflow").failure.substr(0, 44),
              "x: a continuous state became NaN or infinite");
}

TEST(GeneratedCode, EqualsTheEngineForSubsystemsThatAreTriggeredResetChosenOrIterated) {
    const auto recordings = compare_all(control_cases(), drivers);
    EXPECT_EQ(recordings.at("endless").failure,
              "s.w: the while loop around it did not end within 7 iterations: look at "
              "the condition of its While, or let it allow more");
}

TEST(GeneratedCode, EqualsTheEngineForEveryExample) { compare_all(example_cases(), drivers); }

// ---- the program of a project, and refusals

template <class F> std::string refusal(F&& f) {
    try {
        f();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

/// A lag and a wave whose parameters have limits and follow from variables, which have limits too.
const char* const limited_model = R"m(model: limited
step: 0.1
stop: 0.1
solver: euler
variables:
  w: {value: 4, minimum: -5, maximum: 9, unit: Hz, doc: of the wave}
  twice: {value: 2*w, maximum: 12, doc: as fast}
blocks:
  c: {block: Constant, value: 3}
  v: {block: Constant, value: [1, 2]}
  lag: {block: FilteredDerivative, time_constant: [0.1, 0.2]}
  p: {block: Pulse, cycle: 1/w, width: 50}
  s: {block: Saturate, lower: 0, upper: w}
connections: {v: lag, c: s}
)m";

TEST(GeneratedProgram, HoldsParametersAndVariablesToTheirLimits) {
    const Elaborated model(formats::read_yaml_text(limited_model, "m.yaml"));
    const Program program(model.diagram, "limited");
    ASSERT_EQ(program.compiled, 0);
    const auto errors = [&](const std::string& parameters) {
        write_text(program.folder.path / "p.yaml", parameters);
        return program("--params p.yaml") == 0 ? "none" : program.text("errors.txt");
    };
    EXPECT_EQ(errors("p.width: 100\nlag.time_constant: 3\n"), "none");
    EXPECT_EQ(errors("p:\n  width: 100.5\n  cycle: 0\nlag.time_constant: [1, -1]\n"),
              "p.yaml:2: parameter 'p.width' must be from 0 to 100, but is 100.5\n"
              "p.yaml:3: parameter 'p.cycle' must be greater than 0, but is 0\n"
              "p.yaml:4: parameter 'lag.time_constant' must be greater than 0, but element 2 is -1\n");
    EXPECT_EQ(errors("c.value: 1\nw: -4\n"),
              "p.yaml: parameter 'p.cycle' must be greater than 0, but is -0.25\n");
    EXPECT_EQ(errors("w: -4\np.cycle: 2\ns.lower: -4\n"), "none") << "what was given follows no more";
    EXPECT_EQ(errors("w: -4\np.cycle: 2\n"),
              "p.yaml: parameter 's.upper' must be at least 'lower', but -4 is below 0\n");
    EXPECT_EQ(errors("s.lower: [5]\n"),
              "p.yaml: parameter 's.upper' must be at least 'lower', but 4 is below 5\n");
    EXPECT_EQ(errors("s.lower: 5\ns.upper: 6\n"), "none");
    EXPECT_EQ(errors("c.value: 1\nw: 9.5\n"), "p.yaml:2: variable 'w' must be from -5 to 9, but is 9.5\n");
    EXPECT_EQ(errors("w: 7\n"), "p.yaml: variable 'twice' must be at most 12, but is 14\n");
    EXPECT_EQ(errors("w: 7\ntwice: 12\n"), "none");
    ASSERT_EQ(program("--list"), 0);
    EXPECT_NE(program.text("out.txt").find("p.width: 50  # 1x1 part of the cycle that is high, in percent; "
                                           "from 0 to 100\n"),
              std::string::npos)
        << program.text("out.txt");
    EXPECT_TRUE(program.text("out.txt").starts_with("w: 4  # 1x1 [Hz] of the wave; from -5 to 9\ntwice: 8  # "
                                                    "1x1 as fast; = 2*w; at most 12\nc.value: 3 "));
    const std::string header = program.text("limited.hpp");
    EXPECT_NE(header.find("double w = 4.0; ///< w [Hz]: of the wave\n"), std::string::npos) << header;
    EXPECT_NE(header.find("double twice = 8.0; ///< twice = 2*w: as fast\n"), std::string::npos) << header;
    expect_commands(program, R"py(
names = "w", "c.value", "p.cycle", "lag.time_constant"
with Commanded("./program") as program:
    assert program.ask("?") == "w: 4  # 1x1 [Hz] of the wave; from -5 to 9"
    while program.lines.readline().strip():
        pass
    before = program.values(*names)
    assert before == ("4", "3", "0.25", "[0.1, 0.2]"), before
    assert program.ask("{c.value: 5, p.cycle: -1}") == "error: parameter 'p.cycle' must be greater than 0, but is -1"
    assert program.ask("{c.value: 5, w: -2}") == "error: parameter 'p.cycle' must be greater than 0, but is -0.5"
    assert program.ask("{c.value: 5, w: 9.5}") == "error: variable 'w' must be from -5 to 9, but is 9.5"
    assert program.ask("{c.value: 5, w: 7}") == "error: variable 'twice' must be at most 12, but is 14"
    assert program.values(*names) == before, program.values(*names)
    assert program.ask("{c.value: 5, w: 2}") == "ok"
    assert program.values(*names) == ("2", "5", "0.5", "[0.1, 0.2]"), program.values(*names)
)py");

    std::filesystem::remove(program.folder.path / "main.cpp");
    write_text(program.folder.path / "api.cpp", R"(
#include "limited.hpp"
#include <cstdio>
int main() {
    Limited m;
    if (!m.initialize()) return 1;
    const double width[] = {-1}, value[] = {7}, w[] = {-4}, much[] = {9.5}, more[] = {7}, low[] = {5};
    const bf::generated::NewValue changes[] = {{"c.value", value, 1}, {"p.width", width, 1}};
    const bf::generated::NewValue following[] = {{"c.value", value, 1}, {"w", w, 1}};
    const bf::generated::NewValue variable[] = {{"c.value", value, 1}, {"w", much, 1}};
    std::printf("%s\n", m.set_parameters(changes, 2));
    std::printf("%s\n", m.set_parameters(following, 2));
    std::printf("%s\n", m.set_parameters(variable, 2));
    std::printf("%s\n", m.set_parameter("w", more, 1));
    std::printf("%s\n", m.set_parameter("s.lower", low, 1));
    std::printf("%g %g %g\n", m.parameters.c_value, m.parameters.p_width, m.variables.w);
    std::printf("%d %d\n", m.set_parameter("c.value", value, 1) == nullptr, m.step());
}
)");
    ASSERT_EQ(std::system((program.at + BF_CXX " -std=c++17 -ffp-contract=off -I. -Iinclude api.cpp "
                                               "limited.cpp limited_tables.cpp -o api && ./api > out.txt")
                              .c_str()),
              0);
    EXPECT_EQ(program.text("out.txt"), "parameter 'p.width' must be from 0 to 100, but is -1\n"
                                       "parameter 'p.cycle' must be greater than 0, but is -0.25\n"
                                       "variable 'w' must be from -5 to 9, but is 9.5\n"
                                       "variable 'twice' must be at most 12, but is 14\n"
                                       "parameter 's.upper' must be at least 'lower', but 4 is below 5\n"
                                       "3 50 4\n1 1\n");
}

/// Which function of an object file needs what, a line each: "section symbol".
std::vector<std::string> needs(const fs::path& relocations) {
    std::vector<std::string> all;
    std::istringstream lines(read_text(relocations));
    std::string section;
    for (std::string line; std::getline(lines, line);)
        if (const auto at = line.find("FOR ["); at != std::string::npos)
            section = line.substr(at + 5, line.find(']') - at - 5);
        else if (const auto space = line.rfind(' '); space != std::string::npos)
            all.push_back(section + " " + line.substr(space + 1));
    return all;
}

TEST(GeneratedCode, OfSinglePrecisionComputesInFloatOnly) {
    if (std::system("command -v arm-none-eabi-g++ >/dev/null") != 0)
        GTEST_SKIP() << "arm-none-eabi-g++ is missing: scripts/deps test installs it";
    const Folder folder("single");
    std::string all;
    int count = 0;
    for (const auto& one : block_cases()) {
        const Diagram& diagram = one.elaborated.diagram;
        if (has_hosted_blocks(diagram)) continue;
        ++count;
        for (const auto& [file, text] : generate(diagram, {.embedded = true, .single = true}))
            write_text(folder.path / file, text);
        all += "#include \"" + file_name(diagram) + ".cpp\"\n";
    }
    EXPECT_GT(count, 100);
    write_text(folder.path / "all.cpp", all);
    // A processor with single precision alone: every double would be a call.
    ASSERT_EQ(
        std::system(("cd " + folder.path.string() +
                     " && arm-none-eabi-g++ -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard "
                     "-std=c++17 -O1 -ffp-contract=off -fno-exceptions -fno-rtti -ffunction-sections -w "
                     "-I. -Iinclude -c all.cpp && arm-none-eabi-objdump -r -C all.o >needs.txt")
                        .c_str()),
        0);
    // Of the C library what ends in no f computes in double; of the compiler's what has a d.
    static const std::set<std::string> doubles{
        "sin",   "cos",   "tan",   "asin",  "acos",  "atan", "atan2", "sinh",   "cosh",
        "tanh",  "asinh", "acosh", "atanh", "exp",   "log",  "log10", "pow",    "sqrt",
        "hypot", "floor", "ceil",  "round", "trunc", "fmod", "fabs",  "sincos", "nextafter"};
    std::size_t calls = 0;
    for (const auto& need : needs(folder.path / "needs.txt")) {
        const std::string symbol = need.substr(need.rfind(' ') + 1);
        const bool is_helper = symbol.starts_with("__aeabi_");
        calls += is_helper || symbol.ends_with('f');
        EXPECT_FALSE(doubles.contains(symbol) ||
                     (is_helper && (symbol.starts_with("__aeabi_d") || symbol.ends_with("2d"))))
            << need;
    }
    EXPECT_GT(calls, 0u);
}

TEST(GeneratedCode, ForMicrocontrollersRefusesWithoutFormattingNumbers) {
    const Elaborated model(formats::read_yaml_text(limited_model, "m.yaml"));
    const Folder folder("limited_embedded");
    write(generate(model.diagram, {.embedded = true}), folder.path);
    write_text(folder.path / "api.cpp", R"(
#include "limited.hpp"
#include <cstdio>
int main() {
    Limited m;
    const double w[] = {-4}, cycle[] = {-1}, much[] = {9.5}, more[] = {7}, low[] = {5};
    std::printf("%s\n", m.set_parameter("w", w, 1));
    std::printf("%s\n", m.set_parameter("p.cycle", cycle, 1));
    std::printf("%s\n", m.set_parameter("w", much, 1));
    std::printf("%s\n", m.set_parameter("w", more, 1));
    std::printf("%s\n", m.set_parameter("s.lower", low, 1));
    std::printf("%g\n", m.variables.w);
}
)");
    ASSERT_EQ(
        std::system(
            ("cd " + folder.path.string() + " && " +
             BF_CXX " -std=c++17 -ffp-contract=off -I. -Iinclude -c limited.cpp limited_tables.cpp && " BF_CXX
                    " -std=c++17 -I. -Iinclude api.cpp limited.o limited_tables.o -o api && "
                    "./api > out.txt && nm -u limited.o limited_tables.o > needs.txt")
                .c_str()),
        0);
    EXPECT_EQ(read_text(folder.path / "out.txt"), "a value is outside of its limits\n"
                                                  "a value is outside of its limits\n"
                                                  "a value is outside of its limits\n"
                                                  "a value is outside of its limits\n"
                                                  "a value is below another that it must be at least\n4\n");
    EXPECT_EQ(read_text(folder.path / "needs.txt").find("printf"), std::string::npos);
}

/// A model in which each expression is the value of a constant c0, c1, ...
std::string expressions_model(const std::vector<std::string>& expressions) {
    std::string text =
        "model: expressions\nstep: 0.1\nstop: 0.1\nvariables:\n  a: 2\n  b: 0.25\n  c: 1\n  n: 2\n  n1: 2\n"
        "  v: [1, -2, 3]\n  M: [[1, 2], [3, 4]]\n  S: {p: 3, q: 2*S.p + a}\nblocks:\n";
    for (std::size_t i = 0; i < expressions.size(); ++i)
        text += "  c" + std::to_string(i) + ": {block: Constant, value: \"" + expressions[i] + "\"}\n";
    return text;
}

const std::vector<std::string>& expressions() {
    static const std::vector<std::string> all{"a",
                                              "-a + b",
                                              "a*b - v",
                                              "v'*v",
                                              "v*v'",
                                              "M*M",
                                              "M*[a; b]",
                                              "M.^2 ./ [a b]",
                                              "2^a",
                                              "sqrt(S.q)/7",
                                              "[a, b; M]",
                                              "[M, [a; b]; 1 2 S.p]",
                                              "v(2)",
                                              "v([3 1])",
                                              "M(:, end)",
                                              "M(2, :) + v(1:2)",
                                              "a > b & ~(b == 0)",
                                              "a >= 1 && b < 0",
                                              "a ~= 1 || b <= 0",
                                              "sin(a) + cos(b)*tan(a) + atan2(a, b)",
                                              "exp(a) + log(a) + log10(a) + log2(b)",
                                              "mod(-a, 0.7) + rem(a, b) + hypot(a, b)",
                                              "min(v, a) + max(v, b)",
                                              "floor(v/2) + ceil(v/3) + fix(a/3) + round(a/3)",
                                              "abs(v) .* sign(v)",
                                              "diag(v)*a",
                                              "diag(M)'",
                                              "eye(2)*a + zeros(n, n)",
                                              "deg2rad(a) + rad2deg(b)",
                                              "a \\\\ v",
                                              "v/a",
                                              "numel(v)*a + pi",
                                              "tanh(a) + asinh(a) + acos(b) + expm1(b) + log1p(b)",
                                              "S.q.^[1 2 3]",
                                              "a*[1 2; 3 4]'",
                                              "v(n1)",
                                              "M(n1, 2)",
                                              "M(2, 3 - n1) + v(end)",
                                              "a > 1.9 && log(a - 1.8) < 9",
                                              "plus(a, lt(v, b)) + power(a, 3)",
                                              "c/c && a",
                                              "reshape([v, a], 2, 2) + tril(M)",
                                              "diag(v, 1) - repmat([flip(v), b], 4, 1)",
                                              "circshift(v, 1) * permute(v, [2 1])"};
    return all;
}

/// The program of all these expressions, compiled once.
const Program& expressions_program() {
    static const Elaborated model(formats::read_yaml_text(expressions_model(expressions()), "m.yaml"));
    static const Program program(model.diagram, "expressions");
    return program;
}

TEST(GeneratedProgram, FollowsVariablesBitForBitAsElaborationDoes) {
    const std::string text = expressions_model(expressions());
    const Program& program = expressions_program();
    ASSERT_EQ(program.compiled, 0);
    const std::vector<std::pair<std::string, std::vector<ElaborateOptions::Override>>> changes{
        {"{}", {}},
        {"{a: 1.7, b: 0.1}", {{"a", "1.7"}, {"b", "0.1"}}},
        {"{v: [0.3, 5, -7], M: [[0.1, 0.2], [0.3, -0.7]]}",
         {{"v", "[0.3 5 -7]"}, {"M", "[0.1 0.2; 0.3 -0.7]"}}},
        {"{S: {p: 0.3}, a: 3, n1: 1}", {{"S.p", "0.3"}, {"a", "3"}, {"n1", "1"}}},
        {"{S: {p: 0.3, q: 11}, c0.value: 6}", {{"S.p", "0.3"}, {"S.q", "11"}, {"c0.value", "6"}}}};
    for (const auto& [file, overrides] : changes) {
        write_text(program.folder.path / "p.yaml", file == "{}" ? "" : file);
        ASSERT_EQ(program("--params p.yaml --csv out.csv"), 0) << program.text("errors.txt");
        Registry registry;
        registry.add(standard_library());
        const Diagram expected =
            elaborate(formats::read_yaml_text(text, "m.yaml"), registry, {overrides, {}});
        std::string row = program.text("out.csv");
        row = row.substr(row.find("\n0,") + 3);
        std::istringstream values(row.substr(0, row.find('\n')));
        for (const auto& node : expected.nodes) {
            const Resolution& r = node.block->resolution();
            for (const double wanted :
                 r.slots[static_cast<std::size_t>(r.find("value", Role::parameter))].initial) {
                std::string cell;
                std::getline(values, cell, ',');
                EXPECT_EQ(std::strtod(cell.c_str(), nullptr), wanted)
                    << file << ": " << node.path << " = "
                    << expressions()[static_cast<std::size_t>(std::stoi(node.path.substr(1)))];
            }
        }
    }
    write_text(program.folder.path / "p.yaml", "a: -1\nn: 3\n");
    EXPECT_NE(program("--params p.yaml"), 0);
    EXPECT_EQ(program.text("errors.txt").substr(0, 46), "p.yaml:2: 'n' cannot change: 'c27.value' follo");
    write_text(program.folder.path / "p.yaml", "a: -1\n");
    EXPECT_NE(program("--params p.yaml"), 0);
    EXPECT_EQ(program.text("errors.txt"),
              "p.yaml: 'c20.value', which follows, is not defined for these values\n");
    write_text(program.folder.path / "p.yaml", "c: 0\n"); // NaN is no condition
    EXPECT_NE(program("--params p.yaml"), 0);
    EXPECT_EQ(program.text("errors.txt"),
              "p.yaml: 'c40.value', which follows, is not defined for these values\n");
}

TEST(GeneratedProgram, NamesTheExpressionThatFixesAVariable) {
    const Elaborated model(
        formats::read_yaml_text(expressions_model({"inv(M)", "a + 0*b", "norm([1 b])", "v(1:n)"}), "m.yaml"));
    const Files files = generate(model.diagram);
    const std::string& tables = files.at("expressions_tables.cpp");
    EXPECT_NE(tables.find("{\"M\", \"'c0.value' follows from it: 'inv' is not computed there\"}"),
              std::string::npos)
        << tables;
    EXPECT_NE(tables.find("{\"b\", \"'c2.value' follows from it: 'norm' is not computed there\"}"),
              std::string::npos);
    EXPECT_NE(tables.find("{\"n\", \"'c3.value' follows from it: a range whose length may change is not "
                          "computed there\"}"),
              std::string::npos);
    EXPECT_NE(files.at("expressions.hpp").find("double a = 2.0;"), std::string::npos);
}

TEST(GeneratedProgram, TakesParametersFromRegularFilesAlone) {
    const Program& program = expressions_program();
    ASSERT_EQ(program.compiled, 0);
    for (const auto& [file, why] :
         {std::pair{".", "it is a folder; give the name of a file"},
          {"/dev/zero", "it is no regular file, which has an end; write its content to one"}}) {
        EXPECT_EQ(program.code("--params " + std::string(file)), 1);
        EXPECT_NE(program.text("errors.txt").find(why), std::string::npos);
    }
}

TEST(GeneratedProgram, TakesCommandsWhileItRuns) {
    const Program& program = expressions_program();
    ASSERT_EQ(program.compiled, 0);
    expect_commands(program, R"py(
import socket
names = "a", "c0.value", "v"
with Commanded("./program") as program:
    assert program.values(*names) == ("2", "2", "[1, -2, 3]"), program.values(*names)
    assert program.ask("a: 3") == "ok"
    assert program.values(*names) == ("3", "3", "[1, -2, 3]"), program.values(*names)
    assert program.ask("{a: 4, c0.value: [1, nan]}") == \
        "error: 'c0.value': wrong number of elements (it has 1x1, the file gives 1x2)"
    assert program.ask("{a: 4, b: 2}") == "error: 'c32.value', which follows, is not defined for these values"
    assert program.values(*names) == ("3", "3", "[1, -2, 3]"), program.values(*names)
    assert program.ask("{a: 4, c0.value: 7}") == "ok"
    assert program.values(*names) == ("4", "7", "[1, -2, 3]"), program.values(*names)
    other = program.connect().makefile("rw")
    program.lines.write("c0.value: 8\n" * 200)  # one line of each in turn
    program.lines.flush()
    other.write("a: 5\n")
    other.flush()
    assert other.readline() == "ok\n"
    assert len(program.connection.recv(1000, socket.MSG_PEEK)) < 100 * len("ok\n")
    for _ in range(200):
        assert program.lines.readline() == "ok\n"
    idle = [program.connect() for _ in range(14)]
    full = program.connect()
    assert full.recv(1) == b""  # sent away: all places are taken by those who may be here
    idle.clear()
    assert program.ask("{a: 1, a: 2}").startswith("error: line:1: a second 'a'")
    assert program.lines.readline() == ""  # what is no such mapping ends the connection
with Commanded("./program") as program:
    assert program.ask("POST / HTTP/1.1").startswith("error: line:1: write name: value")
    assert program.lines.readline() == ""  # disconnected
)py");
}

TEST(GeneratedProgram, ParametersFitTheirTypeOrAreRefused) {
    using namespace bf::generated;
    const auto attempt = [](generated::Type type, double value) {
        const generated::Quantity quantity{"p", "", "", type, Where::parameters, 1, 1, 0, -1};
        Problem problem;
        const char* wrong = check_limits(
            quantity, 1, [&](int) { return value; }, problem);
        const char* brief = check_limits(quantity, 1, [&](int) { return value; });
        EXPECT_EQ(wrong == nullptr, brief == nullptr);
        return std::string(wrong ? wrong : "");
    };
    EXPECT_EQ(attempt(generated::Type::int8, -128), "");
    EXPECT_EQ(attempt(generated::Type::int8, 128),
              "parameter 'p' must be a whole number from -128 to 127, but is 128");
    EXPECT_EQ(attempt(generated::Type::uint32, 4294967295.0), "");
    EXPECT_EQ(attempt(generated::Type::uint32, -1),
              "parameter 'p' must be a whole number from 0 to 4294967295, but is -1");
    EXPECT_EQ(attempt(generated::Type::int32, 0.5),
              "parameter 'p' must be a whole number from -2147483648 to 2147483647, but is 0.5");
    EXPECT_EQ(attempt(generated::Type::boolean, 2), "parameter 'p' must be 0 or 1, but is 2");
    EXPECT_EQ(attempt(generated::Type::boolean, 1), "");
    EXPECT_EQ(attempt(generated::Type::float64, 0.0 / 0.0), "parameter 'p' must be a number, but is NaN");
    EXPECT_EQ(attempt(generated::Type::float32, HUGE_VAL), "");
}

} // namespace
} // namespace bf::codegen::test

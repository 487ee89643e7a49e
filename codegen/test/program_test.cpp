// What a generated program does as a process: options, parameter files, inputs, commands, ends.
#include "cases.hpp"
#include "program.hpp"

#include "bf/codegen/parameter_file.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/builder.hpp"

#include <random>

namespace bf::codegen::test {
namespace {

/// A model from text that records what it says.
struct Loaded {
    explicit Loaded(const std::string& text) {
        registry.add(standard_library());
        diagram = elaborate(formats::read_yaml_text(text, "m.yaml"), registry);
    }
    Registry registry;
    Diagram diagram;
};

TEST(GeneratedProgram, SubtractsTruthValuesOfVariablesFromZero) {
    const Loaded model(
        "model: zeros\nstep: 1\nstop: 1\nvariables: {w: 9}\nblocks:\n  c: {block: Constant, value: "
        "\"[atan2(0 - (w > 5), -1), atan2(0 - (w > 5 && w < 7), -1)]\"}\n");
    const Program program(model.diagram);
    ASSERT_EQ(program.compiled, 0);
    write_text(program.folder.path / "p.yaml", "w: 1\n");
    ASSERT_EQ(program("--params p.yaml --csv out.csv"), 0) << program.text("errors.txt");
    const std::string csv = program.text("out.csv");
    EXPECT_NE(csv.find("3.1415926535897931,3.1415926535897931"), std::string::npos) << csv; // atan2(0, -1)
    EXPECT_EQ(csv.find("-3.14"), std::string::npos) << csv;
}

TEST(GeneratedProgram, TakesAllParametersOfAFileOrNone) {
    model::Builder m("two gains");
    m.step(0.1).stop(0.2);
    m.add("one", "Constant", {{"value", "[1 2]"}});
    m.add("K", "Gain", {{"K", 3}});
    m.add("matrix", "Constant", {{"value", "[1 2; 3 4]"}});
    m.connect(model::End{"one"}, model::End{"K"});
    m.record({"K.y"});
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram = elaborate(m.build(), registry);
    const Program program(diagram);
    ASSERT_EQ(program.compiled, 0);
    const auto run = [&](const std::string& parameters) {
        write_text(program.folder.path / "p.yaml", parameters);
        return program.text(program("--params p.yaml --csv out.csv") == 0 ? "out.csv" : "errors.txt");
    };
    EXPECT_EQ(run(""), "time,\"K.y[1]\",\"K.y[2]\"\n0,3,6\n0.10000000000000001,3,6\n");
    const std::string changed = "time,\"K.y[1]\",\"K.y[2]\"\n0,-2,-2.5\n0.10000000000000001,-2,-2.5\n";
    EXPECT_EQ(run("# a comment\none.value: [4, 5] # constants follow\nK.K: -0.5\n"), changed);
    EXPECT_EQ(run("---\none:\n  value:\n  - 4\n  - 5\n\nK:\n    # deeper\n    K: -0.5\n"), changed);
    EXPECT_EQ(run("\xEF\xBB\xBFone.value: [4, 5]\nK.K: -0.5\n"), changed);
    EXPECT_EQ(run("{one: {value: [4,\n   5]}, 'K': {K: -5e-1}}\n"), changed);
    EXPECT_EQ(run("one: {value: \"[4 5]\"}\nK: {K: -.5}\n"), changed);
    EXPECT_EQ(run("one.value: [1, 2, 3]\nK.k: 1\nK.K: nan\nK.K 1\nmatrix.value: [[1, 2], [3]]\nstep: "
                  "1\n"),
              "p.yaml:4: write name: value, not 'K.K 1'\n"
              "p.yaml:5: the rows of 'matrix.value' differ in length\n"
              "p.yaml:1: 'one.value': wrong number of elements (it has 2x1, the file gives 1x3)\n"
              "p.yaml:2: there is no parameter or variable 'K.k'; --list names all\n"
              "p.yaml:3: parameter 'K.K' must be a number, but is NaN\n"
              "p.yaml:6: 'step' cannot change: it is the period of the generated code\n");
    EXPECT_EQ(run("K.K: 2*pi\n"), "p.yaml:1: 'K.K': '2*pi' is no number; a generated program computes no "
                                  "expressions, write the value\n");
    ASSERT_EQ(program("--list"), 0);
    EXPECT_EQ(
        program.text("out.txt"),
        "one.value: [1, 2]  # 2x1 the constant; its type is that of y\nK.K: 3  # 1x1 factor\n"
        "matrix.value: [[1, 2], [3, 4]]  # 2x2 the constant; its type is that of y\n# step is fixed: it "
        "is the period of the generated code\n# stop is fixed: give it as --stop\n");

    // Vectors may be rows or columns; a matrix has its shape.
    EXPECT_EQ(run("one.value: [[4, 5]]\nK.K: -0.5\n"), changed);
    EXPECT_EQ(run("one.value: [[4], [5]]\nK.K: -0.5\n"), changed);
    EXPECT_EQ(run("matrix.value: [[5, 6], [7, 8]]\n").substr(0, 4), "time");
    EXPECT_EQ(run("matrix.value: 1\n").substr(0, 4), "time");
    for (const std::string four : {"[[1, 2, 3, 4]]", "[1, 2, 3, 4]", "[[1], [2], [3], [4]]"})
        EXPECT_EQ(run("matrix.value: " + four + "\n").substr(0, 40),
                  "p.yaml:1: 'matrix.value': wrong shape (i");
    EXPECT_EQ(run("K.K: 1\none:\n  value: 2\nK:\n  K: 2\n"),
              "p.yaml:5: a second 'K.K'; remove or rename one; the first is at p.yaml:1\n");
    EXPECT_EQ(run("{K.K: 1, K.K: 1}\n"),
              "p.yaml:1: a second 'K.K'; remove or rename one; the first is at p.yaml:1\n");
    EXPECT_EQ(
        run("K.K:\none.value:\n  - 1\nK:\n  K: # nothing\n"),
        "p.yaml:1: 'K.K' has no value; write name: value\np.yaml:5: a second 'K.K'; remove or rename one; "
        "the first is at p.yaml:1\n");
    EXPECT_EQ(run("{K.K: , one.value: }\n"), "p.yaml:1: 'K.K' has no value; write name: value\n"
                                             "p.yaml:1: 'one.value' has no value; write name: value\n");

    EXPECT_EQ(program("--realtime --priority 0"), 0);
    EXPECT_NE(program.text("out.txt").find("period of 100000 us, 2 steps"), std::string::npos);
    EXPECT_EQ(program("--help"), 0);
    // What both refuse, `bf run` and generated programs.
    write_text(program.folder.path / "m.yaml",
               "model: m\nstep: 0.1\nstop: 0.2\nblocks: {c: {block: Clock}}\nrecord: [c.y]\n");
    const auto command = [&](const std::string& options) {
        return WEXITSTATUS(std::system(
            (program.at + BF_PROGRAM " run m.yaml --quiet " + options + " >out.txt 2>wrong.txt").c_str()));
    };
    for (const std::string paced :
         {"--overrun never", "--overrun catch_up", "--overrun", "--overrun ''", "--priority 100",
          "--priority -1", "--priority 1.5", "--priority x", "--cpu 0.5", "--cpu 1e300", "--cpu -1",
          "--watchdog x", "--watchdog nan", "--watchdog 1e10", "--watchdog 1e400", "--watchdog 0x1",
          "--watchdog ''"}) {
        EXPECT_EQ(program.code("--realtime " + paced), 2) << paced;
        EXPECT_EQ(command("--realtime " + paced), 2) << paced;
        EXPECT_EQ(program.code(paced), 2) << paced;
        EXPECT_EQ(command(paced), 2) << paced;
    }
    for (const std::string wrong :
         {"--stop", "--stop ''", "--inputs ''", "--params ''", "--what", "word", "--stop 1 --stop 2",
          "--priority 0", "--watchdog 1", "--cpu 0", "--overrun stop", "--token t"}) {
        EXPECT_EQ(program.code(wrong), 2) << wrong;
        EXPECT_EQ(command(wrong), 2) << wrong;
    }
    for (const std::string wrong : {"--stop -1", "--stop nan", "--stop 1e400", "--stop x", "--stop 1e300"}) {
        EXPECT_NE(program.code(wrong), 0) << wrong;
        EXPECT_NE(command(wrong), 0) << wrong;
    }
    EXPECT_EQ(program.code("--realtime --priority 100"), 2);
    EXPECT_EQ(
        program.text("errors.txt"),
        "program: --priority: Value 100 not in range [0 - 99] of whole numbers\nSee ./program --help\n");
    EXPECT_EQ(program.code("--csv ''"), 2);
    EXPECT_EQ(program.code("--realtime --realtime --priority 0"), 0) << "as the script of a package may say";
    EXPECT_EQ(run("K.K: 1e400\n"),
              "p.yaml:1: 'K.K': '1e400' is beyond the largest number, 1.8e308; write Inf for "
              "infinity; a generated program computes no expressions, write the value\n");
    EXPECT_EQ(run("K.K: -inf\none.value: [1d1, 0]\n").substr(0, 4), "time");
    EXPECT_EQ(program.code("--params p.yaml --csv ./p.yaml"), 1);
    EXPECT_EQ(program.text("errors.txt"),
              "program: --csv ./p.yaml is a file that is read; give another name\n");
    EXPECT_EQ(program("--csv /dev/full"), 256);
    EXPECT_EQ(program.text("errors.txt"),
              "program: cannot write /dev/full: No space left on device; free space, or "
              "write to another disk\n");
    EXPECT_EQ(std::system((program.at + "mkfifo pipe && ./program --csv pipe 2>errors.txt").c_str()), 256);
    EXPECT_EQ(program.text("errors.txt"),
              "program: cannot write pipe: no program reads this pipe; start one that "
              "does, or give a file\n");
    EXPECT_EQ(
        std::system((program.at + "bash -c 'trap \"\" XFSZ; ulimit -f 8; exec ./program --stop Inf --csv "
                                  "full.csv 2>errors.txt'")
                        .c_str()),
        256);
    EXPECT_NE(program.text("errors.txt").find(" s: cannot write full.csv: File too large; raise the limit"),
              std::string::npos)
        << program.text("errors.txt");
    EXPECT_EQ(program("--overrun catch-up --realtime --priority 0"), 0);
}

TEST(GeneratedProgram, EndsAsTheCommandDoes) {
    model::Builder m("runs on");
    m.step(0.01).stop(100);
    m.add("one", "Constant", {});
    m.add("x", "DiscreteIntegrator", {});
    m.connect(model::End{"one"}, model::End{"x"});
    m.record({"x.y"});
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram = elaborate(m.build(), registry);
    const Program program(diagram, "ends");
    ASSERT_EQ(program.compiled, 0);
    const auto shell = [&](const std::string& text) {
        const int status = std::system((program.at + text).c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    };
    const std::string endless = "./program --stop Inf ";
    for (const auto& [signal, code] : {std::pair("INT", 130), std::pair("TERM", 143), std::pair("HUP", 129)})
        for (const char* paced : {"--realtime --priority 0", ""}) {
            EXPECT_EQ(shell(endless + paced + " --csv out.csv >report.txt 2>errors.txt & sleep 0.3; kill -" +
                            signal + " $!; wait $!"),
                      code);
            EXPECT_NE(program.text("errors.txt").find("program: stopped at t = "), std::string::npos);
            EXPECT_NE(program.text("errors.txt").find(" s: interrupted\n"), std::string::npos);
            const std::string rows = program.text("out.csv");
            EXPECT_EQ(rows.back(), '\n') << "the last row is whole";
            EXPECT_NE(rows.find("\n0.01,0.01\n"), std::string::npos);
        }
    // A pause of the whole process is no hang.
    EXPECT_EQ(
        shell("./program --stop 1.5 --realtime --priority 0 --watchdog 0.3 >report.txt & sleep 0.7; kill "
              "-STOP $!; sleep 1; kill -CONT $!; wait $!"),
        0);
    model::Builder f("fast");
    f.step(1e-9).stop(1);
    f.add("t", "Clock", {});
    const Diagram fast = elaborate(f.build(), registry);
    const Program late(fast, "late");
    ASSERT_EQ(late.compiled, 0);
    EXPECT_EQ(late.code("--realtime --priority 0 --overrun stop"), 1);
    EXPECT_NE(late.text("errors.txt").find("program: stopped at t = 1e-09 s: step 0 missed its deadline by "),
              std::string::npos);
    EXPECT_NE(
        late.text("errors.txt").find("; choose another --overrun than stop, or give the step more time\n"),
        std::string::npos);
}

TEST(GeneratedProgram, AStepThatHangsEndsIt) {
    const Loaded model(R"m(model: hang
step: 0.01
stop: 5
blocks:
  outer:
    execution: for
    iterations: 100000
    outputs: [y]
    blocks:
      inner:
        execution: for
        iterations: 100000
        outputs: [y]
        blocks: {n: {block: Iteration}, m: {block: UnitDelay}, s: {block: Sum}}
        connections: {n: s.u1, m: s.u2, s: [m, y]}
    connections: {inner: y}
record: [outer.y]
)m");
    const Program program(model.diagram, "hang");
    ASSERT_EQ(program.compiled, 0);
    EXPECT_EQ(program.code("--realtime --priority 0 --watchdog 0.3"), 1);
    EXPECT_EQ(program.text("errors.txt"), "program: step 0 at t = 0 s has not ended for 0.3 s, so the "
                                          "program ends without stopping the blocks; "
                                          "look for a block that waits or never ends, or raise --watchdog\n");
    // The first signal asks for the end of the step, the second one does not.
    const int status =
        std::system((program.at + "./program 2>errors.txt & sleep 0.3; kill $!; sleep 0.2; kill $!; "
                                  "wait $!")
                        .c_str());
    EXPECT_EQ(WEXITSTATUS(status), 143);
}

TEST(GeneratedProgram, TakesInputsOfAFileAsTheEngineDoes) {
    const Loaded model(R"m(model: sums
step: 0.1
stop: 0.6
inputs: {u: {shape: 1}, x: {shape: 2}, M: {shape: "[2 2]"}, n: {shape: 1, type: int8}}
blocks:
  gu: {block: Gain}
  gx: {block: Gain}
  gM: {block: Gain}
  gn: {block: Gain}
connections: {u: gu, x: gx, M: gM, n: gn}
record: [gu.y, gx.y, gM.y, gn.y]
)m");
    const Program program(model.diagram, "inputs");
    ASSERT_EQ(program.compiled, 0);
    write_text(program.folder.path / "in.csv",
               "time,\"u (V)\",x[2],\"M[1][2]\",n\r\n0.1,1,2,3,4\r\n0.30000000000000004,-1.5,0,0,-128\r\n"
               "0.4,7,7,7,7\r\n0.4,inf,1e-3,+2,0\r\n9,1,1,1,1\r\n");
    ASSERT_EQ(program("--inputs in.csv --csv out.csv"), 0) << program.text("errors.txt");
    const std::string rows = program.text("out.csv");
    EXPECT_EQ(rows.substr(rows.find('\n') + 1), "0,0,0,0,0,0,0,0,0\n"
                                                "0.10000000000000001,1,0,2,0,0,3,0,4\n"
                                                "0.20000000000000001,1,0,2,0,0,3,0,4\n"
                                                "0.30000000000000004,-1.5,0,0,0,0,0,0,-128\n"
                                                "0.40000000000000002,inf,0,0.001,0,0,2,0,0\n"
                                                "0.5,inf,0,0.001,0,0,2,0,0\n");
    write_text(program.folder.path / "in.csv", "time,v\n0,1\n");
    EXPECT_EQ(program.code("--inputs in.csv"), 1);
    EXPECT_EQ(program.text("errors.txt"),
              "program: in.csv:1: the model has no input 'v'; it has u, x, M, n, with "
              "elements as x[1], M[1][2], counted from 1\n");
    write_text(program.folder.path / "in.csv", "time,u\n0,\"1\n");
    EXPECT_EQ(program.code("--inputs in.csv"), 1);
    EXPECT_EQ(program.text("errors.txt"), "program: in.csv:2: a quote does not end on its line\n");
    std::filesystem::remove(program.folder.path / "out.csv");
    EXPECT_EQ(std::system((program.at + "./program --csv out.csv --stop x 0>&- 1>&- 2>&-").c_str()), 512);
    EXPECT_EQ(std::system((program.at + "./program --csv out.csv --time 0>&- 1>&- 2>&-").c_str()), 0);
    EXPECT_EQ(program.text("out.csv").substr(0, 5), "time,") << "and nothing else";
    EXPECT_EQ(program.text("out.csv").find("per step"), std::string::npos);
}

TEST(GeneratedProgram, ATcpPortAsksForItsToken) {
    const Loaded model("model: tcp\nstep: 0.01\nstop: 1\nvariables: {a: 2}\nblocks:\n"
                       "  c: {block: Constant, value: a}\n");
    const Program program(model.diagram, "tcp");
    ASSERT_EQ(program.compiled, 0);
    write_text(program.folder.path / "client.py", R"py(
import os, re, signal, socket, subprocess
def start(*options, **environment):
    return subprocess.Popen(["./program", "--realtime", "--stop", "Inf", "--priority", "0", *options], text=True,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={**os.environ, **environment})
def end(program):
    program.terminate()
    assert program.wait(20) == 143
def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=20).makefile("rw")
def ask(lines, line):
    lines.write(line + "\n")
    lines.flush()
    return lines.readline().strip()

program = start("--command-port", "0")
port, token = re.search(r"at 127\.0\.0\.1:(\d+) after the line: token (\w{32})$", program.stderr.readline()).groups()
idle = [connect(port) for _ in range(50)]  # who has not told the token gives way
for wrong in "", "a: 3", "?", "token", "token " + token[:-1], "token " + token + "0", "GET / HTTP/1.1":
    lines = connect(port)
    assert ask(lines, wrong).startswith("error: the first line is 'token TOKEN'"), wrong
    assert lines.readline() == ""
lines = connect(port)
assert ask(lines, "token " + token) == "ok"
assert ask(lines, "a: 3") == "ok"
end(program)

program = start("--command-port", "0", "--token", "secret")
text = program.stderr.readline()
token = open("secret").read().strip()
assert token not in text and "and the line in secret" in text, text
assert os.stat("secret").st_mode & 0o777 == 0o600
lines = connect(re.search(r":(\d+) ", text)[1])
assert ask(lines, "token " + token) == "ok"
end(program)

folder = os.path.abspath("run")
os.mkdir(folder)
for killed in True, False:
    program = start("--command-port", XDG_RUNTIME_DIR=folder)
    assert program.stderr.readline() == f"takes commands at {folder}/program.sock\n"
    second = start("--command-port", XDG_RUNTIME_DIR=folder)
    assert "Address already in use; give the path of another socket" in second.stderr.read()
    assert second.wait(20) == 1
    if killed:  # and its socket stays behind
        program.kill()
        program.wait(20)
    else:
        end(program)
    assert os.path.exists(folder + "/program.sock") == killed
open("file", "w").close()
program = start("--command-port", "file")
assert "Address already in use" in program.stderr.read() and os.path.exists("file")
program = start("--command-port", XDG_RUNTIME_DIR="")
assert "there is no XDG_RUNTIME_DIR; give the path of a socket" in program.stderr.read()
program = start("--command-port", "x" * 200)
assert "File name too long; give the path of another socket" in program.stderr.read()
program = start("--command-port", "70000")
assert "port 70000: it is above 65535" in program.stderr.read()
)py");
    EXPECT_EQ(std::system((program.at + "timeout 120 python3 client.py").c_str()), 0);
}

TEST(GeneratedProgram, ReadsAndWritesNumbersAlikeInEveryLocale) {
    const Loaded model("model: german\nstep: 0.5\nstop: 1\ninputs: {u: {shape: 1}}\n"
                       "blocks:\n  K: {block: Gain, K: 2}\nconnections: {u: K}\n"
                       "record: [K.y]\n");
    Program program(model.diagram, "german",
                    "#include <clocale>\n#include <cstdlib>\nstatic const bool is_german = "
                    "std::setlocale(LC_ALL, \"de_DE.UTF-8\") || (std::abort(), false);\n"
                    "extern const bool* used;\nconst bool* used = &is_german;\n");
    ASSERT_EQ(program.compiled, 0);
    if (std::system((program.at + "localedef -i de_DE -f UTF-8 ./de_DE.UTF-8 2>/dev/null").c_str()) != 0)
        GTEST_SKIP() << "the locale de_DE.UTF-8 cannot be made here";
    program.at += "export LOCPATH=. && ";
    write_text(program.folder.path / "in.csv", "time,u\n0,0.25\n0.5,1.5\n");
    write_text(program.folder.path / "p.yaml", "K.K: 0.25\n");
    ASSERT_EQ(program("--params p.yaml --inputs in.csv --csv out.csv --stop 1.0"), 0)
        << program.text("errors.txt");
    EXPECT_EQ(program.text("out.csv"), "time,\"K.y\"\n0,0.0625\n0.5,0.375\n");
    ASSERT_EQ(program("--params p.yaml --list"), 0);
    EXPECT_EQ(program.text("out.txt").substr(0, 9), "K.K: 0.25");
    write_text(program.folder.path / "p.yaml", "K.K: '0,25'\n");
    EXPECT_EQ(program.code("--params p.yaml"), 1);
    EXPECT_EQ(program.text("errors.txt").substr(0, 36), "p.yaml:1: 'K.K': '0,25' is no number");
}

TEST(ParameterFile, NamesAreListedAsTheyAreReadEverywhere) {
    for (const std::string name :
         {"a.K",    "[q.K", "\"c\"d.K", "'.K",  "it's: x.K", "{a}.K", "# b.K",  "a #b.K", "-.K",
          "- a.K",  "1.K",  "true",     "null", "NULL",      "~.K",   "a, b.K", "ü.K",    "\\.K",
          "a: b.K", "?.K",  "!x.K",     "&x.K", "%x.K",      "@.K",   "`.K",    "|.K"}) {
        const double value = 3;
        const generated::Quantity q{name.c_str(), "", "", {}, {}, 1, 1, 0, -1};
        const std::string line = generated::line_of(q, [&](int) { return value; });
        for (const std::string& text : {line, "{" + line.substr(0, line.find("  #")) + "}\n"}) {
            const auto read = generated::parse_parameters(text, "f");
            ASSERT_EQ(read.entries.size(), 1u) << text << read.errors;
            EXPECT_EQ(read.entries[0].name, name);
            const auto variables = formats::read_yaml_variables(text, "f");
            ASSERT_EQ(variables.size(), 1u) << text;
            EXPECT_EQ(variables[0].name, name);
        }
    }
}

TEST(ParameterFile, IndentationSaysWhatANameBelongsTo) {
    const auto errors = [](const std::string& text) { return generated::parse_parameters(text, "f").errors; };
    EXPECT_EQ(errors("a:\n  b: 1\n  c:\n     d: 2\n  e: 3\nf: 4\n"), "");
    EXPECT_EQ(errors("a:\n  b: 1\n c: 2\n"), "f:3: 'c: 2' is indented by 1, its neighbours by 2\n");
    EXPECT_EQ(errors("a: 1\n  b: 2\n"), "f:2: 'b: 2' is indented by 2, its neighbours by 0\n");
}

TEST(ParameterFile, AnyTextIsReadOrRefused) {
    std::mt19937 random(1);
    const std::string alphabet = "ab.:{}[],;'\"# \n\t-1e0\r|&*";
    std::size_t entries = 0;
    for (int i = 0; i < 20000; ++i) {
        std::string text;
        for (auto length = random() % 40; length > 0; --length) text += alphabet[random() % alphabet.size()];
        for (const auto& entry : generated::parse_parameters(text, "f").entries) {
            EXPECT_EQ(entry.items.size(), static_cast<std::size_t>(entry.rows * entry.cols)) << text;
            ++entries;
        }
    }
    EXPECT_GT(entries, 100u);
    std::string deep;
    for (int i = 0; i < 30000; ++i) deep += "{a: ";
    EXPECT_EQ(generated::parse_parameters(deep + std::string(30000, '}'), "f").errors,
              "f:1: the names are nested too deeply\n");
}

} // namespace
} // namespace bf::codegen::test

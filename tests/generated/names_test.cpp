// Whatever a model and its parts are called, generated code compiles in every language and says it as text.
#include "bf/base/escape.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/codegen/generate.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <unistd.h>

namespace bf::codegen {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> hostile = {
    "plain",
    "",
    "x\"\"\"; import os; os._exit(3) #",
    "'''; import os; os._exit(3) #",
    "*/ int injected; /*",
    "// \\",
    "a\nint injected;\n#error injected\nimport injected",
    "a\r#error injected",
    "?\?/",
    "?\?/\n#error injected",
    "ends with a backslash \\",
    "@set_folder@ @structures@ @binds@ @Class@",
    "${injected} $ENV{PATH} $(injected) `injected`",
    "]] ) message(FATAL_ERROR injected)",
    "<script>alert(1)</script> [x](y) # z",
    "größer 机器人 🤖",
    "\u202e reversed \u2066",
    "\u2028 breaks \u0085",
    "\x1b[2J",
    std::string(3000, 'x'),
    "9 lives",
};

/// Names that other things have in C, C++, Python, CMake or in generated code.
const std::vector<std::string> taken = {
    "FILE",  "DIR",     "Real",     "real",    "EOF",      "NULL",   "M_PI",    "linux",      "SIGINT",
    "class", "typeof",  "restrict", "lambda",  "None",     "True",   "is",      "ValueError", "value_error",
    "timer", "sem",     "si",       "pthread", "thrd",     "posix",  "ctypes",  "struct",     "keyword",
    "os",    "pathlib", "random",   "Inputs",  "Signals",  "Type",   "Where",   "Quantity",   "NewValue",
    "main",  "std",     "bf",       "test",    "all",      "clean",  "install", "CMakeLists", "README",
    "c",     "m",       "string",   "stdint",  "INT8_MAX", "assert", "errno",   "int8_t",     "kernels"};

/// A JSON string is one of YAML between double quotes.
std::string in_quotes(const std::string& text) { return escape::python(text); }

struct Elaborated {
    std::unique_ptr<Registry> registry = std::make_unique<Registry>();
    Diagram diagram;
    explicit Elaborated(const std::string& text) {
        registry->add(standard_library());
        diagram = elaborate(formats::read_yaml_text(text, "model.yaml"), *registry);
    }
};

std::string small_model(const std::string& name) {
    return "model: " + in_quotes(name) +
           "\nstep: 0.1\nvariables: {k: 2}\ninputs: {u: {doc: " + in_quotes(name) +
           "}}\noutputs: [y]\nblocks: {g: {block: Gain, K: k}}\nconnections: {u: g, g: y}\n";
}

class Names : public testing::Test {
  protected:
    Names() {
        std::string pattern = fs::temp_directory_path() / "bf_names_XXXXXX";
        at = ::mkdtemp(pattern.data());
    }
    ~Names() override { fs::remove_all(at); }

    void put(const std::string& name, const std::string& text) const {
        fs::create_directories((at / name).parent_path());
        std::ofstream(at / name, std::ios::binary) << text;
    }
    std::string log() const {
        std::ostringstream text;
        text << std::ifstream(at / "log").rdbuf();
        return text.str().substr(0, 5000);
    }
    bool succeeds(const std::string& command) const {
        return std::system(("cd '" + at.string() + "' && { " + command + "; } >log 2>&1").c_str()) == 0;
    }
    /// Source that includes all files of a kind.
    std::string include_all(const std::string& ending) const {
        std::string text;
        for (const auto& [name, files] : projects)
            for (const auto& [file, content] : files)
                if (file.ends_with(ending) && file.find('/') == std::string::npos)
                    text += "#define main main_" + name + "\n#define bf_run_v1 run_" + name +
                            "\n#include \"" + name + "/" + file + "\"\n#undef main\n#undef bf_run_v1\n";
        return text;
    }
    /// A project of its own for each model; of those that give the same names to their files one.
    void generate_all(const Options& options) {
        std::set<std::string> classes;
        for (const auto* list : {&hostile, &taken})
            for (const auto& name : *list) {
                const Elaborated model(small_model(name));
                if (!classes.insert(class_name(model.diagram)).second ||
                    !classes.insert(file_name(model.diagram)).second)
                    continue;
                names.push_back(name);
                const std::string folder = "p" + std::to_string(projects.size());
                projects.emplace_back(folder, generate(model.diagram, options));
                for (const auto& [file, text] : projects.back().second) put(folder + "/" + file, text);
                modules.push_back(file_name(model.diagram));
            }
    }

    Registry registry;
    fs::path at;
    std::vector<std::string> names, modules;
    std::vector<std::pair<std::string, Files>> projects;
};

const std::string warnings = " -Wall -Wextra -Wtrigraphs -Werror ";

TEST_F(Names, OfModelsCompileInCppAndC) {
    generate_all({});
    put("all.cpp", include_all(".cpp"));
    EXPECT_TRUE(succeeds(BF_CXX " -std=c++17 -fsyntax-only -Ip0/include" + warnings + "all.cpp")) << log();
    put("all.c", include_all("_c.h"));
    EXPECT_TRUE(succeeds(BF_CC " -std=gnu17 -fsyntax-only" + warnings + "all.c")) << log();
    EXPECT_TRUE(succeeds(BF_CC " -std=c11 -fsyntax-only" + warnings + "all.c")) << log();
}

TEST_F(Names, OfModelsCompileAsPlainC) {
    generate_all({.language = Language::c});
    put("all.c", include_all(".c"));
    EXPECT_TRUE(succeeds(BF_CC " -std=c11 -fsyntax-only -Wpedantic" + warnings + "all.c")) << log();
}

TEST_F(Names, OfModelsCompileForMicrocontrollers) {
    generate_all({.embedded = true});
    put("all.cpp", include_all(".cpp"));
    const std::string flags =
        " -std=c++17 -fno-exceptions -fno-rtti -fsyntax-only -Ip0/include" + warnings + "all.cpp";
    EXPECT_TRUE(succeeds(BF_CXX + flags)) << log();
    for (const char* compiler : {"arm-none-eabi-g++", "aarch64-linux-gnu-g++"})
        if (succeeds(std::string("command -v ") + compiler)) {
            EXPECT_TRUE(succeeds(compiler + flags)) << log();
        }
}

TEST_F(Names, OfModelsAreTextInPython) {
    generate_all({});
    std::string docs;
    for (std::size_t i = 0; i < projects.size(); ++i)
        docs += "(" + in_quotes("p" + std::to_string(i) + "/" + modules[i] + ".py") + ", " +
                in_quotes(modules[i]) + ", " + in_quotes(names[i]) + "),\n";
    // The first module shows what statements there are; a name that became code would be one more.
    put("look.py", "import ast, keyword, sys\nshape = None\nfor file, name, title in [\n" + docs + R"(]:
    tree = ast.parse(open(file, encoding="utf-8").read())
    assert ast.get_docstring(tree, clean=False).startswith(title + ", a model"), file
    kinds = [type(node).__name__ for node in ast.walk(tree)]
    shape = shape or kinds
    assert kinds == shape, file
    assert name.isidentifier() and not keyword.iskeyword(name), name
    assert name not in sys.stdlib_module_names, name
)");
    EXPECT_TRUE(succeeds(BF_PYTHON " look.py")) << log();
}

TEST_F(Names, OfModelsConfigureInCMake) {
    for (const Language language : {Language::cpp, Language::c}) {
        projects.clear();
        generate_all({.language = language});
        std::string lists = "cmake_minimum_required(VERSION 3.16)\nproject(names LANGUAGES C CXX)\n";
        for (const auto& [folder, files] : projects) lists += "add_subdirectory(" + folder + ")\n";
        put("CMakeLists.txt", lists);
        EXPECT_TRUE(succeeds("cmake -S . -B build -DCMAKE_CXX_COMPILER=" BF_CXX " -DCMAKE_C_COMPILER=" BF_CC))
            << log();
        EXPECT_EQ(log().find("injected"), std::string::npos) << log();
    }
}

/// What a block's name may be made of.
std::string block_name(const std::string& text) {
    std::string name;
    for (const char c : text.substr(0, 190))
        if (static_cast<unsigned char>(c) >= 32 && c != '.' && c != '*') name += c;
    while (name.ends_with(' ')) name.pop_back();
    while (name.starts_with(' ')) name.erase(0, 1);
    return name;
}

TEST_F(Names, OfPartsCompile) {
    // Blocks, ports and variables; titles, docs and units.
    std::string inputs, outputs, blocks, connections, variables;
    int count = 0;
    auto parts = taken;
    for (const auto& text : hostile) {
        const std::string name = block_name(text);
        if (!name.empty()) parts.push_back(name);
        inputs += "  " + in_quotes("doc " + std::to_string(count++)) + ": {doc: " + in_quotes(text) + "}\n";
    }
    for (const char* alike : {"a/b", "a_b", "a b", "a-b", "a__b", "_a_b_"}) parts.push_back(alike);
    count = 0;
    std::set<std::string> known{"M", "SIG", "si"}; // blocks below
    for (const auto& name : parts) {
        if (!known.insert(name).second) continue;
        const std::string block = in_quotes("block " + name);
        inputs += "  " + in_quotes(name) + ": {}\n";
        outputs += "  " + in_quotes("out " + name) + ": {}\n";
        blocks += "  " + block + ": {block: Gain, K: 2}\n";
        connections +=
            "  " + in_quotes(name) + ": " + block + "\n  " + block + ": " + in_quotes("out " + name) + "\n";
    }
    for (const auto& [name, text] :
         {std::pair("outer EOF", "EOF"), {"M", "PI"}, {"SIG", "INT"}, {"si", "value"}})
        blocks += "  " + std::string(name) + ": {inputs: [], outputs: [], blocks: {" + text +
                  ": {block: Constant}}}\n";
    // Every macro that the project's own headers bring along, as a variable.
    const Elaborated first(small_model("first"));
    for (const auto& [file, text] : generate(first.diagram)) put("first/" + file, text);
    ASSERT_TRUE(succeeds(BF_CXX " -std=gnu++17 -dM -E -Ifirst/include first/main.cpp -o macros && " BF_CC
                                " -std=gnu17 -dM -E -include stdlib.h first/first_c.h -o more"))
        << log();
    std::set<std::string> macros{"Inputs", "Variables", "Parameters"};
    for (const char* file : {"macros", "more"}) {
        std::ifstream lines(at / file);
        for (std::string word, line; lines >> word >> word && std::getline(lines, line);)
            if (word[0] != '_' && word.find('(') == std::string::npos) macros.insert(word);
    }
    EXPECT_GT(macros.size(), 500u);
    for (const auto& name : macros) variables += "  " + in_quotes(name) + ": 1\n";
    const Elaborated model("model: parts\nstep: 0.1\nvariables:\n" + variables + "inputs:\n" + inputs +
                           "outputs:\n" + outputs + "blocks:\n" + blocks + "connections:\n" + connections);
    for (const bool embedded : {false, true}) {
        const Files files = generate(model.diagram, {.embedded = embedded});
        std::string all;
        for (const auto& [file, text] : files) {
            put((embedded ? "e/" : "p/") + file, text);
            if (file.ends_with(".cpp")) all += "#include \"" + file + "\"\n";
        }
        put(embedded ? "e/all.cpp" : "p/all.cpp", all);
    }
    for (const auto& [file, text] : generate(model.diagram, {.language = Language::c}))
        put("c/" + file, text);
    EXPECT_TRUE(succeeds(BF_CC " -std=gnu17 -fsyntax-only -Ic" + warnings + "c/parts.c c/main.c")) << log();
    EXPECT_TRUE(succeeds(BF_CC " -std=c11 -fsyntax-only -Wpedantic -Ic" + warnings + "c/parts.c c/main.c"))
        << log();
    put("parts.c", "#include \"p/parts_c.h\"\n");
    EXPECT_TRUE(succeeds(BF_CXX " -std=gnu++17 -fsyntax-only -Ip/include -Ip" + warnings + "p/all.cpp"))
        << log();
    EXPECT_TRUE(succeeds(BF_CXX " -std=c++17 -fsyntax-only -Ie/include -Ie" + warnings + "e/all.cpp"))
        << log();
    EXPECT_TRUE(succeeds(BF_CC " -std=gnu17 -fsyntax-only" + warnings + "parts.c")) << log();
    EXPECT_TRUE(succeeds(BF_PYTHON " -m py_compile p/parts.py")) << log();
}

const std::string with_factory = std::string(BF_CXX) + " -std=c++20 -fsyntax-only -I" BF_EIGEN + [] {
    std::string folders;
    for (const char* room :
         {"base", "kernels", "core", "blocks", "model", "elaborate", "matlab", "program", "formats/yaml"})
        folders += std::string(" -I" BF_SOURCE_DIRECTORY "/") + room + "/include";
    return folders;
}() + warnings;

TEST_F(Names, OfBlocksOfTheFactoryAndTheirFilesCompile) {
    std::string blocks;
    std::set<std::string> known;
    for (const auto* list : {&hostile, &taken})
        for (const auto& text : *list) {
            const std::string name = block_name(text);
            if (name.empty() || !known.insert(name).second) continue;
            std::string file = text.substr(0, 200);
            std::erase(file, '/');
            while (file.starts_with(' ')) file.erase(0, 1); // of a setting's text this is no part
            if (file.empty()) continue;
            put(file, "0,0\n1,3\n");
            blocks += "  " + in_quotes(name) + ": {block: SignalFromFile, file: " + in_quotes(file) + "}\n";
        }
    registry.add(standard_library());
    const Diagram diagram = elaborate(
        formats::read_yaml_text("model: hosted\nstep: 0.1\nblocks:\n" + blocks, at / "model.yaml"), registry);
    for (const auto& [file, text] : generate(diagram, {.folder = at})) put("h/" + file, text);
    EXPECT_TRUE(succeeds(with_factory + " -Ih/include h/hosted_hosted.cpp")) << log();
}

TEST_F(Names, OfFilesAndChangesAreTextInProgramsOfAnySize) {
    std::string text = small_model("any");
    Options options{.has_runtime_sizes = true, .model_file = "model.yaml"};
    for (const auto* list : {&hostile, &taken})
        for (const auto& name : *list) {
            text += "# " + escape::comment(name) + "\n";
            options.texts["files/" + name] = name;
            options.overrides.emplace_back(name, name);
        }
    options.texts["model.yaml"] = text;
    const Elaborated model(text);
    for (const auto& [file, content] : generate(model.diagram, options)) put("any/" + file, content);
    EXPECT_TRUE(succeeds(with_factory + " -Iany/include any/any_hosted.cpp")) << log();
}

} // namespace
} // namespace bf::codegen

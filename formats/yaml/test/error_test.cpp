#include "bf/formats/yaml.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <unistd.h>

namespace bf::formats {
namespace {

/// What the reader says about `text`, or "accepted".
std::string errors_of(const std::string& text) {
    try {
        read_yaml_text(text, "m.yaml");
        return "accepted";
    } catch (const model::Errors& errors) {
        return errors.what();
    }
}

std::string errors_of_blocks(const std::string& blocks) { return errors_of("model: m\nblocks:\n" + blocks); }

TEST(Errors, OfAFileAreCollectedInItsOrder) {
    EXPECT_EQ(errors_of("model: m\n"
                        "stpo: 20\n"
                        "blocks:\n"
                        "  a: {blok: Gain}\n"
                        "  b: {block: Gain, K: }\n"
                        "  b: {block: Sum}\n"
                        "  c:\n"
                        "    blocks:\n"
                        "      d: 3\n"
                        "    priod: 1\n"
                        "connections:\n"
                        "  a: e\n"
                        "  c: b\n"),
              "m.yaml:2:1: unknown key 'stpo' of a model; did you mean 'stop'?\n"
              "m.yaml:4:3: a: a block has exactly one of `block: TYPE`, `blocks:` and `file:`; did you mean "
              "'block'?\n"
              "m.yaml:5:20: b: 'K' has no value; give it one, or remove the key\n"
              "m.yaml:6:3: a second 'b'; remove or rename one; the first is at m.yaml:5:3\n"
              "m.yaml:9:7: c.d: a block has exactly one of `block: TYPE`, `blocks:` and `file:`; say which "
              "it is: of a "
              "library, a subsystem, or in a file of its own\n"
              "m.yaml:10:5: c: unknown key 'priod' of a subsystem; did you mean 'period'?\n"
              "m.yaml:12:6: there is no 'e' to connect; did you mean 'a' or 'b' or 'c'?\n"
              "m.yaml:13:3: subsystem 'c' has no output; declare it in the `outputs` of 'c'");
}

TEST(Errors, NameWhatAFileMustHave) {
    EXPECT_EQ(errors_of(""), "m.yaml:1:1: the file holds no model; begin with `model: NAME` and `blocks:`");
    EXPECT_EQ(errors_of("step: 1\n"), "m.yaml:1:1: the model has no name; begin the file with `model: NAME`");
    EXPECT_EQ(errors_of("- a\n"),
              "m.yaml:1:1: expected a model, a mapping; write `key: value` lines without '-'");
    EXPECT_EQ(errors_of("model:\n"), "m.yaml:1:1: 'model' is a text; write it on one line or after '|'");
    EXPECT_EQ(errors_of("model: m\nblocks: 3\n"),
              "m.yaml:2:9: expected blocks, a mapping; write `key: value` lines");
}

TEST(Errors, OfSyntaxAreLocatedAndAdvise) {
    EXPECT_EQ(errors_of("model: m\nblocks: {a: {block: Gain}\n"),
              "m.yaml:2:1: the YAML syntax is wrong: end of map flow not found; close the bracket or quote; "
              "inside [ ] "
              "and { } put expressions with ',' or brackets in double quotes");
    EXPECT_EQ(errors_of("model: m\ndoc: \"abc\n"),
              "m.yaml:2:6: a quote that is not closed; end the text with \"");
    EXPECT_EQ(errors_of("model: m\nstep: [1 2]*pi\n"),
              "m.yaml:2:12: the YAML syntax is wrong: end of map not found; check the indentation; put "
              "expressions with ': ', ' #' "
              "or a leading bracket in double quotes");
    EXPECT_EQ(errors_of("model: m\nblocks:\n\ta: {block: Gain}\n"),
              "m.yaml:3:1: a tab in the indentation; indent by blanks");
    EXPECT_EQ(errors_of("model: \xff\n"),
              "m.yaml:1:8: a byte that is no text in UTF-8; save the file as UTF-8, and "
              "write control characters as escapes in double quotes");
    EXPECT_EQ(errors_of("model: m\n---\nmodel: n\n"),
              "m.yaml:2:1: a second YAML document; a model file holds one document");
    EXPECT_EQ(errors_of(",model: m\n").substr(0, 61),
              "m.yaml:1:1: the YAML syntax is wrong: text outside of the map");
}

TEST(Errors, RefuseAnchorsAliasesAndTags) {
    EXPECT_EQ(errors_of("model: m\nstep: &a 1\nstop: *a\ndoc: !!str x\n"),
              "m.yaml:2:7: a YAML anchor; give the value a name in `variables` and use it in expressions\n"
              "m.yaml:3:7: a YAML alias; give the value a name in `variables` and use it in expressions\n"
              "m.yaml:4:6: the YAML tag 'tag:yaml.org,2002:str'; remove it: types follow from the blocks");
    std::string bomb = "model: m\na0: &a0 [x]\n";
    for (int i = 1; i < 40; ++i) {
        const std::string last = "*a" + std::to_string(i - 1), name = "a" + std::to_string(i);
        bomb += name + ": &" + name + " [" + last + ", " + last + "]\n";
    }
    EXPECT_EQ(errors_of(bomb).substr(0, 27), "m.yaml:2:5: a YAML anchor; ");
}

TEST(Errors, RefuseTooDeepNesting) {
    const std::string open(20000, '[');
    EXPECT_EQ(
        errors_of("model: m\nstep: " + open),
        "m.yaml:2:1: values are nested more than 500 deep; close brackets where they end, and put parts "
        "into files of their own");
    EXPECT_NE(
        errors_of("model: m\nstep: " + open + std::string(20000, ']') + "\n").find(" more than 500 deep"),
        std::string::npos);
    std::string deep = "model: m\nblocks:\n", indent = "  ";
    for (int level = 0; level < 110; ++level, indent += "  ")
        deep += indent + "s:\n" + indent + " blocks:\n", indent += " ";
    EXPECT_NE(
        errors_of(deep + indent + "g: {block: Gain}\n").find("subsystems are nested more than 100 deep"),
        std::string::npos);
}

TEST(Errors, NameTheKeysOfAVariableWithLimits) {
    EXPECT_EQ(errors_of("model: m\nvariables: {K: {value: 1, minimun: 0}}\n"),
              "m.yaml:2:27: unknown key 'minimun' of the variable 'K', which has a `value`; did you mean "
              "'minimum'?");
    EXPECT_EQ(errors_of("model: m\nvariables:\n  K:\n    value: 1\n    minimum:\n"),
              "m.yaml:5:5: 'minimum' has no value; give it one, or remove the key");
}

TEST(Errors, ExplainValuesThatYamlReadsOtherwise) {
    EXPECT_EQ(errors_of_blocks("  a: {block: Constant, value: zeros(3, 1), u: 2}\n"),
              "m.yaml:3:31: a: the ',' ends the value 'zeros(3'; put the expression in double quotes: "
              "\"zeros(3, 1)\"");
    EXPECT_EQ(
        errors_of_blocks("  a: {block: Gain, K: {p: 1}}\n"),
        "m.yaml:3:23: a: 'K' is an expression, not a mapping; put a struct in `variables` and name it here");
    EXPECT_EQ(errors_of_blocks("  a:\n    block: Gain\n    K: [1 2\n      3 4]\n"),
              "m.yaml:5:8: a: a line of the matrix ends without ',' or ';', after '[1 2'; end it with ';' "
              "for a new "
              "row or with ',' for the same row");
    EXPECT_EQ(errors_of_blocks("  a: {block: Gain, K: [[[1, 2]], [[3, 4]]]}\n"),
              "m.yaml:3:23: a: sequences nested more than twice; a matrix is a sequence of rows");
    EXPECT_EQ(errors_of_blocks("  a: {block: [Gain]}\n"),
              "m.yaml:3:14: a: 'block' is a text; write it on one line or after '|'");
    EXPECT_EQ(errors_of_blocks("  ~: {block: Gain}\n"),
              "m.yaml:3:3: a key that is no text; put the key in double quotes");
    EXPECT_EQ(errors_of_blocks("  a: {block: Gain, blocks: {}}\n").substr(0, 78),
              "m.yaml:3:3: a: a block has exactly one of `block: TYPE`, `blocks:` and `file:`");
    EXPECT_EQ(errors_of_blocks("  a: {block: Gain, with: {a: 1}}\n"),
              "m.yaml:3:26: a: 'with' is an expression, not a mapping; put a struct in `variables` and name "
              "it here");
}

TEST(Errors, NameTheChoicesOfAKey) {
    EXPECT_EQ(errors_of("model: m\nexecution: enable\nstates: []\n"),
              "m.yaml:2:12: 'execution' is 'enable'; it is one of: virtual, atomic, enabled, triggered, "
              "enabled_and_triggered, for, while, for_each\n"
              "m.yaml:3:9: 'states' is ''; it is one of: held, reset");
    EXPECT_EQ(errors_of("model: m\noutputs: {y: {when_disabled: on, shap: 3}}\n"),
              "m.yaml:2:30: 'when_disabled' is 'on'; it is one of: held, reset\n"
              "m.yaml:2:34: unknown key 'shap' of the port 'y'; did you mean 'shape'?");
    EXPECT_EQ(errors_of("model: m\nblocks:\n  s: {reset: level, blocks: {}}\n"),
              "m.yaml:3:14: s: 'reset' is 'level'; it is one of: rising, falling, either, level_hold");
}

TEST(Errors, OfConnectionsAndSignalsAreLocated) {
    EXPECT_EQ(
        errors_of("model: m\nblocks:\n  a: {block: Gain}\n  b: {block: Gain}\nconnections:\n  a.y.z: b\n"
                  "  a: [b, b]\n  a.q: [{}]\n  b:\nrecord: [a, c, [d]]\nplots: {P: e}\n"),
        "m.yaml:6:3: 'a.y.z' is no end of a connection; write `block.port`, or the name of a block, input or "
        "output of this subsystem\n"
        "m.yaml:7:10: 'b' is connected twice; an input has one source; the first is at m.yaml:7:7\n"
        "m.yaml:8:9: an end of a connection is no text; write `block.port`, or the name of a block, input or "
        "output of this subsystem\n"
        "m.yaml:9:3: 'b' is connected to nothing; name a destination, or remove the connection\n"
        "m.yaml:10:13: there is no signal 'c'; did you mean 'a' or 'b'?\n"
        "m.yaml:10:16: an entry of 'record' is no name; write a list of names: [first, second]\n"
        "m.yaml:11:12: there is no signal 'e'; did you mean 'a' or 'b'?");
}

/// A folder of model files that is gone after the test.
class Files : public testing::Test {
  protected:
    Files()
        : folder_(std::filesystem::path(testing::TempDir()) / ("bf_yaml_files_" + std::to_string(getpid()))) {
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    ~Files() override { std::filesystem::remove_all(folder_); }

    void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

    /// What the reader says about a file, with paths relative to the folder.
    std::string errors_of_file(const std::string& name) {
        try {
            read_yaml(folder_ / name);
            return "accepted";
        } catch (const model::Errors& errors) {
            std::string text = errors.what();
            const std::string prefix = folder_.string() + "/";
            for (std::size_t at = text.find(prefix); at != text.npos; at = text.find(prefix))
                text.erase(at, prefix.size());
            return text;
        }
    }

    std::filesystem::path folder_;
};

TEST_F(Files, ReferencesInARingAreRefused) {
    write("a.yaml", "model: a\nblocks:\n  b: {file: b.yaml}\n");
    write("b.yaml", "model: b\nblocks:\n  c: {file: ./c.yaml}\n");
    write("c.yaml", "model: c\nblocks:\n  a: {file: b.yaml}\n");
    EXPECT_EQ(errors_of_file("a.yaml"),
              "./c.yaml:3:13: a: the files refer to each other in a ring: b.yaml -> c.yaml "
              "-> b.yaml; remove one of these references");
}

TEST_F(Files, ThatAreMissingOrWrongAreReportedWithTheOthers) {
    write("a.yaml",
          "model: a\nblocks:\n  b: {file: b.yaml}\n  c: {file: none.yaml}\n  d: {block: Gain, K: }\n");
    write("b.yaml", "model: b\nsetp: 1\n");
    EXPECT_EQ(errors_of_file("a.yaml"),
              "b.yaml:2:1: unknown key 'setp' of a model; did you mean 'step'?\n"
              "a.yaml:4:13: c: there is no file 'none.yaml'; a path is relative to the file that names it\n"
              "a.yaml:5:20: d: 'K' has no value; give it one, or remove the key");
    EXPECT_EQ(errors_of_file("none.yaml"),
              "there is no file 'none.yaml'; a path is relative to the file that names it");
    EXPECT_NE(errors_of_file(".").find("cannot read '.': it is a folder; give the name of a file"),
              std::string::npos);
}

TEST_F(Files, UsedTwiceAreReadOnceAndOverriddenApart) {
    write("a.yaml",
          "model: a\nblocks:\n  b: {file: in.yaml, with: {k: 2}}\n  c: {file: in.yaml, with: {l: 3}}\n");
    write("in.yaml",
          "model: in\nvariables: {k: 1}\noutputs: [y]\nblocks: {s: {block: Step}}\nconnections: {s: y}\n");
    EXPECT_EQ(errors_of_file("a.yaml"),
              "a.yaml:4:29: c: 'in.yaml' has no variable 'l' to override; did you mean 'k'?");
    write("a.yaml", "model: a\nblocks:\n  b: {file: in.yaml, with: {k: 2}}\n  c: {file: in.yaml}\n");
    const model::Model model = read_yaml(folder_ / "a.yaml");
    EXPECT_EQ(model.root.blocks[0].reference->model, model.root.blocks[1].reference->model);
    EXPECT_EQ(model.root.blocks[0].content()->outputs.at(0).name, "y");
}

} // namespace
} // namespace bf::formats

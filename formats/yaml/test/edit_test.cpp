#include "../src/printer.hpp"
#include "bf/formats/yaml.hpp"

#include "bf/model/builder.hpp"
#include "bf/model/edit.hpp"
#include "changes.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace bf::formats {
namespace {

using namespace model;
using namespace model::operations;
using Path = std::filesystem::path;

std::string content_of_file(const Path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

/// The model files of the examples and of the tests.
std::vector<Path> model_files() {
    std::vector<Path> files;
    for (const char* folder :
         {"examples", "tests/models", "tests/generated", "tests/fuzz/found", "docs/start"})
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(Path(BF_SOURCE_DIRECTORY) / folder))
            if (entry.path().extension() == ".yaml" &&
                content_of_file(entry.path()).find("model:") != std::string::npos)
                files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

const std::string sample = "# A loop, spelt by hand.\n"
                           "model:   loop   # name\n"
                           "step: 1e-3\n"
                           "\n"
                           "variables: {k: 2, 'T':  3.0}\n"
                           "blocks:\n"
                           "    # the plant\n"
                           "    plant: { block: Gain,  K: [1,2;3, 4] }      # in metres\n"
                           "\n"
                           "    law:\n"
                           "      inputs: [e]   # error\n"
                           "      outputs: [u]\n"
                           "      blocks:\n"
                           "        'p': {block: Gain, K: k}\n"
                           "        code:\n"
                           "          block: Fcn\n"
                           "          expression: |  # kept\n"
                           "            u + 1\n"
                           "      connections: {e: p, p: u}\n"
                           "    \"sum\" : {block: Sum, signs: +-}\n"
                           "connections:\n"
                           "    sum: law\n"
                           "    law: plant\n"
                           "    plant:\n"
                           "    - sum.u2   # back\n"
                           "record: [plant, law.p, 'sum']\n"
                           "layout:\n"
                           "    blocks:\n"
                           "        plant:   {x: 1, y:  2}   # here\n"
                           "        law.p: {y: 3, x: 4}\n"
                           "# the end\n";

Lines changes(const Operation& operation, const std::string& text = sample) {
    return formats::changes(operation, text);
}

TEST(Edited, FilesThatDidNotChangeKeepTheirBytes) {
    EXPECT_GT(model_files().size(), 30u);
    for (const Path& file : model_files()) {
        EXPECT_EQ(write_yaml(read_yaml(file)), content_of_file(file)) << file;
        Model model = read_yaml(file);
        EXPECT_EQ(edited_yaml(model), content_of_file(file)) << file;
    }
}

TEST(Edited, AMoveOfOneBlockChangesOneLine) {
    EXPECT_EQ(changes(Move{"plant", {5, 6}}), (Lines{"-         plant:   {x: 1, y:  2}   # here",
                                                     "+         plant:   {x: 5, y:  6}   # here"}));
    EXPECT_EQ(changes(Move{"law.p", {5, 3}}),
              (Lines{"-         law.p: {y: 3, x: 4}", "+         law.p: {y: 3, x: 5}"}));
    EXPECT_EQ(changes(Move{"sum", {5, 6}}), (Lines{"+         sum: {x: 5, y: 6}"}));
    EXPECT_EQ(changes(Resize{"plant", Point{7, 8}}),
              (Lines{"-         plant:   {x: 1, y:  2}   # here",
                     "+         plant:   {x: 1, y:  2, width: 7, height: 8}   # here"}));
}

TEST(Edited, ARenameChangesTheLinesThatNameTheBlock) {
    EXPECT_EQ(changes(Rename{"plant", "robot"}),
              (Lines{"-     plant: { block: Gain,  K: [1,2;3, 4] }      # in metres",
                     "+     robot: { block: Gain,  K: [1,2;3, 4] }      # in metres", "-     law: plant",
                     "-     plant:", "+     law: robot", "+     robot:", "- record: [plant, law.p, 'sum']",
                     "+ record: [robot, law.p, 'sum']", "-         plant:   {x: 1, y:  2}   # here",
                     "+         robot:   {x: 1, y:  2}   # here"}));
    EXPECT_EQ(changes(Rename{"law.e", "error"}),
              (Lines{"-       inputs: [e]   # error", "+       inputs: [error]   # error",
                     "-       connections: {e: p, p: u}", "+       connections: {error: p, p: u}"}));
}

TEST(Edited, ValuesChangeInTheirPlace) {
    EXPECT_EQ(changes(Set{"law.p", "K", "f(a, b)"}),
              (Lines{"-         'p': {block: Gain, K: k}", "+         'p': {block: Gain, K: \"f(a, b)\"}"}));
    EXPECT_EQ(changes(Set{"law.p", "K"}),
              (Lines{"-         'p': {block: Gain, K: k}", "+         'p': {block: Gain}"}));
    EXPECT_EQ(changes(Set{"law.code", "expression", "u + 2\n"}),
              (Lines{"-             u + 1", "+             u + 2"}));
    EXPECT_EQ(changes(Set{"", "step", "0.01"}), (Lines{"- step: 1e-3", "+ step: 0.01"}));
    EXPECT_EQ(changes(Set{"", "stop", "10"}), (Lines{"+ stop: 10"}));
    EXPECT_EQ(changes(SetVariable{"", "k", Variable{.name = {}, .value = {.text = "5"}}}),
              (Lines{"- variables: {k: 2, 'T':  3.0}", "+ variables: {k: 5, 'T':  3.0}"}));
    EXPECT_EQ(changes(RenameVariable{"", "k", "gain"}),
              (Lines{"- variables: {k: 2, 'T':  3.0}", "+ variables: {gain: 2, 'T':  3.0}",
                     "-         'p': {block: Gain, K: k}", "+         'p': {block: Gain, K: gain}"}));
}

TEST(Edited, BlocksAndWiresComeAndGoInTheirLines) {
    Block gain{.name = "gain", .type = "Gain"};
    EXPECT_EQ(changes(Add{.system = "law", .block = gain}), (Lines{"+         gain: {block: Gain}"}));
    EXPECT_EQ(changes(Add{.system = "", .block = gain, .index = 0}), (Lines{"+     gain: {block: Gain}"}));
    EXPECT_EQ(changes(Connect{"", "law", "sum.u1"}),
              (Lines{"-     law: plant", "+     law: [plant, sum.u1]"}));
    EXPECT_EQ(changes(Connect{"law", "e", "code"}),
              (Lines{"-       connections: {e: p, p: u}", "+       connections: {e: [p, code], p: u}"}));
    EXPECT_EQ(changes(Remove{"sum"}), (Lines{"-     \"sum\" : {block: Sum, signs: +-}", "-     sum: law",
                                             "-     plant:", "-     - sum.u2   # back",
                                             "- record: [plant, law.p, 'sum']", "+ record: [plant, law.p]"}));
    EXPECT_EQ(changes(Reorder{"sum", 0}),
              (Lines{"+     \"sum\" : {block: Sum, signs: +-}", "-     \"sum\" : {block: Sum, signs: +-}"}));
}

TEST(Edited, NamesAndRecordsOfSignalsComeAndGoInTheirLines) {
    EXPECT_EQ(changes(NameSignal{"law", "p", "wanted"}), (Lines{"+       signals:", "+         wanted: p"}));
    EXPECT_EQ(changes(NameSignal{"", "law.u", "it's"}), (Lines{"+ signals:", "+   it's: law.u"}));
    const std::string named = sample.substr(0, sample.find("record")) +
                              "signals: # by name\n  wanted: law   # V\n  seen:  plant\nrecord: [wanted]\n";
    EXPECT_EQ(changes(Rename{"wanted", "u"}, named),
              (Lines{"-   wanted: law   # V", "+   u: law   # V", "- record: [wanted]", "+ record: [u]"}));
    EXPECT_EQ(changes(Remove{"seen"}, named), (Lines{"-   seen:  plant"}));
    EXPECT_EQ(changes(Record{"law.u"}),
              (Lines{"- record: [plant, law.p, 'sum']", "+ record: [plant, law.p, 'sum', law.u]"}));
    EXPECT_EQ(changes(Record{"law.p", false}),
              (Lines{"- record: [plant, law.p, 'sum']", "+ record: [plant, 'sum']"}));
    EXPECT_EQ(changes(Record{"law.u", true, "Voltage [V]"}),
              (Lines{"+ plots:", "+   \"Voltage [V]\": [law.u]"}));
}

TEST(Edited, GroupingShiftsTheLinesOfTheBlocks) {
    EXPECT_EQ(changes(Group{"", {"plant"}, "world"}),
              (Lines{"-     # the plant",
                     "-     plant: { block: Gain,  K: [1,2;3, 4] }      # in metres",
                     "+     world:",
                     "+       inputs: [u]",
                     "+       outputs: [y]",
                     "+       blocks:",
                     "+         # the plant",
                     "+         plant: { block: Gain,  K: [1,2;3, 4] }      # in metres",
                     "+       connections:",
                     "+         u: plant",
                     "+         plant: y   # back",
                     "-     law: plant",
                     "-     plant:",
                     "-     - sum.u2   # back",

                     "- record: [plant, law.p, 'sum']",
                     "+     law: world.u",
                     "+     world.y: sum.u2",
                     "+ record: [world.plant, law.p, 'sum']",
                     "-         plant:   {x: 1, y:  2}   # here",
                     "+         world.plant:   {x: 1, y:  2}   # here",
                     "+         world: {x: 1, y: 2}"}));
}

TEST(Edited, KeepsLineEndsAndByteOrderMarks) {
    const std::string text =
        "\xef\xbb\xbfmodel: m # one\r\nblocks:\r\n  a: {block: Gain}\r\n  b: {block: Gain}";
    Model model = read_yaml_text(text);
    EXPECT_EQ(write_yaml(model), text);
    edit(model, Rename{"a", "c"});
    EXPECT_EQ(write_yaml(model),
              "\xef\xbb\xbfmodel: m # one\r\nblocks:\r\n  c: {block: Gain}\r\n  b: {block: Gain}");
}

/// Picks operations at random; some are impossible.
class Monkey {
  public:
    explicit Monkey(unsigned seed) : random_(seed) {}

    std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
    template <typename Items> auto any(const Items& items) { return items[below(items.size())]; }

    Operation operation(const Model& model) {
        std::vector<std::string> blocks, systems{""}, ports, references;
        walk(model, [&](const std::string& path, const Block& block) {
            if (!find(const_cast<Model&>(model), path)) return; // in another file
            blocks.push_back(path);
            if (block.system) systems.push_back(path);
            if (block.reference) references.push_back(path);
        });
        const std::string system = any(systems);
        const System& in = system.empty() ? model.root : *find(model, system)->content();
        for (const auto* list : {&in.inputs, &in.outputs})
            for (const Port& port : *list)
                ports.push_back(system.empty() ? port.name : system + "." + port.name);
        if (blocks.empty()) return add(system);
        const std::string block = any(blocks), name = any(names_) + std::to_string(below(100));
        switch (below(26)) {
        case 0: return add(system);
        case 1: return Remove{block};
        case 2: return Rename{block, name};
        case 3: return Reorder{block, below(5)};
        case 4: {
            if (in.connections.empty()) return add(system);
            const Connection connection = any(in.connections);
            return Disconnect{.system = system, .to = any(connection.to).text()};
        }
        case 5:
        case 6: return connect(in, system);
        case 7: return Set{block, "doc", any(texts_)};
        case 8: {
            const Block& chosen = *find(model, block);
            if (!chosen.is_library_block()) return Set{block, "period", "0.5"};
            const bool is_new = chosen.settings.empty() || below(3) == 0;
            if (!is_new && below(3) == 0) return Set{block, any(chosen.settings).name};
            return Set{block, is_new ? name : any(chosen.settings).name, any(texts_)};
        }
        case 9:
            return AddPort{
                .system = system, .port = {.name = name, .unit = any(texts_)}, .is_output = below(2) == 0};
        case 10: return Move{block, {double(below(1000)), -0.5 * double(below(9))}};
        case 11: return Resize{block, Point{double(1 + below(9)), 2}};
        case 12: return below(2) == 0 ? Operation(Flip{block}) : Operation(Rotate{block});
        case 13: {
            if (in.connections.empty()) return add(system);
            const Connection connection = any(in.connections);
            const std::string wire = joined(system, any(connection.to).text());
            if (below(3) == 0) return Label{wire, below(2) == 0};
            return Bend{wire, {{1, 2}, {3, double(below(9))}}};
        }
        case 14: return Annotate{any(names_), Note{.name = {}, .text = any(texts_), .system = system}};
        case 15: {
            std::vector<std::string> some;
            for (const Block& each : in.blocks)
                if (below(2) == 0) some.push_back(each.name);
            return Group{system, some, name};
        }
        case 16: return Dissolve{any(systems)};
        case 17:
            return references.empty() ? Operation(Extract{any(systems), "parts/" + name + ".yaml"})
                                      : Operation(Inline{any(references)});
        case 18: return Record{block, below(2) == 0, below(2) == 0 ? "" : any(names_)};
        case 24: return NameSignal{system, split_last(block).second, name};
        case 25:
            return in.signals.empty() ? Operation(NameSignal{"", block, name})
                   : below(2) == 0    ? Operation(Remove{joined(system, any(in.signals).name)})
                                      : Operation(Rename{joined(system, any(in.signals).name), name});
        case 19: return Plot{any(names_), std::vector<std::string>{block, any(blocks)}};
        case 20:
            return SetVariable{system, name,
                               Variable{.name = {}, .value = {.text = any(texts_)}, .doc = any(texts_)}};
        case 21:
            if (in.variables.empty())
                return PlacePort{block, "u", below(3) > 0 ? std::optional(Side(below(4))) : std::nullopt};
            return RenameVariable{system, any(in.variables).name, name};
        case 22: return ports.empty() ? Operation(Flip{block}) : Operation(Remove{any(ports)});
        default: return ports.empty() ? Operation(Flip{block}) : Operation(Rename{any(ports), name});
        }
    }

  private:
    Operation add(const std::string& system) {
        Block block{.name = any(names_) + std::to_string(below(100))};
        if (below(4) == 0) {
            block.system = std::make_unique<System>();
            block.system->inputs.push_back({.name = "u"});
        } else {
            block.type = "Gain";
            for (std::size_t n = below(3); n > 0; --n) set(block, any(names_), any(texts_));
        }
        Add operation{.system = system, .block = std::move(block), .index = below(6)};
        if (below(2) == 0) operation.at = Point{1, 2};
        return operation;
    }
    Operation connect(const System& in, const std::string& system) {
        std::vector<std::string> from, to;
        for (const Port& port : in.inputs) from.push_back(port.name);
        for (const Port& port : in.outputs) to.push_back(port.name);
        for (const Block& block : in.blocks) {
            const System* content = block.content();
            from.push_back(block.name +
                           (content && !content->outputs.empty() ? "." + content->outputs[0].name : ""));
            to.push_back(block.name + "." +
                         (content && !content->inputs.empty() ? content->inputs[0].name : any(names_)));
        }
        if (from.empty() || to.empty()) return add(system);
        return Connect{system, any(from), any(to)};
    }

    std::mt19937 random_;
    const Lines names_{"a", "gain", "Left leg", "x", "it's", "q: r", "K", "#1"};
    const Lines texts_{"1",       "[1, 2; 3 4]", "2*pi",     "f(a, b)", "'text'", "one\ntwo", "a: b # c",
                       "[1;\n2]", "-",           "{1, 'b'}", "x'",      "true",   "~",        "\"q\""};
};

/// A long random edit of what was read from `text`, with every claim on the way.
void edit_at_random(const std::string& text, const std::string& name, unsigned seed, int steps) {
    Monkey monkey(seed);
    Model model = read_yaml_text(text, name);
    std::vector<Model> states{model};
    History history;
    for (int step = 0; step < steps && !testing::Test::HasFailure(); ++step) {
        const Operation operation = monkey.operation(model);
        const std::string json = to_json(operation);
        SCOPED_TRACE(name + ", seed " + std::to_string(seed) + ": " + json);
        const Operation read_back = operation_from_json(json);
        ASSERT_EQ(to_json(read_back), json);
        try {
            if (!history.edit(model, read_back)) {
                ASSERT_TRUE(model == states.back());
                continue;
            }
        } catch (const Errors& errors) {
            ASSERT_TRUE(model == states.back()) << "a refusal leaves the model as it was";
            ASSERT_FALSE(errors.diagnostics().empty());
            continue;
        }
        states.push_back(model);
        const auto edited = edited_yaml(model); // has been read again and compared
        ASSERT_TRUE(edited) << "written anew:\n" << canonical_yaml(model);
        if (monkey.below(4) == 0) { // some are taken back at once
            ASSERT_TRUE(history.undo(model));
            states.pop_back();
            ASSERT_TRUE(model == states.back());
            ASSERT_TRUE(edited_yaml(model));
        }
    }
    const std::string last = write_yaml(model);
    for (std::size_t i = states.size(); i-- > 1;) {
        ASSERT_TRUE(history.undo(model));
        ASSERT_TRUE(model == states[i - 1]);
    }
    ASSERT_EQ(write_yaml(model), text) << name << ", seed " << seed;
    for (std::size_t i = 1; i < states.size(); ++i) ASSERT_TRUE(history.redo(model) && model == states[i]);
    ASSERT_EQ(write_yaml(model), last);
}

TEST(Edited, RandomEditsOfAllFilesAreReadBackAndUndoneByteForByte) {
    unsigned seed = 1;
    for (const Path& file : model_files())
        for (int round = 0; round < 1; ++round)
            edit_at_random(content_of_file(file), file.string(), seed++, 25);
}

TEST(Edited, RandomEditsOfGeneratedModelsAreUndoneByteForByte) {
    for (unsigned seed = 1; seed <= 40 && !testing::Test::HasFailure(); ++seed) {
        Monkey monkey(seed);
        Model model{.name = "generated"};
        for (int step = 0; step < 40; ++step) try {
                edit(model, monkey.operation(model));
            } catch (const Errors&) {
            }
        std::erase_if(model.root.blocks, [](const Block& block) { return bool(block.reference); });
        model.root.connections.clear();
        model.record.clear();
        model.plots.clear();
        std::string text;
        try {
            text = canonical_yaml(model);
            read_yaml_text(text);
        } catch (const Errors&) {
            continue; // refers to a file that nobody has written
        }
        edit_at_random(text, "generated.yaml", seed, 25);
    }
    edit_at_random(sample, "sample.yaml", 1, 400);
}

TEST(Edited, RandomMovesAndRenamesChangeOnlyTheLinesThatNameTheBlock) {
    Monkey monkey(3);
    for (const Path& file : model_files()) {
        const std::string text = content_of_file(file);
        const Model model = read_yaml(file);
        std::vector<std::string> paths;
        Model own = model;
        walk(model, [&](const std::string& path, const Block&) {
            if (find(own, path)) paths.push_back(path);
        });
        for (const std::string& path : paths) {
            Model moved = model;
            edit(moved, Move{path, {1, 2}});
            Lines changed = difference_of(text, write_yaml(moved));
            EXPECT_LE(changed.size(), 3u) << path; // with `layout:` and `blocks:`, if there were none
            moved.source = std::make_shared<const std::string>(write_yaml(moved));
            moved = read_yaml_text(write_yaml(moved), file.string());
            const std::string placed = write_yaml(moved);
            edit(moved, Move{path, {3, 4}});
            EXPECT_EQ(difference_of(placed, write_yaml(moved)).size(), 2u) << file << path;
            Model renamed = model;
            edit(renamed, Rename{path, "renamed"});
            const std::string name = path.substr(path.rfind('.') + 1);
            for (const std::string& line : difference_of(text, write_yaml(renamed)))
                EXPECT_NE(line.find(line[0] == '-' ? name : "renamed"), std::string::npos) << file << line;
        }
    }
}

} // namespace
} // namespace bf::formats

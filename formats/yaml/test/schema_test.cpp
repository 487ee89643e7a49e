#include "../src/keys.hpp"
#include "bf/formats/yaml.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

namespace bf::formats {
namespace {

using nlohmann::json;

const std::filesystem::path schema_file = BF_SOURCE_DIRECTORY "/formats/yaml/model.schema.json";
const std::filesystem::path valid_folder = BF_SOURCE_DIRECTORY "/tests/models/yaml";

/// A document as editors see it: by yaml-cpp's own tree and YAML's types of plain scalars.
json to_json(const YAML::Node& node) {
    if (node.IsMap()) {
        json map = json::object();
        for (const auto& entry : node) map[entry.first.as<std::string>()] = to_json(entry.second);
        return map;
    }
    if (node.IsSequence()) {
        json list = json::array();
        for (const YAML::Node& item : node) list.push_back(to_json(item));
        return list;
    }
    if (node.IsNull()) return nullptr;
    if (node.Tag() == "!") return node.as<std::string>();
    bool truth = false;
    double number = 0;
    if (YAML::convert<bool>::decode(node, truth)) return truth;
    if (YAML::convert<double>::decode(node, number)) return number;
    return node.as<std::string>();
}

json schema() { return json::parse(std::ifstream(schema_file)); }

/// Per document, whether Python's jsonschema accepts it.
std::vector<bool> validate(const json& documents) {
    const std::filesystem::path work =
        std::filesystem::path(testing::TempDir()) / ("bf_yaml_schema_" + std::to_string(getpid()));
    std::filesystem::create_directories(work);
    std::ofstream(work / "documents.json") << documents;
    std::ofstream(work / "validate.py") << R"(
import json, sys, jsonschema
schema = json.load(open(sys.argv[1]))
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
json.dump([validator.is_valid(d) for d in json.load(open(sys.argv[2]))], open(sys.argv[3], 'w'))
)";
    const std::string in = " " + schema_file.string() + " " + (work / "documents.json").string();
    const std::string command = std::string(BF_PYTHON) + " " + (work / "validate.py").string() + in + " " +
                                (work / "result.json").string();
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    const json result = json::parse(std::ifstream(work / "result.json"));
    std::filesystem::remove_all(work);
    return result.get<std::vector<bool>>();
}

bool is_read(const std::string& text) {
    try {
        read_yaml_text(text);
        return true;
    } catch (const model::Errors&) {
        return false;
    }
}

TEST(Schema, AcceptsEverySample) {
    json documents = json::array();
    for (const auto& entry : std::filesystem::directory_iterator(valid_folder))
        if (entry.path().extension() == ".yaml") documents.push_back(to_json(YAML::LoadFile(entry.path())));
    ASSERT_GE(documents.size(), 3u);
    EXPECT_EQ(validate(documents), std::vector<bool>(documents.size(), true));
}

TEST(Schema, AgreesWithTheReaderOnSmallModels) {
    const std::vector<std::pair<std::string, bool>> cases = {
        {"model: m", true},
        {"step: 1", false},
        {"model: m\nstpo: 1", false},
        {"model: m\nblocks: {a: {block: Gain, K: [[1, 2], [3, 4]], f: {'a', 'b'}}}", true},
        {"model: m\nblocks: {a: {block: Gain, K: {p: 1}}}", false},
        {"model: m\nblocks: {a: {K: 2}}", false},
        {"model: m\nblocks: {a: {blocks: {}, K: 2}}", false},
        {"model: m\nblocks: {a: {block: SignalFromFile, file: a.csv}}", true},
        {"model: m\nblocks: {a: {block: Gain, with: {a: 1}}}", false},
        {"model: m\nblocks: {a: Gain}", false},
        {"model: m\nexecution: sometimes", false},
        {"model: m\nexecution: enabled\nstates: reset", true},
        {"model: m\ninputs: [a, b]\noutputs: {y: {when_disabled: reset}, z: }", true},
        {"model: m\ninputs: {a: {when_disabled: reset}}", false},
        {"model: m\nvariables: {a: {b: {c: 1}}, d: true}", true},
        {"model: m\nvariables: {a: }", false},
        {"model: m\nvariables: {a: {value: 1, minimum: 0}, S: {b: {value: 1, above: 0, maximum: 2*pi}}}",
         true},
        {"model: m\nvariables: {a: {value: 1, unit: m, doc: of the cart}, b: {value: 2, unit: 1}}", true},
        {"model: m\nvariables: {a: {value: 1, doc: [1]}}", false},
        {"model: m\nvariables: {a: {value: 1, minimun: 0}}", false},
        {"model: m\nvariables: {a: {value: {b: 1}}}", false},
        {"model: m\nvariables: {a: {value: 1, minimum: }}", false},
        {"model: m\nvariables: {a: {minimum: 1, maximum: {b: 1}}}", true},
        {"model: m\nenumerations: {Mode: [idle, walk], Sm: {balance: 1, swing: 4}}", true},
        {"model: m\nenumerations: [idle]", false},
        {"model: m\nrecord: all\nlayout: {any: [thing]}", false},
        {"model: m\nlayout: {blocks: {a.b: {x: 1, y: -2.5, width: 3, height: 4, flipped: true}}}", true},
        {"model: m\nlayout: {blocks: {a: {x: 1, y: 2, rotated: 270, sides: {u: top, y 1: left}}}}", true},
        {"model: m\nlayout: {blocks: {a: {x: 1, y: 2, rotated: 45}}}", false},
        {"model: m\nlayout: {wires: {a.u: labels, a.v: [[1, 2]]}}", true},
        {"model: m\nlayout: {wires: {a.u: label}}", false},
        {"model: m\nlayout: {blocks: {a: {x: 1, y: 2, sides: {u: middle}}}}", false},
        {"model: m\nlayout: {wires: {a.u: [[1, 2], [3, 4]]}, notes: {n: {text: t, in: a, x: 0, y: 0}}}",
         true},
        {"model: m\nlayout: {wires: {a.u: [[1, 2, 3]]}}", false},
        {"model: m\nlayout: {displays: {speed: {shows: xy, signals: [a.y, b.y]}}}", true},
        {"model: m\nlayout: {displays: {speed: {shows: pie, signals: [a.y]}}}", false},
        {"model: m\nlayout: {displays: {speed: {signals: [a.y], of: b}}}", false},
        {"model: m\nlayout: {blocks: {a: {x: left}}}", false},
        {"model: m\nlayout: {blocks: {a: {text: t}}}", false},
        {"model: m\nconnections: {a: {b: 1}}", false},
    };
    json documents = json::array();
    for (const auto& [text, valid] : cases) documents.push_back(to_json(YAML::Load(text)));
    const std::vector<bool> accepted = validate(documents);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        EXPECT_EQ(accepted[i], cases[i].second) << "schema on:\n" << cases[i].first;
        EXPECT_EQ(is_read(cases[i].first), cases[i].second) << "reader on:\n" << cases[i].first;
    }
}

TEST(Schema, KnowsTheLimitsOfNumbers) {
    const std::vector<std::pair<std::string, bool>> cases{
        {"{model: m, step: 0}", false},       {"{model: m, step: 1e-3}", true},
        {"{model: m, step: -T}", true},       {"{model: m, stop: -1}", false},
        {"{model: m, stop: 0}", true},        {"{model: m, relative_tolerance: 0}", false},
        {"{model: m, max_step: 0}", false},   {"{model: m, absolute_tolerance: 1e-9}", true},
        {"{model: m, iterations: 0}", false}, {"{model: m, iterations: 100001}", false},
        {"{model: m, iterations: 3}", true},
    };
    json documents = json::array();
    for (const auto& [text, valid] : cases) documents.push_back(to_json(YAML::Load(text)));
    const std::vector<bool> accepted = validate(documents);
    for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_EQ(accepted[i], cases[i].second) << cases[i].first;
}

/// The names of `properties` of a definition, sorted.
keys::Keys properties(const json& definition) {
    keys::Keys names;
    for (const auto& [name, value] : definition.at("properties").items()) names.push_back(name);
    return names;
}

keys::Keys sorted(keys::Keys names) {
    std::ranges::sort(names);
    return names;
}

TEST(Schema, HasTheReadersKeysAndNoOthers) {
    const json all = schema(), &defs = all.at("$defs");
    EXPECT_EQ(properties(all), sorted(keys::model));
    EXPECT_EQ(properties(defs.at("subsystem")), sorted(keys::subsystem));
    keys::Keys of_blocks = keys::library_block;
    of_blocks.push_back("chart"); // the only setting that is a mapping
    EXPECT_EQ(properties(defs.at("library_block")), sorted(of_blocks));
    EXPECT_EQ(properties(defs.at("reference")), sorted(keys::reference));
    EXPECT_EQ(properties(defs.at("variable")), sorted(keys::variable));
    EXPECT_EQ(properties(defs.at("input")), sorted(keys::input));
    EXPECT_EQ(properties(defs.at("output")), sorted(keys::output));
    const auto& parts = defs.at("layout").at("properties");
    EXPECT_EQ(properties(defs.at("layout")), sorted(keys::layout));
    EXPECT_EQ(properties(parts.at("blocks").at("additionalProperties")), sorted(keys::placement));
    EXPECT_EQ(properties(parts.at("notes").at("additionalProperties")), sorted(keys::note));
    EXPECT_EQ(properties(parts.at("displays").at("additionalProperties")), sorted(keys::display));
    EXPECT_EQ(parts.at("displays").at("additionalProperties").at("properties").at("shows").at("enum"),
              json(model::choices::shows));
    EXPECT_EQ(defs.at("execution").at("enum").get<keys::Keys>(), keys::executions);
    EXPECT_EQ(defs.at("held_or_reset").at("enum").get<keys::Keys>(), keys::held_or_reset);
}

/// The reader is driven by comparisons with each key, so that each listed key is tried once.
TEST(Schema, EveryListedKeyIsRead) {
    auto value_of = [](const std::string& key) -> std::string {
        if (key == "execution") return "atomic";
        if (key == "trigger" || key == "reset") return "falling";
        if (key == "each") return "true";
        if (key == "algebraic_loops") return "solve";
        if (key == "rate_transitions") return "checked";
        if (key == "non_finite") return "error";
        if (key == "states" || key == "when_disabled") return "reset";
        if (key == "enumerations" || key == "variables" || key == "blocks" || key == "connections" ||
            key == "signals" || key == "plots" || key == "with" || key == "layout")
            return "{}";
        if (key == "file") return (valid_folder / "pd.yaml").string();
        return key == "inputs" || key == "outputs" || key == "record" || key == "plugins" ? "[]" : "x";
    };
    auto all = [&](const keys::Keys& known) {
        std::string text;
        for (const std::string& key : known) text += (text.empty() ? "{" : ", ") + key + ": " + value_of(key);
        return text + "}";
    };
    auto is_kept = [](const std::string& text) { return canonical_yaml(read_yaml_text(text)); };
    const std::string blocks =
        is_kept("model: m\nvariables: {v: " + all(keys::variable) + "}\ninputs: {p: " + all(keys::input) +
                "}\noutputs: {q: " + all(keys::output) + "}\nblocks:\n  a: " + all(keys::library_block) +
                "\n  b: " + all(keys::reference) + "\n  c: " + all(keys::subsystem) + "\n");
    for (const keys::Keys* known : {&keys::variable, &keys::input, &keys::output, &keys::library_block,
                                    &keys::reference, &keys::subsystem})
        for (const std::string& key : *known)
            EXPECT_NE(blocks.find(key + ": "), std::string::npos) << key << blocks;
    std::string lines;
    for (const std::string& key : keys::model) lines += key + ": " + value_of(key) + "\n";
    EXPECT_EQ(is_kept(lines), lines);
}

} // namespace
} // namespace bf::formats

// The Simulink library that `bf describe` writes is read back: each of its blocks, with the values that its
// mask holds, is a block that the S-function accepts.
#include "bf/matlab/formula.hpp"
#include "simstruct/model.hpp"

#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <sstream>
#include <unistd.h>

extern "C" const SimStructMethods simstruct_methods;

namespace {

/// A node of the text format: values by key, nodes in order.
struct Node {
    std::string kind;
    std::map<std::string, std::string> values;
    std::vector<Node> nodes;
    const std::string& at(const std::string& key) const {
        const auto found = values.find(key);
        if (found == values.end()) throw std::runtime_error(kind + " has no " + key);
        return found->second;
    }
};

std::string unquoted(const std::string& text) {
    if (text.size() < 2 || text.front() != '"') return text;
    if (text.back() != '"') throw std::runtime_error("a text does not end: " + text);
    std::string result;
    for (std::size_t i = 1; i + 1 < text.size(); ++i) {
        if (text[i] == '"') throw std::runtime_error("a quote within a text: " + text);
        if (text[i] != '\\') {
            result += text[i];
            continue;
        }
        ++i;
        if (std::string("n\"\\").find(text[i]) == std::string::npos)
            throw std::runtime_error("escape in: " + text);
        result += text[i] == 'n' ? '\n' : text[i];
    }
    return result;
}

Node read(std::istream& file, const std::string& kind) {
    Node node{kind, {}, {}};
    for (std::string line; std::getline(file, line);) {
        line.erase(0, line.find_first_not_of(" \t"));
        if (line == "}") return node;
        if (line.ends_with(" {")) {
            node.nodes.push_back(read(file, line.substr(0, line.size() - 2)));
            continue;
        }
        const auto blank = line.find_first_of(" \t");
        if (blank == std::string::npos) throw std::runtime_error("no value: " + line);
        const auto value = line.find_first_not_of(" \t", blank);
        if (!node.values.emplace(line.substr(0, blank), unquoted(line.substr(value))).second)
            throw std::runtime_error("a key comes twice: " + line);
    }
    if (!kind.empty()) throw std::runtime_error(kind + " does not end");
    return node;
}

/// Split at a separator that no backslash stands before and that is in no parentheses.
std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts(1);
    int depth = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == separator) {
            parts.back() += text[++i];
            continue;
        }
        depth += separator == ',' ? (text[i] == '(') - (text[i] == ')') : 0;
        if (text[i] == separator && depth == 0)
            parts.emplace_back();
        else
            parts.back() += text[i];
    }
    return parts;
}

mxArray* array_of(const bf::matlab::Value& value) {
    using bf::matlab::Class;
    if (value.is_text()) return simstruct::text(value.text());
    if (value.is_cell()) {
        mxArray* cells = mxCreateCellMatrix(static_cast<std::size_t>(value.rows()),
                                            static_cast<std::size_t>(value.cols()));
        for (bf::matlab::Index i = 0; i < value.numel(); ++i)
            mxSetCell(cells, static_cast<std::size_t>(i), array_of(value.at(i)));
        return cells;
    }
    if (value.is_struct()) {
        std::vector<const char*> names;
        for (const auto& field : value.fields()) names.push_back(field.first.c_str());
        mxArray* made = mxCreateStructMatrix(1, 1, static_cast<int>(names.size()), names.data());
        for (const auto& field : value.fields())
            mxSetField(made, 0, field.first.c_str(), array_of(field.second));
        return made;
    }
    const Eigen::MatrixXd matrix = value.matrix();
    return simstruct::matrix(static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()),
                             {matrix.data(), matrix.data() + matrix.size()});
}

/// What MATLAB makes of the mask: its variables, then the S-function's parameters.
std::vector<mxArray*> parameters(const Node& block) {
    bf::matlab::Workspace variables;
    const auto names = split(block.at("MaskVariables"), ';');
    const auto values = split(block.at("MaskValueString"), '|');
    const auto styles = split(block.at("MaskStyleString"), ',');
    const auto prompts = split(block.at("MaskPromptString"), '|');
    if (names.size() > 1) { // the last semicolon ends the list
        EXPECT_EQ(values.size() + 1, names.size());
        EXPECT_EQ(values.size(), styles.size());
        EXPECT_EQ(values.size(), prompts.size());
        EXPECT_EQ(values.size(), split(block.at("MaskTunableValueString"), ',').size());
    }
    for (std::size_t i = 0; i + 1 < names.size(); ++i) {
        const auto equals = names[i].find('=');
        const std::string name = names[i].substr(0, equals);
        EXPECT_EQ(names[i].substr(equals + 2), std::to_string(i + 1));
        // A variable may not be called like a keyword; its prompt may.
        EXPECT_EQ(prompts[i].substr(0, name.size() - name.ends_with('_')) + (name.ends_with('_') ? "_" : ""),
                  name);
        if (styles[i] == "checkbox") {
            EXPECT_TRUE(values[i] == "on" || values[i] == "off") << values[i];
            variables.set(name, bf::matlab::Value(values[i] == "on" ? 1.0 : 0.0));
        } else if (names[i][equals + 1] == '&') {
            EXPECT_NE(styles[i].find(values[i]), std::string::npos) << styles[i];
            variables.set(name, bf::matlab::Value(values[i]));
        } else {
            variables.set(name, bf::matlab::evaluate(values[i], variables));
        }
    }
    const auto all = bf::matlab::evaluate("{" + block.at("Parameters") + "}", variables);
    std::vector<mxArray*> arrays;
    for (bf::matlab::Index i = 0; i < all.numel(); ++i) arrays.push_back(array_of(all.at(i)));
    return arrays;
}

class SimulinkLibrary : public testing::TestWithParam<const char*> {};

TEST_P(SimulinkLibrary, HoldsBlocksThatTheSFunctionAccepts) {
    const std::string name = GetParam();
    const std::string path = testing::TempDir() + name + "_" + std::to_string(getpid()) + ".mdl";
    setenv("BLOCKFACTORY_PLUGIN_PATH",
           BF_TEST_PLUGINS ":" BF_PLUGIN_DIRECTORY ":" BF_PLUGIN_DIRECTORY "/legacy", 1);
    ASSERT_EQ(std::system((BF_PROGRAM " describe --simulink-library " + name + " -o " + path).c_str()), 0);
    std::ifstream file(path);
    const Node root = read(file, "");
    ASSERT_EQ(root.nodes.size(), 1u);
    const Node& library = root.nodes[0];
    EXPECT_EQ(library.kind, "Library");
    EXPECT_EQ(library.at("Name"), name);
    int count = 0;
    for (const Node& group : library.nodes.at(0).nodes) {
        ASSERT_EQ(group.at("BlockType"), "SubSystem");
        for (const Node& block : group.nodes.at(0).nodes) {
            SCOPED_TRACE(block.at("Name"));
            EXPECT_EQ(block.at("BlockType"), "S-Function");
            EXPECT_EQ(block.at("FunctionName"), "BlockFactory");
            EXPECT_FALSE(block.at("MaskDescription").empty());
            if (block.at("Name") == "CounterFree") {
                EXPECT_NE(block.at("MaskPromptString").find("length of the counter; from 1 to 32|"),
                          std::string::npos)
                    << "prompts name the limits";
            }
            simstruct::Model model(simstruct_methods, 0.01);
            const int made = model.add("m/" + block.at("Name"), parameters(block));
            try {
                model.compile();
            } catch (const simstruct::Error& error) {
                // Alone and unwired, some blocks have no size; but their parameters must be accepted.
                const std::string text = error.what();
                // No default names a file that exists or the tasks of a hierarchy, and one test block can
                // never be made.
                const bool needs_a_value = text.find("SignalFromFile") != std::string::npos ||
                                           text.find("HierarchicalQP") != std::string::npos ||
                                           text.find("CannotBeMade") != std::string::npos;
                EXPECT_TRUE(text.find("mdlInitializeSizes") == std::string::npos || needs_a_value) << text;
                if (needs_a_value) continue;
            }
            EXPECT_EQ(block.at("Ports"), "[" + std::to_string(model.inputs(made)) + ", " +
                                             std::to_string(model.outputs(made)) + "]");
            const auto labels = split(block.at("MaskDisplay"), '\n');
            EXPECT_LE(static_cast<int>(labels.size()) - 1, model.inputs(made) + model.outputs(made));
            ++count;
        }
    }
    EXPECT_GT(count, name == "LegacyPlugin" ? 3 : 15);
    std::remove(path.c_str());
}
INSTANTIATE_TEST_SUITE_P(Libraries, SimulinkLibrary,
                         testing::Values("standard", "WholeBodyToolbox", "LegacyPlugin"),
                         [](const auto& named) { return std::string(named.param); });

} // namespace

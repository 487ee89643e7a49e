// Operations of chance on several files, and back.
#include "bf/base/files.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"
#include "bf/service/project.hpp"
#include "folder.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

namespace {

namespace fs = std::filesystem;
namespace op = bf::model::operations;
using bf::model::Operation;
using bf::service::Project;
using Texts = std::map<std::string, std::string>;

const Texts start{{"top.yaml", "# The whole.\n"
                               "model: top   # of two\n"
                               "step: 0.1\n"
                               "stop: 1\n"
                               "variables:\n"
                               "  gain: 2        # of both\n"
                               "  limits: {low: -1, high: 1}\n"
                               "blocks:\n"
                               "  one: {block: Constant, value: gain}   # V\n"
                               "  left: {file: part.yaml}\n"
                               "  right: {file: part.yaml, with: {k: 3}}\n"
                               "  inner:\n"
                               "    inputs: [u]\n"
                               "    outputs: [y]\n"
                               "    blocks:\n"
                               "      a: {block: Gain, K: gain}\n"
                               "      deep: {file: sub/leaf.yaml}\n"
                               "    connections: {u: [a, deep.u], a: y}\n"
                               "connections:\n"
                               "  one: [left.u, right.u, inner.u]\n"
                               "record: [left.y, inner.a, right.*]   # what matters\n"
                               "plots:\n"
                               "  Both: [left.y, right.y]\n"},
                  {"part.yaml", "model: part\n"
                                "variables: {k: 1}\n"
                                "inputs: [u]   # from above\n"
                                "outputs: [y]\n"
                                "blocks:\n"
                                "  g: {block: Gain, K: k}\n"
                                "  leaf: {file: sub/leaf.yaml}\n"
                                "connections:\n"
                                "  u: g\n"
                                "  g: [y, leaf.u]\n"},
                  {"sub/leaf.yaml", "# A leaf.\n"
                                    "model: leaf\n"
                                    "inputs: [u]\n"
                                    "outputs: [y]\n"
                                    "blocks:\n"
                                    "  x: {block: DiscreteIntegrator, gain: 2}  # rad\n"
                                    "  machine:\n"
                                    "    block: StateMachine\n"
                                    "    states: [idle, move]   # of the arm\n"
                                    "    transitions: |\n"
                                    "      [1 2 0 0.1;\n"
                                    "       2 1 0 0.2]\n"
                                    "connections: {u: x, x: y}\n"}};

/// Chooses operations on a model, most of which are possible.
class Chance {
  public:
    explicit Chance(unsigned seed) : random_(seed) {}

    Operation operator()(const bf::model::Model& model) {
        paths_ = {}, systems_ = {""}, ends_ = {}, references_ = {}, subsystems_ = {}, wires_ = {},
        charts_ = {};
        collect(model.root, "");
        switch (number(25)) {
        case 0: {
            bf::model::Block block{.name = name(), .type = "Gain"};
            if (number(2)) block.settings.push_back({"K", {.text = "gain"}});
            const std::string system = of(systems_);
            if (charts_.contains(system))
                block = {.name = name()};
            else if (number(5) == 0)
                block = {.name = name(), .reference = bf::model::Reference{"sub/leaf.yaml"}};
            Operation add = op::Add{system, block, {}, {}};
            if (number(2)) std::get<op::Add>(add).at = point();
            return add;
        }
        case 1:
        case 23:
        case 24: return op::Remove{of(paths_)};
        case 2: return op::Rename{of(paths_), name()};
        case 3: return op::Reorder{of(paths_), static_cast<std::size_t>(number(3))};
        case 4: {
            const std::string system = of(systems_);
            return op::Connect{system, end_in(system), end_in(system)};
        }
        case 5: {
            const std::string system = of(systems_);
            return op::Disconnect{system, {}, end_in(system)};
        }
        case 6:
            return op::Set{of(paths_), number(2) ? "K" : "doc",
                           number(3) ? std::optional(name()) : std::nullopt};
        case 7: return op::AddPort{of(systems_), {.name = name()}, number(2) == 0, {}};
        case 8: {
            bf::model::Variable variable{.name = number(2) ? "gain" : name()};
            variable.value = {.text = std::to_string(number(9))};
            return op::SetVariable{of(systems_), variable.name, variable};
        }
        case 9: return op::RenameVariable{of(systems_), number(2) ? "gain" : "k", name()};
        case 10: return op::Move{of(paths_), point()};
        case 11: return op::Resize{of(paths_), number(2) ? std::optional(point()) : std::nullopt};
        case 12:
            if (number(3) == 0) return op::Flip{of(paths_)};
            if (number(2) == 0) return op::Rotate{of(paths_)};
            return op::PlacePort{of(paths_), "u",
                                 number(3) ? std::optional(bf::model::Side(number(4))) : std::nullopt};
        case 13:
            if (number(2)) return op::Label{of(wires_), number(4) > 0};
            return op::Bend{of(wires_), {point(), point()}};
        case 14: {
            bf::model::Note note{.name = name(), .text = "a note\n: of two lines", .system = of(systems_)};
            return op::Annotate{note.name, note};
        }
        case 15: {
            const std::string path = of(paths_);
            const auto dot = path.rfind('.');
            return op::Group{dot == path.npos ? "" : path.substr(0, dot), {path.substr(dot + 1)}, name()};
        }
        case 16: return op::Dissolve{of(subsystems_)};
        case 17: return op::Inline{of(references_)};
        case 18: return op::Extract{of(subsystems_), "made" + std::to_string(made_++) + ".yaml"};
        case 19: return op::Record{of(paths_), number(2) == 0, number(2) ? "" : "Both"};
        case 20:
            if (number(3) == 0) {
                const std::string system = of(systems_);
                const std::string end = end_in(system);
                return op::NameSignal{system, end, name()};
            }
            if (number(2))
                return op::Watch{number(2) ? "Both" : name(),
                                 bf::model::Display{.name = {}, .signals = {{.path = of(paths_)}}}};
            return op::Plot{number(2) ? "Both" : name(), std::vector<std::string>{of(paths_)}};
        case 21: {
            bf::model::Model other = model;
            other.doc = name();
            return bf::model::difference(model, other);
        }
        default: {
            const std::string path = of(paths_);
            return op::Batch{{op::Move{path, point()}, op::Flip{path}}};
        }
        }
    }

    int number(int below) { return static_cast<int>(random_() % static_cast<unsigned>(below)); }

  private:
    void collect(const bf::model::System& system, const std::string& prefix) {
        for (const auto* ports : {&system.inputs, &system.outputs})
            for (const auto& port : *ports)
                paths_.push_back(prefix + port.name), ends_[prefix].push_back(port.name);
        for (const auto& connection : system.connections)
            for (const auto& to : connection.to) wires_.push_back(prefix + to.text());
        for (const auto& signal : system.signals) paths_.push_back(prefix + signal.name);
        for (const auto& block : system.blocks) {
            const std::string path = prefix + block.name;
            paths_.push_back(path);
            ends_[prefix].push_back(block.name);
            if (block.reference) references_.push_back(path);
            if (block.system) subsystems_.push_back(path);
            if (const auto chart = bf::model::chart_of(block)) {
                systems_.push_back(path);
                charts_.insert(path);
                for (const auto& state : chart->states)
                    paths_.push_back(path + "." + state), ends_[path + "."].push_back(state);
                for (std::size_t i = 0; i < chart->transitions.size(); ++i)
                    ends_[path + "."].push_back(chart->name_of(i));
            }
            if (const auto* content = block.content()) {
                for (const auto* ports : {&content->inputs, &content->outputs})
                    for (const auto& port : *ports) ends_[prefix].push_back(block.name + "." + port.name);
                systems_.push_back(path);
                collect(*content, path + ".");
            }
        }
    }
    std::string of(const std::vector<std::string>& list) {
        return list.empty() ? "nothing"
                            : list[static_cast<std::size_t>(number(static_cast<int>(list.size())))];
    }
    std::string end_in(const std::string& system) { return of(ends_[system.empty() ? "" : system + "."]); }
    std::string name() {
        return std::string(1, static_cast<char>('a' + number(26))) + std::to_string(number(40));
    }
    bf::model::Point point() { return {10.0 * number(50), 10.0 * number(50)}; }

    std::mt19937 random_;
    int made_ = 0;
    std::vector<std::string> paths_, systems_, references_, subsystems_, wires_;
    std::map<std::string, std::vector<std::string>> ends_;
    std::set<std::string> charts_;
};

TEST(Undo, GivesTheBytesOfAllFilesBackAfterThousandsOfOperationsOfEveryKind) {
    const fs::path folder = bf::service::test_folder();
    fs::create_directory(folder / "sub");
    for (const auto& [name, text] : start) std::ofstream(folder / name) << text;
    const auto texts = [&] {
        Texts all;
        for (const auto& [name, text] : start) all[name] = bf::read_text_file(folder / name);
        return all;
    };
    Project project(folder / "top.yaml");
    Chance chance(7);
    std::vector<int> done(std::variant_size_v<Operation>);
    std::vector<Texts> states{start};
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        const Operation operation = chance(project.model());
        const auto revision = project.revision();
        try {
            project.edit(operation);
        } catch (const bf::model::Errors&) {
            ++refused;
            if (i % 16 == 0) {
                EXPECT_EQ(texts(), states.back()) << bf::model::to_json(operation);
            }
            continue;
        }
        ++done[operation.index()];
        if (project.revision() == revision) continue; // nothing has changed
        states.push_back(texts());
        if (chance.number(20) > 0) continue;
        const int steps = 1 + chance.number(10); // back and on again
        int undone = 0;
        while (undone < steps && project.undo()) ++undone;
        ASSERT_EQ(texts(), states[states.size() - 1 - static_cast<std::size_t>(undone)]) << i;
        while (undone-- > 0) ASSERT_TRUE(project.redo());
        ASSERT_EQ(texts(), states.back()) << i;
    }
    for (std::size_t kind = 0; kind < done.size(); ++kind) EXPECT_GT(done[kind], 2) << kind;
    EXPECT_GT(states.size(), 800u);
    EXPECT_GT(refused, 100);
    for (std::size_t i = states.size() - 1; i-- > 0;) {
        ASSERT_TRUE(project.undo());
        if (i % 50 == 0) {
            ASSERT_EQ(texts(), states[i]) << i;
        }
    }
    EXPECT_FALSE(project.undo());
    EXPECT_EQ(texts(), start);
}

} // namespace

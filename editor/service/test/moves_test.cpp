// Blocks keep their states in a run, whatever path they get.
#include "../src/timeline.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"
#include "bf/service/project.hpp"
#include "folder.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <random>

namespace bf::service {
namespace {

namespace fs = std::filesystem;
namespace op = bf::model::operations;

const std::map<std::string, std::string> files{
    {"top.yaml", "model: top\n"
                 "step: 0.1\n"
                 "blocks:\n"
                 "  sine: {block: Sine, frequency: 3}\n"
                 "  a: {block: DiscreteIntegrator, initial: 1}\n"
                 "  b: {block: DiscreteIntegrator, initial: 10}\n"
                 "  c: {block: UnitDelay, initial: 100, period: 0.3}\n"
                 "  s:\n"
                 "    inputs: [u]\n"
                 "    outputs: [y]\n"
                 "    blocks:\n"
                 "      a: {block: DiscreteIntegrator, initial: 2}\n"
                 "      b: {block: UnitDelay, initial: 20}\n"
                 "    connections: {u: a, a: b, b: y}\n"
                 "  left: {file: part.yaml}\n"
                 "  right: {file: part.yaml}\n"
                 "  on: {block: Pulse, period: 0.4, width: 0.2}\n"
                 "  e:\n"
                 "    execution: enabled\n"
                 "    inputs: [u]\n"
                 "    outputs: [y]\n"
                 "    blocks: {a: {block: DiscreteIntegrator, initial: 3}}\n"
                 "    connections: {u: a, a: y}\n"
                 "connections: {sine: [a, s.u, left.u], a: b, b: [c, right.u], c: e.u, on: e.enable}\n"},
    {"part.yaml", "model: part\n"
                  "inputs: [u]\n"
                  "outputs: [y]\n"
                  "blocks:\n"
                  "  a: {block: DiscreteIntegrator, initial: 4}\n"
                  "  b: {block: DiscreteIntegrator, initial: 40}\n"
                  "connections: {u: [a, b], b: y}\n"}};

fs::path written(const fs::path& folder) {
    for (const auto& [name, text] : files) std::ofstream(folder / name) << text;
    return folder / "top.yaml";
}

/// The model as its files are now.
Edited edited(const Project& project) {
    formats::Files texts = project.texts();
    return {
        std::make_shared<const LoadedModel>(load(formats::read_yaml(project.file(), texts), project.file())),
        project.revision(), "edit", project.moves()};
}

double value(Simulation& run, const std::string& path) {
    const auto end = run.diagram().find_signal(path + ".y");
    if (end.node < 0) throw std::runtime_error("no signal " + path + ".y");
    return read_value(run.context().data(end.node, end.slot), run.diagram().slot(end).type, 0);
}

/// Blocks of the diagram that have states.
std::vector<std::string> stateful(const Diagram& diagram) {
    std::vector<std::string> all;
    for (const auto& node : diagram.nodes)
        if (std::ranges::any_of(node.block->resolution().slots,
                                [](const Slot& slot) { return is_state(slot.role); }))
            all.push_back(node.path);
    return all;
}

/// A change of chance of a subsystem of either file.
model::Operation chance(const model::Model& model, std::mt19937& random) {
    std::vector<std::string> paths, systems;
    model::walk(model, [&](const std::string& path, const model::Block& block) {
        paths.push_back(path);
        if (block.system) systems.push_back(path);
    });
    const auto any = [&](const auto& all) { return all[random() % all.size()]; };
    const std::string one = any(paths), system = model::split_last(one).first;
    std::vector<std::string> siblings;
    for (const auto& path : paths)
        if (model::split_last(path).first == system) siblings.push_back(model::split_last(path).second);
    const std::string other = model::joined(system, any(siblings)), name = model::split_last(one).second;
    switch (random() % 5) {
    case 0: return op::Rename{one, std::string(1, static_cast<char>('a' + random() % 6))};
    case 1:
        return op::Batch{{op::Rename{one, "tmp"}, op::Rename{other, name},
                          op::Rename{model::joined(system, "tmp"), model::split_last(other).second}}};
    case 2: return op::Rename{one, "x" + std::to_string(random() % 4)};
    case 3: return op::Group{system, {name, any(siblings)}, any(siblings)};
    default: return op::Dissolve{any(systems)};
    }
}

TEST(Moves, KeepEveryStateOfARunWhateverIsRenamedGroupedAndDissolved) {
    std::mt19937 random(7);
    int done = 0, grouped = 0, undone = 0;
    for (int round = 0; round < 20; ++round) {
        Project project(written(test_folder()));
        const std::int64_t first = project.revision();
        const Edited original = edited(project);
        Simulation alone(original.model->diagram);
        alone.start();
        Timeline timeline([](Played&) {}, 1 << 24, 64);
        timeline.begin(original.model, original.revision);
        for (int edits = 0; edits < 25; ++edits) {
            try {
                if (random() % 5 == 0) {
                    undone += random() % 3 == 0 ? project.redo() : project.undo();
                } else {
                    const model::Operation operation = chance(project.model(), random);
                    project.edit(operation);
                    grouped += std::holds_alternative<op::Group>(operation);
                }
            } catch (const model::Errors&) {
                continue; // of a name that is taken, an enabled subsystem that would be dissolved, ...
            }
            if (random() % 3 == 0) continue; // the next one comes before the check
            const Edited now = edited(project);
            const RunEdit told = timeline.compare(now);
            ASSERT_EQ(told.refusal, "");
            ASSERT_TRUE(told.lost.empty()) << told.lost.front();
            ASSERT_TRUE(told.begun.empty()) << told.begun.front();
            ASSERT_TRUE(told.unclear.empty());
            timeline.edit(now);
            ++done;
            for (int k = static_cast<int>(random() % 4); k > 0; --k) {
                ASSERT_TRUE(timeline.advance());
                ASSERT_TRUE(alone.step());
                for (const auto& path : stateful(alone.diagram())) {
                    const auto current = project.moves().path_since(first, path);
                    ASSERT_TRUE(current) << path;
                    ASSERT_EQ(value(timeline.run(), *current), value(alone, path)) << path << " " << *current;
                }
            }
        }
    }
    EXPECT_GT(done, 150);
    EXPECT_GT(grouped, 10);
    EXPECT_GT(undone, 20);
}

/// What 'a' and 'b' are a few steps after a change at 1 s.
std::pair<double, double> after_a_change(const std::function<void(Project&)>& change, RunEdit* told = nullptr,
                                         int steps = 3) {
    Project project(written(test_folder()));
    const Edited original = edited(project);
    Timeline timeline([](Played&) {}, 1 << 24, 64);
    timeline.begin(original.model, original.revision);
    timeline.go_to(0);
    while (timeline.time() < 0.95)
        if (!timeline.advance()) throw std::runtime_error(timeline.run().failure());
    change(project);
    const Edited now = edited(project);
    if (told) *told = timeline.compare(now);
    timeline.edit(now);
    for (int k = 0; k < steps; ++k) timeline.advance();
    return {value(timeline.run(), "a"), value(timeline.run(), "b")};
}

const op::Batch exchange{{op::Rename{"a", "tmp"}, op::Rename{"b", "a"}, op::Rename{"tmp", "b"}}};

TEST(Moves, ValuesFollowTwoIntegratorsThatExchangeTheirNames) {
    const auto [a, b] = after_a_change([](Project&) {});
    ASSERT_GT(b, 5 * a);
    for (const bool is_one_edit : {true, false}) {
        const auto [new_a, new_b] = after_a_change([&](Project& project) {
            if (is_one_edit) return project.edit(exchange);
            for (const auto& part : exchange.operations) project.edit(part);
        });
        EXPECT_EQ(new_a, b) << is_one_edit;
        EXPECT_EQ(new_b, a) << is_one_edit;
    }
    const auto undone = after_a_change([](Project& project) {
        project.edit(exchange);
        project.undo();
    });
    EXPECT_EQ(undone, std::pair(a, b));
}

TEST(Moves, WhatIsWrittenByHandStaysWithTheNamesAndIsSaidBefore) {
    RunEdit told;
    const auto alone = after_a_change([](Project&) {}, nullptr, 1);
    const auto by_hand = after_a_change(
        [](Project& project) {
            project.edit(exchange);
            const std::string text = project.text_in(project.file());
            project.undo();
            ASSERT_TRUE(project.rewrite(project.file(), project.text_in(project.file()), text));
        },
        &told, 1);
    EXPECT_EQ(told.unclear, std::vector<std::string>{
                                "'a' and 'b' look as if they had exchanged their names in the file: their "
                                "states stay with the names; rename the blocks in the page, and the "
                                "states go along"});
    EXPECT_EQ(by_hand, alone);
    after_a_change(
        [](Project& project) {
            std::string text = project.text_in(project.file());
            text.replace(text.find("initial: 10"), 11, "initial: 11");
            ASSERT_TRUE(project.rewrite(project.file(), project.text_in(project.file()), text));
        },
        &told);
    EXPECT_TRUE(told.unclear.empty());
}

TEST(Moves, ABlockThatTakesANameThatWasLeftBeginsAnew) {
    RunEdit told;
    after_a_change(
        [](Project& project) {
            project.edit(op::Rename{"a", "old"});
            project.edit(op::Add{"", {.name = "a", .type = "DiscreteIntegrator"}});
            project.edit(op::Connect{"", "sine", "a"});
        },
        &told);
    EXPECT_TRUE(told.lost.empty());
    EXPECT_EQ(told.begun, (std::vector<std::string>{"a.x", "a.before"}));
}

TEST(Moves, TheActiveStateOfAChartStaysActiveWhateverBecomesOfTheOthers) {
    const fs::path file = test_folder() / "chart.yaml";
    std::ofstream(file)
        << "model: m\nstep: 0.1\nblocks:\n  c: {block: StateMachine, states: [idle, fill, run, "
           "trip], transitions: \"[1 2 0 0.2; 2 3 0 0.2; 3 4 0 100]\"}\n";
    Project project(file);
    Timeline timeline([](Played&) {}, 1 << 24, 64);
    const Edited original = edited(project);
    timeline.begin(original.model, original.revision);
    const auto state = [&] {
        const auto end = timeline.run().diagram().find_signal("c.state");
        return read_value(timeline.run().context().data(end.node, end.slot), Type::float64, 0);
    };
    const auto after = [&](const std::function<void()>& change) {
        change();
        const Edited now = edited(project);
        const RunEdit told = timeline.compare(now);
        timeline.edit(now);
        if (!timeline.advance()) throw std::runtime_error(timeline.run().failure());
        return told.lost;
    };
    const std::vector<std::string> nothing;
    while (timeline.time() < 0.75)
        if (!timeline.advance()) throw std::runtime_error(timeline.run().failure());
    ASSERT_EQ(state(), 3);
    EXPECT_EQ(after([&] { project.edit(op::Remove{"c.idle"}); }), nothing);
    EXPECT_EQ(state(), 2);
    EXPECT_EQ(after([&] { project.edit(op::Rename{"c.run", "idle"}); }), nothing);
    EXPECT_EQ(state(), 2);
    EXPECT_EQ(after([&] { project.undo(), project.undo(); }), nothing);
    EXPECT_EQ(state(), 3) << "where it stands again";
    EXPECT_EQ(after([&] {
                  std::string text = project.text_in(file);
                  const std::string before = text;
                  text.replace(text.find("run"), 3, "go");
                  ASSERT_TRUE(project.rewrite(file, before, text));
              }),
              std::vector<std::string>{"'c.x' is 'run', which is no longer there: 'c' then begins anew"});
    EXPECT_EQ(state(), 1) << "by hand in the file";
}

} // namespace
} // namespace bf::service

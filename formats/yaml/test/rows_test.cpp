// Edits of matrices and lists, each of which has its own form in the text.
#include "bf/model/edit.hpp"
#include "changes.hpp"

#include <random>

namespace bf::formats {
namespace {

using namespace model;
using namespace model::operations;

constexpr const char *before = "model: m\nblocks:\n  m:\n    block: StateMachine\n",
                     *after = "    initial: 2\n";

/// What an operation changes of a state machine with these settings.
Lines changed(const Operation& operation, const std::string& settings) {
    return changes(operation, before + settings + after);
}

const std::string block = "    states:\n"
                          "      - idle   # waits\n"
                          "      # on the way\n"
                          "      - move\n"
                          "      - hold\n"
                          "    transitions:   # rows\n"
                          "      - [1, 2, 1, 0]   # go\n"
                          "      # after a while\n"
                          "      - [2, 3, 0,  2*T]\n"
                          "\n"
                          "      - [3, 1, max(1, 2), 0.5]  # back\n";

TEST(EditedRows, OfABlockKeepTheirLines) {
    EXPECT_EQ(changed(Set{"m.hold.2", "minimum_time", "3"}, block),
              (Lines{"-       - [2, 3, 0,  2*T]", "+       - [2, 3, 0,  3]"}));
    EXPECT_EQ(changed(Set{"m.idle.3", "condition", "2"}, block),
              (Lines{"-       - [3, 1, max(1, 2), 0.5]  # back", "+       - [3, 1, 2, 0.5]  # back"}));
    EXPECT_EQ(changed(Connect{"m", "hold", "move"}, block), (Lines{"+       - [3, 2, 0, 0]"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "move.1"}, block), (Lines{"-       - [1, 2, 1, 0]   # go"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "hold.2"}, block),
              (Lines{"-       # after a while", "-       - [2, 3, 0,  2*T]"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "idle.3"}, block),
              (Lines{"- ", "-       - [3, 1, max(1, 2), 0.5]  # back"}));
}

TEST(EditedRows, OfAListKeepTheirLines) {
    EXPECT_EQ(changed(Rename{"m.move", "go"}, block), (Lines{"-       - move", "+       - go"}));
    EXPECT_EQ(changed(Rename{"m.idle", "a, b"}, block),
              (Lines{"-       - idle   # waits", "+       - 'a, b'   # waits"}));
    EXPECT_EQ(changed(Add{"m", {.name = "stop"}, {}, {}}, block), (Lines{"+       - stop"}));
    EXPECT_EQ(changed(Remove{"m.move"}, block),
              (Lines{"-       # on the way", "-       - move", "-       - [1, 2, 1, 0]   # go",
                     "-       # after a while", "-       - [2, 3, 0,  2*T]",
                     "-       - [3, 1, max(1, 2), 0.5]  # back", "-     initial: 2",
                     "+       - [2, 1, max(1, 2), 0.5]  # back"}));
}

TEST(EditedRows, KeepTheirCommentsOverManyEdits) {
    const Batch edits{{Set{"m.move.1", "minimum_time", "2"}, Rename{"m.move", "go"},
                       Add{"m", {.name = "stop"}, {}, {}}, Connect{"m", "idle", "stop"}, Remove{"m.go"}}};
    EXPECT_EQ(changed(edits, block),
              (Lines{"-       # on the way", "-       - move", "+       - stop",
                     "-       - [1, 2, 1, 0]   # go", "-       # after a while", "-       - [2, 3, 0,  2*T]",
                     "-       - [3, 1, max(1, 2), 0.5]  # back", "-     initial: 2",
                     "+       - [2, 1, max(1, 2), 0.5]  # back", "+       - [1, 3, 0, 0]"}));
}

const std::string flow = "    states: [idle,  move, # then\n"
                         "             hold]\n"
                         "    transitions: [[1, 2, 1, 0],    # go\n"
                         "                  # after a while\n"
                         "                  [2, 3, 0,  2*T],\n"
                         "                  [3, 1, 2, 0.5]]  # back\n";

TEST(EditedRows, InBracketsKeepTheirLines) {
    EXPECT_EQ(changed(Set{"m.hold.2", "minimum_time", "3"}, flow),
              (Lines{"-                   [2, 3, 0,  2*T],", "+                   [2, 3, 0,  3],"}));
    EXPECT_EQ(changed(Connect{"m", "hold", "move"}, flow),
              (Lines{"-                   [3, 1, 2, 0.5]]  # back",
                     "+                   [3, 1, 2, 0.5],  # back", "+                   [3, 2, 0, 0]]"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "hold.2"}, flow),
              (Lines{"-                   # after a while", "-                   [2, 3, 0,  2*T],"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "idle.3"}, flow),
              (Lines{"-                   [2, 3, 0,  2*T],", "-                   [3, 1, 2, 0.5]]  # back",
                     "+                   [2, 3, 0,  2*T]]"}));
    EXPECT_EQ(changed(Rename{"m.move", "go"}, flow),
              (Lines{"-     states: [idle,  move, # then", "+     states: [idle,  go, # then"}));
    EXPECT_EQ(changed(Add{"m", {.name = "stop"}, {}, {}}, flow),
              (Lines{"-              hold]", "+              hold,", "+              stop]"}));
}

TEST(EditedRows, WithTheirBracketOnALineOfItsOwn) {
    const std::string open = "    transitions: [\n"
                             "      [1, 1, 1, 0], # go\n"
                             "      [1, 1, 0, 2],  # stay\n"
                             "    ]\n";
    EXPECT_EQ(changed(Connect{"m", "a", "a"}, "    states: [a, b]\n" + open),
              (Lines{"+       [1, 1, 0, 0],"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "a.1"}, "    states: [a, b]\n" + open),
              (Lines{"-       [1, 1, 1, 0], # go"}));
    EXPECT_EQ(changed(Set{"m.a.2", "minimum_time", "3"}, "    states: [a, b]\n" + open),
              (Lines{"-       [1, 1, 0, 2],  # stay", "+       [1, 1, 0, 3],  # stay"}));
}

TEST(EditedRows, ThatEndWithASemicolonKeepTheirLines) {
    const std::string rows = "    states: [a, b]\n"
                             "    transitions: [1 2 1 0;\n"
                             "                  2 1  0 2*T;\n"
                             "                  1 1 2 0.5]   # all\n";
    EXPECT_EQ(changed(Set{"m.a.2", "minimum_time", "3"}, rows),
              (Lines{"-                   2 1  0 2*T;", "+                   2 1  0 3;"}));
    EXPECT_EQ(changed(Connect{"m", "b", "b"}, rows),
              (Lines{"-                   1 1 2 0.5]   # all", "+                   1 1 2 0.5;",
                     "+                   2 2 0 0]   # all"}));
    EXPECT_EQ(changed(Disconnect{"m", {}, "a.2"}, rows), (Lines{"-                   2 1  0 2*T;"}));
}

TEST(EditedRows, OfAMatrixOnOneLineChangeTheirEntryAlone) {
    const std::string text =
        "model: m\nblocks:\n"
        "  m: {block: StateMachine,  states: [a,b],  transitions: [[1,2,1,0],[2,1,0,2]]}\n"
        "  n: {block: StateMachine, states: 'a, b', transitions: [1 2 1 0;  2 1 0 2]}  # n\n";
    EXPECT_EQ(changes(Set{"m.a.2", "minimum_time", "3"}, text)[1],
              "+   m: {block: StateMachine,  states: [a,b],  transitions: [[1,2,1,0],[2,1,0,3]]}");
    EXPECT_EQ(changes(Connect{"m", "b", "b"}, text)[1],
              "+   m: {block: StateMachine,  states: [a,b],  transitions: [[1,2,1,0],[2,1,0,2],[2,2,0,0]]}");
    EXPECT_EQ(changes(Rename{"m.b", "c"}, text)[1],
              "+   m: {block: StateMachine,  states: [a,c],  transitions: [[1,2,1,0],[2,1,0,2]]}");
}

TEST(EditedRows, OfAnyMatrixKeepTheirLines) {
    const std::string text = "model: m\nblocks:\n  g:\n    block: Gain\n    K:\n    - [1, 0]   # x\n"
                             "    - - 0\n      - 2*k\n";
    EXPECT_EQ(changes(Set{"g", "K", "[1, 0; 3, 2*k]"}, text), (Lines{"-     - - 0", "+     - - 3"}));
    EXPECT_EQ(changes(Set{"g", "K", "[1, 0; 0, 2*k; 1, 1]"}, text), (Lines{"+     - [1, 1]"}));
    EXPECT_EQ(changes(Set{"g", "K", "[4, 0]"}, text),
              (Lines{"-     - [1, 0]   # x", "-     - - 0", "-       - 2*k", "+     - [4, 0]   # x"}));
    EXPECT_EQ(changes(Set{"g", "K", "k"}, text),
              (Lines{"-     K:", "-     - [1, 0]   # x", "-     - - 0", "-       - 2*k", "+     K: k   # x"}))
        << "what is no matrix any more is written anew";
}

// What a state machine says, with the comment of each state and row, kept apart from the document.
struct Kept {
    struct Row {
        std::string from, to, minimum_time, comment;
    };
    std::vector<std::pair<std::string, std::string>> states; ///< name, comment
    std::vector<Row> rows;
};

std::string text_of(const Kept& kept, bool is_flow) {
    std::string text = "    states:";
    const auto number = [&](const std::string& name) {
        return std::to_string(std::ranges::find(kept.states, name, [](const auto& s) { return s.first; }) -
                              kept.states.begin() + 1);
    };
    const auto line = [&](std::size_t i, std::size_t count, const std::string& item,
                          const std::string& comment) {
        text += is_flow ? (i == 0 ? " [" : "\n      ") + item + (i + 1 < count ? ",  # " : "]  # ") + comment
                        : "\n      - " + item + "  # " + comment;
    };
    for (std::size_t i = 0; i < kept.states.size(); ++i)
        line(i, kept.states.size(), kept.states[i].first, kept.states[i].second);
    text += "\n    transitions:";
    for (std::size_t i = 0; i < kept.rows.size(); ++i) {
        const auto& row = kept.rows[i];
        line(i, kept.rows.size(),
             "[" + number(row.from) + ", " + number(row.to) + ", 0, " + row.minimum_time + "]", row.comment);
    }
    return text + "\n";
}

/// Comments behind items, in their order; an item without one has an empty text.
std::vector<std::string> comments_of(const std::string& text) {
    std::vector<std::string> comments;
    for (const std::string& line : lines_of(text)) {
        const bool has_item = line.starts_with("      ") || line.find(": [") != line.npos;
        const std::size_t begin = line.find("# ");
        if (has_item) comments.push_back(begin == line.npos ? "" : line.substr(begin + 2));
    }
    return comments;
}

TEST(EditedRows, HaveTheCommentsThatTheyHadBeforeManyStatesCameAndWent) {
    std::mt19937 random(7);
    const auto any = [&](std::size_t count) { return random() % count; };
    for (const bool is_flow : {false, true})
        for (int round = 0; round < 60; ++round) {
            Kept kept;
            int fresh = 0;
            for (int i = 0; i < 5; ++i)
                kept.states.push_back({"s" + std::to_string(i), "S" + std::to_string(i)});
            for (int i = 0; i < 8; ++i)
                kept.rows.push_back({"s" + std::to_string(any(5)), "s" + std::to_string(any(5)), "1",
                                     "R" + std::to_string(i)}); // many say the same
            Model model = read_yaml_text(before + text_of(kept, is_flow) + after);
            for (int i = 0; i < 14; ++i) {
                const std::size_t state = any(kept.states.size());
                const std::string name = kept.states[state].first, other = "n" + std::to_string(fresh++);
                const std::size_t row = kept.rows.empty() ? 0 : any(kept.rows.size());
                const auto path = [&] { return kept.rows[row].to + "." + std::to_string(row + 1); };
                switch (any(6)) {
                case 0:
                    edit(model, Add{"m", {.name = other}, {}, {}});
                    kept.states.push_back({other, ""});
                    break;
                case 1: {
                    edit(model, Rename{"m." + name, other});
                    kept.states[state].first = other;
                    for (auto& r : kept.rows) {
                        if (r.from == name) r.from = other;
                        if (r.to == name) r.to = other;
                    }
                    break;
                }
                case 2:
                    if (kept.states.size() < 3) break;
                    edit(model, Remove{"m." + name});
                    kept.states.erase(kept.states.begin() + static_cast<std::ptrdiff_t>(state));
                    std::erase_if(kept.rows, [&](const auto& r) { return r.from == name || r.to == name; });
                    break;
                case 3:
                    edit(model, Connect{"m", name, kept.states[0].first});
                    kept.rows.push_back({name, kept.states[0].first, "0", ""});
                    break;
                case 4:
                    if (kept.rows.size() < 2) break;
                    edit(model, Disconnect{"m", {}, path()});
                    kept.rows.erase(kept.rows.begin() + static_cast<std::ptrdiff_t>(row));
                    break;
                default:
                    if (kept.rows.empty()) break;
                    edit(model, Set{"m." + path(), "minimum_time", "2"});
                    kept.rows[row].minimum_time = "2";
                }
                if (kept.rows.empty()) break;
                std::vector<std::string> wanted;
                for (const auto& [known, comment] : kept.states) wanted.push_back(comment);
                for (const auto& r : kept.rows) wanted.push_back(r.comment);
                const auto written = edited_yaml(model);
                ASSERT_TRUE(written);
                ASSERT_EQ(comments_of(written->substr(0, written->rfind("    initial"))), wanted) << *written;
                if (any(4) == 0) { // another program looks at the file meanwhile
                    model = read_yaml_text(*written);
                }
            }
        }
}

TEST(EditedRows, KnowTheirLines) {
    const auto lines = [](const std::string& settings) {
        const Model model = read_yaml_text(before + settings + after);
        std::vector<int> all;
        for (const auto& where : model.root.blocks[0].find_setting("transitions")->value.rows)
            all.push_back(where.line);
        return all;
    };
    EXPECT_EQ(lines(block), (std::vector<int>{11, 13, 15}));
    EXPECT_EQ(lines(flow), (std::vector<int>{7, 9, 10}));
    EXPECT_EQ(lines("    transitions: [1 2 1 0;\n      2 1 0 2;\n      1 1 0 0]\n"),
              (std::vector<int>{5, 6, 7}));
    EXPECT_EQ(lines("    transitions: |\n      [1 2 1 0;\n\n       2 1 0 2]\n"), (std::vector<int>{6, 8}));
    EXPECT_EQ(lines("    transitions: |\n      [\n      1 2 1 0\n      2 1 0 2\n      ]\n"),
              (std::vector<int>{7, 8}));
    EXPECT_EQ(lines("    transitions: \"[1 2 1 0; 2 1 0 2]\"\n"), (std::vector<int>{5, 5}));
}

} // namespace
} // namespace bf::formats

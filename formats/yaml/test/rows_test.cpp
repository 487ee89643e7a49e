// Edits of matrices and lists, each of which has its own form in the text.
#include "bf/model/edit.hpp"
#include "changes.hpp"

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

} // namespace
} // namespace bf::formats

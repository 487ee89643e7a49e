#include "bf/formats/yaml.hpp"
#include "bf/library/load.hpp"
#include "bf/model/edit.hpp"
#include "bf/view/draw.hpp"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>

namespace {

using namespace bf::editor;

constexpr const char* head = "model: m\nstep: 0.1\nstop: 1\nvariables: {T: 2}\nblocks:\n"
                             "  go: {block: Constant, value: true}\n"
                             "  pair: {block: Constant, value: '[1 0]'}\n"
                             "  gathered: {block: Mux, inputs: 2}\n"
                             "  inner:\n"
                             "    inputs: [u]\n"
                             "    blocks:\n"
                             "      machine:\n"
                             "        block: StateMachine\n"
                             "        states: [idle, move, hold]\n";
constexpr const char* tail = "    connections: {u: machine}\n"
                             "connections: {go: gathered.u1, pair: gathered.u2, gathered: inner}\n";

bf::model::Model model_of(const std::string& transitions, const std::string& layout = "") {
    return bf::formats::read_yaml_text(head + ("        transitions: \"" + transitions + "\"\n") + tail +
                                       layout);
}
Drawing drawn(const bf::model::Model& model, const std::string& system = "inner.machine") {
    const auto known = bf::examine(model, "m.yaml");
    return draw(model, system, known.diagram, known.diagnostics);
}
const Element& shown(const Drawing& drawing, const std::string& path) {
    return *std::ranges::find(drawing.elements.rbegin(), drawing.elements.rend(), path,
                              &Element::path); // blocks before wires
}
std::string written(const Element& element) {
    std::string all;
    for (const auto& shape : element.shapes) all += shape.kind == Shape::Kind::text ? shape.text : "";
    return all;
}

const char* const cycle = "[1 2 1 0; 2 3 0 2*T; 3 1 2 0.5; 3 3 0 1; 2 1 0 0]";

TEST(DrawChart, ShowsEachStateAndTransitionOnce) {
    const Drawing drawing = drawn(model_of(cycle));
    std::multiset<std::string> paths;
    for (const auto& element : drawing.elements) paths.insert(element.path);
    const std::string m = "inner.machine.";
    EXPECT_EQ(paths, (std::multiset<std::string>{m + "idle", m + "move", m + "hold", m + "move.1",
                                                 m + "hold.2", m + "idle.3", m + "hold.4", m + "idle.5"}));
    EXPECT_EQ(drawing.active, "inner.machine.state");
    EXPECT_EQ(shown(drawing, m + "hold").state, 3);
    EXPECT_EQ(shown(drawing, m + "idle.3").state, 3) << "of the state that it leaves";
    EXPECT_EQ(shown(drawing, m + "idle.3").title, "transition from hold to idle, [u(2)] after 0.5 s");
    EXPECT_EQ(written(shown(drawing, m + "hold.2")), "after 2*T s");
    EXPECT_EQ(written(shown(drawing, m + "idle.5")), "");
    EXPECT_EQ(shown(drawing, m + "idle").title, "idle, first state");
}

TEST(DrawChart, ArrowsLeadFromStateToState) {
    const Drawing drawing = drawn(model_of(cycle));
    const auto is_on = [](const Point& p, const Rectangle& r) {
        return (p.x == r.x || p.x == r.x + r.width) && p.y > r.y && p.y < r.y + r.height;
    };
    for (const auto& element : drawing.elements) {
        if (element.kind != Element::Kind::wire) continue;
        const std::string to = element.path.substr(0, element.path.rfind('.'));
        EXPECT_TRUE(is_on(element.corners.front(), shown(drawing, "inner.machine." + element.from).bounds))
            << element.path;
        EXPECT_TRUE(is_on(element.corners.back(), shown(drawing, to).bounds)) << element.path;
        EXPECT_EQ(element.shapes[1].points[0], element.corners.back()) << "the head of the arrow";
    }
}

TEST(DrawChart, CallsConditionsByWhatAMuxGathers) {
    auto model = model_of(cycle);
    auto& inner = *model.root.find_block("inner")->system;
    inner.blocks.push_back({.name = "both",
                            .type = "Mux",
                            .settings = {{.name = "inputs", .value = {.text = "2"}, .where = {}}}});
    inner.blocks.push_back({.name = "pair",
                            .type = "Constant",
                            .settings = {{.name = "value", .value = {.text = "[1; 0]"}, .where = {}}}});
    inner.inputs.push_back({.name = "ready"});
    inner.connections = {{.from = {.block = {}, .port = "ready"}, .to = {{.block = "both", .port = "u2"}}},
                         {.from = {.block = "pair"}, .to = {{.block = "both", .port = "u1"}}},
                         {.from = {.block = "both"}, .to = {{.block = "machine"}}}};
    model.root.connections.back().to[0].port = "u";
    const Drawing drawing = drawn(model);
    EXPECT_EQ(written(shown(drawing, "inner.machine.move.1")), "[pair(1)]");
    EXPECT_EQ(written(shown(drawing, "inner.machine.idle.3")), "[pair(2)] after 0.5 s");
    inner.find_block("machine")->settings[1].value.text = "[1 2 3 0]";
    EXPECT_EQ(written(shown(drawn(model), "inner.machine.move.1")), "[ready]");
}

TEST(DrawChart, ShowsWhatExpressionsComeTo) {
    auto model = model_of("rows");
    model.root.variables.push_back({.name = "rows", .value = {.text = "[1 2 0 T; 2 1 1 0]"}});
    const Drawing drawing = drawn(model);
    EXPECT_EQ(written(shown(drawing, "inner.machine.move.1")), "after 2 s");
}

TEST(DrawChart, StatesStandWhereTheLayoutSays) {
    const auto model = model_of(cycle, "layout:\n  blocks:\n    inner.machine.move: {x: 400, y: 300}\n"
                                       "  wires:\n    inner.machine.move.1: [[300, 50], [300, 320]]\n");
    const Drawing drawing = drawn(model);
    EXPECT_EQ(shown(drawing, "inner.machine.move").bounds.x, 400);
    EXPECT_EQ(shown(drawing, "inner.machine.move").bounds.y, 300);
    const auto& corners = shown(drawing, "inner.machine.move.1").corners;
    EXPECT_TRUE(std::ranges::any_of(corners, [](const Point& p) { return p.x == 300; }));
    const auto known = bf::examine(model, "m.yaml");
    EXPECT_EQ(unplaced(model, "inner.machine", known.diagram).size(), 2u);
    EXPECT_EQ(arranged(model, "inner.machine", known.diagram).operations.size(), 4u)
        << "three states, and a transition that finds its way";
}

TEST(DrawChart, StatesAreFlippedAndTurnedWithTheirTransitions) {
    for (const char* how : {"rotated: 90", "rotated: 180", "rotated: 270", "flipped: true"}) {
        const Drawing drawing = drawn(
            model_of("[1 2 1 0; 2 3 0 2*T]", "layout:\n  blocks:\n    inner.machine.move: {x: 400, y: 300, " +
                                                 std::string(how) + "}\n"));
        const Rectangle move = shown(drawing, "inner.machine.move").bounds;
        const Element &in = shown(drawing, "inner.machine.move.1"),
                      &out = shown(drawing, "inner.machine.hold.2");
        const Point arrives = in.corners.back(), leaves = out.corners.front(),
                    label = out.shapes.back().points[0];
        if (how == std::string("rotated: 90")) {
            EXPECT_EQ(arrives.y, move.y);
            EXPECT_EQ(leaves.y, move.y + move.height);
        } else if (how == std::string("rotated: 270")) {
            EXPECT_EQ(arrives.y, move.y + move.height);
            EXPECT_EQ(leaves.y, move.y);
        } else {
            EXPECT_EQ(arrives.x, move.x + move.width);
            EXPECT_EQ(leaves.x, move.x);
        }
        const bool is_on = label.x > move.x && label.x < move.x + move.width && label.y > move.y &&
                           label.y - out.shapes.back().size < move.y + move.height;
        EXPECT_FALSE(is_on) << how << ": the state would hide its guard";
    }
}

TEST(DrawChart, ShowsStatesWithinStatesLevelByLevel) {
    const auto model = bf::formats::read_yaml_text(
        "model: m\nstep: 0.1\nblocks:\n  machine:\n    block: StateMachine\n    chart:\n      events: [stop, "
        "go]\n"
        "      variables: [n]\n      states:\n        off: {transitions: [{to: last, on: go}]}\n"
        "        on:\n          initial: b\n          transitions: [{to: off, on: stop}]\n          states:\n"
        "            last: {history: shallow, to: b}\n"
        "            a: {transitions: [{to: b, if: n > 2, after: 0.5, do: n = 0}, {every: 1, do: n = n + "
        "1}]}\n"
        "            b: {transitions: [{to: off, on: go}]}\n");
    const auto texts = [&](const std::string& system) {
        std::string all;
        for (const auto& element : drawn(model, system).elements)
            if (element.kind == Element::Kind::wire)
                all += element.from + " > " + element.to + ": " + written(element) + "\n";
            else
                all += element.title + "\n";
        return all;
    };
    EXPECT_EQ(texts("machine"), "off > off.1: go\non > on.1: stop\non > on.b.1: go\noff, first state\non, "
                                "state with states inside\n");
    EXPECT_EQ(texts("machine.on"), "a > a.1: [n > 2] after 0.5 s / n = 0\na > a.2: every 1 s / n = n + 1\n"
                                   "last, history\na, state\nb, first state\n");
    for (const char* system : {"machine", "machine.on"})
        EXPECT_EQ(drawn(model, system).active, "machine.active");
    EXPECT_EQ(shown(drawn(model, "machine"), "machine.on").state, 2) << "in the document's order";
    EXPECT_EQ(shown(drawn(model, "machine.on"), "machine.on.b").state, 4);
    EXPECT_EQ(shown(drawn(model, "machine.on"), "machine.on.last").state, std::nullopt) << "is never active";
    EXPECT_EQ(shown(drawn(model, "machine"), "machine.on.b.1").state, 2) << "it leaves `on`, too";
    auto without = model;
    auto& text = bf::model::find(without, "machine")->settings[0].value.text;
    text.erase(text.find(R"("initial": "b", )"), 16);
    EXPECT_EQ(shown(drawn(without, "machine.on"), "machine.on.a").title, "a, first state")
        << "and not the history before it";
    EXPECT_THROW(drawn(model, "machine.off"), bf::model::Errors) << "has no states inside";
}

TEST(DrawChart, AStateMachineIsEnteredAndItsStatesAreNot) {
    const auto model = model_of(cycle);
    EXPECT_EQ(shown(drawn(model, "inner"), "inner.machine").kind, Element::Kind::chart);
    EXPECT_THROW(drawn(model, "inner.machine.idle"), bf::model::Errors);
}

TEST(DrawChart, AStateKeepsItsSizeAndItsPlaceWhateverTransitionsItHas) {
    const std::string layout = "layout:\n  blocks:\n    inner.machine.idle: {x: 40, y: 60}\n"
                               "    inner.machine.move: {x: 400, y: 300}\n"
                               "    inner.machine.hold: {x: 700, y: 80}\n";
    const auto bounds_with = [&](const std::string& transitions) {
        const Drawing drawing = drawn(model_of(transitions, layout));
        std::vector<std::array<double, 4>> all;
        for (const auto& element : drawing.elements)
            if (element.kind == Element::Kind::state)
                all.push_back(
                    {element.bounds.x, element.bounds.y, element.bounds.width, element.bounds.height});
        return all;
    };
    const auto alone = bounds_with("[1 2 0 1]");
    std::string rows = "[1 2 0 1";
    for (int n = 2; n <= 12; ++n) {
        rows += n % 2 ? "; 1 2 1 0" : "; 2 1 0 1";
        EXPECT_EQ(bounds_with(rows + "]"), alone) << n << " transitions";
    }
}

/// The letters of a text: none of them reaches further up or down, or is wider on average.
Rectangle letters(const Shape& text) {
    const double width = 0.5 * text.size * static_cast<double>(text.text.size()),
                 left = text.points[0].x - (text.align == Align::end ? width : 0);
    return {left, text.points[0].y - 0.75 * text.size, width, 0.9 * text.size};
}
bool runs_through(const std::vector<Point>& way, const Rectangle& r) {
    for (std::size_t k = 1; k < way.size(); ++k)
        for (int i = 0; i <= 400; ++i) { // point by point
            const double x = way[k - 1].x + (way[k].x - way[k - 1].x) * i / 400,
                         y = way[k - 1].y + (way[k].y - way[k - 1].y) * i / 400;
            if (x > r.x && x < r.x + r.width && y > r.y && y < r.y + r.height) return true;
        }
    return false;
}

TEST(DrawChart, GuardsStandOnNoOtherTransitionStateOrGuard) {
    const std::string placed = "layout:\n  blocks:\n    inner.machine.idle: {x: 40, y: 60}\n"
                               "    inner.machine.move: {x: 300, y: 60}\n"
                               "    inner.machine.hold: {x: 300, y: 200}\n";
    for (const std::string& layout : {std::string(), placed})
        for (const char* transitions : {cycle, "[1 2 1 0; 1 3 2 0; 2 1 3 0; 2 3 1 0.5; 3 1 2 0; 3 2 3 1]",
                                        "[1 2 1 0; 1 2 2 0; 1 2 3 0; 2 1 1 0; 2 1 2 0; 2 1 3 0]",
                                        "[1 3 1 0; 2 3 2 0; 3 1 0 4; 3 2 3 2]"}) {
            const Drawing drawing = drawn(model_of(transitions, layout));
            for (const auto& one : drawing.elements) {
                if (one.kind != Element::Kind::wire || one.shapes.back().kind != Shape::Kind::text) continue;
                const Rectangle guard = letters(one.shapes.back());
                for (const auto& other : drawing.elements) {
                    if (&other == &one) continue;
                    EXPECT_FALSE(other.kind == Element::Kind::wire && runs_through(other.corners, guard))
                        << transitions << ": " << other.title << " runs through the guard of " << one.title;
                    const Rectangle& b = other.bounds;
                    const Rectangle area = other.kind == Element::Kind::state ? b
                                           : other.shapes.back().kind == Shape::Kind::text
                                               ? letters(other.shapes.back())
                                               : Rectangle{};
                    EXPECT_FALSE(guard.x < area.x + area.width && area.x < guard.x + guard.width &&
                                 guard.y < area.y + area.height && area.y < guard.y + guard.height)
                        << transitions << ": the guard of " << one.title << " stands on " << other.title;
                }
            }
        }
}

TEST(DrawChart, NamesWhatDrivesEachCondition) {
    const auto model = bf::formats::read_yaml_text(
        "model: m\nstep: 0.1\nblocks:\n  near: {block: Constant}\n  pair: {block: Constant, value: [1, 0]}\n"
        "  all: {block: Mux, inputs: 3}\n  one: {block: Mux, inputs: 1}\n"
        "  a: {block: StateMachine}\n  b: {block: StateMachine}\n  c: {block: StateMachine}\n"
        "  d: {block: StateMachine}\n"
        "connections: {near: [all.u1, all.u3, one], pair: [all.u2, b], all: a, one: c}\n");
    const auto known = bf::examine(model, "m.yaml");
    using Names = std::vector<std::string>;
    EXPECT_EQ(conditions_of(model, "a", known.diagram), (Names{"near", "pair(1)", "pair(2)", "near"}));
    EXPECT_EQ(conditions_of(model, "b", known.diagram), (Names{"pair(1)", "pair(2)"}));
    EXPECT_EQ(conditions_of(model, "c", known.diagram), Names{"near"});
    EXPECT_EQ(conditions_of(model, "d", known.diagram), Names()) << "nothing is wired";
    EXPECT_EQ(conditions_of(model, "a", {}), (Names{"near", "pair", "near"})) << "before it is checked";
    EXPECT_EQ(conditions_of(model, "", known.diagram), Names());
}

} // namespace

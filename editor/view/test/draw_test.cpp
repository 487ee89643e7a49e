#include "bf/view/draw.hpp"

#include "bf/formats/yaml.hpp"
#include "bf/library/load.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "growth.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <set>

namespace {

using namespace bf::editor;
using Kind = Element::Kind;

/// A text as `bf edit` knows it: document and what elaboration says of it.
struct Known {
    explicit Known(const std::string& text) : model(bf::formats::read_yaml_text(text)) { check(); }
    explicit Known(bf::model::Model m) : model(std::move(m)) { check(); }
    void check() { examined = std::make_unique<bf::ExaminedModel>(bf::examine(model, "model.yaml")); }
    Drawing draw(const std::string& system = "", const DrawOptions& options = {}) const {
        return bf::editor::draw(model, system, examined->diagram, examined->diagnostics, options);
    }
    bf::model::Model model;
    std::unique_ptr<bf::ExaminedModel> examined;
};

const Element& find(const Drawing& drawing, const std::string& path, Kind kind = Kind::block) {
    for (const auto& element : drawing.elements)
        if (element.path == path && element.kind == kind) return element;
    throw std::runtime_error("nothing is drawn of " + path);
}

std::string texts(const Element& element, Style style) {
    std::string all;
    for (const auto& shape : element.shapes)
        if (shape.kind == Shape::Kind::text && shape.style == style)
            all += (all.empty() ? "" : "|") + shape.text;
    return all;
}

bool overlap(const Rectangle& a, const Rectangle& b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Rectangle around(const Shape& shape) {
    const auto [left, right] = std::ranges::minmax(shape.points, {}, &Point::x);
    const auto [top, bottom] = std::ranges::minmax(shape.points, {}, &Point::y);
    return {left.x, top.y, right.x - left.x, bottom.y - top.y};
}

bool inside(const Point& p, const Rectangle& r) {
    return p.x > r.x && p.x < r.x + r.width && p.y > r.y && p.y < r.y + r.height;
}

std::string motor() { return BF_SOURCE_DIRECTORY "/docs/start/motor.yaml"; }

constexpr const char* loop = "model: loop\n"
                             "step: 0.01\n"
                             "inputs: [r]\n"
                             "outputs: [y]\n"
                             "variables: {Kp: 3}\n"
                             "blocks:\n"
                             "  error: {block: Sum, signs: +-}\n"
                             "  law: {block: Gain, K: Kp, doc: Proportional.}\n"
                             "  plant: {block: TransferFunction, numerator: 1, denominator: [1 2 0.5]}\n"
                             "connections:\n"
                             "  r: error.u1\n"
                             "  error: law\n"
                             "  law: plant\n"
                             "  plant: [error.u2, y]\n";

TEST(Draw, ShowsEachBlockPortAndWireOnce) {
    const Drawing drawing = Known(loop).draw();
    std::multiset<std::string> drawn;
    for (const auto& element : drawing.elements) drawn.insert(element.path);
    EXPECT_EQ(drawn, (std::multiset<std::string>{"r", "error.u1", "error", "law", "law", "plant", "plant",
                                                 "error.u2", "y", "y"}));
    EXPECT_EQ(find(drawing, "r", Kind::input).ports.size(), 1u);
    EXPECT_EQ(find(drawing, "error.u2", Kind::wire).from, "plant");
}

TEST(Draw, WiresEndAtTheirPorts) {
    const Drawing drawing = Known(loop).draw();
    const Element& error = find(drawing, "error");
    const Element& wire = find(drawing, "error.u2", Kind::wire);
    EXPECT_EQ(wire.shapes[0].points.back(), error.ports[1].at);
    EXPECT_EQ(error.ports[1].name, "u2");
    EXPECT_TRUE(error.ports[1].is_wired);
    EXPECT_EQ(find(drawing, "law", Kind::wire).shapes[0].points.front(), error.ports[2].at);
}

TEST(Draw, ShowsWhatABlockComputes) {
    const Drawing drawing = Known(loop).draw();
    EXPECT_EQ(texts(find(drawing, "law"), Style::value), "Kp");
    EXPECT_EQ(find(drawing, "law").shapes[0].points.size(), 3u) << "a gain is a triangle";
    EXPECT_EQ(texts(find(drawing, "error"), Style::value), "+|−");
    EXPECT_EQ(texts(find(drawing, "plant"), Style::value), "1|s² + 2 s + 0.5");
    EXPECT_EQ(find(drawing, "law").title, "law, Gain, K = Kp");
    EXPECT_EQ(find(drawing, "law").description, "Proportional.");
}

TEST(Draw, SaysSizesTypesRatesAndUnitsWhereTheyAreAsked) {
    const Known known(loop);
    EXPECT_EQ(texts(find(known.draw(), "law", Kind::wire), Style::label), "");
    DrawOptions all;
    all.sizes = all.types = true;
    EXPECT_EQ(texts(find(known.draw("", all), "law", Kind::wire), Style::label).substr(0, 4), "scal");
    EXPECT_EQ(find(known.draw(), "law").ports[0].about, "scalar double, continuous");
    const Drawing drawing = known.draw();
    EXPECT_EQ(drawing.rates.at(static_cast<std::size_t>(*find(drawing, "plant").rate)), "continuous");
}

TEST(Draw, SaysNamesOfSignalsAtTheirWiresAndWhereTheModelKeepsThem) {
    Known known(std::string(loop) + "signals: {wanted: law}\n"
                                    "record: [plant.y, wanted]\nplots: {Law: [wanted, error], All: ['*']}\n");
    const Drawing drawing = known.draw();
    const Element& wire = find(drawing, "plant", Kind::wire);
    EXPECT_EQ(texts(wire, Style::label), "wanted");
    DrawOptions sizes;
    sizes.sizes = true;
    EXPECT_EQ(texts(find(known.draw("", sizes), "plant", Kind::wire), Style::label).substr(0, 7), "wanted ");
    const auto kept = [&](int number) {
        std::set<std::string> all;
        for (const auto& one : drawing.signals.at(static_cast<std::size_t>(number)).kept)
            all.insert(one.plot + ": " + one.entry);
        return all;
    };
    EXPECT_EQ(drawing.signals.at(static_cast<std::size_t>(wire.signal)).path, "law");
    EXPECT_EQ(drawing.signals.at(static_cast<std::size_t>(wire.signal)).name, "wanted");
    EXPECT_EQ(kept(wire.signal), (std::set<std::string>{": wanted", "Law: wanted", "All: "}));
    EXPECT_EQ(kept(find(drawing, "plant").ports[1].signal), (std::set<std::string>{": plant.y", "All: "}))
        << "called otherwise than its wires do";
    EXPECT_EQ(find(drawing, "plant").ports[0].signal, wire.signal) << "an input carries what is wired to it";
    EXPECT_EQ(find(drawing, "y", Kind::output).ports[0].signal, find(drawing, "error.u2", Kind::wire).signal);
}

TEST(Draw, ShowsOpenPortsHollowAndMarksThemOnDemand) {
    const Known known("model: m\nstep: 0.1\nblocks:\n  s: {block: Sum, signs: ++}\n  c: {block: Constant}\n"
                      "connections: {c: s.u1}\n");
    DrawOptions quiet;
    quiet.marks_open = false;
    const auto hollow = [](const Element& element) {
        std::vector<Point> middles;
        for (const auto& shape : element.shapes)
            if (shape.style == Style::open)
                middles.push_back({(shape.points[0].x + shape.points[1].x) / 2,
                                   (shape.points[0].y + shape.points[1].y) / 2});
        return middles;
    };
    const Drawing drawing = known.draw("", quiet);
    const Element& sum = find(drawing, "s");
    EXPECT_TRUE(sum.marks.empty());
    EXPECT_EQ(hollow(sum), (std::vector<Point>{sum.ports[1].at, sum.ports[2].at}));
    EXPECT_TRUE(hollow(find(drawing, "c")).empty());
    ASSERT_EQ(find(known.draw(), "s").marks.size(), 1u);
    EXPECT_EQ(find(known.draw(), "s").marks[0].message, "input 'u2' is not connected");
}

TEST(Draw, WritesLabelsWholeWhereALevelPieceHasRoom) {
    const Known known(
        "model: m\nstep: 0.01\nblocks:\n  fast: {block: RandomUniform}\n  gain: {block: Gain, period: 0.02}\n"
        "  far: {block: Gain}\nconnections: {fast: gain, gain: far}\n"
        "layout:\n  blocks:\n    fast: {x: 0, y: 0}\n    gain: {x: 70, y: 0}\n    far: {x: 300, y: 0}\n");
    DrawOptions rates;
    rates.rates = true;
    EXPECT_EQ(texts(find(known.draw("", rates), "far", Kind::wire), Style::label), "20 ms");
    DrawOptions all;
    all.sizes = all.types = all.rates = true;
    EXPECT_EQ(texts(find(known.draw("", all), "far", Kind::wire), Style::label), "scalar double 20 ms");
    const std::string close = texts(find(known.draw("", all), "gain", Kind::wire), Style::label);
    EXPECT_TRUE(close.ends_with("…")) << close;
}

TEST(Draw, BoundsHoldAllTexts) {
    const Known known(
        "model: m\nstep: 1\nblocks:\n  a_name_that_is_longer_than_its_block: {block: Constant}\n");
    const Drawing drawing = known.draw();
    const Element& block = find(drawing, "a_name_that_is_longer_than_its_block");
    EXPECT_LT(drawing.bounds.x, block.bounds.x - 10);
    EXPECT_GT(drawing.bounds.x + drawing.bounds.width, block.bounds.x + block.bounds.width + 10);
    EXPECT_GT(drawing.bounds.y + drawing.bounds.height, block.bounds.y + block.bounds.height + 10);
}

TEST(Draw, LooksIntoSubsystemsAndRefusesOthers) {
    const Known known(bf::formats::read_yaml(motor()));
    EXPECT_EQ(find(known.draw(), "controller", Kind::subsystem).ports.size(), 3u);
    const Drawing inside = known.draw("controller");
    EXPECT_EQ(find(inside, "controller.reference", Kind::input).title, "reference, input");
    EXPECT_EQ(texts(find(inside, "controller.proportional"), Style::value), "Gain.Kp");
    EXPECT_THROW(known.draw("controller.error"), bf::model::Errors);
    EXPECT_THROW(known.draw("nowhere"), bf::model::Errors);
}

TEST(Draw, BlocksWithoutAPlaceOverlapNothing) {
    for (const std::string model :
         {"docs/start/motor.yaml", "examples/cart_pole/model.yaml", "examples/stick_slip/model.yaml",
          "examples/thermostat/model.yaml", "examples/double_pendulum/model.yaml",
          "examples/buck_converter/model.yaml"}) {
        const std::string file = std::string(BF_SOURCE_DIRECTORY "/") + model;
        const bf::model::Model read = bf::formats::read_yaml(file);
        const bf::ExaminedModel examined = bf::examine(file);
        std::vector<std::string> systems{""};
        bf::model::walk(read, [&](const std::string& path, const bf::model::Block& block) {
            if (block.content()) systems.push_back(path);
        });
        for (const auto& system : systems) {
            const Drawing drawing = draw(read, system, examined.diagram, {});
            for (const auto& a : drawing.elements)
                for (const auto& b : drawing.elements)
                    if (&a < &b && a.kind != Kind::wire && b.kind != Kind::wire) {
                        EXPECT_FALSE(overlap(a.bounds, b.bounds))
                            << model << ": " << a.path << " and " << b.path;
                    }
        }
    }
}

TEST(Draw, StandsWhereTheDocumentSaysAndOtherBlocksBelow) {
    Known known(loop);
    namespace op = bf::model::operations;
    bf::model::edit(known.model, op::Move{"law", {300, 200}});
    bf::model::edit(known.model, op::Flip{"law"});
    known.check();
    const Drawing drawing = known.draw();
    const Element& law = find(drawing, "law");
    EXPECT_EQ(law.bounds.x, 300);
    EXPECT_EQ(law.bounds.y, 200);
    EXPECT_GT(law.ports[0].at.x, law.ports[1].at.x) << "its input comes from the right";
    for (const auto& element : drawing.elements)
        EXPECT_TRUE(element.kind != Kind::block || element.path == "law" || element.bounds.y > 240)
            << element.path;
    DrawOptions dragged;
    dragged.moved["law"] = {.at = {10, 20}};
    EXPECT_EQ(find(known.draw("", dragged), "law").bounds.x, 10);
}

TEST(Draw, ShowsWhatIsTriedAsIfTheDocumentSaidSo) {
    Known known(loop);
    namespace op = bf::model::operations;
    for (const auto& [path, at] : unplaced(known.model, "", known.examined->diagram))
        bf::model::edit(known.model, op::Move{path, at});
    bf::model::edit(known.model,
                    op::Annotate{"why", bf::model::Note{.name = "why", .text = "so", .at = {5, 6}}});
    DrawOptions tried;
    tried.moved["law"] = {.at = {310, 220}, .size = Point{90, 70}};
    tried.bent["law"] = {{250, 0}, {250, 255}};
    tried.moved_notes["why"] = {50, 60};
    const Drawing seen = known.draw("", tried);
    const Element& law = find(seen, "law");
    EXPECT_EQ(law.bounds.width, 90);
    EXPECT_EQ(law.bounds.height, 70);
    EXPECT_EQ(find(seen, "why", Kind::note).bounds.y, 60);
    bf::model::edit(known.model, op::Move{"law", {310, 220}});
    bf::model::edit(known.model, op::Resize{"law", Point{90, 70}});
    bf::model::edit(known.model, op::Bend{"law", {{250, 0}, {250, 255}}});
    bf::model::edit(known.model,
                    op::Annotate{"why", bf::model::Note{.name = "why", .text = "so", .at = {50, 60}}});
    EXPECT_EQ(to_svg(seen), to_svg(known.draw()));
}

TEST(Draw, LabelsStandForAWire) {
    Known known(std::string(loop) +
                "signals: {speed: plant}\nlayout: {wires: {error.u2: labels, y: labels}}\n");
    const Drawing drawing = known.draw();
    const Element& back = find(drawing, "error.u2", Kind::wire);
    EXPECT_TRUE(back.as_labels);
    EXPECT_TRUE(back.corners.empty());
    EXPECT_EQ(texts(back, Style::label), "speed|speed") << "at its end, and at the source";
    EXPECT_EQ(texts(find(drawing, "y", Kind::wire), Style::label), "speed") << "the source has one for all";
    const auto ends_at = [&](const Point& port) {
        return std::ranges::count_if(back.shapes, [&](const Shape& shape) {
            return shape.kind == Shape::Kind::line && shape.points.back() == port;
        });
    };
    EXPECT_EQ(ends_at(find(drawing, "error").ports[1].at), 1);
    EXPECT_EQ(ends_at(find(drawing, "plant").ports[1].at), 1);
    for (const char* to : {"error.u2", "y"})
        for (const Shape& shape : find(drawing, to, Kind::wire).shapes)
            for (const Element& element : drawing.elements)
                EXPECT_FALSE(shape.kind == Shape::Kind::polygon && element.kind != Kind::wire &&
                             overlap(around(shape), element.bounds))
                    << to << " has no room beside " << element.path;
    const Element& other = find(drawing, "law", Kind::wire);
    EXPECT_FALSE(other.as_labels);
    EXPECT_GE(other.corners.size(), 2u);
}

TEST(Draw, LabelsNeedNoneAtASourceWithALine) {
    Known known(std::string(loop) + "layout: {wires: {error.u2: labels}}\n");
    const Drawing drawing = known.draw();
    EXPECT_EQ(texts(find(drawing, "error.u2", Kind::wire), Style::label), "plant");
    EXPECT_EQ(texts(find(drawing, "y", Kind::wire), Style::label), "plant") << "stands along the line";
}

TEST(Draw, LabelsStandOutsideOfPortsOnEachSide) {
    for (const std::string side : {"left", "right", "top", "bottom"}) {
        Known known(std::string(loop) + "layout:\n  blocks: {plant: {x: 300, y: 200, sides: {y: " + side +
                    "}}, law: {x: 100, y: 200}, error: {x: 0, y: 200}}\n"
                    "  wires: {y: labels, error.u2: labels}\n");
        const Drawing drawing = known.draw();
        const Rectangle block = find(drawing, "plant").bounds;
        for (const char* to : {"error.u2", "y"})
            for (const Shape& shape : find(drawing, to, Kind::wire).shapes)
                for (const Point& p : shape.points) EXPECT_FALSE(inside(p, block)) << side;
        EXPECT_EQ(texts(find(drawing, "error.u2", Kind::wire), Style::label), "plant|plant") << side;
    }
}

/// Does a piece of the wire run through the inside of the rectangle?
bool runs_through(const Element& wire, const Rectangle& r) {
    for (std::size_t k = 1; k < wire.corners.size(); ++k)
        if (overlap(around({Shape::Kind::line, Style::wire, {wire.corners[k - 1], wire.corners[k]}}), r))
            return true;
    return false;
}

TEST(Draw, ALabelWithLittleRoomHidesNothingAndLeavesOtherWiresTheirWay) {
    for (int apart = 4; apart <= 120; apart += 4) { // of the chart and what a label stands at
        Known known("model: m\nstep: 0.1\nblocks:\n  c: {block: Clock}\n  chart: {block: Gain}\n"
                    "  is_running: {block: Gain}\n  filled: {block: Gain}\n  back: {block: Gain}\n"
                    "connections: {c: chart, chart: [is_running, back], back: filled}\n"
                    "layout:\n  blocks:\n    c: {x: 100, y: 0}\n    chart: {x: 300, y: 0}\n"
                    "    filled: {x: 200, y: 60}\n    back: {x: 0, y: 100}\n    is_running: {x: " +
                    std::to_string(340 + apart) + ", y: 0}\n  wires: {is_running: labels}\n");
        const Drawing drawing = known.draw();
        const Element& back = find(drawing, "back", Kind::wire);
        for (const char* block : {"c", "chart", "is_running", "filled", "back"})
            EXPECT_FALSE(runs_through(back, find(drawing, block).bounds)) << block << " " << apart;
        if (apart < 44) continue; // from there on a letter has room
        for (const Shape& shape : find(drawing, "is_running", Kind::wire).shapes)
            EXPECT_FALSE(shape.kind == Shape::Kind::polygon &&
                         overlap(around(shape), find(drawing, "chart").bounds))
                << apart;
    }
}

TEST(Draw, ArrangingStraightensWiresAndLeavesLabels) {
    Known known(std::string(loop) +
                "layout:\n  blocks: {error: {x: 300, y: 0}, plant: {x: 0, y: 0}}\n"
                "  wires: {error.u2: [[280, 5], [280, 70]], law: [[0, 99]], y: labels}\n");
    const auto before = known.draw();
    bf::model::edit(known.model, arranged(known.model, "", known.examined->diagram));
    ASSERT_EQ(known.model.layout.wires.size(), 1u);
    EXPECT_EQ(known.model.layout.wires[0].path, "y");
    Known fresh{std::string(loop) + "layout: {wires: {y: labels}}\n"};
    EXPECT_EQ(to_svg(known.draw()), to_svg(fresh.draw())) << "as if nobody had placed anything";
}

TEST(Draw, WiresTellAllTheirCorners) {
    const Drawing drawing = Known(loop).draw();
    const Element &own = find(drawing, "error.u2", Kind::wire), &error = find(drawing, "error");
    EXPECT_EQ(own.corners.front(), find(drawing, "plant").ports[1].at) << "not where it leaves another wire";
    EXPECT_EQ(own.corners.back(), error.ports[1].at);
    for (std::size_t k = 1; k < own.corners.size(); ++k)
        EXPECT_TRUE(own.corners[k].x == own.corners[k - 1].x || own.corners[k].y == own.corners[k - 1].y);
}

TEST(Draw, PortsOfAGroupStandBesideTheirBlocksLevelWithThem) {
    Known known(std::string(loop) +
                "layout:\n  blocks:\n    r: {x: 0, y: 40}\n    error: {x: 100, y: 30}\n"
                "    law: {x: 200, y: 20}\n    plant: {x: 300, y: 200}\n    y: {x: 500, y: 210}\n");
    bf::model::edit(known.model, bf::model::operations::Group{"", {"law", "plant"}, "inner"});
    known.check();
    const Drawing inside = known.draw("inner");
    const Element &law = find(inside, "inner.law"), &plant = find(inside, "inner.plant");
    const Element &input = find(inside, "inner.u", Kind::input),
                  &output = find(inside, "inner.y", Kind::output);
    EXPECT_EQ(input.ports[0].at.y, law.ports[0].at.y);
    EXPECT_LT(input.bounds.x + input.bounds.width, law.bounds.x);
    EXPECT_GT(input.bounds.x + input.bounds.width, law.bounds.x - 100);
    EXPECT_EQ(output.ports[0].at.y, plant.ports[1].at.y);
    EXPECT_GT(output.bounds.x, plant.bounds.x + plant.bounds.width);
    EXPECT_LT(output.bounds.x, plant.bounds.x + plant.bounds.width + 100);
}

TEST(Draw, MarksWhatIsWrongAndWhatItStandsIn) {
    Known known(bf::formats::read_yaml(motor()));
    bf::model::edit(known.model, bf::model::operations::Set{"controller.proportional", "K", "nothing"});
    known.check();
    const Drawing inside = known.draw("controller");
    const Element& wrong = find(inside, "controller.proportional");
    ASSERT_EQ(wrong.marks.size(), 1u);
    EXPECT_EQ(wrong.marks[0].message, known.examined->diagnostics[0].message);
    EXPECT_TRUE(find(inside, "controller.integral").marks.empty());
    EXPECT_EQ(find(known.draw(), "controller", Kind::subsystem).marks.size(), 1u);
    EXPECT_EQ(wrong.ports.size(), 2u) << "what cannot be made still has the ports that are wired";
    const Element& wire = find(inside, "controller.proportional", Kind::wire);
    EXPECT_TRUE(wire.marks.empty()) << "a wrong setting is no mistake of the wire";
}

TEST(Draw, TheSameModelGivesTheSameBytes) {
    EXPECT_EQ(to_svg(Known(loop).draw()), to_svg(Known(loop).draw()));
}

TEST(Draw, NamesAndValuesAreTextInSvg) {
    const Known known(
        "model: m\nstep: 1\nblocks:\n  \"</svg><script>\": {block: Constant, value: \"1 < 2 & 3\"}\n");
    const std::string svg = to_svg(known.draw());
    EXPECT_EQ(svg.find("<script"), std::string::npos);
    EXPECT_NE(svg.find("&lt;script&gt;"), std::string::npos);
    EXPECT_NE(svg.find("1 &lt; 2 &amp; 3"), std::string::npos);
}

/// Blocks in a row, each of which also feeds those two and three further on.
std::string fans(int blocks) {
    std::string text = "model: fans\nstep: 1\nblocks:\n  b0: {block: Constant}\n", wires = "connections:\n";
    for (int i = 1; i < blocks; ++i) {
        const auto name = [](int k) { return "b" + std::to_string(k); };
        text += "  " + name(i) + ": {block: Sum, signs: " + (i < 3 ? "+" : "+++") + "}\n";
        wires += "  " + name(i - 1) + ": [" + name(i) + (i < 3 ? "" : ".u1");
        for (int k : {i + 1, i + 2})
            if (k >= 3 && k < blocks) wires += ", " + name(k) + (k == i + 1 ? ".u2" : ".u3");
        wires += "]\n";
    }
    return text + wires;
}

TEST(Growth, OfDrawing) {
    const auto drawing = [](std::size_t blocks) {
        return [model = bf::formats::read_yaml_text(fans(static_cast<int>(blocks))), blocks] {
            EXPECT_GT(draw(model, "", bf::Diagram(), {}).elements.size(), 3 * blocks);
        };
    };
    // A quick part of it looks at pairs: whether boxes are in the way of wires.
    bf::test::expect_growth("drawing", drawing(500), drawing(2000), 12);
}

/// "name side" of each port, by where it stands on its block.
std::set<std::string> sides(const Element& element) {
    std::set<std::string> all;
    const Rectangle& r = element.bounds;
    for (const auto& port : element.ports)
        all.insert(port.name + (port.at.x == r.x              ? " left"
                                : port.at.x == r.x + r.width  ? " right"
                                : port.at.y == r.y            ? " top"
                                : port.at.y == r.y + r.height ? " bottom"
                                                              : " nowhere"));
    return all;
}

std::string turned_model(const std::string& look) {
    return "model: m\nstep: 0.01\nblocks:\n  s: {block: Switch}\n  g: {block: Gain}\n  e: {block: Sum, "
           "signs: +-}\n"
           "  sub:\n    inputs: [u, v]\n    outputs: [y]\n    execution: enabled\n    blocks: {}\n"
           "connections: {s: g, g: [e.u1, sub.u]}\n"
           "layout:\n  blocks:\n    s: {x: 0, y: 0, " +
           look + "}\n    g: {x: 200, y: 0, " + look + "}\n    e: {x: 400, y: 0, " + look +
           "}\n    sub: {x: 600, y: 200, " + look + "}\n";
}

TEST(Draw, ABlockThatWasPutIntoAWireStandsBetweenItsEndsWhereThereIsRoom) {
    const auto convert = [](const std::string& x, const std::string& more = "") {
        const Known known(
            "model: m\nblocks:\n  a: {block: Constant}\n  all: {block: Mux, inputs: 2}\n"
            "  new: {block: Convert}\n  other: {block: Constant}\n"
            "connections: {a: new, new: all.u2, other: all.u1}\n"
            "layout:\n  blocks:\n    a: {x: 0, y: 200}\n    other: {x: 0, y: 0}\n    all: {x: " +
            x + ", y: 0}\n" + more);
        const Drawing drawing = known.draw();
        const auto by_name = [](const std::string& name) {
            return [name](const Port& p) { return p.name == name; };
        };
        const Element &new_ = find(drawing, "new"), &all = find(drawing, "all");
        const bool is_level = std::ranges::find_if(new_.ports, by_name("y"))->at.y ==
                              std::ranges::find_if(all.ports, by_name("u2"))->at.y;
        for (const auto& element : drawing.elements)
            EXPECT_FALSE(element.kind == Kind::block && element.path != "new" &&
                         overlap(element.bounds, new_.bounds))
                << element.path;
        const bool is_between = new_.bounds.x > find(drawing, "a").bounds.width &&
                                new_.bounds.x + new_.bounds.width < all.bounds.x;
        return is_level && is_between;
    };
    EXPECT_TRUE(convert("300"));
    EXPECT_FALSE(convert("90")) << "there is no room";
}

TEST(Draw, TurnsBlocksWithTheirPorts) {
    using Sides = std::set<std::string>;
    const auto drawn = [](const std::string& look) { return Known(turned_model(look)).draw(); };
    EXPECT_EQ(sides(find(drawn("flipped: true"), "g")), (Sides{"u right", "y left"}));
    EXPECT_EQ(sides(find(drawn("rotated: 90"), "g")), (Sides{"u top", "y bottom"}));
    EXPECT_EQ(sides(find(drawn("rotated: 180"), "g")), (Sides{"u right", "y left"}));
    EXPECT_EQ(sides(find(drawn("rotated: 270"), "g")), (Sides{"u bottom", "y top"}));
    EXPECT_EQ(sides(find(drawn("flipped: true, rotated: 90"), "g")), (Sides{"u bottom", "y top"}));
    EXPECT_EQ(sides(find(drawn("rotated: 90"), "e")), (Sides{"u1 top", "u2 left", "y bottom"}));
    EXPECT_EQ(sides(find(drawn("rotated: 90"), "sub", Kind::subsystem)),
              (Sides{"u top", "v top", "y bottom", "enable right"}));
    const Drawing turned = drawn("rotated: 90");
    const Point tip = find(turned, "g").shapes[0].points[2];
    const Rectangle& r = find(turned, "g").bounds;
    EXPECT_EQ(tip, (Point{r.x + r.width / 2, r.y + r.height}))
        << "the triangle points to where the signal goes";
}

TEST(Draw, PutsPortsOnChosenSides) {
    using Sides = std::set<std::string>;
    const Drawing drawing = Known(turned_model("rotated: 90, sides: {u: left, y: left}")).draw();
    EXPECT_EQ(sides(find(drawing, "sub", Kind::subsystem)),
              (Sides{"u left", "v top", "y left", "enable right"}));
    const Element& wire = find(drawing, "sub.u", Kind::wire);
    EXPECT_EQ(wire.corners.back(), find(drawing, "sub", Kind::subsystem).ports[0].at);
    const Point last = wire.corners[wire.corners.size() - 2];
    EXPECT_LT(last.x, wire.corners.back().x) << "it comes from outside of the block";
    EXPECT_EQ(last.y, wire.corners.back().y);
}

TEST(Draw, WiresLeaveAndReachPortsOnEachSideFromOutside) {
    for (const char* from : {"left", "right", "top", "bottom"})
        for (const char* to : {"left", "right", "top", "bottom"}) {
            const Drawing drawing =
                Known("model: m\nstep: 1\nblocks: {a: {block: Gain}, b: {block: Gain}}\nconnections: {a: b}\n"
                      "layout: {blocks: {a: {x: 0, y: 0, sides: {y: " +
                      std::string(from) + "}}, b: {x: 300, y: 200, sides: {u: " + to + "}}}}\n")
                    .draw();
            const Element &a = find(drawing, "a"), &b = find(drawing, "b"),
                          &wire = find(drawing, "b", Kind::wire);
            ASSERT_GE(wire.corners.size(), 2u);
            for (std::size_t i = 1; i < wire.corners.size(); ++i) {
                const Point p = wire.corners[i - 1], q = wire.corners[i];
                EXPECT_TRUE(p.x == q.x || p.y == q.y) << from << " " << to;
                for (const Element* block : {&a, &b}) {
                    const Rectangle& r = block->bounds;
                    const Point middle{(p.x + q.x) / 2, (p.y + q.y) / 2};
                    EXPECT_FALSE(middle.x > r.x && middle.x < r.x + r.width && middle.y > r.y &&
                                 middle.y < r.y + r.height)
                        << from << " " << to;
                }
            }
        }
}

TEST(Draw, ASubsystemShowsItsIconOrElseASketch) {
    const auto drawn = [](const std::string& icon) {
        return Known("model: m\nstep: 1\nblocks:\n  part:\n    icon: " + icon +
                     "\n    inputs: [u]\n    blocks: {a: {block: Gain}, b: {block: Terminator}}\n    "
                     "connections: {u: a, a: b}\n"
                     "layout: {blocks: {part: {x: 0, y: 0, width: 120, height: 80}}}\n")
            .draw();
    };
    EXPECT_EQ(texts(find(drawn("spring"), "part", Kind::subsystem), Style::value), "spring");
    const Element sketched = find(drawn("''"), "part", Kind::subsystem);
    EXPECT_EQ(texts(sketched, Style::value), "");
    const auto small = std::ranges::count_if(sketched.shapes, [](const Shape& shape) {
        return shape.kind == Shape::Kind::polygon && shape.style == Style::port;
    });
    EXPECT_EQ(small, 3) << "two blocks and an input";
    EXPECT_EQ(find(drawn("none.svg"), "part", Kind::subsystem).marks.at(0).message,
              "the image 'none.svg' is not there");
}

TEST(Draw, EmbedsImagesInItsPicture) {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "bf_view_images";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "a.svg") << "<svg/>";
    Known known("model: m\nblocks: {}\nlayout: {notes: {n: {image: a.svg, x: 0, y: 0}}}\n");
    DrawOptions options;
    options.folder = folder;
    known.model.where.file = nullptr;
    const Drawing drawing = known.draw("", options);
    EXPECT_NE(to_svg(drawing).find("href=\"data:image/svg+xml;base64,PHN2Zy8+\""), std::string::npos)
        << to_svg(drawing);
    std::filesystem::remove_all(folder);
}

} // namespace

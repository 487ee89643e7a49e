// Where blocks stand and how wires run, of boxes with ports; knows nothing of models.
#pragma once

#include "bf/view/drawing.hpp"

#include <cstddef>
#include <vector>

namespace bf::editor {

using model::Side;

/// What is placed: its size, and where wires begin and end, from its upper left corner.
struct Box {
    struct Pin {
        Point at;
        Side side;
    };
    double width = 0, height = 0;
    std::vector<Pin> pins;
};

/// A pin of a box.
struct PinOf {
    std::size_t box = 0, pin = 0;
};

/// From one output to one input. Wires of one output are one net, which divides.
struct Net {
    PinOf from;
    std::vector<PinOf> to;
};

/// A corner for each box: signals run from left to right, boxes overlap nowhere, few wires cross, and the
/// order of boxes is kept where nothing else decides. The same input gives the same result.
std::vector<Point> arrange(const std::vector<Box>& boxes, const std::vector<Net>& nets);

/// How a wire runs: from its output to its input, by horizontal and vertical pieces.
struct Route {
    std::vector<Point> points;
    std::vector<Point> branches; ///< where it leaves the wires of its net before it
};

/// Routes in the order of nets and their inputs, around the boxes, which stand at `corners`. `bends`, where
/// given (not empty), are the corners that a person drew of that wire; they are kept. Wires of different nets
/// do not lie on each other, and cross rarely.
std::vector<std::vector<Route>> route(const std::vector<Box>& boxes, const std::vector<Point>& corners,
                                      const std::vector<Net>& nets,
                                      const std::vector<std::vector<std::vector<Point>>>& bends = {});

} // namespace bf::editor

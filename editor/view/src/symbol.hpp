#pragma once

#include "bf/model/model.hpp"
#include "bf/view/drawing.hpp"

#include <functional>
#include <string>
#include <vector>

namespace bf::editor {

inline constexpr double port_gap = 20; ///< between neighbouring ports of one side

/// What a block looks like, from its upper left corner; ports are not part of it.
struct Symbol {
    enum class Outline {
        rectangle,
        triangle, ///< points to where signals go
        circle,
        bar,    ///< narrow and filled, where signals join or part
        pill,   ///< an end of signals
        rounded ///< a state
    };
    Outline outline = Outline::rectangle;
    double width = 0, height = 0; ///< least ones
    std::vector<Shape> shapes = {};
    Point middle = {};                   ///< where a text stands, from the middle of the outline
    std::vector<std::string> signs = {}; ///< beside the inputs
    bool follows_signals = false;        ///< do its lines turn with the ports?
};

/// The text of a setting as the model has it, or else what holds without it.
using SettingText = std::function<std::string(const std::string& name)>;

/// Of a block of a library. `rows` is the number of ports on the side that has more.
Symbol symbol_of(const std::string& type, std::size_t rows, const SettingText& setting);

/// The outline as shapes of the given size; signals go to that side.
std::vector<Shape> outline_shapes(Symbol::Outline outline, double width, double height, model::Side to);

/// "[1 2 0.5]" as "s² + 2s + 0.5"; what is no row of numbers stays as it is.
std::string polynomial(const std::string& coefficients, const std::string& variable);

} // namespace bf::editor

#pragma once

#include "bf/recording/reader.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace bf::recording {

/// One line of a panel. A value that is not finite leaves a gap.
struct Curve {
    std::string name;          ///< in the legend
    std::vector<double> time;  ///< seconds, not decreasing
    std::vector<double> value; ///< as many as `time`
    bool reference = false; ///< dashed, in a darker shade of the curve it belongs to: the first reference of
                            ///< a panel to its first other curve, and so on
    bool steps = false;     ///< holds each value until the next: modes, flags, counters
    enum class Mark { none, cross, circle };
    Mark mark = Mark::none; ///< of each sample, instead of a line
};

struct Panel {
    std::string title;
    std::string y_label; ///< quantity or unit, e.g. "N m"
    std::vector<Curve> curves;
    std::vector<std::pair<double, std::string>> names = {}; ///< of values, instead of numbers on the axis
};

/// Panels stacked above one axis, which is that of time where nothing else is said.
struct Figure {
    std::string title;
    std::vector<Panel> panels;
    std::string x_label = "time (s)";
    bool is_logarithmic = false; ///< the common axis
    bool is_equal = false;       ///< a circle in the only panel is a circle
};

/// Draws a figure to a .png or .svg file of `width` x `height` pixels; height 0 chooses one that gives each
/// panel and its legend room. Curves with more samples than pixels are drawn by their extremes per pixel, so
/// that no peak is lost. Runs the program gnuplot. Throws std::runtime_error when the figure cannot be drawn:
/// nothing to draw, times and values of unlike number, another file type, gnuplot missing or failing, file
/// not writable.
void save(const Figure& figure, const std::filesystem::path& path, int width = 960, int height = 0);

/// All elements of a signal, each named after it; integers and booleans as steps.
Panel panel_of(const Channel& channel);

} // namespace bf::recording

#include "bf/recording/plot.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"

#include "gnuplot.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

namespace bf::recording {
namespace {

// Okabe and Ito's colours, which colour-blind people tell apart, without their yellow, which is lost on
// white.
constexpr int palette[] = {0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0x6B6B6B};
// Further rounds through the palette differ by their dashes.
constexpr const char* dashes[] = {"solid", "(12,4)", "(4,3)", "(12,4,3,4)"};

constexpr int right_margin = 18, bottom_margin = 50, panel_title_height = 26, panel_gap = 10;
constexpr int legend_row = 15, letter_width = 7;
constexpr std::size_t longest_name = 40; // in a legend

/// The difference of two such numbers, and of ticks beyond them, is finite.
bool is_drawable(double value) { return std::abs(value) < 1e300; }

struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    void add(double value) {
        if (!is_drawable(value)) return;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    /// Never empty, so that constants and absent data have axes too.
    Range padded(double share) const {
        if (low > high) return {-1, 1};
        if (low == high) {
            const double room = low == 0 ? 1 : 0.1 * std::abs(low);
            return {low - room, high + room};
        }
        // Halves first: the difference of two large numbers may overflow.
        const double room = 2 * share * (high / 2 - low / 2);
        return {low - room, high + room};
    }
};

std::string number(double value) { return number_text(value); }

std::string colour(int rgb, double shade = 1) {
    char text[16];
    const auto part = [&](int shift) { return static_cast<int>(((rgb >> shift) & 0xFF) * shade); };
    std::snprintf(text, sizeof text, "'#%02x%02x%02x'", part(16), part(8), part(0));
    return text;
}

std::size_t letters(const std::string& utf8) {
    return static_cast<std::size_t>(
        std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// Of a long text the beginning and the end.
std::string shortened(const std::string& text, std::size_t most) {
    const std::size_t count = letters(text);
    if (count <= most) return text;
    const std::size_t begin = most / 2, end = count - (most - 1 - begin);
    std::string out;
    std::size_t letter = 0;
    for (const char c : text) {
        if ((c & 0xC0) != 0x80 && ++letter == begin + 1) out += "…";
        if (letter <= begin || letter > end) out += c;
    }
    return out;
}

/// The least of 1, 2, 5, 10, 20, ... (times a power of ten) that leaves `room` pixels from tick to tick.
double tick_step(Range range, int pixels, int room) {
    // Halves, as in Range::padded.
    const double least = (range.high / 2 - range.low / 2) * (2.0 * room / pixels);
    const double power = std::pow(10, std::floor(std::log10(least)));
    for (const double factor : {1, 2, 5})
        if (factor * power >= least) return factor * power;
    return std::max(10 * power, std::numeric_limits<double>::min());
}

/// The samples of a curve as a block of gnuplot data: all, or the extremes within each pixel column.
class Data {
  public:
    Data(const Curve& curve, Range time, int columns) {
        const std::size_t count = curve.time.size();
        if (count <= 4 * static_cast<std::size_t>(columns)) {
            for (std::size_t k = 0; k < count; ++k) point(curve, k);
            hold_last(curve, time);
            return;
        }
        const auto column = [&](std::size_t k) {
            return std::floor((curve.time[k] - time.low) / (time.high - time.low) * columns);
        };
        for (std::size_t first = 0, last; first < count; first = last) {
            std::size_t low = first, high = first;
            for (last = first + 1; last < count && column(last) == column(first); ++last) {
                // Comparisons with NaN are false: one that came first gives way to the next.
                if (!(curve.value[low] <= curve.value[last])) low = last;
                if (!(curve.value[high] >= curve.value[last])) high = last;
            }
            std::size_t shown[] = {first, low, high, last - 1};
            std::sort(std::begin(shown), std::end(shown));
            for (const auto* k = shown; k != std::unique(std::begin(shown), std::end(shown)); ++k)
                point(curve, *k);
        }
        hold_last(curve, time);
    }
    bool drawable() const { return drawable_; }
    const std::string& text() const { return text_; }

  private:
    void point(const Curve& curve, std::size_t k) { point(curve.time[k], curve.value[k]); }
    void point(double t, double value) {
        const bool finite = is_drawable(value) && std::isfinite(t);
        drawable_ = drawable_ || finite;
        text_ += finite ? number(t) + ' ' + number(value) + '\n' : "NaN NaN\n";
    }
    /// What is held, as a constant with its only sample, goes on to the end of the figure.
    void hold_last(const Curve& curve, Range time) {
        if (curve.steps && !curve.time.empty() && curve.time.back() < time.high)
            point(time.high, curve.value.back());
    }
    std::string text_;
    bool drawable_ = false;
};

/// The values of a panel, and where its ticks are.
struct Axis {
    Range values;
    double step;
    int digits; ///< as many as neighbouring ticks need to differ
    Axis(const Panel& panel, int height) {
        bool whole = true;
        for (const Curve& curve : panel.curves)
            for (const double value : curve.value) {
                values.add(value);
                whole = whole && curve.steps && value == std::floor(value);
            }
        values = values.padded(0.06);
        step = std::max(tick_step(values, height, 22), whole ? 1.0 : 0.0);
        const double largest = std::max(std::abs(values.low), std::abs(values.high));
        digits = std::clamp(2 + static_cast<int>(std::log10(largest / step)), 6, 15);
    }
};

void check(const Figure& figure) {
    if (figure.panels.empty()) throw std::runtime_error("the figure '" + figure.title + "' has no panel");
    for (const Panel& panel : figure.panels)
        for (const Curve& curve : panel.curves)
            if (curve.time.size() != curve.value.size())
                throw std::runtime_error("the curve '" + curve.name + "' of the panel '" + panel.title +
                                         "' has " + std::to_string(curve.time.size()) + " times and " +
                                         std::to_string(curve.value.size()) +
                                         " values; it needs as many of each");
}

/// Where everything goes, in pixels from the top left.
struct Layout {
    struct Place {
        int top, height;
        Axis axis;
        int legend_rows() const { return std::max(1, height / legend_row); }
    };
    int width, height, left, legend_column, legend_width;
    std::vector<Place> places; ///< of the panels

    Layout(const Figure& figure, int width, int height) : width(width) {
        const int panels = static_cast<int>(figure.panels.size());
        const int title_height = figure.title.empty() ? 10 : 44;
        const int fixed =
            title_height + bottom_margin + panels * panel_title_height + (panels - 1) * panel_gap;
        if (height > 0 && height < fixed + 30 * panels)
            throw std::runtime_error(std::to_string(height) + " pixels are too low for " +
                                     std::to_string(panels) + " panels; use at least " +
                                     std::to_string(fixed + 30 * panels));
        int bottom = title_height - panel_gap, columns = 0;
        std::size_t longest = 0, longest_value = 9;
        for (const Panel& panel : figure.panels) {
            const int rows = panel.curves.size() > 1 ? static_cast<int>(panel.curves.size()) : 0;
            const int highest = std::max(380, (rows + 1) / 2 * legend_row); // a legend of at most two columns
            const int panel_height = height > 0
                                         ? (height - fixed) / panels
                                         : std::clamp(rows * legend_row, panels > 2 ? 150 : 190, highest);
            places.push_back(
                {bottom + panel_gap + panel_title_height, panel_height, Axis(panel, panel_height)});
            const Place& place = places.back();
            bottom = place.top + place.height;
            columns = std::max(columns, (rows + place.legend_rows() - 1) / place.legend_rows());
            for (const Curve& curve : panel.curves)
                longest = std::max(longest, std::min(letters(curve.name), longest_name));
            for (const auto& [value, name] : panel.names)
                longest_value = std::max(longest_value, std::min(letters(name), longest_name));
            if (panel.names.empty()) // sign and point
                longest_value = std::max(longest_value, static_cast<std::size_t>(place.axis.digits) + 2);
        }
        left = 27 + static_cast<int>(longest_value) * letter_width;
        this->height = height > 0 ? height : bottom + bottom_margin;
        legend_column = static_cast<int>(longest) * letter_width + 40;
        legend_width = columns * legend_column;
        if (plot_width() < 80)
            throw std::runtime_error(std::to_string(width) +
                                     " pixels are too narrow for axes and legend; use at least " +
                                     std::to_string(width - plot_width() + 80));
    }
    int plot_width() const { return width - left - right_margin - legend_width; }
    std::string x(double pixels) const { return "screen " + number(pixels / width); }
    std::string y(double pixels) const { return "screen " + number(1 - pixels / height); }
};

std::string line_style(const Curve& curve, int position) {
    constexpr int colours = std::size(palette), patterns = std::size(dashes);
    const int rgb = palette[position % colours];
    if (curve.reference) return " lw 1.6 dt (6,4) lc rgb " + colour(rgb, 0.45);
    return std::string(" lw 1.5 dt ") + dashes[position / colours % patterns] + " lc rgb " + colour(rgb);
}

/// Writes the script. The legend is made of labels and lines, since gnuplot's own drops the entries for which
/// it sees no room.
class Script {
  public:
    Script(const Layout& layout, bool png) : layout_(layout), png_(png) {}

    std::string figure(const Figure& figure, const std::string& output) {
        Range time;
        for (const Panel& panel : figure.panels)
            for (const Curve& curve : panel.curves)
                for (const double t : curve.time) time.add(t);
        time_ = time.padded(figure.is_equal ? 0.06 : 0);
        if (figure.is_equal) make_equal();
        const double step = figure.is_logarithmic ? 10 : tick_step(time_, layout_.plot_width(), 60);
        // The last sample of a run to 20 s is a little before 20, which shall have its tick nevertheless.
        if (const double tick = step * std::ceil(time_.high / step);
            !figure.is_logarithmic && tick - time_.high < 0.01 * (time_.high - time_.low))
            time_.high = tick;

        add("set encoding utf8");
        add("set terminal ", png_ ? "pngcairo" : "svg", " size ", layout_.width, ",", layout_.height,
            " noenhanced background '#ffffff'", font(1, ""));
        add("set output ", escape::gnuplot(output));
        add("set multiplot");
        add("unset key");
        add("set border 3 lw 0.8 lc rgb '#8a8a8a'");
        add("set grid xtics ytics lt 1 lw 0.6 lc rgb '#e4e4e4'");
        add("set tics nomirror out scale 0.4 textcolor rgb '#404040'");
        add("set lmargin at ", layout_.x(layout_.left));
        add("set rmargin at ", layout_.x(layout_.left + layout_.plot_width()));
        if (figure.is_logarithmic) add("set logscale x\nset mxtics 10");
        add("set xtics ", figure.is_logarithmic ? logarithmic_tics() : number(step));
        add("set xrange [", number(time_.low), ":", number(time_.high), "]");
        if (!figure.title.empty())
            label(figure.title, layout_.left, 22, "left" + font(4.0 / 3, ":Bold"),
                  letters_to_the_right(4.0 / 3));
        for (std::size_t p = 0; p < figure.panels.size(); ++p) {
            const bool last = p + 1 == figure.panels.size();
            add(last ? "set format x '%h'\nset xlabel " + escape::gnuplot(figure.x_label) +
                           " textcolor rgb '#404040'"
                     : "set format x ''");
            panel(figure.panels[p], layout_.places[p]);
        }
        add("unset multiplot");
        add("unset output");
        return std::move(text_);
    }

  private:
    /// Powers of ten; where there are less than two of them also their doubles and halves, or even steps.
    std::string logarithmic_tics() const {
        const auto tics_at = [&](const std::vector<double>& parts) {
            std::vector<double> all;
            for (double decade = std::pow(10, std::floor(std::log10(time_.low))); decade <= time_.high;
                 decade *= 10)
                for (const double part : parts)
                    if (const double at = part * decade;
                        at >= time_.low * (1 - 1e-6) && at <= time_.high * (1 + 1e-6))
                        all.push_back(at);
            return all;
        };
        if (!(time_.low > 0) || tics_at({1}).size() >= 2) return "10";
        auto all = tics_at({1, 2, 5});
        if (all.size() < 2) {
            all.clear();
            const double step = tick_step(time_, layout_.plot_width(), 60);
            for (double at = step * std::ceil(time_.low / step); at <= time_.high; at += step)
                all.push_back(at);
        }
        std::string text;
        for (const double at : all) text += (text.empty() ? "(" : ", ") + number(at);
        return text + ")";
    }
    template <class... Parts> void add(const Parts&... parts) {
        (append(parts), ...);
        text_ += '\n';
    }
    void append(const std::string& part) { text_ += part; }
    void append(int part) { text_ += std::to_string(part); }

    /// An SVG names a family that every viewer has; its sizes are in pixels, and it knows no bold.
    std::string font(double scale, const char* weight) const {
        if (!png_) return " font 'sans-serif," + number(12 * scale) + "'";
        return std::string(" font 'DejaVu Sans") + weight + "," + number(9 * scale) + "'";
    }

    std::size_t letters_to_the_right(double scale) const {
        return static_cast<std::size_t>((layout_.width - layout_.left) / (1.1 * letter_width * scale));
    }

    void label(const std::string& text, double x, double y, const std::string& how, std::size_t most) {
        add("set label ", escape::gnuplot(shortened(text, most)), " at ", layout_.x(x), ",", layout_.y(y),
            " ", how, " textcolor rgb '#303030'");
    }

    /// As many units in a pixel along one axis as along the other.
    void make_equal() {
        const auto& place = layout_.places.front();
        values_ = place.axis.values;
        const double across = (time_.high - time_.low) / layout_.plot_width(),
                     up = (values_->high - values_->low) / place.height;
        Range& narrow = across < up ? time_ : *values_;
        const double room =
            (narrow.high - narrow.low) * (std::max(across, up) / std::min(across, up) - 1) / 2;
        narrow = {narrow.low - room, narrow.high + room};
    }

    void panel(const Panel& panel, const Layout::Place& place) {
        const auto& [top, height, axis] = place;
        const Range values = values_.value_or(axis.values);
        std::string plots;
        int counts[2] = {0, 0}, row = 0; // measured curves and references
        // References last, above the curves they belong to.
        for (const bool reference : {false, true})
            for (const Curve& curve : panel.curves) {
                if (curve.reference != reference) continue;
                const std::string style = line_style(curve, counts[reference]++);
                if (panel.curves.size() > 1) legend(curve.name, style, place, row);
                const Data data(curve, time_, layout_.plot_width());
                const std::string block = "$d" + std::to_string(row++);
                if (!data.drawable()) continue;
                add(block, " << end_of_data\n", data.text(), "end_of_data");
                plots += (plots.empty() ? "plot " : ", ") + block + " using 1:2 with " + with(curve) + style;
            }
        std::string named;
        for (const auto& [value, name] : panel.names)
            named += (named.empty() ? "" : ", ") + escape::gnuplot(shortened(name, longest_name)) + " " +
                     number(value);
        add("set format y '%.", axis.digits, "h'");
        add("set ytics ",
            named.empty() ? number(values_ ? tick_step(values, height, 22) : axis.step) : "(" + named + ")");
        add("set yrange [", number(values.low), ":", number(values.high), "]");
        add("set tmargin at ", layout_.y(top));
        add("set bmargin at ", layout_.y(top + height));
        label(panel.title, layout_.left, top - 11, "left" + font(1, ":Bold"), letters_to_the_right(1));
        label(panel.y_label, 14, top + height / 2.0, "center rotate",
              static_cast<std::size_t>(height / letter_width));
        add(plots.empty() ? "plot NaN" : plots);
        add("unset label");
        add("unset arrow");
    }

    static std::string with(const Curve& curve) {
        if (curve.mark != Curve::Mark::none)
            return curve.mark == Curve::Mark::cross ? "points pt 2" : "points pt 6";
        return curve.steps ? "steps" : "lines";
    }

    void legend(const std::string& name, const std::string& style, const Layout::Place& place, int row) {
        const double x =
            layout_.left + layout_.plot_width() + 16 + row / place.legend_rows() * layout_.legend_column;
        const double y = place.top + 8 + row % place.legend_rows() * legend_row;
        add("set arrow from ", layout_.x(x), ",", layout_.y(y), " to ", layout_.x(x + 20), ",", layout_.y(y),
            " nohead", style);
        label(name, x + 26, y, "left", longest_name);
    }

    const Layout& layout_;
    const bool png_;
    Range time_;
    std::optional<Range> values_; ///< where the axes have the same scale
    std::string text_;
};

bool ends_with(const std::filesystem::path& path, std::string_view end) {
    std::ifstream file(path, std::ios::binary);
    std::string last(64, '\0');
    file.seekg(0, std::ios::end);
    const auto size = std::min<std::streamoff>(file.tellg(), static_cast<std::streamoff>(last.size()));
    if (!file || size < 0) return false;
    file.seekg(-size, std::ios::end);
    file.read(last.data(), size);
    return last.find(end) != std::string::npos;
}

} // namespace

void save(const Figure& figure, const std::filesystem::path& path, int width, int height) {
    const auto fail = [&](const std::string& why) {
        throw std::runtime_error("cannot draw '" + path.string() + "': " + why);
    };
    const std::string extension = path.extension().string();
    const bool png = extension == ".png";
    if (!png && extension != ".svg")
        throw std::runtime_error("figures are .png or .svg files, not '" + extension + "'");
    check(figure);
    const Layout layout(figure, width, height);
    if (const std::string error = run_gnuplot(Script(layout, png).figure(figure, path.string()));
        !error.empty())
        fail("gnuplot failed:\n" + error);
    // gnuplot does not notice a full disk.
    if (!ends_with(path, png ? "IEND" : "</svg>"))
        fail("the file is not whole; check that the disk is not full");
}

Panel panel_of(const Channel& channel) {
    Panel panel{channel.name, channel.info.unit, {}, channel.info.names};
    const bool is_real = channel.info.type == ElementType::Double || channel.info.type == ElementType::Single;
    const bool steps = channel.info.is_held || !is_real;
    for (std::size_t i = 0; i < channel.info.elements(); ++i)
        panel.curves.push_back({channel.element_name(i), channel.times(), channel.values(i), false, steps});
    return panel;
}

} // namespace bf::recording

// Signals from nowhere: constants, functions of time, files.
#include "bf/kernels/sources.hpp"
#include "bf/kernels/guards.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"
#include "table.hpp"

#include <algorithm>
#include <stdexcept>

namespace bf::blocks {

namespace {

using Real = Array<double>;

/// y = value.
class Constant final : public Block {
  public:
    using Block::Block;
    Argument<bool> vector_1d{
        this, "vector_1d", {.initial = true, .doc = "make a row or column 1-D; else keep it a matrix"}};
    AnyShape shape{this};
    Parameter<> value{this,
                      "value",
                      {.shape = shape,
                       .initial = {1},
                       .unit = any_unit,
                       .doc = "the constant; its type is that of y",
                       .as_written = !*vector_1d}};
    Output<> y{this, "y", any(shape)};
    OutputRule rule{this, kernels::Copy{}, y, value};
};

/// y = 0 in the size and type that its reader wants.
class Ground final : public Block {
  public:
    using Block::Block;
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Copy{}, y, Constants({0})};
};

/// y = t.
class ClockBlock final : public Block {
  public:
    using Block::Block;
    Output<double> y{this, "y", {.unit = unit<"s">, .doc = "time of the step"}};
    OutputRule rule{this, kernels::Copy{}, y, at_time};
};

/// y = before for t < time, after from there on.
class Step final : public Block {
  public:
    using Block::Block;
    Parameter<Real> time{this, "time", {.initial = {1}, .unit = unit<"s">, .doc = "when the step happens"}};
    Parameter<Real> before{
        this, "before", {.initial = {0}, .unit = any_unit, .doc = "value before the step"}};
    Parameter<Real> after{this, "after", {.initial = {1}, .unit = any_unit, .doc = "value from the step on"}};
    Output<Real> y{this, "y", any()};
    OutputRule rule{this, kernels::Step{}, y, time, before, after, at_time};
    GuardOf<Real> at_step{this, "at_step", any("zero at the time of the step")};
    GuardRule guard{this, kernels::Margin{}, at_step, at_time, time};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(time), at_step.index());
        broadcast(*this, inference, slots(time, before, after), y.index());
    }
};

/// y = initial + slope · max(t - start, 0).
class Ramp final : public Block {
  public:
    using Block::Block;
    Parameter<Real> slope{this, "slope", {.initial = {1}, .unit = any_unit, .doc = "unit of y per second"}};
    Parameter<Real> start{this, "start", {.initial = {0}, .unit = unit<"s">, .doc = "when the ramp begins"}};
    Parameter<Real> initial{
        this, "initial", {.initial = {0}, .unit = any_unit, .doc = "value before the ramp"}};
    Output<Real> y{this, "y", any()};
    OutputRule rule{this, kernels::Ramp{}, y, slope, start, initial, at_time};
    GuardOf<Real> at_start{this, "at_start", any("zero where the ramp begins")};
    GuardRule guard{this, kernels::Margin{}, at_start, at_time, start};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(start), at_start.index());
        broadcast(*this, inference, slots(slope, start, initial), y.index());
    }
};

/// y = amplitude · sin(frequency · t + phase) + bias.
class Sine final : public Block {
  public:
    using Block::Block;
    Parameter<Real> amplitude{
        this, "amplitude", {.initial = {1}, .unit = any_unit, .doc = "half of the stroke"}};
    Parameter<Real> frequency{
        this, "frequency", {.initial = {1}, .unit = unit<"rad/s">, .doc = "angular frequency"}};
    Parameter<Real> phase{this, "phase", {.initial = {0}, .unit = unit<"rad">, .doc = "angle at t = 0"}};
    Parameter<Real> bias{this, "bias", {.initial = {0}, .unit = any_unit, .doc = "mean value"}};
    Output<Real> y{this, "y", any()};
    OutputRule rule{this, kernels::SineWave{}, y, amplitude, frequency, phase, bias, at_time};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(amplitude, frequency, phase, bias), y.index());
    }
};

/// y = amplitude in the first part of every cycle, else 0.
class Pulse final : public Block {
  public:
    using Block::Block;
    Parameter<Real> amplitude{
        this, "amplitude", {.initial = {1}, .unit = any_unit, .doc = "value while high"}};
    Parameter<Real> cycle{
        this, "cycle", {.initial = {1}, .above = 0, .unit = unit<"s">, .doc = "from rise to rise"}};
    Parameter<Real> width{
        this,
        "width",
        {.initial = {50}, .minimum = 0, .maximum = 100, .doc = "part of the cycle that is high, in percent"}};
    Parameter<Real> delay{this, "delay", {.initial = {0}, .unit = unit<"s">, .doc = "first rise"}};
    Output<Real> y{this, "y", any()};
    OutputRule rule{this, kernels::Pulse{}, y, amplitude, cycle, width, delay, at_time};
    GuardOf<Array<std::int32_t>> at_edge{this, "at_edge", any("edges so far")};
    GuardRule guard{this, kernels::PulseEdges{}, at_edge, cycle, width, delay, at_time};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(cycle, width, delay), at_edge.index());
        broadcast(*this, inference, slots(amplitude, cycle, width, delay), y.index());
    }
};

/// Sine whose frequency grows steadily.
class Chirp final : public Block {
  public:
    using Block::Block;
    Parameter<Real> f0{this, "f0", {.initial = {0.1}, .unit = unit<"Hz">, .doc = "frequency at t = 0"}};
    Parameter<Real> f1{
        this, "f1", {.initial = {1}, .unit = unit<"Hz">, .doc = "frequency at the target time"}};
    Parameter<Real> target{
        this, "target", {.initial = {100}, .above = 0, .unit = unit<"s">, .doc = "when f1 is reached"}};
    Output<Real> y{this, "y", {.doc = "between -1 and 1"}};
    OutputRule rule{this, kernels::Chirp{}, y, f0, f1, target, at_time};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(f0, f1, target), y.index());
    }
};

/// y = the columns of a CSV file at time t.
class SignalFromFile final : public Block {
  public:
    using Block::Block;
    Argument<std::string> file{
        this, "file", {.initial = "", .doc = "CSV file: first column time [s], the others the signal"}};
    Argument<std::string> interpolation{this,
                                        "interpolation",
                                        {.initial = "hold",
                                         .doc = "between rows: the row before, or a straight line",
                                         .choices = {"hold", "linear"}}};
    const Table table = read();
    Output<Real> y{this, "y", any({Extent(table.width)}, "the columns after the time")};
    GuardOf<std::int32_t> at_row{this, "at_row", {.doc = "rows so far"}};

    Status output(Now at, Out out) const noexcept override {
        const auto& times = table.times;
        const double t = at.time();
        const auto after = times.begin() + rows_until(t);
        const auto row = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - times.begin() - 1, 0));
        const bool between = is_linear && after != times.end() && after != times.begin();
        const double part = between ? (t - times[row]) / (times[row + 1] - times[row]) : 0.0;
        for (int j = 0; j < table.width; ++j) {
            const double here = table.value(row, j);
            out[y](j) = between ? here + part * (table.value(row + 1, j) - here) : here;
        }
        return ok;
    }
    Status guards(Now at, Guards guard) const noexcept override {
        guard[at_row] = static_cast<std::int32_t>(rows_until(at.time()));
        return ok;
    }

  private:
    const bool is_linear = *interpolation == "linear";

    std::ptrdiff_t rows_until(double t) const noexcept {
        return std::upper_bound(table.times.begin(), table.times.end(), t) - table.times.begin();
    }
    Table read() {
        if (file->empty())
            problem("argument 'file' is empty; name a CSV file whose first column is time");
        else
            try {
                return read_table(path_of(*file));
            } catch (const std::runtime_error& error) {
                problem(error.what());
            }
        return {};
    }
};

} // namespace

void add_sources(Library& library) {
    library.group("sources")
        .add<Constant>("Constant",
                       "A constant of any size and type. y = value; rows and columns become 1-D unless "
                       "`vector_1d` is false.")
        .add<Ground>("Ground", "Zero, of the size and type that its reader needs.")
        .add<ClockBlock>("Clock", "Time of the step. y = t [s].")
        .add<Step>("Step", "Steps from one value to another. y = before for t < time, after from there on.")
        .add<Ramp>("Ramp", "Grows steadily from a moment on. y = initial + slope · max(t - start, 0).")
        .add<Sine>("Sine", "Sine wave. y = amplitude · sin(frequency · t + phase) + bias.")
        .add<Pulse>("Pulse",
                    "Rectangular wave. y = amplitude during the first `width` percent of every period after "
                    "the delay, else 0.")
        .add<Chirp>("Chirp", "Sine of growing frequency. y = sin(2π (f0 t + (f1 - f0) t² / (2 target))).")
        .add<SignalFromFile>(
            "SignalFromFile",
            "Plays a CSV file back. y = its columns at time t, held or joined by straight lines; before the "
            "first and after the last row these are held. Refuses a file with a row that is no list of "
            "numbers, is too short, or does not come later than the one before.");
}

} // namespace bf::blocks

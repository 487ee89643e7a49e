// Periodic signals and counters.
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/sources.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>
#include <cmath>

namespace bf::blocks {

namespace {

using Real = Array<double>;

/// y = a wave of one of several forms.
class SignalGenerator final : public Block {
  public:
    using Block::Block;
    Argument<std::string> waveform{this,
                                   "waveform",
                                   {.initial = "sine",
                                    .doc = "form of the wave",
                                    .choices = {"sine", "square", "sawtooth", "triangle"}}};
    Parameter<Real> amplitude{
        this, "amplitude", {.initial = {1}, .unit = any_unit, .doc = "half of the stroke"}};
    Parameter<Real> frequency{
        this, "frequency", {.initial = {1}, .unit = unit<"Hz">, .doc = "cycles per second"}};
    Output<Real> y{this, "y", any()};
    OutputRule rule{this, kernels::Wave{}, y, form(), amplitude, frequency, at_time};
    GuardOf<Array<std::int32_t>> at_edge{this, "at_edge", any("jumps and corners so far")};
    GuardRule guard{this, kernels::WaveEdges{}, at_edge, form(), frequency, at_time};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(frequency), at_edge.index());
        broadcast(*this, inference, slots(amplitude, frequency), y.index());
    }

  private:
    Constants form() const {
        using kernels::Waveform;
        return Constants({double(*waveform == "sine"       ? Waveform::sine
                                 : *waveform == "square"   ? Waveform::square
                                 : *waveform == "sawtooth" ? Waveform::sawtooth
                                                           : Waveform::triangle)});
    }
};

/// y = points joined by straight lines, again and again.
class RepeatingSequence final : public Block {
  public:
    explicit RepeatingSequence(const Arguments& arguments) : Block(arguments) {
        const auto not_after = [](double before, double after) { return !(after > before); };
        if (times->size() < 2 || std::adjacent_find(times->begin(), times->end(), not_after) != times->end())
            problem("argument 'times' must hold at least two times, each later than the one before");
    }
    Argument<std::vector<double>> times{
        this, "times", {.initial = {0, 1}, .doc = "of the points [s]; the last one begins the next cycle"}};
    Parameter<Real> values{this,
                           "values",
                           {.shape = {Extent(std::max(1, static_cast<int>(times->size())))},
                            .initial = {0},
                            .unit = any_unit,
                            .doc = "of y at these times"}};
    Output<double> y{this, "y", any()};
    Workspace<double> within{this, "within", {}};
    OutputRule rule_within{this, kernels::WithinCycle{}, within, points(), at_time};
    OutputRule rule{this, kernels::Interpolate{}, y, points(), values, within};
    GuardOf<std::int32_t> at_point{this, "at_point", {.doc = "points passed so far"}};
    GuardRule guard{this, kernels::CycleEdges{}, at_point, points(), at_time};

  private:
    Constants points() const { return times->empty() ? Constants({0}) : Constants(*times); }
};

/// y = one value per hit, again and again.
class RepeatingStair final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n"};
    Parameter<> values{
        this, "values", {.shape = {n}, .initial = {0, 1}, .unit = any_unit, .doc = "one per hit"}};
    Output<> y{this, "y", any(scalar)};
    DiscreteState<std::uint32_t> k{this, "k", {.doc = "which value, counted from 0"}};
    OutputRule rule{this, kernels::ElementOf{}, y, values, k};
    UpdateRule rule_k{this, kernels::CountAlong{}, next(k), values, k};
};

/// y = 0, 1, …, limit, 0, 1, …
class CounterLimited final : public Block {
  public:
    using Block::Block;
    Parameter<std::uint32_t> limit{this, "limit", {.initial = {7}, .doc = "largest y, after which comes 0"}};
    Output<> y{this, "y", any(scalar)};
    DiscreteState<std::uint32_t> x{this, "x", {.doc = "count"}};
    OutputRule rule{this, kernels::Copy{}, y, x};
    UpdateRule rule_x{this, kernels::CountUp{}, next(x), limit, x};
};

/// y = 0, 1, …, 2^bits - 1, 0, 1, …
class CounterFree final : public Block {
  public:
    using Block::Block;
    Argument<int> bits{
        this, "bits", {.initial = 16, .minimum = 1, .maximum = 32, .doc = "length of the counter"}};
    Output<> y{this, "y", any(scalar)};
    DiscreteState<std::uint32_t> x{this, "x", {.doc = "count"}};
    OutputRule rule{this, kernels::Copy{}, y, x};
    UpdateRule rule_x{this, kernels::CountUp{}, next(x), Constants({std::exp2(*bits) - 1}), x};
};

} // namespace

void add_generators(Library& library) {
    library.group("sources")
        .add<SignalGenerator>("SignalGenerator",
                              "Periodic wave between -amplitude and amplitude. With p = frequency · t less "
                              "its whole part: sine sin 2πp; square 1 in the first half, then -1; sawtooth "
                              "2p - 1; triangle 4p - 1, then 3 - 4p; times the amplitude.")
        .add<RepeatingSequence>("RepeatingSequence", "Points joined by straight lines, repeated from the "
                                                     "last time on; refuses times that do not increase.")
        .add<RepeatingStair>("RepeatingStair", "Values one after the other, one per hit, again and again.")
        .add<CounterLimited>("CounterLimited", "Counts its hits. y = 0, 1, …, limit, 0, …")
        .add<CounterFree>("CounterFree", "Counts its hits. y = 0, 1, …, 2^bits - 1, 0, …");
}

} // namespace bf::blocks

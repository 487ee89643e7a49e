// Random signals, the same for a seed on every machine.
#include "bf/kernels/random.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

namespace bf::blocks {

namespace {

using Real = Array<double>;
using Words = Array<std::uint32_t>;

const About a_seed{
    .doc = "each seed gives another sequence, the elements of y differ for one seed too; without one the "
           "block's path in the model decides, so that two blocks differ",
    .from_path = true};
constexpr const char* count_doc = "numbers drawn so far, low and high word";

/// y uniform in [minimum, maximum).
class RandomUniform final : public Block {
  public:
    using Block::Block;
    Parameter<Real> minimum{this, "minimum", {.initial = {0}, .unit = any_unit, .doc = "smallest y"}};
    Parameter<Real> maximum{
        this,
        "maximum",
        {.initial = {1}, .at_least = minimum.index(), .unit = any_unit, .doc = "y stays below"}};
    Parameter<std::uint32_t> seed{this, "seed", a_seed};
    Output<Real> y{this, "y", any()};
    DiscreteState<Words> count{this, "count", {.shape = {Extent(2)}, .doc = count_doc}};
    OutputRule rule{this, kernels::RandomUniform{}, y, minimum, maximum, seed, count};
    UpdateRule rule_count{this, kernels::NextDraw{}, next(count), count};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(minimum, maximum), y.index());
    }
};

/// y normal, with given mean and variance.
class RandomNormal final : public Block {
  public:
    using Block::Block;
    Parameter<Real> mean{this, "mean", {.initial = {0}, .unit = any_unit, .doc = "expected value"}};
    Parameter<Real> variance{
        this,
        "variance",
        {.initial = {1}, .minimum = 0, .unit = any_unit, .doc = "square of the standard deviation"}};
    Parameter<std::uint32_t> seed{this, "seed", a_seed};
    Output<Real> y{this, "y", any()};
    DiscreteState<Words> count{this, "count", {.shape = {Extent(2)}, .doc = count_doc}};
    OutputRule rule{this, kernels::RandomNormal{}, y, mean, variance, Constants({0}), seed, count};
    UpdateRule rule_count{this, kernels::NextDraw{}, next(count), count};

    void infer(Inference& inference) const override {
        broadcast(*this, inference, slots(mean, variance), y.index());
    }
};

/// y normal, with a flat spectrum up to half the sampling frequency.
class WhiteNoise final : public Block {
  public:
    using Block::Block;
    Parameter<Real> power{
        this,
        "power",
        {.initial = {0.1}, .minimum = 0, .unit = any_unit, .doc = "two-sided spectral density, y² per Hz"}};
    Parameter<std::uint32_t> seed{this, "seed", a_seed};
    Output<Real> y{this, "y", any()};
    DiscreteState<Words> count{this, "count", {.shape = {Extent(2)}, .doc = count_doc}};
    OutputRule rule{this, kernels::RandomNormal{}, y, Constants({0}), power, at_period, seed, count};
    UpdateRule rule_count{this, kernels::NextDraw{}, next(count), count};

    void infer(Inference& inference) const override { broadcast(*this, inference, slots(power), y.index()); }
};

} // namespace

void add_random(Library& library) {
    library.group("sources")
        .add<RandomUniform>(
            "RandomUniform",
            "Uniformly distributed random numbers, a new one at each hit. Generator: Philox4x32-10 of Salmon "
            "et al., SC'11, the seed being its key and the number of the draw its counter.")
        .add<RandomNormal>("RandomNormal", "Normally distributed random numbers, a new one at each hit. From "
                                           "those of RandomUniform by Box and Muller's transform.")
        .add<WhiteNoise>("WhiteNoise",
                         "Band-limited white noise: normal random numbers of variance power / T at each hit, "
                         "T being the period, so that the spectral density does not depend on it.");
}

} // namespace bf::blocks

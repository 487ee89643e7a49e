// Native blocks that are exported through the old factory symbols as well.
#include "bf/boundary/as_legacy_block.hpp"

#include <cmath>

namespace {

using namespace bf;

/// The same quantity as legacy_test::Accumulate, its state declared.
class Accumulate final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n"};
    Parameter<double> factor{this, "factor", {.initial = {1}}};
    Parameter<Vector> offset{this, "bias", {.shape = {n}}};
    Input<Vector> u1{this, "u1", {.shape = {n}}};
    Input<Vector> u2{this, "u2", {.shape = {n}}};
    Output<Vector> y{this, "y1", {.shape = {n}}};
    DiscreteState<double> steps{this, "steps"};

    Status output(Now at, Out out) const noexcept override {
        for (Eigen::Index i = 0; i < out[y].size(); ++i)
            out[y][i] = at[factor] * (at[u1][i] + at[u2][i]) + at[offset][i] + at[steps];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[steps] = at[steps] + 1;
        return ok;
    }
};

/// y = time + period + u, a matrix of open size; fails on a negative first element.
class Clocked final : public Block {
  public:
    using Block::Block;
    Argument<std::string> mode{this, "mode", {.initial = "plain", .choices = {"plain", "double"}}};
    Argument<bool> negate{this, "negate", {.initial = false}};
    Dim rows{this, "rows"}, cols{this, "cols"};
    Input<Matrix> u{this, "u", {.shape = {rows, cols}}};
    Output<Matrix> y{this, "y", {.shape = {rows, cols}}};

    Status output(Now at, Out out) const noexcept override {
        if (at[u](0, 0) < 0) return Status::failure("element ({}, {}) is negative", 0, 0);
        const double factor = (*mode == "double" ? 2.0 : 1.0) * (negate ? -1.0 : 1.0);
        out[y].array() = factor * (at[u].array() + at.time() + at.period());
        return ok;
    }
};

/// y = u.
class Nothing final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u1"};
    Output<double> y{this, "y1"};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u];
        return ok;
    }
    Status update(Now, Next) const noexcept override { return ok; }
};

/// x' = u.
class Continuous final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    ContinuousState<double> x{this, "x"};
};

/// x' = -1; from 0 it jumps to 1.
class Sawtooth final : public Block {
  public:
    using Block::Block;
    Output<double> y{this, "y"};
    ContinuousState<double> x{this, "x", {.initial = {1}}};
    Guard zero{this, "zero"};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[x];
        return ok;
    }
    Status derivative(Now, Rate rate) const noexcept override {
        rate[x] = -1;
        return ok;
    }
    Status guards(Now at, Guards guards) const noexcept override {
        guards[zero] = at[x];
        return ok;
    }
    Status event(Now at, After after) const noexcept override {
        if (at[zero] < 0) after[x] = 1;
        return ok;
    }
};

} // namespace

extern "C" __attribute__((visibility("default"))) void bf_plugin_v1(Library& library) {
    library.group("test")
        .add<Accumulate>("Accumulate", "Test.")
        .add<Clocked>("Clocked", "Test.")
        .add<Continuous>("Continuous", "Test.")
        .add<Nothing>("Nothing", "Test.")
        .add<Sawtooth>("Sawtooth", "Test.");
}
BF_LEGACY_BLOCKS(Accumulate, Clocked, Continuous, Nothing)

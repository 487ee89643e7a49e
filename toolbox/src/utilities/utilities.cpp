#include "utilities/utilities.hpp"

#include "bf/core/block.hpp"
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/linear_algebra.hpp"
#include "bf/kernels/nonlinear.hpp"
#include "bf/kernels/svd.hpp"

#include <algorithm>

namespace bf::toolbox {

namespace {

About any(const char* doc) { return {.unit = any_unit, .doc = doc}; }
About any(const Shape& shape, const char* doc) { return {.shape = shape, .unit = any_unit, .doc = doc}; }

/// y = the first s of the run.
class Holder final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> s{this, "s", any(shape, "signal")};
    Output<> y{this, "y", any(shape, "its first sample")};
    DiscreteState<> held{this, "held", any(shape, "the first sample")};
    DiscreteState<bool> waiting{this, "waiting", {.initial = {1}, .doc = "true before the first step"}};
    OutputRule rule{this, kernels::Choose{}, y, s, waiting, held};
    UpdateRule rule_held{this, kernels::Copy{}, next(held), y};
    UpdateRule rule_waiting{this, kernels::Copy{}, next(waiting), Constants({0})};
};

/// absolute = x - y, relative = (x - y) ./ y.
class Errors final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> x{this, "x", any(shape, "value")};
    Input<> y{this, "y", any(shape, "what it should be")};
    Output<> absolute{this, "absolute", any(shape, "x - y")};
    Output<> relative{this, "relative", any(shape, "(x - y) ./ y")};
    OutputRule rule_absolute{this, kernels::Subtract{}, absolute, x, y};
    OutputRule rule_relative{this, kernels::Divide{}, relative, absolute, y};
};

/// y = Signal, which has the size of Reference.
class MatchSignalSizes final : public Block {
  public:
    using Block::Block;
    AnyShape shape{this};
    Input<> reference{this, "reference", any(shape, "signal of the wanted size")};
    Input<> signal{this, "signal", any(shape, "signal that gets it")};
    Output<> y{this, "y", any(shape, "the signal")};
    OutputRule rule{this, kernels::Copy{}, y, signal};
};

/// y = u⁺ by a kernel.
template <class Kernel> class Pinv final : public Block {
  public:
    using Block::Block;
    Parameter<> tol{this,
                    "tol",
                    {.shape = Shape(Extent(1)),
                     .initial = {1e-4},
                     .minimum = 0,
                     .unit = any_unit,
                     .doc = "damping, or the singular value up to which truncation cuts"}};
    Input<> u{this, "u", any("matrix")};
    Output<> y{this, "y", any("its pseudo-inverse")};
    Workspace<Any> work{this, "work", {}};
    OutputRule rule{this, Kernel{}, y, tol, u, work};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (!s) return;
        const int small = std::min(s->rows, s->cols);
        inference.set(work, Size{small * small + s->count(), 1, false});
        inference.set(y, Size{s->cols, s->rows, true});
    }
};

} // namespace

void add_utilities(Library& library) {
    library.group("utilities")
        .add<Holder>("Holder", "Holds the first sample of a signal, whatever comes later. y[k] = s[0].")
        .add<Errors>("Errors", "Absolute and relative error. absolute = x - y, relative = (x - y) ./ y, "
                               "which is infinite or NaN where y is 0.")
        .add<MatchSignalSizes>("MatchSignalSizes", "Lets a signal pass that has the size of another one, for "
                                                   "what takes its size from the wiring. Errors: two sizes.")
        .add<Pinv<kernels::DampedPinv>>(
            "DampPinv", "Damped pseudo-inverse. y = u' (u u' + tol I)^-1, or (u' u + tol I)^-1 u' of a tall "
                        "matrix. Errors: a singular matrix with tol = 0 stops the run.")
        .add<Pinv<kernels::TruncatedPinv>>("TruncPinv", "Pseudo-inverse without small singular values. y = "
                                                        "sum v u' / s over the singular values s above tol.");
}

} // namespace bf::toolbox

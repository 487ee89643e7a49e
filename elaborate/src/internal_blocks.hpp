// Blocks that no library has: they stand for ports of the model and of subsystems, and between rates.
#pragma once

#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/routing.hpp"
#include "stages.hpp"

#include <numeric>

namespace bf::elaboration {

/// y = u while it runs, held between: an output of a conditional subsystem, or a signal at a slower rate.
class Hold final : public Block {
  public:
    using Block::Block;
    AnyShape s{this};
    Input<> u{this, "u", {.shape = s, .unit = any_unit}};
    Output<> y{this, "y", {.shape = s, .unit = any_unit}};
    OutputRule rule{this, kernels::Copy{}, y, u};
};

/// The part of an input that one iteration of a for_each subsystem sees: an equal share of the elements, or
/// of the columns of a matrix.
class Part final : public Block {
    int index_, count_;

  public:
    Part(int index, int count) : index_(index), count_(count) {}
    void infer(Inference& now) const override {
        const Size* size = now.size(u);
        if (!size) return;
        const int whole = size->is_matrix ? size->cols : size->rows;
        if (whole % count_ != 0)
            now.refuse("has " + std::to_string(whole) + (size->is_matrix ? " columns" : " elements") +
                       ", which cannot be shared among " + std::to_string(count_) + " iterations");
        const int share = whole / count_;
        now.set(y, size->is_matrix ? Size{size->rows, share, true} : Size{share, 1, false});
        std::vector<int> picked(static_cast<std::size_t>(share));
        std::iota(picked.begin(), picked.end(), index_ * share);
        if (!size->is_matrix) now.same_elements({y.index(), u.index(), 0, std::move(picked)});
    }
    Input<> u{this, "u", {.unit = any_unit}};
    Output<> y{this, "y", {.unit = any_unit}};
    Constants which{{static_cast<double>(index_)}};
    OutputRule rule{this, kernels::PartOf{}, y, u, which};
};

/// Joins what the iterations of a for_each subsystem put out: elements one after another, or the columns of
/// matrices.
class Join final : public Block {
    int count_;

  public:
    explicit Join(int count) : count_(count) {}
    void infer(Inference& now) const override {
        const Size* size = now.size(u[0]);
        if (!size) return;
        now.set(y, size->is_matrix ? Size{size->rows, size->cols * u.size(), true}
                                   : Size{size->rows * u.size(), 1, false});
        for (int i = 0; i < u.size() && !size->is_matrix; ++i)
            now.same_elements({y.index(), u[i].index(), i * size->rows});
    }
    AnyShape part{this};
    InputList<> u{this, "u", count_, {.shape = part, .unit = any_unit}};
    Output<> y{this, "y", {.unit = any_unit}};
    OutputRule rule{this, kernels::Concatenate{}, y, u};
};

/// A root input: whoever runs the diagram writes its output.
class RootInput final : public Block {
  public:
    explicit RootInput(const Elaboration::Declared& declared) {
        declare({.is_root_input = true});
        if (declared.size) offer(resolution(), y.index(), *declared.size);
        if (declared.type) offer(resolution(), y.index(), *declared.type);
    }
    Output<> y{this, "y", {.unit = any_unit}};
};

} // namespace bf::elaboration

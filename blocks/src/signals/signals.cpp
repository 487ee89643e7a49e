// Routing: joining, splitting and picking elements; sinks.
#include "bf/kernels/elementwise.hpp"
#include "bf/kernels/routing.hpp"

#include "../groups.hpp"
#include "../shapes.hpp"

#include <algorithm>
#include <numeric>

namespace bf::blocks {

namespace {

std::vector<double> numbers(const std::vector<int>& values) { return {values.begin(), values.end()}; }

/// y = the elements of all inputs, one after the other, 1-D.
class Mux final : public Block {
  public:
    using Block::Block;
    Argument<int> inputs{
        this, "inputs", {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs"}};
    InputList<> u{this, "u", *inputs, any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Concatenate{}, y, u};

    void infer(Inference& inference) const override {
        int sum = 0;
        for (const auto& input : u) {
            const Size* s = inference.size(input);
            if (!s) return;
            if (s->rows > 1 && s->cols > 1)
                inference.refuse(
                    label(resolution(), input.index()) +
                    " is a matrix; stack matrices with ConcatenateMatrices or Reshape them first");
            inference.same_elements({y.index(), input.index(), sum});
            sum += s->count();
        }
        inference.set(y, Size{sum, 1, false});
    }
};

/// y1, y2, … = consecutive parts of u, 1-D.
class Demux final : public Block {
  public:
    explicit Demux(const Arguments& arguments) : Block(arguments) {
        if (sizes->empty()) problem("argument 'sizes' must be a number of outputs or the width of each");
    }
    Argument<std::vector<int>> sizes{this,
                                     "sizes",
                                     {.initial = {2},
                                      .minimum = 1,
                                      .maximum = most_ports,
                                      .doc = "number of equal outputs, or the width of each output"}};
    Input<> u{this, "u", any()};
    OutputList<> y{this, "y", count(), any()};
    OutputRule rule{this, kernels::Split{}, y, u};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (s && s->rows > 1 && s->cols > 1)
            inference.refuse(label(resolution(), u.index()) + " is a matrix; Demux splits vectors");
        int sum = 0;
        for (int i = 0; i < y.size(); ++i) {
            int width = 0;
            if (sizes->size() > 1)
                width = (*sizes)[static_cast<std::size_t>(i)];
            else if (s) // as equal as possible, the first outputs take the rest
                width = s->count() / y.size() + (i < s->count() % y.size());
            else
                return;
            std::vector<int> picked(static_cast<std::size_t>(std::max(width, 0)));
            std::iota(picked.begin(), picked.end(), sum);
            sum += width;
            if (width <= 0) continue;
            inference.set(y[i], Size{width, 1, false});
            if (s && sum <= s->count())
                inference.same_elements({y[i].index(), u.index(), 0, std::move(picked)});
        }
        if (s && (s->count() != sum || s->count() < y.size()))
            inference.refuse(label(resolution(), u.index()) + " cannot be split into " +
                             std::to_string(y.size()) + " outputs" +
                             (sizes->size() > 1 ? " whose widths sum to " + std::to_string(sum) : "") +
                             "; change argument 'sizes'");
        if (!s && sizes->size() > 1) inference.set(u, Size{sum, 1, false});
    }

  private:
    int count() const {
        if (sizes->empty()) return 1;
        return sizes->size() > 1 ? static_cast<int>(sizes->size()) : sizes->front();
    }
};

/// y_i = u(indices_i), or y_ij = u(indices_i, columns_j).
class Selector final : public Block {
  public:
    explicit Selector(const Arguments& arguments) : Block(arguments) {
        if (indices->empty()) problem("argument 'indices' must not be empty");
        if (columns->empty())
            OutputRule(this, kernels::Select{}, y, Constants(numbers(*indices)), u);
        else
            OutputRule(this, kernels::SelectMatrix{}, y, Constants(numbers(*indices)),
                       Constants(numbers(*columns)), u);
    }
    Argument<std::vector<int>> indices{
        this, "indices", {.initial = {1}, .minimum = 1, .doc = "elements, or rows when columns are given"}};
    Argument<std::vector<int>> columns{
        this, "columns", {.initial = {}, .minimum = 1, .doc = "columns; empty: u is a vector and stays one"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        const int rows = static_cast<int>(indices->size()), cols = static_cast<int>(columns->size());
        // Known without the size of u, which may come from a loop.
        if (cols > 0)
            inference.set(y, Size{rows, cols, true});
        else if (rows == 1)
            inference.set(y, Size{});
        const Size* s = inference.size(u);
        if (!s) return;
        const auto check = [&](const std::vector<int>& list, int most, const char* what) {
            for (const int i : list)
                if (i > most)
                    inference.refuse(label(resolution(), u.index()) + " has no " + what + " " +
                                     std::to_string(i));
        };
        if (cols > 0) {
            check(*indices, s->rows, "row");
            return check(*columns, s->cols, "column");
        }
        if (s->rows > 1 && s->cols > 1)
            inference.refuse(label(resolution(), u.index()) + " is a matrix; give argument 'columns' too");
        check(*indices, s->count(), "element");
        std::vector<int> picked = *indices;
        for (int& i : picked) --i;
        inference.same_elements({y.index(), u.index(), 0, std::move(picked)});
        const bool is_row = s->is_matrix && s->rows == 1;
        if (rows > 1) inference.set(y, is_row ? Size{1, rows, true} : Size{rows, 1, s->is_matrix});
    }
};

/// y = base with the elements `indices`, or rows and columns, replaced by u.
class Assign final : public Block {
  public:
    explicit Assign(const Arguments& arguments) : Block(arguments) {
        if (columns->empty())
            OutputRule(this, kernels::Assign{}, y, Constants(numbers(*indices)), base, u);
        else
            OutputRule(this, kernels::AssignMatrix{}, y, Constants(numbers(*indices)),
                       Constants(numbers(*columns)), base, u);
    }
    Argument<std::vector<int>> indices{
        this,
        "indices",
        {.initial = {1}, .minimum = 1, .doc = "elements, or rows when columns are given, that u replaces"}};
    Argument<std::vector<int>> columns{
        this,
        "columns",
        {.initial = {}, .minimum = 1, .doc = "columns; empty: elements are counted column by column"}};
    AnyShape shape{this};
    Input<> base{this, "base", any(shape, "signal of which elements are replaced")};
    Input<> u{this, "u", any("new elements; a scalar expands")};
    Output<> y{this, "y", any(shape)};

    void infer(Inference& inference) const override {
        const Size *whole = inference.size(base), *part = inference.size(u);
        const auto check = [&](const std::vector<int>& list, int most, const char* what) {
            for (const int i : list)
                if (i > most)
                    inference.refuse(label(resolution(), base.index()) + " has no " + what + " " +
                                     std::to_string(i));
        };
        const bool is_matrix = !columns->empty();
        if (whole) check(*indices, is_matrix ? whole->rows : whole->count(), is_matrix ? "row" : "element");
        if (whole && is_matrix) check(*columns, whole->cols, "column");
        const std::size_t wanted = indices->size() * (is_matrix ? columns->size() : 1);
        if (part && !part->is_scalar() && static_cast<std::size_t>(part->count()) != wanted)
            inference.refuse(label(resolution(), u.index()) + " must have as many elements as it replaces, " +
                             std::to_string(wanted));
    }
};

/// y = number of elements of u.
class Width final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", {.unit = any_unit, .feedthrough = false}};
    Output<double> y{this, "y", {.doc = "number of elements of u"}};

    Status output(Now, Out out) const noexcept override {
        out[y] = size(u).count();
        return ok;
    }
};

/// Takes a signal and does nothing.
class Terminator final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
};

/// Input of any type and size for the progress line of a run to show, labelled with the block's name.
class Display final : public Block {
  public:
    explicit Display(const Arguments& arguments) : Block(arguments) { declare({.is_displayed = true}); }
    Input<> u{this, "u", any()};
};

/// Inputs of any types and sizes for the recorder to see.
class Scope final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
};

} // namespace

void add_signals(Library& library) {
    library.group("signals")
        .add<Mux>("Mux", "Joins signals into one vector. y = [u1; u2; …], 1-D; refuses matrices.")
        .add<Demux>("Demux",
                    "Splits a vector. Into `sizes` equal parts, or parts of the given widths, 1-D each; "
                    "refuses widths whose sum is not that of the input.")
        .add<Selector>("Selector", "Picks elements. y_i = u(indices_i), or y_ij = u(indices_i, columns_j), "
                                   "counted from 1 in any order; refuses indices that u does not have.")
        .add<Assign>(
            "Assign",
            "Replaces elements. y = base, then y(indices_i) = u_i, or y(indices_i, columns_j) = u_ij.")
        .add<Width>("Width", "Number of elements of a signal. y = rows × columns of u.")
        .add<Terminator>("Terminator", "Ends a line that nothing else uses.")
        .add<Display>("Display",
                      "Shows the present value in the progress line of a run, after the block's name.")
        .add<Scope>("Scope", "Shows a signal in recordings and plots.");
}

} // namespace bf::blocks

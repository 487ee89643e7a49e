// Building, taking apart and rearranging matrices.
#include "bf/kernels/geometry.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/kernels/routing.hpp"

#include "../elementwise.hpp"
#include "../groups.hpp"

#include <algorithm>

namespace bf::blocks {

namespace {

/// y = uᵀ; a 1-D signal becomes a row.
class Transpose final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Transpose{}, y, u};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(u)) inference.set(y, Size{s->cols, s->rows, true});
    }
};

/// y = u with another size; elements keep their order, column by column.
class Reshape final : public Block {
  public:
    explicit Reshape(const Arguments& arguments) : Block(arguments) {
        if (size->size() > 2) problem("argument 'size' must be [] for a 1-D signal, [n] or [rows columns]");
    }
    Argument<std::vector<int>> size{
        this,
        "size",
        {.initial = {}, .minimum = 1, .doc = "[] for a 1-D signal of all elements, [n] or [rows columns]"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::Copy{}, y, u};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        const auto& n = *size;
        Size wanted{s ? s->count() : 0, 1, false};
        if (n.size() == 1) wanted = {n[0], 1, false};
        if (n.size() == 2) wanted = {n[0], n[1], true};
        if (s && s->count() != wanted.count())
            inference.refuse(label(resolution(), u.index()) + " has " + std::to_string(s->count()) +
                             " elements and cannot become " + wanted.text() + "; change argument 'size'");
        if (s || !n.empty()) inference.set(y, wanted);
    }
};

/// y = u(row … row + rows - 1, column … column + columns - 1).
class Submatrix final : public Block {
  public:
    using Block::Block;
    Argument<int> row{this, "row", {.initial = 1, .minimum = 1, .doc = "first row, counted from 1"}};
    Argument<int> column{this, "column", {.initial = 1, .minimum = 1, .doc = "first column, counted from 1"}};
    Argument<int> rows{this, "rows", {.initial = 1, .minimum = 1, .doc = "number of rows"}};
    Argument<int> columns{this, "columns", {.initial = 1, .minimum = 1, .doc = "number of columns"}};
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any({Extent(*rows), Extent(*columns)})};
    OutputRule rule{this, kernels::Submatrix{}, y, Constants({double(*row)}), Constants({double(*column)}),
                    u};

    void infer(Inference& inference) const override {
        const Size* s = inference.size(u);
        if (s && (*row + *rows - 1 > s->rows || *column + *columns - 1 > s->cols))
            inference.refuse(label(resolution(), u.index()) + " has no rows " + std::to_string(*row) +
                             " to " + std::to_string(*row + *rows - 1) + " and columns " +
                             std::to_string(*column) + " to " + std::to_string(*column + *columns - 1));
    }
};

/// y = [u1 u2 …] or [u1; u2; …].
class ConcatenateMatrices final : public Block {
  public:
    explicit ConcatenateMatrices(const Arguments& arguments) : Block(arguments) {
        if (*direction == "horizontal")
            OutputRule(this, kernels::Concatenate{}, y, u);
        else
            OutputRule(this, kernels::ConcatenateVertically{}, y, u);
    }
    Argument<std::string> direction{
        this,
        "direction",
        {.initial = "horizontal", .doc = "side by side or stacked", .choices = {"horizontal", "vertical"}}};
    Argument<int> inputs{
        this, "inputs", {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs"}};
    InputList<> u{this, "u", *inputs, any()};
    Output<> y{this, "y", any()};

    void infer(Inference& inference) const override {
        const bool side_by_side = *direction == "horizontal";
        int sum = 0;
        for (const auto& input : u) {
            const Size *s = inference.size(input), *first = inference.size(u[0]);
            if (!s || !first) return;
            if (side_by_side ? s->rows != first->rows : s->cols != first->cols)
                inference.refuse(
                    label(resolution(), u[0].index()) + " and " + label(resolution(), input.index()) +
                    " cannot be joined: they need as many " + (side_by_side ? "rows" : "columns"));
            sum += side_by_side ? s->cols : s->rows;
        }
        const Size* first = inference.size(u[0]);
        inference.set(y, side_by_side ? Size{first->rows, sum, true} : Size{sum, first->cols, true});
    }
};

/// y = blkdiag(u1, u2, …).
class BlockDiagonal final : public Block {
  public:
    using Block::Block;
    Argument<int> inputs{
        this, "inputs", {.initial = 2, .minimum = 1, .maximum = most_ports, .doc = "number of inputs"}};
    InputList<> u{this, "u", *inputs, any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::BlockDiagonal{}, y, u};

    void infer(Inference& inference) const override {
        Size sum{0, 0, true};
        for (const auto& input : u) {
            const Size* s = inference.size(input);
            if (!s) return;
            sum.rows += s->rows;
            sum.cols += s->cols;
        }
        inference.set(y, sum);
    }
};

/// y = diag(u).
class DiagonalMatrix final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n"};
    Input<> u{this, "u", any({n})};
    Output<> y{this, "y", any({n, n})};
    OutputRule rule{this, kernels::Diagonal{}, y, u};
};

/// y = the diagonal of u, 1-D.
class DiagonalOf final : public Block {
  public:
    using Block::Block;
    Input<> u{this, "u", any()};
    Output<> y{this, "y", any()};
    OutputRule rule{this, kernels::DiagonalOf{}, y, u};

    void infer(Inference& inference) const override {
        if (const Size* s = inference.size(u)) inference.set(y, Size{std::min(s->rows, s->cols), 1, false});
    }
};

/// y = I.
class Identity final : public Block {
  public:
    using Block::Block;
    Argument<int> size{
        this, "size", {.initial = 3, .minimum = 1, .maximum = 10'000, .doc = "number of rows and columns"}};
    Output<Matrix> y{this, "y", any({Extent(*size), Extent(*size)})};
    OutputRule rule{this, kernels::Identity{}, y};
};

/// y = S(u), S(u) v = u × v.
class Skew final : public Block {
  public:
    using Block::Block;
    Input<Vector3> u{this, "u", any()};
    Output<Eigen::Matrix3d> y{this, "y", any()};
    OutputRule rule{this, kernels::Skew{}, y, u};
};

} // namespace

void add_matrices(Library& library) {
    library.group("math")
        .add<Transpose>("Transpose", "Transpose of a matrix. y = uᵀ; a 1-D signal becomes a row.")
        .add<Reshape>("Reshape", "Gives a signal another size. Elements keep their order, column by column; "
                                 "refuses a size with another number of elements.")
        .add<Submatrix>("Submatrix", "Cuts a rectangle out of a matrix. y = u(row : row + rows - 1, column : "
                                     "column + columns - 1); refuses a rectangle that is not inside u.")
        .add<ConcatenateMatrices>("ConcatenateMatrices",
                                  "Joins matrices side by side or one above the other. y = [u1 u2 …] or [u1; "
                                  "u2; …]; refuses heights or widths that do not agree.")
        .add<BlockDiagonal>("BlockDiagonal", "Puts its inputs on the diagonal. y = blkdiag(u1, u2, …).")
        .add<DiagonalMatrix>("DiagonalMatrix", "Diagonal matrix of a vector. y = diag(u).")
        .add<DiagonalOf>("DiagonalOf", "Diagonal of a matrix. y_i = u_ii, a 1-D signal.")
        .add<Identity>("Identity", "Identity matrix. y = I.")
        .add<Skew>("Skew", "Skew-symmetric matrix of a 3-vector. y v = u × v for every v.");
}

} // namespace bf::blocks

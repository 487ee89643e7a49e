// Tables of values over breakpoints.
#include "bf/kernels/lookup.hpp"

#include "../groups.hpp"
#include "../guards.hpp"
#include "../shapes.hpp"

#include <algorithm>
#include <cmath>

namespace bf::blocks {

namespace {

using kernels::Interpolation;
using Guesses = Array<std::int32_t>;

constexpr const char* breakpoints_doc = "where the table's values stand; each larger than the one before";

/// Argument "extrapolation", and how its text reaches kernels.
class Extrapolation {
  public:
    explicit Extrapolation(Block* owner)
        : argument_(owner, "extrapolation",
                    {.initial = "clip",
                     .doc = "beyond the breakpoints: the border's value, or the straight line at the border "
                            "goes on",
                     .choices = {"clip", "linear"}}) {}
    bool clips() const { return *argument_ == "clip"; }

  private:
    Argument<std::string> argument_;
};

/// A problem of the block unless the points increase; returns points that a kernel can work with.
std::vector<double> increasing(Block& block, const std::string& argument, const std::vector<double>& points) {
    std::string wrong;
    if (points.empty()) wrong = "is empty; give at least one breakpoint";
    for (std::size_t i = 0; wrong.empty() && i < points.size(); ++i)
        if (!std::isfinite(points[i]))
            wrong = "has element " + std::to_string(i + 1) + " that is not finite";
        else if (i > 0 && !(points[i] > points[i - 1]))
            wrong = "must increase strictly, but element " + std::to_string(i + 1) +
                    " is not above the one before";
    if (wrong.empty()) return points;
    bf::detail::declared_by(block).problems.push_back("argument '" + argument + "' " + wrong);
    return {0};
}

/// Refuses a table whose number of elements is not the product of the lengths.
void check_table(const Block& block, Inference& inference, int table,
                 const std::vector<std::size_t>& lengths) {
    const Size* s = inference.size(table);
    std::size_t wanted = 1;
    std::string text;
    for (const auto n : lengths) {
        wanted *= n;
        text += (text.empty() ? "" : " x ") + std::to_string(n);
    }
    if (s && static_cast<std::size_t>(s->count()) != wanted)
        inference.refuse(label(block.resolution(), table) + " has " + std::to_string(s->count()) +
                         " elements, but the breakpoints ask for " + text);
    if (s && lengths.size() == 2 && s->is_matrix && s->rows != 1 && s->cols != 1 &&
        static_cast<std::size_t>(s->rows) != lengths[0])
        inference.refuse(label(block.resolution(), table) + " must be " + text +
                         ": one row per breakpoint of the first input");
}

/// The operand `layout` of the kernel Lookup.
Constants layout(Interpolation how, bool clips, const std::vector<std::vector<double>>& points) {
    std::vector<double> all{double(how), double(clips)};
    for (const auto& x : points) all.push_back(double(x.size()));
    for (const auto& x : points) all.insert(all.end(), x.begin(), x.end());
    return Constants(all);
}

Interpolation interpolation_of(const std::string& text) {
    return text == "flat"      ? Interpolation::flat
           : text == "nearest" ? Interpolation::nearest
                               : Interpolation::linear;
}

/// Change where a table jumps or has a corner along one of its inputs.
template <class U>
Edges table_edges(Block* owner, const std::string& name, Interpolation how, bool clips,
                  const std::vector<double>& points, const U& u) {
    return {owner,
            name,
            "number of the table's piece",
            kernels::TablePiece{},
            Constants({double(how), double(clips)}),
            Constants(points),
            u};
}

/// Those of several inputs, the first of which is u1.
std::vector<Edges> table_edges(Block* owner, Interpolation how, bool clips,
                               const std::vector<std::vector<double>>& points, const InputList<>& u) {
    std::vector<Edges> all;
    for (std::size_t i = 0; i < points.size(); ++i)
        all.push_back(table_edges(owner, "piece" + std::to_string(i + 1), how, clips, points[i],
                                  u[static_cast<int>(i)]));
    return all;
}

/// y = table at u, element by element.
class Lookup1D final : public Block {
  public:
    explicit Lookup1D(const Arguments& arguments) : Block(arguments) {
        if (!is_smooth) {
            OutputRule(this, kernels::Lookup{}, y,
                       layout(interpolation_of(*interpolation), extrapolation.clips(), {points}), table, u,
                       guess);
            return;
        }
        if (*interpolation == "spline")
            OutputRule(this, kernels::SplineSlopes{}, slopes, Constants(points), table, work);
        else
            OutputRule(this, kernels::AkimaSlopes{}, slopes, Constants(points), table);
        OutputRule(this, kernels::Hermite{}, y, Constants({double(extrapolation.clips())}), Constants(points),
                   table, slopes, u[0], guess);
    }
    Argument<std::vector<double>> breakpoints{
        this, "breakpoints", {.initial = {0, 1}, .doc = breakpoints_doc}};
    Argument<std::string> interpolation{
        this,
        "interpolation",
        {.initial = "linear",
         .doc = "between breakpoints: a straight line, the value below, the nearest value, a cubic spline or "
                "the modified Akima interpolant",
         .choices = {"linear", "flat", "nearest", "spline", "akima"}}};
    Extrapolation extrapolation{this};
    const std::vector<double> points = increasing(*this, "breakpoints", *breakpoints);
    const bool is_smooth = *interpolation == "spline" || *interpolation == "akima";
    const int count = static_cast<int>(points.size());
    AnyShape shape{this};
    Parameter<> table{
        this, "table", {.initial = {0, 1}, .unit = any_unit, .doc = "one value per breakpoint"}};
    InputList<> u{this, std::vector<std::string>{"u"}, any(shape)};
    Output<> y{this, "y", any(shape, "value of the table")};
    Workspace<Guesses> guess{this, "guess", {.shape = scalar}};
    Workspace<Array<double>> slopes{this, "slopes", {.shape = {Extent(count)}, .present = is_smooth}};
    Workspace<Array<double>> work{
        this, "work", {.shape = {Extent(count)}, .present = *interpolation == "spline"}};
    // A smooth interpolant has corners at its ends alone.
    Edges piece = table_edges(
        this, "piece", interpolation_of(*interpolation), extrapolation.clips(),
        is_smooth&& count > 1 ? std::vector<double>{points.front(), points.back()} : points, u[0]);

    void infer(Inference& inference) const override {
        piece.infer(*this, inference);
        check_table(*this, inference, table.index(), {points.size()});
    }
};

/// y = table at (u1, u2), element by element.
class Lookup2D final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<double>> breakpoints1{
        this, "breakpoints1", {.initial = {0, 1}, .doc = "where the table's rows stand; increasing"}};
    Argument<std::vector<double>> breakpoints2{
        this, "breakpoints2", {.initial = {0, 1}, .doc = "where the table's columns stand; increasing"}};
    Argument<std::string> interpolation{
        this,
        "interpolation",
        {.initial = "linear",
         .doc = "between breakpoints: along straight lines, the value below, or the nearest value",
         .choices = {"linear", "flat", "nearest"}}};
    Extrapolation extrapolation{this};
    const std::vector<double> points1 = increasing(*this, "breakpoints1", *breakpoints1);
    const std::vector<double> points2 = increasing(*this, "breakpoints2", *breakpoints2);
    Parameter<> table{this,
                      "table",
                      {.initial = {0, 1, 1, 2},
                       .unit = any_unit,
                       .doc = "one row per breakpoint of u1, one column per breakpoint of u2",
                       .as_written = true}};
    InputList<> u{this, "u", 2, any()};
    Output<> y{this, "y", any("value of the table")};
    Workspace<Guesses> guess{this, "guess", {.shape = {Extent(2)}}};
    std::vector<Edges> pieces =
        table_edges(this, interpolation_of(*interpolation), extrapolation.clips(), {points1, points2}, u);
    OutputRule rule{
        this,  kernels::Lookup{},
        y,     layout(interpolation_of(*interpolation), extrapolation.clips(), {points1, points2}),
        table, u,
        guess};

    void infer(Inference& inference) const override {
        for (const auto& piece : pieces) piece.infer(*this, inference);
        check_table(*this, inference, table.index(), {points1.size(), points2.size()});
        broadcast(*this, inference, slots(u), y.index());
    }
};

/// y = table at (u1, u2, …), element by element.
class LookupND final : public Block {
  public:
    using Block::Block;
    Argument<int> dimensions{
        this,
        "dimensions",
        {.initial = 3, .minimum = 1, .maximum = kernels::most_table_dimensions, .doc = "number of inputs"}};
    Argument<std::string> interpolation{
        this,
        "interpolation",
        {.initial = "linear",
         .doc = "between breakpoints: along straight lines, the value below, or the nearest value",
         .choices = {"linear", "flat", "nearest"}}};
    Extrapolation extrapolation{this};
    const int count = *dimensions;
    const std::vector<std::vector<double>> points = declare_points();
    Parameter<> table{
        this,
        "table",
        {.initial = {0, 1, 1, 2, 1, 2, 2, 3},
         .unit = any_unit,
         .doc = "values, those along the first dimension next to each other: [T(:,:,1) T(:,:,2) ...]",
         .as_written = true}};
    InputList<> u{this, "u", count, any()};
    Output<> y{this, "y", any("value of the table")};
    Workspace<Guesses> guess{this, "guess", {.shape = {Extent(count)}}};
    std::vector<Edges> pieces =
        table_edges(this, interpolation_of(*interpolation), extrapolation.clips(), points, u);
    OutputRule rule{this,  kernels::Lookup{},
                    y,     layout(interpolation_of(*interpolation), extrapolation.clips(), points),
                    table, u,
                    guess};

    void infer(Inference& inference) const override {
        for (const auto& piece : pieces) piece.infer(*this, inference);
        std::vector<std::size_t> lengths;
        for (const auto& x : points) lengths.push_back(x.size());
        check_table(*this, inference, table.index(), lengths);
        broadcast(*this, inference, slots(u), y.index());
    }

  private:
    std::vector<std::vector<double>> declare_points() {
        std::vector<std::vector<double>> all;
        for (int i = 1; i <= count; ++i) {
            const std::string name = "breakpoints" + std::to_string(i);
            const Argument<std::vector<double>> argument(this, name.c_str(),
                                                         {.initial = {0, 1}, .doc = breakpoints_doc});
            all.push_back(increasing(*this, name, *argument));
        }
        return all;
    }
};

/// y = table(i) or table(i, j).
class DirectLookup final : public Block {
  public:
    explicit DirectLookup(const Arguments& arguments) : Block(arguments) {
        OutputRule(this, kernels::ElementAt{}, y,
                   Constants({double(*outside == "error"), double(*from_zero)}), table, index);
        for (int i = 0; i < index.size(); ++i)
            elements.emplace_back(this, "element" + std::to_string(i + 1), "index without its fraction",
                                  kernels::WholeNumber{}, index[i]);
    }
    Argument<int> dimensions{this,
                             "dimensions",
                             {.initial = 1,
                              .minimum = 1,
                              .maximum = 2,
                              .doc = "1: one index, along the columns; 2: row and column"}};
    Argument<bool> from_zero{this, "from_zero", {.initial = false, .doc = "the first element is 0, else 1"}};
    Argument<std::string> outside{this,
                                  "outside",
                                  {.initial = "clip",
                                   .doc = "an index that is not in the table: take the nearest one, or stop",
                                   .choices = {"clip", "error"}}};
    Parameter<> table{this, "table", {.initial = {1}, .unit = any_unit, .doc = "values", .as_written = true}};
    InputList<Array<double>> index{this, "i", *dimensions, {.doc = "index, without its fraction"}};
    Output<> y{this, "y", any("element of the table")};
    std::vector<Edges> elements;

    void infer(Inference& inference) const override {
        for (const auto& element : elements) element.infer(*this, inference);
        broadcast(*this, inference, slots(index), y.index());
    }
};

/// Where u stands among breakpoints.
class Prelookup final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<double>> breakpoints{
        this, "breakpoints", {.initial = {0, 1}, .doc = breakpoints_doc}};
    Extrapolation extrapolation{this};
    const std::vector<double> points = increasing(*this, "breakpoints", *breakpoints);
    AnyShape shape{this};
    Input<> u{this, "u", any(shape)};
    Output<Array<double>> k{this, "k", {.shape = shape, .doc = "breakpoint below u, counted from 0"}};
    Output<Array<double>> f{this, "f", {.shape = shape, .doc = "part of the way to the next one"}};
    Workspace<Guesses> guess{this, "guess", {.shape = scalar}};
    OutputRule rule{
        this, kernels::Prelookup{}, k, f, Constants({double(extrapolation.clips())}), Constants(points), u,
        guess};
    Edges piece = table_edges(this, "piece", Interpolation::linear, extrapolation.clips(), points, u);

    void infer(Inference& inference) const override { piece.infer(*this, inference); }
};

/// Table at places that Prelookup blocks found.
class InterpolateAt final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<int>> size{
        this, "size", {.initial = {2}, .minimum = 1, .doc = "number of breakpoints of each dimension"}};
    const std::vector<int> lengths = checked();
    Parameter<Array<double>> table{this,
                                   "table",
                                   {.initial = {0, 1},
                                    .unit = any_unit,
                                    .doc = "values, those along the first dimension next to each other",
                                    .as_written = true}};
    InputList<Array<double>> places{this, names(), {.doc = "from a Prelookup block"}};
    Output<Array<double>> y{this, "y", any("value of the table")};
    OutputRule rule{this,  kernels::InterpolateAt{}, y, Constants({lengths.begin(), lengths.end()}), table,
                    places};
    std::vector<Edges> pieces = declare_pieces();

    void infer(Inference& inference) const override {
        for (const auto& piece : pieces) piece.infer(*this, inference);
        check_table(*this, inference, table.index(), {lengths.begin(), lengths.end()});
        broadcast(*this, inference, slots(places), y.index());
    }

  private:
    std::vector<int> checked() {
        if (!size->empty() && size->size() <= kernels::most_table_dimensions) return *size;
        problem("argument 'size' must hold the number of breakpoints of 1 to " +
                std::to_string(kernels::most_table_dimensions) + " dimensions");
        return {2};
    }
    std::vector<Edges> declare_pieces() {
        std::vector<Edges> all;
        for (int i = 0; i < places.size(); i += 2)
            all.emplace_back(this, "piece" + std::to_string(i / 2 + 1), "number of the table's piece",
                             kernels::WholeNumber{}, places[i]);
        return all;
    }
    std::vector<std::string> names() const {
        std::vector<std::string> all;
        for (std::size_t i = 1; i <= lengths.size(); ++i) {
            all.push_back("k" + std::to_string(i));
            all.push_back("f" + std::to_string(i));
        }
        return all;
    }
};

} // namespace

void add_tables(Library& library) {
    library.group("tables")
        .add<Lookup1D>("Lookup1D",
                       "Function of one variable given by points. Between them a straight line, the value "
                       "below, the nearest value, the cubic spline (its first and last two pieces one "
                       "polynomial each) or the modified Akima interpolant; refuses breakpoints that do not "
                       "increase.")
        .add<Lookup2D>("Lookup2D",
                       "Function of two variables given by a table. Along straight lines in each variable, "
                       "the value below or the nearest value; refuses breakpoints that do not increase.")
        .add<LookupND>(
            "LookupND",
            "Function of up to six variables given by a table. Along straight lines in each variable, the "
            "value below or the nearest value; refuses breakpoints that do not increase.")
        .add<DirectLookup>("DirectLookup", "Element of a table. y = table(i) or table(i, j).")
        .add<Prelookup>("Prelookup", "Finds a signal among breakpoints. x_k + f (x_{k+1} - x_k) = u; several "
                                     "InterpolateAt blocks may share the result.")
        .add<InterpolateAt>("InterpolateAt",
                            "Table at places that Prelookup blocks found, one k and f for each dimension. An "
                            "index outside the table stops the run.");
}

} // namespace bf::blocks

#include "bf/core/differenced.hpp"
#include "bf/dynamics/tasks.hpp"
#include "bf/qp/hierarchy.hpp"
#include "rigid_body/robot_block.hpp"
#include "tasks/tasks.hpp"

#include <algorithm>
#include <set>

namespace bf::toolbox {

namespace {

using Names = std::vector<std::string>;
using Fault = qp::Hierarchy::Fault;

constexpr const char* held_doc = "rows [A, lower, upper, weight] that must hold";
constexpr const char* wanted_doc = "rows [A, lower, upper, weight] that are violated as little as possible";
constexpr const char* status_doc =
    "0 solved, 1 iteration limit, -1 internal error or a row at fault, -2 the constraints contradict each "
    "other";

/// Ports of rows, each with as many as are wired.
class RowPorts {
  public:
    /// `columns`: of A, for each port or one for all.
    RowPorts(Block* owner, const Names& names, const std::vector<Extent>& columns, const char* doc) {
        for (std::size_t i = 0; i < names.size(); ++i) {
            Extent wide = columns.size() == 1 ? columns[0] : columns[i];
            wide.plus += static_cast<int>(dynamics::row_extra);
            const Dim rows(owner, ("rows_" + names[i]).c_str());
            keys_.emplace_back(owner, names[i],
                               About{.shape = {rows, wide}, .unit = mixed_units, .doc = doc});
        }
    }
    int size() const { return static_cast<int>(keys_.size()); }
    const Input<Matrix>& operator[](int i) const { return keys_[static_cast<std::size_t>(i)]; }
    auto begin() const { return keys_.begin(); }
    auto end() const { return keys_.end(); }

  private:
    std::vector<Input<Matrix>> keys_;
};

/// What is wired to a hierarchy, in which levels it stands, and how these are solved.
struct Levels {
    /// `rows`: what its ports take.
    Levels(Block* owner, const std::string& rows)
        : constraints{owner,
                      "constraints",
                      {.doc = ("names of ports of " + rows + " that must hold").c_str()}},
          tasks{owner, "tasks", {.doc = ("names of ports of " + rows + " that are wanted").c_str()}},
          levels{owner,
                 "levels",
                 {.doc = "of each task, 1 the first: those of one level are weighed, each level leaves those "
                         "before it as they are; none: all 1"}},
          max_iterations{owner,
                         "max_iterations",
                         {.initial = 1000, .minimum = 1, .doc = "of one solve, all levels together"}},
          rank_tolerance{owner,
                         "rank_tolerance",
                         {.initial = 1e-7,
                          .above = 0,
                          .maximum = 0.01,
                          .doc = "a row of a task asks for nothing where the rows before it leave less than "
                                 "this part of it free"}},
          stop_when_fails{
              owner,
              "stop_when_fails",
              {.initial = false, .doc = "what is not solved ends the run; otherwise it shows in status"}} {}

    /// Refuses wires that cannot be put into levels. `own`: names of other ports.
    void check(Inference& inference, Names own = {}) const {
        own.insert(own.end(), constraints->begin(), constraints->end());
        own.insert(own.end(), tasks->begin(), tasks->end());
        std::set<std::string> seen;
        for (const std::string& name : own)
            if (!seen.insert(name).second)
                inference.refuse("'" + name + "' is listed twice; give each port a name of its own");
        if (!levels->empty() && levels->size() != tasks->size())
            inference.refuse("argument 'levels' has " + std::to_string(levels->size()) +
                             " elements, but there are " + std::to_string(tasks->size()) +
                             " tasks; give one level for each, or none");
        for (const int level : *levels)
            if (level < 1 || level > static_cast<int>(tasks->size()))
                inference.refuse("argument 'levels' has " + std::to_string(level) +
                                 "; levels go from 1, the first, to " + std::to_string(tasks->size()) +
                                 ", the number of tasks");
    }
    int of_task(int task) const { return levels->empty() ? 1 : (*levels)[static_cast<std::size_t>(task)]; }
    int count() const {
        return tasks->empty() ? 0 : levels->empty() ? 1 : *std::max_element(levels->begin(), levels->end());
    }
    qp::Hierarchy::Options options() const {
        return {.max_iterations = max_iterations, .rank_tolerance = rank_tolerance};
    }

    Argument<Names> constraints, tasks;
    Argument<std::vector<int>> levels;
    Argument<int> max_iterations;
    Argument<double> rank_tolerance;
    Argument<bool> stop_when_fails;
};

/// Which rows of a level are those of a port.
struct Place {
    int level, first, rows;
    const Input<Matrix>* port; ///< null: the block's own
    int column, columns;       ///< of x on which they act
};

/// Where the wires of a block lie in the levels of its hierarchy.
struct Layout {
    std::vector<int> rows{0}; ///< of each level
    std::vector<Place> places;

    void add(int level, int count, const Input<Matrix>* port = nullptr, int column = 0, int columns = 0) {
        int& total = rows[static_cast<std::size_t>(level)];
        places.push_back({level, total, count, port, column, columns});
        total += count;
    }
};

/// Copies rows; their A acts on the variables from `column` on.
void write(qp::Hierarchy::Rows& to, int first, const Eigen::Ref<const Matrix>& rows, Eigen::Index column) {
    const Eigen::Index a = rows.cols() - dynamics::row_extra, count = rows.rows();
    to.A.block(first, column, count, a) = rows.leftCols(a);
    to.lower.segment(first, count) = rows.col(a);
    to.upper.segment(first, count) = rows.col(a + 1);
    to.weight.segment(first, count) = rows.col(a + 2);
}

/// A hierarchy and its wires.
struct Solver {
    Layout layout;
    qp::Hierarchy hierarchy;

    int state_size() const { return hierarchy.state_size(); }
    void save(double* to) const { hierarchy.save(to); }
    void restore(const double* from) { hierarchy.restore(from); }
};

/// Says what ends the run where failures do: the entry of the wire at fault, or what to do.
Status failure(const qp::Hierarchy::Result& result, const Layout& layout) {
    const auto place = std::find_if(layout.places.begin(), layout.places.end(), [&](const Place& p) {
        return p.level == result.level && result.row >= p.first && result.row < p.first + p.rows;
    });
    if (result.fault != Fault::none && place != layout.places.end() && place->port != nullptr) {
        const auto& port = *place->port;
        const auto element = [&](int column) { return result.row - place->first + column * place->rows; };
        switch (result.fault) {
        case Fault::matrix:
            return Status::failure("{element} is not finite or above 1e100; look at what computes it", port,
                                   element(result.column - place->column));
        case Fault::bound:
            return Status::failure(
                "{element} or the upper bound beside it is no bound; use -inf and inf where there is none",
                port, element(place->columns));
        case Fault::weight:
            return Status::failure("{element} is no weight; it must be from 0 to 1e100", port,
                                   element(place->columns + 2));
        case Fault::crossing:
            return Status::failure("{element} is above the upper bound beside it; look at what computes them",
                                   port, element(place->columns));
        default:
            return Status::failure(
                "{element} contradicts other equalities that must hold; relax it, or make it a task", port,
                element(place->columns));
        }
    }
    if (result.fault == Fault::matrix || result.fault == Fault::bound)
        return Status::failure("the equations of motion are not finite; look at the robot's state");
    switch (result.status) {
    case qp::Status::iteration_limit:
        return Status::failure("level {} was not solved within max_iterations; raise it", result.levels + 1);
    case qp::Status::infeasible:
        return Status::failure("the constraints contradict each other; relax them, or make limits a task of "
                               "the first level, which is violated as little as possible");
    default:
        return Status::failure("the solver broke down at level {}; scale the rows alike", result.levels + 1);
    }
}

/// Is there an x? A level above the first that fails leaves that of the levels before it.
bool is_usable(const qp::Hierarchy::Result& result) {
    return result.status == qp::Status::solved || result.levels > 0;
}

class HierarchicalQP final : public Block, public WarmStarted {
  public:
    using Block::Block;
    Levels levels{this, "rows"};

    Dim n{this, "n"};
    Dim l{this, "l", [this] { return levels.count(); }};
    RowPorts constraints{this, *levels.constraints, {n}, held_doc};
    RowPorts tasks{this, *levels.tasks, {n}, wanted_doc};
    Output<Vector> x{
        this,
        "x",
        {.shape = {n}, .unit = any_unit, .doc = "solution; the last one while no level is solved"}};
    Output<double> status{this, "status", {.doc = status_doc}};
    Output<Vector> violation{this,
                             "violation",
                             {.shape = {l},
                              .unit = any_unit,
                              .doc = "of each level: root of the sum of weight times violation squared",
                              .present = tasks.size() > 0}};
    DiscreteState<Vector> last{this, "last", {.shape = {n}, .unit = any_unit, .doc = "last solution"}};
    DiscreteState<Vector> last_violation{
        this,
        "last_violation",
        {.shape = {l}, .unit = any_unit, .doc = "its violations", .present = tasks.size() > 0}};
    OutsideState<Solver> solver{this, [this] { return make_solver(); }};

    void infer(Inference& inference) const override {
        if (constraints.size() + tasks.size() == 0)
            inference.refuse("it has no rows; name ports in tasks or constraints");
        if (const Size* known = inference.size(x); known && known->rows < 1)
            inference.refuse(
                "its rows have no column of A; a row is [A, lower, upper, weight], at least 4 numbers");
        levels.check(inference);
    }
    Status reset(Now at, After) const noexcept override {
        at[solver].hierarchy.reset();
        return ok;
    }
    Status output(Now at, Out out) const noexcept override {
        auto& [layout, hierarchy] = at[solver];
        for (const Place& place : layout.places) {
            auto rows = hierarchy.level(place.level);
            write(rows, place.first, at[*place.port], place.column);
        }
        auto solution = out[x];
        solution = at[last];
        const auto result = hierarchy.solve(solution);
        out[status] = static_cast<double>(result.status);
        if (violation.is_present()) {
            out[violation] = at[last_violation];
            if (is_usable(result)) out[violation] = hierarchy.violation();
        }
        return result.status == qp::Status::solved || !levels.stop_when_fails ? ok : failure(result, layout);
    }
    Status update(Now at, Next next) const noexcept override {
        next[last] = at[x];
        if (violation.is_present()) next[last_violation] = at[violation];
        return ok;
    }

  private:
    std::shared_ptr<Solver> make_solver() const {
        Layout layout;
        layout.rows.resize(static_cast<std::size_t>(value(l)) + 1);
        for (const auto& port : constraints) layout.add(0, size(port).rows, &port, 0, value(n));
        for (int i = 0; i < tasks.size(); ++i)
            layout.add(levels.of_task(i), size(tasks[i]).rows, &tasks[i], 0, value(n));
        qp::Hierarchy hierarchy(value(n), layout.rows, levels.options());
        return std::make_shared<Solver>(Solver{std::move(layout), std::move(hierarchy)});
    }
};

class TaskSpaceInverseDynamics final : public VelocityBlock, public WarmStarted {
  public:
    using VelocityBlock::VelocityBlock;
    Argument<Names> surfaces{
        this, "surfaces", {.doc = "frames that touch the world and transmit a wrench, such as soles"}};
    Argument<Names> points{
        this, "points", {.doc = "frames that touch it with their origin and transmit a force"}};
    Levels levels{this, "rows over nu_dot"};

    Dim c{this, "c", [this] { return contact_names(); }};
    Dim m{this, "m", [this] { return wrench_names(); }};
    Dim l{this, "l", [this] { return levels.count(); }};
    Input<Vector> contacts{
        this,
        "contacts",
        {.shape = {c},
         .initial = {1},
         .doc = "1: the contact is there; 0: its wrench is zero and it may move; surfaces, then points",
         .present = has_contacts(),
         .optional = true}};
    RowPorts limits{
        this, prefixed("limits_", *contact_names()), contact_sizes(),
        "rows [A, lower, upper, weight] over the wrench on the frame, as ContactLimits makes them"};
    RowPorts constraints{this, *levels.constraints, {v}, held_doc};
    RowPorts tasks{this, *levels.tasks, {v}, wanted_doc};
    Parameter<double> contact_damping{this,
                                      "contact_damping",
                                      {.initial = {10},
                                       .minimum = 0,
                                       .unit = unit<"1/s">,
                                       .doc = "takes away what velocity contacts have"}};
    Parameter<Vector> max_torque{this,
                                 "max_torque",
                                 {.shape = {n},
                                  .initial = {bf::Limits::infinity},
                                  .above = 0,
                                  .unit = unit<"Nm">,
                                  .doc = "besides those of the URDF"}};
    Output<Vector> tau{this, "tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "joint torques"}};
    Output<Vector> nu_dot{
        this, "nu_dot", {.shape = {v}, .unit = mixed_units, .doc = "accelerations [v_b_dot; s_ddot]"}};
    Output<Vector> f{this,
                     "f",
                     {.shape = {m},
                      .unit = mixed_units,
                      .doc = "wrenches on the surfaces [N; Nm], forces on the points [N], world axes",
                      .present = has_contacts()}};
    Output<double> status{this, "status", {.doc = status_doc}};
    Output<Vector> violation{this,
                             "violation",
                             {.shape = {l},
                              .unit = any_unit,
                              .doc = "of each level: root of the sum of weight times violation squared",
                              .present = tasks.size() > 0}};
    DiscreteState<Vector> last_tau{
        this, "last_tau", {.shape = {n}, .unit = unit<"Nm">, .doc = "last torques"}};
    DiscreteState<Vector> last_nu_dot{
        this, "last_nu_dot", {.shape = {v}, .unit = mixed_units, .doc = "last accelerations"}};
    DiscreteState<Vector> last_f{
        this,
        "last_f",
        {.shape = {m}, .unit = mixed_units, .doc = "last wrenches", .present = has_contacts()}};
    DiscreteState<Vector> last_violation{
        this,
        "last_violation",
        {.shape = {l}, .unit = any_unit, .doc = "their violations", .present = tasks.size() > 0}};
    OutsideState<Solver> solver{this, [this] { return make_solver(); }};

    /// What is computed before the levels are written.
    struct Work {
        Matrix equations, rows; ///< [M, -J'] over x, and the rows of one contact
        Vector h, x;
        Eigen::Matrix<double, 6, Eigen::Dynamic> J;
    };
    Scratch<Work> work{this, [this] {
                           const int wide = value(v);
                           return Work{Matrix(wide, wide + value(m)), Matrix(6, wide + 3), Vector(wide),
                                       Vector::Zero(wide + value(m)),
                                       Eigen::Matrix<double, 6, Eigen::Dynamic>(6, wide)};
                       }};

    void infer(Inference& inference) const override {
        Names own = prefixed("limits_", *contact_names());
        own.insert(own.end(), {"w_H_b", "s", "v_b", "s_dot", "contacts"});
        levels.check(inference, std::move(own));
        if (!robot.is_bound()) return;
        contacts_.clear();
        for (const std::string& name : *surfaces) contacts_.push_back({model().frame(name), 6});
        for (const std::string& name : *points) contacts_.push_back({model().frame(name), 3});
    }
    Status reset(Now at, After) const noexcept override {
        at[solver].hierarchy.reset();
        return ok;
    }
    Status evaluate(Now at, Out out) const noexcept override {
        auto& d = at_state(at);
        auto& [layout, hierarchy] = at[solver];
        Work& w = at[work];
        const Eigen::Index wide = model().velocities(), joints = model().joints(), base = wide - joints;
        dynamics::motion_equations(model(), d, contacts_, w.equations, w.h, w.J);

        // The base has no motor; those of the joints have limits.
        auto hard = hierarchy.level(0);
        hard.A.topRows(wide) = w.equations;
        hard.lower.head(base) = hard.upper.head(base) = -w.h.head(base);
        const auto torque = model().effort_max().cwiseMin(at[max_torque]);
        hard.lower.segment(base, joints) = -torque - w.h.tail(joints);
        hard.upper.segment(base, joints) = torque - w.h.tail(joints);

        // A contact moves and pushes, or does neither.
        Eigen::Index row = wide, column = wide;
        for (std::size_t i = 0; i < contacts_.size(); ++i) {
            const dynamics::Contact& contact = contacts_[i];
            const bool touches = at[contacts][static_cast<Eigen::Index>(i)] > 0.5;
            auto rows = w.rows.topRows(contact.size);
            dynamics::rigid_contact(model(), d, contact.frame, at[contact_damping], rows, w.J);
            hard.A.block(row, 0, contact.size, wide) = rows.leftCols(wide);
            hard.lower.segment(row, contact.size) = hard.upper.segment(row, contact.size) = rows.col(wide);
            hard.weight.segment(row, contact.size).setConstant(touches ? 1.0 : 0.0);
            row += contact.size;
            hard.A.block(row, column, contact.size, contact.size).setIdentity();
            hard.weight.segment(row, contact.size).setConstant(touches ? 0.0 : 1.0);
            row += contact.size;
            column += contact.size;
        }
        std::size_t limit = 0;
        for (const Place& place : layout.places) {
            if (place.port == nullptr) continue;
            auto rows = hierarchy.level(place.level);
            write(rows, place.first, at[*place.port], place.column);
            const bool is_limit = place.column > 0;
            if (is_limit && !(at[contacts][static_cast<Eigen::Index>(limit++)] > 0.5))
                rows.weight.segment(place.first, place.rows).setZero();
        }

        const auto result = hierarchy.solve(w.x);
        out[status] = static_cast<double>(result.status);
        const bool usable = is_usable(result);
        if (usable) {
            out[nu_dot] = w.x.head(wide);
            out[tau] = w.h.tail(joints);
            out[tau].noalias() += w.equations.bottomRows(joints).lazyProduct(w.x);
        } else {
            out[nu_dot] = at[last_nu_dot];
            out[tau] = at[last_tau];
        }
        if (has_contacts()) {
            out[f] = at[last_f];
            if (usable) out[f] = w.x.tail(w.x.size() - wide);
        }
        if (violation.is_present()) {
            out[violation] = at[last_violation];
            if (usable) out[violation] = hierarchy.violation();
        }
        return result.status == qp::Status::solved || !levels.stop_when_fails ? ok : failure(result, layout);
    }
    Status update(Now at, Next next) const noexcept override {
        next[last_nu_dot] = at[nu_dot];
        next[last_tau] = at[tau];
        if (has_contacts()) next[last_f] = at[f];
        if (violation.is_present()) next[last_violation] = at[violation];
        return ok;
    }

  private:
    bool has_contacts() const { return !surfaces->empty() || !points->empty(); }
    Dim::Names contact_names() const {
        Names names = *surfaces;
        names.insert(names.end(), points->begin(), points->end());
        return names;
    }
    Dim::Names wrench_names() const {
        Names names;
        for (const std::string& name : *surfaces)
            for (const char* part : {"_fx", "_fy", "_fz", "_mx", "_my", "_mz"}) names.push_back(name + part);
        for (const std::string& name : *points)
            for (const char* part : {"_fx", "_fy", "_fz"}) names.push_back(name + part);
        return names;
    }
    std::vector<Extent> contact_sizes() const {
        std::vector<Extent> sizes(surfaces->size(), Extent(6));
        sizes.resize(surfaces->size() + points->size(), Extent(3));
        return sizes;
    }
    std::shared_ptr<Solver> make_solver() const {
        Layout layout;
        layout.rows.resize(static_cast<std::size_t>(value(l)) + 1);
        layout.add(0, value(v));
        for (const dynamics::Contact& contact : contacts_) layout.add(0, 2 * contact.size);
        int column = value(v);
        for (int i = 0; i < limits.size(); ++i) {
            const int wide = contacts_[static_cast<std::size_t>(i)].size;
            layout.add(0, size(limits[i]).rows, &limits[i], column, wide);
            column += wide;
        }
        for (const auto& port : constraints) layout.add(0, size(port).rows, &port, 0, value(v));
        for (int i = 0; i < tasks.size(); ++i)
            layout.add(levels.of_task(i), size(tasks[i]).rows, &tasks[i], 0, value(v));
        qp::Hierarchy hierarchy(value(v) + value(m), layout.rows, levels.options());
        return std::make_shared<Solver>(Solver{std::move(layout), std::move(hierarchy)});
    }

    mutable std::vector<dynamics::Contact> contacts_;
};

} // namespace

void add_task_solvers(Library& library) {
    library.group("task space")
        .add<HierarchicalQP>(
            "HierarchicalQP",
            "The x that keeps all constraints and violates the tasks as little as possible, level by level: "
            "of all x that keep the constraints those of least 1/2 sum weight violation^2 of level 1, of "
            "these those of level 2, and so on, at last the x of least |x|. Each port takes rows [A, lower, "
            "upper, weight], r x (n+3), which ask for lower <= A x <= upper; equal bounds make an equality, "
            "-inf and inf are none, weight 0 switches a row off. One level is an ordinary weighted quadratic "
            "program. Limits given as a task of level 1 are never infeasible: they are violated as little as "
            "possible, and all else comes after. While status is not 0: x is the best of the levels before "
            "the one that failed, and when that was the first, the last solution (zero before the first). "
            "Sources: B. Siciliano, J.-J. Slotine, A general framework for managing multiple tasks in highly "
            "redundant robotic systems, 1991; O. Kanoun, F. Lamiraux, P.-B. Wieber, Kinematic control of "
            "redundant manipulators: generalizing the task-priority framework to inequality task, 2011; "
            "status numbers are those of QP. Errors: levels that are not those of the tasks, a name that is "
            "given twice. With stop_when_fails, what is not solved, naming the entry that is at fault.")
        .add<TaskSpaceInverseDynamics>(
            "TaskSpaceInverseDynamics",
            "Joint torques of the tasks: HierarchicalQP over x = [nu_dot; f], the accelerations and the "
            "wrenches of the contacts, under the equations of motion M nu_dot + h = [0; tau] + sum J' f (tau "
            "follows from x and is no variable), |tau| <= max_torque, contacts that do not move, J nu_dot = "
            "-J_dot nu - contact_damping J nu, and their limits. Tasks and constraints are rows over nu_dot. "
            "What no level decides is the x of least norm, so that contacts share the load. While status is "
            "not 0: the best of the levels before the one that failed, and when that was the first, torques, "
            "accelerations and wrenches stay as they were. Sources: A. Herzog, N. Rotella, S. Mason, F. "
            "Grimminger, S. Schaal, L. Righetti, Momentum control with hierarchical inverse dynamics on a "
            "torque-controlled humanoid, 2016; those of HierarchicalQP. Errors: a frame that the robot does "
            "not have (the text lists similar ones), levels that are not those of the tasks, a name that is "
            "given twice. With stop_when_fails, what is not solved, naming the entry that is at fault.");
}

} // namespace bf::toolbox

#include "bf/analysis/trim.hpp"

#include "bf/analysis/linearize.hpp"
#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/core/registry.hpp"
#include "look.hpp"
#include "named.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <exception>
#include <kinsol/kinsol.h>
#include <memory>
#include <nvector/nvector_serial.h>
#include <optional>
#include <set>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

namespace bf::analysis {

namespace {

constexpr double tolerance = 1e-10; ///< of residuals, relative where values are larger than 1

/// An element of the diagram's memory that is found, held or looked at.
struct Variable {
    std::string name, numbered; ///< "arm.q[elbow]", "arm.q[2]"
    Node::End end;
    int element = 0;
    double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
    double scale = 1; ///< in which the map below turns to its bound on one side

    bool has_lower() const { return std::isfinite(lower); }
    bool has_upper() const { return std::isfinite(upper); }
    /// Gives it bounds where the run stands at x.
    void keep_between(double least, double most, double x) {
        lower = least, upper = most;
        if (has_lower() != has_upper()) scale = std::max(std::abs(x - (has_lower() ? lower : upper)), 1e-6);
    }
    /// The value of a number without bounds, and back, and the slope of that. What stands on a bound or
    /// beyond begins inside, where the slope is not small: a first step would lead anywhere.
    double outward(double z) const {
        if (has_lower() && has_upper()) return lower + (upper - lower) / 2 * (std::sin(z) + 1);
        const double room = std::hypot(z, scale) - scale;
        return has_lower() ? lower + room : has_upper() ? upper - room : z;
    }
    double inward(double x) const {
        if (has_lower() && has_upper())
            return std::asin(std::clamp(2 * (x - lower) / (upper - lower) - 1, -0.999, 0.999));
        return has_lower() || has_upper() ? std::sqrt(3) * scale : x; // as far inside as it may be outside
    }
    double slope(double z) const {
        if (has_lower() && has_upper()) return (upper - lower) / 2 * std::cos(z);
        const double root = z / std::hypot(z, scale);
        return has_lower() ? root : has_upper() ? -root : 1;
    }
};

class Trim {
  public:
    Trim(Simulation& run, const TrimOptions& options)
        : run_(run), d_(run.diagram()), context_(run.context()) {
        find_variables(options);
        start_ = run_.snapshot();
        const auto count = unknowns_.size(), wanted = states_.size() + targets_.size();
        if (count == wanted) return;
        throw RunError("there are " + std::to_string(count) + " free numbers (" + list(unknowns_) + ") for " +
                       std::to_string(wanted) + " equations (that " + list(states_) + " rest" +
                       (targets_.empty() ? "" : ", and the targets of " + list(targets_)) +
                       "); free an input or give a target, or hold a state, for each that is missing");
    }

    TrimResult operator()() {
        if (unknowns_.empty()) return finish(nullptr);
        const auto n = static_cast<sunindextype>(unknowns_.size());
        SUNContext context = nullptr;
        if (SUNContext_Create(nullptr, &context) != 0) throw std::bad_alloc();
        const std::shared_ptr<void> own(nullptr, [&](void*) { SUNContext_Free(&context); });
        const std::shared_ptr<_generic_N_Vector> z(N_VNew_Serial(n, context), N_VDestroy),
            ones(N_VNew_Serial(n, context), N_VDestroy);
        const std::shared_ptr<_generic_SUNMatrix> matrix(SUNDenseMatrix(n, n, context), SUNMatDestroy);
        const std::shared_ptr<_generic_SUNLinearSolver> linear(
            SUNLinSol_Dense(z.get(), matrix.get(), context), [](SUNLinearSolver s) { SUNLinSolFree(s); });
        const std::shared_ptr<void> memory(KINCreate(context), [](void* m) { KINFree(&m); });
        N_VConst(1, ones.get());
        for (sunindextype i = 0; i < n; ++i) {
            const auto& unknown = unknowns_[static_cast<std::size_t>(i)];
            N_VGetArrayPointer(z.get())[i] = unknown.inward(value(unknown));
        }
        KINSetErrHandlerFn(
            memory.get(), [](int, const char*, const char*, char*, void*) {}, nullptr);
        KINSetInfoHandlerFn(
            memory.get(), [](const char*, const char*, char*, void*) {}, nullptr);
        KINInit(memory.get(), residual, z.get());
        KINSetUserData(memory.get(), this);
        KINSetLinearSolver(memory.get(), linear.get(), matrix.get());
        KINSetJacFn(memory.get(), jacobian);
        KINSetFuncNormTol(memory.get(), tolerance);
        KINSetScaledStepTol(memory.get(), 1e-14);
        KINSetMaxSetupCalls(memory.get(), 1);
        // Without this KINSOL goes on by at most 1, and that five times, where it begins at 0.
        KINSetMaxNewtonStep(memory.get(), 1e9);
        KINSetNumMaxIters(memory.get(), 200);
        const auto found = [&] { return Vector(Eigen::Map<Vector>(N_VGetArrayPointer(z.get()), n)); };
        const Vector begin = found();
        static_cast<void>(KINSol(memory.get(), z.get(), KIN_LINESEARCH, ones.get(), ones.get()));
        if (error_) std::rethrow_exception(error_);
        // It looks at the size of residuals, which is small where everything is slow; gives up where the
        // equations say nothing of some number; and may creep along a valley out of which a whole step leads.
        for (const auto& [from, is_damped] : {std::pair(found(), false), {begin, false}, {begin, true}})
            if (const auto rest = newton(from, is_damped); rest && is_solution(*rest))
                return finish(rest->data());
        return finish(N_VGetArrayPointer(z.get()));
    }

  private:
    const Slot& slot(const Node::End& end) const { return d_.slot(end); }
    double value(const Variable& v) const {
        return read_value(context_.data(v.end.node, v.end.slot), slot(v.end).type, v.element);
    }
    void set(const Variable& v, double x) {
        const Type type = slot(v.end).type;
        for (void* memory :
             {context_.data(v.end.node, v.end.slot), context_.next_data(v.end.node, v.end.slot)})
            if (memory) write_values(static_cast<std::byte*>(memory) + v.element * bytes(type), type, 1, {x});
    }
    static std::string list(const std::vector<Variable>& all) {
        std::string text;
        for (std::size_t i = 0; i < all.size() && i < 8; ++i) text += (i ? ", " : "") + all[i].name;
        return all.empty() ? "none" : all.size() > 8 ? text + ", ..." : text;
    }

    // ---- what is free, held and wanted

    void add(std::vector<Variable>& to, const std::string& path, const Node::End& end) {
        const Slot& its = slot(end);
        if (its.type != Type::float64 && its.type != Type::float32) return;
        for (int e = 0; e < its.size.count(); ++e)
            to.push_back({its.size.count() == 1 ? path : path + d_.element_text(end, e),
                          path + "[" + std::to_string(e + 1) + "]", end, e});
    }
    /// Those of that name, of an element or of a whole signal.
    std::vector<Variable> named(const std::vector<Variable>& all, const std::string& name,
                                const char* what) const {
        std::vector<Variable> found;
        std::vector<std::string> names;
        for (const auto& v : all) {
            const bool is_known =
                std::any_of(found.begin(), found.end(), [&](const auto& f) { return is_same(f, v); });
            if (!is_known && (v.name == name || v.numbered == name || v.name.starts_with(name + "[")))
                found.push_back(v);
            names.push_back(v.name);
        }
        if (found.empty())
            throw RunError("there is no " + std::string(what) + " '" + name + "'" +
                           did_you_mean(name, names));
        return found;
    }
    static bool is_same(const Variable& a, const Variable& b) {
        return a.end.node == b.end.node && a.end.slot == b.end.slot && a.element == b.element;
    }

    [[noreturn]] static void refuse_twice(const Variable& v, const char* what, double a, double b) {
        throw RunError("'" + v.name + "' is " + what + " " + number_text(a) + " and " + number_text(b) +
                       "; give one of them");
    }

    void find_variables(const TrimOptions& options) {
        std::vector<Variable> inputs, signals;
        for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n) {
            const auto& node = d_.nodes[static_cast<std::size_t>(n)];
            const auto& slots = node.block->resolution().slots;
            // What only looks on, as a check, rests or not.
            if (std::none_of(slots.begin(), slots.end(),
                             [](const Slot& its) { return its.role == Role::output; }))
                continue;
            if (d_.rates[static_cast<std::size_t>(node.rate)].offset != 0)
                throw RunError(node.path +
                               ": its sample time has an offset, and no step shows what it and all others do "
                               "next; leave the offset out");
            for (int s = 0; s < static_cast<int>(slots.size()); ++s)
                if (is_state(slots[static_cast<std::size_t>(s)].role) && node.condition == 0 && rests(node))
                    add(states_, node.path + "." + slots[static_cast<std::size_t>(s)].name, {n, s});
        }
        for (const auto& port : d_.inputs) add(inputs, port.path, port.end);
        for (const auto& signal : d_.signals()) add(signals, signal.path, signal.end);
        for (const auto& node : d_.nodes)
            if (const auto end = d_.find_signal(node.path); end.node >= 0) add(signals, node.path, end);
        for (const auto& port : d_.outputs) add(signals, port.path, port.end);
        unknowns_ = states_;
        for (const auto& name : options.free)
            for (auto& v : named(inputs, name, "input of the root"))
                if (std::none_of(unknowns_.begin(), unknowns_.end(),
                                 [&](const auto& u) { return is_same(u, v); })) {
                    unknowns_.push_back(v);
                    inputs_.push_back(v.name);
                }
        auto all = states_;
        all.insert(all.end(), inputs.begin(), inputs.end());
        for (const auto* given : {&options.hold, &options.target})
            for (const auto& [name, x] : *given)
                if (!std::isfinite(x))
                    throw RunError("'" + name + "' cannot come to " + number_text(x) +
                                   "; give a finite number");
        for (const auto& [name, x] : options.hold)
            for (const auto& v : named(all, name, "state or input")) {
                std::erase(inputs_, v.name);
                for (const auto& [other, value] : held_)
                    if (is_same(other, v)) refuse_twice(v, "held at", value, x);
                std::erase_if(unknowns_, [&](const Variable& u) { return is_same(u, v); });
                held_.emplace_back(v, x);
            }
        for (const auto& [name, lower, upper] : options.bounds) {
            if (!(lower < upper)) throw RunError("the bounds of '" + name + "' leave nothing between them");
            for (const auto& v : named(unknowns_, name, "free input or state"))
                for (auto& u : unknowns_)
                    if (is_same(u, v)) u.keep_between(lower, upper, value(u));
        }
        for (const auto& [name, x] : options.target)
            for (const auto& v : named(signals, name, "signal")) {
                for (std::size_t i = 0; i < targets_.size(); ++i)
                    if (is_same(targets_[i], v)) refuse_twice(v, "to be", wanted_[i], x);
                targets_.push_back(v);
                wanted_.push_back(x);
            }
    }

    // ---- the equations

    void go_to(const double* z) {
        run_.restore(start_);
        for (const auto& [v, x] : held_) set(v, x);
        for (std::size_t i = 0; i < unknowns_.size(); ++i) set(unknowns_[i], unknowns_[i].outward(z[i]));
    }
    /// Can its states rest? What is disabled or triggered keeps its states.
    bool rests(const DiagramNode& node) const {
        const auto& rate = d_.rates[static_cast<std::size_t>(node.rate)];
        return rate.trigger == 0 && !rate.is_constant;
    }

    /// x' of continuous states, x⁺ - x of sampled ones, y - target.
    /// None: a step fails there.
    std::optional<std::vector<double>> residuals(const double* z) {
        std::vector<double> all;
        go_to(z);
        const Status status = step_with(run_, [&] {
            for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
                for (const Phase phase : {Phase::derivative, Phase::update})
                    if (rests(d_.nodes[static_cast<std::size_t>(n)]))
                        for (int i = 0; i < context_.activities(n, phase); ++i)
                            static_cast<void>(context_.task(n, phase, i)());
            for (const auto& v : states_) {
                const Frame& frame = context_.frame(v.end.node);
                const Slot& its = slot(v.end);
                all.push_back(its.role == Role::continuous_state
                                  ? read_value(frame.rate[v.end.slot], its.type, v.element)
                                  : read_value(frame.next[v.end.slot], its.type, v.element) - value(v));
            }
            for (std::size_t i = 0; i < targets_.size(); ++i) all.push_back(value(targets_[i]) - wanted_[i]);
        });
        if (!status) return std::nullopt;
        return all;
    }

    static int residual(N_Vector z, N_Vector f, void* self) {
        auto& trim = *static_cast<Trim*>(self);
        try {
            const auto all = trim.residuals(N_VGetArrayPointer(z));
            if (!all) return 1; // KINSOL tries a smaller step
            for (std::size_t i = 0; i < all->size(); ++i) {
                if (!std::isfinite((*all)[i])) return 1;
                N_VGetArrayPointer(f)[i] = (*all)[i];
            }
            return 0;
        } catch (...) {
            trim.error_ = std::current_exception();
            return -1;
        }
    }

    /// By all unknowns, of which linearize knows those that are held, too.
    Matrix slopes(const double* z) {
        go_to(z);
        LinearizeOptions options{.from = inputs_, .at_once = true};
        for (const auto& v : targets_) options.to.push_back(v.name);
        const auto system = linearize(run_, options);
        system_held_ = system.held;
        Matrix all(states_.size() + targets_.size(), unknowns_.size());
        // linearize also has the states that keep theirs.
        std::vector<Eigen::Index> rows;
        for (const auto& v : states_)
            rows.push_back(std::find(system.states.begin(), system.states.end(), v.name) -
                           system.states.begin());
        for (std::size_t j = 0; j < unknowns_.size(); ++j) {
            const auto state = std::find_if(states_.begin(), states_.end(),
                                            [&](const Variable& v) { return is_same(v, unknowns_[j]); });
            const bool is_state = state != states_.end();
            const auto number = static_cast<std::size_t>(state - states_.begin());
            const auto column =
                is_state ? rows[number] : static_cast<Eigen::Index>(j - (unknowns_.size() - inputs_.size()));
            const auto to = static_cast<Eigen::Index>(j);
            all.col(to) << (is_state ? system.A : system.B)(rows, column),
                (is_state ? system.C : system.D).col(column);
            if (is_state && slot(state->end).role == Role::discrete_state)
                all(static_cast<Eigen::Index>(number), to) -= 1;
            all.col(to) *= unknowns_[j].slope(z[j]);
        }
        return all;
    }

    static int jacobian(N_Vector z, N_Vector, SUNMatrix to, void* self, N_Vector, N_Vector) {
        auto& trim = *static_cast<Trim*>(self);
        try {
            const Matrix slopes = trim.slopes(N_VGetArrayPointer(z));
            for (Eigen::Index j = 0; j < slopes.cols(); ++j)
                for (Eigen::Index i = 0; i < slopes.rows(); ++i) SM_ELEMENT_D(to, i, j) = slopes(i, j);
            return 0;
        } catch (...) {
            trim.error_ = std::current_exception();
            return -1;
        }
    }

    Vector sizes(const double* z) const {
        Vector all(static_cast<Eigen::Index>(unknowns_.size()));
        for (std::size_t i = 0; i < unknowns_.size(); ++i)
            all[static_cast<Eigen::Index>(i)] = std::max(1.0, std::abs(unknowns_[i].outward(z[i])));
        return all;
    }

    /// Newton steps until they change nothing more, of which the shortest is taken where the equations leave
    /// several; damped ones are cut until the next one would be shorter, which does not depend on how
    /// equations are scaled. None: they do not come to an end. Source: Deuflhard, Newton Methods for
    /// Nonlinear Problems, §3.2, the natural monotonicity test.
    std::optional<Vector> newton(Vector z, bool is_damped) {
        constexpr int most_steps = 60;
        try {
            for (int k = 0; k < most_steps; ++k) {
                const auto left = residuals(z.data());
                if (!left) return std::nullopt;
                const Vector scale = sizes(z.data());
                Matrix by = slopes(z.data()) * scale.asDiagonal();
                Vector measure = by.rowwise().lpNorm<Eigen::Infinity>(); // each equation has its own
                measure = (measure.array() > 0).select(measure.cwiseInverse(), 1);
                by = measure.asDiagonal() * by;
                const auto solver = by.completeOrthogonalDecomposition();
                const auto correction = [&](const std::vector<double>& r) -> Vector {
                    return solver.solve(measure.cwiseProduct(Eigen::Map<const Vector>(r.data(), by.rows())));
                };
                const Vector step = correction(*left);
                if (!step.allFinite()) return std::nullopt;
                double part = 1;
                const auto is_nearer = [&] {
                    const auto next = residuals(Vector(z - part * scale.cwiseProduct(step)).data());
                    return next && correction(*next).norm() <= (1 - part / 4) * step.norm();
                };
                while (is_damped && part > 1e-9 && !is_nearer()) part /= 2;
                z -= part * scale.cwiseProduct(step);
                if (part == 1 && step.cwiseAbs().maxCoeff() < 1e-13) return z;
            }
        } catch (const RunError&) { // it has no derivative there
        }
        return std::nullopt;
    }

    /// What is left must be small beside what small changes of the numbers make: where it is no more changed
    /// by them, as far along an asymptote, it is not.
    bool is_solution(const Vector& z) {
        const auto left = residuals(z.data());
        return left && is_small(*left, z.data());
    }
    bool is_small(const std::vector<double>& left, const double* z) {
        Vector scale;
        const Vector all = sizes(z);
        try {
            if (!unknowns_.empty()) scale = slopes(z).cwiseAbs() * all;
        } catch (const RunError&) { // it has no derivative right there, as a root at 0
            scale = Vector::Constant(static_cast<Eigen::Index>(left.size()), all.maxCoeff());
        }
        for (std::size_t i = 0; i < left.size(); ++i)
            if (!(std::abs(left[i]) <= 1e-7 * scale[static_cast<Eigen::Index>(i)] + 1e-10)) return false;
        return true;
    }

    TrimResult finish(const double* z) {
        const auto there = residuals(z);
        if (!there) fail_there();
        const auto& left = *there;
        TrimResult result;
        for (std::size_t i = 0; i < unknowns_.size(); ++i)
            result.free.emplace_back(unknowns_[i].name, unknowns_[i].outward(z[i]));
        std::size_t worst = 0;
        for (std::size_t i = 0; i < left.size(); ++i) {
            const bool is_state = i < states_.size();
            const auto& of = is_state ? states_[i] : targets_[i - states_.size()];
            result.residuals.emplace_back(of.name, left[i]);
            if (!(std::abs(left[i]) <= std::abs(left[worst]))) worst = i;
        }
        if (!is_small(left, z)) fail(z, left, worst);
        result.held = system_held_;
        go_to(z);
        return result;
    }

    /// Blocks on wires to that one which what is free reaches, and which do not pass it on.
    std::vector<std::string> stops_before(const double* z, int to) {
        const auto node = [&](int n) -> const DiagramNode& { return d_.nodes[static_cast<std::size_t>(n)]; };
        const SignalFinder finder(d_);
        LinearizeOptions options{.from = inputs_, .at_once = true};
        std::vector<Node::End> looked;
        for (const auto& one : finder.all())
            if (slot(one.end).type == Type::float64) {
                options.to.push_back(one.path);
                looked.push_back(one.end);
            }
        std::set<int> moving, known;
        for (const auto& v : unknowns_)
            if (!is_state(slot(v.end).role)) moving.insert(v.end.node);
        try {
            go_to(z);
            const auto system = linearize(run_, options);
            Matrix by = Matrix::Zero(system.C.rows(), 1);
            if (!inputs_.empty()) by += system.D.cwiseAbs().rowwise().sum();
            for (const auto& v : unknowns_)
                for (std::size_t i = 0; i < system.states.size(); ++i)
                    if (system.states[i] == v.name)
                        by += system.C.col(static_cast<Eigen::Index>(i)).cwiseAbs();
            Eigen::Index row = 0;
            for (const auto& end : looked) {
                const int count = slot(end).size.count();
                if (!by.middleRows(row, count).isZero(0)) moving.insert(end.node);
                known.insert(end.node);
                row += count;
            }
        } catch (const RunError&) { // it has no derivative there
            return {};
        }
        const auto before = reached({to}, [&](int n, auto&& go) {
            for (const auto& source : node(n).sources)
                if (source.node >= 0) go(source.node);
        });
        std::vector<std::string> stops;
        for (const int n : before)
            if (known.contains(n) && !moving.contains(n) &&
                std::ranges::any_of(node(n).sources,
                                    [&](const auto& source) { return moving.contains(source.node); }))
                stops.push_back("'" + node(n).path + "'");
        return stops;
    }

    [[noreturn]] void fail_there() {
        run_.restore(start_);
        throw RunError("no operating point was found: a step fails there; give other initial states");
    }
    [[noreturn]] void fail(const double* z, const std::vector<double>& left, std::size_t worst) {
        const bool is_state = worst < states_.size();
        const auto& of = is_state ? states_[worst] : targets_[worst - states_.size()];
        const char* what = !is_state                                     ? " misses its target by "
                           : slot(of.end).role == Role::continuous_state ? " still moves, per second by "
                                                                         : " still moves, per sample by ";
        const Matrix by = slopes(z);
        const auto stops = stops_before(z, of.end.node);
        run_.restore(start_);
        Eigen::Index most = 0;
        by.row(static_cast<Eigen::Index>(worst)).cwiseAbs().maxCoeff(&most);
        std::string text =
            "no operating point was found: '" + of.name + "'" + what + std::to_string(left[worst]) + ", and ";
        std::string at_bounds;
        for (std::size_t i = 0; i < unknowns_.size(); ++i) {
            const double x = unknowns_[i].outward(z[i]);
            const double room = 1e-3 * std::max(1.0, std::abs(x));
            if (x - unknowns_[i].lower < room || unknowns_[i].upper - x < room)
                at_bounds += (at_bounds.empty() ? "'" : ", '") + unknowns_[i].name + "'";
        }
        if (!at_bounds.empty())
            text += at_bounds + " is at its bound; widen it, or ask for less";
        else if (!stops.empty())
            text +=
                name_list(stops) + (stops.size() == 1 ? " passes" : " pass") +
                " no small change on of what is free: it stands at a limit, has steps, or its gain is 0; ask "
                "for less, widen the limit, or begin elsewhere";
        else if (by.row(static_cast<Eigen::Index>(worst)).cwiseAbs().maxCoeff() < 1e-9)
            text += "nothing that is free changes that; free another input, or hold another state";
        else
            text += "it depends most on '" + unknowns_[static_cast<std::size_t>(most)].name +
                    "'; begin nearer, free another input, or hold another state";
        throw RunError(text);
    }

    Simulation& run_;
    const Diagram& d_;
    Context& context_;
    std::vector<std::byte> start_;
    std::vector<Variable> states_, unknowns_, targets_;
    std::vector<std::string> inputs_; ///< names of the free ones, which are the last unknowns
    std::vector<std::pair<Variable, double>> held_;
    std::vector<double> wanted_;
    std::vector<std::string> system_held_; ///< as linearize says it
    std::exception_ptr error_;
};

} // namespace

TrimResult trim(Simulation& run, const TrimOptions& options) { return Trim(run, options)(); }

} // namespace bf::analysis

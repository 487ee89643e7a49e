// Where the output or derivative of a block jumps or has a corner, a zero-crossing function must tell an
// adaptive solver of it. The blocks are searched for such places along lines, knowing nothing but their
// declarations.
#include "contract.hpp"
#include "standard_variants.hpp"

#include "bf/blocks/standard.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <optional>
#include <random>

namespace bf::conformance {
namespace {

using test::RunBlock;
using Values = std::vector<double>;

/// One block as a function of its inputs and continuous states.
class Function {
  public:
    struct Result {
        Values values;                   ///< outputs, then derivatives
        std::vector<std::string> places; ///< the name of each
        Values margins, counts;          ///< guards, and those of whole numbers
    };

    explicit Function(RunBlock run) : run_(std::move(run)) {
        for (const Phase phase : {Phase::output, Phase::derivative, Phase::guards})
            for (int i = 0; i < run_.context().activities(0, phase); ++i)
                tasks_.push_back(run_.context().task(0, phase, i));
        const auto& all = slots();
        for (std::size_t i = 0; i < all.size(); ++i)
            if (all[i].type == Type::float64 &&
                (all[i].role == Role::input || all[i].role == Role::continuous_state))
                for (int k = 0; k < all[i].size.count(); ++k) arguments_.push_back({static_cast<int>(i), k});
    }

    std::size_t arguments() const { return arguments_.size(); }
    bool is_state(std::size_t argument) const { return slot(argument).role == Role::continuous_state; }
    std::string name_of(std::size_t argument) const { return slot(argument).name; }

    /// Finite values instead of infinite ones, and others than 0.
    void choose_parameters() {
        for (std::size_t i = 0; i < slots().size(); ++i) {
            const Slot& s = slots()[i];
            if (s.role != Role::parameter || s.type != Type::float64) continue;
            auto* data = static_cast<double*>(run_.context().data(0, static_cast<int>(i)));
            for (int k = 0; k < s.size.count(); ++k) {
                if (std::isinf(data[k])) data[k] = std::copysign(data[k] > 0 ? 0.9 : 0.7, data[k]);
                if (data[k] == 0 && outside_limits(s, {0.35}).empty()) data[k] = 0.35;
                levels_.push_back(data[k]);
            }
        }
    }
    /// Values that parameters have: limits are among them.
    const Values& levels() const { return levels_; }

    /// Nothing where the block refuses.
    std::optional<Result> operator()(const Values& at) {
        for (std::size_t a = 0; a < arguments_.size(); ++a)
            static_cast<double*>(run_.context().data(0, arguments_[a].slot))[arguments_[a].element] = at[a];
        for (const Task& task : tasks_)
            if (!task()) return {};
        Result result;
        for (std::size_t i = 0; i < slots().size(); ++i) {
            const Slot& s = slots()[i];
            const int slot = static_cast<int>(i);
            for (int k = 0; k < s.size.count(); ++k) {
                const double value = read_value(run_.context().data(0, slot), s.type, k);
                if (s.role == Role::guard)
                    (s.type == Type::float64 ? result.margins : result.counts).push_back(value);
                if (s.role == Role::output) result.values.push_back(value);
                if (s.role == Role::continuous_state)
                    result.values.push_back(
                        static_cast<const double*>(run_.context().frame(0).rate[slot])[k]);
                if (s.role == Role::output || s.role == Role::continuous_state)
                    result.places.push_back((s.role == Role::output ? "" : "derivative of ") + s.name);
            }
        }
        return result;
    }

  private:
    struct Element {
        int slot, element;
    };
    const std::vector<Slot>& slots() const { return run_.resolution().slots; }
    const Slot& slot(std::size_t argument) const {
        return slots()[static_cast<std::size_t>(arguments_[argument].slot)];
    }
    RunBlock run_;
    std::vector<Task> tasks_;
    std::vector<Element> arguments_;
    Values levels_;
};

bool is_told(const Function::Result& left, const Function::Result& right) {
    for (std::size_t i = 0; i < left.margins.size(); ++i)
        if (left.margins[i] * right.margins[i] < 0) return true;
    return left.counts != right.counts;
}

/// Corners and jumps of a function along one argument that no guard tells, each as a sentence.
class Search {
  public:
    Search(Function& function, std::string where) : function_(function), where_(std::move(where)) {}

    void along(std::size_t argument, Values at) {
        argument_ = argument;
        at_ = std::move(at);
        const double step = 6.0 / points;
        std::vector<std::optional<Function::Result>> seen;
        for (int i = 0; i <= points; ++i) seen.push_back(look(-3.01 + step * i));
        for (std::size_t v = 0; seen[0] && v < seen[0]->values.size(); ++v) {
            const auto bend = [&](std::size_t i) {
                return seen[i - 1] && seen[i] && seen[i + 1]
                           ? std::abs(seen[i - 1]->values[v] - 2 * seen[i]->values[v] +
                                      seen[i + 1]->values[v])
                           : NAN;
            };
            for (std::size_t i = 3; i + 3 < seen.size(); ++i)
                if (bend(i) > 1e-6 && bend(i) > 4 * std::min(bend(i - 2), bend(i + 2)) &&
                    bend(i) >= std::max(bend(i - 1), bend(i + 1)))
                    zoom(v, -3.01 + step * static_cast<double>(i), step, bend(i));
        }
    }
    std::vector<std::string> found;

  private:
    static constexpr int points = 400, levels = 4;

    std::optional<Function::Result> look(double x) {
        at_[argument_] = x;
        return function_(at_);
    }
    /// A smooth function bends 64 times less in steps that are 8 times shorter, one with a corner 8 times,
    /// and one with a jump no less.
    void zoom(std::size_t v, double middle, double step, double first_bend) {
        double bend = first_bend;
        for (int level = 0; level < levels; ++level) {
            const double begin = middle - step;
            step /= 8;
            Values y;
            for (int i = 0; i <= 16; ++i) {
                const auto here = look(begin + step * i);
                if (!here || !std::isfinite(here->values[v])) return;
                y.push_back(here->values[v]);
            }
            bend = -1;
            for (std::size_t i = 1; i < 16; ++i)
                if (const double b = std::abs(y[i - 1] - 2 * y[i] + y[i + 1]); b > bend) {
                    bend = b;
                    middle = begin + step * static_cast<double>(i);
                }
        }
        if (bend < first_bend / std::pow(22.6, levels) || bend > 2 * first_bend) return; // smooth; a pole
        const auto left = look(middle - 2 * step), right = look(middle + 2 * step);
        if (!left || !right || is_told(*left, *right)) return;
        found.push_back(where_ + ": no guard tells of the " + (bend > 0.1 * first_bend ? "jump" : "corner") +
                        " of " + left->places[v] + " at " + function_.name_of(argument_) + " = " +
                        std::to_string(middle));
    }

    Function& function_;
    std::string where_;
    std::size_t argument_ = 0;
    Values at_;
};

std::vector<std::string> untold_places(const BlockClass& block_class, const Arguments& arguments) {
    std::vector<std::string> all;
    for (const Size& size : {Size{}, Size{3, 1, false}}) {
        RunBlock run(block_class, arguments);
        const auto& d = run.declaration();
        const bool is_discrete = (block_class.methods.update || !d.update_rules.empty()) &&
                                 !run.instance().block().answers(block_class.methods);
        if (is_discrete) return {}; // it runs at the samples alone
        if (!detail::wire(run, {std::vector<Size>(d.slots.size(), size), {}})) continue;
        Function function(run);
        function.choose_parameters();
        std::string where = block_class.name + (size.is_scalar() ? "" : " of vectors");
        for (const auto& [name, value] : arguments) where += " " + name + ": " + value.text;
        Search search(function, where);
        std::mt19937 random(5);
        std::uniform_real_distribution<double> any(-1.5, 1.5);
        Values at(function.arguments());
        for (int round = 0; round < (size.is_scalar() ? 8 : 2); ++round) {
            for (auto& x : at) x = any(random);
            for (std::size_t a = 0; a < at.size(); ++a) search.along(a, at);
            for (std::size_t state = 0; state < at.size(); ++state)
                if (function.is_state(state))
                    for (const double level : function.levels()) {
                        Values held = at;
                        held[state] = level;
                        for (std::size_t a = 0; a < at.size(); ++a)
                            if (a != state) search.along(a, held);
                    }
        }
        all.insert(all.end(), search.found.begin(), search.found.end());
    }
    return all;
}

/// Blocks whose jumps and corners depend on arguments that the other tests leave as they are.
std::multimap<std::string, Settings> with_edges() {
    std::multimap<std::string, Settings> all;
    for (const char* function : {"floor", "ceil", "fix"}) all.insert({"Round", {{"function", function}}});
    for (const char* rounding : {"floor", "nearest", "ceil", "zero", "away", "convergent"})
        all.insert({"Convert", {{"type", "int8"}, {"rounding", rounding}}});
    for (const char* name : {"Minimum", "Maximum"})
        for (const int inputs : {1, 2, 3}) all.insert({name, {{"inputs", inputs}}});
    const auto points = row({-1.5, -0.5, 0.2, 2}), values = row({1, -1, 0.5, 3});
    for (const char* extrapolation : {"clip", "linear"}) {
        for (const char* interpolation : {"linear", "flat", "nearest", "spline", "akima"})
            all.insert({"Lookup1D",
                        {{"breakpoints", points},
                         {"table", values},
                         {"interpolation", interpolation},
                         {"extrapolation", extrapolation}}});
        for (const char* interpolation : {"linear", "flat", "nearest"}) {
            all.insert({"Lookup2D",
                        {{"breakpoints1", points},
                         {"table", row({1, -1, 0.5, 3, 2, 0.5, -1, 1})},
                         {"interpolation", interpolation},
                         {"extrapolation", extrapolation}}});
            all.insert({"LookupND",
                        {{"dimensions", 1},
                         {"breakpoints1", points},
                         {"table", values},
                         {"interpolation", interpolation},
                         {"extrapolation", extrapolation}}});
        }
        all.insert({"Prelookup", {{"breakpoints", points}, {"extrapolation", extrapolation}}});
    }
    all.insert({"DirectLookup", {{"table", row({1, -1, 3})}}});
    all.insert({"InterpolateAt", {{"size", 4}, {"table", values}}});
    for (const char* expression :
         {"abs(u) + 1", "sign(u)*u^2", "floor(u) - ceil(2*u)", "round(u) + fix(u)",
          "min(u, 0.7) - max(u, -0.3)", "mod(u, 0.7)", "rem(u, -0.7)", "atan2(u, -1)",
          "(u < 0.5) + 2*(u <= -0.7)", "(u > 0.5) - (u >= 2)", "(u > -1 & u < 1) | u > 2", "~(u > 1)"})
        all.insert({"Fcn", {{"expression", expression}}});
    for (const char* expression : {"mod(u1, u2)", "rem(u1, u2)", "atan2(u1, u2)", "u1*(u1 > u2)"})
        all.insert({"Fcn", {{"expression", expression}}});
    return all;
}

} // namespace

TEST(Guards, TellOfEveryJumpAndCornerOfOutputsAndDerivatives) {
    const Library library = standard_library();
    const auto edges = with_edges();
    for (const auto& block_class : library.classes()) {
        if (block_class.name == "SignalFromFile") continue; // a function of time alone
        std::vector<Arguments> tried(1);
        const auto [first, last] = variants().equal_range(block_class.name);
        for (auto i = first; i != last; ++i) tried.emplace_back().assign(i->second.begin(), i->second.end());
        const auto [more, end] = edges.equal_range(block_class.name);
        for (auto i = more; i != end; ++i) tried.emplace_back().assign(i->second.begin(), i->second.end());
        for (const auto& arguments : tried) {
            const auto found = untold_places(block_class, arguments);
            if (!found.empty()) ADD_FAILURE() << found.front() << " (and " << found.size() - 1 << " more)";
        }
    }
}

/// dx/dt = |x| - u, without a guard.
class Silent final : public Block {
  public:
    using Block::Block;
    Input<double> u{this, "u"};
    ContinuousState<double> x{this, "x"};
    Status derivative(Now at, Rate to) const noexcept override {
        to[x] = std::abs(at[x]) - at[u];
        return ok;
    }
};

TEST(Guards, ThatAreMissingAreFound) {
    Library library("");
    library.group("test").add<Silent>("Silent", "");
    const auto found = untold_places(library.classes().front(), {});
    ASSERT_EQ(found.size(), 8u);
    EXPECT_EQ(found.front().substr(0, found.front().rfind(' ')),
              "Silent: no guard tells of the corner of derivative of x at x =");
}

} // namespace bf::conformance

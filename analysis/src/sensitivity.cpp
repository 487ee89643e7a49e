#include "bf/analysis/sensitivity.hpp"

#include "adjustable.hpp"
#include "bf/analysis/gradient.hpp"
#include "bf/base/names.hpp"
#include "bf/engine/simulation.hpp"
#include "named.hpp"
#include "short_text.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace bf::analysis {

double Sensitivities::Check::change_to_limit(Eigen::Index i) const {
    const double slope = distance_slopes[i];
    return slope == 0 || !std::isfinite(distance) ? std::numeric_limits<double>::infinity()
                                                  : -distance / slope;
}

namespace {

using Check = Sensitivities::Check;

/// An element of a parameter or variable.
struct Number {
    const Adjustable* whole;
    std::size_t element;
    double value() const { return whole->given.values[element]; }
};

class Sensitivity {
  public:
    Sensitivity(const Diagram& diagram, const SensitivityOptions& options)
        : d_(diagram), options_(options), run_(diagram), adjustables_((run_.start(), run_)) {
        find_checks();
        find_numbers();
        const double duration = options.duration > 0 ? options.duration : d_.stop;
        if (!(duration > 0) || !std::isfinite(duration))
            throw RunError("the run has no end: give it a duration, or the model a stop time");
        steps_ = run_.steps_before(duration);
        if (!(options.step > 0 && options.step <= 0.1))
            throw RunError("differences are made with relative steps above 0, and of at most 0.1");
    }

    Sensitivities operator()() {
        Sensitivities found;
        const auto count = static_cast<Eigen::Index>(numbers_.size());
        for (auto* all : {&found.at, &found.least, &found.most}) all->resize(count);
        for (Eigen::Index i = 0; i < count; ++i) {
            const auto& number = numbers_[static_cast<std::size_t>(i)];
            const auto& limits = number.whole->limits;
            found.names.push_back(adjustables_.name(*number.whole, number.element));
            found.at[i] = number.value();
            found.least[i] = std::max(limits.minimum, limits.above);
            found.most[i] = limits.maximum;
        }
        const auto values = run({});
        for (std::size_t c = 0; c < checks_.size(); ++c) {
            Check check = limits_of(checks_[c]);
            check.value = values[c];
            check.distance = std::min(check.value - check.lower, check.upper - check.value);
            check.has_passed = check.distance >= 0;
            found.checks.push_back(std::move(check));
        }
        find_followers();
        Matrix differences;
        for (std::size_t c = 0; c < checks_.size(); ++c) {
            Check& check = found.checks[c];
            check.slopes = exact(checks_[c], check);
            if (!check.differenced.empty()) {
                if (differences.size() == 0) differences = this->differences(count);
                check.slopes = differences.row(static_cast<Eigen::Index>(c)).transpose();
            }
            const bool is_upper = check.upper - check.value <= check.value - check.lower;
            check.distance_slopes = Vector::Zero(count);
            if (!std::isfinite(check.distance)) continue;
            const auto limit = slopes_of_parameter(check.name + (is_upper ? ".at_most" : ".at_least"), count);
            check.distance_slopes = is_upper ? Vector(limit - check.slopes) : Vector(check.slopes - limit);
        }
        const auto nearness = [&](const Check& check) {
            double least = std::numeric_limits<double>::infinity();
            for (Eigen::Index i = 0; i < count; ++i)
                least = std::min(least, std::abs(check.change_to_limit(i)) /
                                            std::max(std::abs(found.at[i]), 1e-300));
            return least;
        };
        std::stable_sort(found.checks.begin(), found.checks.end(),
                         [&](const Check& a, const Check& b) { return nearness(a) < nearness(b); });
        return found;
    }

  private:
    // ---- what is looked at

    void find_checks() {
        std::vector<std::string> known;
        for (const auto& [path, end] : values_of_checks()) {
            known.push_back(path);
            const bool is_asked = options_.checks.empty() ||
                                  std::count(options_.checks.begin(), options_.checks.end(), path) > 0;
            if (is_asked) checks_.push_back(path);
        }
        for (const auto& asked : options_.checks)
            if (std::count(known.begin(), known.end(), asked) == 0)
                throw RunError("the model has no check that reports a number '" + asked + "'" +
                               did_you_mean(asked, known));
        if (checks_.empty())
            throw RunError(
                "the model has no check that reports a number: add a block Check of a kind other than "
                "'always'");
    }
    std::vector<std::pair<std::string, Node::End>> values_of_checks() const {
        std::vector<std::pair<std::string, Node::End>> all;
        for (const auto& reported : d_.checks()) {
            const auto& node = d_.nodes[static_cast<std::size_t>(reported.end.node)];
            if (node.type == "Check" && node.library.empty() && d_.slot(reported.end).name == "value")
                all.emplace_back(node.path, reported.end);
        }
        return all;
    }
    bool is_check(const std::string& parameter) const {
        const auto node = d_.find_node(parameter.substr(0, parameter.rfind('.')));
        return node >= 0 && d_.nodes[static_cast<std::size_t>(node)].type == "Check";
    }

    void add(const Adjustable& whole) {
        for (std::size_t e = 0; e < whole.given.values.size(); ++e) numbers_.push_back({&whole, e});
    }
    void find_numbers() {
        for (const auto& asked : options_.by) {
            const auto [whole, elements] = adjustables_.named(asked);
            if (!whole)
                throw RunError("the model has no parameter or variable of doubles '" + asked + "'" +
                               adjustables_.nearest(asked));
            for (const auto e : elements) numbers_.push_back({whole, e});
        }
        if (!options_.by.empty()) return;
        for (const auto& one : adjustables_.all())
            if (one.is_variable && one.fixed.empty()) add(one);
        if (!numbers_.empty()) return;
        for (const auto& one : adjustables_.all())
            if (!one.is_variable && !is_check(one.given.path)) add(one);
        if (numbers_.empty())
            throw RunError("the model has no variables and no parameters of doubles that a run can change");
    }

    Check limits_of(const std::string& path) const {
        Check check;
        check.name = path;
        check.lower = find(run_.parameters(), path + ".at_least")[0];
        check.upper = find(run_.parameters(), path + ".at_most")[0];
        return check;
    }

    // ---- by numbers

    static double step_of(double value, double relative) {
        return relative * (value != 0 ? std::abs(value) : 1);
    }
    /// The parameters that follow when a number changes by so much.
    std::vector<ParameterValue> followers(const Number& number, double change) const {
        auto given = number.whole->given;
        given.values[number.element] += change;
        return adjustables_.follow({given});
    }
    struct Side {
        double change = 0;
        std::vector<ParameterValue> parameters;
    };
    /// What follows from changes by -h and h, and from none on the side that a limit of the number forbids.
    std::pair<Side, Side> sides(const Number& number, double h) const {
        std::string why;
        const auto side = [&](double change) {
            try {
                return Side{change, followers(number, change)};
            } catch (const RunError& error) {
                why = error.what();
                return Side{0, followers(number, 0)};
            }
        };
        auto below = side(-h), above = side(h);
        if (below.change == above.change) throw RunError(why);
        return {std::move(below), std::move(above)};
    }
    /// Of each number, how all parameters follow from it.
    void find_followers() {
        constexpr double relative = 1e-6; // of expressions, which are cheap and smooth
        for (const auto& number : numbers_) {
            auto& slopes = followers_.emplace_back();
            const auto& whole = number.whole->given;
            if (!number.whole->is_variable) {
                auto& own = slopes[whole.path];
                own = Vector::Zero(static_cast<Eigen::Index>(whole.values.size()));
                own[static_cast<Eigen::Index>(number.element)] = 1;
                continue;
            }
            const auto [below, above] = sides(number, step_of(number.value(), relative));
            const auto &up = above.parameters, &down = below.parameters;
            for (std::size_t k = 0; k < up.size(); ++k) {
                auto& slope = slopes[up[k].path];
                slope = Vector::Zero(static_cast<Eigen::Index>(up[k].values.size()));
                for (std::size_t i = 0; i < up[k].values.size(); ++i) {
                    const double change = up[k].values[i] - down[k].values[i];
                    slope[static_cast<Eigen::Index>(i)] =
                        change == 0 ? 0 : change / (above.change - below.change);
                }
            }
        }
    }
    /// Of a scalar parameter by each number.
    Vector slopes_of_parameter(const std::string& path, Eigen::Index count) const {
        Vector all = Vector::Zero(count);
        for (Eigen::Index i = 0; i < count; ++i) {
            const auto& slopes = followers_[static_cast<std::size_t>(i)];
            if (const auto found = slopes.find(path); found != slopes.end()) all[i] = found->second[0];
        }
        return all;
    }

    /// By the gradient of the run; or says why not.
    Vector exact(const std::string& path, Check& check) {
        if (options_.by_differences) {
            check.differenced = "asked for";
            return {};
        }
        std::map<std::string, Eigen::Index> places;
        GradientOptions asked{.by = {},
                              .cost = path + ".value",
                              .over = GradientOptions::Over::end,
                              .duration = static_cast<double>(steps_) * d_.step,
                              .by_rules_alone = true,
                              .go_on = options_.go_on};
        Eigen::Index elements = 0;
        for (const auto& slopes : followers_)
            for (const auto& [parameter, slope] : slopes)
                if (places.emplace(parameter, elements).second) {
                    asked.by.push_back(parameter);
                    elements += slope.size();
                }
        if (elements == 0) return Vector::Zero(static_cast<Eigen::Index>(followers_.size()));
        try {
            const auto found = gradient(run_, asked);
            check.has_corner = found.has_corner;
            Vector all(static_cast<Eigen::Index>(followers_.size()));
            for (std::size_t i = 0; i < followers_.size(); ++i) {
                double sum = 0;
                for (const auto& [parameter, slope] : followers_[i])
                    sum += slope.dot(found.slopes.segment(places[parameter], slope.size()));
                all[static_cast<Eigen::Index>(i)] = sum;
            }
            return all;
        } catch (const RunError& error) {
            check.differenced = error.what();
            return {};
        }
    }

    /// Values of all checks at the end of a run with these parameters, from its start.
    std::vector<double> run(const std::vector<ParameterValue>& parameters) {
        auto change = run_.prepare(parameters);
        const auto apply = [&] {
            if (const Status status = run_.apply(change); !status) throw RunError(change.why_refused(status));
        };
        apply();
        // Applied again, a change puts the old values back.
        const std::shared_ptr<void> end(nullptr, [&](void*) { static_cast<void>(run_.apply(change)); });
        run_.start();
        for (std::int64_t k = 0; k < steps_; ++k) {
            if (options_.go_on && k % 1000 == 0 && !options_.go_on())
                throw RunError("the runs were interrupted");
            if (!run_.step())
                throw RunError("the run ends at " + short_text(run_.time()) + " s: " + run_.failure() +
                               "; with a shorter duration checks are those of what was until then");
        }
        std::vector<double> values;
        const auto all = values_of_checks();
        for (const auto& path : checks_) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.first == path; });
            const auto read = [&](const Node::End& of) {
                return read_value(run_.context().data(of.node, of.slot), d_.slot(of).type, 0);
            };
            if (read(find_state(d_, path + ".count")) == 0)
                throw RunError("the check '" + path +
                               "' has looked at no step when the run ends; let it begin earlier or the run "
                               "end later, or name other checks");
            values.push_back(read(found->second));
        }
        return values;
    }
    /// Of each check by each number.
    Matrix differences(Eigen::Index count) {
        Matrix all(static_cast<Eigen::Index>(checks_.size()), count);
        for (Eigen::Index i = 0; i < count; ++i) {
            const auto& number = numbers_[static_cast<std::size_t>(i)];
            const auto [below, above] = sides(number, step_of(number.value(), options_.step));
            const auto up = run(above.parameters), down = run(below.parameters);
            for (std::size_t c = 0; c < checks_.size(); ++c)
                all(static_cast<Eigen::Index>(c), i) = (up[c] - down[c]) / (above.change - below.change);
        }
        return all;
    }

    const Diagram& d_;
    const SensitivityOptions& options_;
    Simulation run_;
    const Adjustables adjustables_;
    std::vector<std::string> checks_; ///< paths
    std::vector<Number> numbers_;
    std::vector<std::map<std::string, Vector>> followers_; ///< by number, slopes of parameters
    std::int64_t steps_ = 0;
};

} // namespace

Sensitivities sensitivities(const Diagram& diagram, const SensitivityOptions& options) {
    return Sensitivity(diagram, options)();
}

} // namespace bf::analysis

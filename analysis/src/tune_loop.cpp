#include "bf/analysis/tune_loop.hpp"

#include "bf/analysis/linearize.hpp"
#include "bf/core/registry.hpp"
#include "injection.hpp"
#include "reduced.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace bf::analysis {

namespace {

constexpr double pi = std::numbers::pi;

std::string text(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", value);
    return digits;
}

/// A gain: an element of a parameter or of a variable.
struct Gain {
    std::string name, whole;
    std::size_t element = 0;
};

/// Numbers by which a run is tuned.
class Gains {
  public:
    Gains(Simulation& run, const std::vector<std::string>& names) : run_(run) {
        for (const auto& quantity : run.parameters()) present_.push_back({quantity.path, quantity.values()});
        for (auto& variable : run.variables()) present_.push_back(std::move(variable));
        for (const auto& name : names) add(name);
        for (const auto& gain : all_) first_.push_back(value(gain));
    }

    const std::vector<Gain>& all() const { return all_; }
    const std::vector<double>& first() const { return first_; }
    /// Are they P, I and D of one block, in this order?
    bool is_pid() const {
        if (all_.size() != 3) return false;
        const std::string block = all_[0].whole.substr(0, all_[0].whole.rfind('.'));
        for (int i = 0; i < 3; ++i)
            if (all_[static_cast<std::size_t>(i)].whole != block + "." + "PID"[i]) return false;
        return true;
    }
    /// `accepts`: from now on variables lead to others as an elaboration with these values would have it.
    void set(const std::vector<double>& values, bool accepts = false) {
        std::vector<ParameterValue> asked;
        for (std::size_t i = 0; i < all_.size(); ++i) {
            const auto& gain = all_[i];
            auto found = std::find_if(asked.begin(), asked.end(),
                                      [&](const ParameterValue& one) { return one.path == gain.whole; });
            if (found == asked.end()) found = asked.insert(asked.end(), *present(gain.whole));
            found->values[gain.element] = values[i];
        }
        std::vector<ParameterValue> lead_to;
        try {
            lead_to = run_.follow(asked);
        } catch (const RunError&) {
            throw;
        } catch (const std::runtime_error& error) {
            throw RunError(error.what());
        }
        auto change = run_.prepare(lead_to);
        if (const Status status = run_.apply(change); !status) throw RunError(change.why_refused(status));
        if (accepts) run_.accept(asked);
    }

  private:
    const ParameterValue* present(const std::string& path) const {
        const auto found = std::find_if(present_.begin(), present_.end(),
                                        [&](const ParameterValue& one) { return one.path == path; });
        return found == present_.end() ? nullptr : &*found;
    }
    double value(const Gain& gain) const { return present(gain.whole)->values.at(gain.element); }

    void add(const std::string& name) {
        if (present(name + ".P") && present(name + ".I") && present(name + ".D")) {
            add(name + ".P");
            add(name + ".I");
            const auto& D = present(name + ".D")->values;
            if (std::any_of(D.begin(), D.end(), [](double d) { return d != 0; })) add(name + ".D");
            return;
        }
        std::string whole = name;
        std::size_t element = 0;
        const auto* found = present(name);
        if (const auto bracket = name.find('['); !found && bracket != std::string::npos) {
            whole = name.substr(0, bracket);
            found = present(whole);
            if (found) {
                const auto number = elements(whole, name.substr(bracket));
                if (!number)
                    throw RunError("'" + whole + "' has no element " + name.substr(bracket) + "; it has " +
                                   std::to_string(found->values.size()));
                element = *number;
            }
        } else if (found && found->values.size() != 1) {
            throw RunError("'" + name + "' has " + std::to_string(found->values.size()) +
                           " elements; name one of them, as '" + name + "[1]'");
        }
        if (!found) {
            std::vector<std::string> known;
            for (const auto& one : present_) known.push_back(one.path);
            throw RunError("the model has no parameter, variable or block with P, I and D '" + whole + "'" +
                           did_you_mean(whole, known));
        }
        all_.push_back({name, whole, element});
    }
    /// The element of a parameter that the text stands for, "[2]"; those of variables have numbers only.
    std::optional<std::size_t> elements(const std::string& path, const std::string& text) const {
        for (const auto& parameter : run_.parameters())
            if (parameter.path == path)
                return parameter.info.elements() == 1 && text == "[1]" ? 0
                                                                       : parameter.info.find_element(text);
        for (std::size_t i = 0; i < present(path)->values.size(); ++i)
            if (text == "[" + std::to_string(i + 1) + "]") return i;
        return std::nullopt;
    }

    Simulation& run_;
    std::vector<ParameterValue> present_;
    std::vector<Gain> all_;
    std::vector<double> first_;
};

/// L and its slopes by the gains, as they are near some of them.
struct Family {
    std::vector<double> at;
    Reduced loop;
    std::vector<Reduced> moved;
    std::vector<double> by; ///< how far the gains were moved
};

class Tuning {
  public:
    Tuning(Simulation& run, const TuneOptions& options)
        : run_(run), options_(options), start_(run.snapshot()), gains_(run, options.by) {
        check();
        const auto& first = gains_.first();
        const auto nonzero = std::find_if(first.begin(), first.end(), [](double g) { return g != 0; });
        const double sign = nonzero != first.end() && *nonzero < 0 ? -1 : 1;
        for (const double g : first) signs_.push_back(g == 0 ? sign : g < 0 ? -1 : 1);
    }

    TunedLoop operator()() {
        TunedLoop found;
        found.before = state(gains_.first());
        const double period = found.before.loop.period;
        most_ = period > 0 ? pi / period : std::numeric_limits<double>::infinity();
        std::vector<double> gains;
        try {
            gains = search();
            found.after = state(gains);
            verify(found.after.margins);
            for (std::size_t i = 0; i < gains.size(); ++i)
                found.gains.push_back({gains_.all()[i].name, gains_.first()[i], gains[i]});
        } catch (...) {
            reset(gains_.first());
            throw;
        }
        reset(gains);
        gains_.set(gains, true);
        return found;
    }

  private:
    using Values = std::vector<double>;

    void check() const {
        const auto refuse = [](const std::string& what, double value) {
            throw RunError(what + " is a number above 0, not " + text(value));
        };
        const bool has_frequency = options_.crossover != 0 || options_.bandwidth != 0;
        if (options_.crossover != 0 && options_.bandwidth != 0)
            throw RunError("a crossover and a bandwidth say the same; give one of them");
        if (has_frequency && !(options_.crossover > 0) && !(options_.bandwidth > 0))
            refuse("a crossover or bandwidth", options_.crossover + options_.bandwidth);
        if (options_.phase_margin && !(*options_.phase_margin > 0 && *options_.phase_margin < 180))
            throw RunError("a phase margin lies between 0 and 180 degrees, not at " +
                           text(*options_.phase_margin));
        if (options_.overshoot && !(*options_.overshoot > 0)) refuse("an overshoot", *options_.overshoot);
        const auto count = gains_.all().size();
        if (count == 0) throw RunError("name gains by which the loop is tuned");
        if (count > 2 && !gains_.is_pid())
            throw RunError(
                "a crossover and a phase margin decide two gains, or P, I and D of a block; there are " +
                std::to_string(count) + ": name the block, or two of them");
        if (count > 1 && !has_frequency)
            throw RunError("say how fast the loop is to be: a crossover or a bandwidth, rad/s");
        if (count == 1 && has_frequency && options_.overshoot)
            throw RunError(
                "one gain meets one requirement: a crossover, a bandwidth, a phase margin or an overshoot");
    }

    // ---- the loop

    void reset(const Values& gains) {
        run_.restore(start_);
        gains_.set(gains); // what is constant follows from them
    }
    /// With these gains; what is asked of one set of gains is asked one after another.
    const LinearSystem& loop(const Values& gains) {
        if (gains == looped_) return loop_;
        looped_.clear();
        reset(gains);
        auto system = linearize(run_, LinearizeOptions::of_loop(options_.loop, options_.open));
        if (system.inputs.size() != 1)
            throw RunError("'" + options_.loop + "' has " + std::to_string(system.inputs.size()) +
                           " elements; name one of them, as '" + options_.loop + "[1]'");
        loop_ = negative(std::move(system));
        looped_ = gains;
        return loop_;
    }
    TunedLoop::State state(const Values& gains) {
        TunedLoop::State state{.loop = loop(gains), .margins = {}, .step = {}};
        if (state.loop.D.isZero(0) && (state.loop.C.isZero(0) || state.loop.B.isZero(0))) {
            state.margins.is_stable = true; // without gains there is no loop
            return state;
        }
        state.margins = margins(state.loop);
        state.step = step_response(closed(state.loop), 0, 0);
        return state;
    }
    Family family(const Values& at) {
        double largest = 0;
        for (const double g : at) largest = std::max(largest, std::abs(g));
        Family found{at, Reduced(loop(at), 0, 0), {}, {}};
        for (std::size_t i = 0; i < at.size(); ++i) {
            Values moved = at;
            moved[i] += signs_[i] * 1e-3 * (at[i] != 0 ? std::abs(at[i]) : largest > 0 ? largest : 1);
            found.by.push_back(moved[i] - at[i]);
            found.moved.emplace_back(loop(moved), 0, 0);
        }
        return found;
    }

    // ---- gains for one crossover

    static Complex wanted(double phase_margin) { return std::polar(1.0, (phase_margin - 180) * pi / 180); }

    /// Gains with which the affine L(jω) has the value; of one gain, with which |L| = 1. Empty: none.
    Values solve(const Family& family, double omega, const Complex& value) const {
        const auto count = family.at.size();
        // L = a + Σ s_i g_i
        Complex a = family.loop(omega);
        std::vector<Complex> s;
        for (std::size_t i = 0; i < count; ++i) {
            s.push_back((family.moved[i](omega) - family.loop(omega)) / family.by[i]);
            a -= s[i] * family.at[i];
            if (s[i] == 0.0)
                throw RunError(
                    "'" + gains_.all()[i].name + "' does not change what comes back to '" + options_.loop +
                    "'; name gains of that loop, and an operating point at which " + "no limit is met");
        }
        if (count == 1) {
            // |a + s g|² = 1
            const double A = std::norm(s[0]), B = (std::conj(a) * s[0]).real(), C = std::norm(a) - 1;
            return root(A, B, C, [](double g) { return Values{g}; });
        }
        Eigen::MatrixXd M(2, static_cast<Eigen::Index>(count));
        for (std::size_t i = 0; i < count; ++i) {
            const auto column = static_cast<Eigen::Index>(i);
            M(0, column) = s[i].real();
            M(1, column) = s[i].imag();
        }
        const Eigen::Vector2d right((value - a).real(), (value - a).imag());
        // Of columns of like size: gains are of unlike ones.
        const Vector scale = M.colwise().norm().transpose();
        const Eigen::FullPivLU<Eigen::MatrixXd> lu(M * scale.cwiseInverse().asDiagonal());
        if (lu.rank() < 2) return {};
        const Vector one = scale.cwiseInverse().asDiagonal() * Vector(lu.solve(right));
        if (count == 2) return {one[0], one[1]};
        const Vector along = scale.cwiseInverse().asDiagonal() * Vector(lu.kernel().col(0));
        const auto at = [&](double t) {
            return Values{one[0] + t * along[0], one[1] + t * along[1], one[2] + t * along[2]};
        };
        // P² = 4 I D along the line.
        return root(along[0] * along[0] - 4 * along[1] * along[2],
                    one[0] * along[0] - 2 * (one[1] * along[2] + one[2] * along[1]),
                    one[0] * one[0] - 4 * one[1] * one[2], at);
    }
    /// At a root of A t² + 2 B t + C: that one of which the gains have their signs, and act most.
    template <class At> Values root(double A, double B, double C, At&& at) const {
        const double inside = B * B - A * C;
        if (!(inside >= 0) || A == 0) return {};
        Values best;
        for (const double sign : {1.0, -1.0}) {
            Values gains = at((-B + sign * std::sqrt(inside)) / A);
            if (best.empty() || (have_signs(gains) && !have_signs(best)) ||
                (have_signs(gains) && gains.size() == 3 && std::abs(gains[1]) > std::abs(best[1])))
                best = std::move(gains);
        }
        return best;
    }
    bool have_signs(const Values& gains) const {
        for (std::size_t i = 0; i < gains.size(); ++i)
            if (!std::isfinite(gains[i]) || gains[i] * signs_[i] < 0) return false;
        return !gains.empty();
    }

    /// Newton's method; of gains in which L is affine its first step is the last one. Empty: none were found.
    Values attempt(double omega, double phase_margin) {
        constexpr int most = 30;
        constexpr double enough = 1e-10;
        const Complex value = wanted(phase_margin);
        if (!family_) family_.emplace(family(gains_.first()));
        auto gains = solve(*family_, omega, value);
        for (int i = 0; have_signs(gains); ++i) {
            const Complex L = Reduced(loop(gains), 0, 0)(omega);
            if (L == 0.0) {
                std::string values;
                for (std::size_t k = 0; k < gains.size(); ++k)
                    values += (k > 0 ? ", " : "") + gains_.all()[k].name + " = " + text(gains[k]);
                throw RunError("with " + values + " nothing comes back to '" + options_.loop +
                               "': a limit is met at this operating point; choose one at which all rests");
            }
            if (std::abs(gains.size() == 1 ? Complex(std::abs(L) - 1) : L - value) < enough) return gains;
            if (i == most) return {};
            gains = solve(family(gains), omega, value);
        }
        return gains; // of other signs, which say what is in the way
    }
    bool is_good(const Values& gains) {
        if (!have_signs(gains)) return false;
        const auto& system = loop(gains);
        return are_stable(poles(closed(system)), system.period);
    }

    /// The same with a crossover that gives the bandwidth, if that is what is asked for.
    Values at_speed(double phase_margin) {
        if (options_.crossover > 0) return attempt(last_omega_ = options_.crossover, phase_margin);
        double omega = std::min(options_.bandwidth / 1.5, 0.9 * most_);
        double omega_before = 0, bandwidth_before = 0;
        Values gains;
        for (int i = 0; i < 60; ++i) {
            gains = attempt(last_omega_ = omega, phase_margin);
            if (!is_good(gains)) return gains;
            const double bandwidth = margins(loop(gains)).bandwidth;
            if (std::abs(bandwidth - options_.bandwidth) < 1e-9 * options_.bandwidth) return gains;
            if (!std::isfinite(bandwidth)) break;
            // By secants of logarithms: the bandwidth grows about as a power of the crossover.
            double power =
                i == 0 ? 1 : std::log(bandwidth / bandwidth_before) / std::log(omega / omega_before);
            power = power > 0.3 && power < 3 ? power : 1; // not NaN
            omega_before = omega;
            bandwidth_before = bandwidth;
            const double factor = std::pow(options_.bandwidth / bandwidth, 1 / power);
            omega = std::min(omega * std::clamp(factor, 0.2, 5.0), 0.999 * most_);
        }
        return {};
    }

    double overshoot_of(const Values& gains) { return step_response(closed(loop(gains)), 0, 0).overshoot; }

    // ---- requirements

    Values search() {
        if (options_.crossover >= most_ || options_.bandwidth >= most_)
            throw RunError("the loop is sampled at " + text(2 * most_) +
                           " rad/s, of which half can be had at most, not " +
                           text(options_.crossover + options_.bandwidth) + " rad/s");
        if (gains_.all().size() == 1 && options_.crossover == 0 && options_.bandwidth == 0) return by_phase();
        const double least = options_.phase_margin.value_or(options_.overshoot ? 20.0 : 60.0);
        if (!options_.overshoot) {
            const auto gains = at_speed(least);
            if (!is_good(gains)) refuse(least, gains);
            return gains;
        }
        // The least phase margin that does.
        constexpr double step = 2.5, fine = 1e-3;
        double before = 0, smallest = std::numeric_limits<double>::infinity(), smallest_at = 0;
        Values first;
        bool is_any = false;
        for (double margin = least; margin < 180; margin += step) {
            auto gains = at_speed(margin);
            if (first.empty()) first = gains;
            if (!is_good(gains)) {
                if (is_any) break;
                if (options_.phase_margin && margin == least) refuse(least, gains);
                continue;
            }
            const double overshoot = overshoot_of(gains);
            if (overshoot < smallest) {
                smallest = overshoot;
                smallest_at = margin;
            }
            if (overshoot > *options_.overshoot) {
                before = margin;
                is_any = true;
                continue;
            }
            if (!is_any) return gains;
            double after = margin;
            while (after - before > fine) {
                const double middle = 0.5 * (before + after);
                auto between = at_speed(middle);
                if (is_good(between) && overshoot_of(between) <= *options_.overshoot) {
                    after = middle;
                    gains = std::move(between);
                } else {
                    before = middle;
                }
            }
            return gains;
        }
        if (!is_any) refuse(least, first);
        throw RunError("an overshoot of at most " + text(*options_.overshoot) + " % cannot be reached at " +
                       speed_text() + ": the least one is " + text(smallest) + " %, with a phase margin of " +
                       text(smallest_at) + " degrees; ask for another speed, or tune more gains");
    }

    std::string speed_text() const {
        return options_.crossover > 0 ? text(options_.crossover) + " rad/s"
                                      : "a bandwidth of " + text(options_.bandwidth) + " rad/s";
    }

    bool has_gain_margin(const Margins& m) const {
        return options_.gain_margin == 0 || 20 * std::log10(m.gain) >= options_.gain_margin;
    }

    /// Of one gain: the highest crossover that does.
    Values by_phase() {
        const double phase_margin = options_.phase_margin.value_or(options_.overshoot ? 0.0 : 60.0);
        if (!family_) family_.emplace(family(gains_.first()));
        // Gains beyond limits of their own are none.
        const auto does = [&](double omega) -> Values {
            try {
                const auto gains = attempt(omega, 0);
                if (!is_good(gains)) return {};
                const auto found = margins(loop(gains));
                const bool has_overshoot = !options_.overshoot || overshoot_of(gains) <= *options_.overshoot;
                return found.phase >= phase_margin && has_overshoot && has_gain_margin(found) ? gains
                                                                                              : Values{};
            } catch (const RunError&) {
                return {};
            }
        };
        const std::string asked = options_.overshoot && !options_.phase_margin
                                      ? "an overshoot of at most " + text(*options_.overshoot) + " %"
                                      : "a phase margin of " + text(phase_margin) + " degrees";
        const auto range = frequencies(loop(gains_.first()), 0, 0, 60, true);
        for (auto omega = range.rbegin() + 1; omega != range.rend(); ++omega) {
            auto gains = does(*omega);
            if (gains.empty()) continue;
            if (omega == range.rbegin() + 1)
                throw RunError(
                    "the loop has " + asked + " at crossovers up to " + text(*omega) +
                    " rad/s, where the search ends, so that none is the fastest; ask for a crossover");
            double low = *omega, high = *(omega - 1);
            while (high > low * (1 + 1e-9)) {
                const double middle = std::sqrt(low * high);
                auto between = does(middle);
                (between.empty() ? high : low) = middle;
                if (!between.empty()) gains = std::move(between);
            }
            return gains;
        }
        throw RunError(
            "no value of '" + gains_.all()[0].name + "' gives " + asked +
            (options_.gain_margin > 0 ? " and a gain margin of " + text(options_.gain_margin) + " dB" : "") +
            " between " + text(range.front()) + " and " + text(range.back()) +
            " rad/s; ask for less, or tune another gain, too");
    }

    /// The ends of what can be had around that, to a hundredth of it; `ok` holds within.
    template <class Ok> static std::pair<double, double> ends(std::vector<double> grid, Ok&& ok) {
        double low = NAN, high = NAN;
        for (std::size_t i = 0; i < grid.size(); ++i)
            if (ok(grid[i])) {
                if (std::isnan(low)) low = grid[i];
                high = grid[i];
            } else if (!std::isnan(low)) {
                double outside = grid[i];
                for (int k = 0; k < 8; ++k) {
                    const double middle = 0.5 * (high + outside);
                    (ok(middle) ? high : outside) = middle;
                }
                break;
            }
        return {low, high};
    }

    [[noreturn]] void refuse(double phase_margin, const Values& gains) {
        std::string names, why;
        for (const auto& gain : gains_.all()) names += (names.empty() ? "" : ", ") + gain.name;
        const double omega = last_omega_;
        for (std::size_t i = 0; i < gains.size() && why.empty(); ++i)
            if (!(gains[i] * signs_[i] >= 0))
                why = "'" + gains_.all()[i].name + "' would have to be " + text(gains[i]) +
                      ", and gains keep their sign";
        if (gains.empty()) why = "no gains have it";
        if (why.empty()) why = "the closed loop would be unstable";
        const bool is_single = gains_.all().size() == 1;
        std::string can;
        const auto holds = [&](double w, double margin) { return is_good(attempt(w, margin)); };
        if (!is_single) {
            std::vector<double> margins;
            for (double m = 2; m < 180; m += 4) margins.push_back(m);
            const auto [low, high] = ends(margins, [&](double m) { return holds(omega, m); });
            if (!std::isnan(low))
                can += "; at " + text(omega) + " rad/s there are phase margins from " + text(low) + " to " +
                       text(high) + " degrees";
        }
        std::vector<double> omegas;
        for (int i = -30; i <= 10; ++i)
            if (const double w = omega * std::pow(10, i / 10.0); w < most_) omegas.push_back(w);
        const auto [slow, fast] = ends(omegas, [&](double w) { return holds(w, phase_margin); });
        if (!std::isnan(slow))
            can += (is_single ? "; there are crossovers from "
                              : "; with this phase margin there are crossovers from ") +
                   text(slow) + " to " + text(fast) + " rad/s";
        throw RunError((is_single ? "a crossover" : "a phase margin of " + text(phase_margin) + " degrees") +
                       " at " + text(omega) + " rad/s cannot be reached with " + names + ": " + why +
                       (can.empty() ? "; tune other gains" : can));
    }

    void verify(const Margins& m) const {
        if (options_.phase_margin && m.phase < *options_.phase_margin - 1e-6)
            throw RunError("the loop crosses 1 again at " + text(m.gain_crossover) +
                           " rad/s, where its phase margin is " + text(m.phase) +
                           " degrees; ask for a slower loop, or damp what resonates there");
        if (m.modulus < 1e-6)
            throw RunError("the closed loop would swing on for ever at " + text(m.gain_crossover) +
                           " rad/s, where the loop's gain is -1; ask for another speed, or tune more gains");
        if (!has_gain_margin(m))
            throw RunError("the gain margin comes to " + text(20 * std::log10(m.gain)) + " dB at " +
                           text(m.phase_crossover) + " rad/s, not to " + text(options_.gain_margin) +
                           " dB; ask for a slower loop or a greater phase margin");
    }

    Simulation& run_;
    const TuneOptions& options_;
    std::vector<std::byte> start_;
    Gains gains_;
    Values signs_;
    std::optional<Family> family_; ///< at the first gains
    Values looped_;                ///< gains of
    LinearSystem loop_;            ///< the loop that was asked for last
    double most_ = 0;              ///< rad/s
    double last_omega_ = 0;
};

} // namespace

TunedLoop tune_loop(Simulation& run, const TuneOptions& options) {
    const auto here = run.snapshot();
    try {
        return Tuning(run, options)();
    } catch (...) {
        run.restore(here);
        throw;
    }
}

SimulatedStep simulated_step(Simulation& run, const std::string& loop, double duration, double height) {
    const Element at = find_element(run.diagram(), loop);
    const auto start = run.snapshot();
    const double value =
        read_value(run.context().data(at.end.node, at.end.slot), run.diagram().slot(at.end).type, at.number);
    SimulatedStep found{
        .time = {}, .value = {}, .height = height != 0 ? height : 0.01 * std::max(1.0, std::abs(value))};
    if (!(duration > 0) || !std::isfinite(duration) || !std::isfinite(height))
        throw RunError("a step lasts longer than 0 s, and has a height");
    /// What the loop's block computes, after each step's outputs.
    struct Watch final : Run::Observer {
        Injection* injection = nullptr;
        std::vector<double> values;
        void observe(const Run& of) noexcept override {
            if (!of.shows_event() && values.size() < values.capacity()) values.push_back(injection->own());
        }
    };
    const auto steps = static_cast<std::size_t>(std::ceil(duration / run.period()));
    const auto back = [&](double added) {
        run.restore(start);
        Injection injection(run, at, [added](double) { return added; });
        Watch watch;
        watch.injection = &injection;
        watch.values.reserve(steps);
        run.add_observer(watch);
        const std::shared_ptr<void> end(nullptr, [&](void*) { run.remove_observer(watch); });
        for (std::size_t k = 0; k < steps; ++k)
            if (!run.step()) throw RunError(run.failure());
        return watch.values;
    };
    const std::shared_ptr<void> end(nullptr, [&](void*) { run.restore(start); });
    const auto still = back(0), stepped = back(found.height);
    for (std::size_t k = 0; k < steps; ++k) {
        found.time.push_back(static_cast<double>(k) * run.period());
        found.value.push_back(-(stepped[k] - still[k]) / found.height);
    }
    return found;
}

} // namespace bf::analysis

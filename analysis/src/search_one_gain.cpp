#include "bf/analysis/loop_gain.hpp"
#include "loop_by_gains.hpp"
#include "root.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace bf::analysis {

namespace {

/// Whether a loop is stable, how fast and how far from its limit is looked at for values of the gain all over
/// what it may be: more than one of them may give a crossover, and the loop need not be linear in it.
class OneGain {
  public:
    explicit OneGain(LoopByGains& loop) : loop_(loop), asked_(loop.asked()), row_(sizes()) {}

    Gains operator()() {
        return {loop_.sign(0) * (asked_.crossover > 0 || asked_.bandwidth > 0 ? by_speed() : by_margins())};
    }

  private:
    static constexpr int per_decade = 20, decades = 6;

    struct Tried {
        bool is_stable = false;
        Margins margins = {};
        bool crosses() const { return is_stable && margins.gain_crossover > 0; } ///< is |L| = 1 somewhere?
        double overshoot = NAN;
    };

    /// Absolute values, from the model's own one to six decades away, or to its limits.
    std::vector<double> sizes() {
        const auto [low, high] = loop_.range(0);
        double middle = std::abs(loop_.first()[0]);
        if (middle == 0) middle = size_that_acts();
        const double least = std::max(low, middle * std::pow(10, -decades)),
                     most = std::min(high, middle * std::pow(10, decades));
        is_low_end_open_ = least > low;
        is_high_end_open_ = most < high;
        std::vector<double> all{least, most};
        for (int k = -decades * per_decade; k <= decades * per_decade; ++k)
            if (const double size = middle * std::pow(10, static_cast<double>(k) / per_decade);
                size > least && size < most)
                all.push_back(size);
        constexpr int fewest = 2 * per_decade;
        if (all.size() < fewest) // between narrow limits
            for (int k = 1; k < fewest; ++k) all.push_back(least + (most - least) * k / fewest);
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }
    /// With which a gain that is 0 now adds about 1 to the loop.
    double size_that_acts() {
        const auto [low, high] = loop_.range(0);
        const double probe = std::clamp(1.0, low, high);
        const LinearSystem present = loop_.loop({0.0}), other = loop_.loop({loop_.sign(0) * probe});
        std::vector<double> slopes;
        for (const double w : frequencies(other, 0, 0, 21))
            slopes.push_back(std::abs(Reduced(other, 0, 0)(w) - Reduced(present, 0, 0)(w)) / probe);
        std::nth_element(slopes.begin(), slopes.begin() + 10, slopes.end());
        return std::isfinite(1 / slopes[10]) ? std::clamp(1 / slopes[10], std::max(low, 1e-300), high)
                                             : probe;
    }

    const LinearSystem& system(double size) { return loop_.loop({loop_.sign(0) * size}); }
    const Tried& tried(double size) {
        const auto [found, is_new] = tried_.try_emplace(size);
        if (!is_new) return found->second;
        auto& its = found->second;
        try {
            const auto& loop = system(size);
            if (is_nothing(loop) || !are_stable(poles(closed(loop)), loop.period)) return its;
            its.margins = margins(loop);
            if (asked_.overshoot) its.overshoot = step_response(closed(loop), 0, 0).overshoot;
            its.is_stable = true;
        } catch (const Interrupted&) {
            throw;
        } catch (const RunError&) { // limits of what follows from it, or a loop without delay
        }
        return its;
    }

    // ---- a speed

    bool is_by_crossover() const { return asked_.crossover > 0; }
    double speed() const { return is_by_crossover() ? asked_.crossover : asked_.bandwidth; }
    double speed_of(const Tried& one) const {
        return is_by_crossover() ? one.margins.gain_crossover : one.margins.bandwidth;
    }
    std::string speed_text() const { return is_by_crossover() ? "crossover" : "bandwidth"; }

    /// 0 where it is as asked.
    double miss(double size) {
        if (!is_by_crossover()) {
            const auto& its = tried(size);
            return its.is_stable ? std::log(its.margins.bandwidth / asked_.bandwidth) : NAN;
        }
        try {
            const double above = std::log(std::abs(Reduced(system(size), 0, 0)(asked_.crossover)));
            return std::abs(above) < 1e-13 ? 0 : above; // but for rounding
        } catch (const Interrupted&) {
            throw;
        } catch (const RunError&) {
            return NAN;
        }
    }

    /// Where |L(jω)| = 1 at the crossover, of a loop that is affine in the gain: |a + s g|² = 1. Nothing: it
    /// is not.
    std::optional<std::vector<double>> affine_roots() {
        const auto [low, high] = loop_.range(0);
        const double first = std::abs(loop_.first()[0]),
                     far = row_.back() != first ? row_.back() : row_.front();
        const double near = 1.25 * first <= high && first > 0 ? 1.25 * first : row_[row_.size() / 3];
        Complex at_first, at_near, at_far;
        try {
            const auto L = [&](double size) { return Reduced(system(size), 0, 0)(asked_.crossover); };
            at_first = L(first);
            at_near = L(near);
            at_far = L(far);
        } catch (const Interrupted&) {
            throw;
        } catch (const RunError&) {
            return std::nullopt;
        }
        const Complex s = (at_near - at_first) / (near - first), a = at_first - s * first;
        if (near == far || !(std::abs(a + s * far - at_far) <= 1e-9 * std::abs(s * far))) return std::nullopt;
        const double A = std::norm(s), B = (std::conj(a) * s).real(), C = std::norm(a) - 1,
                     inside = B * B - A * C;
        std::vector<double> all;
        if (!(inside >= 0)) return all;
        for (const double sign : {1.0, -1.0})
            if (const double size = (-B + sign * std::sqrt(inside)) / A;
                size > 0 && size >= low && size <= high) {
                if (!(std::abs(miss(size)) < 1e-8)) return std::nullopt; // a limit on the way
                all.push_back(size);
            }
        return all;
    }
    /// All values of the gain that have the speed.
    std::vector<double> with_speed() {
        if (is_by_crossover())
            if (auto roots = affine_roots()) return *roots;
        std::vector<double> found;
        double before = miss(row_[0]);
        if (before == 0) found.push_back(row_[0]);
        for (std::size_t k = 1; k < row_.size(); ++k) {
            const double now = miss(row_[k]);
            if (now == 0)
                found.push_back(row_[k]);
            else if (before != 0 && std::isfinite(before) && std::isfinite(now) && (before > 0) != (now > 0))
                if (const double root =
                        find_root([&](double size) { return miss(size); }, row_[k - 1], row_[k]);
                    std::abs(miss(root)) < 1e-8)
                    found.push_back(root);
            before = now;
        }
        return found;
    }
    double by_speed() {
        const auto found = with_speed();
        // Of several the one that is farthest from the limit of stability.
        double best = NAN;
        for (const double size : found)
            if (tried(size).is_stable &&
                (std::isnan(best) || tried(size).margins.phase > tried(best).margins.phase))
                best = size;
        if (std::isnan(best)) refuse_speed(found.empty());
        const auto& its = tried(best).margins;
        if (asked_.phase_margin && its.phase < *asked_.phase_margin - 1e-6)
            throw RunError(
                "with a " + speed_text() + " of " + short_text(speed()) + " rad/s '" + loop_.name(0) +
                "' = " + short_text(loop_.sign(0) * best) + " leaves a phase margin of " +
                short_text(its.phase) + " degrees, not " + short_text(*asked_.phase_margin) +
                "; one gain meets one requirement: ask for one of them, or tune another gain, too");
        return best;
    }
    [[noreturn]] void refuse_speed(bool has_none) {
        const auto does = [&](double size) {
            const auto& its = tried(size);
            return its.is_stable && speed_of(its) > 0 && std::isfinite(speed_of(its));
        };
        Ends all;
        const auto see = [&](double size, bool is_open) {
            const double its = speed_of(tried(size));
            if (!(its >= all.low)) {
                all.low = its;
                all.begins_before = is_open;
            }
            if (!(its <= all.high)) {
                all.high = its;
                all.goes_on = is_open;
            }
        };
        for (std::size_t k = 0; k < row_.size(); ++k) {
            if (!does(row_[k])) continue;
            see(row_[k], is_search_end(k));
            for (const std::size_t other : {k - 1, k + 1})
                if (other < row_.size() && !does(row_[other])) see(border(row_[k], row_[other], does), false);
        }
        throw RunError(
            "a " + speed_text() + " at " + short_text(speed()) + " rad/s cannot be reached with " +
            loop_.name(0) + ": " +
            (has_none ? "no value " + values_text() + " has it" : "the closed loop would be unstable") +
            (std::isnan(all.low) ? "; tune other gains"
                                 : "; there are " + speed_text() + "s " + range_text(all, "rad/s")));
    }

    // ---- margins

    double phase_margin() const { return asked_.phase_margin.value_or(asked_.overshoot ? 0.0 : 60.0); }
    bool fits(double size) {
        const auto& its = tried(size);
        return its.is_stable && its.margins.phase >= phase_margin() &&
               (!asked_.overshoot || its.overshoot <= *asked_.overshoot) &&
               has_gain_margin(its.margins, asked_.gain_margin);
    }
    /// Is nothing to spare of what is asked for?
    bool is_just_met(double size) {
        const auto& its = tried(size);
        return its.margins.phase - phase_margin() < 1e-4 ||
               (asked_.overshoot && *asked_.overshoot - its.overshoot < 1e-4 * *asked_.overshoot) ||
               (asked_.gain_margin > 0 && gain_margin(its.margins) - asked_.gain_margin < 1e-4);
    }
    /// Loops that cross 1 are faster than those whose |L| stays below.
    static bool is_faster(const Margins& one, const Margins& other) {
        if (one.gain_crossover != other.gain_crossover) return one.gain_crossover > other.gain_crossover;
        return std::isfinite(one.bandwidth) && !(one.bandwidth <= other.bandwidth);
    }
    /// Where all is just met, or, where it has more than that all over its limits, the fastest loop.
    double by_margins() {
        const auto does = [&](double size) { return fits(size); };
        double best = NAN, within = NAN;
        const auto see = [&](double& fastest, double size) {
            if (std::isnan(fastest) || is_faster(tried(size).margins, tried(fastest).margins)) fastest = size;
        };
        for (std::size_t k = 0; k < row_.size(); ++k) {
            if (!fits(row_[k])) continue;
            see(within, row_[k]);
            for (const std::size_t other : {k - 1, k + 1}) {
                if (other >= row_.size() || fits(row_[other])) continue;
                const double size = border(row_[k], row_[other], does);
                see(is_just_met(size) ? best : within, size);
            }
        }
        if (!std::isnan(best)) return best;
        if (std::isnan(within)) refuse_margins();
        const auto at = static_cast<std::size_t>(std::find(row_.begin(), row_.end(), within) - row_.begin());
        if (is_search_end(at)) refuse_endless(at);
        return within;
    }

    /// That part of the way from what does to what does not at which it just does.
    template <class Does> double border(double inside, double outside, Does&& does) {
        while (std::abs(outside / inside - 1) > 1e-10) {
            const double middle = std::sqrt(inside * outside);
            (does(middle) ? inside : outside) = middle;
        }
        return inside;
    }
    /// Is it one where limits of the gain are not?
    bool is_search_end(std::size_t k) const {
        return (k == 0 && is_low_end_open_) || (k + 1 == row_.size() && is_high_end_open_);
    }
    std::string value_text(double size) const { return short_text(loop_.sign(0) * size); }
    std::string values_text() const {
        return "from " + value_text(row_.front()) + " to " + value_text(row_.back());
    }

    std::string asked_text() const {
        std::string text =
            asked_.overshoot ? "an overshoot of at most " + short_text(*asked_.overshoot) + " %" : "";
        const auto add = [&](const std::string& more) { text += (text.empty() ? "" : " and ") + more; };
        if (asked_.phase_margin || !asked_.overshoot)
            add("a phase margin of " + short_text(phase_margin()) + " degrees");
        if (asked_.gain_margin > 0) add("a gain margin of " + short_text(asked_.gain_margin) + " dB");
        return text;
    }
    [[noreturn]] void refuse_endless(std::size_t end) {
        if (!tried(row_[end]).crosses())
            throw RunError("every value of '" + loop_.name(0) + "' " + values_text() + " gives " +
                           asked_text() +
                           ", as |L| stays below 1, so that none is the fastest; ask for a bandwidth");
        const bool is_up = end > 0;
        std::size_t first = end;
        const auto does = [&](double size) { return tried(size).crosses() && fits(size); };
        const auto next = [&] { return is_up ? first - 1 : first + 1; };
        while (next() < row_.size() && does(row_[next()])) first = next();
        const std::size_t outside = next();
        const double from = outside < row_.size() ? border(row_[first], row_[outside], does) : row_[first];
        throw RunError("every value of '" + loop_.name(0) + "' from " + value_text(from) +
                       (is_up ? " up" : " down") + " gives " + asked_text() + ", at " +
                       short_text(tried(from).margins.gain_crossover) + " rad/s and faster, so that " +
                       "none is the fastest; ask for a crossover");
    }
    /// What can be had at most.
    [[noreturn]] void refuse_margins() {
        const std::string begin = "no value of '" + loop_.name(0) + "' gives " + asked_text();
        const std::string end = "; ask for less, or tune another gain, too";
        std::string can;
        const auto limit = [&](const char* what, const char* unit, bool is_asked, double wanted, auto&& of) {
            if (!is_asked || !can.empty()) return;
            const auto value = [&](double size) {
                const auto& its = tried(size);
                return its.is_stable ? of(its) : -INFINITY;
            };
            const auto best = static_cast<std::size_t>(
                std::max_element(row_.begin(), row_.end(),
                                 [&](double a, double b) { return value(a) < value(b); }) -
                row_.begin());
            double size = row_[best];
            if (!std::isfinite(value(size))) return;
            if (best > 0 && best + 1 < row_.size())
                if (const double inner =
                        find_least([&](double s) { return -value(s); }, row_[best - 1], row_[best + 1]);
                    value(inner) > value(size))
                    size = inner;
            if (value(size) < wanted)
                can = std::string(": the ") + what + " " + short_text(std::abs(value(size))) + " " + unit +
                      ", at " + short_text(tried(size).margins.gain_crossover) + " rad/s with " +
                      value_text(size);
        };
        limit("most is", "degrees", asked_.phase_margin || !asked_.overshoot, phase_margin(),
              [](const Tried& one) { return one.margins.phase; });
        limit("least overshoot is", "%", asked_.overshoot.has_value(), -asked_.overshoot.value_or(0),
              [](const Tried& one) { return -one.overshoot; });
        limit("greatest gain margin is", "dB", asked_.gain_margin > 0, asked_.gain_margin,
              [](const Tried& one) { return gain_margin(one.margins); });
        const bool is_any =
            std::any_of(row_.begin(), row_.end(), [&](double size) { return tried(size).is_stable; });
        if (can.empty())
            can = is_any ? ": each of it can be had, but not all at once"
                         : ": with all " + values_text() + " the closed loop is unstable";
        throw RunError(begin + can + end);
    }

    LoopByGains& loop_;
    const TuneOptions& asked_;
    bool is_low_end_open_ = false, is_high_end_open_ = false;
    std::vector<double> row_;
    std::map<double, Tried> tried_;
};

} // namespace

Gains search_one_gain(LoopByGains& loop) { return OneGain(loop)(); }

} // namespace bf::analysis

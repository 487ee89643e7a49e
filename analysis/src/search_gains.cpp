#include "loop_by_gains.hpp"
#include "root.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace bf::analysis {

namespace {

constexpr double enough = 1e-10; // of |L - what it is to be|

/// L and its slopes by the gains, as they are near some of them.
struct Family {
    Gains at;
    Reduced loop;
    std::vector<Reduced> moved = {};
    std::vector<double> by = {}; ///< how far the gains were moved
};

class SeveralGains {
  public:
    SeveralGains(LoopByGains& loop, double most_omega)
        : loop_(loop), asked_(loop.asked()), most_(most_omega) {}

    Gains operator()() {
        const double least = asked_.phase_margin.value_or(asked_.overshoot ? 20.0 : 60.0);
        if (asked_.overshoot) return by_overshoot(least);
        auto gains = at_speed(least, Effort::all);
        if (!loop_.is_good(gains)) refuse(least, gains);
        return gains;
    }

  private:
    /// Of a search for gains that act nonlinearly: from the last ones that were found, or from many.
    enum class Effort { one, all };

    double size_of(double gain) const {
        double largest = 0;
        for (const double g : loop_.first()) largest = std::max(largest, std::abs(g));
        return gain != 0 ? std::abs(gain) : largest > 0 ? 1e-3 * largest : 1e-3;
    }

    // ---- gains in which L is affine

    Family family(const Gains& at) {
        Family found{at, Reduced(loop_.loop(at), 0, 0)};
        for (std::size_t i = 0; i < at.size(); ++i) {
            const auto [low, high] = loop_.range(i);
            const double size = std::abs(at[i]);
            // To the side on which it is farther from its limits; by much, as what is affine has no curvature
            // and the gains that are found may be far greater.
            const double by = size != 0 ? 0.25 * size : 1e3 * size_of(0);
            double to = size + by;
            if (to > high) to = std::max(low, size - by);
            if (to == size) to = std::min(high, size + 0.5 * (high - low));
            Gains moved = at;
            moved[i] = loop_.sign(i) * to;
            found.by.push_back(moved[i] - at[i]);
            found.moved.emplace_back(loop_.loop(moved), 0, 0);
        }
        return found;
    }
    /// Slopes of L, and what it is with gains of 0.
    std::pair<std::vector<Complex>, Complex> affine(double omega) {
        if (!family_) family_.emplace(family(loop_.first()));
        Complex rest = family_->loop(omega);
        std::vector<Complex> slopes;
        for (std::size_t i = 0; i < loop_.count(); ++i) {
            slopes.push_back((family_->moved[i](omega) - family_->loop(omega)) / family_->by[i]);
            rest -= slopes[i] * family_->at[i];
        }
        return {slopes, rest};
    }
    /// Does L go on as it begins?
    bool is_affine(double omega) {
        if (!other_) {
            other_.emplace(Family{loop_.first(), Reduced(loop_.loop(loop_.first()), 0, 0)});
            for (std::size_t i = 0; i < other_->at.size(); ++i) {
                const auto [low, high] = loop_.range(i);
                const double size = 1.3 * (other_->at[i] != 0 ? std::abs(other_->at[i]) : size_of(0));
                other_->at[i] = loop_.sign(i) * (size <= high ? size : std::max(low, size / 1.69));
            }
            other_->loop = Reduced(loop_.loop(other_->at), 0, 0);
        }
        const auto [slopes, rest] = affine(omega);
        Complex L = rest;
        double size = std::abs(rest);
        for (std::size_t i = 0; i < slopes.size(); ++i) {
            L += slopes[i] * other_->at[i];
            size += std::abs(slopes[i] * other_->at[i]);
        }
        return std::abs(L - other_->loop(omega)) < 1e-8 * size;
    }

    /// Gains with which the affine L(jω) has the value; empty: none.
    Gains solve(double omega, const Complex& value) {
        const auto [s, a] = affine(omega);
        const auto count = static_cast<Eigen::Index>(s.size());
        Eigen::MatrixXd M(2, count);
        for (Eigen::Index i = 0; i < count; ++i)
            M.col(i) << s[static_cast<std::size_t>(i)].real(), s[static_cast<std::size_t>(i)].imag();
        const Eigen::Vector2d right((value - a).real(), (value - a).imag());
        // Of columns of like size: gains are of unlike ones.
        const Vector scale = M.colwise().norm().transpose();
        if (!(scale.minCoeff() > 0)) return {};
        const Eigen::FullPivLU<Eigen::MatrixXd> lu(M * scale.cwiseInverse().asDiagonal());
        if (lu.rank() < 2) return {};
        const Vector one = scale.cwiseInverse().asDiagonal() * Vector(lu.solve(right));
        if (count == 2) return {one[0], one[1]};
        const Vector along = scale.cwiseInverse().asDiagonal() * Vector(lu.kernel().col(0));
        // P² = 4 I D along the line: A t² + 2 B t + C = 0. Of both that one of which the gains have their
        // signs, and of which I acts most.
        const double A = along[0] * along[0] - 4 * along[1] * along[2],
                     B = one[0] * along[0] - 2 * (one[1] * along[2] + one[2] * along[1]),
                     C = one[0] * one[0] - 4 * one[1] * one[2];
        const double inside = B * B - A * C;
        if (!(inside >= 0) || A == 0) return {};
        Gains best;
        for (const double sign : {1.0, -1.0}) {
            const double t = (-B + sign * std::sqrt(inside)) / A;
            Gains gains{one[0] + t * along[0], one[1] + t * along[1], one[2] + t * along[2]};
            if (best.empty() || (loop_.allows(gains) && !loop_.allows(best)) ||
                (loop_.allows(gains) && std::abs(gains[1]) > std::abs(best[1])))
                best = std::move(gains);
        }
        return best;
    }

    // ---- gains in which it is not

    /// log L - log of what it is to be, as real and imaginary part, of three gains also P² = 4 I D; by the
    /// logarithms of their sizes. Infinite where there is no such loop.
    Vector misses(const Vector& logs, double omega, const Complex& value) {
        const auto n = static_cast<Eigen::Index>(loop_.count());
        Vector r = Vector::Constant(n, INFINITY);
        try {
            const Complex ratio = loop_.at(gains_of(logs), omega) / value;
            const Complex log = std::log(ratio);
            if (!std::isfinite(log.real()) || !std::isfinite(log.imag())) return r;
            r.head(2) << log.real(), log.imag();
            if (n == 3) r[2] = 2 * logs[0] - logs[1] - logs[2] - std::log(4.0);
        } catch (const Interrupted&) {
            throw;
        } catch (const RunError&) { // limits of what follows from it, or a loop without delay
        }
        return r;
    }
    Gains gains_of(const Vector& logs) const {
        Gains gains;
        for (std::size_t i = 0; i < loop_.count(); ++i) {
            const auto [low, high] = loop_.range(i);
            gains.push_back(loop_.sign(i) *
                            std::clamp(std::exp(logs[static_cast<Eigen::Index>(i)]), low, high));
        }
        return gains;
    }
    /// By damped steps on the loop as it is linearised on the way, within the limits. Source: Marquardt, SIAM
    /// Journal on Applied Mathematics 11 (1963). Returns the largest miss that is left.
    double approach(Gains& gains, double omega, const Complex& value) {
        constexpr int most_steps = 60, most_tries = 12, most_idle = 3;
        constexpr double probe = 1e-6, longest = 1.5; // in logarithms
        const auto n = static_cast<Eigen::Index>(loop_.count());
        Vector at(n), low(n), high(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto k = static_cast<std::size_t>(i);
            low[i] = std::log(std::max(loop_.range(k).first, 1e-12 * size_of(gains[k])));
            high[i] = std::log(loop_.range(k).second);
            at[i] = std::clamp(std::log(size_of(gains[k])), low[i], high[i]);
        }
        Vector r = misses(at, omega, value);
        double damping = 1e-3;
        int idle = 0; // steps with hardly any progress
        bool goes_on = r.allFinite();
        for (int step = 0; goes_on && step < most_steps && r.lpNorm<Eigen::Infinity>() > 0.1 * enough;
             ++step) {
            Matrix J(n, n);
            for (Eigen::Index i = 0; i < n; ++i) {
                Vector moved = at;
                moved[i] += at[i] + probe <= high[i] ? probe : -probe;
                Vector change = misses(moved, omega, value) - r;
                // Of log(L moved / L), also where the phase of one lies beyond half a turn.
                change[1] = std::remainder(change[1], 2 * std::numbers::pi);
                J.col(i) = change / (moved[i] - at[i]);
            }
            if (!J.allFinite()) break;
            Vector down = -J.transpose() * r;
            // A gain at its limit does not go beyond it.
            for (Eigen::Index i = 0; i < n; ++i)
                if ((at[i] >= high[i] && down[i] > 0) || (at[i] <= low[i] && down[i] < 0)) {
                    J.col(i).setZero();
                    down[i] = 0;
                }
            goes_on = false;
            bool is_better = false;
            for (int k = 0; k < most_tries && !is_better; ++k, damping *= 8) {
                Matrix H = J.transpose() * J;
                H.diagonal() += damping * H.diagonal() + Vector::Constant(n, 1e-300);
                Vector to = at + H.ldlt().solve(down).cwiseMax(-longest).cwiseMin(longest);
                to = to.cwiseMax(low).cwiseMin(high);
                const Vector there = misses(to, omega, value);
                if (!(there.norm() < r.norm())) continue;
                idle = there.norm() > 0.95 * r.norm() ? idle + 1 : 0;
                at = to;
                r = there;
                is_better = true;
                goes_on = idle < most_idle;
                damping = std::max(damping / 64, 1e-14);
            }
        }
        gains = gains_of(at);
        return r.lpNorm<Eigen::Infinity>();
    }
    Gains search(double omega, const Complex& value, Effort effort, const Gains& of_affine) {
        std::vector<Gains> starts;
        if (!last_.empty()) starts.push_back(last_);
        starts.push_back(loop_.first());
        if (effort == Effort::all) {
            if (loop_.allows(of_affine)) starts.push_back(of_affine);
            for (std::size_t i = 0; i < loop_.count(); ++i)
                for (const double factor : {0.125, 8.0}) {
                    Gains start = loop_.first();
                    start[i] = loop_.sign(i) * std::clamp(factor * size_of(start[i]), loop_.range(i).first,
                                                          loop_.range(i).second);
                    starts.push_back(std::move(start));
                }
        }
        Gains unstable, nearest;
        double least = INFINITY;
        for (auto& start : starts) {
            const double miss = approach(start, omega, value);
            if (miss < 1e-8) {
                if (loop_.is_good(start)) return last_ = start;
                if (unstable.empty()) unstable = start;
            } else if (miss < least) {
                least = miss;
                nearest = start;
            }
        }
        if (unstable.empty() && !nearest.empty() && effort == Effort::all) tell_nearest(nearest, omega);
        return unstable;
    }
    void tell_nearest(const Gains& gains, double omega) {
        const Complex L = loop_.at(gains, omega);
        nearest_ = "no gains that were found have it; the nearest are " + loop_.text(gains) +
                   " with a gain of " + short_text(std::abs(L)) + " and a phase margin of " +
                   short_text(std::arg(-L) * 180 / std::numbers::pi) + " degrees there";
        for (std::size_t i = 0; i < gains.size(); ++i)
            for (const double limit : {loop_.range(i).first, loop_.range(i).second})
                if (limit > 0 && std::abs(std::abs(gains[i]) - limit) < 1e-9 * limit)
                    nearest_ +=
                        "; '" + loop_.name(i) + "' is at its limit, " + short_text(loop_.sign(i) * limit);
    }

    /// Gains that cross 1 there with that phase margin, also such that are out of the question, which says
    /// why; empty: there are none.
    Gains attempt(double omega, double phase_margin, Effort effort) {
        last_omega_ = omega;
        nearest_.clear();
        const Complex value = std::polar(1.0, (phase_margin - 180) * std::numbers::pi / 180);
        const auto gains = solve(omega, value);
        if (!loop_.allows(gains)) return is_affine(omega) ? gains : search(omega, value, effort, gains);
        const Complex L = loop_.at(gains, omega);
        if (L == 0.0) loop_.refuse_nothing(gains);
        return std::abs(L - value) < enough ? gains : search(omega, value, effort, gains);
    }

    /// The same with a crossover that gives the bandwidth, if that is what is asked for.
    Gains at_speed(double phase_margin, Effort effort) {
        if (asked_.crossover > 0) return attempt(asked_.crossover, phase_margin, effort);
        const auto bandwidth_at = [&](double omega) {
            const auto gains = attempt(omega, phase_margin, effort);
            return loop_.is_good(gains) ? margins(loop_.loop(gains)).bandwidth : NAN;
        };
        double omega = std::min(asked_.bandwidth / 1.5, 0.9 * most_);
        double omega_before = 0, bandwidth_before = 0;
        for (int i = 0; i < 30; ++i) {
            const double bandwidth = bandwidth_at(omega);
            if (std::abs(bandwidth - asked_.bandwidth) < 1e-9 * asked_.bandwidth)
                return attempt(omega, phase_margin, effort);
            if (!std::isfinite(bandwidth)) break;
            // By secants of logarithms: the bandwidth grows about as a power of the crossover.
            double power =
                i == 0 ? 1 : std::log(bandwidth / bandwidth_before) / std::log(omega / omega_before);
            power = power > 0.3 && power < 3 ? power : 1; // not NaN
            omega_before = omega;
            bandwidth_before = bandwidth;
            const double factor = std::pow(asked_.bandwidth / bandwidth, 1 / power);
            omega = std::min(omega * std::clamp(factor, 0.2, 5.0), 0.999 * most_);
        }
        if (effort == Effort::one) return {};
        // It need not, and there may be no gains in between: all crossovers around are looked at, from the
        // fastest one on.
        const auto miss = [&](double w) { return std::log(bandwidth_at(w) / asked_.bandwidth); };
        double last = NAN, last_miss = NAN, best = NAN, least = INFINITY;
        for (int i = 20; i >= -30; --i) {
            const double w = asked_.bandwidth * std::pow(10, i / 20.0);
            if (w >= most_) continue;
            const double now = miss(w);
            if ((now > 0) != (last_miss > 0) && std::isfinite(now) && std::isfinite(last_miss))
                if (const double root = find_root(miss, w, last); std::abs(miss(root)) < 1e-8)
                    return attempt(root, phase_margin, effort);
            if (std::abs(now) < std::abs(least)) {
                least = now;
                best = w;
            }
            last = w;
            last_miss = now;
        }
        const auto gains = attempt(std::isnan(best) ? asked_.bandwidth / 1.5 : best, phase_margin, effort);
        if (std::isnan(best)) return gains;
        nearest_ = "the nearest that was found is one of " + short_text(asked_.bandwidth * std::exp(least)) +
                   " rad/s, with a crossover at " + short_text(best) + " rad/s";
        return {};
    }

    // ---- requirements

    /// The least phase margin that does.
    Gains by_overshoot(double least) {
        constexpr double step = 2.5, fine = 1e-3;
        struct Tried {
            double margin;
            Gains gains;
            double overshoot = INFINITY; ///< infinite: out of the question
        };
        const auto attempted = [&](double margin, Effort effort) {
            Tried its{margin, at_speed(margin, effort)};
            if (loop_.is_good(its.gains)) its.overshoot = loop_.overshoot(its.gains);
            return its;
        };
        const auto is_good = [](const Tried& its) { return std::isfinite(its.overshoot); };
        const auto does = [&](const Tried& its) { return its.overshoot <= *asked_.overshoot; };
        const auto border = [&](Tried outside, Tried inside, auto&& holds) {
            while (std::abs(inside.margin - outside.margin) > fine) {
                auto middle = attempted(0.5 * (outside.margin + inside.margin), Effort::one);
                (holds(middle) ? inside : outside) = std::move(middle);
            }
            return inside;
        };
        Tried smallest{least, {}};
        std::optional<Tried> first, before;
        for (double margin = least; margin < 180; margin += step) {
            auto now = attempted(margin, first ? Effort::one : Effort::all);
            if (!first) first = now;
            if (asked_.phase_margin && margin == least && !is_good(now)) refuse(least, now.gains);
            if (does(now)) return before && is_good(*before) ? border(*before, now, does).gains : now.gains;
            if (before && is_good(*before) && !is_good(now)) {
                // The last that can be had may do.
                const auto last = border(now, *before, is_good);
                if (does(last)) return border(*before, last, does).gains;
                if (last.overshoot < smallest.overshoot) smallest = last;
                break;
            }
            if (now.overshoot < smallest.overshoot) smallest = now;
            before = std::move(now);
        }
        if (!is_good(smallest)) refuse(least, first->gains);
        throw RunError("an overshoot of at most " + short_text(*asked_.overshoot) +
                       " % cannot be reached at " + (asked_.crossover > 0 ? "" : "a bandwidth of ") +
                       short_text(asked_.crossover + asked_.bandwidth) + " rad/s: the least one is " +
                       short_text(smallest.overshoot) + " %, with a phase margin of " +
                       short_text(smallest.margin) + " degrees; ask for another speed, or tune more gains");
    }

    [[noreturn]] void refuse(double phase_margin, const Gains& gains) {
        const double omega = last_omega_;
        std::string why = nearest_;
        if (why.empty() && gains.empty()) why = "no gains have it";
        if (why.empty()) why = loop_.why_not(gains);
        if (why.empty()) why = "the closed loop would be unstable";
        const std::string asked =
            (asked_.crossover > 0
                 ? "a phase margin of " + short_text(phase_margin) + " degrees at " +
                       short_text(asked_.crossover) + " rad/s"
                 : "a bandwidth of " + short_text(asked_.bandwidth) + " rad/s with a phase margin of " +
                       short_text(phase_margin) + " degrees") +
            " cannot be reached with " + loop_.names() + ": " + why;
        const auto holds = [&](double w, double margin) {
            return loop_.is_good(attempt(w, margin, Effort::one));
        };
        // Steps cost more than a solution does.
        const int every = is_affine(omega) ? 1 : 3;
        std::vector<double> margins, omegas;
        for (double m = 2; m < 180; m += 4 * every) margins.push_back(m);
        for (int i = -30; i <= 10; i += every)
            if (const double w = omega * std::pow(10, i / 10.0); w < most_) omegas.push_back(w);
        std::string can;
        auto all = ends(margins, [&](double m) { return holds(omega, m); });
        if (!std::isnan(all.low))
            can +=
                "; at " + short_text(omega) + " rad/s there are phase margins " + range_text(all, "degrees");
        all = ends(omegas, [&](double w) { return holds(w, phase_margin); });
        if (!std::isnan(all.low))
            can += "; with this phase margin there are crossovers " + range_text(all, "rad/s");
        throw RunError(asked + (can.empty() ? "; tune other gains" : can));
    }

    LoopByGains& loop_;
    const TuneOptions& asked_;
    double most_; ///< rad/s
    std::optional<Family> family_, other_;
    Gains last_; ///< that were found by steps
    std::string nearest_;
    double last_omega_ = 0;
};

} // namespace

Gains search_gains(LoopByGains& loop, double most_omega) { return SeveralGains(loop, most_omega)(); }

} // namespace bf::analysis

#include "solvers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace bf {

namespace {

/// The pair 5(4) of Dormand and Prince with step control by a PI controller and dense output of order 4.
/// Source of all coefficients: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed.,
/// tables II.5.2 and formulas II.4 (starting step), II.6.12 (dense output), IV.2.43a of volume II
/// (controller).
class DormandPrince final : public Solver {
  public:
    DormandPrince(const SolverSettings& settings, ContinuousSystem system)
        : Solver(std::move(system)), settings_(settings), x_(system_.x.size()), rest_(x_), trial_(x_),
          trial_rest_(x_), at_begin_(system_.guards.size()), before_(at_begin_), after_(at_begin_),
          middle_(at_begin_) {
        for (auto& k : slopes_) k.resize(x_.size());
        for (auto& c : dense_) c.resize(x_.size());
    }

    void restart(double t) override {
        begin_ = end_ = t;
        is_started_ = has_crossed_ = false;
    }

    Outcome advance(double& t, double end) override {
        if (!is_started_ && !start(t, end)) return Outcome::failed;
        for (int steps = 0;;) {
            if (has_crossed_ && end_ <= end) {
                t = end_;
                std::copy(x_.begin(), x_.end(), system_.x.begin());
                is_started_ = false; // an event changes the state, or the equations
                has_crossed_ = false;
                is_behind_crossing_ = true;
                step_ = std::max(step_, std::exchange(step_before_crossing_, 0));
                return Outcome::crossed;
            }
            if (end_ >= end) {
                interpolate(end);
                t = end;
                return Outcome::reached;
            }
            if (!step(end)) return failed(t);
            if (++steps == most_steps) {
                failure_ = too_many_steps(SolverMethod::dormand_prince45);
                return failed(t);
            }
        }
    }

    std::vector<double> history() const override {
        std::vector<double> all;
        visit(*this, [&](const auto& value) { all.push_back(static_cast<double>(value)); });
        return all;
    }

    void set_history(double t, std::span<const double> all) override {
        restart(t);
        step_ = step_before_crossing_ = 0;
        is_behind_crossing_ = false;
        if (all.empty()) return;
        const double* from = all.data();
        visit(*this, [&](auto& value) { value = static_cast<std::decay_t<decltype(value)>>(*from++); });
    }

  private:
    static constexpr double epsilon = std::numeric_limits<double>::epsilon();

    /// All that one step leaves to the next.
    template <class Self, class F> static void visit(Self& self, F&& f) {
        f(self.begin_), f(self.end_), f(self.length_), f(self.step_), f(self.step_before_crossing_);
        f(self.last_error_), f(self.is_started_), f(self.has_crossed_), f(self.is_behind_crossing_);
        const auto each = [&](auto& values) {
            for (auto& value : values) f(value);
        };
        each(self.x_), each(self.rest_), each(self.trial_rest_), each(self.slopes_[0]);
        for (auto& c : self.dense_) each(c);
        each(self.before_), each(self.crossings_);
    }

    double scale(double a, double b) const {
        return settings_.absolute_tolerance +
               settings_.relative_tolerance * std::max(std::abs(a), std::abs(b));
    }
    /// Root mean square of the elements over their scale.
    template <class F> double norm(F&& element) const {
        double sum = 0;
        for (std::size_t i = 0; i < x_.size(); ++i) sum += element(i) * element(i);
        return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(x_.size(), 1)));
    }

    bool slope(double t, const std::vector<double>& x, std::vector<double>& k) {
        std::copy(x.begin(), x.end(), system_.x.begin());
        if (!system_.derivatives(t)) return false;
        std::copy(system_.rate.begin(), system_.rate.end(), k.begin());
        return true;
    }

    bool start(double t, double end) {
        begin_ = end_ = t;
        std::copy(system_.x.begin(), system_.x.end(), x_.begin());
        std::fill(rest_.begin(), rest_.end(), 0.0);
        if (!slope(t, x_, slopes_[0])) return false;
        if (!system_.evaluate_guards(t, true)) return false;
        std::copy(system_.guards.begin(), system_.guards.end(), before_.begin());
        is_started_ = true;
        last_error_ = 1e-4;
        return step_ > 0 || starting_step(t, end);
    }

    bool starting_step(double t, double end) {
        const auto& k = slopes_[0];
        const double d0 = norm([&](std::size_t i) { return x_[i] / scale(x_[i], 0); });
        const double d1 = norm([&](std::size_t i) { return k[i] / scale(x_[i], 0); });
        const double h0 = std::min(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, end - t);
        for (std::size_t i = 0; i < x_.size(); ++i) trial_[i] = x_[i] + h0 * k[i];
        if (!slope(t + h0, trial_, slopes_[1])) return false;
        const double d2 = norm([&](std::size_t i) { return (slopes_[1][i] - k[i]) / scale(x_[i], 0); }) / h0;
        const double largest = std::max(d1, d2);
        const double h1 = largest <= 1e-15 ? std::max(1e-6, h0 * 1e-3) : std::pow(0.01 / largest, 0.2);
        step_ = std::min(100 * h0, h1);
        if (!(step_ > 0)) step_ = 1e-6;
        return true;
    }

    /// One accepted step from end_, watched for crossings.
    bool step(double end) {
        static constexpr std::array<std::array<double, 6>, 7> a{
            {{},
             {1. / 5},
             {3. / 40, 9. / 40},
             {44. / 45, -56. / 15, 32. / 9},
             {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
             {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
             {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}}};
        static constexpr std::array<double, 7> c{0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1, 1};
        static constexpr std::array<double, 7> e{71. / 57600,      0,         -71. / 16695, 71. / 1920,
                                                 -17253. / 339200, 22. / 525, -1. / 40};
        const double t = end_;
        bool was_rejected = false;
        while (true) {
            double h = std::min(step_, settings_.max_step);
            const bool is_cut = system_.has_samples && t + h >= end - 0.01 * h;
            if (is_cut) h = end - t;
            if (h < 16 * epsilon * std::max(std::abs(t), 1e-300) && !is_cut) return give_up();
            for (std::size_t s = 1; s < 7; ++s) {
                for (std::size_t i = 0; i < x_.size(); ++i) {
                    double sum = 0;
                    for (std::size_t j = 0; j < s; ++j) sum += a[s][j] * slopes_[j][i];
                    const double change = h * sum + rest_[i];
                    trial_[i] = x_[i] + change;
                    if (s == 6) trial_rest_[i] = std::isfinite(trial_[i]) ? change - (trial_[i] - x_[i]) : 0;
                }
                if (!slope(t + c[s] * h, trial_, slopes_[s])) return false;
            }
            const auto error_of = [&](std::size_t i) {
                double sum = 0;
                for (std::size_t s = 0; s < 7; ++s) sum += e[s] * slopes_[s][i];
                return h * sum / scale(x_[i], trial_[i]);
            };
            const double error = norm(error_of);
            const double factor = std::pow(error, 0.17) / std::pow(last_error_, 0.04) / 0.9;
            if (error <= 1) {
                double next = h / std::clamp(factor, 0.1, 5.0);
                if (was_rejected) next = std::min(next, h);
                step_ = is_cut ? std::max(step_, next) : next;
                last_error_ = std::max(error, 1e-4);
                begin_ = t;
                end_ = is_cut ? end : t + h;
                densify(h);
                x_.swap(trial_);
                rest_.swap(trial_rest_);
                slopes_[0].swap(slopes_[6]);
                return watch(end);
            }
            worst_state_ = 0; // what to name if no step is small enough
            for (std::size_t i = 1; i < x_.size(); ++i)
                if (!(std::abs(error_of(i)) <= std::abs(error_of(static_cast<std::size_t>(worst_state_)))))
                    worst_state_ = static_cast<int>(i);
            step_ = std::isfinite(error) ? h / std::min(5.0, std::pow(error, 0.2) / 0.9) : h / 10;
            was_rejected = true;
            if (is_cut && step_ < 16 * epsilon * std::abs(t)) return give_up();
        }
    }

    Outcome failed(double& t) {
        t = end_;
        std::copy(x_.begin(), x_.end(), system_.x.begin());
        return Outcome::failed;
    }

    bool give_up() {
        failure_ =
            Status::failure("no step is small enough for the tolerances: look for a state that grows without "
                            "bound or a jump without a zero crossing, or use larger tolerances");
        return false;
    }

    /// Coefficients of the interpolation over the step just accepted, before x_ and the slopes move on.
    void densify(double h) {
        static constexpr std::array<double, 7> d{-12715105075. / 11282082432,  0,
                                                 87487479700. / 32700410799,   -10690763975. / 1880347072,
                                                 701980252875. / 199316789632, -1453857185. / 822651844,
                                                 69997945. / 29380423};
        length_ = h;
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const double difference = trial_[i] - x_[i] + (trial_rest_[i] - rest_[i]);
            const double bend = h * slopes_[0][i] - difference;
            double sum = 0;
            for (std::size_t s = 0; s < 7; ++s) sum += d[s] * slopes_[s][i];
            dense_[0][i] = x_[i];
            dense_[1][i] = difference;
            dense_[2][i] = bend;
            dense_[3][i] = difference - h * slopes_[6][i] - bend;
            dense_[4][i] = h * sum;
        }
    }

    /// The state at a time of the last step, in the system's memory.
    void interpolate(double t) {
        if (t == end_) {
            std::copy(x_.begin(), x_.end(), system_.x.begin());
            return;
        }
        const double s = (t - begin_) / length_, r = 1 - s;
        for (std::size_t i = 0; i < x_.size(); ++i)
            system_.x[i] = dense_[0][i] +
                           (trial_rest_[i] +
                            s * (dense_[1][i] + r * (dense_[2][i] + s * (dense_[3][i] + r * dense_[4][i]))));
    }

    /// Looks for the first crossing in the last step, and ends the step there.
    bool watch(double end) {
        if (before_.empty()) return true;
        if (!system_.evaluate_guards(end_, true)) return false;
        std::copy(system_.guards.begin(), system_.guards.end(), after_.begin());
        at_begin_ = before_;
        double low = begin_, high = end_;
        const bool is_behind = std::exchange(is_behind_crossing_, false);
        if (is_behind || std::find(before_.begin(), before_.end(), 0.0) != before_.end()) {
            // What begins at zero, or just behind it, may leave it and come back within the step: the less it
            // moves, the later it can be told from zero.
            double ahead = std::max(64 * epsilon * std::abs(low), 1e-8 * (std::min(high, end) - low));
            do {
                const double left_zero = begin_ + ahead;
                interpolate(left_zero);
                if (!system_.evaluate_guards(left_zero, false)) return false;
                std::copy(system_.guards.begin(), system_.guards.end(), middle_.begin());
                for (std::size_t i = 0; i < before_.size(); ++i)
                    if (before_[i] == 0) before_[i] = middle_[i];
                if (has_crossing(middle_)) {
                    high = left_zero;
                    after_.swap(middle_);
                    break;
                }
                low = left_zero;
                ahead *= 10;
            } while (is_behind && ahead < end_ - begin_);
        }
        if (!has_crossing(after_)) {
            before_ = after_;
            return true;
        }
        const double tolerance = 8 * epsilon * std::max(std::abs(low), std::abs(high));
        std::vector<double>& left = before_;
        // Illinois: a side that stays twice counts half, so that the secant moves off it. Where one value is
        // larger than the other by many orders, that takes hundreds of secants, so that every fourth halves.
        double left_weight = 1, right_weight = 1;
        bool was_left = false, was_right = false;
        for (int tries = 1; high - low > tolerance; ++tries) {
            double at = high;
            for (std::size_t i = 0; i < left.size(); ++i)
                if (crossing(left[i], after_[i])) {
                    const double l = left_weight * left[i], r = right_weight * after_[i];
                    // No secant meets an infinite value.
                    at = std::min(at, low + (high - low) * (std::isfinite(l - r) ? l / (l - r) : 0.5));
                }
            if (tries % 4 == 0) at = 0.5 * (low + high);
            at = std::clamp(at, low + 0.5 * tolerance, high - 0.5 * tolerance);
            if (at <= low || at >= high) at = 0.5 * (low + high);
            if (at <= low || at >= high) break;
            interpolate(at);
            if (!system_.evaluate_guards(at, false)) return false;
            std::copy(system_.guards.begin(), system_.guards.end(), middle_.begin());
            if (has_crossing(middle_)) {
                high = at;
                after_.swap(middle_);
                left_weight = was_right ? left_weight / 2 : 1, right_weight = 1;
                was_right = true, was_left = false;
            } else {
                low = at;
                left.swap(middle_);
                right_weight = was_left ? right_weight / 2 : 1, left_weight = 1;
                was_left = true, was_right = false;
            }
        }
        // Interpolation from behind the crossing knows nothing of what lies before it.
        const bool is_before_all_stages = high - begin_ < 0.2 * length_;
        const double shortest = 1e3 * std::max(tolerance, 8 * epsilon * (end - begin_));
        if ((jumps() || is_before_all_stages) && high - begin_ > shortest) {
            is_behind_crossing_ = is_behind;
            return approach(high);
        }
        interpolate(high);
        std::copy(system_.x.begin(), system_.x.end(), x_.begin());
        end_ = high;
        for (std::size_t i = 0; i < left.size(); ++i) crossings_[i] = crossing(left[i], after_[i]);
        has_crossed_ = true;
        return true;
    }

    /// Did the slope change within the last step by more than the tolerance allows for? A crossing at which
    /// it jumps, or has a corner, spoils the interpolation of the step that contains it.
    bool jumps() const {
        const auto& at_begin = slopes_[6];
        return std::any_of(slopes_.begin(), slopes_.begin() + 6, [&](const auto& slope) {
            return norm([&](std::size_t i) {
                       return length_ * (slope[i] - at_begin[i]) / scale(x_[i], dense_[0][i]);
                   }) > 1;
        });
    }

    /// Takes the last step back, to go most of the way to a crossing in a step that does not contain it.
    bool approach(double crossing) {
        step_before_crossing_ = std::max(step_before_crossing_, step_);
        std::copy(dense_[0].begin(), dense_[0].end(), x_.begin());
        rest_.swap(trial_rest_);
        slopes_[0].swap(slopes_[6]);
        before_ = at_begin_;
        end_ = begin_;
        step_ = 0.9 * (crossing - begin_);
        return true;
    }

    bool has_crossing(const std::vector<double>& now) const {
        for (std::size_t i = 0; i < now.size(); ++i)
            if (crossing(before_[i], now[i])) return true;
        return false;
    }

    const SolverSettings settings_;
    double begin_ = 0, end_ = 0;      ///< the last step; the state is known up to its end
    double length_ = 1;               ///< of the last step before a crossing ended it
    double step_ = 0;                 ///< to try next
    double step_before_crossing_ = 0; ///< not 0: while a crossing is approached
    double last_error_ = 1e-4;
    bool is_started_ = false, has_crossed_ = false;
    bool is_behind_crossing_ = false; ///< until the first step from there on
    /// What rounding takes from x_ is added in the next step: however short, steps move it in the end.
    std::vector<double> x_, rest_;
    std::vector<double> trial_, trial_rest_; ///< after the step: what they were at its begin
    std::array<std::vector<double>, 7> slopes_;
    std::array<std::vector<double>, 5> dense_;
    std::vector<double> at_begin_, before_, after_, middle_; ///< guards
};

} // namespace

std::unique_ptr<Solver> make_dormand_prince(const SolverSettings& settings, ContinuousSystem system) {
    return std::make_unique<DormandPrince>(settings, std::move(system));
}

} // namespace bf
